//! Scenes on volume meshes: closed forms, other programs' cases, mistakes that are answered.

use crate::bench::{Bench, DATABASE, Run, numbers, run};
use pliant::geometry::files::{Group, open_surface, write_msh, write_stl};
use pliant::geometry::shapes::block;
use pliant::geometry::volume::{Elements, KUHN, VolumeMesh};
use pliant::math::Vec3;
use pliant::units::LengthUnit;
use serde_json::{Value, json};

/// A bar of 40 × 20 × 20 mm with its end faces as sets and its halves as groups.
fn bar(tetrahedra: bool) -> (VolumeMesh, [Group; 2], [Group; 4]) {
    let mut mesh = VolumeMesh::cuboid(Vec3::new(40.0, 20.0, 20.0), [4, 2, 2], false);
    let mut share = 1;
    if tetrahedra {
        let cells: Vec<Vec<u32>> = (0..16).map(|e| mesh.elements.nodes_of(e).to_vec()).collect();
        let tets = cells.iter().flat_map(|cell| KUHN.map(|tet| tet.map(|k| cell[k])));
        mesh.elements = Elements::Tetrahedra(tets.collect());
        share = 6;
    }
    let group = |name: &str, members: Vec<u32>| Group {
        name: name.into(),
        members,
    };
    let nodes = |name: &str, fits: &dyn Fn(&Vec3) -> bool| {
        let inside = mesh.nodes.iter().enumerate().filter(|(_, x)| fits(x));
        group(name, inside.map(|(i, _)| i as u32).collect())
    };
    let lower = group("lower", (0..8 * share).collect());
    let upper = group("upper", (8 * share..16 * share).collect());
    let sets = [
        nodes("bottom", &|x| x.z == 0.0),
        nodes("top", &|x| x.z == 20.0),
        nodes("left", &|x| x.x == 0.0),
        nodes("front", &|x| x.y == 0.0),
    ];
    (mesh, [lower, upper], sets)
}

fn bench(tetrahedra: bool) -> Bench {
    let bench = Bench::new();
    let (mesh, groups, sets) = bar(tetrahedra);
    let mut bytes = Vec::new();
    write_msh(&mut bytes, &mesh, &groups, &sets).unwrap();
    std::fs::write(bench.path("bar.msh"), bytes).unwrap();
    bench
}

/// On rollers: nothing but E, A and ν counts.
const ROLLERS: &str = r#"schema = 1
[mesh]
file = "bar.msh"
unit = "mm"
[[material]]
id = "rubber"
young = "0.3 MPa"
poisson = 0.3
density = "1000 kg/m3"
[[region]]
name = "all"
material = "rubber"
[[fixed]]
set = "bottom"
components = "z"
[[fixed]]
set = "left"
components = "x"
[[fixed]]
set = "front"
components = "y"
"#;

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "found {found}, expected {expected}"
    );
}

fn support<'a>(level: &'a Value, name: &str) -> &'a Value {
    let list = level["supports"].as_array().unwrap();
    let found = list
        .iter()
        .find(|s| s["support"].as_str().unwrap().contains(name));
    &found.unwrap_or_else(|| panic!("no {name}"))["force_n"]
}

