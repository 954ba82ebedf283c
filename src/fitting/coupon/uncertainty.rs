//! How well coupon tests determine the numbers of a law.
//!
//! ```text
//! C = H⁺ Jᵀ S J H⁺,   H = JᵀJ + TᵀT,   S = diag(σ_g²),   σ_g² = Σ_{i∈g} r_i²/n_g · n/(n − p)
//! C_law = G C Gᵀ,   G = ∂(parameters of the law)/∂θ
//! d_j = 1 − [H⁺ TᵀT]_jj
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | r, J | residuals of [`super::fit`] without ties, and their derivatives by θ, central differences |
//! | T | derivatives of the ties |
//! | g, n_g, σ_g² | a test's stresses, or its widths; how many; their variance |
//! | n, p | all residuals; free parameters |
//! | d_j | share of what holds θ_j that comes from data, 1 without ties |
//!
//! H⁺ leaves out directions in which the scaled H is below 10⁻¹⁰. A parameter at a bound is held there. The variances
//! may differ from test to test; residuals are taken as independent, which those of a smooth curve that misses a smooth
//! curve are not: these errors are then too small, and [`super::bootstrap`] is the better answer.

use super::fit::{CouponFit, CouponTest, Family, residuals};
use crate::material::law::Law;
use nalgebra::{DMatrix, DVector};

/// Eigenvalues of the scaled normal matrix below this are no information.
const SILENT: f64 = 1e-10;
/// A parameter with more than this share of its length in silent directions is not determined.
const SHARE_SILENT: f64 = 0.1;
/// Standard errors above this are no determination: of a logarithm, and relative to the value otherwise.
const LARGEST_ERROR: f64 = 0.5;

/// What is known of one number θ_j.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// What it is.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// The value found.
    pub value: f64,
    /// Its standard error; none where it is held at a bound or silent.
    pub standard_error: Option<f64>,
    /// Whether it lies at a bound.
    pub at_bound: bool,
    /// Whether the data, rather than ties and bounds, say what it is.
    pub determined: bool,
}

/// Uncertainty of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Knowledge {
    /// One per θ.
    pub numbers: Vec<Known>,
    /// Covariance of [`Law::parameters`], `(n × n)`, in the products of their units.
    pub covariance: Vec<Vec<f64>>,
}

/// What the tests tell of the numbers of `fit`.
pub fn knowledge(fit: &CouponFit, tests: &[CouponTest]) -> Knowledge {
    let (family, theta) = (&fit.family, fit.theta.as_slice());
    let n = theta.len();
    let at_bound: Vec<bool> = (0..n).map(|j| is_at_bound(family, theta, j)).collect();
    let groups = residuals(&fit.law, tests);
    let rows: usize = groups.iter().map(Vec::len).sum();
    let free = at_bound.iter().filter(|b| !**b).count();
    let correction = rows as f64 / (rows as f64 - free as f64).max(1.0);
    let mut variance = Vec::with_capacity(rows);
    for group in &groups {
        let mean = group.iter().map(|r| r * r).sum::<f64>() / group.len().max(1) as f64;
        variance.extend(std::iter::repeat_n(mean * correction, group.len()));
    }
    let data = |theta: &[f64]| family.law(theta).map(|law| residuals(&law, tests).concat());
    let mut jacobian = differences(family, theta, rows, &|t| data(t).unwrap_or_default());
    let ties = differences(family, theta, family.ties(theta).len(), &|t| family.ties(t));
    for j in (0..n).filter(|&j| at_bound[j]) {
        jacobian.column_mut(j).fill(0.0);
    }
    let mut tied = ties.tr_mul(&ties);
    for j in (0..n).filter(|&j| at_bound[j]) {
        tied.row_mut(j).fill(0.0);
        tied.column_mut(j).fill(0.0);
    }
    let (inverse, silent) = pseudo_inverse(&(jacobian.tr_mul(&jacobian) + &tied));
    let noise = DMatrix::from_diagonal(&DVector::from_vec(variance));
    let covariance = &inverse * (jacobian.tr_mul(&noise) * &jacobian) * &inverse;
    let from_ties = &inverse * tied;
    let names = family.names();
    let numbers = (0..n)
        .map(|j| {
            let error = covariance[(j, j)].max(0.0).sqrt();
            let limit = if names[j].0.starts_with("ln ") {
                LARGEST_ERROR
            } else {
                LARGEST_ERROR * theta[j].abs().max(0.1)
            };
            let told = !at_bound[j] && silent[j] < SHARE_SILENT;
            Known {
                name: names[j].0.clone(),
                unit: names[j].1,
                value: theta[j],
                standard_error: told.then_some(error),
                at_bound: at_bound[j],
                determined: told && error < limit && from_ties[(j, j)] < 0.5,
            }
        })
        .collect();
    let map = parameters_by_theta(family, theta, &fit.law);
    let of_law = &map * covariance * map.transpose();
    Knowledge {
        numbers,
        covariance: (0..of_law.nrows())
            .map(|i| of_law.row(i).iter().copied().collect())
            .collect(),
    }
}

fn is_at_bound(family: &Family, theta: &[f64], j: usize) -> bool {
    family.bounds().get(j).is_some_and(|(low, high)| {
        // θ is rounded to six decimals.
        theta[j] <= low + 2e-6 || theta[j] >= high - 2e-6
    })
}

/// Central differences of `rows` values, one-sided at a bound; what is not finite counts as zero.
fn differences(
    family: &Family,
    theta: &[f64],
    rows: usize,
    values: &dyn Fn(&[f64]) -> Vec<f64>,
) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(rows, theta.len());
    for j in 0..theta.len() {
        let h = 6e-6 * theta[j].abs().max(1e-2);
        let (mut up, mut down) = (theta.to_vec(), theta.to_vec());
        let (low, high) = family.bounds().get(j).copied().unwrap_or((f64::MIN, f64::MAX));
        up[j] = (theta[j] + h).min(high);
        down[j] = (theta[j] - h).max(low);
        let width = up[j] - down[j];
        let (above, below) = (values(&up), values(&down));
        for i in 0..rows.min(above.len()).min(below.len()) {
            let slope = (above[i] - below[i]) / width;
            jacobian[(i, j)] = if slope.is_finite() { slope } else { 0.0 };
        }
    }
    jacobian
}

/// The inverse on what is not silent, and for each parameter the share of its length in silent directions.
fn pseudo_inverse(normal: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let n = normal.nrows();
    // Scaled to a unit diagonal, so that units do not decide what is silent.
    let scale: Vec<f64> = (0..n)
        .map(|j| {
            let d = normal[(j, j)];
            if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 }
        })
        .collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.symmetric_eigen();
    let mut silent = vec![0.0; n];
    let mut inverse = DMatrix::zeros(n, n);
    for (k, value) in eigen.eigenvalues.iter().enumerate() {
        let v = eigen.eigenvectors.column(k);
        if *value > SILENT {
            inverse += v * v.transpose() / *value;
        } else {
            silent.iter_mut().zip(v.iter()).for_each(|(s, v)| *s += v * v);
        }
    }
    let unscaled = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
    (unscaled, silent)
}

fn parameters_by_theta(family: &Family, theta: &[f64], law: &Law) -> DMatrix<f64> {
    let values = |t: &[f64]| -> Vec<f64> {
        let law = family.law(t);
        law.map_or(Vec::new(), |law| {
            law.parameters().iter().map(|p| p.value).collect()
        })
    };
    differences(family, theta, law.parameters().len(), &values)
}
