//! A constitutive law as people write it, in TOML.
//!
//! ```toml
//! law = "linear"         # the default: young, poisson (or shear, bulk)
//! law = "transverse"     # young_axial, young_plane, poisson_axial, poisson_plane, shear_axial; or e11 e12 e13 e33 e44; axis
//! law = "neo-hookean"    # form = "logarithmic" | "isochoric"; young + poisson, shear + bulk, shear + lame_lambda, c10 + d1
//! law = "mooney-rivlin"  # c10, c01, bulk or d1
//! law = "ogden"          # terms = [{ shear = "0.4 MPa", exponent = 1.3 }], bulk or d = ["0.02 1/MPa"];
//!                        # convention = "abaqus" | "febio" | "classic", volume = "powers" | "logarithm"
//! law = "hyperfoam"      # terms = [{ shear = "0.2 MPa", exponent = 8.0, poisson = 0.1 }]
//! law = "rbf"            # form = "secant" | "energy" | "paper"; see super::law_text_rbf
//! ```
//!
//! Quantities are strings with a unit, numbers have none. Each law refuses the fields of the others, so that nothing that
//! is written is passed over.

use super::hyperelastic::{FoamTerm, Form, Hyperelastic, OgdenTerm, VolumeEnergy};
use super::isotropic::{IsotropicRbf, young};
use super::law::{Law, LawError};
use super::transverse::{TransverseModuli, TransverseRbf};
use crate::math::Vec3;
use crate::units::{self, UnitError};
use serde::Deserialize;
use std::ops::Range;
use toml::Spanned;

/// A quantity with its unit, at its place in the file.
pub type Quantity = Option<Spanned<String>>;
/// A number, at its place in the file.
pub type Number = Option<Spanned<f64>>;

/// What a law is made of; which fields belong to which law stands at the head of the module.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LawText {
    /// The name under which a file holds the material; the law does not use it.
    pub id: Option<Spanned<String>>,
    /// Mass per volume; the law does not use it.
    pub density: Quantity,
    /// The law; `linear` if nothing is said.
    pub law: Option<Spanned<String>>,
    /// Which form of the law.
    pub form: Option<Spanned<String>>,
    /// Young's modulus.
    pub young: Quantity,
    /// Poisson's ratio.
    pub poisson: Number,
    /// Shear modulus.
    pub shear: Quantity,
    /// Bulk modulus.
    pub bulk: Quantity,
    /// Lamé's λ.
    pub lame_lambda: Quantity,
    /// C10.
    pub c10: Quantity,
    /// C01.
    pub c01: Quantity,
    /// D1, an inverse modulus: K = 2/D1.
    pub d1: Quantity,
    /// D1, D2, … of an Ogden law.
    pub d: Option<Spanned<Vec<String>>>,
    /// Which program's Ogden coefficients the terms hold.
    pub convention: Option<Spanned<String>>,
    /// Which energy of volume an Ogden law has.
    pub volume: Option<Spanned<String>>,
    /// Terms of an Ogden or hyperfoam law.
    pub terms: Option<Spanned<Vec<TermText>>>,
    /// Young's modulus along the axis.
    pub young_axial: Quantity,
    /// Young's modulus across the axis.
    pub young_plane: Quantity,
    /// Poisson's ratio for load along the axis.
    pub poisson_axial: Number,
    /// Poisson's ratio in the plane.
    pub poisson_plane: Number,
    /// Shear modulus of planes that hold the axis.
    pub shear_axial: Quantity,
    /// E11 of Bickel 2010, (8.5).
    pub e11: Quantity,
    /// E12.
    pub e12: Quantity,
    /// E13.
    pub e13: Quantity,
    /// E33.
    pub e33: Quantity,
    /// E44.
    pub e44: Quantity,
    /// The axis of symmetry; z if nothing is said.
    pub axis: Option<Spanned<[f64; 3]>>,
    /// Centres of an interpolation.
    pub centres: Option<Spanned<Vec<CentreText>>>,
    /// The fitted range of an interpolation's invariants.
    pub range: Option<Spanned<RangeText>>,
    /// The kernel's offset of an energy, in strain.
    pub offset: Number,
    /// The norm of strain in the papers' form: `vector` or `tensor`.
    pub norm: Option<Spanned<String>>,
    /// Whether the papers' form has a constant term.
    pub constant: Option<Spanned<bool>>,
}

