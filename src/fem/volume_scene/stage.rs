//! The cases of a scene on a volume mesh, simulated.
//!
//! A case in proportion is one load curve. On a path each level is a load of its own and is reached from rest: materials
//! here are elastic, so an equilibrium does not depend on the way to it as long as there is one alone.

use super::super::contact::{
    BadContact, BodyContact, ContactOptions, ContactSolver, Level, RigidBody, Surface,
};
use super::super::elements::Discretisation;
use super::super::equilibrium::{Curve, Load, Options, Solver, Stop, Work};
use super::super::forces::{Materials, PointFields, add_internal_forces, point_fields};
use super::super::model::{Constrained, Model, ModelError};
use super::super::stage::{Support, stepped};
use super::loads::{Loading, Wired, wire};
use super::{VolumeScene, bodies};
use crate::material::law::Law;
use crate::math::Vec3;
use crate::numerics::cholesky::CholeskyError;
use crate::units::document::Mistake;
use rayon::prelude::*;
use std::sync::Arc;

/// Why there is no stage.
#[derive(Debug, thiserror::Error)]
pub enum VolumeStageError {
    /// Something in the file is wrong.
    #[error(transparent)]
    Mistake(#[from] Mistake),
    /// The mesh cannot be simulated.
    #[error("{file}: {error}")]
    Model {
        /// The scene.
        file: String,
        /// What is wrong.
        error: ModelError,
    },
}

/// One case, wired.
#[derive(Clone, Debug)]
pub struct VolumeCase {
    /// Its name.
    pub name: String,
    /// Unknowns and matrix.
    pub model: Arc<Model>,
    /// What holds and moves the object; moves first.
    pub supports: Vec<Support>,
    /// Its load.
    pub loading: Loading,
}

/// The cases of a scene with the laws at the mesh's integration points.
#[derive(Clone, Debug)]
pub struct VolumeStage {
    /// The cases.
    pub cases: Vec<VolumeCase>,
    bodies: Vec<RigidBody>,
    surface: Surface,
    laws: Vec<Law>,
    region_of_point: Vec<u16>,
}

/// What a case came to.
#[derive(Clone, Debug)]
pub struct VolumeOutcome {
    /// Displacements at every level that was reached, each `(nodes)` \[mm\].
    pub levels: Vec<Vec<Vec3>>,
    /// Force of the supports on each node at every level, `(levels × nodes)` \[N\]; zero where nothing is held.
    pub reactions: Vec<Vec<Vec3>>,
    /// What each rigid body does at every level, `(levels × bodies)`.
    pub bodies: Vec<Vec<BodyContact>>,
    /// Work done on the object from rest to each level \[mJ\]: of the external forces, of the supports that move and of the
    /// rigid bodies; by the trapezoidal rule over the levels.
    pub work_done: Vec<f64>,
    /// Why it ended.
    pub stop: Stop,
    /// Share of the load that was reached; on a path, share of its levels.
    pub reached: f64,
    /// Residual force of the last state, as a share of the load.
    pub residual: f64,
    /// What it cost.
    pub work: Work,
}

impl VolumeStage {
    /// Wires the cases of a scene.
    ///
    /// # Errors
    /// [`VolumeStageError`]: an unknown set, a load that makes no sense, a part that nothing holds.
    pub fn new(scene: &VolumeScene) -> Result<VolumeStage, VolumeStageError> {
        let fail = |error: ModelError| VolumeStageError::Model {
            file: scene.document.file.display().to_string(),
            error,
        };
        let regions = Some(scene.region_of.as_slice());
        let parts = Discretisation::with(&scene.file.mesh, None, scene.volumetric, regions)
            .map_err(|e| fail(e.into()))?;
        let mut models: Vec<(Vec<Constrained>, Arc<Model>)> = Vec::new();
        let mut cases = Vec::new();
        for text in &scene.loads {
            let Wired {
                constrained,
                supports,
                loading,
            } = wire(scene, &parts, text)?;
            let known = models.iter().find(|(c, _)| *c == constrained);
            let model = match known.map(|(_, m)| Arc::clone(m)) {
                Some(model) => model,
                None => {
                    let mesh = scene.file.mesh.clone();
                    let model = Model::with(mesh, None, constrained.clone(), scene.volumetric, regions);
                    let model = Arc::new(model.map_err(fail)?);
                    models.push((constrained, Arc::clone(&model)));
                    model
                }
            };
            cases.push(VolumeCase {
                name: text.name.get_ref().clone(),
                model,
                supports,
                loading,
            });
        }
        let n = parts.points_per_element();
        let region_of_point = scene.region_of.iter().flat_map(|&r| vec![r; n]).collect();
        let surface = Surface::of_mesh(&scene.file.mesh);
        Ok(VolumeStage {
            cases,
            bodies: bodies::hold(scene, &surface)?,
            surface,
            laws: scene.regions.iter().map(|r| r.law.clone()).collect(),
            region_of_point,
        })
    }

