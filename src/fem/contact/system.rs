//! Newton's step on the balance of forces.
//!
//! ```text
//! | K + Σ Nᵀ k N    −b | | δu |   | r_u |
//! |     −bᵀ          c | | δs | = | r_s |,   b = Σ Nᵀ k d,  c = Σ d·k d,  k = −∂f_p/∂x
//! ```
//!
//! The contact's blocks k lie inside the matrix pattern, since a point's nodes belong to one element; the travels δs of
//! pressed bodies are eliminated, one more right-hand side each. Where nothing rubs, k is symmetric and one factor solves
//! the system exactly; friction, and a material without energy, make the matrix unsymmetric, and GMRES solves it with
//! the symmetric factor as preconditioner.
//!
//! Symbols as in [`super::balance`]; K tangent stiffness \[N/mm\].

use super::balance::{Balance, State};
use super::krylov::{dot, gmres};
use super::law::{Response, Status};
use crate::fem::forces::Materials;
use crate::fem::stiffness::Kind;
use crate::math::{Mat3, Vec3};
use crate::numerics::gmres::skew_product;
use crate::numerics::linear_solver::LinearSolver;
use nalgebra::{DMatrix, DVector};

/// Share of the largest entry below which a skew part is rounding.
const SKEW: f64 = 1e-9;
/// Relative residual of the unsymmetric linear solves; Newton's next residual can't be better than this.
const LINEAR_TOLERANCE: f64 = 1e-6;
/// Most steps of an unsymmetric linear solve.
const LINEAR_STEPS: usize = 60;

/// Which symmetric matrix stands for the contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Blocks {
    /// The symmetric part of the exact one.
    Exact,
    /// One that is never indefinite.
    Robust,
}

