//! The search for the layout that behaves most like the target (Bickel 2010, section 8.4.2).
//!
//! Breadth first through a decision tree whose level l decides cell l. A node with the first cells decided is judged by
//! its *uniform completions*: the undecided cells all of one base material, for each material in turn. All completions of
//! a level are simulated first, then
//!
//! - *culling*: the box that spans a node's completions, component by component, bounds what its subtree can reach; a node
//!   is dropped if the target is farther from its box than the best layout's error;
//! - *clustering*: nodes that behave alike are merged to at most K representatives ([`super::clusters`]).
//!
//! Every completion is a whole layout and competes for the best. Neither step is conservative: displacements are not
//! monotone in the materials, and a representative speaks for its cluster; so the answer is the best layout found, not a
//! proven optimum. Two additions to the paper, each of which can be switched off: *polishing* exchanges one cell's
//! material at a time in the best layouts until nothing improves, and `most_materials` limits how many materials a layout
//! mixes. The *exhaustive* method simulates every layout and is proof, where the space is small enough.
//!
//! The paper measures the distance of (8.4) squared and the culling distance plain; here both sides of the culling test
//! are root mean square errors in mm.

use super::clusters::representatives;
use super::misfit::{Misfit, Target};
use super::space::{Space, distinct};
use crate::fem::rig::{Layout, Response};
use std::collections::HashMap;

/// How to search.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Options {
    /// Simulate every layout.
    pub exhaustive: bool,
    /// K, the most nodes that a level keeps. Default 20.
    pub clusters: usize,
    /// Seed of the clustering. Default 1.
    pub seed: u64,
    /// How many of the best layouts are polished; 0 for none. Default 3.
    pub polished: usize,
    /// At most how many materials in one layout.
    pub most_materials: usize,
    /// How many layouts the outcome lists. Default 10.
    pub listed: usize,
}

/// More layouts than this are not enumerated.
pub const MOST_ENUMERATED: u128 = 2_000_000;

/// An option that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BadSearch {
    /// Too many layouts to enumerate.
    #[error(
        "{layouts} layouts are more than --exhaustive enumerates ({MOST_ENUMERATED}): use fewer layers or materials, or search without it"
    )]
    TooManyLayouts {
        /// Size of the space.
        layouts: String,
    },
    /// A count of zero.
    #[error("search option {field} is 0: it must be at least 1")]
    Zero {
        /// Which one.
        field: &'static str,
    },
}

/// A layout with its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranked {
    /// Material of each cell.
    pub layout: Layout,
    /// Its error.
    pub misfit: Misfit,
}

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// Every layout was simulated: the first is the best there is.
    Enumerated,
    /// The tree was walked to its leaves.
    Searched,
    /// A user stopped it: the best so far.
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
    /// Level of the tree, from 1, and how many there are.
    pub level: [usize; 2],
    /// Layouts in this batch.
    pub batch: usize,
    /// Best RMS error so far \[mm\].
    pub best_rms_mm: f64,
}

/// Simulates layouts. The order of the answers is that of the layouts.
pub trait Bench {
    /// The responses of `layouts`; `None` for those that were not simulated because the user asked to stop.
    fn respond(&mut self, layouts: &[Layout], progress: &Progress) -> Vec<Option<Response>>;
}

struct Interrupted;

/// Searches layouts of `cells` cells out of `materials` materials.
///
/// # Errors
/// [`BadSearch`] for options that cannot be.
pub fn search(
    cells: usize,
    materials: usize,
    target: &Target,
    options: &Options,
    bench: &mut dyn Bench,
) -> Result<Outcome, BadSearch> {
    let space = Space {
        most_materials: options.most_materials,
        ..Space::free(cells, materials)
    };
    search_in(&space, target, options, bench)
}

/// Searches the layouts of `space`.
///
/// # Errors
/// [`BadSearch`] for options that cannot be.
pub fn search_in(
    space: &Space,
    target: &Target,
    options: &Options,
    bench: &mut dyn Bench,
) -> Result<Outcome, BadSearch> {
    let (cells, materials) = (space.cells, space.materials);
    for (field, value) in [
        ("clusters", options.clusters),
        ("most_materials", options.most_materials),
        ("listed", options.listed),
    ] {
        if value == 0 {
            return Err(BadSearch::Zero { field });
        }
    }
    let mut tree = Tree {
        space,
        cells,
        materials,
        target,
        options,
        bench,
        memory: HashMap::new(),
        best_rms: f64::INFINITY,
        culled: 0,
        merged: 0,
    };
    let walked = if options.exhaustive {
        let layouts = (materials as u128).checked_pow(cells as u32).unwrap_or(u128::MAX);
        if layouts > MOST_ENUMERATED {
            return Err(BadSearch::TooManyLayouts {
                layouts: format!("{materials}^{cells}"),
            });
        }
        tree.enumerate(layouts as usize).map(|()| Stop::Enumerated)
    } else {
        tree.walk().and_then(|()| tree.polish()).map(|()| Stop::Searched)
    };
    Ok(tree.outcome(walked.unwrap_or(Stop::Interrupted)))
}

