//! Layers found again, bounds, and derivatives against full solves.

use super::*;
use crate::design::goal::Goal;
use crate::geometry::files::write_stl;
use crate::geometry::shapes::block::block;
use crate::material::database::Database;
use crate::math::Vec3;
use std::path::Path;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// A block of 40 × 30 × 24 mm in four layers, pressed on top and, off the middle, on a side; points on top and on the sides.
fn goal(regions: &str) -> Goal {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    write_stl(&block(Vec3::new(40.0, 30.0, 24.0), 10.0).unwrap(), &mut bytes).unwrap();
    std::fs::write(folder.path().join("block.stl"), bytes).unwrap();
    let points: Vec<[f64; 3]> = [5.0, 15.0, 25.0, 35.0]
        .into_iter()
        .flat_map(|x| [[x, 10.0, 24.0], [x, 25.0, 24.0], [x, 0.0, 7.0], [x, 30.0, 16.5]])
        .collect();
    let table = |forces: [f64; 3]| -> String {
        let mut rows = String::from("force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n");
        for force in forces {
            for [x, y, z] in &points {
                rows += &format!("{force},{x},{y},{z},0,0,0\n");
            }
        }
        rows
    };
    std::fs::write(folder.path().join("top.csv"), table([2.0, 4.0, 8.0])).unwrap();
    std::fs::write(folder.path().join("side.csv"), table([0.5, 1.0, 2.0])).unwrap();
    let text = format!(
        r#"
schema = 1
name = "Block"
[object]
mesh = "block.stl"
unit = "mm"
element_size = "10 mm"
[[fixed]]
face = "bottom"
{regions}
[palette]
materials = ["ecoflex-00-50", "mold-star-16", "dragon-skin-20", "leap-foam"]
[[example]]
name = "top"
point_mm = [15, 15, 24]
direction = [0, 0, -1]
radius = "8 mm"
file = "top.csv"
[[example]]
name = "side"
point_mm = [40, 14, 15]
direction = [-1, 0, 0]
radius = "5 mm"
file = "side.csv"
"#
    );
    std::fs::write(folder.path().join("goal.toml"), text).unwrap();
    let database = Database::open(&Path::new(ROOT).join("materials-db")).unwrap();
    Goal::read(folder.path(), &database).unwrap()
}

const FOUR: &str = "[[region]]\nname = \"block\"\nlayers = 4\n";

fn rig_of(setup: &Setup, goal: &Goal) -> Rig {
    Rig::new(setup, goal.palette.iter().map(|m| m.law.clone()).collect()).unwrap()
}

/// What `layout` answers with its borders at `borders`, as a target.
fn target_of(goal: &Goal, layout: &[u8], borders: &[Vec<f64>]) -> Target {
    let setup = goal.setup.with_cells(goal.setup.cells.moved(borders).unwrap());
    let rig = rig_of(&setup, goal);
    let exact = equilibrium::Options::default();
    let response = rig.bench().unwrap().respond(layout, &exact, &|| false);
    assert!(response.complete);
    let mut target = Target::new(&goal.setup.examples);
    target.components = response.displacements.into_iter().map(Some).collect();
    target
}

