//! An object with its materials in place and its load cases, ready to be simulated: what a scene, or a found layout
//! under its goal's examples, comes down to.
//!
//! A press adds known forces to the supports of all cases; a move prescribes displacements and so has its own set of
//! unknowns. Every case starts from rest. Levels are what is reported; between two levels the load may be taken in more
//! steps, which changes the work but not the answer, since every step is iterated to equilibrium.

use super::equilibrium::{Load, Options, Solver, Stop, Work};
use super::example::{Example, Sensor};
use super::forces::{Materials, PointFields, point_fields};
use super::model::{Constrained, Model};
use super::rig::{Layout, RigError, cells_of_points, grid_for};
use super::scene::{Move, Scene};
use super::setup::{FixedText, Setup};
use crate::geometry::grid::Grid;
use crate::material::law::Law;
use crate::math::Vec3;
use crate::numerics::cholesky::CholeskyError;
use crate::units::document::{Document, Mistake};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// The object, held, filled and wired.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The grid over the object.
    pub grid: Grid,
    /// The cell of each integration point, `(points)`.
    pub cell_of_point: Vec<u16>,
    /// The laws that the layout refers to.
    pub laws: Vec<Law>,
    /// For each cell, its law.
    pub layout: Layout,
    /// What is done to the object.
    pub cases: Vec<Case>,
    /// Nodes to report.
    pub nodes: Vec<usize>,
}

/// One load case.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its name.
    pub name: String,
    /// Force or displacement.
    pub kind: CaseKind,
    /// Unknowns and matrix.
    pub model: Arc<Model>,
    /// Forces or displacements at the last level.
    pub load: Load,
    /// Share of the load at each level, ascending to 1.
    pub factors: Vec<f64>,
    /// Points to report \[mm\], each with its sensor.
    pub points: Vec<(Vec3, Sensor)>,
    /// What holds or moves the object.
    pub supports: Vec<Support>,
}

/// What a case's levels are.
#[derive(Clone, Debug, PartialEq)]
pub enum CaseKind {
    /// Known forces \[N\], one a level.
    Press {
        /// The forces.
        forces_n: Vec<f64>,
        /// The contact point on the surface \[mm\].
        contact_point: Vec3,
    },
    /// A displacement at the last level \[mm\]; `None` where a component stays free.
    Move {
        /// The displacement.
        displacement: [Option<f64>; 3],
    },
}

/// What a support holds. A component of a node belongs to the first support that names it, so that reactions add up.
#[derive(Clone, Debug, PartialEq)]
pub struct Support {
    /// Its name, for instance `fixed 1 (bottom)`.
    pub name: String,
    /// Its nodes, ascending, with the components that it holds.
    pub held: Vec<(usize, Constrained)>,
}

impl Support {
    /// The sum of a nodal field, `(nodes)`, over what the support holds.
    pub(super) fn sum(&self, field: &[Vec3]) -> Vec3 {
        let part = |&(node, held): &(usize, Constrained)| {
            let value = field[node];
            Vec3::from([0, 1, 2].map(|c| if held[c] { value[c] } else { 0.0 }))
        };
        self.held.iter().map(part).sum()
    }
}

/// What a case came to.
#[derive(Clone, Debug)]
pub struct CaseOutcome {
    /// Displacements at every level that was reached, each `(nodes)` \[mm\].
    pub levels: Vec<Vec<Vec3>>,
    /// Force that each support exerts at every level that was reached, `(levels × supports)` \[N\].
    pub reactions: Vec<Vec<Vec3>>,
    /// Strain and stress at the last level that was reached; at rest if none was.
    pub fields: PointFields,
    /// Why it ended.
    pub stop: Stop,
    /// Share of the load that was reached.
    pub reached: f64,
    /// Residual force of the last state, as a share of the load.
    pub residual: f64,
    /// What it cost.
    pub work: Work,
}

impl Stage {
    /// The stage of a scene.
    ///
    /// # Errors
    /// [`RigError`]: too fine a grid, supports, presses, moves or points that miss the object.
    pub fn of_scene(scene: &Scene) -> Result<Stage, RigError> {
        let laws = scene.materials.iter().map(|m| m.law.clone()).collect();
        let setup = &scene.setup;
        let spans = &scene.press_spans;
        let mut stage = Stage::of_examples(setup, laws, scene.layout.clone(), spans)?;
        for own in &scene.moves {
            let case = move_case(setup, own, &scene.points, &stage.grid)?;
            stage.cases.push(case);
        }
        for node in &scene.nodes {
            let count = stage.grid.mesh.nodes.len();
            if *node.get_ref() >= count {
                let message = format!("found node {}, expected 0 to {}", node.get_ref(), count - 1);
                return Err(setup.document.mistake(&node.span(), message).into());
            }
            stage.nodes.push(*node.get_ref());
        }
        Ok(stage)
    }

