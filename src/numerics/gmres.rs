//! Systems whose matrix is nearly symmetric: a factor of the symmetric part, and a few iterations for the rest.
//!
//! ```text
//! (S + W) x = b,   S = Sᵀ = L Lᵀ,   W = −Wᵀ:        (I + W S⁻¹) y = b,   x = S⁻¹ y
//! ```
//!
//! by GMRES (Saad and Schultz 1986). In the inner product of S⁻¹ the operator is the identity plus a skew one: its field
//! of values lies on the line 1 + i ℝ, so the iteration cannot stagnate (Concus and Golub 1976; Widlund 1978). The tangents of strain-space laws are of this
//! kind, with a W that is small against S: about five iterations, each a triangular solve and a product with W, in place of
//! an unsymmetric factorisation of twice the size.

use super::cholesky::Pattern;
use super::linear_solver::LinearSolver;
use nalgebra::DMatrix;

/// How the skew part enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Solves with S + W.
    Plain,
    /// Solves with the transposed matrix, S − W.
    Transposed,
}

/// y = W x for the skew matrix whose lower triangle has the values `skew`, `(nnz)`, on `pattern`; `x`, `y`: `(n)`.
pub fn skew_product(pattern: &Pattern, skew: &[f64], x: &[f64], y: &mut [f64]) {
    y.fill(0.0);
    for column in 0..pattern.unknowns() {
        let mut own = 0.0;
        let entries = pattern.columns[column]..pattern.columns[column + 1];
        for (&row, w) in pattern.rows[entries.clone()].iter().zip(&skew[entries]) {
            y[row] += w * x[column];
            own -= w * x[row];
        }
        y[column] += own;
    }
}

/// Solves with the matrix of symmetric part `factor` and skew lower triangle `skew` in place, `(n)`, until the residual is
/// below `tolerance` times the right-hand side; answers the number of iterations, at most `most`. If it does not
/// get there the best answer is left.
pub fn solve(
    factor: &mut LinearSolver,
    pattern: &Pattern,
    skew: &[f64],
    side: Side,
    right_hand_side: &mut [f64],
    tolerance: f64,
    most: usize,
) -> usize {
    let n = right_hand_side.len();
    let size = norm(right_hand_side);
    if size == 0.0 || !size.is_finite() {
        return 0;
    }
    let sign = if side == Side::Plain { 1.0 } else { -1.0 };
    let mut basis: Vec<Vec<f64>> = vec![right_hand_side.iter().map(|b| b / size).collect()];
    // Columns of the Hessenberg matrix turned to upper triangular form by plane rotations.
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut right = vec![size];
    let (mut seen, mut product) = (vec![0.0; n], vec![0.0; n]);
    for k in 0..most {
        seen.copy_from_slice(&basis[k]);
        factor.solve(&mut seen);
        skew_product(pattern, skew, &seen, &mut product);
        let mut next: Vec<f64> = basis[k].iter().zip(&product).map(|(v, w)| v + sign * w).collect();
        let mut column = Vec::with_capacity(k + 2);
        for v in &basis {
            let along = dot(v, &next);
            next.iter_mut().zip(v).for_each(|(x, v)| *x -= along * v);
            column.push(along);
        }
        let length = norm(&next);
        for (i, &(c, s)) in rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            (column[i], column[i + 1]) = (c * a + s * b, c * b - s * a);
        }
        let radius = column[k].hypot(length);
        if radius == 0.0 || !radius.is_finite() {
            break;
        }
        let (c, s) = (column[k] / radius, length / radius);
        column[k] = radius;
        rotations.push((c, s));
        columns.push(column);
        let last = right[k];
        right[k] = c * last;
        right.push(-s * last);
        if (s * last).abs() <= tolerance * size || length <= 1e-14 {
            break;
        }
        next.iter_mut().for_each(|x| *x /= length);
        basis.push(next);
    }
    combine(&columns, &right, &basis, right_hand_side);
    factor.solve(right_hand_side);
    columns.len()
}

/// y = Σ c_i v_i with R c = g.
fn combine(columns: &[Vec<f64>], right: &[f64], basis: &[Vec<f64>], y: &mut [f64]) {
    let m = columns.len();
    let r = DMatrix::from_fn(m, m, |i, j| if i <= j { columns[j][i] } else { 0.0 });
    let g = nalgebra::DVector::from_fn(m, |i, _| right[i]);
    let Some(c) = r.solve_upper_triangular(&g) else {
        return;
    };
    y.fill(0.0);
    for (c, v) in c.iter().zip(basis) {
        y.iter_mut().zip(v).for_each(|(y, v)| *y += c * v);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::cholesky::Symbolic;
    use std::sync::Arc;

    /// Advection and diffusion in one dimension: 2 on the diagonal, −1 ± 0.4 beside it.
    #[test]
    fn solves_an_unsymmetric_system_and_its_transpose() {
        let n = 60;
        let (mut columns, mut rows, mut values, mut skew) = (vec![0], Vec::new(), Vec::new(), Vec::new());
        for j in 0..n {
            rows.push(j);
            values.push(2.0);
            skew.push(0.0);
            if j + 1 < n {
                rows.push(j + 1);
                values.push(-1.0);
                skew.push(0.4);
            }
            columns.push(rows.len());
        }
        let pattern = Pattern { columns, rows };
        let mut factor = LinearSolver::new(Arc::new(Symbolic::new(pattern.clone()).unwrap())).unwrap();
        factor.factorise(&values).unwrap();
        for (side, below, above) in [(Side::Plain, -0.6, -1.4), (Side::Transposed, -1.4, -0.6)] {
            let exact: Vec<f64> = (0..n).map(|i| (0.3 * i as f64).sin()).collect();
            let mut x: Vec<f64> = (0..n)
                .map(|i| {
                    let low = if i > 0 { below * exact[i - 1] } else { 0.0 };
                    let high = if i + 1 < n { above * exact[i + 1] } else { 0.0 };
                    low + 2.0 * exact[i] + high
                })
                .collect();
            let iterations = solve(&mut factor, &pattern, &skew, side, &mut x, 1e-12, n);
            assert!(iterations > 1 && iterations <= n);
            let off = x
                .iter()
                .zip(&exact)
                .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(off < 1e-9, "{off:e}");
        }
    }
}
