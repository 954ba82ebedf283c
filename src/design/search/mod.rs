//! The search for the layout that behaves most like the target (Bickel 2010, section 8.4), three ways.
//!
//! ```text
//! find m = argmin S(m),   S(m) = RMS(x(m) − x̄) + w C(m),   m ∈ space
//! ```
//!
//! Symbols: m layout, x(m) its displacements \[mm\], x̄ the target's, C cost, w what a unit of cost is worth \[mm\]; S is the
//! *score* \[mm\]. Every layout is simulated at most once (`memory`).
//!
//! - [`Method::Anytime`], the default: a surrogate of x(m) learned from all simulated layouts says which to simulate next
//!   (`surrogate`, `anytime`); the best are polished by exchanges; then a best-first tree bounds what is left (`bound`).
//!   Where the space is small enough, all of it is simulated instead, which is proof.
//! - [`Method::Paper`]: the thesis' breadth-first tree with clusters (`paper`, `clusters`).
//! - [`Method::Exhaustive`]: every layout (`exhaustive`).
//!
//! Each answer says how good it may be at most, and what that rests on ([`Bound`]).

mod anytime;
mod bound;
mod clusters;
mod exchange;
mod exhaustive;
mod memory;
mod paper;
mod surrogate;
#[cfg(test)]
mod tests;

use super::misfit::{Misfit, Target};
use super::space::Space;
use crate::fem::rig::{Layout, Response};
use memory::{Halt, Memory};

pub use bound::{Basis, Bound};
pub use exhaustive::MOST_ENUMERATED;

/// Scores that the search's haste may have swapped are this many times the largest change apart: one for each of the two,
/// doubled.
const HASTE: f64 = 4.0;
/// At most how many of the best layouts are simulated again.
const MOST_REFINED: usize = 2000;

/// How a search walks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// By a learned surrogate, with a bound.
    #[default]
    Anytime,
    /// The thesis' tree.
    Paper,
    /// Every layout.
    Exhaustive,
}

/// How to search.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct Options {
    /// Which way.
    pub method: Method,
    /// K, the most nodes that a level of the thesis' tree keeps.
    pub clusters: usize,
    /// Seed of all random choices.
    pub seed: u64,
    /// How many of the best layouts are polished; 0 for none.
    pub polished: usize,
    /// At most how many layouts are simulated; the exhaustive method has no limit.
    pub most_simulations: usize,
    /// A score that is good enough \[mm\]: a search that reached it looks no further.
    pub good_enough_mm: f64,
    /// How many layouts the outcome lists.
    pub listed: usize,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            method: Method::Anytime,
            clusters: 20,
            seed: 1,
            polished: 3,
            most_simulations: 2000,
            good_enough_mm: 0.0,
            listed: 10,
        }
    }
}

/// An option that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BadSearch {
    /// Too many layouts to enumerate.
    #[error(
        "{layouts:e} layouts are more than --method exhaustive simulates ({MOST_ENUMERATED}): use fewer layers or materials, or search without it"
    )]
    TooManyLayouts {
        /// Size of the space.
        layouts: f64,
    },
    /// A count of zero.
    #[error("search option {field} is 0: it must be at least 1")]
    Zero {
        /// Which one.
        field: &'static str,
    },
    /// A length that is none.
    #[error("search option good_enough_mm is {value}: it must be zero or more")]
    GoodEnough {
        /// What it was set to.
        value: f64,
    },
}

/// A layout with its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranked {
    /// Material of each cell.
    pub layout: Layout,
    /// Its error.
    pub misfit: Misfit,
    /// Its error and its weighted cost \[mm\], by which it is ranked.
    pub score_mm: f64,
}

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// Every layout was simulated: the first is the best there is.
    Enumerated,
    /// The method came to its end.
    Searched,
    /// The best layout's score is good enough.
    GoodEnough,
    /// As many layouts were simulated as were allowed.
    Exhausted,
    /// A user, or the time allowed, stopped it: the best so far.
    Interrupted,
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The best layouts, best first.
    pub best: Vec<Ranked>,
    /// The best layout of one material alone.
    pub best_uniform: Option<Ranked>,
    /// Every layout that may be built and was simulated, with its error, best first.
    pub simulated: Vec<Ranked>,
    /// What no layout can be better than, as far as is known.
    pub bound: Bound,
    /// Why it ended.
    pub stop: Stop,
    /// Layouts simulated.
    pub simulations: usize,
    /// Of these, layouts without equilibrium under all loads.
    pub failed: usize,
    /// Nodes dropped by their bound.
    pub culled: usize,
    /// Nodes merged into a representative.
    pub merged: usize,
}

