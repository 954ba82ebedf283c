//! `pliant db compare`.

use super::super::Answer;
use super::super::terminal::{glyphs, plot_columns, say};
use super::list::summary_json;
use super::show::write_svg;
use crate::material::database::Database;
use crate::material::homogeneous::uniaxial;
use crate::material::law::Law;
use crate::material::record::MaterialRecord;
use crate::report::database::{MaterialSummary, kind_words, percent, range_words};
use crate::report::database_curve::{comparison_plot, name_of};
use crate::report::table::{Look, drawn};
use crate::report::terminal_plot::terminal_plot;
use miette::IntoDiagnostic;
use serde_json::json;
use std::path::PathBuf;

/// Which materials.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Two ids or more; ID@N for a material's version N
    #[arg(required = true, num_args = 2..)]
    ids: Vec<String>,
    /// Write the plot to this file, too
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<PathBuf>,
}

/// Strains at which the table gives stresses.
const STRAINS: [f64; 6] = [-0.5, -0.3, -0.1, 0.1, 0.3, 1.0];

/// Compares materials.
pub(super) fn run(database: &Database, options: &Arguments, json: bool) -> miette::Result<Answer> {
    let mut materials: Vec<(&MaterialRecord, Law)> = Vec::new();
    for id in &options.ids {
        let record = database.find(id).into_diagnostic()?;
        materials.push((record, record.law().into_diagnostic()?));
    }
    let materials: Vec<(&MaterialRecord, &Law)> = materials.iter().map(|(r, law)| (*r, law)).collect();
    let plot = comparison_plot(&materials);
    if let Some(file) = &options.svg {
        write_svg(file, &plot)?;
    }
    if json {
        let values: Vec<_> = materials
            .iter()
            .map(|(record, law)| as_json(record, law))
            .collect();
        say(&serde_json::to_string_pretty(&values).into_diagnostic()?);
        return Ok(Answer::Done);
    }
    say(&table(&materials));
    say("stress is nominal, of the uniaxial test along z; in brackets where it is extrapolated\n");
    say(&terminal_plot(&plot, plot_columns(), glyphs()));
    if let Some(file) = &options.svg {
        say(&format!("wrote {}", file.display()));
    }
    Ok(Answer::Done)
}

/// A column for each material.
fn table(materials: &[(&MaterialRecord, &Law)]) -> String {
    let mut header = vec![String::new()];
    header.extend(materials.iter().map(|(record, _)| name_of(materials, record)));
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let row = |name: String, value: &dyn Fn(&MaterialRecord, &Law) -> String| {
        let mut cells = vec![name];
        cells.extend(materials.iter().map(|(record, law)| value(record, law)));
        cells
    };
    let summary = |law: &Law| MaterialSummary::of(law);
    let mut rows = vec![
        row("kind".into(), &|record, _| kind_words(record)),
        row("E at rest [MPa]".into(), &|_, law| {
            format!("{:.4}", summary(law).young_at_rest_mpa)
        }),
        row("Poisson's ratio at rest".into(), &|_, law| {
            format!("{:.3}", summary(law).poisson_at_rest)
        }),
        row("density [g/cm³]".into(), &|record, _| {
            format!("{}", record.density_g_per_cm3)
        }),
        row("fitted range".into(), &|record, _| range_words(record)),
        row("error".into(), &|record, _| {
            record.relative_rms().map_or("–".into(), percent)
        }),
    ];
    for strain in STRAINS {
        rows.push(row(
            format!("stress at {:+.0} % [MPa]", 100.0 * strain),
            &|record, law| {
                let stress = format!("{:.4}", uniaxial(law, strain).stress);
                match inside(record, strain) {
                    true => stress,
                    false => format!("({stress})"),
                }
            },
        ));
    }
    drawn(&header, rows.into_iter(), &[0], Look::Plain)
}

fn inside(record: &MaterialRecord, strain: f64) -> bool {
    let [low, high] = record.model.range.engineering_strain;
    strain >= low && strain <= high
}

fn as_json(record: &MaterialRecord, law: &Law) -> serde_json::Value {
    let mut value = summary_json(record, &MaterialSummary::of(law));
    let point = |e: &f64| {
        let stress = uniaxial(law, *e).stress;
        json!({"strain": e, "stress_mpa": stress, "fitted": inside(record, *e)})
    };
    value["uniaxial"] = STRAINS.iter().map(point).collect();
    value
}
