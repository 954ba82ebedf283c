//! `pliant db check`.

use super::super::Answer;
use super::super::terminal::say;
use crate::material::check::Finding;
use crate::material::database::{Database, Entry};
use miette::{IntoDiagnostic, miette};
use serde_json::json;

/// Examines every record and the versions before it.
pub(super) fn run(database: &Database, json: bool) -> miette::Result<Answer> {
    if database.entries().is_empty() && database.older().is_empty() && database.broken().is_empty() {
        return Err(miette!(
            "{} holds no records: name the folder with --db",
            database.folder().display()
        ));
    }
    let checked = database.check();
    let failed = checked.iter().filter(|c| !c.1.is_empty()).count() + database.broken().len();
    if json {
        let records: Vec<_> = checked
            .iter()
            .map(|(entry, findings)| as_json(entry, findings))
            .collect();
        let broken: Vec<_> = database.broken().iter().map(ToString::to_string).collect();
        let value = json!({"records": records, "broken": broken, "failed": failed});
        say(&serde_json::to_string_pretty(&value).into_diagnostic()?);
    } else {
        for broken in database.broken() {
            say(&broken.to_string());
        }
        for (entry, findings) in &checked {
            for finding in findings {
                say(&line(entry, finding));
            }
        }
        let (records, older) = (
            database.entries().len() + database.broken().len(),
            database.older().len(),
        );
        say(&match older {
            0 => format!("{records} records, {failed} with findings"),
            _ => format!("{records} records and {older} older versions, {failed} with findings"),
        });
    }
    Ok(match failed {
        0 => Answer::Done,
        _ => Answer::Negative,
    })
}

/// A finding as a line of text.
pub(super) fn line(entry: &Entry, f: &Finding) -> String {
    format!(
        "{}, line {}: {}: {}",
        entry.file.display(),
        f.line,
        f.field,
        f.message
    )
}

fn as_json(entry: &Entry, findings: &[Finding]) -> serde_json::Value {
    let findings: Vec<_> = findings
        .iter()
        .map(|f| json!({"line": f.line, "field": f.field, "message": f.message}))
        .collect();
    json!({
        "id": entry.record.id,
        "version": entry.record.version,
        "file": entry.file.display().to_string(),
        "findings": findings,
    })
}