impl Balance<'_> {
    /// Newton's step at the state last looked at: δu, then δs; `None` if no matrix has a Cholesky factor.
    ///
    /// `robust` leaves out what can make the matrix indefinite.
    pub fn step(&mut self, state: &State, materials: &Materials, robust: bool) -> Option<Vec<f64>> {
        let rubs = |r: &Response| matches!(r.status, Status::Stuck | Status::Sliding);
        let has_friction = self.touching.iter().any(|(_, r)| rubs(r));
        let ways = [
            (Kind::Tangent, Blocks::Exact),
            (Kind::Tangent, Blocks::Robust),
            (Kind::Secant, Blocks::Robust),
        ];
        let skipped = if robust {
            2
        } else if has_friction {
            1
        } else {
            0
        };
        for (kind, blocks) in ways.into_iter().skip(skipped) {
            let exact = self.assemble(state, materials, kind) || (has_friction && !robust);
            if exact {
                self.material.clone_from(&self.values);
            }
            self.add_blocks(blocks);
            self.work.factorisations += 1;
            let mut factor = self.factor.take()?;
            let step = factor.factorise(&self.values).is_ok().then(|| {
                let border = self.border(&mut factor, blocks);
                let mut step = self.residual.clone();
                if exact {
                    step = gmres(
                        &self.residual,
                        &mut |x| self.multiply(x),
                        &mut |x| border.solve(&mut factor, x),
                        LINEAR_TOLERANCE,
                        LINEAR_STEPS,
                    );
                } else {
                    border.solve(&mut factor, &mut step);
                }
                step
            });
            self.factor = Some(factor);
            if step.is_some() {
                return step;
            }
        }
        None
    }

    /// The object's matrix with its anchors; answers whether it has a skew part that counts.
    fn assemble(&mut self, state: &State, materials: &Materials, kind: Kind) -> bool {
        let u = &state.u;
        match kind {
            Kind::Tangent => self
                .model
                .assemble_tangent(u, materials, &mut self.values, &mut self.skew),
            Kind::Secant => {
                self.skew.fill(0.0);
                self.model.assemble(u, materials, kind, &mut self.values);
            }
        }
        let pattern = self.model.symbolic().pattern();
        for (&first, k) in pattern.columns.iter().zip(&self.anchor) {
            self.values[first] += k;
        }
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        largest(&self.skew) > SKEW * largest(&self.values)
    }

    fn block(r: &Response, blocks: Blocks) -> Mat3 {
        match blocks {
            Blocks::Exact => (r.jacobian + r.jacobian.transpose()) * -0.5,
            Blocks::Robust => r.stiffness,
        }
    }

    fn add_blocks(&mut self, blocks: Blocks) {
        for (n, r) in &self.touching {
            let k = Self::block(r, blocks);
            let weights = &self.surface.points[self.pairs[*n].point].weights;
            for (i, &(a, wa)) in weights.iter().enumerate() {
                for &(b, wb) in &weights[..=i] {
                    self.model
                        .add_pair(a as usize, b as usize, &(k * (wa * wb)), &mut self.values);
                }
            }
        }
    }

    /// The columns of the pressed bodies, seen through the factor.
    fn border(&self, factor: &mut LinearSolver, blocks: Blocks) -> Border {
        let unknowns = self.model.unknowns();
        let m = self.loose.len();
        let mut border = Border {
            columns: Vec::with_capacity(m),
            through: Vec::with_capacity(m),
            schur: DMatrix::zeros(m, m),
        };
        for (j, &body) in self.loose.iter().enumerate() {
            let d = self.bodies[body].direction;
            let mut field = vec![Vec3::zeros(); self.model.mesh.nodes.len()];
            for (n, r) in self.touching.iter().filter(|(n, _)| self.pairs[*n].body == body) {
                let pull = Self::block(r, blocks) * d;
                border.schur[(j, j)] += d.dot(&pull);
                for &(node, w) in &self.surface.points[self.pairs[*n].point].weights {
                    field[node as usize] += pull * w;
                }
            }
            let mut column = vec![0.0; unknowns];
            self.model.gather(&field, &mut column);
            let mut through = column.clone();
            factor.solve(&mut through);
            border.columns.push(column);
            border.through.push(through);
        }
        for i in 0..m {
            for j in 0..m {
                border.schur[(i, j)] -= dot(&border.columns[i], &border.through[j]);
            }
        }
        border
    }

    /// The exact matrix times `x`.
    fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let unknowns = self.model.unknowns();
        let pattern = self.model.symbolic().pattern();
        let mut y = vec![0.0; x.len()];
        skew_product(pattern, &self.skew, &x[..unknowns], &mut y[..unknowns]);
        for column in 0..unknowns {
            let mut sum = 0.0;
            for k in pattern.columns[column]..pattern.columns[column + 1] {
                let (row, value) = (pattern.rows[k], self.material[k]);
                sum += value * x[row];
                if row != column {
                    y[row] += value * x[column];
                }
            }
            y[column] += sum;
        }
        let mut moved = vec![Vec3::zeros(); self.model.mesh.nodes.len()];
        self.model.spread(&x[..unknowns], &mut moved);
        let mut forces = vec![Vec3::zeros(); moved.len()];
        for (n, r) in &self.touching {
            let pair = &self.pairs[*n];
            let point = &self.surface.points[pair.point];
            let mut relative = point.moved(&moved);
            let unknown = self.loose.iter().position(|&b| b == pair.body);
            let d = self.bodies[pair.body].direction;
            if let Some(k) = unknown {
                relative -= d * x[unknowns + k];
            }
            let change = r.jacobian * relative;
            for &(node, w) in &point.weights {
                forces[node as usize] += change * w;
            }
            if let Some(k) = unknown {
                y[unknowns + k] += d.dot(&change);
            }
        }
        let mut contact = vec![0.0; unknowns];
        self.model.gather(&forces, &mut contact);
        y.iter_mut().zip(&contact).for_each(|(y, c)| *y -= c);
        y
    }

    /// The largest share of a step in which no pressed body can jump over a point.
    pub fn longest_share(&self, step: &[f64]) -> f64 {
        let unknowns = self.model.unknowns();
        self.loose.iter().enumerate().fold(1.0, |share, (k, &body)| {
            let way = step[unknowns + k].abs();
            let depth = 0.5 * self.bodies[body].shape.depth_mm();
            if way > depth {
                share.min(depth / way)
            } else {
                share
            }
        })
    }

    /// State after `share` of a step.
    pub fn moved(&self, state: &State, step: &[f64], share: f64) -> State {
        let unknowns = self.model.unknowns();
        let mut values = vec![0.0; unknowns];
        self.model.gather(&state.u, &mut values);
        values.iter_mut().zip(step).for_each(|(x, s)| *x += share * s);
        let mut next = state.clone();
        self.model.spread(&values, &mut next.u);
        for (k, &body) in self.loose.iter().enumerate() {
            next.travel[body] += share * step[unknowns + k];
        }
        next
    }

    /// Work of the residual forces along a step, the descent of the energy where there is one.
    pub fn slope(&self, step: &[f64]) -> f64 {
        dot(&self.residual, step)
    }
}

/// The travels' part of the linear system.
struct Border {
    /// b of each pressed body, `(unknowns)`.
    columns: Vec<Vec<f64>>,
    /// K⁻¹ b.
    through: Vec<Vec<f64>>,
    /// c − bᵀ K⁻¹ b.
    schur: DMatrix<f64>,
}

impl Border {
    /// Solves in place for the residual `x`, r_u then r_s.
    fn solve(&self, factor: &mut LinearSolver, x: &mut [f64]) {
        let m = self.columns.len();
        let (u, s) = x.split_at_mut(x.len() - m);
        factor.solve(u);
        if m == 0 {
            return;
        }
        let mut schur = self.schur.clone();
        let mut right = DVector::zeros(m);
        for k in 0..m {
            // b before K⁻¹ or after: the factor is symmetric, and u has been through it.
            right[k] = s[k] + dot(&self.columns[k], u);
            if schur[(k, k)] <= 0.0 {
                // A body that touches nothing stays where it is.
                schur.row_mut(k).fill(0.0);
                schur.column_mut(k).fill(0.0);
                schur[(k, k)] = 1.0;
                right[k] = 0.0;
            }
        }
        let travels = schur.lu().solve(&right).unwrap_or_else(|| DVector::zeros(m));
        for (k, through) in self.through.iter().enumerate() {
            s[k] = travels[k];
            u.iter_mut().zip(through).for_each(|(u, z)| *u += travels[k] * z);
        }
    }
}
