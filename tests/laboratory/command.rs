//! `pliant measure` as people run it.

use crate::support::{HEAD, MIDDLE, SIDE, SOLID, TUBES, laboratory};
use assert_cmd::Command;
use pliant::fem::equilibrium::Options;
use pliant::fem::measurement_set::{MeasurementSet, Origin};
use pliant::laboratory::aside::Aside;
use pliant::laboratory::measure::Wired;
use std::path::Path;

/// Exit code, standard output, standard error.
fn measure(folder: &Path, text: &str, more: &[&str]) -> (i32, String, String) {
    std::fs::write(folder.join("laboratory.toml"), text).unwrap();
    let mut command = Command::cargo_bin("pliant").unwrap();
    command
        .current_dir(folder)
        .args(["measure", "laboratory.toml", "--out", "sets"])
        .args(more);
    command.args(["--db", concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db")]);
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code().unwrap(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

#[test]
fn a_set_is_written_read_and_compared() {
    let folder = tempfile::tempdir().unwrap();
    let text = [HEAD, TUBES, MIDDLE, SIDE].concat();
    let (code, out, err) = measure(folder.path(), &text, &["--against", "ecoflex-00-30"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("markers off by"), "{out}");
    let set = MeasurementSet::open(&folder.path().join("sets/small.toml")).unwrap();
    let Origin::Computed(words) = &set.origin else {
        panic!("measured")
    };
    assert!(
        words.contains("hexagonal") && words.contains("young = \"1 MPa\"") && words.contains("nodes"),
        "{words}"
    );
    assert_eq!(set.experiments.len(), 2);
    // The drag stays in the force: 2 N along (0, 1, 0.3).
    let force = set.experiments[1].forces[0];
    assert!((force.norm() - 2.0).abs() < 1e-12 && (force.z / force.y - 0.3).abs() < 1e-12);
    assert!(!folder.path().join("sets/.measuring-small").exists());
    let csv = std::fs::read(folder.path().join("sets/small/middle.csv")).unwrap();
    // The same again gives the same bytes.
    std::fs::remove_dir_all(folder.path().join("sets")).unwrap();
    assert_eq!(measure(folder.path(), &text, &["--jobs", "2", "--json"]).0, 0);
    assert_eq!(
        std::fs::read(folder.path().join("sets/small/middle.csv")).unwrap(),
        csv
    );
}

#[test]
fn a_run_that_was_broken_off_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let parts = [HEAD, SOLID, MIDDLE, SIDE];
    let laboratory = laboratory(folder.path(), &parts);
    let wired = Wired::new(&laboratory).unwrap();
    let done = wired
        .measure(&[0], 1, &Options::default(), &|_, _| {}, &|| false)
        .unwrap();
    let aside = Aside::new(&laboratory, &folder.path().join("sets"));
    // What is found is taken, not computed again: the mark stands in the set.
    let mut marked = done[0].1.clone();
    marked.markers_mm[0][0][2] = -0.123456;
    aside.keep(&laboratory.probes[0], &marked).unwrap();
    let (code, out, err) = measure(folder.path(), &parts.concat(), &[]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("1 presses were finished before"), "{out}");
    let csv = std::fs::read_to_string(folder.path().join("sets/small/middle.csv")).unwrap();
    assert!(csv.contains("-0.123456"), "{csv}");
    assert!(folder.path().join("sets/small/side.csv").exists());
}

/// A load that folds the block is not reached: the levels below it are kept, with a warning and exit code 1.
#[test]
fn a_press_that_gives_in_leaves_the_levels_that_it_reached() {
    let folder = tempfile::tempdir().unwrap();
    let hard = MIDDLE.replace("[1, 3]", "[1, 2000]");
    let (code, _, err) = measure(folder.path(), &[HEAD, SOLID, &hard].concat(), &[]);
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("1 levels reached"), "{err}");
    let set = MeasurementSet::open(&folder.path().join("sets/small.toml")).unwrap();
    assert_eq!(set.experiments[0].forces.len(), 1);
}

#[test]
fn mistakes_are_answered_with_their_place_and_nothing_is_written() {
    let good = [HEAD, TUBES, MIDDLE].concat();
    let wrong = [
        ("schema = 1", "schema = 9", "schema 9"),
        ("\"2 mm\"", "\"4.9 mm\"", "diameter = 4.9"),
        ("spacing = \"5 mm\"", "spacing = 5", ":"),
        ("count = [4, 4]", "count = [0, 4]", "tubes in a row"),
        (
            "[tubes]",
            "[solid]\nsize_mm = [1, 1, 1]\nelement_size = \"1 mm\"\n[tubes]",
            "expected one of",
        ),
        ("face = \"z+\"", "face = \"up\"", "found face \"up\""),
        ("\"middle\"", "\"../middle\"", "lower-case letters"),
        ("[1, 3]", "[3, 1]", "rising"),
        ("[10, 8, 10]", "[10, 80, 10]", "does not lie on the face"),
        ("[10, 8, 10]", "[10, 8, 30]", "does not lie on the face"),
        (
            "face = \"bottom\"",
            "box_mm = [[0, 0, 40], [1, 1, 50]]",
            "holds no node",
        ),
        ("density = \"1.2 g/cm3\"\n", "", "density"),
        (
            "[base.law]\nlaw = \"linear\"\nyoung = \"1 MPa\"\npoisson = 0.4\ndensity = \"1.2 g/cm3\"",
            "[base]\nrecord = \"no-such\"",
            "no-such",
        ),
        (
            "radius = \"4 mm\"",
            "radius = \"0.01 mm\"",
            "no material lies under the disc",
        ),
    ];
    for (from, to, said) in wrong {
        let folder = tempfile::tempdir().unwrap();
        let text = good.replacen(from, to, 1);
        assert_ne!(text, good, "{from}");
        let (code, _, err) = measure(folder.path(), &text, &[]);
        assert_eq!(code, 2, "{to}: {err}");
        assert!(
            err.contains("laboratory.toml:") && err.contains(said),
            "{to}: {err}"
        );
        assert!(!folder.path().join("sets").exists(), "{to}");
    }
}
