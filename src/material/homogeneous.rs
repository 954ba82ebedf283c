//! What a law answers in the homogeneous tests of a coupon.
//!
//! ```text
//! uniaxial:       ε = diag(e, e, a),  T_xx(e, a) = 0  →  e;   nominal stress P = T_zz
//! equibiaxial:    ε = diag(a, a, e),  T_zz(a, e) = 0  →  e;   nominal stress P = T_xx
//! planar:         ε = diag(e, 0, a),  T_xx(e, a) = 0  →  e;   nominal stress P = T_zz
//! confined:       ε = diag(0, 0, a);                          nominal stress P = T_zz
//! simple shear:   F = I + γ e1⊗e2,  F = RU,  P = R T(U − I);  nominal shear stress P_12
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | a, e | engineering strain where it is prescribed, and where it follows | – |
//! | γ | shear | – |
//! | T, P | Biot stress; first Piola–Kirchhoff (nominal) stress, force over reference area | MPa |
//!
//! Where R = I, in all but the last, Biot stress is the nominal one. Validity: isotropic laws, and transversely isotropic
//! ones loaded along their axis z (equibiaxially across it). Planar tension is that of a wide clamped sheet, its width
//! along y kept; confined, of a cylinder in a smooth rigid sleeve. In simple shear nothing holds the normal stresses at zero, as between bonded plates.

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
    let start = first_guess(law, axial, law.poisson_ratio_at_rest());
    let lateral = free_strain(law, axial, start, |e| {
        let (stress, slope) = normal(law, [e, e, axial]);
        (stress[0], slope[0][0] + slope[0][1])
    });
    Uniaxial {
        axial,
        lateral,
        stress: normal(law, [lateral, lateral, axial]).0[2],
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
    let (_, rest) = normal(law, [0.0; 3]);
    let ratio = (rest[2][0] + rest[2][1]) / rest[2][2];
    let thickness = free_strain(law, in_plane, first_guess(law, in_plane, ratio), |e| {
        let (stress, slope) = normal(law, [in_plane, in_plane, e]);
        (stress[2], slope[2][2])
    });
    Equibiaxial {
        in_plane,
        thickness,
        stress: normal(law, [in_plane, in_plane, thickness]).0[0],
    }
}

/// A state of stress along z, width along y kept, and no stress along x: a wide sheet between clamps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planar {
    /// Engineering strain along z.
    pub axial: f64,
    /// Engineering strain along x, from zero stress there.
    pub thickness: f64,
    /// Nominal stress along z \[MPa\].
    pub stress: f64,
}

impl Planar {
    /// The strain, `(6)`.
    pub fn strain(&self) -> Mandel {
        Mandel::new(self.thickness, 0.0, self.axial, 0.0, 0.0, 0.0)
    }
}

/// The planar state at engineering strain `axial` along z.
pub fn planar(law: &Law, axial: f64) -> Planar {
    let (_, rest) = normal(law, [0.0; 3]);
    let ratio = rest[0][2] / rest[0][0];
    let thickness = free_strain(law, axial, first_guess(law, axial, ratio), |e| {
        let (stress, slope) = normal(law, [e, 0.0, axial]);
        (stress[0], slope[0][0])
    });
    Planar {
        axial,
        thickness,
        stress: normal(law, [thickness, 0.0, axial]).0[2],
    }
}

/// Biot strain of a confined test at engineering strain `axial` along z, `(6)`.
pub fn confined_strain(axial: f64) -> Mandel {
    Mandel::new(0.0, 0.0, axial, 0.0, 0.0, 0.0)
}

/// Nominal stress along z \[MPa\] at engineering strain `axial` there and none across.
pub fn confined_stress(law: &Law, axial: f64) -> f64 {
    normal(law, [0.0, 0.0, axial]).0[2]
}

