//! Checks against tables and figures of the papers.

mod insole;
mod thesis_validation;
