//! Goal-based design: which material goes into which cell of an object, so that it gives like the examples (Bickel 2010,
//! section 8.4).
//!
//! Rooms: [`cells`] (regions cut into layers), [`goal`] (what the user asks for), [`rig`] (the object on the test bench:
//! one layout in, displacements out), [`misfit`] (how far displacements are from the target), [`clusters`] (K-means of
//! tree nodes), [`search`] (the decision tree), [`found`] (what a search leaves on disk).

pub mod cells;
pub mod clusters;
pub mod found;
pub mod goal;
pub mod goal_text;
pub mod misfit;
pub mod rig;
pub mod search;
