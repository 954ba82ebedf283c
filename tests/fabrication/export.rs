//! Exports, opened by the 3MF reference library, by trimesh, and by the `threemf` crate.

use crate::python;
use crate::shapes::{around, block, sole};
use pliant::fabrication::export::{ExportError, ExportMeta, ExportPart, write_export};
use pliant::fabrication::manifest::{ExportFault, Manifest, read_manifest, verify};
use pliant::fabrication::tiling::{Tiling, TilingOptions, tile};
use pliant::geometry::cutting::LevelSet;
use pliant::math::Vec3;
use std::fs;
use std::path::{Path, PathBuf};

const NAMES: [(&str, &str, [u8; 3]); 3] = [
    ("ecoflex-30", "EcoFlex 30 & thinner", [240, 200, 16]),
    ("foam/leap", "LEAP foam \"soft\"", [0, 128, 255]),
    ("synthetic", "Röhrenblock <z>", [17, 34, 51]),
];

fn export_parts(tiling: &Tiling) -> Vec<ExportPart> {
    let part = |p: &pliant::fabrication::tiling::Part| {
        let (id, name, colour) = NAMES[p.label];
        ExportPart {
            material_id: id.into(),
            material_name: name.into(),
            colour,
            mesh: p.mesh.clone(),
            volume_mm3: p.volume_mm3,
        }
    };
    tiling.parts.iter().map(part).collect()
}

/// A block in two layers, 30 × 20 × 10 mm.
fn small(border: f64) -> Vec<ExportPart> {
    let half = Vec3::new(15.0, 10.0, 5.0);
    let plane = move |x: &Vec3| x.z - border;
    let label = move |x: &Vec3| Some(usize::from(x.z > border));
    let options = TilingOptions {
        spacing_mm: Some(2.0),
        ..TilingOptions::default()
    };
    export_parts(&tile(&block(half), around(half), &[&plane], &label, &options).expect("tiles"))
}

fn files(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(dir)
        .expect("a folder")
        .map(|e| e.expect("an entry"))
        .map(|e| {
            (
                e.file_name().to_string_lossy().into_owned(),
                fs::read(e.path()).unwrap_or_default(),
            )
        })
        .collect();
    files.sort();
    files
}

#[test]
fn reference_library_and_trimesh_open_a_sole() {
    let (f, bounds) = sole();
    let planes: Vec<_> = (1..4)
        .map(|k| move |x: &Vec3| x.z - 5.0 * f64::from(k) - 0.004 * x.x)
        .collect();
    let levels: Vec<LevelSet> = planes.iter().map(|p| p as LevelSet).collect();
    let label = |x: &Vec3| Some(planes.iter().filter(|p| p(x) > 0.0).count() % 3);
    let options = TilingOptions {
        spacing_mm: Some(3.0),
        ..TilingOptions::default()
    };
    let parts = export_parts(&tile(&f, bounds, &levels, &label, &options).expect("tiles"));
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path().join("sole");
    let meta = ExportMeta {
        description: Some("a <sole>".into()),
        ..ExportMeta::default()
    };
    let manifest = write_export(&dir, "sole", &parts, &meta).expect("written");
    assert_eq!(verify(&dir).expect("read"), []);

    let mut paths: Vec<PathBuf> = vec![dir.join(&manifest.threemf.file)];
    paths.extend(manifest.parts.iter().map(|p| dir.join(&p.stl.file)));
    let arguments: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    let Some(text) = python::run("read_3mf.py", &arguments) else {
        return;
    };
    let seen: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(seen["warnings"], serde_json::json!([]));
    // lib3mf's ModelUnit::MilliMeter.
    assert!(
        seen["unit"] == "1" || seen["unit"] == "ModelUnit.MilliMeter",
        "{}",
        seen["unit"]
    );
    assert_eq!(seen["items"], 3);
    assert_eq!(seen["metadata"]["Title"], "sole");
    assert_eq!(seen["metadata"]["Description"], "a <sole>");
    let near = |a: &serde_json::Value, b: f64| (a.as_f64().expect("a number") / b - 1.0).abs() < 1e-4;
    for (i, part) in manifest.parts.iter().enumerate() {
        let object = &seen["objects"][i];
        let (_, name, [r, g, b]) = NAMES[i];
        assert_eq!(object["name"], name);
        assert_eq!(object["material"], name);
        assert_eq!(object["colour"], serde_json::json!([r, g, b, 255]));
        for yes in ["valid", "manifold", "has_material"] {
            assert_eq!(object[yes], true, "{yes} of {name}");
        }
        assert_eq!(object["triangles"], part.triangles);
        let stl = &seen["stl"][i];
        assert!(
            stl["watertight"] == true && near(&stl["volume"], part.volume_mm3),
            "{stl}"
        );
    }
    let meshes = seen["trimesh"].as_object().expect("meshes");
    assert_eq!(meshes.len(), 3);
    assert!(
        meshes
            .values()
            .all(|m| m["watertight"] == true && m["winding"] == true),
        "{meshes:?}"
    );
    let volume: f64 = meshes.values().filter_map(|m| m["volume"].as_f64()).sum();
    assert!(near(&volume.into(), manifest.volume_mm3));
}