struct Tree<'a> {
    space: &'a Space,
    cells: usize,
    materials: usize,
    target: &'a Target,
    options: &'a Options,
    bench: &'a mut dyn Bench,
    memory: HashMap<Layout, Response>,
    best_rms: f64,
    culled: usize,
    merged: usize,
}

impl Tree<'_> {
    fn walk(&mut self) -> Result<(), Interrupted> {
        let mut nodes: Vec<Layout> = vec![Vec::new()];
        for level in 0..self.cells {
            let children: Vec<Layout> = nodes
                .iter()
                .flat_map(|node| (0..self.materials).map(move |m| [node.as_slice(), &[m as u8]].concat()))
                .filter(|child| self.space.may_hold(child))
                .collect();
            let completions: Vec<Layout> = children.iter().flat_map(|c| self.completions(c)).collect();
            self.simulate(&completions, "searching", [level + 1, self.cells])?;
            let kept: Vec<Layout> = children.iter().filter(|c| self.may_improve(c)).cloned().collect();
            self.culled += children.len() - kept.len();
            let features: Vec<Vec<f64>> = kept.iter().map(|node| self.features(node)).collect();
            let chosen = representatives(&features, self.options.clusters, self.options.seed + level as u64);
            self.merged += kept.len() - chosen.len();
            nodes = chosen.into_iter().map(|i| kept[i].clone()).collect();
        }
        Ok(())
    }

    fn enumerate(&mut self, layouts: usize) -> Result<(), Interrupted> {
        let batch = 2000;
        let batches = layouts.div_ceil(batch);
        for b in 0..batches {
            let numbers = b * batch..((b + 1) * batch).min(layouts);
            let list: Vec<Layout> = numbers
                .map(|n| self.decoded(n))
                .filter(|l| self.space.allows(l))
                .collect();
            self.simulate(&list, "enumerating", [b + 1, batches])?;
        }
        Ok(())
    }

    fn decoded(&self, mut number: usize) -> Layout {
        (0..self.cells)
            .map(|_| {
                let m = number % self.materials;
                number /= self.materials;
                m as u8
            })
            .collect()
    }

    /// The uniform completions of a node, one for each material. Those that mix too many materials still bound the node.
    fn completions(&self, node: &[u8]) -> Vec<Layout> {
        (0..self.materials)
            .map(|m| {
                let mut layout = node.to_vec();
                layout.resize(self.cells, m as u8);
                layout
            })
            .collect()
    }

    fn simulate(
        &mut self,
        layouts: &[Layout],
        phase: &'static str,
        level: [usize; 2],
    ) -> Result<(), Interrupted> {
        let mut fresh: Vec<Layout> = layouts
            .iter()
            .filter(|l| !self.memory.contains_key(*l))
            .cloned()
            .collect();
        fresh.sort_unstable();
        fresh.dedup();
        if fresh.is_empty() {
            return Ok(());
        }
        let progress = Progress {
            phase,
            level,
            batch: fresh.len(),
            best_rms_mm: self.best_rms,
        };
        let responses = self.bench.respond(&fresh, &progress);
        let mut interrupted = false;
        for (layout, response) in fresh.into_iter().zip(responses) {
            let Some(response) = response else {
                interrupted = true;
                continue;
            };
            let misfit = self.misfit(&layout, &response);
            self.best_rms = self.best_rms.min(misfit.rms_mm);
            self.memory.insert(layout, response);
        }
        if interrupted { Err(Interrupted) } else { Ok(()) }
    }

    /// The error of a layout that may be built; a failed one if it has no equilibrium or breaks a rule.
    fn misfit(&self, layout: &[u8], response: &Response) -> Misfit {
        if !response.complete || !self.space.allows(layout) {
            return Misfit::FAILED;
        }
        self.target.misfit(&response.displacements)
    }

    /// Can the node's subtree hold something better than the best? A node with a completion that has no equilibrium is
    /// not bounded.
    fn may_improve(&self, node: &[u8]) -> bool {
        let components = self.target.components.len();
        let (mut low, mut high) = (
            vec![f64::INFINITY; components],
            vec![f64::NEG_INFINITY; components],
        );
        for layout in self.completions(node) {
            let Some(response) = self.memory.get(&layout).filter(|r| r.complete) else {
                return true;
            };
            for (i, x) in response.displacements.iter().enumerate() {
                low[i] = low[i].min(*x);
                high[i] = high[i].max(*x);
            }
        }
        // Rounding must not drop the node of the best layout itself.
        self.target.distance_to_box(&low, &high) <= self.best_rms * (1.0 + 1e-9)
    }

    fn features(&self, node: &[u8]) -> Vec<f64> {
        let mut features = Vec::new();
        for layout in self.completions(node) {
            let Some(response) = self.memory.get(&layout) else {
                continue;
            };
            let measured = response.displacements.iter().zip(&self.target.components);
            features.extend(measured.filter(|(_, target)| target.is_some()).map(|(x, _)| *x));
        }
        features
    }

    /// Exchanges one cell at a time in each of the best layouts, the best exchange first, until none improves.
    fn polish(&mut self) -> Result<(), Interrupted> {
        let starts: Vec<Ranked> = self.ranked().into_iter().take(self.options.polished).collect();
        for (number, start) in starts.iter().enumerate() {
            let mut current = start.clone();
            loop {
                let neighbours = self.neighbours(&current.layout);
                self.simulate(&neighbours, "polishing", [number + 1, starts.len()])?;
                let better = neighbours
                    .into_iter()
                    .filter_map(|layout| {
                        let misfit = self.misfit(&layout, self.memory.get(&layout)?);
                        Some(Ranked { layout, misfit })
                    })
                    .min_by(by_error);
                match better {
                    Some(better) if better.misfit.rms_mm < current.misfit.rms_mm => current = better,
                    _ => break,
                }
            }
        }
        Ok(())
    }

    fn neighbours(&self, layout: &[u8]) -> Vec<Layout> {
        let mut result = Vec::new();
        for cell in 0..self.cells {
            for m in 0..self.materials as u8 {
                let mut other = layout.to_vec();
                other[cell] = m;
                if m != layout[cell] && self.space.allows(&other) {
                    result.push(other);
                }
            }
        }
        result
    }

    fn ranked(&self) -> Vec<Ranked> {
        let mut all: Vec<Ranked> = self
            .memory
            .iter()
            .map(|(layout, response)| Ranked {
                layout: layout.clone(),
                misfit: self.misfit(layout, response),
            })
            .filter(|r| r.misfit.rms_mm.is_finite())
            .collect();
        all.sort_by(by_error);
        all
    }

    fn outcome(&self, stop: Stop) -> Outcome {
        let ranked = self.ranked();
        let best_uniform = ranked.iter().find(|r| distinct(&r.layout) == 1).cloned();
        Outcome {
            best_uniform,
            stop,
            simulations: self.memory.len(),
            failed: self.memory.values().filter(|r| !r.complete).count(),
            culled: self.culled,
            merged: self.merged,
            best: ranked.iter().take(self.options.listed).cloned().collect(),
            simulated: ranked,
        }
    }
}

