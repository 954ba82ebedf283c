//! Presses in the laboratory: a solid block is a homogeneous one; lattices that fill space are solid; noise is what it says.

use crate::support::{HEAD, MIDDLE, SIDE, SOLID, TUBES, laboratory};
use pliant::fem::equilibrium::Options;
use pliant::fem::measurement_set::MeasurementSet;
use pliant::fem::measurement_set::write::write_set;
use pliant::geometry::files::write_stl;
use pliant::geometry::shapes::block;
use pliant::laboratory::aside::Aside;
use pliant::laboratory::compare::compare;
use pliant::laboratory::measure::{Press, Wired};
use pliant::laboratory::read::Laboratory;
use pliant::laboratory::set::measurement_set;
use pliant::math::Vec3;
use std::path::Path;

fn presses(laboratory: &Laboratory, jobs: usize) -> Vec<Press> {
    let wired = Wired::new(laboratory).unwrap();
    let all: Vec<usize> = (0..laboratory.probes.len()).collect();
    let done = wired
        .measure(&all, jobs, &Options::default(), &|_, _| {}, &|| false)
        .unwrap();
    done.into_iter().map(|(_, press)| press).collect()
}

fn written(laboratory: &Laboratory, presses: &[Press], folder: &Path) -> MeasurementSet {
    let wired = Wired::new(laboratory).unwrap();
    let set = measurement_set(laboratory, &wired.markers, presses);
    MeasurementSet::open(&write_set(&set, folder).unwrap()).unwrap()
}

/// The set of a solid block, pressed as a homogeneous block of the base material by code that knows nothing of the laboratory:
/// same elements, but the patch is summed over other spots, so 1 % is allowed.
#[test]
fn a_solid_block_is_a_homogeneous_one() {
    let folder = tempfile::tempdir().unwrap();
    let laboratory = laboratory(folder.path(), &[HEAD, SOLID, MIDDLE, SIDE]);
    let presses = presses(&laboratory, 1);
    assert!(presses.iter().all(|p| p.is_complete), "{presses:?}");
    let set = written(&laboratory, &presses, folder.path());
    assert_eq!(set.experiments.len(), 2);
    let errors = compare(&set, &presses, &laboratory.base.law, &Options::default()).unwrap();
    assert_eq!(errors.len(), 3);
    for e in errors {
        assert!(e.moved_rms_mm > 0.03, "{e:?}");
        assert!(
            e.relative() < 0.01 && e.relative_at_probe().unwrap() < 0.01,
            "{e:?}"
        );
    }
}

/// Shares of a force add up to one, and its resultant acts at the middle of the disc, on walls as on a solid face where the
/// disc's middle is one of the array's centres of symmetry.
#[test]
fn the_force_is_whole_and_acts_at_the_middle() {
    let folder = tempfile::tempdir().unwrap();
    for structure in [SOLID, TUBES] {
        // The middle of the third tube of the second row, about which the array is symmetric.
        let probe = MIDDLE.replace("[10, 8, 10]", "[10, 6.4952, 10]");
        let laboratory = laboratory(folder.path(), &[HEAD, structure, &probe]);
        let wired = Wired::new(&laboratory).unwrap();
        let nodes = &wired.model.mesh.nodes;
        let total: f64 = wired.shares[0].iter().sum();
        let middle: Vec3 = nodes.iter().zip(&wired.shares[0]).map(|(x, s)| x * *s).sum();
        assert!((total - 1.0).abs() < 1e-12);
        // Spots lie 0.25 mm apart, on a disc of 4 mm.
        assert!((middle - Vec3::new(10.0, 6.4952, 10.0)).norm() < 0.05, "{middle}");
    }
}

/// Tubes soften the block; the homogeneous block of the base material is far off, and says so.
#[test]
fn tubes_soften() {
    let folder = tempfile::tempdir().unwrap();
    let laboratory = laboratory(folder.path(), &[HEAD, TUBES, MIDDLE, SIDE]);
    let side_by_side = presses(&laboratory, 2);
    assert_eq!(
        side_by_side,
        presses(&laboratory, 1),
        "depends on the number of jobs"
    );
    let set = written(&laboratory, &side_by_side, folder.path());
    assert!((set.material.density_g_per_cm3 - 1.2 * laboratory.fine.solid_share).abs() < 1e-3);
    let errors = compare(&set, &side_by_side, &laboratory.base.law, &Options::default()).unwrap();
    for e in &errors {
        assert!(
            e.relative_at_probe().unwrap() > 0.15 && e.relative() > 0.1,
            "{e:?}"
        );
    }
}

