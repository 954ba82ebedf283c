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
    /// Iterate and residual of the iteration before; empty at a start.
    previous: [Vec<f64>; 2],
    steps: Vec<Vec<f64>>,
    changes: Vec<Vec<f64>>,
    /// Products of the changes with each other, `(depth × depth)`.
    products: DMatrix<f64>,
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
            previous: [Vec::new(), Vec::new()],
            steps: Vec::new(),
            changes: Vec::new(),
            products: DMatrix::zeros(depth, depth),
            oldest: 0,
        }
    }

    /// Forgets everything: the problem has changed.
    pub fn restart(&mut self) {
        self.carry_on();
        self.steps.clear();
        self.changes.clear();
        self.oldest = 0;
    }

    /// Starts at another iterate of the same problem, or of one whose residual differs by a constant, and keeps what is known
    /// of its slope.
    pub fn carry_on(&mut self) {
        self.previous.iter_mut().for_each(Vec::clear);
    }

    /// Moves `x` to the next iterate, given the residual step `r` at `x`, both `(n)`.
    pub fn advance(&mut self, x: &mut [f64], r: &[f64]) {
        self.remember(x, r);
        let gamma = self.coefficients(r);
        for (x, r) in x.iter_mut().zip(r) {
            *x += r;
        }
        for (i, gamma) in gamma.iter().flat_map(|g| g.iter().enumerate()) {
            for ((x, s), c) in x.iter_mut().zip(&self.steps[i]).zip(&self.changes[i]) {
                *x -= gamma * (s + c);
            }
        }
    }

    /// γ; `None` without memory.
    fn coefficients(&self, r: &[f64]) -> Option<DVector<f64>> {
        let m = self.steps.len();
        if m == 0 {
            return None;
        }
        let mut normal = self.products.view((0, 0), (m, m)).into_owned();
        let right = DVector::from_fn(m, |i, _| dot(&self.changes[i], r));
        let ridge = RIDGE * normal.diagonal().amax();
        for i in 0..m {
            normal[(i, i)] += ridge;
        }
        normal.cholesky().map(|c| c.solve(&right))
    }

    fn remember(&mut self, x: &[f64], r: &[f64]) {
        if self.previous[0].is_empty() {
            self.previous = [x.to_vec(), r.to_vec()];
            return;
        }
        // The memory of the last iteration becomes that of the differences, the oldest difference that of this one.
        let [mut step, mut change] = std::mem::take(&mut self.previous);
        for ((s, x), (c, r)) in step.iter_mut().zip(x).zip(change.iter_mut().zip(r)) {
            *s = x - *s;
            *c = r - *c;
        }
        if self.depth == 0 {
            self.previous = [x.to_vec(), r.to_vec()];
            return;
        }
        let place = if self.steps.len() < self.depth {
            self.steps.push(step);
            self.changes.push(change);
            self.previous = [x.to_vec(), r.to_vec()];
            self.steps.len() - 1
        } else {
            let place = self.oldest;
            std::mem::swap(&mut self.steps[place], &mut step);
            std::mem::swap(&mut self.changes[place], &mut change);
            step.copy_from_slice(x);
            change.copy_from_slice(r);
            self.previous = [step, change];
            self.oldest = (place + 1) % self.depth;
            place
        };
        for i in 0..self.changes.len() {
            let product = dot(&self.changes[i], &self.changes[place]);
            self.products[(i, place)] = product;
            self.products[(place, i)] = product;
        }
    }
}

/// In four running sums, which vector instructions can hold side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4
        .remainder()
        .iter()
        .zip(b4.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a4.zip(b4) {
        for l in 0..4 {
            sums[l] += a[l] * b[l];
        }
    }
    sums.iter().sum::<f64>() + rest
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
