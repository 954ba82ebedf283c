//! `pliant replicate`, `simulate` and `export` with voxels, through the real binary.

use crate::support::{goal, goal_text};
use pliant::design::found::Found;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const MATERIALS: [&str; 2] = ["ecoflex-00-30", "dragon-skin-20"];

fn pliant(folder: &Path, arguments: &[&str]) -> Output {
    let database = concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db");
    Command::new(env!("CARGO_BIN_EXE_pliant"))
        .args(arguments)
        .args(["--db", database])
        .current_dir(folder)
        .output()
        .expect("pliant runs")
}

#[test]
fn a_layout_of_voxels_is_found_simulated_and_exported() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/block/block.stl");
    fs::copy(mesh, folder.path().join("block.stl")).expect("a copy");
    let rules = "[voxels]\nsymmetry = [\"x\"]\nconnected = [\"dragon-skin-20\"]";
    let text = goal_text("voxels = [4, 3, 2]", &MATERIALS, rules, 2, &[0.5, 1.0]);
    // Between what the two materials alone give.
    let text = text.replace("displacements_mm = [0.0, 0.0]", "displacements_mm = [0.2, 0.4]");
    fs::write(folder.path().join("goal.toml"), &text).expect("a goal");
    let answer = pliant(
        folder.path(),
        &["replicate", "goal.toml", "--export", "print", "--json"],
    );
    assert!(
        answer.status.success(),
        "{}",
        String::from_utf8_lossy(&answer.stderr)
    );
    let answer: serde_json::Value = serde_json::from_slice(&answer.stdout).expect("JSON");
    let rms_mm = answer["rms_mm"].as_f64().expect("a number");
    assert!(rms_mm < answer["best_single_material_rms_mm"].as_f64().expect("a number"));

    let file = folder.path().join("found/layout.toml");
    let found = Found::read(&file).expect("a layout");
    assert!(found.cell.is_empty() && found.voxels[0].counts == [4, 3, 2]);
    for row in found.voxels[0].slices.iter().flat_map(|s| s.split(' ')) {
        assert!(row.bytes().eq(row.bytes().rev()), "{row} is no mirror image");
    }
    // What is read is what was written, character by character.
    let read = goal(&text).expect("a goal");
    let (layout, _) = found.layout(&read, &file).expect("a layout");
    let region = &read.setup.cells.regions()[0];
    for (z, slice) in found.voxels[0].slices.iter().enumerate() {
        for (y, row) in slice.split(' ').enumerate() {
            for (x, digit) in row.bytes().enumerate() {
                let id = &found.material[(digit - b'0') as usize].id;
                let own = layout[region.number([x, y, z])] as usize;
                assert_eq!(id, MATERIALS[own]);
            }
        }
    }

    let manifest = fs::read_to_string(folder.path().join("print/manifest.json")).expect("a manifest");
    let manifest: serde_json::Value = serde_json::from_str(&manifest).expect("JSON");
    let parts = manifest["parts"].as_array().expect("parts");
    assert_eq!(parts.len(), found.material.len());
    for part in parts {
        let number = found
            .material
            .iter()
            .position(|m| part["material"] == m.id.as_str());
        let digit = b'0' + number.expect("a material of the layout") as u8;
        let digits = found.voxels[0].slices.iter().flat_map(|s| s.bytes());
        let voxels = digits.filter(|&d| d == digit).count() as f64;
        let volume = part["volume_mm3"].as_f64().expect("a volume");
        // A block of 50 000 mm³ in 24 voxels whose faces are planes: cut exactly, but for single precision.
        assert!(
            (volume / (voxels * 50_000.0 / 24.0) - 1.0).abs() < 1e-4,
            "{volume}"
        );
    }

    let again = pliant(folder.path(), &["simulate", "found/layout.toml", "--json"]);
    assert!(
        again.status.success(),
        "{}",
        String::from_utf8_lossy(&again.stderr)
    );
    let exported = pliant(folder.path(), &["export", "goal.toml", "--out", "again"]);
    assert!(
        exported.status.success(),
        "{}",
        String::from_utf8_lossy(&exported.stderr)
    );
    let report = fs::read_to_string(folder.path().join("found/report.html")).expect("a report");
    assert!(report.contains("% of the cells"));

    // A row too short is no layout of the goal.
    let torn = fs::read_to_string(&file)
        .expect("text")
        .replacen("slices = [\"", "slices = [\"0", 1);
    fs::write(&file, torn).expect("a file");
    let refused = pliant(folder.path(), &["export", "goal.toml"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("not those of the goal"));
}

