//! Derivatives of displacements with respect to material parameters against solves with changed parameters.

use crate::clusters::tetrahedral_box;
use crate::support::{even_force, fixed_where, hardening_law};
use pliant::fem::elements::VolumetricStrain;
use pliant::fem::equilibrium::{Load, Options, Solver, Stop};
use pliant::fem::example::Sensor;
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

/// Readings by parameters and by loads, along both ways that the solver may choose, against whole fields and against solves
/// with changed loads.
#[test]
fn readings_agree_with_fields_and_changed_loads() {
    let size = Vec3::new(12.0, 10.0, 12.0);
    let case = Case::new(
        VolumeMesh::cuboid(size, [2, 2, 2], false),
        VolumetricStrain::Shared,
    );
    let (law, other) = (hardening_law(0.15, 0.45), hardening_law(0.3, 0.4));
    let sideways = even_force(&case.model.mesh, Vec3::new(0.0, 1.0, 0.0), |x| {
        x.z > 12.0 - 1e-9 && x.x > 5.0
    });
    let sensor = |k: usize| {
        let node = case.model.mesh.nodes.len() - 1 - k;
        let weights = vec![(node, 0.6), (node - 3, 0.4)];
        (Sensor { weights }, vec![Vec3::x(), Vec3::y(), Vec3::z()])
    };
    let many: Vec<_> = (0..6).map(sensor).collect();
    let changed = |case: &Case, by: f64| {
        let forces = case.load.forces.iter().zip(&sideways.forces);
        let load = Load {
            forces: forces.map(|(f, s)| f + s * by).collect(),
            prescribed: None,
        };
        let case = Case {
            model: case.model.clone(),
            load,
            cells: case.cells.clone(),
        };
        case.solved(&[&law, &other], |_, u, _| u.to_vec())
    };
    let step = 1e-5;
    let (plus, minus) = (changed(&case, step), changed(&case, -step));
    case.solved(&[&law, &other], |solver, u, materials| {
        let fields = solver.displacement_derivatives(u, materials, 0).unwrap();
        let count = fields.len();
        assert!(many.len() * 3 > count + 1 && count + 1 > 3);
        for sensors in [&many[..], &many[..1]] {
            let found = solver
                .reading_derivatives(
                    u,
                    materials,
                    0,
                    &Law::stress_by_parameters,
                    &[&sideways.forces],
                    sensors,
                )
                .unwrap();
            assert_eq!(found.shape(), (3 * sensors.len(), count + 1));
            let size = found.amax();
            for (row, value) in found.row_iter().enumerate() {
                let (sensor, c) = (&sensors[row / 3].0, row % 3);
                for (field, value) in fields.iter().zip(value.iter()) {
                    assert!((sensor.read(field)[c] - value).abs() < 1e-5 * size);
                }
                let quotient = (sensor.read(&plus) - sensor.read(&minus))[c] / (2.0 * step);
                assert!(quotient.abs() > 1e-6 && (quotient - value[count]).abs() < 1e-5 * size);
            }
        }
    });
}

/// A route through loads that are not in proportion ends where each load alone leads, and in proportion it is the curve.
#[test]
fn a_route_of_loads_meets_the_equilibria_of_each() {
    let size = Vec3::new(12.0, 10.0, 12.0);
    let case = Case::new(
        VolumeMesh::cuboid(size, [2, 2, 2], false),
        VolumetricStrain::Shared,
    );
    let law = hardening_law(0.15, 0.45);
    let materials = Materials {
        laws: &[&law, &law],
        cell_of_point: &case.cells,
    };
    let options = Options {
        tolerance: 1e-12,
        ..Options::default()
    };
    let mut solver = Solver::new(&case.model).unwrap();
    solver.start(&materials).unwrap();
    let straight: Vec<Vec<Vec3>> = [0.3, 1.0]
        .iter()
        .map(|t| case.load.forces.iter().map(|f| f * *t).collect())
        .collect();
    let route = solver.route(&materials, &straight, &options, &|| false);
    let curve = solver.curve(&materials, &case.load, &[0.3, 1.0], &options, &|| false);
    assert_eq!((route.stop, route.reached), (Stop::Converged, 2.0));
    let bent = [straight[0].clone(), {
        let turned = straight[1].iter().map(|f| Vec3::new(f.y, f.x, 0.8 * f.z));
        turned.collect()
    }];
    let found = solver.route(&materials, &bent, &options, &|| false);
    let alone = solver.route(&materials, &bent[1..], &options, &|| false);
    let gap = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    for (a, b) in route.levels.iter().zip(&curve.levels) {
        assert!(gap(a, b) < 1e-10);
    }
    assert!(gap(&found.levels[1], &alone.levels[0]) < 1e-9);
    assert!(gap(&found.levels[1], &curve.levels[1]) > 0.1);
}
