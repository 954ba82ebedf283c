//! The material record: one TOML file per material.
//!
//! A record holds everything that is needed to use a material years later without its measurements: the law, the range
//! of strain it was fitted in, density, colour, what was measured and where that came from, how well the law answers
//! the measurement, what had to be assumed. `docs/formats.md` describes the file.

use super::hyperelastic::Form;
use super::law::LawError;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

use super::migrate::migrate;
pub use super::record_places::{field_error, line_of_field, read_toml, unknown_fields};

/// The version of the format that this program writes. It reads older ones too: [`super::migrate`].
pub const SCHEMA: u32 = 2;

/// The symmetry of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The same in all directions.
    Isotropic,
    /// The same in all directions about the z axis.
    TransverselyIsotropic,
}

impl Kind {
    /// The word of the file.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Isotropic => "isotropic",
            Kind::TransverselyIsotropic => "transversely-isotropic",
        }
    }

    /// Number of strain invariants.
    pub fn invariants(self) -> usize {
        match self {
            Kind::Isotropic => 3,
            Kind::TransverselyIsotropic => 4,
        }
    }

    /// Number of moduli, and of interpolated quantities.
    pub fn moduli(self) -> usize {
        match self {
            Kind::Isotropic => 2,
            Kind::TransverselyIsotropic => 5,
        }
    }
}

/// A material as it stands in `materials-db/ID.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialRecord {
    /// Version of the format.
    pub schema: u32,
    /// Which of the records of this id it is, from 1. A record never changes: other content is another version.
    #[serde(default)]
    pub version: u32,
    /// The file that the record was fitted from, relative to the database's folder: `coupons/ID.toml`, `sets/ID.toml`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recipe: Option<String>,
    /// SHA-256 of the file of the version before, in hexadecimal digits; none for version 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub previous_sha256: Option<String>,
    /// The name of the file without its ending: lower-case letters, digits and hyphens.
    pub id: String,
    /// The name for people.
    pub name: String,
    /// The symmetry.
    pub kind: Kind,
    /// Made up or estimated, not measured.
    pub synthetic: bool,
    /// Display colour, `#rrggbb`.
    pub colour: String,
    /// Mass per volume of the material as a block, holes included \[g/cm³\].
    pub density_g_per_cm3: f64,
    /// What the measurement does not say and the law needed.
    pub assumptions: Vec<String>,
    /// How an object of it can be made.
    pub printability: Printability,
    /// Where the measurement comes from.
    pub source: Source,
    /// The law.
    pub model: Model,
    /// How well the measurement determines the law's parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<Uncertainty>,
    /// What was measured, with the law's error. Empty for a synthetic material.
    #[serde(default)]
    pub measurements: Vec<Measurement>,
    /// Strains and the stresses that the law answered when the record was made.
    #[serde(default)]
    pub checks: Vec<CheckPair>,
}

/// How an object of a material can be made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Printability {
    /// Whether a multi-material printer can lay it down.
    pub printable: bool,
    /// How it is made, in a few words.
    pub process: String,
}

/// Where numbers come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Whom to cite.
    pub citation: String,
    /// Under which terms the data is given.
    pub licence: String,
    /// Where it lies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<String>,
}

/// What is made of the moduli at the centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Formulation {
    /// A secant stiffness: [`super::isotropic`], [`super::transverse`].
    #[default]
    Secant,
    /// An energy: [`super::energy`].
    Energy,
}

impl Formulation {
    fn is_secant(&self) -> bool {
        *self == Formulation::Secant
    }
}

/// The law's numbers: a strain-dependent stiffness, or a hyperelastic energy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Secant if the file says nothing.
    #[serde(default, skip_serializing_if = "Formulation::is_secant")]
    pub formulation: Formulation,
    /// The kernel's offset c of an energy, in strain; 0 if the file says nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    /// Constants of the interpolated quantities, `(V)`.
    pub constant: Vec<f64>,
    /// The fitted range of strain.
    pub range: ModelRange,
    /// The centres.
    pub centres: Vec<Centre>,
    /// A hyperelastic energy. Then there are no constants, no centres and no ranges of invariants.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hyperelastic: Option<Form>,
}

