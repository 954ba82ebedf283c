//! The stages of a fit: minimisations, and what happens between them. [`super::fit`](mod@super::fit) puts them in order.

use super::centres::{moved, strains_met, with_centres};
use super::coordinates::Coordinates;
use super::fit::{ProbeError, ProbeOptions, Round, Step, Tangential};
use super::press::{Levels, PressedSpecimen};
use super::problem::{CentresMove, ProbeProblem, free_centres};
use super::start::{RATIOS, Symmetry, standing, young};
use super::tangential;
use crate::material::law::Law;
use crate::math::Vec3;
use crate::numerics::least_squares::{self, LeastSquaresError, News, Stop, minimise_problem};

/// A law and its equilibria.
type State = (Law, Vec<Levels>);

/// A law with its minimisation.
pub(super) struct Descent {
    pub law: Law,
    pub theta: Vec<f64>,
    pub equilibria: Vec<Levels>,
    pub outcome: least_squares::Outcome,
    pub data_rows: usize,
    pub free: Vec<bool>,
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

/// A fit under way.
pub(super) struct Fitter<'a> {
    pub symmetry: Symmetry,
    pub options: &'a ProbeOptions,
    pub which: Vec<usize>,
    /// Root mean square of x̄/σ.
    pub size: f64,
    pub cancelled: &'a (dyn Fn() -> bool + Sync),
    pub news: &'a mut dyn FnMut(&Step),
    pub rounds: Vec<Round>,
}

