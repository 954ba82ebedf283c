//! The search of `pliant replicate` with what surrounds it: progress, Ctrl-C, the journal, and other processes.

use super::progress::SearchBar;
use super::stop;
use super::terminal::warn;
use crate::design::journal::Journal;
#[cfg(feature = "mpi")]
use crate::design::processes::Processes;
use crate::design::search::{self, Aim, Bench, Outcome, Progress};
use crate::design::voxels::bench::{MixtureBench, OwnMixtures};
use crate::design::voxels::rules::VoxelRules;
use crate::design::workbench::Workbench;
use crate::fem::equilibrium;
use crate::fem::mixture::Mixtures;
use crate::fem::rig::Rig;
use miette::IntoDiagnostic;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// How to search, apart from what the method itself is told.
pub struct Setting {
    /// Each simulation of the search.
    pub solver: equilibrium::Options,
    /// When to end by itself.
    pub until: Option<Instant>,
    /// Where simulated layouts are kept; nowhere if `None`.
    pub journal: Option<PathBuf>,
    /// Show no progress.
    pub quiet: bool,
}

impl Setting {
    /// Is it time to end?
    pub fn cancelled(&self) -> impl Fn() -> bool + Sync + use<> {
        let (flag, until) = (stop::flag(), self.until);
        move || flag.load(Ordering::Relaxed) || until.is_some_and(|t| Instant::now() >= t)
    }
}

/// A search that has ended.
pub struct Searched {
    /// What it found, refined.
    pub outcome: Outcome,
    /// How long it took.
    pub time: Duration,
    /// Responses that the journal gave.
    pub from_journal: usize,
}

/// The processes that share this run; one alone without the feature `mpi`.
#[derive(Default)]
pub struct Team {
    #[cfg(feature = "mpi")]
    processes: Option<Processes>,
}

impl Team {
    /// Joins the processes that `mpirun` started.
    pub fn join() -> Team {
        Team {
            #[cfg(feature = "mpi")]
            processes: Processes::join(),
        }
    }

    /// Is this the process that searches, writes and speaks?
    pub fn leads(&self) -> bool {
        #[cfg(feature = "mpi")]
        if let Some(processes) = &self.processes {
            return processes.leads();
        }
        true
    }

    /// Simulates for the leader until it has finished.
    pub fn serve(&self, rig: &Rig, setting: &Setting) {
        #[cfg(feature = "mpi")]
        if let Some(processes) = &self.processes {
            let watch = |_: &Progress, _: usize| {};
            let own = benches(rig, setting, &watch).map(|bench| Box::new(bench) as Box<dyn Bench + '_>);
            processes.serve(own.into(), rig.components());
        }
        #[cfg(not(feature = "mpi"))]
        let _ = (rig, setting);
    }

    /// A bench of mixtures for `rules`, of all processes.
    pub fn mixtures<'a>(
        &'a self,
        rig: &'a Rig,
        rules: &'a VoxelRules,
        cancelled: &'a (dyn Fn() -> bool + Sync),
    ) -> Box<dyn MixtureBench + 'a> {
        let all = Mixtures::new(rig, rules.variable_of_cell.len());
        #[cfg(feature = "mpi")]
        if let Some(processes) = &self.processes {
            let own = OwnMixtures::new(all.only(processes.presses(rig)), rules, cancelled);
            return Box::new(processes.mixtures(Box::new(own), rig));
        }
        Box::new(OwnMixtures::new(all, rules, cancelled))
    }

    /// Simulates mixtures for the leader until it has finished.
    pub fn serve_mixtures(&self, rig: &Rig, rules: &VoxelRules, setting: &Setting) {
        #[cfg(feature = "mpi")]
        if let Some(processes) = &self.processes {
            let cancelled = setting.cancelled();
            let all = Mixtures::new(rig, rules.variable_of_cell.len());
            let mut own = OwnMixtures::new(all.only(processes.presses(rig)), rules, &cancelled);
            processes.serve_mixtures(&mut own);
        }
        #[cfg(not(feature = "mpi"))]
        let _ = (rig, rules, setting);
    }

    /// Searches, and simulates what is listed again at the default tolerance.
    ///
    /// # Errors
    /// Options that cannot be; a journal that cannot be used.
    pub fn search(
        &self,
        rig: &Rig,
        aim: &Aim,
        options: &search::Options,
        setting: &Setting,
    ) -> miette::Result<Searched> {
        let began = Instant::now();
        let bar = SearchBar::new(setting.quiet);
        let watch = |progress: &Progress, done: usize| bar.show(progress, done);
        let [coarse, fine] = benches(rig, setting, &watch);
        let mut coarse = self.bench(0, coarse, rig);
        let mut fine = self.bench(1, fine, rig);
        // Other processes wait for orders by now: if this fails, the end of the team is the end of their waiting.
        let journal = setting.journal.as_deref().map(Journal::open);
        let journal = journal.transpose().into_diagnostic()?;
        let (outcome, from_journal) = match &journal {
            None => (
                search_and_refine(aim, options, coarse.as_mut(), fine.as_mut())?,
                0,
            ),
            Some(journal) => {
                let mut coarse = journal.bench(rig, &setting.solver, coarse.as_mut());
                let mut fine = journal.bench(rig, &equilibrium::Options::default(), fine.as_mut());
                let outcome = search_and_refine(aim, options, &mut coarse, &mut fine)?;
                if let Some(error) = coarse.error.as_ref().or(fine.error.as_ref()) {
                    warn(&format!("warning: {error}; the search went on without it"));
                }
                (outcome, coarse.found)
            }
        };
        bar.finish();
        Ok(Searched {
            outcome,
            time: began.elapsed(),
            from_journal,
        })
    }

    fn bench<'a>(&'a self, number: usize, own: Workbench<'a>, rig: &Rig) -> Box<dyn Bench + 'a> {
        #[cfg(feature = "mpi")]
        if let Some(processes) = &self.processes {
            return Box::new(processes.bench(number, Box::new(own), rig.components()));
        }
        #[cfg(not(feature = "mpi"))]
        let _ = (number, rig);
        Box::new(own)
    }
}

/// The bench that searches and the one that refines.
fn benches<'a>(
    rig: &'a Rig,
    setting: &Setting,
    watch: &'a (dyn Fn(&Progress, usize) + Sync),
) -> [Workbench<'a>; 2] {
    let mut coarse = Workbench::new(rig, setting.solver, stop::flag(), watch);
    coarse.until = setting.until;
    [
        coarse,
        Workbench::new(rig, equilibrium::Options::default(), stop::flag(), watch),
    ]
}

fn search_and_refine(
    aim: &Aim,
    options: &search::Options,
    coarse: &mut dyn Bench,
    fine: &mut dyn Bench,
) -> miette::Result<Outcome> {
    let outcome = search::search(aim, options, coarse).into_diagnostic()?;
    Ok(outcome.refined(aim, fine))
}
