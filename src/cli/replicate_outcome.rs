//! What `pliant replicate` writes and says when a search has ended: the layout, the printer's files, the report.

use super::replicate_rules as rules;
use super::replicate_shape::Shape;
use super::searching::Searched;
use super::terminal::{say, warn};
use crate::design::found::{Found, sha256};
use crate::design::goal::Goal;
use crate::design::misfit::Target;
use crate::design::reach::Reach;
use crate::design::search::{self, Basis, Method, Outcome};
use crate::design::space::Space;
use crate::fabrication::export::ExportMeta;
use crate::fabrication::layout::{self, export_options, tile_layout};
use crate::fem::rig::Rig;
use crate::report::page::{Fact, ReplicatePage};
use crate::report::replicate::Replica;
use crate::report::table::layout_table;
use crate::report::ticks::{duration, significant};
use crate::units::whole_file::replace_file;
use miette::{IntoDiagnostic, miette};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A search that has ended, with all that its files and its words are made of.
pub(super) struct Work<'a> {
    pub goal: &'a Goal,
    pub rig: &'a Rig,
    pub target: &'a Target,
    pub options: &'a search::Options,
    /// Accuracy of each simulation in the search.
    pub tolerance: f64,
    pub outcome: &'a Outcome,
    pub searching: &'a Searched,
    /// What no layout can be better than, in words.
    pub bound: &'a str,
    pub shape: &'a Shape,
    pub reach: &'a Reach,
    pub fronts: &'a [rules::Front],
    /// Folder of the layout and the report.
    pub found: &'a Path,
    /// Folder of the printer's files; none are written if `None`.
    pub export: Option<&'a Path>,
    /// Folder of the report's pictures; none are written if `None`.
    pub pictures: Option<&'a Path>,
    /// Speak JSON.
    pub json: bool,
    pub began: Instant,
}