/// Where a search stands.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// What it does.
    pub phase: &'static str,
    /// Which step of how many; zero of zero where that is not known.
    pub level: [usize; 2],
    /// Layouts in this batch.
    pub batch: usize,
    /// Best score so far \[mm\].
    pub best_mm: f64,
    /// What no layout can be better than, as far as is known \[mm\].
    pub bound_mm: f64,
}

/// Simulates layouts. The order of the answers is that of the layouts.
pub trait Bench {
    /// The responses of `layouts`; `None` for those that were not simulated because the user asked to stop.
    fn respond(&mut self, layouts: &[Layout], progress: &Progress) -> Vec<Option<Response>>;
}

/// What a search is for.
#[derive(Clone, Copy, Debug)]
pub struct Aim<'a> {
    /// The layouts that may be built.
    pub space: &'a Space,
    /// What they should behave like.
    pub target: &'a Target,
    /// w, the error that a unit of cost is worth \[mm\]; 0 if cost does not count.
    pub cost_weight_mm: f64,
}

impl Aim<'_> {
    /// A layout with its error; a failed one if it may not be built or has no equilibrium.
    pub fn rate(&self, layout: &[u8], response: &Response) -> Ranked {
        let misfit = if response.complete && self.space.allows(layout) {
            self.target.misfit(&response.displacements)
        } else {
            Misfit::FAILED
        };
        self.ranked(layout, misfit)
    }

    /// A layout with an error that is known already.
    pub fn ranked(&self, layout: &[u8], misfit: Misfit) -> Ranked {
        Ranked {
            score_mm: misfit.rms_mm + self.worth(self.space.cost(layout)),
            layout: layout.to_vec(),
            misfit,
        }
    }

    /// The error that `cost` is worth \[mm\].
    fn worth(&self, cost: f64) -> f64 {
        if self.cost_weight_mm == 0.0 {
            0.0
        } else {
            self.cost_weight_mm * cost
        }
    }
}

/// Searches.
///
/// # Errors
/// [`BadSearch`] for options that cannot be.
pub fn search(aim: &Aim, options: &Options, bench: &mut dyn Bench) -> Result<Outcome, BadSearch> {
    check(options)?;
    let mut memory = Memory::new(aim, options.most_simulations, bench);
    let mut counts = Counts::default();
    let walked = match options.method {
        Method::Exhaustive => {
            memory.most = usize::MAX;
            exhaustive::walk(&mut memory)?
        }
        Method::Paper => {
            memory.most = usize::MAX;
            paper::walk(&mut memory, options, &mut counts)
                .and_then(|()| exchange::polish(&mut memory, options.polished))
                .map(|()| Stop::Searched)
        }
        Method::Anytime => anytime::walk(&mut memory, options, &mut counts),
    };
    let stop = walked.unwrap_or_else(|halt| match halt {
        Halt::Interrupted => Stop::Interrupted,
        Halt::Exhausted => Stop::Exhausted,
    });
    let bound = match stop {
        Stop::Enumerated => Bound::enumerated(memory.best_mm),
        _ => counts.bound.unwrap_or_else(|| bound::of_root(&memory)),
    };
    Ok(outcome(&memory, options, &counts, bound, stop))
}

/// What a method counted on its way.
#[derive(Default)]
struct Counts {
    culled: usize,
    merged: usize,
    bound: Option<Bound>,
}

impl Counts {
    /// Takes a bound that is higher than what is known.
    fn improve(&mut self, bound: Bound) {
        if self.bound.is_none_or(|known| bound.score_mm > known.score_mm) {
            self.bound = Some(bound);
        }
    }
}

fn check(options: &Options) -> Result<(), BadSearch> {
    for (field, value) in [
        ("clusters", options.clusters),
        ("most_simulations", options.most_simulations),
        ("listed", options.listed),
    ] {
        if value == 0 {
            return Err(BadSearch::Zero { field });
        }
    }
    if options.good_enough_mm >= 0.0 && options.good_enough_mm.is_finite() {
        return Ok(());
    }
    let value = options.good_enough_mm;
    Err(BadSearch::GoodEnough { value })
}