/// Derivatives by planes against central differences of full solves on moved rigs, to 1e-5 of the largest: solves to 1e-12
/// and steps of 1e-3 mm leave about 1e-7. Loads and sensors on the sides change with the borders too.
fn check_derivatives(goal: &Goal, layout: &[u8], borders: &[Vec<f64>]) {
    let base = rig_of(&goal.setup, goal);
    let setup = goal.setup.with_cells(goal.setup.cells.moved(borders).unwrap());
    let exact = equilibrium::Options {
        tolerance: 1e-12,
        ..equilibrium::Options::default()
    };
    let planes = Planes::of(&setup.object.solid, &setup.cells).unwrap();
    let moving: Vec<usize> = (0..planes.now.len())
        .filter(|&k| planes.may_move(k, &setup.cells))
        .collect();
    assert!(moving.len() >= 2);
    let rig = base.moved(&setup).unwrap();
    let mut bench = rig.bench().unwrap();
    let responded = bench.respond_in_full(layout, &exact, &|| false);
    assert!(responded.response.complete);
    let nudged = Nudged::new(&rig, &setup, &moving).unwrap();
    let derivatives = bench.derivatives_by_planes(layout, &nudged, &responded).unwrap();
    for (column, &k) in moving.iter().enumerate() {
        let step = 4e-5 * (planes.now[planes.now.len() - 1] - planes.now[0]);
        let at = |shift: f64| {
            let mut places = planes.now.clone();
            places[k] += shift;
            let cells = setup
                .cells
                .moved(&planes.borders_at(&setup.cells, &places))
                .unwrap();
            let rig = base.moved(&setup.with_cells(cells)).unwrap();
            rig.bench()
                .unwrap()
                .respond(layout, &exact, &|| false)
                .displacements
        };
        let (above, below) = (at(step), at(-step));
        let largest = derivatives.column(column).amax();
        assert!(largest > 1e-3, "plane {k} does nothing");
        for (i, (a, b)) in above.iter().zip(&below).enumerate() {
            let expected = (a - b) / (2.0 * step);
            let found = derivatives[(i, column)];
            assert!(
                (found - expected).abs() < 1e-5 * largest,
                "plane {k}, component {i}: {found} for {expected}, the largest is {largest}"
            );
        }
    }
}

#[test]
fn derivatives_agree_with_solves_of_moved_borders() {
    let borders = [vec![0.0, 4.0, 11.0, 18.5, 24.0]];
    check_derivatives(&goal(FOUR), &[0, 1, 2, 1], &borders);
    check_derivatives(&goal(FOUR), &[0, 1, 3, 2], &borders);
}

/// A sole whose layers follow its height: fills change with the borders, and borders of two regions share a plane.
#[test]
fn derivatives_agree_where_layers_follow_the_height() {
    let folder = tempfile::tempdir().unwrap();
    let sole = Path::new(ROOT).join("designs/flip-flop");
    std::fs::copy(sole.join("sole.stl"), folder.path().join("sole.stl")).unwrap();
    let text = r#"
schema = 1
name = "Sole"
[object]
mesh = "sole.stl"
unit = "mm"
element_size = "16 mm"
[[fixed]]
face = "bottom"
[[region]]
name = "heel"
box_mm = [[-100, -200, -50], [100, 60, 80]]
layers = 4
style = "follow"
[[region]]
name = "rest"
layers = 2
style = "follow"
[palette]
materials = ["ecoflex-00-50", "mold-star-16", "dragon-skin-20"]
[[example]]
name = "heel"
point_mm = [0, 40, 24]
direction = [0, 0, -1]
radius = "14 mm"
forces_n = [10, 20]
displacements_mm = [0.5, 0.9]
origin = "made up"
[[example]]
name = "ball"
point_mm = [0, 160, 14]
direction = [0, 0.2, -1]
radius = "14 mm"
forces_n = [10, 20]
displacements_mm = [0.5, 0.9]
origin = "made up"
"#;
    std::fs::write(folder.path().join("goal.toml"), text).unwrap();
    let database = Database::open(&Path::new(ROOT).join("materials-db")).unwrap();
    let goal = Goal::read(folder.path(), &database).unwrap();
    let borders = [vec![0.0, 0.2, 0.45, 0.8, 1.0], vec![0.0, 0.45, 1.0]];
    check_derivatives(&goal, &[0, 1, 2, 0, 1, 0], &borders);
}