    /// Simulates all cases, each in `steps` load steps from one level to the next. The answer does not depend on the
    /// number of threads.
    ///
    /// # Errors
    /// [`BadContact`]: out of memory; a rigid body out of range, or nothing that it can touch.
    pub fn simulate(
        &self,
        options: &Options,
        steps: usize,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<VolumeOutcome>, BadContact> {
        let laws: Vec<&Law> = self.laws.iter().collect();
        let materials = self.materials(&laws);
        let one = |case: &VolumeCase| match &case.loading {
            Loading::Proportional { load, shares } => Ok(without_bodies(case, &materials, |solver| {
                proportional(solver, &materials, load, shares, options, steps, cancelled)
            })?),
            Loading::Path { levels } => Ok(without_bodies(case, &materials, |solver| {
                path(solver, &materials, levels, options, steps, cancelled)
            })?),
            Loading::Contact { load, shares, drives } => {
                let levels = shares.iter().zip(drives).map(|(share, drives)| Level {
                    load_factor: *share,
                    drives: drives.clone(),
                });
                let levels: Vec<Level> = levels.collect();
                self.with_bodies(case, &materials, load, &levels, options, cancelled)
            }
        };
        self.cases.par_iter().map(one).collect()
    }

    fn with_bodies(
        &self,
        case: &VolumeCase,
        materials: &Materials,
        load: &Load,
        levels: &[Level],
        options: &Options,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<VolumeOutcome, BadContact> {
        let options = ContactOptions {
            tolerance: options.tolerance,
            ..ContactOptions::default()
        };
        let mut solver = ContactSolver::new(&case.model, &self.surface, &self.bodies)?;
        let curve = solver.curve(materials, load, levels, &options, &|| cancelled())?;
        let mut outcome = VolumeOutcome {
            levels: Vec::new(),
            reactions: Vec::new(),
            bodies: Vec::new(),
            work_done: Vec::new(),
            stop: curve.stop,
            reached: curve.reached / levels.len().max(1) as f64,
            residual: curve.levels.last().map_or(0.0, |l| l.residual),
            work: curve.work,
        };
        for (level, wanted) in curve.levels.into_iter().zip(levels) {
            let reactions = solver.reactions(&level, wanted.load_factor, materials, load);
            outcome.reactions.push(reactions);
            outcome.levels.push(level.displacements);
            outcome.bodies.push(level.bodies);
        }
        outcome.work_done = work_done(case, materials, &outcome.levels);
        Ok(outcome)
    }

    fn materials<'a>(&'a self, laws: &'a [&'a Law]) -> Materials<'a> {
        Materials {
            laws,
            cell_of_point: &self.region_of_point,
        }
    }

    /// Strain and stress at the integration points of a case at the displacements `u`, `(nodes)` \[mm\].
    pub fn fields(&self, case: &VolumeCase, u: &[Vec3]) -> PointFields {
        let laws: Vec<&Law> = self.laws.iter().collect();
        point_fields(&case.model.parts, u, &self.materials(&laws))
    }

