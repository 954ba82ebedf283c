//! Mistakes in `goal.toml`: each is answered with the file, the line, what was found and what was expected; exit code 2,
//! no panic, nothing written.

use crate::support::{GOAL, design, pliant};

/// What is replaced, by what, the line that must be named, and words that must be said.
const MISTAKES: [(&str, &str, usize, &[&str]); 32] = [
    ("schema = 1", "schema = 7", 1, &["7", "expected 1"]),
    ("name = \"Small block\"", "nmae = \"Small block\"", 2, &["nmae"]),
    (
        "\"block.stl\"",
        "\"absent.stl\"",
        5,
        &["absent.stl", "cannot be read"],
    ),
    ("\"block.stl\"", "\"goal.toml\"", 5, &["goal.toml", ".stl"]),
    ("unit = \"mm\"", "unit = \"parsec\"", 6, &["parsec", "mm"]),
    ("unit = \"mm\"", "unit = \"m\"", 5, &["50", "unit"]),
    (
        "\"10 mm\"\n\n[[fixed]]",
        "\"10\"\n\n[[fixed]]",
        7,
        &["without a unit"],
    ),
    ("\"10 mm\"\n\n[[fixed]]", "\"10 N\"\n\n[[fixed]]", 7, &["N", "mm"]),
    (
        "\"10 mm\"\n\n[[fixed]]",
        "\"-3 mm\"\n\n[[fixed]]",
        7,
        &["-3 mm", "above zero"],
    ),
    (
        "face = \"bottom\"",
        "face = \"underside\"",
        10,
        &["underside", "bottom"],
    ),
    (
        "face = \"bottom\"",
        "box_mm = [[100, 100, 100], [110, 110, 110]]",
        10,
        &["no node"],
    ),
    (
        "face = \"bottom\"",
        "box_mm = [[0, 0, 0], [0, 1, 1]]",
        10,
        &["corner"],
    ),
    ("layers = 2", "layers = 0", 14, &["0 layers", "1 to 64"]),
    ("layers = 2", "layers = \"two\"", 14, &["string"]),
    (
        "layers = 2",
        "layers = 2\nbox_mm = [[0, 0, 0], [25, 40, 25]]",
        12,
        &["no region", "[[region]]"],
    ),
    (
        "layers = 2",
        "layers = 2\nstyle = \"wavy\"",
        15,
        &["wavy", "follow"],
    ),
    (
        "\"mold-star-16\"",
        "\"mold-star-61\"",
        17,
        &["mold-star-61", "mold-star-16"],
    ),
    ("\"mold-star-16\"", "\"ecoflex-00-50\"", 17, &["twice"]),
    ("\"mold-star-16\"", "\"tubes-fine-open\"", 17, &["synthetic"]),
    (
        "[palette]",
        "[palette]\nmost_materials = 0",
        17,
        &["at least one"],
    ),
    (
        "[palette]",
        "[palette]\nleast_layer = \"20 mm\"",
        14,
        &["12.50 mm", "20 mm"],
    ),
    ("point_mm = [25, 20, 25]", "point_mm = [25, 20]", 21, &["3"]),
    (
        "point_mm = [25, 20, 25]",
        "point_mm = [nan, 20, 25]",
        21,
        &["finite"],
    ),
    (
        "point_mm = [25, 20, 25]",
        "point_mm = [300, 20, 25]",
        1,
        &["press", "0 %"],
    ),
    (
        "direction = [0, 0, -1]",
        "direction = [0, 0, 0]",
        22,
        &["no length"],
    ),
    ("forces_n = [4, 8]", "forces_n = [8, 4]", 24, &["rising"]),
    (
        "displacements_mm = [0.9, 1.7]",
        "displacements_mm = [0.9]",
        25,
        &["1 displacements for 2 forces"],
    ),
    (
        "displacements_mm = [0.9, 1.7]",
        "",
        20,
        &["needs either forces_n"],
    ),
    (
        "displacements_mm = [0.9, 1.7]",
        "displacements_mm = [-0.9, -1.7]",
        25,
        &["-0.9 mm", "along the force"],
    ),
    (
        "origin = \"made up\"",
        "tolerance = \"0.1\"",
        26,
        &["without a unit", "25 mm"],
    ),
    (
        "forces_n = [4, 8]\ndisplacements_mm = [0.9, 1.7]",
        "stiffness = \"5 N/mm\"",
        24,
        &["without at", "10 N"],
    ),
    (
        "forces_n = [4, 8]\ndisplacements_mm = [0.9, 1.7]",
        "stiffness = \"5 MPa\"\nat = \"4 N\"",
        24,
        &["MPa", "N/mm"],
    ),
];

