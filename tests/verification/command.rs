//! `pliant verify`, the real binary.

use assert_cmd::Command;
use serde_json::Value;

fn verify(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("pliant").expect("the binary");
    command.arg("verify").args(arguments);
    command
}

#[test]
fn one_check_answers_in_words_and_in_json() {
    let text = verify(&["--only", "patch"])
        .assert()
        .code(0)
        .get_output()
        .stdout
        .clone();
    let text = String::from_utf8(text).unwrap();
    assert!(text.contains("Patch test") && text.contains("holds"), "{text}");
    let json = verify(&["--only", "patch", "--json"])
        .assert()
        .code(0)
        .get_output()
        .stdout
        .clone();
    let answer: Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(answer["passed"], true);
    let rows = answer["checks"][0]["rows"].as_array().unwrap();
    assert!(
        rows.len() >= 3 && rows.iter().all(|row| row["found"].is_number()),
        "{rows:?}"
    );
}

#[test]
fn mistakes_are_named() {
    let unknown = verify(&["--only", "pacth"])
        .assert()
        .code(2)
        .get_output()
        .stderr
        .clone();
    let text = String::from_utf8(unknown).unwrap();
    assert!(text.contains("pacth") && text.contains("patch"), "{text}");
    // A page of some of the checks would pass for the whole.
    verify(&["--only", "patch", "--out", "page.md"]).assert().code(2);
    verify(&["--quick", "--out", "page.md"]).assert().code(2);
}

#[test]
fn the_list_holds_every_check() {
    let json = verify(&["--list", "--json"])
        .assert()
        .code(0)
        .get_output()
        .stdout
        .clone();
    let answer: Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(answer.as_array().unwrap().len(), pliant::verify::CHECKS.len());
}
