//! Tetrahedral meshes: conforming, bounded in their angles, true to the object and to its borders.

use super::scans::shared;
use super::solids::sphere;
use approx::assert_relative_eq;
use pliant::geometry::cells::{Cells, LayeredRegion, Style};
use pliant::geometry::files::open_surface;
use pliant::geometry::heights::Heights;
use pliant::geometry::shapes::{SoleOptions, block, flip_flop_sole};
use pliant::geometry::tetrahedra::{
    Borders, MeshError, MeshOptions, TetMesh, dihedral_angles_deg, tetrahedral_mesh,
};
use pliant::geometry::volume::Elements;
use pliant::geometry::{Axis, Region, Solid, TriMesh};
use pliant::math::Vec3;
use pliant::units::LengthUnit;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

fn tets(made: &TetMesh) -> &[[u32; 4]] {
    match &made.mesh.elements {
        Elements::Tetrahedra(tets) => tets,
        other => panic!("{} elements of another kind", other.len()),
    }
}

fn corners(made: &TetMesh, tet: &[u32; 4]) -> [Vec3; 4] {
    tet.map(|v| made.mesh.nodes[v as usize])
}

fn volume(p: &[Vec3; 4]) -> f64 {
    (p[1] - p[0]).cross(&(p[2] - p[0])).dot(&(p[3] - p[0])) / 6.0
}

/// Every face has one or two tetrahedra on opposite sides, the faces with one are a closed surface with one fan at every vertex,
/// and all angles keep the bound. Answers that surface.
fn checked(made: &TetMesh, bound_deg: f64) -> TriMesh {
    let mut faces: BTreeMap<[u32; 3], Vec<[u32; 3]>> = BTreeMap::new();
    for tet in tets(made) {
        let [a, b, c, d] = *tet;
        assert!(volume(&corners(made, tet)) > 0.0);
        let [least, greatest] = dihedral_angles_deg(&corners(made, tet));
        assert!(
            least >= bound_deg && greatest <= 180.0 - bound_deg,
            "{least} {greatest}"
        );
        for face in [[b, c, d], [a, d, c], [a, b, d], [a, c, b]] {
            let mut key = face;
            key.sort_unstable();
            faces.entry(key).or_default().push(face);
        }
    }
    let mut triangles = Vec::new();
    for (key, sides) in &faces {
        match sides[..] {
            [face] => triangles.push(face),
            [p, q] => {
                let at = p.iter().position(|v| *v == q[0]).unwrap();
                assert_ne!(
                    p[(at + 1) % 3],
                    q[1],
                    "both tetrahedra at {key:?} lie on one side of it"
                );
            }
            _ => panic!("{} tetrahedra at the face {key:?}", sides.len()),
        }
    }
    let mut edges: BTreeMap<(u32, u32), [u32; 2]> = BTreeMap::new();
    let mut around: BTreeMap<u32, Vec<(u32, u32)>> = BTreeMap::new();
    for t in &triangles {
        for k in 0..3 {
            let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
            edges.entry((a.min(b), a.max(b))).or_default()[usize::from(a < b)] += 1;
            around.entry(a).or_default().push((b, c));
        }
    }
    assert!(edges.values().all(|count| *count == [1, 1]));
    for (v, mut rim) in around {
        let (start, mut at) = rim.pop().unwrap();
        while at != start {
            let next = rim.iter().position(|(from, _)| *from == at).unwrap();
            at = rim.swap_remove(next).1;
        }
        assert!(rim.is_empty(), "two fans at vertex {v}");
    }
    let mut used = vec![false; made.mesh.nodes.len()];
    tets(made)
        .as_flattened()
        .iter()
        .for_each(|&v| used[v as usize] = true);
    assert!(used.iter().all(|u| *u));
    assert_eq!(made.cell_of_element.len(), tets(made).len());
    TriMesh {
        vertices: made.mesh.nodes.clone(),
        triangles,
    }
}

fn volume_of(made: &TetMesh, cell: u16) -> f64 {
    let all = tets(made).iter().zip(&made.cell_of_element);
    all.filter(|(_, c)| **c == cell)
        .map(|(t, _)| volume(&corners(made, t)))
        .sum()
}

