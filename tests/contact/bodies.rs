//! Several bodies, bodies from a mesh, bodies under a force, and what is refused.

use crate::support::{ball, block, difference, level, model, simulate, soft, unloaded};
use pliant::fem::contact::{
    ContactCurve, ContactOptions, ContactSolver, Drive, Friction, Pose, RigidBody, Shape, Surface,
};
use pliant::fem::elements::VolumetricStrain;
use pliant::fem::equilibrium::{Load, Stop};
use pliant::fem::forces::Materials;
use pliant::fem::model::Model;
use pliant::geometry::Axis;
use pliant::geometry::grid::{Grid, Levels};
use pliant::geometry::shapes;
use pliant::geometry::solid::Solid;
use pliant::geometry::surface::TriMesh;
use pliant::geometry::volume::{Elements, KUHN, VolumeMesh};
use pliant::material::hyperelastic::{Form, Hyperelastic};
use pliant::material::law::Law;
use pliant::math::Vec3;

const SMOOTH: Friction = Friction::Frictionless;

/// The block under `bodies` at each of the given drives.
fn press(bodies: &[RigidBody], drives: Vec<Vec<Drive>>, options: &ContactOptions) -> ContactCurve {
    let model = block();
    let surface = Surface::of_mesh(&model.mesh);
    let levels: Vec<_> = drives.into_iter().map(level).collect();
    let (curve, reactions) = simulate(
        &model,
        &surface,
        bodies,
        &soft(),
        &unloaded(&model),
        &levels,
        options,
    );
    for (level, reaction) in curve.levels.iter().zip(&reactions) {
        // Contact and supports are in balance, to the tolerance of the residual with room for many points.
        let force: Vec3 = level.bodies.iter().map(|b| b.force_n).sum();
        let size: f64 = level.bodies.iter().map(|b| b.force_n.norm()).sum();
        assert!(
            (force + reaction).norm() <= 1e-6 * size + 1e-12,
            "{force} {reaction}"
        );
    }
    curve
}

fn arrived(bodies: &[RigidBody], drives: Vec<Vec<Drive>>) -> ContactCurve {
    let curve = press(bodies, drives, &ContactOptions::default());
    assert_eq!(curve.stop, Stop::Converged, "{:?}", curve.work);
    curve
}

#[test]
fn pressed_by_force_is_pressed_by_travel() {
    let ball = [ball(6.0, 8.0, 8.0, SMOOTH)];
    let by_travel = arrived(&ball, vec![vec![Drive::travel(2.0)]]);
    let force = -by_travel.levels[0].bodies[0].force_n.z;
    let by_force = arrived(&ball, vec![vec![Drive::force(force)]]);
    assert!((by_force.levels[0].bodies[0].travel_mm - 2.0).abs() < 2e-6);
    let off = difference(
        &by_travel.levels[0].displacements,
        &by_force.levels[0].displacements,
    );
    assert!(off < 1e-6, "{off}");
    // From a distance, and let go again.
    let far = [RigidBody {
        pose: Pose::at(Vec3::new(8.0, 8.0, 30.0)).unwrap(),
        ..ball[0].clone()
    }];
    let curve = arrived(&far, vec![vec![Drive::force(force)], vec![Drive::travel(0.0)]]);
    assert!((curve.levels[0].bodies[0].travel_mm - 18.0).abs() < 2e-6);
    assert!(curve.levels[1].displacements.iter().all(|u| u.norm() < 1e-6));
}

#[test]
fn the_answer_does_not_depend_on_the_steps() {
    let ball = [ball(6.0, 7.3, 8.4, SMOOTH)];
    let one = arrived(&ball, vec![vec![Drive::travel(2.0)]]);
    let five = arrived(
        &ball,
        (1..=5).map(|k| vec![Drive::travel(0.4 * f64::from(k))]).collect(),
    );
    let off = difference(&one.levels[0].displacements, &five.levels[4].displacements);
    assert!(off < 1e-6, "{off}");
    let stiffer = ContactOptions {
        penalty: 200.0,
        ..ContactOptions::default()
    };
    let other = press(&ball, vec![vec![Drive::travel(2.0)]], &stiffer);
    let off = difference(&one.levels[0].displacements, &other.levels[0].displacements);
    assert!(off < 1e-6, "{off}");
    assert!(one.levels[0].bodies[0].penetration_mm < 1e-5);
}