impl Outcome {
    /// Simulates the listed layouts again on `bench`, which is more accurate than the one that searched, and ranks them by
    /// the errors found there: what is reported must not hold the search's haste. An interrupted refinement changes nothing.
    pub fn refined(mut self, target: &Target, bench: &mut dyn Bench) -> Outcome {
        let mut layouts: Vec<Layout> = self.best.iter().map(|r| r.layout.clone()).collect();
        layouts.extend(self.best_uniform.iter().map(|r| r.layout.clone()));
        let best_rms_mm = self.best.first().map_or(f64::INFINITY, |r| r.misfit.rms_mm);
        let progress = Progress {
            phase: "refining",
            level: [1, 1],
            batch: layouts.len(),
            best_rms_mm,
        };
        let responses = bench.respond(&layouts, &progress);
        if responses.iter().any(Option::is_none) {
            return self;
        }
        let rate = |ranked: &mut Ranked, response: &Option<Response>| {
            if let Some(response) = response.as_ref().filter(|r| r.complete) {
                ranked.misfit = target.misfit(&response.displacements);
            }
        };
        for (ranked, response) in self.best.iter_mut().chain(&mut self.best_uniform).zip(&responses) {
            rate(ranked, response);
        }
        self.best.sort_by(by_error);
        self
    }
}

