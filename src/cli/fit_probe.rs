//! One measurement set of `pliant fit`: fits, reports, draws, writes.

use super::Answer;
use super::fit::Arguments;
use super::fit_coupon::note;
use super::stop;
use super::terminal::{say, warn};
use crate::fem::measurement_set::MeasurementSet;
use crate::fem::measurement_set::plausible::oddities;
use crate::fem::specimen::Specimen;
use crate::fitting::probe::fit::{ProbeFit, ProbeOptions, Step, fit};
use crate::fitting::probe::press::PressedSpecimen;
use crate::fitting::probe::record::record;
use crate::fitting::probe::start::Symmetry;
use crate::material::check::check;
use crate::material::database::Database;
use crate::material::record::{Formulation, Kind, MaterialRecord};
use crate::report::fit_probe::{drawings, page, summary, table, warnings};
use crate::report::table::Look;
use crate::units::whole_file::replace_file;
use indicatif::{ProgressBar, ProgressDrawTarget};
use miette::{IntoDiagnostic, WrapErr, miette};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Is this the text of a measurement set? A coupon file has no specimen.
pub fn is_set(text: &str) -> bool {
    text.parse::<toml::Table>()
        .is_ok_and(|table| table.contains_key("specimen"))
}

/// Fits the set in `path` and does what `arguments` ask.
///
/// # Errors
/// A set that makes no sense or has nothing to fit, something that can't be written.
pub fn run(arguments: &Arguments, path: &Path) -> miette::Result<(Answer, Value)> {
    if arguments.compare {
        return Err(miette!(
            "{}: --compare is for coupon files; a measurement set is fitted with one law (--energy for the other form)",
            path.display()
        ));
    }
    if arguments.page.is_some() {
        warn(&format!(
            "warning: {}: --page is for coupon files; --plots writes the page of a measurement set",
            path.display()
        ));
    }
    let set = MeasurementSet::open(path).into_diagnostic()?;
    for oddity in oddities(&set) {
        if oddity.is_fatal {
            return Err(miette!("{}: {oddity}", path.display()));
        }
        warn(&format!("warning: {}: {oddity}", path.display()));
    }
    let specimen = Specimen::new(&set).into_diagnostic()?;
    let mut pressed = PressedSpecimen::new(&set, &specimen);
    let fitted = fitted(arguments, path, &set, &mut pressed)?;
    let record = record(&set, &fitted, recipe(path, &arguments.out)).into_diagnostic()?;
    if !arguments.json {
        report(&record, &fitted);
    }
    let (mut answer, file, findings) = write(arguments, &record)?;
    if !fitted.has_converged() {
        answer = Answer::Negative;
    }
    let written = draw(arguments, &record, &fitted)?;
    if !arguments.json {
        let all = file.iter().chain(&written);
        all.for_each(|f| say(&format!("  wrote {f}")));
    }
    Ok((answer, value(&record, &fitted, file, &findings)?))
}

fn fitted(
    arguments: &Arguments,
    path: &Path,
    set: &MeasurementSet,
    pressed: &mut PressedSpecimen,
) -> miette::Result<ProbeFit> {
    let mut symmetry = Symmetry::of(&set.material);
    if arguments.energy {
        if set.material.kind != Kind::Isotropic {
            return Err(miette!(
                "{}: --energy is for isotropic materials, and this one is {}",
                path.display(),
                set.material.kind.word()
            ));
        }
        symmetry.formulation = Formulation::Energy;
    }
    let suited = ProbeOptions::suited(set);
    let options = ProbeOptions {
        centres: arguments.centres.map(usize::from),
        tangential: !arguments.no_tangential && suited.tangential,
        bootstrap: arguments.bootstrap.unwrap_or(0) as usize,
        seed: arguments.seed,
        ..suited
    };
    let bar = ProgressBar::new_spinner();
    if arguments.json || !std::io::stderr().is_terminal() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    let flag = stop::flag();
    let mut news = |step: &Step| {
        bar.set_message(format!(
            "{}: {}, step {}: error {:.3} standard deviations",
            set.material.id, step.stage, step.iterations, step.scaled_rms
        ));
    };
    let cancelled = || flag.load(Ordering::Relaxed);
    let found = fit(pressed, symmetry, &options, &cancelled, &mut news);
    bar.finish_and_clear();
    found
        .into_diagnostic()
        .wrap_err_with(|| format!("fitting {}", path.display()))
}

