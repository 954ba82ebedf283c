//! The constitutive law at a point.
//!
//! ```text
//! T = E(p(ε)) ε,     ε = RᵀF − I
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | F = RU | deformation gradient and its polar decomposition, det R = +1 | – |
//! | ε | Biot strain U − I, Mandel notation | – |
//! | T | Biot stress, Mandel notation, in the unrotated frame; P = R T is the nominal stress | MPa |
//! | E(p) | secant stiffness at the stiffness parameters p, symmetric and positive definite | MPa |
//!
//! This is the form of the two laws that records of measured materials hold. [`super::hyperelastic`] and
//! [`super::energy`] have T = ∂W/∂U instead and a symmetric tangent; [`super::paper`] is the papers' own form.
//!
//! In the first two the parameters depend on strain by radial basis functions over strain invariants (Bickel 2010, (7.9)–(7.10), (8.2);
//! with a constant term as in Carr et al. 2001). What is interpolated is unconstrained (logarithms, a Cholesky factor),
//! so E is positive definite at every strain, not only at the centres.
//!
//! Validity: the fitted range of strain. Outside it each invariant is moved to the nearest one in the range, so the
//! secant stiffness stays what it was at the border. They are Cauchy-elastic: stress depends on strain alone, the
//! tangent dT/dε is not symmetric in general, and closed strain paths may make work.

use super::energy::EnergyRbf;
use super::hyperelastic::Hyperelastic;
use super::isotropic::IsotropicRbf;
use super::paper::PaperRbf;
use super::transverse::TransverseRbf;
use crate::math::Vec3;
use crate::math::mandel::{Mandel, Mandel6};

/// Smooths norms of strain at zero, `|a| → √(|a|² + δ²) − δ`: a norm's gradient has no limit at rest, and Newton would
/// see a different tangent from every side. A tenth of a percent lies below what coupons resolve.
pub const SMOOTHING_STRAIN: f64 = 1e-3;

/// A material's answer to strain.
#[derive(Clone, Debug, PartialEq)]
pub enum Law {
    /// The same in all directions.
    Isotropic(IsotropicRbf),
    /// The same in all directions about one axis.
    TransverselyIsotropic(Box<TransverseRbf>),
    /// Rubber or foam with an energy of the principal stretches.
    Hyperelastic(Hyperelastic),
    /// The same in all directions, with an energy that is interpolated in strain space.
    Energy(Box<EnergyRbf>),
    /// The papers' strain-space interpolation, for comparison.
    Paper(Box<PaperRbf>),
}

/// Which measure of volume change a law is written in, so which one an element may average against locking.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Volumetric {
    /// tr ε.
    Trace,
    /// J = det U.
    Jacobian,
}

/// A number that a law depends on and a fit may change.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// What it is, as `ln shear modulus at centre 2`.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit: `MPa`, `ln MPa`, `√MPa` or `–`.
    pub unit: &'static str,
}

