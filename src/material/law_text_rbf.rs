//! The interpolated laws as people write them, in TOML.
//!
//! ```toml
//! law = "rbf"
//! form = "secant"                 # or "energy", "paper"; two moduli are isotropic, five E11 E12 E13 E33 E44
//! centres = [
//!   { strain = [0, 0, 0, 0, 0, 0], moduli = ["0.2 MPa", "1.0 MPa"] },
//!   { invariants = [-0.1, 0.3, -0.3], moduli = ["0.25 MPa", "1.5 MPa"] },   # not in form = "paper"
//! ]
//! range = { low = [-0.1, 0.0, -0.3], high = [0.0, 0.3, 0.0] }   # default: the box of the centres and rest
//! offset = 0.1                    # energy only; default half the mean spacing of the centres
//! norm = "tensor"                 # paper only: "vector" or "tensor"
//! constant = false                # paper only
//! convention = "lambda-alpha"     # paper only: "lambda-alpha", "lame", "young-poisson"; five moduli need none
//! ```
//!
//! Moduli are μ, K (secant, energy), and in the papers' form (λ, α), (λ, μ) or (E, ν), where ν has no unit. Strain
//! components stand in the order xx yy zz yz xz xy and are those of the tensor; the axis is z unless `axis` turns the law.

use super::energy::EnergyRbf;
use super::isotropic::{IsotropicRbf, invariants};
use super::law::{Law, LawError, Range};
use super::law_text::{CentreText, LawText, LawTextError};
use super::paper::{PaperParameters, PaperRbf, StrainNorm};
use super::transverse::{TransverseModuli, TransverseRbf};
use crate::math::mandel::Mandel;
use crate::math::rbf::ConstantTerm;
use crate::units;
use std::f64::consts::SQRT_2;

impl LawText {
    pub(super) fn rbf(&self) -> Result<Law, LawTextError> {
        match self.word("form", &self.form, &["secant", "energy", "paper"])? {
            "paper" => self.paper(),
            "energy" => {
                self.only("rbf of an energy", &["form", "centres", "range", "offset"])?;
                let (centres, moduli) = self.isotropic_centres()?;
                let default = EnergyRbf::default_offset(&centres);
                let offset = self.offset.as_ref().map_or(default, |o| *o.get_ref());
                let law = EnergyRbf::interpolating(&centres, &moduli, offset, self.range_of(&centres)?);
                law.map(|law| Law::Energy(Box::new(law)))
                    .map_err(|e| self.of_centres(&e))
            }
            _ => {
                self.only("rbf of a secant", &["form", "centres", "range", "axis"])?;
                if self.centres()?.first().is_some_and(|c| c.moduli.len() == 5) {
                    return self.transverse_secant();
                }
                let (centres, moduli) = self.isotropic_centres()?;
                let law = IsotropicRbf::interpolating(&centres, &moduli, self.range_of(&centres)?);
                law.map(Law::Isotropic).map_err(|e| self.of_centres(&e))
            }
        }
    }

    fn transverse_secant(&self) -> Result<Law, LawTextError> {
        let rest = TransverseRbf::linear(&TransverseModuli::from_array([2.0, 0.0, 0.0, 2.0, 1.0]))
            .map_err(|e| self.of_centres(&e))?;
        let (mut centres, mut moduli) = (Vec::new(), Vec::new());
        for (i, centre) in self.centres()?.iter().enumerate() {
            centres.push(self.invariants(i, centre, |strain| rest.invariants(strain))?);
            let row: [f64; 5] = self.moduli(i, centre, &[])?;
            moduli.push(TransverseModuli::from_array(row));
        }
        let law = TransverseRbf::interpolating(&centres, &moduli, self.range_of(&centres)?)
            .map_err(|e| self.of_centres(&e))?;
        self.turned(Law::TransverselyIsotropic(Box::new(law)))
    }

