//! Parts tile their object.

use crate::shapes::{around, ball, block, sole};
use pliant::fabrication::tiling::check::{Contacts, check_tiling};
use pliant::fabrication::tiling::{Part, Tiling, TilingError, TilingOptions, tile};
use pliant::geometry::cutting::{CutError, LevelSet};
use pliant::math::{Mat3, Vec3};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::PI;

fn checked(tiling: &Tiling) -> Contacts {
    let contacts = check_tiling(&tiling.parts).unwrap_or_else(|faults| {
        panic!(
            "{} faults, first {}",
            faults.len(),
            faults.iter().take(3).map(|f| f.to_string()).collect::<String>()
        )
    });
    assert!(contacts.outer_closed);
    contacts
}

fn spacing(h: f64) -> TilingOptions {
    TilingOptions {
        spacing_mm: Some(h),
        ..TilingOptions::default()
    }
}

/// How often a part's surface winds around a point: 1 inside, 0 outside (Van Oosterom and Strackee's solid angle).
fn winding(part: &Part, x: &Vec3) -> f64 {
    let angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| part.mesh.vertices[v as usize] - x);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(below)
    };
    part.mesh.triangles.iter().map(angle).sum::<f64>() / (4.0 * PI)
}

/// Points inside the object by more than `margin` are in exactly one part, points outside in none.
fn each_point_in_one_part(tiling: &Tiling, f: LevelSet, (low, high): (Vec3, Vec3), margin: f64) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let mut inside = 0;
    for _ in 0..300 {
        let x = Vec3::from_fn(|k, _| rng.gen_range(low[k]..high[k]));
        if f(&x).abs() < margin {
            continue;
        }
        let windings: Vec<f64> = tiling.parts.iter().map(|p| winding(p, &x)).collect();
        assert!(
            windings.iter().all(|w| (w - w.round()).abs() < 1e-6),
            "{windings:?}"
        );
        let expected = if f(&x) < 0.0 { 1.0 } else { 0.0 };
        assert!(
            (windings.iter().sum::<f64>() - expected).abs() < 1e-6,
            "{x:?} {windings:?}"
        );
        assert!(windings.iter().all(|w| *w > -1e-6));
        inside += usize::from(f(&x) < 0.0);
    }
    assert!(inside > 50);
}

/// 50 × 40 × 25 mm in five layers of 5 mm, alternating between two materials: everything is flat and on the axes, so
/// volumes and areas are exact.
#[test]
fn layered_block_is_exact() {
    let half = Vec3::new(25.0, 20.0, 12.5);
    let f = block(half);
    let planes: Vec<_> = (1..5)
        .map(|k| move |x: &Vec3| x.z + 12.5 - 5.0 * f64::from(k))
        .collect();
    let levels: Vec<LevelSet> = planes.iter().map(|p| p as LevelSet).collect();
    let label = |x: &Vec3| Some(((x.z + 12.5) / 5.0) as usize % 2);
    // 25 mm become 14 boxes of 1.79 mm: the layers' borders fall between lattice planes.
    let tiling = tile(&f, around(half), &levels, &label, &spacing(1.9)).expect("tiles");
    let contacts = checked(&tiling);
    // Layers 0, 2, 4 and layers 1, 3, each 50 × 40 × 5 mm.
    assert!(
        (tiling.parts[0].volume_mm3 - 30_000.0).abs() < 1e-3,
        "{}",
        tiling.parts[0].volume_mm3
    );
    assert!(
        (tiling.parts[1].volume_mm3 - 20_000.0).abs() < 1e-3,
        "{}",
        tiling.parts[1].volume_mm3
    );
    // Four interfaces of 50 × 40 mm; the block's surface is 2 (50·40 + 50·25 + 40·25).
    assert!((contacts.shared_mm2[&(0, 1)] - 8_000.0).abs() < 1e-3);
    assert!((contacts.outer_mm2 - 8_500.0).abs() < 1e-3);
    let low = tiling.parts[1]
        .mesh
        .vertices
        .iter()
        .map(|v| v.z)
        .fold(f64::INFINITY, f64::min);
    assert!((low + 7.5).abs() < 1e-6, "{low}");
    each_point_in_one_part(&tiling, &f, around(half * 1.2), 0.01);
}

