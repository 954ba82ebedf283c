//! A problem whose Jacobian comes from central differences of its residual.

use super::{Problem, clamp};
use nalgebra::DMatrix;

/// A residual function made into a problem. A residual that is not finite counts as one that cannot be evaluated.
pub(super) struct Differences<'a> {
    pub residual: &'a mut dyn FnMut(&[f64]) -> Vec<f64>,
    pub bounds: &'a [(f64, f64)],
    /// Step relative to max(|x_j|, 1e-3).
    pub step: f64,
    /// Number of residuals.
    pub rows: usize,
    /// Calls of the residual function for differences.
    pub evaluations: usize,
}

impl Problem for Differences<'_> {
    fn residual(&mut self, x: &[f64]) -> Option<Vec<f64>> {
        Some((self.residual)(x))
    }

    /// Central differences, one-sided where a bound is in the way; an entry that is not finite counts as zero.
    fn jacobian(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(self.rows, x.len());
        for j in 0..x.len() {
            let h = self.step * x[j].abs().max(1e-3);
            let (mut up, mut down) = (x.to_vec(), x.to_vec());
            up[j] += h;
            down[j] -= h;
            clamp(&mut up, self.bounds);
            clamp(&mut down, self.bounds);
            let width = up[j] - down[j];
            let (above, below) = ((self.residual)(&up), (self.residual)(&down));
            self.evaluations += 2;
            for i in 0..self.rows.min(above.len()).min(below.len()) {
                let slope = (above[i] - below[i]) / width;
                jacobian[(i, j)] = if slope.is_finite() { slope } else { 0.0 };
            }
        }
        Some(jacobian)
    }
}
