//! Layouts judged by what is not known of their materials: a band about each predicted displacement, and the error that a
//! layout does not exceed with a given probability.
//!
//! ```text
//! x(z) = x(0) + Σ_m A_m z_m,   A_m = ∂x/∂p_m B_m,   B_m B_mᵀ = C_m,   z ~ N(0, I)
//! σ_i² = Σ_m |row i of A_m|²                        a reading lies within x_i ± 1.645 σ_i in 90 of 100 cases
//! pessimistic error = Q-quantile of RMS(x(z)) over N samples of z
//! ```
//!
//! p_m are the parameters of material m ([`crate::material::law::Law::parameters`]), C_m their covariance as its record has it, x
//! the response. All cells of a material share its z. The derivatives are exact at the equilibrium of each level
//! ([`crate::fem::rig_sensitivity`]); the response is taken to be linear in the parameters over a few deviations, which is off
//! by some percent of the deviation where that is a tenth of the modulus. z is the same for all layouts, so that their order does
//! not hang on the draw, and follows from the seed alone.
//!
//! A covariance of a fit says how well the tests determine the numbers of the law, given its form. Scatter between batches, ageing
//! and what the form cannot say are not in it. A material without a covariance counts as known exactly.

use super::goal::BaseMaterial;
use super::misfit::{Misfit, Target};
use super::space::Space;
use crate::fem::equilibrium;
use crate::fem::rig::{Bench, Layout, Rig};
use crate::fem::rig_sensitivity::Doubt;
use crate::material::law::Law;
use crate::material::record::Uncertainty;
use crate::math::normal::normal_pair;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::atomic::{AtomicBool, Ordering};

/// The standard normal distribution lies between its negative and this in 90 of 100 cases.
pub const BAND: f64 = 1.644_853_626_951_472_7;
/// Eigenvalues of a covariance below this share of the largest are rounding: records keep six digits.
const ROUNDING: f64 = 1e-6;
/// Samples of which the responses are held at a time.
const CHUNK: usize = 100;

/// How to judge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Q, the probability that the pessimistic error is not exceeded. Default 0.9.
    pub quantile: f64,
    /// N, samples. Default 2000.
    pub samples: usize,
    /// Seed of the samples. Default 1.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            quantile: 0.9,
            samples: 2000,
            seed: 1,
        }
    }
}

impl Options {
    /// # Errors
    /// [`RobustError`] names the option that cannot be.
    pub fn check(&self) -> Result<(), RobustError> {
        if !(self.quantile > 0.0 && self.quantile < 1.0) {
            return Err(RobustError::Quantile(self.quantile));
        }
        match self.samples {
            0 => Err(RobustError::Samples),
            _ => Ok(()),
        }
    }
}

/// Why layouts cannot be judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RobustError {
    /// The quantile.
    #[error(
        "the quantile of the pessimistic error is {0}: expected a number above 0 and below 1, for instance 0.9"
    )]
    Quantile(f64),
    /// No samples.
    #[error("0 samples: expected at least 1")]
    Samples,
    /// A record's covariance does not fit its law.
    #[error(
        "material {id:?}: uncertainty: {reason}; `pliant db check` says more, `pliant db refit` fits it again"
    )]
    Uncertainty {
        /// Its id.
        id: String,
        /// What is wrong.
        reason: String,
    },
}

/// What a layout is expected to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Forecast {
    /// Material of each cell.
    pub layout: Layout,
    /// Its error with all materials as their records have them.
    pub misfit: Misfit,
    /// Its RMS error at the quantile \[mm\].
    pub pessimistic_rms_mm: f64,
}

/// Doubts of a palette, `(palette)`; none where a record has no covariance.
///
/// # Errors
/// [`RobustError::Uncertainty`]: a covariance that does not fit its law.
pub fn doubts(palette: &[BaseMaterial]) -> Result<Vec<Option<Doubt>>, RobustError> {
    let one = |material: &BaseMaterial| {
        let read = |u: &Uncertainty| {
            doubt(u, &material.law).map_err(|reason| RobustError::Uncertainty {
                id: material.record.id.clone(),
                reason,
            })
        };
        material.record.uncertainty.as_ref().map(read).transpose()
    };
    palette.iter().map(one).collect()
}