/// How far elements reach over a border: the largest distance from its cell of a point of an element, over points near its corners
/// and its middle.
fn straddle(made: &TetMesh, cells: &Cells) -> f64 {
    let borders = cells.borders();
    let mut worst = 0.0_f64;
    for (tet, cell) in tets(made).iter().zip(&made.cell_of_element) {
        let p = corners(made, tet);
        let middle = p.iter().sum::<Vec3>() / 4.0;
        for point in p.iter().map(|x| middle + (x - middle) * 0.98).chain([middle]) {
            if cells.cell_at(&point) != Some(*cell as usize) {
                let near = borders
                    .iter()
                    .map(|b| b(&point).abs())
                    .fold(f64::INFINITY, f64::min);
                worst = worst.max(near);
            }
        }
    }
    worst
}

fn layered(region: Region, axis: Axis, style: Style, borders: Vec<f64>) -> LayeredRegion {
    LayeredRegion {
        name: "part".into(),
        region,
        axis,
        style,
        borders,
        across: Default::default(),
    }
}

fn flat(borders: Vec<f64>) -> Cells {
    Cells::new(
        vec![layered(Region::Everything, Axis::Z, Style::Flat, borders)],
        None,
    )
}

fn even(solid: &Solid, axis: Axis, n: usize) -> Cells {
    let (low, high) = solid.bounds();
    let k = axis.index();
    let border = |i: usize| low[k] + (high[k] - low[k]) * i as f64 / n as f64;
    Cells::new(
        vec![layered(
            Region::Everything,
            axis,
            Style::Flat,
            (0..=n).map(border).collect(),
        )],
        None,
    )
}

/// 50 × 40 × 25 mm: its planes are the lattice's, so everything is exact, sharp edges too. Layers of 5 mm get planes of the lattice;
/// one of 1 mm is thinner than half an edge and is cut.
#[test]
fn a_layered_block_is_exact() {
    let solid = Solid::new(block(Vec3::new(50.0, 40.0, 25.0), 2.5).unwrap()).unwrap();
    for borders in [
        vec![0.0, 5.0, 10.0, 15.0, 20.0, 25.0],
        vec![0.0, 11.0, 12.0, 25.0],
    ] {
        let cells = flat(borders.clone());
        let made = tetrahedral_mesh(&solid, Some(&cells), &MeshOptions::new(4.0)).unwrap();
        let surface = checked(&made, 10.0);
        assert_relative_eq!(surface.signed_volume(), 50_000.0, max_relative = 1e-9);
        assert_relative_eq!(made.quality.volume_mm3, 50_000.0, max_relative = 1e-9);
        // 2 (50·40 + 50·25 + 40·25) mm².
        assert_relative_eq!(surface.area(), 8_500.0, max_relative = 1e-9);
        for (cell, pair) in borders.windows(2).enumerate() {
            let expected = 2000.0 * (pair[1] - pair[0]);
            assert_relative_eq!(volume_of(&made, cell as u16), expected, max_relative = 1e-6);
        }
        assert!(made.quality.border_distance_mm < 1e-6, "{:?}", made.quality);
        assert!(straddle(&made, &cells) < 1e-6);
    }
}

/// The ball of radius 20 mm by a fine polyhedron (0.5 % less than the ball), in three layers: a cap of height h has
/// π h² (3r − h)/3.
#[test]
fn a_ball_with_layers_has_its_caps() {
    let r = 20.0;
    let solid = Solid::new(sphere(Vec3::new(5.0, -3.0, 2.0), r, 60)).unwrap();
    let (low, high) = solid.bounds();
    let cells = flat(vec![low.z, low.z + 8.0, low.z + 27.0, high.z]);
    let mut errors = Vec::new();
    for edge in [5.0, 2.5] {
        let made = tetrahedral_mesh(&solid, Some(&cells), &MeshOptions::new(edge)).unwrap();
        checked(&made, 10.0);
        let cap = |h: f64| PI * h * h * (3.0 * r - h) / 3.0;
        let ball = 4.0 / 3.0 * PI * r.powi(3);
        // Chords of length L cut off L²/8r of depth: 1.6 % of the ball at 5 mm edges with diagonals of 8.7 mm, and more of a flat cap.
        let tolerance = 0.06 * (edge / 5.0);
        assert_relative_eq!(volume_of(&made, 0), cap(8.0), max_relative = tolerance);
        assert_relative_eq!(volume_of(&made, 2), cap(13.0), max_relative = tolerance);
        let middle = ball - cap(8.0) - cap(13.0);
        assert_relative_eq!(volume_of(&made, 1), middle, max_relative = tolerance);
        assert!(
            made.quality.surface_distance_mm < 0.2 * edge,
            "{:?}",
            made.quality
        );
        assert!(straddle(&made, &cells) <= made.quality.border_distance_mm + 1e-6);
        errors.push(made.quality.volume_error.abs());
    }
    // Second order: four times less at half the edge; three allows for the slack.
    assert!(errors[1] < errors[0] / 3.0, "{errors:?}");
}

