//! Multigrid conjugate gradients against the direct solver, over sizes, contrasts, partly filled cells and threads.

use pliant::fem::forces::Materials;
use pliant::fem::model::Model;
use pliant::fem::stiffness::Kind;
use pliant::geometry::axis::Axis;
use pliant::geometry::files::read::open_surface;
use pliant::geometry::grid::{Grid, Levels};
use pliant::geometry::heights::Heights;
use pliant::geometry::solid::Solid;
use pliant::geometry::volume::{Elements, KUHN, VolumeMesh};
use pliant::material::law::Law;
use pliant::math::Vec3;
use pliant::numerics::cholesky::{Cholesky, CholeskyError, Method, Symbolic};
use pliant::numerics::conjugate_gradients::Ended;
use pliant::numerics::linear_solver::LinearSolver;
use pliant::units::LengthUnit;
use std::path::Path;
use std::sync::Arc;

/// One linear step: a model, the lower triangle of its stiffness, a load.
struct Step {
    model: Model,
    values: Vec<f64>,
    load: Vec<f64>,
}

fn step(mesh: VolumeMesh, fill: Option<Vec<f64>>, held: Vec<[bool; 3]>, contrast: f64, part: f64) -> Step {
    let model = Model::new(mesh, fill, held).unwrap();
    let laws = [1.0, 1.0 / contrast].map(|young| Law::linear_isotropic(young, 0.3).unwrap());
    let per_element = model.parts.points_per_element();
    // Cubes of two materials alternate.
    let cell_of_point: Vec<u16> = (0..model.parts.points())
        .map(|q| {
            let nodes = model.mesh.elements.nodes_of(q / per_element);
            let middle: Vec3 =
                nodes.iter().map(|&n| model.mesh.nodes[n as usize]).sum::<Vec3>() / nodes.len() as f64;
            (middle / part)
                .iter()
                .map(|c| c.floor() as i64)
                .sum::<i64>()
                .rem_euclid(2) as u16
        })
        .collect();
    let materials = Materials {
        laws: &[&laws[0], &laws[1]],
        cell_of_point: &cell_of_point,
    };
    let rest = vec![Vec3::zeros(); model.mesh.nodes.len()];
    let mut values = vec![0.0; model.symbolic().pattern().rows.len()];
    model.assemble(&rest, &materials, Kind::Secant, &mut values);
    let load = (0..model.unknowns()).map(|i| (0.7 * i as f64).sin()).collect();
    Step { model, values, load }
}

fn cube(n: usize, contrast: f64) -> Step {
    let mesh = VolumeMesh::cuboid(Vec3::from_element(n as f64), [n; 3], false);
    // One face held in x only, the ground in all components: rows of held components of both kinds.
    let held = mesh
        .nodes
        .iter()
        .map(|x| [x.z == 0.0 || x.x == 0.0, x.z == 0.0, x.z == 0.0])
        .collect();
    step(mesh, None, held, contrast, n as f64 / 4.0)
}

/// Tetrahedra with nodes off the lines of any grid.
fn tetrahedra(n: usize) -> Step {
    let cells = VolumeMesh::cuboid(Vec3::new(1.5, 1.0, 0.7) * n as f64, [n; 3], true);
    let Elements::KuhnCells(boxes) = &cells.elements else {
        unreachable!()
    };
    let tets = boxes
        .iter()
        .flat_map(|c| KUHN.map(|tet| tet.map(|i| c[i])))
        .collect();
    let held = cells.nodes.iter().map(|x| [x.z == 0.0; 3]).collect();
    let nodes = cells.nodes.iter().enumerate();
    let shaken = nodes.map(|(i, x)| {
        let t = i as f64;
        x + 0.12 * Vec3::new((3.1 * t).sin(), (1.7 * t).cos(), (2.3 * t).sin())
    });
    let mesh = VolumeMesh {
        nodes: shaken.collect(),
        elements: Elements::Tetrahedra(tets),
    };
    step(mesh, None, held, 1.0, 1.0)
}

/// The flip-flop's sole on a grid that follows its surface, cells at the outline partly filled.
fn sole(size_mm: f64, layers: usize, contrast: f64) -> Step {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/flip-flop/sole.stl");
    let solid = Solid::new(open_surface(&path, Some(LengthUnit::Millimetre)).unwrap().mesh).unwrap();
    let shares = (0..=layers).map(|k| k as f64 / layers as f64).collect();
    let levels = Levels::Following(Heights::new(&solid, Axis::Z, size_mm), shares);
    let grid = Grid::new(&solid, Axis::Z, size_mm, levels, [&[], &[]]).unwrap();
    let mut held = vec![[false; 3]; grid.mesh.nodes.len()];
    for node in grid.end_nodes(false) {
        held[node] = [true; 3];
    }
    step(grid.mesh, Some(grid.fill), held, contrast, 20.0)
}

