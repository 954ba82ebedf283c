//! Materials from presses of a specimen with a probe (Bickel 2010, 8.2 and 8.3).
//!
//! A specimen of one material is held and pressed; forces and displacements of markers are measured; sought is the law with
//! which the finite-element model of the specimen answers alike. Strain is not homogeneous, so one press tells of many strains.
//!
//! | room | holds |
//! |---|---|
//! | [`press`] | the presses beside the model: equilibria and derivatives, side by side |
//! | [`coordinates`] | what the fit moves, in a form whose bounds are a box |
//! | [`centres`] | where in strain space the moduli are fitted |
//! | `problem` | residual and Jacobian at equilibrium |
//! | [`start`] | the first guess, and a homogeneous law from it |
//! | [`tangential`] | forces under the probe that were not measured |
//! | [`errors`] | errors by force and by marker, as Table 8.1 |
//! | [`spread`] | what the data leave open: covariance, bootstrap, bands |
//! | `stages` | the minimisations, and what happens between them |
//! | [`fit`](mod@fit) | their order, and what they come to |
//! | [`record`](mod@record) | the fit as a material record |

pub mod centres;
pub mod coordinates;
pub mod errors;
pub mod fit;
pub mod press;
mod problem;
pub mod record;
pub mod spread;
mod stages;
pub mod start;
pub mod tangential;
