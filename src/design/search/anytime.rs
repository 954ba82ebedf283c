//! The search that learns: a surrogate of all layouts says which to simulate next.
//!
//! 1. The uniform layouts and a spread of others are simulated: seeded, every material equally often in every cell.
//! 2. *Learning.* The surrogate is learned from all, and the layouts that it expects the most of are simulated. This ends where
//!    it expects nothing better, or nothing better was found for [`PATIENCE`] rounds.
//! 3. *Polishing* by exchanges of single cells, and learning again where that found something.
//! 4. *Bounding*: where what is left of the space may be simulated, it is, and the answer is proved. Otherwise the tree of
//!    [`super::bound`] is walked best-first where its boxes hold, and where the surrogate can look at the whole space,
//!
//! ```text
//! S(m) ≥ Ŝ(m) − RMS(x(m) − x̂(m)) ≥ (1 − ρ) Ŝ(m)
//! ```
//!
//!    with Ŝ, x̂ what it expects and ρ = max RMS(x − x̂)/Ŝ the largest surprise of late: whatever has (1 − ρ) Ŝ below the
//!    best score is simulated, and layouts picked by chance with it, which say what ρ is.
//!
//! Small spaces are looked at whole by the surrogate; of larger ones, the neighbours of the best layouts by one and two
//! exchanges, and crosses of the best.

use super::memory::{Halt, Memory};
use super::surrogate::Surrogate;
use super::{Basis, Bound, Counts, Options, Stop, bound, exchange, exhaustive};
use crate::design::space::Space;
use crate::fem::rig::Layout;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256Plus;
use std::collections::BTreeSet;

/// Rounds of the spread, each of which shows every material in every cell once.
const SPREAD: usize = 16;
/// Layouts simulated in a round of learning.
const BATCH: usize = 32;
/// Rounds of learning without a better layout after which polishing takes over.
const PATIENCE: usize = 3;
/// Rounds of learning in all.
const ROUNDS: usize = 40;
/// A space up to this size is looked at whole by the surrogate.
const LOOKED_AT_WHOLE: f64 = 100_000.0;
/// The best layouts whose neighbours the surrogate looks at in a larger space.
const PARENTS: usize = 12;
/// Layouts picked by chance in a round of bounding.
const CHECKS: usize = 16;
/// Rounds of bounding that say how wrong the surrogate may be.
const LATE: usize = 3;
/// How much more wrong than was seen it may be.
const CAUTION: f64 = 1.25;
/// Layouts that are expected to be so many times worse than the best are doubted no longer.
const DOUBT: f64 = 10.0;
/// Double exchanges that the surrogate looks at in a larger space.
const TWICE: usize = 4000;
/// Crosses of the best that the surrogate looks at in a larger space.
const CROSSES: usize = 4000;

/// Walks until the bound meets the best score, the score is good enough, or nothing more may be simulated.
pub(super) fn walk(memory: &mut Memory, options: &Options, counts: &mut Counts) -> Result<Stop, Halt> {
    let space = memory.aim.space;
    let mut random = Xoshiro256Plus::seed_from_u64(options.seed);
    memory.simulate(&memory.uniform(), "searching", [0, 0])?;
    let is_small = space.size() <= options.most_simulations as f64 / 4.0;
    if !is_small {
        memory.simulate(&spread_over(space, &mut random), "searching", [0, 0])?;
        loop {
            learn(memory, options, &mut random)?;
            let before = memory.best_mm;
            if before > options.good_enough_mm {
                exchange::polish(memory, options.polished)?;
            }
            if memory.best_mm >= before {
                break;
            }
        }
        if memory.best_mm <= options.good_enough_mm {
            return Ok(Stop::GoodEnough);
        }
    }
    if space.size() <= options.most_simulations as f64 {
        exhaustive::rest(memory)?;
        return Ok(Stop::Enumerated);
    }
    certify(memory, counts, &mut random)?;
    bound::tighten(memory, counts)?;
    Ok(Stop::Searched)
}

