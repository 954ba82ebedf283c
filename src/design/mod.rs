//! Goal-based design: which material goes into which cell of an object, so that it gives like the examples (Bickel 2010,
//! section 8.4).
//!
//! Rooms: [`goal`] (what the user asks for) and [`goal_text`] (the file as written), [`misfit`] (how far displacements are
//! from the target), [`clusters`] (K-means of tree nodes), [`space`] (the layouts that may be built), [`search`] (the decision tree), [`workbench`] (layouts simulated
//! in parallel), [`thickness`] (layer borders that move), [`robust`] (what is not known of the materials), [`found`] (what a search leaves on disk).

pub mod clusters;
pub mod found;
pub mod goal;
pub mod goal_text;
pub mod misfit;
pub mod robust;
pub mod search;
pub mod space;
pub mod thickness;
pub mod workbench;