#[test]
fn threemf_crate_reads_the_meshes_back() {
    let mut parts = small(0.0);
    parts
        .iter_mut()
        .flat_map(|p| &mut p.mesh.vertices)
        .for_each(|v| v.x += 0.1);
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path().join("block");
    let manifest = write_export(&dir, "block", &parts, &ExportMeta::default()).expect("written");
    let file = fs::File::open(dir.join(&manifest.threemf.file)).expect("a file");
    let models = threemf::read(file).expect("3MF");
    let objects = &models[0].resources.object;
    assert_eq!(objects.len(), 2);
    for (object, part) in objects.iter().zip(&parts) {
        let mesh = object.mesh.as_ref().expect("a mesh");
        assert_eq!(
            (object.pid, mesh.triangles.triangle.len()),
            (Some(1), part.mesh.triangles.len())
        );
        for (a, b) in mesh.vertices.vertex.iter().zip(&part.mesh.vertices) {
            // Half of single precision's step between 8 and 16 mm.
            assert!((Vec3::new(a.x, a.y, a.z) - b).amax() <= 4.8e-7);
        }
    }
    // Two layers of 30 × 20 × 5 mm.
    assert!(
        manifest
            .parts
            .iter()
            .all(|p| (p.volume_mm3 - 3000.0).abs() < 1e-2)
    );
    // As written: 15.1 in single precision is 15.1000003815.
    assert_eq!(manifest.bounding_box_mm.min, [f64::from(-14.9_f32), -10.0, -5.0]);
    assert_eq!(manifest.bounding_box_mm.max, [f64::from(15.1_f32), 10.0, 5.0]);
}

#[test]
fn equal_exports_are_equal_byte_by_byte_and_replace_earlier_ones() {
    let folder = tempfile::tempdir().expect("a folder");
    let (dir, twin) = (folder.path().join("block"), folder.path().join("twin"));
    let export = |dir: &Path, parts: &[ExportPart]| -> Manifest {
        write_export(dir, "block", parts, &ExportMeta::default()).expect("written")
    };
    export(&dir, &small(0.0));
    fs::write(dir.join("README.md"), "mine").expect("a file");
    let before = files(&dir);
    assert_eq!(
        before.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(),
        [
            "README.md",
            "block-ecoflex-30.stl",
            "block-foam-leap.stl",
            "block.3mf",
            "manifest.json"
        ]
    );

    let mut one = small(1.0);
    one.remove(1);
    export(&dir, &one);
    assert!(!dir.join("block-foam-leap.stl").exists());
    assert_eq!(verify(&dir).expect("read"), []);

    export(&dir, &small(0.0));
    assert_eq!(files(&dir), before);
    export(&twin, &small(0.0));
    assert_eq!(files(&twin), before[1..]);
    // Nothing else is left beside the two folders.
    assert_eq!(files(folder.path()).len(), 2);
}

#[test]
fn changed_files_are_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest =
        write_export(folder.path(), "block", &small(0.0), &ExportMeta::default()).expect("written");
    assert_eq!(read_manifest(folder.path()).expect("read"), manifest);
    let stl = folder.path().join(&manifest.parts[1].stl.file);
    let mut bytes = fs::read(&stl).expect("bytes");
    bytes[200] ^= 1;
    fs::write(&stl, bytes).expect("written");
    fs::remove_file(folder.path().join(&manifest.threemf.file)).expect("removed");
    let faults = verify(folder.path()).expect("read");
    assert!(
        matches!(&faults[0], ExportFault::Changed { file, .. } if file == "block-foam-leap.stl"),
        "{faults:?}"
    );
    assert!(
        matches!(&faults[1], ExportFault::Unreadable { file, .. } if file == "block.3mf"),
        "{faults:?}"
    );
}

#[test]
fn what_cannot_be_written_leaves_the_folder_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path().join("block");
    let write = |name: &str, parts: &[ExportPart]| write_export(&dir, name, parts, &ExportMeta::default());
    write("block", &small(0.0)).expect("written");
    let before = files(&dir);

    assert!(matches!(
        write("../block", &small(1.0)),
        Err(ExportError::Name(_))
    ));
    assert!(matches!(write("block", &[]), Err(ExportError::NoParts)));
    let mut twice = small(1.0);
    twice[1].material_id = twice[0].material_id.clone();
    assert!(matches!(write("block", &twice), Err(ExportError::Twice(_))));
    let mut open = small(1.0);
    open[1].mesh.triangles.pop();
    let error = write("block", &open).expect_err("a hole");
    assert!(error.to_string().contains("foam/leap"), "{error}");
    let mut lying = small(1.0);
    lying[0].volume_mm3 *= 1.01;
    assert!(matches!(write("block", &lying), Err(ExportError::Mesh { .. })));
    let mut stray = small(1.0);
    stray[0].mesh.triangles[0][0] = 4_000_000;
    assert!(matches!(write("block", &stray), Err(ExportError::Mesh { .. })));
    fs::create_dir(dir.join("other.3mf")).expect("a folder");
    assert!(matches!(
        write("other", &small(1.0)),
        Err(ExportError::InTheWay(_))
    ));
    fs::remove_dir(dir.join("other.3mf")).expect("removed");
    assert_eq!(files(&dir), before);
    assert_eq!(files(folder.path()).len(), 1);
}
