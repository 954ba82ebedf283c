//! The material record: one TOML file per material.
//!
//! A record holds everything that is needed to use a material years later without its measurements: the law, the range
//! of strain it was fitted in, density, colour, what was measured and where that came from, how well the law answers
//! the measurement, what had to be assumed. `docs/formats.md` describes the file.

use super::energy::EnergyRbf;
use super::hyperelastic::{Form, Hyperelastic};
use super::isotropic::IsotropicRbf;
use super::law::{Law, LawError, Range};
use super::transverse::{TransverseModuli, TransverseRbf};
use crate::math::multiquadric::Multiquadric;
use crate::math::rbf::LinearRbf;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

pub use super::record_places::{field_error, line_of_field, read_toml, unknown_fields};

/// The version of the record that this program reads and writes.
pub const SCHEMA: u32 = 1;

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
    /// Reads a record from the text of its file; `file` is for messages. Also answers which fields it did not know.
    ///
    /// # Errors
    /// No TOML, a missing field, a wrong type, another schema version, lists whose length does not fit the kind.
    pub fn parse(text: &str, file: &Path) -> Result<(Self, Vec<Unknown>), RecordError> {
        let record: MaterialRecord = read_toml(text, file)?;
        if record.schema != SCHEMA {
            return Err(field_error(
                text,
                file,
                "schema",
                &record.schema,
                &format!("{SCHEMA}"),
            ));
        }
        record.check_lengths(text, file)?;
        let unknown = unknown_fields(text, &record);
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
        Ok(())
    }

    /// The law of the stored weights, axis along z.
    ///
    /// # Errors
    /// Numbers that make no law; the message names the record.
    pub fn law(&self) -> Result<Law, RecordError> {
        let named = |source| RecordError::Law {
            id: self.id.clone(),
            source,
        };
        let model = &self.model;
        if let Some(form) = &model.hyperelastic {
            let law = Hyperelastic::new(form.clone());
            return law.map(Law::Hyperelastic).map_err(named);
        }
        match self.kind {
            Kind::Isotropic if model.formulation == Formulation::Energy => {
                let range = model.range.invariants::<3>().map_err(named)?;
                let rbf = model.interpolant::<3, 2>().map_err(named)?;
                let smooth = Multiquadric {
                    centres: rbf.centres,
                    weights: rbf.weights,
                    constant: rbf.constant,
                    offset: model.offset.unwrap_or(0.0),
                };
                let law = EnergyRbf::from_weights(smooth, range);
                law.map(|law| Law::Energy(Box::new(law))).map_err(named)
            }
            Kind::Isotropic => {
                let range = model.range.invariants::<3>().map_err(named)?;
                let law = IsotropicRbf::from_weights(model.interpolant::<3, 2>().map_err(named)?, range);
                law.map(Law::Isotropic).map_err(named)
            }
            Kind::TransverselyIsotropic => {
                let range = model.range.invariants::<4>().map_err(named)?;
                let law = TransverseRbf::from_weights(model.interpolant::<4, 5>().map_err(named)?, range);
                law.map(|law| Law::TransverselyIsotropic(Box::new(law)))
                    .map_err(named)
            }
        }
    }

    /// The law that the moduli at the centres make, for comparison with the stored weights.
    ///
    /// # Errors
    /// Moduli that make no law.
    pub fn law_from_moduli(&self) -> Result<Law, RecordError> {
        let named = |source| RecordError::Law {
            id: self.id.clone(),
            source,
        };
        let model = &self.model;
        if model.hyperelastic.is_some() {
            return self.law();
        }
        match self.kind {
            Kind::Isotropic if model.formulation == Formulation::Energy => {
                let (centres, moduli) = model.rows::<3, 2>().map_err(named)?;
                let range = model.range.invariants::<3>().map_err(named)?;
                EnergyRbf::interpolating(&centres, &moduli, model.offset.unwrap_or(0.0), range)
                    .map(|law| Law::Energy(Box::new(law)))
                    .map_err(named)
            }
            Kind::Isotropic => {
                let (centres, moduli) = model.rows::<3, 2>().map_err(named)?;
                let range = model.range.invariants::<3>().map_err(named)?;
                IsotropicRbf::interpolating(&centres, &moduli, range)
                    .map(Law::Isotropic)
                    .map_err(named)
            }
            Kind::TransverselyIsotropic => {
                let (centres, moduli) = model.rows::<4, 5>().map_err(named)?;
                let moduli: Vec<_> = moduli.into_iter().map(TransverseModuli::from_array).collect();
                let range = model.range.invariants::<4>().map_err(named)?;
                TransverseRbf::interpolating(&centres, &moduli, range)
                    .map(|law| Law::TransverselyIsotropic(Box::new(law)))
                    .map_err(named)
            }
        }
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

type Rows<const D: usize, const V: usize> = (Vec<[f64; D]>, Vec<[f64; V]>);

fn fixed<const N: usize>(list: &[f64]) -> Result<[f64; N], LawError> {
    list.try_into()
        .map_err(|_| LawError::Weights(format!("{} numbers where {N} belong", list.len())))
}

impl ModelRange {
    /// The box of the law.
    fn invariants<const D: usize>(&self) -> Result<Range<D>, LawError> {
        Range::new(fixed(&self.low)?, fixed(&self.high)?)
    }
}

impl Model {
    fn interpolant<const D: usize, const V: usize>(&self) -> Result<LinearRbf<D, V>, LawError> {
        let centres = self
            .centres
            .iter()
            .map(|c| fixed(&c.invariants))
            .collect::<Result<_, _>>()?;
        let weights = self
            .centres
            .iter()
            .map(|c| fixed(&c.weights))
            .collect::<Result<_, _>>()?;
        Ok(LinearRbf {
            centres,
            weights,
            constant: fixed(&self.constant)?,
        })
    }

    fn rows<const D: usize, const V: usize>(&self) -> Result<Rows<D, V>, LawError> {
        let centres = self
            .centres
            .iter()
            .map(|c| fixed(&c.invariants))
            .collect::<Result<_, _>>()?;
        let moduli = self
            .centres
            .iter()
            .map(|c| fixed(&c.moduli_mpa))
            .collect::<Result<_, _>>()?;
        Ok((centres, moduli))
    }

    /// The stored form of a law.
    ///
    /// # Errors
    /// [`LawError::Unrecorded`] for the papers' form.
    pub fn of(law: &Law, engineering_strain: [f64; 2]) -> Result<Self, LawError> {
        let range = ModelRange {
            engineering_strain,
            low: Vec::new(),
            high: Vec::new(),
        };
        let mut model = Model {
            formulation: Formulation::Secant,
            offset: None,
            constant: Vec::new(),
            range,
            centres: Vec::new(),
            hyperelastic: None,
        };
        match law {
            Law::Isotropic(law) => {
                let rbf = law.log_moduli();
                model.set(&rbf.constant, law.range());
                model.centres = rows(&rbf.centres, &rbf.weights, |q| {
                    rbf.value(q).map(f64::exp).to_vec()
                });
            }
            Law::TransverselyIsotropic(law) => {
                let rbf = law.parameters();
                let moduli = |q: &_| {
                    TransverseModuli::from_parameters(&rbf.value(q))
                        .to_array()
                        .to_vec()
                };
                model.set(&rbf.constant, law.range());
                model.centres = rows(&rbf.centres, &rbf.weights, moduli);
            }
            Law::Energy(law) => {
                let rbf = law.log_moduli();
                model.formulation = Formulation::Energy;
                model.offset = Some(rbf.offset);
                model.set(&rbf.constant, law.range());
                model.centres = rows(&rbf.centres, &rbf.weights, |q| {
                    rbf.value(q).map(f64::exp).to_vec()
                });
            }
            Law::Hyperelastic(law) => model.hyperelastic = Some(law.form().clone()),
            Law::Paper(_) => return Err(LawError::Unrecorded),
        }
        Ok(model)
    }

    fn set<const D: usize>(&mut self, constant: &[f64], range: &Range<D>) {
        self.constant = constant.to_vec();
        self.range.low = range.low().to_vec();
        self.range.high = range.high().to_vec();
    }
}

fn rows<const D: usize, const V: usize>(
    centres: &[[f64; D]],
    weights: &[[f64; V]],
    moduli: impl Fn(&[f64; D]) -> Vec<f64>,
) -> Vec<Centre> {
    let centre = |(q, w): (&[f64; D], &[f64; V])| Centre {
        invariants: q.to_vec(),
        // Twelve digits: for people, and without the last bits' noise of exp and ln.
        moduli_mpa: moduli(q).iter().map(|&m| significant(m, 12)).collect(),
        weights: w.to_vec(),
    };
    centres.iter().zip(weights).map(centre).collect()
}

/// `x` rounded to so many significant digits.
pub fn significant(x: f64, digits: usize) -> f64 {
    format!("{x:.*e}", digits.saturating_sub(1)).parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::hyperelastic::{FoamTerm, OgdenTerm, VolumeEnergy};
    use crate::math::mandel::Mandel;

    fn round_trip(law: &Law) -> Law {
        let file = Path::new("a.toml");
        let text = include_str!("../../materials-db/body-double-silk.toml");
        let (mut record, _) = MaterialRecord::parse(text, file).unwrap();
        record.model = Model::of(law, [-0.3, 0.3]).unwrap();
        let (read, unknown) = MaterialRecord::parse(&record.to_toml().unwrap(), file).unwrap();
        assert!(unknown.is_empty(), "{unknown:?}");
        assert_eq!(read.model, record.model);
        read.law().unwrap()
    }

    #[test]
    fn laws_with_an_energy_come_back_from_their_file() {
        let centres = [[0.0, 0.0, 0.0], [-0.05, 0.2, -0.2]];
        let range = Range::new([-0.1, 0.0, -0.3], [0.0, 0.3, 0.0]).unwrap();
        let energy = EnergyRbf::interpolating(&centres, &[[0.1, 0.2], [0.3, 0.4]], 0.1, range).unwrap();
        let foam = Form::Hyperfoam {
            terms: vec![FoamTerm {
                shear_mpa: 0.1,
                exponent: 4.0,
                poisson: 0.1,
            }],
        };
        let ogden = Form::Ogden {
            terms: vec![OgdenTerm {
                shear_mpa: 0.1,
                exponent: 1.5,
            }],
            volume: VolumeEnergy::Powers(vec![1.0, 0.2]),
        };
        let strain = Mandel::new(-0.1, 0.02, 0.05, 0.1, 0.0, 0.03);
        for law in [
            Law::Energy(Box::new(energy)),
            Law::Hyperelastic(Hyperelastic::new(foam).unwrap()),
            Law::Hyperelastic(Hyperelastic::new(ogden).unwrap()),
        ] {
            assert_eq!(round_trip(&law).stress(&strain), law.stress(&strain));
        }
    }
}