/// Why numbers make no material.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LawError {
    /// A modulus that is not a positive number.
    #[error("{name} = {value} MPa: a modulus must be a positive number")]
    Modulus {
        /// Which modulus.
        name: &'static str,
        /// The value found \[MPa\].
        value: f64,
    },
    /// Poisson's ratio outside what is positive definite.
    #[error(
        "Poisson's ratio {0}: it must lie above −1 and below 0.5 (0.49 stands for nearly incompressible)"
    )]
    Poisson(f64),
    /// Transversely isotropic moduli whose matrix is not positive definite.
    #[error("moduli {0:?} MPa (E11, E12, E13, E33, E44) are not positive definite: {1}")]
    Indefinite([f64; 5], &'static str),
    /// A range that does not hold the state at rest, or is not a range.
    #[error("invariant {index}: range {low} to {high} must hold 0 (rest) and be finite or unbounded")]
    Range {
        /// Which invariant, from 0.
        index: usize,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// The centres do not determine an interpolant.
    #[error("the centres do not determine an interpolation: {0}")]
    Interpolation(#[from] crate::math::rbf::RbfError),
    /// Weights that do not belong to the centres.
    #[error("weights: {0}")]
    Weights(String),
    /// A coefficient that makes no material.
    #[error("{field} = {value}: expected {expected}")]
    Coefficient {
        /// Which one, as `terms[1].exponent`.
        field: String,
        /// The value found, in MPa where it is a modulus.
        value: f64,
        /// What belongs there.
        expected: &'static str,
    },
    /// Moduli of a centre whose stiffness is not positive definite.
    #[error("centre {centre}: {values:?} make no positive definite stiffness")]
    Centre {
        /// Which centre, from 0.
        centre: usize,
        /// The values found.
        values: Vec<f64>,
    },
    /// A law that records don't hold.
    #[error("the papers' form is for comparison and has no material record")]
    Unrecorded,
    /// A list of the wrong length.
    #[error("found {found} numbers, expected {expected}")]
    Count {
        /// Numbers found.
        found: usize,
        /// Numbers needed.
        expected: usize,
    },
}

pub(super) fn expect_count(expected: usize, found: usize) -> Result<(), LawError> {
    if found == expected {
        Ok(())
    } else {
        Err(LawError::Count { found, expected })
    }
}

/// The box of strain invariants that a law was fitted in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range<const D: usize> {
    low: [f64; D],
    high: [f64; D],
}

impl<const D: usize> Range<D> {
    /// Without limits.
    pub const UNBOUNDED: Self = Range {
        low: [f64::NEG_INFINITY; D],
        high: [f64::INFINITY; D],
    };

    /// The box from `low` to `high`, `(D)` each.
    ///
    /// # Errors
    /// If an interval does not hold zero, the state at rest, or an end is not a number.
    pub fn new(low: [f64; D], high: [f64; D]) -> Result<Self, LawError> {
        for index in 0..D {
            // A chain of comparisons that NaN fails.
            if !(low[index] <= 0.0 && high[index] >= 0.0) {
                return Err(LawError::Range {
                    index,
                    low: low[index],
                    high: high[index],
                });
            }
        }
        Ok(Range { low, high })
    }

    /// Lower ends, `(D)`.
    pub fn low(&self) -> &[f64; D] {
        &self.low
    }

    /// Upper ends, `(D)`.
    pub fn high(&self) -> &[f64; D] {
        &self.high
    }

    /// Whether `q` lies in the box.
    #[inline]
    pub fn contains(&self, q: &[f64; D]) -> bool {
        (0..D).all(|d| q[d] >= self.low[d] && q[d] <= self.high[d])
    }

    /// The point of the box nearest to `q`.
    #[inline]
    pub fn nearest(&self, q: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|d| q[d].max(self.low[d]).min(self.high[d]))
    }

    /// Sets to zero the columns of a gradient `(V × D)` along which [`Range::nearest`] does not move.
    #[inline]
    pub(super) fn hold<const V: usize>(&self, q: &[f64; D], gradient: &mut [[f64; D]; V]) {
        for d in 0..D {
            if q[d] < self.low[d] || q[d] > self.high[d] {
                for row in gradient.iter_mut() {
                    row[d] = 0.0;
                }
            }
        }
    }
}

/// `√(a² + δ²) − δ` and its derivative with respect to a² times two, `1/√(a² + δ²)`.
#[inline]
pub(super) fn smooth_norm(squared: f64) -> (f64, f64) {
    let root = (squared + SMOOTHING_STRAIN * SMOOTHING_STRAIN).sqrt();
    (root - SMOOTHING_STRAIN, 1.0 / root)
}

impl Law {
    /// Hooke's law with constant moduli: Young's modulus \[MPa\] and Poisson's ratio.
    ///
    /// # Errors
    /// If the modulus is not positive or the ratio lies outside (−1, 0.5).
    pub fn linear_isotropic(young_mpa: f64, poisson: f64) -> Result<Law, LawError> {
        IsotropicRbf::linear(young_mpa, poisson).map(Law::Isotropic)
    }

    /// Biot stress \[MPa\] at Biot strain, both `(6)`. NaN where a hyperelastic energy is not defined (a principal stretch
    /// that is not positive): such a state is to be refused.
    #[inline]
    pub fn stress(&self, strain: &Mandel) -> Mandel {
        match self {
            Law::Isotropic(law) => law.stress(strain),
            Law::TransverselyIsotropic(law) => law.stress(strain),
            Law::Hyperelastic(law) => law.stress(strain),
            Law::Energy(law) => law.stress(strain),
            Law::Paper(law) => law.stress(strain),
        }
    }

    /// Biot stress `(6)` \[MPa\] and the consistent tangent dT/dε `(6 × 6)` \[MPa\], symmetric where there is an energy.
    #[inline]
    pub fn stress_and_tangent(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        match self {
            Law::Isotropic(law) => law.stress_and_tangent(strain),
            Law::TransverselyIsotropic(law) => law.stress_and_tangent(strain),
            Law::Hyperelastic(law) => law.stress_and_tangent(strain),
            Law::Energy(law) => law.stress_and_tangent(strain),
            Law::Paper(law) => law.stress_and_tangent(strain),
        }
    }

