//! What a soft material answers to strain at a point, and the database of materials.
//!
//! A law maps Biot strain to Biot stress through a secant stiffness that depends on strain by radial basis functions,
//! σ = E(p(ε)) ε (Bickel 2010, sections 7.2 and 8.2). Rooms: [`law`] is what elements call; [`isotropic`] and
//! [`transverse`] are that secant form; [`hyperelastic`] (with [`neo_hookean`], [`principal`] and the terms of its energies) and
//! [`energy`] have an energy; [`paper`] is the papers' form for comparison;
//! [`law_text`] is a law as people write it; [`homogeneous`] answers the tests of a coupon; [`record`] is a material on disk,
//! [`migrate`] reads and rewrites older schemas, [`check`] says whether to trust it, [`database`] is the folder of all, [`put`] writes
//! to it, [`versions`] are the older ones, [`selection`] picks and sorts,
//! [`difference`] says what changed, [`export`] writes laws for other programs.

pub mod check;
pub mod database;
pub mod difference;
pub mod energy;
mod energy_fit;
pub mod export;
pub mod homogeneous;
pub mod hyperelastic;
pub mod isotropic;
mod isotropic_lanes;
pub mod law;
pub mod law_text;
mod law_text_rbf;
pub mod migrate;
pub mod neo_hookean;
pub mod paper;
pub mod principal;
pub mod put;
pub mod record;
mod record_law;
mod record_places;
pub mod selection;
mod stretch_terms;
pub mod transverse;
pub mod versions;
