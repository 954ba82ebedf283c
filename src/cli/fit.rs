//! `pliant fit`: from coupon tests to a material record.

use super::Answer;
use super::terminal::{say, warn};
use crate::fitting::coupon_file::CouponFile;
use crate::fitting::record::{Fitted, fit_coupon};
use crate::material::check::check;
use crate::material::database::Database;
use crate::material::put::{Change, Put};
use miette::{IntoDiagnostic, WrapErr, miette};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Fits materials to coupon tests (pressed, pulled or sheared specimens) and writes their records.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Coupon files: which tests, where their curves are, units, what is assumed
    #[arg(required = true, value_name = "COUPON.toml")]
    coupons: Vec<PathBuf>,
    /// Folder of the material database that the record goes to
    #[arg(long, value_name = "DIR", default_value = "materials-db")]
    out: PathBuf,
    /// Folder that the paths of curves are relative to [default: the coupon file's own]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Write nothing, only fit and report
    #[arg(long)]
    dry_run: bool,
    /// Answer in JSON, for machines
    #[arg(long)]
    json: bool,
}

/// Runs `pliant fit`.
///
/// # Errors
/// A coupon file or curve that makes no sense, a record that can't be written.
pub fn run(arguments: &Arguments) -> miette::Result<Answer> {
    let mut answer = Answer::Done;
    let mut values = Vec::new();
    for path in &arguments.coupons {
        let mut fitted = fit_file(path, arguments.data.as_deref())?;
        // Only a recipe that the database holds can be found again.
        fitted.record.recipe = fitted.record.recipe.filter(|r| arguments.out.join(r).is_file());
        let record = &fitted.record;
        let text = record.to_toml().into_diagnostic()?;
        let findings = check(record, &text);
        let sound = findings.is_empty();
        if !arguments.json {
            report(&fitted);
        }
        for f in &findings {
            warn(&format!("{}: {}: {}", record.id, f.field, f.message));
        }
        let mut written = None;
        if !sound {
            answer = Answer::Negative;
            warn(&format!(
                "{}: not written, since the record would not pass `pliant db check`",
                record.id
            ));
        } else if !arguments.dry_run {
            let put = Database::put(&arguments.out, record).into_diagnostic()?;
            if !arguments.json {
                say(&wrote(&put));
            }
            written = Some(put.file.display().to_string());
        }
        values.push(json!({
            "id": record.id,
            "measurements": serde_json::to_value(&record.measurements).into_diagnostic()?,
            "assumptions": record.assumptions,
            "converged": fitted.fit.as_ref().map(|f| f.stop != crate::numerics::least_squares::Stop::Iterations),
            "findings": findings.iter().map(|f| f.message.clone()).collect::<Vec<_>>(),
            "file": written,
        }));
    }
    if arguments.json {
        say(&serde_json::to_string_pretty(&values).into_diagnostic()?);
    }
    Ok(answer)
}

fn wrote(put: &Put) -> String {
    let (file, version) = (put.file.display(), put.version);
    match put.change {
        Change::First => format!("  wrote {file}"),
        Change::Revised => format!("  wrote {file}, version {version}; the one before is kept"),
        Change::Same => format!("  {file} holds this already, as version {version}"),
    }
}

fn fit_file(path: &Path, data: Option<&Path>) -> miette::Result<Fitted> {
    let text = std::fs::read_to_string(path).map_err(|e| miette!("{}: {e}", path.display()))?;
    let (coupon, unknown) = CouponFile::parse(&text, path).into_diagnostic()?;
    for u in unknown {
        warn(&format!(
            "warning: {}, line {}: {} is not a field that this version knows",
            path.display(),
            u.line,
            u.field
        ));
    }
    let own = path.parent().unwrap_or(Path::new("."));
    let folder = data.unwrap_or(own);
    fit_coupon(&coupon, &|file| std::fs::read(folder.join(file)))
        .into_diagnostic()
        .wrap_err_with(|| format!("fitting {} (curves in {})", path.display(), folder.display()))
}

fn report(fitted: &Fitted) {
    let record = &fitted.record;
    say(&format!(
        "{} ({}), {} centres",
        record.id,
        record.name,
        record.model.centres.len()
    ));
    for m in &record.measurements {
        let [low, high] = m.strain;
        let width = m
            .lateral_relative_rms
            .map_or(String::new(), |e| format!(", width {:.2} %", 100.0 * e));
        say(&format!(
            "  {:21} {:6.1} to {:6.1} %: error {:5.2} % of the RMS stress{width}",
            m.test,
            100.0 * low,
            100.0 * high,
            100.0 * m.relative_rms
        ));
    }
    if let Some(fit) = &fitted.fit {
        say(&format!("  {} steps, stopped by {:?}", fit.iterations, fit.stop));
    }
    for assumption in &record.assumptions {
        say(&format!("  assumed: {assumption}"));
    }
}
