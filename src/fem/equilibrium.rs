//! Quasi-static equilibrium under growing loads.
//!
//! ```text
//! find u:  f_int(u) = t f_ext on the unknown components,  u = t ū on the prescribed ones,   0 < t ≤ 1
//! ```
//!
//! Every load level is iterated to equilibrium, so the answer does not depend on how many levels there are; the papers'
//! single solve per level was off by 3 % with ten of them. Two iterations take turns:
//!
//! - *Anderson* on `u ← u + K₀⁻¹ (t f_ext − f_int(u))` with one factorisation at rest, K₀: an iteration costs a residual
//!   and a triangular solve, about a tenth of a Newton step. Where a level takes many iterations, the secant matrix of
//!   the current state takes the place of K₀ for the rest of the curve;
//! - *Newton* with the consistent tangent (`newton.rs`), where Anderson stalls.
//!
//! If neither arrives, the load increment is halved and the level is tried again from the last equilibrium. A state with
//! an element turned inside out (det F ≤ 0) is never accepted: there an iteration can converge to a mirror world. Why a
//! curve ends before its last level is found out in `diagnosis.rs`.
//!
//! Symbols: u displacement \[mm\], f force \[N\], K stiffness \[N/mm\], t load factor. Source: Bickel 2010, 7.2.4 iterated
//! to equilibrium; Walker and Ni 2011; Deuflhard 2004.

use super::diagnosis;
use super::forces::{Materials, add_internal_forces, smallest_jacobian};
use super::model::Model;
use super::stiffness::Kind;
use crate::math::Vec3;
use crate::numerics::anderson::Anderson;
use crate::numerics::cholesky::CholeskyError;
use crate::numerics::linear_solver::LinearSolver;

pub use super::load_curve::{BadOption, Curve, Load, NewtonMatrix, Options, Stop, Work};

/// Iterations that Anderson's method remembers.
const DEPTH: usize = 12;
/// Iterations after which a factor has become a poor guide.
const REFRESH: usize = 16;
/// Equilibria before the last that a prediction looks at.
const MEMORY: usize = 2;
/// Iterations without a new best after which Newton takes over.
const PATIENCE: usize = 8;

/// The solver's memory for one model; one a thread.
#[derive(Debug)]
pub struct Solver<'a> {
    pub(super) model: &'a Model,
    pub(super) rest: LinearSolver,
    pub(super) newton: Option<LinearSolver>,
    pub(super) values: Vec<f64>,
    /// Lower triangle of the tangent's skew part; empty until Newton asks for it.
    pub(super) skew: Vec<f64>,
    internal: Vec<Vec3>,
    pub(super) external: Vec<f64>,
    /// Load on the unknowns at factor zero; empty for none.
    bias: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) step: Vec<f64>,
    pub(super) unknowns: Vec<f64>,
    pub(super) memory: Anderson,
    /// Does the accelerated iteration go on with the factor of a later state?
    pub(super) is_refreshed: bool,
    pub(super) work: Work,
}

/// Residual at a state: the forces out of balance and the scale that they are judged by.
pub(super) struct Imbalance {
    pub residual_norm: f64,
    scale: f64,
}

enum Attempt {
    Arrived(f64),
    Failed(Stop),
}