impl Work<'_> {
    /// Writes layout, printer's files and report, and says what was found.
    pub fn write_and_tell(&self) -> miette::Result<()> {
        let goal = self.goal;
        let record = Found::new(goal, self.target, self.outcome, self.options, self.tolerance);
        let mut record = record.ok_or_else(|| nothing_found(goal, self.outcome))?;
        self.shape.note(&mut record);
        record.pareto = rules::found_choices(goal, self.fronts);
        record.write(&self.layout_file()).into_diagnostic()?;
        let volumes_mm3 = self.fabricate(&record)?;
        let replica = Replica {
            goal,
            rig: self.rig,
            target: self.target,
            outcome: self.outcome,
            volumes_mm3: &volumes_mm3,
            modes: &self.shape.modes,
            notes: &self.shape.notes(),
        };
        // Moved borders change what a layout weighs.
        let weighed = goal.weighed(self.rig);
        let page = self.page(&replica, &weighed)?;
        replace_file(&self.report_file(), page.html().as_bytes()).into_diagnostic()?;
        if let Some(folder) = self.pictures {
            write_pictures(&page, folder, &super::export::name_of(goal))?;
        }
        match self.json {
            true => say(&format!("{:#}", self.answer(&weighed, &page.warnings))),
            false => self.tell(&replica, &page.warnings),
        }
        Ok(())
    }

    fn layout_file(&self) -> PathBuf {
        self.found.join("layout.toml")
    }

    fn report_file(&self) -> PathBuf {
        self.found.join("report.html")
    }

    /// Tiles the best layout and writes the printer's files; the volume of each material \[mm³\].
    fn fabricate(&self, record: &Found) -> miette::Result<Vec<(usize, f64)>> {
        let goal = self.goal;
        let best = &self.outcome.best[0];
        let tiling = tile_layout(goal, &best.layout, None, &export_options(goal))
            .map_err(|e| miette!("{}: {e}", goal.file().display()))?;
        let volumes_mm3 = tiling.parts.iter().map(|p| (p.label, p.volume_mm3)).collect();
        if let Some(folder) = self.export {
            let name = super::export::name_of(goal);
            let parts = layout::export_parts(goal, tiling);
            let meta = export_meta(goal, record);
            crate::fabrication::export::write_export(folder, &name, &parts, &meta).into_diagnostic()?;
        }
        Ok(volumes_mm3)
    }

    fn page(&self, replica: &Replica, weighed: &Space) -> miette::Result<ReplicatePage> {
        let goal = self.goal;
        let facts = [self.search_facts(), self.shape.facts(goal)];
        let mut page = replica.page(facts.concat(), provenance(goal)).into_diagnostic()?;
        page.warnings.extend(self.shape.warnings(goal));
        page.warnings
            .extend(rules::overweight(goal, weighed, &self.outcome.best[0].layout));
        page.sections = rules::sections(goal, self.reach, self.fronts);
        Ok(page)
    }

    fn search_facts(&self) -> Vec<Fact> {
        let (outcome, options) = (self.outcome, self.options);
        let are_voxels = self.goal.voxels.is_some();
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
        let mut facts = vec![
            Fact::new("method", method),
            Fact::new("ended", format!("{:?}", outcome.stop).to_lowercase()),
            Fact::new("bound", self.bound),
            Fact::new("seed", options.seed),
            Fact::new("simulated layouts", outcome.simulations),
            Fact::new("of these from the journal", self.searching.from_journal),
            Fact::new("without equilibrium", outcome.failed),
        ];
        if !are_voxels {
            facts.push(Fact::new("nodes culled", outcome.culled));
            facts.push(Fact::new("nodes merged", outcome.merged));
        }
        facts.push(Fact::new(
            "tolerance of a simulation",
            format!("{:e}", self.tolerance),
        ));
        facts.push(Fact::new(
            "search time",
            duration(self.searching.time.as_secs_f64()),
        ));
        facts
    }

    /// The answer for machines.
    fn answer(&self, weighed: &Space, warnings: &[String]) -> Value {
        let (goal, outcome) = (self.goal, self.outcome);
        let best = &outcome.best[0];
        // Thousands of voxels stand in the layout's file.
        let cells = best.layout.iter().enumerate().filter(|_| goal.voxels.is_none());
        let mut answer = json!({
            "rms_mm": best.misfit.rms_mm,
            "max_mm": best.misfit.max_mm,
            "largest_target_mm": self.target.largest_mm(),
            "best_single_material_rms_mm": outcome.best_uniform.as_ref().map(|u| u.misfit.rms_mm),
            "cells": cells.map(|(c, &m)| json!({
                "cell": goal.setup.cells.name(c),
                "material": goal.palette[m as usize].record.id,
            })).collect::<Vec<_>>(),
            "ended": outcome.stop,
            "simulations": outcome.simulations,
            "from_journal": self.searching.from_journal,
            "failed": outcome.failed,
            "culled": outcome.culled,
            "bound_mm": outcome.bound.score_mm,
            "gap_mm": outcome.gap_mm(),
            "bound_rests_on": outcome.bound.basis,
            "search_s": self.searching.time.as_secs_f64(),
            "whole_s": self.began.elapsed().as_secs_f64(),
            "layout": self.layout_file(),
            "report": self.report_file(),
            "export": self.export,
            "mass_g": weighed.mass_g(&best.layout),
            "cost": goal.rules.currency.as_ref().map(|_| weighed.cost(&best.layout)),
            "currency": goal.rules.currency,
            "out_of_reach": rules::reach_json(self.reach, goal),
            "pareto": rules::found_choices(goal, self.fronts),
            "warnings": warnings,
        });
        self.shape.put(&mut answer);
        answer
    }

    /// Says what was found.
    fn tell(&self, replica: &Replica, warnings: &[String]) {
        let outcome = self.outcome;
        let mut rows = replica.rows();
        let kept = rows.len().min(5);
        let last = rows.split_off(
            rows.len()
                .saturating_sub(usize::from(outcome.best_uniform.is_some())),
        );
        rows.truncate(kept);
        rows.extend(last);
        say(&layout_table(&rows));
        say(&replica.summary(&outcome.best[0]));
        if self.options.method == Method::Paper {
            say("the thesis' culling is not conservative: a better layout may have been passed by");
        }
        say(self.bound);
        for fact in self.shape.facts(self.goal) {
            say(&format!("{}: {}", fact.name, fact.value));
        }
        rules::tell_fronts(self.goal, self.fronts);
        for warning in warnings {
            warn(&format!("warning: {warning}"));
        }
        let culled = match self.goal.voxels {
            Some(_) => String::new(),
            None => format!(", {} nodes culled", outcome.culled),
        };
        say(&format!(
            "{} layouts simulated ({} of them before), {} without equilibrium{culled}; search {}, in all {}",
            outcome.simulations,
            self.searching.from_journal,
            outcome.failed,
            duration(self.searching.time.as_secs_f64()),
            duration(self.began.elapsed().as_secs_f64())
        ));
        say(&format!("layout  {}", self.layout_file().display()));
        say(&format!("report  {}", self.report_file().display()));
        if let Some(export) = self.export {
            say(&format!("export  {}", export.display()));
        }
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

/// What no layout can be better than, in words.
pub(super) fn bound_words(outcome: &Outcome, are_voxels: bool) -> String {
    let bound = &outcome.bound;
    match bound.basis {
        Basis::Enumerated => format!("best possible: {}", bound.basis),
        Basis::Nothing if are_voxels => {
            "no bound: the mixtures that were tried are no better than the layout".into()
        }
        Basis::Nothing => "no bound: a material alone has no equilibrium under the loads".into(),
        Basis::Relaxed => format!(
            "mixtures of the materials come to {} mm, a gap of {} mm; this is {}",
            significant(bound.score_mm, 3),
            significant(outcome.gap_mm(), 3),
            bound.basis
        ),
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
