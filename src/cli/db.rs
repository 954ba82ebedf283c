//! `pliant db`: the database of materials.

use super::Answer;
use super::terminal::{say, warn};
use crate::material::check::Finding;
use crate::material::database::{Database, Entry};
use crate::material::homogeneous::uniaxial;
use crate::material::law::Law;
use crate::material::record::{Kind, MaterialRecord};
use clap::Subcommand;
use comfy_table::{CellAlignment, Table, presets};
use miette::{IntoDiagnostic, miette};
use serde_json::json;
use std::path::PathBuf;

/// Lists, shows and checks the materials of the database.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder of the material database
    #[arg(long, global = true, value_name = "DIR", default_value = "materials-db")]
    db: PathBuf,
    /// Answer in JSON, for machines
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Lists a line per material: stiffness at rest and pressed, range measured, error of the fit, source
    List {
        /// As a Markdown table
        #[arg(long)]
        markdown: bool,
    },
    /// Shows all about one material, with its curve under pressing and pulling
    Show {
        /// Its id, as in `pliant db list`
        id: String,
    },
    /// Examines every record: units, positive stiffness, rising curves, source; exit code 1 if one fails
    Check,
}

/// Runs `pliant db`.
///
/// # Errors
/// If the folder or the material asked for can't be read.
pub fn run(arguments: &Arguments) -> miette::Result<Answer> {
    let database = Database::open(&arguments.db).into_diagnostic()?;
    for entry in database.entries() {
        for unknown in &entry.unknown {
            warn(&format!(
                "warning: {}, line {}: {} is not a field that this version knows",
                entry.file.display(),
                unknown.line,
                unknown.field
            ));
        }
    }
    match &arguments.command {
        Action::List { markdown } => list(&database, arguments.json, *markdown),
        Action::Show { id } => show(&database, id, arguments.json),
        Action::Check => check(&database, arguments.json),
    }
}

/// What the table says about one material.
struct Summary {
    young_at_rest: f64,
    young_pressed: f64,
    poisson: f64,
}

/// Compression at which the table gives a second modulus.
const PRESSED: f64 = -0.3;

fn summary(law: &Law) -> Summary {
    Summary {
        young_at_rest: law.young_modulus(&crate::math::mandel::Mandel::zeros()),
        young_pressed: uniaxial(law, PRESSED).stress / PRESSED,
        poisson: law.poisson_ratio_at_rest(),
    }
}

fn percent(x: f64) -> String {
    format!("{:.1} %", 100.0 * x)
}

fn range_words(record: &MaterialRecord) -> String {
    let [low, high] = record.model.range.engineering_strain;
    format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high)
}

fn tests_words(record: &MaterialRecord) -> String {
    let words: Vec<String> = record
        .measurements
        .iter()
        .map(|m| match m.lateral_relative_rms {
            Some(width) => format!("{} {}, width {}", m.test, percent(m.relative_rms), percent(width)),
            None => format!("{} {}", m.test, percent(m.relative_rms)),
        })
        .collect();
    if words.is_empty() {
        "not measured".into()
    } else {
        words.join("; ")
    }
}

