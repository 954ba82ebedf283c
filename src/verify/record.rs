//! What a check demanded and what it found.

/// What a quantity must be.
#[derive(Clone, Debug, PartialEq)]
pub enum Demand {
    /// Within `tolerance` of `expected`, both in the quantity's unit.
    Near {
        /// What it should be.
        expected: f64,
        /// How far it may be off.
        tolerance: f64,
    },
    /// At most this much. For errors: below the bound their digits are rounding, and the page leaves them out.
    AtMost(f64),
    /// At least this much.
    AtLeast(f64),
    /// Nothing: stated for comparison with `expected`, which the check does not claim to meet.
    Stated {
        /// What others found.
        expected: f64,
    },
    /// These words.
    Words(String),
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// A number in the quantity's unit.
    Number(f64),
    /// An answer in words, and whether it is the one demanded.
    Words {
        /// The answer.
        text: String,
        /// Is it what was demanded?
        is_right: bool,
    },
}

/// One line of a check.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of the quantity, without its unit.
    pub quantity: String,
    /// Its unit; empty for a pure number.
    pub unit: &'static str,
    /// What it must be.
    pub demand: Demand,
    /// What it is.
    pub found: Found,
    /// Significant digits that the page shows.
    pub digits: usize,
}

impl Row {
    /// A number that must lie within `tolerance` of `expected`.
    pub fn near(
        quantity: impl Into<String>,
        unit: &'static str,
        expected: f64,
        found: f64,
        tolerance: f64,
    ) -> Row {
        Row::new(quantity, unit, Demand::Near { expected, tolerance }, found)
    }

    /// A number that must lie within the share `relative` of `expected`.
    pub fn within(
        quantity: impl Into<String>,
        unit: &'static str,
        expected: f64,
        found: f64,
        relative: f64,
    ) -> Row {
        Row::near(quantity, unit, expected, found, relative * expected.abs())
    }

    /// An error that must stay below `bound`.
    pub fn at_most(quantity: impl Into<String>, unit: &'static str, bound: f64, found: f64) -> Row {
        Row::new(quantity, unit, Demand::AtMost(bound), found)
    }

    /// A number that must reach `bound`.
    pub fn at_least(quantity: impl Into<String>, unit: &'static str, bound: f64, found: f64) -> Row {
        Row::new(quantity, unit, Demand::AtLeast(bound), found)
    }

    /// A number beside that of others, without a demand.
    pub fn stated(quantity: impl Into<String>, unit: &'static str, expected: f64, found: f64) -> Row {
        Row::new(quantity, unit, Demand::Stated { expected }, found)
    }

    /// An answer in words.
    pub fn answer(
        quantity: impl Into<String>,
        expected: impl Into<String>,
        text: String,
        is_right: bool,
    ) -> Row {
        Row {
            quantity: quantity.into(),
            unit: "",
            demand: Demand::Words(expected.into()),
            found: Found::Words { text, is_right },
            digits: 0,
        }
    }

    /// The same with so many significant digits on the page (five otherwise).
    pub fn digits(self, digits: usize) -> Row {
        Row { digits, ..self }
    }

    fn new(quantity: impl Into<String>, unit: &'static str, demand: Demand, found: f64) -> Row {
        Row {
            quantity: quantity.into(),
            unit,
            demand,
            found: Found::Number(found),
            digits: 5,
        }
    }

    /// Is the demand met? A number that is not finite meets none.
    pub fn passed(&self) -> bool {
        let found = match &self.found {
            Found::Words { is_right, .. } => return *is_right,
            Found::Number(found) => *found,
        };
        found.is_finite()
            && match &self.demand {
                Demand::Near { expected, tolerance } => (found - expected).abs() <= *tolerance,
                Demand::AtMost(bound) => found <= *bound,
                Demand::AtLeast(bound) => found >= *bound,
                Demand::Stated { .. } => true,
                Demand::Words(_) => false,
            }
    }
}

/// What a check came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// Its lines.
    pub rows: Vec<Row>,
    /// What a reader has to know: how the tolerances were chosen, what is not met.
    pub note: String,
}

impl Findings {
    /// Rows under a note.
    pub fn new(rows: Vec<Row>, note: &str) -> Findings {
        Findings {
            rows,
            note: note.into(),
        }
    }

    /// Is there a line, and is every demand met?
    pub fn passed(&self) -> bool {
        !self.rows.is_empty() && self.rows.iter().all(Row::passed)
    }

    /// The lines that fail, in words.
    pub fn failures(&self) -> Vec<String> {
        let failed = self.rows.iter().filter(|row| !row.passed());
        failed.map(|row| format!("{row:?}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn demands_can_fail() {
        assert!(
            Row::near("u", "mm", 2.0, 2.1, 0.11).passed() && !Row::near("u", "mm", 2.0, 2.1, 0.09).passed()
        );
        assert!(Row::within("u", "mm", -2.0, -2.1, 0.06).passed());
        assert!(!Row::within("u", "mm", -2.0, -2.1, 0.04).passed());
        assert!(Row::at_most("e", "", 1.0, 1.0).passed() && !Row::at_most("e", "", 1.0, 1.1).passed());
        assert!(Row::at_least("e", "", 1.0, 1.0).passed() && !Row::at_least("e", "", 1.0, 0.9).passed());
        assert!(!Row::answer("a", "yes", "no".into(), false).passed());
        for row in [
            Row::at_most("e", "", 1.0, f64::NAN),
            Row::near("e", "", f64::NAN, 1.0, 1.0),
            Row::stated("e", "", 1.0, f64::NAN),
        ] {
            assert!(!row.passed(), "{row:?}");
        }
        assert!(
            !Findings::default().passed(),
            "a check that checks nothing has not passed"
        );
    }
}
