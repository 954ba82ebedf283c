//! Smooth interpolation of scattered values: multiquadrics.
//!
//! ```text
//! f(q) = a + Σ_i w_i φ(|q − q_i|),   φ(r) = √(r² + c²),   Σ_i w_i = 0
//! ```
//!
//! | symbol | meaning | size |
//! |---|---|---|
//! | q, q_i | where it is asked, the i-th centre | D |
//! | w_i, a | weights, one per interpolated quantity; constants | V |
//! | c | the kernel's offset: it is rounded off over this distance | – |
//!
//! φ is conditionally positive definite of order one up to its sign (Micchelli 1986), so with Σw = 0 the interpolant
//! exists and is unique for distinct centres, and gives constants back exactly. It has derivatives of every order, and
//! for c → 0 it becomes [`super::rbf::LinearRbf`]. A large c makes the matrix nearly singular: a few distances of
//! neighbouring centres are the most that is sensible.

use super::rbf::{Cardinal, ConstantTerm, RbfError, distance};

/// A smooth interpolant of `V` quantities over `D` coordinates. Without centres it is the constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Multiquadric<const D: usize, const V: usize> {
    /// Centres, `(n × D)`.
    pub centres: Vec<[f64; D]>,
    /// Weights, `(n × V)`; each column sums to zero.
    pub weights: Vec<[f64; V]>,
    /// Constants, `(V)`.
    pub constant: [f64; V],
    /// c.
    pub offset: f64,
}

/// f, ∂f/∂q and ∂²f/∂q².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet<const D: usize, const V: usize> {
    /// f, `(V)`.
    pub value: [f64; V],
    /// ∂f/∂q, `(V × D)`.
    pub gradient: [[f64; D]; V],
    /// ∂²f/∂q², `(V × D × D)`.
    pub hessian: [[[f64; D]; D]; V],
}

impl<const D: usize, const V: usize> Multiquadric<D, V> {
    /// The same value everywhere.
    pub fn constant(value: [f64; V]) -> Self {
        Multiquadric {
            centres: Vec::new(),
            weights: Vec::new(),
            constant: value,
            offset: 0.0,
        }
    }

    /// The interpolant that takes `values[i]` at `centres[i]`, with the offset c, and its cardinal functions.
    ///
    /// # Errors
    /// No centres, unequal lengths, numbers that are not finite, a negative offset, two centres at one point.
    pub fn interpolating(
        centres: &[[f64; D]],
        values: &[[f64; V]],
        offset: f64,
    ) -> Result<(Self, Cardinal), RbfError> {
        if values.len() != centres.len() {
            return Err(RbfError::Length {
                centres: centres.len(),
                values: values.len(),
            });
        }
        if let Some(index) = values.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return Err(RbfError::NotFinite { index });
        }
        if !(offset >= 0.0 && offset.is_finite()) {
            return Err(RbfError::Offset(offset));
        }
        let cardinal = Cardinal::new(centres, |r| (r * r + offset * offset).sqrt(), ConstantTerm::With)?;
        let (weights, constant) = cardinal.weights(values);
        let f = Multiquadric {
            centres: centres.to_vec(),
            weights,
            constant,
            offset,
        };
        Ok((f, cardinal))
    }

    /// φ at `q` for each centre, `(n)`.
    pub fn kernels(&self, q: &[f64; D]) -> Vec<f64> {
        self.centres
            .iter()
            .map(|centre| kernel(&difference(q, centre), self.offset))
            .collect()
    }

    /// ∂φ/∂q for each centre, `(n × D)`.
    pub fn kernel_gradients(&self, q: &[f64; D]) -> Vec<[f64; D]> {
        let kernels = self.kernels(q);
        let gradient = |(centre, kernel): (&[f64; D], f64)| {
            let inverse = if kernel > 0.0 { 1.0 / kernel } else { 0.0 };
            std::array::from_fn(|d| (q[d] - centre[d]) * inverse)
        };
        self.centres.iter().zip(kernels).map(gradient).collect()
    }

    /// f(q), `(V)`.
    #[inline]
    pub fn value(&self, q: &[f64; D]) -> [f64; V] {
        let mut f = self.constant;
        for (centre, weight) in self.centres.iter().zip(&self.weights) {
            let kernel = kernel(&difference(q, centre), self.offset);
            for (f, w) in f.iter_mut().zip(weight) {
                *f += w * kernel;
            }
        }
        f
    }

    /// f and its first two derivatives: ∂φ = x/φ, ∂²φ = (I − x xᵀ/φ²)/φ with x = q − q_i.
    pub fn jet(&self, q: &[f64; D]) -> Jet<D, V> {
        let mut jet = Jet {
            value: self.constant,
            gradient: [[0.0; D]; V],
            hessian: [[[0.0; D]; D]; V],
        };
        for (centre, weight) in self.centres.iter().zip(&self.weights) {
            let x = difference(q, centre);
            let kernel = kernel(&x, self.offset);
            let inverse = if kernel > 0.0 { 1.0 / kernel } else { 0.0 };
            let unit = x.map(|x| x * inverse);
            for (k, w) in weight.iter().enumerate() {
                jet.value[k] += w * kernel;
                for a in 0..D {
                    jet.gradient[k][a] += w * unit[a];
                    for b in 0..D {
                        let identity = if a == b { 1.0 } else { 0.0 };
                        jet.hessian[k][a][b] += w * inverse * (identity - unit[a] * unit[b]);
                    }
                }
            }
        }
        jet
    }
}

