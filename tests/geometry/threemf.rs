//! 3MF files: what is on the build list, where it is, in which unit; and what is said about mistakes.

use super::files::{MM, model, package, refusal, three_mf};
use super::scans::shared;
use approx::assert_relative_eq;
use pliant::geometry::Solid;
use pliant::geometry::files::{MeshFileError, SurfaceFormat, open_surface, read_surface};
use pliant::math::Vec3;
use pliant::units::LengthUnit;

#[test]
fn a_3mf_places_its_objects_and_declares_its_unit() {
    let build = |items: &str, more: &str| format!("{more}</resources><build>{items}</build>");
    let read =
        |unit: &str, rest: &str, stated| read_surface(&three_mf(unit, rest), SurfaceFormat::ThreeMf, stated);
    // 2 cm are 20 mm; a tetrahedron of three legs l has the volume l³/6.
    let one = build("<item objectid='1'/>", "");
    let file = read("unit='centimeter'", &one, None).unwrap();
    assert_eq!(file.unit, LengthUnit::Centimetre);
    assert_relative_eq!(file.mesh.signed_volume(), 8000.0 / 6.0, max_relative = 1e-12);
    assert!(matches!(
        read("unit='centimeter'", &one, MM),
        Err(MeshFileError::UnitConflict { .. })
    ));
    // Without a unit millimetres are meant, and 2 mm is too small.
    assert!(
        read("", &one, None)
            .unwrap_err()
            .to_string()
            .contains("should the file declare")
    );
    // An assembly of two, one mirrored and moved by 10, all turned by 90° about z: still outward.
    let assembly = "<object id='2'><components><component objectid='1'/>\
                    <component objectid='1' transform='-1 0 0 0 1 0 0 0 1 10 0 0'/></components></object>";
    let turned = build(
        "<item objectid='2' transform='0 1 0 -1 0 0 0 0 1 0 0 0'/>",
        assembly,
    );
    let mesh = read("unit='centimeter'", &turned, None).unwrap().mesh;
    assert_eq!(mesh.triangles.len(), 8);
    assert_relative_eq!(mesh.signed_volume(), 2.0 * 8000.0 / 6.0, max_relative = 1e-12);
    let (lo, hi) = mesh.bounds().unwrap();
    // x' = −y, y' = x: the pair lies between 0 and 100 mm along y, and −20 and 0 along x.
    assert_relative_eq!(lo, Vec3::new(-20.0, 0.0, 0.0), epsilon = 1e-9);
    assert_relative_eq!(hi, Vec3::new(0.0, 100.0, 20.0), epsilon = 1e-9);
    // A support is not a part of the thing.
    let support = "<object id='3' type='support'><components><component objectid='1'/></components></object>";
    let file = read(
        "unit='centimeter'",
        &build("<item objectid='1'/><item objectid='3'/>", support),
        None,
    )
    .unwrap();
    assert_eq!((file.mesh.triangles.len(), file.notes.len()), (4, 1));
}

#[test]
fn a_3mf_may_spread_over_parts() {
    let relationships = "<Relationships xmlns='http://schemas.openxmlformats.org/package/2006/relationships'>\
        <Relationship Target='/3D/plate.model' Id='r0' Type='http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel'/>\
        </Relationships>";
    let root = "<object id='9'><components><component objectid='1' p:path='/3D/Objects/part.model'/></components></object>\
        </resources><build><item objectid='9'/></build>";
    let part = model("unit='centimeter'", "</resources><build/>");
    let parts = [
        ("_rels/.rels", relationships),
        ("3D/plate.model", &model("unit='centimeter'", root)),
        ("3D/Objects/part.model", &part),
    ];
    let file = read_surface(&package(&parts), SurfaceFormat::ThreeMf, None).unwrap();
    assert_eq!(file.mesh.triangles.len(), 4);
    assert!(refusal(&package(&parts[..2]), SurfaceFormat::ThreeMf).contains("3D/Objects/part.model"));
}

#[test]
fn mistakes_in_3mf_files_are_named() {
    let read = |bytes: &[u8]| {
        read_surface(bytes, SurfaceFormat::ThreeMf, None)
            .unwrap_err()
            .to_string()
    };
    let good = model(
        "unit='centimeter'",
        "</resources><build><item objectid='1'/></build>",
    );
    let with = |text: String| read(&package(&[("3D/3dmodel.model", &text)]));
    let circle = "<object id='2'><components><component objectid='2'/></components></object></resources>\
                  <build><item objectid='2'/></build>";
    // Each level names the one below twice: two to the power of 31 placements.
    let doubling: String = (2..33)
        .map(|id| {
            let below = format!("<component objectid='{}'/>", id - 1);
            format!("<object id='{id}'><components>{below}{below}</components></object>")
        })
        .collect();
    let doubling = format!("{doubling}</resources><build><item objectid='32'/></build>");
    for (error, parts) in [
        (
            with(good.replace("v3='3'", "v3='7'")),
            ["object 1, triangle", "vertex 7"],
        ),
        (with(good.replace("x='2'", "x='nan'")), ["line", "NaN"]),
        (with(good.replace("x='2'", "")), ["line", "\"x\""]),
        (with(good.replace("centimeter", "parsec")), ["parsec", "line 2"]),
        (
            with(good.replace("<item objectid='1'/>", "<item objectid='5'/>")),
            ["no object 5", ""],
        ),
        (
            with(good.replace("<item objectid='1'/>", "")),
            ["no triangles", "build"],
        ),
        (
            with(good.replace("objectid='1'", "objectid='1' transform='1 2 3'")),
            ["transform", "12"],
        ),
        (with(good.replace("core/2015/02", "core/1999")), ["namespace", ""]),
        (
            with(model("unit='centimeter'", circle)),
            ["contains itself", "object 2"],
        ),
        (
            with(model("unit='centimeter'", &doubling)),
            ["placed objects", "1000000"],
        ),
        (read(b"no zip"), ["zip", ""]),
        (
            read(&package(&[("other.txt", "x")])),
            ["3D/3dmodel.model", "no such part"],
        ),
    ] {
        assert!(
            parts.iter().all(|part| error.contains(part)),
            "{parts:?} in {error}"
        );
    }
}

#[test]
fn the_reference_samples_of_3mf_are_read() {
    // Triangles of the whole build, counted in the files' XML with each object as often as it is placed.
    for (name, triangles) in [
        ("core_box.3mf", 12),
        ("core_cylinder.3mf", 88),
        ("core_torus.3mf", 2200),
        ("core_multiple_cylinders.3mf", 528),
        ("core_cube_gears.3mf", 25692),
        ("core_dodeca_chain_loop.3mf", 7680),
        ("material_multiprop-metallic.3mf", 12),
        ("material_multiprop-translucent.3mf", 12),
        ("material_rhombicuboctahedron_color.3mf", 44),
        ("production_box_prod.3mf", 12),
        ("slices_box_sliced.3mf", 12),
    ] {
        let Some(path) = shared(&format!("3mf/{name}")) else {
            continue;
        };
        let file = open_surface(&path, None).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(file.mesh.triangles.len(), triangles, "{name}");
        Solid::new(file.mesh).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}
