//! The files: ParaView's, a goal's, and the record.

use crate::bench::{BAR, Bench, DATABASE, PRESSED, numbers};
use pliant::design::goal::Goal;
use pliant::material::database::Database;

/// The CSV of a press is an example of a goal: read back, it holds the points and displacements of the record.
#[test]
fn a_goal_reads_the_csv_of_a_press() {
    let bench = Bench::new();
    let scene = format!(
        "{PRESSED}[output]\nsurface_points = 10\nsurface_radius = \"9 mm\"\npoints_mm = [[0, 0, 20]]\n"
    );
    let case = &bench.record(&scene)["cases"][0];
    let goal = r#"
schema = 1
name = "bar"
[object]
mesh = "bar.stl"
unit = "mm"
[[fixed]]
face = "bottom"
[[region]]
name = "bar"
layers = 2
[palette]
materials = ["ecoflex-00-30"]
[[example]]
name = "middle"
point_mm = [20, 10, 20]
direction = [0, 0, -1]
radius = "6 mm"
file = "simulated/middle.csv"
"#;
    let file = bench.write("goal.toml", goal);
    let goal = Goal::read(&file, &Database::open(DATABASE.as_ref()).unwrap()).unwrap();
    let example = &goal.setup.examples[0];
    assert_eq!(example.forces_n, [1.0, 2.0, 4.0]);
    // The contact point, ten around it, and the corner.
    assert_eq!(example.points.len(), 12);
    for (point, record) in example.points.iter().zip(case["points"].as_array().unwrap()) {
        assert_eq!(numbers(&record["place_mm"]), point.place.as_slice());
        // On the top face, within the radius asked for; the corner is the exception.
        let off = (point.place - pliant::math::Vec3::new(20.0, 10.0, 20.0)).norm();
        assert!(off <= 9.0 || point.place.as_slice() == [0.0, 0.0, 20.0], "{off}");
        let kept: Vec<f64> = point
            .displacements_mm
            .iter()
            .flatten()
            .map(|d| d.unwrap())
            .collect();
        for (a, b) in kept.iter().zip(numbers(&record["displacements_mm"])) {
            // The CSV keeps nanometres.
            assert!((a - b).abs() <= 0.51e-6, "{a} {b}");
        }
    }
    // Spread evenly: no two of the ten are near one another. Ten discs of 2 mm fit easily into one of 9 mm.
    let around = &example.points[..11];
    for (i, p) in around.iter().enumerate() {
        assert!(around[..i].iter().all(|q| (p.place - q.place).norm() > 2.0));
    }
    // The contact moves most, downwards, and more under more force.
    let down = |level: usize| example.points[0].displacements_mm[level][2].unwrap();
    assert!(down(2) < down(1) && down(1) < down(0) && down(0) < 0.0);
}

/// `section name components` of every array that an XML header declares.
fn arrays(header: &str) -> Vec<String> {
    use quick_xml::events::Event;
    let mut reader = quick_xml::Reader::from_str(header);
    let (mut found, mut section) = (Vec::new(), String::new());
    loop {
        match reader.read_event().unwrap() {
            Event::Eof => return found,
            Event::Start(tag) => section = tag.name().as_ref().to_string(),
            Event::Empty(tag) => {
                let value = |key: &str| tag.try_get_attribute(key).unwrap().unwrap().value.into_owned();
                let (name, components) = (value("Name"), value("NumberOfComponents"));
                found.push(format!("{section} {name} {components}"));
            }
            _ => {}
        }
    }
}

#[test]
fn vtu_holds_the_named_arrays() {
    let bench = Bench::new();
    bench.record(&format!(
        "{PRESSED}[[move]]\nname = \"lift\"\nface = \"top\"\ndisplacement_mm = [0, 0, 1]\n"
    ));
    for name in ["middle", "lift"] {
        let bytes = std::fs::read(bench.path(&format!("simulated/{name}.vtu"))).unwrap();
        let end = bytes.windows(13).position(|w| w == b"<AppendedData").unwrap();
        let header = String::from_utf8(bytes[..end].to_vec()).unwrap() + "</VTKFile>";
        let found = arrays(&header);
        let expected = [
            "PointData displacement 3",
            "CellData strain 6",
            "CellData stress 6",
            "CellData material_id 1",
            "CellData young_modulus 1",
            "CellData jacobian 1",
            "CellData fill 1",
        ];
        assert_eq!(found[..expected.len()], expected);
        // 8 × 4 × 4 cells of 5 mm.
        assert!(header.contains("NumberOfCells=\"128\""), "{header}");
    }
    // A move has no known force, so it is no example.
    assert!(bench.path("simulated/middle.csv").exists() && !bench.path("simulated/lift.csv").exists());
}

