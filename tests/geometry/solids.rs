//! Inside, outside and volume, on surfaces whose answers are known.

use approx::assert_relative_eq;
use pliant::geometry::shapes::block;
use pliant::geometry::solid::SolidError;
use pliant::geometry::{Axis, Solid, TriMesh};
use pliant::math::Vec3;
use std::f64::consts::PI;

/// A sphere of latitudes and longitudes, outward.
pub fn sphere(centre: Vec3, radius: f64, rings: u32) -> TriMesh {
    let around = 2 * rings;
    let mut vertices = vec![centre + Vec3::z() * radius, centre - Vec3::z() * radius];
    for r in 1..rings {
        let polar = PI * f64::from(r) / f64::from(rings);
        for k in 0..around {
            let angle = 2.0 * PI * f64::from(k) / f64::from(around);
            let direction = Vec3::new(polar.sin() * angle.cos(), polar.sin() * angle.sin(), polar.cos());
            vertices.push(centre + radius * direction);
        }
    }
    let at = |r: u32, k: u32| 2 + (r - 1) * around + k % around;
    let mut triangles = Vec::new();
    for k in 0..around {
        triangles.push([0, at(1, k), at(1, k + 1)]);
        triangles.push([1, at(rings - 1, k + 1), at(rings - 1, k)]);
        for r in 1..rings - 1 {
            triangles.push([at(r, k), at(r + 1, k), at(r + 1, k + 1)]);
            triangles.push([at(r, k), at(r + 1, k + 1), at(r, k + 1)]);
        }
    }
    TriMesh { vertices, triangles }
}

fn joined(parts: &[TriMesh]) -> TriMesh {
    let mut all = TriMesh::default();
    for part in parts {
        let base = all.vertices.len() as u32;
        all.vertices.extend(&part.vertices);
        all.triangles
            .extend(part.triangles.iter().map(|t| t.map(|v| v + base)));
    }
    all
}

fn inside_out(mesh: &TriMesh) -> TriMesh {
    TriMesh {
        vertices: mesh.vertices.clone(),
        triangles: mesh.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect(),
    }
}

fn cube(side: f64) -> TriMesh {
    block(Vec3::repeat(side), side / 8.0).unwrap()
}

#[test]
fn a_clean_block_is_clean() {
    let solid = Solid::new(block(Vec3::new(50.0, 40.0, 25.0), 2.5).unwrap()).unwrap();
    assert_eq!(solid.health().warnings(), Vec::<String>::new());
    assert!(solid.health().is_closed());
    assert_eq!(solid.health().components, 1);
    assert_relative_eq!(solid.volume(), 50.0 * 40.0 * 25.0, max_relative = 1e-12);
    assert_eq!(solid.bounds(), (Vec3::zeros(), Vec3::new(50.0, 40.0, 25.0)));
}

#[test]
fn a_sphere_has_its_volume_and_its_inside() {
    let centre = Vec3::new(100.0, -50.0, 30.0);
    let solid = Solid::new(sphere(centre, 20.0, 40)).unwrap();
    // The inscribed polyhedron lacks about (π²/2)/rings² · ½ of the ball: 0.5 % at 40 rings.
    assert_relative_eq!(solid.volume(), 4.0 / 3.0 * PI * 8000.0, max_relative = 6e-3);
    for n in 0..500 {
        let direction = Vec3::new(
            (f64::from(n) * 0.7).sin(),
            (f64::from(n) * 1.3).cos(),
            (f64::from(n) * 2.1).sin(),
        );
        let direction = direction.normalize();
        // The facets lie at most 0.1 mm below the sphere of radius 20 mm.
        assert!(solid.contains(&(centre + direction * 19.8)));
        assert!(!solid.contains(&(centre + direction * 20.01)));
        let closest = solid.closest(&(centre + direction * 25.0));
        assert_relative_eq!(closest.distance, 5.0, epsilon = 0.1);
        let [a, b, c] = solid.mesh().corners(closest.triangle as usize);
        assert!(
            (b - a)
                .cross(&(c - a))
                .normalize()
                .dot(&(closest.point - a))
                .abs()
                < 1e-9
        );
    }
}

