//! What a soft material answers to strain at a point, and the database of materials.
//!
//! A law maps Biot strain to Biot stress through a secant stiffness that depends on strain by radial basis functions,
//! σ = E(p(ε)) ε (Bickel 2010, sections 7.2 and 8.2). Rooms: [`law`] is what elements call; [`isotropic`] and
//! [`transverse`] are the two kinds.

pub mod homogeneous;
pub mod isotropic;
pub mod law;
pub mod transverse;
