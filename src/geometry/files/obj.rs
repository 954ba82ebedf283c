//! Wavefront OBJ: vertices and faces. Materials, normals, texture coordinates, lines and groups are passed over; all groups
//! are one surface. A polygon becomes a fan of triangles, which for the winding number is right for concave polygons too.

use super::MeshFileError;
use super::read::RawSurface;
use super::stl::{coordinate, quoted};
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;
use std::io::{self, Write};

pub(super) fn read(bytes: &[u8]) -> Result<RawSurface, MeshFileError> {
    let text = String::from_utf8_lossy(bytes);
    let mut mesh = TriMesh::default();
    // A corner may name a vertex that stands further down, so ranges are checked at the end.
    let mut faces: Vec<(usize, Vec<(i64, String)>)> = Vec::new();
    let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut notes = Vec::new();
    let mut lines_passed = 0;
    while let Some((number, line)) = lines.next() {
        let number = number + 1;
        let mut line = line.trim_end().to_string();
        while line.ends_with('\\') {
            line.pop();
            match lines.next() {
                Some((_, rest)) => line.push_str(rest.trim_end()),
                None => {
                    return Err(MeshFileError::Truncated {
                        what: "it ends in a continued line".into(),
                    });
                }
            }
        }
        let line = line.split('#').next().unwrap_or("");
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => mesh.vertices.push(vertex(words, number)?),
            Some("f") => faces.push((number, face(words, number, mesh.vertices.len())?)),
            Some("l" | "p" | "curv" | "surf") => lines_passed += 1,
            _ => {}
        }
    }
    for (line, corners) in faces {
        let mut polygon = Vec::with_capacity(corners.len());
        for (index, word) in corners {
            match u32::try_from(index) {
                Ok(v) if (v as usize) < mesh.vertices.len() => polygon.push(v),
                _ => {
                    return Err(MeshFileError::IndexOutOfRange {
                        place: format!("line {line}"),
                        index: word,
                        count: mesh.vertices.len(),
                        from_one: true,
                    });
                }
            }
        }
        let fan = polygon
            .windows(2)
            .skip(1)
            .map(|pair| [polygon[0], pair[0], pair[1]]);
        mesh.triangles.extend(fan);
    }
    if lines_passed > 0 {
        notes.push(format!(
            "{lines_passed} lines, points or curves of the OBJ were passed over"
        ));
    }
    let if_empty = "an OBJ surface has lines that begin with \"v\" and \"f\"".into();
    Ok(RawSurface {
        mesh,
        unit: None,
        notes,
        if_empty,
    })
}

fn vertex<'a>(words: impl Iterator<Item = &'a str>, line: usize) -> Result<Vec3, MeshFileError> {
    // Behind x, y, z may stand a weight or a colour.
    let words: Vec<&str> = words.collect();
    let [x, y, z, ..] = words.as_slice() else {
        let found = quoted(&format!("v {}", words.join(" ")));
        return Err(MeshFileError::Syntax {
            line,
            found,
            expected: "three coordinates".into(),
        });
    };
    Ok(Vec3::new(
        coordinate(x, line)?,
        coordinate(y, line)?,
        coordinate(z, line)?,
    ))
}

/// The corners of a face: the index from 0, and the word for messages. Negative words count back from the last vertex.
fn face<'a>(
    words: impl Iterator<Item = &'a str>,
    line: usize,
    vertices: usize,
) -> Result<Vec<(i64, String)>, MeshFileError> {
    let mut corners = Vec::new();
    for word in words {
        let index: i64 = word
            .split('/')
            .next()
            .unwrap_or("")
            .parse()
            .map_err(|_| MeshFileError::Syntax {
                line,
                found: quoted(word),
                expected: "a vertex number such as 7, 7/1 or 7//3".into(),
            })?;
        // There is no vertex 0: it must not become the last one.
        let from_zero = if index < 0 {
            index.saturating_add(vertices as i64)
        } else {
            index - 1
        };
        corners.push((from_zero, word.to_string()));
    }
    if corners.len() < 3 {
        let found = format!("a face with {} corners", corners.len());
        return Err(MeshFileError::Syntax {
            line,
            found,
            expected: "three or more".into(),
        });
    }
    Ok(corners)
}

/// Writes a surface as OBJ, in millimetres, so that reading it gives back the same numbers.
///
/// # Errors
/// What the writer answers.
pub fn write_obj(mesh: &TriMesh, mut out: impl Write) -> io::Result<()> {
    writeln!(out, "# pliant, units: mm")?;
    for v in &mesh.vertices {
        writeln!(out, "v {} {} {}", v.x, v.y, v.z)?;
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(
            out,
            "f {} {} {}",
            u64::from(*a) + 1,
            u64::from(*b) + 1,
            u64::from(*c) + 1
        )?;
    }
    out.flush()
}