/// As the bar of the grid in `physics.rs`: F = E A ε = 0.3 · 800 · 0.1 = 24 N at 2 mm, width + ν ε · 40 mm = 1.2 mm. The
/// work of the support is ½ F u = 24 mJ for a law that is linear in Biot strain; the trapezoid over two levels has it
/// exactly. Strain −0.1, 0.03, 0.03; Cauchy stress −0.03 MPa over the area's growth 1.03².
#[test]
fn a_bar_pushes_back_with_e_a_epsilon() {
    for tetrahedra in [false, true] {
        let bench = bench(tetrahedra);
        let scene = format!(
            "{ROLLERS}[[load]]\nname = \"squash\"\nlevels = 2\n[[load.move]]\nset = \"top\"\ndisplacement_mm = {{ z = -2 }}\n\
             [output]\npoints_mm = [[40, 20, 20], [13, 7, 11]]\nstrains = \"all\"\n"
        );
        let record = bench.record(&scene);
        let levels = record["cases"][0]["levels"].as_array().unwrap();
        assert_eq!(levels.len(), 2);
        near(
            support(&levels[0], "move (top)")[2].as_f64().unwrap(),
            -12.0,
            1e-7,
        );
        near(
            support(&levels[1], "move (top)")[2].as_f64().unwrap(),
            -24.0,
            1e-7,
        );
        near(support(&levels[1], "bottom")[2].as_f64().unwrap(), 24.0, 1e-7);
        near(levels[1]["work_done_mj"].as_f64().unwrap(), 24.0, 1e-6);
        let corner = numbers(&levels[1]["points"][0]["displacement_mm"]);
        let inside = numbers(&levels[1]["points"][1]["displacement_mm"]);
        for c in 0..3 {
            near(corner[c], [1.2, 0.6, -2.0][c], 1e-7);
            near(inside[c], [0.03 * 13.0, 0.03 * 7.0, -0.1 * 11.0][c], 1e-7);
        }
        let strain = numbers(&levels[1]["points"][1]["strain"]);
        let stress = numbers(&levels[1]["points"][1]["stress_mpa"]);
        for c in 0..6 {
            near(strain[c], [0.03, 0.03, -0.1, 0.0, 0.0, 0.0][c], 1e-8);
            near(
                stress[c],
                [0.0, 0.0, -0.03 / (1.03 * 1.03), 0.0, 0.0, 0.0][c],
                1e-8,
            );
        }
        for level in levels {
            assert_eq!(
                level["elements"]["strain"].as_array().unwrap().len(),
                if tetrahedra { 96 } else { 16 }
            );
        }
        near(
            levels[1]["smallest_jacobian"].as_f64().unwrap(),
            0.9 * 1.03 * 1.03,
            1e-8,
        );
        for file in ["squash.vtu", "squash-001.vtu", "squash.pvd"] {
            assert!(bench.path("simulated").join(file).exists(), "{file}");
        }
    }
}

/// A finer surface of the same bar, carried along: a homogeneous strain takes it to 41.2 × 20.6 × 18 mm, its left, front and
/// lower faces staying in their planes; STL holds single precision.
#[test]
fn a_fine_surface_follows_the_mesh() {
    for follow in ["moving-least-squares", "elements"] {
        let bench = bench(true);
        let fine = block(Vec3::new(40.0, 20.0, 20.0), 1.5).unwrap();
        let mut bytes = Vec::new();
        write_stl(&fine, &mut bytes).unwrap();
        std::fs::write(bench.path("fine.stl"), bytes).unwrap();
        let scene = format!(
            "{ROLLERS}[[load]]\nname = \"squash\"\nlevels = 2\n[[load.move]]\nset = \"top\"\ndisplacement_mm = {{ z = -2 }}\n\
             [output]\nsurface = {{ file = \"fine.stl\", unit = \"mm\", follow = {follow:?} }}\n"
        );
        bench.record(&scene);
        for (name, share) in [("squash-001-surface.stl", 0.5), ("squash-surface.stl", 1.0)] {
            let moved =
                open_surface(&bench.path("simulated").join(name), Some(LengthUnit::Millimetre)).unwrap();
            let (low, high) = moved.mesh.bounds().unwrap();
            let expected = Vec3::new(40.0 + 1.2 * share, 20.0 + 0.6 * share, 20.0 - 2.0 * share);
            assert!(
                low.amax() < 1e-5 && (high - expected).amax() < 1e-5,
                "{follow} {name}: {low} {high}"
            );
            assert_eq!(moved.mesh.triangles.len(), fine.triangles.len());
        }
    }
    let bench = bench(true);
    let mut bytes = Vec::new();
    write_stl(&block(Vec3::new(90.0, 20.0, 20.0), 10.0).unwrap(), &mut bytes).unwrap();
    std::fs::write(bench.path("long.stl"), bytes).unwrap();
    let scene = format!(
        "{ROLLERS}[[load]]\nname = \"squash\"\n[[load.move]]\nset = \"top\"\ndisplacement_mm = {{ z = -2 }}\n\
         [output]\nsurface = {{ file = \"long.stl\", unit = \"mm\" }}\n"
    );
    let run = bench.simulate(&scene, &[]);
    assert_eq!(run.code, 2);
    assert!(
        run.err.contains("long.stl") && run.err.contains("outside the mesh"),
        "{}",
        run.err
    );
}

