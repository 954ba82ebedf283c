//! Mistakes in `goal.toml`: each is answered with the file, the line, what was found and what was expected; exit code 2,
//! no panic, nothing written.

use crate::support::{GOAL, design, pliant};

/// What is replaced, by what, the line that must be named, and words that must be said.
const MISTAKES: [(&str, &str, usize, &[&str]); 36] = [
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
    (
        "[palette]",
        "[palette]\napart = [[\"mold-star-16\", \"gold\"]]",
        17,
        &["gold", "not in the palette", "dragon-skin-30"],
    ),
    (
        "[palette]",
        "[palette]\nmost_mass = \"20 g\"",
        17,
        &["lightest layout weighs", "20.0 g"],
    ),
    (
        "[[example]]",
        "[[palette.surface]]\nface = \"inside\"\nonly = [\"mold-star-16\"]\n\n[[example]]",
        20,
        &["inside", "outside"],
    ),
    (
        "[[example]]",
        "[palette.price]\nmold-star-16 = \"30\"\n\n[[example]]",
        20,
        &["28 EUR/kg"],
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

/// The softest material of the palette gives its own displacements; 40 % more is out of reach, as are displacements of nearly
/// nothing; just below the softest is in reach. Each search goes on to a layout.
#[test]
fn a_goal_out_of_reach_is_said_and_searched_all_the_same() {
    let asked = |displacements: [f64; 2]| {
        let text = format!("displacements_mm = [{}, {}]", displacements[0], displacements[1]);
        GOAL.replace("displacements_mm = [0.9, 1.7]", &text)
    };
    let soft = found(&asked([9.0, 14.0]), &[]);
    let out = &soft["out_of_reach"][0];
    assert_eq!(
        (&out["missing"], &out["material"]),
        (&"softer".into(), &"ecoflex-00-50".into())
    );
    let softest = [0, 1].map(|level| out["nearest"][level]["nearest_mm"].as_f64().unwrap());
    assert!(softest[0] > 0.0 && softest[1] > softest[0] && softest[1] < 14.0);
    assert!(soft["rms_mm"].as_f64().unwrap() > 0.1);

    let stiff = found(&asked([0.01, 0.02]), &[]);
    let out = &stiff["out_of_reach"][0];
    assert_eq!(out["missing"], "stiffer");
    assert!(out["stiffness_times"].as_f64().unwrap() > 5.0, "{out}");

    let within = found(&asked(softest.map(|u| 0.95 * u)), &[]);
    assert_eq!(within["out_of_reach"], serde_json::json!([]));

    // By the law of similarity a material of s times the stiffness gives at F what this one gives at F/s: ask for what the
    // softest gives at 8 N already at 4 N.
    let folder = design(&GOAL.replace(
        "forces_n = [4, 8]\ndisplacements_mm = [0.9, 1.7]",
        &format!("forces_n = [4]\ndisplacements_mm = [{}]", softest[1]),
    ));
    let output = pliant(folder.path(), &["replicate", ".", "--no-export"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        said.contains("press at 4") && said.contains("a material of 0.50 times its stiffness is missing"),
        "{said}"
    );
    let page = std::fs::read_to_string(folder.path().join("found/report.html")).unwrap();
    assert!(page.contains("Out of reach") && page.contains("nearest in reach") && !page.contains("NaN"));
}

const PRICES: &str = "[palette.price]\necoflex-00-50 = \"0.02 EUR/cm3\"\nmold-star-16 = \"30 EUR/kg\"\ndragon-skin-30 = \"0.05 EUR/cm3\"\n\n[[example]]";

/// All nine layouts of the small block with their errors, mass and cost, from an enumeration without rules. Each layer has
/// 25 cm³.
fn every_layout() -> Vec<(Vec<String>, f64, f64, f64)> {
    let folder = design(GOAL);
    let output = pliant(
        folder.path(),
        &["replicate", ".", "--no-export", "--method", "exhaustive"],
    )
    .output()
    .unwrap();
    assert!(output.status.success());
    let text = std::fs::read_to_string(folder.path().join("found/layout.toml")).unwrap();
    let file: toml::Table = text.parse().unwrap();
    let words = |list: &toml::Value| -> Vec<String> {
        list.as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_str().unwrap().to_string())
            .collect()
    };
    let best = file["cell"].as_array().unwrap().iter();
    let best: Vec<String> = best
        .map(|c| c["material"].as_str().unwrap().to_string())
        .collect();
    let mut all = vec![(best, file["error"]["rms_mm"].as_float().unwrap())];
    for other in file["runner_up"].as_array().unwrap() {
        all.push((words(&other["materials"]), other["rms_mm"].as_float().unwrap()));
    }
    assert_eq!(all.len(), 9);
    let record = |id: &str| -> toml::Table {
        let file = format!("{}/materials-db/{id}.toml", env!("CARGO_MANIFEST_DIR"));
        std::fs::read_to_string(file).unwrap().parse().unwrap()
    };
    let density = |id: &String| record(id)["density_g_per_cm3"].as_float().unwrap();
    let price = |id: &String| match id.as_str() {
        "ecoflex-00-50" => 0.02,
        "mold-star-16" => 0.03 * density(id),
        _ => 0.05,
    };
    all.into_iter()
        .map(|(layout, rms)| {
            let mass = layout.iter().map(|id| 25.0 * density(id)).sum();
            let cost = layout.iter().map(|id| 25.0 * price(id)).sum();
            (layout, rms, mass, cost)
        })
        .collect()
}

#[test]
fn the_best_layout_keeps_the_rules_and_none_that_keeps_them_is_better() {
    let all = every_layout();
    let best = all[0].0.clone();
    let costs: Vec<f64> = all.iter().map(|l| l.3).collect();
    let limit = 0.5
        * (costs.iter().copied().fold(f64::INFINITY, f64::min) + costs.iter().copied().fold(0.0, f64::max));
    let masses: Vec<f64> = all.iter().map(|l| l.2).collect();
    let heavy = 0.5
        * (masses.iter().copied().fold(f64::INFINITY, f64::min) + masses.iter().copied().fold(0.0, f64::max));
    type Rule<'a> = (String, Box<dyn Fn(&(Vec<String>, f64, f64, f64)) -> bool + 'a>);
    let apart = |a: &str, b: &str| GOAL.replace("[palette]", &format!("[palette]\napart = [[{a:?}, {b:?}]]"));
    let mut rules: Vec<Rule> = vec![
        (
            GOAL.replace(
                "[[example]]",
                &format!(
                    "[[palette.surface]]\nface = \"top\"\nnever = [{:?}]\n\n[[example]]",
                    best[1]
                ),
            ),
            Box::new(|l| l.0[1] != best[1]),
        ),
        (
            GOAL.replace("[palette]", &format!("[palette]\nmost_cost = \"{limit} EUR\""))
                .replace("[[example]]", PRICES),
            Box::new(move |l| l.3 <= limit),
        ),
        (
            GOAL.replace("[palette]", &format!("[palette]\nmost_mass = \"{heavy} g\"")),
            Box::new(move |l| l.2 <= heavy),
        ),
        (
            GOAL.replace("[palette]", "[palette]\nmost_materials = 1"),
            Box::new(|l| l.0[0] == l.0[1]),
        ),
    ];
    if best[0] != best[1] {
        rules.push((
            apart(&best[1], &best[0]),
            Box::new(|l| l.0 != best && (l.0[0] != best[1] || l.0[1] != best[0])),
        ));
    }
    for (goal, keeps) in &rules {
        let expected = all.iter().find(|l| keeps(l)).unwrap();
        let found = found(goal, &[]);
        let cells: Vec<&str> = found["cells"]
            .as_array()
            .unwrap()
            .iter()
            .map(|c| c["material"].as_str().unwrap())
            .collect();
        assert_eq!(cells, expected.0, "{goal}");
        assert!((found["mass_g"].as_f64().unwrap() - expected.2).abs() < 1e-6 * expected.2);
        if let Some(cost) = found["cost"].as_f64() {
            assert!((cost - expected.3).abs() < 1e-6 * expected.3);
        }
    }
}

/// Against the definition over all nine layouts.
#[test]
fn the_pareto_set_holds_what_none_beats() {
    let all = every_layout();
    let goal = GOAL.replace("[[example]]", PRICES);
    let found = found(&goal, &["--method", "exhaustive", "--pareto"]);
    let rows = found["pareto"].as_array().unwrap();
    for (against, of) in [("mass", 2), ("cost", 3)] {
        let amount = |l: &(Vec<String>, f64, f64, f64)| if of == 2 { l.2 } else { l.3 };
        let mut expected: Vec<&(Vec<String>, f64, f64, f64)> = all
            .iter()
            .filter(|a| {
                !all.iter().any(|b| {
                    let (less, same) = (
                        amount(b) < amount(a) - 1e-9,
                        (amount(b) - amount(a)).abs() <= 1e-9,
                    );
                    (b.1 < a.1 && (less || same)) || (b.1 <= a.1 && less)
                })
            })
            .collect();
        expected.sort_by(|a, b| amount(a).total_cmp(&amount(b)));
        let listed: Vec<Vec<&str>> = rows
            .iter()
            .filter(|r| r["against"] == against)
            .map(|r| {
                r["materials"]
                    .as_array()
                    .unwrap()
                    .iter()
                    .map(|m| m.as_str().unwrap())
                    .collect()
            })
            .collect();
        assert!(!listed.is_empty());
        assert_eq!(
            listed,
            expected.iter().map(|l| l.0.clone()).collect::<Vec<_>>(),
            "{against}"
        );
    }
    // The terminal, the page and the file say it too.
    let folder = design(&goal);
    let output = pliant(
        folder.path(),
        &[
            "replicate",
            ".",
            "--no-export",
            "--method",
            "exhaustive",
            "--pareto",
        ],
    )
    .output()
    .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        said.contains("Error against mass") && said.contains("cost EUR"),
        "{said}"
    );
    let page = std::fs::read_to_string(folder.path().join("found/report.html")).unwrap();
    assert!(page.contains("Error against cost") && !page.contains("NaN"));
    let file = std::fs::read_to_string(folder.path().join("found/layout.toml")).unwrap();
    assert!(file.contains("[[pareto]]"));
    let again = pliant(folder.path(), &["export", ".", "--out", "again"])
        .output()
        .unwrap();
    assert!(
        again.status.success(),
        "{}",
        String::from_utf8_lossy(&again.stderr)
    );
}
