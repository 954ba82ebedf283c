//! The search for a layout of voxels: relaxing, rounding, exchanging.
//!
//! 1. *Relaxing* starts from the best of all uniform layouts and the even mixture, and takes Levenberg steps
//!    ([`Linear::step`]) as long as they help.
//! 2. *Rounding* goes to a layout in a few steps. Each linearises anew, picks the layout whose linearised readings are
//!    near the targets ([`Linear::rounded`]), and goes a share of the way there, along which the step keeps the readings.
//! 3. *Exchanging* ([`exchange`]) changes a handful of variables at a time, fewer where that did not help, until not even
//!    one of the best single exchanges does.
//!
//! Two further cycles start from mixtures around the best layout.
//!
//! An answer is a layout that was simulated whole. Where the readings are very many, each level of a press is told by as
//! many random combinations of them as fit, the first of which is its residual: the gradient stays exact.
//!
//! The answer depends on the seed and not on the number of threads.

use super::connected::Parts;
use super::exchange;
use super::linear::{Linear, Shares, shares_of};
use super::rules::VoxelRules;
use crate::design::misfit::{Misfit, Target};
use crate::design::search::{Basis, Bound, Outcome, Progress, Ranked, Stop};
use crate::design::space::Space;
use crate::fem::equilibrium;
use crate::fem::mixture::{MixtureError, Mixtures, Pressed, Reading};
use crate::fem::rig::{Layout, Rig};
use crate::math::mandel::Mandel;
use nalgebra::{DMatrix, DVector};
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256Plus;

/// Ways from mixtures to the layout that is rounded to, one a step of the rounding.
const WAYS: [f64; 4] = [0.3, 0.5, 0.7, 1.0];
/// Steps without a tenth less error after which relaxing ends.
const STALLS: usize = 2;
/// Share of the best layout in the mixtures that a further cycle starts from; the rest is even.
const KEPT: f64 = 0.7;
/// Single exchanges that are tried before exchanging ends.
const SINGLES: usize = 6;
/// How much more exact the layouts are simulated than the mixtures: exchanges change little.
const EXACTER: f64 = 0.01;
/// Residual of the adjoint solves: derivatives need not be more exact than a linearisation is.
const ADJOINT_TOLERANCE: f64 = 1e-3;
/// Most numbers in the derivatives.
const MOST_NUMBERS: usize = 20_000_000;

/// How to search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Seed of the orders in which variables are rounded, and of combinations of readings. Default 1.
    pub seed: u64,
    /// Most simulations. Default 120.
    pub most_simulations: usize,
    /// Most steps of relaxing. Default 10.
    pub relaxing: usize,
    /// Most further cycles of the three phases, each from a mixture around the best layout. Default 2.
    pub cycles: usize,
    /// Most readings in one linearisation. Default 600.
    pub readings: usize,
    /// RMS error at which the search ends \[mm\]. Default 0.
    pub enough_mm: f64,
    /// Tolerance of a simulation of mixtures. Default 1e-3.
    pub tolerance: f64,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            seed: 1,
            most_simulations: 120,
            relaxing: 10,
            cycles: 2,
            readings: 600,
            enough_mm: 0.0,
            tolerance: 1e-3,
        }
    }
}

