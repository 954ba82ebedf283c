//! Every mistake is answered with the file, the line, what was found and what was expected.

use crate::bench::{BAR, Bench, DATABASE, PRESSED};

/// A change to the pressed bar, the line that the message names, and words that it holds.
const MISTAKES: [(&str, &str, usize, &[&str]); 21] = [
    ("bar.stl", "rab.stl", 4, &["rab.stl", "cannot be read"]),
    ("radius", "radios", 20, &["radios"]),
    ("\"6 mm\"", "\"6\"", 20, &["\"6\"", "unit"]),
    ("\"6 mm\"", "\"6 N\"", 20, &["\"N\""]),
    ("\"300 kPa\"", "\"300 mm\"", 14, &["\"mm\"", "stress"]),
    ("poisson = 0.3", "poisson = 0.5", 15, &["0.5", "Poisson"]),
    ("poisson = 0.3", "poisson = nan", 15, &["NaN"]),
    ("[20, 10, 20]", "[20, nan, 20]", 18, &["NaN"]),
    ("[1, 2, 4]", "[1, 2, nan]", 21, &["NaN", "rising"]),
    ("[1, 2, 4]", "[4, 2]", 21, &["rising"]),
    ("material = \"rubber\"", "material = \"rubbr\"", 11, &["rubbr"]),
    ("material = \"rubber\"", "materials = []", 11, &["empty"]),
    ("material = \"rubber\"", "", 10, &["no material", "materials"]),
    ("\"bottom\"", "\"left\"", 8, &["\"left\"", "\"bottom\""]),
    ("[20, 10, 20]", "[20, 60, 20]", 18, &["0 %", "middle"]),
    ("[0, 0, -1]", "[0, 0, 0]", 19, &["no length"]),
    (
        "[[fixed]]\nface = \"bottom\"\n",
        "",
        1,
        &["[[fixed]]", "nothing holds"],
    ),
    (
        "name = \"middle\"",
        "name = \"../middle\"",
        17,
        &["../middle", "letters"],
    ),
    ("schema = 1", "schema = 2", 2, &["schema 2", "expected 1"]),
    (
        "[[press]]",
        "[output]\nnodes = [100000]\n[[press]]",
        17,
        &["100000", "0 to 224"],
    ),
    (
        "[[press]]",
        "[output]\npoints_mm = [[20, 10, 90]]\n[[press]]",
        17,
        &["70.0 mm off"],
    ),
];

#[test]
fn mistakes_name_line_found_and_expected() {
    let bench = Bench::new();
    for (old, new, line, words) in MISTAKES {
        assert!(PRESSED.contains(old), "{old}");
        let run = bench.simulate(&PRESSED.replacen(old, new, 1), &["--db", DATABASE]);
        assert_eq!(run.code, 2, "{old} → {new}: {}", run.err);
        assert!(run.out.is_empty(), "{}", run.out);
        // Messages are wrapped at the terminal's width; blanks may be line breaks.
        let message = run
            .err
            .split_whitespace()
            .filter(|w| *w != "│")
            .collect::<Vec<_>>()
            .join(" ");
        let place = format!("scene.toml:{line}:");
        // A long path may be broken anywhere, the place behind it not.
        let squeezed: String = message.split(' ').collect();
        assert!(
            squeezed.contains(&place),
            "{old} → {new}: no {place} in {message}"
        );
        for word in words {
            let word: String = word.split(' ').collect();
            assert!(
                squeezed.contains(&word),
                "{old} → {new}: no {word:?} in {message}"
            );
        }
    }
    assert!(!bench.path("simulated").exists());
}

const MOVES: [(&str, &[&str]); 6] = [
    ("face = \"top\"\ndisplacement_mm = [0, 0]\n", &["[dx, dy, dz]"]),
    ("face = \"top\"\ndisplacement_mm = { up = 2 }\n", &["\"up\""]),
    ("face = \"top\"\ndisplacement_mm = { z = inf }\n", &["inf"]),
    (
        "face = \"bottom\"\ndisplacement_mm = { z = 2 }\n",
        &["along z", "holds it"],
    ),
    ("displacement_mm = { z = 2 }\n", &["0 places"]),
    ("face = \"top\"\ndisplacement_mm = [0, 0, 0]\n", &["nothing"]),
];

#[test]
fn moves_that_make_no_sense_are_refused() {
    let bench = Bench::new();
    for (text, words) in MOVES {
        let run = bench.simulate(&format!("{BAR}[[move]]\nname = \"m\"\n{text}"), &[]);
        assert_eq!(run.code, 2, "{text}: {}", run.err);
        let squeezed: String = run.err.split_whitespace().filter(|w| *w != "│").collect();
        for word in words {
            let word: String = word.split(' ').collect();
            assert!(squeezed.contains(&word), "{text}: no {word} in {}", run.err);
        }
    }
}

/// A needle that pushes far harder than the bar can bear: the answer is no, with the load that was reached, and the files
/// hold the last level before it.
#[test]
fn a_load_that_folds_the_object_is_a_negative_answer() {
    let bench = Bench::new();
    let scene = PRESSED.replace("[1, 2, 4]", "[1, 2, 4000]");
    let run = bench.simulate(&scene, &[]);
    assert_eq!(run.code, 1, "{}", run.err);
    assert!(
        run.err.contains("reached") && run.err.contains("of 4000 N"),
        "{}",
        run.err
    );
    let case = &bench.simulated()["cases"][0];
    assert_eq!(case["complete"], false);
    assert_eq!(case["levels"], serde_json::json!([1.0, 2.0]));
    let reached = case["reached_load"].as_f64().unwrap();
    // Pressure beyond Young's modulus on a disc of 113 mm², 34 N, folds it for sure well before 4000 N.
    assert!((2.0..4000.0).contains(&reached), "{reached}");
    let csv = std::fs::read_to_string(bench.path("simulated/middle.csv")).unwrap();
    assert_eq!(csv.lines().count(), 3, "{csv}");
}

/// Rollers under the bottom alone leave it free to slide.
#[test]
fn an_object_that_can_slide_is_not_answered_with_numbers() {
    let bench = Bench::new();
    let scene = PRESSED.replace("face = \"bottom\"", "face = \"bottom\"\ncomponents = \"z\"");
    let run = bench.simulate(&scene.replace("[0, 0, -1]", "[1, 0, -1]"), &[]);
    assert_eq!(run.code, 1, "{} {}", run.out, run.err);
}

#[test]
fn missing_files_are_named() {
    let bench = Bench::new();
    let run = crate::bench::run(bench.folder.path(), &["simulate", "nowhere.toml"]);
    assert!(run.code == 2 && run.err.contains("nowhere.toml"), "{}", run.err);
}
