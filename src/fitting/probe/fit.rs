//! The fit: a homogeneous law, then centres over the strains that it meets, in rounds, and the forces under the probe.
//!
//! ```text
//! linear law at small strain → homogeneous law → [ strains met → centres → all presses at once ] × rounds
//!                                              → centres move with the moduli → to the end
//! ```
//!
//! Tangential forces under the probe are estimated after the homogeneous law and after the rounds, each time in turns with
//! fits, and are kept if the markers elsewhere are better for them.
//!
//! Each arrow but the first is a Levenberg–Marquardt minimisation of [`super::problem`]; a step to a law that the specimen does
//! not stand is refused and shortened. A fit of rounds ends when the centres stay where they are. Source: Bickel 2010, 8.3.

use super::centres::{moved, strains_met, with_centres, with_range};
use super::coordinates::Coordinates;
use super::errors::{Errors, errors};
use super::press::{Bench, Failure, Levels};
use super::problem::{CentresMove, ProbeProblem, free_centres};
use super::spread::{self, Final, PressCurve, Spread};
use super::start::{RATIOS, Symmetry, standing, young};
use super::tangential;
use crate::material::law::{Law, LawError};
use crate::math::Vec3;
use crate::numerics::least_squares::{self, LeastSquaresError, News, Stop, minimise_problem};
use std::time::Instant;

/// How to fit.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeOptions {
    /// Centres, rest among them; 1 for a homogeneous law. `None`: 6 for an isotropic law, 12 for a transversely isotropic one.
    pub centres: Option<usize>,
    /// Most rounds of placing centres and fitting. Default 6.
    pub rounds: usize,
    /// Most Levenberg–Marquardt steps of a round. Default 40.
    pub iterations: usize,
    /// Whether the centres move with the moduli after the rounds. Default true.
    pub moves_centres: bool,
    /// Whether tangential forces under the probe are estimated where markers tell them. Default true.
    pub tangential: bool,
    /// Refits of the bootstrap; 0 for none. Default 0.
    pub bootstrap: usize,
    /// Seed of the bootstrap. Default 1.
    pub seed: u64,
}

impl Default for ProbeOptions {
    fn default() -> ProbeOptions {
        ProbeOptions {
            centres: None,
            rounds: 6,
            iterations: 40,
            moves_centres: true,
            tangential: true,
            bootstrap: 0,
            seed: 1,
        }
    }
}

