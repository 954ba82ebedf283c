//! STL, binary and ASCII. An STL has no unit, no shared vertices and normals that are often wrong: vertices at equal
//! positions are joined, and normals are ignored, since the order of the corners says the same.
//!
//! A file is binary if its length is what the count in its header needs, 84 + 50 n bytes: the word `solid`, with which an
//! ASCII file begins, stands in many binary headers too. Several solids in one ASCII file are one surface.

use super::MeshFileError;
use super::read::RawSurface;
use crate::geometry::surface::{TriMesh, area_vector};
use crate::geometry::weld::weld;
use crate::math::Vec3;
use std::io::{self, Write};

const HEADER: usize = 84;
const RECORD: usize = 50;

pub(super) fn read(bytes: &[u8]) -> Result<RawSurface, MeshFileError> {
    let corners = if is_binary(bytes)? {
        read_binary(bytes)?
    } else {
        read_ascii(bytes)?
    };
    let triangles = (0..corners.len() / 3)
        .map(|t| [0, 1, 2].map(|k| (3 * t + k) as u32))
        .collect();
    let mesh = weld(
        &TriMesh {
            vertices: corners,
            triangles,
        },
        0.0,
    );
    Ok(RawSurface {
        mesh,
        ..RawSurface::default()
    })
}

/// Whether the file is binary.
///
/// # Errors
/// If it is neither: a binary header over the wrong number of bytes, or nothing of either kind.
fn is_binary(bytes: &[u8]) -> Result<bool, MeshFileError> {
    if bytes.is_empty() {
        return Err(MeshFileError::Empty {
            hint: "it is empty".into(),
        });
    }
    let declared = bytes
        .get(80..84)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let expected = |count: u32| HEADER as u64 + RECORD as u64 * u64::from(count);
    if declared.is_some_and(|count| bytes.len() as u64 == expected(count)) {
        return Ok(true);
    }
    // Text begins with "solid", and the 80 bytes of a binary header are followed by bytes that no text has.
    let start = bytes.trim_ascii_start();
    let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
    let says_solid = start
        .get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let text = bytes
        .iter()
        .take(1000)
        .all(|&b| b >= 0x20 || b.is_ascii_whitespace());
    if says_solid && text {
        return Ok(false);
    }
    match declared {
        Some(declared) if !text => Err(MeshFileError::StlCount {
            declared,
            expected_bytes: expected(declared),
            bytes: bytes.len() as u64,
            room: ((bytes.len() - HEADER) / RECORD) as u64,
        }),
        _ if !text => Err(MeshFileError::Truncated {
            what: format!(
                "{} bytes are less than the header of a binary STL (84 bytes)",
                bytes.len()
            ),
        }),
        _ => Err(MeshFileError::Syntax {
            line: 1,
            found: quoted(String::from_utf8_lossy(start).lines().next().unwrap_or("")),
            expected: "\"solid\", with which an ASCII STL begins".into(),
        }),
    }
}

fn read_binary(bytes: &[u8]) -> Result<Vec<Vec3>, MeshFileError> {
    let records = bytes[HEADER..].chunks_exact(RECORD);
    let mut corners = Vec::with_capacity(3 * records.len());
    for (number, record) in records.enumerate() {
        // 12 bytes of normal, three corners of 12 bytes, two bytes that mean nothing.
        for corner in record[12..48].chunks_exact(12) {
            let x = [0, 4, 8]
                .map(|k| f32::from_le_bytes([corner[k], corner[k + 1], corner[k + 2], corner[k + 3]]));
            if let Some(bad) = x.iter().find(|x| !x.is_finite()) {
                let place = format!("triangle {}", number + 1);
                return Err(MeshFileError::NotFinite {
                    place,
                    value: bad.to_string(),
                });
            }
            corners.push(Vec3::from(x.map(f64::from)));
        }
    }
    Ok(corners)
}

/// Where a line of an ASCII STL may stand.
#[derive(Clone, Copy, PartialEq)]
enum State {
    /// Before, between or after solids.
    Outside,
    Solid,
    Facet,
    /// Inside the loop, with so many vertices read.
    Loop(usize),
    /// After the loop.
    Closed,
}

fn read_ascii(bytes: &[u8]) -> Result<Vec<Vec3>, MeshFileError> {
    let text = String::from_utf8_lossy(bytes);
    let mut corners = Vec::new();
    let mut state = State::Outside;
    let mut last = 0;
    for (number, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let number = number + 1;
        let mut words = line.split_whitespace();
        let Some(first) = words.next() else { continue };
        last = number;
        state = match (state, first.to_ascii_lowercase().as_str()) {
            (State::Outside, "solid") => State::Solid,
            (State::Solid, "endsolid") => State::Outside,
            // Some exporters write "end solid", and so on.
            (State::Solid, "facet") => State::Facet,
            (State::Facet, "outer") => State::Loop(0),
            (State::Loop(count @ 0..3), "vertex") => {
                corners.push(vertex(words, number)?);
                State::Loop(count + 1)
            }
            (State::Loop(3), "endloop") => State::Closed,
            (State::Closed, "endfacet") => State::Solid,
            (state, _) => {
                let expected = match state {
                    State::Outside => "\"solid\"",
                    State::Solid => "\"facet\" or \"endsolid\"",
                    State::Facet => "\"outer loop\"",
                    State::Loop(0..3) => "\"vertex\" and three numbers (a facet has three vertices)",
                    State::Loop(_) => "\"endloop\" (a facet has three vertices)",
                    State::Closed => "\"endfacet\"",
                };
                return Err(MeshFileError::Syntax {
                    line: number,
                    found: quoted(line),
                    expected: expected.into(),
                });
            }
        };
    }
    match state {
        State::Outside => Ok(corners),
        _ => Err(MeshFileError::Truncated {
            what: format!("it ends after line {last}, without \"endsolid\""),
        }),
    }
}