#[test]
fn nodes_and_fitted_range_are_reported() {
    let bench = Bench::new();
    let scene = format!(
        "{BAR}[[move]]\nname = \"squash\"\nface = \"top\"\ndisplacement_mm = {{ z = -2 }}\n[output]\nnodes = [0, 3]\n"
    );
    let linear = bench.record(&scene);
    let nodes = linear["cases"][0]["nodes"].as_array().unwrap().clone();
    assert_eq!((nodes.len(), nodes[1]["node"].as_u64()), (2, Some(3)));
    for node in &nodes {
        // Uniaxial compression by 10 %, ν = 0.3: u = (0.03 x, 0.03 y, −0.1 z).
        let (place, u) = (numbers(&node["place_mm"]), numbers(&node["displacements_mm"]));
        for (c, slope) in [0.03, 0.03, -0.1].iter().enumerate() {
            assert!((u[c] - slope * place[c]).abs() < 1e-8);
        }
    }
    // Hooke's law has no fitted range; this silicone was compressed by 54 % and never pulled.
    assert_eq!(linear["cases"][0]["share_outside_fitted_range"], 0.0);
    let pulled = scene
        .replace("material = \"rubber\"", "material = \"ecoflex-00-30\"")
        .replace("z = -2", "z = 2");
    let silicone = bench.record(&pulled);
    assert_eq!(silicone["cases"][0]["share_outside_fitted_range"], 1.0);
    assert!(silicone["warnings"][0].as_str().unwrap().contains("100 %"));
}

#[test]
fn threads_and_repeats_leave_equal_files() {
    let bench = Bench::new();
    let scene = format!(
        "{PRESSED}[[move]]\nname = \"lift\"\nface = \"top\"\ndisplacement_mm = [0, 0, 1]\n[output]\nsurface_points = 5\n"
    );
    for (threads, out) in [("1", "one"), ("2", "two")] {
        let run = bench.simulate(&scene, &["--threads", threads, "--out", out]);
        assert_eq!(run.code, 0, "{}", run.err);
    }
    for name in ["simulated.json", "middle.csv", "middle.vtu", "lift.vtu"] {
        let read = |folder: &str| std::fs::read(bench.path(&format!("{folder}/{name}"))).unwrap();
        assert_eq!(read("one"), read("two"), "{name}");
    }
}

#[test]
fn json_is_alone_on_standard_output() {
    let bench = Bench::new();
    let run = bench.simulate(PRESSED, &["--json"]);
    let answer: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(answer["cases"][0]["complete"], true);
    let people = bench.simulate(PRESSED, &[]);
    assert!(people.out.contains("4.000 of 4.000 N"), "{}", people.out);
}

/// The example of the documentation does what it says, with the names that it gives.
#[test]
fn the_documented_scene_runs() {
    let bench = Bench::new();
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/formats.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (_, section) = page.split_once("### An example of a scene").unwrap();
    let scene = section
        .split("```toml\n")
        .nth(1)
        .unwrap()
        .split("```")
        .next()
        .unwrap();
    let block = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/block/block.stl");
    let record = bench.record(&scene.replace("\"block.stl\"", &format!("{block:?}")));
    let names: Vec<&str> = record["cells"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| c["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["core", "rest 1", "rest 2"]);
    assert_eq!(
        record["materials"],
        serde_json::json!(["gel", "dragon-skin-20", "ecoflex-00-30"])
    );
    let count = |case: usize, key: &str| record["cases"][case][key].as_array().unwrap().len();
    // The press: three forces; the contact, 30 points around it, and the corner. The move: four steps and the corner.
    assert_eq!(
        [count(0, "levels"), count(0, "points"), count(0, "nodes")],
        [3, 32, 2]
    );
    assert_eq!(
        [count(1, "levels"), count(1, "points"), count(1, "nodes")],
        [4, 1, 2]
    );
    // Every key of a case is explained.
    for key in record["cases"][0].as_object().unwrap().keys() {
        assert!(page.contains(&format!("`{key}`")), "{key}");
    }
}
