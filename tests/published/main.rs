//! Checks against tables and figures of the papers.

mod insole;
mod leap;
mod thesis_validation;
