//! Patch tests, rigid motion, objectivity, tangent against finite differences, energy.

use crate::support::{fixed_where, hardening_law, solve};
use pliant::fem::elements::Discretisation;
use pliant::fem::equilibrium::{Load, Options, Stop};
use pliant::fem::forces::{Materials, add_internal_forces};
use pliant::fem::model::Model;
use pliant::fem::stiffness::Kind;
use pliant::geometry::volume::{Elements, KUHN, VolumeMesh};
use pliant::material::database::Database;
use pliant::material::law::Law;
use pliant::math::{Mat3, Vec3};
use std::path::Path;

fn distorted(tetrahedra: bool) -> VolumeMesh {
    let size = Vec3::new(3.0, 2.0, 2.0);
    let mut mesh = VolumeMesh::cuboid(size, [3, 3, 2], tetrahedra);
    for (i, x) in mesh.nodes.iter_mut().enumerate() {
        let inner = (0..3).all(|c| x[c] > 1e-9 && x[c] < size[c] - 1e-9);
        if inner {
            let t = i as f64;
            *x += 0.15 * Vec3::new((3.1 * t).sin(), (1.7 * t).cos(), (2.3 * t).sin());
        }
    }
    mesh
}

fn lone_tetrahedra() -> VolumeMesh {
    let mesh = distorted(true);
    let Elements::KuhnCells(cells) = &mesh.elements else {
        unreachable!()
    };
    let tets = cells.iter().flat_map(|c| KUHN.map(|t| t.map(|i| c[i]))).collect();
    VolumeMesh {
        nodes: mesh.nodes,
        elements: Elements::Tetrahedra(tets),
    }
}

fn all_kinds() -> [VolumeMesh; 3] {
    [distorted(false), distorted(true), lone_tetrahedra()]
}

fn internal_forces(mesh: &VolumeMesh, u: &[Vec3], law: &Law) -> Vec<Vec3> {
    let parts = Discretisation::new(mesh, None).unwrap();
    let cells = vec![0; parts.points()];
    let mut forces = vec![Vec3::zeros(); u.len()];
    add_internal_forces(
        &parts,
        u,
        &Materials {
            laws: &[law],
            cell_of_point: &cells,
        },
        &mut forces,
    );
    forces
}

fn laws() -> [Law; 2] {
    [Law::linear_isotropic(0.3, 0.3).unwrap(), hardening_law(0.3, 0.45)]
}

/// A homogeneous strain of the border must make the same strain inside, on any mesh.
#[test]
fn patch_test_on_distorted_meshes() {
    let slope = Mat3::new(-0.15, 0.05, 0.02, 0.08, 0.10, -0.04, 0.03, -0.06, 0.12);
    for law in laws() {
        for mesh in all_kinds() {
            let on_border = |x: &Vec3| {
                [x.x, x.y, x.z]
                    .iter()
                    .zip([3.0, 2.0, 2.0])
                    .any(|(x, s)| *x < 1e-9 || *x > s - 1e-9)
            };
            let held = fixed_where(&mesh, |x| [on_border(x); 3]);
            let target: Vec<Vec3> = mesh.nodes.iter().map(|x| slope * x).collect();
            let load = Load {
                forces: vec![Vec3::zeros(); mesh.nodes.len()],
                prescribed: Some(target.clone()),
            };
            let model = Model::new(mesh, None, held).unwrap();
            let curve = solve(&model, &law, &load, &[1.0], &Options::default());
            assert_eq!(curve.stop, Stop::Converged);
            for (u, t) in curve.levels[0].iter().zip(&target) {
                // Displacements are about 0.5 mm; the solve stops at 1e-8 of that.
                assert!((u - t).norm() < 2e-8, "{u} is not {t}");
            }
        }
    }
}

