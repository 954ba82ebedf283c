//! Symmetric tensors as 6-vectors.
//!
//! ```text
//! a = (a_xx, a_yy, a_zz, √2 a_yz, √2 a_xz, √2 a_xy)
//! ```
//!
//! Mandel's scaling keeps the tensor's inner product, `a · b = A : B`, so the Euclidean norm of the 6-vector is the
//! Frobenius norm of the tensor and does not change under rotation. Order and scaling are the ones in which Bickel
//! 2010, (8.5) is transversely isotropic about z; the 6-vector of (7.2) with its plain shear components is not
//! invariant.

use super::Mat3;
use std::f64::consts::SQRT_2;

/// A symmetric tensor in Mandel notation, `(6)`, order xx yy zz yz xz xy.
pub type Mandel = nalgebra::SVector<f64, 6>;
/// A linear map between symmetric tensors in Mandel notation, `(6 × 6)`.
pub type Mandel6 = nalgebra::SMatrix<f64, 6, 6>;

/// The symmetric part of `a` as a 6-vector.
#[inline]
pub fn from_tensor(a: &Mat3) -> Mandel {
    let half = 0.5 * SQRT_2;
    Mandel::new(
        a[(0, 0)],
        a[(1, 1)],
        a[(2, 2)],
        half * (a[(1, 2)] + a[(2, 1)]),
        half * (a[(0, 2)] + a[(2, 0)]),
        half * (a[(0, 1)] + a[(1, 0)]),
    )
}

/// The symmetric tensor whose 6-vector is `a`.
#[inline]
pub fn to_tensor(a: &Mandel) -> Mat3 {
    let s = 1.0 / SQRT_2;
    Mat3::new(
        a[0],
        s * a[5],
        s * a[4],
        s * a[5],
        a[1],
        s * a[3],
        s * a[4],
        s * a[3],
        a[2],
    )
}

/// The trace of the tensor.
#[inline]
pub fn trace(a: &Mandel) -> f64 {
    a[0] + a[1] + a[2]
}

/// The deviator `A − (tr A / 3) I`.
#[inline]
pub fn deviator(a: &Mandel) -> Mandel {
    let m = trace(a) / 3.0;
    Mandel::new(a[0] - m, a[1] - m, a[2] - m, a[3], a[4], a[5])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_inner_product() {
        let a = Mat3::new(1.0, 2.0, 3.0, 2.0, -4.0, 5.0, 3.0, 5.0, 6.0);
        let b = Mat3::new(0.5, -1.0, 2.0, -1.0, 3.0, 0.25, 2.0, 0.25, -2.0);
        let inner = from_tensor(&a).dot(&from_tensor(&b));
        assert!((inner - a.component_mul(&b).sum()).abs() < 1e-14);
        assert!((to_tensor(&from_tensor(&a)) - a).norm() < 1e-14);
    }
}
