//! Quasi-static finite elements for soft objects (Bickel 2010, sections 7.2 and 8.2).
//!
//! Rooms: [`elements`] (integration points), [`forces`] (internal forces), [`stiffness`] (secant and tangent),
//! [`model`] (unknowns and the sparse matrix), [`equilibrium`] (the solve).

pub mod elements;
pub mod equilibrium;
pub mod example;
pub mod forces;
pub mod model;
pub mod stiffness;
