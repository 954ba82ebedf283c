//! Quasi-static equilibrium of an object that touches rigid bodies.
//!
//! ```text
//! f_int(u) = t f_ext + Σ f_contact(u, s, a),   u = t ū on the supports,   each body at its travel s or under its force
//! ```
//!
//! From level to level all drives change in proportion: travels and ways from where the bodies are, forces from what they
//! exert. An increment is a semi-smooth Newton iteration on balance and contact together: points touch or not, stick or
//! slide by the present iterate; the multipliers take over the penalties' forces in every iteration that is near balance,
//! until penetration is below its tolerance too. The step length is where the work of the residual along the step
//! vanishes, or nearly. An increment that does not arrive, or that turns an element inside out, is halved; after a
//! success it doubles. Without friction the answer does not depend on the increments; with friction it depends on the
//! path, as it should.
//!
//! Symbols: u displacement, s travel, a way across \[mm\], f force \[N\], t load factor. Sources: Alart and Curnier 1991;
//! Simo and Laursen 1992; Matthies and Strang, The solution of nonlinear finite element equations, International Journal
//! for Numerical Methods in Engineering 14, 1979, for the line search.

use super::balance::{Balance, Imbalance, State, Target};
use super::body::{BodyError, Push, RigidBody};
use super::moment::Moment;
use super::report::{
    BadContact, BodyContact, ContactCurve, ContactLevel, ContactOptions, Level, PointContact,
};
use super::surface::Surface;
use crate::fem::forces::{Materials, smallest_jacobian};
use crate::fem::load_curve::{Load, Stop, Work};
use crate::fem::model::Model;
use crate::math::Vec3;

/// Share of the forces below which the multipliers are updated: near enough to balance to know who touches.
const LOOSE: f64 = 1e-3;
/// Share of the largest displacement that the last step may have where residual and gaps are small: Newton's next one
/// is its square.
const LAST_STEP: f64 = 1e-4;
/// Tries of the line search.
const TRIES: usize = 10;
/// The solver's memory for one object and its bodies.
pub struct ContactSolver<'a> {
    balance: Balance<'a>,
}

impl std::fmt::Debug for ContactSolver<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ContactSolver")
            .field("bodies", &self.balance.bodies.len())
            .field("pairs", &self.balance.pairs.len())
            .finish_non_exhaustive()
    }
}

/// Where a simulation is.
struct Path {
    state: State,
    load_factor: f64,
    /// The state before, and the change of all drives from it to this one.
    previous: Option<(State, Vec<f64>)>,
}

