//! Goal-based design: which material goes into which cell of an object, so that it gives like the examples (Bickel 2010,
//! section 8.4).
//!
//! Rooms: [`goal`] (what the user asks for) and [`goal_text`] (the file as written), [`misfit`] (how far displacements are
//! from the target), [`clusters`] (K-means of tree nodes), [`space`] (the layouts that may be built), [`rules_text`] and [`rules`] (from a goal's rules to them), [`pareto`] (error
//! against mass and cost), [`reach`] (is the goal
//! within the palette's reach?), [`search`] (the decision tree), [`workbench`] (layouts simulated
//! in parallel), [`found`] (what a search leaves on disk).

pub mod clusters;
pub mod found;
pub mod goal;
pub mod goal_text;
pub mod misfit;
pub mod pareto;
pub mod reach;
pub mod rules;
pub mod rules_text;
pub mod search;
pub mod space;
pub mod workbench;