/// Gravity: 16 000 mm³ of 1000 kg/m³ weigh 0.016 kg, 0.15696 N at 9.81 m/s². Pressure of 10 kPa on 40 × 20 mm: 8 N, on an
/// even bar the same as that force spread as the pressure spreads it; per node for hand: corners carry a quarter of an
/// inner node on hexahedra.
#[test]
fn gravity_pressure_and_forces_add_up() {
    for tetrahedra in [false, true] {
        let bench = bench(tetrahedra);
        let scene = format!(
            "{ROLLERS}[[load]]\nname = \"weight\"\ngravity_m_s2 = [0, 0, -9.81]\n\
             [[load]]\nname = \"press\"\n[[load.pressure]]\nset = \"top\"\npressure = \"10 kPa\"\n\
             [[load]]\nname = \"nodes\"\nforces_n = [[45, 0, 0, -1], [45, 0, 0.5, 0]]\n[[load.force]]\nset = \"top\"\ntotal_n = [0, 0, -3]\n"
        );
        let record = bench.record(&scene);
        let level = |case: usize| &record["cases"][case]["levels"][0];
        near(support(level(0), "bottom")[2].as_f64().unwrap(), 0.15696, 1e-9);
        near(support(level(1), "bottom")[2].as_f64().unwrap(), 8.0, 1e-7);
        near(support(level(2), "bottom")[2].as_f64().unwrap(), 4.0, 1e-7);
        near(level(2)["external_force_n"][2].as_f64().unwrap(), -4.0, 1e-12);
        // Even pressure on an even bar: ε = −p/E at every node of the top, u = −20 mm · 0.01/0.3 (law linear in Biot strain,
        // load per undeformed area).
        for (node, u) in level(1)["displacements_mm"]
            .as_array()
            .unwrap()
            .iter()
            .enumerate()
        {
            if node >= 30 {
                near(u[2].as_f64().unwrap(), -20.0 / 30.0, 1e-6);
            }
        }
        // Without friction, what pushes along y is held by the front.
        near(support(level(2), "front")[1].as_f64().unwrap(), -0.5, 1e-7);
        // A dead load on a body that is linear in Biot strain and does not turn: it stores half of force times way.
        let work = level(1)["work_done_mj"].as_f64().unwrap();
        near(work, 0.5 * 8.0 * 20.0 / 30.0, 1e-5);
    }
}

/// Two waypoints, of which the second is the end of a straight move: the same state. And back at rest nothing is left.
#[test]
fn a_path_arrives_where_a_straight_move_does() {
    let bench = bench(false);
    let glued = ROLLERS.replace("components = \"z\"\n", "");
    let scene = format!(
        "{glued}[[load]]\nname = \"path\"\n[[load.move]]\nset = \"top\"\npath_mm = {{ x = [2, 1, 0], z = [0, -2, 0] }}\n\
         [[load]]\nname = \"straight\"\n[[load.move]]\nset = \"top\"\ndisplacement_mm = {{ x = 1, z = -2 }}\n"
    );
    let scene = scene.replace("[[fixed]]\nset = \"left\"\ncomponents = \"x\"\n", "");
    let record = bench.record(&scene);
    let (path, straight) = (&record["cases"][0]["levels"], &record["cases"][1]["levels"]);
    assert_eq!(path.as_array().unwrap().len(), 3);
    let (a, b) = (
        numbers(&path[1]["displacements_mm"]),
        numbers(&straight[0]["displacements_mm"]),
    );
    for (a, b) in a.iter().zip(&b) {
        near(*a, *b, 1e-9);
    }
    assert!(
        numbers(&path[2]["displacements_mm"])
            .iter()
            .all(|u| u.abs() < 1e-12)
    );
    // x goes 2 mm and z stays: sheared, not pressed.
    near(numbers(&path[0]["displacements_mm"])[3 * 44], 2.0, 0.0);
}

