//! What a simulation leaves behind for each case: a VTU for ParaView, a CSV that a goal can cite as an example, and the
//! record of the case in `simulated.json`.

use super::elements::Discretisation;
use super::equilibrium::{Options, Stop, Work};
use super::forces::PointFields;
use super::stage::{Case, CaseKind, CaseOutcome, Stage};
use crate::geometry::files::vtu::{Array, VtuCells, VtuError, VtuGrid, write_vtu};
use crate::geometry::volume::Elements;
use crate::math::mandel::{self, Mandel};
use crate::math::{Mat3, Vec3};
use serde::Serialize;
use std::io::{self, Write};

/// The fields at one level, one value an element: means over the element's integration points, weighted by the volume of
/// the object that each stands for.
#[derive(Clone, Debug, Default)]
pub struct ElementFields {
    /// Biot strain U − I in the undeformed object's axes, Mandel notation.
    pub strain: Vec<Mandel>,
    /// Cauchy stress in space, Mandel notation \[MPa\].
    pub stress: Vec<Mandel>,
    /// Secant Young's modulus \[MPa\].
    pub young_modulus: Vec<f64>,
    /// det F.
    pub jacobian: Vec<f64>,
    /// Share of the element inside the object.
    pub fill: Vec<f64>,
    /// The material of the largest share of the element, by its number in the layout's laws.
    pub material_id: Vec<i32>,
}

impl ElementFields {
    /// The means of `fields`, `(points)`, over the elements of `case`.
    pub fn new(stage: &Stage, case: &Case, fields: &PointFields) -> ElementFields {
        let material_of = |q: usize| usize::from(stage.layout[usize::from(stage.cell_of_point[q])]);
        let parts = &case.model.parts;
        ElementFields::means(
            parts,
            fields,
            Some(&stage.grid.fill),
            stage.laws.len(),
            material_of,
        )
    }

    /// The means of `fields`, `(points)`, over elements; `fill`, `(points)`, is one where it is not given, and
    /// `material_of` answers the number, below `materials`, of a point's material.
    pub fn means(
        parts: &Discretisation,
        fields: &PointFields,
        fill: Option<&[f64]>,
        materials: usize,
        material_of: impl Fn(usize) -> usize,
    ) -> ElementFields {
        let n = parts.points_per_element();
        let mut result = ElementFields::default();
        for e in 0..parts.points() / n {
            let points = e * n..(e + 1) * n;
            let volume: f64 = points.clone().map(|q| parts.weight(q)).sum();
            // An element that is kept holds some of the object; a share of zero would say otherwise.
            let share = |q: usize| {
                if volume > 0.0 {
                    parts.weight(q) / volume
                } else {
                    1.0 / n as f64
                }
            };
            let (mut strain, mut stress, mut young, mut jacobian) =
                (Mandel::zeros(), Mat3::zeros(), 0.0, 0.0);
            let mut volume_of = vec![0.0; materials];
            for q in points.clone() {
                let w = share(q);
                strain += fields.strain[q] * w;
                stress += fields.cauchy_stress[q] * w;
                young += fields.young_modulus[q] * w;
                jacobian += fields.jacobian[q] * w;
                volume_of[material_of(q)] += w;
            }
            let largest =
                (0..volume_of.len()).fold(0, |a, b| if volume_of[b] > volume_of[a] { b } else { a });
            result.strain.push(strain);
            result.stress.push(mandel::from_tensor(&stress));
            result.young_modulus.push(young);
            result.jacobian.push(jacobian);
            let filled = |q: usize| fill.map_or(1.0, |fill| fill[q]);
            result.fill.push(points.map(filled).sum::<f64>() / n as f64);
            result.material_id.push(largest as i32);
        }
        result
    }
}

