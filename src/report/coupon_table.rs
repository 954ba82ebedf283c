//! A comparison of laws as a table: for the terminal, and for a page.

use super::table::{Look, drawn};
use super::ticks::fixed;
use crate::fitting::coupon::compare::Comparison;
use crate::fitting::coupon::fit::TestError;

/// Headers and cells; one row for each law, the least AICc first.
fn cells(comparison: &Comparison) -> (Vec<String>, Vec<Vec<String>>) {
    let mut header: Vec<String> = ["law", "numbers"].map(String::from).to_vec();
    if let Some(row) = comparison.rows.first() {
        header.extend(row.paths.iter().map(|p| format!("{} %", p.kind.word())));
    }
    header.extend(["all %", "AICc", "more than least", "beyond the range"].map(String::from));
    let least = comparison.rows.first().map_or(0.0, |r| r.aicc);
    let rows = comparison.rows.iter().map(|row| {
        let mut cells = vec![row.fit.choice.word().to_string(), row.parameters.to_string()];
        cells.extend(row.fit.errors.iter().map(error_words));
        cells.push(fixed(100.0 * row.fit.relative_rms, 2));
        cells.push(fixed(row.aicc, 1));
        cells.push(fixed(row.aicc - least, 1));
        cells.push(if row.faults.is_empty() {
            "rises, stable".into()
        } else {
            row.faults.join("; ")
        });
        cells
    });
    let rows = rows.collect();
    (header, rows)
}

/// Stress error in percent, and that of the width where it was measured.
pub fn error_words(error: &TestError) -> String {
    let stress = fixed(100.0 * error.relative_rms, 2);
    match error.lateral_relative_rms {
        Some(width) => format!("{stress} (width {})", fixed(100.0 * width, 2)),
        None => stress,
    }
}

/// The table for standard output.
pub fn comparison_table(comparison: &Comparison) -> String {
    comparison_table_as(comparison, Look::of_standard_output())
}

/// The table in a look.
pub fn comparison_table_as(comparison: &Comparison, look: Look) -> String {
    let (header, rows) = cells(comparison);
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let last = header.len() - 1;
    drawn(&header, rows.into_iter(), &[0, last], look)
}

/// The table in Markdown.
pub fn comparison_markdown(comparison: &Comparison) -> String {
    let (header, rows) = cells(comparison);
    let mut text = format!("| {} |\n|---|", header.join(" | "));
    text.push_str(&"---:|".repeat(header.len() - 2));
    text.push_str("---|\n");
    for row in rows {
        text.push_str(&format!("| {} |\n", row.join(" | ")));
    }
    text
}