/// A ball cut by a wavy surface that no plane follows, and by a cylinder.
#[test]
fn ball_with_curved_cells() {
    let (r, f) = (10.0, ball(10.0));
    let wave = |x: &Vec3| x.z - 1.5 * (0.9 * x.x).sin() - 1.0;
    let cylinder = |x: &Vec3| x.xy().norm() - 4.0;
    let label = |x: &Vec3| Some(usize::from(wave(x) > 0.0) + 2 * usize::from(cylinder(x) > 0.0));
    let tiling = tile(
        &f,
        around(Vec3::repeat(r)),
        &[&wave, &cylinder],
        &label,
        &spacing(0.8),
    )
    .expect("tiles");
    checked(&tiling);
    assert_eq!(
        tiling.parts.iter().map(|p| p.label).collect::<Vec<_>>(),
        [0, 1, 2, 3]
    );
    let volume = 4.0 / 3.0 * PI * r.powi(3);
    assert!(
        (tiling.volume_mm3 / volume - 1.0).abs() < 0.005,
        "{}",
        tiling.volume_mm3 / volume
    );
    // Ball and cylinder: 4/3 π (r³ − (r² − a²)^{3/2}) is what the cylinder takes.
    let core: f64 = tiling.parts[..2].iter().map(|p| p.volume_mm3).sum();
    let expected = 4.0 / 3.0 * PI * (r.powi(3) - (r * r - 16.0_f64).powf(1.5));
    assert!((core / expected - 1.0).abs() < 0.015, "{}", core / expected);
    each_point_in_one_part(&tiling, &f, around(Vec3::repeat(1.2 * r)), 0.25);
}

/// A small ball inside a block, on a lattice nearly as coarse as the ball: centroids of many pieces lie on the other
/// side of the true sphere than the piece does, and the border must follow the pieces.
#[test]
fn border_of_a_coarsely_cut_cell_is_smooth() {
    let half = Vec3::repeat(6.0);
    let f = block(half);
    let core = ball(3.0);
    let label = |x: &Vec3| Some(usize::from(core(x) > 0.0));
    for h in [1.1, 1.5, 1.9, 2.3] {
        let tiling = tile(&f, around(half), &[&core], &label, &spacing(h)).expect("tiles");
        checked(&tiling);
        let off = tiling.parts[0]
            .mesh
            .vertices
            .iter()
            .map(|x| core(x).abs())
            .fold(0.0, f64::max);
        // A thousandth of the spacing is what a vertex that may not move is allowed.
        assert!(
            off <= 1.1e-3 * h,
            "{off} mm off the sphere at a spacing of {h} mm"
        );
    }
}

/// Quarters of a block in two materials, crosswise: each touches itself along the middle line only.
#[test]
fn crosswise_quarters_are_split_along_their_common_edge() {
    let half = Vec3::new(6.0, 6.0, 4.0);
    let f = block(half);
    let (across, along) = (|x: &Vec3| x.x - 0.1, |x: &Vec3| x.y + 0.2);
    let label = |x: &Vec3| Some(usize::from((x.x > 0.1) == (x.y > -0.2)));
    let tiling = tile(&f, around(half), &[&across, &along], &label, &spacing(1.0)).expect("tiles");
    checked(&tiling);
    // 5.9·6.2 + 6.1·5.8 and 5.9·5.8 + 6.1·6.2 mm², 8 mm high.
    assert!((tiling.parts[1].volume_mm3 - 8.0 * (5.9 * 6.2 + 6.1 * 5.8)).abs() < 1e-3);
    assert!((tiling.parts[0].volume_mm3 - 8.0 * (5.9 * 5.8 + 6.1 * 6.2)).abs() < 1e-3);
    each_point_in_one_part(&tiling, &f, around(half * 1.2), 0.01);
}