/// A cylinder of radius 9 mm through a block: a curved border between cells, π r² · 25 mm³, meeting the block's faces at right angles.
#[test]
fn a_curved_region_is_followed() {
    let solid = Solid::new(block(Vec3::new(50.0, 40.0, 25.0), 2.5).unwrap()).unwrap();
    let core = Region::Cylinder {
        axis: Axis::Z,
        centre: [23.0, 21.0],
        radius: 9.0,
        range: [-1.0, 26.0],
    };
    let whole = vec![0.0, 25.0];
    let cells = Cells::new(
        vec![
            layered(core, Axis::Z, Style::Flat, whole.clone()),
            layered(Region::Everything, Axis::Z, Style::Flat, vec![0.0, 9.0, 25.0]),
        ],
        None,
    );
    let options = MeshOptions::new(2.5);
    let made = tetrahedral_mesh(&solid, Some(&cells), &options).unwrap();
    checked(&made, 10.0);
    // An inscribed polygon with sides of 2.5 to 4.3 mm lacks 1 to 4 % of the circle.
    assert_relative_eq!(volume_of(&made, 0), PI * 81.0 * 25.0, max_relative = 0.03);
    assert_relative_eq!(made.quality.volume_mm3, 50_000.0, max_relative = 1e-9);
    // A chord of 4.3 mm is 0.26 mm below the circle.
    assert!(made.quality.border_distance_mm < 0.3, "{:?}", made.quality);
    assert!(straddle(&made, &cells) < 0.3);
    // Crossing borders, the layer's 9 mm fall between the lattice's planes: elements must straddle them.
    let options = MeshOptions {
        borders: Borders::Cross,
        ..options
    };
    let crossing = tetrahedral_mesh(&solid, Some(&cells), &options).unwrap();
    checked(&crossing, 10.0);
    assert!(straddle(&crossing, &cells) > 0.5);
    assert_eq!(crossing.quality.border_distance_mm, 0.0);
}

/// A ball of radius 8 mm inside a block, given as a surface: a border that meets nothing, 4/3 π r³.
#[test]
fn a_region_given_by_its_surface_is_followed() {
    let solid = Solid::new(block(Vec3::new(50.0, 40.0, 25.0), 2.5).unwrap()).unwrap();
    let ball = Solid::new(sphere(Vec3::new(24.0, 19.0, 12.0), 8.0, 40)).unwrap();
    let whole = vec![0.0, 25.0];
    let cells = Cells::new(
        vec![
            layered(Region::Mesh(Arc::new(ball)), Axis::Z, Style::Flat, whole.clone()),
            layered(Region::Everything, Axis::Z, Style::Flat, whole),
        ],
        None,
    );
    let made = tetrahedral_mesh(&solid, Some(&cells), &MeshOptions::new(2.5)).unwrap();
    checked(&made, 10.0);
    // Chords of up to 4.3 mm lie 0.29 mm deep in a ball of 8 mm: two thirds of that around it all are 7 %.
    let ball = 4.0 / 3.0 * PI * 512.0;
    assert_relative_eq!(volume_of(&made, 0), ball, max_relative = 0.07);
    assert_relative_eq!(made.quality.volume_mm3, 50_000.0, max_relative = 1e-9);
    assert!(straddle(&made, &cells) < 0.3, "{}", straddle(&made, &cells));
}

