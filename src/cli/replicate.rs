//! `pliant replicate`: from a goal to the layout, the report and the files for the printer.

use super::Answer;
use super::replicate_rules as rules;
use super::replicate_shape::{Shape, Shaping};
use super::replicate_voxels;
use super::searching::{Searched, Setting, Team};
use super::terminal::{say, warn};
use crate::design::found::{Found, sha256};
use crate::design::goal::Goal;
use crate::design::misfit::Target;
use crate::design::reach::Reach;
use crate::design::search::{self, Aim, Basis, Method, Outcome};
use crate::design::space::Space;
use crate::fabrication::export::ExportMeta;
use crate::fabrication::layout::{self, export_options, tile_layout};
use crate::fem::equilibrium;
use crate::fem::rig::Rig;
use crate::material::database::Database;
use crate::report::page::{Fact, ReplicatePage};
use crate::report::replicate::Replica;
use crate::report::table::layout_table;
use crate::report::ticks::{duration, significant};
use crate::units::whole_file::replace_file;
use miette::{IntoDiagnostic, miette};
use serde_json::json;
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
    /// Accuracy of each simulation in the search, as a share of load and displacement; the layouts that are reported are
    /// simulated again at 1e-8
    #[arg(long, value_name = "T", default_value_t = 1e-5)]
    tolerance: f64,
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
        // The leader meets the same mistake and reports it.
        Err(_) if !team.leads() => Ok(Answer::Failed),
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
        let plain = arguments.method == Way::Anytime && arguments.robust.is_none() && !arguments.thickness;
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
        // Voxels are searched by one process, whose threads share the examples.
        if goal.voxels.is_none() {
            team.serve(&rig, &setting);
        }
        return Ok(Answer::Done);
    }
    let reach = rules::judge(&goal, &rig, &space, arguments.json);
    let all = search::Options {
        listed: shaping.candidates().max(options.listed),
        ..options
    };
    let searching = match &goal.voxels {
        Some(rules) => {
            replicate_voxels::search(&goal, &rig, &aim, rules, &all, arguments.tolerance, &setting)?
        }
        None => team.search(&rig, &aim, &all, &setting)?,
    };
    let mut outcome = searching.outcome.clone();
    // Of the layers as drawn and the materials as fitted, which the steps below leave.
    let bound = match goal.voxels {
        Some(_) => "no bound is known for layouts of voxels".to_string(),
        None => bound_words(&outcome),
    };
    let fronts = match arguments.pareto {
        true => rules::fronts(&goal, &rig, &aim, &outcome),
        false => Vec::new(),
    };
    let shape = shaping.shape(&mut goal, &mut rig, &aim, &mut outcome, options.listed)?;
    let work = Work {
        arguments,
        goal: &goal,
        rig: &rig,
        target: &target,
        options: &options,
        outcome: &outcome,
        searching: &searching,
        bound: &bound,
        shape: &shape,
        reach: &reach,
        fronts: &fronts,
        found: &found,
        began,
    };
    work.write_and_tell()?;
    Ok(Answer::Done)
}

/// The solver's options, once all options are such as can be.
fn checked(arguments: &Arguments) -> miette::Result<equilibrium::Options> {
    let solver = equilibrium::Options::for_search(arguments.tolerance);
    solver.check().into_diagnostic()?;
    match arguments.seconds.filter(|s| !(*s > 0.0 && *s < 1e9)) {
        Some(seconds) => Err(miette!("--seconds is {seconds}: expected a time above zero")),
        None => Ok(solver),
    }
}

/// A search that has ended, with all that its files and its words are made of.
struct Work<'a> {
    arguments: &'a Arguments,
    goal: &'a Goal,
    rig: &'a Rig,
    target: &'a Target,
    options: &'a search::Options,
    outcome: &'a Outcome,
    searching: &'a Searched,
    bound: &'a str,
    shape: &'a Shape,
    reach: &'a Reach,
    fronts: &'a [rules::Front],
    found: &'a Path,
    began: Instant,
}

