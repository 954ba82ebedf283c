//! What a simulation on a volume mesh leaves behind: the record of each case in `simulated.json`, and VTU files of every
//! level for ParaView with a PVD that strings them together.

use super::super::contact::{BodyContact, PointContact};
use super::super::equilibrium::{Stop, Work};
use super::super::forces::PointFields;
use super::super::scene_record::{ElementFields, WORTH_A_WARNING, share_outside, six};
use super::stage::{VolumeCase, VolumeOutcome, VolumeStage};
use super::{StrainLevels, VolumeScene};
use crate::geometry::files::vtu::{Array, VtuCells, VtuError, VtuGrid, write_vtu};
use crate::geometry::volume::Elements;
use crate::math::Vec3;
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write;

/// A case in `simulated.json`.
#[derive(Clone, Debug, Serialize)]
pub struct VolumeCaseRecord {
    /// Its name.
    pub name: String,
    /// Share of the load that was reached; on a path, share of its levels.
    pub reached_share: f64,
    /// Is every level in equilibrium?
    pub complete: bool,
    /// Why it ended, in words.
    pub stop: String,
    /// Where it failed \[mm\], if at a place.
    pub stop_place_mm: Option<[f64; 3]>,
    /// Residual force of the last state, as a share of the load.
    pub residual: f64,
    /// Counts of the solver's work.
    pub work: Work,
    /// The levels that were reached.
    pub levels: Vec<LevelRecord>,
    /// What to look at.
    pub warnings: Vec<String>,
}

/// One level of a case.
#[derive(Clone, Debug, Serialize)]
pub struct LevelRecord {
    /// Share of the load; on a path, or with rigid bodies, the number of the level from 1.
    pub level: f64,
    /// Displacement of every node, `(nodes × 3)` \[mm\].
    pub displacements_mm: Vec<[f64; 3]>,
    /// The points asked for.
    pub points: Vec<VolumePointRecord>,
    /// Mean displacements of the scene's sets.
    pub sets: Vec<SetRecord>,
    /// Forces of the supports on the object.
    pub supports: Vec<SupportRecord>,
    /// What the rigid bodies do.
    pub bodies: Vec<BodyRecord>,
    /// Force of the supports on each node that they hold.
    pub reactions: Vec<ReactionNode>,
    /// Sum of the external forces, those on held nodes included \[N\].
    pub external_force_n: [f64; 3],
    /// Work done on the object from rest \[mJ\]: of external forces, supports that move and rigid bodies.
    pub work_done_mj: f64,
    /// Energy that the object holds \[mJ\]; none where a law has none.
    pub stored_energy_mj: Option<f64>,
    /// Smallest det F.
    pub smallest_jacobian: f64,
    /// Largest det F.
    pub largest_jacobian: f64,
    /// Means over elements, where they were asked for.
    pub elements: Option<ElementRecord>,
}

/// A point that was asked for.
#[derive(Clone, Debug, Serialize)]
pub struct VolumePointRecord {
    /// Where it is in the undeformed object \[mm\].
    pub place_mm: [f64; 3],
    /// The element that it lies in or next to, as the mesh's file numbers it.
    pub element: u64,
    /// Its displacement \[mm\].
    pub displacement_mm: [f64; 3],
    /// Biot strain of the element, XX YY ZZ XY YZ XZ.
    pub strain: [f64; 6],
    /// Cauchy stress of the element, XX YY ZZ XY YZ XZ \[MPa\].
    pub stress_mpa: [f64; 6],
}

/// A set of nodes.
#[derive(Clone, Debug, Serialize)]
pub struct SetRecord {
    /// Its name.
    pub name: String,
    /// How many nodes it holds.
    pub nodes: usize,
    /// Mean of its nodes' displacements \[mm\].
    pub mean_displacement_mm: [f64; 3],
}

/// A support.
#[derive(Clone, Debug, Serialize)]
pub struct SupportRecord {
    /// Its name.
    pub support: String,
    /// How many nodes it holds.
    pub nodes: usize,
    /// Its force on the object \[N\].
    pub force_n: [f64; 3],
}

/// A rigid body.
#[derive(Clone, Debug, Serialize)]
pub struct BodyRecord {
    /// Its name.
    pub name: String,
    /// Its travel along its direction \[mm\].
    pub travel_mm: f64,
    /// Its whole way from the start \[mm\].
    pub translation_mm: [f64; 3],
    /// Its force on the object \[N\].
    pub force_n: [f64; 3],
    /// Its moment on the object about its own position \[N mm\].
    pub moment_n_mm: [f64; 3],
    /// Deformed area of the points that touch \[mm²\].
    pub area_mm2: f64,
    /// Normal force over area \[MPa\].
    pub mean_pressure_mpa: f64,
    /// Largest pressure of a point \[MPa\].
    pub largest_pressure_mpa: f64,
    /// Deepest penetration of a point \[mm\].
    pub penetration_mm: f64,
    /// The points that touch.
    pub points: Vec<BodyPoint>,
}

