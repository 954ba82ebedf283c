//! The search of `pliant replicate` where a region is cut into voxels.

use super::progress::SearchBar;
use super::searching::{Searched, Setting};
use super::stop;
use crate::design::goal::Goal;
use crate::design::search::{self, Aim, Progress};
use crate::design::voxels::rules::VoxelRules;
use crate::design::voxels::{self, Options};
use crate::design::workbench::Workbench;
use crate::fem::equilibrium;
use crate::fem::rig::Rig;
use miette::miette;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Refuses what is for layers alone; `plain` says that none of it was asked for.
///
/// # Errors
/// If it was.
pub fn check(goal: &Goal, plain: bool) -> miette::Result<()> {
    if goal.rules.cost_weight_mm > 0.0 {
        return Err(miette!(
            "{}: cost_weight is not known to the search for layouts of voxels: leave it out, or use layers",
            goal.file().display()
        ));
    }
    if plain {
        return Ok(());
    }
    Err(miette!(
        "{}: it has {} voxels, for which there is one way to search and no --robust or --thickness: leave these and --method out",
        goal.file().display(),
        goal.setup.cells.count()
    ))
}

/// Searches, and simulates the best layout again at the default tolerance. Of `options` the seed, the score that is good
/// enough and the most simulations hold here too.
///
/// # Errors
/// A rule or an option that cannot be, memory.
pub fn search(
    goal: &Goal,
    rig: &Rig,
    aim: &Aim,
    rules: &VoxelRules,
    options: &search::Options,
    tolerance: f64,
    setting: &Setting,
) -> miette::Result<Searched> {
    let began = Instant::now();
    let default = Options::default();
    let own = Options {
        seed: options.seed,
        tolerance,
        enough_mm: options.good_enough_mm,
        most_simulations: default.most_simulations.min(options.most_simulations),
        ..default
    };
    let flag = stop::flag();
    let bar = SearchBar::new(setting.quiet);
    let watch = |progress: &Progress, done: usize| bar.show(progress, done);
    let until = setting.until;
    let cancelled = || flag.load(Ordering::Relaxed) || until.is_some_and(|t| Instant::now() >= t);
    let found = voxels::search(rig, aim.target, aim.space, rules, &own, &watch, &cancelled)
        .map_err(|e| miette!("{}: {e}", goal.file().display()))?;
    let mut fine = Workbench::new(rig, equilibrium::Options::default(), flag, &watch);
    let outcome = found.outcome.refined(aim, &mut fine);
    bar.finish();
    Ok(Searched {
        outcome,
        time: began.elapsed(),
        from_journal: 0,
    })
}