/// The fitted range of strain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelRange {
    /// Least and largest engineering strain of the uniaxial tests (along z).
    pub engineering_strain: [f64; 2],
    /// Lower ends of the invariants, `(D)`.
    pub low: Vec<f64>,
    /// Upper ends of the invariants, `(D)`.
    pub high: Vec<f64>,
}

/// One centre of the interpolation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Centre {
    /// Strain invariants, `(D)`.
    pub invariants: Vec<f64>,
    /// Moduli there, for people \[MPa\]: shear and bulk, or E11 E12 E13 E33 E44.
    pub moduli_mpa: Vec<f64>,
    /// Weights, `(V)`.
    pub weights: Vec<f64>,
}

/// One test of a specimen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// The test, as `uniaxial-compression`.
    pub test: String,
    /// The specimen.
    pub specimen: String,
    /// When it was tested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// The file of the raw data in the source.
    pub file: String,
    /// Strain fitted: engineering strain, or shear.
    pub strain: [f64; 2],
    /// Points compared.
    pub points: usize,
    /// Root mean square of the law's stress error over that of the measured stress.
    pub relative_rms: f64,
    /// The same for the lateral strain, where it was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lateral_relative_rms: Option<f64>,
    /// For a probe's test: root mean square of the displacement errors \[mm\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_mm: Option<f64>,
    /// For a probe's test: the largest displacement error \[mm\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_mm: Option<f64>,
}

/// How well a measurement determines the parameters of a law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// Names of the parameters that were fitted, `(n)`, as [`super::law::Law::parameters`] names and orders them.
    pub parameters: Vec<String>,
    /// Their covariance `(n × n)`, in products of the parameters' units.
    pub covariance: Vec<Vec<f64>>,
    /// Where it comes from, in words: "residuals", "bootstrap of 200".
    pub basis: String,
}

impl Uncertainty {
    /// Standard deviations of the parameters, `(n)`, in their units.
    pub fn deviations(&self) -> Vec<f64> {
        let diagonal = |(i, row): (usize, &Vec<f64>)| row.get(i).copied().unwrap_or(f64::NAN).sqrt();
        self.covariance.iter().enumerate().map(diagonal).collect()
    }
}

/// A strain and the stress that the law answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CheckPair {
    /// Biot strain, Mandel notation.
    pub strain: [f64; 6],
    /// Biot stress \[MPa\], Mandel notation.
    pub stress_mpa: [f64; 6],
}

/// Why a record could not be read or used.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file can't be read.
    #[error("{}: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is no TOML, or a field is missing or of the wrong type.
    #[error("{}, line {line}: {message}", file.display())]
    Syntax {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A field holds what can't be right.
    #[error("{}, line {line}: {field} = {value}: expected {expected}", file.display())]
    Field {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// Path of the field, as `model.centres[2].weights`.
        field: String,
        /// The value found.
        value: String,
        /// What was expected.
        expected: String,
    },
    /// The numbers make no law.
    #[error("{id}: {source}")]
    Law {
        /// The record.
        id: String,
        /// Why.
        source: LawError,
    },
}

/// What a file says that is not quite right but does not stop its use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unknown {
    /// The line, from 1.
    pub line: usize,
    /// Path of the field that this version does not know.
    pub field: String,
}

impl MaterialRecord {
    /// Reads a record from the text of its file, whatever schema it is in; `file` is for messages. Also answers which fields
    /// it did not know.
    ///
    /// # Errors
    /// No TOML, a missing field, a wrong type, a schema that this version does not know, lists whose length does not fit the
    /// kind.
    pub fn parse(text: &str, file: &Path) -> Result<(Self, Vec<Unknown>), RecordError> {
        let mut record: MaterialRecord = read_toml(text, file)?;
        let unknown = unknown_fields(text, &record);
        migrate(&mut record, text, file)?;
        record.check_lengths(text, file)?;
        Ok((record, unknown))
    }

