//! Mesh files: good ones, hostile ones, and what is said about them.

use super::solids::sphere;
use approx::assert_relative_eq;
use pliant::geometry::files::{SurfaceFormat, open_surface, read_surface, write_obj, write_stl};
use pliant::geometry::shapes::block;
use pliant::geometry::{Solid, TriMesh};
use pliant::math::Vec3;
use pliant::units::LengthUnit;
use proptest::prelude::*;
use std::io::Write;

pub const MM: Option<LengthUnit> = Some(LengthUnit::Millimetre);

fn ball() -> TriMesh {
    sphere(Vec3::new(10.0, 20.0, 30.0), 20.0, 8)
}

fn bytes_of(write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(&mut bytes);
    bytes
}

fn binary_stl(mesh: &TriMesh) -> Vec<u8> {
    bytes_of(|bytes| write_stl(mesh, bytes).unwrap())
}

fn obj(mesh: &TriMesh) -> Vec<u8> {
    bytes_of(|bytes| write_obj(mesh, bytes).unwrap())
}

/// An ASCII STL with the given opening, facet word and closing.
fn ascii_stl(mesh: &TriMesh, opening: &str, closing: &str) -> Vec<u8> {
    let mut text = format!("{opening}\n");
    for t in 0..mesh.triangles.len() {
        text += "facet normal 0 0 0\n outer loop\n";
        for v in mesh.corners(t) {
            text += &format!("  vertex {} {} {}\n", v.x, v.y, v.z);
        }
        text += " endloop\nendfacet\n";
    }
    (text + closing + "\n").into_bytes()
}

fn ply(mesh: &TriMesh, format: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment made by a test\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nproperty uchar red\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for v in &mesh.vertices {
        match format {
            "ascii" => writeln!(bytes, "{} {} {} 7", v.x, v.y, v.z).unwrap(),
            "binary_little_endian" => {
                v.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
                bytes.push(7);
            }
            _ => {
                v.iter().for_each(|x| bytes.extend(x.to_be_bytes()));
                bytes.push(7);
            }
        }
    }
    for t in &mesh.triangles {
        match format {
            "ascii" => writeln!(bytes, "3 {} {} {}", t[0], t[1], t[2]).unwrap(),
            "binary_little_endian" => {
                bytes.push(3);
                t.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
            }
            _ => {
                bytes.push(3);
                t.iter().for_each(|v| bytes.extend(v.to_be_bytes()));
            }
        }
    }
    bytes
}

