//! Every layout that was simulated, so that none is simulated twice.

use super::{Aim, Bench, Progress, Ranked, by_score};
use crate::fem::rig::{Layout, Response};
use std::collections::HashMap;

/// A layout and what it answered.
pub(super) struct Entry {
    pub ranked: Ranked,
    pub response: Response,
}

/// Why no more is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Halt {
    /// The bench was stopped.
    Interrupted,
    /// As many layouts were simulated as were allowed.
    Exhausted,
}

/// The simulated layouts, in the order of their simulation.
pub(super) struct Memory<'a> {
    pub aim: &'a Aim<'a>,
    pub entries: Vec<Entry>,
    /// The best score \[mm\].
    pub best_mm: f64,
    /// The bound to show with the progress \[mm\].
    pub bound_mm: f64,
    /// At most how many layouts are simulated.
    pub most: usize,
    bench: &'a mut dyn Bench,
    place: HashMap<Layout, usize>,
}

impl<'a> Memory<'a> {
    pub fn new(aim: &'a Aim<'a>, most: usize, bench: &'a mut dyn Bench) -> Memory<'a> {
        Memory {
            aim,
            entries: Vec::new(),
            best_mm: f64::INFINITY,
            bound_mm: 0.0,
            most,
            bench,
            place: HashMap::new(),
        }
    }

    pub fn get(&self, layout: &[u8]) -> Option<&Entry> {
        self.place.get(layout).map(|&i| &self.entries[i])
    }

    pub fn knows(&self, layout: &[u8]) -> bool {
        self.place.contains_key(layout)
    }

    /// Simulates those of `layouts` that were not yet.
    pub fn simulate(
        &mut self,
        layouts: &[Layout],
        phase: &'static str,
        level: [usize; 2],
    ) -> Result<(), Halt> {
        let mut fresh: Vec<Layout> = layouts.iter().filter(|l| !self.knows(l)).cloned().collect();
        fresh.sort_unstable();
        fresh.dedup();
        let left = self.most - self.entries.len().min(self.most);
        let is_cut = fresh.len() > left;
        fresh.truncate(left);
        if !fresh.is_empty() {
            self.ask(fresh, phase, level)?;
        }
        if is_cut { Err(Halt::Exhausted) } else { Ok(()) }
    }

    fn ask(&mut self, fresh: Vec<Layout>, phase: &'static str, level: [usize; 2]) -> Result<(), Halt> {
        let progress = Progress {
            phase,
            level,
            batch: fresh.len(),
            best_mm: self.best_mm,
            bound_mm: self.bound_mm,
        };
        let responses = self.bench.respond(&fresh, &progress);
        let mut is_whole = true;
        for (layout, response) in fresh.into_iter().zip(responses) {
            let Some(response) = response else {
                is_whole = false;
                continue;
            };
            let ranked = self.aim.rate(&layout, &response);
            self.best_mm = self.best_mm.min(ranked.score_mm);
            self.place.insert(layout, self.entries.len());
            self.entries.push(Entry { ranked, response });
        }
        if is_whole { Ok(()) } else { Err(Halt::Interrupted) }
    }

    /// The layouts that may be built and stand their loads, best first.
    pub fn ranked(&self) -> Vec<Ranked> {
        let standing = self.entries.iter().filter(|e| e.ranked.score_mm.is_finite());
        let mut all: Vec<Ranked> = standing.map(|e| e.ranked.clone()).collect();
        all.sort_by(by_score);
        all
    }

    /// The layouts of one material alone.
    pub fn uniform(&self) -> Vec<Layout> {
        let space = self.aim.space;
        (0..space.materials).map(|m| vec![m as u8; space.cells]).collect()
    }
}
