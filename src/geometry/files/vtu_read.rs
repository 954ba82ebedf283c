//! Reading VTU, VTK's XML file of an unstructured grid (VTK User's Guide, section 19.3; [`super::vtu`] writes it): arrays
//! as text, in base64 inside the XML, or appended after it raw or in base64; compressed with zlib or not; of any number
//! type and byte order. Several pieces are joined.
//!
//! ```text
//! not compressed:  n bytes                             n of `header_type`
//! compressed:      blocks size last c_1 … c_n bytes    see vtu.rs
//! ```
//!
//! An array of whole numbers at the cells gives groups `ARRAY=VALUE`, one at the points sets of nodes, where it has at
//! most 256 values: `material_id=2`.

use super::volume::{CellKind, RawCell, RawVolume, missing};
use super::volume_error::VolumeFileError;
use super::vtu_array::{Appended, ArrayText, Layout};
use crate::math::Vec3;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::BTreeMap;

/// More values than this are data, not labels of parts.
const MOST_LABELS: usize = 256;

/// The arrays of one piece, as written.
#[derive(Default)]
struct Piece {
    points: usize,
    cells: usize,
    /// The section (`Points`, `Cells`, `PointData`, `CellData`) and the array.
    arrays: Vec<(String, ArrayText)>,
}

pub(super) fn read(bytes: &[u8]) -> Result<RawVolume, VolumeFileError> {
    let appended = Appended::find(bytes)?;
    let (layout, pieces) = parse(&String::from_utf8_lossy(&bytes[..appended.start()]))?;
    let mut raw = RawVolume::default();
    let mut groups = Labels::default();
    let mut sets = Labels::default();
    for piece in &pieces {
        add_piece(&mut raw, piece, &layout, &appended, &mut groups, &mut sets)?;
    }
    raw.groups = groups.named();
    raw.node_sets = sets.named();
    Ok(raw)
}

/// The header and the pieces of the XML before the appended data.
fn parse(xml: &str) -> Result<(Layout, Vec<Piece>), VolumeFileError> {
    let mut reader = Reader::from_str(xml);
    // The end tags after appended data were cut off with it.
    reader.config_mut().check_end_names = false;
    let mut layout = None;
    let mut pieces: Vec<Piece> = Vec::new();
    let mut section = String::new();
    let mut open: Option<ArrayText> = None;
    let mut inner = 0;
    loop {
        let at = reader.buffer_position();
        let event = reader.read_event().map_err(|e| VolumeFileError::Syntax {
            place: line_of(xml, at),
            found: e.to_string(),
            expected: "XML".into(),
        })?;
        match event {
            Event::Start(tag) | Event::Empty(tag) if tag.name().as_ref() == "VTKFile" => {
                layout = Some(Layout::new(&attributes(&tag), &line_of(xml, at))?);
            }
            Event::Start(tag) if tag.name().as_ref() == "Piece" => {
                pieces.push(piece(&attributes(&tag), &line_of(xml, at))?);
            }
            Event::Start(tag) if tag.name().as_ref() == "DataArray" => {
                open = Some(ArrayText::new(&attributes(&tag), line_of(xml, at))?);
            }
            Event::Empty(tag) if tag.name().as_ref() == "DataArray" => {
                let array = ArrayText::new(&attributes(&tag), line_of(xml, at))?;
                keep(&mut pieces, &section, array);
            }
            // Arrays may hold tags of their own, which end no section.
            Event::Start(tag) if open.is_none() => section = tag.name().as_ref().to_string(),
            Event::Start(_) => inner += 1,
            Event::End(_) if inner > 0 => inner -= 1,
            Event::Text(text) if inner == 0 => {
                if let Some(array) = &mut open {
                    array.text.extend_from_slice(text.as_bytes());
                }
            }
            Event::End(tag) if tag.name().as_ref() == "DataArray" => {
                if let Some(array) = open.take() {
                    keep(&mut pieces, &section, array);
                }
            }
            Event::Eof => break,
            _ => {}
        }
    }
    let Some(layout) = layout else {
        return Err(VolumeFileError::Syntax {
            place: "the file".into(),
            found: "no <VTKFile>".into(),
            expected: "<VTKFile type=\"UnstructuredGrid\" …>".into(),
        });
    };
    Ok((layout, pieces))
}

fn keep(pieces: &mut [Piece], section: &str, array: ArrayText) {
    if let Some(piece) = pieces.last_mut() {
        piece.arrays.push((section.to_string(), array));
    }
}

