//! `pliant db diff`: what changed from one record to another, or from one revision of the database to this one.

use super::super::Answer;
use super::super::terminal::{say, warn};
use crate::material::database::Database;
use crate::material::difference::Difference;
use crate::material::record::MaterialRecord;
use crate::report::database::percent;
use miette::{IntoDiagnostic, WrapErr, miette};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What is compared with what.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Exit code 1 where a record changed without a new version, or a version is no longer there."
)]
pub(super) struct Arguments {
    /// Two records (ID@1 ID@2, or two ids), or one id: its newest version with the one before
    #[arg(num_args = 0..=2)]
    ids: Vec<String>,
    /// Compare the database with the one in this folder, which is taken as the older
    #[arg(long, value_name = "DIR", conflicts_with = "revision")]
    against: Option<PathBuf>,
    /// Compare the database with what it was at this revision of its git repository
    #[arg(long, value_name = "REV")]
    revision: Option<String>,
}

/// Compares records or databases.
pub(super) fn run(database: &Database, options: &Arguments, json: bool) -> miette::Result<Answer> {
    if let Some(folder) = &options.against {
        let older = Database::open(folder).into_diagnostic()?;
        return folders(&older, database, &options.ids, json);
    }
    if let Some(revision) = &options.revision {
        let copy = checked_out(database.folder(), revision)?;
        let older = Database::open(copy.path()).into_diagnostic()?;
        return folders(&older, database, &options.ids, json);
    }
    let (before, after) = match options.ids.as_slice() {
        [before, after] => (
            database.find(before).into_diagnostic()?,
            database.find(after).into_diagnostic()?,
        ),
        [id, ..] => {
            let after = database.find(id).into_diagnostic()?;
            let history = database.history(&after.id);
            let before = history.iter().rev().find(|e| e.record.version < after.version);
            let before = before.ok_or_else(|| {
                miette!(
                    "{}@{} has no version before it: name another record, or --against DIR or --revision REV",
                    after.id,
                    after.version
                )
            })?;
            (&before.record, after)
        }
        [] => return Err(miette!("name a record, or --against DIR, or --revision REV")),
    };
    let difference = Difference::between(before, after);
    if json {
        let value = as_json(before, after, &difference);
        say(&serde_json::to_string_pretty(&value).into_diagnostic()?);
    } else {
        say(&format!(
            "{}@{} to {}@{}",
            before.id, before.version, after.id, after.version
        ));
        for line in lines(&difference) {
            say(&format!("  {line}"));
        }
    }
    Ok(Answer::Done)
}

/// What changed, a line for each; "nothing" where nothing did.
pub(super) fn lines(difference: &Difference) -> Vec<String> {
    let mut lines = Vec::new();
    let words = |value: &Option<String>| value.clone().unwrap_or("nothing".into());
    for f in &difference.fields {
        lines.push(format!(
            "{}: {} to {}",
            f.field,
            words(&f.before),
            words(&f.after)
        ));
    }
    if difference.other_law {
        lines.push("the law has other centres or other parameters".into());
    }
    for p in &difference.parameters {
        let moved = p.after - p.before;
        lines.push(format!(
            "{}: {:.5} to {:.5} {} ({moved:+.2e})",
            p.name, p.before, p.after, p.unit
        ));
    }
    match difference.curve {
        _ if difference.is_empty() => lines.push("nothing changed".into()),
        Some(c) if c.largest_mpa == 0.0 => lines.push("the uniaxial curve did not move".into()),
        Some(c) => lines.push(format!(
            "the uniaxial curve moved by {} of its RMS stress over {:.0} to {:.0} %; at most by {:.2e} MPa, at {:.0} %",
            small_percent(c.relative_rms),
            100.0 * c.strain[0],
            100.0 * c.strain[1],
            c.largest_mpa,
            100.0 * c.largest_at
        )),
        None => lines.push("the curves can't be compared: no law, or no common range of strain".into()),
    }
    lines
}

fn small_percent(part: f64) -> String {
    match part != 0.0 && part < 1e-3 {
        true => format!("{:.1e} %", 100.0 * part),
        false => percent(part),
    }
}

pub(super) fn as_json(before: &MaterialRecord, after: &MaterialRecord, d: &Difference) -> Value {
    let fields: Vec<_> = d
        .fields
        .iter()
        .map(|f| json!({"field": f.field, "before": f.before, "after": f.after}))
        .collect();
    let parameters: Vec<_> = d
        .parameters
        .iter()
        .map(|p| json!({"name": p.name, "unit": p.unit, "before": p.before, "after": p.after}))
        .collect();
    let curve = d.curve.map(|c| {
        json!({
            "engineering_strain": c.strain,
            "relative_rms": c.relative_rms,
            "largest_mpa": c.largest_mpa,
            "largest_at_strain": c.largest_at,
        })
    });
    json!({
        "before": {"id": before.id, "version": before.version},
        "after": {"id": after.id, "version": after.version},
        "same": d.is_empty(),
        "fields": fields,
        "other_law": d.other_law,
        "parameters": parameters,
        "curve": curve,
    })
}

