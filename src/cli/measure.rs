//! `pliant measure`: presses a fine structure in the virtual laboratory and writes its measurement set.

use super::terminal::{say, warn};
use super::{Answer, stop};
use crate::fem::equilibrium::Options;
use crate::fem::measurement_set::MeasurementSet;
use crate::fem::measurement_set::write::write_set;
use crate::laboratory::aside::Aside;
use crate::laboratory::compare::{LevelError, compare};
use crate::laboratory::measure::{Press, Wired};
use crate::laboratory::read::Laboratory;
use crate::laboratory::set::measurement_set;
use crate::material::database::Database;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use miette::{IntoDiagnostic, WrapErr, miette};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Presses fine structures (tubes, lattices, voxel images) in the virtual laboratory and writes their measurement sets.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Laboratory files: structure, base material, probes, markers
    #[arg(required = true, value_name = "LABORATORY.toml")]
    laboratories: Vec<PathBuf>,
    /// Folder that the sets go to
    #[arg(long, value_name = "DIR", default_value = "materials-db/sets")]
    out: PathBuf,
    /// Folder of the material database
    #[arg(long, value_name = "DIR", default_value = "materials-db")]
    db: PathBuf,
    /// Presses side by side; each needs memory for its own matrix
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    jobs: u16,
    /// Also press a homogeneous block of this record and say how far it is off
    #[arg(long, value_name = "ID")]
    against: Option<String>,
    /// Answer in JSON, for machines
    #[arg(long)]
    json: bool,
}

/// Runs `pliant measure`.
///
/// # Errors
/// A laboratory that makes no sense, a set that cannot be written.
pub fn run(arguments: &Arguments) -> miette::Result<Answer> {
    let mut answer = Answer::Done;
    let mut values = Vec::new();
    for file in &arguments.laboratories {
        let (own, value) = one(arguments, file)?;
        if own == Answer::Negative {
            answer = Answer::Negative;
        }
        values.push(value);
        if stop::flag().load(Ordering::Relaxed) {
            break;
        }
    }
    if arguments.json {
        say(&serde_json::to_string_pretty(&values).into_diagnostic()?);
    }
    Ok(answer)
}

fn one(arguments: &Arguments, file: &Path) -> miette::Result<(Answer, Value)> {
    let began = Instant::now();
    let laboratory = Laboratory::open(file, &arguments.db).into_diagnostic()?;
    let against = against(arguments, &laboratory)?;
    let wired = Wired::new(&laboratory).into_diagnostic()?;
    if !arguments.json {
        say(&format!(
            "{}: {} elements, {} unknowns, {} markers, {} presses",
            laboratory.card.id,
            laboratory.fine.mesh.elements.len(),
            wired.model.unknowns(),
            wired.markers.len(),
            laboratory.probes.len()
        ));
    }
    let aside = Aside::new(&laboratory, &arguments.out);
    let presses = presses(arguments, &laboratory, &wired, &aside)?;
    let Some(presses) = presses else {
        warn(&format!(
            "{}: stopped; finished presses are kept beside the set, and the same command goes on from there",
            laboratory.card.id
        ));
        return Ok((
            Answer::Negative,
            json!({ "id": laboratory.card.id, "complete": false }),
        ));
    };
    let set = measurement_set(&laboratory, &wired.markers, &presses);
    if set.experiments.is_empty() {
        return Err(miette!(
            "{}: no press reached its first level: {}",
            file.display(),
            presses[0].stop
        ));
    }
    let written = write_set(&set, &arguments.out)
        .into_diagnostic()
        .wrap_err_with(|| {
            format!(
                "writing the set {} to {}",
                laboratory.card.id,
                arguments.out.display()
            )
        })?;
    let complete = presses.iter().all(|p| p.is_complete);
    for press in presses.iter().filter(|p| !p.is_complete) {
        warn(&format!(
            "{}: {}: {} levels reached: {}",
            laboratory.card.id,
            press.name,
            press.markers_mm.len(),
            press.stop
        ));
    }
    let errors = match &against {
        None => Vec::new(),
        Some(law) => {
            let read = MeasurementSet::open(&written).into_diagnostic()?;
            compare(&read, &presses, law, &Options::default()).into_diagnostic()?
        }
    };
    aside.clear();
    if !arguments.json {
        report(&presses, &errors, &written, began.elapsed().as_secs_f64());
    }
    let value = json!({
        "id": laboratory.card.id,
        "complete": complete,
        "elements": laboratory.fine.mesh.elements.len(),
        "unknowns": wired.model.unknowns(),
        "markers": wired.markers.len(),
        "solid_share": laboratory.fine.solid_share,
        "presses": presses.iter().map(|p| json!({ "name": p.name, "probe_mm": p.probe_mm, "stop": p.stop, "residual": p.residual })).collect::<Vec<_>>(),
        "against": arguments.against,
        "errors": errors,
        "file": written,
        "seconds": began.elapsed().as_secs_f64(),
    });
    Ok((if complete { Answer::Done } else { Answer::Negative }, value))
}

