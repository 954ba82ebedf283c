//! The real binary, as its users run it.

mod goals;
mod replicate;
mod shape;
mod support;