#[test]
fn grid_lines_run_through_a_sphere_in_chords() {
    let centre = Vec3::new(3.0, 5.0, 7.0);
    let solid = Solid::new(sphere(centre, 20.0, 60)).unwrap();
    for axis in Axis::ALL {
        let (i, j) = axis.others();
        for (a, b) in [(0.0, 0.0), (3.3, -7.1), (-12.0, 9.0), (0.0, 19.0)] {
            let chord = solid.intervals(axis, centre[i] + a, centre[j] + b);
            let half = (400.0_f64 - a * a - b * b).sqrt();
            assert_eq!(chord.len(), 1, "{axis} {a} {b}");
            // Near the rim the chord is steep in the sagitta of the facets, 0.03 mm.
            assert_relative_eq!(chord[0][0], centre[axis.index()] - half, epsilon = 0.3);
            assert_relative_eq!(chord[0][1], centre[axis.index()] + half, epsilon = 0.3);
        }
        assert!(
            solid
                .intervals(axis, centre[i] + 15.0, centre[j] + 15.0)
                .is_empty()
        );
    }
}

#[test]
fn lines_through_edges_vertices_and_faces_get_one_answer() {
    let solid = Solid::new(cube(8.0)).unwrap();
    for axis in Axis::ALL {
        // Every node and diagonal of the 1 mm faces, without the rim.
        for n in 1..64 {
            let (a, b) = (f64::from(n % 8).max(0.5), f64::from(n / 8).max(0.5));
            let found = solid.intervals(axis, a, b);
            assert_eq!(found.len(), 1, "{axis} {a} {b}");
            assert_relative_eq!(found[0][0], 0.0, epsilon = 1e-6);
            assert_relative_eq!(found[0][1], 8.0, epsilon = 1e-6);
        }
        // In a side face: all or nothing, never in pieces.
        for (a, b) in [
            (0.0, 4.0),
            (8.0, 4.0),
            (4.0, 0.0),
            (4.0, 8.0),
            (0.0, 0.0),
            (8.0, 8.0),
        ] {
            let found = solid.intervals(axis, a, b);
            assert!(
                found.is_empty() || (found.len() == 1 && found[0][1] - found[0][0] > 7.9),
                "{found:?}"
            );
        }
    }
}

#[test]
fn a_cavity_stays_a_cavity_and_an_inverted_body_is_turned() {
    let (outer, inner) = (sphere(Vec3::zeros(), 20.0, 30), sphere(Vec3::zeros(), 10.0, 30));
    let hollow = [outer.clone(), inside_out(&inner)];
    let expected = outer.signed_volume() - inner.signed_volume();
    // As it should be; all inside out; only the outer wall inside out, where the inner one then follows it.
    for (parts, inverted) in [
        (joined(&hollow), 0),
        (inside_out(&joined(&hollow)), 2),
        (joined(&[inside_out(&outer)]), 1),
    ] {
        let solid = Solid::new(parts).unwrap();
        assert_eq!(solid.health().inverted_components, inverted);
        assert!(solid.contains(&Vec3::new(0.0, 15.0, 0.0)));
        if solid.health().components == 2 {
            assert!(!solid.contains(&Vec3::zeros()));
            assert_relative_eq!(solid.volume(), expected, max_relative = 1e-9);
            assert_eq!(solid.intervals(Axis::X, 0.3, 0.2).len(), 2);
        }
    }
}

#[test]
fn triangles_that_disagree_are_turned_and_counted() {
    let mut mesh = cube(10.0);
    for t in [3, 40, 41, 100] {
        mesh.triangles[t].swap(0, 1);
    }
    let solid = Solid::new(mesh).unwrap();
    assert_eq!(solid.health().flipped, 4);
    assert!(
        solid
            .health()
            .warnings()
            .iter()
            .any(|w| w.contains("4 triangles turned over"))
    );
    assert_relative_eq!(solid.volume(), 1000.0, max_relative = 1e-12);
}

