//! `pliant replicate`: from a goal to the layout, the report and the files for the printer.

use super::Answer;
use super::replicate_outcome::{Work, bound_words};
use super::replicate_rules as rules;
use super::replicate_shape::Shaping;
use super::replicate_voxels;
use super::searching::{Searched, Setting, Team};
use super::terminal::{say, warn};
use crate::design::goal::Goal;
use crate::design::misfit::Target;
use crate::design::search::{self, Aim, Method};
use crate::fem::equilibrium;
use crate::fem::rig::Rig;
use crate::material::database::Database;
use miette::{IntoDiagnostic, miette};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Finds the layout of base materials inside an object that gives like the examples of its goal.
///
/// Reads DESIGN/goal.toml, searches, and writes DESIGN/found/layout.toml, DESIGN/found/report.html and the printer's files
/// in export/NAME. Ctrl-C ends the search with the best layout so far.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder of the design (it holds goal.toml), or the goal file itself
    #[arg(value_name = "DESIGN")]
    design: PathBuf,
    /// Folder of the material database
    #[arg(long, value_name = "DIR", default_value = "materials-db")]
    db: PathBuf,
    /// Where the printer's files go [default: export/NAME]
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// Where the layout and the report go [default: DESIGN/found]
    #[arg(long, value_name = "DIR")]
    found: Option<PathBuf>,
    /// Where the report's pictures and curves go as separate .svg files [default: none are written]
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// How to search: "anytime" learns from what it simulated and bounds the rest, "paper" walks the thesis' tree,
    /// "exhaustive" simulates every layout
    #[arg(long, value_name = "METHOD", value_enum, default_value_t = Way::Anytime)]
    method: Way,
    /// At most how many layouts the anytime search simulates; more make the bound tighter
    #[arg(long, value_name = "N", default_value_t = 2000)]
    simulations: usize,
    /// Ends the search after this many seconds with the best layout so far [default: no limit]
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// How many clusters of alike designs each level of the thesis' tree keeps
    #[arg(long, value_name = "K", default_value_t = 20)]
    clusters: usize,
    /// How many of the best layouts are improved by exchanging one cell at a time [default: 3; none with --method paper]
    #[arg(long, value_name = "N")]
    polish: Option<usize>,
    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Accuracy of each simulation in the search, as a share of load and displacement; the best layouts, as far as that may
    /// have swapped them, are simulated again at 1e-8 [default: 1e-5; 1e-3 with --method exhaustive]
    #[arg(long, value_name = "T")]
    tolerance: Option<f64>,
    /// Threads [default: all cores]; the answer does not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Where every simulated layout is kept, so that a search that was ended goes on where it was [default:
    /// DESIGN/found/simulated.redb]
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
    /// Keep no simulated layouts
    #[arg(long)]
    no_journal: bool,
    /// Move the borders between layers of the best layouts until the error is least
    #[arg(long)]
    thickness: bool,
    /// Rank layouts by the error that is not exceeded with this probability, given how well their materials are known
    #[arg(long, value_name = "Q", num_args = 0..=1, require_equals = true, default_missing_value = "0.9")]
    robust: Option<f64>,
    /// Show which layouts no other beats in both error and mass, and error and cost where the goal names prices
    #[arg(long)]
    pareto: bool,
    /// Write no printer's files
    #[arg(long)]
    no_export: bool,
    /// Answer in JSON, for machines
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// The accuracy asked for, or the one that serves the method.
    fn tolerance(&self) -> f64 {
        self.tolerance.unwrap_or(match self.method {
            Way::Exhaustive => 1e-3,
            Way::Anytime | Way::Paper => 1e-5,
        })
    }

    /// Where the printer's files go; `None` if none are wanted.
    fn export(&self, goal: &Goal) -> Option<PathBuf> {
        let own = || Path::new("export").join(super::export::name_of(goal));
        (!self.no_export).then(|| self.export.clone().unwrap_or_else(own))
    }
}

/// The ways to search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Way {
    Anytime,
    Paper,
    Exhaustive,
}

impl Way {
    fn method(self) -> Method {
        match self {
            Way::Anytime => Method::Anytime,
            Way::Paper => Method::Paper,
            Way::Exhaustive => Method::Exhaustive,
        }
    }
}

/// Runs `pliant replicate`.
///
/// # Errors
/// A goal, a material or an object that is wrong; files that cannot be written.
pub fn run(arguments: &Arguments) -> miette::Result<Answer> {
    let team = Team::join();
    match replicate(arguments, &team) {
        // The leader meets the same mistake and reports it. A process that ends with a failure code before that would have
        // `mpirun` kill it.
        Err(_) if !team.leads() => Ok(Answer::Done),
        answer => answer,
    }
}

