//! The balance of forces of an object that touches rigid bodies: residual, linear system, Newton step.
//!
//! ```text
//! r_u = t f_ext + Σ_p Nᵀ f_p(x_p − c) − f_int(u)          on the unknown components
//! r_s = F − d · Σ_p f_p                                    for each body pressed by a force
//! | K + Σ Nᵀ k N    −b | | δu |   | r_u |
//! |     −bᵀ          c | | δs | = | r_s |,   b = Σ Nᵀ k d,  c = Σ d·k d,  k = −∂f_p/∂x
//! ```
//!
//! The contact's blocks k lie inside the matrix pattern, since a point's nodes belong to one element; the travels δs of
//! pressed bodies are eliminated, one more right-hand side each. Where nothing rubs, k is symmetric and the Cholesky
//! factor solves the system exactly; friction makes k unsymmetric, and GMRES solves it with the factor of the symmetric
//! part as preconditioner.
//!
//! Symbols: u displacement, s travel of a body along its direction d \[mm\], f force \[N\], F force that presses a body
//! \[N\], N shape functions' values at a contact point, K tangent stiffness \[N/mm\].

use super::body::RigidBody;
use super::krylov::{dot, gmres, norm};
use super::law::{Memory, Response, Status, response};
use super::surface::Surface;
use crate::fem::forces::{Materials, add_internal_forces};
use crate::fem::load_curve::Work;
use crate::fem::model::Model;
use crate::fem::stiffness::Kind;
use crate::math::{Mat3, Vec3};
use crate::numerics::cholesky::{Cholesky, CholeskyError};
use nalgebra::{DMatrix, DVector};

/// Share of a point's motion along a direction that must be free for it to carry a constraint there.
const LEAST_MOBILITY: f64 = 1e-3;
/// Relative residual of the unsymmetric linear solves; Newton's next residual can't be better than this.
const LINEAR_TOLERANCE: f64 = 1e-6;
/// Most steps of an unsymmetric linear solve.
const LINEAR_STEPS: usize = 60;

/// Object and bodies at one moment.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// Displacements, `(nodes)` \[mm\].
    pub u: Vec<Vec3>,
    /// Travel of each body along its direction \[mm\].
    pub travel: Vec<f64>,
    /// Way of each body in addition \[mm\].
    pub across: Vec<Vec3>,
    /// What each pair remembers.
    pub memory: Vec<Memory>,
}

/// The forces that act at a moment.
#[derive(Clone, Debug)]
pub(super) struct Target {
    /// Nodal forces, `(unknowns)` \[N\].
    pub external: Vec<f64>,
    /// Force on each body; `None` where its travel is prescribed \[N\].
    pub push: Vec<Option<f64>>,
}

/// How far from balance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Imbalance {
    pub residual_norm: f64,
    pub scale: f64,
    /// Largest violation of a contact condition, as a share of its point's size.
    pub violation: f64,
}

/// A contact point and a body that it may meet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub body: usize,
    pub point: usize,
}

/// Memory for the balance of one object against its bodies.
pub(super) struct Balance<'a> {
    pub model: &'a Model,
    pub surface: &'a Surface,
    pub bodies: &'a [RigidBody],
    pub pairs: Vec<Pair>,
    /// κ of each point \[N/mm\].
    pub penalty: Vec<f64>,
    /// Edge of the square that each point stands for \[mm\].
    pub size_mm: Vec<f64>,
    /// Which share of each point's motion along x, y, z is free.
    mobility: Vec<Vec3>,
    rest: Vec<Vec3>,
    /// Out of its place only while an unsymmetric system is solved.
    factor: Option<Cholesky>,
    values: Vec<f64>,
    /// The material's tangent alone, where the linear solves need it.
    material: Vec<f64>,
    internal: Vec<Vec3>,
    /// Pairs that touch, with their responses at the last state looked at.
    pub touching: Vec<(usize, Response)>,
    /// r_u, then r_s.
    residual: Vec<f64>,
    /// Bodies whose travel is unknown.
    loose: Vec<usize>,
    pub work: Work,
}