impl<'a> Solver<'a> {
    /// Memory for solves on `model`.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`].
    pub fn new(model: &'a Model) -> Result<Solver<'a>, CholeskyError> {
        let n = model.unknowns();
        Ok(Solver {
            model,
            rest: linear_solver(model)?,
            newton: None,
            values: vec![0.0; model.symbolic().pattern().rows.len()],
            skew: Vec::new(),
            internal: vec![Vec3::zeros(); model.mesh.nodes.len()],
            external: vec![0.0; n],
            bias: Vec::new(),
            residual: vec![0.0; n],
            step: vec![0.0; n],
            unknowns: vec![0.0; n],
            memory: Anderson::new(DEPTH),
            is_refreshed: false,
            work: Work::default(),
        })
    }

    /// Factorises the stiffness at rest with these materials; all loads on them share it.
    ///
    /// # Errors
    /// [`CholeskyError::NotPositiveDefinite`] if the object is not held or a material is not stable at rest.
    pub fn start(&mut self, materials: &Materials) -> Result<(), CholeskyError> {
        let rest = vec![Vec3::zeros(); self.model.mesh.nodes.len()];
        self.model
            .assemble(&rest, materials, Kind::Secant, &mut self.values);
        self.rest.factorise(&self.values)
    }

    /// Displacements at each of the ascending load `factors`, from rest; [`Solver::start`] comes first.
    pub fn curve(
        &mut self,
        materials: &Materials,
        load: &Load,
        factors: &[f64],
        options: &Options,
        cancelled: &dyn Fn() -> bool,
    ) -> Curve {
        let mut path = Path::at_rest(self.model.mesh.nodes.len());
        let mut curve = self.begin();
        if curve.stop == Stop::Converged {
            for &factor in factors {
                if !self.level(&mut curve, &mut path, factor, materials, load, options, cancelled) {
                    break;
                }
            }
        }
        curve.reached = path.factor;
        curve.work = self.work;
        curve
    }

    /// Displacements at each of the `loads`, each `(nodes)` \[N\], from rest; the forces go from one to the next in a straight
    /// line and need not be in proportion. [`Curve::reached`] then counts loads. [`Solver::start`] comes first.
    ///
    /// With F_k the k-th load and s the way that the forces have gone, F(s) = F_{k−1} + (s − s_{k−1}) ΔF_k/|ΔF_k|.
    pub fn route(
        &mut self,
        materials: &Materials,
        loads: &[Vec<Vec3>],
        options: &Options,
        cancelled: &dyn Fn() -> bool,
    ) -> Curve {
        let nodes = self.model.mesh.nodes.len();
        let mut path = Path::at_rest(nodes);
        let mut curve = self.begin();
        let mut from = vec![Vec3::zeros(); nodes];
        for (k, to) in loads.iter().enumerate() {
            let change: Vec<Vec3> = to.iter().zip(&from).map(|(b, a)| b - a).collect();
            let way = change.iter().map(Vec3::norm_squared).sum::<f64>().sqrt();
            if way == 0.0 && curve.stop == Stop::Converged {
                curve.levels.push(path.u.clone());
                curve.reached = (k + 1) as f64;
            }
            if way == 0.0 || curve.stop != Stop::Converged {
                continue;
            }
            let load = Load {
                forces: change.iter().map(|f| f / way).collect(),
                prescribed: None,
            };
            let start = path.factor;
            let before: Vec<Vec3> = from
                .iter()
                .zip(&load.forces)
                .map(|(a, f)| a - f * start)
                .collect();
            self.bias.resize(self.model.unknowns(), 0.0);
            self.model.gather(&before, &mut self.bias);
            self.level(
                &mut curve,
                &mut path,
                start + way,
                materials,
                &load,
                options,
                cancelled,
            );
            curve.reached = k as f64 + (path.factor - start) / way;
            from.clone_from(to);
        }
        self.bias.clear();
        curve.work = self.work;
        curve
    }

    /// An empty curve, and the memory as new: a factor of an earlier curve would make the answer depend on what was solved
    /// before.
    fn begin(&mut self) -> Curve {
        self.work = Work {
            factorisations: 1,
            ..Work::default()
        };
        self.is_refreshed = false;
        self.bias.clear();
        self.memory.restart();
        Curve {
            levels: Vec::new(),
            stop: if self.rest.is_factored() {
                Stop::Converged
            } else {
                Stop::Unstable
            },
            reached: 0.0,
            residual: 0.0,
            work: self.work,
        }
    }

    /// One more level of `curve`; false where it ends before.
    #[allow(clippy::too_many_arguments)]
    fn level(
        &mut self,
        curve: &mut Curve,
        path: &mut Path,
        factor: f64,
        materials: &Materials,
        load: &Load,
        options: &Options,
        cancelled: &dyn Fn() -> bool,
    ) -> bool {
        match self.reach(path, factor, materials, load, options, cancelled) {
            Attempt::Arrived(residual) => {
                curve.residual = residual;
                curve.levels.push(path.u.clone());
                true
            }
            Attempt::Failed(stop) => {
                curve.stop = diagnosis::named(self, stop, path, materials, load);
                false
            }
        }
    }

    /// Goes from the last equilibrium to `target`, halving the increment on trouble and doubling it when that is easy.
    fn reach(
        &mut self,
        path: &mut Path,
        target: f64,
        materials: &Materials,
        load: &Load,
        options: &Options,
        cancelled: &dyn Fn() -> bool,
    ) -> Attempt {
        let whole = target - path.factor;
        let least = whole / 2f64.powi(options.halvings as i32) * 0.999;
        let mut increment = whole;
        let mut residual = 0.0;
        while target - path.factor > 1e-12 * target.abs() {
            if cancelled() {
                return Attempt::Failed(Stop::Cancelled);
            }
            let next = if path.factor + increment > target - 1e-9 * whole {
                target
            } else {
                path.factor + increment
            };
            let mut u = self.predicted(path, next, materials, load);
            match self.settle(&mut u, path, next, materials, load, options, cancelled) {
                Attempt::Arrived(r) => {
                    residual = r;
                    path.accept(u, next);
                    increment *= 2.0;
                }
                Attempt::Failed(stop) => {
                    increment = 0.5 * (next - path.factor);
                    self.work.halvings += 1;
                    if increment < least || stop == Stop::Cancelled {
                        return Attempt::Failed(stop);
                    }
                }
            }
        }
        Attempt::Arrived(residual)
    }

    /// The start of the iteration at factor `next`: the path continued, or the linear answer from rest.
    fn predicted(&mut self, path: &Path, next: f64, materials: &Materials, load: &Load) -> Vec<Vec3> {
        let mut u = path.continued(next);
        let Some(prescribed) = &load.prescribed else {
            return u;
        };
        if path.before.is_empty() {
            self.follow_supports(&mut u, prescribed, next - path.factor, materials);
        }
        self.place_supports(&mut u, prescribed, next);
        u
    }

    fn place_supports(&self, u: &mut [Vec3], prescribed: &[Vec3], factor: f64) {
        for ((u, target), held) in u.iter_mut().zip(prescribed).zip(&self.model.constrained) {
            for c in 0..3 {
                if held[c] {
                    u[c] = factor * target[c];
                }
            }
        }
    }

    /// Moves the unknown components as linear elasticity does when the supports move by `by` times their target: the
    /// force that a tiny move raises, seen through the factor at rest.
    fn follow_supports(&mut self, u: &mut [Vec3], prescribed: &[Vec3], by: f64, materials: &Materials) {
        const TINY: f64 = 1e-6;
        let mut moved = u.to_vec();
        for ((u, target), held) in moved.iter_mut().zip(prescribed).zip(&self.model.constrained) {
            for c in 0..3 {
                if held[c] {
                    u[c] += TINY * by * target[c];
                }
            }
        }
        self.internal.fill(Vec3::zeros());
        add_internal_forces(&self.model.parts, &moved, materials, &mut self.internal);
        self.model.gather(&self.internal, &mut self.step);
        self.work.residuals += 1;
        self.rest.solve(&mut self.step);
        self.model.gather(u, &mut self.unknowns);
        for (x, s) in self.unknowns.iter_mut().zip(&self.step) {
            *x -= s / TINY;
        }
        self.model.spread(&self.unknowns, u);
    }

    /// Iterates `u` to equilibrium at factor `t`.
    #[allow(clippy::too_many_arguments)]
    fn settle(
        &mut self,
        u: &mut Vec<Vec3>,
        path: &Path,
        t: f64,
        materials: &Materials,
        load: &Load,
        options: &Options,
        cancelled: &dyn Fn() -> bool,
    ) -> Attempt {
        self.model.gather(&load.forces, &mut self.external);
        self.external.iter_mut().for_each(|f| *f *= t);
        self.external
            .iter_mut()
            .zip(&self.bias)
            .for_each(|(f, b)| *f += b);
        let start = u.clone();
        let arrived = self
            .accelerated(u, materials, options, cancelled)
            .or_else(|| {
                u.clone_from(&start);
                self.newton(u, materials, options, cancelled)
            })
            .or_else(|| {
                // The prediction itself may have been the trouble.
                path.before.last()?;
                u.clone_from(&path.u);
                if let Some(prescribed) = &load.prescribed {
                    self.place_supports(u, prescribed, t);
                }
                self.newton(u, materials, options, cancelled)
            });
        let Some(residual) = arrived else {
            path.failed.replace(u.clone());
            return Attempt::Failed(if cancelled() {
                Stop::Cancelled
            } else {
                Stop::NotConverged
            });
        };
        let (jacobian, element) = smallest_jacobian(
            &self.model.parts,
            u,
            self.model.fill.as_deref(),
            options.least_fill,
        );
        if jacobian <= 0.0 {
            let place = self.model.mesh.nodes[self.model.mesh.elements.nodes_of(element)[0] as usize];
            return Attempt::Failed(Stop::Inverted { element, place });
        }
        Attempt::Arrived(residual)
    }

    /// The residual at `u`, left in `self.residual`.
    pub(super) fn imbalance(&mut self, u: &[Vec3], materials: &Materials) -> Imbalance {
        self.work.residuals += 1;
        self.internal.fill(Vec3::zeros());
        add_internal_forces(&self.model.parts, u, materials, &mut self.internal);
        self.model.gather(&self.internal, &mut self.residual);
        let mut load = 0.0;
        for (r, f) in self.residual.iter_mut().zip(&self.external) {
            *r = f - *r;
            load += f * f;
        }
        // Reactions count as load too: they are all there is when displacements are prescribed.
        let reactions: f64 = self
            .internal
            .iter()
            .zip(&self.model.constrained)
            .map(|(f, held)| (0..3).filter(|&c| held[c]).map(|c| f[c] * f[c]).sum::<f64>())
            .sum();
        Imbalance {
            residual_norm: norm(&self.residual),
            scale: load.sqrt() + reactions.sqrt(),
        }
    }

    /// Anderson's iteration. It starts from the factor at rest; where that has become a poor guide, the secant matrix of the
    /// current state takes its place for the rest of the curve.
    fn accelerated(
        &mut self,
        u: &mut [Vec3],
        materials: &Materials,
        options: &Options,
        cancelled: &dyn Fn() -> bool,
    ) -> Option<f64> {
        let (mut best, mut best_at, mut since_factor) = (f64::INFINITY, 0, 0);
        // The load enters the residual as a constant: what the last level taught about its slope holds.
        self.memory.carry_on();
        self.model.gather(u, &mut self.unknowns);
        for iteration in 0..options.accelerated_iterations {
            let found = self.imbalance(u, materials);
            self.step.copy_from_slice(&self.residual);
            self.precondition();
            let size = largest(&self.step);
            if !size.is_finite() || cancelled() {
                return None;
            }
            if is_settled(&found, size, u, options) {
                return Some(relative(&found));
            }
            if size < best {
                (best, best_at) = (size, iteration);
            } else if iteration > best_at + PATIENCE {
                return None;
            }
            since_factor += 1;
            if since_factor > REFRESH && self.refresh(u, materials) {
                since_factor = 0;
                (best, best_at) = (f64::INFINITY, iteration);
                continue;
            }
            self.work.accelerated_iterations += 1;
            self.memory.advance(&mut self.unknowns, &self.step);
            self.model.spread(&self.unknowns, u);
        }
        None
    }

    /// `self.step` seen through the factor in use.
    fn precondition(&mut self) {
        match &mut self.newton {
            Some(factor) if self.is_refreshed => factor.solve(&mut self.step),
            _ => self.rest.solve(&mut self.step),
        }
    }

    /// Factorises the secant matrix at `u` for the iterations to come.
    fn refresh(&mut self, u: &[Vec3], materials: &Materials) -> bool {
        if self.newton.is_none() {
            self.newton = linear_solver(self.model).ok();
        }
        self.is_refreshed = self.factorise_at(u, materials, Kind::Secant);
        self.memory.restart();
        self.is_refreshed
    }

    /// Forces that the supports exert at the displacements `u`, `(nodes)` \[N\]; zero on unknown components.
    pub fn reactions(&mut self, u: &[Vec3], materials: &Materials, external: &[Vec3]) -> Vec<Vec3> {
        let mut forces = vec![Vec3::zeros(); u.len()];
        add_internal_forces(&self.model.parts, u, materials, &mut forces);
        for ((f, e), held) in forces.iter_mut().zip(external).zip(&self.model.constrained) {
            for c in 0..3 {
                f[c] = if held[c] { f[c] - e[c] } else { 0.0 };
            }
        }
        forces
    }
}

/// Residual at which iterative linear solves end. They need not be exact: the residual that they are given is, so what
/// one leaves is made up for in the next iteration.
pub(super) const INEXACT: f64 = 1e-4;

/// A solver by the size of the model.
pub(super) fn linear_solver(model: &Model) -> Result<LinearSolver, CholeskyError> {
    let mut solver = LinearSolver::new(model.symbolic().clone())?;
    solver.set_tolerance(INEXACT);
    Ok(solver)
}

/// The equilibria met so far.
pub(super) struct Path {
    pub u: Vec<Vec3>,
    pub factor: f64,
    /// Up to two equilibria before, the latest last.
    before: Vec<(Vec<Vec3>, f64)>,
    /// Where the last iteration that failed ended.
    pub failed: std::cell::RefCell<Vec<Vec3>>,
}

impl Path {
    fn at_rest(nodes: usize) -> Path {
        Path {
            u: vec![Vec3::zeros(); nodes],
            factor: 0.0,
            before: Vec::new(),
            failed: std::cell::RefCell::default(),
        }
    }

