//! Sparse direct solution, accelerated iteration, least squares.
//!
//! Rooms: [`ordering`] (a fill-reducing order from node positions), [`cholesky`] (one symbolic factorisation, many
//! numeric ones), [`gmres`] (nearly symmetric systems), [`anderson`] (acceleration of a fixed point), [`least_squares`] (Levenberg–Marquardt).

pub mod anderson;
pub mod cholesky;
pub mod gmres;
pub mod least_squares;
pub mod ordering;
