//! The checks of `pliant verify`, each solved once a run, and the page that they make.

use pliant::verify::page::write_page;
use pliant::verify::{CHECKS, Check, Findings};
use std::path::Path;
use std::sync::OnceLock;

static FINDINGS: [OnceLock<Findings>; CHECKS.len()] = [const { OnceLock::new() }; CHECKS.len()];

fn findings(check: &Check) -> &'static Findings {
    let index = CHECKS
        .iter()
        .position(|c| c.id == check.id)
        .expect("a check of the list");
    FINDINGS[index].get_or_init(|| (check.run)().unwrap_or_else(|e| panic!("{}: {e}", check.id)))
}

fn holds(id: &str) {
    let check = pliant::verify::check(id).expect("a check of the list");
    let findings = findings(check);
    assert!(
        findings.passed(),
        "{}:\n{}",
        check.title,
        findings.failures().join("\n")
    );
}

/// One test a check, and the list of all that have one.
macro_rules! tests {
    ($($name:ident: $id:literal),* $(,)?) => {
        const TESTED: &[&str] = &[$($id),*];
        $(#[test]
        fn $name() {
            holds($id);
        })*
    };
}

tests! {
    patch: "patch",
    rigid: "rigid",
    laws: "laws",
    slow_orders: "orders",
    slow_cantilever: "cantilever",
    slow_cook: "cook",
    slow_sphere: "sphere",
    slow_contact: "contact",
    block: "block",
    slow_path: "path",
    slow_beam: "beam",
    slow_repeat: "repeat",
}

#[test]
fn every_check_is_asserted() {
    let ids: Vec<&str> = CHECKS.iter().map(|check| check.id).collect();
    assert_eq!(ids, TESTED);
}

#[test]
fn slow_page_is_what_the_checks_write() {
    let outcomes: Vec<(&Check, Findings)> = CHECKS.iter().map(|c| (c, findings(c).clone())).collect();
    let mut page = Vec::new();
    write_page(&outcomes, &mut page).expect("memory");
    let page = String::from_utf8(page).expect("text");
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/verification.md");
    let committed = std::fs::read_to_string(file).expect("docs/verification.md");
    for (line, (written, committed)) in page.lines().zip(committed.lines()).enumerate() {
        assert_eq!(
            written,
            committed,
            "line {}: run pliant verify --out docs/verification.md",
            line + 1
        );
    }
    assert_eq!(
        page.len(),
        committed.len(),
        "run pliant verify --out docs/verification.md"
    );
}
