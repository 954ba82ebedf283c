//! A layout that a search found, simulated again.

use crate::bench::{Bench, DATABASE, PRESSED, run};

const GOAL: &str = r#"
schema = 1
name = "bar"
[object]
mesh = "bar.stl"
unit = "mm"
element_size = "7 mm"
[[fixed]]
face = "bottom"
[[region]]
name = "bar"
layers = 2
[palette]
materials = ["ecoflex-00-30", "dragon-skin-20"]
[[example]]
name = "middle"
point_mm = [20, 10, 20]
direction = [0, 0, -1]
radius = "6 mm"
file = "simulated/middle.csv"
"#;

#[test]
fn a_found_layout_has_the_error_that_the_search_recorded() {
    let bench = Bench::new();
    bench.record(&format!("{PRESSED}[output]\nsurface_points = 6\n"));
    let goal = bench.write(
        "design/goal.toml",
        &GOAL
            .replace("\"bar.stl", "\"../bar.stl")
            .replace("simulated/", "../simulated/"),
    );
    let folder = goal.parent().unwrap();
    let found = run(
        folder,
        &["replicate", ".", "--db", DATABASE, "--no-export", "--json"],
    );
    assert_eq!(found.code, 0, "{}", found.err);
    let again = run(
        folder,
        &["simulate", "found/layout.toml", "--db", DATABASE, "--json"],
    );
    assert_eq!(again.code, 0, "{}", again.err);
    let answer: serde_json::Value = serde_json::from_str(&again.out).unwrap();
    assert_eq!(answer["error"]["equals_recorded"], true);
    let rms = |v: &serde_json::Value| v["rms_mm"].as_f64().unwrap();
    let searched: serde_json::Value = serde_json::from_str(&found.out).unwrap();
    assert!((rms(&answer["error"]) - rms(&searched)).abs() <= 1e-9 * rms(&searched));
    assert!(folder.join("found/simulated/middle.vtu").exists());

    // A record that says something else is a negative answer.
    let file = folder.join("found/layout.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let line = text
        .lines()
        .find(|l| l.starts_with("rms_mm"))
        .unwrap()
        .to_string();
    std::fs::write(&file, text.replacen(&line, "rms_mm = 0.0123", 1)).unwrap();
    let other = run(folder, &["simulate", "found/layout.toml", "--db", DATABASE]);
    assert!(
        other.code == 1 && other.out.contains("NOT"),
        "{} {}",
        other.out,
        other.err
    );

    // A goal that changed since is an error.
    std::fs::write(&goal, std::fs::read_to_string(&goal).unwrap() + "# changed\n").unwrap();
    let stale = run(folder, &["simulate", "found/layout.toml", "--db", DATABASE]);
    assert!(stale.code == 2 && stale.err.contains("changed"), "{}", stale.err);
}
