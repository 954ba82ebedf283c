//! The page that the checks make: Markdown, the same bytes from the same findings, without times or machines.

use super::record::{Demand, Found, Row};
use super::{Check, Findings};
use crate::report::ticks::significant;
use std::io::{self, Write};

/// What stands before the checks on the page, and after them: the tests that are no checks of `pliant verify`.
const OPENING: &str = include_str!("page_opening.md");
const CLOSING: &str = include_str!("page_closing.md");

/// Writes the page of all checks, in their order.
///
/// # Errors
/// What `out` says.
pub fn write_page(outcomes: &[(&Check, Findings)], out: &mut impl Write) -> io::Result<()> {
    out.write_all(OPENING.as_bytes())?;
    for (check, findings) in outcomes {
        let verdict = if findings.passed() { "" } else { " – FAILS" };
        writeln!(out, "\n### {}{verdict}\n", check.title)?;
        writeln!(out, "`{}`. {}\n", check.id, check.against)?;
        writeln!(out, "| quantity | expected | found | tolerance | |")?;
        writeln!(out, "|---|---:|---:|---:|---|")?;
        for row in &findings.rows {
            // A bar would end the cell.
            let [quantity, expected, found, tolerance] = cells(row).map(|cell| cell.replace('|', "\\|"));
            let mark = match row.demand {
                Demand::Stated { .. } => "stated",
                _ if row.passed() => "holds",
                _ => "**fails**",
            };
            writeln!(
                out,
                "| {quantity} | {expected} | {found} | {tolerance} | {mark} |"
            )?;
        }
        if !findings.note.is_empty() {
            writeln!(out, "\n{}", findings.note)?;
        }
    }
    out.write_all(CLOSING.as_bytes())
}

/// Quantity, expected, found and tolerance in words.
pub fn cells(row: &Row) -> [String; 4] {
    let quantity = match row.unit {
        "" => row.quantity.clone(),
        unit => format!("{} [{unit}]", row.quantity),
    };
    let digits = row.digits.max(1);
    let expected = match &row.demand {
        Demand::Near { expected, .. } | Demand::Stated { expected } => significant(*expected, digits),
        Demand::AtMost(bound) => format!("≤ {}", significant(*bound, 2)),
        Demand::AtLeast(bound) => format!("≥ {}", significant(*bound, 3)),
        Demand::Words(words) => words.clone(),
    };
    let found = match (&row.found, &row.demand) {
        (Found::Words { text, .. }, _) => text.clone(),
        // Digits of an error at the level of rounding differ from machine to machine.
        (Found::Number(_), Demand::AtMost(_)) if row.passed() => "below".into(),
        (Found::Number(found), _) => significant(*found, digits),
    };
    let tolerance = match &row.demand {
        Demand::Near { expected, tolerance } if expected.abs() > 0.0 => {
            format!("{} %", significant(100.0 * tolerance / expected.abs(), 2))
        }
        Demand::Near { tolerance, .. } => significant(*tolerance, 2),
        _ => "–".into(),
    };
    [quantity, expected, found, tolerance]
}