/// One term of an Ogden or hyperfoam law.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TermText {
    /// The modulus, in the law's convention.
    pub shear: Spanned<String>,
    /// The exponent.
    pub exponent: f64,
    /// Poisson's ratio, of a foam's term.
    pub poisson: Option<f64>,
}

/// One centre of an interpolation: a strain or its invariants, and moduli.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CentreText {
    /// Strain components xx yy zz yz xz xy (tensor shears).
    pub strain: Option<[f64; 6]>,
    /// Invariants of the law, three or four.
    pub invariants: Option<Vec<f64>>,
    /// Moduli in the order that the law names, with units (a Poisson's ratio without).
    pub moduli: Vec<String>,
}

/// A box of invariants.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RangeText {
    /// Lower ends.
    pub low: Vec<f64>,
    /// Upper ends.
    pub high: Vec<f64>,
}

/// What is wrong with a law, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}: {message}")]
pub struct LawTextError {
    /// The field.
    pub field: String,
    /// The bytes of the file where it stands; none if it, and the word `law`, are missing.
    pub span: Option<Range<usize>>,
    /// What was found and what was expected.
    pub message: String,
}

impl LawText {
    /// The law.
    ///
    /// # Errors
    /// An unknown law or form, a field that is missing, does not belong to the law, has no unit, or makes no material.
    pub fn law(&self) -> Result<Law, LawTextError> {
        let word = self.law.as_ref().map_or("linear", |w| w.get_ref().as_str());
        match word {
            "linear" => self.linear(),
            "transverse" => self.transverse(),
            "neo-hookean" => self.neo_hookean(),
            "mooney-rivlin" => self.mooney_rivlin(),
            "ogden" => self.ogden(),
            "hyperfoam" => self.hyperfoam(),
            "rbf" => self.rbf(),
            _ => Err(self.fail(
                "law",
                format!(
                    "found {word:?}, expected linear, transverse, neo-hookean, mooney-rivlin, ogden, hyperfoam or rbf"
                ),
            )),
        }
    }

    fn linear(&self) -> Result<Law, LawTextError> {
        self.only("linear", &["young", "poisson", "shear", "bulk"])?;
        if self.young.is_some() || self.shear.is_none() {
            let young = self.need("young", &self.young, units::stress)?;
            let poisson = self.need_number("poisson", &self.poisson)?;
            let law = IsotropicRbf::linear(young, poisson).map_err(|e| {
                let about_poisson = matches!(e, LawError::Poisson(_));
                self.fail(if about_poisson { "poisson" } else { "young" }, e.to_string())
            })?;
            return Ok(Law::Isotropic(law));
        }
        let (shear, bulk) = self.shear_and_bulk()?;
        let law = IsotropicRbf::linear(young(shear, bulk), super::isotropic::poisson(shear, bulk));
        law.map(Law::Isotropic)
            .map_err(|e| self.fail("shear", e.to_string()))
    }

    fn transverse(&self) -> Result<Law, LawTextError> {
        let stiffness = ["e11", "e12", "e13", "e33", "e44", "axis"];
        let engineering = [
            "young_axial",
            "young_plane",
            "poisson_axial",
            "poisson_plane",
            "shear_axial",
            "axis",
        ];
        let (moduli, place) = if self.e11.is_some() {
            self.only("transverse with e11", &stiffness)?;
            let moduli = TransverseModuli {
                e11: self.need("e11", &self.e11, units::stress)?,
                e12: self.need("e12", &self.e12, units::stress)?,
                e13: self.need("e13", &self.e13, units::stress)?,
                e33: self.need("e33", &self.e33, units::stress)?,
                e44: self.need("e44", &self.e44, units::stress)?,
            };
            (Ok(moduli), "e11")
        } else {
            self.only("transverse", &engineering)?;
            let moduli = TransverseModuli::from_engineering(
                self.need("young_axial", &self.young_axial, units::stress)?,
                self.need("young_plane", &self.young_plane, units::stress)?,
                self.need_number("poisson_axial", &self.poisson_axial)?,
                self.need_number("poisson_plane", &self.poisson_plane)?,
                self.need("shear_axial", &self.shear_axial, units::stress)?,
            );
            (moduli, "young_axial")
        };
        let law = moduli
            .and_then(|m| TransverseRbf::linear(&m))
            .map_err(|e| self.fail(place, e.to_string()))?;
        self.turned(Law::TransverselyIsotropic(Box::new(law)))
    }

