//! What a law answers in the homogeneous tests of a coupon.
//!
//! ```text
//! uniaxial:       ε = diag(e, e, a),  T_xx(e, a) = 0  →  e;   nominal stress P = T_zz
//! equibiaxial:    ε = diag(a, a, e),  T_zz(a, e) = 0  →  e;   nominal stress P = T_xx
//! simple shear:   F = I + γ e1⊗e2,  F = RU,  P = R T(U − I);  nominal shear stress P_12
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | a, e | engineering strain where it is prescribed, and where it follows | – |
//! | γ | shear | – |
//! | T, P | Biot stress; first Piola–Kirchhoff (nominal) stress, force over reference area | MPa |
//!
//! Where R = I, in the first two, Biot stress is the nominal one. Validity: isotropic laws, and transversely isotropic
//! ones loaded along their axis z (equibiaxially across it). In simple shear nothing holds the normal stresses at zero, as between bonded plates.

use super::law::{Law, Volumetric};
use crate::math::Mat3;
use crate::math::mandel::{Mandel, from_tensor, to_tensor};

/// A state of uniaxial stress along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uniaxial {
    /// Engineering strain along z.
    pub axial: f64,
    /// Engineering strain across z, from zero lateral stress.
    pub lateral: f64,
    /// Nominal stress along z \[MPa\].
    pub stress: f64,
}

impl Uniaxial {
    /// The strain, `(6)`.
    pub fn strain(&self) -> Mandel {
        Mandel::new(self.lateral, self.lateral, self.axial, 0.0, 0.0, 0.0)
    }
}

/// The uniaxial state at engineering strain `axial` along z.
pub fn uniaxial(law: &Law, axial: f64) -> Uniaxial {
    let at = |e: f64| Mandel::new(e, e, axial, 0.0, 0.0, 0.0);
    let lateral = free_strain(law, axial, -law.poisson_ratio_at_rest() * axial, |e| {
        let (stress, tangent) = law.stress_and_tangent(&at(e));
        (stress[0], tangent[(0, 0)] + tangent[(0, 1)])
    });
    Uniaxial {
        axial,
        lateral,
        stress: law.stress(&at(lateral))[2],
    }
}

/// Derivatives of the nominal stress with respect to the law's parameters at fixed axial strain \[MPa per unit of the
/// parameter\], in the order of [`Law::parameters`]; `state` is a [`uniaxial`] state of the law:
///
/// ```text
/// dP/dp = ∂T_zz/∂p − (∂T_zz/∂e) (∂T_xx/∂e)⁻¹ ∂T_xx/∂p
/// ```
pub fn uniaxial_by_parameters(law: &Law, state: &Uniaxial) -> Vec<f64> {
    let strain = state.strain();
    let (_, tangent) = law.stress_and_tangent(&strain);
    let across = tangent[(0, 0)] + tangent[(0, 1)];
    let along = tangent[(2, 0)] + tangent[(2, 1)];
    law.stress_by_parameters(&strain)
        .iter()
        .map(|stress| stress[2] - along / across * stress[0])
        .collect()
}

/// A state of equal stress along x and y and none along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equibiaxial {
    /// Engineering strain along x and y.
    pub in_plane: f64,
    /// Engineering strain along z, from zero stress there.
    pub thickness: f64,
    /// Nominal stress along x and y \[MPa\].
    pub stress: f64,
}

impl Equibiaxial {
    /// The strain, `(6)`.
    pub fn strain(&self) -> Mandel {
        Mandel::new(self.in_plane, self.in_plane, self.thickness, 0.0, 0.0, 0.0)
    }
}

/// The equibiaxial state at engineering strain `in_plane` along x and y.
pub fn equibiaxial(law: &Law, in_plane: f64) -> Equibiaxial {
    let at = |e: f64| Mandel::new(in_plane, in_plane, e, 0.0, 0.0, 0.0);
    let (_, rest) = law.stress_and_tangent(&Mandel::zeros());
    let start = -2.0 * rest[(2, 0)] / rest[(2, 2)] * in_plane;
    let thickness = free_strain(law, in_plane, start, |e| {
        let (stress, tangent) = law.stress_and_tangent(&at(e));
        (stress[2], tangent[(2, 2)])
    });
    Equibiaxial {
        in_plane,
        thickness,
        stress: law.stress(&at(thickness))[0],
    }
}

/// The strain at which a stress that rises with it is zero, by Newton's method inside a bracket; `stress` answers the
/// stress and its slope, `given` is the strain of the loaded direction.
fn free_strain(law: &Law, given: f64, start: f64, stress: impl Fn(f64) -> (f64, f64)) -> f64 {
    if given == 0.0 {
        return 0.0;
    }
    // Positive definiteness of an isotropic secant puts its Poisson's ratio, and with it −e/a, between −1 and ½;
    // an anisotropic one may leave that, so the bracket is wider. At finite strain a block that keeps its volume goes
    // further when it is pressed: to a stretch of 1/√λ across, or of 1/λ² under equal pressure from the sides.
    let (mut low, mut high) = (-2.0 * given.abs(), 2.0 * given.abs());
    if law.volumetric() == Volumetric::Jacobian && given > -1.0 {
        let stretch = 1.0 + given;
        high = high.max(2.0 / (stretch * stretch));
        low = low.max(-1.0);
    }
    let mut free = start.clamp(0.999 * low, 0.999 * high);
    for _ in 0..80 {
        let (here, slope) = stress(free);
        // Stress rises with strain: the sign tells the side of the root. Below the root is also where there is no
        // stress at all, because a stretch is not positive.
        if here > 0.0 {
            high = free;
        } else {
            low = free;
        }
        let newton = free - here / slope;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        let settled = (next - free).abs() <= 1e-15 * given.abs();
        free = next;
        if settled {
            break;
        }
    }
    free
}

