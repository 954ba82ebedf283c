//! Volume meshes from files: good ones, hostile ones, and what is said about them.

use pliant::geometry::files::vtu::{Array, VtuCells, VtuGrid, write_vtu};
use pliant::geometry::files::{Group, VolumeFile, VolumeFormat, read_volume, volume_from_arrays, write_msh};
use pliant::geometry::volume::{Elements, VolumeMesh};
use pliant::math::Vec3;
use pliant::units::LengthUnit;
use proptest::prelude::*;

const MM: Option<LengthUnit> = Some(LengthUnit::Millimetre);

/// Two tetrahedra on a common face, in two volumes with a group each; a surface of one triangle, a point, and an edge of
/// a curve that no group names. The second tetrahedron is listed inside out. Node 9 holds an arc's centre alone.
const MSH_4: &str = r#"$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
4
0 1 "tip"
2 7 "glued side"
3 1 "soft"
3 2 "hard"
$EndPhysicalNames
$Entities
2 1 1 2
1 0 0 10 1 1
2 50 50 50 0
1 0 0 0 10 0 0 0 2 1 -2
4 0 0 0 10 10 0 1 7 1 1
1 0 0 0 10 10 10 1 1 1 4
2 0 0 0 10 10 10 1 2 1 -4
$EndEntities
$Nodes
2 6 2 9
0 2 0 1
9
50 50 50
3 1 1 5
2
4
6
8
7
0 0 0 0.1 0.2 0.3
10 0 0 0 0 0
0 10 0 0 0 0
0 0 10 0 0 0
10 10 10 0 0 0
$EndNodes
$Elements
6 6 1 40
0 1 15 1
1 8
0 2 15 1
2 9
1 1 1 1
3 2 4
2 4 2 1
4 2 4 6
3 1 4 1
17 2 4 6 8
3 2 4 1
40 4 8 6 7
$EndElements
"#;

const MSH_2: &str = r#"$MeshFormat
2.2 0 8
$EndMeshFormat
$Comments
anything
$EndComments
$PhysicalNames
2
2 7 "glued side"
3 1 "soft"
$EndPhysicalNames
$Nodes
5
2 0 0 0
4 10 0 0
6 0 10 0
8 0 0 10
7 10 10 10
$EndNodes
$Elements
4
4 2 2 7 4 2 4 6
17 4 2 1 1 2 4 6 8
18 4 2 5 1 2 4 6 8
40 4 4 5 2 1 -1 4 6 8 7
$EndElements
"#;

fn read(text: &str, format: VolumeFormat) -> VolumeFile {
    read_volume(text.as_bytes(), format, MM).unwrap()
}

fn refusal(bytes: &[u8], format: VolumeFormat) -> String {
    read_volume(bytes, format, MM).unwrap_err().to_string()
}

fn group<'a>(groups: &'a [Group], name: &str) -> &'a [u32] {
    &groups
        .iter()
        .find(|g| g.name == name)
        .unwrap_or_else(|| panic!("no {name:?} in {groups:?}"))
        .members
}

fn names(groups: &[Group]) -> Vec<&str> {
    groups.iter().map(|g| g.name.as_str()).collect()
}

/// Six times the volume of tetrahedron `e`.
fn six_volumes(mesh: &VolumeMesh, e: usize) -> f64 {
    let x: Vec<Vec3> = mesh
        .elements
        .nodes_of(e)
        .iter()
        .map(|&n| mesh.nodes[n as usize])
        .collect();
    (x[1] - x[0]).dot(&(x[2] - x[0]).cross(&(x[3] - x[0])))
}

