//! `pliant export`: the printer's files of a layout that was found before, without a search.

use super::Answer;
use super::terminal::{say, warn};
use crate::design::found::Found;
use crate::design::goal::Goal;
use crate::fabrication::export::write_export;
use crate::fabrication::layout::{export_options, export_parts, tile_layout};
use crate::material::database::Database;
use miette::{IntoDiagnostic, miette};
use std::path::{Path, PathBuf};

/// Writes the printer's files of the layout in DESIGN/found: one 3MF, one STL per material, and a manifest.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder of the design, as given to `pliant replicate`
    #[arg(value_name = "DESIGN")]
    design: PathBuf,
    /// Folder of the material database
    #[arg(long, value_name = "DIR", default_value = "materials-db")]
    db: PathBuf,
    /// The layout file [default: DESIGN/found/layout.toml]
    #[arg(long, value_name = "FILE")]
    layout: Option<PathBuf>,
    /// Where the files go [default: export/NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Spacing of the lattice that the parts are cut from, in mm [default: by the thinnest layer]
    #[arg(long, value_name = "MM")]
    spacing: Option<f64>,
    /// Answer in JSON, for machines
    #[arg(long)]
    json: bool,
}

/// Runs `pliant export`.
///
/// # Errors
/// A design without a found layout, a goal that changed since, files that cannot be written.
pub fn run(arguments: &Arguments) -> miette::Result<Answer> {
    let database = Database::open(&arguments.db).into_diagnostic()?;
    let goal = Goal::read(&arguments.design, &database).into_diagnostic()?;
    for warning in &goal.setup.object.warnings {
        warn(&format!("warning: {warning}"));
    }
    let file = arguments
        .layout
        .clone()
        .unwrap_or_else(|| goal.folder().join("found").join("layout.toml"));
    let found = Found::read(&file).into_diagnostic()?;
    let (layout, _) = found.layout(&goal, &file).into_diagnostic()?;
    let goal = found.on(goal, &file).into_diagnostic()?;
    let mut options = export_options(&goal);
    options.spacing_mm = arguments.spacing;
    let tiling =
        tile_layout(&goal, &layout, None, &options).map_err(|e| miette!("{}: {e}", goal.file().display()))?;
    let name = name_of(&goal);
    let folder = arguments
        .out
        .clone()
        .unwrap_or_else(|| Path::new("export").join(&name));
    let parts = export_parts(&goal, tiling);
    let meta = super::replicate_outcome::export_meta(&goal, &found);
    let manifest = write_export(&folder, &name, &parts, &meta).into_diagnostic()?;
    if arguments.json {
        say(&serde_json::to_string_pretty(&manifest).into_diagnostic()?);
        return Ok(Answer::Done);
    }
    for part in &parts {
        say(&format!(
            "{:>10.1} cm³  {}",
            1e-3 * part.volume_mm3,
            part.material_name
        ));
    }
    say(&format!("export  {}", folder.display()));
    Ok(Answer::Done)
}

/// The name of a design's files: its folder's, or the goal's file's.
pub fn name_of(goal: &Goal) -> String {
    let folder = goal.folder().canonicalize().ok();
    let own = folder
        .as_deref()
        .and_then(Path::file_name)
        .map(|n| n.to_string_lossy().into_owned());
    plain(own.as_deref().unwrap_or_default())
}

/// A name as a file may bear it anywhere: ASCII letters, digits, `-`, `_` and `.`, the first one no `.`.
pub fn plain(name: &str) -> String {
    let allowed = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let kept: String = name
        .trim_start_matches('.')
        .chars()
        .map(|c| if allowed(c) { c } else { '-' })
        .collect();
    if kept.is_empty() { "design".into() } else { kept }
}
