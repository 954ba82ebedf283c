//! 3MF, the core specification (3MF Consortium, version 1.3): a zip archive of a model in XML, what its parts are,
//! and which of them to start from. One object per material; each points into one group of base materials, which
//! carries the materials' names and display colours in sRGB and stands before the objects, as strict readers demand.

use crate::geometry::surface::TriMesh;
use std::io::{self, BufWriter, Seek, Write};
use thiserror::Error;
use zip::write::SimpleFileOptions;

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;
const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"#;
/// The group of base materials; objects follow with 2, 3, …
const MATERIALS_ID: usize = 1;
/// The names that the core specification gives to metadata; others would need a namespace.
const METADATA: [&str; 9] = [
    "Title",
    "Designer",
    "Description",
    "Copyright",
    "LicenseTerms",
    "Rating",
    "CreationDate",
    "ModificationDate",
    "Application",
];

/// One object of the file.
#[derive(Clone, Copy, Debug)]
pub struct ThreemfPart<'a> {
    /// Name of the material, and of the object.
    pub name: &'a str,
    /// Display colour, sRGB red, green, blue.
    pub colour: [u8; 3],
    /// A closed mesh \[mm\]; written in single precision.
    pub mesh: &'a TriMesh,
}

/// Why a 3MF file could not be written.
#[derive(Debug, Error)]
pub enum ThreemfError {
    /// Nothing to print.
    #[error("a 3MF file needs at least one part with at least one triangle; `{0}` has none")]
    Empty(String),
    /// A mesh that no reader would take.
    #[error(
        "part `{part}`, triangle {triangle} ({vertices:?}): its vertices must exist, be finite and differ"
    )]
    Triangle {
        /// The part's name.
        part: String,
        /// The triangle's place in the mesh.
        triangle: usize,
        /// The vertices that it names.
        vertices: [u32; 3],
    },
    /// A metadata name outside the core specification.
    #[error("`{0}` is not a metadata name of the 3MF core specification; use one of {METADATA:?}")]
    Metadata(String),
    /// The writer below failed.
    #[error("cannot write the 3MF file: {0}")]
    Io(#[from] io::Error),
}

/// Writes the parts as one 3MF file. The same parts and metadata make the same bytes.
///
/// `metadata` are pairs of a core specification's name (`Title`, `Designer`, `Description`, …) and a text;
/// `Application` is added where it is missing.
///
/// # Errors
/// No parts or an empty one, a triangle that no reader would take, an unknown metadata name, and those of `out`.
pub fn write_threemf(
    out: impl Write + Seek,
    parts: &[ThreemfPart],
    metadata: &[(&str, &str)],
) -> Result<(), ThreemfError> {
    check(parts, metadata)?;
    // The time of writing would make two equal exports differ.
    let options = SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default())
        .unix_permissions(0o644);
    let mut archive = zip::ZipWriter::new(out);
    for (name, text) in [
        ("[Content_Types].xml", CONTENT_TYPES),
        ("_rels/.rels", RELATIONSHIPS),
    ] {
        archive.start_file(name, options).map_err(io::Error::from)?;
        archive.write_all(text.as_bytes())?;
    }
    archive
        .start_file("3D/3dmodel.model", options)
        .map_err(io::Error::from)?;
    let mut buffer = BufWriter::with_capacity(1 << 16, &mut archive);
    model(&mut buffer, parts, metadata)?;
    buffer.flush()?;
    drop(buffer);
    archive.finish().map_err(io::Error::from)?.flush()?;
    Ok(())
}

fn check(parts: &[ThreemfPart], metadata: &[(&str, &str)]) -> Result<(), ThreemfError> {
    if parts.is_empty() {
        return Err(ThreemfError::Empty("(no part)".into()));
    }
    for part in parts {
        if part.mesh.triangles.is_empty() {
            return Err(ThreemfError::Empty(part.name.into()));
        }
        let usable = |v: u32| {
            part.mesh
                .vertices
                .get(v as usize)
                .is_some_and(|p| p.iter().all(|c| (*c as f32).is_finite()))
        };
        for (triangle, &vertices) in part.mesh.triangles.iter().enumerate() {
            let [a, b, c] = vertices;
            if a == b || b == c || c == a || ![a, b, c].into_iter().all(usable) {
                return Err(ThreemfError::Triangle {
                    part: part.name.into(),
                    triangle,
                    vertices,
                });
            }
        }
    }
    match metadata.iter().find(|(name, _)| !METADATA.contains(name)) {
        Some((name, _)) => Err(ThreemfError::Metadata((*name).into())),
        None => Ok(()),
    }
}

