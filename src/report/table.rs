//! Tables for the terminal.

use std::io::IsTerminal;

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};

use super::layouts::LayoutRow;
use super::page::MaterialRow;
use super::ticks::{fixed, significant};

/// How a table is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Columns and blanks, each row in one line: for files, pipes and scripts.
    Plain,
    /// Rules, and cells broken to fit so many columns.
    Terminal {
        /// Width of the terminal in characters.
        width: u16,
    },
}

impl Look {
    /// [`Look::Terminal`] if standard output is one, of its width, else [`Look::Plain`].
    pub fn of_standard_output() -> Self {
        if !std::io::stdout().is_terminal() {
            return Self::Plain;
        }
        let width = Table::new().width().unwrap_or(100);
        Self::Terminal { width: width.max(40) }
    }
}

/// The best layouts and their errors, drawn for standard output.
pub fn layout_table(rows: &[LayoutRow]) -> String {
    layout_table_as(rows, Look::of_standard_output())
}

/// The best layouts and their errors.
pub fn layout_table_as(rows: &[LayoutRow], look: Look) -> String {
    let massive = rows.iter().any(|row| row.mass_g.is_some());
    let mut header = vec!["rank", "materials", "RMS mm", "RMS %", "max mm", "max %"];
    header.extend(massive.then_some("mass g"));
    let cells = rows.iter().map(|row| {
        let materials: Vec<String> = row
            .runs()
            .iter()
            .map(|run| format!("{}: {}", run.cell, run.material))
            .collect();
        let mut cells = vec![
            row.heading(),
            materials.join(if look == Look::Plain { "; " } else { "\n" }),
            significant(row.rms_mm, 3),
            fixed(row.rms_percent, 1),
            significant(row.max_mm, 3),
            fixed(row.max_percent, 1),
        ];
        cells.extend(massive.then(|| significant(row.mass_g.unwrap_or(f64::NAN), 3)));
        cells
    });
    drawn(&header, cells, &[0, 1], look)
}

/// The palette, drawn for standard output.
pub fn material_table(rows: &[MaterialRow]) -> String {
    material_table_as(rows, Look::of_standard_output())
}

/// The palette.
pub fn material_table_as(rows: &[MaterialRow], look: Look) -> String {
    let header = ["id", "name", "kind", "E MPa", "Poisson", "g/cm³"];
    let cells = rows.iter().map(|row| {
        vec![
            row.id.clone(),
            row.name.clone(),
            row.kind.clone(),
            significant(row.young_modulus.unwrap_or(f64::NAN), 3),
            significant(row.poisson_ratio.unwrap_or(f64::NAN), 3),
            significant(row.density.unwrap_or(f64::NAN), 3),
        ]
    });
    drawn(&header, cells, &[0, 1, 2], look)
}

/// Any rows under a header; the columns in `words` are aligned left, the others are numbers.
pub fn drawn(
    header: &[&str],
    rows: impl Iterator<Item = Vec<String>>,
    words: &[usize],
    look: Look,
) -> String {
    let mut table = Table::new();
    match look {
        Look::Plain => {
            table
                .load_preset(presets::NOTHING)
                .set_content_arrangement(ContentArrangement::Disabled);
        }
        Look::Terminal { width } => {
            table
                .load_preset(presets::UTF8_HORIZONTAL_ONLY)
                .set_content_arrangement(ContentArrangement::Dynamic);
            table.set_width(width);
        }
    }
    // A name with a control character must not steer the terminal.
    let tame = |cell: String| -> String {
        cell.chars()
            .map(|c| {
                if c.is_control() && c != '\n' {
                    '\u{fffd}'
                } else {
                    c
                }
            })
            .collect()
    };
    table.set_header(header.iter().copied());
    for row in rows {
        table.add_row(row.into_iter().map(tame));
    }
    for (index, column) in table.column_iter_mut().enumerate() {
        if !words.contains(&index) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
        .lines()
        .map(|line| line.trim_end().to_owned())
        .collect::<Vec<_>>()
        .join("\n")
}

#[cfg(test)]
mod tests {
    use super::super::colour::Colour;
    use super::super::layouts::CellChoice;
    use super::*;

    fn rows() -> Vec<LayoutRow> {
        let cell = |cell: &str, material: &str| CellChoice {
            cell: cell.to_owned(),
            material: material.to_owned(),
            colour: Colour::qualitative(1),
        };
        let row = |rank, note: &str, rms_mm| LayoutRow {
            rank,
            note: note.to_owned(),
            cells: vec![cell("heel", "EcoFlex 00-30"), cell("toe", "Dragon\u{1b}[31mSkin")],
            rms_mm,
            rms_percent: 1.26,
            max_mm: 0.204,
            max_percent: f64::NAN,
            mass_g: None,
        };
        vec![row(Some(1), "", 0.0673), row(None, "best single", 1.2)]
    }

    #[test]
    fn a_plain_row_is_one_line_without_escapes() {
        let text = layout_table_as(&rows(), Look::Plain);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 3, "{text}");
        assert!(
            lines[1].contains("heel: EcoFlex 00-30; toe: Dragon\u{fffd}[31mSkin"),
            "{text}"
        );
        assert!(
            lines[1].contains("0.0673") && lines[1].contains("1.3") && lines[1].ends_with('–'),
            "{text}"
        );
        assert!(lines[2].contains("best single"));
        assert!(!text.contains('\u{1b}'));
    }

    #[test]
    fn a_terminal_is_not_overrun() {
        for width in [50, 80, 120] {
            let text = layout_table_as(&rows(), Look::Terminal { width });
            assert!(
                text.lines()
                    .all(|line| line.chars().count() <= usize::from(width)),
                "{text}"
            );
        }
    }
}