/// Bits: the same simulation twice.
#[test]
fn results_repeat() {
    let ball = [ball(6.0, 7.3, 8.4, Friction::Coulomb { coefficient: 0.3 })];
    let run = || arrived(&ball, vec![vec![Drive::force(0.3)]]);
    assert_eq!(run().levels, run().levels);
}

#[test]
fn two_probes_press_alike_where_they_stand_alike() {
    let bodies = [ball(3.0, 4.0, 8.0, SMOOTH), ball(3.0, 12.0, 8.0, SMOOTH)];
    let curve = arrived(&bodies, vec![vec![Drive::travel(1.0), Drive::travel(1.0)]]);
    let forces = [0, 1].map(|b| curve.levels[0].bodies[b].force_n);
    // Mirror images.
    assert!(
        (forces[0].z - forces[1].z).abs() < 1e-6 * forces[0].z.abs(),
        "{forces:?}"
    );
    assert!(
        (forces[0].x + forces[1].x).abs() < 1e-6 * forces[0].z.abs(),
        "{forces:?}"
    );
    // One by travel, the other by the force that goes with it.
    let mixed = arrived(
        &bodies,
        vec![vec![Drive::travel(1.0), Drive::force(-forces[1].z)]],
    );
    assert!((mixed.levels[0].bodies[1].travel_mm - 1.0).abs() < 1e-5);
    // A single one meets less resistance than one beside another.
    let alone = arrived(&bodies[..1], vec![vec![Drive::travel(1.0)]]);
    assert!(alone.levels[0].bodies[0].force_n.z.abs() > forces[0].z.abs());
}

/// An icosahedron, its triangles cut into four `times`, on a sphere about `centre`.
fn round(radius: f64, centre: Vec3, times: usize) -> TriMesh {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let vertices = [[0.0, 1.0, g], [0.0, 1.0, -g], [0.0, -1.0, g], [0.0, -1.0, -g]]
        .iter()
        .flat_map(|&[a, b, c]| [Vec3::new(a, b, c), Vec3::new(b, c, a), Vec3::new(c, a, b)])
        .map(|v| v.normalize())
        .collect::<Vec<_>>();
    // Its edges are 1.05 long; three vertices that near one another are a face.
    let near = |a: usize, b: usize| (vertices[a] - vertices[b]).norm() < 1.1;
    let mut faces: Vec<[Vec3; 3]> = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let [p, q, r] = [a, b, c].map(|k| vertices[k]);
                    let is_outward = (q - p).cross(&(r - p)).dot(&p) > 0.0;
                    faces.push(if is_outward { [p, q, r] } else { [p, r, q] });
                }
            }
        }
    }
    for _ in 0..times {
        let cut = |[p, q, r]: &[Vec3; 3]| {
            let [a, b, c] = [(p + q).normalize(), (q + r).normalize(), (r + p).normalize()];
            [[*p, a, c], [a, *q, b], [c, b, *r], [a, b, c]]
        };
        faces = faces.iter().flat_map(cut).collect();
    }
    let triangles = (0..faces.len() as u32)
        .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
        .collect();
    TriMesh {
        vertices: faces.iter().flatten().map(|v| centre + v * radius).collect(),
        triangles,
    }
}

