//! A measurement set: one material, its specimen on its supports, and what a probe and cameras measured on it.
//!
//! The record that capture and the virtual laboratory hand to fitting. Rooms: [`text`] (the file as people write it), [`card`](mod@card) (what
//! it says of the material), here
//! reading and checking each value, [`plausible`] (whether the numbers make sense together: units, drift, outliers),
//! [`mod@write`] (a set as a file).

pub mod card;
pub mod plausible;
pub mod text;
pub mod write;

pub use self::card::MaterialCard;
use self::card::MaterialText;
use self::text::{ExampleText, MeasurementSetText, SpecimenText};
use super::elements::VolumetricStrain;
use super::example::{Contact, MeasuredPoint};
use super::example_table::read_table;
use super::example_text::check_forces;
use super::model::Constrained;
use super::setup::{FixedText, finite, length_unit, positive_length, volumetric_strain};
use crate::geometry::files::open_volume;
use crate::geometry::volume::VolumeMesh;
use crate::math::Vec3;
use crate::units::document::{Document, Mistake};
use std::path::Path;
use toml::Spanned;

/// The version of the format that this program reads and writes.
pub const SCHEMA: u32 = 1;
/// A block gets no more elements than this.
const MOST_ELEMENTS: f64 = 2e6;
/// Standard deviation of a displacement where nothing says more \[mm\]: what cameras reach.
pub const DEVIATION_MM: f64 = 0.1;

/// Where displacements come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// From an experiment.
    Measured,
    /// From a simulation, which the words describe.
    Computed(String),
}

/// One place where the specimen was pressed.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Its name.
    pub name: String,
    /// Where and how it was pressed.
    pub contact: Contact,
    /// Force at each level, its part along the contact's direction rising \[N\].
    pub forces: Vec<Vec3>,
    /// What was measured at each level.
    pub points: Vec<MeasuredPoint>,
    /// Standard deviation of each component of a displacement, `(points × levels)` \[mm\].
    pub deviations_mm: Vec<Vec<f64>>,
    /// How much its squared residuals count beside those of the others. 1 where nothing else is said.
    pub weight: f64,
    /// Not fitted, but compared.
    pub held_out: bool,
}

/// A checked measurement set.
#[derive(Clone, Debug)]
pub struct MeasurementSet {
    /// The file, for messages about later findings.
    pub document: Document,
    /// Where the numbers come from.
    pub origin: Origin,
    /// The material.
    pub material: MaterialCard,
    /// The specimen.
    pub mesh: VolumeMesh,
    /// How its elements sample their volumetric strain.
    pub volumetric: VolumetricStrain,
    /// What holds it, `(nodes)`.
    pub constrained: Vec<Constrained>,
    /// What was done to it and measured.
    pub experiments: Vec<Experiment>,
}

impl MeasurementSet {
    /// Reads and checks a set; files that it names are taken from its folder.
    ///
    /// # Errors
    /// [`Mistake`] names the file, the line, what was found and what was expected.
    pub fn read(document: Document) -> Result<MeasurementSet, Mistake> {
        let text: MeasurementSetText = document.parse()?;
        if *text.schema.get_ref() != SCHEMA {
            let message = format!("found schema {}, expected {SCHEMA}", text.schema.get_ref());
            return Err(document.mistake(&text.schema.span(), message));
        }
        let origin = origin(&document, &text)?;
        let material = card(&document, &text.material)?;
        let (mesh, volumetric) = specimen(&document, &text.specimen)?;
        let constrained = supports(&document, &text.fixed, &mesh)?;
        let experiments = experiments(&document, &text.example)?;
        Ok(MeasurementSet {
            document,
            origin,
            material,
            mesh,
            volumetric,
            constrained,
            experiments,
        })
    }

    /// Reads the set in `file`.
    ///
    /// # Errors
    /// As [`MeasurementSet::read`], and a file that cannot be read.
    pub fn open(file: &Path) -> Result<MeasurementSet, Mistake> {
        MeasurementSet::read(Document::open(file)?)
    }

    /// Lower and upper corner of the specimen \[mm\].
    pub fn bounds(&self) -> (Vec3, Vec3) {
        bounds(&self.mesh)
    }
}

fn bounds(mesh: &VolumeMesh) -> (Vec3, Vec3) {
    let nothing = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    mesh.nodes
        .iter()
        .fold(nothing, |(low, high), x| (low.inf(x), high.sup(x)))
}

