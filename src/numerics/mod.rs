//! Sparse direct and iterative solution, accelerated iteration, least squares.
//!
//! Rooms: [`linear_solver`] (a factor or an iteration, by size); [`ordering`] (a fill-reducing order from node
//! positions), [`cholesky`] (one symbolic factorisation, many numeric ones); [`blocks`] (matrices of 3 × 3 blocks),
//! [`transfer`] (interpolation from lattices), [`multigrid`] and [`conjugate_gradients`]; [`gmres`] (nearly symmetric
//! systems); [`anderson`] (acceleration of a fixed point), [`least_squares`] (Levenberg–Marquardt).

pub mod anderson;
pub mod blocks;
pub mod cholesky;
pub mod conjugate_gradients;
pub mod gmres;
pub mod least_squares;
pub mod linear_solver;
pub mod multigrid;
pub mod ordering;
mod supernodal;
pub mod transfer;
