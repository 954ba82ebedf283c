//! The rows that the page and the terminal share: a layout with its errors.

use super::colour::Colour;

/// The material of one cell of a layout.
#[derive(Clone, Debug, PartialEq)]
pub struct CellChoice {
    /// The cell's name, as in `heel 2`.
    pub cell: String,
    /// The material's name.
    pub material: String,
    /// The material's display colour.
    pub colour: Colour,
}

/// A layout and how close it comes to the goal.
#[derive(Clone, Debug, PartialEq)]
pub struct LayoutRow {
    /// 1 for the best; `None` for a row that is only there to compare with.
    pub rank: Option<usize>,
    /// What is special about it, as in `best single material`; empty for nothing.
    pub note: String,
    /// The material of each cell, in the goal's order.
    pub cells: Vec<CellChoice>,
    /// Root of the mean square displacement error \[mm\].
    pub rms_mm: f64,
    /// The same in percent of the largest target displacement.
    pub rms_percent: f64,
    /// The largest displacement error \[mm\].
    pub max_mm: f64,
    /// The same in percent of the largest target displacement.
    pub max_percent: f64,
    /// The object's mass \[g\], where the densities are known.
    pub mass_g: Option<f64>,
}

impl LayoutRow {
    /// `1`, `2`, … or the note of a row without a rank.
    pub fn heading(&self) -> String {
        match (self.rank, self.note.is_empty()) {
            (Some(rank), true) => rank.to_string(),
            (Some(rank), false) => format!("{rank} ({})", self.note),
            (None, true) => "–".to_owned(),
            (None, false) => self.note.clone(),
        }
    }

    /// The cells with neighbours of one material joined, region by region: `heel 1 – heel 3` once instead of three
    /// times, where a region is what stands before the last blank of a cell's name; `all` where all are alike.
    pub fn runs(&self) -> Vec<CellChoice> {
        let alike = |a: &CellChoice, b: &CellChoice| a.material == b.material && a.colour == b.colour;
        if let [first, rest @ ..] = self.cells.as_slice()
            && !rest.is_empty()
            && rest.iter().all(|cell| alike(cell, first))
        {
            return vec![CellChoice {
                cell: "all".to_owned(),
                ..first.clone()
            }];
        }
        let same_run = |a: &CellChoice, b: &CellChoice| alike(a, b) && region(&a.cell) == region(&b.cell);
        let joined = |run: &[CellChoice]| match run {
            [first, .., last] => CellChoice {
                cell: format!("{} – {}", first.cell, last.cell),
                ..first.clone()
            },
            _ => run[0].clone(),
        };
        self.cells.chunk_by(same_run).map(joined).collect()
    }
}

fn region(cell: &str) -> &str {
    cell.rsplit_once(' ').map_or("", |(region, _)| region)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_of_one_material_are_joined() {
        let cell = |cell: &str, material: &str| CellChoice {
            cell: cell.to_owned(),
            material: material.to_owned(),
            colour: Colour::qualitative(1),
        };
        let mut row = LayoutRow {
            rank: Some(1),
            note: String::new(),
            cells: vec![
                cell("toe 1", "a"),
                cell("toe 2", "a"),
                cell("toe 3", "b"),
                cell("heel 1", "b"),
            ],
            rms_mm: 0.1,
            rms_percent: 1.0,
            max_mm: 0.2,
            max_percent: 2.0,
            mass_g: None,
        };
        let runs = |row: &LayoutRow| -> Vec<String> {
            row.runs()
                .into_iter()
                .map(|run| format!("{}={}", run.cell, run.material))
                .collect()
        };
        assert_eq!(runs(&row), ["toe 1 – toe 2=a", "toe 3=b", "heel 1=b"]);
        row.cells.truncate(2);
        assert_eq!(runs(&row), ["all=a"]);
        row.cells.truncate(1);
        assert_eq!(runs(&row), ["toe 1=a"]);
        row.cells.clear();
        assert!(row.runs().is_empty());
        assert_eq!(row.heading(), "1");
    }
}