    /// Biot stress `(6)` \[MPa\] and a symmetric positive definite stiffness `(6 × 6)` \[MPa\]: E(p(ε)) where the law has one,
    /// the tangent made definite where it has an energy.
    #[inline]
    pub fn stress_and_secant(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        match self {
            Law::Isotropic(law) => law.stress_and_secant(strain),
            Law::TransverselyIsotropic(law) => law.stress_and_secant(strain),
            Law::Hyperelastic(law) => law.stress_and_secant(strain),
            Law::Energy(law) => law.stress_and_secant(strain),
            Law::Paper(law) => law.stress_and_secant(strain),
        }
    }

    /// Energy per undeformed volume \[MPa = N mm/mm³\]; none for a law without one.
    pub fn energy(&self, strain: &Mandel) -> Option<f64> {
        match self {
            Law::Isotropic(law) => law.energy(strain),
            Law::TransverselyIsotropic(law) => law.energy(strain),
            Law::Hyperelastic(law) => Some(law.energy(strain)),
            Law::Energy(law) => Some(law.energy(strain)),
            Law::Paper(_) => None,
        }
    }

    /// The measure of volume that the law is written in.
    #[inline]
    pub fn volumetric(&self) -> Volumetric {
        match self {
            Law::Hyperelastic(_) => Volumetric::Jacobian,
            _ => Volumetric::Trace,
        }
    }

    /// Whether the secant stiffness that makes the stress is positive definite at `strain`. Only the papers' form can
    /// lose that.
    #[inline]
    pub fn is_definite(&self, strain: &Mandel) -> bool {
        match self {
            Law::Paper(law) => law.is_definite(strain),
            _ => true,
        }
    }

    /// Secant Young's modulus at `strain` \[MPa\]; along the axis for a transversely isotropic material, at rest for a
    /// hyperelastic one.
    pub fn young_modulus(&self, strain: &Mandel) -> f64 {
        match self {
            Law::Isotropic(law) => law.young_modulus(strain),
            Law::TransverselyIsotropic(law) => law.young_modulus(strain),
            Law::Hyperelastic(law) => {
                let (shear, bulk) = law.moduli_at_rest();
                super::isotropic::young(shear, bulk)
            }
            Law::Energy(law) => law.young_modulus(strain),
            Law::Paper(law) => law.young_modulus(strain),
        }
    }

    /// Whether stress and strain need not share their axes, so that the change of the rotation makes work too.
    #[inline]
    pub fn turns_stress(&self) -> bool {
        matches!(self, Law::TransverselyIsotropic(_))
    }

    /// Whether `strain` lies in the range that the law was fitted in.
    #[inline]
    pub fn in_range(&self, strain: &Mandel) -> bool {
        match self {
            Law::Isotropic(law) => law.in_range(strain),
            Law::TransverselyIsotropic(law) => law.in_range(strain),
            Law::Energy(law) => law.in_range(strain),
            Law::Hyperelastic(_) | Law::Paper(_) => true,
        }
    }

    /// Poisson's ratio at zero strain; for load along the axis for a transversely isotropic material.
    pub fn poisson_ratio_at_rest(&self) -> f64 {
        match self {
            Law::Isotropic(law) => law.poisson_ratio_at_rest(),
            Law::TransverselyIsotropic(law) => law.poisson_ratio_at_rest(),
            Law::Hyperelastic(law) => {
                let (shear, bulk) = law.moduli_at_rest();
                super::isotropic::poisson(shear, bulk)
            }
            Law::Energy(law) => law.poisson_ratio_at_rest(),
            Law::Paper(law) => law.poisson_ratio_at_rest(),
        }
    }

    /// The same material with its axis along `axis` (any length; a zero or non-finite one leaves the law as it is).
    /// An isotropic material has no axis and stays itself.
    pub fn rotated(&self, axis: &Vec3) -> Law {
        match self {
            Law::TransverselyIsotropic(law) => Law::TransverselyIsotropic(Box::new(law.rotated(axis))),
            Law::Paper(law) => Law::Paper(Box::new(law.rotated(axis))),
            Law::Isotropic(_) | Law::Hyperelastic(_) | Law::Energy(_) => self.clone(),
        }
    }

