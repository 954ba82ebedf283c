//! The blocks of tubes in the database: computed by the laboratory as it is, and right about a block that no fit has seen.

use pliant::fem::equilibrium::Options;
use pliant::fem::measurement_set::{MeasurementSet, Origin};
use pliant::laboratory::compare::compare;
use pliant::laboratory::measure::Wired;
use pliant::laboratory::read::Laboratory;
use pliant::laboratory::set::measurement_set;
use pliant::material::database::Database;
use std::path::{Path, PathBuf};

const TUBES: [&str; 4] = [
    "tubes-coarse-open",
    "tubes-coarse-wide",
    "tubes-fine-open",
    "tubes-fine-wide",
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("materials-db")
}

/// A block three fifths as high as the one that was fitted. Walls, cut ends and the neighbourhood of the disc don't behave as
/// their average: over the four presses of a structure the markers' errors stay below 10 % of their displacements (root mean
/// squares), and below 12 % in each press alone (11.3 % where the widest tubes are pressed from the side).
#[test]
fn records_of_tubes_predict_a_thinner_block() {
    let database = Database::open(&folder()).unwrap();
    for id in TUBES {
        let record = database.find(id).unwrap();
        assert!(record.synthetic && record.model.centres.len() == 12, "{id}");
        let set = MeasurementSet::open(&folder().join(format!("sets/thin/{id}.toml"))).unwrap();
        let errors = compare(&set, &[], &record.law().unwrap(), &Options::default()).unwrap();
        assert_eq!(errors.len(), 8, "{id}");
        let (mut off, mut moved) = (0.0, 0.0);
        for e in &errors {
            println!("{id} {} {} N: {:.1} %", e.probe, e.force_n, 100.0 * e.relative());
            assert!(e.moved_rms_mm > 0.05 && e.relative() < 0.12, "{id}: {e:?}");
            off += e.rms_mm * e.rms_mm;
            moved += e.moved_rms_mm * e.moved_rms_mm;
        }
        let whole = (off / moved).sqrt();
        println!("{id}: {:.1} %", 100.0 * whole);
        assert!(whole < 0.10, "{id}: {whole}");
    }
}

/// Each set says from what it was computed, which is what its laboratory says today.
#[test]
fn sets_of_tubes_belong_to_their_laboratories() {
    for (kind, id) in TUBES.iter().flat_map(|id| [("", id), ("thin/", id)]) {
        let set = MeasurementSet::open(&folder().join(format!("sets/{kind}{id}.toml"))).unwrap();
        let laboratory = folder().join(format!("laboratory/{kind}{id}.toml"));
        let laboratory = Laboratory::open(&laboratory, &folder()).unwrap();
        let Origin::Computed(words) = measurement_set(&laboratory, &[], &[]).origin else {
            panic!("measured")
        };
        assert_eq!(set.origin, Origin::Computed(words));
        assert_eq!(set.material, laboratory.card);
        let (names, probes): (Vec<&str>, Vec<&str>) = (
            set.experiments.iter().map(|e| e.name.as_str()).collect(),
            laboratory.probes.iter().map(|p| p.name.as_str()).collect(),
        );
        assert_eq!(names, probes);
    }
}

/// One press of a set, computed again: the file's six digits to two units in the last.
#[test]
fn slow_a_press_of_a_set_is_computed_again() {
    let id = "thin/tubes-fine-open";
    let set = MeasurementSet::open(&folder().join(format!("sets/{id}.toml"))).unwrap();
    let laboratory = Laboratory::open(&folder().join(format!("laboratory/{id}.toml")), &folder()).unwrap();
    let wired = Wired::new(&laboratory).unwrap();
    let done = wired
        .measure(&[0], 1, &Options::default(), &|_, _| {}, &|| false)
        .unwrap();
    let (experiment, press) = (&set.experiments[0], &done[0].1);
    assert_eq!(experiment.points.len(), wired.markers.len());
    for (point, marker) in experiment.points.iter().zip(0..) {
        for (level, kept) in point.displacements_mm.iter().enumerate() {
            for (kept, found) in kept.iter().zip(press.markers_mm[level][marker]) {
                assert!((kept.unwrap() - found).abs() < 2e-6, "{kept:?} {found}");
            }
        }
    }
}
