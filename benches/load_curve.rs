//! Load curves of the block: 50 × 50 × 25 mm in structured tetrahedra (six a cell, Kuhn), clamped below, pressed with
//! 15 N spread evenly over the top nodes within 8.5 mm of the middle, on one thread.
//!
//! `cargo bench --bench load_curve`: a strain-dependent material, five forces to 15 N, tolerance 1e-6. `-- --peer
//! --cells=7,8,5`: the ten steps at 1e-8 that `benches/peers/block.py` compares with other codes.

#[path = "support/mod.rs"]
mod support;

use pliant::fem::equilibrium::{Load, NewtonMatrix, Options, Solver, Stop};
use pliant::fem::forces::Materials;
use pliant::fem::model::Model;
use pliant::geometry::volume::{Elements, KUHN, VolumeMesh};
use pliant::material::hyperelastic::{Form, Hyperelastic};
use pliant::material::isotropic::{IsotropicRbf, invariants, shear_and_bulk};
use pliant::material::law::{Law, Range};
use pliant::math::Vec3;
use pliant::math::mandel::Mandel;
use support::{argument, median, processor_seconds};

const SIZE: Vec3 = Vec3::new(50.0, 50.0, 25.0);
const FORCE_N: f64 = 15.0;
const RADIUS_MM: f64 = 8.5;
const YOUNG_MPA: f64 = 0.15;
const POISSON: f64 = 0.4;

fn main() {
    let rounds = 5;
    if std::env::args().any(|a| a == "--peer") {
        let text = argument("cells").unwrap_or_else(|| "7,8,5".into());
        let counts: Vec<usize> = text.split(',').filter_map(|c| c.parse().ok()).collect();
        let counts = counts.try_into().expect("--cells= takes three counts");
        ten_steps(counts, rounds);
        return;
    }
    println!("tetrahedra | unknowns | iteration | ms a curve | displacement of the patch mm | work");
    for counts in [[7, 8, 5], [11, 12, 10]] {
        let (model, load, patch) = block(counts);
        let factors = [0.2, 0.4, 0.6, 0.8, 1.0];
        let options = Options {
            tolerance: 1e-6,
            ..Options::default()
        };
        let newton = |newton_matrix| Options {
            accelerated_iterations: 0,
            newton_matrix,
            ..options
        };
        let ways = [
            ("default", options),
            ("Newton, exact tangent", newton(NewtonMatrix::Tangent)),
            ("Newton, its symmetric part", newton(NewtonMatrix::SymmetricPart)),
        ];
        for (way, options) in ways {
            let law = strain_dependent();
            let (ms, down, work) = curve(&model, &load, &patch, &law, &factors, &options, rounds);
            println!(
                "{} | {} | {way} | {ms:.2} | {down:.6} | {work}",
                model.mesh.elements.len(),
                model.unknowns()
            );
        }
    }
}

fn ten_steps(counts: [usize; 3], rounds: usize) {
    let (model, load, patch) = block(counts);
    let law = neo_hookean();
    let factors: Vec<f64> = (1..=10).map(|k| f64::from(k) / 10.0).collect();
    let options = Options {
        tolerance: 1e-8,
        ..Options::default()
    };
    let (ms, down, work) = curve(&model, &load, &patch, &law, &factors, &options, rounds);
    println!("ten steps: {ms:.3} ms a curve, {down:.10} mm; {work}");
}

/// The law of the peers' comparison, μ/2 (J^(−2/3) I₁ − 3) + K/2 (J − 1)².
fn neo_hookean() -> Law {
    let (shear_mpa, bulk_mpa) = shear_and_bulk(YOUNG_MPA, POISSON).expect("valid moduli");
    let law = Hyperelastic::new(Form::NeoHookeanIsochoric { shear_mpa, bulk_mpa });
    Law::Hyperelastic(law.expect("valid moduli"))
}

/// The block, its load, and the nodes that are pressed.
fn block(counts: [usize; 3]) -> (Model, Load, Vec<usize>) {
    let cells = VolumeMesh::cuboid(SIZE, counts, true);
    let Elements::KuhnCells(boxes) = &cells.elements else {
        unreachable!("a cuboid of Kuhn cells was asked for");
    };
    let tetrahedra = boxes
        .iter()
        .flat_map(|cell| KUHN.map(|tet| tet.map(|corner| cell[corner])))
        .collect();
    let mesh = VolumeMesh {
        nodes: cells.nodes,
        elements: Elements::Tetrahedra(tetrahedra),
    };
    let held = mesh.nodes.iter().map(|x| [x.z == 0.0; 3]).collect();
    let middle = Vec3::new(SIZE.x / 2.0, SIZE.y / 2.0, SIZE.z);
    let is_pressed = |x: &Vec3| x.z == SIZE.z && (x - middle).norm() <= RADIUS_MM + 1e-9;
    let patch: Vec<usize> = (0..mesh.nodes.len())
        .filter(|&i| is_pressed(&mesh.nodes[i]))
        .collect();
    let mut forces = vec![Vec3::zeros(); mesh.nodes.len()];
    for &i in &patch {
        forces[i].z = -FORCE_N / patch.len() as f64;
    }
    let model = Model::new(mesh, None, held).expect("the mesh is sound and held");
    let load = Load {
        forces,
        prescribed: None,
    };
    (model, load, patch)
}

/// A foam-like law that stiffens with strain, six centres on a path of compression and tension.
fn strain_dependent() -> Law {
    let path = [-0.5f64, -0.3, -0.15, 0.0, 0.2, 0.5];
    let centres = path.map(|e| invariants(&Mandel::new(-POISSON * e, -POISSON * e, e, 0.0, 0.0, 0.0)));
    let moduli = path.map(|e| {
        let (shear, bulk) = shear_and_bulk(YOUNG_MPA * (1.0 + 4.0 * e * e), POISSON).expect("valid moduli");
        [shear, bulk]
    });
    let law = IsotropicRbf::interpolating(&centres, &moduli, Range::UNBOUNDED);
    Law::Isotropic(law.expect("the centres are distinct"))
}

/// Curves timed together: the system counts processor time in ticks of some milliseconds.
const REPEATS: usize = 20;

/// Median processor milliseconds of a curve on a model that is ready, with the factor at rest; the mean displacement of the patch;
/// what it took.
fn curve(
    model: &Model,
    load: &Load,
    patch: &[usize],
    law: &Law,
    factors: &[f64],
    options: &Options,
    rounds: usize,
) -> (f64, f64, String) {
    let cells = vec![0u16; model.parts.points()];
    let materials = Materials {
        laws: &[law],
        cell_of_point: &cells,
    };
    let mut solver = Solver::new(model).expect("it fits");
    let mut last = None;
    let times = (0..rounds).map(|_| {
        processor_seconds(|| {
            for _ in 0..REPEATS {
                solver.start(&materials).expect("it is held");
                last = Some(solver.curve(&materials, load, factors, options, &|| false));
            }
        })
    });
    let ms = 1e3 * median(times.collect()) / REPEATS as f64;
    let found = last.expect("there was a round");
    assert_eq!(found.stop, Stop::Converged, "the curve did not arrive");
    let u = found.levels.last().expect("it arrived");
    let down = patch.iter().map(|&i| u[i].z).sum::<f64>() / patch.len() as f64;
    (ms, down, format!("{:?}", found.work))
}
