//! The real binary: `pliant db` and `pliant fit`.

use assert_cmd::Command;
use std::path::Path;

const DATABASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db");
const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data");

pub fn pliant(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("pliant")
        .unwrap()
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code().unwrap_or(-1),
        text(&output.stdout),
        text(&output.stderr),
    )
}

#[test]
fn list_and_show_answer_people_and_machines() {
    let (code, out, _) = pliant(&["db", "list", "--db", DATABASE]);
    assert!(code == 0 && out.contains("leap-foam"));
    let (code, out, _) = pliant(&["db", "list", "--db", DATABASE, "--json"]);
    let list: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(code, 0);
    assert!(
        list.as_array()
            .unwrap()
            .iter()
            .all(|r| r["young_at_rest_mpa"].as_f64().unwrap() > 0.0)
    );
    let (code, out, _) = pliant(&["db", "show", "sole-heel-foam", "--db", DATABASE]);
    assert!(
        code == 0 && out.contains("fitted range") && out.contains("licence"),
        "{out}"
    );
    let (code, _, err) = pliant(&["db", "show", "sole-heal-foam", "--db", DATABASE]);
    assert!(code == 2 && err.contains("sole-heel-foam"), "{err}");
}

#[test]
fn the_table_in_the_docs_is_that_of_the_database() {
    let (_, out, _) = pliant(&["db", "list", "--markdown", "--db", DATABASE]);
    let kept = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/materials.md")).unwrap();
    assert_eq!(
        out, kept,
        "refresh it: pliant db list --markdown > docs/materials.md"
    );
}

#[test]
fn check_answers_with_its_exit_code() {
    assert_eq!(pliant(&["db", "check", "--db", DATABASE]).0, 0);
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(
        pliant(&["db", "check", "--db", &folder.path().to_string_lossy()]).0,
        2,
        "an empty folder"
    );
    let text = std::fs::read_to_string(Path::new(DATABASE).join("leap-foam.toml")).unwrap();
    let place = folder.path().join("leap-foam.toml");
    std::fs::write(
        &place,
        text.replacen("density_g_per_cm3 = 0.1", "density_g_per_cm3 = 100.0", 1),
    )
    .unwrap();
    let (code, out, _) = pliant(&["db", "check", "--db", &folder.path().to_string_lossy()]);
    assert!(code == 1 && out.contains("density_g_per_cm3"), "{out}");
    std::fs::write(&place, "schema = \"one\"").unwrap();
    let (code, out, _) = pliant(&["db", "check", "--db", &folder.path().to_string_lossy()]);
    assert!(code == 1 && out.contains("line 1"), "{out}");
}

#[test]
fn fit_writes_a_record() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_string_lossy().into_owned();
    let heel = format!("{DATABASE}/coupons/sole-heel-foam.toml");
    let (code, _, err) = pliant(&["fit", &heel, "--out", &out, "--data", "/nowhere"]);
    assert!(code == 2 && err.contains("--data"), "{err}");
    if !Path::new(DATA).is_dir() {
        println!("skipped the rest: no measurements at {DATA}");
        return;
    }
    let (code, json, err) = pliant(&["fit", &heel, "--out", &out, "--data", DATA, "--json"]);
    assert_eq!(code, 0, "{err}");
    let answer: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(answer[0]["measurements"][0]["relative_rms"].as_f64().unwrap() < 0.02);
    assert!(folder.path().join("sole-heel-foam.toml").is_file());
}