/// Prices, a limit, forbidden neighbours, doubts about the materials, the set against cost; and all of it from the journal.
#[test]
fn rules_doubts_and_the_set_are_answered() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/block/block.stl");
    fs::copy(mesh, folder.path().join("block.stl")).expect("a copy");
    let materials = ["ecoflex-00-30", "mold-star-16", "dragon-skin-20"];
    let rules = "apart = [[\"ecoflex-00-30\", \"dragon-skin-20\"]]\nmost_mass = \"56 g\"\ncost_weight = \"0.01 mm/EUR\"\n\
                 [palette.price]\necoflex-00-30 = \"40 EUR/kg\"\nmold-star-16 = \"30 EUR/kg\"\ndragon-skin-20 = \"25 EUR/kg\"";
    let text = goal_text("voxels = [4, 3, 2]", &materials, rules, 2, &[0.5, 1.0]);
    let text = text.replace("displacements_mm = [0.0, 0.0]", "displacements_mm = [0.2, 0.4]");
    fs::write(folder.path().join("goal.toml"), &text).expect("a goal");
    let run = || {
        let answer = pliant(
            folder.path(),
            &[
                "replicate",
                "goal.toml",
                "--no-export",
                "--robust",
                "--pareto",
                "--json",
            ],
        );
        assert!(
            answer.status.success(),
            "{}",
            String::from_utf8_lossy(&answer.stderr)
        );
        serde_json::from_slice::<serde_json::Value>(&answer.stdout).expect("JSON")
    };
    let first = run();
    let number = |name: &str| first[name].as_f64().expect("a number");
    assert!(number("mass_g") <= 56.0 && number("pessimistic_rms_mm") > number("rms_mm"));
    assert_eq!(first["currency"], "EUR");
    let rows = first["pareto"].as_array().expect("rows");
    let of = |row: &serde_json::Value, name: &str| row[name].as_f64().expect("a number");
    let costs: Vec<&serde_json::Value> = rows.iter().filter(|r| r["against"] == "cost").collect();
    assert!(costs.len() > 1, "{rows:?}");
    for pair in costs.windows(2) {
        assert!(of(pair[0], "cost") < of(pair[1], "cost") && of(pair[0], "rms_mm") > of(pair[1], "rms_mm"));
    }
    let layout = fs::read(folder.path().join("found/layout.toml")).expect("a file");
    let again = run();
    assert_eq!(again["from_journal"], first["simulations"]);
    assert_eq!(
        fs::read(folder.path().join("found/layout.toml")).expect("a file"),
        layout
    );
}

#[test]
fn mistakes_are_answered_with_their_line() {
    for (cut, more, message) in [
        ("voxels = [4, 0, 2]", "", "voxels = [4, 0, 2]"),
        ("voxels = [250, 250, 2]", "", "at most 50000 in all"),
        ("columns = [300, 2]", "", "1 to 256"),
        ("layers = 2\nvoxels = [4, 3, 2]", "", "cut in two ways"),
        ("", "", "not cut into cells"),
        (
            "layers = 2",
            "[voxels]\nsymmetry = [\"x\"]",
            "no [[region]] has voxels",
        ),
        (
            "voxels = [4, 3, 2]",
            "[voxels]\nleast_feature = \"30 mm\"",
            "less than the least feature",
        ),
        (
            "voxels = [4, 3, 2]",
            "[voxels]\nconnected = [\"rubber\"]",
            "not in the palette",
        ),
        (
            "voxels = [4, 3, 2]\nstyle = \"follow\"",
            "[voxels]\nsymmetry = [\"x\"]",
            "follows",
        ),
    ] {
        let text = goal_text(cut, &MATERIALS, more, 1, &[1.0]);
        let mistake = goal(&text).map(|_| ()).expect_err(message).to_string();
        assert!(mistake.contains(message), "{mistake}");
    }
}
