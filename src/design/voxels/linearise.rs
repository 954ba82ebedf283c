//! The linearised problem at some shares, and what is chosen from it.

use super::combinations::combinations;
use super::kept::{Kept, key};
use super::linear::{Linear, Shares};
use super::walk::{End, Walk};
use crate::fem::mixture::Reading;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256Plus;

/// Most numbers in the derivatives.
const MOST_NUMBERS: usize = 20_000_000;

/// Shares with what they answered.
#[derive(Clone)]
pub(super) struct State {
    pub shares: Shares,
    pub tolerance: f64,
    pub displacements: Vec<f64>,
    pub complete: bool,
    pub rms_mm: f64,
    /// Error and weighted cost \[mm\].
    pub score_mm: f64,
    /// Error, weighted cost, and what is above the limits, for comparing mixtures \[mm\].
    pub merit_mm: f64,
    pub linear: Linearised,
}

/// A linearisation: its number, and itself once it is needed.
#[derive(Clone, Default)]
pub(super) struct Linearised {
    pub number: Option<usize>,
    pub made: Option<Linear>,
}

impl Walk<'_> {
    /// What `choose` chooses from the linearisation at `state`, or what is known that it chose.
    pub fn decide<T: Kept>(
        &mut self,
        state: &mut State,
        kind: &str,
        inputs: Vec<u8>,
        choose: impl FnOnce(&Self, &Linear, &[f64]) -> T,
    ) -> Result<T, End> {
        let number = *state.linear.number.get_or_insert_with(|| {
            self.linearisations += 1;
            self.linearisations
        });
        let shares = state.shares.iter().flat_map(|x| x.to_le_bytes());
        let at: Vec<u8> = shares.chain((number as u64).to_le_bytes()).collect();
        let free: Vec<u8> = self.free.iter().map(|f| u8::from(*f)).collect();
        let key = key(&[kind], &[&self.setting, &at, &free, &inputs]);
        if let Some(known) = self.bench.recall(&key).and_then(|bytes| T::unpacked(&bytes)) {
            return Ok(known);
        }
        let linear = match state.linear.made.take() {
            Some(linear) => linear,
            None => self.linear(state, number)?,
        };
        let chosen = choose(self, &linear, &state.shares);
        state.linear.made = Some(linear);
        self.bench.keep(&key, &chosen.packed());
        Ok(chosen)
    }

    /// Residuals of the readings and their derivatives.
    fn linear(&mut self, state: &State, number: usize) -> Result<Linear, End> {
        let (readings, residual) = self.readings(&state.displacements, number);
        let derivatives = self
            .bench
            .derivatives(&state.shares, state.tolerance, &readings)?;
        let derivatives = derivatives.ok_or(End::Interrupted)?;
        let usable = derivatives.iter().all(|x| x.is_finite()) && residual.iter().all(|x| x.is_finite());
        let (derivatives, residual) = if usable {
            (derivatives, DVector::from_vec(residual))
        } else {
            let count = readings.len();
            (DMatrix::zeros(count, self.free.len()), DVector::zeros(count))
        };
        let linear = Linear {
            derivatives,
            residual,
            materials: self.aim.space.materials,
            sums: 0,
        };
        let target = self.aim.target;
        let (pairs, largest_mm) = (target.measured_pairs(), target.largest_mm());
        Ok(self
            .limits
            .with_worth(linear, &state.shares, pairs, state.rms_mm, largest_mm))
    }

    /// The readings of all presses and levels, by press, with their residuals \[mm\].
    fn readings(&self, displacements: &[f64], number: usize) -> (Vec<Reading>, Vec<f64>) {
        // Its own random numbers, whatever came before.
        let mut random = Xoshiro256Plus::seed_from_u64(self.options.seed ^ (number as u64) << 32);
        let presses = &self.rig.presses;
        let levels: usize = presses.iter().map(|p| p.factors.len()).sum();
        let most = self.options.readings.min(MOST_NUMBERS / self.free.len().max(1));
        let most = (most / levels.max(1)).max(1);
        let excess = self.aim.target.excess(displacements);
        let (mut readings, mut residuals) = (Vec::new(), Vec::new());
        let mut start = 0;
        for (k, press) in presses.iter().enumerate() {
            let count = press.components();
            for level in 0..press.factors.len() {
                let own: Vec<Option<f64>> = (start..start + count)
                    .map(|i| self.aim.target.components[i].map(|_| excess[i]))
                    .collect();
                start += count;
                for weights in combinations(&own, most, &mut random) {
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
}