/// The six numbers XX YY ZZ XY YZ XZ of a symmetric tensor, without Mandel's factors.
pub fn six(tensor: &Mandel) -> [f64; 6] {
    let a = mandel::to_tensor(tensor);
    [a[(0, 0)], a[(1, 1)], a[(2, 2)], a[(0, 1)], a[(1, 2)], a[(0, 2)]]
}

/// Writes the last level that was reached (the state at rest if none was) for ParaView.
///
/// # Errors
/// [`VtuError`] of the writer below.
pub fn write_case_vtu(
    out: impl Write,
    stage: &Stage,
    case: &Case,
    outcome: &CaseOutcome,
) -> Result<(), VtuError> {
    let rest = vec![Vec3::zeros(); stage.grid.mesh.nodes.len()];
    let displacement = outcome.levels.last().unwrap_or(&rest);
    let fields = ElementFields::new(stage, case, &outcome.fields);
    let cells = match &stage.grid.mesh.elements {
        Elements::Hexahedra(cells) | Elements::KuhnCells(cells) => VtuCells::Hexahedra(cells),
        Elements::Tetrahedra(cells) => VtuCells::Tetrahedra(cells),
    };
    let grid = VtuGrid {
        points: &stage.grid.mesh.nodes,
        cells,
    };
    let at_cells = [
        ("strain", Array::SymmetricTensors(&fields.strain)),
        ("stress", Array::SymmetricTensors(&fields.stress)),
        ("material_id", Array::Integers(&fields.material_id)),
        ("young_modulus", Array::Scalars(&fields.young_modulus)),
        ("jacobian", Array::Scalars(&fields.jacobian)),
        ("fill", Array::Scalars(&fields.fill)),
    ];
    write_vtu(
        out,
        &grid,
        &[("displacement", Array::Vectors(displacement))],
        &at_cells,
    )
}

/// Writes the displacements of a press' points at every force that was reached, as a goal's example takes them.
///
/// Coordinates are written in full, so that a goal finds the very point again; displacements to the nanometre.
///
/// # Errors
/// What `out` says.
pub fn write_case_csv(
    mut out: impl Write,
    case: &Case,
    forces_n: &[f64],
    outcome: &CaseOutcome,
) -> io::Result<()> {
    writeln!(out, "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm")?;
    for (force, u) in forces_n.iter().zip(&outcome.levels) {
        for (place, sensor) in &case.points {
            let d = sensor.read(u);
            writeln!(
                out,
                "{force},{},{},{},{:.6},{:.6},{:.6}",
                place.x, place.y, place.z, d.x, d.y, d.z
            )?;
        }
    }
    out.flush()
}

/// A case in `simulated.json`.
#[derive(Clone, Debug, Serialize)]
pub struct CaseRecord {
    /// Its name.
    pub name: String,
    /// `press` or `move`.
    pub kind: &'static str,
    /// The full load: force \[N\], or displacement \[mm\].
    pub full_load: f64,
    /// What was reached of it, same unit.
    pub reached_load: f64,
    /// Share that was reached.
    pub reached_share: f64,
    /// Is every level in equilibrium?
    pub complete: bool,
    /// Why it ended, in words.
    pub stop: String,
    /// Where it failed \[mm\], if at a place.
    pub stop_place_mm: Option<[f64; 3]>,
    /// The load at each level that was reached: force \[N\], or displacement \[mm\].
    pub levels: Vec<f64>,
    /// The place on the surface where a press acts \[mm\].
    pub contact_point_mm: Option<[f64; 3]>,
    /// Displacements of the points asked for.
    pub points: Vec<PointRecord>,
    /// Displacements of the nodes asked for.
    pub nodes: Vec<NodeRecord>,
    /// Forces that hold the object.
    pub reactions: Vec<ReactionRecord>,
    /// The largest displacement at the last level that was reached.
    pub largest_displacement: LargestDisplacement,
    /// Residual force of the last state, as a share of the load.
    pub residual: f64,
    /// Counts of the solver's work.
    pub work: Work,
    /// Share of the object's volume that is strained by more than 1 % and beyond its material's fitted range, at the last
    /// level. Where strain is smaller, the stiffness is the one at rest on either side of the border.
    pub share_outside_fitted_range: f64,
    /// Smallest det F at the last level, over points that count.
    pub smallest_jacobian: f64,
    /// Largest det F.
    pub largest_jacobian: f64,
    /// What to look at.
    pub warnings: Vec<String>,
}