#[test]
fn every_mistake_names_its_place_and_the_mend() {
    for (from, to, line, words) in MISTAKES {
        assert!(GOAL.contains(from), "{from:?} is not in the goal");
        let folder = design(&GOAL.replacen(from, to, 1));
        let output = pliant(folder.path(), &["replicate", "."]).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{to:?}: {said}");
        assert!(
            said.contains(&format!("goal.toml:{line}:")),
            "{to:?} is in line {line}: {said}"
        );
        // Long messages are folded at the terminal's width.
        let folded: String = said
            .split_whitespace()
            .filter(|w| *w != "│")
            .collect::<Vec<_>>()
            .join(" ");
        for word in words {
            assert!(folded.contains(word), "{to:?} does not say {word:?}: {folded}");
        }
        assert!(!said.contains("panicked"), "{to:?}: {said}");
        assert!(
            !folder.path().join("found").exists(),
            "{to:?} left something behind"
        );
    }
}

#[test]
fn csv_examples_are_checked_line_by_line() {
    let cases: [(&str, &[&str]); 6] = [
        ("force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n", &["no rows"]),
        (
            "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm\n4,25,20,25,0,0\n",
            &["line 1", "dz_mm"],
        ),
        (
            "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n4,25,20,25,0,0,-1\n4,25,20,25,0,0,-1\n",
            &["line 3", "twice"],
        ),
        (
            "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n4,25,20,25,0,0,-1\n3,25,20,25,0,0,-1\n",
            &["line 3", "rising"],
        ),
        (
            "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n4,25,20,25,0,0,inf\n",
            &["line 2", "finite"],
        ),
        (
            "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n4,25,20,250,0,0,-1\n",
            &["off the object"],
        ),
    ];
    let goal = GOAL.replace(
        "forces_n = [4, 8]\ndisplacements_mm = [0.9, 1.7]",
        "file = \"points.csv\"",
    );
    for (text, words) in cases {
        let folder = design(&goal);
        std::fs::write(folder.path().join("points.csv"), text).unwrap();
        let output = pliant(folder.path(), &["replicate", "."]).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{text:?}: {said}");
        let folded: String = said
            .split_whitespace()
            .filter(|w| *w != "│")
            .collect::<Vec<_>>()
            .join(" ");
        for word in words {
            assert!(folded.contains(word), "{text:?} does not say {word:?}: {folded}");
        }
    }
}

#[test]
fn lost_markers_are_allowed() {
    let goal = GOAL.replace(
        "forces_n = [4, 8]\ndisplacements_mm = [0.9, 1.7]",
        "file = \"points.csv\"",
    );
    let folder = design(&goal);
    let text =
        "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n4,25,20,25,0,0,-1\n4,30,20,25,,,\n8,25,20,25,,,-1.8\n";
    std::fs::write(folder.path().join("points.csv"), text).unwrap();
    let output = pliant(folder.path(), &["replicate", ".", "--no-export"])
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// Searches `goal` and answers in JSON.
fn found(goal: &str, more: &[&str]) -> serde_json::Value {
    let folder = design(goal);
    let mut arguments = vec!["replicate", ".", "--json", "--no-export"];
    arguments.extend(more);
    let output = pliant(folder.path(), &arguments).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Force over stiffness is a displacement: both goals ask for the same. A tolerance takes its part off the largest error.
#[test]
fn a_stiffness_asks_for_what_its_displacement_does_and_tolerance_counts() {
    let curve = "forces_n = [4, 8]\ndisplacements_mm = [0.9, 1.7]";
    let lists = GOAL.replace(curve, "forces_n = [4]\ndisplacements_mm = [0.8]");
    let asked = GOAL.replace(curve, "stiffness = \"5 N/mm\"\nat = \"4 N\"");
    let (lists, asked) = (found(&lists, &[]), found(&asked, &[]));
    assert_eq!(lists["cells"], asked["cells"]);
    let error = |found: &serde_json::Value| found["max_mm"].as_f64().unwrap();
    assert!((error(&lists) - error(&asked)).abs() < 1e-9);
    let part = 0.25 * error(&lists);
    let tolerant = GOAL.replace(
        curve,
        &format!("forces_n = [4]\ndisplacements_mm = [0.8]\ntolerance = \"{part} mm\""),
    );
    let tolerant = found(&tolerant, &[]);
    assert!((error(&tolerant) - 0.75 * error(&lists)).abs() < 1e-6);
    let generous = GOAL.replace(curve, &format!("{curve}\ntolerance = \"90 %\""));
    assert_eq!(found(&generous, &[])["rms_mm"], 0.0);
}