/// Halves of 0.1 and 0.4 MPa in series as in `physics.rs`, by group, by list and by box: 6.4 N/mm.
#[test]
fn materials_by_group_list_and_box() {
    for (tetrahedra, place) in [
        (true, "group = \"lower\"".to_string()),
        (false, format!("elements = {:?}", (1..=8).collect::<Vec<u32>>())),
        (false, "box_mm = [[0, 0, 0], [40, 20, 10]]".to_string()),
    ] {
        let bench = bench(tetrahedra);
        let soft = "[[material]]\nid = \"soft\"\nyoung = \"100 kPa\"\npoisson = 0\n";
        let scene = ROLLERS
            .replace(
                "young = \"0.3 MPa\"\npoisson = 0.3",
                "young = \"0.4 MPa\"\npoisson = 0",
            )
            .replace(
                "[[region]]",
                &format!("{soft}[[region]]\nname = \"soft half\"\nmaterial = \"soft\"\n{place}\n[[region]]"),
            );
        let more =
            "[[load]]\nname = \"squash\"\n[[load.move]]\nset = \"top\"\ndisplacement_mm = { z = -1 }\n";
        let record = bench.record(&format!("{scene}{more}"));
        near(
            support(&record["cases"][0]["levels"][0], "top")[2]
                .as_f64()
                .unwrap(),
            -6.4,
            1e-6,
        );
        assert_eq!(record["regions"][0]["elements"], record["regions"][1]["elements"]);
    }
}

/// The same scene with its arrays written out, as TOML and as JSON.
#[test]
fn arrays_and_json_say_the_same() {
    let bench = bench(true);
    let (mesh, _, _) = bar(true);
    let load = "[[load]]\nname = \"squash\"\n[[load.move]]\nset = \"top\"\ndisplacement_mm = { z = -2 }\n";
    let record = bench.record(&format!("{ROLLERS}{load}"));
    let Elements::Tetrahedra(tets) = &mesh.elements else {
        panic!("tetrahedra");
    };
    let nodes: Vec<[f64; 3]> = mesh.nodes.iter().map(|x| (*x).into()).collect();
    let side = |name: &str, low: [f64; 3], high: [f64; 3]| json!({"name": name, "box_mm": [low, high]});
    let scene = json!({
        "schema": 1,
        "mesh": {"nodes_mm": nodes, "tetrahedra": tets},
        "material": [{"id": "rubber", "young": "0.3 MPa", "poisson": 0.3}],
        "region": [{"name": "all", "material": "rubber"}],
        "set": [
            side("bottom", [-1.0, -1.0, -1.0], [41.0, 21.0, 0.1]),
            side("top", [-1.0, -1.0, 19.9], [41.0, 21.0, 21.0]),
            side("left", [-1.0, -1.0, -1.0], [0.1, 21.0, 21.0]),
            side("front", [-1.0, -1.0, -1.0], [41.0, 0.1, 21.0]),
        ],
        "fixed": [
            {"set": "bottom", "components": "z"},
            {"set": "left", "components": "x"},
            {"set": "front", "components": "y"},
        ],
        "load": [{"name": "squash", "move": [{"set": "top", "displacement_mm": {"z": -2}}]}],
    });
    let file = bench.write("again/scene.json", &format!("{scene:#}"));
    let run = run(bench.folder.path(), &["simulate", &file.to_string_lossy()]);
    assert_eq!(run.code, 0, "{}", run.err);
    let text = std::fs::read_to_string(bench.path("again/simulated/simulated.json")).unwrap();
    let again: Value = serde_json::from_str(&text).unwrap();
    let of = |record: &Value| numbers(&record["cases"][0]["levels"][0]["displacements_mm"]);
    // Elements come in another order from the groups of the file, and so sums in another order.
    for (a, b) in of(&record).iter().zip(of(&again)) {
        near(*a, b, 1e-9);
    }
    let set = &again["cases"][0]["levels"][0]["sets"][1];
    assert_eq!((&set["name"], &set["nodes"]), (&json!("top"), &json!(15)));
    near(set["mean_displacement_mm"][2].as_f64().unwrap(), -2.0, 1e-12);
}

fn squeezed(run: &Run) -> String {
    run.err.split_whitespace().filter(|w| *w != "│").collect()
}

const LOAD: &str =
    "[[load]]\nname = \"squash\"\n[[load.move]]\nset = \"top\"\ndisplacement_mm = { z = -2 }\n";