#[test]
fn a_sphere_from_a_mesh_is_a_sphere() {
    let centre = Vec3::new(7.3, 8.4, 14.0);
    let solid = Solid::new(round(6.0, centre, 4)).unwrap();
    let meshed = RigidBody::of_solid(&solid, None, Vec3::zeros(), -Vec3::z(), SMOOTH).unwrap();
    // Facets with edges of up to 0.5 mm cut r²/2R = 0.29²/12 mm off the sphere; the field rounds less than that.
    for k in 0..50 {
        let t = f64::from(k);
        let x =
            centre + Vec3::new(t.sin(), (1.7 * t).cos(), (0.6 * t).sin()).normalize() * (6.0 + 0.3 * t.cos());
        let off = meshed.distance(&Vec3::zeros(), &x).value - ((x - centre).norm() - 6.0);
        assert!((-1e-3..7e-3).contains(&off), "{off}");
    }
    let drives = vec![vec![Drive::travel(1.5)]];
    let exact = arrived(&[ball(6.0, 7.3, 8.4, SMOOTH)], drives.clone());
    let found = arrived(&[meshed], drives);
    let [f, g] = [&exact, &found].map(|c| c.levels[0].bodies[0].force_n.z);
    // 3e-3 mm of 1.5 mm, to the power 1.5.
    assert!((f / g - 1.0).abs() < 0.006, "{f} {g}");
}

#[test]
fn cylinders_boxes_and_discs_press() {
    let pose = |axis: Vec3, height: f64| Pose::new(Vec3::new(8.1, 7.8, 8.0 + height), axis).unwrap();
    let bodies = [
        (
            Shape::Cylinder {
                radius_mm: 3.0,
                length_mm: 9.0,
                edge_mm: 0.5,
            },
            pose(Vec3::x(), 3.0),
        ),
        (
            Shape::Cylinder {
                radius_mm: 3.0,
                length_mm: 9.0,
                edge_mm: 0.5,
            },
            pose(Vec3::z(), 4.5),
        ),
        (
            Shape::Cuboid {
                size_mm: Vec3::new(6.0, 5.0, 4.0),
                edge_mm: 0.5,
            },
            pose(Vec3::z(), 2.0),
        ),
        (
            Shape::Disc {
                radius_mm: 3.0,
                edge_mm: 0.5,
            },
            pose(-Vec3::z(), 0.0),
        ),
    ];
    let mut forces = Vec::new();
    for (shape, pose) in bodies {
        let body = RigidBody::probe(shape, pose, -Vec3::z(), SMOOTH).unwrap();
        let curve = arrived(&[body], vec![vec![Drive::travel(0.5)], vec![Drive::travel(1.0)]]);
        let found = &curve.levels[1].bodies[0];
        // Force by pressures is force by points.
        let normal = found.mean_pressure_mpa() * found.area_mm2;
        assert!(
            normal >= -found.force_n.z * (1.0 - 1e-9),
            "{normal} {}",
            found.force_n
        );
        assert!(found.points.iter().all(|p| p.pressure_mpa >= 0.0));
        forces.push(-found.force_n.z);
    }
    // A standing cylinder is a disc.
    assert!((forces[1] / forces[3] - 1.0).abs() < 1e-6, "{forces:?}");
}

/// Tissue on a skull: the lower face of a cap lies on a sphere of 30 mm and slides there, pushed and pulled.
#[test]
fn tissue_slides_on_a_skull_and_stays_on_it() {
    const RADIUS: f64 = 30.0;
    let skull = Vec3::new(0.0, 0.0, -RADIUS);
    let mut mesh = VolumeMesh::cuboid(Vec3::new(16.0, 12.0, 4.0), [8, 6, 2], false);
    for x in &mut mesh.nodes {
        let (a, b) = (x.x - 8.0, x.y - 6.0);
        let down = (RADIUS * RADIUS - a * a - b * b).sqrt() - RADIUS;
        *x = Vec3::new(a, b, x.z + down);
    }
    let on = |x: &Vec3| ((x - skull).norm() - RADIUS).abs() < 1e-9;
    let model: Model = model(mesh, |x| [x.x == -8.0 && !on(x); 3]);
    let nodes = &model.mesh.nodes;
    let surface = Surface::of_mesh(&model.mesh).only(nodes, |x, _| on(x));
    let held = (0..surface.points.len() as u32).collect();
    let bone = RigidBody::probe(
        Shape::Sphere { radius_mm: RADIUS },
        Pose::at(skull).unwrap(),
        Vec3::z(),
        SMOOTH,
    )
    .unwrap()
    .holding(held);
    // Pulled aside and off at the free end.
    let pull = |x: &Vec3| {
        if x.x == 8.0 {
            Vec3::new(0.02, 0.0, 0.02)
        } else {
            Vec3::zeros()
        }
    };
    let load = Load {
        forces: nodes.iter().map(pull).collect(),
        prescribed: None,
    };
    let levels = [level(vec![Drive::HELD])];
    let options = ContactOptions::default();
    let (curve, _) = simulate(&model, &surface, &[bone], &soft(), &load, &levels, &options);
    assert_eq!(curve.stop, Stop::Converged, "{:?}", curve.work);
    let u = &curve.levels[0].displacements;
    let mut slip = 0.0_f64;
    for point in &surface.points {
        let (rest, now) = (point.rest(nodes), point.place(nodes, u));
        // A millionth of a square of 2 mm.
        assert!(((now - skull).norm() - RADIUS).abs() < 3e-6);
        slip = slip.max((now - rest).norm());
    }
    assert!(slip > 0.3, "{slip}");
    // The bone holds the tissue down.
    assert!(
        curve.levels[0].bodies[0]
            .points
            .iter()
            .any(|p| p.force_n.dot(&(p.place - skull)) < 0.0)
    );
}

