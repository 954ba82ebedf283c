//! Goal-based design: which material goes into which cell of an object, so that it gives like the examples (Bickel 2010,
//! section 8.4).
//!
//! Rooms: [`goal`] (what the user asks for) and [`goal_text`] (the file as written), [`misfit`] (how far displacements are
//! from the target), [`space`] (the layouts that may be built), [`rules_text`] and [`rules`] (from a
//! goal's rules to them), [`pareto`] (error against mass and cost), [`reach`] (is the goal
//! within the palette's reach?), [`search`] (three ways through them), [`workbench`] (layouts
//! simulated in parallel), [`journal`] (all of them kept on disk), `processes` (many of them
//! together, with the feature `mpi`), [`voxels`] (layouts of thousands of cells), [`thickness`] (layer borders that move), [`robust`] (what is not known
//! of the materials), [`found`] (what a search leaves on disk).

pub mod found;
pub mod goal;
pub mod goal_text;
pub mod journal;
pub mod misfit;
pub mod pareto;
#[cfg(feature = "mpi")]
pub mod processes;
pub mod reach;
pub mod robust;
pub mod rules;
pub mod rules_text;
pub mod search;
pub mod space;
pub mod thickness;
pub mod voxels;
pub mod workbench;