#[test]
fn gmsh_4_gives_mesh_groups_sets_and_its_own_numbers() {
    let file = read(MSH_4, VolumeFormat::Msh);
    assert_eq!(file.node_numbers, [2, 4, 6, 8, 7]);
    assert_eq!(file.element_numbers, [17, 40]);
    assert_eq!(file.mesh.nodes[4], Vec3::new(10.0, 10.0, 10.0));
    assert_eq!(names(&file.element_groups), ["soft", "hard"]);
    assert_eq!(group(&file.element_groups, "hard"), [1]);
    assert_eq!(group(&file.node_sets, "tip"), [3]);
    assert_eq!(group(&file.node_sets, "glued side"), [0, 1, 2]);
    assert_eq!(group(&file.node_sets, "hard"), [1, 2, 3, 4]);
    // 10³ for the corner; for 4, 8, 6, 7 the determinant of (−10, 0, 10), (−10, 10, 0), (0, 10, 10) is −2000, turned.
    assert_eq!(six_volumes(&file.mesh, 0), 1000.0);
    assert_eq!(six_volumes(&file.mesh, 1), 2000.0);
    let notes = file.notes.join("\n");
    assert!(notes.contains("1 of 2 elements were inside out"), "{notes}");
    assert!(
        notes.contains("1 nodes belong to points, lines or faces alone"),
        "{notes}"
    );
}

#[test]
fn gmsh_2_lists_an_element_of_two_groups_twice() {
    let file = read(MSH_2, VolumeFormat::Msh);
    assert_eq!(file.element_numbers, [17, 40]);
    assert_eq!(group(&file.element_groups, "soft"), [0]);
    assert_eq!(group(&file.element_groups, "5"), [0, 1]);
    assert_eq!(group(&file.node_sets, "glued side"), [0, 1, 2]);
    assert!(file.notes.join("\n").contains("again"), "{:?}", file.notes);
}

#[test]
fn entities_stand_in_where_there_are_no_physical_groups() {
    let plain = MSH_4
        .replace("1 0 0 10 1 1\n", "1 0 0 10 0\n")
        .replace("10 10 0 1 7 1 1", "10 10 0 0 1 1")
        .replace("10 10 10 1 1 1 4", "10 10 10 0 1 4")
        .replace("10 10 10 1 2 1 -4", "10 10 10 0 1 -4");
    let file = read(&plain, VolumeFormat::Msh);
    assert_eq!(names(&file.element_groups), ["volume 1", "volume 2"]);
    assert_eq!(group(&file.node_sets, "curve 1"), [0, 1]);
}

#[test]
fn quadratic_tetrahedra_are_read_as_their_corners() {
    let mut text = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n");
    let corners = [[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 8.0, 0.0], [0.0, 0.0, 8.0]].map(Vec3::from);
    let edges = [[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]];
    let middles = edges.map(|[a, b]| 0.5 * (corners[a] + corners[b]));
    for (i, x) in middles.iter().chain(&corners).enumerate() {
        text += &format!("{} {} {} {}\n", i + 1, x.x, x.y, x.z);
    }
    text += "$EndNodes\n$Elements\n1\n1 11 2 3 3 7 8 9 10 1 2 3 4 5 6\n$EndElements\n";
    let file = read(&text, VolumeFormat::Msh);
    assert_eq!(file.node_numbers, [7, 8, 9, 10]);
    assert_eq!(file.mesh.elements, Elements::Tetrahedra(vec![[0, 1, 2, 3]]));
    assert_eq!(file.mesh.nodes, corners);
    assert!(
        file.notes.join("\n").contains("1 curved elements"),
        "{:?}",
        file.notes
    );
}

/// A change to the good file, and words that its refusal holds: place, value, mend.
const MISTAKES: [(&str, &str, &[&str]); 12] = [
    (
        "$MeshFormat\n4.1",
        "$MeshFormat\n4.0",
        &["line 2", "4.0", "MSH 4.1 or 2.2"],
    ),
    (
        "10 0 0 0 0 0",
        "10 nan 0 0 0 0",
        &["line 32", "NaN", "not a finite number"],
    ),
    (
        "10 0 0 0 0 0",
        "10 one 0 0 0 0",
        &["line 32", "\"one\"", "a number"],
    ),
    (
        "17 2 4 6 8",
        "17 2 4 6 99",
        &["line 48", "element 17", "node 99", "2 to 9"],
    ),
    ("17 2 4 6 8", "17 2 4 6 -8", &["line 48", "\"-8\""]),
    ("17 2 4 6 8", "17 2 4 6 6", &["element 17", "flat", "mesh again"]),
    ("\n0 0 10 0 0 0", "\n3 3 0 0 0 0", &["element 17", "flat"]),
    (
        "2 9\n1 1 1 1",
        "2 8\n1 1 1 1",
        &["node 9", "(50.0000, 50.0000, 50.0000)", "no element"],
    ),
    (
        "2 4 2 1\n4 2 4 6",
        "2 4 99 1\n4 2 4 6",
        &["line 45", "element type 99"],
    ),
    ("4\n6\n8\n7\n", "4\n6\n8\n4\n", &["node 4 a second time"]),
    ("3 1 4 1\n17", "3 1 4 100000\n17", &["cut off", "100000"]),
    (
        "3 2 4 1\n40 4 8 6 7",
        "3 2 6 1\n40 4 8 6 7 2 9",
        &["1 tetrahedra, 1 prisms", "alone"],
    ),
];