/// An object that stands on a frictionless floor by its weight alone: the floor carries it.
#[test]
fn a_floor_carries_the_weight() {
    let mesh = VolumeMesh::cuboid(Vec3::new(8.0, 8.0, 4.0), [4, 4, 2], false);
    let model = model(mesh, |x| [x.x == 4.0, x.y == 4.0, false]);
    let surface = Surface::of_mesh(&model.mesh).only(&model.mesh.nodes, |x, _| x.z == 0.0);
    let floor = RigidBody::floor(Vec3::zeros(), Vec3::z(), SMOOTH).unwrap();
    let each = Vec3::new(0.0, 0.0, -0.002);
    let load = Load {
        forces: vec![each; model.mesh.nodes.len()],
        prescribed: None,
    };
    let levels = [level(vec![Drive::HELD])];
    let options = ContactOptions::default();
    let (curve, _) = simulate(&model, &surface, &[floor], &soft(), &load, &levels, &options);
    assert_eq!(curve.stop, Stop::Converged, "{:?}", curve.work);
    let weight = 0.002 * model.mesh.nodes.len() as f64;
    assert!((curve.levels[0].bodies[0].force_n.z - weight).abs() < 1e-6 * weight);
}

/// Points on the true surface in a grid that follows it along the face, or reaches half an element beyond it, against
/// nodes on the surface. The two kinds of points converge from both sides: 1.15, 1.26, 1.28 N for nodes and 1.44, 1.32,
/// 1.32 N embedded at 2, 1 and 0.8 mm.
#[test]
fn embedded_points_press_like_nodes() {
    let solid = Solid::new(shapes::block(Vec3::new(16.0, 16.0, 8.0), 4.0).unwrap()).unwrap();
    let bodies = [ball(6.0, 8.0, 8.0, SMOOTH)];
    let run = |model: &Model, surface: &Surface| {
        let levels = [level(vec![Drive::travel(2.0)])];
        let options = ContactOptions::default();
        let (curve, _) = simulate(
            model,
            surface,
            &bodies,
            &soft(),
            &unloaded(model),
            &levels,
            &options,
        );
        assert_eq!(curve.stop, Stop::Converged, "{:?}", curve.work);
        -curve.levels[0].bodies[0].force_n.z
    };
    let bottom = |x: &Vec3| [x.z == 0.0; 3];
    let mesh = VolumeMesh::cuboid(Vec3::new(16.0, 16.0, 8.0), [16, 16, 8], false);
    let nodes = model(mesh, bottom);
    let exact = run(&nodes, &Surface::of_mesh(&nodes.mesh));
    for beyond in [0.0, 0.5] {
        let height = |k: i32| f64::from(k) + if k == 8 { beyond } else { 0.0 };
        let levels = Levels::Flat((0..=8).map(height).collect());
        let grid = Grid::new(&solid, Axis::Z, 1.0, levels, [&[], &[]]).unwrap();
        let held = grid.mesh.nodes.iter().map(bottom).collect();
        let filled = Model::new(grid.mesh.clone(), Some(grid.fill.clone()), held).unwrap();
        let found = run(&filled, &Surface::embedded(&solid, &grid));
        assert!((found / exact - 1.0).abs() < 0.07, "{beyond}: {found} {exact}");
    }
}

