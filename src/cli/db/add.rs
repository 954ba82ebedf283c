//! `pliant db add` and `pliant db migrate`: what writes records.

use super::super::Answer;
use super::super::terminal::{say, warn};
use super::{check, warn_of_unknown};
use crate::material::check::check as findings_of;
use crate::material::database::{Database, Entry};
use crate::material::put::{Change, Put};
use crate::material::record::{MaterialRecord, SCHEMA};
use miette::{IntoDiagnostic, miette};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Checks the records in `files` and puts them into the database, all or, if one is unsound, none.
pub(super) fn run(folder: &Path, files: &[PathBuf], json: bool) -> miette::Result<Answer> {
    let mut entries = Vec::new();
    let mut sound = true;
    for file in files {
        let text = std::fs::read_to_string(file).map_err(|e| miette!("{}: {e}", file.display()))?;
        let (record, unknown) = MaterialRecord::parse(&text, file).into_diagnostic()?;
        let entry = Entry {
            record,
            file: file.clone(),
            text,
            unknown,
        };
        warn_of_unknown(&entry.file, &entry.unknown);
        for finding in findings_of(&entry.record, &entry.text) {
            sound = false;
            warn(&check::line(&entry, &finding));
        }
        entries.push(entry);
    }
    if !sound {
        warn("nothing was added: mend what is named above");
        return Ok(Answer::Negative);
    }
    let mut values = Vec::new();
    for entry in &entries {
        let put = Database::put_text(folder, &entry.record, &entry.text).into_diagnostic()?;
        if !json {
            say(&sentence(&entry.record.id, &put));
        }
        values.push(as_json(&entry.record.id, &put));
    }
    if json {
        say(&serde_json::to_string_pretty(&values).into_diagnostic()?);
    }
    Ok(Answer::Done)
}

/// What was done, for people.
pub(super) fn sentence(id: &str, put: &Put) -> String {
    let (file, version) = (put.file.display(), put.version);
    match put.change {
        Change::First => format!("{id}: version {version}, the first, in {file}"),
        Change::Revised => format!(
            "{id}: version {version} in {file}; version {} can be read as {id}@{0}",
            version - 1
        ),
        Change::Same => format!("{id}: version {version} holds the same; nothing was written"),
    }
}

/// What was done, for machines.
pub(super) fn as_json(id: &str, put: &Put) -> serde_json::Value {
    let change = match put.change {
        Change::First => "first",
        Change::Revised => "revised",
        Change::Same => "same",
    };
    json!({"id": id, "file": put.file.display().to_string(), "version": put.version, "change": change})
}

/// Rewrites records of older schemas.
pub(super) fn migrate(folder: &Path, json: bool) -> miette::Result<Answer> {
    let done = Database::migrate(folder).into_diagnostic()?;
    for (file, unknown) in &done {
        warn_of_unknown(file, unknown);
    }
    if json {
        let files: Vec<_> = done.iter().map(|(file, _)| file.display().to_string()).collect();
        let value = json!({"schema": SCHEMA, "rewritten": files});
        say(&serde_json::to_string_pretty(&value).into_diagnostic()?);
        return Ok(Answer::Done);
    }
    for (file, _) in &done {
        say(&format!("{}: rewritten", file.display()));
    }
    say(&match done.len() {
        0 => format!("all records are of schema {SCHEMA}; nothing was written"),
        n => format!("{n} records rewritten in schema {SCHEMA}; their content and version are the same"),
    });
    Ok(Answer::Done)
}
