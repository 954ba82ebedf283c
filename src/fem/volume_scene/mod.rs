//! A scene on a volume mesh, such as another program made: elements with their materials, what holds the nodes, and cases
//! of forces, pressures, gravity and prescribed displacements.
//!
//! Rooms: [`text`] (the file as people write it), [`sets`] (mesh, sets of nodes, regions of elements), [`loads`] (from
//! words to nodal forces and displacements), [`bodies`] (probes and the floor), [`stage`] (the cases, simulated), [`record`] (what that leaves behind).
//! Everything is read and checked here, before anything is simulated.

pub mod bodies;
pub mod loads;
pub mod record;
pub mod sets;
pub mod stage;
pub mod text;

use self::bodies::NamedBody;
use self::sets::NodeSet;
use self::text::{FixedText, LoadText, OutputText, SurfaceText, VolumeSceneText};
use super::elements::{LOCKING_POISSON, VolumetricStrain};
use super::equilibrium::Options;
use super::scene::{self, SCHEMA};
use super::scene_materials::{SceneMaterial, Shelf};
use super::setup::{finite, length_unit, volumetric_strain};
use crate::geometry::embedding::{Embedding, EmbeddingError, EmbeddingOptions, Held, Locator};
use crate::geometry::files::{VolumeFile, open_surface};
use crate::geometry::surface::TriMesh;
use crate::geometry::volume::Elements;
use crate::material::law::Law;
use crate::math::Vec3;
use crate::units::document::{Document, Mistake};
use std::path::Path;
use toml::Spanned;

/// A point may lie outside the mesh by this share of its diagonal.
const REACH: f64 = 0.02;

/// A part of the object with one material.
#[derive(Clone, Debug)]
pub struct Region {
    /// Its name.
    pub name: String,
    /// Its material, by its place among the scene's.
    pub material: usize,
    /// The material's law, its axis as the region has it.
    pub law: Law,
    /// How many elements it holds.
    pub elements: usize,
}

/// At which levels strains and stresses stand in the record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrainLevels {
    /// Nowhere.
    None,
    /// At the last that was reached.
    Last,
    /// At every one.
    All,
}

/// A surface of more detail than the mesh, carried along by it.
#[derive(Clone, Debug)]
pub struct FineSurface {
    /// Its triangles, as they are at rest.
    pub mesh: TriMesh,
    /// How its vertices follow the mesh's nodes.
    pub embedding: Embedding,
}

/// A checked scene on a volume mesh.
#[derive(Clone, Debug)]
pub struct VolumeScene {
    /// The file, for messages about later findings.
    pub document: Document,
    /// The object's name.
    pub name: String,
    /// The mesh with its groups.
    pub file: VolumeFile,
    /// How tetrahedra or hexahedra sample their volumetric strain.
    pub volumetric: VolumetricStrain,
    /// The scene's own sets of nodes.
    pub sets: Vec<NodeSet>,
    /// Its materials, in the order in which the regions name them.
    pub materials: Vec<SceneMaterial>,
    /// Its regions.
    pub regions: Vec<Region>,
    /// The region of each element, `(elements)`.
    pub region_of: Vec<u16>,
    /// What holds it.
    pub fixed: Vec<Spanned<FixedText>>,
    /// Rigid bodies that meet it.
    pub bodies: Vec<NamedBody>,
    /// For each body the set of nodes that slides on it without coming off, `(bodies)`.
    pub holds: Vec<Option<Spanned<String>>>,
    /// What is done to it.
    pub loads: Vec<LoadText>,
    /// Points to report \[mm\], each with its element.
    pub points: Vec<(Vec3, Held)>,
    /// A fine surface that follows the mesh.
    pub surface: Option<FineSurface>,
    /// What the record holds of strains.
    pub strains: StrainLevels,
    /// How to solve.
    pub options: Options,
    /// Load steps from one level to the next.
    pub steps: usize,
}

impl VolumeScene {
    /// Checks a scene; materials that it does not define itself come from the database in the folder `database`.
    ///
    /// # Errors
    /// [`Mistake`] names the file, the line, what was found and what was expected.
    pub fn read(document: Document, database: &Path) -> Result<VolumeScene, Mistake> {
        let text: VolumeSceneText = document.parse()?;
        if *text.schema.get_ref() != SCHEMA {
            let message = format!("found schema {}, expected {SCHEMA}", text.schema.get_ref());
            return Err(document.mistake(&text.schema.span(), message));
        }
        let names: Vec<&Spanned<String>> = text.load.get_ref().iter().map(|l| &l.name).collect();
        if names.is_empty() {
            return Err(document.mistake(&text.load.span(), "found no [[load]], expected at least one"));
        }
        scene::check_names(&document, &names)?;
        let (options, steps) = scene::solver(&document, &text.solver)?;
        let strains = strain_levels(&document, &text.output)?;
        let mut shelf = Shelf::new(&document, &text.material, database)?;
        let file = sets::read_mesh(&document, &text.mesh)?;
        let sets = sets::read_sets(&document, &text.set, &file)?;
        let region_of = sets::read_regions(&document, &text.region, &file)?;
        let regions = regions(&document, &text, &mut shelf, &region_of)?;
        let volumetric = match &text.mesh.get_ref().volumetric_strain {
            None => VolumetricStrain::suited(&file.mesh.elements, regions.iter().map(|r| &r.law)),
            Some(asked) => volumetric_strain(&document, asked)?,
        };
        let materials = shelf.taken;
        let points = points(&document, &text.output, &file)?;
        let surface = match &text.output.surface {
            None => None,
            Some(asked) => Some(fine_surface(&document, asked, &file)?),
        };
        let bodies = bodies::read_bodies(&document, &text)?;
        let own_name = || {
            document
                .file
                .file_stem()
                .map(|n| n.to_string_lossy().into_owned())
        };
        Ok(VolumeScene {
            name: text.name.clone().or_else(own_name).unwrap_or_default(),
            file,
            volumetric,
            sets,
            materials,
            regions,
            region_of,
            fixed: text.fixed,
            holds: bodies
                .iter()
                .zip(text.probe.iter().map(|p| Some(p.holds.clone())).chain([None]))
                .map(|(_, h)| h.flatten())
                .collect(),
            bodies,
            loads: text.load.into_inner(),
            points,
            surface,
            strains,
            options,
            steps,
            document,
        })
    }