    fn neo_hookean(&self) -> Result<Law, LawTextError> {
        let fields = [
            "form",
            "young",
            "poisson",
            "shear",
            "bulk",
            "lame_lambda",
            "c10",
            "d1",
        ];
        self.only("neo-hookean", &fields)?;
        let (shear_mpa, bulk_mpa) = self.shear_and_bulk()?;
        let form = match self.word("form", &self.form, &["logarithmic", "isochoric"])? {
            "isochoric" => Form::NeoHookeanIsochoric { shear_mpa, bulk_mpa },
            _ => Form::NeoHookeanLogarithmic {
                shear_mpa,
                lame_lambda_mpa: bulk_mpa - 2.0 / 3.0 * shear_mpa,
            },
        };
        self.hyperelastic(form)
    }

    fn mooney_rivlin(&self) -> Result<Law, LawTextError> {
        self.only("mooney-rivlin", &["c10", "c01", "bulk", "d1"])?;
        self.hyperelastic(Form::MooneyRivlin {
            c10_mpa: self.need("c10", &self.c10, units::stress)?,
            c01_mpa: self.need("c01", &self.c01, units::stress)?,
            bulk_mpa: self.bulk()?,
        })
    }

    fn ogden(&self) -> Result<Law, LawTextError> {
        self.only("ogden", &["terms", "bulk", "d1", "d", "convention", "volume"])?;
        let conventions = ["abaqus", "febio", "classic"];
        let convention = match &self.convention {
            None => "abaqus",
            some => self.word("convention", some, &conventions)?,
        };
        let mut terms = Vec::new();
        for (i, term) in self.terms()?.iter().enumerate() {
            if term.poisson.is_some() {
                let message = "an Ogden term has no Poisson's ratio; hyperfoam's has";
                return Err(self.fail(&format!("terms[{i}].poisson"), message.into()));
            }
            let modulus = self.term_shear(i, term)?;
            // 2μ/α² of this form is c/m² of FEBio's and μ/α of Ogden's own.
            let shear_mpa = match convention {
                "febio" => 0.5 * modulus,
                "classic" => 0.5 * modulus * term.exponent,
                _ => modulus,
            };
            terms.push(OgdenTerm {
                shear_mpa,
                exponent: term.exponent,
            });
        }
        let default = if convention == "febio" {
            "logarithm"
        } else {
            "powers"
        };
        let volume = match &self.volume {
            None => default,
            some => self.word("volume", some, &["powers", "logarithm"])?,
        };
        let volume = match (volume, &self.d) {
            ("logarithm", None) => VolumeEnergy::Logarithm(self.bulk()?),
            ("logarithm", Some(_)) => {
                return Err(self.fail("d", "belongs to volume = \"powers\"".into()));
            }
            (_, None) => VolumeEnergy::Powers(vec![0.5 * self.bulk()?]),
            (_, Some(list)) => {
                let read = |text: &String| {
                    let d = units::compliance(text).map_err(|e| self.fail("d", e.to_string()))?;
                    // Other programs write 0 for a term that is not there.
                    Ok(if d == 0.0 { 0.0 } else { 1.0 / d })
                };
                VolumeEnergy::Powers(list.get_ref().iter().map(read).collect::<Result<_, _>>()?)
            }
        };
        self.hyperelastic(Form::Ogden { terms, volume })
    }

    fn hyperfoam(&self) -> Result<Law, LawTextError> {
        self.only("hyperfoam", &["terms", "poisson"])?;
        let mut terms = Vec::new();
        for (i, term) in self.terms()?.iter().enumerate() {
            let common = self.poisson.as_ref().map(|p| *p.get_ref());
            let Some(poisson) = term.poisson.or(common) else {
                let message = "missing: expected a number such as 0.1, here or once beside terms";
                return Err(self.fail(&format!("terms[{i}].poisson"), message.into()));
            };
            terms.push(FoamTerm {
                shear_mpa: self.term_shear(i, term)?,
                exponent: term.exponent,
                poisson,
            });
        }
        self.hyperelastic(Form::Hyperfoam { terms })
    }

