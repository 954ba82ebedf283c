//! Whole solves against closed forms and against themselves with other steps.

use crate::support::{even_force, fixed_where, hardening_law, solve};
use pliant::fem::equilibrium::{Load, Options, Solver, Stop};
use pliant::fem::forces::Materials;
use pliant::fem::model::{Model, ModelError};
use pliant::geometry::volume::VolumeMesh;
use pliant::material::law::Law;
use pliant::math::Vec3;
use pliant::math::mandel::Mandel;

const BLOCK: Vec3 = Vec3::new(50.0, 40.0, 25.0);

fn pressed(counts: [usize; 3], tetrahedra: bool, total_n: f64) -> (Model, Load) {
    let mesh = VolumeMesh::cuboid(BLOCK, counts, tetrahedra);
    let held = fixed_where(&mesh, |x| [x.z < 1e-9; 3]);
    let on_disc = |x: &Vec3| x.z > 25.0 - 1e-9 && (x.x - 25.0).hypot(x.y - 20.0) < 8.5;
    let load = even_force(&mesh, Vec3::new(0.0, 0.0, -total_n), on_disc);
    (Model::new(mesh, None, held).unwrap(), load)
}

/// Free sides, rollers below: uniform strain ε = U − I, and nominal stress σ(ε) from the law itself with the lateral
/// strain −ν ε; for the linear law F = E ε A.
#[test]
fn uniaxial_compression_is_homogeneous() {
    let law = Law::linear_isotropic(0.25, 0.3).unwrap();
    for tetrahedra in [false, true] {
        let mesh = VolumeMesh::cuboid(BLOCK, [3, 3, 2], tetrahedra);
        let held = fixed_where(&mesh, |x| {
            [x.x < 1e-9, x.y < 1e-9, x.z < 1e-9 || x.z > 25.0 - 1e-9]
        });
        let target = mesh
            .nodes
            .iter()
            .map(|x| Vec3::new(0.0, 0.0, -0.3 * x.z))
            .collect();
        let load = Load {
            forces: vec![Vec3::zeros(); mesh.nodes.len()],
            prescribed: Some(target),
        };
        let model = Model::new(mesh, None, held).unwrap();
        let curve = solve(&model, &law, &load, &[1.0], &Options::default());
        assert_eq!(curve.stop, Stop::Converged);
        for (x, u) in model.mesh.nodes.iter().zip(&curve.levels[0]) {
            let exact = Vec3::new(0.09 * x.x, 0.09 * x.y, -0.3 * x.z);
            assert!((u - exact).norm() < 1e-6, "{u} is not {exact}");
        }
    }
}

/// The same with a load in place of a displacement and a law that stiffens: P = σ(ε) of the law.
#[test]
fn a_hardening_column_carries_the_stress_of_its_law() {
    let law = hardening_law(0.2, 0.3);
    let strain = Mandel::new(0.09, 0.09, -0.3, 0.0, 0.0, 0.0);
    let stress = law.stress(&strain);
    // Off the centres of the law the lateral stress is zero because Poisson's ratio is the same at all of them.
    assert!(stress[0].abs() < 1e-9);
    let mesh = VolumeMesh::cuboid(BLOCK, [2, 2, 2], false);
    let held = fixed_where(&mesh, |x| [x.x < 1e-9, x.y < 1e-9, x.z < 1e-9]);
    // Consistent nodal forces of a uniform pressure: corner 1, edge 2, middle 4 shares.
    let share = |x: &Vec3| {
        let inner = |c: f64, s: f64| if c > 1e-9 && c < s - 1e-9 { 2.0 } else { 1.0 };
        if x.z > 25.0 - 1e-9 {
            inner(x.x, 50.0) * inner(x.y, 40.0) / 16.0
        } else {
            0.0
        }
    };
    let total = stress[2] * 50.0 * 40.0;
    let forces = mesh
        .nodes
        .iter()
        .map(|x| Vec3::new(0.0, 0.0, total * share(x)))
        .collect();
    let model = Model::new(mesh, None, held).unwrap();
    let load = Load {
        forces,
        prescribed: None,
    };
    let curve = solve(&model, &law, &load, &[0.5, 1.0], &Options::default());
    assert_eq!(curve.stop, Stop::Converged);
    let top = model.mesh.nodes.iter().position(|x| x.z > 24.9).unwrap();
    assert!(
        (curve.levels[1][top].z + 7.5).abs() < 1e-5,
        "{}",
        curve.levels[1][top].z
    );
}

#[test]
fn the_answer_does_not_depend_on_the_number_of_steps() {
    for (law, tetrahedra) in [
        (hardening_law(0.15, 0.45), false),
        (hardening_law(0.15, 0.3), true),
    ] {
        let (model, load) = pressed([10, 8, 5], tetrahedra, 15.0);
        let options = Options::default();
        let answers: Vec<Vec<Vec3>> = [1usize, 3, 7]
            .iter()
            .map(|&n| {
                let factors: Vec<f64> = (1..=n).map(|k| k as f64 / n as f64).collect();
                let mut curve = solve(&model, &law, &load, &factors, &options);
                assert_eq!(curve.stop, Stop::Converged, "{:?}", curve.work);
                curve.levels.pop().unwrap()
            })
            .collect();
        let size = answers[0].iter().map(Vec3::norm).fold(0.0, f64::max);
        assert!(size > 2.0);
        for other in &answers[1..] {
            let difference = answers[0]
                .iter()
                .zip(other)
                .map(|(a, b)| (a - b).norm())
                .fold(0.0, f64::max);
            assert!(difference < 1e-6 * size, "{difference} mm of {size} mm");
        }
    }
}