impl<'a> ContactSolver<'a> {
    /// Memory for solves of `model` with contact points `surface` against `bodies`.
    ///
    /// # Errors
    /// [`BadContact`]: a body out of range, an object without contact points, too large a matrix.
    pub fn new(
        model: &'a Model,
        surface: &'a Surface,
        bodies: &'a [RigidBody],
    ) -> Result<ContactSolver<'a>, BadContact> {
        for body in bodies {
            body.check(surface.points.len())?;
        }
        let balance = Balance::new(model, surface, bodies)?;
        if balance.pairs.is_empty() && !bodies.is_empty() {
            return Err(BadContact::NoPoints);
        }
        Ok(ContactSolver { balance })
    }

    /// Goes from rest through the `levels`. `load` acts at each level's load factor.
    ///
    /// # Errors
    /// [`BadContact`]: an option, a drive or a load out of range. Not to arrive is no error: see [`ContactCurve::stop`].
    pub fn curve(
        &mut self,
        materials: &Materials,
        load: &Load,
        levels: &[Level],
        options: &ContactOptions,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<ContactCurve, BadContact> {
        self.check(load, levels, options)?;
        self.balance.work = Work::default();
        self.balance.weigh(materials, options);
        let mut path = Path {
            state: self.balance.at_rest(),
            load_factor: 0.0,
            previous: None,
        };
        let mut curve = ContactCurve {
            levels: Vec::new(),
            stop: Stop::Converged,
            reached: 0.0,
            work: Work::default(),
        };
        let run = Run {
            materials,
            load,
            options,
            cancelled,
        };
        for level in levels {
            match self.reach(&mut path, level, &run) {
                (_, Ok(residual)) => {
                    curve.levels.push(self.report(&path.state, residual));
                    curve.reached = curve.levels.len() as f64;
                }
                (share, Err(stop)) => {
                    curve.reached += share;
                    curve.stop = stop;
                    break;
                }
            }
        }
        curve.work = self.balance.work;
        Ok(curve)
    }

    fn check(&self, load: &Load, levels: &[Level], options: &ContactOptions) -> Result<(), BadContact> {
        options.check()?;
        let nodes = self.balance.model.mesh.nodes.len();
        for field in [Some(&load.forces), load.prescribed.as_ref()]
            .into_iter()
            .flatten()
        {
            if field.len() != nodes || field.iter().any(|v| v.iter().any(|c| !c.is_finite())) {
                let found = field.len();
                return Err(BadContact::Load { found, nodes });
            }
        }
        let bodies = self.balance.bodies.len();
        for (n, level) in levels.iter().enumerate() {
            if level.drives.len() != bodies {
                let drives = level.drives.len();
                return Err(BodyError::Drives {
                    level: n,
                    drives,
                    bodies,
                }
                .into());
            }
            super::shape::finite("load factor", &Vec3::new(level.load_factor, 0.0, 0.0))
                .map_err(BodyError::from)?;
            for drive in &level.drives {
                drive.check()?;
            }
        }
        Ok(())
    }

    /// Goes from where the path is to `level`; the share of the way that was reached, and the residual or why not.
    fn reach(&mut self, path: &mut Path, level: &Level, run: &Run) -> (f64, Result<f64, Stop>) {
        let start = self.here(path, level);
        let end = Moment {
            load_factor: level.load_factor,
            push: level.drives.iter().map(|d| d.push).collect(),
            across: level.drives.iter().map(|d| d.across_mm).collect(),
        };
        let most = self.longest_increment(&start, &end);
        let least = 0.999 * most * 0.5f64.powi(run.options.halvings.min(60) as i32);
        let (mut done, mut increment, mut residual) = (0.0, most, 0.0);
        while done < 1.0 {
            if (run.cancelled)() {
                return (done, Err(Stop::Cancelled));
            }
            let share = if done + increment > 1.0 - 1e-9 {
                1.0
            } else {
                done + increment
            };
            let from = start.between(&end, done);
            let to = start.between(&end, share);
            match self.advance(path, &from, &to, run) {
                Ok((state, found)) => {
                    residual = found;
                    let old = std::mem::replace(&mut path.state, state);
                    path.previous = Some((old, from.change(&to)));
                    path.load_factor = to.load_factor;
                    done = share;
                    increment = (2.0 * increment).min(most);
                }
                Err(stop) => {
                    increment = 0.5 * (share - done);
                    self.balance.work.halvings += 1;
                    // An extrapolation across a failure has failed once already.
                    path.previous = None;
                    if increment < least || stop == Stop::Cancelled {
                        return (done, Err(stop));
                    }
                }
            }
        }
        (1.0, Ok(residual))
    }

    /// The share of the way in which no body can jump over a point of the object.
    fn longest_increment(&self, start: &Moment, end: &Moment) -> f64 {
        let mut most = 1.0_f64;
        for (b, body) in self.balance.bodies.iter().enumerate() {
            let along = match (start.push[b], end.push[b]) {
                (Push::Travel(from), Push::Travel(to)) => to - from,
                _ => 0.0,
            };
            let way = (body.direction * along + end.across[b] - start.across[b]).norm();
            // Beyond its middle a body would push points on, out of its back.
            let depth = 0.5 * body.shape.depth_mm();
            if way > depth {
                most = most.min(depth / way);
            }
        }
        most
    }

    /// Where the drives of `level` are now: travels as they are, forces as they act.
    fn here(&mut self, path: &Path, level: &Level) -> Moment {
        self.balance.meet(&path.state);
        let push = level.drives.iter().enumerate().map(|(b, d)| match d.push {
            Push::Travel(_) => Push::Travel(path.state.travel[b]),
            Push::Force(_) => Push::Force(self.balance.push_of(b).max(0.0)),
        });
        Moment {
            load_factor: path.load_factor,
            push: push.collect(),
            across: path.state.across.clone(),
        }
    }

    /// One increment: from the prediction, and from the last equilibrium if that fails.
    fn advance(&mut self, path: &Path, from: &Moment, to: &Moment, run: &Run) -> Result<(State, f64), Stop> {
        let target = self.target(to, run);
        let mut starts = Vec::new();
        starts.extend(self.extrapolated(path, from, to));
        starts.push(self.carried(path, from, to, run));
        let mut stop = Stop::NotConverged;
        for mut state in starts {
            self.place(&mut state, to, run);
            match self.settle(&mut state, &target, run) {
                Ok(residual) => return Ok((state, residual)),
                Err(Stop::Cancelled) => return Err(Stop::Cancelled),
                Err(found) => stop = found,
            }
        }
        Err(stop)
    }

    fn target(&self, to: &Moment, run: &Run) -> Target {
        let model = self.balance.model;
        let mut external = vec![0.0; model.unknowns()];
        model.gather(&run.load.forces, &mut external);
        external.iter_mut().for_each(|f| *f *= to.load_factor);
        let push = to.push.iter().map(|p| match p {
            Push::Travel(_) => None,
            Push::Force(force) => Some(*force),
        });
        Target {
            external,
            push: push.collect(),
        }
    }

    /// Puts supports and bodies where the moment wants them.
    fn place(&self, state: &mut State, to: &Moment, run: &Run) {
        state.across.clone_from(&to.across);
        for (travel, push) in state.travel.iter_mut().zip(&to.push) {
            if let Push::Travel(way) = push {
                *travel = *way;
            }
        }
        self.place_supports(&mut state.u, to.load_factor, run);
    }

    fn place_supports(&self, u: &mut [Vec3], factor: f64, run: &Run) {
        let prescribed = run.load.prescribed.as_deref();
        for (n, (u, held)) in u.iter_mut().zip(&self.balance.model.constrained).enumerate() {
            let target = prescribed.map_or_else(Vec3::zeros, |p| p[n]);
            for c in 0..3 {
                if held[c] {
                    u[c] = factor * target[c];
                }
            }
        }
    }

    /// The last increment continued, where the drives go on as before.
    fn extrapolated(&self, path: &Path, from: &Moment, to: &Moment) -> Option<State> {
        let (older, change) = path.previous.as_ref()?;
        let next = from.change(to);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (before, now, both) = (dot(change, change), dot(&next, &next), dot(change, &next));
        if both <= 0.0 || both * both < 0.999 * before * now {
            return None;
        }
        let ratio = both / before;
        let mut state = path.state.clone();
        for (u, old) in state.u.iter_mut().zip(&older.u) {
            *u += (*u - old) * ratio;
        }
        for (s, old) in state.travel.iter_mut().zip(&older.travel) {
            *s += (*s - old) * ratio;
        }
        Some(state)
    }

    /// The last equilibrium, its inside carried along linearly where supports move.
    fn carried(&mut self, path: &Path, from: &Moment, to: &Moment, run: &Run) -> State {
        const TINY: f64 = 1e-6;
        let state = path.state.clone();
        let by = to.load_factor - from.load_factor;
        if run.load.prescribed.is_none() || by == 0.0 {
            return state;
        }
        // The force that a tiny move raises, seen through the present stiffness.
        let mut target = self.target(from, run);
        target.push.fill(None);
        let before = self.balance.imbalance(&state, &target, run.materials);
        let mut nudged = state.clone();
        self.place_supports(&mut nudged.u, from.load_factor + TINY * by, run);
        if !before.residual_norm.is_finite() {
            return state;
        }
        let found = self.balance.imbalance(&nudged, &target, run.materials);
        if !found.residual_norm.is_finite() {
            return state;
        }
        match self.balance.step(&state, run.materials, true) {
            Some(step) => self.balance.moved(&state, &step, 1.0 / TINY),
            None => state,
        }
    }
}