fn line_of(xml: &str, at: u64) -> String {
    let before = xml.get(..at as usize).unwrap_or(xml);
    format!("line {}", 1 + before.matches('\n').count())
}

fn attributes(tag: &BytesStart) -> BTreeMap<String, String> {
    let pair = |a: quick_xml::events::attributes::Attribute| {
        let plain = quick_xml::escape::unescape(&a.value).map(|t| t.into_owned());
        (a.key.as_ref().to_string(), plain.unwrap_or(a.value.into_owned()))
    };
    tag.attributes().flatten().map(pair).collect()
}

fn piece(attributes: &BTreeMap<String, String>, place: &str) -> Result<Piece, VolumeFileError> {
    let count = |name: &str| {
        let found = attributes.get(name).map_or("", String::as_str);
        found.parse().map_err(|_| VolumeFileError::Syntax {
            place: place.into(),
            found: format!("{name}={found:?}"),
            expected: "a whole number".into(),
        })
    };
    Ok(Piece {
        points: count("NumberOfPoints")?,
        cells: count("NumberOfCells")?,
        arrays: Vec::new(),
    })
}

impl Piece {
    fn array(&self, section: &str, name: Option<&str>) -> Option<&ArrayText> {
        let fits = |(s, a): &&(String, ArrayText)| s == section && name.is_none_or(|n| a.name == n);
        self.arrays.iter().find(fits).map(|(_, a)| a)
    }

    /// The numbers of an array that every piece has, of which there must be `count` if that is known.
    fn numbers(
        &self,
        section: &str,
        name: Option<&str>,
        count: Option<usize>,
        layout: &Layout,
        appended: &Appended,
    ) -> Result<Vec<f64>, VolumeFileError> {
        let shown = name.unwrap_or(section);
        let Some(array) = self.array(section, name) else {
            return Err(VolumeFileError::Syntax {
                place: format!("<{section}>"),
                found: format!("no array {shown:?}"),
                expected: "one in each piece".into(),
            });
        };
        let numbers = array.numbers(layout, appended)?;
        match count {
            Some(count) if count != numbers.len() => Err(VolumeFileError::Syntax {
                place: array.place.clone(),
                found: format!("{} numbers in {shown:?}", numbers.len()),
                expected: format!("{count}"),
            }),
            _ => Ok(numbers),
        }
    }
}

fn add_piece(
    raw: &mut RawVolume,
    piece: &Piece,
    layout: &Layout,
    appended: &Appended,
    groups: &mut Labels,
    sets: &mut Labels,
) -> Result<(), VolumeFileError> {
    if piece.cells == 0 && piece.points == 0 {
        return Ok(());
    }
    let (first_node, first_cell) = (raw.nodes.len(), raw.cells.len());
    let coordinates = piece.numbers("Points", None, Some(3 * piece.points), layout, appended)?;
    for (i, x) in coordinates.chunks_exact(3).enumerate() {
        if x.iter().any(|c| !c.is_finite()) {
            return Err(VolumeFileError::NotFinite {
                place: format!("point {}", first_node + i),
                value: format!("{x:?}"),
            });
        }
        raw.node_numbers.push(raw.nodes.len() as u64);
        raw.nodes.push(Vec3::new(x[0], x[1], x[2]));
    }
    let nodes = piece.numbers("Cells", Some("connectivity"), None, layout, appended)?;
    let ends = piece.numbers("Cells", Some("offsets"), Some(piece.cells), layout, appended)?;
    let types = piece.numbers("Cells", Some("types"), Some(piece.cells), layout, appended)?;
    let mut start = 0;
    for (i, (end, cell_type)) in ends.iter().zip(&types).enumerate() {
        let end = *end as usize;
        let number = raw.cells.len() as u64;
        let Some(own) = nodes.get(start..end) else {
            return Err(VolumeFileError::Syntax {
                place: format!("array \"offsets\", cell {i}"),
                found: format!("{start} to {end}"),
                expected: format!("a range within the {} numbers of \"connectivity\"", nodes.len()),
            });
        };
        start = end;
        add_cell(raw, own, *cell_type as u8, number, first_node)?;
    }
    for (section, array) in &piece.arrays {
        match section.as_str() {
            "CellData" if array.components == 1 => {
                groups.add(array, first_cell, piece.cells, layout, appended)?;
            }
            "PointData" if array.components == 1 => {
                sets.add(array, first_node, piece.points, layout, appended)?;
            }
            _ => {}
        }
    }
    Ok(())
}