fn outcome(memory: &Memory, options: &Options, counts: &Counts, bound: Bound, stop: Stop) -> Outcome {
    let simulated = memory.ranked();
    let uniform = |r: &&Ranked| super::space::distinct(&r.layout) == 1;
    Outcome {
        best_uniform: simulated.iter().find(uniform).cloned(),
        best: simulated.iter().take(options.listed).cloned().collect(),
        bound: Bound {
            score_mm: bound.score_mm.min(memory.best_mm),
            ..bound
        },
        stop,
        simulations: memory.entries.len(),
        failed: memory.entries.iter().filter(|e| !e.response.complete).count(),
        culled: counts.culled,
        merged: counts.merged,
        simulated,
    }
}

impl Outcome {
    /// Brings the simulated layouts into order, each once, after some were added.
    pub fn sort(&mut self) {
        self.simulated.sort_by(by_score);
        self.simulated.dedup_by(|a, b| a.layout == b.layout);
    }

    /// How far the best layout may be from the best there is, as far as is known \[mm\].
    pub fn gap_mm(&self) -> f64 {
        self.best.first().map_or(f64::INFINITY, |best| {
            (best.score_mm - self.bound.score_mm).max(0.0)
        })
    }

    /// Simulates the listed layouts again on `bench`, which is more accurate than the one that searched, and ranks them by
    /// the errors found there: what is reported must not hold the search's haste. Layouts that this haste may have put
    /// behind the best are simulated again too: by the scores that have changed, the haste is known. An interrupted
    /// refinement changes nothing.
    pub fn refined(mut self, aim: &Aim, bench: &mut dyn Bench) -> Outcome {
        let listed = self.best.len();
        let best_mm = self.best.first().map_or(f64::INFINITY, |r| r.score_mm);
        let mut coarse = self.best.clone();
        let uniform = self.best_uniform.iter().cloned();
        coarse.extend(uniform.filter(|u| self.best.iter().all(|r| r.layout != u.layout)));
        let mut fine: Vec<Ranked> = Vec::new();
        let mut haste_mm = 0.0f64;
        while !coarse.is_empty() {
            let layouts: Vec<Layout> = coarse.iter().map(|r| r.layout.clone()).collect();
            let progress = Progress {
                phase: "refining",
                level: [0, 0],
                batch: layouts.len(),
                best_mm,
                bound_mm: self.bound.score_mm,
            };
            let responses = bench.respond(&layouts, &progress);
            if responses.iter().any(Option::is_none) {
                return self;
            }
            for (ranked, response) in coarse.drain(..).zip(responses.into_iter().flatten()) {
                let again = match response.complete {
                    true => aim.rate(&ranked.layout, &response),
                    false => ranked.clone(),
                };
                let change = (again.score_mm - ranked.score_mm).abs();
                // What the rules forbid, as a uniform layout may be, has no score.
                haste_mm = haste_mm.max(if change.is_finite() { change } else { 0.0 });
                fine.push(again);
            }
            let near = self.simulated.iter().take(MOST_REFINED);
            coarse = near
                .take_while(|r| r.score_mm <= best_mm + HASTE * haste_mm)
                .filter(|r| fine.iter().all(|f| f.layout != r.layout))
                .cloned()
                .collect();
        }
        fine.sort_by(by_score);
        if let Some(uniform) = &mut self.best_uniform {
            let again = fine.iter().find(|r| r.layout == uniform.layout);
            *uniform = again.cloned().unwrap_or_else(|| uniform.clone());
        }
        fine.retain(|r| aim.space.allows(&r.layout));
        self.best = fine.into_iter().take(listed).collect();
        let best_mm = self.best.first().map_or(f64::INFINITY, |r| r.score_mm);
        self.bound.score_mm = match self.bound.basis {
            Basis::Enumerated => best_mm,
            _ => self.bound.score_mm.min(best_mm),
        };
        self
    }
}

/// By score, then by layout, so that equal scores are always in one order.
fn by_score(a: &Ranked, b: &Ranked) -> std::cmp::Ordering {
    a.score_mm
        .total_cmp(&b.score_mm)
        .then_with(|| a.layout.cmp(&b.layout))
}