/// A point that touches.
#[derive(Clone, Debug, Serialize)]
pub struct BodyPoint {
    /// Where it is \[mm\].
    pub place_mm: [f64; 3],
    /// Force on the object there \[N\].
    pub force_n: [f64; 3],
    /// Normal force over deformed area \[MPa\].
    pub pressure_mpa: f64,
}

impl BodyRecord {
    fn new(name: &str, body: &BodyContact) -> BodyRecord {
        let point = |p: &PointContact| BodyPoint {
            place_mm: p.place.into(),
            force_n: p.force_n.into(),
            pressure_mpa: p.pressure_mpa,
        };
        BodyRecord {
            name: name.to_string(),
            travel_mm: body.travel_mm,
            translation_mm: body.translation_mm.into(),
            force_n: body.force_n.into(),
            moment_n_mm: body.moment_n_mm.into(),
            area_mm2: body.area_mm2,
            mean_pressure_mpa: body.mean_pressure_mpa(),
            largest_pressure_mpa: body.largest_pressure_mpa(),
            penetration_mm: body.penetration_mm,
            points: body.points.iter().map(point).collect(),
        }
    }
}

/// A held node.
#[derive(Clone, Debug, Serialize)]
pub struct ReactionNode {
    /// Its number in the mesh's file.
    pub node: u64,
    /// Force of the supports on it \[N\]; zero along components that are free.
    pub force_n: [f64; 3],
}

/// Means over elements, each `(elements)`.
#[derive(Clone, Debug, Serialize)]
pub struct ElementRecord {
    /// Biot strain U − I, XX YY ZZ XY YZ XZ.
    pub strain: Vec<[f64; 6]>,
    /// Cauchy stress, XX YY ZZ XY YZ XZ \[MPa\].
    pub stress_mpa: Vec<[f64; 6]>,
    /// det F.
    pub jacobian: Vec<f64>,
}

/// The fields of one level: at points and over elements.
pub struct LevelFields {
    points: PointFields,
    elements: ElementFields,
}

impl LevelFields {
    /// The fields of a case at the displacements `u`, `(nodes)` \[mm\].
    pub fn new(scene: &VolumeScene, stage: &VolumeStage, case: &VolumeCase, u: &[Vec3]) -> LevelFields {
        let points = stage.fields(case, u);
        let parts = &case.model.parts;
        let n = parts.points_per_element();
        let material_of = |q: usize| scene.regions[usize::from(scene.region_of[q / n])].material;
        let elements = ElementFields::means(parts, &points, None, scene.materials.len(), material_of);
        LevelFields { points, elements }
    }
}

impl VolumeCaseRecord {
    /// What to keep of a case; `fields` are those of the levels that were reached.
    pub fn new(
        scene: &VolumeScene,
        stage: &VolumeStage,
        case: &VolumeCase,
        outcome: &VolumeOutcome,
        fields: &[LevelFields],
    ) -> VolumeCaseRecord {
        let last = fields.len().saturating_sub(1);
        let levels = fields.iter().enumerate().map(|(k, own)| {
            let full = match scene.strains {
                StrainLevels::None => false,
                StrainLevels::Last => k == last,
                StrainLevels::All => true,
            };
            level(scene, stage, case, outcome, k, own, full)
        });
        let mut record = VolumeCaseRecord {
            name: case.name.clone(),
            reached_share: outcome.reached,
            complete: outcome.stop == Stop::Converged,
            stop: outcome.stop.to_string(),
            stop_place_mm: match outcome.stop {
                Stop::Inverted { place, .. } | Stop::Indefinite { place, .. } => Some(place.into()),
                _ => None,
            },
            residual: outcome.residual,
            work: outcome.work,
            levels: levels.collect(),
            warnings: Vec::new(),
        };
        if !record.complete {
            record.warnings.push(format!(
                "{}: reached {} of {} levels, {:.1} % of the load: {}; the files hold the levels that were reached",
                case.name,
                record.levels.len(),
                case.loading.levels(),
                100.0 * outcome.reached,
                record.stop
            ));
        }
        let outside = fields
            .last()
            .map_or(0.0, |f| share_outside(&case.model.parts, &f.points));
        if outside > WORTH_A_WARNING {
            record.warnings.push(format!(
                "{}: {:.0} % of the object is strained beyond what its materials were measured at; there the stiffness is the one at the border of the measurements",
                case.name,
                100.0 * outside
            ));
        }
        record
    }
}

