//! Sticking, sliding, Coulomb's law.

use crate::support::{ball, block, difference, level, model, model_of_block, simulate, soft, unloaded};
use pliant::fem::contact::law::Status;
use pliant::fem::contact::{
    ContactCurve, ContactOptions, Drive, Friction, Level, Pose, RigidBody, Shape, Surface,
};
use pliant::fem::equilibrium::{Load, Options, Solver, Stop};
use pliant::fem::forces::Materials;
use pliant::fem::model::Model;
use pliant::geometry::volume::VolumeMesh;
use pliant::material::law::Law;
use pliant::math::Vec3;

const COEFFICIENT: f64 = 0.3;

/// A block of 10 × 10 × 4 mm, held at its top, on a floor that touches it.
fn on_floor(press: Option<f64>, poisson: f64, levels: &[Level]) -> ContactCurve {
    let mesh = VolumeMesh::cuboid(Vec3::new(10.0, 10.0, 4.0), [5, 5, 2], false);
    let model = model(mesh, |x| [x.z == 4.0; 3]);
    let surface = Surface::of_mesh(&model.mesh).only(&model.mesh.nodes, |x, _| x.z == 0.0);
    let friction = Friction::Coulomb {
        coefficient: COEFFICIENT,
    };
    let floor = RigidBody::floor(Vec3::zeros(), Vec3::z(), friction).unwrap();
    let down = |x: &Vec3| Vec3::new(0.0, 0.0, if x.z == 4.0 { -press.unwrap_or(0.0) } else { 0.0 });
    let load = Load {
        prescribed: Some(model.mesh.nodes.iter().map(down).collect()),
        ..unloaded(&model)
    };
    let law = Law::linear_isotropic(0.1, poisson).unwrap();
    let options = ContactOptions::default();
    simulate(&model, &surface, &[floor], &law, &load, levels, &options).0
}

/// The top goes down by 0.4 mm, then the floor is dragged: first the block sticks and the force grows with the drag, in the
/// end it slides, and the tangential force is μ times the normal one.
#[test]
fn a_dragged_floor_sticks_and_then_slides() {
    let drag = |way: f64| level(vec![Drive::HELD.across(Vec3::x() * way)]);
    let levels = [drag(0.0), drag(0.05), drag(0.1), drag(1.5), drag(3.0)];
    // Without lateral strain nothing slides while it is pressed.
    let curve = on_floor(Some(0.4), 0.0, &levels);
    assert_eq!(curve.stop, Stop::Converged, "{:?}", curve.work);
    let forces: Vec<Vec3> = curve.levels.iter().map(|l| l.bodies[0].force_n).collect();
    // E A δ / h = 0.1 · 100 · 0.1 at rest's section; Biot stress is linear in this strain.
    assert!((forces[0].z - 1.0).abs() < 1e-6, "{}", forces[0]);
    assert!(forces[0].x.abs() < 1e-6);
    let states = |n: usize| curve.levels[n].bodies[0].points.iter().map(|p| p.status);
    assert!(states(1).all(|s| s == Status::Stuck));
    assert!((forces[2].x / forces[1].x - 2.0).abs() < 0.02, "{forces:?}");
    assert!(forces[2].x < COEFFICIENT * forces[2].z);
    for n in [3, 4] {
        assert!(states(n).all(|s| s == Status::Sliding));
        let ratio = forces[n].x / forces[n].z;
        assert!((ratio - COEFFICIENT).abs() < 1e-4, "{ratio}");
    }
}

/// The same with the floor pressed up by 1 N: the limit is known beforehand, and the floor's height follows.
#[test]
fn a_pressed_and_dragged_floor_slides_at_its_coefficient() {
    let at = |way: f64| level(vec![Drive::force(1.0).across(Vec3::x() * way)]);
    let curve = on_floor(None, 0.3, &[at(0.0), at(1.5), at(3.0)]);
    assert_eq!(curve.stop, Stop::Converged, "{:?}", curve.work);
    let last = &curve.levels[2].bodies[0];
    assert!((last.force_n.z - 1.0).abs() < 1e-6, "{}", last.force_n);
    // Directions of sliding that the bulging left behind have died away by a few parts in ten thousand.
    assert!((last.force_n.x - COEFFICIENT).abs() < 1e-3, "{}", last.force_n);
    assert!(last.travel_mm > 0.3 && last.travel_mm < 0.6, "{}", last.travel_mm);
}