/// Materials by chance on cubes: every way of touching along edges and in vertices occurs.
#[test]
fn random_cubes_are_manifold() {
    let half = Vec3::repeat(3.0);
    let f = block(half);
    let planes: Vec<_> = (0..3)
        .flat_map(|axis| (1..6).map(move |k| move |x: &Vec3| x[axis] + 3.0 - f64::from(k)))
        .collect();
    let levels: Vec<LevelSet> = planes.iter().map(|p| p as LevelSet).collect();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let material: Vec<Option<usize>> = (0..216)
        .map(|_| Some(rng.gen_range(0..4_usize)).filter(|m| *m < 3))
        .collect();
    let label = |x: &Vec3| {
        let i = x.map(|c| ((c + 3.0).floor() as usize).min(5));
        material[(i.z * 6 + i.y) * 6 + i.x]
    };
    for h in [1.0, 0.7, 2.5] {
        let tiling = tile(&f, around(half), &levels, &label, &spacing(h)).expect("tiles");
        checked(&tiling);
        for part in &tiling.parts {
            // Cubes of 1 mm³.
            let cubes = material.iter().filter(|m| **m == Some(part.label)).count();
            assert!(
                (part.volume_mm3 - cubes as f64).abs() < 1e-4,
                "{} {cubes}",
                part.volume_mm3
            );
        }
    }
}

/// A material by chance for every tetrahedron: pieces touch in every way there is, also along edges whose two fans
/// meet again at both ends.
#[test]
fn random_tetrahedra_are_manifold() {
    let half = Vec3::repeat(2.0);
    let f = block(half);
    for seed in 0..20_u64 {
        let label = |x: &Vec3| {
            let place = x.iter().fold(seed, |h, c| {
                (h ^ (c * 1e6).round() as i64 as u64)
                    .wrapping_mul(0x9e37_79b9_7f4a_7c15)
                    .rotate_left(29)
            });
            Some((place % 2) as usize)
        };
        let tiling = tile(&f, around(half), &[], &label, &spacing(0.8)).expect("tiles");
        checked(&tiling);
        assert!((tiling.volume_mm3 - 64.0).abs() < 1e-6);
    }
}

/// A block that lies across the lattice loses a little at its rims, and no more than is allowed at default spacing.
#[test]
fn turned_block_keeps_its_volume() {
    let half = Vec3::new(25.0, 20.0, 12.5);
    let flat = block(half);
    let turn: Mat3 = skew();
    let f = |x: &Vec3| flat(&(turn.transpose() * x));
    let extent = turn.abs() * half;
    let options = TilingOptions {
        volume_mm3: Some(50_000.0),
        ..TilingOptions::default()
    };
    let layer = |x: &Vec3| (turn.transpose() * x).z - 3.0;
    let tiling = tile(
        &f,
        around(extent),
        &[&layer],
        &|x| Some(usize::from(layer(x) > 0.0)),
        &options,
    )
    .expect("within 0.5 %");
    checked(&tiling);
    println!(
        "turned block: {:.3} % of its volume lost",
        100.0 * (1.0 - tiling.volume_mm3 / 50_000.0)
    );
    // 40 × 50 × 9.5 mm above the layer.
    assert!(
        (tiling.parts[1].volume_mm3 / 19_000.0 - 1.0).abs() < 0.005,
        "{}",
        tiling.parts[1].volume_mm3
    );
    each_point_in_one_part(&tiling, &f, around(extent), 0.7);

    // The loss goes with the spacing's square: a tolerance below it makes the default finer.
    let strict = TilingOptions {
        volume_tolerance: Some(0.001),
        ..options.clone()
    };
    let finer = tile(&f, around(extent), &[], &|_| Some(0), &strict).expect("finer");
    assert!(finer.spacing_mm.max() < 0.8 * tiling.spacing_mm.max());
    assert!((finer.volume_mm3 / 50_000.0 - 1.0).abs() <= 0.001);

    let coarse = TilingOptions {
        spacing_mm: Some(6.0),
        ..options
    };
    let error = tile(&f, around(extent), &[], &|_| Some(0), &coarse).expect_err("rims of 6 mm");
    assert!(
        matches!(error, TilingError::Volume { percent, .. } if percent < -0.5),
        "{error}"
    );
}

/// 20° about each axis in turn: no face, edge or diagonal stays on the lattice.
fn skew() -> Mat3 {
    let (s, c) = 20_f64.to_radians().sin_cos();
    let about_x = Mat3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
    let about_y = Mat3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c);
    let about_z = Mat3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    about_z * about_y * about_x
}

