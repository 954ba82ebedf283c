//! Anderson acceleration of a fixed-point iteration.
//!
//! For x ← x + r(x), with the steps Δx_i and residual changes Δr_i of the last m iterations,
//!
//! ```text
//! γ = arg min ‖ r_k − ΔR γ ‖,   x_{k+1} = x_k + r_k − (ΔX + ΔR) γ
//! ```
//!
//! (Walker and Ni 2011, type II). Here r is the residual force seen through one old factorisation, r = −K₀⁻¹ R(x): an
//! iteration then costs a residual and a solve, about a tenth of a Newton step. The least-squares problem is solved
//! from its normal equations with a small ridge: m is 6 or so, and a poor γ costs an iteration, not the answer.

use nalgebra::{DMatrix, DVector};

/// The memory of the last iterations.
#[derive(Clone, Debug)]
pub struct Anderson {
    depth: usize,
    previous: Option<(Vec<f64>, Vec<f64>)>,
    steps: Vec<Vec<f64>>,
    changes: Vec<Vec<f64>>,
    oldest: usize,
}

/// Ridge of the normal equations, relative to their largest diagonal entry: drops directions that are parallel to the
/// last ten digits.
const RIDGE: f64 = 1e-12;

impl Anderson {
    /// A memory of `depth` iterations.
    pub fn new(depth: usize) -> Anderson {
        Anderson {
            depth,
            previous: None,
            steps: Vec::new(),
            changes: Vec::new(),
            oldest: 0,
        }
    }

    /// Forgets everything: the problem has changed.
    pub fn restart(&mut self) {
        self.previous = None;
        self.steps.clear();
        self.changes.clear();
        self.oldest = 0;
    }

    /// Moves `x` to the next iterate, given the residual step `r` at `x`, both `(n)`.
    pub fn advance(&mut self, x: &mut [f64], r: &[f64]) {
        self.remember(x, r);
        self.previous = Some((x.to_vec(), r.to_vec()));
        let m = self.steps.len();
        for (x, r) in x.iter_mut().zip(r) {
            *x += r;
        }
        if m == 0 {
            return;
        }
        let mut normal = DMatrix::zeros(m, m);
        let mut right = DVector::zeros(m);
        for i in 0..m {
            right[i] = dot(&self.changes[i], r);
            for j in 0..=i {
                normal[(i, j)] = dot(&self.changes[i], &self.changes[j]);
                normal[(j, i)] = normal[(i, j)];
            }
        }
        let ridge = RIDGE * normal.diagonal().amax();
        for i in 0..m {
            normal[(i, i)] += ridge;
        }
        let Some(gamma) = normal.cholesky().map(|c| c.solve(&right)) else {
            return;
        };
        for i in 0..m {
            for ((x, s), c) in x.iter_mut().zip(&self.steps[i]).zip(&self.changes[i]) {
                *x -= gamma[i] * (s + c);
            }
        }
    }

    fn remember(&mut self, x: &[f64], r: &[f64]) {
        let Some((old_x, old_r)) = &self.previous else {
            return;
        };
        let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
        let (step, change) = (difference(x, old_x), difference(r, old_r));
        if self.steps.len() < self.depth {
            self.steps.push(step);
            self.changes.push(change);
        } else if self.depth > 0 {
            self.steps[self.oldest] = step;
            self.changes[self.oldest] = change;
            self.oldest = (self.oldest + 1) % self.depth;
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x = cos-like contraction in four dimensions with a known fixed point at the origin.
    fn residual(x: &[f64]) -> Vec<f64> {
        let rates = [0.9, 0.7, -0.5, 0.2];
        x.iter()
            .zip(rates)
            .map(|(x, q)| q * (x + 0.05 * x * x) - x)
            .collect()
    }

    #[test]
    fn needs_far_fewer_iterations_than_the_plain_iteration() {
        let iterations = |depth: usize| {
            let (mut x, mut memory) = (vec![1.0; 4], Anderson::new(depth));
            for k in 0..1000 {
                let r = residual(&x);
                if dot(&r, &r).sqrt() < 1e-10 {
                    return k;
                }
                memory.advance(&mut x, &r);
            }
            1000
        };
        assert!(iterations(0) > 150);
        assert!(iterations(4) < 16, "{}", iterations(4));
    }
}