/// Biot strain of simple shear γ in the plane of x and y, `(6)`, and the rotation of its polar decomposition.
pub fn simple_shear(gamma: f64) -> (Mandel, Mat3) {
    // In two dimensions R is F plus its cofactor, scaled: [[2, γ], [−γ, 2]]/√(4 + γ²).
    let scale = 1.0 / (4.0 + gamma * gamma).sqrt();
    let (c, s) = (2.0 * scale, gamma * scale);
    let rotation = Mat3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
    let gradient = Mat3::new(1.0, gamma, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    (
        from_tensor(&(rotation.transpose() * gradient - Mat3::identity())),
        rotation,
    )
}

/// Nominal shear stress P_12 \[MPa\] in simple shear γ.
pub fn shear_stress(law: &Law, gamma: f64) -> f64 {
    let (strain, rotation) = simple_shear(gamma);
    (rotation * to_tensor(&law.stress(&strain)))[(0, 1)]
}

/// The first engineering strain between 0 and `end`, in `steps` steps, at which the nominal stress of the uniaxial
/// test no longer grows in size: a fold, where a pressed object would snap and a load has no single answer.
pub fn first_fold(law: &Law, end: f64, steps: usize) -> Option<f64> {
    let mut before = 0.0;
    for i in 1..=steps {
        let axial = end * i as f64 / steps as f64;
        let stress = uniaxial(law, axial).stress * end.signum();
        if stress.is_nan() || stress <= before {
            return Some(axial);
        }
        before = stress;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hookes_law_in_closed_form() {
        let law = Law::linear_isotropic(0.3, 0.4).unwrap();
        for axial in [-0.5, 0.0, 1.2] {
            let state = uniaxial(&law, axial);
            assert!(
                (state.stress - 0.3 * axial).abs() < 1e-14 && (state.lateral + 0.4 * axial).abs() < 1e-14
            );
        }
        // P12 with μ = E/2.8 and λ = 2μν/(1−2ν) = 4μ: from R and U by hand, with s = √(4 + γ²):
        // U − I = [[2/s − 1, γ/s], [γ/s, (2 + γ²)/s − 1]], tr = s − 2, P12 = (2/s) T12 + (γ/s) T22.
        let (mu, gamma) = (0.3 / 2.8, 0.6_f64);
        let s = (4.0 + gamma * gamma).sqrt();
        let t12 = 2.0 * mu * gamma / s;
        let t22 = 2.0 * mu * ((2.0 + gamma * gamma) / s - 1.0) + 4.0 * mu * (s - 2.0);
        let expected = (2.0 * t12 + gamma * t22) / s;
        assert!((shear_stress(&law, gamma) - expected).abs() < 1e-14);
        assert!((shear_stress(&law, 1e-6) / 1e-6 - mu).abs() < 1e-9);
    }

    /// Against central differences of solved uniaxial states.
    #[test]
    fn slope_of_the_uniaxial_stress_by_parameters() {
        use crate::material::record::MaterialRecord;
        let text = include_str!("../../materials-db/leap-foam.toml");
        let record = MaterialRecord::parse(text, std::path::Path::new("leap-foam.toml"))
            .unwrap()
            .0;
        let foam = record.law().unwrap();
        let hooke = Law::linear_isotropic(0.3, 0.4).unwrap();
        for (law, axial) in [(&foam, -0.31), (&foam, 0.12), (&hooke, 0.2)] {
            let slopes = uniaxial_by_parameters(law, &uniaxial(law, axial));
            let values: Vec<f64> = law.parameters().iter().map(|p| p.value).collect();
            assert!(slopes.iter().any(|s| s.abs() > 1e-4));
            for i in 0..values.len() {
                let at = |step: f64| {
                    let mut moved = values.clone();
                    moved[i] += step;
                    uniaxial(&law.with_parameters(&moved).unwrap(), axial).stress
                };
                let expected = (at(1e-5) - at(-1e-5)) / 2e-5;
                // The difference's own error: second order in the step, and rounding of the solved state.
                assert!(
                    (slopes[i] - expected).abs() < 1e-9,
                    "{i}: {} and {expected}",
                    slopes[i]
                );
            }
        }
    }

    #[test]
    fn finds_a_fold() {
        use crate::material::isotropic::IsotropicRbf;
        use crate::material::law::Range;
        // The modulus falls from 1 to 0.1 MPa between 10 % and 20 %: σ falls from 0.1 to about 0.02 MPa.
        let at = |a: f64| {
            let strain = Mandel::new(-0.3 * a, -0.3 * a, a, 0.0, 0.0, 0.0);
            crate::material::isotropic::invariants(&strain)
        };
        let centres = [at(-0.001), at(-0.1), at(-0.2)];
        let moduli = [1.0, 1.0, 0.1].map(|e| {
            let (shear, bulk) = crate::material::isotropic::shear_and_bulk(e, 0.3).unwrap();
            [shear, bulk]
        });
        let law = IsotropicRbf::interpolating(&centres, &moduli, Range::UNBOUNDED).unwrap();
        let fold = first_fold(&Law::Isotropic(law), -0.2, 100).unwrap();
        assert!(fold < -0.095 && fold > -0.12, "{fold}");
        assert_eq!(
            first_fold(&Law::linear_isotropic(1.0, 0.3).unwrap(), -0.9, 100),
            None
        );
    }
}
