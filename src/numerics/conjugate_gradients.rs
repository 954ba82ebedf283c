//! Preconditioned conjugate gradients, `A x = b` for a symmetric positive definite A.
//!
//! ```text
//! α = rᵀz / pᵀA p,   x ← x + α p,   r ← r − α A p,   z = M r,   β = rᵀz / (rᵀz)_old,   p ← z + β p
//! ```
//!
//! M is a symmetric positive definite approximation of A⁻¹, here a multigrid cycle. The iteration ends when
//! ‖r‖ ≤ τ ‖b‖. A direction with pᵀA p ≤ 0 proves that A is not positive definite, and is said. All sums run in fixed
//! chunks ([`super::blocks::dot`]). Source: Hestenes and Stiefel 1952.

use super::blocks::{add_scaled, dot};
use super::multigrid::Multigrid;
use crate::math::Vec3;

/// Why an iteration ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ended {
    /// The residual fell below the tolerance.
    Converged,
    /// A direction of negative curvature was met: the matrix is not positive definite.
    Indefinite,
    /// The residual did not fall far enough in the allowed iterations.
    Stalled,
}

/// What an iteration came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Why it ended.
    pub ended: Ended,
    /// Iterations done.
    pub iterations: usize,
    /// ‖b − A x‖ / ‖b‖ at the end.
    pub residual: f64,
}

/// Room for the iteration's vectors.
#[derive(Debug, Default)]
pub struct Room {
    residual: Vec<Vec3>,
    preconditioned: Vec<Vec3>,
    direction: Vec<Vec3>,
    product: Vec<Vec3>,
}

/// Solves for `x`, `(sites)`, from zero.
pub fn solve(
    multigrid: &mut Multigrid,
    b: &[Vec3],
    x: &mut [Vec3],
    tolerance: f64,
    most_iterations: usize,
    room: &mut Room,
) -> Outcome {
    let n = b.len();
    x.fill(Vec3::zeros());
    room.residual.clear();
    room.residual.extend_from_slice(b);
    for vector in [&mut room.preconditioned, &mut room.direction, &mut room.product] {
        vector.clear();
        vector.resize(n, Vec3::zeros());
    }
    let scale = dot(b, b).sqrt();
    let outcome = |ended, iterations, residual| Outcome {
        ended,
        iterations,
        residual,
    };
    if scale == 0.0 {
        return outcome(Ended::Converged, 0, 0.0);
    }
    let mut left = 1.0;
    let mut energy = 0.0;
    for iteration in 0..most_iterations {
        multigrid.cycle(&room.residual, &mut room.preconditioned);
        let next = dot(&room.residual, &room.preconditioned);
        // A cycle of a matrix that is not positive definite need not be so either. NaN ends here too.
        if !(next > 0.0 && next.is_finite()) {
            return outcome(Ended::Indefinite, iteration, left);
        }
        let beta = if iteration == 0 { 0.0 } else { next / energy };
        energy = next;
        for (p, z) in room.direction.iter_mut().zip(&room.preconditioned) {
            *p = *z + *p * beta;
        }
        multigrid.matrix().product(&room.direction, &mut room.product);
        let curvature = dot(&room.direction, &room.product);
        if !(curvature > 0.0 && curvature.is_finite()) {
            return outcome(Ended::Indefinite, iteration, left);
        }
        let alpha = energy / curvature;
        add_scaled(x, alpha, &room.direction);
        add_scaled(&mut room.residual, -alpha, &room.product);
        left = dot(&room.residual, &room.residual).sqrt() / scale;
        if left <= tolerance {
            return outcome(Ended::Converged, iteration + 1, left);
        }
    }
    outcome(Ended::Stalled, most_iterations, left)
}