/// B of a covariance, by its eigenvectors; parameters that it does not name are known.
fn doubt(uncertainty: &Uncertainty, law: &Law) -> Result<Doubt, String> {
    let names: Vec<String> = law.parameters().into_iter().map(|p| p.name).collect();
    let n = uncertainty.parameters.len();
    let covariance = DMatrix::from_fn(n, n, |i, j| {
        let row = uncertainty.covariance.get(i);
        row.and_then(|row| row.get(j)).copied().unwrap_or(f64::NAN)
    });
    if covariance.iter().any(|c| !c.is_finite()) {
        return Err("found a covariance with numbers that are missing or not finite".into());
    }
    let places = uncertainty
        .parameters
        .iter()
        .map(|name| {
            names
                .iter()
                .position(|k| k == name)
                .ok_or_else(|| format!("{name:?} is no parameter of the law"))
        })
        .collect::<Result<Vec<usize>, String>>()?;
    let eigen = SymmetricEigen::new(0.5 * (&covariance + covariance.transpose()));
    let largest = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
    let heard: Vec<usize> = (0..n)
        .filter(|&k| eigen.eigenvalues[k] > ROUNDING * largest)
        .collect();
    let mut spread = DMatrix::zeros(names.len(), heard.len());
    for (column, &k) in heard.iter().enumerate() {
        for (i, &place) in places.iter().enumerate() {
            spread[(place, column)] = eigen.eigenvectors[(i, k)] * eigen.eigenvalues[k].sqrt();
        }
    }
    Ok(Doubt { spread })
}

/// Judges layouts on one rig.
pub struct Judge<'a> {
    rig: &'a Rig,
    target: &'a Target,
    doubts: Vec<Option<Doubt>>,
    /// For each material its numbers, `(numbers × samples)`.
    draws: Vec<DMatrix<f64>>,
    options: Options,
    stop: &'a AtomicBool,
}