/// Compares two revisions of the database, all records or the named ones.
fn folders(older: &Database, newer: &Database, ids: &[String], json: bool) -> miette::Result<Answer> {
    for broken in older.broken().iter().chain(newer.broken()) {
        warn(&format!("warning: {broken}"));
    }
    for id in ids {
        if older.find(id).is_err() {
            newer.find(id).into_diagnostic()?;
        }
    }
    let wanted = |r: &&MaterialRecord| ids.is_empty() || ids.contains(&r.id);
    let (mut values, mut broken_rules, mut same) = (Vec::new(), Vec::new(), 0);
    for after in newer.records().filter(wanted) {
        let Ok(before) = older.find(&after.id) else {
            if !json {
                say(&format!("{}: new, version {}", after.id, after.version));
            }
            values.push(json!({"after": {"id": after.id, "version": after.version}, "new": true}));
            continue;
        };
        let difference = Difference::between(before, after);
        // Where a record of schema 1 came from was found out when it was rewritten; that is no change.
        let mut known = before.clone();
        known.recipe = known.recipe.or(after.recipe.clone());
        if known == *after {
            same += 1;
            continue;
        }
        if !json {
            say(&format!(
                "{}: version {} to {}",
                after.id, before.version, after.version
            ));
            lines(&difference)
                .iter()
                .for_each(|line| say(&format!("  {line}")));
        }
        values.push(as_json(before, after, &difference));
        if after.version == before.version {
            broken_rules.push(format!(
                "{}: changed, but both are version {}: put the new one with `pliant db add`",
                after.id, after.version
            ));
        } else if after.version < before.version {
            broken_rules.push(format!("{}: version {} is gone", after.id, before.version));
        }
    }
    for before in older
        .entries()
        .iter()
        .chain(older.older())
        .map(|e| &e.record)
        .filter(wanted)
    {
        let name = format!("{}@{}", before.id, before.version);
        match newer.find(&name) {
            Err(_) => broken_rules.push(format!("{name}: no longer there")),
            // The newest ones were compared above.
            Ok(now) if now != before && newer.find(&before.id).is_ok_and(|r| r.version != before.version) => {
                broken_rules.push(format!("{name}: changed"));
            }
            Ok(_) => {}
        }
    }
    if json {
        let value = json!({"changed": values, "same": same, "broken": broken_rules});
        say(&serde_json::to_string_pretty(&value).into_diagnostic()?);
    } else {
        broken_rules.iter().for_each(|rule| say(rule));
        say(&format!(
            "{} records changed or new, {same} the same",
            values.len()
        ));
    }
    Ok(match broken_rules.is_empty() {
        true => Answer::Done,
        false => Answer::Negative,
    })
}

/// The records of the folder as they were at a revision of the git repository around it.
fn checked_out(folder: &Path, revision: &str) -> miette::Result<tempfile::TempDir> {
    if revision.starts_with('-') {
        return Err(miette!("--revision {revision}: expected a commit, branch or tag"));
    }
    let git = |arguments: &[&str]| -> miette::Result<Vec<u8>> {
        let output = Command::new("git")
            .arg("-C")
            .arg(folder)
            .args(arguments)
            .output()
            .into_diagnostic()
            .wrap_err("git can't be run: compare with a copy of the folder, --against DIR")?;
        match output.status.success() {
            true => Ok(output.stdout),
            false => Err(miette!(
                "--revision {revision}: git says: {}",
                String::from_utf8_lossy(&output.stderr).trim()
            )),
        }
    };
    let listed = git(&["ls-tree", "-r", "-z", "--name-only", revision, "--", "."])?;
    let copy = tempfile::tempdir().into_diagnostic()?;
    let mut found = false;
    for name in String::from_utf8_lossy(&listed)
        .split('\0')
        .filter(|n| n.ends_with(".toml"))
    {
        let place = match name.split('/').collect::<Vec<_>>().as_slice() {
            [_] => copy.path().to_path_buf(),
            ["versions", _] => copy.path().join("versions"),
            _ => continue,
        };
        let file = place.join(name.rsplit('/').next().unwrap_or(name));
        let bytes = git(&["show", &format!("{revision}:./{name}")])?;
        std::fs::create_dir_all(&place).into_diagnostic()?;
        std::fs::write(file, bytes).into_diagnostic()?;
        found = true;
    }
    match found {
        true => Ok(copy),
        false => Err(miette!(
            "--revision {revision}: {} held no records then",
            folder.display()
        )),
    }
}
