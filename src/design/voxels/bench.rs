//! Where mixtures are simulated and linearised.

use super::rules::VoxelRules;
use crate::design::journal::Key;
use crate::fem::equilibrium::Options;
use crate::fem::mixture::{MixtureError, Mixtures, Pressed, Reading};
use crate::fem::rig::Response;
use nalgebra::DMatrix;
use std::collections::VecDeque;

/// Residual of the adjoint solves: derivatives need not be more exact than a linearisation is.
const ADJOINT_TOLERANCE: f64 = 1e-3;
/// Simulations whose displacement fields stay at hand. A rejected step goes back by one.
const AT_HAND: usize = 2;

/// Simulates and linearises mixtures. `shares`, `(variables × materials)`; an answer of `None` says that the user asked to
/// stop.
pub trait MixtureBench {
    /// The readings of all presses.
    ///
    /// # Errors
    /// [`MixtureError`]: memory.
    fn press(&mut self, shares: &[f64], tolerance: f64) -> Result<Option<Response>, MixtureError>;

    /// Derivatives of `readings`, ordered by press, at what [`MixtureBench::press`] found,
    /// `(readings × (variables · materials))` \[mm\].
    ///
    /// # Errors
    /// [`MixtureError`]: memory.
    fn derivatives(
        &mut self,
        shares: &[f64],
        tolerance: f64,
        readings: &[Reading],
    ) -> Result<Option<DMatrix<f64>>, MixtureError>;

    /// A decision that was made before, if it is known.
    fn recall(&mut self, _key: &Key) -> Option<Vec<u8>> {
        None
    }

    /// Keeps a decision.
    fn keep(&mut self, _key: &Key, _decision: &[u8]) {}
}

/// The bench of this process.
pub struct OwnMixtures<'a> {
    mixtures: Mixtures<'a>,
    rules: &'a VoxelRules,
    cancelled: &'a (dyn Fn() -> bool + Sync),
    at_hand: VecDeque<(Vec<f64>, f64, Pressed)>,
}

impl<'a> OwnMixtures<'a> {
    /// A bench for `mixtures`; `cancelled` ends what is under way.
    pub fn new(
        mixtures: Mixtures<'a>,
        rules: &'a VoxelRules,
        cancelled: &'a (dyn Fn() -> bool + Sync),
    ) -> OwnMixtures<'a> {
        OwnMixtures {
            mixtures,
            rules,
            cancelled,
            at_hand: VecDeque::new(),
        }
    }

    /// Simulates what is not at hand; its place among what is.
    fn simulated(&mut self, shares: &[f64], tolerance: f64) -> Result<usize, MixtureError> {
        let known = |(s, t, _): &(Vec<f64>, f64, Pressed)| *t == tolerance && s == shares;
        if let Some(place) = self.at_hand.iter().position(known) {
            return Ok(place);
        }
        let materials = self.mixtures.rig().laws.len();
        let of = |&v: &u32| &shares[v as usize * materials..(v as usize + 1) * materials];
        let by_cell: Vec<f64> = self.rules.variable_of_cell.iter().flat_map(of).copied().collect();
        let solver = Options::for_search(tolerance);
        let pressed = self.mixtures.press(&by_cell, &solver, self.cancelled)?;
        self.at_hand.truncate(AT_HAND - 1);
        self.at_hand.push_front((shares.to_vec(), tolerance, pressed));
        Ok(0)
    }
}

impl MixtureBench for OwnMixtures<'_> {
    fn press(&mut self, shares: &[f64], tolerance: f64) -> Result<Option<Response>, MixtureError> {
        let place = self.simulated(shares, tolerance)?;
        if (self.cancelled)() {
            self.at_hand.clear();
            return Ok(None);
        }
        Ok(Some(self.at_hand[place].2.response.clone()))
    }

    fn derivatives(
        &mut self,
        shares: &[f64],
        tolerance: f64,
        readings: &[Reading],
    ) -> Result<Option<DMatrix<f64>>, MixtureError> {
        let place = self.simulated(shares, tolerance)?;
        let own = self.mixtures.presses();
        let readings: Vec<Reading> = readings
            .iter()
            .filter(|r| own.contains(&r.press))
            .cloned()
            .collect();
        let variables = &self.rules.variable_of_cell;
        let pressed = &self.at_hand[place].2;
        let derivatives = self
            .mixtures
            .derivatives(pressed, &readings, variables, ADJOINT_TOLERANCE)?;
        if (self.cancelled)() {
            self.at_hand.clear();
            return Ok(None);
        }
        Ok(Some(derivatives))
    }
}
