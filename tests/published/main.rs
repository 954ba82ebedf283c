//! Checks against tables and figures of the papers.

mod thesis_validation;
