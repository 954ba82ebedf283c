//! A block of one material, its supports and its solve.

use pliant::fem::equilibrium::{Curve, Load, Options, Solver};
use pliant::fem::forces::Materials;
use pliant::fem::model::{Constrained, Model};
use pliant::geometry::volume::VolumeMesh;
use pliant::material::isotropic::IsotropicRbf;
use pliant::material::law::{Law, Range};
use pliant::math::Vec3;

/// A foam-like law that stiffens with strain, isotropic, six centres on a path of compression and tension.
pub fn hardening_law(young_mpa: f64, poisson: f64) -> Law {
    let path = [-0.5f64, -0.3, -0.15, 0.0, 0.2, 0.5];
    let centres: Vec<[f64; 3]> = path
        .iter()
        .map(|e| {
            let lateral = -poisson * e;
            let strain = pliant::math::mandel::Mandel::new(lateral, lateral, *e, 0.0, 0.0, 0.0);
            pliant::material::isotropic::invariants(&strain)
        })
        .collect();
    let moduli: Vec<[f64; 2]> = path
        .iter()
        .map(|e| {
            let young = young_mpa * (1.0 + 4.0 * e * e);
            let (shear, bulk) = pliant::material::isotropic::shear_and_bulk(young, poisson).unwrap();
            [shear, bulk]
        })
        .collect();
    Law::Isotropic(IsotropicRbf::interpolating(&centres, &moduli, Range::UNBOUNDED).unwrap())
}

pub fn fixed_where(mesh: &VolumeMesh, held: impl Fn(&Vec3) -> Constrained) -> Vec<Constrained> {
    mesh.nodes.iter().map(held).collect()
}

/// Solves one load curve with one law everywhere.
pub fn solve(model: &Model, law: &Law, load: &Load, factors: &[f64], options: &Options) -> Curve {
    let cells = vec![0u16; model.parts.points()];
    let laws = [law];
    let materials = Materials {
        laws: &laws,
        cell_of_point: &cells,
    };
    let mut solver = Solver::new(model).unwrap();
    solver.start(&materials).unwrap();
    solver.curve(&materials, load, factors, options, &|| false)
}

/// Force `total` spread evenly over the nodes that `here` picks.
pub fn even_force(mesh: &VolumeMesh, total: Vec3, here: impl Fn(&Vec3) -> bool) -> Load {
    let count = mesh.nodes.iter().filter(|x| here(x)).count() as f64;
    let forces = mesh
        .nodes
        .iter()
        .map(|x| if here(x) { total / count } else { Vec3::zeros() })
        .collect();
    Load {
        forces,
        prescribed: None,
    }
}
