//! A real scan with real foams: a shoe insole (an open data set's mesh, with its odd face count) whose heel, middle and toe are
//! made of the foams measured on a worn sole, replicated in silicones. The reference displacements are computed from the
//! fitted foams, not measured on an insole.

use assert_cmd::Command;
use std::path::Path;

const SCAN: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../shared/data/objects/gensole_Left-Insole.stl"
);
const TEXTS: [(&str, &str); 2] = [
    ("original.toml", include_str!("insole/original.toml")),
    ("goal.toml", include_str!("insole/goal.toml")),
];

fn pliant(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let output = Command::cargo_bin("pliant")
        .unwrap()
        .current_dir(folder)
        .args(arguments)
        .args([
            "--json",
            "--db",
            concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db"),
        ])
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn slow_insole_of_measured_foams_is_replicated_in_silicones() {
    if !Path::new(SCAN).exists() {
        println!("skipped: {SCAN} is missing");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in TEXTS {
        std::fs::write(folder.path().join(name), text.replace("MESH", SCAN)).unwrap();
    }
    pliant(folder.path(), &["simulate", "original.toml", "--out", "original"]);
    let found = pliant(folder.path(), &["replicate", "goal.toml", "--export", "export"]);
    println!("{found:#}");
    let number = |key: &str| found[key].as_f64().unwrap();
    let (rms, single) = (number("rms_mm"), number("best_single_material_rms_mm"));
    println!(
        "insole: RMS {rms:.4} mm of {:.2} mm, best single material {single:.4} mm, {:.0} s",
        number("largest_target_mm"),
        number("whole_s")
    );
    // Three regions of different foams: no single silicone can follow all of them.
    assert!(rms < 0.9 * single);
    assert!(
        folder.path().join("found/report.html").exists()
            && folder.path().join("export/manifest.json").exists()
    );
}