    /// The energy that a case's object holds at the strains of `fields` \[mJ\]; `None` where a law has none.
    pub fn stored_energy(&self, case: &VolumeCase, fields: &PointFields) -> Option<f64> {
        let mut sum = 0.0;
        for (q, strain) in fields.strain.iter().enumerate() {
            let law = &self.laws[usize::from(self.region_of_point[q])];
            sum += case.model.parts.weight(q) * law.energy(strain)?;
        }
        Some(sum)
    }
}

fn without_bodies(
    case: &VolumeCase,
    materials: &Materials,
    solve: impl FnOnce(&mut Solver) -> Curve,
) -> Result<VolumeOutcome, CholeskyError> {
    let mut solver = Solver::new(&case.model)?;
    match solver.start(materials) {
        Ok(()) | Err(CholeskyError::NotPositiveDefinite { .. }) => {}
        Err(other) => return Err(other),
    }
    let curve = solve(&mut solver);
    let reactions = curve.levels.iter().enumerate();
    let reactions = reactions
        .map(|(k, u)| solver.reactions(u, materials, &case.loading.forces(k)))
        .collect();
    Ok(VolumeOutcome {
        reactions,
        bodies: Vec::new(),
        work_done: work_done(case, materials, &curve.levels),
        levels: curve.levels,
        stop: curve.stop,
        reached: curve.reached,
        residual: curve.residual,
        work: curve.work,
    })
}

/// Work done on the object, from rest to each level \[mJ\]: in equilibrium the internal forces are what pushes on each node,
/// whoever does. By the trapezoidal rule over the levels.
fn work_done(case: &VolumeCase, materials: &Materials, levels: &[Vec<Vec3>]) -> Vec<f64> {
    let rest = vec![Vec3::zeros(); case.model.mesh.nodes.len()];
    let (mut before, mut pushed, mut sum) = (&rest, rest.clone(), 0.0);
    let mut done = Vec::new();
    for u in levels {
        let mut push = vec![Vec3::zeros(); rest.len()];
        add_internal_forces(&case.model.parts, u, materials, &mut push);
        for ((u, b), (f, p)) in u.iter().zip(before).zip(push.iter().zip(&pushed)) {
            sum += 0.5 * (f + p).dot(&(u - b));
        }
        done.push(sum);
        (before, pushed) = (u, push);
    }
    done
}

/// One load curve, of which the levels asked for are kept.
fn proportional(
    solver: &mut Solver,
    materials: &Materials,
    load: &Load,
    shares: &[f64],
    options: &Options,
    steps: usize,
    cancelled: &dyn Fn() -> bool,
) -> Curve {
    let mut curve = solver.curve(materials, load, &stepped(shares, steps), options, cancelled);
    let mut index = 0;
    curve.levels.retain(|_| {
        index += 1;
        index % steps == 0
    });
    curve
}

/// Each level of a path from rest.
fn path(
    solver: &mut Solver,
    materials: &Materials,
    levels: &[Load],
    options: &Options,
    steps: usize,
    cancelled: &dyn Fn() -> bool,
) -> Curve {
    let factors = stepped(&[1.0], steps);
    let mut whole = Curve {
        levels: Vec::new(),
        stop: Stop::Converged,
        reached: 0.0,
        residual: 0.0,
        work: Work::default(),
    };
    for load in levels {
        let mut curve = solver.curve(materials, load, &factors, options, cancelled);
        add_work(&mut whole.work, &curve.work);
        (whole.stop, whole.residual) = (curve.stop, curve.residual);
        match (curve.stop, curve.levels.pop()) {
            (Stop::Converged, Some(u)) => whole.levels.push(u),
            _ => break,
        }
    }
    whole.reached = whole.levels.len() as f64 / levels.len().max(1) as f64;
    whole
}

fn add_work(sum: &mut Work, own: &Work) {
    sum.accelerated_iterations += own.accelerated_iterations;
    sum.newton_iterations += own.newton_iterations;
    sum.linear_iterations += own.linear_iterations;
    sum.factorisations += own.factorisations;
    sum.residuals += own.residuals;
    sum.halvings += own.halvings;
}
