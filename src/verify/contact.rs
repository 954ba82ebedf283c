//! A ball and a flat punch pressed into an elastic half space.
//!
//! ```text
//! Hertz        F = 4/3 E* √R δ^(3/2),   a = √(R δ),   p₀ = 2 E*/π √(δ/R)
//! flat punch   F = 2 a E* δ
//! E* = E / (1 − ν²)
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | F | force | N |
//! | δ | indentation | mm |
//! | R, a | radius of the ball; of the contact, or of the punch | mm |
//! | p₀ | largest pressure | MPa |
//!
//! The half space is a quarter of a block, 90 contact radii large, held on its far sides and base, on planes of symmetry where
//! it is cut; cells grow with the distance from the contact. Small strain: δ is a five-hundredth of R. Frictionless. Source:
//! Johnson 1985, Contact Mechanics, sections 3.4, 3.8 and 4.2.

use super::record::{Findings, Row};
use super::specimen::{Kind, Specimen};
use super::{Check, CheckError, Cost};
use crate::fem::contact::{
    BodyContact, ContactOptions, ContactSolver, Drive, Friction, Level, Pose, RigidBody, Shape, Surface,
};
use crate::fem::equilibrium::{Load, Stop};
use crate::geometry::volume::VolumeMesh;
use crate::material::law::Law;
use crate::math::Vec3;
use std::f64::consts::PI;

/// Hertz and the flat punch.
pub const CONTACT: Check = Check {
    id: "contact",
    title: "Ball and flat punch on a half space",
    against: "Closed forms: Hertz' for a ball, Boussinesq's for a flat punch (Johnson 1985, sections 3.4, 3.8, 4.2).",
    cost: Cost::Heavy,
    run: contact,
};

const YOUNG_MPA: f64 = 1.0;
const POISSON: f64 = 0.3;
/// E* \[MPa\].
const STIFFNESS: f64 = YOUNG_MPA / (1.0 - POISSON * POISSON);
/// Edge of the quarter block \[mm\].
const EDGE: f64 = 200.0;
/// Radius of the ball \[mm\], and how deep it goes.
const RADIUS: f64 = 50.0;
const DEPTH: f64 = 0.1;

/// Lines from 0 to [`EDGE`]: `count` cells of width `h`, then each wider than the last by about `growth`.
fn graded(h: f64, count: usize, growth: f64) -> Vec<f64> {
    let mut lines: Vec<f64> = (0..=count).map(|k| h * k as f64).collect();
    let (mut step, mut end) = (h, h * count as f64);
    while end < EDGE {
        step *= growth;
        end += step;
        lines.push(end);
    }
    // The wider ones are shrunk alike, so that the last ends on the edge.
    let start = h * count as f64;
    for x in lines.iter_mut().skip(count + 1) {
        *x = start + (*x - start) * (EDGE - start) / (end - start);
    }
    lines
}

/// The quarter block below z = 0, its corner at the origin, with cells of width `h` out to `count` of them.
fn quarter(h: f64, count: usize) -> Result<Specimen, CheckError> {
    let lines = graded(h, count, 1.5);
    let n = lines.len() - 1;
    let mesh = VolumeMesh::cuboid(Vec3::from_element(n as f64), [n; 3], false);
    let place = |x: &Vec3| {
        let at = |c: f64| lines[c.round() as usize];
        Vec3::new(at(x.x), at(x.y), -at(n as f64 - x.z))
    };
    let mesh = VolumeMesh {
        nodes: mesh.nodes.iter().map(place).collect(),
        elements: mesh.elements,
    };
    let law = Law::linear_isotropic(YOUNG_MPA, POISSON)?;
    let far = |c: f64| (c - EDGE).abs() < 1e-9;
    Specimen::new(Kind::Hexahedra, mesh, law, |x| {
        let held = far(x.x) || far(x.y) || far(-x.z);
        [held || x.x == 0.0, held || x.y == 0.0, held]
    })
}

