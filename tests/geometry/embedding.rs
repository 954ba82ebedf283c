//! Surfaces that follow volume meshes.

use pliant::geometry::embedding::{Embedding, EmbeddingError, EmbeddingOptions};
use pliant::geometry::volume::{Elements, VolumeMesh};
use pliant::math::{Mat3, Vec3};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

type Build = fn(&VolumeMesh, &[Vec3], &EmbeddingOptions) -> Result<Embedding, EmbeddingError>;
const KINDS: [Build; 2] = [Embedding::in_elements, Embedding::moving_least_squares];

/// 12 × 8 × 6 mm in cells of 2 mm, inner and outer nodes shifted: no element is a box.
fn skewed(tetrahedra: bool) -> VolumeMesh {
    let mut mesh = VolumeMesh::cuboid(Vec3::new(12.0, 8.0, 6.0), [6, 4, 3], tetrahedra);
    for (i, x) in mesh.nodes.iter_mut().enumerate() {
        let t = i as f64;
        *x += 0.2 * Vec3::new((3.1 * t).sin(), (1.7 * t).cos(), (2.3 * t).sin());
    }
    mesh
}

fn meshes() -> Vec<VolumeMesh> {
    let kuhn = skewed(true);
    let Elements::KuhnCells(cells) = &kuhn.elements else {
        panic!()
    };
    let tets = cells
        .iter()
        .flat_map(|c| pliant::geometry::volume::KUHN.map(|t| t.map(|i| c[i])))
        .collect();
    let plain = VolumeMesh {
        nodes: kuhn.nodes.clone(),
        elements: Elements::Tetrahedra(tets),
    };
    vec![skewed(false), kuhn, plain]
}

/// In the box and up to 0.5 mm around it.
fn places(count: usize) -> Vec<Vec3> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    (0..count)
        .map(|_| {
            Vec3::new(
                rng.gen_range(-0.5..12.5),
                rng.gen_range(-0.5..8.5),
                rng.gen_range(-0.5..6.5),
            )
        })
        .collect()
}

#[test]
fn linear_fields_are_followed_exactly_and_weights_add_up_to_one() {
    let slope = Mat3::new(0.1, -0.2, 0.3, 0.05, 0.4, -0.1, 0.2, 0.15, -0.3);
    let shift = Vec3::new(3.0, -1.0, 0.5);
    let points = places(400);
    for mesh in meshes() {
        let u: Vec<Vec3> = mesh.nodes.iter().map(|x| slope * x + shift).collect();
        for build in KINDS {
            let embedding = build(&mesh, &points, &EmbeddingOptions::default()).unwrap();
            assert!(embedding.outside() > 20 && embedding.outside() < 200);
            let moved = embedding.displaced(&u).unwrap();
            for (p, (x, y)) in points.iter().zip(&moved).enumerate() {
                // Rounding of coordinates of order ten with weights of order one.
                assert!((y - (x + slope * x + shift)).norm() < 1e-12, "{p}");
                let sum: f64 = embedding.weights_of(p).map(|(_, w)| w).sum();
                assert!((sum - 1.0).abs() < 1e-13, "{sum}");
            }
        }
    }
}

/// At a node its own displacement, in the middle of an edge of a tetrahedron the mean of two, in the centre of a box
/// the mean of eight.
#[test]
fn weights_in_elements_are_shape_functions() {
    let mesh = VolumeMesh::cuboid(Vec3::repeat(1.0), [1, 1, 1], false);
    let points = [Vec3::zeros(), Vec3::repeat(0.5), Vec3::new(0.25, 0.5, 1.0)];
    let embedding = Embedding::in_elements(&mesh, &points, &EmbeddingOptions::default()).unwrap();
    let weights = |p: usize| -> Vec<f64> {
        let mut all = vec![0.0; 8];
        embedding.weights_of(p).for_each(|(n, w)| all[n as usize] += w);
        all
    };
    let near = |found: Vec<f64>, expected: [f64; 8]| {
        assert!(
            found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-14),
            "{found:?}"
        );
    };
    near(weights(0), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    near(weights(1), [0.125; 8]);
    // Nodes of a cuboid run along x first: the upper four share (¾, ¼) in x and (½, ½) in y.
    near(weights(2), [0.0, 0.0, 0.0, 0.0, 0.375, 0.125, 0.375, 0.125]);
}

#[test]
fn embeddings_are_continuous() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    for mesh in meshes() {
        let u: Vec<Vec3> = mesh
            .nodes
            .iter()
            .map(|_| Vec3::from_fn(|_, _| rng.gen_range(-1.0..1.0)))
            .collect();
        // Along a line through many elements, in steps of 1e-5 mm where the field changes by about 1 mm a millimetre.
        let line = |t: f64| Vec3::new(1.0 + 10.0 * t, 1.0 + 6.0 * t, 5.0 - 4.0 * t);
        let points: Vec<Vec3> = (0..4000)
            .flat_map(|k| {
                let t = f64::from(k) / 4000.0;
                [line(t), line(t + 1e-6)]
            })
            .collect();
        for build in KINDS {
            let moved = build(&mesh, &points, &EmbeddingOptions::default())
                .unwrap()
                .displaced(&u)
                .unwrap();
            let steps = moved.chunks_exact(2).map(|pair| (pair[1] - pair[0]).norm());
            let most = steps.fold(0.0, f64::max);
            assert!(most < 1e-4 && most > 1e-7, "{most}");
        }
    }
}

