//! What the commands write to the terminal. A closed pipe (`pliant db list | head`) is no error.

use crate::report::table::Look;
use crate::report::terminal_plot::Glyphs;
use std::io::{IsTerminal, Write};

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

/// What curves are drawn with: Braille on a terminal that says it shows UTF-8, ASCII for everything else.
pub fn glyphs() -> Glyphs {
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"]
        .iter()
        .filter_map(|name| std::env::var(name).ok())
        .find(|value| !value.is_empty())
        .unwrap_or_default()
        .to_uppercase();
    let utf8 = cfg!(windows) || locale.contains("UTF-8") || locale.contains("UTF8");
    match utf8 && std::io::stdout().is_terminal() {
        true => Glyphs::Braille,
        false => Glyphs::Ascii,
    }
}

/// How wide a plot may be: the terminal's width, at most 100 letters; 80 where there is none.
pub fn plot_columns() -> usize {
    match Look::of_standard_output() {
        Look::Terminal { width } => usize::from(width).min(100),
        Look::Plain => 80,
    }
}
