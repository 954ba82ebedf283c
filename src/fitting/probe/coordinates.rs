//! The numbers that a fit moves: the law's parameters at each centre, in a form whose bounds are a box.
//!
//! ```text
//! isotropic                θ = ( ln μ,  ln K/μ )
//! transversely isotropic   θ = ( ln E44,  ln(E11 − E12),  ln l11,  l21/l11,  ln l22 ),    l21/l11 = √2 ν_a
//! ```
//!
//! The stiffness is positive definite for every θ, at the centres and between them: see [`crate::material::isotropic`] and
//! [`crate::material::transverse`]. In place of pushing an indefinite matrix back, as Rebonato and Jäckel's method does, there is
//! none. What is bounded besides is Poisson's ratio, K/μ = 2 (1 + ν)/(3 (1 − 2ν)); ν_a = E13/(E11 + E12) is that for load
//! along the axis.

use crate::material::law::{Law, LawError};
use nalgebra::DMatrix;
use std::f64::consts::SQRT_2;

/// Poisson's ratios that a fit may find: below lies no material that is pressed here, and above elements see no difference.
pub const POISSON_BOUNDS: (f64, f64) = (-0.5, 0.495);
/// The ratio for load along the axis may pass ½ where the axis is stiff.
const AXIAL_POISSON_BOUND: f64 = 1.5;
/// Moduli stay within this factor's logarithm of the start.
const DECADES: f64 = 7.0;

/// Which form the law has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// Two numbers a centre.
    Isotropic,
    /// Five numbers a centre.
    Transverse,
}

/// ln K/μ at a Poisson's ratio.
pub fn log_ratio(poisson: f64) -> f64 {
    (2.0 * (1.0 + poisson) / (3.0 * (1.0 - 2.0 * poisson))).ln()
}

impl Coordinates {
    /// The form of `law`; `None` for one that is not fitted to presses.
    pub fn of(law: &Law) -> Option<Coordinates> {
        match law {
            Law::Isotropic(_) | Law::Energy(_) => Some(Coordinates::Isotropic),
            Law::TransverselyIsotropic(_) => Some(Coordinates::Transverse),
            _ => None,
        }
    }

    /// Numbers a centre.
    pub fn per_centre(self) -> usize {
        match self {
            Coordinates::Isotropic => 2,
            Coordinates::Transverse => 5,
        }
    }

    /// θ of `law`, `(n)`.
    pub fn read(self, law: &Law) -> Vec<f64> {
        let values: Vec<f64> = law.parameters().iter().map(|p| p.value).collect();
        let rows = values.chunks_exact(self.per_centre());
        match self {
            Coordinates::Isotropic => rows.flat_map(|v| vec![v[0], v[1] - v[0]]).collect(),
            Coordinates::Transverse => rows
                .flat_map(|v| vec![v[0], v[1], v[2], v[3] * (-v[2]).exp(), v[4]])
                .collect(),
        }
    }

    /// `law` with other θ.
    ///
    /// # Errors
    /// A wrong count, or numbers too large for moduli.
    pub fn put(self, law: &Law, theta: &[f64]) -> Result<Law, LawError> {
        let rows = theta.chunks_exact(self.per_centre());
        let values: Vec<f64> = match self {
            Coordinates::Isotropic => rows.flat_map(|t| vec![t[0], t[0] + t[1]]).collect(),
            Coordinates::Transverse => rows
                .flat_map(|t| vec![t[0], t[1], t[2], t[3] * t[2].exp(), t[4]])
                .collect(),
        };
        law.with_parameters(&values)
    }

    /// ∂(law's parameters)/∂θ, `(n × n)`, a block for each centre.
    pub fn slope(self, theta: &[f64]) -> DMatrix<f64> {
        let mut slope = DMatrix::identity(theta.len(), theta.len());
        for (c, t) in theta.chunks_exact(self.per_centre()).enumerate() {
            let first = c * self.per_centre();
            match self {
                Coordinates::Isotropic => slope[(first + 1, first)] = 1.0,
                Coordinates::Transverse => {
                    slope[(first + 3, first + 2)] = t[3] * t[2].exp();
                    slope[(first + 3, first + 3)] = t[2].exp();
                }
            }
        }
        slope
    }

    /// Lower and upper bounds about the start `theta`, `(n)`.
    pub fn bounds(self, theta: &[f64]) -> Vec<(f64, f64)> {
        let about = |t: f64| (t - DECADES, t + DECADES);
        let one = |(k, t): (usize, &f64)| match (self, k % self.per_centre()) {
            (Coordinates::Isotropic, 1) => (log_ratio(POISSON_BOUNDS.0), log_ratio(POISSON_BOUNDS.1)),
            (Coordinates::Transverse, 3) => (-SQRT_2 * AXIAL_POISSON_BOUND, SQRT_2 * AXIAL_POISSON_BOUND),
            _ => about(*t),
        };
        theta.iter().enumerate().map(one).collect()
    }

    /// What the k-th number of θ is called.
    pub fn name(self, k: usize) -> String {
        const ISOTROPIC: [&str; 2] = ["ln shear modulus", "ln bulk over shear modulus"];
        const TRANSVERSE: [&str; 5] = ["ln E44", "ln(E11 − E12)", "ln l11", "l21/l11", "ln l22"];
        let (centre, n) = (k / self.per_centre(), k % self.per_centre());
        let word = match self {
            Coordinates::Isotropic => ISOTROPIC[n],
            Coordinates::Transverse => TRANSVERSE[n],
        };
        format!("{word} at centre {centre}")
    }
}
