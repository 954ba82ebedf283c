//! The law of a material from coupon tests.
//!
//! ```text
//! min_θ  Σ_t w_t/(n_t s_t²) Σ_i (P(ε_i; θ) − P_i)²  +  Σ_t w_t/(m_t r_t²) Σ_i (e(a_i; θ) − e_i)²  +  ties(θ)
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | θ | free numbers of a family of laws: [`super::rbf`], [`super::hyperelastic`] | |
//! | P(ε; θ), P_i | nominal stress of the law in the homogeneous test and as measured | MPa |
//! | e(a; θ), e_i | strain of the free side at strain a, from zero stress there, and as measured | – |
//! | s_t, r_t | root mean square of the test's stress and lateral strain | MPa, – |
//! | w_t | the test's weight; equal weights make each test count equally, however many points it has | – |
//!
//! No finite elements: the strain of a coupon is homogeneous. Levenberg–Marquardt, from one start or several as the
//! family says. Held-out tests take no part.

use super::curve::Curve;
use super::file::{FittedPoisson, LawChoice, Poisson, TestKind};
use super::hyperelastic::{self, Stretching};
use super::rbf::{self, Rbf};
use super::state::{response, slope_over_shear};
use crate::material::law::{Law, LawError};
use crate::numerics::least_squares::{LeastSquaresError, Options, Outcome, Stop, minimise};

/// Poisson's ratios that a fit may find. Above, the bulk modulus is so large that elements of a coarse mesh lock.
pub(super) const POISSON_BOUNDS: (f64, f64) = (0.0, 0.49);

/// A test to be fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct CouponTest {
    /// The kind.
    pub kind: TestKind,
    /// What it counts beside the others.
    pub weight: f64,
    /// What was measured.
    pub curve: Curve,
}

/// How well the law answers one test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestError {
    /// Root mean square of the stress error over that of the stress.
    pub relative_rms: f64,
    /// Largest stress error \[MPa\].
    pub largest_mpa: f64,
    /// Root mean square of the lateral strain's error over that of the lateral strain.
    pub lateral_relative_rms: Option<f64>,
}

/// A family of laws with free numbers θ.
#[derive(Clone, Debug, PartialEq)]
pub enum Family {
    /// Moduli that depend on strain.
    Rbf(Rbf),
    /// An energy of the stretches.
    Stretching(Stretching),
}

impl Family {
    /// The law at θ.
    ///
    /// # Errors
    /// Numbers that make no material.
    pub fn law(&self, theta: &[f64]) -> Result<Law, LawError> {
        match self {
            Family::Rbf(family) => family.law(theta),
            Family::Stretching(family) => family.law(theta),
        }
    }

    /// Names of θ with their units.
    pub fn names(&self) -> Vec<(String, &'static str)> {
        match self {
            Family::Rbf(family) => family.names(),
            Family::Stretching(family) => family.names(),
        }
    }

    /// Lower and upper bounds of θ.
    pub fn bounds(&self) -> &[(f64, f64)] {
        match self {
            Family::Rbf(family) => &family.bounds,
            Family::Stretching(family) => &family.bounds,
        }
    }

    /// Residuals that tie θ where the data is silent; empty for a hyperelastic law.
    pub fn ties(&self, theta: &[f64]) -> Vec<f64> {
        match self {
            Family::Rbf(family) => family.ties(theta),
            Family::Stretching(_) => Vec::new(),
        }
    }

    /// Minimises from `start`.
    ///
    /// # Errors
    /// A start that makes no law.
    pub(super) fn minimise(
        &self,
        tests: &[CouponTest],
        start: &[f64],
        options: &Options,
    ) -> Result<Outcome, LeastSquaresError> {
        let mut residual = |theta: &[f64]| match self.law(theta) {
            Ok(law) => {
                let mut r: Vec<f64> = residuals(&law, tests).concat();
                r.extend(self.ties(theta));
                r
            }
            Err(_) => vec![f64::NAN],
        };
        minimise(&mut residual, start, self.bounds(), options)
    }
}

