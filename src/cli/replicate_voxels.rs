//! The search of `pliant replicate` where a region is cut into voxels.

use super::progress::SearchBar;
use super::stop;
use crate::design::goal::Goal;
use crate::design::misfit::Target;
use crate::design::search::{self, Outcome};
use crate::design::space::Space;
use crate::design::voxels::rules::Rules;
use crate::design::voxels::{self, Options};
use crate::fem::rig::Rig;
use miette::{IntoDiagnostic, miette};
use std::sync::atomic::Ordering;

/// Searches; `options` are those of the search in layers, of which seed and most materials hold here too.
///
/// # Errors
/// An option that is for layers alone, memory.
pub fn search(
    goal: &Goal,
    rig: &Rig,
    target: &Target,
    rules: &Rules,
    options: &search::Options,
    tolerance: f64,
    bar: &SearchBar,
) -> miette::Result<Outcome> {
    let cells = goal.setup.cells.count();
    if options.exhaustive {
        return Err(miette!(
            "{}: the layouts of {cells} voxels cannot be enumerated: leave out --exhaustive",
            goal.file().display()
        ));
    }
    let space = Space {
        most_materials: goal.most_materials,
        ..Space::free(cells, goal.palette.len())
    };
    let own = Options {
        seed: options.seed,
        tolerance,
        ..Options::default()
    };
    let flag = stop::flag();
    let watch = |progress: &search::Progress, done: usize| bar.show(progress, done);
    let cancelled = || flag.load(Ordering::Relaxed);
    let found = voxels::search(rig, target, &space, rules, &own, &watch, &cancelled).into_diagnostic()?;
    Ok(found.outcome)
}
