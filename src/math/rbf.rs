//! Interpolation of scattered values by radial basis functions.
//!
//! ```text
//! f(q) = c + Σ_i w_i φ(|q − q_i|),   φ(r) = r,   Σ_i w_i = 0
//! ```
//!
//! | symbol | meaning | size |
//! |---|---|---|
//! | q, q_i | where it is asked, the i-th centre | D |
//! | w_i | weights of the i-th centre, one per interpolated quantity | V |
//! | c | constants | V |
//!
//! The side condition Σw = 0 makes the linear kernel, which is only conditionally positive definite, uniquely solvable
//! for distinct centres, and gives constants back exactly (Carr et al. 2001, Reconstruction and representation of 3D
//! objects with radial basis functions, section 3). Two consequences that users of this module lean on: between
//! centres that lie on one line f is piecewise linear along that line, and far from all centres f tends to a constant
//! along every ray instead of growing.
//!
//! φ has a kink at each centre; the gradient there takes zero for the centre's own term.

/// An interpolant of `V` quantities over `D` coordinates. Without centres it is the constant.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearRbf<const D: usize, const V: usize> {
    /// Centres, `(n × D)`.
    pub centres: Vec<[f64; D]>,
    /// Weights, `(n × V)`; each column sums to zero.
    pub weights: Vec<[f64; V]>,
    /// Constants, `(V)`.
    pub constant: [f64; V],
}

/// Why no interpolant exists.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RbfError {
    /// Nothing to interpolate.
    #[error("an interpolant needs at least one centre")]
    Empty,
    /// As many rows of values as centres are needed.
    #[error("{centres} centres but {values} rows of values")]
    Length {
        /// Number of centres given.
        centres: usize,
        /// Number of rows of values given.
        values: usize,
    },
    /// A coordinate or a value is not a number.
    #[error("centre {index} or its value is not finite")]
    NotFinite {
        /// Which centre, from 0.
        index: usize,
    },
    /// Two centres are the same point as far as the solve can tell.
    #[error("centres {first} and {second} are only {distance:e} apart; merge them")]
    Coincident {
        /// The earlier centre, from 0.
        first: usize,
        /// The later centre, from 0.
        second: usize,
        /// Their distance.
        distance: f64,
    },
    /// The offset of a smooth kernel.
    #[error("kernel offset {0}: expected a finite number that is not negative")]
    Offset(f64),
    /// The linear system could not be solved.
    #[error("the interpolation matrix of {0} centres is singular")]
    Singular(usize),
}

/// Centres nearer than this (relative to the spread of all centres) count as one point.
pub const COINCIDENT: f64 = 1e-9;

impl<const D: usize, const V: usize> LinearRbf<D, V> {
    /// The same value everywhere.
    pub fn constant(value: [f64; V]) -> Self {
        LinearRbf {
            centres: Vec::new(),
            weights: Vec::new(),
            constant: value,
        }
    }

    /// The interpolant that takes `values[i]` at `centres[i]`.
    ///
    /// # Errors
    /// No centres, unequal lengths, numbers that are not finite, two centres at one point.
    pub fn interpolating(centres: &[[f64; D]], values: &[[f64; V]]) -> Result<Self, RbfError> {
        let n = centres.len();
        if n == 0 {
            return Err(RbfError::Empty);
        }
        if values.len() != n {
            return Err(RbfError::Length {
                centres: n,
                values: values.len(),
            });
        }
        for (index, (q, v)) in centres.iter().zip(values).enumerate() {
            if !q.iter().chain(v).all(|x| x.is_finite()) {
                return Err(RbfError::NotFinite { index });
            }
        }
        let mut matrix = nalgebra::DMatrix::<f64>::zeros(n + 1, n + 1);
        let mut spread = 0.0_f64;
        for i in 0..n {
            for j in 0..n {
                matrix[(i, j)] = distance(&centres[i], &centres[j]);
                spread = spread.max(matrix[(i, j)]);
            }
            matrix[(i, n)] = 1.0;
            matrix[(n, i)] = 1.0;
        }
        for second in 1..n {
            for first in 0..second {
                if matrix[(first, second)] <= COINCIDENT * spread {
                    return Err(RbfError::Coincident {
                        first,
                        second,
                        distance: matrix[(first, second)],
                    });
                }
            }
        }
        let right =
            nalgebra::DMatrix::<f64>::from_fn(n + 1, V, |i, k| if i < n { values[i][k] } else { 0.0 });
        let solution = matrix.lu().solve(&right).ok_or(RbfError::Singular(n))?;
        let weights = (0..n)
            .map(|i| std::array::from_fn(|k| solution[(i, k)]))
            .collect();
        Ok(LinearRbf {
            centres: centres.to_vec(),
            weights,
            constant: std::array::from_fn(|k| solution[(n, k)]),
        })
    }

