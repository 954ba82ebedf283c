//! The generated objects: watertight, of the size asked for, of decent triangles, and equal to the files that ship.

use approx::assert_relative_eq;
use pliant::geometry::files::{SurfaceFormat, read_surface, write_stl};
use pliant::geometry::shapes::{SeatOptions, SoleOptions, block, flip_flop_sole, stool_seat};
use pliant::geometry::{Axis, Solid, TriMesh};
use pliant::math::Vec3;
use pliant::units::LengthUnit;
use std::path::Path;

fn shipped() -> [(&'static str, TriMesh); 3] {
    [
        (
            "flip-flop/sole.stl",
            flip_flop_sole(&SoleOptions::default()).unwrap(),
        ),
        ("stool/seat.stl", stool_seat(&SeatOptions::default()).unwrap()),
        (
            "block/block.stl",
            block(Vec3::new(50.0, 40.0, 25.0), 2.5).unwrap(),
        ),
    ]
}

/// Smallest angle of a triangle \[degrees\].
fn smallest_angle([a, b, c]: [Vec3; 3]) -> f64 {
    let angle = |p: Vec3, q: Vec3, r: Vec3| (q - p).angle(&(r - p)).to_degrees();
    angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b))
}

#[test]
fn shapes_are_watertight_and_well_shaped() {
    for (name, mesh) in shipped() {
        let count = mesh.triangles.len();
        assert!((2000..6500).contains(&count), "{name}: {count} triangles");
        let mut angles: Vec<f64> = (0..count).map(|t| smallest_angle(mesh.corners(t))).collect();
        angles.sort_by(f64::total_cmp);
        // Narrow ones are allowed where the rounded rims meet the walls.
        assert!(angles[0] > 8.0, "{name}: smallest angle {}", angles[0]);
        assert!(
            angles[count / 20] > 14.0,
            "{name}: one in twenty below {}",
            angles[count / 20]
        );
        let solid = Solid::new(mesh.clone()).unwrap();
        assert_eq!(solid.health().warnings(), Vec::<String>::new(), "{name}");
        assert_eq!(solid.health().components, 1, "{name}");
        assert_eq!(solid.mesh(), &mesh, "{name}: nothing to mend");
        assert!(mesh.signed_volume() > 0.0);
        // Nowhere does the surface pass through itself: along any line the signed crossings alternate.
        assert_relative_eq!(solid.volume(), mesh.signed_volume());
    }
}

#[test]
fn shapes_have_the_sizes_asked_for() {
    let options = SoleOptions {
        length: 230.0,
        ball_width: 88.0,
        heel_width: 60.0,
        ..SoleOptions::default()
    };
    let sole = Solid::new(flip_flop_sole(&options).unwrap()).unwrap();
    let (lo, hi) = sole.bounds();
    assert_relative_eq!(sole.size().x, 88.0, epsilon = 1e-9);
    assert_relative_eq!(lo.y, 0.0, epsilon = 1e-9);
    assert_relative_eq!(hi.y, 230.0, epsilon = 1e-9);
    assert_eq!(lo.z, 0.0);
    // Under the rim's radius of 3 mm the wall is straight: the widest places are those of the outline.
    let width = |range: std::ops::Range<f64>| {
        let spans = (0..400).map(|k| range.start + (range.end - range.start) * f64::from(k) / 400.0);
        let widths = spans
            .flat_map(|y| sole.intervals(Axis::X, y, 1.0))
            .map(|[from, to]| to - from);
        widths.fold(0.0, f64::max)
    };
    assert_relative_eq!(width(2.0..60.0), 60.0, epsilon = 1.0);
    // At the toes the thickness is that of the toes; at the heel the hollow takes away 1.5 mm.
    let thickness = |y: f64| {
        let parts = sole.intervals(Axis::Z, 0.0, y);
        assert_eq!(parts.len(), 1);
        parts[0][1] - parts[0][0]
    };
    assert_relative_eq!(thickness(215.0), 14.0, epsilon = 0.05);
    assert_relative_eq!(thickness(0.16 * 230.0), 20.5, epsilon = 0.1);

    let seat = Solid::new(stool_seat(&SeatOptions::default()).unwrap()).unwrap();
    assert_relative_eq!(seat.size().x, 340.0, epsilon = 1e-9);
    assert_relative_eq!(seat.size().y, 340.0, epsilon = 1e-9);
    let top = |x: f64| seat.intervals(Axis::Z, x, 0.0)[0][1];
    // The dimple of 6 mm in the dome of 60 mm; outside of it the dome, 10 (1 − (x/170)²) above 50 mm.
    assert_relative_eq!(top(0.0), 54.0, epsilon = 0.3);
    assert_relative_eq!(
        top(90.0),
        50.0 + 10.0 * (1.0 - (90.0_f64 / 170.0).powi(2)),
        epsilon = 0.1
    );
    let button = SeatOptions::default().button();
    assert!(button.contains(&Vec3::new(30.0, 30.0, 40.0)) && !button.contains(&Vec3::new(40.0, 30.0, 40.0)));
}

