//! Compressible neo-Hookean rubber without principal axes, in the two forms that other programs use.
//!
//! ```text
//! logarithmic  W = μ/2 (I1 − 3 − 2 ln J) + λ/2 (ln J)²
//!              T = μ (U − U⁻¹) + λ ln J U⁻¹                       P = μ (F − F⁻ᵀ) + λ ln J F⁻ᵀ
//! isochoric    W = μ/2 (J^(−2/3) I1 − 3) + K/2 (J − 1)²
//!              T = μ J^(−2/3) (U − I1/3 U⁻¹) + K J (J − 1) U⁻¹
//! both         T = a U + b U⁻¹,   dT = a dU + U da − b U⁻¹ dU U⁻¹ + U⁻¹ db
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | U = I + ε, J = det U, I1 = tr U² | stretch, volume ratio, first invariant of C | – |
//! | W | energy per undeformed volume | MPa |
//! | μ, λ, K | shear modulus, Lamé's λ, bulk modulus, all at rest | MPa |
//!
//! Valid for positive definite U; elsewhere the energy is not defined and everything answered is NaN, which a solver
//! takes as a state to refuse. Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2008,
//! (6.27); the isochoric form is `*HYPERELASTIC, NEO HOOKE` of Abaqus and CalculiX with C10 = μ/2, D1 = 2/K.

use crate::math::Mat3;
use crate::math::mandel::{Mandel, Mandel6, from_tensor, to_tensor, trace};
use crate::math::polar::cofactor;
use std::f64::consts::FRAC_1_SQRT_2;

/// Which of the two energies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Volumetry {
    /// Logarithms of the volume ratio; the second modulus is Lamé's λ.
    Logarithmic,
    /// Distortion and volume apart; the second modulus is the bulk modulus.
    Isochoric,
}

/// Stretch, its inverse and its volume ratio.
struct State {
    stretch: Mandel,
    inverse: Mat3,
    /// J − 1, without the cancellation of det U − 1.
    growth: f64,
    log_growth: f64,
    /// tr U².
    first: f64,
}

impl State {
    /// None unless U is positive definite.
    #[inline]
    fn of(strain: &Mandel) -> Option<State> {
        let u = to_tensor(strain) + Mat3::identity();
        let growth = growth(strain);
        let plane = u[(0, 0)] * u[(1, 1)] - u[(0, 1)] * u[(0, 1)];
        // Sylvester's criterion, so written that NaN fails.
        if !(u[(0, 0)] > 0.0 && plane > 0.0 && growth > -1.0) {
            return None;
        }
        Some(State {
            stretch: from_tensor(&u),
            inverse: cofactor(&u) * (1.0 / u.determinant()),
            growth,
            log_growth: growth.ln_1p(),
            first: u.norm_squared(),
        })
    }
}

/// J − 1 = tr ε + ½((tr ε)² − ε:ε) + det ε.
#[inline]
pub(super) fn growth(strain: &Mandel) -> f64 {
    let t = trace(strain);
    t + 0.5 * (t * t - strain.norm_squared()) + to_tensor(strain).determinant()
}

/// a and b of T = a U + b U⁻¹.
#[inline]
fn factors(form: Volumetry, shear: f64, second: f64, s: &State) -> (f64, f64) {
    match form {
        Volumetry::Logarithmic => (shear, second * s.log_growth - shear),
        Volumetry::Isochoric => {
            let a = shear * (-2.0 / 3.0 * s.log_growth).exp();
            let pressure = second * (1.0 + s.growth) * s.growth;
            (a, pressure - a * s.first / 3.0)
        }
    }
}

/// W \[MPa\] at `strain`.
pub fn energy(form: Volumetry, shear: f64, second: f64, strain: &Mandel) -> f64 {
    let Some(s) = State::of(strain) else {
        return f64::NAN;
    };
    match form {
        Volumetry::Logarithmic => {
            // I1 − 3 = 2 tr ε + ε:ε.
            let first = 2.0 * trace(strain) + strain.norm_squared();
            0.5 * shear * (first - 2.0 * s.log_growth) + 0.5 * second * s.log_growth * s.log_growth
        }
        Volumetry::Isochoric => {
            let isochoric = (-2.0 / 3.0 * s.log_growth).exp() * s.first;
            0.5 * shear * (isochoric - 3.0) + 0.5 * second * s.growth * s.growth
        }
    }
}

/// T \[MPa\] at `strain`.
#[inline]
pub fn stress(form: Volumetry, shear: f64, second: f64, strain: &Mandel) -> Mandel {
    let Some(s) = State::of(strain) else {
        return Mandel::repeat(f64::NAN);
    };
    let (a, b) = factors(form, shear, second, &s);
    s.stretch * a + from_tensor(&s.inverse) * b
}

/// T and dT/dε \[MPa\] at `strain`.
pub fn stress_and_tangent(form: Volumetry, shear: f64, second: f64, strain: &Mandel) -> (Mandel, Mandel6) {
    let Some(s) = State::of(strain) else {
        return (Mandel::repeat(f64::NAN), Mandel6::repeat(f64::NAN));
    };
    let (a, b) = factors(form, shear, second, &s);
    let inverse = from_tensor(&s.inverse);
    let mut tangent = congruence(&s.inverse) * -b;
    for i in 0..6 {
        tangent[(i, i)] += a;
    }
    // δ ln J = U⁻¹ : δU, δI1 = 2 U : δU.
    match form {
        Volumetry::Logarithmic => tangent += (inverse * second) * inverse.transpose(),
        Volumetry::Isochoric => {
            let mixed = (inverse * (-2.0 / 3.0 * a)) * s.stretch.transpose();
            let j = 1.0 + s.growth;
            let volume = second * j * (j + s.growth) + 2.0 / 9.0 * a * s.first;
            tangent += mixed + mixed.transpose() + (inverse * volume) * inverse.transpose();
        }
    }
    (s.stretch * a + inverse * b, tangent)
}

/// The map dU ↦ A dU A of a symmetric A, in Mandel notation.
fn congruence(a: &Mat3) -> Mandel6 {
    let mut map = Mandel6::zeros();
    for j in 0..6 {
        let column = match j {
            0..=2 => {
                let c = a.column(j);
                c * c.transpose()
            }
            _ => {
                let (p, q) = [(1, 2), (0, 2), (0, 1)][j - 3];
                let (c, d) = (a.column(p), a.column(q));
                (c * d.transpose() + d * c.transpose()) * FRAC_1_SQRT_2
            }
        };
        map.set_column(j, &from_tensor(&column));
    }
    map
}
