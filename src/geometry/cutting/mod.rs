//! A lattice of tetrahedra, cut along level sets.
//!
//! ```text
//! object   Ω = { x : f(x) < 0 }          border i   { x : g_i(x) = 0 }          [mm]
//! ```
//!
//! Boxes are divided into six tetrahedra each, around their long diagonal (Kuhn 1960), and cut by `f` and then by every
//! `g_i` in turn, each of them taken as linear along the edges that it crosses, with the crossing itself found on the true
//! function. A cut edge carries one new vertex, a cut face is split by its smallest vertex number, so both neighbours of a
//! face always see the same triangles: the result is conforming, whatever the functions were. Vertices that a cut passes
//! closely are moved onto it first (the warping of Labelle and Shewchuk 2007, "Isosurface stuffing").
//!
//! Printing tiles an object with it ([`crate::fabrication`]), meshing improves what it leaves ([`super::tetrahedra`]).
//!
//! Rooms: [`complex`] (the tetrahedra and the lattice), [`cut`], [`warp`], [`labels`].

pub mod complex;
pub mod cut;
pub mod labels;
pub mod warp;

use crate::math::Vec3;
use thiserror::Error;

/// A function of a point \[mm\], zero on an interface; its values need a sign and to be continuous, no more.
pub type LevelSet<'a> = &'a (dyn Fn(&Vec3) -> f64 + Sync);

/// A level set without an answer.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CutError {
    /// Not a number, or infinite.
    #[error("{what} is not a finite number at {point:?} mm")]
    NotFinite {
        /// Which function.
        what: String,
        /// Where.
        point: [f64; 3],
    },
}
