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
    // The journal alone, with what was simulated.
    for file in ["found/layout.toml", "found/report.html", "export"] {
        assert!(!folder.path().join(file).exists(), "{file}");
    }
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
    std::thread::sleep(std::time::Duration::from_secs(10));
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

/// A second search asks the journal and answers the same.
#[test]
fn a_journal_saves_simulations_and_changes_no_answer() {
    let folder = design(GOAL);
    let first = replicate(folder.path(), &["--seed", "3"]);
    let layout = std::fs::read(folder.path().join("found/layout.toml")).unwrap();
    let again = replicate(folder.path(), &["--seed", "3"]);
    assert_eq!(
        (&first["from_journal"], &again["from_journal"]),
        (&0.into(), &first["simulations"])
    );
    assert_eq!(
        layout,
        std::fs::read(folder.path().join("found/layout.toml")).unwrap()
    );
    // Another target and another method find what fits; another tolerance finds nothing.
    let goal = GOAL.replace("[0.9, 1.7]", "[0.8, 1.5]");
    std::fs::write(folder.path().join("goal.toml"), goal).unwrap();
    let other = replicate(folder.path(), &["--method", "exhaustive", "--tolerance", "1e-5"]);
    assert_eq!(other["from_journal"], 9);
    assert_eq!(
        replicate(folder.path(), &["--tolerance", "1e-6"])["from_journal"],
        0
    );
    assert_eq!(replicate(folder.path(), &["--no-journal"])["from_journal"], 0);
}

#[test]
fn a_journal_that_is_none_is_an_error_and_is_left_alone() {
    let folder = design(GOAL);
    let file = folder.path().join("notes.txt");
    for text in [b"not a journal".to_vec(), vec![7u8; 100_000]] {
        std::fs::write(&file, &text).unwrap();
        let output = pliant(folder.path(), &["replicate", ".", "--journal", "notes.txt"])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).replace('\n', " ");
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(
            said.contains("notes.txt") && said.contains("--no-journal"),
            "{said}"
        );
        assert_eq!(std::fs::read(&file).unwrap(), text);
        assert!(!folder.path().join("found").exists());
    }
}

/// Killed without warning, a search goes on from its journal and answers as if nothing had happened.
#[cfg(unix)]
#[test]
fn a_killed_search_goes_on() {
    let goal = GOAL
        .replace("layers = 2", "layers = 4")
        .replace("element_size = \"10 mm\"", "element_size = \"6 mm\"");
    let options = ["--no-export", "--tolerance", "1e-8"];
    let folder = design(&goal);
    // Later and later, until a kill comes between the first commit and the end.
    let caught = (1..=24).find_map(|k| {
        let _ = std::fs::remove_dir_all(folder.path().join("found"));
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_pliant"))
            .current_dir(folder.path())
            .args(["replicate", ".", "--threads", "1"])
            .args(options)
            .args(["--db", concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db")])
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(250 * k));
        let _ = child.kill();
        child.wait().unwrap();
        if folder.path().join("found/layout.toml").exists() {
            return None;
        }
        let resumed = replicate(folder.path(), &options);
        let count = |key: &str| resumed[key].as_u64().unwrap();
        (count("from_journal") > 0 && count("from_journal") < count("simulations")).then_some(resumed)
    });
    let resumed = caught.expect("no kill came between the first commit and the end");
    let layout = std::fs::read_to_string(folder.path().join("found/layout.toml")).unwrap();
    let alone = replicate(folder.path(), &[&options[..], &["--no-journal"]].concat());
    let fresh = std::fs::read_to_string(folder.path().join("found/layout.toml")).unwrap();
    assert_eq!(layout, fresh);
    assert_eq!(resumed["rms_mm"], alone["rms_mm"]);
}

#[test]
fn every_answer_says_what_it_rests_on() {
    let folder = design(GOAL);
    let small = replicate(folder.path(), &[]);
    assert_eq!(
        (&small["ended"], &small["bound_rests_on"]["kind"]),
        (&"enumerated".into(), &"enumerated".into())
    );
    assert_eq!(small["gap_mm"], 0.0);
    let output = pliant(
        folder.path(),
        &["replicate", ".", "--method", "paper", "--no-export"],
    )
    .output()
    .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).replace('\n', " ");
    assert!(
        said.contains("not conservative") && said.contains("no layout can be better than"),
        "{said}"
    );
    let few = replicate(folder.path(), &["--simulations", "5"]);
    assert_eq!(
        (&few["ended"], &few["simulations"]),
        (&"exhausted".into(), &5.into())
    );
}
