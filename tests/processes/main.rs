//! Many processes find what one finds. Needs the feature `mpi` and `mpirun`:
//! `cargo test --release --features mpi --test processes`.

#![cfg(feature = "mpi")]

use std::path::Path;
use std::process::{Command, Output};

/// A block of four layers, pressed in the middle.
const GOAL: &str = r#"schema = 1
name = "Small block"
[object]
mesh = "block.stl"
unit = "mm"
element_size = "10 mm"
[[fixed]]
face = "bottom"
[[region]]
name = "block"
layers = 4
[palette]
materials = ["ecoflex-00-30", "ecoflex-00-50", "mold-star-16", "dragon-skin-20", "dragon-skin-30"]
[[example]]
name = "press"
point_mm = [25, 20, 25]
direction = [0, 0, -1]
radius = "12 mm"
forces_n = [4, 8]
displacements_mm = [0.9, 1.7]
origin = "made up"
"#;

fn run(folder: &Path, processes: usize, more: &[&str]) -> Output {
    Command::new("mpirun")
        .current_dir(folder)
        .args([
            "-n",
            &processes.to_string(),
            "--oversubscribe",
            "--allow-run-as-root",
        ])
        .arg(env!("CARGO_BIN_EXE_pliant"))
        .args(["replicate", ".", "--json", "--no-export", "--threads", "1"])
        .args(["--db", concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db")])
        .args(more)
        .output()
        .unwrap()
}

fn design(goal: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("goal.toml"), goal).unwrap();
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/block/block.stl");
    std::fs::copy(mesh, folder.path().join("block.stl")).unwrap();
    folder
}

/// layout.toml holds layout, errors, bound and counts: the same bytes from one, two and four processes, with a journal and
/// without.
#[test]
fn one_two_and_four_processes_find_the_same() {
    all_find_the_same(GOAL);
}

/// Voxels, whose examples the processes share: there are fewer of these than processes.
#[test]
fn voxels_are_found_the_same() {
    let more = GOAL[GOAL.find("[[example]]").unwrap()..].replace("\"press\"", "\"another\"");
    let voxels = GOAL
        .replace("layers = 4", "voxels = [5, 4, 3]")
        .replace("point_mm = [25", "point_mm = [15");
    all_find_the_same(&(voxels + &more.replace("0.9, 1.7", "0.8, 1.5")));
}

fn all_find_the_same(goal: &str) {
    let folder = design(goal);
    let mut found = Vec::new();
    for (processes, journal) in [
        (1, "--no-journal"),
        (2, "--no-journal"),
        (4, "--journal=j.redb"),
        (4, "--journal=j.redb"),
    ] {
        let output = run(folder.path(), processes, &[journal]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        println!(
            "{processes} processes: {} mm, {} from the journal",
            answer["rms_mm"], answer["from_journal"]
        );
        found.push(std::fs::read(folder.path().join("found/layout.toml")).unwrap());
    }
    assert!(found.windows(2).all(|pair| pair[0] == pair[1]));
}

/// A mistake is reported once, and all processes end.
#[test]
fn a_mistake_is_reported_once() {
    let folder = design(&GOAL.replace("mold-star-16", "mold-star-61"));
    let output = run(folder.path(), 3, &["--no-journal"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success());
    assert_eq!(said.matches("mold-star-61").count(), 1, "{said}");
    // One that shows when the others wait for orders already.
    let folder = design(GOAL);
    std::fs::write(folder.path().join("j.redb"), "no journal").unwrap();
    let output = run(folder.path(), 3, &["--journal=j.redb"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && said.contains("j.redb"), "{said}");
}