/// A point with its displacement at each level.
#[derive(Clone, Debug, Serialize)]
pub struct PointRecord {
    /// Where it is in the undeformed object \[mm\].
    pub place_mm: [f64; 3],
    /// Displacements, `(levels × 3)` \[mm\].
    pub displacements_mm: Vec<[f64; 3]>,
}

/// A node with its displacement at each level.
#[derive(Clone, Debug, Serialize)]
pub struct NodeRecord {
    /// Its number, from 0.
    pub node: usize,
    /// Where it is in the undeformed object \[mm\].
    pub place_mm: [f64; 3],
    /// Displacements, `(levels × 3)` \[mm\].
    pub displacements_mm: Vec<[f64; 3]>,
}

/// A support with its force at each level.
#[derive(Clone, Debug, Serialize)]
pub struct ReactionRecord {
    /// Its name.
    pub support: String,
    /// How many nodes it holds.
    pub nodes: usize,
    /// Force on the object, `(levels × 3)` \[N\].
    pub forces_n: Vec<[f64; 3]>,
}

/// The node that moved most.
#[derive(Clone, Debug, Serialize)]
pub struct LargestDisplacement {
    /// Its number.
    pub node: usize,
    /// Where it is in the undeformed object \[mm\].
    pub place_mm: [f64; 3],
    /// How far it moved \[mm\].
    pub size_mm: f64,
    /// Its displacement \[mm\].
    pub displacement_mm: [f64; 3],
}

/// More strain than this share outside the fitted range is worth a warning.
pub(super) const WORTH_A_WARNING: f64 = 0.05;

impl CaseRecord {
    /// What to keep of a case.
    pub fn new(stage: &Stage, case: &Case, outcome: &CaseOutcome, options: &Options) -> CaseRecord {
        let (kind, full_load, contact_point) = match &case.kind {
            CaseKind::Press {
                forces_n,
                contact_point,
            } => (
                "press",
                forces_n.last().copied().unwrap_or(0.0),
                Some(*contact_point),
            ),
            CaseKind::Move { displacement } => ("move", displacement_size(displacement), None),
        };
        let levels: Vec<f64> = match &case.kind {
            CaseKind::Press { forces_n, .. } => forces_n[..outcome.levels.len()].to_vec(),
            CaseKind::Move { .. } => case.factors[..outcome.levels.len()]
                .iter()
                .map(|t| t * full_load)
                .collect(),
        };
        let [smallest_jacobian, largest_jacobian] = jacobians(case, outcome, options);
        let mut record = CaseRecord {
            name: case.name.clone(),
            kind,
            full_load,
            reached_load: outcome.reached * full_load,
            reached_share: outcome.reached,
            complete: outcome.stop == Stop::Converged,
            stop: outcome.stop.to_string(),
            stop_place_mm: match outcome.stop {
                Stop::Inverted { place, .. } => Some(place.into()),
                _ => None,
            },
            contact_point_mm: contact_point.map(Into::into),
            points: points(case, outcome),
            nodes: nodes(stage, outcome),
            reactions: reactions(case, outcome),
            largest_displacement: largest_displacement(stage, outcome),
            residual: outcome.residual,
            work: outcome.work,
            share_outside_fitted_range: share_outside(&case.model.parts, &outcome.fields),
            smallest_jacobian,
            largest_jacobian,
            levels,
            warnings: Vec::new(),
        };
        record.warnings = record.findings();
        record
    }