#[test]
fn newton_and_the_accelerated_iteration_agree() {
    let law = hardening_law(0.15, 0.4);
    let (model, load) = pressed([10, 8, 5], false, 15.0);
    let options = Options::default();
    let newton = Options {
        accelerated_iterations: 0,
        ..options
    };
    let factors = [0.2, 0.4, 0.6, 0.8, 1.0];
    let (a, b) = (
        solve(&model, &law, &load, &factors, &options),
        solve(&model, &law, &load, &factors, &newton),
    );
    assert_eq!((a.stop, b.stop), (Stop::Converged, Stop::Converged));
    assert!(a.work.newton_iterations == 0 && b.work.accelerated_iterations == 0);
    let worst = a.levels[4]
        .iter()
        .zip(&b.levels[4])
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max);
    assert!(worst < 1e-6, "{worst} mm apart");
    println!("accelerated {:?}\nnewton {:?}", a.work, b.work);
}

/// Displacement under the load on three meshes at ν = 0.3 and 0.49. The nearly incompressible block is stiffer by a
/// factor that depends on the mesh only a little, where an element that locks grows stiffer without limit.
#[test]
fn elements_do_not_lock_near_incompressibility() {
    let sag = |counts: [usize; 3], poisson: f64, tetrahedra: bool| {
        let law = Law::linear_isotropic(0.5, poisson).unwrap();
        let mesh = VolumeMesh::cuboid(BLOCK, counts, tetrahedra);
        let held = fixed_where(&mesh, |x| [x.z < 1e-9; 3]);
        let load = even_force(&mesh, Vec3::new(0.0, 0.0, -20.0), |x| x.z > 25.0 - 1e-9);
        let model = Model::new(mesh, None, held).unwrap();
        let curve = solve(&model, &law, &load, &[1.0], &Options::default());
        assert_eq!(curve.stop, Stop::Converged);
        let top = model
            .mesh
            .nodes
            .iter()
            .zip(&curve.levels[0])
            .filter(|(x, _)| x.z > 25.0 - 1e-9);
        let (sum, count) = top.fold((0.0, 0), |(s, n), (_, u)| (s + u.z, n + 1));
        -sum / count as f64
    };
    for tetrahedra in [false, true] {
        let meshes = [[4, 3, 2], [8, 6, 4], [16, 12, 8]];
        let ratios: Vec<f64> = meshes
            .iter()
            .map(|&m| sag(m, 0.49, tetrahedra) / sag(m, 0.3, tetrahedra))
            .collect();
        println!("tetrahedra {tetrahedra}: stiffening on three meshes {ratios:?}");
        assert!((ratios[0] / ratios[2] - 1.0).abs() < 0.12, "{ratios:?}");
        assert!((ratios[1] / ratios[2] - 1.0).abs() < 0.05, "{ratios:?}");
    }
}

#[test]
fn a_load_that_tears_the_object_is_said_with_what_was_reached() {
    let law = Law::linear_isotropic(0.05, 0.3).unwrap();
    let (model, load) = pressed([10, 8, 5], false, 100.0);
    let curve = solve(&model, &law, &load, &[0.1, 0.5, 1.0], &Options::default());
    assert!(
        matches!(curve.stop, Stop::Inverted { .. } | Stop::NotConverged),
        "{:?}",
        curve.stop
    );
    assert!(curve.reached > 0.0 && curve.reached < 1.0 && curve.levels.len() < 3);
}

#[test]
fn an_object_that_nothing_holds_is_named() {
    let mesh = VolumeMesh::cuboid(BLOCK, [2, 2, 2], false);
    let held = vec![[false; 3]; mesh.nodes.len()];
    assert!(matches!(
        Model::new(mesh, None, held),
        Err(ModelError::NotHeld {
            elements: 8,
            held: 0,
            ..
        })
    ));
}

/// Anderson's iterations and the factorisation run on one thread: the bits must repeat.
#[test]
fn two_runs_agree_bit_by_bit() {
    let law = hardening_law(0.15, 0.4);
    let (model, load) = pressed([8, 6, 4], false, 12.0);
    let run = || solve(&model, &law, &load, &[0.5, 1.0], &Options::default()).levels;
    assert_eq!(run(), run());
}

/// A solver that has seen other materials and hard loads answers the bits of a fresh one: layouts meet threads in any order.
#[test]
fn an_earlier_curve_leaves_no_trace() {
    let (model, load) = pressed([8, 6, 4], false, 8.0);
    let (soft, firm) = (hardening_law(0.08, 0.45), hardening_law(0.3, 0.4));
    let cells = vec![0u16; model.parts.points()];
    let (soft, firm) = ([&soft], [&firm]);
    let materials = |laws| Materials {
        laws,
        cell_of_point: &cells,
    };
    let mut solver = Solver::new(&model).unwrap();
    // So exact that Anderson's iteration outlives its factor at rest.
    let options = Options {
        tolerance: 1e-12,
        accelerated_iterations: 200,
        ..Options::default()
    };
    let mut answer = |laws| {
        let materials = materials(laws);
        solver.start(&materials).unwrap();
        solver.curve(&materials, &load, &[0.5, 1.0], &options, &|| false)
    };
    let first = answer(&soft);
    // Otherwise there would be nothing to leave behind; Newton's iteration clears up by itself.
    assert!(
        first.work.factorisations > 1 && first.work.newton_iterations == 0,
        "{:?}",
        first.work
    );
    let second = answer(&firm);
    let fresh = solve(&model, firm[0], &load, &[0.5, 1.0], &options);
    assert_eq!(second.levels, fresh.levels);
    assert_eq!(second.work, fresh.work);
}
