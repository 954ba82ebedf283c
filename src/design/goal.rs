//! A goal: the object, what holds it, its cells, the palette, and the examples to behave like; read from `goal.toml` and
//! checked, so that what follows need not ask again.

use super::cells::{Cells, LayeredRegion, Style};
use super::goal_text::{ExampleText, GoalText, PaletteText, RegionText};
use crate::fem::example::{Example, MeasuredPoint};
use crate::fem::setup::{self, FixedText, Object};
use crate::geometry::axis::Axis;
use crate::geometry::heights::Heights;
use crate::geometry::region::Region;
use crate::geometry::solid::Solid;
use crate::material::database::Database;
use crate::material::law::Law;
use crate::material::record::MaterialRecord;
use crate::math::mandel::Mandel;
use crate::math::Vec3;
use crate::units;
use crate::units::document::{Document, Mistake};
use std::path::{Path, PathBuf};
use toml::Spanned;

/// The version of `goal.toml` that this program reads.
pub const SCHEMA: u32 = 1;
/// More base materials or cells than this make no sense for a tree.
const MOST_MATERIALS: usize = 64;
const MOST_CELLS: usize = 256;

/// A checked goal.
#[derive(Clone, Debug)]
pub struct Goal {
    /// The object's name.
    pub name: String,
    /// The file that it was read from.
    pub file: PathBuf,
    /// The object.
    pub object: Object,
    /// What holds it.
    pub fixed: Vec<FixedText>,
    /// Its cells.
    pub cells: Cells,
    /// The base materials.
    pub palette: Vec<BaseMaterial>,
    /// At most how many of them in one layout.
    pub most_materials: usize,
    /// The examples.
    pub examples: Vec<Example>,
    /// Edge length of the elements across the layers \[mm\].
    pub element_size_mm: f64,
    /// The text of the file, for messages about later findings.
    pub document: Document,
}

/// A material of the palette with its law.
#[derive(Clone, Debug)]
pub struct BaseMaterial {
    /// The record.
    pub record: MaterialRecord,
    /// Its law, axis along z.
    pub law: Law,
}

/// Why there is no goal.
#[derive(Debug, thiserror::Error)]
pub enum GoalError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {reason}; name a folder that holds a goal.toml, or the file itself", file.display())]
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

impl Goal {
    /// Reads a goal. `place` is the file or the folder that holds `goal.toml`.
    ///
    /// # Errors
    /// [`GoalError`] names the file, the line, what was found and what was expected.
    pub fn read(place: &Path, database: &Database) -> Result<Goal, GoalError> {
        let file = if place.is_dir() { place.join("goal.toml") } else { place.to_path_buf() };
        let text = std::fs::read_to_string(&file)
            .map_err(|e| GoalError::Read { file: file.clone(), reason: e.to_string() })?;
        let document = Document { file: file.clone(), text };
        let goal: GoalText = document.parse()?;
        if *goal.schema.get_ref() != SCHEMA {
            let message = format!("found schema {}, expected {SCHEMA}", goal.schema.get_ref());
            return Err(document.mistake(&goal.schema.span(), message).into());
        }
        let object = goal.object.read(&document)?;
        let palette = palette(&document, &goal.palette, database)?;
        let most_materials = most_materials(&document, &goal.palette, palette.len())?;
        let cells = cells(&document, &goal, &object)?;
        let element_size_mm = match &goal.object.element_size {
            Some(size) => setup::positive_length(&document, size)?,
            None => default_element_size(&object.solid),
        };
        let examples = examples(&document, &goal.example)?;
        Ok(Goal {
            name: goal.name,
            file,
            object,
            fixed: goal.fixed,
            cells,
            palette,
            most_materials,
            examples,
            element_size_mm,
            document,
        })
    }

    /// The folder of the goal's file.
    pub fn folder(&self) -> &Path {
        self.file.parent().unwrap_or(Path::new(""))
    }
}

/// About thirty elements along the longest side.
fn default_element_size(solid: &Solid) -> f64 {
    let (low, high) = solid.bounds();
    (high - low).max() / 30.0
}