/// Layouts in which every cell takes every allowed material equally often, those that break a rule left out.
fn spread_over(space: &Space, random: &mut Xoshiro256Plus) -> Vec<Layout> {
    let mut layouts = Vec::new();
    for _ in 0..SPREAD {
        let columns: Vec<Vec<u8>> = space
            .allowed
            .iter()
            .map(|allowed| {
                let mut column = allowed.clone();
                column.shuffle(random);
                column
            })
            .collect();
        let rows = space.allowed.iter().map(Vec::len).max().unwrap_or(0);
        layouts.extend((0..rows).map(|r| columns.iter().map(|c| c[r % c.len()]).collect::<Layout>()));
    }
    layouts.retain(|l| space.allows(l));
    layouts
}

/// Rounds of learning, from the best that is known.
fn learn(memory: &mut Memory, options: &Options, random: &mut Xoshiro256Plus) -> Result<(), Halt> {
    let space = memory.aim.space;
    let whole: Option<Vec<Layout>> = (space.size() <= LOOKED_AT_WHOLE)
        .then(|| exhaustive::all(space).filter(|l| space.allows(l)).collect());
    let mut waited = 0;
    for round in 0..ROUNDS {
        if waited == PATIENCE || memory.best_mm <= options.good_enough_mm {
            break;
        }
        let Some(surrogate) = Surrogate::learn(memory) else {
            break;
        };
        let near;
        let candidates = match &whole {
            Some(all) => all,
            None => {
                near = around(memory, random);
                &near
            }
        };
        let fresh: Vec<Layout> = candidates.iter().filter(|l| !memory.knows(l)).cloned().collect();
        let scores = surrogate.scores(memory.aim, &fresh);
        let mut order: Vec<usize> = (0..fresh.len()).collect();
        order.sort_by(|&a, &b| {
            scores[a]
                .total_cmp(&scores[b])
                .then_with(|| fresh[a].cmp(&fresh[b]))
        });
        let batch: Vec<Layout> = order.iter().take(BATCH).map(|&i| fresh[i].clone()).collect();
        if batch.is_empty() {
            break;
        }
        let before = memory.best_mm;
        memory.simulate(&batch, "learning", [round + 1, ROUNDS])?;
        waited = if memory.best_mm < before { 0 } else { waited + 1 };
    }
    Ok(())
}

/// Simulates what the surrogate expects within its surprise of the best, until nothing is left.
fn certify(memory: &mut Memory, counts: &mut Counts, random: &mut Xoshiro256Plus) -> Result<(), Halt> {
    let space = memory.aim.space;
    if space.size() > LOOKED_AT_WHOLE {
        return Ok(());
    }
    let mut doubtful: Vec<Layout> = exhaustive::all(space).filter(|l| space.allows(l)).collect();
    // The least score that was expected of those that are doubted no longer.
    let mut least_dropped = f64::INFINITY;
    let mut surprises = Surprises::default();
    while let Some(surrogate) = Surrogate::learn(memory) {
        doubtful.retain(|l| !memory.knows(l));
        let scores = surrogate.scores(memory.aim, &doubtful);
        let mut order: Vec<usize> = (0..doubtful.len()).collect();
        order.sort_by(|&a, &b| {
            scores[a]
                .total_cmp(&scores[b])
                .then_with(|| doubtful[a].cmp(&doubtful[b]))
        });
        let sure = 1.0 - surprises.allowed();
        let mut chosen = random_layouts(space, CHECKS, random);
        if surprises.by_round.len() >= LATE {
            let expected = order.first().map_or(f64::INFINITY, |&first| scores[first]);
            let least = (sure * expected.min(least_dropped)).clamp(0.0, memory.best_mm);
            memory.bound_mm = least;
            counts.bound = Some(Bound {
                score_mm: least,
                basis: Basis::Learned {
                    checks: surprises.checks,
                    surprise: 1.0 - sure,
                },
            });
            if least >= memory.best_mm {
                break;
            }
            let is_doubtful: Vec<bool> = scores
                .iter()
                .map(|score| *score < DOUBT * memory.best_mm)
                .collect();
            let dropped = scores.iter().zip(&is_doubtful).filter(|(_, kept)| !**kept);
            least_dropped = dropped.fold(least_dropped, |least, (score, _)| least.min(*score));
            let near = order.iter().take_while(|&&i| sure * scores[i] < memory.best_mm);
            chosen.extend(near.take(2 * BATCH).map(|&i| doubtful[i].clone()));
            let mut kept = is_doubtful.into_iter();
            doubtful.retain(|_| kept.next().unwrap_or(false));
        } else {
            chosen.extend(order.iter().take(BATCH).map(|&i| doubtful[i].clone()));
        }
        chosen.retain(|l| !memory.knows(l));
        memory.simulate(&chosen, "bounding", [0, 0])?;
        surprises.note(memory, &surrogate, &chosen);
    }
    Ok(())
}

