//! Isotropic laws with an energy, evaluated on the principal axes of strain.
//!
//! ```text
//! ε = Σ_i e_i n_i⊗n_i,   λ_i = 1 + e_i,   W = W(e_1, e_2, e_3) symmetric
//! T = ∂W/∂ε = Σ_i t_i n_i⊗n_i,                              t_i = ∂W/∂e_i
//! C = ∂T/∂ε = Σ_ij H_ij (n_i⊗n_i)⊗(n_j⊗n_j) + Σ_{i<j} g_ij m_ij⊗m_ij,   H_ij = ∂²W/∂e_i∂e_j
//! g_ij = (t_i − t_j)/(e_i − e_j),   m_ij = (n_i⊗n_j + n_j⊗n_i)/√2
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | e, λ | principal Biot strains and stretches | – |
//! | n | principal axes, unit length | – |
//! | T, t | Biot stress and its principal values | MPa |
//! | C, H, g | tangent, its normal part and its three shear stiffnesses | MPa |
//!
//! Where two strains meet, the quotient g has the limit `½(H_ii + H_jj) − H_ij`, which is off by the square of their
//! distance. Source: R. W. Ogden, Non-Linear Elastic Deformations, 1984, section 6.1 (the derivative of an isotropic
//! tensor function), written for the Biot pair.

use crate::math::Mat3;
use crate::math::mandel::{Mandel, Mandel6, to_tensor};
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// Strains nearer than this take the limit of the quotient: its truncation (1e-12 of the third derivative) then stays
/// below the rounding of the quotient (1e-16 / 1e-6).
const MEETING: f64 = 1e-6;

/// The pairs (i, j) of the three principal shears.
const PAIRS: [(usize, usize); 3] = [(1, 2), (0, 2), (0, 1)];

/// Energy and its derivatives with respect to the principal strains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principal {
    /// W per undeformed volume \[MPa\].
    pub energy: f64,
    /// t_i = ∂W/∂e_i \[MPa\].
    pub stress: [f64; 3],
    /// H_ij = ∂²W/∂e_i∂e_j \[MPa\].
    pub hessian: [[f64; 3]; 3],
}

/// Principal strains and the tensors of their axes.
#[derive(Clone, Copy, Debug)]
pub struct Axes {
    /// e, not sorted.
    pub strains: [f64; 3],
    /// n_i⊗n_i, Mandel notation.
    dyads: [Mandel; 3],
    /// m_ij for the pairs yz, xz, xy of axes, Mandel notation.
    mixed: [Mandel; 3],
}

impl Axes {
    /// The principal axes of `strain`.
    #[inline]
    pub fn of(strain: &Mandel) -> Axes {
        let (strains, n) = symmetric_eigen(&to_tensor(strain));
        let product = |i: usize, j: usize, scale: f64| {
            let both = |a: usize, b: usize| scale * (n[(a, i)] * n[(b, j)] + n[(b, i)] * n[(a, j)]);
            Mandel::new(
                both(0, 0),
                both(1, 1),
                both(2, 2),
                SQRT_2 * both(1, 2),
                SQRT_2 * both(0, 2),
                SQRT_2 * both(0, 1),
            )
        };
        Axes {
            strains,
            dyads: [0, 1, 2].map(|i| product(i, i, 0.5)),
            mixed: PAIRS.map(|(i, j)| product(i, j, FRAC_1_SQRT_2)),
        }
    }

    /// The tensor with the principal values `t` on these axes.
    #[inline]
    pub fn tensor(&self, t: &[f64; 3]) -> Mandel {
        self.dyads[0] * t[0] + self.dyads[1] * t[1] + self.dyads[2] * t[2]
    }

    /// The exact tangent C.
    pub fn tangent(&self, at: &Principal) -> Mandel6 {
        self.assemble(&at.hessian, &self.shears(at))
    }

    /// The tangent with every eigenvalue below `floor` \[MPa\] raised to it: symmetric positive definite.
    pub fn definite_tangent(&self, at: &Principal, floor: f64) -> Mandel6 {
        let h = at.hessian;
        let normal = Mat3::from_fn(|i, j| 0.5 * (h[i][j] + h[j][i]));
        let (values, n) = symmetric_eigen(&normal);
        let mut raised = h;
        if values.iter().any(|v| *v < floor) {
            for (i, row) in raised.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry = (0..3).map(|k| values[k].max(floor) * n[(i, k)] * n[(j, k)]).sum();
                }
            }
        }
        self.assemble(&raised, &self.shears(at).map(|g| g.max(floor)))
    }

    /// The smallest eigenvalue of the tangent \[MPa\].
    pub fn least_stiffness(&self, at: &Principal) -> f64 {
        let normal = Mat3::from_fn(|i, j| at.hessian[i][j]);
        let (values, _) = symmetric_eigen(&normal);
        let least = |list: [f64; 3]| list[0].min(list[1]).min(list[2]);
        least(values).min(least(self.shears(at)))
    }

    fn shears(&self, at: &Principal) -> [f64; 3] {
        PAIRS.map(|(i, j)| {
            let distance = self.strains[i] - self.strains[j];
            if distance.abs() < MEETING {
                0.5 * (at.hessian[i][i] + at.hessian[j][j]) - at.hessian[i][j]
            } else {
                (at.stress[i] - at.stress[j]) / distance
            }
        })
    }

    fn assemble(&self, normal: &[[f64; 3]; 3], shears: &[f64; 3]) -> Mandel6 {
        let mut tangent = Mandel6::zeros();
        for (dyad, row) in self.dyads.iter().zip(normal) {
            tangent += dyad * self.tensor(row).transpose();
        }
        for (m, g) in self.mixed.iter().zip(shears) {
            tangent += (m * *g) * m.transpose();
        }
        tangent
    }
}