fn cells(document: &Document, goal: &GoalText, object: &Object) -> Result<Cells, Mistake> {
    let span = goal.region.span();
    let regions = goal.region.get_ref();
    if regions.is_empty() {
        return Err(document.mistake(&span, "found no [[region]], expected at least one"));
    }
    let follow: Vec<Axis> = regions.iter().filter(|r| style(r) == Style::Follow).map(along).collect();
    if follow.windows(2).any(|pair| pair[0] != pair[1]) {
        let message = "regions follow the object's height along different axes, expected one axis for all of them";
        return Err(document.mistake(&span, message));
    }
    let heights = follow.first().map(|&axis| Heights::new(&object.solid, axis, height_spacing(&object.solid)));
    let mut layered = Vec::new();
    for text in regions {
        layered.push(layered_region(document, text, object)?);
    }
    let cells = Cells::new(layered, heights);
    if cells.count() > MOST_CELLS {
        let message = format!("found {} cells in all, expected at most {MOST_CELLS}", cells.count());
        return Err(document.mistake(&span, message));
    }
    check_cover(document, &span, &cells, &object.solid)?;
    if let Some(least) = &goal.palette.least_layer {
        check_layers(document, least, regions, &cells, &object.solid)?;
    }
    Ok(cells)
}

/// Fine enough to follow a sole's edge, coarse enough for quick lookups.
fn height_spacing(solid: &Solid) -> f64 {
    let (low, high) = solid.bounds();
    (high - low).max() / 120.0
}

fn style(text: &RegionText) -> Style {
    text.style.as_ref().map_or(Style::Flat, |s| *s.get_ref())
}

fn along(text: &RegionText) -> Axis {
    text.along.unwrap_or(Axis::Z)
}

fn layered_region(document: &Document, text: &RegionText, object: &Object) -> Result<LayeredRegion, Mistake> {
    let layers = *text.layers.get_ref();
    if !(1..=64).contains(&layers) {
        let message = format!("found {layers} layers, expected 1 to 64");
        return Err(document.mistake(&text.layers.span(), message));
    }
    let region = text.shape().read(document, object.unit)?;
    let axis = along(text);
    let [from, to] = match style(text) {
        Style::Follow => [0.0, 1.0],
        Style::Flat => extent(&region, axis, &object.solid),
    };
    if to <= from {
        let message = format!("region {:?} does not meet the object", text.name);
        return Err(document.mistake(&text.layers.span(), message));
    }
    let borders = (0..=layers).map(|k| from + (to - from) * k as f64 / layers as f64).collect();
    Ok(LayeredRegion { name: text.name.clone(), region, axis, style: style(text), borders })
}

/// Where a region begins and ends inside the object along `axis`.
fn extent(region: &Region, axis: Axis, solid: &Solid) -> [f64; 2] {
    let (low, high) = solid.bounds();
    let w = axis.index();
    let (from, to) = match region {
        Region::Box { min, max } => (min[w], max[w]),
        Region::Cylinder { axis: own, centre, radius, range } => {
            let (a, b) = own.others();
            if *own == axis {
                (range[0], range[1])
            } else {
                let c = if a == w { centre[0] } else { centre[usize::from(b == w)] };
                (c - radius, c + radius)
            }
        }
        Region::Mesh(own) => (own.bounds().0[w], own.bounds().1[w]),
        Region::Everything => (low[w], high[w]),
    };
    [from.max(low[w]), to.min(high[w])]
}

/// Every part of the object must belong to a region.
fn check_cover(
    document: &Document,
    span: &std::ops::Range<usize>,
    cells: &Cells,
    solid: &Solid,
) -> Result<(), Mistake> {
    let (low, high) = solid.bounds();
    let (mut inside, mut lost, mut first) = (0, 0, None);
    let n = 24;
    for k in 0..n * n * n {
        let at = |c: usize, i: usize| low[c] + (high[c] - low[c]) * (i as f64 + 0.5) / n as f64;
        let point = Vec3::new(at(0, k % n), at(1, k / n % n), at(2, k / n / n));
        if solid.contains(&point) {
            inside += 1;
            if cells.cell_at(&point).is_none() {
                lost += 1;
                first.get_or_insert(point);
            }
        }
    }
    let Some(point) = first else { return Ok(()) };
    Err(document.mistake(
        span,
        format!(
            "{:.0} % of the object lies in no region, for instance the point ({:.1}, {:.1}, {:.1}) mm; add a last [[region]] without a shape: it takes the rest",
            100.0 * lost as f64 / inside as f64,
            point.x,
            point.y,
            point.z
        ),
    ))
}