/// A sole in six layers of three materials with a heel region; the same bits on one thread and on two.
#[test]
fn sole_at_print_size() {
    let (f, bounds) = sole();
    let planes: Vec<_> = (1..6)
        .map(|k| move |x: &Vec3| x.z - 20.0 / 6.0 * f64::from(k))
        .collect();
    let heel = |x: &Vec3| x.x + 40.0;
    let mut levels: Vec<LevelSet> = planes.iter().map(|p| p as LevelSet).collect();
    levels.push(&heel);
    let label = |x: &Vec3| Some(((x.z / (20.0 / 6.0)) as usize + usize::from(heel(x) > 0.0)) % 3);
    let tile_on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        let start = std::time::Instant::now();
        let tiling = pool
            .install(|| tile(&f, bounds, &levels, &label, &TilingOptions::default()))
            .expect("tiles");
        println!(
            "sole, {threads} threads: {:.2} s, {} triangles, spacing {:?}",
            start.elapsed().as_secs_f64(),
            tiling.parts.iter().map(|p| p.mesh.triangles.len()).sum::<usize>(),
            tiling.spacing_mm.as_slice(),
        );
        tiling
    };
    let tiling = tile_on(1);
    assert!(tiling == tile_on(2));
    checked(&tiling);
    // Area of |x/a|⁴ + |y/b(x)|⁴ < 1 by the midpoint rule in x, far finer than the lattice.
    let n = 100_000;
    let area: f64 = (0..n)
        .map(|i| {
            let x = -130.0 + 260.0 * (f64::from(i) + 0.5) / f64::from(n);
            2.0 * (42.0 + 8.0 * (x / 40.0).sin()) * (1.0 - (x / 130.0).powi(4)).powf(0.25) * 260.0
                / f64::from(n)
        })
        .sum();
    let off = tiling.volume_mm3 / (20.0 * area) - 1.0;
    println!("sole: volume off by {:.4} %", 100.0 * off);
    assert!(off.abs() < 0.001, "{off}");
    each_point_in_one_part(&tiling, &f, bounds, 0.5);
}

/// No edge of the result collapses when vertices go to single precision, which is what STL and 3MF hold.
#[test]
fn edges_survive_single_precision() {
    let (f, bounds) = sole();
    let tilted = |x: &Vec3| x.z - 7.0 - 0.013 * x.x + 0.02 * x.y;
    let wave = |x: &Vec3| x.z - 12.0 - (x.x / 17.0).sin() - (x.y / 13.0).cos();
    let label = |x: &Vec3| Some(usize::from(tilted(x) > 0.0) + usize::from(wave(x) > 0.0));
    let tiling = tile(&f, bounds, &[&tilted, &wave], &label, &spacing(2.0)).expect("tiles");
    checked(&tiling);
    let mut shortest = f64::INFINITY;
    for part in &tiling.parts {
        for t in &part.mesh.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                shortest =
                    shortest.min((part.mesh.vertices[a as usize] - part.mesh.vertices[b as usize]).norm());
            }
        }
    }
    println!("shortest edge {shortest:.2e} mm");
    // Between 128 and 256 mm neighbouring f32 are 1.5e-5 mm apart.
    assert!(shortest > 1e-4, "{shortest}");
}

#[test]
fn mistakes_are_named() {
    let f = ball(1.0);
    let unit = around(Vec3::repeat(1.0));
    let all = |_: &Vec3| Some(0);
    let bad = TilingOptions {
        spacing_mm: Some(-1.0),
        ..TilingOptions::default()
    };
    assert!(matches!(
        tile(&f, unit, &[], &all, &bad),
        Err(TilingError::Option {
            field: "spacing_mm",
            ..
        })
    ));
    assert!(matches!(
        tile(&f, unit, &[], &all, &spacing(1e-4)),
        Err(TilingError::TooFine { .. })
    ));
    let flat = (Vec3::zeros(), Vec3::new(1.0, 1.0, 0.0));
    assert!(matches!(
        tile(&f, flat, &[], &all, &spacing(0.1)),
        Err(TilingError::Bounds { .. })
    ));
    let nan: LevelSet = &|_| f64::NAN;
    assert!(matches!(
        tile(&f, unit, &[nan], &all, &spacing(0.1)),
        Err(TilingError::Cut(CutError::NotFinite { .. }))
    ));
    assert!(matches!(
        tile(&f, unit, &[], &|_| None, &spacing(0.1)),
        Err(TilingError::Empty { .. })
    ));
}