/// Nothing but a floor, a ball and friction holds this block; anchors keep it from drifting while nothing touches.
#[test]
fn an_object_lies_on_a_floor_and_is_pressed() {
    let mesh = VolumeMesh::cuboid(Vec3::new(12.0, 12.0, 6.0), [6, 6, 3], false);
    let free = vec![[false; 3]; mesh.nodes.len()];
    let model = Model::unheld(mesh, None, free, VolumetricStrain::Shared, None).unwrap();
    let surface = Surface::of_mesh(&model.mesh);
    let each = Vec3::new(0.0, 0.0, -0.0005);
    let load = Load {
        forces: vec![each; model.mesh.nodes.len()],
        prescribed: None,
    };
    let weight = 0.0005 * model.mesh.nodes.len() as f64;
    for friction in [SMOOTH, Friction::Sticking, Friction::Coulomb { coefficient: 0.5 }] {
        let bodies = [
            RigidBody {
                pose: Pose::at(Vec3::new(6.5, 5.7, 13.0)).unwrap(),
                ..ball(5.0, 0.0, 0.0, SMOOTH)
            },
            RigidBody::floor(Vec3::zeros(), Vec3::z(), friction).unwrap(),
        ];
        let levels = [
            level(vec![Drive::HELD, Drive::HELD]),
            level(vec![Drive::force(0.2), Drive::HELD]),
        ];
        let options = ContactOptions {
            anchor: 1e-6,
            ..ContactOptions::default()
        };
        let (curve, _) = simulate(&model, &surface, &bodies, &soft(), &load, &levels, &options);
        assert_eq!(curve.stop, Stop::Converged, "{friction:?} {:?}", curve.work);
        let floor = curve.levels[1].bodies[1].force_n;
        // Anchors take a millionth of the object's stiffness times its motion.
        assert!((floor.z - weight - 0.2).abs() < 1e-4, "{friction:?}: {floor}");
        assert!((curve.levels[1].bodies[0].force_n.z + 0.2).abs() < 1e-6);
    }
}

/// Tetrahedra in patches, and a rubber with an energy: the same contact, the same balance.
#[test]
fn tetrahedra_and_rubber_are_pressed() {
    let cells = VolumeMesh::cuboid(Vec3::new(12.0, 12.0, 6.0), [6, 6, 3], false);
    let Elements::Hexahedra(hexahedra) = &cells.elements else {
        unreachable!()
    };
    let cut = |c: &[u32; 8]| KUHN.map(|t| t.map(|i| c[i]));
    let mesh = VolumeMesh {
        elements: Elements::Tetrahedra(hexahedra.iter().flat_map(cut).collect()),
        nodes: cells.nodes.clone(),
    };
    let held: Vec<_> = mesh.nodes.iter().map(|x| [x.z == 0.0; 3]).collect();
    let tetrahedra = Model::with(mesh, None, held.clone(), VolumetricStrain::Shared, None).unwrap();
    let hexahedra = Model::new(cells, None, held).unwrap();
    let form = Form::NeoHookeanLogarithmic {
        shear_mpa: 0.03,
        lame_lambda_mpa: 0.05,
    };
    let rubber = Law::Hyperelastic(Hyperelastic::new(form).unwrap());
    let body = RigidBody {
        pose: Pose::at(Vec3::new(6.0, 6.0, 10.0)).unwrap(),
        ..ball(4.0, 0.0, 0.0, Friction::Coulomb { coefficient: 0.3 })
    };
    let force = |model: &Model| {
        let surface = Surface::of_mesh(&model.mesh);
        let levels = [level(vec![Drive::travel(0.6)]), level(vec![Drive::travel(1.2)])];
        let options = ContactOptions::default();
        let bodies = std::slice::from_ref(&body);
        let (curve, reactions) = simulate(
            model,
            &surface,
            bodies,
            &rubber,
            &unloaded(model),
            &levels,
            &options,
        );
        assert_eq!(curve.stop, Stop::Converged, "{:?}", curve.work);
        let force = curve.levels[1].bodies[0].force_n;
        assert!(
            (force + reactions[1]).norm() < 1e-6 * force.norm(),
            "{force} {}",
            reactions[1]
        );
        -force.z
    };
    let (f, g) = (force(&tetrahedra), force(&hexahedra));
    // Three elements across the height, a contact of two: the elements differ by that much.
    assert!((f / g - 1.0).abs() < 0.15, "{f} {g}");
}