fn model(out: &mut dyn Write, parts: &[ThreemfPart], metadata: &[(&str, &str)]) -> io::Result<()> {
    writeln!(out, r#"<?xml version="1.0" encoding="UTF-8"?>"#)?;
    let namespace = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
    writeln!(
        out,
        r#"<model unit="millimeter" xml:lang="en-US" xmlns="{namespace}">"#
    )?;
    for (name, text) in metadata {
        writeln!(out, r#"<metadata name="{name}">{}</metadata>"#, escaped(text))?;
    }
    if !metadata.iter().any(|(name, _)| *name == "Application") {
        writeln!(
            out,
            r#"<metadata name="Application">pliant {}</metadata>"#,
            env!("CARGO_PKG_VERSION")
        )?;
    }
    writeln!(out, "<resources>\n<basematerials id=\"{MATERIALS_ID}\">")?;
    for part in parts {
        let [r, g, b] = part.colour;
        let name = escaped(part.name);
        writeln!(
            out,
            r##"<base name="{name}" displaycolor="#{r:02X}{g:02X}{b:02X}"/>"##
        )?;
    }
    writeln!(out, "</basematerials>")?;
    for (i, part) in parts.iter().enumerate() {
        object(out, i, part)?;
    }
    writeln!(out, "</resources>\n<build>")?;
    for i in 0..parts.len() {
        writeln!(out, r#"<item objectid="{}"/>"#, object_id(i))?;
    }
    writeln!(out, "</build>\n</model>")
}

fn object_id(part: usize) -> usize {
    MATERIALS_ID + 1 + part
}

fn object(out: &mut dyn Write, i: usize, part: &ThreemfPart) -> io::Result<()> {
    let (id, name) = (object_id(i), escaped(part.name));
    writeln!(
        out,
        r#"<object id="{id}" type="model" name="{name}" pid="{MATERIALS_ID}" pindex="{i}">"#
    )?;
    writeln!(out, "<mesh>\n<vertices>")?;
    for p in &part.mesh.vertices {
        let [x, y, z] = [p.x, p.y, p.z].map(|c| c as f32 + 0.0);
        writeln!(out, r#"<vertex x="{x}" y="{y}" z="{z}"/>"#)?;
    }
    writeln!(out, "</vertices>\n<triangles>")?;
    for [a, b, c] in &part.mesh.triangles {
        writeln!(out, r#"<triangle v1="{a}" v2="{b}" v3="{c}"/>"#)?;
    }
    writeln!(out, "</triangles>\n</mesh>\n</object>")
}

/// Text as XML may carry it; characters that XML forbids become the replacement character.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => out.push(' '),
            '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use std::io::{Cursor, Read};

    fn tetrahedron() -> TriMesh {
        TriMesh {
            vertices: vec![
                Vec3::zeros(),
                Vec3::x(),
                Vec3::y() * 1e-3,
                Vec3::new(0.0, 0.0, -2.5),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        }
    }

    #[test]
    fn materials_come_before_the_objects_that_use_them() {
        let mesh = tetrahedron();
        let part = ThreemfPart {
            name: "soft & <\u{7}>",
            colour: [1, 171, 255],
            mesh: &mesh,
        };
        let mut bytes = Cursor::new(Vec::new());
        write_threemf(&mut bytes, &[part, part], &[("Title", "a \"b\"")]).expect("memory");
        let mut archive = zip::ZipArchive::new(bytes).expect("zip");
        let mut text = String::new();
        archive
            .by_name("3D/3dmodel.model")
            .expect("model")
            .read_to_string(&mut text)
            .expect("text");
        let base = text
            .find(r##"<base name="soft &amp; &lt;�&gt;" displaycolor="#01ABFF"/>"##)
            .expect("base");
        let object = text.find(r#"<object id="2" type="model""#).expect("object");
        assert!(base < object);
        assert!(
            text.contains(r#"<object id="3" type="model" name="soft &amp; &lt;�&gt;" pid="1" pindex="1">"#)
        );
        assert!(text.contains(r#"<vertex x="0" y="0.001" z="0"/>"#));
        assert!(text.contains(r#"<metadata name="Title">a &quot;b&quot;</metadata>"#));
    }

    #[test]
    fn what_no_reader_would_take_is_refused() {
        let mut mesh = tetrahedron();
        let write = |mesh: &TriMesh, metadata: &[(&str, &str)]| {
            let part = ThreemfPart {
                name: "a",
                colour: [0; 3],
                mesh,
            };
            write_threemf(Cursor::new(Vec::new()), &[part], metadata)
        };
        assert!(matches!(
            write(&TriMesh::default(), &[]),
            Err(ThreemfError::Empty(_))
        ));
        assert!(matches!(
            write(&mesh, &[("Mood", "good")]),
            Err(ThreemfError::Metadata(_))
        ));
        mesh.triangles[1] = [0, 2, 2];
        assert!(matches!(
            write(&mesh, &[]),
            Err(ThreemfError::Triangle { triangle: 1, .. })
        ));
        mesh.triangles[1] = [0, 2, 3];
        mesh.vertices[3].z = 1e300;
        assert!(matches!(
            write(&mesh, &[]),
            Err(ThreemfError::Triangle { triangle: 1, .. })
        ));
    }
}
