//! Sparse direct solution and accelerated iteration. Rooms: [`ordering`] (a fill-reducing order from node positions),
//! [`cholesky`] (one symbolic factorisation, many numeric ones), [`anderson`] (acceleration of a fixed point).

pub mod anderson;
pub mod cholesky;
pub mod ordering;