/// The set's file as the database's folder sees it, if it lies in there.
fn recipe(path: &Path, folder: &Path) -> Option<String> {
    let (path, folder) = (path.canonicalize().ok()?, folder.canonicalize().ok()?);
    let inside = path.strip_prefix(folder).ok()?;
    let parts: Vec<String> = inside
        .components()
        .map(|c| c.as_os_str().to_string_lossy().into_owned())
        .collect();
    Some(parts.join("/"))
}

fn report(record: &MaterialRecord, fit: &ProbeFit) {
    say(&format!("{} ({})", record.id, record.name));
    for fact in summary(fit) {
        say(&format!("  {}: {}", fact.name, fact.value));
    }
    for line in table(fit, Look::of_standard_output()).lines() {
        say(&format!("  {line}"));
    }
    for warning in warnings(fit) {
        warn(&format!("warning: {}: {warning}", record.id));
    }
    for assumption in &record.assumptions {
        say(&format!("  assumed: {assumption}"));
    }
}

/// Writes the record if it is sound and wanted; its file, and what was found wrong.
fn write(
    arguments: &Arguments,
    record: &MaterialRecord,
) -> miette::Result<(Answer, Option<String>, Vec<String>)> {
    let text = record.to_toml().into_diagnostic()?;
    let findings: Vec<String> = check(record, &text)
        .iter()
        .map(|f| format!("{}: {}", f.field, f.message))
        .collect();
    if !findings.is_empty() {
        findings.iter().for_each(|f| warn(&format!("{}: {f}", record.id)));
        warn(&format!(
            "{}: not written, since the record would not pass `pliant db check`",
            record.id
        ));
        return Ok((Answer::Negative, None, findings));
    }
    if arguments.dry_run {
        return Ok((Answer::Done, None, findings));
    }
    let put = Database::put(&arguments.out, record).into_diagnostic()?;
    if !arguments.json {
        note(&put);
    }
    Ok((Answer::Done, Some(put.file.display().to_string()), findings))
}

fn draw(arguments: &Arguments, record: &MaterialRecord, fit: &ProbeFit) -> miette::Result<Vec<String>> {
    let Some(folder) = &arguments.plots else {
        return Ok(Vec::new());
    };
    let mut files = vec![(
        format!("{}-fit.html", record.id),
        page(&record.name, fit).into_bytes(),
    )];
    for figure in drawings(fit) {
        files.push((
            format!("{}-{}.svg", record.id, figure.name),
            figure.drawing.into_bytes(),
        ));
    }
    let mut written = Vec::new();
    for (name, bytes) in files {
        let file = folder.join(name);
        replace_file(&file, &bytes).map_err(|e| miette!("{}: {e}", file.display()))?;
        written.push(file.display().to_string());
    }
    Ok(written)
}

fn value(
    record: &MaterialRecord,
    fit: &ProbeFit,
    file: Option<String>,
    findings: &[String],
) -> miette::Result<Value> {
    let levels = |errors: &crate::fitting::probe::errors::Errors| -> Vec<Value> {
        let one = |l: &crate::fitting::probe::errors::LevelErrors| {
            json!({
                "force": l.size, "forces_n": l.forces_n, "average_mm": l.average_mm,
                "standard_deviation_mm": l.deviation_mm, "largest_mm": l.largest_mm,
                "largest_displacement_mm": l.displacement_mm, "markers": l.markers,
            })
        };
        errors.levels.iter().map(one).collect()
    };
    let held_out = match &fit.held_out {
        Some(Ok(errors)) => json!(levels(errors)),
        Some(Err(failure)) => json!(failure.to_string()),
        None => Value::Null,
    };
    Ok(json!({
        "id": record.id,
        "measurements": serde_json::to_value(&record.measurements).into_diagnostic()?,
        "assumptions": record.assumptions,
        "converged": fit.has_converged(),
        "settled": fit.has_settled,
        "stopped": fit.stop.to_string(),
        "errors": levels(&fit.errors),
        "held_out": held_out,
        "warnings": warnings(fit),
        "seconds": fit.seconds,
        "findings": findings,
        "file": file,
    }))
}
