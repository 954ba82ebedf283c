//! From a goal to files.

use crate::support::{GOAL, design, pliant};
use std::path::Path;

fn replicate(folder: &Path, more: &[&str]) -> serde_json::Value {
    let mut arguments = vec!["replicate", ".", "--json", "--export", "out"];
    arguments.extend(more);
    let output = pliant(folder, &arguments).output().unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn writes_layout_report_and_printer_files() {
    let folder = design(GOAL);
    let found = replicate(folder.path(), &[]);
    assert_eq!(found["cells"].as_array().unwrap().len(), 2);
    assert!(found["rms_mm"].as_f64().unwrap() <= found["best_single_material_rms_mm"].as_f64().unwrap());
    let page = std::fs::read_to_string(folder.path().join("found/report.html")).unwrap();
    assert!(page.contains("<svg") && !page.contains("http://localhost") && !page.contains("NaN"));
    // The parts fill the block: 50 × 40 × 25 mm.
    let manifest = std::fs::read_to_string(folder.path().join("out/manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    fn volumes(value: &serde_json::Value, sum: &mut f64) {
        match value {
            serde_json::Value::Object(map) => {
                *sum += map.get("volume_mm3").and_then(|v| v.as_f64()).unwrap_or(0.0);
                map.values().for_each(|v| volumes(v, sum));
            }
            serde_json::Value::Array(list) => list.iter().for_each(|v| volumes(v, sum)),
            _ => {}
        }
    }
    let mut sum = 0.0;
    volumes(&manifest["files"], &mut sum);
    if sum == 0.0 {
        volumes(&manifest, &mut sum);
    }
    assert!(
        (sum / 50_000.0 - 1.0).abs() < 0.005 || (sum / 100_000.0 - 1.0).abs() < 0.005,
        "{sum} mm³"
    );
}

#[test]
fn exhaustive_search_is_at_least_as_good_and_threads_change_nothing() {
    let folder = design(GOAL);
    let tree = replicate(folder.path(), &["--threads", "1"]);
    let layout_of_one = std::fs::read(folder.path().join("found/layout.toml")).unwrap();
    replicate(folder.path(), &["--threads", "2"]);
    assert_eq!(
        layout_of_one,
        std::fs::read(folder.path().join("found/layout.toml")).unwrap()
    );
    let all = replicate(folder.path(), &["--method", "exhaustive"]);
    assert_eq!(all["simulations"], 9);
    assert!(all["rms_mm"].as_f64().unwrap() <= tree["rms_mm"].as_f64().unwrap() + 1e-12);
}

#[test]
fn a_found_layout_is_exported_again_without_a_search() {
    let folder = design(GOAL);
    replicate(folder.path(), &["--no-export"]);
    assert!(!folder.path().join("out").exists());
    let export = pliant(folder.path(), &["export", ".", "--out", "again"])
        .output()
        .unwrap();
    assert!(
        export.status.success(),
        "{}",
        String::from_utf8_lossy(&export.stderr)
    );
    assert!(folder.path().join("again/manifest.json").exists());
    // A goal that changed since makes the layout stale: exit code 2 and the mend.
    std::fs::write(
        folder.path().join("goal.toml"),
        GOAL.replace("[0.9, 1.7]", "[0.9, 1.8]"),
    )
    .unwrap();
    let stale = pliant(folder.path(), &["export", ".", "--out", "third"])
        .output()
        .unwrap();
    assert_eq!(stale.status.code(), Some(2));
    let said = String::from_utf8_lossy(&stale.stderr).replace('\n', " ");
    assert!(
        said.contains("changed") && said.contains("pliant replicate"),
        "{said}"
    );
    assert!(!folder.path().join("third").exists());
}

#[test]
fn an_export_before_any_search_says_what_to_do() {
    let folder = design(GOAL);
    let output = pliant(folder.path(), &["export", "."]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("replicate"));
}

#[test]
fn forces_beyond_every_material_are_an_error_and_leave_nothing_behind() {
    let goal = GOAL.replace("forces_n = [4, 8]", "forces_n = [4000, 8000]");
    let folder = design(&goal);
    let output = pliant(folder.path(), &["replicate", "."]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("lower the forces"));
    assert!(!folder.path().join("found").exists() && !folder.path().join("export").exists());
}

/// Ctrl-C keeps the best layout so far.
#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_search_with_what_it_has() {
    let goal = GOAL
        .replace("layers = 2", "layers = 8")
        .replace("element_size = \"10 mm\"", "element_size = \"3 mm\"");
    let folder = design(&goal);
    let child = std::process::Command::new(env!("CARGO_BIN_EXE_pliant"))
        .current_dir(folder.path())
        .args(["replicate", ".", "--json", "--export", "out"])
        .args(["--db", concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db")])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // The first level of eight takes longer than this; the whole search minutes.
    std::thread::sleep(std::time::Duration::from_secs(4));
    let killed = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["ended"], "interrupted");
    assert!(found["rms_mm"].as_f64().unwrap().is_finite());
}