/// Why there is no search.
#[derive(Debug, thiserror::Error)]
pub enum BadVoxels {
    /// A rule that this search does not know.
    #[error("{0} is not known to the search for layouts of voxels: leave it out, or use layers")]
    Rule(&'static str),
    /// Options that cannot be.
    #[error("voxel search option {field} is 0: it must be at least 1")]
    Zero {
        /// Which one.
        field: &'static str,
    },
    /// The simulation.
    #[error(transparent)]
    Mixture(#[from] MixtureError),
}

/// What a search found, and what it took.
#[derive(Clone, Debug)]
pub struct Found {
    /// The best layout, if any, as other searches answer it.
    pub outcome: Outcome,
    /// Linearisations: each costs an adjoint solve a reading.
    pub linearisations: usize,
    /// RMS error of the relaxed mixtures \[mm\].
    pub relaxed_rms_mm: f64,
    /// Each time that a layout was better than all before.
    pub history: Vec<Milestone>,
}

/// A layout better than all before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Milestone {
    /// Simulations until then, its own among them.
    pub simulations: usize,
    /// Linearisations until then.
    pub linearisations: usize,
    /// Its RMS error \[mm\].
    pub rms_mm: f64,
}

/// Searches the layouts of a rig for one that behaves like the target.
///
/// # Errors
/// [`BadVoxels`]: options or rules that cannot be, memory.
pub fn search(
    rig: &Rig,
    target: &Target,
    space: &Space,
    rules: &VoxelRules,
    options: &Options,
    watch: &dyn Fn(&Progress, usize),
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Result<Found, BadVoxels> {
    for (field, value) in [
        ("most_simulations", options.most_simulations),
        ("readings", options.readings),
    ] {
        if value == 0 {
            return Err(BadVoxels::Zero { field });
        }
    }
    let bounded = space.most_mass_g.is_finite() || space.most_cost.is_finite();
    if bounded || !space.apart.is_empty() {
        return Err(BadVoxels::Rule(if bounded {
            "a limit on mass or cost"
        } else {
            "materials that must not touch"
        }));
    }
    let mixtures = Mixtures::new(rig, space.cells);
    let touching = mixtures.touching();
    let filled: Vec<bool> = mixtures.volumes_mm3().iter().map(|&v| v > 0.0).collect();
    let mut free = vec![true; rules.variables * space.materials];
    for (allowed, &v) in space.allowed.iter().zip(&rules.variable_of_cell) {
        for m in (0..space.materials).filter(|&m| !allowed.contains(&(m as u8))) {
            free[v as usize * space.materials + m] = false;
        }
    }
    let moduli = rig.laws.iter().map(|law| law.young_modulus(&Mandel::zeros()));
    let mut walk = Walk {
        mixtures,
        target,
        space,
        parts: Parts {
            touching: &touching,
            filled: &filled,
            variable_of_cell: &rules.variable_of_cell,
            connected: &rules.connected,
        },
        variables: rules.variables,
        options,
        watch,
        cancelled,
        free,
        moduli: moduli.collect(),
        random: Xoshiro256Plus::seed_from_u64(options.seed),
        simulations: 0,
        failed: 0,
        linearisations: 0,
        best: None,
        best_uniform: None,
        relaxed_rms_mm: f64::NAN,
        history: Vec::new(),
        place: ("starting", [1, 1]),
    };
    let stop = match walk.run() {
        Ok(()) if walk.best_rms_mm() <= options.enough_mm => Stop::GoodEnough,
        Ok(()) if walk.simulations >= options.most_simulations => Stop::Exhausted,
        Ok(()) => Stop::Searched,
        Err(End::Interrupted) => Stop::Interrupted,
        Err(End::Mixture(error)) => return Err(error.into()),
    };
    Ok(walk.found(stop))
}

/// Why a walk ends before its end.
enum End {
    Interrupted,
    Mixture(MixtureError),
}

impl From<MixtureError> for End {
    fn from(error: MixtureError) -> End {
        End::Mixture(error)
    }
}

struct Walk<'a> {
    mixtures: Mixtures<'a>,
    target: &'a Target,
    space: &'a Space,
    parts: Parts<'a>,
    variables: usize,
    options: &'a Options,
    watch: &'a dyn Fn(&Progress, usize),
    cancelled: &'a (dyn Fn() -> bool + Sync),
    /// Which shares may be above zero, `(variables × materials)`.
    free: Vec<bool>,
    moduli: Vec<f64>,
    random: Xoshiro256Plus,
    simulations: usize,
    failed: usize,
    linearisations: usize,
    best: Option<(Vec<u8>, Misfit)>,
    best_uniform: Option<(u8, Misfit)>,
    relaxed_rms_mm: f64,
    history: Vec<Milestone>,
    place: (&'static str, [usize; 2]),
}

/// Shares with what they answered.
struct State {
    shares: Shares,
    pressed: Pressed,
    rms_mm: f64,
}

impl Walk<'_> {
    fn run(&mut self) -> Result<(), End> {
        let Some(start) = self.start()? else {
            return Ok(());
        };
        let mut state = self.relax(start, self.options.relaxing)?;
        if self.space.most_materials < self.space.materials {
            self.keep_most_used(&state.shares);
            let shares = self.evened(&state.shares);
            state = self.mixed(shares)?;
            state = self.relax(state, self.options.relaxing)?;
        }
        self.relaxed_rms_mm = state.rms_mm;
        self.round(state)?;
        self.exchange()?;
        for _ in 0..self.options.cycles {
            let Some((choice, _)) = self.best.clone().filter(|_| !self.is_done()) else {
                break;
            };
            let layout = shares_of(&choice, self.space.materials);
            let even = self.evened(&vec![0.0; layout.len()]);
            let blend = layout.iter().zip(&even).map(|(l, e)| KEPT * l + (1.0 - KEPT) * e);
            let shares: Shares = blend.collect();
            self.place = ("relaxing", [0, self.options.relaxing]);
            let state = self.mixed(shares)?;
            let state = self.relax(state, self.options.relaxing)?;
            self.relaxed_rms_mm = self.relaxed_rms_mm.min(state.rms_mm);
            self.round(state)?;
            self.exchange()?;
        }
        Ok(())
    }

    fn best_rms_mm(&self) -> f64 {
        self.best.as_ref().map_or(f64::INFINITY, |b| b.1.rms_mm)
    }

    fn is_done(&self) -> bool {
        self.simulations >= self.options.most_simulations || self.best_rms_mm() <= self.options.enough_mm
    }

    /// Simulates shares of variables.
    fn press(&mut self, shares: &[f64], tolerance: f64) -> Result<Pressed, End> {
        let (phase, level) = self.place;
        let progress = Progress {
            phase,
            level,
            batch: 1,
            best_mm: self.best_rms_mm(),
            bound_mm: 0.0,
        };
        (self.watch)(&progress, 0);
        let m = self.space.materials;
        let by_cell: Vec<f64> = self
            .parts
            .variable_of_cell
            .iter()
            .flat_map(|&v| &shares[v as usize * m..(v as usize + 1) * m])
            .copied()
            .collect();
        let solver = equilibrium::Options::for_search(tolerance);
        let pressed = self.mixtures.press(&by_cell, &solver, self.cancelled)?;
        if (self.cancelled)() {
            return Err(End::Interrupted);
        }
        self.simulations += 1;
        self.failed += usize::from(!pressed.response.complete);
        (self.watch)(&progress, 1);
        Ok(pressed)
    }

    fn mixed(&mut self, shares: Shares) -> Result<State, End> {
        let pressed = self.press(&shares, self.options.tolerance)?;
        let rms_mm = self.target.misfit(&pressed.response.displacements).rms_mm;
        Ok(State {
            shares,
            pressed,
            rms_mm,
        })
    }

    /// Simulates a layout, and keeps it if it is the best.
    fn layout(&mut self, choice: &[u8]) -> Result<State, End> {
        let shares = shares_of(choice, self.space.materials);
        let pressed = self.press(&shares, EXACTER * self.options.tolerance)?;
        let misfit = self.target.misfit(&pressed.response.displacements);
        if pressed.response.complete && misfit.rms_mm < self.best_rms_mm() && self.may_be(choice) {
            self.best = Some((choice.to_vec(), misfit));
            self.history.push(Milestone {
                simulations: self.simulations,
                linearisations: self.linearisations,
                rms_mm: misfit.rms_mm,
            });
        }
        Ok(State {
            shares,
            rms_mm: misfit.rms_mm,
            pressed,
        })
    }

    fn may_be(&self, choice: &[u8]) -> bool {
        self.space.allows(&self.by_cell(choice)) && self.parts.hold(choice)
    }

    fn by_cell(&self, choice: &[u8]) -> Layout {
        let of = |&v: &u32| choice[v as usize];
        self.parts.variable_of_cell.iter().map(of).collect()
    }

    /// The best of the uniform layouts and the even mixture; `None` where none answers at all.
    fn start(&mut self) -> Result<Option<State>, End> {
        let m = self.space.materials;
        self.place = ("uniform layouts", [1, m + 1]);
        let mut best: Option<State> = None;
        let better = |state: State, best: Option<State>| match best {
            Some(best) if best.rms_mm <= state.rms_mm => Some(best),
            _ if state.rms_mm.is_finite() => Some(state),
            best => best,
        };
        for k in 0..m {
            self.place.1[0] = k + 1;
            if (0..self.variables).any(|v| !self.free[v * m + k]) {
                continue;
            }
            let choice = vec![k as u8; self.variables];
            let state = self.layout(&choice)?;
            let misfit = self.target.misfit(&state.pressed.response.displacements);
            let known = self.best_uniform.map_or(f64::INFINITY, |b| b.1.rms_mm);
            if state.pressed.response.complete && misfit.rms_mm < known {
                self.best_uniform = Some((k as u8, misfit));
            }
            best = better(state, best);
        }
        self.place.1[0] = m + 1;
        let shares = self.evened(&vec![0.0; self.variables * m]);
        let even = self.mixed(shares)?;
        Ok(better(even, best))
    }

    /// The nearest shares that are allowed.
    fn evened(&self, shares: &[f64]) -> Shares {
        let m = self.space.materials;
        let mut result = shares.to_vec();
        for (own, free) in result.chunks_mut(m).zip(self.free.chunks(m)) {
            super::linear::project(own, free);
        }
        result
    }

    /// Frees none but the materials that are used most, as many as a layout may mix.
    fn keep_most_used(&mut self, shares: &[f64]) {
        let m = self.space.materials;
        let volumes = self.mixtures.volumes_mm3();
        let mut used = vec![0.0; m];
        for (&v, volume) in self.parts.variable_of_cell.iter().zip(&volumes) {
            for (k, used) in used.iter_mut().enumerate() {
                *used += volume * shares[v as usize * m + k];
            }
        }
        let mut order: Vec<usize> = (0..m).collect();
        order.sort_by(|&a, &b| used[b].total_cmp(&used[a]).then(a.cmp(&b)));
        for &k in &order[self.space.most_materials.max(1)..] {
            for v in 0..self.variables {
                // A variable that may take nothing else keeps what it may take.
                let others = (0..m).any(|o| o != k && self.free[v * m + o]);
                self.free[v * m + k] &= !others;
            }
        }
    }

    /// Levenberg steps until they no longer help.
    fn relax(&mut self, mut state: State, most: usize) -> Result<State, End> {
        let (mut damping, mut stalls, mut linear) = (1e-3, 0, None);
        for step in 0..most {
            if stalls >= STALLS || self.is_done() || state.rms_mm <= 0.1 * self.options.enough_mm {
                break;
            }
            self.place = ("relaxing", [step + 1, most]);
            if linear.is_none() {
                linear = Some(self.linear(&state)?);
            }
            let Some(known) = &linear else { break };
            let shares = known.step(&state.shares, &state.shares, damping, &self.free);
            if step == 0 {
                // So that there is a layout to answer with, whenever a user stops.
                let choice = self.rounded(known, &shares, 1.0);
                self.layout(&choice)?;
            }
            let next = self.mixed(shares)?;
            stalls += usize::from(next.rms_mm.is_nan() || next.rms_mm > 0.9 * state.rms_mm);
            if next.rms_mm < state.rms_mm {
                (state, linear) = (next, None);
                damping *= 0.1;
            } else {
                damping *= 10.0;
            }
        }
        Ok(state)
    }

    /// A layout near `shares` in linearised readings, its parts connected where they must be and can.
    fn rounded(&mut self, linear: &Linear, shares: &[f64], firmness: f64) -> Vec<u8> {
        let mut order: Vec<u32> = (0..self.variables as u32).collect();
        order.shuffle(&mut self.random);
        let choice = linear.rounded(shares, &self.free, &order, firmness);
        let m = self.space.materials;
        let price = |variables: &[u32], to: u8| {
            let mut rest = linear.residual.clone();
            for &v in variables {
                let from = v as usize * m;
                if !self.free[from + to as usize] {
                    return f64::INFINITY;
                }
                let old = choice[v as usize] as usize;
                rest += linear.derivatives.column(from + to as usize) - linear.derivatives.column(from + old);
            }
            rest.norm()
        };
        let mended = self.parts.mended(&choice, price);
        mended.unwrap_or(choice)
    }

    /// Goes from mixtures to a layout.
    fn round(&mut self, mut state: State) -> Result<(), End> {
        for (step, way) in WAYS.into_iter().enumerate() {
            if self.is_done() {
                break;
            }
            self.place = ("rounding", [step + 1, WAYS.len()]);
            let linear = self.linear(&state)?;
            let choice = self.rounded(&linear, &state.shares, 1.0);
            if way >= 1.0 {
                self.layout(&choice)?;
                break;
            }
            let layout = shares_of(&choice, self.space.materials);
            let towards = state.shares.iter().zip(&layout).map(|(s, l)| s + way * (l - s));
            let goal: Shares = towards.collect();
            let shares = linear.step(&state.shares, &goal, 1e-3, &self.free);
            state = self.mixed(shares)?;
        }
        Ok(())
    }

    /// Changes the best layout a few materials at a time as long as it gets better.
    fn exchange(&mut self) -> Result<(), End> {
        let Some((mut choice, _)) = self.best.clone() else {
            return Ok(());
        };
        let mut most = (self.variables / 16).max(4);
        let mut round = 1;
        self.place = ("exchanging", [round, round]);
        let mut state = self.layout(&choice)?;
        while !self.is_done() {
            let linear = self.linear(&state)?;
            let allowed = |now: &[u8]| self.may_be(now);
            let moves = exchange::choose(&linear, &choice, &self.free, &self.moduli, most, &allowed);
            let Some((next, better)) = self.first_better(&choice, &moves)? else {
                return Ok(());
            };
            let changed = next.iter().zip(&choice).filter(|(a, b)| a != b).count();
            most = (changed + changed / 2 + 1).min(self.variables);
            (choice, state) = (next, better);
            round += 1;
            self.place = ("exchanging", [round, round]);
        }
        Ok(())
    }

    /// The first layout that is better than the best: all moves at once, a third of them, and so on down to one; then the
    /// first few one by one.
    fn first_better(&mut self, choice: &[u8], moves: &[(u32, u8)]) -> Result<Option<(Vec<u8>, State)>, End> {
        let mut trials: Vec<&[(u32, u8)]> = Vec::new();
        let mut count = moves.len();
        while count > 0 {
            trials.push(&moves[..count]);
            count /= 3;
        }
        trials.extend(moves.chunks(1).skip(1).take(SINGLES));
        for trial in trials {
            if self.is_done() {
                break;
            }
            let mut next = choice.to_vec();
            trial.iter().for_each(|&(v, m)| next[v as usize] = m);
            let before = self.best_rms_mm();
            let state = self.layout(&next)?;
            if self.best_rms_mm() < before {
                return Ok(Some((next, state)));
            }
        }
        Ok(None)
    }

    /// Residuals of the readings and their derivatives.
    fn linear(&mut self, state: &State) -> Result<Linear, End> {
        self.linearisations += 1;
        let (readings, residual) = self.readings(&state.pressed.response.displacements);
        let derivatives = self.mixtures.derivatives(
            &state.pressed,
            &readings,
            self.parts.variable_of_cell,
            ADJOINT_TOLERANCE,
        )?;
        if (self.cancelled)() {
            return Err(End::Interrupted);
        }
        let usable = derivatives.iter().all(|x| x.is_finite()) && residual.iter().all(|x| x.is_finite());
        Ok(Linear {
            derivatives: if usable {
                derivatives
            } else {
                DMatrix::zeros(readings.len(), self.free.len())
            },
            residual: if usable {
                DVector::from_vec(residual)
            } else {
                DVector::zeros(readings.len())
            },
            materials: self.space.materials,
        })
    }

    /// The readings of all presses and levels, by press, with their residuals \[mm\].
    fn readings(&mut self, displacements: &[f64]) -> (Vec<Reading>, Vec<f64>) {
        let presses = &self.mixtures.rig().presses;
        let levels: usize = presses.iter().map(|p| p.factors.len()).sum();
        let most = self.options.readings.min(MOST_NUMBERS / self.free.len().max(1));
        let most = (most / levels.max(1)).max(1);
        let excess = self.target.excess(displacements);
        let (mut readings, mut residuals) = (Vec::new(), Vec::new());
        let mut start = 0;
        for (k, press) in presses.iter().enumerate() {
            let count = press.components();
            for level in 0..press.factors.len() {
                let own: Vec<Option<f64>> = (start..start + count)
                    .map(|i| self.target.components[i].map(|_| excess[i]))
                    .collect();
                start += count;
                for weights in combinations(&own, most, &mut self.random) {
                    let all = weights.iter().zip(&own);
                    residuals.push(all.map(|(w, r)| w * r.unwrap_or(0.0)).sum());
                    readings.push(Reading {
                        press: k,
                        level,
                        weights,
                    });
                }
            }
        }
        (readings, residuals)
    }

    fn found(self, stop: Stop) -> Found {
        let ranked = |layout: Layout, misfit: Misfit| Ranked {
            layout,
            misfit,
            score_mm: misfit.rms_mm,
        };
        let best = self.best.as_ref();
        let best: Vec<Ranked> = best
            .map(|(choice, misfit)| ranked(self.by_cell(choice), *misfit))
            .into_iter()
            .collect();
        let uniform = self.best_uniform;
        let best_uniform = uniform.map(|(m, misfit)| ranked(vec![m; self.space.cells], misfit));
        Found {
            outcome: Outcome {
                simulated: best.clone(),
                best,
                best_uniform,
                bound: Bound {
                    score_mm: 0.0,
                    basis: Basis::Nothing,
                },
                stop,
                simulations: self.simulations,
                failed: self.failed,
                culled: 0,
                merged: 0,
            },
            linearisations: self.linearisations,
            relaxed_rms_mm: self.relaxed_rms_mm,
            history: self.history,
        }
    }
}

/// Up to `most` orthonormal combinations of the measured ones among `residuals`: each alone if they are so few, else the
/// residual itself and random ones.
fn combinations(residuals: &[Option<f64>], most: usize, random: &mut Xoshiro256Plus) -> Vec<Vec<f64>> {
    let measured: Vec<usize> = (0..residuals.len()).filter(|&i| residuals[i].is_some()).collect();
    let unit = |i: usize| {
        (0..residuals.len())
            .map(|j| f64::from(u8::from(i == j)))
            .collect()
    };
    if measured.len() <= most {
        return measured.into_iter().map(unit).collect();
    }
    let mut all: Vec<Vec<f64>> = Vec::new();
    for k in 0..most {
        let mut own = vec![0.0; residuals.len()];
        for &i in &measured {
            own[i] = if k == 0 {
                residuals[i].unwrap_or(0.0)
            } else {
                random.gen_range(-1.0..1.0)
            };
        }
        // Twice is enough for Gram and Schmidt.
        for _ in 0..2 {
            for other in &all {
                let along: f64 = own.iter().zip(other).map(|(a, b)| a * b).sum();
                own.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
            }
        }
        let norm = own.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm > 1e-9 && norm.is_finite() {
            all.push(own.into_iter().map(|x| x / norm).collect());
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn combinations_hold_the_residual_and_are_orthonormal() {
        let residuals: Vec<Option<f64>> = (0..20)
            .map(|i| (i != 7).then(|| (i * 13 % 11) as f64 - 4.0))
            .collect();
        let mut random = Xoshiro256Plus::seed_from_u64(3);
        let few = combinations(&residuals, 5, &mut random);
        assert_eq!(few.len(), 5);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (i, a) in few.iter().enumerate() {
            assert_eq!(a[7], 0.0);
            for (j, b) in few.iter().enumerate() {
                assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
        let own: Vec<f64> = residuals.iter().map(|r| r.unwrap_or(0.0)).collect();
        assert!((dot(&own, &few[0]).abs() - dot(&own, &own).sqrt()).abs() < 1e-12);
        assert_eq!(combinations(&residuals, 19, &mut random).len(), 19);
    }
}
