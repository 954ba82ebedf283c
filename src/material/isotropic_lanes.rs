//! The moduli of an isotropic strain-dependent law at eight points at once: [`super::isotropic`]'s equations with the points
//! side by side, so that the compiler can use vector instructions.

// Index loops say here which numbers lie side by side.
#![allow(clippy::needless_range_loop)]

use super::isotropic::{INV_SQRT_3, IsotropicRbf, THREE_SQRT_6};
use super::law::SMOOTHING_STRAIN;
use crate::math::exponential::exp;
use crate::math::polar_lanes::{Lanes, Matrices, ZERO};

impl IsotropicRbf {
    /// Secant moduli (μ, K) \[MPa\] in every lane, `(2 × 8)`, at strains with the traces `trace`, `(8)`, and the deviators
    /// `dev`, `(3 × 3 × 8)`.
    #[inline(always)]
    pub fn moduli_in_lanes(&self, trace: &Lanes, dev: &Matrices) -> [Lanes; 2] {
        let rbf = self.log_moduli();
        if rbf.centres.is_empty() {
            return rbf.constant.map(|c| [c.exp(); 8]);
        }
        let q = self.held_invariants(trace, dev);
        let mut logarithms = rbf.constant.map(|c| [c; 8]);
        for (centre, weight) in rbf.centres.iter().zip(&rbf.weights) {
            let mut squared = ZERO;
            for d in 0..3 {
                for l in 0..8 {
                    squared[l] += (q[d][l] - centre[d]) * (q[d][l] - centre[d]);
                }
            }
            for l in 0..8 {
                let r = squared[l].sqrt();
                logarithms[0][l] += weight[0] * r;
                logarithms[1][l] += weight[1] * r;
            }
        }
        [exp(&logarithms[0]), exp(&logarithms[1])]
    }

    /// The invariants, held to the fitted range.
    #[inline(always)]
    fn held_invariants(&self, trace: &Lanes, dev: &Matrices) -> [Lanes; 3] {
        let mut q = [ZERO; 3];
        let d = |i: usize, j: usize, l: usize| dev[i][j][l];
        for l in 0..8 {
            let diagonal = d(0, 0, l) * d(0, 0, l) + d(1, 1, l) * d(1, 1, l) + d(2, 2, l) * d(2, 2, l);
            let off = d(0, 1, l) * d(0, 1, l) + d(0, 2, l) * d(0, 2, l) + d(1, 2, l) * d(1, 2, l);
            let smoothed = diagonal + 2.0 * off + SMOOTHING_STRAIN * SMOOTHING_STRAIN;
            let determinant = d(0, 0, l) * (d(1, 1, l) * d(2, 2, l) - d(1, 2, l) * d(1, 2, l))
                - d(0, 1, l) * (d(0, 1, l) * d(2, 2, l) - d(1, 2, l) * d(0, 2, l))
                + d(0, 2, l) * (d(0, 1, l) * d(1, 2, l) - d(1, 1, l) * d(0, 2, l));
            q[0][l] = trace[l] * INV_SQRT_3;
            q[1][l] = smoothed.sqrt() - SMOOTHING_STRAIN;
            q[2][l] = THREE_SQRT_6 * determinant / smoothed;
        }
        let (low, high) = (self.range().low(), self.range().high());
        for d in 0..3 {
            for l in 0..8 {
                q[d][l] = q[d][l].max(low[d]).min(high[d]);
            }
        }
        q
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::isotropic::invariants;
    use crate::material::law::Range;
    use crate::math::Mat3;
    use crate::math::mandel::{deviator, from_tensor, to_tensor, trace};

    #[test]
    fn agrees_with_the_law_at_one_point() {
        let centres = [
            [0.0, 0.0, 0.0],
            [-0.1, 0.3, -0.3],
            [0.05, 0.4, 0.4],
            [0.0, 0.5, 0.1],
        ];
        let moduli = [[0.1, 0.5], [0.2, 0.9], [0.15, 0.4], [0.3, 1.1]];
        let range = Range::new([-0.2, 0.0, -0.4], [0.1, 0.5, 0.5]).unwrap();
        let law = IsotropicRbf::interpolating(&centres, &moduli, range).unwrap();
        let strains: Vec<_> = (0..8)
            .map(|k| {
                let t = k as f64;
                let s = |a: f64| 0.09 * t * (a * (t + 1.0)).sin();
                from_tensor(&Mat3::new(
                    s(1.0),
                    s(2.0),
                    s(3.0),
                    s(2.0),
                    s(4.0),
                    s(5.0),
                    s(3.0),
                    s(5.0),
                    s(6.0),
                ))
            })
            .collect();
        let (mut traces, mut dev) = (ZERO, [[ZERO; 3]; 3]);
        for (l, e) in strains.iter().enumerate() {
            traces[l] = trace(e);
            let d = to_tensor(&deviator(e));
            for i in 0..3 {
                for j in 0..3 {
                    dev[i][j][l] = d[(i, j)];
                }
            }
        }
        let found = law.moduli_in_lanes(&traces, &dev);
        for (l, e) in strains.iter().enumerate() {
            let expected = law.moduli(&invariants(e));
            for k in 0..2 {
                assert!((found[k][l] / expected[k] - 1.0).abs() < 1e-13, "lane {l}");
            }
        }
    }
}