    fn hyperelastic(&self, form: Form) -> Result<Law, LawTextError> {
        Hyperelastic::new(form)
            .map(Law::Hyperelastic)
            .map_err(|e| match e {
                LawError::Coefficient {
                    field,
                    value,
                    expected,
                } => self.fail(&field, format!("found {value}, expected {expected}")),
                other => self.fail("law", other.to_string()),
            })
    }

    fn term_shear(&self, i: usize, term: &TermText) -> Result<f64, LawTextError> {
        units::stress(term.shear.get_ref()).map_err(|e| LawTextError {
            field: format!("terms[{i}].shear"),
            span: Some(term.shear.span()),
            message: e.to_string(),
        })
    }

    fn terms(&self) -> Result<&[TermText], LawTextError> {
        match &self.terms {
            Some(terms) => Ok(terms.get_ref()),
            None => Err(self.fail(
                "terms",
                "missing: expected terms = [{ shear = \"0.1 MPa\", exponent = 2.0 }]".into(),
            )),
        }
    }

    /// Shear and bulk modulus from any of the pairs that are written.
    fn shear_and_bulk(&self) -> Result<(f64, f64), LawTextError> {
        if self.young.is_some() {
            for (name, given) in [("shear", &self.shear), ("bulk", &self.bulk), ("c10", &self.c10)] {
                if given.is_some() {
                    return Err(self.fail(name, "one modulus too many beside young and poisson".into()));
                }
            }
            let young = self.need("young", &self.young, units::stress)?;
            let poisson = self.need_number("poisson", &self.poisson)?;
            return super::isotropic::shear_and_bulk(young, poisson).map_err(|e| {
                let about_poisson = matches!(e, LawError::Poisson(_));
                self.fail(if about_poisson { "poisson" } else { "young" }, e.to_string())
            });
        }
        let shear = match (&self.shear, &self.c10) {
            (Some(_), Some(_)) => return Err(self.fail("c10", "one modulus too many beside shear".into())),
            (None, Some(_)) => 2.0 * self.need("c10", &self.c10, units::stress)?,
            _ => self.need("shear", &self.shear, units::stress)?,
        };
        if self.lame_lambda.is_some() {
            let lambda = self.need("lame_lambda", &self.lame_lambda, units::stress)?;
            return Ok((shear, lambda + 2.0 / 3.0 * shear));
        }
        if let Some(poisson) = &self.poisson {
            let poisson = *poisson.get_ref();
            let young = 2.0 * shear * (1.0 + poisson);
            return super::isotropic::shear_and_bulk(young, poisson)
                .map_err(|e| self.fail("poisson", e.to_string()));
        }
        Ok((shear, self.bulk()?))
    }

    /// The bulk modulus, as such or as D1 = 2/K.
    fn bulk(&self) -> Result<f64, LawTextError> {
        if self.d1.is_none() {
            return self.need("bulk", &self.bulk, units::stress);
        }
        if self.bulk.is_some() {
            return Err(self.fail("d1", "one modulus too many beside bulk".into()));
        }
        let d1 = self.need("d1", &self.d1, units::compliance)?;
        if d1 > 0.0 {
            Ok(2.0 / d1)
        } else {
            Err(self.fail(
                "d1",
                format!("found {d1} 1/MPa, expected a positive number: an incompressible material has no bulk modulus"),
            ))
        }
    }

    pub(super) fn turned(&self, law: Law) -> Result<Law, LawTextError> {
        let Some(axis) = &self.axis else { return Ok(law) };
        let axis = Vec3::from(*axis.get_ref());
        if !(axis.norm() > 0.0 && axis.norm().is_finite()) {
            let found = format!("found {:?}, expected a direction", axis.as_slice());
            return Err(self.fail("axis", found));
        }
        Ok(law.rotated(&axis))
    }

