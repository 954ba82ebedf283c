//! A scene: an object with its materials in place, what holds it, and what is done to it; read from `SCENE.toml` and
//! checked. Each press (a known force over a patch) and each move (a prescribed displacement) is a load case of its own
//! and starts from rest. [`super::stage`] simulates it.

use super::equilibrium::Options;
use super::example::{Contact, Example, MeasuredPoint};
use super::example_text::check_forces;
use super::regions::{RegionText, read_cells};
use super::rig::Layout;
pub use super::scene_materials::SceneMaterial;
use super::scene_materials::Shelf;
use super::scene_text::{OutputText, PressText, SceneText, SolverText};
use super::setup::{FixedText, Object, Setup, finite, positive_length};
use crate::geometry::solid::Solid;
use crate::math::Vec3;
use crate::units::document::{Document, Mistake};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// The version of `SCENE.toml` that this program reads.
pub const SCHEMA: u32 = 1;
/// More points around one press than this are refused; the candidates are 500.
const MOST_SURFACE_POINTS: usize = 400;

/// A checked scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The object's name.
    pub name: String,
    /// The object, what holds it, its cells; its examples are the presses, with the points to report and no target.
    pub setup: Setup,
    /// Where each press stands in the file.
    pub press_spans: Vec<Range<usize>>,
    /// The materials, in the order in which the regions name them.
    pub materials: Vec<SceneMaterial>,
    /// For each cell, its material.
    pub layout: Layout,
    /// The prescribed displacements.
    pub moves: Vec<Move>,
    /// Points to report in every case \[mm\].
    pub points: Vec<Vec3>,
    /// Nodes to report in every case.
    pub nodes: Vec<Spanned<usize>>,
    /// How to solve.
    pub options: Options,
    /// Load steps from one level to the next.
    pub steps: usize,
}

/// A prescribed displacement.
#[derive(Clone, Debug)]
pub struct Move {
    /// Its name.
    pub name: String,
    /// Where it stands in the file.
    pub span: Range<usize>,
    /// The nodes that move.
    pub place: FixedText,
    /// Their displacement at the end \[mm\]; `None` where a component stays free.
    pub displacement: [Option<f64>; 3],
    /// In how many equal steps it is reported.
    pub steps: usize,
}

/// Why there is no scene.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {reason}; name a scene (a .toml file), or the layout.toml of a found design", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// Something in the file is wrong.
    #[error(transparent)]
    Mistake(#[from] Mistake),
}

impl Scene {
    /// Reads a scene; materials that it does not define itself come from the database in the folder `database`.
    ///
    /// # Errors
    /// [`SceneError`] names the file, the line, what was found and what was expected.
    pub fn read(file: &Path, database: &Path) -> Result<Scene, SceneError> {
        let text = std::fs::read_to_string(file).map_err(|e| SceneError::Read {
            file: file.to_path_buf(),
            reason: e.to_string(),
        })?;
        let file = file.to_path_buf();
        Ok(Scene::check(Document { file, text }, database)?)
    }

    fn check(document: Document, database: &Path) -> Result<Scene, Mistake> {
        let text: SceneText = document.parse()?;
        if *text.schema.get_ref() != SCHEMA {
            let message = format!("found schema {}, expected {SCHEMA}", text.schema.get_ref());
            return Err(document.mistake(&text.schema.span(), message));
        }
        check_cases(&document, &text)?;
        let (options, steps) = solver(&document, &text.solver)?;
        let object = text.object.read(&document)?;
        let mut shelf = Shelf::new(&document, &text.material, database)?;
        let mut regions: Vec<RegionText> = Vec::new();
        let mut layout = Layout::new();
        for region in text.region.get_ref() {
            let layers = region.layers(&document)?;
            regions.push(region.as_region(layers.len()));
            for id in &layers {
                layout.push(shelf.take(id)?);
            }
        }
        let regions = Spanned::new(text.region.span(), regions);
        let cells = read_cells(&document, &regions, None, &object)?;
        let element_size_mm = text.object.element_size_mm(&document, &object)?;
        let points = points(&document, &text.output, &object)?;
        let examples = text
            .press
            .iter()
            .map(|press| example(&document, press, &text.output, &points, &object))
            .collect::<Result<_, _>>()?;
        let moves = moves(&document, &text)?;
        let press_spans = text.press.iter().map(|p| p.point_mm.span()).collect();
        let materials = shelf.taken;
        let own_name = || {
            document
                .file
                .file_stem()
                .map(|n| n.to_string_lossy().into_owned())
        };
        Ok(Scene {
            name: text.name.clone().or_else(own_name).unwrap_or_default(),
            press_spans,
            materials,
            layout,
            moves,
            points,
            nodes: text.output.nodes,
            options,
            steps,
            setup: Setup {
                document,
                object,
                fixed: text.fixed,
                cells,
                element_size_mm,
                examples,
            },
        })
    }

