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
//! | [`linear`] | the step of mixtures, and the layout nearest to one in linearised readings |
//! | [`exchange`] | the exchanges that lower a linearised error most |
//! | [`connected`] | connected parts |
//! | [`walk`] | the phases |

pub mod connected;
pub mod exchange;
pub mod linear;
pub mod rules;
pub mod walk;

pub use walk::{Found, Options, search};
