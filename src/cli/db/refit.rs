//! `pliant db refit`: fits a record again from what it was fitted from, and says by how much it moved.

use super::super::Answer;
use super::super::terminal::{say, warn};
use super::super::{fit_probe, stop};
use super::{add, check, diff, warn_of_unknown};
use crate::fem::measurement_set::MeasurementSet;
use crate::fem::specimen::Specimen;
use crate::fitting::coupon::file::CouponFile;
use crate::fitting::coupon::record::fit_coupon;
use crate::fitting::probe::fit::{self as probe, ProbeOptions};
use crate::fitting::probe::press::PressedSpecimen;
use crate::fitting::probe::record::record as probe_record;
use crate::fitting::probe::start::Symmetry;
use crate::material::check::check as findings_of;
use crate::material::database::{Database, Entry};
use crate::material::difference::Difference;
use crate::material::record::MaterialRecord;
use crate::report::database::tests_words;
use miette::{IntoDiagnostic, WrapErr, miette};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Which record, from which data.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Its id; ID@N compares with version N
    id: String,
    /// Folder that the paths of curves are relative to [default: the recipe's own]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Put the new fit into the database, as the next version where it differs
    #[arg(long)]
    write: bool,
}

/// Fits a record again.
pub(super) fn run(database: &Database, options: &Arguments, json: bool) -> miette::Result<Answer> {
    let entry = database.entry(&options.id).into_diagnostic()?;
    let before = &entry.record;
    let after = fitted(database.folder(), before, options.data.as_deref())?;
    let difference = Difference::between(before, &after);
    let text = after.to_toml().into_diagnostic()?;
    let findings = findings_of(&after, &text);
    let shown = Entry {
        record: after,
        file: entry.file.clone(),
        text,
        unknown: Vec::new(),
    };
    for finding in &findings {
        warn(&format!("the new fit: {}", check::line(&shown, finding)));
    }
    let put = match (options.write, findings.is_empty()) {
        (true, true) => Some(Database::put(database.folder(), &shown.record).into_diagnostic()?),
        (true, false) => {
            warn("not written, since the record would not pass `pliant db check`");
            None
        }
        (false, _) => None,
    };
    if json {
        let mut value = diff::as_json(before, &shown.record, &difference);
        value["after"] = json!({"id": shown.record.id});
        value["measurements"] = serde_json::to_value(&shown.record.measurements).into_diagnostic()?;
        value["findings"] = findings.iter().map(|f| f.message.clone()).collect();
        value["written"] = put.as_ref().map(|put| add::as_json(&before.id, put)).into();
        say(&serde_json::to_string_pretty(&value).into_diagnostic()?);
    } else {
        say(&format!(
            "{}@{} fitted again from {}",
            before.id,
            before.version,
            recipe_of(before)?
        ));
        say(&format!("  errors before: {}", tests_words(before)));
        say(&format!("  errors now:    {}", tests_words(&shown.record)));
        diff::lines(&difference)
            .iter()
            .for_each(|line| say(&format!("  {line}")));
        match &put {
            Some(put) => say(&add::sentence(&before.id, put)),
            None if findings.is_empty() => say("nothing was written; --write puts it into the database"),
            None => {}
        }
    }
    Ok(match findings.is_empty() {
        true => Answer::Done,
        false => Answer::Negative,
    })
}

fn recipe_of(record: &MaterialRecord) -> miette::Result<&str> {
    record.recipe.as_deref().ok_or_else(|| {
        miette!(
            "{} does not say what it was fitted from (recipe): fit it with `pliant fit` from a file in the database's folder",
            record.id
        )
    })
}

/// The record that its recipe makes today.
fn fitted(folder: &Path, record: &MaterialRecord, data: Option<&Path>) -> miette::Result<MaterialRecord> {
    let file = folder.join(recipe_of(record)?);
    let text = std::fs::read_to_string(&file).map_err(|e| miette!("{}: {e}", file.display()))?;
    let mut after = match fit_probe::is_set(&text) {
        true => fitted_to_presses(&file, record)?,
        false => fitted_to_coupons(&file, &text, record, data)?,
    };
    after.recipe = record.recipe.clone();
    after.version = record.version;
    after.previous_sha256 = record.previous_sha256.clone();
    Ok(after)
}

/// The record that a measurement set makes today, with the law's form of the record before.
fn fitted_to_presses(file: &Path, record: &MaterialRecord) -> miette::Result<MaterialRecord> {
    let set = MeasurementSet::open(file).into_diagnostic()?;
    if set.material.id != record.id {
        return Err(other_id(file, &set.material.id, &record.id));
    }
    let specimen = Specimen::new(&set).into_diagnostic()?;
    let mut pressed = PressedSpecimen::new(&set, &specimen);
    let mut symmetry = Symmetry::of(&set.material);
    symmetry.formulation = record.model.formulation;
    let flag = stop::flag();
    let cancelled = || flag.load(std::sync::atomic::Ordering::Relaxed);
    let fit = probe::fit(
        &mut pressed,
        symmetry,
        &ProbeOptions::suited(&set),
        &cancelled,
        &mut |_| {},
    )
    .into_diagnostic()
    .wrap_err_with(|| format!("fitting {}", file.display()))?;
    if !fit.has_converged() {
        return Err(miette!(
            "{}: the fit did not end by itself ({:?}); nothing is compared",
            file.display(),
            fit.stop
        ));
    }
    probe_record(&set, &fit, None).into_diagnostic()
}

fn other_id(file: &Path, found: &str, expected: &str) -> miette::Report {
    miette!(
        "{}: id = {found:?}: expected {expected:?}, whose recipe it is",
        file.display()
    )
}

/// The record that a coupon file makes today.
fn fitted_to_coupons(
    file: &Path,
    text: &str,
    record: &MaterialRecord,
    data: Option<&Path>,
) -> miette::Result<MaterialRecord> {
    let (coupon, unknown) = CouponFile::parse(text, file).into_diagnostic()?;
    warn_of_unknown(file, &unknown);
    if coupon.id != record.id {
        return Err(other_id(file, &coupon.id, &record.id));
    }
    let own = file.parent().unwrap_or(Path::new("."));
    let data = data.unwrap_or(own);
    let lateral = |t: &crate::fitting::coupon::file::Test| t.lateral.as_ref().map(|l| l.file.clone());
    let files = coupon
        .tests
        .iter()
        .flat_map(|t| [Some(t.file.clone()), lateral(t)])
        .flatten();
    let missing: Vec<String> = files.filter(|f| !data.join(f).is_file()).collect();
    if !missing.is_empty() {
        return Err(miette!(
            "{} can't be fitted again: {} not in {}: name the folder of the measurements with --data; they come from {}",
            record.id,
            missing.join(", "),
            data.display(),
            record.source.link.as_ref().unwrap_or(&record.source.citation)
        ));
    }
    let fitted = fit_coupon(&coupon, &|file| std::fs::read(data.join(file)))
        .into_diagnostic()
        .wrap_err_with(|| format!("fitting {} (curves in {})", file.display(), data.display()))?;
    Ok(fitted.record)
}
