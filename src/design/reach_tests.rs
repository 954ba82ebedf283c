use super::*;
use crate::design::goal::Goal;
use crate::material::database::Database;
use crate::material::hyperelastic::{Form, Hyperelastic};
use crate::material::law::Law;
use std::path::Path;

const GOAL: &str = r#"schema = 1
name = "Block"
[object]
mesh = "block.stl"
unit = "mm"
element_size = "10 mm"
[[fixed]]
face = "bottom"
[[region]]
name = "block"
layers = 2
[palette]
materials = ["ecoflex-00-50"]
[[example]]
name = "press"
point_mm = [25, 20, 25]
direction = [0, 0, -1]
radius = "12 mm"
forces_n = [2, 4, 6]
displacements_mm = [1, 2, 3]
"#;

fn rubber(stiffness: f64) -> Law {
    let (shear_mpa, bulk_mpa) = (0.05 * stiffness, 0.4 * stiffness);
    Law::Hyperelastic(Hyperelastic::new(Form::NeoHookeanIsochoric { shear_mpa, bulk_mpa }).unwrap())
}

/// A rig whose palette is the same rubber, 1, 2 and 3 times as stiff, and then `hidden` times; and examples that ask for
/// what the last one gives.
fn asked(hidden: f64, tolerance: f64) -> (Rig, Vec<Example>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(
        root.join("designs/block/block.stl"),
        folder.path().join("block.stl"),
    )
    .unwrap();
    std::fs::write(folder.path().join("goal.toml"), GOAL).unwrap();
    let database = Database::open(&root.join("materials-db")).unwrap();
    let goal = Goal::read(folder.path(), &database).unwrap();
    let laws = [1.0, 2.0, 3.0, hidden].map(rubber).to_vec();
    let rig = Rig::new(&goal.setup, laws).unwrap();
    let response = rig
        .bench()
        .unwrap()
        .respond(&[3, 3], &Options::default(), &|| false);
    assert!(response.complete);
    let mut examples = goal.setup.examples;
    for (level, x) in response.displacements.iter().enumerate() {
        examples[0].points[0].displacements_mm[level] = vec![Some(*x)];
        examples[0].tolerances_mm[0][level] = tolerance;
    }
    (rig, examples)
}

fn judged(rig: &Rig, examples: &[Example]) -> Reach {
    judge(examples, rig, 2, &[0, 1, 2], &Options::default(), &|| false).unwrap()
}

/// The target is computed with the missing material itself: the factor must come out again.
#[test]
fn the_missing_material_is_named_with_its_stiffness() {
    for (hidden, missing, nearest, expected) in
        [(0.62, Missing::Softer, 0, 0.62), (4.5, Missing::Stiffer, 2, 1.5)]
    {
        let (rig, examples) = asked(hidden, 0.0);
        let reach = judged(&rig, &examples);
        assert_eq!(reach.shortfalls.len(), 1, "{reach:?}");
        let shortfall = reach.shortfalls[0];
        assert_eq!((shortfall.missing, shortfall.material), (missing, nearest));
        let Scale::Times(s) = shortfall.scale else {
            panic!("{shortfall:?}");
        };
        // The force is found to 1e-4 of the displacement, which is about 1e-4 of the force.
        assert!((s / expected - 1.0).abs() < 5e-4, "{s} for {expected}");
        for level in &reach.examples[0] {
            let (stiff, soft) = (level.stiffest_mm.unwrap(), level.softest_mm.unwrap());
            assert!(stiff < soft);
            let end = if missing == Missing::Softer { soft } else { stiff };
            assert_eq!(level.nearest_mm(), Some(end));
        }
    }
}

#[test]
fn what_lies_between_the_materials_or_within_tolerance_is_in_reach() {
    for (hidden, tolerance) in [(1.0, 0.0), (1.7, 0.0), (3.0, 0.0), (0.9, 0.5)] {
        let (rig, examples) = asked(hidden, tolerance);
        let reach = judged(&rig, &examples);
        assert!(reach.shortfalls.is_empty(), "{hidden}: {reach:?}");
        assert_eq!(reach.examples[0].len(), 3);
    }
    // Without its tolerance the last one was out.
    let (rig, examples) = asked(0.9, 0.0);
    assert_eq!(judged(&rig, &examples).shortfalls.len(), 1);
}

/// A target that is steeper than any material's crosses both ends: soft at first, stiff at last.
#[test]
fn an_example_may_be_out_of_reach_on_both_sides() {
    let (rig, mut examples) = asked(1.7, 0.0);
    examples[0].points[0].displacements_mm = [5.0, 5.05, 0.0].map(|x| vec![Some(x)]).to_vec();
    let reach = judged(&rig, &examples);
    let sides: Vec<(Missing, f64)> = reach.shortfalls.iter().map(|s| (s.missing, s.force_n)).collect();
    assert_eq!(sides, [(Missing::Softer, 2.0), (Missing::Stiffer, 6.0)]);
    assert_eq!(reach.shortfalls[1].scale, Scale::Rigid);
}

/// 20 mm of a block of 25 mm cannot be had from any force that leaves the rubber in equilibrium.
#[test]
fn where_the_softest_material_gives_in_first_the_factor_is_a_limit() {
    let (rig, mut examples) = asked(1.7, 0.0);
    examples[0].points[0].displacements_mm[2] = vec![Some(24.5)];
    let shortfall = judged(&rig, &examples).shortfalls[0];
    let Scale::LessThan(limit) = shortfall.scale else {
        panic!("{shortfall:?}");
    };
    assert!((1.0 / MOST_FORCE / 1.5..1.0).contains(&limit), "{limit}");
}

/// A material without equilibrium bounds nothing from above.
#[test]
fn a_material_that_falls_gives_without_end() {
    let curves: [(u8, &[f64]); 2] = [(0, &[1.0]), (1, &[0.5, 0.9])];
    assert_eq!(extreme(&curves, 0, Missing::Softer), Some((0, 1.0)));
    assert_eq!(extreme(&curves, 1, Missing::Softer), None);
    assert_eq!(extreme(&curves, 1, Missing::Stiffer), Some((1, 0.9)));
    assert_eq!(extreme(&curves, 2, Missing::Stiffer), None);
}
