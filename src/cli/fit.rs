//! `pliant fit`: from coupon tests or presses with a probe to a material record.

use super::Answer;
use super::terminal::say;
use super::{fit_coupon, fit_probe};
use miette::{IntoDiagnostic, miette};
use std::path::{Path, PathBuf};

/// Fits materials to coupon tests (pressed, pulled or sheared specimens) or to measurement sets (a specimen pressed with a
/// probe) and writes their records.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Coupon files (which tests, where their curves are, units, what is assumed) and measurement sets, which have a
    /// [specimen]
    #[arg(required = true, value_name = "FILE.toml")]
    pub(super) coupons: Vec<PathBuf>,
    /// Folder of the material database that the record goes to
    #[arg(long, value_name = "DIR", default_value = "materials-db")]
    pub(super) out: PathBuf,
    /// Folder that the paths of curves are relative to [default: the coupon file's own]
    #[arg(long, value_name = "DIR")]
    pub(super) data: Option<PathBuf>,
    /// Write no record, only fit and report
    #[arg(long)]
    pub(super) dry_run: bool,
    /// Fit the other laws too, and say which to trust inside the range and beyond it
    #[arg(long)]
    pub(super) compare: bool,
    /// Resample the residuals so many times: a band on the curves, and the covariance of the record
    #[arg(long, value_name = "SAMPLES", value_parser = clap::value_parser!(u32).range(20..=100_000))]
    pub(super) bootstrap: Option<u32>,
    /// Seed of the resampling
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    pub(super) seed: u64,
    /// Draw measured points, laws and residuals into this folder
    #[arg(long, value_name = "DIR")]
    pub(super) plots: Option<PathBuf>,
    /// Write a page of all fits in Markdown, with the drawings of --plots
    #[arg(long, value_name = "FILE.md")]
    pub(super) page: Option<PathBuf>,
    /// Measurement sets: centres in strain space [default: 6, transversely isotropic 12; 1 for a homogeneous law]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=60))]
    pub(super) centres: Option<u16>,
    /// Measurement sets: interpolate an energy in place of a stiffness (isotropic materials)
    #[arg(long)]
    pub(super) energy: bool,
    /// Measurement sets: take the probe's force as measured, without estimating its tangential part
    #[arg(long)]
    pub(super) no_tangential: bool,
    /// Answer in JSON, for machines
    #[arg(long)]
    pub(super) json: bool,
}

/// Runs `pliant fit`.
///
/// # Errors
/// A coupon file or curve that makes no sense, a record or drawing that can't be written.
pub fn run(arguments: &Arguments) -> miette::Result<Answer> {
    let mut answer = Answer::Done;
    let mut values = Vec::new();
    let mut entries = Vec::new();
    for path in &arguments.coupons {
        let text = read(path)?;
        if fit_probe::is_set(&text) {
            let (own, value) = fit_probe::run(arguments, path)?;
            if own == Answer::Negative {
                answer = Answer::Negative;
            }
            values.push(value);
            continue;
        }
        let done = fit_coupon::run(arguments, path, &text)?;
        if done.answer == Answer::Negative {
            answer = Answer::Negative;
        }
        values.push(done.value);
        entries.push(done.entry);
    }
    if let Some(file) = &arguments.page {
        fit_coupon::write_page(file, &entries)?;
        if !arguments.json {
            say(&format!("wrote {}", file.display()));
        }
    }
    if arguments.json {
        say(&serde_json::to_string_pretty(&values).into_diagnostic()?);
    }
    Ok(answer)
}

fn read(path: &Path) -> miette::Result<String> {
    std::fs::read_to_string(path).map_err(|e| miette!("{}: {e}", path.display()))
}
