//! The balance of forces of an object that touches rigid bodies.
//!
//! ```text
//! r_u = t f_ext + Σ_p Nᵀ f_p(x_p − c) − f_int(u) − α k (u − u₀)     on the unknown components
//! r_s = F − d · Σ_p f_p                                             for each body pressed by a force
//! ```
//!
//! The last term of r_u anchors an object that its contacts alone hold: springs, a tiny share α of the object's own
//! stiffness, from where it was at the last equilibrium. [`super::system`] solves for what makes r vanish.
//!
//! Symbols: u displacement, s travel of a body along its direction d \[mm\], f force \[N\], F force that presses a body
//! \[N\], N shape functions' values at a contact point, k diagonal of the stiffness at rest \[N/mm\].

use super::body::{Bond, RigidBody};
use super::krylov::{dot, norm};
use super::law::{Memory, Response, Status, response};
use super::report::ContactOptions;
use super::surface::Surface;
use crate::fem::forces::{Materials, add_internal_forces};
use crate::fem::load_curve::Work;
use crate::fem::model::Model;
use crate::fem::stiffness::Kind;
use crate::math::Vec3;
use crate::numerics::cholesky::CholeskyError;
use crate::numerics::linear_solver::LinearSolver;

/// Share of a point's motion along a direction that must be free for it to carry a constraint there.
const LEAST_MOBILITY: f64 = 1e-3;
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
    /// Translation of each body at the last equilibrium \[mm\].
    pub from: Vec<Vec3>,
    /// Displacements at the last equilibrium, `(nodes)` \[mm\].
    pub from_u: Vec<Vec3>,
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
    pub(super) factor: Option<LinearSolver>,
    pub(super) values: Vec<f64>,
    /// The material's tangent alone, where the linear solves need it.
    pub(super) material: Vec<f64>,
    /// Lower triangle of its skew part.
    pub(super) skew: Vec<f64>,
    /// Anchoring springs of the unknowns \[N/mm\].
    pub(super) anchor: Vec<f64>,
    internal: Vec<Vec3>,
    /// Pairs that touch, with their responses at the last state looked at.
    pub touching: Vec<(usize, Response)>,
    /// r_u, then r_s.
    pub(super) residual: Vec<f64>,
    /// Bodies whose travel is unknown.
    pub(super) loose: Vec<usize>,
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
            factor: Some(LinearSolver::new(model.symbolic().clone())?),
            values: vec![0.0; model.symbolic().pattern().rows.len()],
            material: Vec::new(),
            skew: vec![0.0; model.symbolic().pattern().rows.len()],
            anchor: vec![0.0; model.unknowns()],
            internal: vec![Vec3::zeros(); nodes.len()],
            touching: Vec::new(),
            residual: vec![0.0; model.unknowns()],
            loose: Vec::new(),
            work: Work::default(),
        })
    }

    /// Sets penalties and anchors from the stiffness at rest: κ = ratio / Σ (N_a² / k_a), with k_a the mean of node a's
    /// diagonal, and α k.
    pub fn weigh(&mut self, materials: &Materials, options: &ContactOptions) {
        let still = vec![Vec3::zeros(); self.model.mesh.nodes.len()];
        self.model
            .assemble(&still, materials, Kind::Secant, &mut self.values);
        let pattern = self.model.symbolic().pattern();
        let diagonal: Vec<f64> = pattern.columns[..self.model.unknowns()]
            .iter()
            .map(|&first| self.values[first])
            .collect();
        self.anchor = diagonal.iter().map(|k| k * options.anchor).collect();
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
            *penalty = if compliance > 0.0 {
                options.penalty / compliance
            } else {
                0.0
            };
        }
    }

    pub fn at_rest(&self) -> State {
        let mut state = State {
            u: vec![Vec3::zeros(); self.model.mesh.nodes.len()],
            travel: vec![0.0; self.bodies.len()],
            across: vec![Vec3::zeros(); self.bodies.len()],
            memory: Vec::new(),
            from: vec![Vec3::zeros(); self.bodies.len()],
            from_u: vec![Vec3::zeros(); self.model.mesh.nodes.len()],
        };
        let at_start = |pair: &Pair| {
            let place = self.rest[pair.point];
            let distance = self.bodies[pair.body].distance(&Vec3::zeros(), &place);
            Memory {
                normal_n: 0.0,
                tangential_n: Vec3::zeros(),
                place,
                rest_gap_mm: distance.value,
                gap_mm: distance.value,
                normal: distance.gradient,
            }
        };
        state.memory = self.pairs.iter().map(at_start).collect();
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
        let share = match body.bond {
            Bond::Unilateral => memory.touching_share(&(translation - state.from[pair.body])),
            Bond::Bilateral => 1.0,
        };
        let penalty = self.penalty[pair.point];
        Some(response(
            &distance,
            (&moved, share),
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
        self.pull_to_anchors(state);
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

    fn pull_to_anchors(&mut self, state: &State) {
        if self.anchor.iter().all(|k| *k == 0.0) {
            return;
        }
        let way: Vec<Vec3> = state.u.iter().zip(&state.from_u).map(|(u, o)| u - o).collect();
        let mut unknown = vec![0.0; self.anchor.len()];
        self.model.gather(&way, &mut unknown);
        for ((r, k), x) in self.residual.iter_mut().zip(&self.anchor).zip(&unknown) {
            *r -= k * x;
        }
    }

    /// Takes `baseline` from the residual that was last looked at.
    pub fn subtract(&mut self, baseline: &[f64]) {
        self.residual.iter_mut().zip(baseline).for_each(|(r, b)| *r -= b);
    }

    /// Has a point come through a body since the last equilibrium, from one side to another?
    pub fn has_jumped(&self, state: &State) -> bool {
        self.pairs.iter().zip(&state.memory).any(|(pair, memory)| {
            let body = &self.bodies[pair.body];
            let (x, translation) = self.relative_place(state, pair);
            let way = x - translation - memory.place;
            let on_way = [0.25, 0.5, 0.75].map(|t| memory.place + way * t);
            let deepest = -0.5 * body.shape.depth_mm();
            on_way
                .iter()
                .any(|x| body.distance(&Vec3::zeros(), x).value < deepest)
        })
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
            let distance = self.bodies[self.pairs[n].body].distance(&translation, &x);
            let memory = &mut state.memory[n];
            memory.place = x - translation;
            memory.tangential_n = Vec3::zeros();
            memory.gap_mm = distance.value;
            memory.normal = distance.gradient;
        }
        for (n, r) in &self.touching {
            state.memory[*n].tangential_n = r.tangential_n;
            // Touching to the tolerance is touching.
            state.memory[*n].gap_mm = 0.0;
        }
        for body in 0..self.bodies.len() {
            state.from[body] = self.translation(state, body);
        }
        state.from_u.clone_from(&state.u);
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
