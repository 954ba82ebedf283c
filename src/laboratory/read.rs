//! A laboratory, read and checked: everything that a run needs but the solve.

use super::structure::Fine;
use super::text::{BaseText, LaboratoryText, MarkersText, ProbeText, SurfaceText, TubesText, VoxelsText};
use crate::fem::example::Contact;
use crate::fem::example_text::check_forces;
use crate::fem::measurement_set::{DEVIATION_MM, MaterialCard};
use crate::fem::setup::{FixedText, finite, length_unit, positive_length, quantity, read_object};
use crate::geometry::axis::Axis;
use crate::geometry::files::nrrd::read_nrrd;
use crate::geometry::shapes::TubeBlock;
use crate::material::check::is_id;
use crate::material::database::Database;
use crate::material::law::Law;
use crate::math::Vec3;
use crate::units::document::{Document, Mistake};
use crate::units::{self, LengthUnit};
use std::path::Path;
use toml::Spanned;

/// The version of the format that this program reads.
pub const SCHEMA: u32 = 1;

/// A face of the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// The axis that it lies across.
    pub axis: Axis,
    /// Does it lie at the axis' upper end?
    pub is_upper: bool,
}

impl Face {
    /// All six.
    pub const ALL: [Face; 6] = [
        Face {
            axis: Axis::X,
            is_upper: false,
        },
        Face {
            axis: Axis::X,
            is_upper: true,
        },
        Face {
            axis: Axis::Y,
            is_upper: false,
        },
        Face {
            axis: Axis::Y,
            is_upper: true,
        },
        Face {
            axis: Axis::Z,
            is_upper: false,
        },
        Face {
            axis: Axis::Z,
            is_upper: true,
        },
    ];

    /// Its outward normal.
    pub fn normal(self) -> Vec3 {
        let mut normal = Vec3::zeros();
        normal[self.axis.index()] = if self.is_upper { 1.0 } else { -1.0 };
        normal
    }

    /// Where it lies along its axis, of a block between the origin and `size` \[mm\].
    pub fn place(self, size: &Vec3) -> f64 {
        if self.is_upper {
            size[self.axis.index()]
        } else {
            0.0
        }
    }

    /// The two axes that it spans, in the order x, y, z.
    pub fn across(self) -> [usize; 2] {
        match self.axis.index() {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        }
    }
}

/// A grid of markers on a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarkerGrid {
    /// The face.
    pub face: Face,
    /// How many along its two axes.
    pub count: [usize; 2],
}

/// One press.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Its name.
    pub name: String,
    /// Where and how the probe presses.
    pub contact: Contact,
    /// Its force at each level, rising \[N\].
    pub forces: Vec<Vec3>,
    /// Not for the fit, but for comparison.
    pub held_out: bool,
}

/// Errors of measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation of each component \[mm\].
    pub deviation_mm: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// What the structure is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// In words.
    pub words: String,
    /// Its law.
    pub law: Law,
    /// Its density \[g/cm³\].
    pub density_g_per_cm3: f64,
}

/// A checked laboratory.
#[derive(Clone, Debug)]
pub struct Laboratory {
    /// The file, for messages about later findings.
    pub document: Document,
    /// The card of the structure's record; its density is that of the block.
    pub card: MaterialCard,
    /// The base material.
    pub base: Base,
    /// The structure in words.
    pub words: String,
    /// The fine mesh.
    pub fine: Fine,
    /// Edge length of the homogeneous specimen's elements \[mm\].
    pub element_size_mm: f64,
    /// What holds the block.
    pub fixed: Vec<FixedText>,
    /// The markers.
    pub markers: Vec<MarkerGrid>,
    /// The presses.
    pub probes: Vec<Probe>,
    /// Errors of measurement.
    pub noise: Option<Noise>,
}

