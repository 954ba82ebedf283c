use super::*;
use crate::design::goal::GoalError;
use crate::material::database::Database;
use std::path::Path;

/// A goal on one of the shipped meshes; `regions` and `palette` are what differs.
fn read(mesh: &str, size: &str, regions: &str, palette: &str) -> Result<Goal, GoalError> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = format!(
        r#"schema = 1
name = "Thing"
[object]
mesh = "{}"
unit = "mm"
element_size = "{size}"
[[fixed]]
face = "bottom"
{regions}
[palette]
materials = ["ecoflex-00-50", "mold-star-16", "dragon-skin-30"]
{palette}
[[example]]
name = "press"
point_mm = [25, 20, 25]
direction = [0, 0, -1]
radius = "12 mm"
forces_n = [2]
displacements_mm = [1]
"#,
        root.join("designs").join(mesh).display()
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("goal.toml"), text).unwrap();
    Goal::read(
        folder.path(),
        &Database::open(&root.join("materials-db")).unwrap(),
    )
}

fn space(goal: &Goal) -> Result<Space, Mistake> {
    let laws = goal.palette.iter().map(|m| m.law.clone()).collect();
    goal.space(&Rig::new(&goal.setup, laws).unwrap())
}

const TWO_LAYERS: &str = "[[region]]\nname = \"block\"\nlayers = 2";

fn block(palette: &str) -> Goal {
    read("block/block.stl", "10 mm", TWO_LAYERS, palette).unwrap()
}

/// A block of 50 × 40 × 25 mm: a fifth of 50 cm³ each, and each layer touches its neighbours.
#[test]
fn layers_of_a_block_have_its_shares_and_touch_in_a_row() {
    let goal = read(
        "block/block.stl",
        "10 mm",
        "[[region]]\nname = \"block\"\nlayers = 5",
        "",
    )
    .unwrap();
    let space = space(&goal).unwrap();
    assert!(space.volumes_cm3.iter().all(|v| (v - 10.0).abs() < 1e-9));
    assert_eq!(
        space.touching,
        [vec![1], vec![0, 2], vec![1, 3], vec![2, 4], vec![3]]
    );
    let density = |m: usize| goal.palette[m].record.density_g_per_cm3;
    let mass = 10.0 * (2.0 * density(0) + 3.0 * density(2));
    assert!((space.mass_g(&[0, 0, 2, 2, 2]) - mass).abs() < 1e-9);
}

/// Two regions side by side: cells that meet in an edge alone do not touch.
#[test]
fn an_edge_is_no_touch() {
    let regions = "[[region]]\nname = \"left\"\nbox_mm = [[-1, -1, -1], [25, 41, 26]]\nlayers = 2\n[[region]]\nname = \"right\"\nlayers = 2";
    let goal = read("block/block.stl", "10 mm", regions, "").unwrap();
    let space = space(&goal).unwrap();
    assert!(space.volumes_cm3.iter().all(|v| (v - 12.5).abs() < 1e-9));
    assert_eq!(space.touching, [vec![1, 2], vec![0, 3], vec![0, 3], vec![1, 2]]);
}

/// Four equal shares of the height of a sole add up to it, and are as large as one another but for the grid's error.
#[test]
fn layers_that_follow_an_object_share_its_volume() {
    let regions = "[[region]]\nname = \"sole\"\nlayers = 4\nstyle = \"follow\"";
    let goal = read("flip-flop/sole.stl", "10 mm", regions, "").unwrap();
    let goal = Goal {
        setup: crate::fem::setup::Setup {
            examples: Vec::new(),
            ..goal.setup
        },
        ..goal
    };
    let space = space(&goal).unwrap();
    let whole = 1e-3 * goal.setup.object.solid.volume();
    assert!((space.volumes_cm3.iter().sum::<f64>() / whole - 1.0).abs() < 1e-12);
    for v in &space.volumes_cm3 {
        assert!((4.0 * v / whole - 1.0).abs() < 0.03, "{v} of {whole}");
    }
    assert_eq!(space.touching, [vec![1], vec![0, 2], vec![1, 3], vec![2]]);
}

#[test]
fn surface_rules_hold_where_a_cell_lies_on_that_side() {
    let rule = |face: &str, what: &str| format!("[[palette.surface]]\nface = {face:?}\n{what}");
    for (face, what, expected) in [
        ("top", "never = [\"ecoflex-00-50\"]", [vec![0, 1, 2], vec![1, 2]]),
        ("bottom", "only = [\"mold-star-16\"]", [vec![1], vec![0, 1, 2]]),
        (
            "sides",
            "never = [\"ecoflex-00-50\", \"dragon-skin-30\"]",
            [vec![1], vec![1]],
        ),
        ("outside", "only = [\"dragon-skin-30\"]", [vec![2], vec![2]]),
    ] {
        assert_eq!(
            space(&block(&rule(face, what))).unwrap().allowed,
            expected,
            "{face}"
        );
    }
    // A core within the block is nowhere on the surface.
    let core = "[[region]]\nname = \"core\"\nbox_mm = [[10, 10, 5], [40, 30, 20]]\nlayers = 1\n[[region]]\nname = \"rest\"\nlayers = 1";
    let goal = read(
        "block/block.stl",
        "5 mm",
        core,
        &rule("outside", "only = [\"mold-star-16\"]"),
    )
    .unwrap();
    let space = space(&goal).unwrap();
    assert_eq!(space.allowed, [vec![0, 1, 2], vec![1]]);
    assert!(
        (space.volumes_cm3[0] - 9.0).abs() < 1e-9,
        "{:?}",
        space.volumes_cm3
    );
}

