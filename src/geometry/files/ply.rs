//! PLY, ASCII and binary: the elements `vertex` (x, y, z) and `face` (`vertex_indices` or `vertex_index`). Other elements
//! and properties are passed over.

use super::MeshFileError;
use super::read::RawSurface;
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Header, Property, PropertyAccess, PropertyAccessResult};

/// A row of the file: what it may have of a vertex and of a face.
#[derive(Default)]
struct Row {
    position: [Option<f64>; 3],
    corners: Option<Vec<i64>>,
}

impl PropertyAccess for Row {
    fn new() -> Row {
        Row::default()
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        match name {
            "x" => self.position[0] = number(&value),
            "y" => self.position[1] = number(&value),
            "z" => self.position[2] = number(&value),
            "vertex_indices" | "vertex_index" => self.corners = integers(value),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn number(value: &Property) -> Option<f64> {
    match value {
        Property::Char(x) => Some(f64::from(*x)),
        Property::UChar(x) => Some(f64::from(*x)),
        Property::Short(x) => Some(f64::from(*x)),
        Property::UShort(x) => Some(f64::from(*x)),
        Property::Int(x) => Some(f64::from(*x)),
        Property::UInt(x) => Some(f64::from(*x)),
        Property::Float(x) => Some(f64::from(*x)),
        Property::Double(x) => Some(*x),
        _ => None,
    }
}

fn integers(value: Property) -> Option<Vec<i64>> {
    match value {
        Property::ListChar(list) => Some(list.into_iter().map(i64::from).collect()),
        Property::ListUChar(list) => Some(list.into_iter().map(i64::from).collect()),
        Property::ListShort(list) => Some(list.into_iter().map(i64::from).collect()),
        Property::ListUShort(list) => Some(list.into_iter().map(i64::from).collect()),
        Property::ListInt(list) => Some(list.into_iter().map(i64::from).collect()),
        Property::ListUInt(list) => Some(list.into_iter().map(i64::from).collect()),
        _ => None,
    }
}

pub(super) fn read(bytes: &[u8]) -> Result<RawSurface, MeshFileError> {
    let parser = Parser::<Row>::new();
    let mut reader = Reader::new(bytes);
    let header = parser.read_header(&mut reader).map_err(|error| ply(&error))?;
    check(&header, bytes.len())?;
    let payload = parser
        .read_payload(&mut reader, &header)
        .map_err(|error| ply(&error))?;
    let rows = |name: &str| payload.get(name).map_or(&[][..], Vec::as_slice);
    let mut mesh = TriMesh::default();
    for (number, row) in rows("vertex").iter().enumerate() {
        let mut position = Vec3::zeros();
        for (k, x) in row.position.iter().enumerate() {
            match x {
                Some(x) if x.is_finite() => position[k] = *x,
                Some(x) => {
                    let place = format!("vertex {number}");
                    return Err(MeshFileError::NotFinite {
                        place,
                        value: x.to_string(),
                    });
                }
                None => {
                    let name = ["x", "y", "z"][k];
                    return Err(message(format!(
                        "the element \"vertex\" has no numeric property \"{name}\""
                    )));
                }
            }
        }
        mesh.vertices.push(position);
    }
    for (number, row) in rows("face").iter().enumerate() {
        let corners = row.corners.as_ref().ok_or_else(|| {
            message(
                "the element \"face\" has no list of integers \"vertex_indices\" or \"vertex_index\"".into(),
            )
        })?;
        fan(&mut mesh, corners, number)?;
    }
    let if_empty = "the element \"face\" is missing or empty; a point cloud must be meshed first".into();
    Ok(RawSurface {
        mesh,
        if_empty,
        ..RawSurface::default()
    })
}

/// The reader asks for as many rows as the header counts: each takes a byte at least, or the count is a lie.
fn check(header: &Header, bytes: usize) -> Result<(), MeshFileError> {
    for (name, element) in &header.elements {
        if element.count > bytes {
            let what = format!(
                "the header counts {} of \"{name}\" in {bytes} bytes",
                element.count
            );
            return Err(MeshFileError::Truncated { what });
        }
        if element.properties.is_empty() && element.count > 0 {
            return Err(message(format!("the element \"{name}\" has no properties")));
        }
    }
    Ok(())
}

fn fan(mesh: &mut TriMesh, corners: &[i64], face: usize) -> Result<(), MeshFileError> {
    let count = mesh.vertices.len();
    let mut polygon = Vec::with_capacity(corners.len());
    for &index in corners {
        match u32::try_from(index) {
            Ok(v) if (v as usize) < count => polygon.push(v),
            _ => {
                let place = format!("face {face}");
                return Err(MeshFileError::IndexOutOfRange {
                    place,
                    index: index.to_string(),
                    count,
                    from_one: false,
                });
            }
        }
    }
    if polygon.len() < 3 {
        return Err(message(format!(
            "face {face} has {} corners: expected three or more",
            polygon.len()
        )));
    }
    let triangles = polygon
        .windows(2)
        .skip(1)
        .map(|pair| [polygon[0], pair[0], pair[1]]);
    mesh.triangles.extend(triangles);
    Ok(())
}

fn message(message: String) -> MeshFileError {
    MeshFileError::Ply { message }
}

/// The crate's messages run over several lines; one is enough.
fn ply(error: &dyn std::fmt::Display) -> MeshFileError {
    let text = error.to_string();
    let words: Vec<&str> = text.split_whitespace().collect();
    message(format!(
        "no readable PLY: {}",
        words.join(" ").chars().take(200).collect::<String>()
    ))
}