/// What the body answers when it has gone `depth` into the quarter block.
fn pressed(block: &Specimen, shape: Shape, pose: Pose, depth: f64) -> Result<BodyContact, CheckError> {
    let other = |e: &dyn std::fmt::Display| CheckError::Other(e.to_string());
    let nodes = block.nodes();
    let surface = Surface::of_mesh(&block.model.mesh).only(nodes, |x, _| x.z > -1e-9);
    let body = RigidBody::probe(shape, pose, -Vec3::z(), Friction::Frictionless).map_err(|e| other(&e))?;
    let bodies = [body];
    let load = Load {
        forces: vec![Vec3::zeros(); nodes.len()],
        prescribed: None,
    };
    let levels = [Level {
        load_factor: 0.0,
        drives: vec![Drive::travel(depth)],
    }];
    let mut solver = ContactSolver::new(&block.model, &surface, &bodies).map_err(|e| other(&e))?;
    let options = ContactOptions::default();
    let curve =
        block.with_materials(|materials| solver.curve(materials, &load, &levels, &options, &|| false));
    let mut curve = curve.map_err(|e| other(&e))?;
    match (curve.stop, curve.levels.pop()) {
        (Stop::Converged, Some(mut level)) => Ok(level.bodies.remove(0)),
        (stop, _) => Err(CheckError::NotReached {
            stop,
            share: curve.reached,
        }),
    }
}

fn contact() -> Result<Findings, CheckError> {
    let radius = (RADIUS * DEPTH).sqrt();
    let force = 4.0 / 3.0 * STIFFNESS * RADIUS.sqrt() * DEPTH.powf(1.5);
    let pressure = 2.0 * STIFFNESS / PI * (DEPTH / RADIUS).sqrt();
    let mut rows = Vec::new();
    for (cells, tolerance) in [(3u32, 0.04), (6, 0.02)] {
        let block = quarter(radius / f64::from(cells), cells as usize * 3 / 2)?;
        let pose = Pose::at(Vec3::z() * RADIUS).map_err(|e| CheckError::Other(e.to_string()))?;
        let shape = Shape::Sphere { radius_mm: RADIUS };
        let of = |what: &str| format!("ball, {cells} cells over the contact's radius: {what}");
        let found = pressed(&block, shape.clone(), pose, DEPTH)?;
        rows.push(Row::within(of("force"), "N", force, -4.0 * found.force_n.z, tolerance).digits(4));
        let measured = (4.0 * found.area_mm2 / PI).sqrt();
        rows.push(
            Row::within(
                of("radius of contact"),
                "mm",
                radius,
                measured,
                1.5 / f64::from(cells),
            )
            .digits(3),
        );
        let largest = found.largest_pressure_mpa();
        rows.push(
            Row::within(
                of("largest pressure"),
                "MPa",
                pressure,
                largest,
                0.5 / f64::from(cells),
            )
            .digits(3),
        );
        let half = pressed(&block, shape, pose, 0.5 * DEPTH)?;
        let power = (found.force_n.z / half.force_n.z).log2();
        rows.push(Row::near(of("power of δ in F"), "", 1.5, power, 0.06).digits(3));
    }
    let punch = 2.0;
    let expected = 2.0 * punch * STIFFNESS * DEPTH;
    for (cells, tolerance) in [(4u32, 0.15), (8, 0.06)] {
        let block = quarter(punch / f64::from(cells), cells as usize * 3 / 2)?;
        let shape = Shape::Disc {
            radius_mm: punch,
            edge_mm: 0.0,
        };
        let pose = Pose::new(Vec3::zeros(), -Vec3::z()).map_err(|e| CheckError::Other(e.to_string()))?;
        let found = pressed(&block, shape, pose, 0.1 * DEPTH)?;
        let quantity = format!("flat punch, {cells} cells over its radius: force");
        rows.push(Row::within(quantity, "N", 0.1 * expected, -4.0 * found.force_n.z, tolerance).digits(4));
    }
    Ok(Findings::new(
        rows,
        "Contact points are nodes, so the edge of the contact is known to about a cell: the radius, which comes from the area of the \
         points that touch, may be off by one and a half cells, the largest pressure by half a cell's share of the radius. The \
         pressure under the punch is infinite at its rim, which every mesh cuts off: its force rises to the closed form with the \
         first order.",
    ))
}