impl Laboratory {
    /// Reads and checks a laboratory; a base material by its id comes from the database in the folder `database`.
    ///
    /// # Errors
    /// [`Mistake`] names the file, the line, what was found and what was expected.
    pub fn read(document: Document, database: &Path) -> Result<Laboratory, Mistake> {
        let text: LaboratoryText = document.parse()?;
        if *text.schema.get_ref() != SCHEMA {
            let message = format!("found schema {}, expected {SCHEMA}", text.schema.get_ref());
            return Err(document.mistake(&text.schema.span(), message));
        }
        let base = base(&document, &text.base, database)?;
        let (words, fine) = structure(&document, &text)?;
        let card = card(&document, &text, base.density_g_per_cm3 * fine.solid_share)?;
        let element_size_mm = match &text.specimen {
            None => fine.size.min() / 6.0,
            Some(own) => positive_length(&document, &own.element_size)?,
        };
        for fixed in text.fixed.get_ref() {
            if let Some(cylinder) = &fixed.cylinder {
                let message = "found a cylinder, expected face or box_mm in the [[fixed]] of a laboratory";
                return Err(document.mistake(&cylinder.span(), message));
            }
        }
        if text.fixed.get_ref().is_empty() {
            let message = "found no [[fixed]], expected what holds the block";
            return Err(document.mistake(&text.fixed.span(), message));
        }
        let markers = markers(&document, &text.markers)?;
        let probes = probes(&document, &text.probe)?;
        let noise = match &text.noise {
            None => None,
            Some(own) => Some(Noise {
                deviation_mm: positive_length(&document, &own.deviation)?,
                seed: own.seed.unwrap_or(1),
            }),
        };
        Ok(Laboratory {
            document,
            card,
            base,
            words,
            fine,
            element_size_mm,
            fixed: text.fixed.into_inner(),
            markers,
            probes,
            noise,
        })
    }

    /// Reads the laboratory in `file`.
    ///
    /// # Errors
    /// As [`Laboratory::read`], and a file that cannot be read.
    pub fn open(file: &Path, database: &Path) -> Result<Laboratory, Mistake> {
        Laboratory::read(Document::open(file)?, database)
    }

    /// Standard deviation that the set gives its displacements \[mm\].
    pub fn deviation_mm(&self) -> f64 {
        self.noise.map_or(DEVIATION_MM, |n| n.deviation_mm)
    }
}

fn base(document: &Document, text: &Spanned<BaseText>, database: &Path) -> Result<Base, Mistake> {
    let own = text.get_ref();
    match (&own.record, &own.law) {
        (Some(id), None) => {
            let fail = |message: String| document.mistake(&id.span(), message);
            let database = Database::open(database).map_err(|e| fail(e.to_string()))?;
            let record = database.find(id.get_ref()).map_err(|e| fail(e.to_string()))?;
            Ok(Base {
                words: format!("{} ({})", record.id, record.name),
                law: record.law().map_err(|e| fail(e.to_string()))?,
                density_g_per_cm3: record.density_g_per_cm3,
            })
        }
        (None, Some(law)) => {
            let (span, written) = (law.span(), law.get_ref());
            let Some(density) = &written.density else {
                return Err(document.mistake(
                    &span,
                    "found a law without density, expected for instance \"1.1 g/cm3\"",
                ));
            };
            // Inside, a density is in t/mm³.
            let density_g_per_cm3 = quantity(document, density, units::density)? * 1e9;
            if density_g_per_cm3.is_nan() || density_g_per_cm3 <= 0.0 {
                let message = format!("found {:?}, expected a density above zero", density.get_ref());
                return Err(document.mistake(&density.span(), message));
            }
            let read = written.law();
            Ok(Base {
                words: words_of(document, span.start),
                law: read.map_err(|e| document.mistake(&e.span.clone().unwrap_or(span), e.to_string()))?,
                density_g_per_cm3,
            })
        }
        _ => {
            let message = "expected one of record (an id of the database) and law (a law in place) in [base]";
            Err(document.mistake(&text.span(), message))
        }
    }
}