/// A change to the scene, the line that the message names, and words that it holds.
const MISTAKES: [(&str, &str, usize, &[&str]); 22] = [
    ("bar.msh", "rab.msh", 3, &["rab.msh", "cannot be read"]),
    ("bar.msh", "bar.stl", 3, &[".msh", ".vtu"]),
    ("unit = \"mm\"\n", "", 3, &["40 × 20 × 20", "unit"]),
    ("unit = \"mm\"", "unit = \"furlong\"", 4, &["furlong"]),
    ("young", "yuong", 7, &["yuong"]),
    ("poisson = 0.3", "poisson = 0.5", 8, &["0.5", "Poisson"]),
    ("\"1000 kg/m3\"", "\"0 kg/m3\"", 9, &["above zero"]),
    ("material = \"rubber\"", "material = \"rubbr\"", 12, &["rubbr"]),
    (
        "material = \"rubber\"",
        "material = \"rubber\"\ngroup = \"middle\"",
        13,
        &["\"middle\"", "\"lower\", \"upper\""],
    ),
    (
        "material = \"rubber\"",
        "material = \"rubber\"\ngroup = \"lower\"",
        10,
        &["8 of 16 elements", "no region"],
    ),
    (
        "material = \"rubber\"",
        "material = \"rubber\"\nelements = [99]",
        13,
        &["element 99", "1 to 16"],
    ),
    (
        "set = \"bottom\"",
        "set = \"botom\"",
        14,
        &["botom", "\"bottom\", \"top\""],
    ),
    (
        "components = \"z\"",
        "components = \"w\"",
        15,
        &["\"w\"", "\"xyz\""],
    ),
    ("{ z = -2 }", "{ z = -2, w = 1 }", 26, &["\"w\""]),
    ("{ z = -2 }", "{ z = nan }", 26, &["nan"]),
    (
        "set = \"top\"\n",
        "set = \"bottom\"\n",
        25,
        &["node 1", "along z", "holds it"],
    ),
    (
        "[[load.move]]\nset = \"top\"\ndisplacement_mm = { z = -2 }",
        "",
        23,
        &["does nothing"],
    ),
    (
        "[[load.move]]",
        "levels = [1, 0.5]\n[[load.move]]",
        24,
        &["rising"],
    ),
    (
        "[[load.move]]",
        "forces_n = [[99, 0, 0, 1]]\n[[load.move]]",
        24,
        &["99.0", "a node of the mesh"],
    ),
    (
        "[[load.move]]",
        "[[load.pressure]]\nset = \"edge\"\npressure = \"1 kPa\"\n[[load.move]]",
        25,
        &["\"edge\""],
    ),
    ("density = \"1000 kg/m3\"\n", "", 23, &["density", "1070 kg/m3"]),
    ("schema = 1", "schema = 2", 1, &["schema 2"]),
];

