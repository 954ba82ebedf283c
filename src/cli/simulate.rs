//! `pliant simulate`: an object with its materials in place, pressed and moved as a scene says, or a layout that was
//! found, pressed as its goal's examples say.

use super::terminal::{say, warn};
use super::{Answer, simulate_volume, stop};
use crate::design::found::{Found, sha256};
use crate::design::goal::Goal;
use crate::design::misfit::{Misfit, Target};
use crate::fem::equilibrium::{self, Options};
use crate::fem::example::Example;
use crate::fem::scene::Scene;
use crate::fem::scene_record::{CaseRecord, write_case_csv, write_case_vtu};
use crate::fem::setup::Setup;
use crate::fem::stage::{CaseKind, CaseOutcome, Stage};
use crate::fem::volume_scene::text::VolumeSceneText;
use crate::material::database::Database;
use crate::units::document::Document;
use crate::units::whole_file::replace_file;
use miette::{IntoDiagnostic, WrapErr};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Simulates an object with its materials in place: how it gives when pressed or moved.
///
/// A scene (SCENE.toml) names the object, what holds it, its materials, and the presses and moves; every one of them
/// is simulated by itself, from rest. A found layout (found/layout.toml of a design) is pressed as its goal's examples
/// say, and its error is compared with the recorded one.
///
/// For every case it writes NAME.vtu (for ParaView) and, for a press, NAME.csv (which a goal can cite as an example); and
/// simulated.json with everything else. Exit code 1 if a case does not reach its full load.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The scene, or the layout.toml of a found design
    #[arg(value_name = "SCENE.toml")]
    pub(super) scene: PathBuf,
    /// Where the files go [default: simulated/ beside the scene]
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Folder of the material database
    #[arg(long, value_name = "DIR", default_value = "materials-db")]
    pub(super) db: PathBuf,
    /// Threads [default: all cores]; the answer does not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Answer in JSON, for machines
    #[arg(long)]
    pub(super) json: bool,
}

/// Runs `pliant simulate`.
///
/// # Errors
/// A scene, a material or an object that is wrong; files that cannot be written.
pub fn run(arguments: &Arguments) -> miette::Result<Answer> {
    if let Some(threads) = arguments.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .into_diagnostic()?;
    }
    if is_layout(&arguments.scene) {
        return layout(arguments);
    }
    // A file that cannot be read is answered by the reader of scenes.
    let text = std::fs::read_to_string(&arguments.scene).unwrap_or_default();
    let document = Document {
        file: arguments.scene.clone(),
        text,
    };
    if VolumeSceneText::fits(&document) {
        simulate_volume::run(arguments, document)
    } else {
        scene(arguments)
    }
}

/// Is this the record of a search, rather than a scene?
fn is_layout(file: &Path) -> bool {
    let table = std::fs::read_to_string(file)
        .ok()
        .and_then(|text| text.parse::<toml::Table>().ok());
    table.is_some_and(|t| t.contains_key("goal") && (t.contains_key("cell") || t.contains_key("voxels")))
}

fn scene(arguments: &Arguments) -> miette::Result<Answer> {
    let began = Instant::now();
    let scene = Scene::read(&arguments.scene, &arguments.db).into_diagnostic()?;
    let mut warnings = scene.setup.object.warnings.clone();
    for material in scene.materials.iter().filter(|m| m.synthetic) {
        let id = &material.id;
        warnings.push(format!(
            "material {id:?} is synthetic: its numbers are estimated, not measured"
        ));
    }
    let stage = Stage::of_scene(&scene).into_diagnostic()?;
    introduce(arguments, &scene.name, &scene.setup, &stage);
    let ids = scene.materials.iter().map(|m| m.id.clone()).collect();
    let shown = Shown {
        name: &scene.name,
        setup: &scene.setup,
        materials: ids,
        stage,
        options: scene.options,
        steps: scene.steps,
        warnings,
    };
    let outcomes = shown.simulate()?;
    let mut answer = shown.write(arguments, &outcomes)?;
    answer.seconds = began.elapsed().as_secs_f64();
    shown.tell(arguments, &answer, None)
}