fn origin(document: &Document, text: &MeasurementSetText) -> Result<Origin, Mistake> {
    match (text.origin.get_ref().as_str(), &text.computed_from) {
        ("measured", None) => Ok(Origin::Measured),
        ("computed", Some(words)) if !words.trim().is_empty() => Ok(Origin::Computed(words.clone())),
        ("measured", Some(_)) => {
            let message = "found computed_from beside origin = \"measured\", expected one of the two";
            Err(document.mistake(&text.origin.span(), message))
        }
        ("computed", _) => {
            let message =
                "found origin = \"computed\" without computed_from, expected a line that says from what";
            Err(document.mistake(&text.origin.span(), message))
        }
        (other, _) => {
            let message = format!("found origin = {other:?}, expected \"measured\" or \"computed\"");
            Err(document.mistake(&text.origin.span(), message))
        }
    }
}

fn card(document: &Document, text: &Spanned<MaterialText>) -> Result<MaterialCard, Mistake> {
    let Some(density) = &text.get_ref().density_g_per_cm3 else {
        let message = "found no density_g_per_cm3, expected that of the specimen, holes included";
        return Err(document.mistake(&text.span(), message));
    };
    let value = *density.get_ref();
    if value.is_nan() || value <= 0.0 {
        let message = format!("found {value} g/cm³, expected a density above zero");
        return Err(document.mistake(&density.span(), message));
    }
    text.get_ref().card(document, value)
}

fn specimen(
    document: &Document,
    text: &Spanned<SpecimenText>,
) -> Result<(VolumeMesh, VolumetricStrain), Mistake> {
    let own = text.get_ref();
    let volumetric = match &own.volumetric_strain {
        None => VolumetricStrain::Shared,
        Some(asked) => volumetric_strain(document, asked)?,
    };
    let mesh = match (&own.size_mm, &own.mesh) {
        (Some(size), None) => block(document, own, size)?,
        (None, Some(file)) => {
            if let Some(size) = &own.element_size {
                let message = "found element_size beside a mesh, which has its own elements";
                return Err(document.mistake(&size.span(), message));
            }
            let unit = length_unit(document, &own.unit)?;
            let path = document.resolve(file.get_ref());
            let read = open_volume(&path, unit);
            read.map_err(|e| document.mistake(&file.span(), e.to_string()))?
                .mesh
        }
        _ => {
            let message = "expected one of size_mm (a block) and mesh (a volume mesh) in [specimen]";
            return Err(document.mistake(&text.span(), message));
        }
    };
    Ok((mesh, volumetric))
}

fn block(document: &Document, text: &SpecimenText, size: &Spanned<[f64; 3]>) -> Result<VolumeMesh, Mistake> {
    if let Some(unit) = &text.unit {
        let message = "found a unit without a mesh: size_mm is in mm";
        return Err(document.mistake(&unit.span(), message));
    }
    let edges = finite(document, size)?;
    if edges.min() <= 0.0 {
        let message = format!(
            "found the size {:?} mm, expected three lengths above zero",
            size.get_ref()
        );
        return Err(document.mistake(&size.span(), message));
    }
    let element = match &text.element_size {
        // Six elements through the thinnest edge resolve a press on it to some percent.
        None => edges.min() / 6.0,
        Some(written) => positive_length(document, written)?,
    };
    let counts = edges.map(|e| (e / element).round().max(1.0));
    if counts.product() > MOST_ELEMENTS {
        let message = format!(
            "a block of {:?} mm in elements of {element:.3} mm has {:.1e} elements, expected at most {MOST_ELEMENTS:.0e}: set a larger element_size",
            size.get_ref(),
            counts.product()
        );
        return Err(document.mistake(&size.span(), message));
    }
    let tetrahedra = match text.elements.as_ref().map(|e| (e.get_ref().as_str(), e.span())) {
        None | Some(("hexahedra", _)) => false,
        Some(("tetrahedra", _)) => true,
        Some((other, span)) => {
            let message = format!("found elements = {other:?}, expected \"hexahedra\" or \"tetrahedra\"");
            return Err(document.mistake(&span, message));
        }
    };
    let counts = [0, 1, 2].map(|c| counts[c] as usize);
    Ok(VolumeMesh::cuboid(edges, counts, tetrahedra))
}