    /// The polynomial in the load factor through the equilibria known, at `next`.
    fn continued(&self, next: f64) -> Vec<Vec3> {
        let factors: Vec<f64> = self.before.iter().map(|b| b.1).chain([self.factor]).collect();
        let share = |k: usize| -> f64 {
            let others = (0..factors.len()).filter(|&j| j != k);
            others
                .map(|j| (next - factors[j]) / (factors[k] - factors[j]))
                .product()
        };
        let own = share(factors.len() - 1);
        let mut u: Vec<Vec3> = self.u.iter().map(|u| u * own).collect();
        for (k, (older, _)) in self.before.iter().enumerate() {
            let share = share(k);
            u.iter_mut().zip(older).for_each(|(u, o)| *u += o * share);
        }
        u
    }

    fn accept(&mut self, u: Vec<Vec3>, factor: f64) {
        if self.before.len() == MEMORY {
            self.before.remove(0);
        }
        self.before.push((std::mem::replace(&mut self.u, u), self.factor));
        self.factor = factor;
    }
}

pub(super) fn is_settled(found: &Imbalance, step: f64, u: &[Vec3], options: &Options) -> bool {
    let size = u.iter().map(Vec3::amax).fold(0.0, f64::max);
    found.residual_norm <= options.tolerance * found.scale && step <= options.tolerance * size
}

pub(super) fn relative(found: &Imbalance) -> f64 {
    if found.scale > 0.0 {
        found.residual_norm / found.scale
    } else {
        0.0
    }
}

pub(super) fn norm(a: &[f64]) -> f64 {
    a.iter().map(|a| a * a).sum::<f64>().sqrt()
}

pub(super) fn largest(a: &[f64]) -> f64 {
    // f64::max drops NaN, which must be seen.
    a.iter()
        .fold(0.0, |m, a| if a.is_nan() { f64::NAN } else { a.abs().max(m) })
}