    /// The file that it was read from.
    pub fn file(&self) -> &Path {
        &self.setup.document.file
    }
}

/// Something is held, something is done, and every case has a name that a file can bear.
fn check_cases(document: &Document, text: &SceneText) -> Result<(), Mistake> {
    if text.fixed.is_empty() {
        let message =
            "found no [[fixed]]: nothing holds the object, expected for instance [[fixed]] face = \"bottom\"";
        return Err(document.mistake(&(0..0), message));
    }
    let presses = text.press.iter().map(|p| &p.name);
    let names: Vec<&Spanned<String>> = presses.chain(text.moves.iter().map(|m| &m.name)).collect();
    if names.is_empty() {
        let message = "found neither [[press]] nor [[move]], expected at least one: nothing happens";
        return Err(document.mistake(&(0..0), message));
    }
    check_names(document, &names)
}

/// Every case has a name that a file can bear, of its own.
///
/// # Errors
/// [`Mistake`] at the name.
pub(super) fn check_names(document: &Document, names: &[&Spanned<String>]) -> Result<(), Mistake> {
    for (i, name) in names.iter().enumerate() {
        let plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
        let own = name.get_ref();
        if own.is_empty() || own.starts_with('.') || !own.chars().all(plain) {
            let message =
                format!("found name {own:?}, expected letters, digits, '-', '_': files are named by it");
            return Err(document.mistake(&name.span(), message));
        }
        // Some file systems take upper and lower case for the same.
        let same = |other: &&Spanned<String>| other.get_ref().to_lowercase() == own.to_lowercase();
        if names[..i].iter().any(same) {
            let message = format!("the name {own:?} stands twice, expected one name for each case");
            return Err(document.mistake(&name.span(), message));
        }
    }
    Ok(())
}

/// `[solver]`: the options, and the load steps from one level to the next.
///
/// # Errors
/// [`Mistake`] at the key.
pub(super) fn solver(document: &Document, text: &SolverText) -> Result<(Options, usize), Mistake> {
    let mut options = Options::default();
    if text.newton_only.unwrap_or(false) {
        options.accelerated_iterations = 0;
    }
    if let Some(tolerance) = &text.tolerance {
        options.tolerance = *tolerance.get_ref();
        options
            .check()
            .map_err(|e| document.mistake(&tolerance.span(), e.to_string()))?;
    }
    Ok((options, count(document, &text.steps, "steps", 1000)?))
}

/// A number from 1 to `most`; 1 if absent.
fn count(
    document: &Document,
    text: &Option<Spanned<usize>>,
    name: &str,
    most: usize,
) -> Result<usize, Mistake> {
    let Some(text) = text else { return Ok(1) };
    let found = *text.get_ref();
    if (1..=most).contains(&found) {
        return Ok(found);
    }
    Err(document.mistake(
        &text.span(),
        format!("found {name} = {found}, expected 1 to {most}"),
    ))
}

