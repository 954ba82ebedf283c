//! Estimated moduli of a soft block with parallel round tubes.
//!
//! ```text
//! φ = π d²/(2√3 s²)                                   tubes of diameter d in hexagonal array of spacing s
//! E_a = E (1−φ)                ν_a = ν                along the tubes: the solid's share
//! E_p = E (1−φ)/(1+2φ)         ν_p = (ν(1−φ)+φ)/(1+2φ)   across them
//! G_a = G (1−φ)/(1+φ)
//! φ(ε) = 1 − (1−φ₀)/J,   J = (1 + a)(1 + p/√2)²
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | E, ν, G | moduli of the base material | MPa, – |
//! | φ, φ₀ | share of the tubes in the volume, deformed and at rest | – |
//! | a, p | axial strain and in-plane area strain over √2 (the first two invariants) | – |
//!
//! Across and in axial shear these are Mori and Tanaka's averages for circular holes in two dimensions; along the tubes
//! they are exact for φ → 0 and a bound else. Strain counts through the closing of the tubes alone: the solid keeps its
//! volume, so φ falls as the block loses volume, and the block stiffens towards the solid. Buckling of the walls, which
//! softens real blocks at 10–20 % across the tubes, is left out. Validity: an estimate for trying out searches, φ₀ below
//! about 0.6. Source for the averages: Benveniste 1987, Mechanics of Materials 6.

use super::coupon_file::Tubes;
use crate::material::law::{LawError, Range};
use crate::material::transverse::{TransverseModuli, TransverseRbf};
use std::f64::consts::{PI, SQRT_2};

/// Compression along the tubes and across them that the estimate covers.
const COMPRESSION: f64 = 0.5;
/// Extension that it covers.
const EXTENSION: f64 = 0.2;
/// Tubes never close entirely.
const LEAST_SHARE: f64 = 0.02;

/// Why sizes make no block.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TubesError {
    /// Tubes that touch, or no tubes.
    #[error("tubes of {diameter} mm at {spacing} mm take {share:.2} of the volume: expected 0.01 to 0.65")]
    Share {
        /// Diameter \[mm\].
        diameter: f64,
        /// Spacing \[mm\].
        spacing: f64,
        /// Share of the volume.
        share: f64,
    },
    /// Moduli that make no law.
    #[error(transparent)]
    Law(#[from] LawError),
}

impl Tubes {
    /// Share of the tubes in the volume at rest.
    pub fn share(&self) -> f64 {
        PI * self.diameter_mm * self.diameter_mm / (2.0 * 3.0_f64.sqrt() * self.spacing_mm * self.spacing_mm)
    }

    fn moduli(&self, share: f64) -> Result<TransverseModuli, LawError> {
        let (e, nu, phi) = (self.base_young_mpa, self.base_poisson, share);
        let solid = 1.0 - phi;
        TransverseModuli::from_engineering(
            e * solid,
            e * solid / (1.0 + 2.0 * phi),
            nu,
            (nu * solid + phi) / (1.0 + 2.0 * phi),
            e / (2.0 * (1.0 + nu)) * solid / (1.0 + phi),
        )
    }

    /// The law of the block, tubes along z, and its range of axial engineering strain.
    ///
    /// # Errors
    /// Tubes that overlap, moduli that are not positive.
    pub fn law(&self) -> Result<(TransverseRbf, [f64; 2]), TubesError> {
        let share = self.share();
        if !(0.01..=0.65).contains(&share) {
            let (diameter, spacing) = (self.diameter_mm, self.spacing_mm);
            return Err(TubesError::Share {
                diameter,
                spacing,
                share,
            });
        }
        // Axial and in-plane (engineering) strains of the centres; shears don't close tubes.
        let states = [
            (0.0, 0.0),
            (-0.25, 0.05),
            (-COMPRESSION, 0.1),
            (EXTENSION, -0.05),
            (0.0, -0.15),
            (0.05, -0.3),
            (-0.3, -0.15),
        ];
        let mut centres = Vec::new();
        let mut moduli = Vec::new();
        for (axial, lateral) in states {
            let volume: f64 = (1.0 + axial) * (1.0 + lateral) * (1.0 + lateral);
            let closed = (1.0 - (1.0 - share) / volume).max(LEAST_SHARE);
            centres.push([axial, SQRT_2 * lateral, 0.0, 0.0]);
            moduli.push(self.moduli(closed)?);
        }
        let range = Range::new(
            [-COMPRESSION, -SQRT_2 * 0.3, 0.0, 0.0],
            [EXTENSION, SQRT_2 * 0.25, 0.4, 0.4],
        )?;
        Ok((
            TransverseRbf::interpolating(&centres, &moduli, range)?,
            [-COMPRESSION, EXTENSION],
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::homogeneous::uniaxial;
    use crate::material::law::Law;

    #[test]
    fn softer_with_more_tube_and_stiffer_when_pressed() {
        let block = |diameter_mm| Tubes {
            base_young_mpa: 0.5,
            base_poisson: 0.45,
            diameter_mm,
            spacing_mm: 3.0,
        };
        // φ = π/(2√3) · 4/9 for d = 2: 0.4031; along the tubes 0.5 · 0.5969 MPa.
        let law = Law::TransverselyIsotropic(Box::new(block(2.0).law().unwrap().0));
        let rest = law.young_modulus(&crate::math::mandel::Mandel::zeros());
        assert!((rest - 0.298_467).abs() < 1e-5, "{rest}");
        let pressed = uniaxial(&law, -0.4);
        assert!(pressed.stress / -0.4 > 1.05 * rest, "{pressed:?}");
        let other = Law::TransverselyIsotropic(Box::new(block(1.0).law().unwrap().0));
        assert!(other.young_modulus(&crate::math::mandel::Mandel::zeros()) > 1.2 * rest);
        assert!(matches!(block(3.0).law(), Err(TubesError::Share { .. })));
    }
}
