//! Contact of the object with rigid bodies: probes, floors, a bone to slide on.
//!
//! ```text
//! g ≥ 0,  f_n ≥ 0,  g f_n = 0;     |t| ≤ μ f_n,  slip only where equal and against t
//! ```
//!
//! | room | holds |
//! |---|---|
//! | [`shape`], [`field`] | rigid shapes as signed distances: sphere, disc, cylinder, box, plane, any closed surface |
//! | [`body`] | a shape in its place, its friction, how it is driven |
//! | [`surface`] | the object's contact points |
//! | [`law`] | force between one point and one body |
//! | `balance`, `system`, `krylov` | residual, Newton's step, unsymmetric systems |
//! | [`solve`], `moment`, `approach` | levels, increments, Newton's method |
//! | [`report`] | options, levels; forces, areas, pressures |
//!
//! A simulation is
//!
//! ```text
//! let surface = Surface::of_mesh(&model.mesh);                     // or Surface::embedded(&solid, &grid)
//! let bodies = [RigidBody::probe(Shape::Sphere { radius_mm: 5.0 }, Pose::at(place)?, -Vec3::z(), Friction::Frictionless)?,
//!               RigidBody::floor(point, Vec3::z(), Friction::Coulomb { coefficient: 0.4 })?];
//! let levels = [Level { load_factor: 1.0, drives: vec![Drive::force(2.0), Drive::HELD] }];
//! let curve = ContactSolver::new(&model, &surface, &bodies)?.curve(&materials, &load, &levels, &options, &|| false)?;
//! ```
//!
//! Theory and limits: `docs/theory/contact.md`.

mod approach;
mod balance;
pub mod body;
pub mod field;
mod krylov;
pub mod law;
mod moment;
pub mod report;
pub mod shape;
pub mod solve;
pub mod surface;
mod system;

pub use body::{Bond, Drive, Friction, Push, RigidBody};
pub use report::{BadContact, BodyContact, ContactCurve, ContactLevel, ContactOptions, Level, PointContact};
pub use shape::{Pose, Shape};
pub use solve::ContactSolver;
pub use surface::Surface;
