//! Generators of the objects that ship with pliant: closed, manifold, outward surfaces. Rooms: [`block`](mod@block).

pub mod block;

pub use block::block;

use thiserror::Error;

/// An option of a generator that makes no shape.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{option} = {value}: expected {expected}")]
pub struct ShapeError {
    /// The option's name.
    pub option: &'static str,
    /// What it was \[mm\].
    pub value: f64,
    /// What it may be.
    pub expected: String,
}

/// Answers the value if it lies in the range.
pub(super) fn within(option: &'static str, value: f64, lo: f64, hi: f64) -> Result<f64, ShapeError> {
    if value >= lo && value <= hi {
        Ok(value)
    } else {
        Err(ShapeError {
            option,
            value,
            expected: format!("{lo} to {hi} mm"),
        })
    }
}