fn supports(
    document: &Document,
    texts: &Spanned<Vec<FixedText>>,
    mesh: &VolumeMesh,
) -> Result<Vec<Constrained>, Mistake> {
    let (low, high) = bounds(mesh);
    let thin = 1e-6 * (high.z - low.z);
    let end = |top: bool| -> Vec<usize> {
        let there = |x: &Vec3| {
            if top {
                high.z - x.z <= thin
            } else {
                x.z - low.z <= thin
            }
        };
        (0..mesh.nodes.len()).filter(|&n| there(&mesh.nodes[n])).collect()
    };
    let mut constrained = vec![[false; 3]; mesh.nodes.len()];
    for fixed in texts.get_ref() {
        fixed.hold_nodes(document, &mesh.nodes, &end, &mut constrained)?;
    }
    if texts.get_ref().is_empty() {
        return Err(document.mistake(
            &texts.span(),
            "found no [[fixed]], expected what holds the specimen",
        ));
    }
    Ok(constrained)
}

fn experiments(document: &Document, texts: &Spanned<Vec<ExampleText>>) -> Result<Vec<Experiment>, Mistake> {
    let mut experiments: Vec<Experiment> = Vec::new();
    for text in texts.get_ref() {
        if experiments.iter().any(|e| e.name == *text.name.get_ref()) {
            let message = format!("the example {:?} stands twice", text.name.get_ref());
            return Err(document.mistake(&text.name.span(), message));
        }
        experiments.push(experiment(document, text)?);
    }
    if experiments.iter().all(|e| e.held_out) {
        let message = "found no [[example]] to fit, expected at least one that is not held out";
        return Err(document.mistake(&texts.span(), message));
    }
    Ok(experiments)
}

fn experiment(document: &Document, text: &ExampleText) -> Result<Experiment, Mistake> {
    let contact = text.contact().read(document)?;
    let deviation = match &text.deviation {
        None => DEVIATION_MM,
        Some(written) => positive_length(document, written)?,
    };
    let weight = match &text.weight {
        None => 1.0,
        Some(written) => {
            let weight = *written.get_ref();
            if weight.is_nan() || weight <= 0.0 || weight.is_infinite() {
                let message = format!(
                    "found weight = {weight}, expected a number above zero (held_out = true leaves it out)"
                );
                return Err(document.mistake(&written.span(), message));
            }
            weight
        }
    };
    let (forces, points, deviations_mm) = match (&text.forces_n, &text.displacements_mm, &text.file) {
        (Some(forces), Some(moved), None) => {
            let (forces, point) = own_path(document, &contact, forces, moved)?;
            let levels = forces.len();
            (forces, vec![point], vec![vec![deviation; levels]])
        }
        (None, None, Some(file)) => {
            let table = read_table(document, file, &contact.direction)?;
            let filled = |own: Vec<Option<f64>>| own.into_iter().map(|d| d.unwrap_or(deviation)).collect();
            let deviations = table.deviations_mm.into_iter().map(filled).collect();
            (table.forces, table.points, deviations)
        }
        _ => {
            let message = format!(
                "example {:?} needs either forces_n and displacements_mm, or a file with displacements of points",
                text.name.get_ref()
            );
            return Err(document.mistake(&text.name.span(), message));
        }
    };
    Ok(Experiment {
        name: text.name.get_ref().clone(),
        contact,
        forces,
        points,
        deviations_mm,
        weight,
        held_out: text.held_out.unwrap_or(false),
    })
}

/// The probe's own path: the contact point's displacement along the direction.
fn own_path(
    document: &Document,
    contact: &Contact,
    forces: &Spanned<Vec<f64>>,
    moved: &Spanned<Vec<f64>>,
) -> Result<(Vec<Vec3>, MeasuredPoint), Mistake> {
    check_forces(document, forces)?;
    let (found, expected) = (moved.get_ref().len(), forces.get_ref().len());
    if found != expected {
        let message =
            format!("found {found} displacements for {expected} forces, expected one for each force");
        return Err(document.mistake(&moved.span(), message));
    }
    if moved.get_ref().iter().any(|d| !d.is_finite()) {
        let message = "found a displacement that is not a finite number";
        return Err(document.mistake(&moved.span(), message));
    }
    let point = MeasuredPoint {
        place: contact.point,
        directions: vec![contact.direction],
        displacements_mm: moved.get_ref().iter().map(|&d| vec![Some(d)]).collect(),
    };
    let forces = forces.get_ref().iter().map(|f| contact.direction * *f).collect();
    Ok((forces, point))
}

#[cfg(test)]
mod set_tests;
