//! What the commands write to the terminal. A closed pipe (`pliant db list | head`) is no error.

use std::io::Write;

/// Writes `text` and a newline to standard output; a reader that went away is ignored.
pub fn say(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "{text}");
}

/// Writes `text` and a newline to standard error.
pub fn warn(text: &str) {
    let mut err = std::io::stderr().lock();
    let _ = writeln!(err, "{text}");
}

/// Writes an error with its help and its place in the file, if it has one, to standard error.
pub fn complain(report: &miette::Report) {
    warn(&format!("{report:?}"));
}
