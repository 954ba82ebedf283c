//! Volume meshes as VTK, meshio and Gmsh write them.

use crate::python;
use pliant::geometry::files::{VolumeFile, open_volume};
use pliant::geometry::volume::{Elements, KUHN, VolumeMesh};
use pliant::math::Vec3;
use pliant::units::LengthUnit;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The block that `write_volumes.py` writes.
fn block(tetrahedra: bool) -> VolumeMesh {
    let mut mesh = VolumeMesh::cuboid(Vec3::new(30.0, 16.0, 6.0), [3, 2, 1], false);
    mesh.nodes.iter_mut().for_each(|x| *x += Vec3::new(0.1, 0.2, 0.3));
    if tetrahedra {
        let cells: Vec<Vec<u32>> = (0..6).map(|e| mesh.elements.nodes_of(e).to_vec()).collect();
        let tets = cells.iter().flat_map(|cell| KUHN.map(|tet| tet.map(|k| cell[k])));
        mesh.elements = Elements::Tetrahedra(tets.collect());
    }
    mesh
}

fn check_block(name: &str, file: &VolumeFile) {
    let expected = block(name.starts_with("tetra"));
    // Written as f32, coordinates up to 30 have an error of 2e-6.
    let tolerance = if name.contains("float32") { 2e-6 } else { 1e-12 };
    assert_eq!(file.mesh.elements, expected.elements, "{name}");
    assert_eq!(file.mesh.nodes.len(), expected.nodes.len(), "{name}");
    for (found, expected) in file.mesh.nodes.iter().zip(&expected.nodes) {
        assert!(
            (found - expected).norm() < tolerance,
            "{name}: {found} for {expected}"
        );
    }
    assert!(file.notes.is_empty(), "{name}: {:?}", file.notes);
    if name.contains("meshio41") {
        return;
    }
    // The cells at i = 0 are the first and the fourth; a cell is one hexahedron or six tetrahedra.
    let share = file.mesh.elements.len() as u32 / 6;
    let first: Vec<u32> = (0..share).chain(3 * share..4 * share).collect();
    let wanted = if name.ends_with(".msh") {
        "first"
    } else {
        "label=1"
    };
    let group = file.element_groups.iter().find(|g| g.name == wanted);
    assert_eq!(group.map(|g| &g.members), Some(&first), "{name}");
}

#[test]
fn every_way_of_writing_gives_the_same_mesh() {
    let folder = tempfile::tempdir().expect("a folder");
    let Some(said) = python::run("write_volumes.py", &[folder.path()]) else {
        return;
    };
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder.path())
        .expect("a list")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    files.sort();
    let mut from_gmsh: BTreeMap<String, VolumeFile> = BTreeMap::new();
    for path in &files {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let file = open_volume(path, Some(LengthUnit::Millimetre)).unwrap_or_else(|e| panic!("{name}: {e}"));
        if name.starts_with("gmsh") {
            from_gmsh.insert(name, file);
        } else {
            check_block(&name, &file);
        }
    }
    // 2 kinds, 64 ways of VTK, 7 of meshio.
    assert_eq!(files.len() - from_gmsh.len(), 142);
    if from_gmsh.is_empty() {
        println!("skipped: {said}");
        return;
    }
    assert_eq!(from_gmsh.len(), 8);
    for (name, file) in &from_gmsh {
        check_gmsh(name, file, &from_gmsh["gmsh-1-4.1-binary.msh"]);
    }
}

/// A block of 30 × 20 × 10 mm with a ball of radius 3 mm in it, in groups of their own; its bottom is a group too.
fn check_gmsh(name: &str, file: &VolumeFile, other: &VolumeFile) {
    let volume = |members: &[u32]| -> f64 {
        let of = |e: &u32| {
            let nodes = file.mesh.elements.nodes_of(*e as usize);
            let x: Vec<Vec3> = nodes.iter().map(|&n| file.mesh.nodes[n as usize]).collect();
            (x[1] - x[0]).dot(&(x[2] - x[0]).cross(&(x[3] - x[0]))) / 6.0
        };
        members.iter().map(of).sum()
    };
    let group = |name: &str| {
        &file
            .element_groups
            .iter()
            .find(|g| g.name == name)
            .expect("a group")
            .members
    };
    let (core, shell) = (group("core"), group("shell"));
    assert!((volume(core) + volume(shell) - 6000.0).abs() < 1e-6, "{name}");
    // Tetrahedra of 5 mm cut the ball of 113 mm³ short, but not by half.
    assert!((56.0..113.2).contains(&volume(core)), "{name}: {}", volume(core));
    let bottom = file.node_sets.iter().find(|s| s.name == "bottom").expect("a set");
    let on_bottom = |n: &usize| file.mesh.nodes[*n].z.abs() < 1e-9;
    let expected: Vec<u32> = (0..file.mesh.nodes.len())
        .filter(on_bottom)
        .map(|n| n as u32)
        .collect();
    assert_eq!(bottom.members, expected, "{name}");
    assert_eq!(
        file.notes.iter().any(|n| n.contains("curved")),
        name.contains("gmsh-2"),
        "{name}"
    );
    if name.contains("gmsh-1") {
        assert_eq!(file.mesh.elements.len(), other.mesh.elements.len(), "{name}");
    }
}
