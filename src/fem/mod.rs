//! Quasi-static finite elements for soft objects (Bickel 2010, sections 7.2 and 8.2).
//!
//! | room | holds |
//! |---|---|
//! | [`elements`], [`patches`] | integration points; tetrahedra that share a volumetric strain |
//! | [`forces`], [`stiffness`] | internal forces; secant and tangent |
//! | [`model`] | unknowns and the sparse matrix |
//! | [`load_curve`], [`equilibrium`] | what a solve is given and answers; the solve, with Newton's iteration and a diagnosis of why a curve ends |
//! | [`sensitivity`] | derivatives of displacements with respect to material parameters |
//! | [`contact`] | rigid probes, floors and surfaces to slide on, with a solve of their own |
//! | [`example`], [`example_text`], [`example_table`] | force–displacement examples |
//! | [`measurement_set`], [`specimen`] | examples of one material with their specimen; that specimen, wired for the solver |
//! | [`setup`], [`regions`] | objects, supports and regions as people write them |
//! | [`planes`] | layer borders in the levels of a grid |
//! | [`rig`], [`rig_sensitivity`] | an object on the test bench: materials by cell in, displacements out; their derivatives by layer borders and by what is uncertain of the materials |
//! | [`mixture`] | the same bench for cells that hold shares of several materials, with derivatives by the shares |
//! | [`scene`], [`scene_text`], [`scene_materials`] | an object with its materials and what is done to it |
//! | [`stage`], [`scene_record`] | a scene's load cases, simulated; what that leaves behind |
//! | [`volume_scene`] | all of that on a mesh from elsewhere |

pub mod contact;
mod diagnosis;
pub mod elements;
pub mod equilibrium;
pub mod example;
pub mod example_table;
pub mod example_text;
pub mod forces;
pub mod load_curve;
pub mod measurement_set;
pub mod mixture;
pub mod model;
mod newton;
pub mod patches;
pub mod planes;
pub mod regions;
mod response;
pub mod rig;
pub mod rig_sensitivity;
pub mod scene;
pub mod scene_materials;
pub mod scene_record;
pub mod scene_text;
pub mod sensitivity;
pub mod setup;
pub mod specimen;
pub mod stage;
pub mod stiffness;
pub mod volume_scene;