/// What stays the same during a simulation.
struct Run<'a> {
    materials: &'a Materials<'a>,
    load: &'a Load,
    options: &'a ContactOptions,
    cancelled: &'a dyn Fn() -> bool,
}

impl ContactSolver<'_> {
    /// Iterates `state` to balance; its memory is then that of the new equilibrium. Returns the residual's share.
    fn settle(&mut self, state: &mut State, target: &Target, run: &Run) -> Result<f64, Stop> {
        let options = run.options;
        let allowed = options.penetration;
        self.balance.approach(state, target)?;
        let mut found = self.balance.imbalance(state, target, run.materials);
        let mut last_step = f64::INFINITY;
        for _ in 0..options.newton_iterations {
            if (run.cancelled)() {
                return Err(Stop::Cancelled);
            }
            if !found.residual_norm.is_finite() {
                return Err(Stop::NotConverged);
            }
            let size = state.u.iter().map(Vec3::amax).fold(0.0, f64::max);
            let size = size.max(allowed * self.balance.surface.spacing_mm());
            let is_still = last_step <= LAST_STEP * size || found.residual_norm == 0.0;
            let is_balanced = found.residual_norm <= options.tolerance * self.scale(&found);
            if is_balanced && is_still && found.violation <= allowed {
                self.check_inversion(state, options)?;
                self.balance.remember(state);
                return Ok(found.residual_norm / self.scale(&found));
            }
            if found.violation > allowed && found.residual_norm <= LOOSE * self.scale(&found) {
                self.balance.update_multipliers(state);
                found = self.balance.imbalance(state, target, run.materials);
            }
            (found, last_step) = self.newton(state, target, found, run)?;
            if self.balance.approach(state, target)? {
                found = self.balance.imbalance(state, target, run.materials);
            }
        }
        Err(Stop::NotConverged)
    }

    /// The forces that a residual is judged by; never less than what a tolerated penetration presses with.
    fn scale(&self, found: &Imbalance) -> f64 {
        let sizes = self.balance.penalty.iter().zip(&self.balance.size_mm);
        let largest = sizes.map(|(k, size)| k * size).fold(0.0, f64::max);
        found.scale.max(1e-6 * largest)
    }

    fn check_inversion(&self, state: &State, options: &ContactOptions) -> Result<(), Stop> {
        let model = self.balance.model;
        let (jacobian, element) =
            smallest_jacobian(&model.parts, &state.u, model.fill.as_deref(), options.least_fill);
        if jacobian > 0.0 {
            return Ok(());
        }
        let place = model.mesh.nodes[model.mesh.elements.nodes_of(element)[0] as usize];
        Err(Stop::Inverted { element, place })
    }

    /// One step of Newton's method; the new imbalance and the largest move \[mm\].
    fn newton(
        &mut self,
        state: &mut State,
        target: &Target,
        before: Imbalance,
        run: &Run,
    ) -> Result<(Imbalance, f64), Stop> {
        self.balance.work.newton_iterations += 1;
        for robust in [false, true] {
            let Some(step) = self.balance.step(state, run.materials, robust) else {
                continue;
            };
            if step.iter().any(|s| !s.is_finite()) {
                continue;
            }
            if let Some((next, found, share)) = self.line_search(state, &step, target, &before, run) {
                *state = next;
                let largest = step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
                return Ok((found, share * largest));
            }
            // The search left its last trial behind.
            self.balance.imbalance(state, target, run.materials);
        }
        Err(Stop::NotConverged)
    }

    /// Goes along `step` to where the residual's work along it has nearly vanished: a full step if that is so there, else
    /// by regula falsi (Illinois).
    fn line_search(
        &mut self,
        state: &State,
        step: &[f64],
        target: &Target,
        before: &Imbalance,
        run: &Run,
    ) -> Option<(State, Imbalance, f64)> {
        let start = self.balance.slope(step);
        let (mut low, mut low_slope) = (0.0, start);
        let mut high: Option<(f64, f64)> = None;
        let mut share = self.balance.longest_share(step);
        let mut best: Option<(State, Imbalance, f64)> = None;
        for _ in 0..TRIES {
            let next = self.balance.moved(state, step, share);
            let found = self.balance.imbalance(&next, target, run.materials);
            if !found.residual_norm.is_finite() {
                high = None;
                share *= 0.25;
                continue;
            }
            let slope = self.balance.slope(step);
            let is_better = found.residual_norm < 0.5 * before.residual_norm;
            // Without descent (friction has no energy) only the residual can judge.
            if slope.abs() <= 0.8 * start.abs() || is_better || start <= 0.0 {
                return Some((next, found, share));
            }
            if best
                .as_ref()
                .is_none_or(|b| found.residual_norm < b.1.residual_norm)
            {
                best = Some((next, found, share));
            }
            if slope > 0.0 {
                // Still downhill at the full step: that far and no farther.
                if high.is_none() {
                    break;
                }
                (low, low_slope) = (share, slope);
                high = high.map(|(x, s)| (x, 0.5 * s));
            } else {
                low_slope *= if high.is_some() { 0.5 } else { 1.0 };
                high = Some((share, slope));
            }
            if let Some((x, s)) = high {
                let place = low + (x - low) * low_slope / (low_slope - s);
                share = place.clamp(low + 0.02 * (x - low), x - 0.02 * (x - low));
            }
        }
        best
    }

    /// Forces, areas and pressures at the equilibrium that was found last. Not looked at anew: the multipliers have moved
    /// on since.
    fn report(&self, state: &State, residual: f64) -> ContactLevel {
        let balance = &self.balance;
        let nodes = &balance.model.mesh.nodes;
        let areas = balance.surface.areas(nodes, &state.u);
        let mut bodies: Vec<BodyContact> = (0..balance.bodies.len())
            .map(|b| BodyContact {
                travel_mm: state.travel[b],
                translation_mm: balance.translation(state, b),
                force_n: Vec3::zeros(),
                moment_n_mm: Vec3::zeros(),
                area_mm2: 0.0,
                penetration_mm: 0.0,
                points: Vec::new(),
            })
            .collect();
        for (n, r) in &balance.touching {
            let pair = balance.pairs[*n];
            let own = &mut bodies[pair.body];
            let place = balance.surface.points[pair.point].place(nodes, &state.u);
            let area = areas[pair.point];
            let arm = place - balance.bodies[pair.body].pose.position - own.translation_mm;
            own.force_n += r.force;
            own.moment_n_mm += arm.cross(&r.force);
            own.area_mm2 += area;
            own.penetration_mm = own.penetration_mm.max(-r.gap_mm);
            own.points.push(PointContact {
                point: pair.point as u32,
                place,
                force_n: r.force,
                pressure_mpa: if area > 0.0 { r.normal_n / area } else { 0.0 },
                area_mm2: area,
                gap_mm: r.gap_mm,
                status: r.status,
            });
        }
        ContactLevel {
            displacements: state.u.clone(),
            bodies,
            residual,
        }
    }

    /// Forces of the supports at a level, `(nodes)` \[N\]; zero on unknown components.
    pub fn reactions(
        &mut self,
        level: &ContactLevel,
        load_factor: f64,
        materials: &Materials,
        load: &Load,
    ) -> Vec<Vec3> {
        let model = self.balance.model;
        let mut forces = vec![Vec3::zeros(); model.mesh.nodes.len()];
        crate::fem::forces::add_internal_forces(&model.parts, &level.displacements, materials, &mut forces);
        for point in level.bodies.iter().flat_map(|b| &b.points) {
            for &(node, w) in &self.balance.surface.points[point.point as usize].weights {
                forces[node as usize] -= point.force_n * w;
            }
        }
        for ((f, e), held) in forces.iter_mut().zip(&load.forces).zip(&model.constrained) {
            for c in 0..3 {
                f[c] = if held[c] { f[c] - e[c] * load_factor } else { 0.0 };
            }
        }
        forces
    }
}
