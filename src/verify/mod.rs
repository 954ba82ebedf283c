//! Checks of the mechanics against what is known: closed forms, other people's programs, measurements, and itself in
//! another order. `pliant verify` runs them and writes `docs/verification.md`; `tests/verification` asserts them.
//!
//! A check solves small problems through the library's public doors and compares numbers; nothing is compared with an
//! earlier answer of the same code. It reads no file and no clock, so that the page it makes is the same everywhere:
//! errors below their bound are shown as such, values with few digits.
//!
//! Rooms: [`record`] (what was demanded and found), [`page`] (Markdown), [`specimen`] (a body, its supports, a finer
//! quadrature), [`elements`] (patch tests, rigid motion), [`laws`] (closed forms of every law), [`orders`] (convergence to a manufactured solution),
//! [`elastica`] and [`cantilever`] (large rotation), [`cook`] (shear near incompressibility), [`sphere`] (a thick shell
//! blown up), [`contact`] (ball and punch on a half space), [`block`] (five other codes), [`path`] (work around closed paths), [`beam`] (a measured beam), [`repeat`]
//! (steps, threads and numbering change nothing).

pub mod beam;
pub mod block;
pub mod cantilever;
pub mod contact;
pub mod cook;
pub mod elastica;
pub mod elements;
pub mod laws;
pub mod orders;
pub mod page;
pub mod path;
pub mod record;
pub mod repeat;
pub mod specimen;
pub mod sphere;

use crate::fem::load_curve::Stop;
use crate::fem::model::ModelError;
use crate::material::law::LawError;
use crate::material::record::RecordError;
use crate::numerics::cholesky::CholeskyError;

pub use record::{Findings, Row};

/// How long a check takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// A second or so.
    Light,
    /// More; left out by `pliant verify --quick`.
    Heavy,
}

/// A check and where its expected numbers come from.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    /// Its name on the command line.
    pub id: &'static str,
    /// Its title on the page.
    pub title: &'static str,
    /// What the answers are compared with, and the source of that.
    pub against: &'static str,
    /// How long it takes.
    pub cost: Cost,
    /// Solves and compares.
    pub run: fn() -> Result<Findings, CheckError>,
}

/// Why a check could not be carried out.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The mesh or the supports.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The matrix.
    #[error(transparent)]
    Cholesky(#[from] CholeskyError),
    /// The material.
    #[error(transparent)]
    Law(#[from] LawError),
    /// The record of a material.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A solve ended early.
    #[error("only {:.0} % of the load was reached: {stop}", 100.0 * share)]
    NotReached {
        /// Why.
        stop: Stop,
        /// Share of the load in equilibrium.
        share: f64,
    },
    /// Anything else.
    #[error("{0}")]
    Other(String),
}

/// All checks, in the order of the page.
pub const CHECKS: [Check; 12] = [
    elements::PATCH,
    elements::RIGID,
    laws::LAWS,
    orders::ORDERS,
    cantilever::CANTILEVER,
    cook::COOK,
    sphere::SPHERE,
    contact::CONTACT,
    block::BLOCK,
    path::PATH,
    beam::BEAM,
    repeat::REPEAT,
];

/// The check named `id`.
pub fn check(id: &str) -> Option<&'static Check> {
    CHECKS.iter().find(|check| check.id == id)
}