impl Work<'_> {
    /// Writes layout, printer's files and report, and says what was found.
    fn write_and_tell(&self) -> miette::Result<()> {
        let (arguments, goal) = (self.arguments, self.goal);
        let record = Found::new(goal, self.target, self.outcome, self.options, arguments.tolerance);
        let mut record = record.ok_or_else(|| nothing_found(goal, self.outcome))?;
        self.shape.note(&mut record);
        record.pareto = rules::found_choices(goal, self.fronts);
        record.write(&self.found.join("layout.toml")).into_diagnostic()?;
        let fabricated = fabricate(arguments, goal, self.outcome, &record)?;
        let replica = Replica {
            goal,
            rig: self.rig,
            target: self.target,
            outcome: self.outcome,
            volumes_mm3: &fabricated.volumes_mm3,
            modes: &self.shape.modes,
            notes: &self.shape.notes(),
        };
        // Moved borders change what a layout weighs.
        let weighed = goal.weighed(self.rig);
        let page = self.page(&replica, &weighed)?;
        let report = self.found.join("report.html");
        replace_file(&report, page.html().as_bytes()).into_diagnostic()?;
        if let Some(folder) = &arguments.pictures {
            write_pictures(&page, folder, &super::export::name_of(goal))?;
        }
        let files = Files {
            found: self.found,
            export: fabricated.folder.as_deref(),
            whole: self.began.elapsed(),
            searched: self.searching.time,
            from_journal: self.searching.from_journal,
            bound: self.bound,
            space: &weighed,
            reach: self.reach,
            fronts: self.fronts,
        };
        tell(
            arguments,
            &replica,
            self.outcome,
            &page.warnings,
            self.shape,
            &files,
        );
        Ok(())
    }

    fn page(&self, replica: &Replica, weighed: &Space) -> miette::Result<ReplicatePage> {
        let goal = self.goal;
        let facts = [
            search_facts(
                self.outcome,
                self.options,
                self.arguments,
                self.searching,
                self.bound,
                goal.voxels.is_some(),
            ),
            self.shape.facts(goal),
        ];
        let mut page = replica.page(facts.concat(), provenance(goal)).into_diagnostic()?;
        page.warnings.extend(self.shape.warnings(goal));
        page.warnings
            .extend(rules::overweight(goal, weighed, &self.outcome.best[0].layout));
        page.sections = rules::sections(goal, self.reach, self.fronts);
        Ok(page)
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

fn nothing_found(goal: &Goal, outcome: &Outcome) -> miette::Report {
    let file = goal.file().display();
    let count = outcome.simulations;
    if outcome.stop == search::Stop::Interrupted {
        return miette!(
            "{file}: stopped after {count} simulated layouts, none of which is in equilibrium under all loads; give it more time"
        );
    }
    miette!(
        "{file}: none of {count} simulated layouts is in equilibrium under all loads; lower the forces, or add stiffer materials to the palette"
    )
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

/// What no layout can be better than, in words.
fn bound_words(outcome: &Outcome) -> String {
    let bound = &outcome.bound;
    match bound.basis {
        Basis::Enumerated => format!("best possible: {}", bound.basis),
        Basis::Nothing => "no bound: a material alone has no equilibrium under the loads".into(),
        _ => format!(
            "no layout can be better than {} mm, a gap of {} mm; this {}",
            significant(bound.score_mm, 3),
            significant(outcome.gap_mm(), 3),
            match bound.basis {
                Basis::Broken { .. } | Basis::Learned { .. } => format!("is {}", bound.basis),
                _ => bound.basis.to_string(),
            }
        ),
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

struct Fabricated {
    folder: Option<PathBuf>,
    volumes_mm3: Vec<(usize, f64)>,
}

/// Tiles the best layout and writes the printer's files.
fn fabricate(
    arguments: &Arguments,
    goal: &Goal,
    outcome: &Outcome,
    record: &Found,
) -> miette::Result<Fabricated> {
    let best = &outcome.best[0];
    let tiling = tile_layout(goal, &best.layout, None, &export_options(goal))
        .map_err(|e| miette!("{}: {e}", goal.file().display()))?;
    let volumes_mm3 = tiling.parts.iter().map(|p| (p.label, p.volume_mm3)).collect();
    if arguments.no_export {
        return Ok(Fabricated {
            folder: None,
            volumes_mm3,
        });
    }
    let name = super::export::name_of(goal);
    let folder = arguments
        .export
        .clone()
        .unwrap_or_else(|| Path::new("export").join(&name));
    let parts = layout::export_parts(goal, tiling);
    let meta = export_meta(goal, record);
    crate::fabrication::export::write_export(&folder, &name, &parts, &meta).into_diagnostic()?;
    Ok(Fabricated {
        folder: Some(folder),
        volumes_mm3,
    })
}

/// What the manifest says of the layout's origin.
pub fn export_meta(goal: &Goal, record: &Found) -> ExportMeta {
    let origin = [
        ("goal".to_string(), goal.file().display().to_string()),
        ("goal_sha256".to_string(), record.goal_sha256.clone()),
        ("rms_error_mm".to_string(), format!("{}", record.error.rms_mm)),
    ];
    ExportMeta {
        title: Some(goal.name.clone()),
        description: None,
        origin: origin.into_iter().collect(),
    }
}

fn search_facts(
    outcome: &Outcome,
    options: &search::Options,
    arguments: &Arguments,
    searching: &Searched,
    bound: &str,
    are_voxels: bool,
) -> Vec<Fact> {
    let method = match options.method {
        _ if are_voxels => "relaxed to mixtures, rounded, materials exchanged".to_string(),
        Method::Exhaustive => "every layout simulated".to_string(),
        Method::Paper => format!(
            "thesis' decision tree, K = {} clusters a level, {} best layouts polished; its culling is not conservative",
            options.clusters, options.polished
        ),
        Method::Anytime => format!(
            "learning, {} best layouts polished, then a best-first tree",
            options.polished
        ),
    };
    vec![
        Fact::new("method", method),
        Fact::new("ended", format!("{:?}", outcome.stop).to_lowercase()),
        Fact::new("bound", bound),
        Fact::new("seed", options.seed),
        Fact::new("simulated layouts", outcome.simulations),
        Fact::new("of these from the journal", searching.from_journal),
        Fact::new("without equilibrium", outcome.failed),
        Fact::new("nodes culled", outcome.culled),
        Fact::new("nodes merged", outcome.merged),
        Fact::new("tolerance of a simulation", format!("{:e}", arguments.tolerance)),
        Fact::new("search time", duration(searching.time.as_secs_f64())),
    ]
}

fn provenance(goal: &Goal) -> Vec<Fact> {
    vec![
        Fact::new("pliant", env!("CARGO_PKG_VERSION")),
        Fact::new("goal", goal.file().display()),
        Fact::new("goal SHA-256", sha256(goal.setup.document.text.as_bytes())),
    ]
}

/// Writes every figure of the page to `folder/NAME-FIGURE.svg`.
fn write_pictures(page: &ReplicatePage, folder: &Path, name: &str) -> miette::Result<()> {
    let more = page.sections.iter().flat_map(|section| &section.figures);
    for figure in page.pictures.iter().chain(&page.plots).chain(more) {
        let file = folder.join(format!("{name}-{}.svg", super::export::plain(&figure.name)));
        replace_file(&file, figure.drawing.as_str().as_bytes())
            .map_err(|e| miette!("{}: cannot be written: {e}", file.display()))?;
    }
    Ok(())
}

struct Files<'a> {
    found: &'a Path,
    export: Option<&'a Path>,
    whole: Duration,
    searched: Duration,
    from_journal: usize,
    bound: &'a str,
    space: &'a Space,
    reach: &'a Reach,
    fronts: &'a [rules::Front],
}

fn tell(
    arguments: &Arguments,
    replica: &Replica,
    outcome: &Outcome,
    warnings: &[String],
    shape: &Shape,
    files: &Files,
) {
    let best = &outcome.best[0];
    let layout = files.found.join("layout.toml");
    if arguments.json {
        let mut answer = json!({
            "rms_mm": best.misfit.rms_mm,
            "max_mm": best.misfit.max_mm,
            "largest_target_mm": replica.target.largest_mm(),
            "best_single_material_rms_mm": outcome.best_uniform.as_ref().map(|u| u.misfit.rms_mm),
            // Thousands of voxels stand in the layout's file.
            "cells": best.layout.iter().enumerate().filter(|_| replica.goal.voxels.is_none()).map(|(c, &m)| json!({
                "cell": replica.goal.setup.cells.name(c),
                "material": replica.goal.palette[m as usize].record.id,
            })).collect::<Vec<_>>(),
            "ended": outcome.stop,
            "simulations": outcome.simulations,
            "from_journal": files.from_journal,
            "failed": outcome.failed,
            "culled": outcome.culled,
            "bound_mm": outcome.bound.score_mm,
            "gap_mm": outcome.gap_mm(),
            "bound_rests_on": outcome.bound.basis,
            "search_s": files.searched.as_secs_f64(),
            "whole_s": files.whole.as_secs_f64(),
            "layout": layout,
            "report": files.found.join("report.html"),
            "export": files.export,
            "mass_g": files.space.mass_g(&best.layout),
            "cost": replica.goal.rules.currency.as_ref().map(|_| files.space.cost(&best.layout)),
            "currency": replica.goal.rules.currency,
            "out_of_reach": rules::reach_json(files.reach, replica.goal),
            "pareto": rules::found_choices(replica.goal, files.fronts),
            "warnings": warnings,
        });
        shape.put(&mut answer);
        say(&format!("{answer:#}"));
        return;
    }
    let mut rows = replica.rows();
    let kept = rows.len().min(5);
    let last = rows.split_off(
        rows.len()
            .saturating_sub(usize::from(outcome.best_uniform.is_some())),
    );
    rows.truncate(kept);
    rows.extend(last);
    say(&layout_table(&rows));
    say(&replica.summary(best));
    if arguments.method == Way::Paper {
        say("the thesis' culling is not conservative: a better layout may have been passed by");
    }
    say(files.bound);
    for fact in shape.facts(replica.goal) {
        say(&format!("{}: {}", fact.name, fact.value));
    }
    rules::tell_fronts(replica.goal, files.fronts);
    for warning in warnings {
        warn(&format!("warning: {warning}"));
    }
    say(&format!(
        "{} layouts simulated ({} of them before), {} without equilibrium, {} nodes culled; search {}, in all {}",
        outcome.simulations,
        files.from_journal,
        outcome.failed,
        outcome.culled,
        duration(files.searched.as_secs_f64()),
        duration(files.whole.as_secs_f64())
    ));
    say(&format!("layout  {}", layout.display()));
    say(&format!("report  {}", files.found.join("report.html").display()));
    if let Some(export) = files.export {
        say(&format!("export  {}", export.display()));
    }
}