/// The kind of cell that VTK's cell type stands for, and how many nodes it has if that is fixed.
fn kind_of(cell_type: u8) -> Option<(CellKind, Option<usize>)> {
    use CellKind::{Hexahedron, Line, Point, Prism, Pyramid, Quadrilateral, Tetrahedron, Triangle};
    Some(match cell_type {
        1 => (Point, Some(1)),
        3 => (Line, Some(2)),
        21 => (Line, Some(3)),
        5 => (Triangle, Some(3)),
        22 => (Triangle, Some(6)),
        69 => (Triangle, None),
        9 | 8 => (Quadrilateral, Some(4)),
        23 => (Quadrilateral, Some(8)),
        28 => (Quadrilateral, Some(9)),
        70 => (Quadrilateral, None),
        10 => (Tetrahedron, Some(4)),
        24 => (Tetrahedron, Some(10)),
        71 => (Tetrahedron, None),
        12 | 11 => (Hexahedron, Some(8)),
        25 => (Hexahedron, Some(20)),
        29 => (Hexahedron, Some(27)),
        72 => (Hexahedron, None),
        13 => (Prism, Some(6)),
        26 => (Prism, Some(15)),
        14 => (Pyramid, Some(5)),
        27 => (Pyramid, Some(13)),
        _ => return None,
    })
}

fn add_cell(
    raw: &mut RawVolume,
    own: &[f64],
    cell_type: u8,
    number: u64,
    first_node: usize,
) -> Result<(), VolumeFileError> {
    let place = || format!("cell {number}");
    let Some((kind, count)) = kind_of(cell_type) else {
        return Err(VolumeFileError::Unsupported {
            place: place(),
            what: format!("VTK's cell type {cell_type}"),
            mend: "save tetrahedra (10) or hexahedra (12)".into(),
        });
    };
    if own.len() < kind.corners() || count.is_some_and(|c| c != own.len()) {
        return Err(VolumeFileError::Syntax {
            place: place(),
            found: format!("{} nodes", own.len()),
            expected: format!("{} for type {cell_type}", count.unwrap_or(kind.corners())),
        });
    }
    let mut corners = [0; 8];
    for (k, &node) in own.iter().enumerate() {
        let index = node + first_node as f64;
        // Written so that NaN fails.
        if !(node >= 0.0 && index < raw.nodes.len() as f64) {
            return Err(missing(place(), number, node, &raw.node_numbers[first_node..]));
        }
        if k < kind.corners() {
            corners[k] = index as u32;
        } else {
            raw.middles.insert(index as u32);
        }
    }
    // A voxel and a pixel list their corners row by row.
    if matches!(cell_type, 8 | 11) {
        corners.swap(2, 3);
        if cell_type == 11 {
            corners.swap(6, 7);
        }
    }
    raw.curved += usize::from(own.len() > kind.corners() && kind.dimension() == 3);
    raw.cells.push(RawCell {
        kind,
        corners,
        number,
    });
    Ok(())
}

/// Cells or points by a value.
type ByValue = BTreeMap<i64, Vec<u32>>;

/// Cells or points by the values of arrays.
#[derive(Default)]
struct Labels {
    /// By array, then by value; `None` where an array turned out to be data.
    arrays: Vec<(String, Option<ByValue>)>,
}

impl Labels {
    fn add(
        &mut self,
        array: &ArrayText,
        first: usize,
        count: usize,
        layout: &Layout,
        appended: &Appended,
    ) -> Result<(), VolumeFileError> {
        let index = match self.arrays.iter().position(|(n, _)| *n == array.name) {
            Some(index) => index,
            None => {
                self.arrays.push((array.name.clone(), Some(ByValue::new())));
                self.arrays.len() - 1
            }
        };
        let values = if array.is_number() {
            array.numbers(layout, appended)?
        } else {
            Vec::new()
        };
        let own = &mut self.arrays[index].1;
        if values.len() != count {
            *own = None;
        }
        for (i, value) in values.iter().enumerate() {
            let Some(map) = own else { break };
            if value.fract() != 0.0 || value.abs() > 1e15 {
                *own = None;
                break;
            }
            map.entry(*value as i64).or_default().push((first + i) as u32);
            if map.len() > MOST_LABELS {
                *own = None;
            }
        }
        Ok(())
    }

    fn named(self) -> Vec<(String, Vec<u32>)> {
        let mut all = Vec::new();
        for (name, map) in self.arrays {
            let own = map.unwrap_or_default().into_iter();
            all.extend(own.map(|(value, members)| (format!("{name}={value}"), members)));
        }
        all
    }
}