/// Root mean square of √w x̄/σ.
pub(super) fn size(pressed: &PressedSpecimen, which: &[usize]) -> f64 {
    let mut scaled = Vec::new();
    for &k in which {
        let press = &pressed.presses[k];
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
        pressed: &PressedSpecimen,
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
        let tie = (noise.max(least), centres);
        let Some((outcome, best)) = self.minimised(pressed, law, (&start, &bounds), &options, tie, stage)?
        else {
            return Ok(None);
        };
        let (law, equilibria) = best;
        let theta = outcome.parameters[..values].to_vec();
        let outcome = without_centres(outcome, start.len() - values);
        let inside = |(t, (low, high)): (&f64, &(f64, f64))| *t > *low && *t < *high;
        let descent = Descent {
            free: theta.iter().zip(&bounds).map(inside).collect(),
            data_rows: super::problem::count(pressed, &self.which),
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

    /// Runs the minimiser; what it found, with the law and the equilibria there.
    fn minimised(
        &mut self,
        pressed: &PressedSpecimen,
        law: &Law,
        (start, bounds): (&[f64], &[(f64, f64)]),
        options: &least_squares::Options,
        tie: (f64, CentresMove),
        stage: &str,
    ) -> Result<Option<(least_squares::Outcome, State)>, ProbeError> {
        let rows = super::problem::count(pressed, &self.which) as f64;
        let news = &mut *self.news;
        let mut tell = |n: &News| {
            news(&Step {
                stage: stage.to_string(),
                iterations: n.iterations,
                scaled_rms: (2.0 * n.cost / f64::max(rows, 1.0)).sqrt(),
            });
        };
        let coordinates = self.symmetry.coordinates;
        let mut problem = ProbeProblem::new(
            pressed,
            &self.which,
            law,
            coordinates,
            tie,
            self.cancelled,
            &mut tell,
        );
        let outcome = match minimise_problem(&mut problem, start, bounds, options) {
            // Refused steps are what a fit that was asked to stop is left with.
            Ok(outcome) if (self.cancelled)() => least_squares::Outcome {
                stop: Stop::Cancelled,
                ..outcome
            },
            Ok(outcome) => outcome,
            Err(LeastSquaresError::NoStart) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        Ok(problem.best.take().map(|best| (outcome, best)))
    }

    /// The homogeneous law, from several starts where the first ends badly; how many.
    pub fn homogeneous(&mut self, pressed: &PressedSpecimen) -> Result<(Descent, usize), ProbeError> {
        let mut best: Option<Descent> = None;
        let mut starts = 0;
        let mut failed = None;
        for ratio in RATIOS {
            starts += 1;
            let Some(modulus) = young(pressed, &self.which, &self.symmetry, ratio, self.cancelled)? else {
                return Err(ProbeError::Backwards);
            };
            let start = [modulus, ratio];
            let law = match standing(pressed, &self.which, &self.symmetry, start, self.cancelled) {
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
            let found = self.descend(pressed, &law, noise, ROUND_TOLERANCE, CentresMove::No, &stage)?;
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
    pub fn rounds(
        &mut self,
        pressed: &PressedSpecimen,
        homogeneous: Descent,
    ) -> Result<(Descent, bool), ProbeError> {
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
            let met = strains_met(pressed, &current, &equilibria);
            let placed = with_centres(&current, &met, count)?;
            if moved(&placed, &current) < SETTLED {
                return Ok((best, true));
            }
            let stage = format!("round {round}");
            let Some(found) =
                self.descend(pressed, &placed, noise, ROUND_TOLERANCE, CentresMove::No, &stage)?
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
    pub fn moved(&mut self, pressed: &PressedSpecimen, found: Descent) -> Result<Descent, ProbeError> {
        if !self.options.moves_centres || (self.cancelled)() || free_centres(&found.law).is_empty() {
            return Ok(found);
        }
        let noise = found.scaled_rms();
        let stage = "centres move";
        let tolerance = self.options.move_tolerance;
        let better = self.descend(pressed, &found.law, noise, tolerance, CentresMove::Yes, stage)?;
        let better = better.filter(|b| b.scaled_rms() < found.scaled_rms());
        Ok(better.unwrap_or(found))
    }

    /// Which of the presses tell their tangential forces; none if they are not asked for.
    fn told(&self, pressed: &PressedSpecimen) -> Vec<bool> {
        let told = |&k: &usize| self.options.tangential && tangential::is_told(&pressed.presses[k]);
        self.which.iter().map(told).collect()
    }

    /// Estimates the forces under the probe and fits again, as long as the markers elsewhere are better for it.
    pub fn alternate(
        &mut self,
        pressed: &mut PressedSpecimen,
        found: Descent,
    ) -> Result<Descent, ProbeError> {
        let told = self.told(pressed);
        let mut least = elsewhere(pressed, &self.which, &found.equilibria);
        let mut best = found;
        for attempt in 1..=ALTERNATIONS {
            if (self.cancelled)() || !told.contains(&true) {
                break;
            }
            let forces = tangential::estimate(pressed, &best.law, &self.which, &best.equilibria)?;
            let held = self.held(pressed);
            for ((&k, forces), told) in self.which.iter().zip(forces).zip(&told) {
                if *told {
                    pressed.presses[k].tangential = forces;
                }
            }
            let stage = format!("tangential forces, {attempt}");
            let noise = best.scaled_rms().min(FIRST_NOISE * self.size);
            let tolerance = ROUND_TOLERANCE;
            let better = self.descend(pressed, &best.law, noise, tolerance, CentresMove::No, &stage)?;
            let after = better
                .as_ref()
                .map(|d| elsewhere(pressed, &self.which, &d.equilibria));
            match (better, after) {
                (Some(better), Some(after)) if after < NEWS * least => (best, least) = (better, after),
                _ => {
                    self.put_back(pressed, held);
                    break;
                }
            }
        }
        Ok(best)
    }

    /// The tangential forces as they are.
    fn held(&self, pressed: &PressedSpecimen) -> Vec<Vec<Vec3>> {
        let of = |&k: &usize| pressed.presses[k].tangential.clone();
        self.which.iter().map(of).collect()
    }

    fn put_back(&self, pressed: &mut PressedSpecimen, forces: Vec<Vec<Vec3>>) {
        for (&k, forces) in self.which.iter().zip(forces) {
            pressed.presses[k].tangential = forces;
        }
    }

    /// Keeps the tangential forces if the markers elsewhere are better for them than for none.
    pub fn tangential(
        &mut self,
        pressed: &mut PressedSpecimen,
        found: Descent,
    ) -> Result<(Descent, Tangential), ProbeError> {
        if !self.options.tangential {
            return Ok((found, Tangential::Off));
        }
        let told = self.told(pressed);
        if !told.contains(&true) {
            return Ok((found, Tangential::Untold));
        }
        let found = self.alternate(pressed, found)?;
        let held = self.held(pressed);
        if held.iter().flatten().all(|t| *t == Vec3::zeros()) {
            return Ok((found, Tangential::Dropped));
        }
        let with = elsewhere(pressed, &self.which, &found.equilibria);
        let none = held.iter().map(|t| vec![Vec3::zeros(); t.len()]).collect();
        self.put_back(pressed, none);
        let stage = "without tangential forces";
        let noise = found.scaled_rms();
        let plain = self.descend(
            pressed,
            &found.law,
            noise,
            ROUND_TOLERANCE,
            CentresMove::No,
            stage,
        )?;
        let without = plain
            .as_ref()
            .map_or(f64::INFINITY, |p| elsewhere(pressed, &self.which, &p.equilibria));
        if let Some(plain) = plain.filter(|_| with > NEWS * without) {
            return Ok((plain, Tangential::Dropped));
        }
        self.put_back(pressed, held);
        let forces = self.which.iter().zip(&told).filter(|(_, told)| **told);
        let named = |(&k, _): (&usize, &bool)| {
            let press = &pressed.presses[k];
            (press.name.clone(), press.tangential.clone())
        };
        let forces = forces.map(named).collect();
        let elsewhere = [without, with];
        Ok((found, Tangential::Used { forces, elsewhere }))
    }

    /// The last minimisation, to the end.
    pub fn last(&mut self, pressed: &PressedSpecimen, found: Descent) -> Result<Descent, ProbeError> {
        if (self.cancelled)() {
            return Ok(found);
        }
        let noise = found.scaled_rms();
        let last = self.descend(
            pressed,
            &found.law,
            noise,
            LAST_TOLERANCE,
            CentresMove::No,
            "last",
        )?;
        Ok(last
            .filter(|l| l.scaled_rms() <= found.scaled_rms() * 1.001)
            .unwrap_or(found))
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

/// Root mean square of the scaled residuals of the markers that are not under a probe; of all where there are no others.
fn elsewhere(pressed: &PressedSpecimen, which: &[usize], equilibria: &[Levels]) -> f64 {
    let residuals = super::problem::residuals(pressed, which, equilibria);
    let mut under = Vec::new();
    for &k in which {
        let press = &pressed.presses[k];
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
