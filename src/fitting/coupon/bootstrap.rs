//! A band on the curves of a fitted law, by resampling residuals.
//!
//! ```text
//! P*_i = P(ε_i; θ̂) + √(n/(n − p)) r*_i,     r* = circular blocks of the test's residuals, drawn with replacement
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | θ̂ | the fit; each sample P* is fitted again from there |
//! | r | residuals P_i − P(ε_i; θ̂) of one test less their mean, in the order of strain; widths the same way, apart |
//! | n, p | residuals of all tests; free parameters: the factor undoes the fit's shrinking of its own residuals |
//! | ⌈√m⌉ | length of a block of a test with m points, because neighbouring residuals are alike |
//!
//! The band at a strain lies between quantiles of the refitted laws' stress there. Strains are taken as exact and centres
//! stay where they are. It says how the noise and the misfit within these specimens move the law, not how specimens
//! differ. Sources: Efron & Tibshirani 1993; Künsch 1989 and Politis & Romano 1992 for circular blocks.

use super::compare::beyond;
use super::fit::{CouponFit, CouponTest, points, stress_errors};
use super::state::response;
use crate::material::law::Law;
use crate::numerics::least_squares::Options;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

/// Points of a band along a test.
const POINTS: usize = 61;

/// A band on the stress of one test.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Strains of the test, from rest to 1.5 times its range.
    pub strain: Vec<f64>,
    /// Lower and upper stress \[MPa\].
    pub stress: Vec<[f64; 2]>,
}

/// What resampling tells.
#[derive(Clone, Debug, PartialEq)]
pub struct Bootstrap {
    /// Samples that were fitted.
    pub samples: usize,
    /// Samples whose fit failed and that are left out.
    pub failed: usize,
    /// Share of the refitted laws between the ends of the bands.
    pub confidence: f64,
    /// One per test.
    pub bands: Vec<Band>,
    /// Covariance of [`Law::parameters`] over the samples, `(n × n)`.
    pub covariance: Vec<Vec<f64>>,
}

/// Resamples `count` times; the same `seed` gives the same answer on any number of threads.
pub fn bootstrap(
    fit: &CouponFit,
    tests: &[CouponTest],
    count: usize,
    seed: u64,
    confidence: f64,
) -> Bootstrap {
    let laws: Vec<Option<Law>> = (0..count)
        .into_par_iter()
        .map(|i| {
            // Weyl's sequence keeps the seeds of samples apart.
            let seed = seed.wrapping_add((i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            refit(fit, &resample(fit, tests, &mut rng))
        })
        .collect();
    let laws: Vec<Law> = laws.into_iter().flatten().collect();
    let bands = tests.iter().map(|t| band(&laws, t, confidence)).collect();
    Bootstrap {
        samples: laws.len(),
        failed: count - laws.len(),
        confidence,
        bands,
        covariance: covariance(&laws),
    }
}

fn refit(fit: &CouponFit, tests: &[CouponTest]) -> Option<Law> {
    let options = Options {
        max_iterations: 60,
        cost_tolerance: 1e-9,
        ..Options::default()
    };
    let outcome = fit.family.minimise(tests, &fit.theta, &options).ok()?;
    fit.family.law(&outcome.parameters).ok()
}

fn resample(fit: &CouponFit, tests: &[CouponTest], rng: &mut Xoshiro256PlusPlus) -> Vec<CouponTest> {
    let (n, p) = (points(tests) as f64, fit.theta.len() as f64);
    let inflation = (n / (n - p).max(1.0)).sqrt();
    let draw = |test: &CouponTest| {
        let mut sample = test.clone();
        // The law's stress less the measured one: a resampled residual of the other sign is as good.
        let errors = stress_errors(&fit.law, test);
        let drawn = blocks(&errors, rng);
        for ((p, error), drawn) in sample.curve.stress.iter_mut().zip(&errors).zip(drawn) {
            *p += error - inflation * drawn;
        }
        let pairs = test.curve.lateral.iter();
        let sideways: Vec<f64> = pairs
            .map(|&(a, e)| response(&fit.law, test.kind, a).free.map_or(0.0, |free| free - e))
            .collect();
        let drawn = blocks(&sideways, rng);
        for ((pair, error), drawn) in sample.curve.lateral.iter_mut().zip(&sideways).zip(drawn) {
            pair.1 += error - inflation * drawn;
        }
        sample
    };
    tests.iter().map(draw).collect()
}

/// As many values as `x` has, in circular blocks of ⌈√m⌉, less their mean: a shift common to all samples is no noise.
fn blocks(x: &[f64], rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let m = x.len();
    let mean = x.iter().sum::<f64>() / m.max(1) as f64;
    let length = (m as f64).sqrt().ceil() as usize;
    let mut drawn = Vec::with_capacity(m + length);
    while drawn.len() < m {
        let first = rng.gen_range(0..m);
        drawn.extend((0..length).map(|i| x[(first + i) % m] - mean));
    }
    drawn.truncate(m);
    drawn
}

fn band(laws: &[Law], test: &CouponTest, confidence: f64) -> Band {
    let end = beyond(test);
    let strain: Vec<f64> = (0..POINTS)
        .map(|i| end * i as f64 / (POINTS - 1) as f64)
        .collect();
    let tail = 0.5 * (1.0 - confidence);
    let ends = |e: &f64| {
        let mut stress: Vec<f64> = laws.iter().map(|l| response(l, test.kind, *e).stress).collect();
        stress.retain(|p| p.is_finite());
        stress.sort_by(f64::total_cmp);
        [quantile(&stress, tail), quantile(&stress, 1.0 - tail)]
    };
    Band {
        stress: strain.par_iter().map(ends).collect(),
        strain,
    }
}

/// The quantile of sorted values, linear between them; NaN of none.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

fn covariance(laws: &[Law]) -> Vec<Vec<f64>> {
    let rows: Vec<Vec<f64>> = laws
        .iter()
        .map(|l| l.parameters().iter().map(|p| p.value).collect())
        .collect();
    let n = rows.first().map_or(0, Vec::len);
    let count = rows.len() as f64;
    let mean: Vec<f64> = (0..n)
        .map(|j| rows.iter().map(|r| r[j]).sum::<f64>() / count)
        .collect();
    let entry = |i: usize, j: usize| {
        let products = rows.iter().map(|r| (r[i] - mean[i]) * (r[j] - mean[j]));
        products.sum::<f64>() / (count - 1.0).max(1.0)
    };
    (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect()
}

#[cfg(test)]
#[path = "bootstrap_tests.rs"]
mod tests;