fn replicate(arguments: &Arguments, team: &Team) -> miette::Result<Answer> {
    let began = Instant::now();
    let solver = checked(arguments)?;
    use_threads(arguments.threads)?;
    let database = Database::open(&arguments.db).into_diagnostic()?;
    let mut goal = Goal::read(&arguments.design, &database).into_diagnostic()?;
    if goal.voxels.is_some() {
        let plain = arguments.method == Way::Anytime && !arguments.thickness;
        replicate_voxels::check(&goal, plain)?;
    }
    let shaping = Shaping::asked(arguments.robust, arguments.thickness, arguments.seed, &goal)?;
    introduce(&goal, arguments.json || !team.leads());
    let laws = goal.palette.iter().map(|m| m.law.clone()).collect();
    let mut rig = Rig::new(&goal.setup, laws).into_diagnostic()?;
    let target = Target::new(&goal.setup.examples);
    let space = goal.space(&rig).into_diagnostic()?;
    let aim = Aim {
        space: &space,
        target: &target,
        cost_weight_mm: goal.rules.cost_weight_mm,
    };
    let options = search_options(arguments, &target);
    let found = arguments
        .found
        .clone()
        .unwrap_or_else(|| goal.folder().join("found"));
    let setting = setting(arguments, &found, solver, began);
    if !team.leads() {
        match &goal.voxels {
            Some(rules) => team.serve_mixtures(&rig, rules, &setting),
            None => team.serve(&rig, &setting),
        }
        return Ok(Answer::Done);
    }
    let reach = rules::judge(&goal, &rig, &space, arguments.json);
    let all = search::Options {
        listed: shaping.candidates().max(options.listed),
        ..options
    };
    let searching = search_with(arguments, team, &goal, &rig, &aim, &all, &setting)?;
    let mut outcome = searching.outcome.clone();
    // Of the layers as drawn and the materials as fitted, which the steps below leave.
    let bound = bound_words(&outcome, goal.voxels.is_some());
    let fronts = match arguments.pareto {
        true => rules::fronts(&goal, &rig, &aim, &outcome),
        false => Vec::new(),
    };
    // Runners-up of thousands of cells would fill the layout's file.
    let listed = if goal.voxels.is_some() { 1 } else { options.listed };
    let shape = shaping.shape(&mut goal, &mut rig, &aim, &mut outcome, listed)?;
    let export = arguments.export(&goal);
    let work = Work {
        goal: &goal,
        rig: &rig,
        target: &target,
        options: &options,
        tolerance: arguments.tolerance(),
        outcome: &outcome,
        searching: &searching,
        bound: &bound,
        shape: &shape,
        reach: &reach,
        fronts: &fronts,
        found: &found,
        export: export.as_deref(),
        pictures: arguments.pictures.as_deref(),
        json: arguments.json,
        began,
    };
    work.write_and_tell()?;
    Ok(Answer::Done)
}

/// The search for layers, or for voxels.
fn search_with(
    arguments: &Arguments,
    team: &Team,
    goal: &Goal,
    rig: &Rig,
    aim: &Aim,
    options: &search::Options,
    setting: &Setting,
) -> miette::Result<Searched> {
    let Some(rules) = &goal.voxels else {
        return team.search(rig, aim, options, setting);
    };
    let task = replicate_voxels::Task {
        goal,
        rig,
        aim,
        rules,
        pareto: arguments.pareto,
    };
    replicate_voxels::search(team, &task, options, arguments.tolerance(), setting)
}

/// The solver's options, once all options are such as can be.
fn checked(arguments: &Arguments) -> miette::Result<equilibrium::Options> {
    let solver = equilibrium::Options::for_search(arguments.tolerance());
    solver.check().into_diagnostic()?;
    match arguments.seconds.filter(|s| !(*s > 0.0 && *s < 1e9)) {
        Some(seconds) => Err(miette!("--seconds is {seconds}: expected a time above zero")),
        None => Ok(solver),
    }
}

fn setting(arguments: &Arguments, found: &Path, solver: equilibrium::Options, began: Instant) -> Setting {
    let own = || found.join("simulated.redb");
    Setting {
        solver,
        until: arguments.seconds.map(|s| began + Duration::from_secs_f64(s)),
        journal: (!arguments.no_journal).then(|| arguments.journal.clone().unwrap_or_else(own)),
        quiet: arguments.json,
    }
}

/// The share of the largest target displacement below which an error is nothing to look further for.
const GOOD_ENOUGH: f64 = 2e-5;

fn search_options(arguments: &Arguments, target: &Target) -> search::Options {
    let method = arguments.method.method();
    let polished = if method == Method::Paper { 0 } else { 3 };
    search::Options {
        method,
        clusters: arguments.clusters,
        seed: arguments.seed,
        polished: arguments.polish.unwrap_or(polished),
        most_simulations: arguments.simulations,
        good_enough_mm: GOOD_ENOUGH * target.largest_mm(),
        ..search::Options::default()
    }
}

fn use_threads(threads: Option<usize>) -> miette::Result<()> {
    let Some(threads) = threads else { return Ok(()) };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .into_diagnostic()
}

fn introduce(goal: &Goal, quiet: bool) {
    for warning in &goal.setup.object.warnings {
        warn(&format!("warning: {warning}"));
    }
    if quiet {
        return;
    }
    let (low, high) = goal.setup.object.solid.bounds();
    let size = high - low;
    let (cells, materials) = (goal.setup.cells.count(), goal.palette.len());
    let layouts = (materials as f64).powi(cells as i32);
    let shown = if layouts < 1e7 {
        format!("{layouts}")
    } else {
        format!("{layouts:.1e}")
    };
    say(&format!(
        "{}: {:.1} × {:.1} × {:.1} mm, {cells} cells, {materials} base materials: {shown} possible layouts",
        goal.name, size.x, size.y, size.z
    ));
}
