//! Polar decomposition.
//!
//! ```text
//! F = R U,   RᵀR = I, det R = +1, U = Uᵀ
//! ```
//!
//! R is the proper rotation nearest to F in the Frobenius norm, also where an element is turned inside out
//! (det F < 0): there U has one negative eigenvalue, so the strain U − I grows without a jump while the element passes
//! through flatness. A reflection in R would hide the inversion.
//!
//! Away from inversion R is the limit of Newton's iteration R ← (R + R⁻ᵀ) / 2 (Higham 1986), which is quadratic;
//! near and beyond inversion it comes from the singular value decomposition.

use super::{Mat3, Vec3};

/// The factors of `F = R U`.
#[derive(Clone, Copy, Debug)]
pub struct Polar {
    /// Proper rotation R, `(3 × 3)`.
    pub rotation: Mat3,
    /// Right stretch U, symmetric `(3 × 3)`; indefinite if det F < 0.
    pub stretch: Mat3,
}

/// A determinant below this share of ‖F‖³ goes to the singular value decomposition: Newton's iteration would need more
/// steps there than the decomposition costs.
const NEARLY_SINGULAR: f64 = 1e-3;

/// The polar decomposition of `f`; for a matrix with entries that are not finite the result is not finite either.
#[inline]
pub fn polar(f: &Mat3) -> Polar {
    let rotation = rotation(f);
    let u = rotation.tr_mul(f);
    Polar {
        rotation,
        stretch: 0.5 * (u + u.transpose()),
    }
}

/// The rotation of the polar decomposition of `f`.
#[inline]
pub fn rotation(f: &Mat3) -> Mat3 {
    let norm = f.norm();
    if !norm.is_finite() {
        return Mat3::from_element(f64::NAN);
    }
    if !is_regular(f.determinant(), norm) {
        return rotation_by_svd(f);
    }
    let mut r = *f;
    for _ in 0..30 {
        let c = cofactor(&r);
        let det = r[(0, 0)] * c[(0, 0)] + r[(0, 1)] * c[(0, 1)] + r[(0, 2)] * c[(0, 2)];
        let next = 0.5 * (r + c * (1.0 / det));
        let change = (next - r).norm_squared();
        r = next;
        // The error after a step is about half the square of the step.
        if change < 1e-17 {
            break;
        }
    }
    r
}

/// Is a matrix far enough from inversion for Newton's iteration?
#[inline]
pub(super) fn is_regular(determinant: f64, norm: f64) -> bool {
    determinant > NEARLY_SINGULAR * norm * norm * norm
}

/// The matrix of cofactors, det(a) a⁻ᵀ.
#[inline]
pub fn cofactor(a: &Mat3) -> Mat3 {
    let (x, y, z) = (a.column(0), a.column(1), a.column(2));
    Mat3::from_columns(&[y.cross(&z), z.cross(&x), x.cross(&y)])
}

fn rotation_by_svd(f: &Mat3) -> Mat3 {
    let svd = f.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return Mat3::identity();
    };
    let mut u = u;
    if u.determinant() * v_t.determinant() < 0.0 {
        // Flip the direction of the smallest singular value: the nearest proper rotation.
        let smallest = svd.singular_values.imin();
        let flipped: Vec3 = -u.column(smallest);
        u.set_column(smallest, &flipped);
    }
    u * v_t
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn turned(axis: [f64; 3], angle: f64) -> Mat3 {
        nalgebra::Rotation3::from_scaled_axis(Vec3::from(axis).normalize() * angle).into_inner()
    }

    proptest! {
        #[test]
        fn recovers_rotation_and_stretch(
            axis in prop::array::uniform3(0.1..1.0f64), angle in -3.0..3.0f64,
            frame in prop::array::uniform3(0.1..1.0f64), lambda in prop::array::uniform3(0.05..3.0f64),
        ) {
            let r = turned(axis, angle);
            let q = turned(frame, 1.0);
            let u = q * Mat3::from_diagonal(&Vec3::from(lambda)) * q.transpose();
            let found = polar(&(r * u));
            prop_assert!((found.rotation - r).norm() < 1e-9);
            prop_assert!((found.stretch - u).norm() < 1e-9);
        }
    }

    #[test]
    fn keeps_a_proper_rotation_for_an_inverted_element() {
        let r = turned([1.0, 2.0, 3.0], 0.7);
        let u = Mat3::from_diagonal(&Vec3::new(1.2, 0.9, -0.3));
        let found = polar(&(r * u));
        assert!((found.rotation.determinant() - 1.0).abs() < 1e-12);
        assert!((found.rotation - r).norm() < 1e-12);
        assert!((found.stretch - u).norm() < 1e-12);
    }

    #[test]
    fn flat_and_zero_matrices_give_proper_rotations() {
        for f in [Mat3::zeros(), Mat3::from_diagonal(&Vec3::new(1.0, 1.0, 0.0))] {
            let found = polar(&f);
            assert!((found.rotation.determinant() - 1.0).abs() < 1e-12);
        }
        assert!(polar(&Mat3::from_element(f64::NAN)).rotation[(0, 0)].is_nan());
    }
}
