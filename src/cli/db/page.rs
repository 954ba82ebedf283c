//! `pliant db page`.

use super::super::Answer;
use super::super::terminal::{say, warn};
use crate::material::database::Database;
use crate::report::database_page::database_page;
use crate::units::whole_file::replace_file;
use miette::{IntoDiagnostic, miette};
use serde_json::json;
use std::path::Path;

/// Writes the page of all materials.
pub(super) fn run(database: &Database, file: &Path, json: bool) -> miette::Result<Answer> {
    let (page, troubles) = database_page(database);
    for trouble in &troubles {
        warn(&format!("warning: not on the page: {trouble}"));
    }
    replace_file(file, page.as_bytes()).map_err(|e| miette!("{}: {e}", file.display()))?;
    if json {
        let value = json!({"file": file.display().to_string(), "materials": database.entries().len(), "left_out": troubles});
        say(&serde_json::to_string_pretty(&value).into_diagnostic()?);
    } else {
        say(&format!("wrote {}", file.display()));
    }
    Ok(Answer::Done)
}
