//! Linear systems that are not symmetric, near one that is.
//!
//! ```text
//! A x = b,   A M⁻¹ y = b,  x = M⁻¹ y;   the residual is least over the space of b, A M⁻¹ b, …
//! ```
//!
//! GMRES with the preconditioner on the right, without restart. Sliding friction makes the contact's stiffness
//! unsymmetric in a few directions only; with M its symmetric stand-in, a handful of steps is enough. Source: Saad and
//! Schultz, SIAM Journal on Scientific and Statistical Computing 7, 1986.

/// Solves `A x = b`, `(n)`, to ‖b − A x‖ ≤ `tolerance` ‖b‖ or for `most` steps; `multiply` is A, `precondition` M⁻¹ in
/// place. What it has then is returned.
pub(super) fn gmres(
    b: &[f64],
    multiply: &mut dyn FnMut(&[f64]) -> Vec<f64>,
    precondition: &mut dyn FnMut(&mut Vec<f64>),
    tolerance: f64,
    most: usize,
) -> Vec<f64> {
    let size = norm(b);
    let mut directions: Vec<Vec<f64>> = Vec::new();
    let mut basis = vec![scaled(b, 1.0 / size)];
    // Upper triangle by columns, after rotations that keep the right-hand side's norm in view.
    let mut triangle: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut right = vec![size];
    if size == 0.0 || !size.is_finite() {
        return vec![0.0; b.len()];
    }
    for k in 0..most {
        let mut z = basis[k].clone();
        precondition(&mut z);
        let mut w = multiply(&z);
        directions.push(z);
        let mut column = Vec::with_capacity(k + 2);
        for v in &basis {
            let h = dot(v, &w);
            w.iter_mut().zip(v).for_each(|(w, v)| *w -= h * v);
            column.push(h);
        }
        let rest = norm(&w);
        for (i, &(c, s)) in rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            (column[i], column[i + 1]) = (c * a + s * b, c * b - s * a);
        }
        let length = column[k].hypot(rest);
        if length == 0.0 || !length.is_finite() {
            directions.pop();
            break;
        }
        let (c, s) = (column[k] / length, rest / length);
        column[k] = length;
        triangle.push(column);
        rotations.push((c, s));
        right.push(-s * right[k]);
        right[k] *= c;
        if right[k + 1].abs() <= tolerance * size {
            break;
        }
        basis.push(scaled(&w, 1.0 / rest));
    }
    let steps = triangle.len();
    let mut weights = right[..steps].to_vec();
    for k in (0..steps).rev() {
        weights[k] /= triangle[k][k];
        for i in 0..k {
            weights[i] -= triangle[k][i] * weights[k];
        }
    }
    let mut x = vec![0.0; b.len()];
    for (direction, weight) in directions.iter().zip(&weights) {
        x.iter_mut().zip(direction).for_each(|(x, d)| *x += weight * d);
    }
    x
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn scaled(a: &[f64], by: f64) -> Vec<f64> {
    a.iter().map(|a| a * by).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A 6 × 6 matrix that is far from symmetric, its diagonal as the preconditioner: the answer is known beforehand.
    #[test]
    fn an_unsymmetric_system_is_solved() {
        let entry = |i: usize, j: usize| {
            if i == j {
                4.0 + i as f64
            } else {
                ((3 * i + 5 * j) % 7) as f64 / 4.0 - 0.5
            }
        };
        let multiply =
            |x: &[f64]| -> Vec<f64> { (0..6).map(|i| (0..6).map(|j| entry(i, j) * x[j]).sum()).collect() };
        let exact = [1.0, -2.0, 0.5, 3.0, -1.0, 2.0];
        let b = multiply(&exact);
        let found = gmres(
            &b,
            &mut |x| multiply(x),
            &mut |x| x.iter_mut().enumerate().for_each(|(i, x)| *x /= entry(i, i)),
            1e-12,
            6,
        );
        for (found, exact) in found.iter().zip(exact) {
            assert!((found - exact).abs() < 1e-9, "{found} {exact}");
        }
    }
}