fn layout(arguments: &Arguments) -> miette::Result<Answer> {
    let began = Instant::now();
    let found = Found::read(&arguments.scene).into_diagnostic()?;
    let database = Database::open(&arguments.db).into_diagnostic()?;
    let folder = arguments.scene.parent().unwrap_or(Path::new(""));
    let goal = Goal::read(&folder.join(&found.goal), &database).into_diagnostic()?;
    let (layout, recorded) = found.layout(&goal, &arguments.scene).into_diagnostic()?;
    let goal = found.on(goal, &arguments.scene).into_diagnostic()?;
    let laws = goal.palette.iter().map(|m| m.law.clone()).collect();
    let stage = Stage::of_examples(&goal.setup, laws, layout, &[]).into_diagnostic()?;
    introduce(arguments, &goal.name, &goal.setup, &stage);
    let shown = Shown {
        name: &goal.name,
        setup: &goal.setup,
        materials: goal.palette.iter().map(|m| m.record.id.clone()).collect(),
        stage,
        // As the search simulates what it reports; `found.search.tolerance` is that of the tree.
        options: Options::default(),
        steps: 1,
        warnings: goal.setup.object.warnings.clone(),
    };
    shown.options.check().into_diagnostic()?;
    let outcomes = shown.simulate()?;
    let target = Target::new(&goal.setup.examples);
    let displacements = displacements(&goal.setup.examples, &shown.stage, &outcomes);
    let misfit = match displacements {
        Some(displacements) => target.misfit(&displacements),
        None => Misfit::FAILED,
    };
    let again = Again { recorded, misfit };
    let mut answer = shown.write(arguments, &outcomes)?;
    answer.seconds = began.elapsed().as_secs_f64();
    shown.tell(arguments, &answer, Some(&again))
}

/// Displacement components in the order of [`Target`]; `None` if a level was not reached.
fn displacements(examples: &[Example], stage: &Stage, outcomes: &[CaseOutcome]) -> Option<Vec<f64>> {
    let mut all = Vec::new();
    for ((example, case), outcome) in examples.iter().zip(&stage.cases).zip(outcomes) {
        if outcome.levels.len() < example.forces_n.len() {
            return None;
        }
        for u in &outcome.levels {
            for (point, (_, sensor)) in example.points.iter().zip(&case.points) {
                let moved = sensor.read(u);
                all.extend(point.directions.iter().map(|d| moved.dot(d)));
            }
        }
    }
    Some(all)
}

/// The error of a found layout, as recorded and as simulated again.
struct Again {
    recorded: Misfit,
    misfit: Misfit,
}

impl Again {
    /// Equal but for the digits that a text file may drop.
    fn equal(&self) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs().max(1e-9);
        near(self.misfit.rms_mm, self.recorded.rms_mm) && near(self.misfit.max_mm, self.recorded.max_mm)
    }
}

/// What is simulated and what is said about it.
struct Shown<'a> {
    name: &'a str,
    setup: &'a Setup,
    materials: Vec<String>,
    stage: Stage,
    options: equilibrium::Options,
    steps: usize,
    warnings: Vec<String>,
}

/// What was simulated and written.
struct Written {
    folder: PathBuf,
    records: Vec<CaseRecord>,
    warnings: Vec<String>,
    seconds: f64,
}

fn introduce(arguments: &Arguments, name: &str, setup: &Setup, stage: &Stage) {
    if arguments.json {
        return;
    }
    let (low, high) = setup.object.solid.bounds();
    let size = high - low;
    say(&format!(
        "{name}: {:.1} × {:.1} × {:.1} mm, {} cells, {} elements, {} nodes; {} load cases",
        size.x,
        size.y,
        size.z,
        setup.cells.count(),
        stage.grid.mesh.elements.len(),
        stage.grid.mesh.nodes.len(),
        stage.cases.len()
    ));
}