fn check_layers(
    document: &Document,
    least: &Spanned<String>,
    texts: &[RegionText],
    cells: &Cells,
    solid: &Solid,
) -> Result<(), Mistake> {
    let least_mm = setup::positive_length(document, least)?;
    for (region, text) in cells.regions().iter().zip(texts) {
        let thinnest = cells.thinnest_layer(region, solid);
        if thinnest < least_mm {
            let layers = *text.layers.get_ref() as f64;
            let message = format!(
                "{layers} layers in region {:?} are {thinnest:.2} mm thin, expected at least {least_mm} mm (least_layer): use at most {:.0}",
                text.name,
                (thinnest * layers / least_mm).floor().max(1.0)
            );
            return Err(document.mistake(&text.layers.span(), message));
        }
    }
    Ok(())
}

fn palette(document: &Document, text: &PaletteText, database: &Database) -> Result<Vec<BaseMaterial>, Mistake> {
    let synthetic = text.synthetic.unwrap_or(false);
    let mut chosen = Vec::new();
    match &text.materials {
        Some(ids) => {
            for id in ids.get_ref() {
                let record =
                    database.find(id.get_ref()).map_err(|e| document.mistake(&id.span(), e.to_string()))?;
                if record.synthetic && !synthetic {
                    let message = format!(
                        "material {:?} is synthetic (its numbers are estimated, not measured); set synthetic = true in [palette] to use it",
                        id.get_ref()
                    );
                    return Err(document.mistake(&id.span(), message));
                }
                if chosen.iter().any(|r: &MaterialRecord| r.id == record.id) {
                    return Err(document.mistake(&id.span(), format!("material {:?} stands twice", id.get_ref())));
                }
                chosen.push(record.clone());
            }
        }
        None => chosen.extend(filtered(document, text, database, synthetic)?),
    }
    let span = text.materials.as_ref().map_or(0..0, Spanned::span);
    if chosen.is_empty() || chosen.len() > MOST_MATERIALS {
        let message = format!("the palette holds {} materials, expected 1 to {MOST_MATERIALS}", chosen.len());
        return Err(document.mistake(&span, message));
    }
    chosen
        .into_iter()
        .map(|record| {
            let law = record.law().map_err(|e| document.mistake(&span, e.to_string()))?;
            Ok(BaseMaterial { record, law })
        })
        .collect()
}

fn filtered(
    document: &Document,
    text: &PaletteText,
    database: &Database,
    synthetic: bool,
) -> Result<Vec<MaterialRecord>, Mistake> {
    let bound = |text: &Option<Spanned<String>>, open: f64| match text {
        None => Ok(open),
        Some(text) => setup::quantity(document, text, units::stress),
    };
    let (softest, stiffest) = (bound(&text.softest, 0.0)?, bound(&text.stiffest, f64::INFINITY)?);
    let known = ["isotropic", "transversely-isotropic"];
    if let Some(kind) = text.kind.as_ref().filter(|k| !known.contains(&k.get_ref().as_str())) {
        let message = format!("found kind {:?}, expected one of {known:?}", kind.get_ref());
        return Err(document.mistake(&kind.span(), message));
    }
    let fits = |record: &&MaterialRecord| {
        let stiffness = record.law().map(|law| law.young_modulus(&Mandel::zeros())).unwrap_or(f64::NAN);
        (synthetic || !record.synthetic)
            && text.kind.as_ref().is_none_or(|k| k.get_ref() == record.kind.word())
            && (!text.printable.unwrap_or(false) || record.printability.printable)
            && stiffness >= softest
            && stiffness <= stiffest
    };
    Ok(database.records().filter(fits).cloned().collect())
}

fn most_materials(document: &Document, text: &PaletteText, available: usize) -> Result<usize, Mistake> {
    match &text.most_materials {
        None => Ok(available),
        Some(most) if *most.get_ref() >= 1 => Ok((*most.get_ref()).min(available)),
        Some(most) => Err(document.mistake(&most.span(), "found 0, expected at least one material")),
    }
}

fn examples(document: &Document, texts: &Spanned<Vec<ExampleText>>) -> Result<Vec<Example>, Mistake> {
    if texts.get_ref().is_empty() {
        return Err(document.mistake(&texts.span(), "found no [[example]], expected at least one"));
    }
    texts.get_ref().iter().map(|text| example(document, text)).collect()
}