fn level(
    scene: &VolumeScene,
    stage: &VolumeStage,
    case: &VolumeCase,
    outcome: &VolumeOutcome,
    k: usize,
    fields: &LevelFields,
    full: bool,
) -> LevelRecord {
    let (u, reactions) = (&outcome.levels[k], &outcome.reactions[k]);
    let bodies = outcome.bodies.get(k).map_or(&[][..], Vec::as_slice);
    let means = &fields.elements;
    let points = scene.points.iter().map(|(place, held)| VolumePointRecord {
        place_mm: (*place).into(),
        element: scene.file.element_numbers[held.element],
        displacement_mm: held
            .nodes
            .iter()
            .zip(&held.weights)
            .map(|(&n, w)| u[n as usize] * *w)
            .sum::<Vec3>()
            .into(),
        strain: six(&means.strain[held.element]),
        stress_mpa: six(&means.stress[held.element]),
    });
    let sets = scene.sets.iter().map(|set| {
        let sum: Vec3 = set.nodes.iter().map(|&n| u[n as usize]).sum();
        SetRecord {
            name: set.name.clone(),
            nodes: set.nodes.len(),
            mean_displacement_mm: (sum / set.nodes.len() as f64).into(),
        }
    });
    let supports = case.supports.iter().map(|support| SupportRecord {
        support: support.name.clone(),
        nodes: support.held.len(),
        force_n: support.sum(reactions).into(),
    });
    let held = case
        .model
        .constrained
        .iter()
        .enumerate()
        .filter(|(_, c)| **c != [false; 3]);
    let jacobians = &fields.points.jacobian;
    LevelRecord {
        level: case.loading.level(k),
        displacements_mm: u.iter().map(|u| (*u).into()).collect(),
        points: points.collect(),
        sets: sets.collect(),
        supports: supports.collect(),
        bodies: scene
            .bodies
            .iter()
            .zip(bodies)
            .map(|(named, b)| BodyRecord::new(&named.name, b))
            .collect(),
        reactions: held
            .map(|(n, _)| ReactionNode {
                node: scene.file.node_numbers[n],
                force_n: reactions[n].into(),
            })
            .collect(),
        external_force_n: case.loading.forces(k).iter().sum::<Vec3>().into(),
        work_done_mj: outcome.work_done[k],
        stored_energy_mj: stage.stored_energy(case, &fields.points),
        smallest_jacobian: jacobians.iter().copied().fold(f64::INFINITY, f64::min),
        largest_jacobian: jacobians.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        elements: full.then(|| ElementRecord {
            strain: means.strain.iter().map(six).collect(),
            stress_mpa: means.stress.iter().map(six).collect(),
            jacobian: means.jacobian.clone(),
        }),
    }
}

/// Writes level `k` of a case for ParaView.
///
/// # Errors
/// [`VtuError`] of the writer below.
pub fn write_level_vtu(
    out: impl Write,
    scene: &VolumeScene,
    outcome: &VolumeOutcome,
    k: usize,
    fields: &LevelFields,
) -> Result<(), VtuError> {
    let mesh = &scene.file.mesh;
    let cells = match &mesh.elements {
        Elements::Hexahedra(cells) | Elements::KuhnCells(cells) => VtuCells::Hexahedra(cells),
        Elements::Tetrahedra(cells) => VtuCells::Tetrahedra(cells),
    };
    let grid = VtuGrid {
        points: &mesh.nodes,
        cells,
    };
    let means = &fields.elements;
    let regions: Vec<i32> = scene.region_of.iter().map(|&r| i32::from(r)).collect();
    write_vtu(
        out,
        &grid,
        &[
            ("displacement", Array::Vectors(&outcome.levels[k])),
            ("reaction", Array::Vectors(&outcome.reactions[k])),
        ],
        &[
            ("strain", Array::SymmetricTensors(&means.strain)),
            ("stress", Array::SymmetricTensors(&means.stress)),
            ("material_id", Array::Integers(&means.material_id)),
            ("region", Array::Integers(&regions)),
            ("young_modulus", Array::Scalars(&means.young_modulus)),
            ("jacobian", Array::Scalars(&means.jacobian)),
        ],
    )
}

/// ParaView's list of a case's levels: files by their load.
pub fn series(levels: &[(f64, String)]) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    for (level, file) in levels {
        // Names of cases are letters, digits, '-', '_' and '.', which need no escape.
        let _ = writeln!(text, "<DataSet timestep=\"{level}\" part=\"0\" file=\"{file}\"/>");
    }
    text + "</Collection>\n</VTKFile>\n"
}