    fn paper(&self) -> Result<Law, LawTextError> {
        let fields = ["form", "centres", "norm", "constant", "convention", "axis"];
        self.only("rbf of the papers", &fields)?;
        let centres = self.centres()?;
        let conventions = ["lambda-alpha", "lame", "young-poisson"];
        let parameters = if centres.first().is_some_and(|c| c.moduli.len() == 5) {
            PaperParameters::Transverse
        } else {
            match self.word("convention", &self.convention, &conventions)? {
                "lambda-alpha" => PaperParameters::LambdaAlpha,
                "lame" => PaperParameters::Lame,
                _ => PaperParameters::YoungPoisson,
            }
        };
        let norm = match self.word("norm", &self.norm, &["tensor", "vector"])? {
            "vector" => StrainNorm::Vector,
            _ => StrainNorm::Tensor,
        };
        let constant = match &self.constant {
            Some(constant) if *constant.get_ref() => ConstantTerm::With,
            Some(_) => ConstantTerm::Without,
            None => return Err(self.fail("constant", "missing: expected true or false".into())),
        };
        let (mut strains, mut values) = (Vec::new(), Vec::new());
        for (i, centre) in centres.iter().enumerate() {
            let Some(strain) = centre.strain else {
                let field = format!("centres[{i}].strain");
                return Err(self.fail(&field, "missing: the papers' centres are strains".into()));
            };
            strains.push(mandel(&strain));
            values.push(match parameters {
                PaperParameters::Transverse => self.moduli::<5>(i, centre, &[])?.to_vec(),
                PaperParameters::YoungPoisson => self.moduli::<2>(i, centre, &[1])?.to_vec(),
                _ => self.moduli::<2>(i, centre, &[])?.to_vec(),
            });
        }
        let law = PaperRbf::interpolating(&strains, &values, parameters, norm, constant)
            .map_err(|e| self.of_centres(&e))?;
        self.turned(Law::Paper(Box::new(law)))
    }

    #[allow(clippy::type_complexity)]
    fn isotropic_centres(&self) -> Result<(Vec<[f64; 3]>, Vec<[f64; 2]>), LawTextError> {
        let (mut centres, mut moduli) = (Vec::new(), Vec::new());
        for (i, centre) in self.centres()?.iter().enumerate() {
            centres.push(self.invariants(i, centre, invariants)?);
            moduli.push(self.moduli(i, centre, &[])?);
        }
        Ok((centres, moduli))
    }

    fn centres(&self) -> Result<&[CentreText], LawTextError> {
        match &self.centres {
            Some(centres) => Ok(centres.get_ref()),
            None => Err(self.fail(
                "centres",
                "missing: expected centres = [{ strain = […], moduli = […] }]".into(),
            )),
        }
    }

    fn invariants<const D: usize>(
        &self,
        i: usize,
        centre: &CentreText,
        of_strain: impl Fn(&Mandel) -> [f64; D],
    ) -> Result<[f64; D], LawTextError> {
        match (&centre.strain, &centre.invariants) {
            (Some(strain), None) => Ok(of_strain(&mandel(strain))),
            (None, Some(list)) => <[f64; D]>::try_from(list.as_slice()).map_err(|_| {
                let found = format!("found {} numbers, expected {D}", list.len());
                self.fail(&format!("centres[{i}].invariants"), found)
            }),
            _ => Err(self.fail(
                &format!("centres[{i}]"),
                "expected strain or invariants, one of them".into(),
            )),
        }
    }

    /// Moduli \[MPa\]; those whose numbers stand in `plain` have no unit.
    fn moduli<const V: usize>(
        &self,
        i: usize,
        centre: &CentreText,
        plain: &[usize],
    ) -> Result<[f64; V], LawTextError> {
        let field = format!("centres[{i}].moduli");
        if centre.moduli.len() != V {
            let found = format!("found {} moduli, expected {V}", centre.moduli.len());
            return Err(self.fail(&field, found));
        }
        let mut moduli = [0.0; V];
        for (k, (value, text)) in moduli.iter_mut().zip(&centre.moduli).enumerate() {
            *value = if plain.contains(&k) {
                text.trim().parse().map_err(|_| {
                    let found = format!("found {text:?}, expected a number without unit");
                    self.fail(&field, found)
                })?
            } else {
                units::stress(text).map_err(|e| self.fail(&field, e.to_string()))?
            };
        }
        Ok(moduli)
    }

    /// The range that is written, or the box of the centres and rest.
    fn range_of<const D: usize>(&self, centres: &[[f64; D]]) -> Result<Range<D>, LawTextError> {
        let (mut low, mut high) = ([0.0_f64; D], [0.0_f64; D]);
        match &self.range {
            None => {
                for centre in centres {
                    for d in 0..D {
                        low[d] = low[d].min(centre[d]);
                        high[d] = high[d].max(centre[d]);
                    }
                }
            }
            Some(range) => {
                let range = range.get_ref();
                for (end, list) in [(&mut low, &range.low), (&mut high, &range.high)] {
                    *end = <[f64; D]>::try_from(list.as_slice()).map_err(|_| {
                        let found = format!("found {} numbers at one end, expected {D}", list.len());
                        self.fail("range", found)
                    })?;
                }
            }
        }
        Range::new(low, high).map_err(|e| self.fail("range", e.to_string()))
    }

    fn of_centres(&self, error: &LawError) -> LawTextError {
        self.fail("centres", error.to_string())
    }
}

fn mandel(strain: &[f64; 6]) -> Mandel {
    let [xx, yy, zz, yz, xz, xy] = *strain;
    Mandel::new(xx, yy, zz, SQRT_2 * yz, SQRT_2 * xz, SQRT_2 * xy)
}
