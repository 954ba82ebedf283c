//! Newton's iteration for the equilibrium of one load level.
//!
//! ```text
//! K(u) s = t f_ext − f_int(u),    u ← u + α s,    α ∈ {1, ½, … 1/64}
//! ```
//!
//! K is the consistent tangent, rotations, averages and the change of the law included. Laws without an energy make it
//! unsymmetric: its symmetric part is factorised, and the skew part enters by a few iterations of
//! [`crate::numerics::gmres`]. Where the symmetric part has no Cholesky factor, or no step along its direction helps, the
//! secant matrix, which is always positive definite, takes its place: the papers' iteration, slow and robust. α is the
//! first that lowers ‖K⁻¹ r‖ by a quarter of its share (Deuflhard's natural monotonicity test, 2004): residual forces alone
//! mislead where stiffnesses differ by orders of magnitude.

use super::equilibrium::{INEXACT, Imbalance, Solver, is_settled, largest, linear_solver, norm, relative};
use super::forces::Materials;
use super::load_curve::{NewtonMatrix, Options};
use super::stiffness::Kind;
use crate::math::Vec3;
use crate::numerics::gmres::{self, Side};

/// The skew part's iterations end when the linear residual is this share of the right-hand side: Newton's own error is larger.
const LINEAR_TOLERANCE: f64 = 1e-5;
/// Most of them.
const MOST_LINEAR: usize = 30;
/// A skew part below this share of the matrix's largest entry is rounding.
const SKEW_NOISE: f64 = 1e-12;

impl Solver<'_> {
    /// Iterates `u` to equilibrium with the external forces in `self.external`; the relative residual, or `None`.
    pub(super) fn newton(
        &mut self,
        u: &mut Vec<Vec3>,
        materials: &Materials,
        options: &Options,
        cancelled: &dyn Fn() -> bool,
    ) -> Option<f64> {
        if self.newton.is_none() {
            self.newton = linear_solver(self.model).ok();
        }
        // Newton's factors take the place of a refreshed one.
        self.is_refreshed = false;
        self.memory.restart();
        let mut found = self.imbalance(u, materials);
        for _ in 0..options.newton_iterations {
            if !found.residual_norm.is_finite() || cancelled() {
                return None;
            }
            self.work.newton_iterations += 1;
            let mut moved = false;
            for kind in [Kind::Tangent, Kind::Secant] {
                if !self.factorise_for_newton(u, materials, kind, options.newton_matrix) {
                    continue;
                }
                self.step.copy_from_slice(&self.residual);
                self.newton_direction(kind)?;
                let size = largest(&self.step);
                if is_settled(&found, size, u, options) {
                    return Some(relative(&found));
                }
                if let Some(next) = self.line_search(u, materials, kind) {
                    found = next;
                    moved = true;
                    break;
                }
                // The search left its last trial's residual behind.
                found = self.imbalance(u, materials);
            }
            if !moved {
                return None;
            }
        }
        None
    }

    /// Factorises what Newton needs at `u`; false if there is no factor.
    fn factorise_for_newton(
        &mut self,
        u: &[Vec3],
        materials: &Materials,
        kind: Kind,
        matrix: NewtonMatrix,
    ) -> bool {
        self.skew.clear();
        self.newton.iter_mut().for_each(|n| n.set_tolerance(INEXACT));
        if kind == Kind::Secant || matrix == NewtonMatrix::SymmetricPart {
            return self.factorise_at(u, materials, kind);
        }
        self.factorise_tangent(u, materials)
    }

    /// Factorises the symmetric part of the tangent at `u` and keeps its skew part, if it has one.
    pub(super) fn factorise_tangent(&mut self, u: &[Vec3], materials: &Materials) -> bool {
        if self.newton.is_none() {
            self.newton = linear_solver(self.model).ok();
        }
        self.skew.resize(self.values.len(), 0.0);
        self.model
            .assemble_tangent(u, materials, &mut self.values, &mut self.skew);
        if largest(&self.skew) <= SKEW_NOISE * largest(&self.values) {
            self.skew.clear();
        }
        self.work.factorisations += 1;
        self.newton
            .as_mut()
            .is_some_and(|n| n.factorise(&self.values).is_ok())
    }

    /// `self.step` seen through the matrix that was factorised last.
    fn newton_direction(&mut self, kind: Kind) -> Option<()> {
        if kind == Kind::Secant {
            self.newton.as_mut()?.solve(&mut self.step);
            return Some(());
        }
        let mut step = std::mem::take(&mut self.step);
        let solved = self.solve_tangent(&mut step, Side::Plain, LINEAR_TOLERANCE);
        self.step = step;
        solved
    }

    /// Solves with the tangent of [`Solver::factorise_tangent`], or with its transpose, in place.
    pub(super) fn solve_tangent(
        &mut self,
        right_hand_side: &mut [f64],
        side: Side,
        tolerance: f64,
    ) -> Option<()> {
        let factor = self.newton.as_mut()?;
        if self.skew.is_empty() {
            factor.solve(right_hand_side);
        } else {
            let pattern = self.model.symbolic().pattern();
            self.work.linear_iterations += gmres::solve(
                factor,
                pattern,
                &self.skew,
                side,
                right_hand_side,
                tolerance,
                MOST_LINEAR,
            );
        }
        Some(())
    }

    pub(super) fn factorise_at(&mut self, u: &[Vec3], materials: &Materials, kind: Kind) -> bool {
        self.model.assemble(u, materials, kind, &mut self.values);
        self.work.factorisations += 1;
        self.newton
            .as_mut()
            .is_some_and(|n| n.factorise(&self.values).is_ok())
    }

    /// Moves `u` along `self.step` as far as ‖K⁻¹ r‖ falls; `None` if it never does.
    fn line_search(&mut self, u: &mut Vec<Vec3>, materials: &Materials, kind: Kind) -> Option<Imbalance> {
        let direction = self.step.clone();
        let before = norm(&direction);
        self.model.gather(u, &mut self.unknowns);
        let origin = self.unknowns.clone();
        let mut trial = u.clone();
        for halvings in 0..7 {
            let share = 0.5f64.powi(halvings);
            for ((x, o), d) in self.unknowns.iter_mut().zip(&origin).zip(&direction) {
                *x = o + share * d;
            }
            self.model.spread(&self.unknowns, &mut trial);
            let found = self.imbalance(&trial, materials);
            self.step.copy_from_slice(&self.residual);
            self.newton_direction(kind)?;
            if norm(&self.step) <= (1.0 - 0.25 * share) * before {
                std::mem::swap(u, &mut trial);
                return Some(found);
            }
        }
        None
    }
}