#[test]
fn a_sole_in_layers_that_follow_its_height_keeps_a_higher_bound() {
    let solid = Solid::new(flip_flop_sole(&SoleOptions::default()).unwrap()).unwrap();
    let heights = Heights::new(&solid, Axis::Z, 3.0);
    let shares = (0..=5).map(|k| f64::from(k) / 5.0).collect();
    let cells = Cells::new(
        vec![layered(Region::Everything, Axis::Z, Style::Follow, shares)],
        Some(heights),
    );
    for bound in [6.0, 12.0] {
        let options = MeshOptions {
            least_dihedral_deg: bound,
            ..MeshOptions::new(6.0)
        };
        let made = tetrahedral_mesh(&solid, Some(&cells), &options).unwrap();
        checked(&made, bound);
        assert!(made.quality.volume_error.abs() < 0.015, "{:?}", made.quality);
        // The slack, 0.2 · 6 mm, and the sag of a face.
        assert!(straddle(&made, &cells) < 1.6, "{}", straddle(&made, &cells));
        for cell in 0..5 {
            let share = volume_of(&made, cell) / made.quality.volume_mm3;
            assert!((0.16..0.24).contains(&share), "{cell}: {share}");
        }
    }
}

/// Open, overlapping, doubled: what matters is that the mesh is one.
#[test]
fn scans_are_meshed_whatever_is_wrong_with_them() {
    for (name, unit, edge, axis, volume_tolerance) in [
        (
            "objects/gensole_Left-Insole.stl",
            LengthUnit::Millimetre,
            5.0,
            Axis::Z,
            0.05,
        ),
        ("objects/stool_01.obj", LengthUnit::Metre, 14.0, Axis::Y, 0.15),
        ("objects/cushion_01.obj", LengthUnit::Metre, 20.0, Axis::Y, 0.02),
        (
            "objects/skull_no_teeth.obj",
            LengthUnit::Metre,
            12.0,
            Axis::Y,
            0.03,
        ),
    ] {
        let Some(path) = shared(name) else { continue };
        let solid = Solid::new(open_surface(&path, Some(unit)).unwrap().mesh).unwrap();
        let cells = even(&solid, axis, 5);
        let made = tetrahedral_mesh(&solid, Some(&cells), &MeshOptions::new(edge)).unwrap();
        let surface = checked(&made, 10.0);
        assert_relative_eq!(
            surface.signed_volume(),
            made.quality.volume_mm3,
            max_relative = 1e-9
        );
        let off = made.quality.volume_mm3 / solid.volume() - 1.0;
        assert!(off.abs() < volume_tolerance, "{name}: {off}");
        assert!(straddle(&made, &cells) <= 0.2 * edge, "{name}");
    }
}

#[test]
fn the_answer_is_the_same_on_any_number_of_threads() {
    let solid = Solid::new(sphere(Vec3::zeros(), 20.0, 20)).unwrap();
    let cells = even(&solid, Axis::X, 3);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| tetrahedral_mesh(&solid, Some(&cells), &MeshOptions::new(6.0)).unwrap())
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn what_cannot_be_meshed_is_refused_by_name() {
    let solid = Solid::new(sphere(Vec3::zeros(), 20.0, 20)).unwrap();
    let with = |change: fn(&mut MeshOptions)| {
        let mut options = MeshOptions::new(6.0);
        change(&mut options);
        tetrahedral_mesh(&solid, None, &options).unwrap_err().to_string()
    };
    for (change, part) in [
        ((|o| o.edge_mm = f64::NAN) as fn(&mut MeshOptions), "edge_mm"),
        (|o| o.edge_mm = 0.0, "edge_mm"),
        (|o| o.least_dihedral_deg = 45.0, "least_dihedral_deg"),
        (|o| o.slack = f64::INFINITY, "slack"),
        (|o| o.edge_mm = 0.1, "use at least 0.4"),
    ] {
        let said = with(change);
        assert!(said.contains(part), "{part} in {said}");
    }
    // Nobody has promised this much.
    let strict = MeshOptions {
        least_dihedral_deg: 30.0,
        slack: 0.0,
        ..MeshOptions::new(6.0)
    };
    match tetrahedral_mesh(&solid, None, &strict) {
        Err(MeshError::BoundMissed { count, least_deg, .. }) => assert!(count > 0 && least_deg < 30.0),
        Err(other) => panic!("{other}"),
        Ok(made) => drop(checked(&made, 30.0)),
    }
    let half = Region::Box {
        min: Vec3::repeat(-30.0),
        max: Vec3::new(0.0, 30.0, 30.0),
    };
    let cells = Cells::new(vec![layered(half, Axis::Z, Style::Flat, vec![-30.0, 30.0])], None);
    let error = tetrahedral_mesh(&solid, Some(&cells), &MeshOptions::new(6.0)).unwrap_err();
    assert!(matches!(error, MeshError::NoCell { .. }), "{error}");
}