#[test]
fn rigid_motion_gives_no_force_and_forces_turn_with_the_object() {
    let turn = nalgebra::Rotation3::from_scaled_axis(Vec3::new(1.0, -2.0, 0.5)).into_inner();
    let shift = Vec3::new(10.0, -3.0, 7.0);
    for law in laws() {
        for mesh in all_kinds() {
            let rigid: Vec<Vec3> = mesh.nodes.iter().map(|x| turn * x + shift - x).collect();
            let largest = internal_forces(&mesh, &rigid, &law)
                .iter()
                .map(|f| f.norm())
                .fold(0.0, f64::max);
            assert!(largest < 1e-13, "{largest} N from a rigid motion");

            let bent: Vec<Vec3> = mesh
                .nodes
                .iter()
                .map(|x| 0.1 * Vec3::new(x.y * x.z, x.x, -x.x * x.y))
                .collect();
            let turned: Vec<Vec3> = mesh
                .nodes
                .iter()
                .zip(&bent)
                .map(|(x, u)| turn * (x + u) + shift - x)
                .collect();
            let (before, after) = (
                internal_forces(&mesh, &bent, &law),
                internal_forces(&mesh, &turned, &law),
            );
            for (b, a) in before.iter().zip(&after) {
                assert!((turn * b - a).norm() < 1e-12);
            }
            let sum: Vec3 = before.iter().sum();
            let moment: Vec3 = mesh
                .nodes
                .iter()
                .zip(&bent)
                .zip(&before)
                .map(|((x, u), f)| (x + u).cross(f))
                .sum();
            assert!(
                sum.norm() < 1e-13 && moment.norm() < 1e-12,
                "{sum} N, {moment} N mm"
            );
        }
    }
}

/// The stress on the rotation, [v]×, makes the Cauchy stress symmetric where stress and stretch have different axes.
/// Without it the moment is 2e-3 mm times the sum of the forces.
#[test]
fn moments_balance_in_a_transversely_isotropic_material() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("materials-db");
    let database = Database::open(&folder).unwrap();
    let law = database.find("tubes-fine-wide").unwrap().law().unwrap();
    for mesh in all_kinds() {
        let bent: Vec<Vec3> = mesh
            .nodes
            .iter()
            .map(|x| 0.1 * Vec3::new(x.y * x.z + x.z, x.x, -x.x * x.y))
            .collect();
        let forces = internal_forces(&mesh, &bent, &law);
        let size: f64 = forces.iter().map(|f| f.norm()).sum();
        let moment: Vec3 = mesh
            .nodes
            .iter()
            .zip(&bent)
            .zip(&forces)
            .map(|((x, u), f)| (x + u).cross(f))
            .sum();
        let sum: Vec3 = forces.iter().sum();
        assert!(size > 0.1, "{size} N");
        assert!(
            sum.norm() < 1e-11 * size && moment.norm() < 1e-11 * size,
            "{sum} N, {moment} N mm of {size} N"
        );
    }
}

#[allow(clippy::needless_range_loop)] // rows and columns of a sparse matrix
/// The assembled tangent is the symmetric part of the derivative of the internal forces.
#[test]
fn tangent_agrees_with_finite_differences() {
    for law in laws() {
        for mesh in all_kinds() {
            let n = mesh.nodes.len();
            let u: Vec<Vec3> = mesh
                .nodes
                .iter()
                .map(|x| {
                    Vec3::new(
                        0.1 * x.y * x.z - 0.05 * x.x,
                        0.12 * x.x,
                        -0.08 * x.z + 0.05 * x.x * x.y,
                    )
                })
                .collect();
            let held = fixed_where(&mesh, |x| [x.z < 1e-9; 3]);
            let model = Model::new(mesh.clone(), None, held).unwrap();
            let mut values = vec![0.0; model.symbolic().pattern().rows.len()];
            let cells = vec![0; model.parts.points()];
            let materials = Materials {
                laws: &[&law],
                cell_of_point: &cells,
            };
            model.assemble(&u, &materials, Kind::Tangent, &mut values);
            let unknowns = model.unknowns();
            let column = |k: usize| {
                let mut e = vec![0.0; unknowns];
                e[k] = 1.0;
                let mut direction = vec![Vec3::zeros(); n];
                model.spread(&e, &mut direction);
                let h = 1e-6;
                let moved = |s: f64| {
                    let v: Vec<Vec3> = u.iter().zip(&direction).map(|(u, d)| u + d * s).collect();
                    let mut out = vec![0.0; unknowns];
                    model.gather(&internal_forces(&mesh, &v, &law), &mut out);
                    out
                };
                let (plus, minus) = (moved(h), moved(-h));
                plus.iter()
                    .zip(&minus)
                    .map(|(p, m)| (p - m) / (2.0 * h))
                    .collect::<Vec<f64>>()
            };
            let full: Vec<Vec<f64>> = (0..unknowns).map(column).collect();
            let largest = full.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
            assert!(largest > 0.01);
            let pattern = model.symbolic().pattern();
            for j in 0..unknowns {
                for p in pattern.columns[j]..pattern.columns[j + 1] {
                    let i = pattern.rows[p];
                    let both = 0.5 * (full[j][i] + full[i][j]);
                    // Central differences at 1e-6 resolve about 1e-9 of the largest entry.
                    assert!(
                        (values[p] - both).abs() < 1e-7 * largest,
                        "({i}, {j}): {} is not {both}",
                        values[p]
                    );
                }
            }
        }
    }
}

