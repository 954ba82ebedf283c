//! A sphere and a flat punch on an elastic half space: a quarter of a block that is large against the contact.
//!
//! ```text
//! Hertz       F = 4/3 E* √R δ^1.5,  a = √(R δ),  p₀ = 2 E*/π √(δ/R)
//! flat punch  F = 2 a E* δ
//! E* = E / (1 − ν²)
//! ```
//!
//! A block of size L in place of the half space is stiffer: its far end would have moved by F / (π E* L), 0.5 % to 1 % of
//! the depth here. Source: Johnson, Contact Mechanics, 1985, sections 3.4, 3.8 and 4.2.

use crate::support::{graded, level, model, on_lines, simulate, unloaded};
use pliant::fem::contact::{BodyContact, ContactOptions, Drive, Friction, Pose, RigidBody, Shape, Surface};
use pliant::fem::equilibrium::Stop;
use pliant::fem::model::Model;
use pliant::material::law::Law;
use pliant::math::Vec3;
use std::f64::consts::PI;

const YOUNG: f64 = 1.0;
const POISSON: f64 = 0.3;
const STIFFNESS: f64 = YOUNG / (1.0 - POISSON * POISSON);
const SIZE: f64 = 150.0;

/// A quarter block with its upper face in z = 0 and its corner under the contact: cells `h` wide, `fine` of them, then
/// growing.
fn quarter(h: f64, fine: usize) -> Model {
    let lines = graded(h, fine, 1.8, SIZE);
    let depth: Vec<f64> = lines.iter().rev().map(|x| -x).collect();
    model(on_lines(&lines, &lines, &depth), |x| {
        let below = (x.z + SIZE).abs() < 1e-9;
        [below || x.x == 0.0, below || x.y == 0.0, below]
    })
}

/// What the body does to the quarter, pressed from above by `travel`.
fn pressed(model: &Model, body: &RigidBody, travel: &[f64]) -> Vec<BodyContact> {
    let surface = Surface::of_mesh(&model.mesh).only(&model.mesh.nodes, |x, _| x.z > -1e-9);
    let law = Law::linear_isotropic(YOUNG, POISSON).unwrap();
    let levels: Vec<_> = travel.iter().map(|t| level(vec![Drive::travel(*t)])).collect();
    let options = ContactOptions::default();
    let bodies = std::slice::from_ref(body);
    let (curve, reactions) = simulate(model, &surface, bodies, &law, &unloaded(model), &levels, &options);
    assert_eq!(curve.stop, Stop::Converged);
    for (level, reaction) in curve.levels.iter().zip(&reactions) {
        // The supports take what the body gives; the residual is below 1e-8 of it.
        let force = level.bodies[0].force_n.z;
        assert!(
            (force + reaction.z).abs() < 1e-6 * force.abs(),
            "{force} {reaction}"
        );
    }
    curve.levels.into_iter().map(|mut l| l.bodies.remove(0)).collect()
}

#[test]
fn hertz() {
    let (radius, depth) = (50.0, 0.1f64);
    let a = (radius * depth).sqrt();
    let p0 = 2.0 * STIFFNESS / PI * (depth / radius).sqrt();
    let force = |depth: f64| 4.0 / 3.0 * STIFFNESS * radius.sqrt() * depth.powf(1.5);
    let sphere = RigidBody::probe(
        Shape::Sphere { radius_mm: radius },
        Pose::at(Vec3::z() * radius).unwrap(),
        -Vec3::z(),
        Friction::Frictionless,
    )
    .unwrap();
    let mut pressure_errors = Vec::new();
    for cells in [3, 5] {
        let h = a / f64::from(cells);
        let model = quarter(h, (cells * 3 / 2) as usize);
        let found = pressed(&model, &sphere, &[0.5 * depth, depth]);
        let share = -4.0 * found[1].force_n.z / force(depth);
        let area_radius = (4.0 * found[1].area_mm2 / PI).sqrt();
        let peak = found[1].largest_pressure_mpa() / p0;
        println!(
            "{cells} cells: force {share:.4}, radius {:.4}, peak {peak:.4} of Hertz'",
            area_radius / a
        );
        // 0.7 % from the block's size, the rest from the cells.
        assert!((share - 1.0).abs() < 0.02, "{share}");
        // F ∝ δ^1.5; half of the depth has a coarser contact.
        let exponent = (found[1].force_n.z / found[0].force_n.z).log2();
        assert!((exponent - 1.5).abs() < 0.05, "{exponent}");
        // Points count with the whole area that they stand for, which reaches half a cell beyond them.
        assert!((area_radius - a).abs() < 1.1 * h, "{area_radius} {a}");
        assert!(found[1].penetration_mm < 1e-6 * SIZE);
        pressure_errors.push((peak - 1.0).abs());
    }
    assert!(
        pressure_errors[1] < 0.6 * pressure_errors[0],
        "{pressure_errors:?}"
    );
    assert!(pressure_errors[1] < 0.07, "{pressure_errors:?}");
}

#[test]
fn flat_punch() {
    let (radius, depth) = (2.0, 0.02);
    let exact = 2.0 * radius * STIFFNESS * depth;
    let mut errors = Vec::new();
    for cells in [3, 6] {
        // The last node under the punch lies half a cell within its edge: what a node stands for ends there.
        let h = radius / (f64::from(cells) + 0.5);
        let model = quarter(h, (cells + 2) as usize);
        let punch = RigidBody::probe(
            Shape::Disc {
                radius_mm: radius,
                edge_mm: 0.02,
            },
            Pose::new(Vec3::zeros(), -Vec3::z()).unwrap(),
            -Vec3::z(),
            Friction::Frictionless,
        )
        .unwrap();
        let found = pressed(&model, &punch, &[depth]);
        let share = -4.0 * found[0].force_n.z / exact;
        println!("{cells} cells: force {share:.4} of the half space's");
        errors.push((share - 1.0).abs());
    }
    // The circle's staircase and the pressure's singular edge: of first order in the cell.
    assert!(errors[0] < 0.12 && errors[1] < 0.06, "{errors:?}");
}