/// A ball driven through the block: the answer says how far it came and why not farther.
#[test]
fn too_deep_is_an_answer() {
    let options = ContactOptions {
        newton_iterations: 25,
        halvings: 3,
        ..ContactOptions::default()
    };
    let curve = press(
        &[ball(2.0, 8.0, 8.0, SMOOTH)],
        vec![vec![Drive::travel(12.0)]],
        &options,
    );
    assert!(
        matches!(curve.stop, Stop::Inverted { .. } | Stop::NotConverged),
        "{:?}",
        curve.stop
    );
    assert!(curve.reached < 1.0 && curve.levels.is_empty());
    // A probe that passes the object by finds no resistance to its force.
    let beside = RigidBody {
        pose: Pose::at(Vec3::new(100.0, 8.0, 10.0)).unwrap(),
        ..ball(2.0, 8.0, 8.0, SMOOTH)
    };
    let curve = press(&[beside], vec![vec![Drive::force(0.1)]], &options);
    assert_eq!(curve.stop, Stop::NotConverged);
}

#[test]
fn nonsense_is_refused() {
    let at = |x: f64| Pose::at(Vec3::new(x, 0.0, 0.0));
    assert!(at(f64::NAN).is_err());
    let sphere = |radius_mm: f64, push: Vec3, friction: Friction| {
        RigidBody::probe(Shape::Sphere { radius_mm }, at(0.0).unwrap(), push, friction)
    };
    assert!(sphere(0.0, Vec3::z(), SMOOTH).is_err());
    assert!(sphere(f64::NAN, Vec3::z(), SMOOTH).is_err());
    assert!(sphere(1.0, Vec3::zeros(), SMOOTH).is_err());
    let coefficient = f64::NAN;
    assert!(sphere(1.0, Vec3::z(), Friction::Coulomb { coefficient }).is_err());
    let model = block();
    let surface = Surface::of_mesh(&model.mesh);
    let outside = [ball(2.0, 8.0, 8.0, SMOOTH).holding(vec![1_000_000])];
    assert!(ContactSolver::new(&model, &surface, &outside).is_err());
    let bodies = [ball(2.0, 8.0, 8.0, SMOOTH)];
    let mut solver = ContactSolver::new(&model, &surface, &bodies).unwrap();
    let (law, cells) = (soft(), vec![0u16; model.parts.points()]);
    let materials = Materials {
        laws: &[&law],
        cell_of_point: &cells,
    };
    let load = unloaded(&model);
    let mut refused = |drives: Vec<Drive>, options: ContactOptions| {
        let found = solver.curve(&materials, &load, &[level(drives)], &options, &|| false);
        found.unwrap_err().to_string()
    };
    let options = ContactOptions::default();
    assert!(refused(vec![], options).contains("moves 0 rigid bodies, but there are 1"));
    assert!(refused(vec![Drive::force(-1.0)], options).contains("-1 N"));
    assert!(refused(vec![Drive::travel(f64::NAN)], options).contains("NaN"));
    let bad = ContactOptions {
        penetration: 0.0,
        ..options
    };
    assert!(refused(vec![Drive::travel(1.0)], bad).contains("penetration"));
}