    /// The stage of a layout under examples; `spans`, where known, says where each stands in the file.
    ///
    /// # Errors
    /// As [`Stage::of_scene`].
    pub fn of_examples(
        setup: &Setup,
        laws: Vec<Law>,
        layout: Layout,
        spans: &[Range<usize>],
    ) -> Result<Stage, RigError> {
        let grid = grid_for(&setup.object.solid, &setup.cells, setup.element_size_mm)?;
        let cell_of_point = cells_of_points(&grid, &setup.cells);
        let mut cases = Vec::new();
        if !setup.examples.is_empty() {
            let (constrained, supports) = supports(setup, &grid)?;
            let model = Arc::new(model(&setup.document, &grid, constrained)?);
            for (index, example) in setup.examples.iter().enumerate() {
                let span = spans.get(index).cloned().unwrap_or(0..0);
                cases.push(press_case(setup, example, span, &grid, &model, &supports)?);
            }
        }
        Ok(Stage {
            grid,
            cell_of_point,
            laws,
            layout,
            cases,
            nodes: Vec::new(),
        })
    }

    /// Simulates all cases, each in `steps` load steps from one level to the next. The answer does not depend on the number
    /// of threads.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`].
    pub fn simulate(
        &self,
        options: &Options,
        steps: usize,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<CaseOutcome>, CholeskyError> {
        self.cases
            .par_iter()
            .map(|case| self.case(case, options, steps, cancelled))
            .collect()
    }

    fn case(
        &self,
        case: &Case,
        options: &Options,
        steps: usize,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<CaseOutcome, CholeskyError> {
        let laws: Vec<&Law> = self.layout.iter().map(|&m| &self.laws[m as usize]).collect();
        let materials = Materials {
            laws: &laws,
            cell_of_point: &self.cell_of_point,
        };
        let mut solver = Solver::new(&case.model)?;
        match solver.start(&materials) {
            Ok(()) | Err(CholeskyError::NotPositiveDefinite { .. }) => {}
            Err(other) => return Err(other),
        }
        let factors = stepped(&case.factors, steps);
        let mut curve = solver.curve(&materials, &case.load, &factors, options, cancelled);
        let mut index = 0;
        curve.levels.retain(|_| {
            index += 1;
            index % steps == 0
        });
        let reactions = curve
            .levels
            .iter()
            .zip(&case.factors)
            .map(|(u, t)| {
                let external: Vec<Vec3> = case.load.forces.iter().map(|f| f * *t).collect();
                let nodal = solver.reactions(u, &materials, &external);
                case.supports.iter().map(|s| s.sum(&nodal)).collect()
            })
            .collect();
        let rest = || vec![Vec3::zeros(); self.grid.mesh.nodes.len()];
        let last = curve.levels.last().cloned().unwrap_or_else(rest);
        Ok(CaseOutcome {
            fields: point_fields(&case.model.parts, &last, &materials),
            levels: curve.levels,
            reactions,
            stop: curve.stop,
            reached: curve.reached,
            residual: curve.residual,
            work: curve.work,
        })
    }
}

/// Each level's increment from the one before (from rest for the first) in `steps` equal parts; the levels themselves
/// stay what they are, bit for bit.
pub(super) fn stepped(factors: &[f64], steps: usize) -> Vec<f64> {
    let mut all = Vec::with_capacity(factors.len() * steps);
    let mut before = 0.0;
    for &factor in factors {
        all.extend((1..steps).map(|k| before + (factor - before) * k as f64 / steps as f64));
        all.push(factor);
        before = factor;
    }
    all
}

fn model(document: &Document, grid: &Grid, constrained: Vec<Constrained>) -> Result<Model, RigError> {
    Model::new(grid.mesh.clone(), Some(grid.fill.clone()), constrained).map_err(|error| RigError::Model {
        file: document.file.display().to_string(),
        error,
    })
}

/// What `[[fixed]]` holds.
fn supports(setup: &Setup, grid: &Grid) -> Result<(Vec<Constrained>, Vec<Support>), Mistake> {
    let mut constrained = vec![[false; 3]; grid.mesh.nodes.len()];
    let mut supports: Vec<Support> = Vec::new();
    for (index, fixed) in setup.fixed.iter().enumerate() {
        let before = constrained.clone();
        fixed.hold(&setup.document, grid, &mut constrained)?;
        supports.push(Support {
            name: support_name(index, fixed),
            held: added(&before, &constrained),
        });
    }
    Ok((constrained, supports))
}

/// The components that `after` holds and `before` does not.
fn added(before: &[Constrained], after: &[Constrained]) -> Vec<(usize, Constrained)> {
    before
        .iter()
        .zip(after)
        .enumerate()
        .filter(|(_, (b, a))| a != b)
        .map(|(node, (b, a))| (node, [0, 1, 2].map(|c| a[c] && !b[c])))
        .collect()
}

fn support_name(index: usize, fixed: &FixedText) -> String {
    let place = match (&fixed.face, &fixed.box_mm) {
        (Some(face), _) => face.get_ref().as_str(),
        (None, Some(_)) => "box",
        (None, None) => "cylinder",
    };
    format!("fixed {} ({place})", index + 1)
}

/// The nodes of a support, ascending.
fn nodes_of(fixed: &FixedText, document: &Document, grid: &Grid) -> Result<Vec<usize>, Mistake> {
    let mut held = vec![[false; 3]; grid.mesh.nodes.len()];
    fixed.hold(document, grid, &mut held)?;
    Ok((0..held.len()).filter(|&n| held[n] != [false; 3]).collect())
}

fn press_case(
    setup: &Setup,
    example: &Example,
    span: Range<usize>,
    grid: &Grid,
    model: &Arc<Model>,
    supports: &[Support],
) -> Result<Case, Mistake> {
    let fail = |message: String| {
        let message = format!("{:?}: {message}", example.name);
        setup.document.mistake(&span, message)
    };
    let (mut forces, contact_point) = example
        .contact
        .unit_load(&setup.object.solid, grid)
        .map_err(|e| fail(e.to_string()))?;
    let largest = *example
        .forces_n
        .last()
        .ok_or_else(|| fail("has no forces".into()))?;
    forces.iter_mut().for_each(|f| *f *= largest);
    let mut points = Vec::new();
    for point in &example.points {
        let at_contact = point.place == example.contact.point;
        let place = if at_contact { contact_point } else { point.place };
        points.push((place, sensor(grid, &place).map_err(&fail)?));
    }
    Ok(Case {
        name: example.name.clone(),
        kind: CaseKind::Press {
            forces_n: example.forces_n.clone(),
            contact_point,
        },
        model: Arc::clone(model),
        load: Load {
            forces,
            prescribed: None,
        },
        factors: example.forces_n.iter().map(|f| f / largest).collect(),
        points,
        supports: supports.to_vec(),
    })
}

fn sensor(grid: &Grid, place: &Vec3) -> Result<Sensor, String> {
    Sensor::at(grid, place).ok_or_else(|| {
        let [x, y, z] = [place.x, place.y, place.z];
        format!("no element lies near the point ({x:.1}, {y:.1}, {z:.1}) mm: use smaller elements")
    })
}

fn move_case(setup: &Setup, own: &Move, points: &[Vec3], grid: &Grid) -> Result<Case, RigError> {
    let document = &setup.document;
    let (mut constrained, mut supports) = supports(setup, grid)?;
    let nodes = nodes_of(&own.place, document, grid)?;
    let before = constrained.clone();
    let mut prescribed = vec![Vec3::zeros(); constrained.len()];
    for &node in &nodes {
        for c in 0..3 {
            let Some(target) = own.displacement[c] else {
                continue;
            };
            if constrained[node][c] && target != 0.0 {
                let [x, y, z] = [0, 1, 2].map(|k| grid.mesh.nodes[node][k]);
                let message = format!(
                    "move {:?} shifts the node at ({x:.1}, {y:.1}, {z:.1}) mm along {}, where a [[fixed]] holds it: keep the two places apart, or free that component",
                    own.name,
                    ["x", "y", "z"][c]
                );
                return Err(document.mistake(&own.span, message).into());
            }
            constrained[node][c] = true;
            prescribed[node][c] = target;
        }
    }
    // What moves the object is asked for first.
    supports.insert(
        0,
        Support {
            name: own.name.clone(),
            held: added(&before, &constrained),
        },
    );
    let fail = |message: String| document.mistake(&own.span, format!("{:?}: {message}", own.name));
    let points = points
        .iter()
        .map(|p| Ok((*p, sensor(grid, p).map_err(fail)?)))
        .collect::<Result<Vec<_>, Mistake>>()?;
    let model = Arc::new(model(document, grid, constrained)?);
    Ok(Case {
        name: own.name.clone(),
        kind: CaseKind::Move {
            displacement: own.displacement,
        },
        load: Load {
            forces: vec![Vec3::zeros(); prescribed.len()],
            prescribed: Some(prescribed),
        },
        model,
        factors: (1..=own.steps).map(|k| k as f64 / own.steps as f64).collect(),
        points,
        supports,
    })
}