    /// The unit of the loads.
    pub fn unit(&self) -> &'static str {
        if self.kind == "press" { "N" } else { "mm" }
    }

    fn findings(&self) -> Vec<String> {
        let mut found = Vec::new();
        if !self.complete {
            let kept = self.levels.last().copied().unwrap_or(0.0);
            found.push(format!(
                "{}: reached {:.3} of {} {unit}: {}; the files hold the state at {kept} {unit}",
                self.name,
                self.reached_load,
                self.full_load,
                self.stop,
                unit = self.unit()
            ));
        }
        if self.share_outside_fitted_range > WORTH_A_WARNING {
            found.push(format!(
                "{}: {:.0} % of the object is strained beyond what its materials were measured at; there the stiffness is the one at the border of the measurements",
                self.name,
                100.0 * self.share_outside_fitted_range
            ));
        }
        found
    }
}

/// Strains below this size (Frobenius norm) are rest, wherever the fitted range ends: a material that was measured in
/// compression alone ends at zero.
const REST_STRAIN: f64 = 0.01;

pub(super) fn share_outside(parts: &Discretisation, fields: &PointFields) -> f64 {
    let (mut whole, mut outside) = (0.0, 0.0);
    for (q, (strain, inside)) in fields.strain.iter().zip(&fields.in_range).enumerate() {
        let volume = parts.weight(q);
        whole += volume;
        if !inside && strain.norm() > REST_STRAIN {
            outside += volume;
        }
    }
    if whole > 0.0 { outside / whole } else { 0.0 }
}

fn displacement_size(displacement: &[Option<f64>; 3]) -> f64 {
    displacement.iter().flatten().map(|d| d * d).sum::<f64>().sqrt()
}

/// Smallest and largest det F over the points that count as the solver's own check counts them.
fn jacobians(case: &Case, outcome: &CaseOutcome, options: &Options) -> [f64; 2] {
    let counts = |q: usize| {
        let fill = case.model.fill.as_ref().map_or(1.0, |fill| fill[q]);
        fill >= options.least_fill
    };
    let values = outcome.fields.jacobian.iter().enumerate();
    values
        .filter(|(q, _)| counts(*q))
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (_, j)| {
            [low.min(*j), high.max(*j)]
        })
}

fn points(case: &Case, outcome: &CaseOutcome) -> Vec<PointRecord> {
    let record = |(place, sensor): &(Vec3, super::example::Sensor)| PointRecord {
        place_mm: (*place).into(),
        displacements_mm: outcome.levels.iter().map(|u| sensor.read(u).into()).collect(),
    };
    case.points.iter().map(record).collect()
}

fn nodes(stage: &Stage, outcome: &CaseOutcome) -> Vec<NodeRecord> {
    let record = |&node: &usize| NodeRecord {
        node,
        place_mm: stage.grid.mesh.nodes[node].into(),
        displacements_mm: outcome.levels.iter().map(|u| u[node].into()).collect(),
    };
    stage.nodes.iter().map(record).collect()
}

fn reactions(case: &Case, outcome: &CaseOutcome) -> Vec<ReactionRecord> {
    let record = |(index, support): (usize, &super::stage::Support)| ReactionRecord {
        support: support.name.clone(),
        nodes: support.held.len(),
        forces_n: outcome
            .reactions
            .iter()
            .map(|level| level[index].into())
            .collect(),
    };
    case.supports.iter().enumerate().map(record).collect()
}

fn largest_displacement(stage: &Stage, outcome: &CaseOutcome) -> LargestDisplacement {
    let rest = Vec::new();
    let u = outcome.levels.last().unwrap_or(&rest);
    let node = (0..u.len()).fold(0, |a, b| if u[b].norm() > u[a].norm() { b } else { a });
    let displacement = u.get(node).copied().unwrap_or_else(Vec3::zeros);
    LargestDisplacement {
        node,
        place_mm: stage.grid.mesh.nodes[node].into(),
        size_mm: displacement.norm(),
        displacement_mm: displacement.into(),
    }
}
