//! Derivatives of displacements with respect to material parameters against solves with changed parameters.

use crate::clusters::tetrahedral_box;
use crate::support::{even_force, fixed_where, hardening_law};
use pliant::fem::elements::VolumetricStrain;
use pliant::fem::equilibrium::{Load, Options, Solver};
use pliant::fem::forces::Materials;
use pliant::fem::model::Model;
use pliant::geometry::volume::VolumeMesh;
use pliant::material::hyperelastic::{Form, Hyperelastic};
use pliant::material::law::Law;
use pliant::material::transverse::{TransverseModuli, TransverseRbf};
use pliant::math::Vec3;

struct Case {
    model: Model,
    load: Load,
    cells: Vec<u16>,
}

impl Case {
    /// A block of two layers, its base held, pressed and dragged on top; no axis of symmetry.
    fn new(mesh: VolumeMesh, volumetric: VolumetricStrain) -> Case {
        let held = fixed_where(&mesh, |x| [x.z < 1e-9; 3]);
        let load = even_force(&mesh, Vec3::new(0.5, 0.2, -2.0), |x| {
            x.z > 12.0 - 1e-9 && x.x > 5.0
        });
        let per = match mesh.elements.nodes_of(0).len() {
            8 => 8,
            _ => 1,
        };
        let cells = (0..mesh.elements.len())
            .flat_map(|e| {
                let nodes = mesh.elements.nodes_of(e);
                let middle: f64 =
                    nodes.iter().map(|&n| mesh.nodes[n as usize].z).sum::<f64>() / nodes.len() as f64;
                vec![u16::from(middle > 6.0); per]
            })
            .collect();
        Case {
            model: Model::with(mesh, None, held, volumetric, None).unwrap(),
            load,
            cells,
        }
    }

    fn solved<T>(&self, laws: &[&Law], then: impl Fn(&mut Solver, &[Vec3], &Materials) -> T) -> T {
        let materials = Materials {
            laws,
            cell_of_point: &self.cells,
        };
        let mut solver = Solver::new(&self.model).unwrap();
        solver.start(&materials).unwrap();
        let options = Options {
            tolerance: 1e-13,
            accelerated_iterations: 0,
            ..Options::default()
        };
        let curve = solver.curve(&materials, &self.load, &[1.0], &options, &|| false);
        let u = curve.levels.last().expect("the block stands this load");
        then(&mut solver, u, &materials)
    }
}

/// Direct derivatives and the adjoint gradient of a weighted sum of displacements, both against central differences; steps of
/// 1e-5 of a parameter leave about 1e-7 of the derivative.
fn check(case: &Case, law: &Law, other: &Law) {
    let weights: Vec<Vec3> = (0..case.load.forces.len())
        .map(|i| Vec3::new((0.7 * i as f64).sin(), 0.3, (1.3 * i as f64).cos()))
        .collect();
    let functional = |u: &[Vec3]| u.iter().zip(&weights).map(|(u, w)| u.dot(w)).sum::<f64>();
    let laws = [law, other];
    let (direct, adjoint) = case.solved(&laws, |solver, u, materials| {
        let direct = solver.displacement_derivatives(u, materials, 0).unwrap();
        let adjoint = solver.gradient(u, materials, &weights).unwrap();
        (direct, adjoint)
    });
    let parameters: Vec<f64> = law.parameters().iter().map(|p| p.value).collect();
    assert_eq!(direct.len(), parameters.len());
    let largest = direct.iter().map(|d| functional(d).abs()).fold(0.0, f64::max);
    assert!(largest > 1e-3);
    for (k, derivative) in direct.iter().enumerate() {
        let step = 1e-5 * parameters[k].abs().max(0.1);
        let at = |s: f64| {
            let mut changed = parameters.clone();
            changed[k] += s;
            let law = law.with_parameters(&changed).unwrap();
            case.solved(&[&law, other], |_, u, _| u.to_vec())
        };
        let (plus, minus) = (at(step), at(-step));
        let size = derivative
            .iter()
            .map(Vec3::norm)
            .fold(0.0, f64::max)
            .max(1e-3 * largest);
        for ((p, m), d) in plus.iter().zip(&minus).zip(derivative) {
            assert!(((p - m) / (2.0 * step) - d).norm() < 2e-5 * size, "parameter {k}");
        }
        let expected = functional(derivative);
        assert!(
            (adjoint[0][k] - expected).abs() < 1e-8 * largest,
            "parameter {k}: {} {expected}",
            adjoint[0][k]
        );
    }
}

#[test]
fn derivatives_agree_with_solves_of_changed_materials() {
    let size = Vec3::new(12.0, 10.0, 12.0);
    let hexahedra = || VolumeMesh::cuboid(size, [2, 2, 2], false);
    let tetrahedra = || tetrahedral_box(size, [2, 2, 2]);
    let secant = hardening_law(0.15, 0.45);
    let rubber = Form::NeoHookeanIsochoric {
        shear_mpa: 0.05,
        bulk_mpa: 0.8,
    };
    let rubber = Law::Hyperelastic(Hyperelastic::new(rubber).unwrap());
    let moduli = TransverseModuli::from_engineering(0.4, 0.1, 0.3, 0.35, 0.06).unwrap();
    let fibres = TransverseRbf::linear(&moduli)
        .unwrap()
        .rotated(&Vec3::new(1.0, 0.3, 0.5));
    let fibres = Law::TransverselyIsotropic(Box::new(fibres));
    check(
        &Case::new(hexahedra(), VolumetricStrain::Shared),
        &secant,
        &rubber,
    );
    check(
        &Case::new(tetrahedra(), VolumetricStrain::Shared),
        &rubber,
        &secant,
    );
    check(
        &Case::new(tetrahedra(), VolumetricStrain::Pointwise),
        &secant,
        &fibres,
    );
    check(
        &Case::new(hexahedra(), VolumetricStrain::Shared),
        &fibres,
        &secant,
    );
}