    /// The numbers that the law depends on, in a fixed order: logarithms of moduli (or the Cholesky parameters) at the
    /// centres, coefficients of a hyperelastic energy, moduli at the centres of the papers' form. Without centres, the
    /// constants. Centres, offset, range and axis are not among them.
    pub fn parameters(&self) -> Vec<Parameter> {
        const ISOTROPIC: [(&str, &str); 2] = [("ln shear modulus", "ln MPa"), ("ln bulk modulus", "ln MPa")];
        const TRANSVERSE: [(&str, &str); 5] = [
            ("ln E44", "ln MPa"),
            ("ln(E11 − E12)", "ln MPa"),
            ("ln l11", "ln √MPa"),
            ("l21", "√MPa"),
            ("ln l22", "ln √MPa"),
        ];
        match self {
            Law::Isotropic(law) => at_centres(&ISOTROPIC, law.values().iter().map(|v| v.as_slice())),
            Law::TransverselyIsotropic(law) => {
                at_centres(&TRANSVERSE, law.values().iter().map(|v| v.as_slice()))
            }
            Law::Energy(law) => at_centres(&ISOTROPIC, law.values().iter().map(|v| v.as_slice())),
            Law::Paper(law) => at_centres(
                law.parameters().names(),
                law.values().iter().map(|v| v.as_slice()),
            ),
            Law::Hyperelastic(law) => law
                .coefficients()
                .into_iter()
                .map(|(name, value, unit)| Parameter { name, value, unit })
                .collect(),
        }
    }

    /// The same law with other numbers, in the order of [`Law::parameters`].
    ///
    /// # Errors
    /// A wrong count, or numbers that make no material.
    pub fn with_parameters(&self, values: &[f64]) -> Result<Law, LawError> {
        Ok(match self {
            Law::Isotropic(law) => Law::Isotropic(law.with_values(values)?),
            Law::TransverselyIsotropic(law) => Law::TransverselyIsotropic(Box::new(law.with_values(values)?)),
            Law::Hyperelastic(law) => Law::Hyperelastic(law.with_coefficients(values)?),
            Law::Energy(law) => Law::Energy(Box::new(law.with_values(values)?)),
            Law::Paper(law) => Law::Paper(Box::new(law.with_values(values)?)),
        })
    }

    /// ∂T/∂(parameter) at fixed strain \[MPa per unit of the parameter\], in the order of [`Law::parameters`].
    pub fn stress_by_parameters(&self, strain: &Mandel) -> Vec<Mandel> {
        match self {
            Law::Isotropic(law) => law.stress_by_values(strain),
            Law::TransverselyIsotropic(law) => law.stress_by_values(strain),
            Law::Hyperelastic(law) => law.stress_by_coefficients(strain),
            Law::Energy(law) => law.stress_by_values(strain),
            Law::Paper(law) => law.stress_by_values(strain),
        }
    }

    /// Invariants of the centres, a centre after the other; empty for a law without centres, or of a form whose centres
    /// are not moved.
    pub fn centres(&self) -> Vec<f64> {
        match self {
            Law::Isotropic(law) => law.log_moduli().centres.iter().flatten().copied().collect(),
            Law::TransverselyIsotropic(law) => law.parameters().centres.iter().flatten().copied().collect(),
            Law::Hyperelastic(_) | Law::Energy(_) | Law::Paper(_) => Vec::new(),
        }
    }

    /// The same parameters at other centres, in the order of [`Law::centres`].
    ///
    /// # Errors
    /// A wrong count, or two centres at one point.
    pub fn with_centres(&self, centres: &[f64]) -> Result<Law, LawError> {
        Ok(match self {
            Law::Isotropic(law) => Law::Isotropic(law.with_centres(centres)?),
            Law::TransverselyIsotropic(law) => {
                Law::TransverselyIsotropic(Box::new(law.with_centres(centres)?))
            }
            other => {
                expect_count(0, centres.len())?;
                other.clone()
            }
        })
    }

    /// ∂T/∂(invariant of a centre) at fixed strain and parameters \[MPa\], in the order of [`Law::centres`].
    pub fn stress_by_centres(&self, strain: &Mandel) -> Vec<Mandel> {
        match self {
            Law::Isotropic(law) => law.stress_by_centres(strain),
            Law::TransverselyIsotropic(law) => law.stress_by_centres(strain),
            Law::Hyperelastic(_) | Law::Energy(_) | Law::Paper(_) => Vec::new(),
        }
    }
}

fn at_centres<'a>(names: &[(&str, &'static str)], rows: impl Iterator<Item = &'a [f64]>) -> Vec<Parameter> {
    rows.enumerate()
        .flat_map(|(i, row)| {
            names.iter().zip(row).map(move |((name, unit), value)| Parameter {
                name: format!("{name} at centre {i}"),
                value: *value,
                unit,
            })
        })
        .collect()
}

#[cfg(test)]
#[path = "law_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "every_law_tests.rs"]
mod every_law_tests;