fn example(document: &Document, text: &ExampleText) -> Result<Example, Mistake> {
    let contact = text.contact().read(document)?;
    let name = text.name.get_ref().clone();
    let origin = text.origin.clone().unwrap_or_else(|| "origin not stated".into());
    let (forces_n, points) = match (&text.forces_n, &text.displacements_mm, &text.file) {
        (Some(forces), Some(displacements), None) => {
            check_forces(document, forces)?;
            let n = forces.get_ref().len();
            if displacements.get_ref().len() != n {
                let found = displacements.get_ref().len();
                let message = format!("found {found} displacements for {n} forces, expected one for each force");
                return Err(document.mistake(&displacements.span(), message));
            }
            if displacements.get_ref().iter().any(|d| !d.is_finite()) {
                return Err(document.mistake(&displacements.span(), "found a displacement that is not a finite number"));
            }
            let displacements_mm = displacements.get_ref().iter().map(|&d| vec![Some(d)]).collect();
            let point =
                MeasuredPoint { place: contact.point, directions: vec![contact.direction], displacements_mm };
            (forces.get_ref().clone(), vec![point])
        }
        (None, None, Some(file)) => read_points(document, file)?,
        _ => {
            let message = format!(
                "example {name:?} needs either forces_n and displacements_mm, or a file with displacements of points"
            );
            return Err(document.mistake(&text.name.span(), message));
        }
    };
    Ok(Example { name, contact, forces_n, points, origin })
}

fn check_forces(document: &Document, forces: &Spanned<Vec<f64>>) -> Result<(), Mistake> {
    let list = forces.get_ref();
    let rising = list.first().is_some_and(|&f| f > 0.0) && list.windows(2).all(|w| w[0] < w[1]);
    if rising && list.iter().all(|f| f.is_finite()) {
        return Ok(());
    }
    Err(document.mistake(&forces.span(), format!("found forces {list:?}, expected rising numbers above zero [N]")))
}

#[derive(serde::Deserialize)]
struct PointRow {
    force_n: f64,
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    dx_mm: Option<f64>,
    dy_mm: Option<f64>,
    dz_mm: Option<f64>,
}

/// Reads `force_n, x_mm, y_mm, z_mm, dx_mm, dy_mm, dz_mm`: one row a point and force, every point at every force; an empty
/// displacement is a marker that was lost.
fn read_points(document: &Document, file: &Spanned<String>) -> Result<(Vec<f64>, Vec<MeasuredPoint>), Mistake> {
    let path = document.resolve(file.get_ref());
    let bad = |line: u64, message: String| {
        document.mistake(&file.span(), format!("{}, line {line}: {message}", path.display()))
    };
    let mut reader = csv::Reader::from_path(&path).map_err(|e| bad(0, e.to_string()))?;
    let mut forces: Vec<f64> = Vec::new();
    let mut points: Vec<MeasuredPoint> = Vec::new();
    for (index, row) in reader.deserialize::<PointRow>().enumerate() {
        let line = index as u64 + 2;
        let row = row.map_err(|e| bad(line, e.to_string()))?;
        let place = Vec3::new(row.x_mm, row.y_mm, row.z_mm);
        let moved = [row.dx_mm, row.dy_mm, row.dz_mm];
        if !place.iter().chain(moved.iter().flatten()).all(|x| x.is_finite()) || !row.force_n.is_finite() {
            return Err(bad(line, "found a number that is not finite".into()));
        }
        if forces.last() != Some(&row.force_n) {
            if row.force_n <= forces.last().copied().unwrap_or(0.0) {
                return Err(bad(line, format!("found a force of {} N, expected rising forces above zero", row.force_n)));
            }
            forces.push(row.force_n);
        }
        let level = forces.len() - 1;
        let index = match points.iter().position(|p| p.place == place) {
            Some(index) => index,
            None => {
                let directions = vec![Vec3::x(), Vec3::y(), Vec3::z()];
                points.push(MeasuredPoint { place, directions, displacements_mm: vec![vec![None; 3]; level] });
                points.len() - 1
            }
        };
        let series = &mut points[index].displacements_mm;
        if series.len() > level {
            return Err(bad(line, format!("the point {:?} stands twice at {} N", [place.x, place.y, place.z], row.force_n)));
        }
        series.resize(level, vec![None; 3]);
        series.push(moved.to_vec());
    }
    if points.is_empty() {
        return Err(bad(1, "found no rows, expected force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm".into()));
    }
    for point in &mut points {
        point.displacements_mm.resize(forces.len(), vec![None; 3]);
    }
    Ok((forces, points))
}