/// 25 cm³ for each layer; prices per mass go by the record's density.
#[test]
fn prices_are_per_volume_or_mass() {
    let goal = block(
        "most_mass = \"0.06 kg\"\nmost_cost = \"2.5 EUR\"\ncost_weight = \"0.2 mm/EUR\"\n[palette.price]\necoflex-00-50 = \"20 EUR/kg\"\nmold-star-16 = \"0.05 EUR/cm3\"\ndragon-skin-30 = \"0.03 EUR/g\"",
    );
    let space = space(&goal).unwrap();
    let density = |m: usize| goal.palette[m].record.density_g_per_cm3;
    let expected = 25.0 * (0.02 * density(0) + 0.05);
    assert!((space.cost(&[0, 1]) - expected).abs() < 1e-9);
    assert!((space.cost(&[2, 2]) - 50.0 * 0.03 * density(2)).abs() < 1e-9);
    assert!((space.most_mass_g - 60.0).abs() < 1e-9 && space.most_cost == 2.5);
    assert_eq!(
        (goal.rules.cost_weight_mm, goal.rules.currency.as_deref()),
        (0.2, Some("EUR"))
    );
}

/// The rule in the way is named, at its line.
#[test]
fn rules_that_no_layout_keeps_are_said() {
    let price = "[palette.price]\necoflex-00-50 = \"1 EUR/cm3\"\nmold-star-16 = \"2 EUR/cm3\"\ndragon-skin-30 = \"3 EUR/cm3\"\n";
    let top = |id: &str| format!("[[palette.surface]]\nface = \"top\"\nonly = [{id:?}]\n");
    let bottom = |id: &str| format!("[[palette.surface]]\nface = \"bottom\"\nonly = [{id:?}]\n");
    for (palette, line, words) in [
        ("most_mass = \"20 g\"".to_string(), 14, "lightest layout weighs"),
        (
            format!("most_cost = \"49 EUR\"\n{price}"),
            14,
            "cheapest layout costs 50.00 EUR",
        ),
        (
            format!("{}{}", top("ecoflex-00-50"), top("mold-star-16")),
            18,
            "no material for cell \"block 2\"",
        ),
        (
            format!(
                "apart = [[\"mold-star-16\", \"ecoflex-00-50\"]]\n{}{}",
                top("ecoflex-00-50"),
                bottom("mold-star-16")
            ),
            14,
            "without apart",
        ),
        (
            format!(
                "most_materials = 1\n{}{}",
                top("ecoflex-00-50"),
                bottom("mold-star-16")
            ),
            14,
            "without most_materials",
        ),
    ] {
        let mistake = space(&block(&palette)).unwrap_err();
        assert!(mistake.message.contains(words), "{palette}: {mistake}");
        assert_eq!(mistake.line, line, "{palette}: {mistake}");
    }
    // Just enough is enough.
    assert!(space(&block(&format!("most_cost = \"50 EUR\"\n{price}"))).is_ok());
}

#[test]
fn mistakes_in_rules_name_the_line_and_the_mend() {
    let price = "[palette.price]\necoflex-00-50 = \"1 EUR/cm3\"\nmold-star-16 = \"2 EUR/cm3\"\n";
    for (palette, line, words) in [
        (
            "apart = [[\"mold-star-16\"]]".to_string(),
            14,
            "1 materials, expected a pair",
        ),
        (
            "apart = [[\"mold-star-16\", \"gold\"]]".into(),
            14,
            "\"gold\" is not in the palette",
        ),
        (
            "apart = [[\"mold-star-16\", \"mold-star-16\"]]".into(),
            14,
            "same material twice",
        ),
        (
            "[[palette.surface]]\nface = \"left\"\nnever = [\"mold-star-16\"]".into(),
            15,
            "\"sides\"",
        ),
        (
            "[[palette.surface]]\nface = \"top\"".into(),
            15,
            "either never or only",
        ),
        (
            "[[palette.surface]]\nface = \"top\"\nonly = []".into(),
            16,
            "at least one",
        ),
        (
            "[[palette.surface]]\nface = \"top\"\nonly = [\"gold\"]".into(),
            16,
            "not in the palette",
        ),
        ("most_mass = \"120\"".into(), 14, "120 g"),
        ("most_mass = \"0 g\"".into(), 14, "above zero"),
        ("most_mass = \"12 N\"".into(), 14, "mg, g, kg, t"),
        ("most_cost = \"3 EUR\"".into(), 14, "without prices"),
        ("cost_weight = \"0.1 mm/EUR\"".into(), 14, "without prices"),
        ("cost_weight = \"0.1 mm\"".into(), 14, "mm/EUR"),
        (price.into(), 14, "no price of \"dragon-skin-30\""),
        (
            format!("{price}dragon-skin-30 = \"3 USD/cm3\""),
            17,
            "one currency",
        ),
        (format!("{price}dragon-skin-30 = \"3 EUR\""), 17, "EUR/kg"),
        (format!("{price}dragon-skin-30 = \"-3 EUR/kg\""), 17, "below zero"),
        (format!("{price}gold = \"3 EUR/kg\""), 17, "not in the palette"),
        (
            format!("most_cost = \"3 USD\"\n{price}dragon-skin-30 = \"3 EUR/cm3\""),
            14,
            "\"USD\" beside \"EUR\"",
        ),
    ] {
        let Err(GoalError::Mistake(mistake)) = read("block/block.stl", "10 mm", TWO_LAYERS, &palette) else {
            panic!("{palette} is no mistake");
        };
        assert!(mistake.message.contains(words), "{palette}: {mistake}");
        // `[palette.price]` itself stands in line 14, and its place is its first key or itself.
        assert!(
            mistake.line == line || (words.starts_with("no price") && mistake.line == 15),
            "{palette}: {mistake}"
        );
    }
}