/// Normal stresses \[MPa\] and their derivatives at the normal strains `e` along x, y, z, without shear.
fn normal(law: &Law, e: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    if let Law::Hyperelastic(law) = law {
        // The axes are known: no eigenvalues, no tangent of six rows.
        let at = law.principal(&e);
        return (at.stress, at.hessian);
    }
    let (stress, tangent) = law.stress_and_tangent(&Mandel::new(e[0], e[1], e[2], 0.0, 0.0, 0.0));
    (
        [stress[0], stress[1], stress[2]],
        [0, 1, 2].map(|i| [tangent[(i, 0)], tangent[(i, 1)], tangent[(i, 2)]]),
    )
}

/// Where the search for a free strain begins: −ratio × given at small strain. A law in stretches answers large strain
/// with (1 + given)^−ratio − 1 if it keeps its volume, and starting there saves most of the way.
fn first_guess(law: &Law, given: f64, ratio: f64) -> f64 {
    if law.volumetric() == Volumetric::Jacobian && given > -1.0 {
        (-ratio * given.ln_1p()).exp_m1()
    } else {
        -ratio * given
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

    /// With λ = K − 2μ/3 = 4μ: planar T_xx = 2μ e + λ (e + a) = 0 and T_zz = 2μ a + λ (e + a); equibiaxial the same with
    /// 2a in place of a; confined T_zz = (2μ + λ) a.
    #[test]
    fn hookes_law_in_the_other_tests() {
        let law = Law::linear_isotropic(0.28, 0.4).unwrap();
        let (mu, lame) = (0.1, 0.4);
        for a in [-0.3, 0.5] {
            let state = planar(&law, a);
            let e = -lame * a / (2.0 * mu + lame);
            assert!((state.thickness - e).abs() < 1e-14);
            assert!((state.stress - (2.0 * mu * a + lame * (e + a))).abs() < 1e-14);
            assert_eq!(state.strain()[1], 0.0);
            let state = equibiaxial(&law, a);
            let e = -2.0 * lame * a / (2.0 * mu + lame);
            assert!((state.thickness - e).abs() < 1e-14);
            assert!((state.stress - (2.0 * mu * a + lame * (e + 2.0 * a))).abs() < 1e-14);
            assert!((confined_stress(&law, a) - (2.0 * mu + lame) * a).abs() < 1e-14);
        }
    }

    /// A neo-Hookean rubber without volume change: P = μ (λ − λ⁻²) pulled, μ (λ − λ⁻⁵) from all sides, μ (λ − λ⁻³)
    /// planar. K = 10⁶ μ leaves a volume change of about P/K. Confined, with J = λ: T = μ λ^(−2/3) (λ − I1/(3λ)) + K (λ − 1).
    #[test]
    fn neo_hookean_rubber_in_closed_form() {
        use crate::material::hyperelastic::{Form, Hyperelastic};
        let rubber = |bulk_mpa: f64| {
            let form = Form::NeoHookeanIsochoric {
                shear_mpa: 0.4,
                bulk_mpa,
            };
            Law::Hyperelastic(Hyperelastic::new(form).unwrap())
        };
        let stiff = rubber(4e5);
        for stretch in [0.3_f64, 0.7, 1.5, 4.0, 7.0] {
            let e = stretch - 1.0;
            let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-3;
            assert!(near(
                uniaxial(&stiff, e).stress,
                0.4 * (stretch - stretch.powi(-2))
            ));
            assert!(near(
                equibiaxial(&stiff, e).stress,
                0.4 * (stretch - stretch.powi(-5))
            ));
            assert!(near(planar(&stiff, e).stress, 0.4 * (stretch - stretch.powi(-3))));
            assert!((planar(&stiff, e).thickness - (1.0 / stretch - 1.0)).abs() < 1e-3);
            let expected =
                0.4 * stretch.powf(-2.0 / 3.0) * (stretch - (2.0 + stretch * stretch) / (3.0 * stretch))
                    + 2.0 * e;
            assert!((confined_stress(&rubber(2.0), e) - expected).abs() < 1e-13);
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
