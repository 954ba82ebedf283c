//! Fits of materials to measurements.

mod probe;
mod twin;
