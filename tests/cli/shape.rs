//! Layers that move and layouts judged by what is not known of their materials, from a goal to files.

use crate::support::{GOAL, design, pliant};
use serde_json::Value;
use std::path::Path;

fn run(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output = pliant(folder, arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code().unwrap(),
        text(&output.stdout),
        text(&output.stderr).replace('\n', " "),
    )
}

/// The borders that `--thickness` finds lower the error, and export, simulation and report have them.
#[test]
fn moved_borders_reach_every_file() {
    // A target for which layers of two materials are best: with one alone no border would show.
    let mixed = ["[0.6, 1.1]", "[0.5, 0.95]", "[0.7, 1.3]", "[0.4, 0.75]"]
        .into_iter()
        .find_map(|target| {
            let folder = design(&GOAL.replace("[0.9, 1.7]", target));
            let arguments = ["replicate", ".", "--thickness", "--json", "--export", "out"];
            let (code, out, err) = run(folder.path(), &arguments);
            assert_eq!(code, 0, "{err}");
            let answer: Value = serde_json::from_str(&out).unwrap();
            let cells = &answer["cells"];
            (cells[0]["material"] != cells[1]["material"]).then_some((folder, answer))
        });
    let (folder, answer) = mixed.expect("no target needs two materials");
    let folder = folder.path();
    let moved = &answer["thickness"];
    let border = moved["regions"][0]["borders"][1].as_f64().unwrap();
    assert!((border - 12.5).abs() > 0.1, "{moved}");
    assert!(
        answer["rms_mm"].as_f64() < moved["rms_before_mm"].as_f64(),
        "{answer}"
    );
    let page = std::fs::read_to_string(folder.join("found/report.html")).unwrap();
    assert!(page.contains("thickness of block 1"));
    // The same error again, on a grid made for these borders.
    let (code, out, err) = run(folder, &["simulate", "found/layout.toml", "--json"]);
    assert_eq!(code, 0, "{err}");
    let again: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(again["error"]["equals_recorded"], true, "{out}");
    // The lower layer has the area of the block, 50 × 40 mm, times its thickness; two materials, two parts.
    for export in [None, Some("again")] {
        if let Some(out) = export {
            assert_eq!(run(folder, &["export", ".", "--out", out]).0, 0);
        }
        let manifest =
            std::fs::read_to_string(folder.join(export.unwrap_or("out")).join("manifest.json")).unwrap();
        let expected = 2000.0 * border;
        let volumes = volumes(&serde_json::from_str(&manifest).unwrap());
        assert!(
            volumes.iter().any(|v| (v - expected).abs() < 0.005 * 50_000.0),
            "{volumes:?} for {expected}"
        );
    }
    // Borders that cannot be are refused, and nothing is written.
    let file = folder.join("found/layout.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let start = text.find("borders = [").unwrap();
    let end = start + text[start..].find(']').unwrap() + 1;
    for (wrong, said) in [
        ("borders = [0.0, 30.0, 25.0]", "ascend"),
        ("borders = [0.0, 25.0]", "3 numbers"),
    ] {
        std::fs::write(&file, text.replace(&text[start..end], wrong)).unwrap();
        for arguments in [
            &["export", ".", "--out", "third"][..],
            &["simulate", "found/layout.toml", "--out", "third"],
        ] {
            let (code, _, err) = run(folder, arguments);
            assert!(code == 2 && err.contains(said), "{err}");
        }
    }
    assert!(!folder.join("third").exists());
}

fn volumes(value: &Value) -> Vec<f64> {
    match value {
        Value::Object(map) => {
            let own = map.get("volume_mm3").and_then(Value::as_f64);
            own.into_iter().chain(map.values().flat_map(volumes)).collect()
        }
        Value::Array(list) => list.iter().flat_map(volumes).collect(),
        _ => Vec::new(),
    }
}

#[test]
fn robust_layouts_say_how_sure_they_are() {
    let folder = design(GOAL);
    let folder = folder.path();
    let robust = |arguments: &[&str]| -> Value {
        let all = [&["replicate", ".", "--json", "--no-export"], arguments].concat();
        let (code, out, err) = run(folder, &all);
        assert_eq!(code, 0, "{err}");
        serde_json::from_str(&out).unwrap()
    };
    let pessimistic = |answer: &Value| answer["pessimistic_rms_mm"].as_f64().unwrap();
    let usual = robust(&["--robust"]);
    assert_eq!(usual["quantile"], 0.9);
    let page = std::fs::read_to_string(folder.join("found/report.html")).unwrap();
    assert!(page.contains("Shaded: where 90 of 100") && page.contains("in 90 of 100 cases"));
    let text = std::fs::read_to_string(folder.join("found/layout.toml")).unwrap();
    let record: toml::Table = text.parse().unwrap();
    assert_eq!(
        record["error"]["pessimistic_rms_mm"].as_float(),
        usual["pessimistic_rms_mm"].as_f64()
    );
    // More certainty costs error; the same seed and other threads give the same; another seed nearly so.
    let surer = robust(&["--robust=0.99"]);
    assert!(pessimistic(&surer) > pessimistic(&usual));
    assert!(pessimistic(&usual) >= 0.5 * usual["rms_mm"].as_f64().unwrap());
    let again = robust(&["--robust=0.9", "--threads", "1"]);
    assert_eq!(again["pessimistic_rms_mm"], usual["pessimistic_rms_mm"]);
    let other = robust(&["--robust", "--seed", "2"]);
    assert!((pessimistic(&other) / pessimistic(&usual) - 1.0).abs() < 0.1);
    // Both steps together.
    let both = robust(&["--robust", "--thickness"]);
    assert!(both["thickness"]["rms_before_mm"].as_f64() >= both["rms_mm"].as_f64());
}

#[test]
fn options_that_cannot_be_are_refused_before_the_search() {
    let folder = design(GOAL);
    for wrong in ["--robust=1.5", "--robust=0", "--robust=nan"] {
        let (code, _, err) = run(folder.path(), &["replicate", ".", wrong]);
        assert!(code == 2 && err.contains("quantile"), "{err}");
    }
    let single = design(&GOAL.replace("layers = 2", "layers = 1"));
    let (code, _, err) = run(single.path(), &["replicate", ".", "--thickness"]);
    assert!(code == 2 && err.contains("no layer border can move"), "{err}");
    for folder in [folder, single] {
        assert!(!folder.path().join("found").exists());
    }
}
