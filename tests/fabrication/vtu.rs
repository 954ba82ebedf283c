//! VTU files, read by VTK itself.

use crate::python;
use pliant::geometry::files::vtu::{Array, VtuCells, VtuGrid, write_vtu};
use pliant::math::mandel;
use pliant::math::{Mat3, Vec3};
use std::fs::File;
use std::io::BufWriter;

#[test]
fn vtk_reads_hexahedra_with_every_kind_of_array() {
    // 60 × 60 × 60 points: the coordinates alone take five compressed blocks.
    let n = 60_u32;
    let id = |i: u32, j: u32, k: u32| (k * n + j) * n + i;
    let points: Vec<Vec3> = (0..n * n * n)
        .map(|p| {
            Vec3::new(
                f64::from(p % n),
                f64::from(p / n % n) * 0.5,
                f64::from(p / n / n) * 0.25,
            )
        })
        .collect();
    let mut hexahedra = Vec::new();
    for k in 0..n - 1 {
        for j in 0..n - 1 {
            for i in 0..n - 1 {
                let ring = |k| [id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k)];
                let ([a, b, c, d], [e, f, g, h]) = (ring(k), ring(k + 1));
                hexahedra.push([a, b, c, d, e, f, g, h]);
            }
        }
    }
    let m = hexahedra.len();
    let strain = mandel::from_tensor(&Mat3::new(1.0, 4.0, 6.0, 4.0, 2.0, 5.0, 6.0, 5.0, 3.0));
    let gradient = Mat3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0);
    let (displacements, loads) = (
        points.iter().map(|p| p * 0.1).collect::<Vec<_>>(),
        vec![0.5; points.len()],
    );
    let (strains, gradients, modulus) = (vec![strain; m], vec![gradient; m], vec![1.25; m]);
    let materials: Vec<i32> = (0..m as i32).map(|i| i % 3 - 1).collect();

    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("block.vtu");
    let grid = VtuGrid {
        points: &points,
        cells: VtuCells::Hexahedra(&hexahedra),
    };
    write_vtu(
        BufWriter::new(File::create(&path).expect("a file")),
        &grid,
        &[
            ("load <N>", Array::Scalars(&loads)),
            ("displacement", Array::Vectors(&displacements)),
        ],
        &[
            ("strain", Array::SymmetricTensors(&strains)),
            ("deformation_gradient", Array::Tensors(&gradients)),
            ("material_id", Array::Integers(&materials)),
            ("young_modulus", Array::Scalars(&modulus)),
        ],
    )
    .expect("written");
    let Some(text) = python::run("read_vtu.py", &[&path]) else {
        return;
    };
    let seen: serde_json::Value = serde_json::from_str(&text).expect("JSON");

    assert_eq!(seen["errors"], serde_json::json!([]));
    assert_eq!(
        (seen["points"].as_u64(), seen["cells"].as_u64()),
        (Some(216_000), Some(59 * 59 * 59))
    );
    assert_eq!(
        seen["bounds"],
        serde_json::json!([0.0, 59.0, 0.0, 29.5, 0.0, 14.75])
    );
    assert_eq!(seen["types"], serde_json::json!([12, 12]));
    assert_eq!(seen["last_cell"][6], serde_json::json!(215_999));
    assert_eq!(seen["vectors"], "displacement");
    assert_eq!(seen["point_data"]["load <N>"]["last"], serde_json::json!([0.5]));
    let last = &seen["point_data"]["displacement"]["last"];
    assert!((last[2].as_f64().expect("a number") - 1.475).abs() < 1e-12);
    // XX YY ZZ XY YZ XZ, the order in which VTK names the six.
    let strain: Vec<f64> = (0..6)
        .map(|k| seen["cell_data"]["strain"]["last"][k].as_f64().expect("six"))
        .collect();
    assert!(
        strain
            .iter()
            .zip([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
            .all(|(a, b)| (a - b).abs() < 1e-12),
        "{strain:?}"
    );
    assert_eq!(
        seen["cell_data"]["deformation_gradient"]["first"],
        serde_json::json!([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0])
    );
    assert_eq!(seen["cell_data"]["material_id"]["type"], "int");
    assert_eq!(
        seen["cell_data"]["material_id"]["first"],
        serde_json::json!([-1.0])
    );
    assert_eq!(
        seen["cell_data"]["young_modulus"]["last"],
        serde_json::json!([1.25])
    );
}

#[test]
fn vtk_reads_tetrahedra() {
    let points = [
        Vec3::zeros(),
        Vec3::x(),
        Vec3::y(),
        Vec3::z(),
        Vec3::new(1.0, 1.0, 1.0),
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("tetrahedra.vtu");
    let grid = VtuGrid {
        points: &points,
        cells: VtuCells::Tetrahedra(&[[0, 1, 2, 3], [1, 2, 3, 4]]),
    };
    write_vtu(File::create(&path).expect("a file"), &grid, &[], &[]).expect("written");
    let Some(text) = python::run("read_vtu.py", &[&path]) else {
        return;
    };
    let seen: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(seen["types"], serde_json::json!([10, 10]));
    assert_eq!(seen["last_cell"], serde_json::json!([1, 2, 3, 4]));
}
