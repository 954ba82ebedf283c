//! Blocks, and one simulation with one law.

use pliant::fem::contact::{
    ContactCurve, ContactOptions, ContactSolver, Drive, Friction, Level, Pose, RigidBody, Shape, Surface,
};
use pliant::fem::equilibrium::Load;
use pliant::fem::forces::Materials;
use pliant::fem::model::{Constrained, Model};
use pliant::geometry::volume::VolumeMesh;
use pliant::material::law::Law;
use pliant::math::Vec3;

/// Coordinates from 0: `count` cells of width `h`, then growing by `growth` up to `end`.
pub fn graded(h: f64, count: usize, growth: f64, end: f64) -> Vec<f64> {
    let mut lines: Vec<f64> = (0..=count).map(|k| h * k as f64).collect();
    let mut step = h;
    while lines[lines.len() - 1] < end {
        step *= growth;
        lines.push(lines[lines.len() - 1] + step);
    }
    // The last one ends where it should, all grown ones stretched alike.
    let (start, last) = (h * count as f64, lines[lines.len() - 1]);
    for x in lines.iter_mut().skip(count + 1) {
        *x = start + (*x - start) * (end - start) / (last - start);
    }
    lines
}

/// A box of hexahedra on the given lines.
pub fn on_lines(x: &[f64], y: &[f64], z: &[f64]) -> VolumeMesh {
    let counts = [x.len() - 1, y.len() - 1, z.len() - 1];
    let size = Vec3::new(counts[0] as f64, counts[1] as f64, counts[2] as f64);
    let mut mesh = VolumeMesh::cuboid(size, counts, false);
    for n in &mut mesh.nodes {
        let at = |lines: &[f64], c: f64| lines[c.round() as usize];
        *n = Vec3::new(at(x, n.x), at(y, n.y), at(z, n.z));
    }
    mesh
}

pub fn model(mesh: VolumeMesh, held: impl Fn(&Vec3) -> Constrained) -> Model {
    let constrained = mesh.nodes.iter().map(held).collect();
    Model::new(mesh, None, constrained).unwrap()
}

pub fn unloaded(model: &Model) -> Load {
    Load {
        forces: vec![Vec3::zeros(); model.mesh.nodes.len()],
        prescribed: None,
    }
}

/// One simulation, and the sum of the supports' forces at each level that was reached.
pub fn simulate(
    model: &Model,
    surface: &Surface,
    bodies: &[RigidBody],
    law: &Law,
    load: &Load,
    levels: &[Level],
    options: &ContactOptions,
) -> (ContactCurve, Vec<Vec3>) {
    let cells = vec![0u16; model.parts.points()];
    let laws = [law];
    let materials = Materials {
        laws: &laws,
        cell_of_point: &cells,
    };
    let mut solver = ContactSolver::new(model, surface, bodies).unwrap();
    let curve = solver
        .curve(&materials, load, levels, options, &|| false)
        .unwrap();
    let reactions = curve
        .levels
        .iter()
        .zip(levels)
        .map(|(found, level)| {
            solver
                .reactions(found, level.load_factor, &materials, load)
                .iter()
                .sum()
        })
        .collect();
    (curve, reactions)
}

/// A block of 16 × 16 × 8 mm, E = 0.1 MPa, in cubes of 2 mm, its bottom held.
pub fn block() -> Model {
    model_of_block(|x| [x.z == 0.0; 3])
}

/// The same block, held as asked.
pub fn model_of_block(held: impl Fn(&Vec3) -> Constrained) -> Model {
    model(
        VolumeMesh::cuboid(Vec3::new(16.0, 16.0, 8.0), [8, 8, 4], false),
        held,
    )
}

pub fn soft() -> Law {
    Law::linear_isotropic(0.1, 0.3).unwrap()
}

/// A ball that presses from above, touching the block at (x, y).
pub fn ball(radius_mm: f64, x: f64, y: f64, friction: Friction) -> RigidBody {
    RigidBody::probe(
        Shape::Sphere { radius_mm },
        Pose::at(Vec3::new(x, y, 8.0 + radius_mm)).unwrap(),
        -Vec3::z(),
        friction,
    )
    .unwrap()
}

/// One level that moves all bodies; the load acts in full.
pub fn level(drives: Vec<Drive>) -> Level {
    Level {
        load_factor: 1.0,
        drives,
    }
}

/// The largest difference of two fields, as a share of the largest vector \[–\].
pub fn difference(a: &[Vec3], b: &[Vec3]) -> f64 {
    let size = a.iter().map(Vec3::norm).fold(0.0, f64::max);
    let off = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    off.fold(0.0, f64::max) / size
}