/// The linear law has an energy, Σ w (μ |ε|² + λ/2 tr² ε): its gradient is the internal force.
#[test]
fn work_of_the_linear_law_does_not_depend_on_the_path() {
    let law = Law::linear_isotropic(0.3, 0.4).unwrap();
    for mesh in all_kinds() {
        let shape = |a: f64, b: f64| -> Vec<Vec3> {
            mesh.nodes
                .iter()
                .map(|x| Vec3::new(a * x.y * x.z, b * x.x * x.x, -a * x.z + b * x.y))
                .collect()
        };
        // Work around a rectangle in the space of two shapes, midpoint rule.
        let corners = [(0.0, 0.0), (0.2, 0.0), (0.2, 0.15), (0.0, 0.15), (0.0, 0.0)];
        let (mut total, mut out) = (0.0, 0.0);
        for pair in corners.windows(2) {
            let ((a0, b0), (a1, b1)) = (pair[0], pair[1]);
            let steps = 200;
            for s in 0..steps {
                let at = |t: f64| shape(a0 + t * (a1 - a0), b0 + t * (b1 - b0));
                let (s0, s1) = (s as f64 / steps as f64, (s + 1) as f64 / steps as f64);
                let forces = internal_forces(&mesh, &at(0.5 * (s0 + s1)), &law);
                let (u0, u1) = (at(s0), at(s1));
                let work: f64 = forces
                    .iter()
                    .zip(u0.iter().zip(&u1))
                    .map(|(f, (u, v))| f.dot(&(v - u)))
                    .sum();
                total += work;
                out += work.abs();
            }
        }
        assert!(out > 0.01 && total.abs() < 1e-5 * out, "{total} of {out} N mm");
    }
}

/// The secant matrix of an isotropic law is built from a closed form: K u at a small displacement from rest must be the
/// internal force that it makes, and a displacement of the whole object must make none.
#[test]
fn secant_matrix_at_rest_is_the_derivative_of_the_internal_forces() {
    for law in laws() {
        for mesh in all_kinds() {
            let held = fixed_where(&mesh, |x| [x.z < 1e-9; 3]);
            let model = Model::new(mesh.clone(), None, held).unwrap();
            let cells = vec![0; model.parts.points()];
            let materials = Materials {
                laws: &[&law],
                cell_of_point: &cells,
            };
            let mut values = vec![0.0; model.symbolic().pattern().rows.len()];
            let rest = vec![Vec3::zeros(); mesh.nodes.len()];
            model.assemble(&rest, &materials, Kind::Secant, &mut values);
            let direction: Vec<f64> = (0..model.unknowns()).map(|i| (1.3 * i as f64).sin()).collect();
            let pattern = model.symbolic().pattern();
            let mut product = vec![0.0; direction.len()];
            for column in 0..direction.len() {
                let entries = pattern.columns[column]..pattern.columns[column + 1];
                for (&row, value) in pattern.rows[entries.clone()].iter().zip(&values[entries]) {
                    product[row] += value * direction[column];
                    if row != column {
                        product[column] += value * direction[row];
                    }
                }
            }
            let h = 1e-7;
            let mut u = rest.clone();
            model.spread(&direction.iter().map(|d| h * d).collect::<Vec<_>>(), &mut u);
            let mut force = vec![0.0; direction.len()];
            model.gather(&internal_forces(&mesh, &u, &law), &mut force);
            let size = product.iter().fold(0.0f64, |m, p| m.max(p.abs()));
            for (p, f) in product.iter().zip(&force) {
                // Second-order terms at strains of 1e-7 and rounding of 1e-16 / 1e-7.
                assert!((p - f / h).abs() < 1e-5 * size, "{p} is not {}", f / h);
            }
        }
    }
}
