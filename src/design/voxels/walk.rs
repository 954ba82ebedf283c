//! The search for a layout of voxels: relaxing, rounding, exchanging.
//!
//! 1. *Relaxing* starts from the best of all uniform layouts and the even mixture, and takes Levenberg steps
//!    ([`Linear::step`]) as long as they help.
//! 2. *Rounding* goes to a layout in a few steps. Each linearises anew, picks the layout whose linearised readings are
//!    near the targets ([`Linear::rounded`]), and goes a share of the way there, along which the step keeps the readings.
//! 3. *Exchanging* ([`exchange`]) changes a handful of variables at a time, fewer where that did not help, until not even
//!    one of the best single exchanges does.
//!
//! A further cycle starts from a mixture around the best layout.
//!
//! An answer is a layout that was simulated whole. Where the readings are very many, each level of a press is told by as
//! many random combinations of them as fit, the first of which is its residual: the gradient stays exact.
//!
//! The answer depends on the seed and not on the number of threads.

use super::bench::MixtureBench;
use super::connected::Parts;
use super::exchange;
use super::kept::key;
use super::limits::Limits;
use super::linear::{Linear, Shares, shares_of};
use super::linearise::{Linearised, State};
use super::rules::VoxelRules;
use super::{BadVoxels, Found, Milestone, Options};
use crate::design::journal::Key;
use crate::design::search::{Aim, Basis, Bound, Outcome, Progress, Ranked, Stop};
use crate::fem::mixture::{MixtureError, Mixtures};
use crate::fem::rig::{Layout, Rig};
use crate::math::mandel::Mandel;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256Plus;

/// Ways from mixtures to the layout that is rounded to, one a step of the rounding.
const WAYS: [f64; 4] = [0.3, 0.5, 0.7, 1.0];
/// Steps without a tenth less error after which relaxing ends.
const STALLS: usize = 2;
/// Share of the best layout in the mixtures that a further cycle starts from; the rest is even.
const KEPT: f64 = 0.7;
/// How much a layout is held to the mixtures that it is rounded from ([`Linear::rounded`]).
const FIRMNESS: f64 = 1.0;
/// Single exchanges that are tried before exchanging ends.
const SINGLES: usize = 6;
/// How much more exact the layouts are simulated than the mixtures: exchanges change little.
const EXACTER: f64 = 0.01;
/// What a share above a limit is worth, in largest target displacements: more than any error.
const BROKEN: f64 = 10.0;
/// Mixtures this far above a limit, as a share of it, still count for the bound.
const BARELY: f64 = 1e-2;

/// Searches the layouts of `rig` for one that behaves like the target. `bench` simulates: its shares are those of the variables
/// of `rules`.
///
/// # Errors
/// [`BadVoxels`]: options that cannot be, memory.
pub fn search(
    rig: &Rig,
    aim: &Aim,
    rules: &VoxelRules,
    options: &Options,
    bench: &mut dyn MixtureBench,
    watch: &dyn Fn(&Progress, usize),
) -> Result<Found, BadVoxels> {
    for (field, value) in [
        ("most_simulations", options.most_simulations),
        ("readings", options.readings),
    ] {
        if value == 0 {
            return Err(BadVoxels::Zero { field });
        }
    }
    let space = aim.space;
    let mixtures = Mixtures::new(rig, space.cells);
    let (touching, volumes_mm3) = (mixtures.touching(), mixtures.volumes_mm3());
    let filled: Vec<bool> = volumes_mm3.iter().map(|&v| v > 0.0).collect();
    let mut free = vec![true; rules.variables * space.materials];
    for (allowed, &v) in space.allowed.iter().zip(&rules.variable_of_cell) {
        for m in (0..space.materials).filter(|&m| !allowed.contains(&(m as u8))) {
            free[v as usize * space.materials + m] = false;
        }
    }
    let moduli = rig.laws.iter().map(|law| law.young_modulus(&Mandel::zeros()));
    let mut walk = Walk {
        rig,
        aim,
        bench,
        parts: Parts {
            touching: &touching,
            filled: &filled,
            variable_of_cell: &rules.variable_of_cell,
            connected: &rules.connected,
        },
        limits: Limits::new(aim, &rules.variable_of_cell, rules.variables),
        volumes_mm3: &volumes_mm3,
        variables: rules.variables,
        options,
        watch,
        setting: key(&[&format!("{aim:?}{rules:?}"), &options.setting()], &[]),
        free,
        moduli: moduli.collect(),
        random: Xoshiro256Plus::seed_from_u64(options.seed),
        simulations: 0,
        failed: 0,
        linearisations: 0,
        best: None,
        best_uniform: None,
        simulated: Vec::new(),
        relaxed: None,
        history: Vec::new(),
        place: ("starting", [1, 1]),
    };
    let stop = match walk.run() {
        Ok(()) if walk.best_mm() <= options.enough_mm => Stop::GoodEnough,
        Ok(()) if walk.simulations >= options.most_simulations => Stop::Exhausted,
        Ok(()) => Stop::Searched,
        Err(End::Interrupted) => Stop::Interrupted,
        Err(End::Mixture(error)) => return Err(error.into()),
    };
    Ok(walk.found(stop))
}