/// A cube as surface, repeated, and a voxel image without holes are the solid block: the same elements, the same answer to
/// rounding. With one voxel of eight missing the block is softer, whether a voxel is an element or an octant of one.
#[test]
fn lattices_that_fill_space_are_solid() {
    let folder = tempfile::tempdir().unwrap();
    let cube = block(Vec3::new(10.0, 8.0, 10.0), 2.0).unwrap();
    let mut stl = Vec::new();
    write_stl(&cube, &mut stl).unwrap();
    std::fs::write(folder.path().join("cell.stl"), stl).unwrap();
    let image = |name: &str, hole: bool| {
        let mut bytes =
            b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 10 8 10\nspacings: 1 1 1\nencoding: raw\n\n"
                .to_vec();
        for k in 0..10 {
            for j in 0..8 {
                bytes.extend((0..10).map(|i| u8::from(!(hole && i % 2 == 1 && j % 2 == 1 && k % 2 == 1))));
            }
        }
        std::fs::write(folder.path().join(name), bytes).unwrap();
    };
    image("full.nrrd", false);
    image("holes.nrrd", true);
    let at_probe = |structure: &str| {
        let laboratory = laboratory(folder.path(), &[HEAD, structure, MIDDLE]);
        let press = presses(&laboratory, 1).remove(0);
        assert!(press.is_complete, "{press:?}");
        (laboratory.fine.solid_share, press.probe_mm[1][2])
    };
    let (_, solid) = at_probe(SOLID);
    let surface =
        "[surface]\nfile = \"cell.stl\"\nunit = \"mm\"\nrepeat = [2, 2, 1]\nelement_size = \"2 mm\"\n";
    let voxels = |file: &str, per: usize| {
        format!("[voxels]\nfile = \"{file}\"\nper_element = {per}\nrepeat = [2, 2, 1]\n")
    };
    let (share, moved) = at_probe(surface);
    assert!(
        (share - 1.0).abs() < 1e-3 && (moved / solid - 1.0).abs() < 1e-3,
        "{share} {moved} {solid}"
    );
    let (share, moved) = at_probe(&voxels("full.nrrd", 2));
    assert!(
        (share - 1.0).abs() < 1e-12 && (moved / solid - 1.0).abs() < 1e-9,
        "{moved} {solid}"
    );
    let (octants, by_octants) = at_probe(&voxels("holes.nrrd", 2));
    let (elements, by_elements) = at_probe(&voxels("holes.nrrd", 1));
    assert!((octants - 0.875).abs() < 1e-12 && (elements - 0.875).abs() < 1e-12);
    assert!(
        by_octants / solid > 1.05 && by_elements / solid > 1.05,
        "{by_octants} {by_elements} {solid}"
    );
}

/// Errors have the asked deviation, no mean, and come again with their seed.
#[test]
fn noise_is_seeded_and_of_the_asked_size() {
    let folder = tempfile::tempdir().unwrap();
    let clean = laboratory(folder.path(), &[HEAD, SOLID, MIDDLE, SIDE]);
    let presses = presses(&clean, 1);
    let set = written(&clean, &presses, folder.path());
    let noisy = |seed: u64| {
        let noise = format!("[noise]\ndeviation = \"0.02 mm\"\nseed = {seed}\n");
        let noisy = laboratory(folder.path(), &[HEAD, SOLID, MIDDLE, SIDE, &noise]);
        written(&noisy, &presses, folder.path())
    };
    let errors = |noisy: &MeasurementSet| -> Vec<f64> {
        let all = |set: &MeasurementSet| -> Vec<f64> {
            let points = set.experiments.iter().flat_map(|e| &e.points);
            points
                .flat_map(|p| {
                    p.displacements_mm
                        .iter()
                        .flatten()
                        .flatten()
                        .copied()
                        .collect::<Vec<_>>()
                })
                .collect()
        };
        all(noisy).iter().zip(all(&set)).map(|(a, b)| a - b).collect()
    };
    let (first, again, other) = (errors(&noisy(7)), errors(&noisy(7)), errors(&noisy(8)));
    assert_eq!(first, again);
    assert_ne!(first, other);
    let n = first.len() as f64;
    let mean = first.iter().sum::<f64>() / n;
    let deviation = (first.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    // n = 261: the mean's own deviation is 0.0012 mm, the deviation's 0.0009 mm; four of each.
    assert!(
        first.len() > 200 && mean.abs() < 0.005 && (deviation - 0.02).abs() < 0.004,
        "{mean} {deviation}"
    );
    assert_eq!(noisy(7).experiments[0].deviations_mm[0][0], 0.02);
}

/// What was finished is found again; what depends on something that changed is not.
#[test]
fn finished_presses_are_found_again_unless_something_changed() {
    let folder = tempfile::tempdir().unwrap();
    let before = laboratory(folder.path(), &[HEAD, TUBES, MIDDLE, SIDE]);
    let done = presses(&before, 1);
    let aside = Aside::new(&before, folder.path());
    for (probe, press) in before.probes.iter().zip(&done) {
        assert_eq!(aside.find(probe), None);
        aside.keep(probe, press).unwrap();
    }
    let side = SIDE.replace("[2]", "[2.5]");
    let changed = laboratory(folder.path(), &[HEAD, TUBES, MIDDLE, &side]);
    let again = Aside::new(&changed, folder.path());
    assert_eq!(again.find(&changed.probes[0]).as_ref(), Some(&done[0]));
    assert_eq!(again.find(&changed.probes[1]), None);
    let finer = TUBES.replace("layers = 4", "layers = 5");
    let finer = laboratory(folder.path(), &[HEAD, &finer, MIDDLE, SIDE]);
    assert_eq!(Aside::new(&finer, folder.path()).find(&finer.probes[0]), None);
    aside.clear();
    assert_eq!(aside.find(&before.probes[0]), None);
}
