//! What a fit leaves open: the covariance of its parameters, and the combinations that the data do not determine.
//!
//! ```text
//! C = s² (JᵀJ)⁻¹,   s² = |r|²/(m − k),      J D⁻¹ = U Σ Vᵀ,   D_jj = |J_j|:   C = s² D⁻¹ V Σ⁻² Vᵀ D⁻¹
//! ```
//!
//! | symbol | meaning | size |
//! |---|---|---|
//! | r, J | residuals of the data (no ties or priors) and their derivatives at the solution | m, m × n |
//! | k | combinations that the data determine, at most n | |
//! | D | column norms, so that units do not decide what counts as determined | n |
//!
//! A right singular vector whose singular value is below [`SILENT`] times the largest is a combination of parameters that
//! the data do not tell; it is left out of C and named. Valid where the model is nearly linear within a few standard
//! deviations and the residuals are independent. Source: Björck 1996, Numerical Methods for Least Squares Problems, 2.8.

use nalgebra::{DMatrix, DVector};

/// Singular values below this share of the largest belong to combinations that the data do not determine.
pub const SILENT: f64 = 1e-6;

/// How well the data determine the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance {
    /// C, `(n × n)`, in the units of the parameters squared; rows and columns of held parameters are zero.
    pub matrix: DMatrix<f64>,
    /// s², the variance of one residual.
    pub variance: f64,
    /// m − k.
    pub freedom: usize,
    /// What the data do not tell.
    pub undetermined: Vec<Undetermined>,
}

/// A combination of parameters that the data do not determine.
#[derive(Clone, Debug, PartialEq)]
pub struct Undetermined {
    /// Its singular value as a share of the largest; zero for a parameter that no residual depends on.
    pub share: f64,
    /// Direction in the space of the parameters, `(n)`, its largest component 1.
    pub direction: Vec<f64>,
}

impl Covariance {
    /// Covariance from the data's residuals `r`, `(m)`, and their `jacobian`, `(m × n)`; parameters that are not `free`
    /// (at a bound) count as known. `None` if there are no more residuals than free parameters, or numbers are not finite.
    pub fn new(r: &[f64], jacobian: &DMatrix<f64>, free: &[bool]) -> Option<Covariance> {
        let n = jacobian.ncols();
        let columns: Vec<usize> = (0..n).filter(|&j| free.get(j).copied().unwrap_or(true)).collect();
        let finite = r.iter().chain(jacobian.iter()).all(|x| x.is_finite());
        if !finite || jacobian.nrows() != r.len() || r.len() <= columns.len() {
            return None;
        }
        let norms: Vec<f64> = columns.iter().map(|&j| jacobian.column(j).norm()).collect();
        let largest = norms.iter().copied().fold(0.0, f64::max);
        let heard: Vec<usize> = (0..columns.len())
            .filter(|&k| norms[k] > SILENT * largest)
            .collect();
        let unheard = (0..columns.len()).filter(|k| !heard.contains(k));
        let mut undetermined: Vec<Undetermined> = unheard
            .map(|k| Undetermined {
                share: if largest > 0.0 { norms[k] / largest } else { 0.0 },
                direction: (0..n).map(|j| f64::from(u8::from(j == columns[k]))).collect(),
            })
            .collect();
        let scaled = DMatrix::from_fn(r.len(), heard.len(), |i, k| {
            jacobian[(i, columns[heard[k]])] / norms[heard[k]]
        });
        // The Gram matrix would lose the small singular values; the QR factor keeps them.
        let svd = scaled.qr().r().try_svd(false, true, f64::EPSILON, 0)?;
        let vectors = svd.v_t?;
        let top = svd.singular_values.iter().copied().fold(0.0, f64::max);
        let mut inverse = DMatrix::<f64>::zeros(n, n);
        let mut determined = 0;
        for (sigma, row) in svd.singular_values.iter().zip(vectors.row_iter()) {
            let mut direction = DVector::<f64>::zeros(n);
            for (k, v) in row.iter().enumerate() {
                direction[columns[heard[k]]] = v / norms[heard[k]];
            }
            if *sigma > SILENT * top {
                determined += 1;
                inverse += &direction * direction.transpose() / (sigma * sigma);
            } else {
                let peak = direction[direction.iamax()];
                undetermined.push(Undetermined {
                    share: sigma / top,
                    direction: direction.iter().map(|d| d / peak).collect(),
                });
            }
        }
        let freedom = r.len() - determined;
        let variance = r.iter().map(|x| x * x).sum::<f64>() / freedom as f64;
        Some(Covariance {
            matrix: inverse * variance,
            variance,
            freedom,
            undetermined,
        })
    }

    /// Standard deviations of the parameters, `(n)`.
    pub fn deviations(&self) -> Vec<f64> {
        self.matrix.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect()
    }
}