    /// The distances of `q` from the centres, `(n)`: the kernels that [`Cardinal::values`] takes.
    pub fn distances(&self, q: &[f64; D]) -> Vec<f64> {
        self.centres.iter().map(|centre| distance(q, centre)).collect()
    }

    /// f(q), `(V)`.
    #[inline]
    pub fn value(&self, q: &[f64; D]) -> [f64; V] {
        let mut f = self.constant;
        for (centre, weight) in self.centres.iter().zip(&self.weights) {
            let r = distance(q, centre);
            for k in 0..V {
                f[k] += weight[k] * r;
            }
        }
        f
    }

    /// f(q), `(V)`, and ∂f/∂q, `(V × D)`.
    #[inline]
    pub fn value_and_gradient(&self, q: &[f64; D]) -> ([f64; V], [[f64; D]; V]) {
        let mut f = self.constant;
        let mut gradient = [[0.0; D]; V];
        for (centre, weight) in self.centres.iter().zip(&self.weights) {
            let r = distance(q, centre);
            let inverse = if r > 0.0 { 1.0 / r } else { 0.0 };
            for k in 0..V {
                f[k] += weight[k] * r;
                for d in 0..D {
                    gradient[k][d] += weight[k] * (q[d] - centre[d]) * inverse;
                }
            }
        }
        (f, gradient)
    }

    /// ∂f/∂q_j at `q` where the values at the centres stay what they are, `(n × V × D)`; `cardinal` is that of the centres.
    ///
    /// With A the interpolation matrix, A \[w; c\] = \[v; 0\] and ℓ the cardinal functions: df = dφ·w − ℓ·(dA w).
    pub fn value_by_centres(&self, q: &[f64; D], cardinal: &Cardinal) -> Vec<[[f64; D]; V]> {
        let shares = cardinal.values(&self.distances(q));
        let n = self.centres.len();
        // The unit vector from b to a; zero at the kink.
        let unit = |a: &[f64; D], b: &[f64; D]| -> [f64; D] {
            let r = distance(a, b);
            std::array::from_fn(|d| if r > 0.0 { (a[d] - b[d]) / r } else { 0.0 })
        };
        (0..n)
            .map(|j| {
                let from_here = unit(&self.centres[j], q);
                let mut slope: [[f64; D]; V] =
                    std::array::from_fn(|k| std::array::from_fn(|d| self.weights[j][k] * from_here[d]));
                for i in (0..n).filter(|&i| i != j) {
                    let between = unit(&self.centres[j], &self.centres[i]);
                    for (k, slope) in slope.iter_mut().enumerate() {
                        let pull = shares[i] * self.weights[j][k] + shares[j] * self.weights[i][k];
                        slope.iter_mut().zip(&between).for_each(|(s, b)| *s -= pull * b);
                    }
                }
                slope
            })
            .collect()
    }
}

/// Whether an interpolant has a constant term, and with it the condition Σw = 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstantTerm {
    /// f = c + Σ w φ, Σw = 0.
    With,
    /// f = Σ w φ.
    Without,
}

