//! Goal-based design: which material goes into which cell of an object, so that it gives like the examples (Bickel 2010,
//! section 8.4).
//!
//! Rooms: [`goal`] (what the user asks for) and [`goal_text`] (the file as written), [`misfit`] (how far displacements are
//! from the target), [`rules_text`] and [`rules`] (what may be built, as a goal says it), [`space`] (the layouts that
//! keep these rules), [`reach`] (is the goal within the palette's reach?), [`search`] (three ways through the
//! space), [`pareto`] (error against mass and cost), [`workbench`] (layouts simulated in parallel), [`journal`] (all of
//! them kept on disk), `processes` (many of them together, with the feature `mpi`), [`thickness`] (layer borders that
//! move), [`robust`] (what is not known of the materials), [`found`] (what a search leaves on disk).

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
pub mod workbench;
