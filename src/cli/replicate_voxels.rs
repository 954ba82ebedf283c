//! The search of `pliant replicate` where a region is cut into voxels.

use super::progress::SearchBar;
use super::searching::{Searched, Setting, Team};
use super::stop;
use super::terminal::warn;
use crate::design::goal::Goal;
use crate::design::journal::Journal;
use crate::design::search::{self, Aim, Outcome, Progress, Stop};
use crate::design::space::Space;
use crate::design::voxels::bench::MixtureBench;
use crate::design::voxels::kept::JournalledMixtures;
use crate::design::voxels::rules::VoxelRules;
use crate::design::voxels::{self, Options};
use crate::design::workbench::Workbench;
use crate::fem::equilibrium;
use crate::fem::rig::Rig;
use miette::{IntoDiagnostic, miette};
use std::time::Instant;

/// Into how many parts the way from the least mass or cost to the best layout's is cut.
const STEPS: usize = 5;
/// Most simulations within each limit.
const SHORT: usize = 30;

/// Refuses what is for layers alone; `plain` says that none of it was asked for.
///
/// # Errors
/// If it was.
pub fn check(goal: &Goal, plain: bool) -> miette::Result<()> {
    if plain {
        return Ok(());
    }
    Err(miette!(
        "{}: it has {} voxels, for which there is one way to search and no --thickness: leave it and --method out",
        goal.file().display(),
        goal.setup.cells.count()
    ))
}

/// What there is to search.
pub struct Task<'a> {
    pub goal: &'a Goal,
    pub rig: &'a Rig,
    pub aim: &'a Aim<'a>,
    pub rules: &'a VoxelRules,
    /// Search for lighter and cheaper layouts too.
    pub pareto: bool,
}

/// Searches, and simulates the best layouts again at the default tolerance. Of `options` the seed, the score that is good
/// enough and the most simulations hold here too.
///
/// # Errors
/// An option that cannot be, memory, a journal that cannot be used.
pub fn search(
    team: &Team,
    task: &Task,
    options: &search::Options,
    tolerance: f64,
    setting: &Setting,
) -> miette::Result<Searched> {
    let began = Instant::now();
    let (rig, aim) = (task.rig, task.aim);
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
    let cancelled = setting.cancelled();
    let mut bench = team.mixtures(rig, task.rules, &cancelled);
    let (outcome, from_journal) = match &setting.journal {
        None => (whole(task, &own, bench.as_mut(), &watch)?, 0),
        Some(file) => {
            let journal = Journal::open(file).into_diagnostic()?;
            let mut bench = JournalledMixtures::new(&journal, rig, task.rules, bench.as_mut());
            let outcome = whole(task, &own, &mut bench, &watch)?;
            if let Some(error) = &bench.error {
                warn(&format!("warning: {error}; the search went on without it"));
            }
            (outcome, bench.found)
        }
    };
    let mut fine = Workbench::new(rig, equilibrium::Options::default(), flag, &watch);
    let outcome = outcome.refined(aim, &mut fine);
    bar.finish();
    Ok(Searched {
        outcome,
        time: began.elapsed(),
        from_journal,
    })
}

/// The search, and where the set against mass or cost is asked for, short ones within limits between the least and what
/// the best layout weighs or costs.
fn whole(
    task: &Task,
    options: &Options,
    bench: &mut dyn MixtureBench,
    watch: &dyn Fn(&Progress, usize),
) -> miette::Result<Outcome> {
    let mut search = |space: &Space, options: &Options| {
        let aim = Aim { space, ..*task.aim };
        voxels::search(task.rig, &aim, task.rules, options, bench, watch)
            .map(|found| found.outcome)
            .map_err(|e| miette!("{}: {e}", task.goal.file().display()))
    };
    let space = task.aim.space;
    let mut outcome = search(space, options)?;
    let Some(best) = outcome.best.first().map(|r| r.layout.clone()) else {
        return Ok(outcome);
    };
    let by_cost = task.goal.rules.currency.is_some();
    let (least, most) = match by_cost {
        true => (space.least_cost(), space.cost(&best)),
        false => (space.least_mass_g(), space.mass_g(&best)),
    };
    let short = Options {
        most_simulations: options.most_simulations.min(SHORT),
        cycles: 0,
        ..*options
    };
    for step in 1..if task.pareto && least < most { STEPS } else { 1 } {
        if outcome.stop == Stop::Interrupted {
            break;
        }
        let mut bounded = space.clone();
        let limit = if by_cost {
            &mut bounded.most_cost
        } else {
            &mut bounded.most_mass_g
        };
        *limit = limit.min(least + (most - least) * step as f64 / STEPS as f64);
        let more = search(&bounded, &short)?;
        outcome.simulations += more.simulations;
        outcome.failed += more.failed;
        outcome.simulated.extend(more.simulated);
    }
    outcome.sort();
    Ok(outcome)
}