/// Displacements of the block under prescribed ones alone, by the solve without contact.
fn prescribed(model: &Model, load: &Load) -> Vec<Vec3> {
    let (law, cells) = (soft(), vec![0u16; model.parts.points()]);
    let materials = Materials {
        laws: &[&law],
        cell_of_point: &cells,
    };
    let mut solver = Solver::new(model).unwrap();
    solver.start(&materials).unwrap();
    let mut curve = solver.curve(&materials, load, &[1.0], &Options::default(), &|| false);
    assert_eq!(curve.stop, Stop::Converged);
    curve.levels.remove(0)
}

/// A flat disc: points that stick to it stay where they touched, so the disc needs more force.
#[test]
fn sticking_is_stiffer_than_sliding() {
    let model = block();
    let surface = Surface::of_mesh(&model.mesh);
    let run = |friction: Friction| {
        let disc = RigidBody::probe(
            Shape::Disc {
                radius_mm: 5.0,
                edge_mm: 0.3,
            },
            Pose::new(Vec3::new(8.0, 8.0, 8.0), -Vec3::z()).unwrap(),
            -Vec3::z(),
            friction,
        )
        .unwrap();
        let levels = [level(vec![Drive::travel(0.8)])];
        let options = ContactOptions::default();
        let (curve, _) = simulate(
            &model,
            &surface,
            &[disc],
            &soft(),
            &unloaded(&model),
            &levels,
            &options,
        );
        assert_eq!(curve.stop, Stop::Converged, "{friction:?} {:?}", curve.work);
        curve.levels.into_iter().next().unwrap()
    };
    let free = run(Friction::Frictionless);
    let stuck = run(Friction::Sticking);
    let some = run(Friction::Coulomb { coefficient: 0.05 });
    let force = |l: &pliant::fem::contact::ContactLevel| -l.bodies[0].force_n.z;
    // All points of the flat part touch, so it may as well be held there and moved.
    let under = |x: &Vec3| x.z == 8.0 && (x.xy() - nalgebra::Vector2::new(8.0, 8.0)).norm() < 4.7;
    for (found, is_held) in [(&free, [false, false, true]), (&stuck, [true; 3])] {
        let held = model_of_block(|x| if under(x) { is_held } else { [x.z == 0.0; 3] });
        let down = |x: &Vec3| if under(x) { Vec3::z() * -0.8 } else { Vec3::zeros() };
        let load = Load {
            prescribed: Some(held.mesh.nodes.iter().map(down).collect()),
            ..unloaded(&held)
        };
        let expected = prescribed(&held, &load);
        let off = difference(&expected, &found.displacements);
        assert!(off < 1e-6, "{off}");
    }
    assert!(force(&some) > force(&free) && force(&stuck) > force(&some));
    let lateral = |l: &pliant::fem::contact::ContactLevel| {
        let points = l.bodies[0]
            .points
            .iter()
            .filter(|p| p.force_n.z < -1e-3 * force(l));
        points
            .map(|p| {
                let rest = surface.points[p.point as usize].rest(&model.mesh.nodes);
                (p.place - rest).xy().norm()
            })
            .fold(0.0, f64::max)
    };
    // A millionth of a 2 mm square is allowed to slip.
    assert!(lateral(&stuck) < 1e-5, "{}", lateral(&stuck));
    assert!(lateral(&free) > 1e-2, "{}", lateral(&free));
    assert!(free.bodies[0].points.iter().all(|p| p.status == Status::Smooth));
}

/// A ball pressed in and dragged across ends at μ times its normal force; curvature makes the directions unequal, and a
/// sloping contact adds a share of the normal force, so only roughly.
#[test]
fn a_dragged_ball_ploughs() {
    let model = block();
    let surface = Surface::of_mesh(&model.mesh);
    let run = |friction: Friction| {
        let levels = [
            level(vec![Drive::travel(0.6)]),
            level(vec![Drive::travel(0.6).across(Vec3::x() * 0.75)]),
            level(vec![Drive::travel(0.6).across(Vec3::x() * 1.5)]),
        ];
        let options = ContactOptions::default();
        let ball = ball(5.0, 7.0, 8.0, friction);
        let (curve, reactions) = simulate(
            &model,
            &surface,
            &[ball],
            &soft(),
            &unloaded(&model),
            &levels,
            &options,
        );
        assert_eq!(curve.stop, Stop::Converged, "{friction:?} {:?}", curve.work);
        let force = curve.levels[2].bodies[0].force_n;
        assert!(
            (force + reactions[2]).norm() < 1e-6 * force.norm(),
            "{force} {}",
            reactions[2]
        );
        -force.x / force.z
    };
    let (smooth, rough) = (
        run(Friction::Frictionless),
        run(Friction::Coulomb { coefficient: 0.2 }),
    );
    assert!((rough - smooth - 0.2).abs() < 0.06, "{smooth} {rough}");
}