impl Shown<'_> {
    fn simulate(&self) -> miette::Result<Vec<CaseOutcome>> {
        let flag = stop::flag();
        let cancelled = || flag.load(Ordering::Relaxed);
        self.stage
            .simulate(&self.options, self.steps, &cancelled)
            .into_diagnostic()
            .wrap_err_with(|| self.setup.document.file.display().to_string())
    }

    /// Writes the files of every case, each whole or not at all, `simulated.json` last.
    fn write(&self, arguments: &Arguments, outcomes: &[CaseOutcome]) -> miette::Result<Written> {
        let folder = arguments.out.clone().unwrap_or_else(|| {
            let beside = arguments.scene.parent().unwrap_or(Path::new(""));
            beside.join("simulated")
        });
        let mut records = Vec::new();
        for (case, outcome) in self.stage.cases.iter().zip(outcomes) {
            let name = file_name(&case.name);
            let mut bytes = Vec::new();
            write_case_vtu(&mut bytes, &self.stage, case, outcome).into_diagnostic()?;
            keep(&folder.join(format!("{name}.vtu")), &bytes)?;
            if let CaseKind::Press { forces_n, .. } = &case.kind {
                let mut bytes = Vec::new();
                write_case_csv(&mut bytes, case, forces_n, outcome).into_diagnostic()?;
                keep(&folder.join(format!("{name}.csv")), &bytes)?;
            }
            records.push(CaseRecord::new(&self.stage, case, outcome, &self.options));
        }
        let mut warnings = self.warnings.clone();
        warnings.extend(records.iter().flat_map(|r| r.warnings.iter().cloned()));
        let written = Written {
            folder,
            records,
            warnings,
            seconds: 0.0,
        };
        let record = format!("{:#}\n", self.record(&written));
        keep(&written.folder.join("simulated.json"), record.as_bytes())?;
        Ok(written)
    }

    /// `simulated.json`: what was simulated, how, and what came of it; no times, so that equal runs leave equal files.
    fn record(&self, written: &Written) -> serde_json::Value {
        let cells = &self.setup.cells;
        let material = |cell: usize| &self.materials[self.stage.layout[cell] as usize];
        json!({
            "schema": 1,
            "pliant": env!("CARGO_PKG_VERSION"),
            "name": self.name,
            "scene": self.setup.document.file,
            "scene_sha256": sha256(self.setup.document.text.as_bytes()),
            "element_size_mm": self.setup.element_size_mm,
            "elements": self.stage.grid.mesh.elements.len(),
            "nodes": self.stage.grid.mesh.nodes.len(),
            "tolerance": self.options.tolerance,
            "steps": self.steps,
            "materials": self.materials,
            "cells": (0..cells.count())
                .map(|c| json!({"name": cells.name(c), "material": material(c), "material_id": self.stage.layout[c]}))
                .collect::<Vec<_>>(),
            "cases": written.records,
            "warnings": written.warnings,
        })
    }

    fn tell(
        &self,
        arguments: &Arguments,
        written: &Written,
        again: Option<&Again>,
    ) -> miette::Result<Answer> {
        let complete = written.records.iter().all(|r| r.complete);
        let equal = again.is_none_or(Again::equal);
        for warning in &written.warnings {
            warn(&format!("warning: {warning}"));
        }
        if arguments.json {
            let mut answer = self.record(written);
            answer["folder"] = json!(written.folder);
            answer["seconds"] = json!(written.seconds);
            if let Some(again) = again {
                answer["error"] = json!({
                    "rms_mm": again.misfit.rms_mm,
                    "max_mm": again.misfit.max_mm,
                    "recorded_rms_mm": again.recorded.rms_mm,
                    "recorded_max_mm": again.recorded.max_mm,
                    "equals_recorded": again.equal(),
                });
            }
            say(&format!("{answer:#}"));
        } else {
            say(&table(&written.records));
            if let Some(again) = again {
                say(&compared(again));
            }
            say(&format!("files  {}", written.folder.display()));
        }
        Ok(if complete && equal {
            Answer::Done
        } else {
            Answer::Negative
        })
    }
}

/// A case's name as a file can bear it: a goal's examples may be named freely.
fn file_name(name: &str) -> String {
    let plain = |c: char| {
        if c.is_alphanumeric() || "-_".contains(c) {
            c
        } else {
            '-'
        }
    };
    name.chars().map(plain).collect()
}

pub(super) fn keep(file: &Path, bytes: &[u8]) -> miette::Result<()> {
    replace_file(file, bytes)
        .into_diagnostic()
        .wrap_err_with(|| format!("{}: cannot be written", file.display()))
}

fn compared(again: &Again) -> String {
    let (found, recorded) = (again.misfit, again.recorded);
    let verdict = if again.equal() {
        "equal to what the search recorded".to_string()
    } else {
        format!(
            "NOT what the search recorded, RMS {:.6} mm, largest {:.6} mm: another version of pliant or of the materials?",
            recorded.rms_mm, recorded.max_mm
        )
    };
    format!(
        "error against the target: RMS {:.6} mm, largest {:.6} mm: {verdict}",
        found.rms_mm, found.max_mm
    )
}

/// One line a case: what was reached, where it gives most, and what pushes back.
fn table(records: &[CaseRecord]) -> String {
    let width = records
        .iter()
        .map(|r| r.name.chars().count())
        .max()
        .unwrap_or(0)
        .max(4);
    let mut lines = vec![format!(
        "{:width$}  {:>20}  {:>12}  at (x, y, z) mm",
        "case", "load reached", "largest move"
    )];
    for record in records {
        let load = format!(
            "{:.3} of {:.3} {}",
            record.reached_load,
            record.full_load,
            record.unit()
        );
        let most = &record.largest_displacement;
        let [x, y, z] = most.place_mm;
        let mut line = format!(
            "{:width$}  {load:>20}  {:>9.3} mm  {:30}",
            record.name,
            most.size_mm,
            format!("({x:.1}, {y:.1}, {z:.1})")
        );
        if let (true, Some(reaction)) = (record.kind == "move", record.reactions.first())
            && let Some([x, y, z]) = reaction.forces_n.last()
        {
            // Adding zero turns −0 into 0.
            let [x, y, z] = [x, y, z].map(|f| (1e3 * f).round() / 1e3 + 0.0);
            line += &format!("  force ({x:.3}, {y:.3}, {z:.3}) N");
        }
        lines.push(line.trim_end().to_string());
    }
    lines.join("\n")
}