    /// What to tell the user before anything is simulated.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.file.notes.clone();
        for material in self.materials.iter().filter(|m| m.synthetic) {
            let id = &material.id;
            warnings.push(format!(
                "material {id:?} is synthetic: its numbers are estimated, not measured"
            ));
        }
        for region in self.regions.iter().filter(|r| r.elements == 0) {
            warnings.push(format!(
                "region {:?} holds no element: regions before it took them all",
                region.name
            ));
        }
        let stiff = self
            .regions
            .iter()
            .find(|r| r.law.poisson_ratio_at_rest() > LOCKING_POISSON);
        let is_plain = matches!(self.file.mesh.elements, Elements::Tetrahedra(_))
            && self.volumetric == VolumetricStrain::Pointwise;
        if let (true, Some(region)) = (is_plain, stiff) {
            warnings.push(format!(
                "region {:?} is nearly incompressible, and plain tetrahedra are too stiff then: leave out volumetric_strain, or set volumetric_strain = \"shared\" in [mesh]",
                region.name
            ));
        }
        warnings
    }
}

fn strain_levels(document: &Document, text: &OutputText) -> Result<StrainLevels, Mistake> {
    let Some(text) = &text.strains else {
        return Ok(StrainLevels::Last);
    };
    match text.get_ref().as_str() {
        "last" => Ok(StrainLevels::Last),
        "all" => Ok(StrainLevels::All),
        "none" => Ok(StrainLevels::None),
        other => {
            let message = format!("found strains = {other:?}, expected \"last\", \"all\" or \"none\"");
            Err(document.mistake(&text.span(), message))
        }
    }
}

fn regions(
    document: &Document,
    text: &VolumeSceneText,
    shelf: &mut Shelf,
    region_of: &[u16],
) -> Result<Vec<Region>, Mistake> {
    let mut regions = Vec::new();
    for (r, text) in text.region.get_ref().iter().enumerate() {
        let material = usize::from(shelf.take(&text.material)?);
        let mut law = shelf.taken[material].law.clone();
        if let Some(axis) = &text.axis {
            let direction = finite(document, axis)?;
            if direction.norm() < 1e-9 {
                let message = "found an axis of no length, expected for instance [0, 0, 1]";
                return Err(document.mistake(&axis.span(), message));
            }
            law = law.rotated(&direction);
        }
        regions.push(Region {
            name: text.name.get_ref().clone(),
            material,
            law,
            elements: region_of.iter().filter(|&&own| usize::from(own) == r).count(),
        });
    }
    Ok(regions)
}

fn points(document: &Document, text: &OutputText, file: &VolumeFile) -> Result<Vec<(Vec3, Held)>, Mistake> {
    let nodes = &file.mesh.nodes;
    let low = nodes
        .iter()
        .fold(Vec3::from_element(f64::INFINITY), |a, b| a.inf(b));
    let high = nodes
        .iter()
        .fold(Vec3::from_element(f64::NEG_INFINITY), |a, b| a.sup(b));
    let reach = REACH * (high - low).norm();
    let fail = |e: EmbeddingError| document.mistake(&(0..0), e.to_string());
    let locator = Locator::new(&file.mesh).map_err(fail)?;
    let mut points = Vec::new();
    for written in &text.points_mm {
        let point = finite(document, written)?;
        let held = locator.nearest(&point);
        if held.distance_mm > reach {
            let message = format!(
                "the point {:?} lies more than {reach:.2} mm off the mesh, which spans {:.1?} to {:.1?} mm",
                written.get_ref(),
                low.as_slice(),
                high.as_slice()
            );
            return Err(document.mistake(&written.span(), message));
        }
        points.push((point, held));
    }
    Ok(points)
}

/// Reads the fine surface and ties its vertices to the mesh.
fn fine_surface(document: &Document, text: &SurfaceText, file: &VolumeFile) -> Result<FineSurface, Mistake> {
    let fail = |message: String| document.mistake(&text.file.span(), message);
    let unit = length_unit(document, &text.unit)?;
    let path = document.resolve(text.file.get_ref());
    let mesh = open_surface(&path, unit).map_err(|e| fail(e.to_string()))?.mesh;
    let options = EmbeddingOptions::default();
    let name = path.display();
    let tied = match text.follow.as_ref().map(|t| (t.get_ref().as_str(), t.span())) {
        None | Some(("moving-least-squares", _)) => {
            Embedding::moving_least_squares(&file.mesh, &mesh.vertices, &options)
        }
        Some(("elements", _)) => Embedding::in_elements(&file.mesh, &mesh.vertices, &options),
        Some((other, span)) => {
            let message =
                format!("found follow = {other:?}, expected \"moving-least-squares\" or \"elements\"");
            return Err(document.mistake(&span, message));
        }
    };
    let embedding = tied.map_err(|e| fail(format!("{name}: {e}")))?;
    Ok(FineSurface { mesh, embedding })
}
