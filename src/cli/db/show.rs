//! `pliant db show`.

use super::super::Answer;
use super::super::terminal::{glyphs, plot_columns, say};
use super::list::summary_json;
use crate::material::database::{Database, Entry};
use crate::material::law::Law;
use crate::material::record::{Measurement, Uncertainty};
use crate::report::database::{MaterialSummary, kind_words, percent};
use crate::report::database_curve::{MaterialCurve, material_plot};
use crate::report::plot::LinePlot;
use crate::report::terminal_plot::terminal_plot;
use crate::units::whole_file::replace_file;
use miette::{IntoDiagnostic, miette};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Which material.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Its id, as in `pliant db list`; ID@N for its version N
    id: String,
    /// Write the plot to this file, too
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,
}

/// Shows a material.
pub(super) fn run(database: &Database, options: &Arguments, json: bool) -> miette::Result<Answer> {
    let entry = database.entry(&options.id).into_diagnostic()?;
    let law = entry.record.law().into_diagnostic()?;
    let plot = material_plot(&entry.record, &law);
    if let Some(file) = &options.svg {
        write_svg(file, &plot)?;
    }
    let versions: Vec<u32> = database
        .history(&entry.record.id)
        .iter()
        .map(|e| e.record.version)
        .collect();
    if json {
        let value = as_json(entry, &law, &versions)?;
        say(&serde_json::to_string_pretty(&value).into_diagnostic()?);
        return Ok(Answer::Done);
    }
    for line in text(entry, &law, &versions) {
        say(&line);
    }
    say("");
    say(&terminal_plot(&plot, plot_columns(), glyphs()));
    if let Some(file) = &options.svg {
        say(&format!("wrote {}", file.display()));
    }
    Ok(Answer::Done)
}

/// Writes a plot to a file, whole.
pub(super) fn write_svg(file: &Path, plot: &LinePlot) -> miette::Result<()> {
    replace_file(file, plot.svg().as_str().as_bytes()).map_err(|e| miette!("{}: {e}", file.display()))
}

fn as_json(entry: &Entry, law: &Law, versions: &[u32]) -> miette::Result<serde_json::Value> {
    let record = &entry.record;
    let curve = MaterialCurve::of(record, law);
    let points = |points: &[[f64; 2]]| -> Vec<serde_json::Value> {
        let point = |p: &[f64; 2]| {
            let state = crate::material::homogeneous::uniaxial(law, p[0] / 100.0);
            json!({"strain": state.axial, "lateral": state.lateral, "stress_mpa": state.stress})
        };
        points.iter().map(point).collect()
    };
    let mut value = summary_json(record, &MaterialSummary::of(law));
    value["file"] = json!(entry.file.display().to_string());
    value["versions"] = json!(versions);
    value["recipe"] = json!(record.recipe);
    value["assumptions"] = json!(record.assumptions);
    value["licence"] = json!(record.source.licence);
    value["link"] = json!(record.source.link);
    value["measurements"] = serde_json::to_value(&record.measurements).into_diagnostic()?;
    value["uncertainty"] = serde_json::to_value(&record.uncertainty).into_diagnostic()?;
    value["uniaxial"] = json!(points(&curve.fitted));
    value["uniaxial_band_mpa"] = json!(curve.band);
    value["uniaxial_extrapolated"] = json!([points(&curve.below), points(&curve.above)]);
    Ok(value)
}

fn text(entry: &Entry, law: &Law, versions: &[u32]) -> Vec<String> {
    let record = &entry.record;
    let s = MaterialSummary::of(law);
    let mut lines = vec![format!(
        "{} – {} ({})",
        record.id,
        record.name,
        kind_words(record)
    )];
    let mut say = |name: &str, value: String| lines.push(format!("  {name:16} {value}"));
    let newest = versions.last().copied().unwrap_or(record.version);
    let others: Vec<String> = versions
        .iter()
        .filter(|v| **v != record.version)
        .map(|v| format!("{}@{v}", record.id))
        .collect();
    let version = match (record.version == newest, others.is_empty()) {
        (_, true) => format!("{}", record.version),
        (true, _) => format!("{}, the newest; before it {}", record.version, others.join(", ")),
        (false, _) => format!("{} of {newest}: not the newest", record.version),
    };
    say("version", version);
    say("E at rest", format!("{:.4} MPa", s.young_at_rest_mpa));
    say("E at −30 %", format!("{:.4} MPa (secant)", s.young_pressed_mpa));
    say(
        "Poisson's ratio",
        format!("{:.3} at rest, in Biot strain", s.poisson_at_rest),
    );
    say("density", format!("{} g/cm³", record.density_g_per_cm3));
    say("colour", record.colour.clone());
    let printable = match record.printability.printable {
        true => "printable",
        false => "not printable",
    };
    say(
        "made by",
        format!("{} ({printable})", record.printability.process),
    );
    for m in &record.measurements {
        say("measured", measured(m));
    }
    if let Some(uncertainty) = &record.uncertainty {
        for line in uncertain(uncertainty, law) {
            say("uncertain", line);
        }
    }
    for assumption in &record.assumptions {
        say("assumed", assumption.clone());
    }
    say(
        "fitted from",
        record.recipe.clone().unwrap_or("not recorded".into()),
    );
    say("source", record.source.citation.clone());
    if let Some(link) = &record.source.link {
        say("link", link.clone());
    }
    say("licence", record.source.licence.clone());
    lines
}

/// A test with its errors.
fn measured(m: &Measurement) -> String {
    let [from, to] = m.strain.map(|e| 100.0 * e);
    let mut text = format!(
        "{} of {}: {from:.1} to {to:.1} %, error {}",
        m.test,
        m.specimen,
        percent(m.relative_rms)
    );
    if let Some(width) = m.lateral_relative_rms {
        text.push_str(&format!(", width {}", percent(width)));
    }
    if let Some(rms) = m.rms_mm {
        text.push_str(&format!(", displacement RMS {rms} mm"));
    }
    if let Some(largest) = m.largest_mm {
        text.push_str(&format!(", largest {largest} mm"));
    }
    text
}

/// A line for each uncertain parameter: its value, standard deviation and unit.
fn uncertain(uncertainty: &Uncertainty, law: &Law) -> Vec<String> {
    let parameters = law.parameters();
    let line = |(name, deviation): (&String, f64)| {
        let parameter = parameters.iter().find(|p| p.name == *name);
        match parameter {
            Some(p) => format!("{name}: {:.4} ± {deviation:.2e} {}", p.value, p.unit),
            None => format!("{name}: ± {deviation:.2e}"),
        }
    };
    let mut lines: Vec<String> = uncertainty
        .parameters
        .iter()
        .zip(uncertainty.deviations())
        .map(line)
        .collect();
    lines.push(format!("± is one standard deviation, from {}", uncertainty.basis));
    lines
}