#[test]
fn mistakes_name_place_value_and_mend() {
    let mut wrong = Vec::new();
    for (old, new, words) in MISTAKES {
        assert!(MSH_4.contains(old), "{old}");
        let message = refusal(MSH_4.replacen(old, new, 1).as_bytes(), VolumeFormat::Msh);
        let missing: Vec<_> = words.iter().filter(|w| !message.contains(**w)).collect();
        if !missing.is_empty() {
            wrong.push(format!("{old} → {new}: no {missing:?} in {message}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let surface = MSH_4
        .replace("3 1 4 1\n17 2 4 6 8\n3 2 4 1\n40 4 8 6 7\n", "")
        .replacen("6 6 1 40", "4 4 1 4", 1);
    let message = refusal(surface.as_bytes(), VolumeFormat::Msh);
    assert!(
        message.contains("2 points, 1 lines, 1 triangles") && message.contains("3D"),
        "{message}"
    );
}

#[test]
fn a_unit_must_be_stated_and_make_sense() {
    let with = |unit| read_volume(MSH_4.as_bytes(), VolumeFormat::Msh, unit);
    let message = with(None).unwrap_err().to_string();
    assert!(
        message.contains("50 × 50 × 50") && message.contains("unit = \"mm\""),
        "{message}"
    );
    let message = with(Some(LengthUnit::Metre)).unwrap_err().to_string();
    assert!(message.contains("millimetres or centimetres"), "{message}");
    let inches = with(Some(LengthUnit::Inch)).unwrap();
    assert_eq!(inches.mesh.nodes[1], Vec3::new(254.0, 0.0, 0.0));
}

/// Random bytes put into files, and files cut anywhere, are answered, and never with a panic.
fn damaged(bytes: &[u8], at: usize, byte: u8, length: usize) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let at = at % bytes.len();
    bytes[at] = byte;
    bytes.truncate(length % (bytes.len() + 1));
    bytes
}

fn block(tetrahedra: bool) -> VolumeMesh {
    let mesh = VolumeMesh::cuboid(Vec3::new(30.0, 20.0, 10.0), [3, 2, 1], tetrahedra);
    if !tetrahedra {
        return mesh;
    }
    let tets = (0..mesh.elements.len())
        .flat_map(|e| {
            let cell = mesh.elements.nodes_of(e).to_vec();
            pliant::geometry::volume::KUHN.map(|tet| tet.map(|k| cell[k]))
        })
        .collect();
    VolumeMesh {
        nodes: mesh.nodes,
        elements: Elements::Tetrahedra(tets),
    }
}

fn named(name: &str, members: Vec<u32>) -> Group {
    Group {
        name: name.into(),
        members,
    }
}

#[test]
fn what_is_written_as_msh_is_read_back() {
    for tetrahedra in [false, true] {
        let mesh = block(tetrahedra);
        let last = mesh.elements.len() as u32 - 1;
        let groups = [named("a", vec![0, 1]), named("b", vec![1, last])];
        let sets = [named("left", vec![0, 4, 8]), named("right", vec![3])];
        let mut bytes = Vec::new();
        write_msh(&mut bytes, &mesh, &groups, &sets).unwrap();
        let file = read_volume(&bytes, VolumeFormat::Msh, MM).unwrap();
        assert_eq!(file.mesh.nodes, mesh.nodes);
        // Elements come grouped; their numbers tell them.
        for (e, &number) in file.element_numbers.iter().enumerate() {
            assert_eq!(
                file.mesh.elements.nodes_of(e),
                mesh.elements.nodes_of(number as usize - 1)
            );
        }
        let own = |name: &str| -> Vec<u32> {
            let list = group(&file.element_groups, name).iter();
            let mut own: Vec<u32> = list
                .map(|&e| file.element_numbers[e as usize] as u32 - 1)
                .collect();
            own.sort_unstable();
            own
        };
        assert_eq!((own("a"), own("b")), (vec![0, 1], vec![1, last]));
        assert_eq!(group(&file.node_sets, "left"), [0, 4, 8]);
        assert!(file.notes.is_empty(), "{:?}", file.notes);
    }
    let bad = write_msh(Vec::new(), &block(true), &[named("a", vec![999])], &[]).unwrap_err();
    assert!(bad.to_string().contains("below 36"), "{bad}");
}

fn vtu(mesh: &VolumeMesh) -> Vec<u8> {
    let materials: Vec<i32> = (0..mesh.elements.len() as i32).map(|e| e % 2).collect();
    let cells = match &mesh.elements {
        Elements::Tetrahedra(tets) => VtuCells::Tetrahedra(tets),
        Elements::Hexahedra(cells) | Elements::KuhnCells(cells) => VtuCells::Hexahedra(cells),
    };
    let grid = VtuGrid {
        points: &mesh.nodes,
        cells,
    };
    let held: Vec<i32> = mesh.nodes.iter().map(|x| i32::from(x.z == 0.0)).collect();
    let load: Vec<f64> = mesh.nodes.iter().map(|x| 0.1 * x.x + 0.01).collect();
    let mut bytes = Vec::new();
    write_vtu(
        &mut bytes,
        &grid,
        &[("held", Array::Integers(&held)), ("load", Array::Scalars(&load))],
        &[("material_id", Array::Integers(&materials))],
    )
    .unwrap();
    bytes
}

#[test]
fn what_is_written_as_vtu_is_read_back() {
    for tetrahedra in [false, true] {
        let mesh = block(tetrahedra);
        let file = read_volume(&vtu(&mesh), VolumeFormat::Vtu, MM).unwrap();
        assert_eq!(file.mesh, mesh);
        assert_eq!(names(&file.element_groups), ["material_id=0", "material_id=1"]);
        assert!(
            group(&file.element_groups, "material_id=1")
                .iter()
                .all(|e| e % 2 == 1)
        );
        let held = group(&file.node_sets, "held=1");
        assert_eq!(held, (0..12).collect::<Vec<u32>>());
        assert!(!names(&file.node_sets).iter().any(|n| n.starts_with("load")));
    }
}

/// A tetrahedron with a triangle beside it, all arrays as text; the triangle's label makes a set of nodes.
const VTU: &str = r#"<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="2">
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">
0 0 0 10 0 0 0 10 0 0 0 10
</DataArray></Points>
<Cells>
<DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3 0 1 2</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">4 7</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">10 5</DataArray>
</Cells>
<CellData><DataArray type="Int32" Name="gmsh:physical" format="ascii">3 8</DataArray></CellData>
</Piece></UnstructuredGrid></VTKFile>
"#;

#[test]
fn text_vtu_and_its_mistakes() {
    let file = read(VTU, VolumeFormat::Vtu);
    assert_eq!(file.mesh.elements, Elements::Tetrahedra(vec![[0, 1, 2, 3]]));
    assert_eq!(group(&file.node_sets, "gmsh:physical=8"), [0, 1, 2]);
    assert_eq!(names(&file.element_groups), ["gmsh:physical=3"]);
    for (old, new, words) in [
        ("0 1 2 3 0", "0 1 2 9 0", &["cell 0", "node 9", "0 to 3"][..]),
        ("0 0 0 10 0 0", "0 0 0 10 nan 0", &["point 1", "NaN"]),
        ("4 7", "4 99", &["offsets", "4 to 99"]),
        ("10 5</", "10 42</", &["cell 1", "type 42"]),
        (
            "NumberOfPoints=\"4\"",
            "NumberOfPoints=\"5\"",
            &["line 4", "12 numbers", "15"],
        ),
        (
            "UnstructuredGrid\" version",
            "PolyData\" version",
            &["line 2", "PolyData"],
        ),
        (
            "version=\"0.1\"",
            "compressor=\"vtkLZ4DataCompressor\"",
            &["LZ4", "zlib"],
        ),
        (
            "Name=\"types\" format=\"ascii\"",
            "Name=\"types\" format=\"appended\" offset=\"7\"",
            &["cut off", "types"],
        ),
    ] {
        assert!(VTU.contains(old), "{old}");
        let message = refusal(VTU.replacen(old, new, 1).as_bytes(), VolumeFormat::Vtu);
        for word in words {
            assert!(message.contains(word), "{old} → {new}: no {word:?} in {message}");
        }
    }
}

#[test]
fn arrays_in_json_bring_their_lists() {
    let text = r#"{"units": "mm", "force_n": [0, 0, -15], "held": [0, 1, 2], "layer": ["low", "high"],
        "nodes": [[0,0,0],[10,0,0],[0,10,0],[0,0,10],[10,10,10]], "tets": [[0,1,2,3],[1,2,3,4]]}"#;
    let file = read(text, VolumeFormat::Arrays);
    assert_eq!(file.mesh.elements.len(), 2);
    assert_eq!(group(&file.node_sets, "held"), [0, 1, 2]);
    assert_eq!(names(&file.element_groups), ["layer=high", "layer=low"]);
    assert!(!names(&file.node_sets).contains(&"force_n"));
    for (old, new, words) in [
        ("[1,2,3,4]]", "[1,2,3,5]]", &["tets[1]", "node 5", "0 to 4"][..]),
        ("[1,2,3,4]]", "[1,2,3]]", &["tets[1]", "4 node numbers"]),
        ("[0,0,10]", "[0,0]", &["nodes[3]", "three numbers"]),
        ("[10,10,10]", "[10,10,1e999]", &["line 2", "JSON"]),
        ("\"nodes\"", "\"vertices\"", &["\"nodes\""]),
    ] {
        let message = refusal(text.replacen(old, new, 1).as_bytes(), VolumeFormat::Arrays);
        for word in words {
            assert!(message.contains(word), "{old} → {new}: no {word:?} in {message}");
        }
    }
}

/// Mirrored hexahedra are turned; one with a corner pushed through its opposite is folded, and refused.
#[test]
fn hexahedra_are_turned_or_refused() {
    let mut mesh = block(false);
    mesh.nodes.iter_mut().for_each(|x| x.x = -x.x);
    let file = volume_from_arrays(mesh.nodes.clone(), mesh.elements.clone()).unwrap();
    assert!(file.notes.join("\n").contains("6 of 6 elements were inside out"));
    let again = volume_from_arrays(file.mesh.nodes, file.mesh.elements).unwrap();
    assert!(again.notes.is_empty(), "{:?}", again.notes);
    let mut mesh = block(false);
    mesh.nodes[0] = Vec3::new(25.0, 15.0, 8.0);
    let message = volume_from_arrays(mesh.nodes, mesh.elements)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("hexahedron 0") && message.contains("folded"),
        "{message}"
    );
}

proptest! {
    #[test]
    fn damaged_files_are_answered(at in any::<usize>(), byte in any::<u8>(), length in any::<usize>(), whole in any::<bool>()) {
        let length = |n: usize| if whole { n } else { length };
        let vtu = vtu(&block(true));
        for (bytes, format) in [
            (MSH_4.as_bytes(), VolumeFormat::Msh),
            (MSH_2.as_bytes(), VolumeFormat::Msh),
            (VTU.as_bytes(), VolumeFormat::Vtu),
            (&vtu, VolumeFormat::Vtu),
        ] {
            if let Ok(file) = read_volume(&damaged(bytes, at, byte, length(bytes.len())), format, MM) {
                prop_assert!(file.mesh.nodes.iter().all(|x| x.iter().all(|c| c.is_finite())));
            }
        }
    }
}
