//! `pliant object`, as it is typed.

use super::scans::shared;
use assert_cmd::Command;
use serde_json::Value;

fn pliant(arguments: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_pliant"))
        .args(arguments)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    // The terminal wraps messages where it likes.
    String::from_utf8_lossy(bytes)
        .split_whitespace()
        .filter(|word| *word != "│")
        .collect::<Vec<_>>()
        .join(" ")
}

#[test]
fn each_option_reaches_its_measure() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("object.stl");
    let out = path.to_str().unwrap();
    let measured = |arguments: &[&str]| -> Value {
        let answer = pliant(&[&["object", "--json"], arguments, &["--out", out]].concat());
        assert_eq!(answer.status.code(), Some(0), "{}", text(&answer.stderr));
        serde_json::from_slice(&answer.stdout).unwrap()
    };
    let plain: Vec<Value> = ["block", "sole", "seat"]
        .iter()
        .map(|kind| measured(&[kind]))
        .collect();
    // Option by option another value changes the surface; equal volumes and sizes mean that it went nowhere.
    for (kind, option, value) in [
        (0, "--width", "60mm"),
        (0, "--depth", "5 cm"),
        (0, "--height", "1in"),
        (0, "--spacing", "5mm"),
        (1, "--length", "250mm"),
        (1, "--ball-width", "90mm"),
        (1, "--heel-width", "60mm"),
        (1, "--heel-thickness", "25mm"),
        (1, "--toe-thickness", "12mm"),
        (1, "--footbed-depth", "0mm"),
        (1, "--toe-spring", "10mm"),
        (1, "--rim-radius", "0mm"),
        (1, "--spacing", "8mm"),
        (2, "--diameter", "300mm"),
        (2, "--thickness", "70mm"),
        (2, "--dome", "5mm"),
        (2, "--button-radius", "30mm"),
        (2, "--button-depth", "0mm"),
        (2, "--rim-radius", "10mm"),
        (2, "--spacing", "15mm"),
    ] {
        let changed = measured(&[["block", "sole", "seat"][kind], option, value]);
        assert_ne!(
            changed["volume_mm3"],
            plain[kind]["volume_mm3"].as_f64().map_or(Value::Null, |v| {
                // Finer or coarser triangles leave the block's volume, and change their number.
                if changed["triangles"] == plain[kind]["triangles"] {
                    v.into()
                } else {
                    Value::Null
                }
            }),
            "{option}"
        );
    }
    assert_eq!(plain[0]["size_mm"], serde_json::json!([50.0, 40.0, 25.0]));
    // What was written is what was said, and nothing else is left in the folder.
    let seen = pliant(&["object", "--json", "inspect", out, "--unit", "mm"]);
    let seen: Value = serde_json::from_slice(&seen.stdout).unwrap();
    assert_eq!(seen["open_edges"], 0);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn mistakes_end_with_two_and_say_what_to_write() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("object.stl");
    let out = path.to_str().unwrap();
    for (arguments, part) in [
        (
            vec!["object", "sole", "--out", out, "--length", "260"],
            "such as \"25 mm\"",
        ),
        (
            vec!["object", "sole", "--out", out, "--heel-width", "3m"],
            "heel_width = 3000 mm",
        ),
        (
            vec!["object", "block", "--out", "/nowhere/at/all.stl"],
            "/nowhere/at/all.stl",
        ),
        (vec!["object", "block"], "--out"),
        (vec!["object", "inspect", "insole.amf"], ".3mf"),
    ] {
        let answer = pliant(&arguments);
        assert_eq!(answer.status.code(), Some(2), "{arguments:?}");
        let said = text(&answer.stderr);
        assert!(
            said.contains(part) || said.replace(' ', "").contains(part),
            "{part} in {said}"
        );
    }
    assert!(!path.exists());
}

#[test]
fn tetrahedra_are_written_with_their_layer_and_their_quality() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (stl, vtu) = (path("block.stl"), path("block.vtu"));
    assert_eq!(pliant(&["object", "block", "--out", &stl]).status.code(), Some(0));
    let mesh = [
        "object",
        "--json",
        "tetrahedra",
        &stl,
        "--unit",
        "mm",
        "--edge",
        "8mm",
    ];
    let said = |more: &[&str]| -> Value {
        let answer = pliant(&[&mesh[..], more].concat());
        assert_eq!(answer.status.code(), Some(0), "{}", text(&answer.stderr));
        serde_json::from_slice(&answer.stdout).unwrap()
    };
    let plain = said(&["--layers", "5", "--out", &vtu]);
    assert_eq!(plain["layers"], 5);
    // 50 × 40 × 25 mm in five layers of 5 mm: 6 × 5 × 5 boxes of six tetrahedra.
    assert_eq!(plain["tetrahedra"], 900);
    assert!(plain["least_dihedral_deg"].as_f64().unwrap() > 10.0);
    assert!(plain["volume_error"].as_f64().unwrap().abs() < 1e-9);
    let written = std::fs::read(&vtu).unwrap();
    assert!(written.windows(11).any(|w| w == b"Name=\"cell\""));
    // Other values go somewhere.
    assert_eq!(said(&["--least-angle", "20"])["bound_deg"], 20.0);
    assert_ne!(said(&["--layers", "5", "--axis", "x"])["nodes"], plain["nodes"]);
    let short = pliant(&["object", "tetrahedra", &stl, "--unit", "mm", "--edge", "8mm"]);
    assert!(text(&short.stdout).contains("dihedral angles"));
    let wrong = pliant(&[&mesh[..], &["--out", &path("block.obj")]].concat());
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong.stderr).contains(".vtu"));
}

#[test]
fn a_hopeless_scan_is_a_negative_answer() {
    let Some(path) = shared("objects/sheepskin_boot.obj") else {
        return;
    };
    let answer = pliant(&["object", "inspect", path.to_str().unwrap(), "--unit", "m"]);
    assert_eq!(answer.status.code(), Some(1));
    assert!(text(&answer.stderr).contains("136 open edges"));
}
