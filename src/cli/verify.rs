//! `pliant verify`: the checks of the mechanics, one by one, and the page that they make.

use super::Answer;
use super::terminal::{say, warn};
use crate::report::table::{Look, drawn};
use crate::units::whole_file::replace_file;
use crate::verify::page::{cells, write_page};
use crate::verify::record::{Demand, Found, Row};
use crate::verify::{CHECKS, Check, Cost, Findings, check};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use miette::{IntoDiagnostic, WrapErr, miette};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::PathBuf;

/// Checks the mechanics against closed forms, other programs and measurements.
///
/// Every check solves small problems and compares numbers; docs/verification.md is what it writes. Exit code 1 if a
/// demand is not met.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Only this check; may be given again [default: all]
    #[arg(long, value_name = "ID")]
    only: Vec<String>,
    /// Leave the long checks out
    #[arg(long)]
    quick: bool,
    /// Names the checks and does none
    #[arg(long)]
    list: bool,
    /// Answer in JSON, for machines
    #[arg(long)]
    json: bool,
    /// Write the page of all checks, in Markdown, to this file
    #[arg(long, value_name = "FILE", conflicts_with_all = ["only", "quick", "list"])]
    out: Option<PathBuf>,
}

/// Runs `pliant verify`.
///
/// # Errors
/// An unknown check, a check that cannot be carried out, or a page that cannot be written.
pub fn run(arguments: &Arguments) -> miette::Result<Answer> {
    let chosen = chosen(arguments)?;
    if arguments.list {
        list(&chosen, arguments.json)?;
        return Ok(Answer::Done);
    }
    let bar = bar(arguments.json, chosen.len());
    let mut outcomes = Vec::new();
    for check in chosen {
        bar.set_message(check.title);
        let findings = (check.run)()
            .into_diagnostic()
            .wrap_err_with(|| format!("check {:?} could not be carried out", check.id))?;
        if !arguments.json {
            bar.suspend(|| tell(check, &findings));
        }
        outcomes.push((check, findings));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let passed = outcomes.iter().all(|(_, findings)| findings.passed());
    if arguments.json {
        let checks: Vec<Value> = outcomes.iter().map(|(c, f)| as_json(c, f)).collect();
        let answer = json!({"passed": passed, "checks": checks});
        say(&serde_json::to_string_pretty(&answer).into_diagnostic()?);
    }
    if let Some(file) = &arguments.out {
        let mut page = Vec::new();
        write_page(&outcomes, &mut page).into_diagnostic()?;
        replace_file(file, &page)
            .into_diagnostic()
            .wrap_err_with(|| format!("{} cannot be written", file.display()))?;
    }
    if passed {
        return Ok(Answer::Done);
    }
    let failed = outcomes.iter().filter(|(_, findings)| !findings.passed());
    let ids: Vec<&str> = failed.map(|(check, _)| check.id).collect();
    warn(&format!("failed: {}", ids.join(", ")));
    Ok(Answer::Negative)
}

fn chosen(arguments: &Arguments) -> miette::Result<Vec<&'static Check>> {
    for id in &arguments.only {
        if check(id).is_none() {
            let ids: Vec<&str> = CHECKS.iter().map(|check| check.id).collect();
            return Err(miette!("no check {id:?}: there are {}", ids.join(", ")));
        }
    }
    let asked = |c: &&Check| arguments.only.is_empty() || arguments.only.iter().any(|id| id == c.id);
    let short = |c: &&Check| !arguments.quick || c.cost == Cost::Light;
    Ok(CHECKS.iter().filter(asked).filter(short).collect())
}

fn bar(quiet: bool, checks: usize) -> ProgressBar {
    let bar = ProgressBar::new(checks as u64);
    if quiet || !std::io::stderr().is_terminal() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let style = ProgressStyle::with_template("{bar:20} {pos}/{len} {msg} {elapsed}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

fn list(checks: &[&Check], as_json: bool) -> miette::Result<()> {
    let cost = |c: &Check| match c.cost {
        Cost::Light => "short",
        Cost::Heavy => "long",
    };
    if as_json {
        let all: Vec<Value> = checks
            .iter()
            .map(|c| json!({"id": c.id, "title": c.title, "against": c.against, "cost": cost(c)}))
            .collect();
        say(&serde_json::to_string_pretty(&all).into_diagnostic()?);
        return Ok(());
    }
    let rows = checks
        .iter()
        .map(|c| vec![c.id.to_string(), c.title.to_string(), cost(c).to_string()]);
    let look = Look::of_standard_output();
    say(&drawn(&["id", "title", "cost"], rows, &[0, 1, 2], look));
    Ok(())
}

fn tell(check: &Check, findings: &Findings) {
    let verdict = if findings.passed() { "holds" } else { "FAILS" };
    say(&format!("{} – {}: {verdict}", check.id, check.title));
    let rows = findings.rows.iter().map(|row| {
        let mut cells = cells(row).to_vec();
        cells.push(mark(row).to_string());
        cells
    });
    let header = ["quantity", "expected", "found", "tolerance", ""];
    say(&drawn(&header, rows, &[0, 4], Look::of_standard_output()));
    say("");
}

fn mark(row: &Row) -> &'static str {
    match (&row.demand, row.passed()) {
        (_, false) => "FAILS",
        (Demand::Stated { .. }, true) => "stated",
        (_, true) => "holds",
    }
}

fn as_json(check: &Check, findings: &Findings) -> Value {
    let rows: Vec<Value> = findings
        .rows
        .iter()
        .map(|row| {
            let demand = match &row.demand {
                Demand::Near { expected, tolerance } => json!({"expected": expected, "tolerance": tolerance}),
                Demand::AtMost(bound) => json!({"at_most": bound}),
                Demand::AtLeast(bound) => json!({"at_least": bound}),
                Demand::Stated { expected } => json!({"others": expected}),
                Demand::Words(words) => json!({"expected": words}),
            };
            let found = match &row.found {
                Found::Number(found) => json!(found),
                Found::Words { text, .. } => json!(text),
            };
            json!({
                "quantity": row.quantity,
                "unit": row.unit,
                "demand": demand,
                "found": found,
                "passed": row.passed(),
            })
        })
        .collect();
    json!({
        "id": check.id,
        "title": check.title,
        "against": check.against,
        "passed": findings.passed(),
        "rows": rows,
        "note": findings.note,
    })
}