/// Why a walk ends before its end.
pub(super) enum End {
    Interrupted,
    Mixture(MixtureError),
}

impl From<MixtureError> for End {
    fn from(error: MixtureError) -> End {
        End::Mixture(error)
    }
}

/// A search under way.
pub(super) struct Walk<'a> {
    pub(super) rig: &'a Rig,
    pub(super) aim: &'a Aim<'a>,
    pub(super) bench: &'a mut dyn MixtureBench,
    parts: Parts<'a>,
    pub(super) limits: Limits,
    volumes_mm3: &'a [f64],
    variables: usize,
    pub(super) options: &'a Options,
    watch: &'a dyn Fn(&Progress, usize),
    /// What every decision depends on.
    pub(super) setting: Key,
    /// Which shares may be above zero, `(variables × materials)`.
    pub(super) free: Vec<bool>,
    moduli: Vec<f64>,
    random: Xoshiro256Plus,
    simulations: usize,
    failed: usize,
    pub(super) linearisations: usize,
    /// The best layout: materials of the variables, error, and what it answered.
    best: Option<(Vec<u8>, Ranked, State)>,
    best_uniform: Option<Ranked>,
    simulated: Vec<Ranked>,
    /// Error and score of the best mixture \[mm\].
    relaxed: Option<(f64, f64)>,
    history: Vec<Milestone>,
    place: (&'static str, [usize; 2]),
}