impl<'a> Balance<'a> {
    pub fn new(
        model: &'a Model,
        surface: &'a Surface,
        bodies: &'a [RigidBody],
    ) -> Result<Balance<'a>, CholeskyError> {
        let free = |n: u32| model.constrained[n as usize].map(|held| f64::from(!held));
        let mobility: Vec<Vec3> = surface
            .points
            .iter()
            .map(|p| {
                let whole: f64 = p.weights.iter().map(|(_, w)| w * w).sum();
                let part = p.weights.iter().map(|&(n, w)| Vec3::from(free(n)) * (w * w));
                part.sum::<Vec3>() / whole
            })
            .collect();
        let mut pairs = Vec::new();
        for (body, b) in bodies.iter().enumerate() {
            let all = 0..surface.points.len();
            let list: Vec<usize> = match &b.points {
                Some(own) => own.iter().map(|&p| p as usize).collect(),
                None => all.collect(),
            };
            let movable = list.into_iter().filter(|&p| mobility[p].max() > 0.0);
            pairs.extend(movable.map(|point| Pair { body, point }));
        }
        let nodes = &model.mesh.nodes;
        Ok(Balance {
            model,
            surface,
            bodies,
            pairs,
            penalty: vec![0.0; surface.points.len()],
            size_mm: sizes(surface),
            mobility,
            rest: surface.points.iter().map(|p| p.rest(nodes)).collect(),
            factor: Some(Cholesky::new(model.symbolic().clone())?),
            values: vec![0.0; model.symbolic().pattern().rows.len()],
            material: Vec::new(),
            internal: vec![Vec3::zeros(); nodes.len()],
            touching: Vec::new(),
            residual: vec![0.0; model.unknowns()],
            loose: Vec::new(),
            work: Work::default(),
        })
    }

    /// Sets the penalties from the stiffness at rest: κ = `ratio` / Σ N_a² / k_a, with k_a the mean of node a's diagonal.
    pub fn weigh(&mut self, materials: &Materials, ratio: f64) {
        let still = vec![Vec3::zeros(); self.model.mesh.nodes.len()];
        self.model
            .assemble(&still, materials, Kind::Secant, &mut self.values);
        let pattern = self.model.symbolic().pattern();
        let diagonal: Vec<f64> = pattern.columns[..self.model.unknowns()]
            .iter()
            .map(|&first| self.values[first])
            .collect();
        let mut of_node = vec![Vec3::zeros(); self.model.mesh.nodes.len()];
        self.model.spread(&diagonal, &mut of_node);
        for (penalty, point) in self.penalty.iter_mut().zip(&self.surface.points) {
            let compliance: f64 = point
                .weights
                .iter()
                .map(|&(n, w)| {
                    let free = self.model.constrained[n as usize].iter().filter(|h| !**h).count();
                    let sum = of_node[n as usize].sum();
                    if sum > 0.0 { w * w * free as f64 / sum } else { 0.0 }
                })
                .sum();
            *penalty = if compliance > 0.0 { ratio / compliance } else { 0.0 };
        }
    }

    pub fn at_rest(&self) -> State {
        let mut state = State {
            u: vec![Vec3::zeros(); self.model.mesh.nodes.len()],
            travel: vec![0.0; self.bodies.len()],
            across: vec![Vec3::zeros(); self.bodies.len()],
            memory: Vec::new(),
        };
        state.memory = self
            .pairs
            .iter()
            .map(|pair| Memory {
                normal_n: 0.0,
                tangential_n: Vec3::zeros(),
                place: self.rest[pair.point],
                rest_gap_mm: self.bodies[pair.body]
                    .distance(&Vec3::zeros(), &self.rest[pair.point])
                    .value,
            })
            .collect();
        state
    }

    /// The translation of a body.
    pub fn translation(&self, state: &State, body: usize) -> Vec3 {
        self.bodies[body].direction * state.travel[body] + state.across[body]
    }

    /// Where a pair's point is, as the body sees it.
    fn relative_place(&self, state: &State, pair: &Pair) -> (Vec3, Vec3) {
        let x = self.rest[pair.point] + self.surface.points[pair.point].moved(&state.u);
        (x, self.translation(state, pair.body))
    }

    /// Response of one pair; `None` where they do not meet and need not.
    fn respond(&self, state: &State, n: usize) -> Option<Response> {
        let pair = &self.pairs[n];
        let (x, translation) = self.relative_place(state, pair);
        let body = &self.bodies[pair.body];
        let distance = body.distance(&translation, &x);
        let mobility = &self.mobility[pair.point];
        if distance.gradient.map(|c| c * c).dot(mobility) < LEAST_MOBILITY {
            return None;
        }
        let memory = &state.memory[n];
        let free = mobility.map(|m| f64::from(m >= LEAST_MOBILITY));
        let moved = (x - translation - memory.place).component_mul(&free);
        let penalty = self.penalty[pair.point];
        Some(response(
            &distance,
            &moved,
            memory,
            body.friction,
            body.bond,
            penalty,
        ))
    }

    /// Distance from one body to the nearest point that it may meet \[mm\]; infinite if there is none.
    pub fn nearest(&self, state: &State, body: usize) -> f64 {
        let own = self.pairs.iter().filter(|p| p.body == body);
        own.map(|pair| {
            let (x, translation) = self.relative_place(state, pair);
            self.bodies[body].distance(&translation, &x).value
        })
        .fold(f64::INFINITY, f64::min)
    }

    /// Looks at all pairs; returns the largest violation, as a share of the point's size.
    pub fn meet(&mut self, state: &State) -> f64 {
        let mut touching = std::mem::take(&mut self.touching);
        touching.clear();
        let mut violation = 0.0_f64;
        for n in 0..self.pairs.len() {
            let Some(found) = self.respond(state, n) else {
                continue;
            };
            violation = violation.max(found.violation_mm / self.size_mm[self.pairs[n].point]);
            if found.status != Status::Open {
                touching.push((n, found));
            }
        }
        self.touching = touching;
        violation
    }

    /// Force of a body on the object along the body's direction \[N\], as last met.
    pub fn push_of(&self, body: usize) -> f64 {
        let own = self.touching.iter().filter(|(n, _)| self.pairs[*n].body == body);
        own.map(|(_, r)| r.force.dot(&self.bodies[body].direction)).sum()
    }

    /// Residual forces at a state, left in `self.residual`.
    pub fn imbalance(&mut self, state: &State, target: &Target, materials: &Materials) -> Imbalance {
        self.work.residuals += 1;
        let violation = self.meet(state);
        let model = self.model;
        self.internal.fill(Vec3::zeros());
        add_internal_forces(&model.parts, &state.u, materials, &mut self.internal);
        let reactions: f64 = self
            .internal
            .iter()
            .zip(&model.constrained)
            .map(|(f, held)| (0..3).filter(|&c| held[c]).map(|c| f[c] * f[c]).sum::<f64>())
            .sum();
        let mut contact = 0.0;
        for (n, r) in &self.touching {
            for &(node, w) in &self.surface.points[self.pairs[*n].point].weights {
                self.internal[node as usize] -= r.force * w;
            }
            contact += r.force.norm_squared();
        }
        self.loose = (0..self.bodies.len())
            .filter(|&b| target.push[b].is_some())
            .collect();
        let unknowns = model.unknowns();
        self.residual.resize(unknowns + self.loose.len(), 0.0);
        model.gather(&self.internal, &mut self.residual[..unknowns]);
        for (r, f) in self.residual.iter_mut().zip(&target.external) {
            *r = f - *r;
        }
        let mut load = dot(&target.external, &target.external);
        for (k, &body) in self.loose.iter().enumerate() {
            let force = target.push[body].unwrap_or(0.0);
            self.residual[unknowns + k] = force - self.push_of(body);
            load += force * force;
        }
        Imbalance {
            residual_norm: norm(&self.residual),
            scale: load.sqrt() + reactions.sqrt() + contact.sqrt(),
            violation,
        }
    }

    /// Lets the multipliers take over what penalties carry, at the state last looked at.
    pub fn update_multipliers(&mut self, state: &mut State) {
        // A point that let go has no response and no force.
        let mut normal = vec![0.0; state.memory.len()];
        for (n, r) in &self.touching {
            normal[*n] = r.normal_n;
            if r.status == Status::Stuck {
                state.memory[*n].tangential_n = r.tangential_n;
            }
        }
        for (memory, f) in state.memory.iter_mut().zip(normal) {
            memory.normal_n = f;
        }
    }

    /// Takes the state last looked at as the equilibrium that friction remembers.
    pub fn remember(&mut self, state: &mut State) {
        self.update_multipliers(state);
        for n in 0..self.pairs.len() {
            let (x, translation) = self.relative_place(state, &self.pairs[n]);
            state.memory[n].place = x - translation;
            state.memory[n].tangential_n = Vec3::zeros();
        }
        for (n, r) in &self.touching {
            state.memory[*n].tangential_n = r.tangential_n;
        }
    }
}

/// Edge of the square that each point stands for \[mm\]; slivers count as a tenth of a typical one.
fn sizes(surface: &Surface) -> Vec<f64> {
    let least = 0.1 * surface.spacing_mm();
    surface
        .points
        .iter()
        .map(|p| p.area_mm2.sqrt().max(least))
        .collect()
}

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
            self.model.assemble(&state.u, materials, kind, &mut self.values);
            let exact = has_friction && !robust;
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
    fn border(&self, factor: &mut Cholesky, blocks: Blocks) -> Border {
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
    fn solve(&self, factor: &mut Cholesky, x: &mut [f64]) {
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
