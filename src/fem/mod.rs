//! Quasi-static finite elements for soft objects (Bickel 2010, sections 7.2 and 8.2).
//!
//! Rooms: [`elements`] (integration points) and [`patches`] (tetrahedra that share), [`forces`] (internal forces), [`stiffness`] (secant and tangent), [`model`]
//! (unknowns and the sparse matrix), [`equilibrium`] (the solve), [`load_curve`] (what it is given and answers);
//! [`example`] (force–displacement examples), [`setup`], [`regions`] and [`example_text`] (objects, supports, regions and
//! examples as people write them), [`rig`] (an object on the test bench: materials by cell in, displacements out); [`scene`]
//! and [`scene_text`] (an object with its materials and what is done to it), [`stage`] (its load cases, simulated),
//! [`scene_record`] (what that leaves behind).

mod diagnosis;
pub mod elements;
pub mod equilibrium;
pub mod example;
pub mod example_text;
pub mod forces;
pub mod load_curve;
pub mod model;
mod newton;
pub mod patches;
pub mod regions;
mod response;
pub mod rig;
pub mod scene;
pub mod scene_record;
pub mod scene_text;
pub mod sensitivity;
pub mod setup;
pub mod stage;
pub mod stiffness;