/// By error, then by layout, so that equal errors are always in one order.
fn by_error(a: &Ranked, b: &Ranked) -> std::cmp::Ordering {
    a.misfit
        .rms_mm
        .total_cmp(&b.misfit.rms_mm)
        .then_with(|| a.layout.cmp(&b.layout))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Springs in a row: each cell of material m gives by c(m) times the force, with a mild hardening; two sensors, one in the middle.
    struct Springs {
        simulated: usize,
        stop_after: usize,
    }

    fn springs(layout: &[u8]) -> Vec<f64> {
        let give = |m: u8, f: f64| {
            let c = 0.5 * 1.4f64.powi(m as i32);
            c * f / (1.0 + 0.05 * c * f)
        };
        let mut result = Vec::new();
        for f in [1.0, 2.0, 3.0] {
            let whole: f64 = layout.iter().map(|&m| give(m, f)).sum();
            let half: f64 = layout[layout.len() / 2..].iter().map(|&m| give(m, f)).sum();
            result.extend([whole, half]);
        }
        result
    }

    impl Bench for Springs {
        fn respond(&mut self, layouts: &[Layout], _: &Progress) -> Vec<Option<Response>> {
            let mut answers = Vec::new();
            for layout in layouts {
                let goes_on = self.simulated < self.stop_after;
                self.simulated += usize::from(goes_on);
                answers.push(goes_on.then(|| Response {
                    displacements: springs(layout),
                    complete: true,
                }));
            }
            answers
        }
    }

    fn target(layout: &[u8]) -> Target {
        let components: Vec<Option<f64>> = springs(layout).into_iter().map(Some).collect();
        let pairs = (0..=components.len()).collect();
        let tolerances_mm = vec![0.0; components.len()];
        Target {
            components,
            pairs,
            tolerances_mm,
        }
    }

    fn options() -> Options {
        Options {
            exhaustive: false,
            clusters: 20,
            seed: 1,
            polished: 3,
            most_materials: 9,
            listed: 10,
        }
    }

    /// The tree is no proof, so it is asked for most of the hidden layouts and for a good one each time. Order inside each
    /// half cannot be seen by two sensors: the error can.
    #[test]
    fn finds_most_hidden_layouts_with_a_fraction_of_the_simulations() {
        let mut exact = 0;
        for number in 0..12usize {
            // Digits of multiples of a number that shares no factor with 6⁵ spread over all layouts.
            let hidden: Vec<u8> = (0..5)
                .map(|cell| ((1 + number) * 2593 / 6usize.pow(cell) % 6) as u8)
                .collect();
            let mut bench = Springs {
                simulated: 0,
                stop_after: usize::MAX,
            };
            let found = search(5, 6, &target(&hidden), &options(), &mut bench).unwrap();
            let (error, single) = (
                found.best[0].misfit.rms_mm,
                found.best_uniform.unwrap().misfit.rms_mm,
            );
            println!(
                "{hidden:?}: {error:.4} mm, single material {single:.4} mm, {} simulations",
                found.simulations
            );
            exact += usize::from(error < 1e-9);
            assert!(error <= 0.25 * single, "{hidden:?}: {error} of {single} mm");
            assert_eq!(found.simulations, bench.simulated);
            assert!(found.simulations * 3 < 6usize.pow(5), "{}", found.simulations);
        }
        assert!(exact >= 8, "{exact} of 12");
    }

    #[test]
    fn enumeration_simulates_everything_once_and_finds_the_optimum() {
        let hidden = [2u8, 0, 1, 2];
        let mut bench = Springs {
            simulated: 0,
            stop_after: usize::MAX,
        };
        let all = Options {
            exhaustive: true,
            ..options()
        };
        let found = search(4, 3, &target(&hidden), &all, &mut bench).unwrap();
        assert_eq!(
            (found.stop, found.simulations, bench.simulated),
            (Stop::Enumerated, 81, 81)
        );
        assert!(found.best[0].misfit.rms_mm < 1e-12);
        assert!(matches!(
            search(40, 9, &target(&[0; 40]), &all, &mut bench),
            Err(BadSearch::TooManyLayouts { .. })
        ));
    }

    #[test]
    fn the_limit_on_materials_holds_for_every_listed_layout() {
        let mut bench = Springs {
            simulated: 0,
            stop_after: usize::MAX,
        };
        let two = Options {
            most_materials: 2,
            ..options()
        };
        let found = search(5, 6, &target(&[0, 3, 1, 5, 2]), &two, &mut bench).unwrap();
        assert!(found.best.iter().all(|r| distinct(&r.layout) <= 2));
        let exhaustive = Options {
            exhaustive: true,
            ..two
        };
        let best = search(5, 6, &target(&[0, 3, 1, 5, 2]), &exhaustive, &mut bench).unwrap();
        assert!(found.best[0].misfit.rms_mm <= 1.5 * best.best[0].misfit.rms_mm);
    }

    #[test]
    fn a_stop_keeps_the_best_so_far() {
        let mut bench = Springs {
            simulated: 0,
            stop_after: 100,
        };
        let found = search(5, 6, &target(&[0, 3, 1, 5, 2]), &options(), &mut bench).unwrap();
        assert_eq!(found.stop, Stop::Interrupted);
        assert!(found.best[0].misfit.rms_mm.is_finite() && found.simulations == bench.simulated);
    }
}