/// Eigenvalues and eigenvectors (in columns) of a symmetric matrix, by Jacobi's rotations: exact to rounding also for
/// equal eigenvalues, and the same bits every time. Not finite in, not finite out.
pub fn symmetric_eigen(matrix: &Mat3) -> ([f64; 3], Mat3) {
    let (mut a, mut n) = (*matrix, Mat3::identity());
    let small = 1e-34 * a.norm_squared();
    // Quadratic convergence: five sweeps are enough for any matrix, the rest is for none.
    for _ in 0..12 {
        let off = a[(0, 1)] * a[(0, 1)] + a[(0, 2)] * a[(0, 2)] + a[(1, 2)] * a[(1, 2)];
        if off <= small {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let apq = a[(p, q)];
            if apq == 0.0 {
                continue;
            }
            let theta = 0.5 * (a[(q, q)] - a[(p, p)]) / apq;
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            a[(p, p)] -= t * apq;
            a[(q, q)] += t * apq;
            a[(p, q)] = 0.0;
            a[(q, p)] = 0.0;
            let r = 3 - p - q;
            let (arp, arq) = (a[(r, p)], a[(r, q)]);
            a[(r, p)] = c * arp - s * arq;
            a[(p, r)] = a[(r, p)];
            a[(r, q)] = s * arp + c * arq;
            a[(q, r)] = a[(r, q)];
            for k in 0..3 {
                let (x, y) = (n[(k, p)], n[(k, q)]);
                n[(k, p)] = c * x - s * y;
                n[(k, q)] = s * x + c * y;
            }
        }
    }
    ([a[(0, 0)], a[(1, 1)], a[(2, 2)]], n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::mandel::from_tensor;

    #[test]
    fn eigenvalues_give_the_matrix_back() {
        let matrices = [
            Mat3::new(1.0, 2.0, 3.0, 2.0, -4.0, 5.0, 3.0, 5.0, 6.0),
            Mat3::new(2.0, 1e-9, 0.0, 1e-9, 2.0, 0.0, 0.0, 0.0, 2.0),
            Mat3::new(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
            Mat3::zeros(),
        ];
        for m in matrices {
            let (e, n) = symmetric_eigen(&m);
            let back = n * Mat3::from_diagonal(&e.into()) * n.transpose();
            // A few roundings of the largest entry.
            assert!((back - m).norm() <= 4e-15 * m.norm(), "{m}");
            assert!((n.transpose() * n - Mat3::identity()).norm() < 1e-15 * 8.0);
        }
        assert!(symmetric_eigen(&Mat3::from_element(f64::NAN)).0[0].is_nan());
    }

    #[test]
    fn the_axes_carry_hookes_law() {
        // W = μ Σe² + λ/2 (Σe)² with μ = 0.8, λ = 0.8: H = 2μ I + λ.
        let strain = Mandel::new(0.1, -0.2, 0.05, 0.02, 0.3, -0.1);
        let axes = Axes::of(&strain);
        let sum: f64 = axes.strains.iter().sum();
        let at = Principal {
            energy: 0.0,
            stress: axes.strains.map(|e| 1.6 * e + 0.8 * sum),
            hessian: [[2.4, 0.8, 0.8], [0.8, 2.4, 0.8], [0.8, 0.8, 2.4]],
        };
        let mut hooke = Mandel6::identity() * 1.6;
        hooke.view_mut((0, 0), (3, 3)).add_scalar_mut(0.8);
        assert!((axes.tangent(&at) - hooke).norm() < 1e-13);
        assert!((axes.definite_tangent(&at, 0.1) - hooke).norm() < 1e-13);
        assert!((axes.tensor(&at.stress) - hooke * strain).norm() < 1e-14);
        assert!((axes.least_stiffness(&at) - 1.6).abs() < 1e-14);
        let raised = axes.definite_tangent(&at, 2.0).symmetric_eigenvalues();
        assert!((raised.min() - 2.0).abs() < 1e-13 && (raised.max() - 4.0).abs() < 1e-13);
        let identity = axes.tensor(&[1.0; 3]) - from_tensor(&Mat3::identity());
        assert!(identity.norm() < 1e-15 * 8.0);
    }
}
