//! A bench of mixtures with a journal, so that a search that was ended goes on where it was.
//!
//! Kept are what each simulation read and what was chosen from each linearisation, each under the SHA-256 of all that it depends
//! on. A search that begins again finds both and makes the same way without simulating, until it comes to what is new;
//! only there are the displacement fields made again that the next linearisation needs.

use super::bench::MixtureBench;
use super::rules::VoxelRules;
use crate::design::journal::{Journal, JournalError, Key, identity};
use crate::fem::mixture::{MixtureError, Reading};
use crate::fem::rig::{Response, Rig};
use nalgebra::DMatrix;
use sha2::{Digest, Sha256};

/// The first half of the SHA-256 of some texts and bytes, each with its length.
pub(super) fn key(texts: &[&str], bytes: &[&[u8]]) -> Key {
    let mut hash = Sha256::new();
    for part in texts.iter().map(|t| t.as_bytes()).chain(bytes.iter().copied()) {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    let mut key = Key::default();
    key.copy_from_slice(&hash.finalize()[..16]);
    key
}

/// Bytes that a decision is kept as.
pub(super) trait Kept: Sized {
    fn packed(&self) -> Vec<u8>;
    fn unpacked(bytes: &[u8]) -> Option<Self>;
}

/// Shares.
impl Kept for Vec<f64> {
    fn packed(&self) -> Vec<u8> {
        self.iter().flat_map(|x| x.to_le_bytes()).collect()
    }

    fn unpacked(bytes: &[u8]) -> Option<Vec<f64>> {
        let number = |b: &[u8]| Some(f64::from_le_bytes(b.try_into().ok()?));
        bytes.chunks(8).map(number).collect()
    }
}

/// Materials.
impl Kept for Vec<u8> {
    fn packed(&self) -> Vec<u8> {
        self.clone()
    }

    fn unpacked(bytes: &[u8]) -> Option<Vec<u8>> {
        Some(bytes.to_vec())
    }
}

/// Exchanges.
impl Kept for Vec<(u32, u8)> {
    fn packed(&self) -> Vec<u8> {
        let one = |(v, m): &(u32, u8)| v.to_le_bytes().into_iter().chain([*m]);
        self.iter().flat_map(one).collect()
    }

    fn unpacked(bytes: &[u8]) -> Option<Vec<(u32, u8)>> {
        let one = |b: &[u8]| {
            let (m, v) = b.split_last()?;
            Some((u32::from_le_bytes(v.try_into().ok()?), *m))
        };
        bytes.chunks(5).map(one).collect()
    }
}

/// A bench that asks `inner` only for what the journal does not hold.
pub struct JournalledMixtures<'a> {
    journal: &'a Journal,
    setting: Key,
    inner: &'a mut dyn MixtureBench,
    /// How many simulations the journal gave.
    pub found: usize,
    /// What went wrong with the journal; the search went on without it.
    pub error: Option<JournalError>,
}

impl<'a> JournalledMixtures<'a> {
    /// Keeps what `inner` simulates on `rig`.
    pub fn new(
        journal: &'a Journal,
        rig: &Rig,
        rules: &VoxelRules,
        inner: &'a mut dyn MixtureBench,
    ) -> JournalledMixtures<'a> {
        let own = format!("mixtures {:?} {:?}", rules.variable_of_cell, rig.laws);
        JournalledMixtures {
            journal,
            setting: key(&[env!("CARGO_PKG_VERSION"), &own], &[&identity(rig)]),
            inner,
            found: 0,
            error: None,
        }
    }

    /// The answer of the journal, unless it has failed.
    fn ask<T>(&mut self, question: impl FnOnce(&Journal) -> Result<T, JournalError>) -> Option<T> {
        if self.error.is_some() {
            return None;
        }
        match question(self.journal) {
            Ok(answer) => Some(answer),
            Err(error) => {
                self.error = Some(error);
                None
            }
        }
    }
}

impl MixtureBench for JournalledMixtures<'_> {
    fn press(&mut self, shares: &[f64], tolerance: f64) -> Result<Option<Response>, MixtureError> {
        let shares_bytes = shares.to_vec().packed();
        let key = key(&[], &[&self.setting, &tolerance.to_le_bytes(), &shares_bytes]);
        let known = self.ask(|journal| journal.read(&[key]));
        if let Some(response) = known.and_then(|mut known| known.pop().flatten()) {
            self.found += 1;
            return Ok(Some(response));
        }
        let response = self.inner.press(shares, tolerance)?;
        if let Some(response) = &response {
            self.ask(|journal| journal.write(&[(key, response)]));
        }
        Ok(response)
    }

    fn derivatives(
        &mut self,
        shares: &[f64],
        tolerance: f64,
        readings: &[Reading],
    ) -> Result<Option<DMatrix<f64>>, MixtureError> {
        self.inner.derivatives(shares, tolerance, readings)
    }

    fn recall(&mut self, decision: &Key) -> Option<Vec<u8>> {
        let key = key(&[], &[&self.setting, decision]);
        self.ask(|journal| journal.decision(&key)).flatten()
    }

    fn keep(&mut self, decision: &Key, chosen: &[u8]) {
        let key = key(&[], &[&self.setting, decision]);
        self.ask(|journal| journal.decide(&key, chosen));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_comes_back() {
        let shares = vec![0.1, -0.0, 1.0 / 3.0];
        let moves = vec![(70_000u32, 3u8), (0, 255)];
        assert_eq!(Vec::<f64>::unpacked(&shares.packed()), Some(shares));
        assert_eq!(Vec::<(u32, u8)>::unpacked(&moves.packed()), Some(moves));
        assert_eq!(Vec::<f64>::unpacked(&[1, 2, 3]), None);
        assert_eq!(Vec::<(u32, u8)>::unpacked(&[1, 2, 3]), None);
        assert_ne!(key(&["ab", "c"], &[]), key(&["a", "bc"], &[]));
    }
}