impl<'a> Judge<'a> {
    /// A judge of layouts on `rig`; `doubts`, `(palette)`. Setting `stop` ends what is under way.
    ///
    /// # Errors
    /// [`RobustError`] names the option that cannot be.
    pub fn new(
        rig: &'a Rig,
        target: &'a Target,
        doubts: Vec<Option<Doubt>>,
        options: Options,
        stop: &'a AtomicBool,
    ) -> Result<Judge<'a>, RobustError> {
        options.check()?;
        let draws = doubts
            .iter()
            .enumerate()
            .map(|(m, doubt)| {
                let numbers = doubt.as_ref().map_or(0, |d| d.spread.ncols());
                let mut random = Xoshiro256PlusPlus::seed_from_u64(options.seed);
                // Far apart in the generator's period: a stream for each material.
                (0..m).for_each(|_| random.jump());
                DMatrix::from_fn(numbers, options.samples, |_, _| normal_pair(&mut random)[0])
            })
            .collect();
        Ok(Judge {
            rig,
            target,
            doubts,
            draws,
            options,
            stop,
        })
    }

    /// A layout's response, `(components)` \[mm\], and what becomes of it with each uncertain number, `(components × numbers)`
    /// \[mm\], the materials one after the other. `None` for a layout without equilibrium under all loads, one at a limit point,
    /// and after a stop.
    pub fn modes(&self, bench: &mut Bench, layout: &[u8]) -> Option<(Vec<f64>, Vec<DMatrix<f64>>)> {
        let cancelled = || self.stop.load(Ordering::Relaxed);
        let exact = equilibrium::Options::default();
        let responded = bench.respond_in_full(layout, &exact, &cancelled);
        if !responded.response.complete {
            return None;
        }
        let modes = bench
            .derivatives_by_doubts(layout, &self.doubts, &responded)
            .ok()?;
        Some((responded.response.displacements, modes))
    }

    /// What a layout is expected to do; `None` as in [`Judge::modes`].
    pub fn forecast(&self, bench: &mut Bench, layout: &[u8]) -> Option<Forecast> {
        let (response, modes) = self.modes(bench, layout)?;
        let mut errors = self.sampled_errors(&response, &modes);
        errors.sort_by(f64::total_cmp);
        let place = (self.options.quantile * errors.len() as f64).ceil() as usize;
        Some(Forecast {
            layout: layout.to_vec(),
            misfit: self.target.misfit(&response),
            pessimistic_rms_mm: errors[place.clamp(1, errors.len()) - 1],
        })
    }

    /// RMS errors of the sampled responses, `(samples)` \[mm\].
    fn sampled_errors(&self, response: &[f64], modes: &[DMatrix<f64>]) -> Vec<f64> {
        let mean = DVector::from_column_slice(response);
        let mut errors = Vec::with_capacity(self.options.samples);
        for first in (0..self.options.samples).step_by(CHUNK) {
            let count = CHUNK.min(self.options.samples - first);
            let mut sampled = DMatrix::from_fn(response.len(), count, |i, _| mean[i]);
            for (own, draws) in modes.iter().zip(&self.draws) {
                if own.ncols() > 0 {
                    sampled += own * draws.columns(first, count);
                }
            }
            errors.extend(
                sampled
                    .column_iter()
                    .map(|x| self.target.misfit(x.as_slice()).rms_mm),
            );
        }
        errors
    }

    /// Forecasts of `layouts`, the least pessimistic error first; those without one are left out.
    pub fn ranked(&self, layouts: &[Layout]) -> Vec<Forecast> {
        let mut forecasts: Vec<Forecast> = layouts
            .par_iter()
            .map_init(
                || self.rig.bench().ok(),
                |bench, layout| self.forecast(bench.as_mut()?, layout),
            )
            .flatten()
            .collect();
        forecasts.sort_by(by_pessimism);
        forecasts
    }

    /// Forecasts of `layouts` and of what exchanges of one cell's material make of the best of them, the best exchange first,
    /// until none lowers the pessimistic error; the least pessimistic error first. After a stop: what is known by then.
    pub fn improved(&self, space: &Space, layouts: &[Layout]) -> Vec<Forecast> {
        let mut known: HashSet<Layout> = layouts.iter().cloned().collect();
        let mut forecasts = self.ranked(layouts);
        while let Some(best) = forecasts.first().cloned() {
            let fresh: Vec<Layout> = space
                .neighbours(&best.layout)
                .into_iter()
                .filter(|layout| known.insert(layout.clone()))
                .collect();
            forecasts.extend(self.ranked(&fresh));
            forecasts.sort_by(by_pessimism);
            if forecasts[0].layout == best.layout || self.stop.load(Ordering::Relaxed) {
                break;
            }
        }
        forecasts
    }

    /// Which materials of the palette have no covariance.
    pub fn known_exactly(&self) -> Vec<usize> {
        (0..self.doubts.len())
            .filter(|&m| self.doubts[m].is_none())
            .collect()
    }
}

/// By pessimistic error, then by layout.
fn by_pessimism(a: &Forecast, b: &Forecast) -> std::cmp::Ordering {
    let errors = a.pessimistic_rms_mm.total_cmp(&b.pessimistic_rms_mm);
    errors.then_with(|| a.layout.cmp(&b.layout))
}

/// Deviation of a sum of components with `weights`, pairs of component and factor.
pub fn deviation(modes: &[DMatrix<f64>], weights: &[(usize, f64)]) -> f64 {
    let square = |own: &DMatrix<f64>| -> f64 {
        let of = |k: usize| weights.iter().map(|&(i, w)| w * own[(i, k)]).sum::<f64>();
        (0..own.ncols()).map(|k| of(k).powi(2)).sum()
    };
    modes.iter().map(square).sum::<f64>().sqrt()
}

#[cfg(test)]
#[path = "robust_tests.rs"]
mod tests;
