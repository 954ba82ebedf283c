//! The first guess: the linear material whose small displacements are most like the measured ones.
//!
//! ```text
//! u(E) = u(E₀) E₀/E at small strain:      E = E₀ Σ x₀² / Σ x₀ x̄
//! ```
//!
//! x̄ are the readings, x₀ those of a material so stiff (E₀) that its strains are small, \[mm\].

use super::coordinates::Coordinates;
use super::fit::ProbeError;
use super::press::{Failure, PressedSpecimen};
use crate::fem::measurement_set::MaterialCard;
use crate::material::energy::EnergyRbf;
use crate::material::isotropic::IsotropicRbf;
use crate::material::law::{Law, LawError};
use crate::material::record::{Formulation, Kind};
use crate::material::transverse::{TransverseModuli, TransverseRbf};
use crate::math::Vec3;

/// Poisson's ratios to start from, the likeliest first.
pub(super) const RATIOS: [f64; 3] = [0.3, 0.45, 0.1];
/// A start that the presses fold is made stiffer by this factor, so many times.
const STIFFER: f64 = 1.5;
const STIFFENINGS: usize = 8;

/// What a fit's law is to be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Symmetry {
    /// Whether an isotropic law interpolates a stiffness or an energy.
    pub formulation: Formulation,
    /// Two numbers a centre or five.
    pub coordinates: Coordinates,
    /// The axis, a unit vector; without meaning for an isotropic law.
    pub axis: Vec3,
}

impl Symmetry {
    /// The symmetry that a measurement set names.
    pub fn of(card: &MaterialCard) -> Symmetry {
        Symmetry {
            formulation: Formulation::Secant,
            coordinates: match card.kind {
                Kind::TransverselyIsotropic => Coordinates::Transverse,
                _ => Coordinates::Isotropic,
            },
            axis: card.axis,
        }
    }

    /// A linear law, the same in all directions, written in this symmetry; Young's modulus in MPa.
    pub(super) fn linear(&self, young: f64, poisson: f64) -> Result<Law, LawError> {
        match self.coordinates {
            Coordinates::Isotropic => match self.formulation {
                Formulation::Secant => IsotropicRbf::linear(young, poisson).map(Law::Isotropic),
                Formulation::Energy => {
                    EnergyRbf::linear(young, poisson).map(|law| Law::Energy(Box::new(law)))
                }
            },
            Coordinates::Transverse => {
                let shear = young / (2.0 * (1.0 + poisson));
                let moduli = TransverseModuli::from_engineering(young, young, poisson, poisson, shear)?;
                let law = TransverseRbf::linear(&moduli)?.rotated(&self.axis);
                Ok(Law::TransverselyIsotropic(Box::new(law)))
            }
        }
    }
}

/// Young's modulus \[MPa\] of the linear material of ratio `poisson` that fits best at small strain; not positive where the
/// readings go against the forces.
pub(super) fn young(
    pressed: &PressedSpecimen,
    which: &[usize],
    symmetry: &Symmetry,
    poisson: f64,
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Result<Option<f64>, Failure> {
    let force = |&k: &usize| {
        pressed.presses[k]
            .forces
            .iter()
            .map(Vec3::norm)
            .fold(0.0, f64::max)
    };
    let largest = which.iter().map(force).fold(0.0, f64::max);
    let nodes = &pressed.model.mesh.nodes;
    let (low, high) = nodes
        .iter()
        .fold((nodes[0], nodes[0]), |(l, h), x| (l.inf(x), h.sup(x)));
    // A force over the square of the smallest side is a stress that the specimen bears everywhere; a thousandth of strain.
    let side = (high - low).min();
    let stiff = 1e5 * largest / (side * side);
    let Ok(law) = symmetry.linear(stiff, poisson) else {
        return Ok(None);
    };
    let equilibria = pressed.equilibria(&law, which, cancelled)?;
    let (mut square, mut product) = (0.0, 0.0);
    for (&k, levels) in which.iter().zip(&equilibria) {
        let press = &pressed.presses[k];
        for ((u, readings), deviations) in levels.iter().zip(&press.readings).zip(&press.deviations) {
            for ((x, reading), deviation) in press.read(u).iter().zip(readings).zip(deviations) {
                if let Some(measured) = reading {
                    let weight = press.weight / (deviation * deviation);
                    square += weight * x * x;
                    product += weight * x * measured;
                }
            }
        }
    }
    Ok(Some(stiff * square / product).filter(|e| e.is_finite() && *e > 0.0))
}

/// The linear law of `young` and `poisson`, made stiffer until the specimen stands all presses.
pub(super) fn standing(
    pressed: &PressedSpecimen,
    which: &[usize],
    symmetry: &Symmetry,
    [young, poisson]: [f64; 2],
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Result<Law, ProbeError> {
    let mut stiffness = young;
    for _ in 0..STIFFENINGS {
        let law = symmetry.linear(stiffness, poisson)?;
        if pressed.equilibria(&law, which, cancelled).is_ok() || cancelled() {
            return Ok(law);
        }
        stiffness *= STIFFER;
    }
    let law = symmetry.linear(stiffness, poisson)?;
    pressed.equilibria(&law, which, cancelled)?;
    Ok(law)
}