fn vertex<'a>(words: impl Iterator<Item = &'a str>, line: usize) -> Result<Vec3, MeshFileError> {
    let words: Vec<&str> = words.collect();
    let [x, y, z] = words.as_slice() else {
        let found = quoted(&words.join(" "));
        return Err(MeshFileError::Syntax {
            line,
            found,
            expected: "three coordinates".into(),
        });
    };
    let mut point = Vec3::zeros();
    for (k, word) in [x, y, z].into_iter().enumerate() {
        point[k] = coordinate(word, line)?;
    }
    Ok(point)
}

/// A finite coordinate from a word of a text file.
pub(super) fn coordinate(word: &str, line: usize) -> Result<f64, MeshFileError> {
    match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        Ok(_) => Err(MeshFileError::NotFinite {
            place: format!("line {line}"),
            value: word.into(),
        }),
        Err(_) => Err(MeshFileError::Syntax {
            line,
            found: quoted(word),
            expected: "a number".into(),
        }),
    }
}

/// Found text in quotes, cut to a readable length.
pub(super) fn quoted(text: &str) -> String {
    let short: String = text.trim().chars().take(40).collect();
    if short.len() < text.trim().len() {
        format!("\"{short}…\"")
    } else {
        format!("\"{short}\"")
    }
}

/// Writes a surface as binary STL, in millimetres and single precision.
///
/// # Errors
/// As [`write_titled_stl`].
pub fn write_stl(mesh: &TriMesh, out: impl Write) -> io::Result<()> {
    write_titled_stl(mesh, "", out)
}

/// Writes a surface as binary STL whose header bears `title`, cut to what fits.
///
/// Corners are rounded to single precision first and normals follow from the rounded ones; a triangle without area gets
/// the zero normal, which readers take as "work it out".
///
/// # Errors
/// What the writer answers, and [`io::ErrorKind::InvalidInput`] for more triangles than the format can count or a vertex
/// that is missing or not finite.
pub fn write_titled_stl(mesh: &TriMesh, title: &str, mut out: impl Write) -> io::Result<()> {
    let invalid = |what: String| io::Error::new(io::ErrorKind::InvalidInput, what);
    let triangles = mesh.triangles.len();
    let count = u32::try_from(triangles)
        .map_err(|_| invalid(format!("{triangles} triangles are more than an STL can count")))?;
    out.write_all(&header(title))?;
    out.write_all(&count.to_le_bytes())?;
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        let corner = |v: u32| {
            let point = mesh.vertices.get(v as usize).map(single);
            point.filter(|p| p.iter().all(|x| x.is_finite())).ok_or_else(|| {
                invalid(format!(
                    "triangle {number} names vertex {v}, missing or not finite"
                ))
            })
        };
        let corners = [corner(triangle[0])?, corner(triangle[1])?, corner(triangle[2])?];
        let normal = area_vector(&corners).try_normalize(0.0).unwrap_or_default();
        for x in [normal].iter().chain(&corners).flat_map(|vector| vector.iter()) {
            out.write_all(&(*x as f32).to_le_bytes())?;
        }
        out.write_all(&[0, 0])?;
    }
    out.flush()
}

/// A point as single precision holds it, `-0` as `0`: what welds in one file then welds in all.
pub fn single(p: &Vec3) -> Vec3 {
    p.map(|x| f64::from(x as f32) + 0.0)
}

/// Eighty bytes that name the unit. They don't begin with "solid": readers that look at the first word alone would take
/// the file for ASCII.
fn header(title: &str) -> [u8; 80] {
    let text = match title {
        "" => "pliant, binary STL, units: mm".to_string(),
        title => format!("pliant, binary STL, units: mm; {title}"),
    };
    let mut header = [b' '; 80];
    for (place, byte) in header.iter_mut().zip(text.bytes().filter(u8::is_ascii)) {
        *place = byte;
    }
    header
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_one_triangle() {
        let mesh = TriMesh {
            vertices: vec![
                Vec3::new(-0.0, 0.0, 0.5),
                Vec3::new(2.0, 0.0, 0.5),
                Vec3::new(0.0, 3.0, 0.5),
            ],
            triangles: vec![[0, 1, 2]],
        };
        let mut bytes = Vec::new();
        write_titled_stl(&mesh, "wedge", &mut bytes).unwrap();
        assert_eq!(bytes.len(), 84 + 50);
        assert_eq!(&bytes[..37], b"pliant, binary STL, units: mm; wedge ");
        assert_eq!(&bytes[80..84], [1, 0, 0, 0]);
        let numbers: Vec<f32> = bytes[84..132]
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        assert_eq!(
            numbers,
            [0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 2.0, 0.0, 0.5, 0.0, 3.0, 0.5]
        );
        // -0 became 0: the byte of its sign is clear.
        assert_eq!(bytes[84 + 12 + 3], 0);
    }

    #[test]
    fn a_missing_vertex_is_an_error() {
        let mesh = TriMesh {
            vertices: vec![Vec3::zeros(); 2],
            triangles: vec![[0, 1, 2]],
        };
        assert!(write_stl(&mesh, Vec::new()).is_err());
    }
}