#[inline]
fn difference<const D: usize>(q: &[f64; D], centre: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|d| q[d] - centre[d])
}

/// √(|x|² + c²).
#[inline]
fn kernel<const D: usize>(x: &[f64; D], offset: f64) -> f64 {
    let mut sum = offset * offset;
    for x in x {
        sum += x * x;
    }
    sum.sqrt()
}

/// The mean distance of a centre from its nearest neighbour; 0 for fewer than two.
pub fn mean_spacing<const D: usize>(centres: &[[f64; D]]) -> f64 {
    if centres.len() < 2 {
        return 0.0;
    }
    let nearest = |i: usize| {
        let others = centres.iter().enumerate().filter(|(j, _)| *j != i);
        others
            .map(|(_, q)| distance(q, &centres[i]))
            .fold(f64::INFINITY, f64::min)
    };
    (0..centres.len()).map(nearest).sum::<f64>() / centres.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const CENTRES: [[f64; 2]; 5] = [[0.0, 0.0], [1.0, 0.0], [0.3, 2.0], [-0.5, 0.25], [1.2, 1.1]];
    const VALUES: [[f64; 2]; 5] = [[1.0, -2.0], [0.5, 3.0], [2.0, 0.0], [7.0, 1.0], [0.0, 2.0]];

    #[test]
    fn takes_the_values_at_the_centres() {
        let (f, cardinal) = Multiquadric::interpolating(&CENTRES, &VALUES, 0.4).unwrap();
        for (q, v) in CENTRES.iter().zip(&VALUES) {
            let at = f.value(q);
            assert!(
                (at[0] - v[0]).abs() < 1e-12 && (at[1] - v[1]).abs() < 1e-12,
                "{at:?} {v:?}"
            );
        }
        let q = [0.4, -0.7];
        let shares = cardinal.values(&f.kernels(&q));
        assert!(
            (shares.iter().sum::<f64>() - 1.0).abs() < 1e-12,
            "constants come back"
        );
        let sum: f64 = shares.iter().zip(&VALUES).map(|(l, v)| l * v[1]).sum();
        assert!((sum - f.value(&q)[1]).abs() < 1e-12);
    }

    #[test]
    fn derivatives_are_difference_quotients() {
        let (f, cardinal) = Multiquadric::interpolating(&CENTRES, &VALUES, 0.3).unwrap();
        let h = 1e-5;
        for q in [[0.2, 0.7], [1.0, 0.0], [-3.0, 2.0]] {
            let jet = f.jet(&q);
            assert_eq!(jet.value, f.value(&q));
            let shares = cardinal.gradients(&f.kernel_gradients(&q));
            for d in 0..2 {
                let (mut up, mut down) = (q, q);
                up[d] += h;
                down[d] -= h;
                let (a, b) = (f.jet(&up), f.jet(&down));
                let of_shares: f64 = shares.iter().zip(&VALUES).map(|(l, v)| l[d] * v[1]).sum();
                assert!((of_shares - jet.gradient[1][d]).abs() < 1e-12);
                for k in 0..2 {
                    let slope = (a.value[k] - b.value[k]) / (2.0 * h);
                    // h² times a third derivative of order 1/c².
                    assert!((jet.gradient[k][d] - slope).abs() < 1e-7, "{slope}");
                    for e in 0..2 {
                        let bend = (a.gradient[k][e] - b.gradient[k][e]) / (2.0 * h);
                        assert!((jet.hessian[k][e][d] - bend).abs() < 1e-7, "{bend}");
                    }
                }
            }
        }
    }

    #[test]
    fn refuses_what_has_no_interpolant() {
        let twice = Multiquadric::interpolating(&[[0.0], [1.0], [1.0]], &[[1.0], [2.0], [3.0]], 0.1);
        assert!(matches!(
            twice,
            Err(RbfError::Coincident {
                first: 1,
                second: 2,
                ..
            })
        ));
        assert!(Multiquadric::interpolating(&[[0.0], [1.0]], &[[1.0], [2.0]], f64::NAN).is_err());
        assert!((mean_spacing(&[[0.0], [1.0], [3.0]]) - 4.0 / 3.0).abs() < 1e-15);
    }
}