#[test]
fn hidden_layers_of_unequal_thickness_are_found_again() {
    let goal = goal(FOUR);
    let hidden = [vec![0.0, 4.0, 11.0, 18.5, 24.0]];
    let layout: Layout = vec![0, 2, 3, 1];
    let target = target_of(&goal, &layout, &hidden);
    let rig = rig_of(&goal.setup, &goal);
    let go = AtomicBool::new(false);
    let options = Options::default();
    let other: Layout = vec![0, 2, 2, 1];
    let both = [other, layout.clone()];
    let found = refine(&rig, &goal.setup, &target, &both, &options, &go).unwrap();
    assert_eq!(found[0].layout, layout);
    println!(
        "{:?} {:?} {}",
        found[0].before, found[0].after, found[0].simulations
    );
    assert!(
        found[0].before.rms_mm > 1e-2 && found[0].after.rms_mm < 1e-4,
        "{:?}",
        found[0].after
    );
    for (found, hidden) in found[0].cells.regions()[0].borders.iter().zip(&hidden[0]) {
        assert!((found - hidden).abs() < 0.02, "{found} for {hidden}");
    }
    assert!(found[0].thinnest.is_empty());
    // Another layout gains too, and cannot be as good.
    assert!(found[1].after.rms_mm <= found[1].before.rms_mm && found[1].after.rms_mm > 1e-3);
    // Within a tolerance there is nothing to gain.
    let mut tolerant = target.clone();
    tolerant.tolerances_mm.fill(1e3);
    let kept = refine(
        &rig,
        &goal.setup,
        &tolerant,
        std::slice::from_ref(&layout),
        &options,
        &go,
    )
    .unwrap();
    assert_eq!(kept[0].after.rms_mm, 0.0);
    assert_eq!(
        kept[0].cells.regions()[0].borders,
        goal.setup.cells.regions()[0].borders
    );
    // A stop keeps the borders as they were.
    go.store(true, Ordering::Relaxed);
    let kept = refine(&rig, &goal.setup, &target, &[layout], &options, &go).unwrap();
    assert_eq!(kept[0].after, kept[0].before);
    assert_eq!(
        kept[0].cells.regions()[0].borders,
        goal.setup.cells.regions()[0].borders
    );
}

/// The target was made with a layer thinner than may be: it stops at its bound and is named. The others still move.
#[test]
fn layers_stop_at_their_least_thickness() {
    let goal = goal(FOUR);
    let layout: Layout = vec![0, 2, 3, 1];
    let target = target_of(&goal, &layout, &[vec![0.0, 2.0, 10.0, 17.0, 24.0]]);
    let rig = rig_of(&goal.setup, &goal);
    let go = AtomicBool::new(false);
    let options = Options {
        least_mm: 4.0,
        ..Options::default()
    };
    let found = refine(&rig, &goal.setup, &target, &[layout], &options, &go).unwrap();
    let borders = &found[0].cells.regions()[0].borders;
    println!("{borders:?} {:?} {:?}", found[0].before, found[0].after);
    assert!(found[0].after.rms_mm < found[0].before.rms_mm);
    assert!(borders.windows(2).all(|pair| pair[1] - pair[0] >= 4.0 - 1e-9));
    assert_eq!(found[0].thinnest, [0]);
    assert!(matches!(
        refine(
            &rig,
            &goal.setup,
            &target,
            &[],
            &Options {
                least_mm: 0.0,
                ..options
            },
            &go
        ),
        Err(ThicknessError::Least(_))
    ));
    let thick = Options {
        least_mm: 6.0,
        ..options
    };
    assert!(matches!(
        refine(&rig, &goal.setup, &target, &[], &thick, &go),
        Err(ThicknessError::NoBorders { .. })
    ));
}

/// Against differences of the excess itself: pairs beyond their tolerance, within it, without one, and one not measured whole.
#[test]
fn derivatives_of_the_excess_are_those_of_its_differences() {
    let target = Target {
        components: vec![
            Some(0.5),
            Some(-0.2),
            Some(0.1),
            Some(1.0),
            Some(0.0),
            Some(0.3),
            Some(0.3),
            None,
        ],
        pairs: vec![0, 3, 4, 6, 8],
        tolerances_mm: vec![0.2, 0.5, 0.0, 0.1],
    };
    let x = [0.9, 0.1, -0.4, 1.2, 0.1, 0.2, 0.9, 7.0];
    let mut found = DMatrix::identity(8, 8);
    to_excess(&target, &x, &mut found);
    for column in 0..8 {
        let at = |shift: f64| {
            let mut moved = x;
            moved[column] += shift;
            target.excess(&moved)
        };
        let (above, below) = (at(1e-5), at(-1e-5));
        for row in 0..8 {
            let expected = (above[row] - below[row]) / 2e-5;
            assert!((found[(row, column)] - expected).abs() < 1e-8, "{row} {column}");
        }
    }
    assert!(found.amax() > 0.5);
}
