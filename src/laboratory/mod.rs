//! The virtual laboratory: fine structures under a probe, computed instead of measured (Bickel 2010, 8.2 and 8.5).
//!
//! A block of tubes, a lattice or a voxel image of a base material is simulated at fine resolution under a schedule of presses. What
//! markers on its faces do becomes a measurement set, marked as computed. A homogeneous material that is fitted to it is the
//! structure seen from afar: the papers' data-driven coarsening.
//!
//! | room | holds |
//! |---|---|
//! | [`text`] | the file as people write it |
//! | [`read`] | the file read and checked: [`read::Laboratory`] |
//! | [`structure`] | the fine mesh: tubes, a repeated surface, a repeated voxel image, a solid block |
//! | [`patch`], [`markers`] | the probe's force and the markers on the fine mesh |
//! | [`measure`](mod@measure) | the presses, simulated |
//! | [`aside`] | finished presses on disk, so that a run that was broken off goes on |
//! | [`noise`] | seeded errors of measurement |
//! | [`set`](mod@set) | the measurement set of it all |
//! | [`compare`](mod@compare) | a homogeneous material held against the fine structure |

pub mod aside;

pub mod compare;
pub mod markers;
pub mod measure;
pub mod noise;
pub mod patch;
pub mod read;
pub mod set;
pub mod structure;
pub mod text;