#[test]
fn a_sole_with_toe_spring_lifts_its_tip() {
    let options = SoleOptions {
        toe_spring: 12.0,
        ..SoleOptions::default()
    };
    let solid = Solid::new(flip_flop_sole(&options).unwrap()).unwrap();
    assert!(solid.health().is_closed());
    assert_relative_eq!(
        solid.closest(&Vec3::new(10.0, 260.0, 0.0)).distance,
        12.0,
        epsilon = 1.5
    );
    assert_eq!(solid.bounds().0.z, 0.0);
}

#[test]
fn extreme_options_make_closed_shapes_or_are_refused_by_name() {
    let sole = SoleOptions::default();
    for options in [
        SoleOptions {
            rim_radius: 0.0,
            ..sole.clone()
        },
        SoleOptions {
            rim_radius: 7.0,
            ..sole.clone()
        },
        SoleOptions {
            heel_width: 98.0,
            ..sole.clone()
        },
        SoleOptions {
            heel_width: 49.0,
            ball_width: 98.0,
            rim_radius: 4.0,
            ..sole.clone()
        },
        SoleOptions {
            spacing: 2.0,
            ..sole.clone()
        },
        SoleOptions {
            spacing: 17.0,
            ..sole.clone()
        },
    ] {
        let solid = Solid::new(flip_flop_sole(&options).unwrap()).unwrap();
        assert!(
            solid.health().warnings().is_empty(),
            "{options:?} {:?}",
            solid.health()
        );
        assert_relative_eq!(solid.volume(), solid.mesh().signed_volume());
    }
    for (options, name) in [
        (
            SoleOptions {
                length: f64::NAN,
                ..sole.clone()
            },
            "length = NaN",
        ),
        (
            SoleOptions {
                heel_width: 120.0,
                ..sole.clone()
            },
            "heel_width = 120",
        ),
        (
            SoleOptions {
                rim_radius: 9.0,
                ..sole.clone()
            },
            "rim_radius = 9",
        ),
    ] {
        let error = flip_flop_sole(&options).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains("expected"), "{error}");
    }
    let seat = SeatOptions::default();
    for options in [
        SeatOptions {
            rim_radius: 0.0,
            dome: 0.0,
            button_depth: 0.0,
            ..seat.clone()
        },
        SeatOptions {
            thickness: 20.0,
            dome: 2.0,
            rim_radius: 8.0,
            ..seat.clone()
        },
    ] {
        assert!(
            Solid::new(stool_seat(&options).unwrap())
                .unwrap()
                .health()
                .warnings()
                .is_empty(),
            "{options:?}"
        );
    }
    assert!(
        stool_seat(&SeatOptions {
            button_radius: 300.0,
            ..seat
        })
        .unwrap_err()
        .to_string()
        .contains("button_radius")
    );
    assert!(
        block(Vec3::new(50.0, 40.0, 0.0), 2.5)
            .unwrap_err()
            .to_string()
            .contains("height")
    );
}

#[test]
fn the_shipped_files_are_what_the_generators_make() {
    for (name, mesh) in shipped() {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/designs")).join(name);
        let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let file = read_surface(&bytes, SurfaceFormat::Stl, Some(LengthUnit::Millimetre))
            .unwrap()
            .mesh;
        let mut made = Vec::new();
        write_stl(&mesh, &mut made).unwrap();
        let made = read_surface(&made, SurfaceFormat::Stl, Some(LengthUnit::Millimetre))
            .unwrap()
            .mesh;
        assert_eq!(file.triangles, made.triangles, "{name}");
        for (ours, theirs) in file.vertices.iter().zip(&made.vertices) {
            // Another machine's sine may differ in the last bit, which single precision may round up.
            assert!((ours - theirs).norm() < 1e-4, "{name}: {ours} {theirs}");
        }
    }
}