fn list(database: &Database, json: bool, markdown: bool) -> miette::Result<Answer> {
    let mut rows = Vec::new();
    for record in database.records() {
        let law = record.law().into_diagnostic()?;
        rows.push((record, summary(&law)));
    }
    for broken in database.broken() {
        warn(&format!("warning: {broken}"));
    }
    if json {
        let values: Vec<_> = rows.iter().map(|(record, s)| summary_json(record, s)).collect();
        say(&serde_json::to_string_pretty(&values).into_diagnostic()?);
    } else if markdown {
        say(markdown_table(&rows).trim_end());
    } else {
        let mut table = Table::new();
        table.load_preset(presets::NOTHING);
        table.set_header([
            "id",
            "name",
            "kind",
            "E at rest\n[MPa]",
            "E at −30 %\n[MPa]",
            "range",
            "error",
            "source",
        ]);
        for (record, s) in &rows {
            table.add_row([
                record.id.clone(),
                record.name.clone(),
                kind_words(record),
                format!("{:.3}", s.young_at_rest),
                format!("{:.3}", s.young_pressed),
                range_words(record),
                record.relative_rms().map_or("–".into(), percent),
                short_source(record),
            ]);
        }
        for column in [3, 4, 6] {
            if let Some(column) = table.column_mut(column) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        say(&table.to_string());
    }
    Ok(Answer::Done)
}

fn kind_words(record: &MaterialRecord) -> String {
    let kind = match record.kind {
        Kind::Isotropic => "isotropic",
        Kind::TransverselyIsotropic => "transverse",
    };
    if record.synthetic {
        format!("{kind}, synthetic")
    } else {
        kind.to_string()
    }
}

/// The first author (or what the citation begins with) and the year in parentheses.
fn short_source(record: &MaterialRecord) -> String {
    let citation = &record.source.citation;
    let first: String = citation
        .split([',', '('])
        .next()
        .unwrap_or_default()
        .trim()
        .chars()
        .take(24)
        .collect();
    let year: String = citation
        .split('(')
        .skip(1)
        .map(|rest| rest.chars().take(4).collect::<String>())
        .find(|y| y.len() == 4 && y.bytes().all(|b| b.is_ascii_digit()))
        .unwrap_or_default();
    format!("{first} {year}").trim().to_string()
}

fn summary_json(record: &MaterialRecord, s: &Summary) -> serde_json::Value {
    json!({
        "id": record.id,
        "name": record.name,
        "kind": record.kind.word(),
        "synthetic": record.synthetic,
        "young_at_rest_mpa": s.young_at_rest,
        "young_at_30_percent_compression_mpa": s.young_pressed,
        "poisson_at_rest": s.poisson,
        "engineering_strain": record.model.range.engineering_strain,
        "relative_rms": record.relative_rms(),
        "density_g_per_cm3": record.density_g_per_cm3,
        "colour": record.colour,
        "source": record.source.citation,
    })
}

fn markdown_table(rows: &[(&MaterialRecord, Summary)]) -> String {
    let mut text = String::from(
        "# Materials of the database\n\n\
         Made by `pliant db list --markdown`. E is the secant Young's modulus (along the axis for transversely\n\
         isotropic materials), ν Poisson's ratio in Biot strain at rest. The error of a test is the root mean square of\n\
         the law's stress error over that of the measured stress, over the range of strain that was fitted; with a\n\
         tracked width, the same for lateral strain.\n\n\
         | id | name | kind | E at rest [MPa] | E at −30 % [MPa] | ν | range | error of each test | source |\n\
         |---|---|---|---:|---:|---:|---|---|---|\n",
    );
    for (record, s) in rows {
        text.push_str(&format!(
            "| `{}` | {} | {} | {:.3} | {:.3} | {:.2} | {} | {} | {} |\n",
            record.id,
            record.name,
            kind_words(record),
            s.young_at_rest,
            s.young_pressed,
            s.poisson,
            range_words(record),
            tests_words(record),
            short_source(record),
        ));
    }
    text
}

fn show(database: &Database, id: &str, json: bool) -> miette::Result<Answer> {
    let entry = database.entry(id).into_diagnostic()?;
    let record = &entry.record;
    let law = record.law().into_diagnostic()?;
    let s = summary(&law);
    let [low, high] = record.model.range.engineering_strain;
    let curve: Vec<_> = (0..=40)
        .map(|i| uniaxial(&law, low + (high - low) * f64::from(i) / 40.0))
        .collect();
    if json {
        let mut value = summary_json(record, &s);
        value["file"] = json!(entry.file.display().to_string());
        value["assumptions"] = json!(record.assumptions);
        value["licence"] = json!(record.source.licence);
        value["measurements"] = serde_json::to_value(&record.measurements).into_diagnostic()?;
        value["uniaxial"] = json!(
            curve
                .iter()
                .map(|u| json!({"strain": u.axial, "lateral": u.lateral, "stress_mpa": u.stress}))
                .collect::<Vec<_>>()
        );
        say(&serde_json::to_string_pretty(&value).into_diagnostic()?);
        return Ok(Answer::Done);
    }
    say(&format!(
        "{} – {} ({})",
        record.id,
        record.name,
        kind_words(record)
    ));
    say(&format!("  E at rest        {:.4} MPa", s.young_at_rest));
    say(&format!("  E at −30 %       {:.4} MPa (secant)", s.young_pressed));
    say(&format!(
        "  Poisson's ratio  {:.3} at rest, in Biot strain",
        s.poisson
    ));
    say(&format!("  density          {} g/cm³", record.density_g_per_cm3));
    say(&format!("  colour           {}", record.colour));
    let printable = if record.printability.printable {
        "printable"
    } else {
        "not printable"
    };
    say(&format!(
        "  made by          {} ({printable})",
        record.printability.process
    ));
    for m in &record.measurements {
        let [from, to] = m.strain;
        let range = format!("{:.1} to {:.1} %", 100.0 * from, 100.0 * to);
        let width = m
            .lateral_relative_rms
            .map_or(String::new(), |e| format!(", width {}", percent(e)));
        say(&format!(
            "  measured         {} of {}: {range}, error {}{width}",
            m.test,
            m.specimen,
            percent(m.relative_rms)
        ));
    }
    for assumption in &record.assumptions {
        say(&format!("  assumed          {assumption}"));
    }
    say(&format!("  source           {}", record.source.citation));
    say(&format!("  licence          {}", record.source.licence));
    say("\nuniaxial test: nominal stress [MPa] over engineering strain [%]");
    say(&plot(
        &curve
            .iter()
            .map(|u| (100.0 * u.axial, u.stress))
            .collect::<Vec<_>>(),
    ));
    Ok(Answer::Done)
}

/// A curve in letters, 61 columns by 15 rows.
fn plot(points: &[(f64, f64)]) -> String {
    const COLUMNS: usize = 61;
    const ROWS: usize = 15;
    let fold = |f: fn(f64, f64) -> f64, k: fn(&(f64, f64)) -> f64, start| points.iter().map(k).fold(start, f);
    let (left, right) = (fold(f64::min, |p| p.0, 0.0), fold(f64::max, |p| p.0, 0.0));
    let (bottom, top) = (fold(f64::min, |p| p.1, 0.0), fold(f64::max, |p| p.1, 0.0));
    let place = |x: f64, from: f64, to: f64, cells: usize| {
        let part = if to > from { (x - from) / (to - from) } else { 0.0 };
        ((part * (cells - 1) as f64).round() as usize).min(cells - 1)
    };
    let mut cells = vec![vec![' '; COLUMNS]; ROWS];
    let (zero_column, zero_row) = (
        place(0.0, left, right, COLUMNS),
        ROWS - 1 - place(0.0, bottom, top, ROWS),
    );
    cells[zero_row].fill('─');
    for (row, line) in cells.iter_mut().enumerate() {
        line[zero_column] = if row == zero_row { '┼' } else { '│' };
    }
    // Between the points straight lines, two samples to a column.
    for pair in points.windows(2) {
        for i in 0..=4 {
            let t = f64::from(i) / 4.0;
            let x = pair[0].0 + t * (pair[1].0 - pair[0].0);
            let y = pair[0].1 + t * (pair[1].1 - pair[0].1);
            cells[ROWS - 1 - place(y, bottom, top, ROWS)][place(x, left, right, COLUMNS)] = '•';
        }
    }
    let mut text = String::new();
    for (row, line) in cells.iter().enumerate() {
        let label = match row {
            0 => format!("{top:9.3}"),
            r if r == ROWS - 1 => format!("{bottom:9.3}"),
            _ => " ".repeat(9),
        };
        text.push_str(&format!(
            "{label} {}\n",
            line.iter().collect::<String>().trim_end()
        ));
    }
    text.push_str(&format!("{:10}{:<30.0}{:>31.0}", "", left, right));
    text
}

fn check(database: &Database, json: bool) -> miette::Result<Answer> {
    if database.entries().is_empty() && database.broken().is_empty() {
        return Err(miette!(
            "{} holds no records: name the folder with --db",
            database.folder().display()
        ));
    }
    let checked: Vec<(&Entry, Vec<Finding>)> = database.entries().iter().map(|e| (e, e.check())).collect();
    let failed = checked.iter().filter(|c| !c.1.is_empty()).count() + database.broken().len();
    if json {
        let records: Vec<_> = checked
            .iter()
            .map(|(entry, findings)| {
                let findings: Vec<_> = findings
                    .iter()
                    .map(|f| json!({"line": f.line, "field": f.field, "message": f.message}))
                    .collect();
                json!({"id": entry.record.id, "file": entry.file.display().to_string(), "findings": findings})
            })
            .collect();
        let broken: Vec<_> = database.broken().iter().map(ToString::to_string).collect();
        let value = json!({"records": records, "broken": broken, "failed": failed});
        say(&serde_json::to_string_pretty(&value).into_diagnostic()?);
    } else {
        for broken in database.broken() {
            say(&broken.to_string());
        }
        for (entry, findings) in &checked {
            for f in findings {
                say(&format!(
                    "{}, line {}: {}: {}",
                    entry.file.display(),
                    f.line,
                    f.field,
                    f.message
                ));
            }
        }
        let total = checked.len() + database.broken().len();
        say(&format!("{total} records, {failed} with findings"));
    }
    Ok(if failed == 0 {
        Answer::Done
    } else {
        Answer::Negative
    })
}