impl Walk<'_> {
    fn run(&mut self) -> Result<(), End> {
        let Some(start) = self.start()? else {
            return Ok(());
        };
        let mut state = self.relax(start, self.options.relaxing)?;
        if self.aim.space.most_materials < self.aim.space.materials {
            self.keep_most_used(&state.shares);
            let shares = self.evened(&state.shares);
            state = self.mixed(shares)?;
            state = self.relax(state, self.options.relaxing)?;
        }
        self.round(state)?;
        self.exchange()?;
        for _ in 0..self.options.cycles {
            let Some(choice) = self
                .best
                .as_ref()
                .map(|b| b.0.clone())
                .filter(|_| !self.is_done())
            else {
                break;
            };
            let layout = shares_of(&choice, self.aim.space.materials);
            let even = self.evened(&vec![0.0; layout.len()]);
            let blend = layout.iter().zip(&even).map(|(l, e)| KEPT * l + (1.0 - KEPT) * e);
            let shares: Shares = blend.collect();
            self.place = ("relaxing", [0, self.options.relaxing]);
            let state = self.mixed(shares)?;
            let state = self.relax(state, self.options.relaxing)?;
            self.round(state)?;
            self.exchange()?;
        }
        Ok(())
    }

    /// The best score \[mm\].
    fn best_mm(&self) -> f64 {
        self.best.as_ref().map_or(f64::INFINITY, |b| b.1.score_mm)
    }

    fn is_done(&self) -> bool {
        self.simulations >= self.options.most_simulations || self.best_mm() <= self.options.enough_mm
    }

    /// Simulates shares of variables.
    fn press(&mut self, shares: Shares, tolerance: f64) -> Result<State, End> {
        let (phase, level) = self.place;
        let progress = Progress {
            phase,
            level,
            batch: 1,
            best_mm: self.best_mm(),
            bound_mm: self.relaxed.map_or(0.0, |r| r.1),
        };
        (self.watch)(&progress, 0);
        let response = self.bench.press(&shares, tolerance)?.ok_or(End::Interrupted)?;
        self.simulations += 1;
        self.failed += usize::from(!response.complete);
        (self.watch)(&progress, 1);
        let rms_mm = self.aim.target.misfit(&response.displacements).rms_mm;
        let score_mm = rms_mm + self.limits.worth_mm(&shares);
        let excess = self.limits.excess(&shares);
        Ok(State {
            tolerance,
            rms_mm,
            score_mm,
            merit_mm: score_mm + BROKEN * excess * self.aim.target.largest_mm(),
            displacements: response.displacements,
            complete: response.complete,
            shares,
            linear: Linearised::default(),
        })
    }

    /// Simulates mixtures.
    fn mixed(&mut self, shares: Shares) -> Result<State, End> {
        let state = self.press(shares, self.options.tolerance)?;
        let is_better = self.relaxed.is_none_or(|known| state.score_mm < known.1);
        if state.complete && is_better && self.limits.excess(&state.shares) < BARELY {
            self.relaxed = Some((state.rms_mm, state.score_mm));
        }
        Ok(state)
    }

    /// Simulates a layout, and keeps it if it is the best.
    fn layout(&mut self, choice: &[u8]) -> Result<State, End> {
        let shares = shares_of(choice, self.aim.space.materials);
        let state = self.press(shares, EXACTER * self.options.tolerance)?;
        if !state.complete {
            return Ok(state);
        }
        let misfit = self.aim.target.misfit(&state.displacements);
        let ranked = self.aim.ranked(&self.by_cell(choice), misfit);
        if !ranked.score_mm.is_finite() || !self.may_be(choice) {
            return Ok(state);
        }
        let known_mm = self.best_uniform.as_ref().map_or(f64::INFINITY, |u| u.score_mm);
        if choice.iter().all(|m| *m == choice[0]) && ranked.score_mm < known_mm {
            self.best_uniform = Some(ranked.clone());
        }
        if ranked.score_mm < self.best_mm() {
            self.best = Some((choice.to_vec(), ranked.clone(), state.clone()));
            self.history.push(Milestone {
                simulations: self.simulations,
                linearisations: self.linearisations,
                rms_mm: misfit.rms_mm,
            });
        }
        self.simulated.push(ranked);
        Ok(state)
    }

    fn may_be(&self, choice: &[u8]) -> bool {
        self.aim.space.allows(&self.by_cell(choice)) && self.parts.hold(choice)
    }

    fn by_cell(&self, choice: &[u8]) -> Layout {
        let of = |&v: &u32| choice[v as usize];
        self.parts.variable_of_cell.iter().map(of).collect()
    }

    /// The best of the uniform layouts and the even mixture; `None` where none answers at all.
    fn start(&mut self) -> Result<Option<State>, End> {
        let m = self.aim.space.materials;
        self.place = ("uniform layouts", [1, m + 1]);
        let mut best: Option<State> = None;
        let better = |state: State, best: Option<State>| match best {
            Some(best) if best.merit_mm <= state.merit_mm => Some(best),
            _ if state.merit_mm.is_finite() => Some(state),
            best => best,
        };
        for k in 0..m {
            self.place.1[0] = k + 1;
            if (0..self.variables).any(|v| !self.free[v * m + k]) {
                continue;
            }
            let state = self.layout(&vec![k as u8; self.variables])?;
            best = better(state, best);
        }
        self.place.1[0] = m + 1;
        let shares = self.evened(&vec![0.0; self.variables * m]);
        let even = self.mixed(shares)?;
        Ok(better(even, best))
    }

    /// The nearest shares that are allowed.
    fn evened(&self, shares: &[f64]) -> Shares {
        let m = self.aim.space.materials;
        let mut result = shares.to_vec();
        for (own, free) in result.chunks_mut(m).zip(self.free.chunks(m)) {
            super::linear::project(own, free);
        }
        result
    }

    /// Frees none but the materials that are used most, as many as a layout may mix.
    fn keep_most_used(&mut self, shares: &[f64]) {
        let m = self.aim.space.materials;
        let mut used = vec![0.0; m];
        for (&v, volume) in self.parts.variable_of_cell.iter().zip(self.volumes_mm3) {
            for (k, used) in used.iter_mut().enumerate() {
                *used += volume * shares[v as usize * m + k];
            }
        }
        let mut order: Vec<usize> = (0..m).collect();
        order.sort_by(|&a, &b| used[b].total_cmp(&used[a]).then(a.cmp(&b)));
        for &k in &order[self.aim.space.most_materials.max(1)..] {
            for v in 0..self.variables {
                // A variable that may take nothing else keeps what it may take.
                let others = (0..m).any(|o| o != k && self.free[v * m + o]);
                self.free[v * m + k] &= !others;
            }
        }
    }

    /// Levenberg steps until they no longer help.
    fn relax(&mut self, mut state: State, most: usize) -> Result<State, End> {
        let (mut damping, mut stalls) = (1e-3, 0);
        for step in 0..most {
            if stalls >= STALLS || self.is_done() || state.merit_mm <= 0.1 * self.options.enough_mm {
                break;
            }
            self.place = ("relaxing", [step + 1, most]);
            let goal = state.shares.clone();
            let shares = self.step(&mut state, goal, damping)?;
            if shares == state.shares {
                stalls += 1;
                damping *= 10.0;
                continue;
            }
            if step == 0 {
                // So that there is a layout to answer with, whenever a user stops.
                let choice = self.rounded(&mut state, &shares)?;
                self.layout(&choice)?;
            }
            let next = self.mixed(shares)?;
            stalls += usize::from(next.merit_mm.is_nan() || next.merit_mm > 0.9 * state.merit_mm);
            if next.merit_mm < state.merit_mm {
                state = next;
                damping *= 0.1;
            } else {
                damping *= 10.0;
            }
        }
        Ok(state)
    }

    /// The shares of a step towards `goal`, within the limits.
    fn step(&mut self, state: &mut State, goal: Shares, damping: f64) -> Result<Shares, End> {
        let inputs = [damping]
            .iter()
            .chain(&goal)
            .flat_map(|x| x.to_le_bytes())
            .collect();
        self.decide(state, "step", inputs, |walk, linear, shares| {
            let next = linear.step(shares, &goal, damping, &walk.free);
            let bound = walk.limits.binding(linear, shares, &next);
            bound.map_or(next, |bound| bound.step(shares, &goal, damping, &walk.free))
        })
    }

    /// A layout near `near` in readings linearised at `state`, the rules kept where that can be.
    fn rounded(&mut self, state: &mut State, near: &[f64]) -> Result<Vec<u8>, End> {
        let mut order: Vec<u32> = (0..self.variables as u32).collect();
        order.shuffle(&mut self.random);
        let inputs = order.iter().flat_map(|v| v.to_le_bytes());
        let inputs = inputs.chain(near.iter().flat_map(|x| x.to_le_bytes()));
        self.decide(state, "round", inputs.collect(), |walk, linear, shares| {
            let limits = &walk.limits;
            let permit = |v: usize, m: u8, choice: &[u8]| limits.permit(v, m, choice);
            // The readings at `near`.
            let moved = Linear {
                residual: linear.moved(shares, near),
                ..linear.clone()
            };
            let mut choice = moved.rounded(near, &walk.free, &order, FIRMNESS, &permit);
            let layout = shares_of(&choice, linear.materials);
            if let Some(bound) = limits.binding(&moved, near, &layout) {
                choice = bound.rounded(near, &walk.free, &order, FIRMNESS, &permit);
            }
            let choice = walk.connected(&moved, near, choice);
            limits.mended(&moved, near, choice, &walk.free)
        })
    }

    /// The choice with the parts connected that must be, where that can be done.
    fn connected(&self, linear: &Linear, shares: &[f64], choice: Vec<u8>) -> Vec<u8> {
        let m = self.aim.space.materials;
        let rest = linear.moved(shares, &shares_of(&choice, m));
        let price = |variables: &[u32], to: u8| {
            let mut rest = rest.clone();
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
        self.parts.mended(&choice, price).unwrap_or(choice)
    }

    /// Goes from mixtures to a layout.
    fn round(&mut self, mut state: State) -> Result<(), End> {
        for (step, way) in WAYS.into_iter().enumerate() {
            if self.is_done() {
                break;
            }
            self.place = ("rounding", [step + 1, WAYS.len()]);
            let near = state.shares.clone();
            let choice = self.rounded(&mut state, &near)?;
            if way >= 1.0 {
                self.layout(&choice)?;
                break;
            }
            let layout = shares_of(&choice, self.aim.space.materials);
            let towards = near.iter().zip(&layout).map(|(s, l)| s + way * (l - s));
            let shares = self.step(&mut state, towards.collect(), 1e-3)?;
            state = self.mixed(shares)?;
        }
        Ok(())
    }

    /// Changes the best layout a few materials at a time as long as it gets better.
    fn exchange(&mut self) -> Result<(), End> {
        let Some((mut choice, _, mut state)) = self.best.clone() else {
            return Ok(());
        };
        let mut most = (self.variables / 16).max(4);
        let mut round = 1;
        self.place = ("exchanging", [round, round]);
        while !self.is_done() {
            let inputs = choice
                .iter()
                .copied()
                .chain((most as u64).to_le_bytes())
                .collect();
            let moves = self.decide(&mut state, "exchange", inputs, |walk, linear, _| {
                let allowed = |now: &[u8]| walk.may_be(now);
                exchange::choose(linear, &choice, &walk.free, &walk.moduli, most, &allowed)
            })?;
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
            if !self.may_be(&next) {
                continue;
            }
            let before = self.best_mm();
            let state = self.layout(&next)?;
            if self.best_mm() < before {
                return Ok(Some((next, state)));
            }
        }
        Ok(None)
    }

    fn found(self, stop: Stop) -> Found {
        // Mixtures that are no better say nothing.
        let bound = match self.relaxed.filter(|relaxed| relaxed.1 < self.best_mm()) {
            Some((_, score_mm)) => Bound {
                score_mm,
                basis: Basis::Relaxed,
            },
            None => Bound {
                score_mm: 0.0,
                basis: Basis::Nothing,
            },
        };
        let mut outcome = Outcome {
            best: self.best.into_iter().map(|best| best.1).collect(),
            simulated: self.simulated,
            best_uniform: self.best_uniform,
            bound,
            stop,
            simulations: self.simulations,
            failed: self.failed,
            culled: 0,
            merged: 0,
        };
        outcome.sort();
        Found {
            outcome,
            linearisations: self.linearisations,
            relaxed_rms_mm: self.relaxed.map_or(f64::NAN, |r| r.0),
            history: self.history,
        }
    }
}