/// What the file says of a law from `start` on: the keys of its table, or its inline table.
fn words_of(document: &Document, start: usize) -> String {
    let mut words: Vec<&str> = Vec::new();
    for (index, line) in document.text.get(start..).unwrap_or_default().lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if index == 0 && line.starts_with('{') {
            return line.to_string();
        }
        if index > 0 && line.starts_with('[') {
            break;
        }
        if index > 0 && !line.is_empty() {
            words.push(line);
        }
    }
    words.join(", ")
}

fn structure(document: &Document, text: &LaboratoryText) -> Result<(String, Fine), Mistake> {
    match (&text.tubes, &text.surface, &text.voxels, &text.solid) {
        (Some(own), None, None, None) => tubes(document, own),
        (None, Some(own), None, None) => surface(document, own),
        (None, None, Some(own), None) => voxels(document, own),
        (None, None, None, Some(own)) => {
            let written = own.get_ref();
            let size = finite(document, &written.size_mm)?;
            if size.min() <= 0.0 {
                let message = format!(
                    "found the size {:?} mm, expected three lengths above zero",
                    size.as_slice()
                );
                return Err(document.mistake(&written.size_mm.span(), message));
            }
            let element = positive_length(document, &written.element_size)?;
            let fine = Fine::solid(size, element).map_err(|m| document.mistake(&own.span(), m))?;
            Ok(("a solid block".into(), fine))
        }
        _ => {
            let message = "expected one of [tubes], [surface], [voxels] and [solid]";
            Err(document.mistake(&(0..0), message))
        }
    }
}

fn tubes(document: &Document, text: &Spanned<TubesText>) -> Result<(String, Fine), Mistake> {
    let own = text.get_ref();
    let spacing_mm = positive_length(document, &own.spacing)?;
    let height_mm = positive_length(document, &own.height)?;
    let block = TubeBlock {
        diameter_mm: positive_length(document, &own.diameter)?,
        spacing_mm,
        array: own.array,
        count: own.count,
        height_mm,
        along_side: own.along_side.unwrap_or(2),
        rings: own.rings.unwrap_or(2),
        layers: own
            .layers
            .unwrap_or_else(|| (2.0 * height_mm / spacing_mm).round().clamp(1.0, 1e4) as usize),
    };
    let fine = Fine::tubes(&block).map_err(|m| document.mistake(&text.span(), m))?;
    let words = format!(
        "tubes of {} mm at {} mm, {} array, {} in a row, {} rows, {} mm high, meshed with {} elements along a cell's side, {} rings, {} layers",
        block.diameter_mm,
        block.spacing_mm,
        format!("{:?}", block.array).to_lowercase(),
        block.count[0],
        block.count[1],
        block.height_mm,
        block.along_side,
        block.rings,
        block.layers
    );
    Ok((words, fine))
}

fn surface(document: &Document, text: &Spanned<SurfaceText>) -> Result<(String, Fine), Mistake> {
    let own = text.get_ref();
    let unit = length_unit(document, &own.unit)?;
    let path = document.resolve(own.file.get_ref());
    let object = read_object(&path, unit).map_err(|m| document.mistake(&own.file.span(), m))?;
    let element = positive_length(document, &own.element_size)?;
    let repeat = *own.repeat.get_ref();
    let fine =
        Fine::surface(&object.solid, element, repeat).map_err(|m| document.mistake(&text.span(), m))?;
    let words = format!(
        "the lattice {:?}, {} × {} × {} cells, in elements of {element} mm",
        own.file.get_ref(),
        repeat[0],
        repeat[1],
        repeat[2]
    );
    Ok((words, fine))
}