/// How an interpolant depends on its values: f(q) = Σ_j v_j ℓ_j(q) with the cardinal functions ℓ_j, which are 1 at their
/// own centre and 0 at the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Cardinal {
    /// \[w; c\] = M v: `(n + 1 × n)`, or `(n × n)` without a constant.
    weights_by_values: nalgebra::DMatrix<f64>,
}

impl Cardinal {
    /// The cardinal functions of `centres` under the kernel φ(r).
    ///
    /// # Errors
    /// No centres, coordinates that are not finite, two centres at one point, a singular matrix.
    pub fn new<const D: usize>(
        centres: &[[f64; D]],
        kernel: impl Fn(f64) -> f64,
        constant: ConstantTerm,
    ) -> Result<Self, RbfError> {
        let n = centres.len();
        if n == 0 {
            return Err(RbfError::Empty);
        }
        if let Some(index) = centres.iter().position(|q| !q.iter().all(|x| x.is_finite())) {
            return Err(RbfError::NotFinite { index });
        }
        let size = match constant {
            ConstantTerm::With => n + 1,
            ConstantTerm::Without => n,
        };
        let mut matrix = nalgebra::DMatrix::<f64>::zeros(size, size);
        let mut spread = 0.0_f64;
        for i in 0..n {
            for j in 0..n {
                let r = distance(&centres[i], &centres[j]);
                matrix[(i, j)] = kernel(r);
                spread = spread.max(r);
            }
            if size > n {
                matrix[(i, n)] = 1.0;
                matrix[(n, i)] = 1.0;
            }
        }
        for second in 1..n {
            for first in 0..second {
                let distance = distance(&centres[first], &centres[second]);
                if distance <= COINCIDENT * spread {
                    return Err(RbfError::Coincident {
                        first,
                        second,
                        distance,
                    });
                }
            }
        }
        let right = nalgebra::DMatrix::<f64>::identity(size, n);
        let weights_by_values = matrix.lu().solve(&right).ok_or(RbfError::Singular(n))?;
        if !weights_by_values.iter().all(|x| x.is_finite()) {
            return Err(RbfError::Singular(n));
        }
        Ok(Cardinal { weights_by_values })
    }

    /// Weights and constants of the interpolant with these values, `(n × V)` each.
    pub fn weights<const V: usize>(&self, values: &[[f64; V]]) -> (Vec<[f64; V]>, [f64; V]) {
        let m = &self.weights_by_values;
        let row = |i: usize| {
            std::array::from_fn(|k| values.iter().enumerate().map(|(j, v)| m[(i, j)] * v[k]).sum())
        };
        let n = m.ncols();
        let constant = if m.nrows() > n { row(n) } else { [0.0; V] };
        ((0..n).map(row).collect(), constant)
    }

    /// ℓ_j where the kernel of the i-th centre is `kernels[i]`, `(n)`.
    pub fn values(&self, kernels: &[f64]) -> Vec<f64> {
        let m = &self.weights_by_values;
        let n = m.ncols();
        (0..n)
            .map(|j| {
                let constant = if m.nrows() > n { m[(n, j)] } else { 0.0 };
                constant
                    + kernels
                        .iter()
                        .enumerate()
                        .map(|(i, k)| m[(i, j)] * k)
                        .sum::<f64>()
            })
            .collect()
    }

    /// ∂ℓ_j/∂q, `(n × D)`, from the gradients of the kernels.
    pub fn gradients<const D: usize>(&self, kernels: &[[f64; D]]) -> Vec<[f64; D]> {
        let m = &self.weights_by_values;
        (0..m.ncols())
            .map(|j| std::array::from_fn(|d| kernels.iter().enumerate().map(|(i, k)| m[(i, j)] * k[d]).sum()))
            .collect()
    }
}