/// A package with the given parts.
pub fn package(parts: &[(&str, &str)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, text) in parts {
        zip.start_file(*name, zip::write::SimpleFileOptions::default())
            .unwrap();
        zip.write_all(text.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// A model part with a tetrahedron of legs 2 as object 1, then `rest`.
pub fn model(unit: &str, rest: &str) -> String {
    let vertices = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]];
    let vertices: String = vertices
        .iter()
        .map(|[x, y, z]| format!("<vertex x='{x}' y='{y}' z='{z}'/>\n"))
        .collect();
    let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let triangles: String = triangles
        .iter()
        .map(|[a, b, c]| format!("<triangle v1='{a}' v2='{b}' v3='{c}'/>\n"))
        .collect();
    format!(
        "<?xml version='1.0' encoding='UTF-8'?>\n<model {unit} xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02' \
         xmlns:p='http://schemas.microsoft.com/3dmanufacturing/production/2015/06'><resources>\n<object id='1'><mesh>\
         <vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh></object>\n{rest}</model>"
    )
}

pub fn three_mf(unit: &str, rest: &str) -> Vec<u8> {
    package(&[("3D/3dmodel.model", &model(unit, rest))])
}

pub fn refusal(bytes: &[u8], format: SurfaceFormat) -> String {
    read_surface(bytes, format, MM).unwrap_err().to_string()
}

/// Positions of all corners, which do not depend on how vertices are numbered.
fn corners(mesh: &TriMesh) -> Vec<[Vec3; 3]> {
    (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect()
}

#[test]
fn every_format_gives_back_the_ball() {
    let ball = ball();
    for (name, bytes, format, tolerance) in [
        ("binary STL", binary_stl(&ball), SurfaceFormat::Stl, 1e-5),
        (
            "ASCII STL",
            ascii_stl(&ball, "solid ball", "endsolid ball"),
            SurfaceFormat::Stl,
            0.0,
        ),
        ("OBJ", obj(&ball), SurfaceFormat::Obj, 0.0),
        ("ASCII PLY", ply(&ball, "ascii"), SurfaceFormat::Ply, 0.0),
        (
            "little endian PLY",
            ply(&ball, "binary_little_endian"),
            SurfaceFormat::Ply,
            0.0,
        ),
        (
            "big endian PLY",
            ply(&ball, "binary_big_endian"),
            SurfaceFormat::Ply,
            0.0,
        ),
    ] {
        let read = read_surface(&bytes, format, MM).unwrap();
        assert_eq!(
            read.mesh.vertices.len(),
            ball.vertices.len(),
            "{name}: vertices are shared"
        );
        for (ours, theirs) in corners(&read.mesh)
            .iter()
            .flatten()
            .zip(corners(&ball).iter().flatten())
        {
            assert!((ours - theirs).norm() <= tolerance, "{name}");
        }
        assert!(Solid::new(read.mesh).unwrap().health().is_closed(), "{name}");
    }
}

#[test]
fn the_unit_scales_and_the_size_is_checked() {
    // A ball of 40 in diameter.
    let bytes = obj(&ball());
    let largest = |unit| {
        read_surface(&bytes, SurfaceFormat::Obj, Some(unit)).map(|file| {
            let (lo, hi) = file.mesh.bounds().unwrap();
            (hi - lo).max()
        })
    };
    assert_relative_eq!(
        largest(LengthUnit::Millimetre).unwrap(),
        40.0,
        max_relative = 1e-12
    );
    assert_relative_eq!(
        largest(LengthUnit::Centimetre).unwrap(),
        400.0,
        max_relative = 1e-12
    );
    assert_relative_eq!(largest(LengthUnit::Inch).unwrap(), 1016.0, max_relative = 1e-12);
    let too_long = largest(LengthUnit::Metre).unwrap_err().to_string();
    assert!(
        too_long.contains("40 m long") && too_long.contains("is the unit millimetres or"),
        "{too_long}"
    );
    let too_short = largest(LengthUnit::Micrometre).unwrap_err().to_string();
    assert!(too_short.contains("0.04 mm long"), "{too_short}");
    let unsaid = read_surface(&bytes, SurfaceFormat::Obj, None)
        .unwrap_err()
        .to_string();
    for part in [
        "40 × ",
        "in mm the largest extent would be 40 mm",
        "in cm 400 mm",
        "in m 40 m",
    ] {
        assert!(unsaid.contains(part), "{part:?} in {unsaid}");
    }
}

#[test]
fn a_scan_in_metres_is_no_insole_of_a_quarter_millimetre() {
    let insole = block(Vec3::new(250.0, 100.0, 20.0), 10.0).unwrap();
    let metres = TriMesh {
        vertices: insole.vertices.iter().map(|v| v / 1000.0).collect(),
        ..insole
    };
    let error = refusal(&obj(&metres), SurfaceFormat::Obj);
    assert!(
        error.contains("0.25 mm long") && error.contains("metres"),
        "{error}"
    );
}

#[test]
fn an_stl_is_binary_by_its_length_not_by_its_first_word() {
    let mut bytes = binary_stl(&ball());
    bytes[..5].copy_from_slice(b"solid");
    assert_eq!(
        read_surface(&bytes, SurfaceFormat::Stl, MM)
            .unwrap()
            .mesh
            .triangles
            .len(),
        ball().triangles.len()
    );
    // A count too small would silently lose triangles; one too large reads beyond the end.
    for count in [10_u32, 100_000] {
        bytes[80..84].copy_from_slice(&count.to_le_bytes());
        let error = refusal(&bytes, SurfaceFormat::Stl);
        let room = ball().triangles.len().to_string();
        assert!(
            error.contains(&count.to_string()) && error.contains(&room) && error.contains("export"),
            "{error}"
        );
    }
}

#[test]
fn ascii_stl_comes_in_many_manners() {
    let ball = ball();
    let plain = ascii_stl(&ball, "solid ball", "endsolid ball");
    let read = |bytes: &[u8]| read_surface(bytes, SurfaceFormat::Stl, MM).unwrap().mesh;
    let expected = read(&plain);
    let capital = String::from_utf8(plain.clone())
        .unwrap()
        .to_uppercase()
        .into_bytes();
    let unnamed = ascii_stl(&ball, "solid", "endsolid");
    let windows = String::from_utf8(plain.clone())
        .unwrap()
        .replace('\n', "\r\n")
        .into_bytes();
    let accented = ascii_stl(&ball, "solid übung größe", "endsolid übung");
    let named_facet = ascii_stl(&ball, "solid facet vertex", "endsolid facet");
    for bytes in [capital, unnamed, windows, accented, named_facet] {
        assert_eq!(
            read(&bytes),
            expected,
            "{}",
            String::from_utf8_lossy(&bytes[..40])
        );
    }
    // Two solids in one file are one surface of twice the triangles.
    let far = TriMesh {
        vertices: ball.vertices.iter().map(|v| v + Vec3::x() * 100.0).collect(),
        ..ball.clone()
    };
    let both = [plain, ascii_stl(&far, "solid second", "endsolid second")].concat();
    assert_eq!(read(&both).triangles.len(), 2 * ball.triangles.len());
}

#[test]
fn our_stl_reads_the_same_in_another_library() {
    let bytes = binary_stl(&ball());
    let theirs = stl_io::read_stl(&mut std::io::Cursor::new(&bytes)).unwrap();
    let ours = read_surface(&bytes, SurfaceFormat::Stl, MM).unwrap().mesh;
    assert_eq!(theirs.faces.len(), ours.triangles.len());
    for (face, corners) in theirs.faces.iter().zip(corners(&ours)) {
        for (v, corner) in face.vertices.iter().zip(corners) {
            assert_eq!(Vec3::from(theirs.vertices[*v].0.map(f64::from)), corner);
        }
        let [a, b, c] = face
            .vertices
            .map(|v| Vec3::from(theirs.vertices[v].0.map(f64::from)));
        let normal = Vec3::from(face.normal.0.map(f64::from));
        assert_relative_eq!((b - a).cross(&(c - a)).normalize(), normal, epsilon = 1e-4);
    }
}

#[test]
fn mistakes_in_text_files_are_named_by_line() {
    let stl = |body: &str| {
        refusal(
            format!("solid s\n{body}\nendsolid s\n").as_bytes(),
            SurfaceFormat::Stl,
        )
    };
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 0 9 0\nendloop\nendfacet";
    for (error, parts) in [
        (
            stl(&facet.replace("vertex 9 0 0", "vertex nan 0 0")),
            ["line 5", "nan"],
        ),
        (
            stl(&facet.replace("vertex 9 0 0", "vertex 9 0,5 0")),
            ["line 5", "0,5"],
        ),
        (
            stl(&facet.replace("vertex 9 0 0", "vertex 9 0")),
            ["line 5", "three coordinates"],
        ),
        (
            stl(&facet.replace("vertex 9 0 0\n", "")),
            ["line 6", "three vertices"],
        ),
        (
            stl(&facet.replace("endloop", "vertex 0 0 9\nendloop")),
            ["line 7", "endloop"],
        ),
        (
            refusal(format!("solid s\n{facet}").as_bytes(), SurfaceFormat::Stl),
            ["cut off", "endsolid"],
        ),
        (
            refusal(b"solid s\nendsolid s\n", SurfaceFormat::Stl),
            ["no triangles", ""],
        ),
        (refusal(b"", SurfaceFormat::Stl), ["no triangles", "empty"]),
        (
            refusal(b"hello world\n", SurfaceFormat::Stl),
            ["hello world", "solid"],
        ),
        (
            refusal(b"v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 4\n", SurfaceFormat::Obj),
            ["line 4", "vertex 4"],
        ),
        (
            refusal(b"v 0 0 0\nv 9 0 0\nv 0 9 0\nf 0 1 2\n", SurfaceFormat::Obj),
            ["line 4", "vertex 0"],
        ),
        (
            refusal(b"v 0 0 0\nv 9 0 0\nv 0 9 0\nf -4 1 2\n", SurfaceFormat::Obj),
            ["line 4", "vertex -4"],
        ),
        (
            refusal(b"v 0 0 0\nv 9 inf 0\n", SurfaceFormat::Obj),
            ["line 2", "inf"],
        ),
        (
            refusal(b"v 0 0\n", SurfaceFormat::Obj),
            ["line 1", "three coordinates"],
        ),
        (
            refusal(b"v 0 0 0\nf 1 1\n", SurfaceFormat::Obj),
            ["line 2", "2 corners"],
        ),
        (
            refusal(b"v 0 0 0\n", SurfaceFormat::Obj),
            ["no triangles", "\"f\""],
        ),
    ] {
        assert!(
            parts.iter().all(|part| error.contains(part)),
            "{parts:?} in {error}"
        );
    }
}

#[test]
fn obj_faces_are_polygons_with_relative_and_split_corners() {
    let text = "# a cube corner\nmtllib none.mtl\no part\nv 0 0 0 0.5 0.5 0.5\nv 9 0 0\nv 9 9 0\nv 0 9 0\nvt 0 0\nvn 0 0 1\n\
                usemtl nothing\nf 1/1/1 2//1 \\\n 3/1 4\ng other\nf -4 -3 -2\nl 1 2\n";
    let file = read_surface(text.as_bytes(), SurfaceFormat::Obj, MM).unwrap();
    assert_eq!(file.mesh.triangles, vec![[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!(file.notes.len(), 1);
}

#[test]
fn mistakes_in_ply_files_are_named() {
    let good = String::from_utf8(ply(&ball(), "ascii")).unwrap();
    let vertices = ball().vertices.len();
    for (text, parts) in [
        (
            good.replace("property double y", "property double why"),
            ["\"vertex\"", "\"y\""],
        ),
        (
            good.replace("vertex_indices", "corners"),
            ["\"face\"", "vertex_indices"],
        ),
        (
            good.replace(&format!("vertex {vertices}"), "vertex 99999999999"),
            ["99999999999", "cut off"],
        ),
        (good.replace("3 0 ", "3 9999 "), ["face 0", "vertex 9999"]),
        (good.replace("3 0 ", "3 -1 "), ["face 0", "vertex -1"]),
        (good.replace("ply\nformat", "format"), ["PLY", ""]),
        (good[..good.len() / 2].to_string(), ["PLY", ""]),
    ] {
        let error = refusal(text.as_bytes(), SurfaceFormat::Ply);
        assert!(
            parts.iter().all(|part| error.contains(part)),
            "{parts:?} in {error}"
        );
    }
    // In the binary one, a NaN in the place of the first vertex' x.
    let mut binary = ply(&ball(), "binary_little_endian");
    let start = binary
        .windows(11)
        .position(|word| word == b"end_header\n")
        .unwrap()
        + 11;
    binary[start..start + 8].copy_from_slice(&f64::NAN.to_le_bytes());
    let error = refusal(&binary, SurfaceFormat::Ply);
    assert!(error.contains("vertex 0") && error.contains("NaN"), "{error}");
}

#[test]
fn endings_name_formats() {
    for (name, format) in [
        ("a.STL", SurfaceFormat::Stl),
        ("b.obj", SurfaceFormat::Obj),
        ("c.d.ply", SurfaceFormat::Ply),
        ("e.3mf", SurfaceFormat::ThreeMf),
    ] {
        assert_eq!(SurfaceFormat::from_path(name.as_ref()).unwrap(), format);
    }
    let error = open_surface("insole.amf".as_ref(), MM).unwrap_err().to_string();
    assert!(error.contains("insole.amf") && error.contains(".stl"), "{error}");
    assert!(
        open_surface("/nowhere/at/all.stl".as_ref(), MM)
            .unwrap_err()
            .to_string()
            .contains("/nowhere/at/all.stl")
    );
}

/// Bytes of a good file with a part cut out, replaced, or cut off.
fn damaged(good: Vec<u8>) -> impl Strategy<Value = Vec<u8>> {
    let length = good.len();
    (
        Just(good),
        0..length,
        0..40_usize,
        proptest::collection::vec(any::<u8>(), 0..40),
        any::<bool>(),
    )
        .prop_map(|(mut bytes, at, cut, insert, truncate)| {
            if truncate {
                bytes.truncate(at);
            } else {
                let end = (at + cut).min(bytes.len());
                bytes.splice(at..end, insert);
            }
            bytes
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Whatever the bytes, there is an answer, and a surface that is answered can be asked.
    #[test]
    fn damaged_files_are_answered(
        stl in damaged(binary_stl(&ball())),
        text in damaged(ascii_stl(&ball(), "solid s", "endsolid s")),
        obj in damaged(obj(&ball())),
        ascii in damaged(ply(&ball(), "ascii")),
        binary in damaged(ply(&ball(), "binary_big_endian")),
        zip in damaged(three_mf("unit='centimeter'", "</resources><build><item objectid='1'/></build>")),
        xml in damaged(model("unit='centimeter'", "</resources><build><item objectid='1'/></build>").into_bytes()),
        noise in proptest::collection::vec(any::<u8>(), 0..300),
    ) {
        let xml = package(&[("3D/3dmodel.model", &String::from_utf8_lossy(&xml))]);
        for (bytes, format) in [
            (&stl, SurfaceFormat::Stl), (&text, SurfaceFormat::Stl), (&obj, SurfaceFormat::Obj),
            (&ascii, SurfaceFormat::Ply), (&binary, SurfaceFormat::Ply), (&zip, SurfaceFormat::ThreeMf),
            (&xml, SurfaceFormat::ThreeMf), (&noise, SurfaceFormat::Stl), (&noise, SurfaceFormat::Obj),
            (&noise, SurfaceFormat::Ply), (&noise, SurfaceFormat::ThreeMf),
        ] {
            let unit = if format == SurfaceFormat::ThreeMf { None } else { MM };
            if let Ok(file) = read_surface(bytes, format, unit) {
                let _ = Solid::new(file.mesh).map(|solid| solid.volume());
            }
        }
    }
}