fn voxels(document: &Document, text: &Spanned<VoxelsText>) -> Result<(String, Fine), Mistake> {
    let own = text.get_ref();
    let unit = length_unit(document, &own.unit)?.unwrap_or(LengthUnit::Millimetre);
    let fail = |message: String| document.mistake(&own.file.span(), message);
    let path = document.resolve(own.file.get_ref());
    let name = path.display();
    let bytes = std::fs::read(&path).map_err(|e| fail(format!("{name}: cannot be read: {e}")))?;
    let image = read_nrrd(&bytes).map_err(|e| fail(format!("{name}: {e}")))?;
    let image = image.scaled(unit.to_mm());
    let per_element = own.per_element.as_ref().map_or(1, |n| *n.get_ref());
    let repeat = *own.repeat.get_ref();
    let threshold = own.threshold.unwrap_or(1.0);
    let fine = Fine::voxels(&image, threshold, per_element, repeat)
        .map_err(|m| document.mistake(&text.span(), m))?;
    let words = format!(
        "the voxel image {:?} from {threshold} on, {} × {} × {} times, {per_element} voxels along an element",
        own.file.get_ref(),
        repeat[0],
        repeat[1],
        repeat[2]
    );
    Ok((words, fine))
}

/// The density is that of the block, holes included.
fn card(document: &Document, text: &LaboratoryText, density: f64) -> Result<MaterialCard, Mistake> {
    let own = text.material.get_ref();
    if let Some(written) = &own.density_g_per_cm3 {
        let message =
            "found a density, which follows from that of the base and its share of the block: leave it out";
        return Err(document.mistake(&written.span(), message));
    }
    own.card(document, (density * 1e3).round() / 1e3)
}

fn markers(document: &Document, texts: &Spanned<Vec<MarkersText>>) -> Result<Vec<MarkerGrid>, Mistake> {
    let mut grids = Vec::new();
    for text in texts.get_ref() {
        let names = ["x-", "x+", "y-", "y+", "z-", "z+"];
        let Some(k) = names.iter().position(|n| n == text.face.get_ref()) else {
            let message = format!("found face {:?}, expected one of {names:?}", text.face.get_ref());
            return Err(document.mistake(&text.face.span(), message));
        };
        let count = *text.count.get_ref();
        if count.iter().any(|n| !(1..=200).contains(n)) {
            let message = format!("found {count:?} markers, expected 1 to 200 each way");
            return Err(document.mistake(&text.count.span(), message));
        }
        grids.push(MarkerGrid {
            face: Face::ALL[k],
            count,
        });
    }
    if grids.is_empty() {
        return Err(document.mistake(&texts.span(), "found no [[markers]], expected at least one grid"));
    }
    Ok(grids)
}

fn probes(document: &Document, texts: &Spanned<Vec<ProbeText>>) -> Result<Vec<Probe>, Mistake> {
    let mut probes: Vec<Probe> = Vec::new();
    for text in texts.get_ref() {
        let name = text.name.get_ref().clone();
        // Names become files.
        if !is_id(&name) {
            let message = format!("found name {name:?}, expected lower-case letters, digits and hyphens");
            return Err(document.mistake(&text.name.span(), message));
        }
        if probes.iter().any(|p| p.name == name) {
            return Err(document.mistake(&text.name.span(), format!("the probe {name:?} stands twice")));
        }
        let contact = text.contact().read(document)?;
        check_forces(document, &text.forces_n)?;
        let along = match &text.drags {
            None => contact.direction,
            Some(written) => {
                let along = finite(document, written)?;
                if along.dot(&contact.direction) <= 1e-3 * along.norm() || along.norm() < 1e-9 {
                    let message =
                        "found a force that does not press, expected one with a part along the direction";
                    return Err(document.mistake(&written.span(), message));
                }
                along.normalize()
            }
        };
        probes.push(Probe {
            name,
            contact,
            forces: text.forces_n.get_ref().iter().map(|f| along * *f).collect(),
            held_out: text.held_out.unwrap_or(false),
        });
    }
    if probes.iter().all(|p| p.held_out) {
        let message = "found no [[probe]] to fit, expected at least one that is not held out";
        return Err(document.mistake(&texts.span(), message));
    }
    Ok(probes)
}