/// The law that is held against the structure, its axis as in the specimen.
fn against(
    arguments: &Arguments,
    laboratory: &Laboratory,
) -> miette::Result<Option<crate::material::law::Law>> {
    let Some(id) = &arguments.against else {
        return Ok(None);
    };
    let database = Database::open(&arguments.db).into_diagnostic()?;
    let law = database.find(id).into_diagnostic()?.law().into_diagnostic()?;
    Ok(Some(law.rotated(&laboratory.card.axis)))
}

/// All presses, those that were finished before among them; none if stopped.
fn presses(
    arguments: &Arguments,
    laboratory: &Laboratory,
    wired: &Wired,
    aside: &Aside,
) -> miette::Result<Option<Vec<Press>>> {
    let mut found: Vec<Option<Press>> = laboratory.probes.iter().map(|p| aside.find(p)).collect();
    let missing: Vec<usize> = (0..found.len()).filter(|&k| found[k].is_none()).collect();
    if missing.len() < found.len() && !arguments.json {
        say(&format!(
            "  {} presses were finished before",
            found.len() - missing.len()
        ));
    }
    let bar = ProgressBar::new(found.len() as u64);
    if arguments.json || !std::io::stderr().is_terminal() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let style = ProgressStyle::with_template("{msg} {bar:30} {pos}/{len} presses {eta}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_message(laboratory.card.id.clone());
    bar.set_position((found.len() - missing.len()) as u64);
    let trouble = Mutex::new(None);
    let finished = |k: usize, press: &Press| {
        if let Err(error) = aside.keep(&laboratory.probes[k], press) {
            // The first trouble says it all: there is no room, or no right to write.
            let _ = trouble
                .lock()
                .map(|mut t| t.get_or_insert(error.to_string()).len());
        }
        bar.inc(1);
    };
    let flag = stop::flag();
    let stopped = || flag.load(Ordering::Relaxed);
    let done = wired
        .measure(
            &missing,
            usize::from(arguments.jobs),
            &Options::default(),
            &finished,
            &stopped,
        )
        .into_diagnostic()?;
    bar.finish_and_clear();
    if let Some(message) = trouble.into_inner().ok().flatten() {
        warn(&format!(
            "warning: finished presses cannot be kept in {}: {message}",
            arguments.out.display()
        ));
    }
    for (k, press) in done {
        found[k] = Some(press);
    }
    Ok(found.into_iter().collect())
}

fn report(presses: &[Press], errors: &[LevelError], file: &Path, seconds: f64) {
    for press in presses {
        if let Some(last) = press.probe_mm.last() {
            let [x, y, z] = last;
            say(&format!(
                "  {:16} {} levels, under the probe ({x:.3}, {y:.3}, {z:.3}) mm at the last",
                press.name,
                press.probe_mm.len()
            ));
        }
    }
    for e in errors {
        let probe = match (e.probe_mm, e.relative_at_probe()) {
            (Some([fine, own]), Some(share)) => format!(
                "; probe {fine:.3} mm, homogeneous {own:.3} mm ({:.1} %)",
                100.0 * share
            ),
            _ => String::new(),
        };
        say(&format!(
            "  {:16} {:6.2} N: markers off by {:.3} mm RMS ({:.1} %), {:.3} mm at most{probe}",
            e.probe,
            e.force_n,
            e.rms_mm,
            100.0 * e.relative(),
            e.largest_mm
        ));
    }
    say(&format!("  wrote {} after {seconds:.1} s", file.display()));
}
