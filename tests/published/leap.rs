//! Bickel 2010, Figure 8.9: a foam, approximated by a stack of other materials. Here the foam is FF LEAP, whose measured
//! compression (mean of loading and unloading) a block of silicones and printed tubes has to follow: five displacements of a
//! block of 50 × 40 × 25 mm between plates without friction, as the foam's coupons were pressed.

use assert_cmd::Command;

const CURVE: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../shared/data/shoe-foam/averaged/foam_leap_UC.csv"
);
/// Stretches that are asked for.
const STRETCHES: [f64; 5] = [0.97, 0.94, 0.90, 0.85, 0.79];
const AREA_MM2: f64 = 50.0 * 40.0;
const HEIGHT_MM: f64 = 25.0;

/// Nominal pressure at a stretch, linear between the points of the curve \[MPa\].
fn pressure(curve: &[[f64; 2]], stretch: f64) -> f64 {
    let k = curve
        .partition_point(|p| p[0] < stretch)
        .clamp(1, curve.len() - 1);
    let ([x0, y0], [x1, y1]) = (curve[k - 1], curve[k]);
    -(y0 + (y1 - y0) * (stretch - x0) / (x1 - x0))
}

fn goal(curve: &[[f64; 2]]) -> String {
    let forces: Vec<f64> = STRETCHES.iter().map(|s| AREA_MM2 * pressure(curve, *s)).collect();
    let displacements: Vec<f64> = STRETCHES.iter().map(|s| HEIGHT_MM * (1.0 - s)).collect();
    format!(
        r#"schema = 1
name = "LEAP"
[object]
mesh = "block.stl"
unit = "mm"
element_size = "12.5 mm"
# Plates without friction: the block is free to widen, away from the planes x = 0 and y = 0.
[[fixed]]
face = "bottom"
components = "z"
[[fixed]]
box_mm = [[-1, -1, -1], [0.1, 41, 26]]
components = "x"
[[fixed]]
box_mm = [[-1, -1, -1], [51, 0.1, 26]]
components = "y"
[[region]]
name = "block"
layers = 4
[palette]
synthetic = true
materials = [
    "ecoflex-00-10", "ecoflex-00-30-thinner-12-5", "ecoflex-00-30", "ecoflex-00-50-thinner-12-5", "ecoflex-00-50",
    "mold-star-16", "dragon-skin-20", "dragon-skin-30",
    "tubes-fine-open", "tubes-fine-wide", "tubes-coarse-open", "tubes-coarse-wide",
]
[[example]]
name = "plate"
point_mm = [25, 20, 25]
direction = [0, 0, -1]
radius = "32.1 mm"
forces_n = {forces:?}
displacements_mm = {displacements:?}
origin = "measured: Moreno-Mateos et al. 2026, foam FF LEAP in unconfined compression"
"#
    )
}

#[test]
fn slow_a_measured_foam_is_approximated_by_silicones_and_tubes() {
    let Ok(text) = std::fs::read_to_string(CURVE) else {
        println!("skipped: {CURVE} is missing");
        return;
    };
    let curve: Vec<[f64; 2]> = text
        .lines()
        .skip(1)
        .filter_map(|line| {
            let (x, y) = line.split_once(',')?;
            Some([x.trim().parse().ok()?, y.trim().parse().ok()?])
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("goal.toml"), goal(&curve)).unwrap();
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/block/block.stl");
    std::fs::copy(mesh, folder.path().join("block.stl")).unwrap();
    let output = Command::cargo_bin("pliant")
        .unwrap()
        .current_dir(folder.path())
        .args(["replicate", ".", "--json", "--no-export"])
        .args(["--db", concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db")])
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let number = |key: &str| found[key].as_f64().unwrap();
    let (rms, single) = (number("rms_mm"), number("best_single_material_rms_mm"));
    println!("{:#}", found);
    println!(
        "LEAP foam: RMS {rms:.4} mm of {:.2} mm, best single material {single:.4} mm, bound {:.4} mm",
        number("largest_target_mm"),
        number("bound_mm")
    );
    // A foam yields and then holds; silicones and rubber stiffen steadily: a stack comes nearer than each of them, not near.
    assert!(rms < 0.7 * single && rms < 0.05 * number("largest_target_mm"));
}