/// A bar of 60 × 10 × 10 mm in cells of 5 mm, bent to a radius of 60 mm. Its upper side is sampled every millimetre along the middle;
/// the measure is the largest turn between neighbouring pieces, over the 1 mm / 60 mm by which each would turn on the true arc.
#[test]
fn moving_least_squares_bend_smoothly() {
    let radius = 60.0;
    let bend = |x: &Vec3| {
        let angle = (x.x - 30.0) / radius;
        let arm = radius - (x.z - 5.0);
        Vec3::new(30.0 + arm * angle.sin(), x.y, 5.0 + radius - arm * angle.cos())
    };
    let points: Vec<Vec3> = (5..=55)
        .map(|k| Vec3::new(f64::from(k) + 0.2, 4.3, 9.9))
        .collect();
    let mesh = VolumeMesh::cuboid(Vec3::new(60.0, 10.0, 10.0), [12, 2, 2], true);
    let u: Vec<Vec3> = mesh.nodes.iter().map(|x| bend(x) - x).collect();
    let largest_turn = |build: Build| {
        let moved = build(&mesh, &points, &EmbeddingOptions::default())
            .unwrap()
            .displaced(&u)
            .unwrap();
        let pieces: Vec<Vec3> = moved.windows(2).map(|p| p[1] - p[0]).collect();
        let turns = pieces
            .windows(2)
            .map(|p| p[0].cross(&p[1]).norm().atan2(p[0].dot(&p[1])));
        turns.fold(0.0, f64::max) * radius
    };
    let [barycentric, smooth] = KINDS.map(largest_turn);
    println!("largest turn over the arc's: {barycentric:.2} barycentric, {smooth:.2} moving least squares");
    // Five pieces' turn falls on one kink, or is shared by two where the line crosses two faces; without kinks it stays near one.
    assert!(barycentric > 2.5, "{barycentric}");
    assert!(smooth < 1.6, "{smooth}");
    // And it is still the arc: the fit cuts less than (10 mm)²/8R off it.
    let moved = Embedding::moving_least_squares(&mesh, &points, &EmbeddingOptions::default())
        .unwrap()
        .displaced(&u)
        .unwrap();
    for (x, y) in points.iter().zip(&moved) {
        assert!((y - bend(x)).norm() < 0.21, "{}", (y - bend(x)).norm());
    }
}

/// A single layer of nodes determines no plane across it: the fit gives way to the element's own functions.
#[test]
fn where_nodes_lie_in_a_plane_the_element_helps_out() {
    // A slab of 0.02 mm with nodes 4 mm apart: for the fit they lie in a plane.
    let mesh = VolumeMesh::cuboid(Vec3::new(20.0, 20.0, 0.02), [5, 5, 1], false);
    let points = [Vec3::new(7.0, 9.0, 0.015)];
    let embedding = Embedding::moving_least_squares(&mesh, &points, &EmbeddingOptions::default()).unwrap();
    assert_eq!(embedding.fallbacks(), 1);
    let u: Vec<Vec3> = mesh
        .nodes
        .iter()
        .map(|x| Vec3::new(0.0, 0.0, 10.0 * x.z))
        .collect();
    let moved = embedding.displaced(&u).unwrap();
    assert!((moved[0].z - 0.165).abs() < 1e-12);
}

#[test]
fn what_cannot_be_embedded_is_refused_by_name() {
    let mesh = skewed(true);
    let options = EmbeddingOptions::default();
    for build in KINDS {
        // Elements are some 3.5 mm long.
        let far = [Vec3::repeat(1.0), Vec3::new(0.0, 0.0, 20.0)];
        match build(&mesh, &far, &options).unwrap_err() {
            EmbeddingError::TooFar {
                point: 1,
                distance_mm,
                ..
            } => assert!((13.0..15.0).contains(&distance_mm)),
            other => panic!("{other}"),
        }
        assert!(matches!(
            build(&mesh, &[Vec3::new(0.0, f64::NAN, 0.0)], &options).unwrap_err(),
            EmbeddingError::NotFinite { point: 0, .. }
        ));
        let reach = EmbeddingOptions {
            reach_mm: Some(0.1),
            ..options
        };
        let near = [Vec3::new(6.0, 4.0, 7.0)];
        assert!(matches!(
            build(&mesh, &near, &reach),
            Err(EmbeddingError::TooFar { .. })
        ));
        let support = EmbeddingOptions {
            support: Some(0.5),
            ..options
        };
        assert!(
            build(&mesh, &near, &support)
                .unwrap_err()
                .to_string()
                .contains("support")
        );
        let empty = VolumeMesh {
            nodes: Vec::new(),
            elements: Elements::Tetrahedra(Vec::new()),
        };
        assert_eq!(build(&empty, &near, &options), Err(EmbeddingError::NoElements));
        let broken = VolumeMesh {
            nodes: vec![Vec3::zeros()],
            elements: Elements::Tetrahedra(vec![[0, 1, 2, 3]]),
        };
        assert_eq!(
            build(&broken, &near, &options),
            Err(EmbeddingError::BadNode { element: 0, node: 1 })
        );
    }
    let embedding = Embedding::in_elements(&mesh, &[Vec3::repeat(1.0)], &options).unwrap();
    assert!(matches!(
        embedding.displaced(&[Vec3::zeros()]),
        Err(EmbeddingError::Length { found: 1, .. })
    ));
}