/// How wrong the surrogate was about layouts that were simulated after it spoke, as shares of the scores it expected.
#[derive(Default)]
struct Surprises {
    /// The largest of each round.
    by_round: Vec<f64>,
    checks: usize,
}

impl Surprises {
    /// How wrong it may be.
    fn allowed(&self) -> f64 {
        let late = self.by_round.iter().rev().take(LATE);
        (CAUTION * late.fold(0.0, |m: f64, s| m.max(*s))).min(1.0)
    }

    fn note(&mut self, memory: &Memory, surrogate: &Surrogate, layouts: &[Layout]) {
        let aim = memory.aim;
        let expected = surrogate.displacements(layouts);
        let scores = surrogate.scores(aim, layouts);
        let mut largest: f64 = 0.0;
        for (k, layout) in layouts.iter().enumerate() {
            let Some(entry) = memory.get(layout).filter(|e| e.response.complete) else {
                continue;
            };
            let by = aim
                .target
                .between(expected.column(k).as_slice(), &entry.response.displacements);
            largest = largest.max(by / scores[k].max(f64::MIN_POSITIVE));
            self.checks += 1;
        }
        self.by_round.push(largest);
    }
}

/// Layouts picked by chance.
fn random_layouts(space: &Space, count: usize, random: &mut Xoshiro256Plus) -> Vec<Layout> {
    let mut pick = || -> Layout {
        let materials = space
            .allowed
            .iter()
            .map(|a| a.choose(random).copied().unwrap_or(0));
        materials.collect()
    };
    // Rules may forbid most of them.
    let tried = (0..50 * count).map(|_| pick());
    tried.filter(|l| space.allows(l)).take(count).collect()
}

/// Neighbours of the best layouts by one and two exchanges, and crosses of the best.
fn around(memory: &Memory, random: &mut Xoshiro256Plus) -> Vec<Layout> {
    let space = memory.aim.space;
    let ranked = memory.ranked();
    let parents: Vec<&Layout> = ranked.iter().take(PARENTS).map(|r| &r.layout).collect();
    let mut found: BTreeSet<Layout> = BTreeSet::new();
    for parent in &parents {
        found.extend(space.neighbours(parent));
    }
    for _ in 0..TWICE {
        let Some(parent) = parents.choose(random) else {
            break;
        };
        let mut child = parent.to_vec();
        (0..2).for_each(|_| exchanged(space, &mut child, random));
        if space.allows(&child) {
            found.insert(child);
        }
    }
    let wide: Vec<&Layout> = ranked.iter().take(4 * PARENTS).map(|r| &r.layout).collect();
    if wide.len() > 1 {
        for _ in 0..CROSSES {
            let (a, b) = (
                wide[random.gen_range(0..wide.len())],
                wide[random.gen_range(0..wide.len())],
            );
            let mut child: Layout = (0..space.cells)
                .map(|c| if random.gen_bool(0.5) { a[c] } else { b[c] })
                .collect();
            exchanged(space, &mut child, random);
            if space.allows(&child) {
                found.insert(child);
            }
        }
    }
    found.into_iter().collect()
}

/// Gives a cell, picked by chance, another material.
fn exchanged(space: &Space, layout: &mut [u8], random: &mut Xoshiro256Plus) {
    let cell = random.gen_range(0..space.cells);
    if let Some(&material) = space.allowed[cell].choose(random) {
        layout[cell] = material;
    }
}
