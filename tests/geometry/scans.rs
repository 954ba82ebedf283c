//! Real objects, clean and dirty, from the shared data; skipped where that is missing.

use approx::assert_relative_eq;
use pliant::geometry::files::open_surface;
use pliant::geometry::{Axis, Solid};
use pliant::math::Vec3;
use pliant::units::LengthUnit;
use std::path::{Path, PathBuf};

/// A file of the shared data, or a printed remark that its tests are skipped.
pub fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data")).join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is missing", path.display());
    None
}

const OBJECTS: [(&str, LengthUnit); 3] = [
    ("objects/gensole_Left-Insole.stl", LengthUnit::Millimetre),
    ("objects/stool_01.obj", LengthUnit::Metre),
    ("objects/sheepskin_boot.obj", LengthUnit::Metre),
];

fn solid(name: &str, unit: LengthUnit) -> Option<Solid> {
    Some(Solid::new(open_surface(&shared(name)?, Some(unit)).unwrap().mesh).unwrap())
}

#[test]
fn the_insole_survives_its_odd_face() {
    let (name, unit) = OBJECTS[0];
    let Some(solid) = solid(name, unit) else { return };
    // 3127 faces, so not every edge can have two: one is a line, and without it the insole is closed.
    assert_eq!((solid.health().triangles, solid.health().degenerate), (3127, 1));
    assert!(solid.health().is_closed());
    assert_eq!(solid.health().warnings().len(), 1);
    // The data's notes say 100 × 258 × 27 mm.
    assert_relative_eq!(solid.size(), Vec3::new(100.0, 258.0, 27.0), epsilon = 0.5);
    // Inside everywhere between its lowest and highest point along a line through the heel.
    let through = solid.intervals(Axis::Z, 0.0, 50.0);
    assert_eq!(through.len(), 1);
    assert!(
        (1.0..27.0).contains(&(through[0][1] - through[0][0])),
        "{through:?}"
    );
}

#[test]
fn the_stool_of_eight_parts_survives() {
    let (name, unit) = OBJECTS[1];
    let Some(solid) = solid(name, unit) else { return };
    // Eight parts and 0.67 m high by the data's notes.
    assert_eq!(solid.health().components, 8);
    assert_relative_eq!(solid.size().y, 670.0, epsilon = 1.0);
    assert!(solid.health().open_edges > 0);
    // The seat's middle, and between the legs.
    let (lo, hi) = solid.bounds();
    let middle = (lo + hi) / 2.0;
    let seat = solid.intervals(Axis::Y, middle.z, middle.x);
    assert!(!seat.is_empty());
    assert!(solid.contains(&Axis::Y.point((seat[0][0] + seat[0][1]) / 2.0, middle.z, middle.x)));
    assert!(!solid.contains(&Vec3::new(middle.x, lo.y + 60.0, middle.z)));
}

#[test]
fn a_boot_that_is_a_sheet_is_refused_with_its_open_edges() {
    let (name, unit) = OBJECTS[2];
    let Some(path) = shared(name) else { return };
    let error = Solid::new(open_surface(&path, Some(unit)).unwrap().mesh)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("136 open edges") && error.contains("fill holes"),
        "{error}"
    );
}

#[test]
fn watertight_objects_have_the_volume_of_the_divergence_theorem() {
    for (name, unit) in [
        ("objects/cushion_01.obj", LengthUnit::Metre),
        ("objects/dish_sponge.obj", LengthUnit::Metre),
        ("objects/foam_finger.obj", LengthUnit::Metre),
        ("meshes/armadillo_low_res.obj", LengthUnit::Metre),
        ("meshes/bunny_watertight_simplified.obj", LengthUnit::Millimetre),
        ("meshes/decimated-max.obj", LengthUnit::Millimetre),
    ] {
        let Some(solid) = solid(name, unit) else { continue };
        assert!(solid.health().is_closed(), "{name}");
        // Lines every millimetre or so, without asking for the volume, which would answer with the theorem itself.
        let (lo, hi) = solid.bounds();
        let count = 120;
        let step = solid.size() / f64::from(count);
        let mut sum = 0.0;
        for i in 0..count {
            for j in 0..count {
                let (a, b) = (
                    lo.x + step.x * (f64::from(i) + 0.5),
                    lo.y + step.y * (f64::from(j) + 0.5),
                );
                let parts = solid.intervals(Axis::Z, a, b);
                assert!(
                    parts.windows(2).all(|pair| pair[0][1] < pair[1][0]),
                    "{name} {parts:?}"
                );
                assert!(
                    parts
                        .iter()
                        .all(|[from, to]| lo.z - 1e-6 <= *from && from < to && *to <= hi.z + 1e-6)
                );
                sum += parts.iter().map(|[from, to]| to - from).sum::<f64>() * step.x * step.y;
            }
        }
        // 14 400 lines: the rim of the silhouette leaves some 0.2 %.
        assert_relative_eq!(sum, solid.mesh().signed_volume(), max_relative = 3e-3);
        assert_eq!(solid.volume(), solid.mesh().signed_volume(), "{name}");
    }
}

#[test]
fn inside_agrees_with_the_ray_parity_of_another_library() {
    let Some(solid) = solid("meshes/bunny_watertight_simplified.obj", LengthUnit::Millimetre) else {
        return;
    };
    use parry3d_f64::glamx::DVec3;
    use parry3d_f64::query::PointQuery;
    use parry3d_f64::shape::{TriMesh, TriMeshFlags};
    let vertices = solid
        .mesh()
        .vertices
        .iter()
        .map(|v| DVec3::new(v.x, v.y, v.z))
        .collect();
    let reference =
        TriMesh::with_flags(vertices, solid.mesh().triangles.clone(), TriMeshFlags::ORIENTED).unwrap();
    let (lo, _) = solid.bounds();
    for n in 0..4000 {
        let share = Vec3::new(
            f64::from(n % 20) + 0.37,
            f64::from(n / 20 % 20) + 0.41,
            f64::from(n / 400) * 2.0 + 0.43,
        );
        let point = lo + solid.size().component_mul(&(share / 20.0));
        let at = DVec3::new(point.x, point.y, point.z);
        assert_eq!(
            solid.contains(&point),
            reference.contains_local_point(at),
            "{point}"
        );
        let distance = reference.distance_to_local_point(at, false).abs();
        assert_relative_eq!(solid.closest(&point).distance, distance, epsilon = 1e-9);
    }
}
