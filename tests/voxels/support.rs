//! A block of 50 × 40 × 25 mm, cut into voxels.

use pliant::design::goal::{Goal, GoalError};
use pliant::fem::rig::Rig;
use pliant::material::database::Database;
use std::path::Path;

/// Places on the top of the block where it is pressed \[mm\].
pub const PLACES: [[f64; 2]; 10] = [
    [10.0, 10.0],
    [20.0, 10.0],
    [30.0, 10.0],
    [40.0, 10.0],
    [10.0, 30.0],
    [20.0, 30.0],
    [30.0, 30.0],
    [40.0, 30.0],
    [17.0, 20.0],
    [33.0, 20.0],
];

/// A goal for the block: `cut` is a key of its region, as `voxels = [4, 3, 2]`; `more` stands before the examples, which press it at
/// the first `presses` places with the given forces. The displacements say nothing.
pub fn goal_text(cut: &str, materials: &[&str], more: &str, presses: usize, forces: &[f64]) -> String {
    let mut text = format!(
        "schema = 1\nname = \"Block\"\n[object]\nmesh = \"block.stl\"\nunit = \"mm\"\nelement_size = \"25 mm\"\n\
         [[fixed]]\nface = \"bottom\"\n[[region]]\nname = \"block\"\n{cut}\n\
         [palette]\nmaterials = {materials:?}\nsynthetic = true\n{more}\n"
    );
    for (k, [x, y]) in PLACES.iter().take(presses).enumerate() {
        let zeros = vec![0.0; forces.len()];
        text += &format!(
            "[[example]]\nname = \"{k}\"\npoint_mm = [{x}, {y}, 25]\ndirection = [0.2, 0.1, -1]\nradius = \"6 mm\"\n\
             forces_n = {forces:?}\ndisplacements_mm = {zeros:?}\norigin = \"none\"\n"
        );
    }
    text
}

/// Reads such a text beside the block's mesh.
pub fn goal(text: &str) -> Result<Goal, GoalError> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::copy(
        root.join("designs/block/block.stl"),
        folder.path().join("block.stl"),
    )
    .expect("a copy");
    std::fs::write(folder.path().join("goal.toml"), text).expect("a goal");
    let database = Database::open(&root.join("materials-db")).expect("the database");
    Goal::read(folder.path(), &database)
}

/// The goal's object on the bench.
pub fn rig(goal: &Goal) -> Rig {
    Rig::new(&goal.setup, goal.palette.iter().map(|m| m.law.clone()).collect()).expect("a rig")
}
