//! Options that make no shape.

use thiserror::Error;

/// An option of a generator that makes no shape.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{option} = {value} mm: expected {expected}")]
pub struct ShapeError {
    /// The option's name.
    pub option: &'static str,
    /// What it was \[mm\].
    pub value: f64,
    /// What it may be.
    pub expected: String,
}

/// Checks that the value \[mm\] lies in the range.
///
/// # Errors
/// [`ShapeError`] if not, or if it is no number.
pub(super) fn within(option: &'static str, value: f64, lo: f64, hi: f64) -> Result<(), ShapeError> {
    if value >= lo && value <= hi {
        Ok(())
    } else {
        Err(ShapeError {
            option,
            value,
            expected: format!("{lo} to {hi} mm"),
        })
    }
}
