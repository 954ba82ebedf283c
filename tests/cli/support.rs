//! A small design in a fresh folder, and the binary to run on it.

use assert_cmd::Command;
use std::path::Path;
use tempfile::TempDir;

/// A goal that a search answers in a blink: a block of two layers, three materials, two forces.
pub const GOAL: &str = r#"schema = 1
name = "Small block"

[object]
mesh = "block.stl"
unit = "mm"
element_size = "10 mm"

[[fixed]]
face = "bottom"

[[region]]
name = "block"
layers = 2

[palette]
materials = ["ecoflex-00-50", "mold-star-16", "dragon-skin-30"]

[[example]]
name = "press"
point_mm = [25, 20, 25]
direction = [0, 0, -1]
radius = "12 mm"
forces_n = [4, 8]
displacements_mm = [0.9, 1.7]
origin = "made up"
"#;

/// A folder with `goal.toml` and its mesh.
pub fn design(goal: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("goal.toml"), goal).unwrap();
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/block/block.stl");
    std::fs::copy(mesh, folder.path().join("block.stl")).unwrap();
    folder
}

/// The binary, run in `folder` with the shipped database.
pub fn pliant(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("pliant").unwrap();
    command.current_dir(folder).args(arguments);
    command.args(["--db", concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db")]);
    command
}