    fn check_lengths(&self, text: &str, file: &Path) -> Result<(), RecordError> {
        let kind = self.kind.word();
        let (d, v) = match &self.model.hyperelastic {
            None => (self.kind.invariants(), self.kind.moduli()),
            Some(_) => (0, 0),
        };
        let isotropic_only = self.model.hyperelastic.is_some() || !self.model.formulation.is_secant();
        if isotropic_only && self.kind != Kind::Isotropic {
            let expected = "isotropic, for a law with an energy";
            return Err(field_error(text, file, "kind", &kind, expected));
        }
        if let (Some(_), Some(_)) = (&self.model.hyperelastic, self.model.centres.first()) {
            let expected = "none beside model.hyperelastic";
            return Err(field_error(text, file, "model.centres", &"some", expected));
        }
        let wrong = |field: String, list: &[f64], length: usize| {
            let expected = format!("{length} numbers, for a material that is {kind}");
            Err(field_error(text, file, &field, &format!("{list:?}"), &expected))
        };
        let lists = [
            ("model.constant", &self.model.constant, v),
            ("model.range.low", &self.model.range.low, d),
            ("model.range.high", &self.model.range.high, d),
        ];
        for (field, list, length) in lists {
            if list.len() != length {
                return wrong(field.into(), list, length);
            }
        }
        for (i, centre) in self.model.centres.iter().enumerate() {
            let lists = [
                ("invariants", &centre.invariants, d),
                ("moduli_mpa", &centre.moduli_mpa, v),
                ("weights", &centre.weights, v),
            ];
            for (field, list, length) in lists {
                if list.len() != length {
                    return wrong(format!("model.centres[{i}].{field}"), list, length);
                }
            }
        }
        let Some(uncertainty) = &self.uncertainty else {
            return Ok(());
        };
        let n = uncertainty.parameters.len();
        let square =
            uncertainty.covariance.len() == n && uncertainty.covariance.iter().all(|row| row.len() == n);
        if !square {
            let found = format!("{} rows", uncertainty.covariance.len());
            let expected = format!("{n} rows of {n} numbers, one for each of uncertainty.parameters");
            return Err(field_error(
                text,
                file,
                "uncertainty.covariance",
                &found,
                &expected,
            ));
        }
        Ok(())
    }

    /// The largest relative error over all tests; none for a material that was not measured.
    pub fn relative_rms(&self) -> Option<f64> {
        self.measurements
            .iter()
            .map(|m| m.relative_rms)
            .fold(None, |worst, e| Some(worst.map_or(e, |w: f64| w.max(e))))
    }

    /// The file's text.
    ///
    /// # Errors
    /// If a value can't be written as TOML.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        let (invariants, moduli) = match self.kind {
            Kind::Isotropic => ("tr e/sqrt(3), |dev e|, |dev e| cos 3theta", "shear, bulk"),
            Kind::TransverselyIsotropic => (
                "axial strain, in-plane area strain/sqrt(2), |in-plane deviator|, |axial shear|",
                "E11, E12, E13, E33, E44",
            ),
        };
        let body = toml::to_string(self)?;
        Ok(format!(
            "# A material of pliant; docs/formats.md describes the fields.\n\
             # invariants: {invariants}\n# moduli_mpa: {moduli}\n{body}"
        ))
    }
}

/// `x` rounded to so many digits after the point.
pub fn rounded(x: f64, digits: i32) -> f64 {
    let scale = 10.0_f64.powi(digits);
    (x * scale).round() / scale
}

/// `x` rounded to so many significant digits.
pub fn significant(x: f64, digits: usize) -> f64 {
    format!("{x:.*e}", digits.saturating_sub(1)).parse().unwrap_or(x)
}