#[test]
fn parts_that_overlap_unite() {
    let (left, right) = (
        sphere(Vec3::zeros(), 10.0, 30),
        sphere(Vec3::new(10.0, 0.0, 0.0), 10.0, 30),
    );
    let solid = Solid::new(joined(&[left, right])).unwrap();
    assert_eq!(solid.health().components, 2);
    // Two balls at a distance of one radius share 5/12 π r³.
    let union = (8.0 / 3.0 - 5.0 / 12.0) * PI * 1000.0;
    assert_relative_eq!(solid.volume(), union, max_relative = 0.01);
    assert_eq!(solid.intervals(Axis::X, 0.1, 0.1).len(), 1);
}

#[test]
fn small_defects_are_named_and_survived() {
    let mut mesh = cube(10.0);
    mesh.triangles.remove(17);
    let first = mesh.triangles[0];
    mesh.triangles.push(first);
    mesh.triangles.push([1, 1, 2]);
    let solid = Solid::new(mesh).unwrap();
    let health = solid.health();
    assert_eq!(
        (health.open_edges, health.duplicate, health.degenerate),
        (3, 1, 1)
    );
    assert_eq!(health.warnings().len(), 3);
    // The winding number closes the hole of 1.25 mm; lines through it end near it.
    assert_relative_eq!(solid.volume(), 1000.0, max_relative = 2e-3);
    let hole = {
        let [a, b, c] = cube(10.0).corners(17);
        (a + b + c) / 3.0
    };
    let flat = Axis::ALL
        .into_iter()
        .find(|axis| hole[axis.index()] == 0.0 || hole[axis.index()] == 10.0)
        .unwrap();
    let (i, j) = flat.others();
    let through = solid.intervals(flat, hole[i], hole[j]);
    assert_eq!(through.len(), 1);
    assert_relative_eq!(through[0][1] - through[0][0], 10.0, epsilon = 0.3);
}

#[test]
fn surfaces_that_bound_nothing_are_refused_with_the_count() {
    let mut open = cube(10.0);
    open.triangles
        .retain(|t| !t.iter().all(|&v| cube(10.0).vertices[v as usize].z == 10.0));
    // The rim of the missing lid has 4 · 8 edges.
    match Solid::new(open).unwrap_err() {
        SolidError::NotClosed { open_edges, percent } => {
            assert_eq!(open_edges, 32);
            assert!(percent > 15.0);
        }
        other => panic!("{other}"),
    }
    let sheet = TriMesh {
        vertices: vec![Vec3::zeros(), Vec3::x() * 9.0, Vec3::y() * 9.0],
        triangles: vec![[0, 1, 2]],
    };
    assert!(
        Solid::new(sheet)
            .unwrap_err()
            .to_string()
            .contains("3 open edges")
    );
    let both_sides = TriMesh {
        vertices: vec![Vec3::zeros(), Vec3::x() * 9.0, Vec3::y() * 9.0],
        triangles: vec![[0, 1, 2], [0, 2, 1]],
    };
    assert!(matches!(Solid::new(both_sides), Err(SolidError::NoVolume { .. })));
    assert_eq!(Solid::new(TriMesh::default()).unwrap_err(), SolidError::Empty);
}

#[test]
fn numbers_that_are_no_surface_are_refused() {
    let mut mesh = cube(10.0);
    mesh.triangles[5][1] = 100_000;
    assert!(matches!(
        Solid::new(mesh),
        Err(SolidError::IndexOutOfRange {
            triangle: 5,
            vertex: 100_000,
            ..
        })
    ));
    let mut mesh = cube(10.0);
    mesh.vertices[7].y = f64::NAN;
    assert!(matches!(
        Solid::new(mesh),
        Err(SolidError::NotFinite { vertex: 7, .. })
    ));
    let mut mesh = cube(10.0);
    mesh.vertices.iter_mut().for_each(|v| *v *= 1e300);
    let _ = Solid::new(mesh);
}

#[test]
fn a_solid_is_shared_between_threads() {
    fn shared<T: Send + Sync>() {}
    shared::<Solid>();
}
