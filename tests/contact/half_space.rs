//! A sphere and a flat punch on an elastic half space: a quarter of a block that is large against the contact.
//!
//! ```text
//! Hertz       F = 4/3 E* √R δ^1.5,  a = √(R δ),  p₀ = 2 E*/π √(δ/R)
//! flat punch  F = 2 a E* δ
//! E* = E / (1 − ν²)
//! ```
//!
//! Source: Johnson, Contact Mechanics, 1985, sections 3.4, 3.8 and 4.2.

use crate::support::{graded, model, on_lines, simulate, unloaded};
use pliant::fem::contact::{ContactOptions, Drive, Friction, Level, Pose, RigidBody, Shape, Surface};
use pliant::fem::equilibrium::Stop;
use pliant::fem::model::Model;
use pliant::material::law::Law;
use pliant::math::Vec3;
use std::f64::consts::PI;

const YOUNG: f64 = 1.0;
const POISSON: f64 = 0.3;
const STIFFNESS: f64 = YOUNG / (1.0 - POISSON * POISSON);

/// A quarter block with its upper face in z = 0 and its corner under the contact: `h` wide cells out to `fine`.
fn quarter(h: f64, fine: usize, growth: f64, size: f64) -> Model {
    let lines = graded(h, fine, growth, size);
    let depth: Vec<f64> = lines.iter().rev().map(|x| -x).collect();
    let mesh = on_lines(&lines, &lines, &depth);
    let far = |c: f64| (c - size).abs() < 1e-9;
    model(mesh, |x| {
        let all = far(-x.z);
        [all || x.x == 0.0, all || x.y == 0.0, all]
    })
}

fn upper(model: &Model) -> Surface {
    let nodes = &model.mesh.nodes;
    Surface::of_mesh(&model.mesh).only(nodes, |x, _| x.z > -1e-9)
}

fn travel(way_mm: f64) -> Level {
    Level {
        load_factor: 0.0,
        drives: vec![Drive::travel(way_mm)],
    }
}

#[test]
fn hertz() {
    let (radius, depth) = (50.0, 0.1f64);
    let a = (radius * depth).sqrt();
    let law = Law::linear_isotropic(YOUNG, POISSON).unwrap();
    let exact = 4.0 / 3.0 * STIFFNESS * radius.sqrt() * depth.powf(1.5);
    for cells in [3, 5, 8] {
        let model = quarter(a / cells as f64, cells * 3 / 2, 1.6, 200.0);
        let surface = upper(&model);
        let sphere = RigidBody::probe(
            Shape::Sphere { radius_mm: radius },
            Pose::at(Vec3::z() * radius).unwrap(),
            -Vec3::z(),
            Friction::Frictionless,
        )
        .unwrap();
        let levels = [travel(0.5 * depth), travel(depth)];
        let started = std::time::Instant::now();
        let (curve, reactions) = simulate(
            &model,
            &surface,
            &[sphere],
            &law,
            &unloaded(&model),
            &levels,
            &ContactOptions::default(),
        );
        println!("{:?} {:?}", started.elapsed(), curve.work);
        assert_eq!(curve.stop, Stop::Converged);
        let found = &curve.levels[1].bodies[0];
        let p0 = 2.0 * STIFFNESS / PI * (depth / radius).sqrt();
        println!(
            "cells {cells} unknowns {} force {} ({:.4}) radius {:.4} p0 {:.4} reactions {:?} force {:?} pen {:.2e}",
            model.unknowns(),
            -4.0 * found.force_n.z,
            -4.0 * found.force_n.z / exact,
            (4.0 * found.area_mm2 / PI).sqrt() / a,
            found.largest_pressure_mpa() / p0,
            reactions[1].z,
            found.force_n.z,
            found.penetration_mm,
        );
    }
    panic!();
}