/// The points to report, each within 5 % of the object's diagonal.
fn points(document: &Document, text: &OutputText, object: &Object) -> Result<Vec<Vec3>, Mistake> {
    let (low, high) = object.solid.bounds();
    let mut points: Vec<Vec3> = Vec::new();
    for written in &text.points_mm {
        let point = finite(document, written)?;
        let off = object.solid.closest(&point).distance;
        if off > 0.05 * (high - low).norm() && !object.solid.contains(&point) {
            let message = format!(
                "the point {:?} lies {off:.1} mm off the object, which spans {:.1?} to {:.1?} mm",
                written.get_ref(),
                low.as_slice(),
                high.as_slice()
            );
            return Err(document.mistake(&written.span(), message));
        }
        if points.contains(&point) {
            let message = format!("the point {:?} stands twice", written.get_ref());
            return Err(document.mistake(&written.span(), message));
        }
        points.push(point);
    }
    Ok(points)
}

/// A press as an example without measurements: the contact point, the surface points around it, the points asked for.
fn example(
    document: &Document,
    text: &PressText,
    output: &OutputText,
    points: &[Vec3],
    object: &Object,
) -> Result<Example, Mistake> {
    let contact = text.contact().read(document)?;
    check_forces(document, &text.forces_n)?;
    let forces_n = text.forces_n.get_ref().clone();
    let mut places = vec![contact.point];
    if let Some(wanted) = &output.surface_points {
        let n = count(
            document,
            &Some(wanted.clone()),
            "surface_points",
            MOST_SURFACE_POINTS,
        )?;
        let radius_mm = match &output.surface_radius {
            Some(radius) => positive_length(document, radius)?,
            None => 3.0 * contact.radius_mm,
        };
        places.extend(surface_points(&contact, radius_mm, n, &object.solid));
    }
    for point in points {
        if !places.contains(point) {
            places.push(*point);
        }
    }
    let unmeasured = |place: Vec3| MeasuredPoint {
        place,
        directions: vec![Vec3::x(), Vec3::y(), Vec3::z()],
        displacements_mm: vec![vec![None; 3]; forces_n.len()],
    };
    Ok(Example {
        name: text.name.get_ref().clone(),
        contact,
        tolerances_mm: vec![vec![0.0; forces_n.len()]; places.len()],
        points: places.into_iter().map(unmeasured).collect(),
        forces_n,
        origin: "computed".into(),
    })
}

/// `n` points of the surface that the press can see within `radius_mm` of its axis, spread evenly: each is the one of
/// the candidates that is farthest from the contact and from the points before it (Gonzalez 1985).
///
/// Fewer if the object is so narrow that fewer candidates meet it.
pub fn surface_points(contact: &Contact, radius_mm: f64, n: usize, solid: &Solid) -> Vec<Vec3> {
    let wide = Contact {
        radius_mm,
        ..*contact
    };
    // To the micrometre and exactly the number that three decimals say, so that a file names the point in a few digits.
    let rounded = |x: f64| format!("{x:.3}").parse().unwrap_or(x);
    let candidates: Vec<Vec3> = wide.spots(solid).iter().map(|p| p.map(rounded)).collect();
    let Some(first) = candidates.first() else {
        return Vec::new();
    };
    let mut distance: Vec<f64> = candidates.iter().map(|p| (p - first).norm()).collect();
    let mut chosen = Vec::new();
    while chosen.len() < n {
        let farthest =
            (0..candidates.len()).fold(0, |best, k| if distance[k] > distance[best] { k } else { best });
        if distance[farthest] <= 0.0 {
            break;
        }
        let point = candidates[farthest];
        for (d, p) in distance.iter_mut().zip(&candidates) {
            *d = d.min((p - point).norm());
        }
        chosen.push(point);
    }
    chosen
}

fn moves(document: &Document, text: &SceneText) -> Result<Vec<Move>, Mistake> {
    text.moves
        .iter()
        .map(|own| {
            Ok(Move {
                name: own.name.get_ref().clone(),
                span: own.displacement_mm.span(),
                place: own.place(document)?,
                displacement: own.displacement(document)?,
                steps: count(document, &own.steps, "steps", 1000)?,
            })
        })
        .collect()
}
