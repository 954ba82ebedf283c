//! `pliant db`: the database of materials. One file per subcommand.

mod add;
mod check;
mod compare;
mod diff;
mod export;
mod list;
mod page;
mod refit;
mod show;

use super::Answer;
use super::terminal::warn;
use crate::material::database::Database;
use crate::material::record::Unknown;
use clap::Subcommand;
use miette::IntoDiagnostic;
use std::path::{Path, PathBuf};

/// Lists, shows, compares and checks the materials of the database, and adds to it.
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
    /// Lists a line per material: stiffness at rest and pressed, density, range measured, error of the fit, source
    List(list::Arguments),
    /// Shows all about one material, with its curve under pressing and pulling
    Show(show::Arguments),
    /// Shows several materials, or versions of one, in one plot and one table
    Compare(compare::Arguments),
    /// Checks records and puts them into the database: a new version where one of that id is there
    Add {
        /// Files of records
        #[arg(required = true, value_name = "RECORD.toml")]
        files: Vec<PathBuf>,
    },
    /// Examines every record: units, positive stiffness, rising curves, source, older versions; exit code 1 if one fails
    Check,
    /// Fits a record again from what it was fitted from, and says by how much it moved
    Refit(refit::Arguments),
    /// Says what changed between two records, or between this database and another revision of it
    Diff(diff::Arguments),
    /// Writes a material for FEBio, CalculiX or Abaqus, or as JSON
    Export(export::Arguments),
    /// Writes one HTML page of all materials, with their curves, to filter and sort in a browser
    Page {
        /// The file
        #[arg(long, value_name = "FILE.html")]
        out: PathBuf,
    },
    /// Rewrites records of older schemas in this version's; their content stays
    Migrate,
}

/// Runs `pliant db`.
///
/// # Errors
/// If the folder or the material asked for can't be read, or a record can't be written.
pub fn run(arguments: &Arguments) -> miette::Result<Answer> {
    let json = arguments.json;
    match &arguments.command {
        Action::Add { files } => return add::run(&arguments.db, files, json),
        Action::Migrate => return add::migrate(&arguments.db, json),
        _ => {}
    }
    let database = Database::open(&arguments.db).into_diagnostic()?;
    for entry in database.entries() {
        warn_of_unknown(&entry.file, &entry.unknown);
    }
    match &arguments.command {
        Action::List(options) => list::run(&database, options, json),
        Action::Show(options) => show::run(&database, options, json),
        Action::Compare(options) => compare::run(&database, options, json),
        Action::Refit(options) => refit::run(&database, options, json),
        Action::Diff(options) => diff::run(&database, options, json),
        Action::Export(options) => export::run(&database, options, json),
        Action::Page { out } => page::run(&database, out, json),
        Action::Check | Action::Add { .. } | Action::Migrate => check::run(&database, json),
    }
}

/// Names the fields of a file that this version does not know.
fn warn_of_unknown(file: &Path, unknown: &[Unknown]) {
    for u in unknown {
        warn(&format!(
            "warning: {}, line {}: {} is not a field that this version knows; it is kept",
            file.display(),
            u.line,
            u.field
        ));
    }
}