/// Why no law could be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProbeError {
    /// An option out of its range.
    #[error("{field} = {value}: expected {expected}")]
    Option {
        /// Name of the option.
        field: &'static str,
        /// The value found.
        value: usize,
        /// What was expected.
        expected: &'static str,
    },
    /// Nothing to fit.
    #[error(
        "no example has a reading to fit: all {held_out} held-out examples are for comparison, and {empty} others have no reading"
    )]
    Nothing {
        /// Examples that are held out.
        held_out: usize,
        /// Others without a reading.
        empty: usize,
    },
    /// A deviation that is no weight.
    #[error("example {press:?}: a standard deviation of {value} mm: expected a positive number")]
    Deviation {
        /// Name of the example.
        press: String,
        /// The value found \[mm\].
        value: f64,
    },
    /// The readings go against the forces.
    #[error(
        "the measured displacements go against the forces (the best linear material has a negative modulus): check the signs and the axes"
    )]
    Backwards,
    /// The specimen does not stand its presses with any law that was tried.
    #[error("no law was found with which the specimen stands its presses: {0}")]
    Stands(#[from] Failure),
    /// The minimiser.
    #[error(transparent)]
    LeastSquares(#[from] LeastSquaresError),
    /// Moduli that make no law.
    #[error(transparent)]
    Law(#[from] LawError),
    /// Asked to stop before there was anything.
    #[error("stopped on request, before there was a law")]
    Cancelled,
}

/// What a fit is doing.
#[derive(Clone, Debug)]
pub struct Step {
    /// In words.
    pub stage: String,
    /// Steps tried in this stage.
    pub iterations: usize,
    /// Root mean square of the residuals over their deviations.
    pub scaled_rms: f64,
}

/// One minimisation.
#[derive(Clone, Debug, PartialEq)]
pub struct Round {
    /// In words.
    pub stage: String,
    /// Centres of the law.
    pub centres: usize,
    /// Root mean square of the residuals over their deviations, at the end.
    pub scaled_rms: f64,
    /// Steps tried.
    pub iterations: usize,
    /// Laws that were solved for.
    pub evaluations: usize,
    /// Why it stopped.
    pub stop: Stop,
}

/// What was found about the forces under the probe.
#[derive(Clone, Debug, PartialEq)]
pub enum Tangential {
    /// Not asked for.
    Off,
    /// No marker under a probe tells them.
    Untold,
    /// Estimated, but the markers elsewhere were no better for it; taken back.
    Dropped,
    /// Estimated and used, `(presses × levels)` \[N\].
    Used {
        /// Presses that they were estimated for, and their forces.
        forces: Vec<(String, Vec<Vec3>)>,
        /// Root mean square of the scaled residuals of the markers that are not under a probe, without these forces and
        /// with them.
        elsewhere: [f64; 2],
    },
}

/// What a fit came to.
#[derive(Clone, Debug)]
pub struct ProbeFit {
    /// The law; its range is the box of invariants that the presses met.
    pub law: Law,
    /// The homogeneous law that the centres came from.
    pub homogeneous: Law,
    /// The minimisations, in order.
    pub rounds: Vec<Round>,
    /// Did the centres settle, rather than the rounds run out?
    pub has_settled: bool,
    /// Why the last minimisation stopped.
    pub stop: Stop,
    /// Starts that were tried.
    pub starts: usize,
    /// The forces under the probe.
    pub tangential: Tangential,
    /// Errors of the examples that were fitted.
    pub errors: Errors,
    /// Errors of those that were held out; `None` where there are none, and the reason where the law does not stand them.
    pub held_out: Option<Result<Errors, Failure>>,
    /// Force–displacement curves, of the fitted examples first.
    pub curves: Vec<PressCurve>,
    /// What the data leave open; `None` where the readings are too few.
    pub spread: Option<Spread>,
    /// Least and largest normal strain along the specimen's axes that an integration point met.
    pub strain: [f64; 2],
    /// Readings that were fitted.
    pub readings: usize,
    /// Wall time \[s\].
    pub seconds: f64,
}

impl ProbeFit {
    /// Did the last minimisation end because there was nothing left to gain?
    pub fn has_converged(&self) -> bool {
        !matches!(self.stop, Stop::Iterations | Stop::Cancelled)
    }
}

/// A law with its minimisation.
struct Descent {
    law: Law,
    theta: Vec<f64>,
    equilibria: Vec<Levels>,
    outcome: least_squares::Outcome,
    data_rows: usize,
    free: Vec<bool>,
}

impl Descent {
    /// Root mean square of the data's rows.
    fn scaled_rms(&self) -> f64 {
        rms(&self.outcome.residual[..self.data_rows])
    }
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// Cost falls by less than this part: a round ends.
const ROUND_TOLERANCE: f64 = 1e-3;
/// The same where the centres move, which is slow near the end and worth little there.
const MOVE_TOLERANCE: f64 = 1e-2;
/// The same for the last minimisation.
const LAST_TOLERANCE: f64 = 1e-7;
/// Centres that move by less than this share of their reach have settled.
const SETTLED: f64 = 0.02;
/// A homogeneous fit that leaves more than this share of the displacements ended badly, as does one at a bound.
const BAD: f64 = 0.5;
/// A residual that falls to more than this share of what it was has not changed.
const NEWS: f64 = 0.99;
/// The same for rounds.
const ROUND_NEWS: f64 = 0.9;
/// Most estimates of the tangential forces, each with a fit.
const ALTERNATIONS: usize = 3;
/// Relative noise that is expected before there is a fit.
const FIRST_NOISE: f64 = 0.02;
/// Residuals below this share of the displacements are the solver's own.
const LEAST_NOISE: f64 = 1e-6;

struct Fitter<'a> {
    symmetry: Symmetry,
    options: &'a ProbeOptions,
    which: Vec<usize>,
    /// Root mean square of x̄/σ.
    size: f64,
    cancelled: &'a (dyn Fn() -> bool + Sync),
    news: &'a mut dyn FnMut(&Step),
    rounds: Vec<Round>,
}

/// Fits a law to the presses of `bench` that are not held out; tangential forces that are found go into its presses.
///
/// # Errors
/// [`ProbeError`]: no readings, readings that go against the forces, a specimen that no law holds up.
pub fn fit(
    bench: &mut Bench,
    symmetry: Symmetry,
    options: &ProbeOptions,
    cancelled: &(dyn Fn() -> bool + Sync),
    news: &mut dyn FnMut(&Step),
) -> Result<ProbeFit, ProbeError> {
    let began = Instant::now();
    let which = check(bench, options)?;
    let mut fitter = Fitter {
        symmetry,
        options,
        size: size(bench, &which),
        which,
        cancelled,
        news,
        rounds: Vec::new(),
    };
    let (homogeneous, starts) = fitter.homogeneous(bench)?;
    let first = homogeneous.law.clone();
    let homogeneous = fitter.alternate(bench, homogeneous)?;
    let (found, has_settled) = fitter.rounds(bench, homogeneous)?;
    let (found, tangential) = fitter.tangential(bench, found)?;
    let found = fitter.moved(bench, found)?;
    let found = fitter.last(bench, found)?;
    fitter.outcome(bench, found, first, (starts, has_settled, tangential), began)
}

/// The presses to be fitted.
fn check(bench: &Bench, options: &ProbeOptions) -> Result<Vec<usize>, ProbeError> {
    for (field, value, least) in [
        ("centres", options.centres.unwrap_or(1), 1),
        ("rounds", options.rounds, 1),
        ("iterations", options.iterations, 1),
    ] {
        if value < least || value > 1000 {
            let expected = "a number from 1 to 1000";
            return Err(ProbeError::Option {
                field,
                value,
                expected,
            });
        }
    }
    for press in &bench.presses {
        for (deviations, readings) in press.deviations.iter().zip(&press.readings) {
            for (&value, _) in deviations.iter().zip(readings).filter(|(_, r)| r.is_some()) {
                if !(value > 0.0 && value.is_finite()) {
                    return Err(ProbeError::Deviation {
                        press: press.name.clone(),
                        value,
                    });
                }
            }
        }
    }
    let has_reading = |k: &usize| bench.presses[*k].readings.iter().flatten().any(Option::is_some);
    let all = 0..bench.presses.len();
    let (held_out, rest): (Vec<usize>, Vec<usize>) = all.partition(|&k| bench.presses[k].held_out);
    let which: Vec<usize> = rest.iter().copied().filter(has_reading).collect();
    if which.is_empty() {
        return Err(ProbeError::Nothing {
            held_out: held_out.len(),
            empty: rest.len(),
        });
    }
    Ok(which)
}

/// Root mean square of √w x̄/σ.
fn size(bench: &Bench, which: &[usize]) -> f64 {
    let mut scaled = Vec::new();
    for &k in which {
        let press = &bench.presses[k];
        for (readings, deviations) in press.readings.iter().zip(&press.deviations) {
            let seen = readings.iter().zip(deviations);
            scaled.extend(seen.filter_map(|(r, d)| Some(press.weight.sqrt() * (*r)? / d)));
        }
    }
    rms(&scaled).max(f64::MIN_POSITIVE)
}

impl Fitter<'_> {
    /// Minimises from `law`; `None` where the specimen does not stand the presses with it.
    fn descend(
        &mut self,
        bench: &Bench,
        law: &Law,
        noise: f64,
        tolerance: f64,
        centres: CentresMove,
        stage: &str,
    ) -> Result<Option<Descent>, ProbeError> {
        let coordinates = self.symmetry.coordinates;
        let mut start = coordinates.read(law);
        let values = start.len();
        let mut bounds = coordinates.bounds(&start);
        if centres == CentresMove::Yes {
            start.extend(free_centres(law));
            // Strains beyond twice the material's own size are none that a press makes.
            bounds.resize(start.len(), (-2.0, 2.0));
        }
        let least = LEAST_NOISE * self.size;
        let options = least_squares::Options {
            max_iterations: self.options.iterations,
            cost_tolerance: tolerance,
            step_tolerance: 1e-7,
            gradient_tolerance: 1e-9,
            negligible_cost: least * least,
            ..least_squares::Options::default()
        };
        let news = &mut *self.news;
        let rows = super::problem::count(bench, &self.which) as f64;
        let mut tell = |n: &News| {
            news(&Step {
                stage: stage.to_string(),
                iterations: n.iterations,
                scaled_rms: (2.0 * n.cost / f64::max(rows, 1.0)).sqrt(),
            });
        };
        let mut problem = ProbeProblem::new(
            bench,
            &self.which,
            law,
            coordinates,
            (noise.max(least), centres),
            self.cancelled,
            &mut tell,
        );
        let outcome = match minimise_problem(&mut problem, &start, &bounds, &options) {
            // Refused steps are what a fit that was asked to stop is left with.
            Ok(outcome) if (self.cancelled)() => least_squares::Outcome {
                stop: Stop::Cancelled,
                ..outcome
            },
            Ok(outcome) => outcome,
            Err(LeastSquaresError::NoStart) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        let Some((law, equilibria)) = problem.best.take() else {
            return Ok(None);
        };
        let theta = outcome.parameters[..values].to_vec();
        let outcome = without_centres(outcome, start.len() - values);
        let inside = |(t, (low, high)): (&f64, &(f64, f64))| *t > *low && *t < *high;
        let descent = Descent {
            free: theta.iter().zip(&bounds).map(inside).collect(),
            data_rows: rows as usize,
            law,
            theta,
            equilibria,
            outcome,
        };
        self.rounds.push(Round {
            stage: stage.to_string(),
            centres: descent.theta.len() / coordinates.per_centre(),
            scaled_rms: descent.scaled_rms(),
            iterations: descent.outcome.iterations,
            evaluations: descent.outcome.evaluations,
            stop: descent.outcome.stop,
        });
        Ok(Some(descent))
    }

    /// The homogeneous law, from several starts where the first ends badly; how many.
    fn homogeneous(&mut self, bench: &Bench) -> Result<(Descent, usize), ProbeError> {
        let mut best: Option<Descent> = None;
        let mut starts = 0;
        let mut failed = None;
        for ratio in RATIOS {
            starts += 1;
            let Some(modulus) = young(bench, &self.which, &self.symmetry, ratio, self.cancelled)? else {
                return Err(ProbeError::Backwards);
            };
            let start = [modulus, ratio];
            let law = match standing(bench, &self.which, &self.symmetry, start, self.cancelled) {
                Ok(law) => law,
                Err(error) => {
                    failed = Some(error);
                    continue;
                }
            };
            let stage = match starts {
                1 => "homogeneous".to_string(),
                n => format!("homogeneous, start {n}"),
            };
            let noise = FIRST_NOISE * self.size;
            let found = self.descend(bench, &law, noise, ROUND_TOLERANCE, CentresMove::No, &stage)?;
            if (self.cancelled)() && best.is_none() {
                return found.map(|d| (d, starts)).ok_or(ProbeError::Cancelled);
            }
            let Some(found) = found else { continue };
            let is_good = found.scaled_rms() < BAD * self.size && found.free.iter().all(|f| *f);
            if best.as_ref().is_none_or(|b| found.outcome.cost < b.outcome.cost) {
                best = Some(found);
            }
            if is_good || (self.cancelled)() {
                break;
            }
        }
        match (best, failed) {
            (Some(best), _) => Ok((best, starts)),
            (None, Some(error)) => Err(error),
            (None, None) => Err(ProbeError::Cancelled),
        }
    }

    /// Centres and fits, in rounds; did they settle?
    fn rounds(&mut self, bench: &Bench, homogeneous: Descent) -> Result<(Descent, bool), ProbeError> {
        let count = self.options.centres.unwrap_or(match self.symmetry.coordinates {
            Coordinates::Isotropic => 6,
            Coordinates::Transverse => 12,
        });
        let mut best = homogeneous;
        if count == 1 {
            return Ok((best, true));
        }
        let mut current = best.law.clone();
        let mut equilibria = best.equilibria.clone();
        let mut noise = best.scaled_rms().min(FIRST_NOISE * self.size);
        for round in 1..=self.options.rounds {
            if (self.cancelled)() {
                return Ok((best, false));
            }
            let met = strains_met(bench, &current, &equilibria);
            let placed = with_centres(&current, &met, count)?;
            if moved(&placed, &current) < SETTLED {
                return Ok((best, true));
            }
            let stage = format!("round {round}");
            let Some(found) =
                self.descend(bench, &placed, noise, ROUND_TOLERANCE, CentresMove::No, &stage)?
            else {
                return Ok((best, false));
            };
            noise = found.scaled_rms().min(noise);
            // Other centres were no better: more rounds would go round in circles.
            let is_no_news = round > 1 && found.scaled_rms() > ROUND_NEWS * best.scaled_rms();
            current = found.law.clone();
            equilibria.clone_from(&found.equilibria);
            if found.scaled_rms() < best.scaled_rms() {
                best = found;
            }
            if is_no_news {
                return Ok((best, true));
            }
        }
        Ok((best, false))
    }

    /// Lets the centres move with the moduli; what was found stays where that is no better.
    fn moved(&mut self, bench: &Bench, found: Descent) -> Result<Descent, ProbeError> {
        if !self.options.moves_centres || (self.cancelled)() || free_centres(&found.law).is_empty() {
            return Ok(found);
        }
        let noise = found.scaled_rms();
        let stage = "centres move";
        let better = self.descend(bench, &found.law, noise, MOVE_TOLERANCE, CentresMove::Yes, stage)?;
        let better = better.filter(|b| b.scaled_rms() < found.scaled_rms());
        Ok(better.unwrap_or(found))
    }

    /// Which of the presses tell their tangential forces; none if they are not asked for.
    fn told(&self, bench: &Bench) -> Vec<bool> {
        let told = |&k: &usize| self.options.tangential && tangential::is_told(&bench.presses[k]);
        self.which.iter().map(told).collect()
    }

    /// Estimates the forces under the probe and fits again, as long as the markers elsewhere are better for it.
    fn alternate(&mut self, bench: &mut Bench, found: Descent) -> Result<Descent, ProbeError> {
        let told = self.told(bench);
        let mut least = elsewhere(bench, &self.which, &found.equilibria);
        let mut best = found;
        for attempt in 1..=ALTERNATIONS {
            if (self.cancelled)() || !told.contains(&true) {
                break;
            }
            let forces = tangential::estimate(bench, &best.law, &self.which, &best.equilibria)?;
            let held = self.held(bench);
            for ((&k, forces), told) in self.which.iter().zip(forces).zip(&told) {
                if *told {
                    bench.presses[k].tangential = forces;
                }
            }
            let stage = format!("tangential forces, {attempt}");
            let noise = best.scaled_rms().min(FIRST_NOISE * self.size);
            let tolerance = ROUND_TOLERANCE;
            let better = self.descend(bench, &best.law, noise, tolerance, CentresMove::No, &stage)?;
            let after = better
                .as_ref()
                .map(|d| elsewhere(bench, &self.which, &d.equilibria));
            match (better, after) {
                (Some(better), Some(after)) if after < NEWS * least => (best, least) = (better, after),
                _ => {
                    self.put_back(bench, held);
                    break;
                }
            }
        }
        Ok(best)
    }

    /// The tangential forces as they are.
    fn held(&self, bench: &Bench) -> Vec<Vec<Vec3>> {
        let of = |&k: &usize| bench.presses[k].tangential.clone();
        self.which.iter().map(of).collect()
    }

    fn put_back(&self, bench: &mut Bench, forces: Vec<Vec<Vec3>>) {
        for (&k, forces) in self.which.iter().zip(forces) {
            bench.presses[k].tangential = forces;
        }
    }

    /// Keeps the tangential forces if the markers elsewhere are better for them than for none.
    fn tangential(&mut self, bench: &mut Bench, found: Descent) -> Result<(Descent, Tangential), ProbeError> {
        if !self.options.tangential {
            return Ok((found, Tangential::Off));
        }
        let told = self.told(bench);
        if !told.contains(&true) {
            return Ok((found, Tangential::Untold));
        }
        let found = self.alternate(bench, found)?;
        let held = self.held(bench);
        if held.iter().flatten().all(|t| *t == Vec3::zeros()) {
            return Ok((found, Tangential::Dropped));
        }
        let with = elsewhere(bench, &self.which, &found.equilibria);
        let none = held.iter().map(|t| vec![Vec3::zeros(); t.len()]).collect();
        self.put_back(bench, none);
        let stage = "without tangential forces";
        let noise = found.scaled_rms();
        let plain = self.descend(bench, &found.law, noise, ROUND_TOLERANCE, CentresMove::No, stage)?;
        let without = plain
            .as_ref()
            .map_or(f64::INFINITY, |p| elsewhere(bench, &self.which, &p.equilibria));
        if let Some(plain) = plain.filter(|_| with > NEWS * without) {
            return Ok((plain, Tangential::Dropped));
        }
        self.put_back(bench, held);
        let forces = self.which.iter().zip(&told).filter(|(_, told)| **told);
        let named = |(&k, _): (&usize, &bool)| {
            let press = &bench.presses[k];
            (press.name.clone(), press.tangential.clone())
        };
        let forces = forces.map(named).collect();
        let elsewhere = [without, with];
        Ok((found, Tangential::Used { forces, elsewhere }))
    }

    /// The last minimisation, to the end.
    fn last(&mut self, bench: &Bench, found: Descent) -> Result<Descent, ProbeError> {
        if (self.cancelled)() {
            return Ok(found);
        }
        let noise = found.scaled_rms();
        let last = self.descend(bench, &found.law, noise, LAST_TOLERANCE, CentresMove::No, "last")?;
        Ok(last
            .filter(|l| l.scaled_rms() <= found.scaled_rms() * 1.001)
            .unwrap_or(found))
    }

    fn outcome(
        self,
        bench: &Bench,
        found: Descent,
        homogeneous: Law,
        (starts, has_settled, tangential): (usize, bool, Tangential),
        began: Instant,
    ) -> Result<ProbeFit, ProbeError> {
        let coordinates = self.symmetry.coordinates;
        let last = Final {
            coordinates,
            theta: &found.theta,
            free: &found.free,
            residual: &found.outcome.residual,
            jacobian: &found.outcome.jacobian,
            data_rows: found.data_rows,
        };
        let mut spread = last.spread();
        let slope = coordinates.slope(&found.theta);
        let refits = match self.options.bootstrap {
            0 => None,
            count => last.refits(
                &spread::markers_of_rows(bench, &self.which),
                count,
                self.options.seed,
            ),
        };
        if let (Some(spread), Some(refits)) = (&mut spread, &refits) {
            spread.covariance = spread::bootstrap_covariance(&slope, refits);
            spread.basis = format!("bootstrap of {} (wild, by markers, linearised)", refits.len());
        }
        let refits = refits.as_ref().map(|r| (&slope, r.as_slice()));
        let mut curves = spread::curves(bench, &self.which, &found.law, &found.equilibria, refits)?;
        let others: Vec<usize> = (0..bench.presses.len())
            .filter(|&k| bench.presses[k].held_out)
            .collect();
        let held_out = if others.is_empty() {
            None
        } else {
            // Ctrl-C was for the fit; what it found is still to be compared.
            Some(match bench.equilibria(&found.law, &others, &|| false) {
                Ok(equilibria) => {
                    curves.extend(spread::curves(bench, &others, &found.law, &equilibria, refits)?);
                    Ok(errors(bench, &others, &equilibria))
                }
                Err(failure) => Err(failure),
            })
        };
        let met = strains_met(bench, &found.law, &found.equilibria);
        let strain = met
            .iter()
            .flat_map(|m| [m.strain[0], m.strain[1], m.strain[2]])
            .fold([0.0_f64; 2], |[l, h], e| [l.min(e), h.max(e)]);
        Ok(ProbeFit {
            law: rounded(&with_range(&found.law, &met)?)?,
            homogeneous,
            has_settled,
            stop: found.outcome.stop,
            starts,
            tangential,
            errors: errors(bench, &self.which, &found.equilibria),
            held_out,
            curves,
            spread,
            strain,
            readings: found.data_rows,
            rounds: self.rounds,
            seconds: began.elapsed().as_secs_f64(),
        })
    }
}

/// The outcome of the moduli alone: without the last `moved` parameters and the rows that tie them.
fn without_centres(outcome: least_squares::Outcome, moved: usize) -> least_squares::Outcome {
    let (rows, columns) = outcome.jacobian.shape();
    let mut residual = outcome.residual;
    residual.truncate(rows - moved);
    least_squares::Outcome {
        jacobian: outcome.jacobian.resize(rows - moved, columns - moved, 0.0),
        residual,
        ..outcome
    }
}

/// Six decimals: far below the fit's error, and a refit on another machine gives the same record.
fn rounded(law: &Law) -> Result<Law, LawError> {
    let values = law
        .parameters()
        .into_iter()
        .map(|p| (p.value * 1e6).round() / 1e6);
    law.with_parameters(&values.collect::<Vec<_>>())
}

/// Root mean square of the scaled residuals of the markers that are not under a probe; of all where there are no others.
fn elsewhere(bench: &Bench, which: &[usize], equilibria: &[Levels]) -> f64 {
    let residuals = super::problem::residuals(bench, which, equilibria);
    let mut under = Vec::new();
    for &k in which {
        let press = &bench.presses[k];
        let points = press.point_of_component();
        for readings in &press.readings {
            let seen = readings.iter().zip(&points).filter(|(r, _)| r.is_some());
            under.extend(seen.map(|(_, &p)| press.under_probe[p]));
        }
    }
    let others: Vec<f64> = residuals
        .iter()
        .zip(&under)
        .filter(|(_, u)| !**u)
        .map(|(r, _)| *r)
        .collect();
    if others.is_empty() {
        rms(&residuals)
    } else {
        rms(&others)
    }
}