fn iterative(step: &Step) -> LinearSolver {
    let symbolic = step.model.symbolic();
    let (pattern, sites) = (symbolic.pattern().clone(), symbolic.sites().cloned());
    LinearSolver::new(Arc::new(Symbolic::by(Method::Iterative, pattern, sites).unwrap())).unwrap()
}

/// Solves by iteration; the answer and the iterations.
fn solved(step: &Step) -> (Vec<f64>, usize) {
    let mut solver = iterative(step);
    solver.factorise(&step.values).unwrap();
    let mut x = step.load.clone();
    solver.solve(&mut x);
    let outcome = solver.last().unwrap();
    assert_eq!(outcome.ended, Ended::Converged);
    assert!(outcome.residual <= 1e-8);
    (x, outcome.iterations)
}

fn distance_from_direct(step: &Step, x: &[f64]) -> f64 {
    let mut cholesky = Cholesky::new(Arc::new(
        Symbolic::new(step.model.symbolic().pattern().clone()).unwrap(),
    ))
    .unwrap();
    cholesky.factorise(&step.values).unwrap();
    let mut exact = step.load.clone();
    cholesky.solve(&mut exact);
    let norm = |a: &mut dyn Iterator<Item = f64>| a.map(|a| a * a).sum::<f64>().sqrt();
    norm(&mut x.iter().zip(&exact).map(|(a, b)| a - b)) / norm(&mut exact.iter().copied())
}

#[test]
fn iterations_do_not_grow_with_the_mesh_and_the_answer_is_the_direct_one() {
    // Without coarse levels the counts double from each size to the next.
    for (contrast, most) in [(1.0, 14), (100.0, 24)] {
        let counts: Vec<usize> = [10, 16, 24]
            .map(|n| {
                let step = cube(n, contrast);
                let (x, iterations) = solved(&step);
                // A residual of 1e-8 bounds the error by 1e-8 times the condition number, here below 1e5; the smooth part,
                // most of the answer, is far better.
                assert!(distance_from_direct(&step, &x) < 1e-6);
                iterations
            })
            .to_vec();
        assert!(
            counts.iter().all(|&c| c <= most),
            "{counts:?} with contrast {contrast}"
        );
        println!("{counts:?} with contrast {contrast}");
        assert!(counts[2] <= counts[0] + 4, "{counts:?} with contrast {contrast}");
    }
}

#[test]
fn partly_filled_cells_and_levels_that_follow_a_surface_cost_no_more() {
    let counts = [(5.0, 5), (3.2, 8)].map(|(size, layers)| {
        let step = sole(size, layers, 100.0);
        let (x, iterations) = solved(&step);
        assert!(distance_from_direct(&step, &x) < 1e-6);
        iterations
    });
    println!("{counts:?}");
    assert!(counts.iter().all(|&c| c <= 30), "{counts:?}");
}

#[test]
fn tetrahedra_off_every_grid_line_are_solved_too() {
    let counts = [10, 16].map(|n| {
        let step = tetrahedra(n);
        let (x, iterations) = solved(&step);
        assert!(distance_from_direct(&step, &x) < 1e-6);
        iterations
    });
    assert!(counts.iter().all(|&c| c <= 40), "{counts:?}");
}

#[test]
fn the_bits_are_the_same_on_one_thread_and_on_three() {
    let step = cube(16, 100.0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| solved(&step))
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one.1, three.1);
    assert!(
        one.0
            .iter()
            .zip(&three.0)
            .all(|(a, b)| a.to_bits() == b.to_bits())
    );
}

#[test]
fn a_matrix_that_is_not_positive_definite_is_said() {
    let mut step = cube(10, 1.0);
    let mut solver = iterative(&step);
    solver.factorise(&step.values).unwrap();
    // Stiffness less a multiple of the identity: every site's own block stays positive, the softest modes do not.
    let pattern = step.model.symbolic().pattern();
    for column in 0..pattern.unknowns() {
        step.values[pattern.columns[column]] -= 0.1;
    }
    let refused = solver.factorise(&step.values).is_err();
    let mut x = step.load.clone();
    solver.solve(&mut x);
    assert!(refused || solver.last().unwrap().ended == Ended::Indefinite);
    assert!(x.iter().all(|x| x.is_nan()));
    step.values[7] = f64::NAN;
    assert!(matches!(
        solver.factorise(&step.values),
        Err(CholeskyError::NotPositiveDefinite { .. })
    ));
}
