//! Layouts of voxels: thousands of cells, more than a tree can decide one after the other.
//!
//! ```text
//! min ½ Σ |x(w) − x̄|²,    Σ_m w_vm = 1,  w ≥ 0        relaxed: a share of each material in each cell
//! w ∈ {0, 1}                                         a layout
//! ```
//!
//! The shares ([`crate::fem::mixture`]) make displacements differentiable. There are many more cells than readings, so a
//! Levenberg step is taken in the space of the readings: one adjoint solve a reading, whatever the number of cells. The
//! same freedom makes rounding cheap: of the many layouts near a mixture, one is taken whose linearised readings are
//! alike.
//!
//! Three phases ([`walk`]): *relaxing* fits the readings with mixtures, *rounding* leads the mixtures to a layout in a few
//! steps, *exchanging* changes materials of single cells, a handful at a time. Only simulated layouts count. Theory:
//! `docs/theory/voxels.md`.
//!
//! | room | holds |
//! |---|---|
//! | [`rules`] | what ties cells together: symmetry, least feature; parts that must be connected |
//! | [`mod@bench`] | where mixtures are simulated and linearised |
//! | [`linear`] | the step of mixtures, and the layout nearest to one in linearised readings |
//! | `linearise` | the linearised problem at some shares, and what is chosen from it |
//! | [`exchange`] | the exchanges that lower a linearised error most |
//! | [`connected`] | connected parts |
//! | [`walk`] | the phases |
//! | `limits` | mass, cost, what cost is worth, what must not touch |
//! | [`kept`] | a bench with a journal |
//! | `combinations` | few combinations of very many readings |

pub mod bench;
mod combinations;
pub mod connected;
pub mod exchange;
pub mod kept;
mod limits;
pub mod linear;
mod linearise;
pub mod rules;
pub mod walk;

use crate::design::search::Outcome;
use crate::fem::mixture::MixtureError;

pub use walk::search;

/// How to search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Seed of the orders in which variables are rounded, and of combinations of readings. Default 1.
    pub seed: u64,
    /// Most simulations. Default 80.
    pub most_simulations: usize,
    /// Most steps of relaxing. Default 10.
    pub relaxing: usize,
    /// Most further cycles of the three phases, each from a mixture around the best layout. Default 1.
    pub cycles: usize,
    /// Most readings in one linearisation. Default 600.
    pub readings: usize,
    /// RMS error at which the search ends \[mm\]. Default 0.
    pub enough_mm: f64,
    /// Tolerance of a simulation of mixtures. Default 1e-3.
    pub tolerance: f64,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            seed: 1,
            most_simulations: 80,
            relaxing: 10,
            cycles: 1,
            readings: 600,
            enough_mm: 0.0,
            tolerance: 1e-3,
        }
    }
}

impl Options {
    /// What a decision depends on: all but the ends of the search.
    fn setting(&self) -> String {
        format!(
            "{} {} {} {} {}",
            self.seed, self.relaxing, self.cycles, self.readings, self.tolerance
        )
    }
}

/// Why there is no search.
#[derive(Debug, thiserror::Error)]
pub enum BadVoxels {
    /// Options that cannot be.
    #[error("voxel search option {field} is 0: it must be at least 1")]
    Zero {
        /// Which one.
        field: &'static str,
    },
    /// The simulation.
    #[error(transparent)]
    Mixture(#[from] MixtureError),
}

/// What a search found, and what it took.
#[derive(Clone, Debug)]
pub struct Found {
    /// The best layout, if any, as other searches answer it.
    pub outcome: Outcome,
    /// Linearisations: each costs an adjoint solve a reading.
    pub linearisations: usize,
    /// RMS error of the relaxed mixtures \[mm\].
    pub relaxed_rms_mm: f64,
    /// Each time that a layout was better than all before.
    pub history: Vec<Milestone>,
}

/// A layout better than all before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Milestone {
    /// Simulations until then, its own among them.
    pub simulations: usize,
    /// Linearisations until then.
    pub linearisations: usize,
    /// Its RMS error \[mm\].
    pub rms_mm: f64,
}