/// The distance of two points.
#[inline]
pub(super) fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for d in 0..D {
        sum += (a[d] - b[d]) * (a[d] - b[d]);
    }
    sum.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_the_values_and_its_weights_sum_to_zero() {
        let centres = [[0.0, 0.0], [1.0, 0.0], [0.3, 2.0], [-0.5, 0.25]];
        let values = [[1.0, -2.0], [0.5, 3.0], [2.0, 0.0], [7.0, 1.0]];
        let f = LinearRbf::interpolating(&centres, &values).unwrap();
        for (q, v) in centres.iter().zip(&values) {
            let at = f.value(q);
            assert!(
                (at[0] - v[0]).abs() < 1e-12 && (at[1] - v[1]).abs() < 1e-12,
                "{at:?} {v:?}"
            );
        }
        for k in 0..2 {
            assert!(f.weights.iter().map(|w| w[k]).sum::<f64>().abs() < 1e-12);
        }
    }

    /// On one line the linear kernel is the broken line through the points, constant beyond its ends.
    #[test]
    fn is_the_broken_line_in_one_dimension() {
        let f = LinearRbf::interpolating(&[[0.0], [1.0], [3.0]], &[[2.0], [4.0], [1.0]]).unwrap();
        for (x, expected) in [(0.25, 2.5), (2.0, 2.5), (-5.0, 2.0), (40.0, 1.0)] {
            assert!(
                (f.value(&[x])[0] - expected).abs() < 1e-12,
                "f({x}) = {}",
                f.value(&[x])[0]
            );
        }
    }

    #[test]
    fn gradient_is_the_difference_quotient() {
        let centres = [
            [0.0, 0.0, 0.1],
            [1.0, 0.0, 0.0],
            [0.3, 2.0, 0.4],
            [-0.5, 0.25, 0.9],
        ];
        let values = [[1.0], [0.5], [2.0], [7.0]];
        let f = LinearRbf::interpolating(&centres, &values).unwrap();
        let q = [0.2, 0.7, -0.3];
        let (_, gradient) = f.value_and_gradient(&q);
        for d in 0..3 {
            let (mut up, mut down) = (q, q);
            up[d] += 1e-6;
            down[d] -= 1e-6;
            let quotient = (f.value(&up)[0] - f.value(&down)[0]) / 2e-6;
            assert!(gradient[0][d].abs() > 1e-3 && (gradient[0][d] - quotient).abs() < 1e-8);
        }
    }

    /// Against interpolants whose centres are moved and whose values are not.
    #[test]
    fn derivative_by_centres_is_the_difference_quotient() {
        let centres = [
            [0.0, 0.0, 0.1],
            [1.0, 0.0, 0.0],
            [0.3, 2.0, 0.4],
            [-0.5, 0.25, 0.9],
        ];
        let values = [[1.0, 3.0], [0.5, -1.0], [2.0, 0.4], [7.0, 1.0]];
        let f = LinearRbf::interpolating(&centres, &values).unwrap();
        let cardinal = Cardinal::new(&centres, |r| r, ConstantTerm::With).unwrap();
        let q = [0.2, 0.7, -0.3];
        let slopes = f.value_by_centres(&q, &cardinal);
        for j in 0..4 {
            for d in 0..3 {
                let at = |step: f64| {
                    let mut moved = centres;
                    moved[j][d] += step;
                    LinearRbf::interpolating(&moved, &values).unwrap().value(&q)
                };
                let (up, down) = (at(1e-6), at(-1e-6));
                for k in 0..2 {
                    let quotient = (up[k] - down[k]) / 2e-6;
                    assert!(quotient.abs() > 1e-4 && (slopes[j][k][d] - quotient).abs() < 1e-7);
                }
            }
        }
    }

    #[test]
    fn refuses_what_has_no_interpolant() {
        assert_eq!(LinearRbf::<1, 1>::interpolating(&[], &[]), Err(RbfError::Empty));
        let twice = LinearRbf::interpolating(&[[0.0], [1.0], [1.0]], &[[1.0], [2.0], [3.0]]);
        assert!(matches!(
            twice,
            Err(RbfError::Coincident {
                first: 1,
                second: 2,
                ..
            })
        ));
        let nan = LinearRbf::interpolating(&[[0.0], [1.0]], &[[1.0], [f64::NAN]]);
        assert_eq!(nan, Err(RbfError::NotFinite { index: 1 }));
    }
}