#[test]
fn mistakes_name_line_found_and_expected() {
    let bench = bench(false);
    let mut wrong = Vec::new();
    for (old, new, line, words) in MISTAKES {
        let mut scene = format!("{ROLLERS}{LOAD}");
        if old.starts_with("density") {
            scene = scene.replace("[[load.move]]", "gravity_m_s2 = [0, 0, -9.81]\n[[load.move]]");
        }
        assert!(scene.contains(old), "{old}");
        let run = bench.simulate(&scene.replacen(old, new, 1), &["--db", DATABASE]);
        let message = squeezed(&run);
        let mut missing: Vec<String> = words.iter().map(|w| w.split(' ').collect()).collect();
        missing.push(format!("scene.toml:{line}:"));
        missing.retain(|word| !message.contains(word));
        if run.code != 2 || !missing.is_empty() {
            wrong.push(format!("{old} → {new}: no {missing:?} in {message}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let far = format!("{ROLLERS}{LOAD}[output]\npoints_mm = [[20, 10, 90]]\n");
    let run = bench.simulate(&far, &[]);
    assert!(
        run.code == 2 && squeezed(&run).contains("scene.toml:28:"),
        "{}",
        run.err
    );
    assert!(!bench.path("simulated").exists());
}

/// Another program's case from its own arrays: a block of tetrahedra under a dead load on a patch, isochoric neo-Hookean;
/// five codes agree on the mean displacement of the patch (`SOURCE.txt` beside the file).
#[test]
fn the_block_of_five_codes() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../shared/data/block-benchmark/block-1680.json"
    );
    if !std::path::Path::new(file).exists() {
        println!("skipped: no {file}");
        return;
    }
    let bench = Bench::new();
    let scene = format!(
        r#"schema = 1
[mesh]
file = "{file}"
unit = "mm"
[[set]]
name = "patch"
group = "patch_nodes"
[[material]]
id = "rubber"
law = "neo-hookean"
form = "isochoric"
young = "0.15 MPa"
poisson = 0.4
[[region]]
name = "block"
material = "rubber"
[[fixed]]
set = "fixed_nodes"
[[load]]
name = "press"
levels = 10
[[load.force]]
set = "patch"
total_n = [0, 0, -15]
"#
    );
    let record = bench.record(&scene);
    let levels = record["cases"][0]["levels"].as_array().unwrap();
    assert_eq!(levels.len(), 10);
    let mean = numbers(&levels[9]["sets"][0]["mean_displacement_mm"])[2];
    near(mean, -3.2384626163, 1e-6);
    near(
        support(&levels[9], "fixed_nodes")[2].as_f64().unwrap(),
        15.0,
        1e-6,
    );
    // A dead load's work goes into the material: trapezoids over ten levels of a curve that stiffens are 0.2 % off.
    let (done, stored) = (&levels[9]["work_done_mj"], &levels[9]["stored_energy_mj"]);
    let (done, stored) = (done.as_f64().unwrap(), stored.as_f64().unwrap());
    near(done, stored, 5e-3 * stored);
}

/// Laws in other words that say 0.3 MPa and 0.3: all are linear in Biot strain, so the bar answers 24 N as above. μ = E/2.6,
/// K = E/1.2; λ = K − 2μ/3; the engineering moduli of an isotropic material are the same along and across.
#[test]
fn every_form_of_a_law_can_be_written_in_a_scene() {
    let (mu, bulk) = (0.3 / 2.6, 0.3 / 1.2);
    let lambda = bulk - 2.0 / 3.0 * mu;
    let centres = |a: f64, b: f64, second_unit: &str| {
        let centre =
            |strain: &str| format!("{{ strain = {strain}, moduli = [\"{a} MPa\", \"{b}{second_unit}\"] }}");
        let list = [
            centre("[0, 0, 0, 0, 0, 0]"),
            centre("[0.03, 0.03, -0.2, 0, 0, 0]"),
            centre("[-0.03, -0.03, 0.2, 0, 0, 0]"),
            centre("[0, 0, 0, 0.1, 0, 0]"),
        ];
        format!("centres = [{}]", list.join(", "))
    };
    let laws = [
        format!("law = \"linear\"\nshear = \"{mu} MPa\"\nbulk = \"{bulk} MPa\""),
        format!(
            "law = \"transverse\"\nyoung_axial = \"0.3 MPa\"\nyoung_plane = \"0.3 MPa\"\npoisson_axial = 0.3\npoisson_plane = 0.3\nshear_axial = \"{mu} MPa\""
        ),
        format!("law = \"rbf\"\nform = \"secant\"\n{}", centres(mu, bulk, " MPa")),
        format!("law = \"rbf\"\nform = \"energy\"\n{}", centres(mu, bulk, " MPa")),
        format!(
            "law = \"rbf\"\nform = \"paper\"\nnorm = \"vector\"\nconstant = true\nconvention = \"lame\"\n{}",
            centres(lambda, mu, " MPa")
        ),
        format!(
            "law = \"rbf\"\nform = \"paper\"\nnorm = \"tensor\"\nconstant = true\nconvention = \"young-poisson\"\n{}",
            centres(0.3, 0.3, "")
        ),
    ];
    let bench = bench(true);
    for law in laws {
        let scene = format!("{ROLLERS}{LOAD}").replace("young = \"0.3 MPa\"\npoisson = 0.3", &law);
        let record = bench.record(&scene);
        let level = &record["cases"][0]["levels"][0];
        let force = support(level, "top")[2].as_f64().unwrap();
        assert!((force + 24.0).abs() < 1e-6, "{law}: {force}");
    }
}

/// A disc as wide as the bar, without friction, is a press with F = E A ε; a force of 24 N sends it 2 mm down, and a
/// travel of 2 mm takes 24 N. The floor under the bar carries what the disc pushes.
#[test]
fn a_probe_presses_the_bar_against_the_floor() {
    let bench = bench(false);
    // The bottom is free to lift off: the floor and a roller at its corners hold it.
    let scene = format!(
        "{}[floor]\npoint_mm = [0, 0, 0]\n[[probe]]\nname = \"press\"\nshape = \"disc\"\nradius = \"60 mm\"\n\
         position_mm = [20, 10, 20]\ndirection = [0, 0, -1]\n\
         [[load]]\nname = \"travel\"\nlevels = 2\n[[load.push]]\nprobe = \"press\"\ntravel_mm = 2\n\
         [[load]]\nname = \"force\"\n[[load.push]]\nprobe = \"press\"\nforce_n = [12, 24]\n",
        ROLLERS
            .replace(
                "set = \"bottom\"\ncomponents = \"z\"",
                "set = \"corner\"\ncomponents = \"z\""
            )
            .replace(
                "[[region]]",
                "[[set]]\nname = \"corner\"\nbox_mm = [[-1, -1, -1], [1, 1, 1]]\n[[region]]"
            )
    );
    let record = bench.record(&scene);
    for case in 0..2 {
        let levels = record["cases"][case]["levels"].as_array().unwrap();
        assert_eq!(levels.len(), 2);
        for (level, force, way) in [(&levels[0], 12.0, 1.0), (&levels[1], 24.0, 2.0)] {
            let [press, floor] = [0, 1].map(|b| &level["bodies"][b]);
            assert_eq!(
                (&press["name"], &floor["name"]),
                (&json!("press"), &json!("floor"))
            );
            near(press["force_n"][2].as_f64().unwrap(), -force, 1e-4);
            near(press["travel_mm"].as_f64().unwrap(), way, 1e-5);
            let held = support(level, "corner")[2].as_f64().unwrap();
            near(floor["force_n"][2].as_f64().unwrap() + held, force, 1e-4);
        }
        // Half of force times way over two levels of a straight line.
        near(levels[1]["work_done_mj"].as_f64().unwrap(), 24.0, 1e-3);
    }
    let wrong = scene.replace(
        "probe = \"press\"\ntravel_mm = 2",
        "probe = \"pres\"\ntravel_mm = 2",
    );
    let run = bench.simulate(&wrong, &[]);
    assert!(
        run.code == 2 && squeezed(&run).contains("\"press\",\"floor\""),
        "{}",
        run.err
    );
}

/// The example of the documentation does what it says, and so does its part on probes.
#[test]
fn the_documented_scene_runs() {
    let bench = bench(true);
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/formats.md");
    let page = std::fs::read_to_string(page).unwrap();
    let block = |heading: &str| {
        let (_, section) = page.split_once(heading).unwrap();
        let block = section.split("```toml\n").nth(1).unwrap();
        block.split("```").next().unwrap().to_string()
    };
    let scene = block("### An example on a volume mesh");
    let record = bench.record(&scene);
    assert_eq!(record["materials"], json!(["fibres", "rubber"]));
    let count = |case: usize, key: &str| record["cases"][case]["levels"][0][key].as_array().unwrap().len();
    assert_eq!(
        [count(0, "points"), count(0, "sets"), count(0, "supports")],
        [2, 1, 1]
    );
    assert_eq!(
        [
            record["cases"][0]["levels"].as_array().unwrap().len(),
            count(1, "supports")
        ],
        [2, 2]
    );
    for key in record["cases"][0]["levels"][1].as_object().unwrap().keys() {
        assert!(page.contains(&format!("`{key}`")), "{key}");
    }
    let (before, after) = scene.split_once("# A case: everything").unwrap();
    let (_, after) = after.split_once("[solver]").unwrap();
    let record = bench.record(&format!(
        "{before}{}[solver]{after}",
        block("### Probes and a floor")
    ));
    let levels = record["cases"][0]["levels"].as_array().unwrap();
    assert_eq!(levels.len(), 3);
    let pushes = |level: &Value| level["bodies"][0]["force_n"][2].as_f64().unwrap();
    // The ball's lowest point starts at the top of the bar and goes 1 mm deep.
    assert!(pushes(&levels[0]) < 0.0 && pushes(&levels[2]) < pushes(&levels[0]));
}