/// The fitted law.
#[derive(Clone, Debug, PartialEq)]
pub struct CouponFit {
    /// Which law.
    pub choice: LawChoice,
    /// How Poisson's ratio was found.
    pub poisson: Poisson,
    /// The family, and the numbers found in it.
    pub family: Family,
    /// θ, rounded to six decimals.
    pub theta: Vec<f64>,
    /// The law; an RBF law's range is the box of invariants that the tests met.
    pub law: Law,
    /// Least and largest engineering strain of the uniaxial tests. Without any, of the other tests along an axis; without
    /// those, ∓ half of the shear, which are simple shear's principal strains to first order.
    pub engineering_strain: [f64; 2],
    /// One per test.
    pub errors: Vec<TestError>,
    /// Square root of the weighted mean of the squared relative errors of stress, and of width where it was measured.
    pub relative_rms: f64,
    /// Why the minimisation stopped.
    pub stop: Stop,
    /// Steps it took, over all starts.
    pub iterations: usize,
    /// Starts tried.
    pub starts: usize,
}

/// Why no law could be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CouponError {
    /// The data makes no start.
    #[error("test {index} ({test}): mean secant modulus {value} MPa: expected a positive number")]
    Start {
        /// Which test, from 1.
        index: usize,
        /// Its kind.
        test: &'static str,
        /// What was found \[MPa\].
        value: f64,
    },
    /// Nothing to fit, or nothing that tells Poisson's ratio.
    #[error("{0}")]
    Tests(&'static str),
    /// The minimiser.
    #[error(transparent)]
    LeastSquares(#[from] LeastSquaresError),
    /// Moduli that make no law.
    #[error(transparent)]
    Law(#[from] LawError),
}

/// Fits the law `choice` to `tests`; `centres` is for the RBF law.
///
/// # Errors
/// No tests, Poisson's ratio asked for where nothing tells it, data without a positive modulus.
pub fn fit(
    tests: &[CouponTest],
    poisson: Poisson,
    choice: LawChoice,
    centres: usize,
) -> Result<CouponFit, CouponError> {
    check_tests(tests, poisson, choice)?;
    let ratio = match poisson {
        Poisson::Assumed(ratio) | Poisson::AtRest(ratio) => ratio,
        Poisson::Fitted(_) => start_ratio(tests),
    };
    let found = match choice {
        LawChoice::Rbf => rbf::solve(tests, poisson, centres, ratio)?,
        _ => hyperelastic::solve(tests, poisson, choice, ratio)?,
    };
    let errors: Vec<TestError> = tests.iter().map(|t| test_error(&found.law, t)).collect();
    Ok(CouponFit {
        choice,
        poisson,
        law: found.law,
        engineering_strain: engineering_range(tests),
        relative_rms: overall(tests, &errors),
        errors,
        family: found.family,
        theta: found.theta,
        stop: found.stop,
        iterations: found.iterations,
        starts: found.starts,
    })
}

/// What a family's search answers.
pub(super) struct Found {
    pub family: Family,
    pub theta: Vec<f64>,
    pub law: Law,
    pub stop: Stop,
    pub iterations: usize,
    pub starts: usize,
}

fn check_tests(tests: &[CouponTest], poisson: Poisson, choice: LawChoice) -> Result<(), CouponError> {
    if tests.is_empty() {
        return Err(CouponError::Tests("there is no test to fit"));
    }
    let sideways = tests.iter().any(|t| !t.curve.lateral.is_empty());
    // Tension and compression share one ratio of their slopes to the shear modulus: they tell no Poisson's ratio.
    let slope = |t: &CouponTest| slope_over_shear(t.kind, 0.3);
    let several = tests.iter().any(|t| slope(t) != slope(&tests[0]));
    match poisson {
        Poisson::Fitted(FittedPoisson::ByStrain) if !sideways && choice == LawChoice::Rbf => Err(
            CouponError::Tests("Poisson's ratio by strain needs a test with lateral widths"),
        ),
        Poisson::Fitted(_) if !(sideways || several) => Err(CouponError::Tests(
            "a fitted Poisson's ratio needs lateral widths, or shear beside a uniaxial test (or another two kinds)",
        )),
        _ => Ok(()),
    }
}

/// The law's error in one test.
pub fn test_error(law: &Law, test: &CouponTest) -> TestError {
    let curve = &test.curve;
    let error = stress_errors(law, test);
    let sideways = lateral_errors(law, test);
    let widths: Vec<f64> = curve.lateral.iter().map(|l| l.1).collect();
    TestError {
        relative_rms: rms(&error) / rms(&curve.stress),
        largest_mpa: error.iter().fold(0.0, |worst: f64, e| worst.max(e.abs())),
        lateral_relative_rms: (!sideways.is_empty()).then(|| rms(&sideways) / rms(&widths)),
    }
}

/// The law's stress less the measured one at each point of a test \[MPa\].
pub fn stress_errors(law: &Law, test: &CouponTest) -> Vec<f64> {
    let points = test.curve.strain.iter().zip(&test.curve.stress);
    points
        .map(|(&e, p)| response(law, test.kind, e).stress - p)
        .collect()
}

fn lateral_errors(law: &Law, test: &CouponTest) -> Vec<f64> {
    let pairs = test.curve.lateral.iter();
    pairs
        .filter_map(|&(a, e)| response(law, test.kind, a).free.map(|free| free - e))
        .collect()
}

/// Groups of residuals of the sum above, ties left out: stress and, where it was measured, lateral strain of each test.
pub(super) fn residuals(law: &Law, tests: &[CouponTest]) -> Vec<Vec<f64>> {
    let mut groups = Vec::new();
    let mut add = |errors: Vec<f64>, measured: &[f64], weight: f64| {
        let scale = weight.sqrt() / (rms(measured) * (measured.len() as f64).sqrt());
        groups.push(errors.into_iter().map(|e| scale * e).collect());
    };
    for test in tests {
        add(stress_errors(law, test), &test.curve.stress, test.weight);
        if !test.curve.lateral.is_empty() {
            let widths: Vec<f64> = test.curve.lateral.iter().map(|l| l.1).collect();
            add(lateral_errors(law, test), &widths, test.weight);
        }
    }
    groups
}

/// √(Σ w e² / Σ w) over stress and width of all tests.
fn overall(tests: &[CouponTest], errors: &[TestError]) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (test, error) in tests.iter().zip(errors) {
        for e in std::iter::once(error.relative_rms).chain(error.lateral_relative_rms) {
            sum += test.weight * e * e;
            weights += test.weight;
        }
    }
    (sum / weights).sqrt()
}

/// Points that the law was compared with: stresses and widths.
pub fn points(tests: &[CouponTest]) -> usize {
    tests
        .iter()
        .map(|t| t.curve.stress.len() + t.curve.lateral.len())
        .sum()
}

pub(super) fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// −Σ e a / Σ a² over all tracked widths of uniaxial tests; 0.3 without.
fn start_ratio(tests: &[CouponTest]) -> f64 {
    let uniaxial = tests.iter().filter(|t| t.kind.is_uniaxial());
    let pairs: Vec<_> = uniaxial.flat_map(|t| &t.curve.lateral).collect();
    let (ea, aa): (f64, f64) = pairs
        .iter()
        .fold((0.0, 0.0), |(s, q), (a, e)| (s - e * a, q + a * a));
    if aa > 0.0 {
        (ea / aa).clamp(0.01, 0.48)
    } else {
        0.3
    }
}

/// Logarithm of the shear modulus that the mean secants of all tests make, in MPa.
///
/// # Errors
/// A test whose secant is not positive.
pub(super) fn mean_log_shear(tests: &[CouponTest], ratio: f64) -> Result<f64, CouponError> {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (k, test) in tests.iter().enumerate() {
        let points = test.curve.strain.iter().zip(&test.curve.stress);
        let (pe, ee) = points.fold((0.0, 0.0), |(pe, ee), (e, p)| (pe + p * e, ee + e * e));
        let here = pe / ee / slope_over_shear(test.kind, ratio);
        if here.is_nan() || here <= 0.0 {
            return Err(CouponError::Start {
                index: k + 1,
                test: test.kind.word(),
                value: here,
            });
        }
        sum += test.weight * here.ln();
        weights += test.weight;
    }
    Ok(sum / weights)
}

fn engineering_range(tests: &[CouponTest]) -> [f64; 2] {
    let over = |chosen: &dyn Fn(TestKind) -> bool, scale: &[f64]| {
        let strains = tests
            .iter()
            .filter(|t| chosen(t.kind))
            .flat_map(|t| &t.curve.strain);
        strains.fold([0.0_f64, 0.0_f64], |[low, high], &e| {
            let ends = scale.iter().map(|s| s * e);
            ends.fold([low, high], |[low, high], e| [low.min(e), high.max(e)])
        })
    };
    let none = [0.0, 0.0];
    let uniaxial = over(&TestKind::is_uniaxial, &[1.0]);
    let along = over(&|k| k != TestKind::SimpleShear, &[1.0]);
    match (uniaxial == none, along == none) {
        (false, _) => uniaxial,
        (true, false) => along,
        (true, true) => over(&|_| true, &[-0.5, 0.5]),
    }
}

#[cfg(test)]
#[path = "fit_tests.rs"]
pub(super) mod tests;
