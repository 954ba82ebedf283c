//! Answers against hand calculations.

use crate::bench::{BAR, Bench, PRESSED, numbers};
use serde_json::Value;

fn reaction<'a>(case: &'a Value, support: &str) -> &'a Value {
    let list = case["reactions"].as_array().unwrap();
    let found = list
        .iter()
        .find(|r| r["support"].as_str().unwrap().starts_with(support));
    &found.unwrap()["forces_n"]
}

fn near(found: f64, expected: f64, relative: f64) {
    assert!(
        (found - expected).abs() <= relative * expected.abs(),
        "found {found}, expected {expected}"
    );
}

/// The bar is free of friction, so its strain is the same everywhere and nothing but E, A and ν counts:
/// F = E A ε = 0.3 MPa · 800 mm² · 0.1 = 24 N at 2 mm of 20 mm, and the width grows by ν ε: 0.3 · 0.1 · 40 mm = 1.2 mm.
/// The law is linear in Biot strain and stress is per undeformed area, so at half the way it is exactly half.
#[test]
fn a_bar_pushes_back_with_e_a_epsilon() {
    let bench = Bench::new();
    let scene = format!(
        "{BAR}[[move]]\nname = \"squash\"\nface = \"top\"\ndisplacement_mm = {{ z = -2 }}\nsteps = 2\n\
         [output]\npoints_mm = [[40, 20, 20]]\n"
    );
    let case = &bench.record(&scene)["cases"][0];
    let top = numbers(reaction(case, "squash"));
    near(top[2], -12.0, 1e-8);
    near(top[5], -24.0, 1e-8);
    near(numbers(reaction(case, "fixed 1 (bottom)"))[5], 24.0, 1e-8);
    // The rollers of the sides carry nothing.
    assert!(
        numbers(reaction(case, "fixed 2 (box)"))
            .iter()
            .all(|f| f.abs() < 1e-6)
    );
    let corner = numbers(&case["points"][0]["displacements_mm"]);
    for (found, expected) in corner.iter().zip([0.6, 0.3, -1.0, 1.2, 0.6, -2.0]) {
        near(*found, expected, 1e-8);
    }
    assert_eq!(case["levels"], serde_json::json!([1.0, 2.0]));
    // det F = 0.9 · 1.03².
    near(
        case["smallest_jacobian"].as_f64().unwrap(),
        0.9 * 1.03 * 1.03,
        1e-8,
    );
}

/// Two layers of equal height in series: compliances add, k = A / (h/E₁ + h/E₂). With ν = 0 nothing moves sideways.
/// A = 800 mm², h = 10 mm, E = 0.1 and 0.4 MPa: k = 800 / (100 + 25) = 6.4 N/mm; 1 mm takes 6.4 N, and the soft layer,
/// which is listed first and so lies below, takes 0.8 mm of it.
#[test]
fn layers_are_listed_from_the_lowest_up() {
    let bench = Bench::new();
    let scene = BAR
        .replace("material = \"rubber\"", "materials = [\"soft\", \"rubber\"]")
        .replace(
            "young = \"0.3 MPa\"\npoisson = 0.3",
            "young = \"0.4 MPa\"\npoisson = 0\n[[material]]\nid = \"soft\"\nyoung = \"100 kPa\"\npoisson = 0",
        );
    let more = "[[move]]\nname = \"squash\"\nface = \"top\"\ndisplacement_mm = { z = -1 }\n[output]\npoints_mm = [[20, 10, 10]]\n";
    let record = bench.record(&format!("{scene}{more}"));
    let case = &record["cases"][0];
    near(numbers(reaction(case, "squash"))[2], -6.4, 1e-6);
    near(numbers(&case["points"][0]["displacements_mm"])[2], -0.8, 1e-6);
    assert_eq!(record["cells"][0]["material"], "soft");
}

/// What presses down is carried by what holds: 1, 2 and 4 N.
#[test]
fn supports_carry_the_load() {
    let bench = Bench::new();
    let record = bench.record(PRESSED);
    let held = numbers(reaction(&record["cases"][0], "fixed 1"));
    for (level, force) in [1.0, 2.0, 4.0].iter().enumerate() {
        near(held[3 * level + 2], *force, 1e-6);
        assert!(held[3 * level].abs() < 1e-6 * force);
    }
}

/// Where the disc presses on nodes that are held, that part goes straight into the support: all supports together carry
/// the force at every level.
#[test]
fn force_on_held_nodes_counts() {
    let bench = Bench::new();
    let held = "[[fixed]]\nbox_mm = [[-1, -1, 19.9], [20.1, 21, 21]]\n[[region]]";
    let record = bench.record(&PRESSED.replace("[[region]]", held));
    let case = &record["cases"][0];
    let carried = [reaction(case, "fixed 1"), reaction(case, "fixed 2")].map(numbers);
    for (level, force) in [1.0, 2.0, 4.0].iter().enumerate() {
        near(
            carried[0][3 * level + 2] + carried[1][3 * level + 2],
            *force,
            1e-6,
        );
        // Half of the disc lies on the held half of the top.
        assert!(carried[1][3 * level + 2] > 0.4 * force);
    }
}

/// The load may be taken in any number of steps, by either iteration: the displacements agree to 1e-6 of the largest.
#[test]
fn the_answer_does_not_depend_on_the_steps() {
    let bench = Bench::new();
    let foam = PRESSED.replace("material = \"rubber\"", "material = \"leap-foam\"");
    let moved = "[[move]]\nname = \"shove\"\nface = \"top\"\ndisplacement_mm = [1, 0, -2]\n[output]\nsurface_points = 12\n";
    let scene = format!("{foam}{moved}");
    let displacements = |solver: &str| {
        let record = bench.record(&format!("{scene}{solver}"));
        let cases = record["cases"].as_array().unwrap().clone();
        let read = |c: &Value| {
            [
                numbers(&c["points"]),
                numbers(&c["largest_displacement"]["displacement_mm"]),
            ]
            .concat()
        };
        cases.iter().flat_map(read).collect::<Vec<f64>>()
    };
    let once = displacements("");
    for solver in [
        "[solver]\nsteps = 7\n",
        "[solver]\nnewton_only = true\nsteps = 2\n",
    ] {
        let again = displacements(solver);
        assert_eq!(once.len(), again.len());
        let apart = once
            .iter()
            .zip(&again)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        // The largest displacements are above 1 mm.
        assert!(apart < 1e-6, "{solver}: {apart:e} mm apart");
    }
    assert!(once.len() > 3 * 3 * 13, "{}", once.len());
}
