//! What the fast iteration solves must be what Newton solves, over many designs.

use crate::clusters::tetrahedral_box;
use crate::support::fixed_where;
use pliant::fem::equilibrium::{Load, Options, Solver, Stop};
use pliant::fem::forces::Materials;
use pliant::fem::model::Model;
use pliant::material::database::Database;
use pliant::material::law::Law;
use pliant::math::Vec3;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::path::Path;

/// 200 random designs of five layers out of the nine pressed silicones and foams of the database, five forces to 15 N:
/// where Newton from small steps reaches every level, so does the default, to the same place.
#[test]
fn slow_no_layered_design_fails_that_newton_solves() {
    let ids = [
        "ecoflex-00-10",
        "ecoflex-00-30",
        "ecoflex-00-50",
        "ecoflex-00-30-thinner-25",
        "dragon-skin-10",
        "dragon-skin-20",
        "sole-heel-foam",
        "sole-mid-foam",
        "leap-foam",
    ];
    let database = Database::open(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db"))).unwrap();
    let laws: Vec<Law> = ids
        .iter()
        .map(|id| database.find(id).unwrap().law().unwrap())
        .collect();
    let mesh = tetrahedral_box(Vec3::new(50.0, 50.0, 25.0), [7, 8, 5]);
    let held = fixed_where(&mesh, |x| [x.z < 1e-9; 3]);
    let patch = |x: &Vec3| x.z > 25.0 - 1e-9 && (x - Vec3::new(25.0, 25.0, 25.0)).norm() < 8.5;
    let count = mesh.nodes.iter().filter(|x| patch(x)).count() as f64;
    let force = |x: &Vec3| {
        if patch(x) {
            Vec3::new(0.0, 0.0, -15.0 / count)
        } else {
            Vec3::zeros()
        }
    };
    let load = Load {
        forces: mesh.nodes.iter().map(force).collect(),
        prescribed: None,
    };
    let layer_of = |e: usize| (e / (6 * 7 * 8)) as u16;
    let cells: Vec<u16> = (0..mesh.elements.len()).map(layer_of).collect();
    let model = Model::new(mesh, None, held).unwrap();
    let mut solver = Solver::new(&model).unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(20);
    let fast = Options {
        tolerance: 1e-6,
        ..Options::default()
    };
    let newton = Options {
        accelerated_iterations: 0,
        ..fast
    };
    let factors = [0.2, 0.4, 0.6, 0.8, 1.0];
    let (mut solved, mut helped, mut lost) = (0, 0, Vec::new());
    for design in 0..200 {
        let layers: Vec<usize> = (0..5).map(|_| random.gen_range(0..laws.len())).collect();
        let own: Vec<&Law> = layers.iter().map(|&l| &laws[l]).collect();
        let materials = Materials {
            laws: &own,
            cell_of_point: &cells,
        };
        solver.start(&materials).unwrap();
        let a = solver.curve(&materials, &load, &factors, &fast, &|| false);
        let b = solver.curve(&materials, &load, &factors, &newton, &|| false);
        helped += usize::from(a.work.newton_iterations > 0);
        if b.stop == Stop::Converged {
            solved += 1;
            if a.stop != Stop::Converged {
                lost.push((design, layers.clone(), a.stop));
                continue;
            }
        }
        for (u, v) in a.levels.iter().zip(&b.levels) {
            let size = v.iter().map(Vec3::amax).fold(0.0, f64::max);
            let off = u.iter().zip(v).map(|(u, v)| (u - v).amax()).fold(0.0, f64::max);
            // Both stop within 1e-6 of the same state, each on its own side.
            assert!(
                off < 1e-4 * size,
                "design {design} {layers:?}: {off} of {size} mm"
            );
        }
    }
    println!(
        "{solved} of 200 designs stand the load by Newton's iteration; {helped} needed it; lost: {lost:?}"
    );
    assert!(lost.is_empty(), "{lost:?}");
    assert!(solved > 100);
}
