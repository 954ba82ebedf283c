//! The homogeneous state of a coupon in each kind of test: what the machine would read from a law.

use super::file::TestKind;
use crate::material::homogeneous::{
    confined_strain, confined_stress, equibiaxial, planar, shear_stress, simple_shear, uniaxial,
};
use crate::material::law::Law;
use crate::math::mandel::Mandel;

/// A law's answer in a test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Nominal stress where the machine pulls \[MPa\].
    pub stress: f64,
    /// Engineering strain of the free side: the width, or a sheet's thickness; none where no side is free.
    pub free: Option<f64>,
    /// Biot strain, `(6)`.
    pub strain: Mandel,
}

/// What `law` answers at engineering strain (or shear) `given` of a test.
pub fn response(law: &Law, kind: TestKind, given: f64) -> Response {
    match kind {
        TestKind::UniaxialCompression | TestKind::UniaxialTension => {
            let state = uniaxial(law, given);
            answer(state.stress, Some(state.lateral), state.strain())
        }
        TestKind::EquibiaxialTension => {
            let state = equibiaxial(law, given);
            answer(state.stress, Some(state.thickness), state.strain())
        }
        TestKind::PlanarTension => {
            let state = planar(law, given);
            answer(state.stress, Some(state.thickness), state.strain())
        }
        TestKind::ConfinedCompression => answer(confined_stress(law, given), None, confined_strain(given)),
        TestKind::SimpleShear => answer(shear_stress(law, given), None, simple_shear(given).0),
    }
}

fn answer(stress: f64, free: Option<f64>, strain: Mandel) -> Response {
    Response { stress, free, strain }
}

/// The strain of a test before any law is known, from Poisson's ratio at small strain.
pub fn guessed_strain(kind: TestKind, given: f64, ratio: f64) -> Mandel {
    match kind {
        TestKind::UniaxialCompression | TestKind::UniaxialTension => {
            Mandel::new(-ratio * given, -ratio * given, given, 0.0, 0.0, 0.0)
        }
        TestKind::EquibiaxialTension => {
            Mandel::new(given, given, -2.0 * ratio / (1.0 - ratio) * given, 0.0, 0.0, 0.0)
        }
        TestKind::PlanarTension => Mandel::new(-ratio / (1.0 - ratio) * given, 0.0, given, 0.0, 0.0, 0.0),
        TestKind::ConfinedCompression => confined_strain(given),
        TestKind::SimpleShear => simple_shear(given).0,
    }
}

/// Slope of stress over strain of Hooke's law in a test, as a multiple of the shear modulus.
pub fn slope_over_shear(kind: TestKind, ratio: f64) -> f64 {
    match kind {
        TestKind::UniaxialCompression | TestKind::UniaxialTension => 2.0 * (1.0 + ratio),
        TestKind::EquibiaxialTension => 2.0 * (1.0 + ratio) / (1.0 - ratio),
        TestKind::PlanarTension => 2.0 / (1.0 - ratio),
        TestKind::ConfinedCompression => 2.0 * (1.0 - ratio) / (1.0 - 2.0 * ratio),
        TestKind::SimpleShear => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hooke's law: guess, slope and state must agree in every test.
    #[test]
    fn small_strain_is_hookes_law() {
        let law = Law::linear_isotropic(0.28, 0.4).unwrap();
        for kind in [
            TestKind::UniaxialCompression,
            TestKind::UniaxialTension,
            TestKind::EquibiaxialTension,
            TestKind::PlanarTension,
            TestKind::ConfinedCompression,
            TestKind::SimpleShear,
        ] {
            let given = 1e-5 * kind.sign();
            let state = response(&law, kind, given);
            let slope = slope_over_shear(kind, 0.4) * 0.1;
            // Shear answers to second order in the strain.
            assert!((state.stress / given / slope - 1.0).abs() < 1e-8, "{kind:?}");
            assert!(
                (state.strain - guessed_strain(kind, given, 0.4)).norm() < 1e-12,
                "{kind:?}"
            );
            assert_eq!(state.free.is_some(), kind.has_free_side());
        }
    }
}