    /// Refuses every field that is not in `fields`.
    pub(super) fn only(&self, law: &str, fields: &[&str]) -> Result<(), LawTextError> {
        for (name, span) in self.places() {
            let expected = ["id", "density", "law"].contains(&name) || fields.contains(&name);
            if let (Some(_), false) = (span, expected) {
                let message = format!(
                    "no field of a material that is {law}: expected {}",
                    fields.join(", ")
                );
                return Err(self.fail(name, message));
            }
        }
        Ok(())
    }

    pub(super) fn need(
        &self,
        name: &str,
        text: &Quantity,
        read: impl Fn(&str) -> Result<f64, UnitError>,
    ) -> Result<f64, LawTextError> {
        match text {
            Some(text) => read(text.get_ref()).map_err(|e| self.fail(name, e.to_string())),
            None => Err(self.fail(name, "missing: expected a quantity with its unit".into())),
        }
    }

    fn need_number(&self, name: &str, number: &Number) -> Result<f64, LawTextError> {
        match number {
            Some(number) if number.get_ref().is_finite() => Ok(*number.get_ref()),
            Some(number) => Err(self.fail(
                name,
                format!("found {}, expected a finite number", number.get_ref()),
            )),
            None => Err(self.fail(name, "missing: expected a number".into())),
        }
    }

    /// One of `words`; the first of them stands in the message for a missing one.
    pub(super) fn word(
        &self,
        name: &str,
        text: &Option<Spanned<String>>,
        words: &[&'static str],
    ) -> Result<&'static str, LawTextError> {
        let found = text.as_ref().map(|t| t.get_ref().as_str());
        let known = found.and_then(|f| words.iter().find(|w| **w == f));
        match known {
            Some(word) => Ok(word),
            None => {
                let found = found.map_or("missing".to_string(), |f| format!("found {f:?}"));
                Err(self.fail(name, format!("{found}, expected {}", words.join(" or "))))
            }
        }
    }

    /// An error at the place of a field, or of its list (`terms[1].shear` stands in `terms`), or of the word `law`.
    pub(super) fn fail(&self, field: &str, message: String) -> LawTextError {
        let head = field.split(['[', '.']).next().unwrap_or(field);
        let places = self.places();
        let at = |name: &str| {
            let place = places.iter().find(|(n, _)| *n == name);
            place.and_then(|(_, span)| span.clone())
        };
        LawTextError {
            field: field.to_string(),
            span: at(head).or_else(|| at("law")).or_else(|| at("id")),
            message,
        }
    }

    fn places(&self) -> Vec<(&'static str, Option<Range<usize>>)> {
        fn span<T>(value: &Option<Spanned<T>>) -> Option<Range<usize>> {
            value.as_ref().map(Spanned::span)
        }
        vec![
            ("id", span(&self.id)),
            ("density", span(&self.density)),
            ("law", span(&self.law)),
            ("form", span(&self.form)),
            ("young", span(&self.young)),
            ("poisson", span(&self.poisson)),
            ("shear", span(&self.shear)),
            ("bulk", span(&self.bulk)),
            ("lame_lambda", span(&self.lame_lambda)),
            ("c10", span(&self.c10)),
            ("c01", span(&self.c01)),
            ("d1", span(&self.d1)),
            ("d", span(&self.d)),
            ("convention", span(&self.convention)),
            ("volume", span(&self.volume)),
            ("terms", span(&self.terms)),
            ("young_axial", span(&self.young_axial)),
            ("young_plane", span(&self.young_plane)),
            ("poisson_axial", span(&self.poisson_axial)),
            ("poisson_plane", span(&self.poisson_plane)),
            ("shear_axial", span(&self.shear_axial)),
            ("e11", span(&self.e11)),
            ("e12", span(&self.e12)),
            ("e13", span(&self.e13)),
            ("e33", span(&self.e33)),
            ("e44", span(&self.e44)),
            ("axis", span(&self.axis)),
            ("centres", span(&self.centres)),
            ("range", span(&self.range)),
            ("offset", span(&self.offset)),
            ("norm", span(&self.norm)),
            ("constant", span(&self.constant)),
        ]
    }
}

#[cfg(test)]
#[path = "law_text_tests.rs"]
mod tests;
