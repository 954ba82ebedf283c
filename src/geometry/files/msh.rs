//! Gmsh's MSH, versions 4.1 and 2.2, as text or binary (Gmsh reference manual, "MSH file format"): nodes, elements, and
//! physical groups with their names. Partitions, periodicity and post-processing data are passed over; parametric
//! coordinates too.
//!
//! A physical group of volumes becomes a group of elements; one of surfaces, curves or points a set of nodes. A file
//! without physical groups gives each of its entities a name: `volume 1`, `surface 5`.

use super::numbers::{Encoding, Numbers};
use super::volume::{CellKind, RawCell, RawVolume, missing};
use super::volume_error::VolumeFileError;
use crate::math::Vec3;
use std::collections::{BTreeMap, HashMap};

/// Names of the dimensions of entities.
const ENTITIES: [&str; 4] = ["point", "curve", "surface", "volume"];

/// A dimension with a number: of a physical group, or of an entity.
type Tag = (u8, i64);

#[derive(Default)]
struct Reader {
    raw: RawVolume,
    names: BTreeMap<Tag, String>,
    /// The physical groups of each entity.
    physical_of: BTreeMap<Tag, Vec<i64>>,
    index_of: HashMap<u64, u32>,
    /// Cells of each physical group, and of each entity.
    physical: BTreeMap<Tag, Vec<u32>>,
    entities: BTreeMap<Tag, Vec<u32>>,
}

pub(super) fn read(bytes: &[u8]) -> Result<RawVolume, VolumeFileError> {
    let mut from = Numbers::new(bytes);
    let four = read_format(&mut from)?;
    let encoding = from.encoding;
    let mut reader = Reader::default();
    loop {
        from.encoding = Encoding::Text;
        let Some(line) = from.line() else { break };
        let Some(section) = line.strip_prefix('$') else {
            return Err(VolumeFileError::Syntax {
                place: from.place_of_line(),
                found: format!("{line:?}"),
                expected: "a section, such as $Nodes".into(),
            });
        };
        if section != "PhysicalNames" {
            from.encoding = encoding;
        }
        match (section, four) {
            ("PhysicalNames", _) => reader.physical_names(&mut from)?,
            ("Entities", true) => reader.entities(&mut from)?,
            ("PartitionedEntities", true) => {
                return Err(VolumeFileError::Unsupported {
                    place: from.place_of_line(),
                    what: "a mesh cut into partitions".into(),
                    mend: "save it without them (Gmsh: Mesh > Unpartition)".into(),
                });
            }
            ("Nodes", true) => reader.nodes_4(&mut from)?,
            ("Nodes", false) => reader.nodes_2(&mut from)?,
            ("Elements", true) => reader.elements_4(&mut from)?,
            ("Elements", false) => reader.elements_2(&mut from)?,
            _ => {}
        }
        from.skip_to(&format!("$End{section}"))?;
    }
    Ok(reader.finished())
}

/// Reads `$MeshFormat`; is the version 4?
fn read_format(from: &mut Numbers) -> Result<bool, VolumeFileError> {
    let first = from.line().unwrap_or("");
    if first.trim_start_matches('\u{feff}') != "$MeshFormat" {
        return Err(VolumeFileError::Syntax {
            place: "line 1".into(),
            found: format!("{:?}", first.chars().take(40).collect::<String>()),
            expected: "$MeshFormat, with which an MSH file of version 2 or 4 begins".into(),
        });
    }
    let line = from.line().unwrap_or("");
    let words: Vec<&str> = line.split_whitespace().collect();
    let wrong = |what: String| VolumeFileError::Unsupported {
        place: "line 2".into(),
        what,
        mend: "save it as MSH 4.1 or 2.2 (Gmsh: File > Export, or -format msh41)".into(),
    };
    let &[version, kind, size] = words.as_slice() else {
        return Err(wrong(format!("the header {line:?}")));
    };
    let four = match version {
        "4.1" => true,
        "2" | "2.0" | "2.1" | "2.2" => false,
        _ => return Err(wrong(format!("version {version}"))),
    };
    if kind == "1" {
        from.size_bytes = match (four, size) {
            (true, "8") => 8,
            (true, "4") | (false, _) => 4,
            _ => return Err(wrong(format!("a size of {size} bytes"))),
        };
        from.encoding = Encoding::LittleEndian;
        let one = from.int("the byte order")?;
        if one == i64::from(1_i32.swap_bytes()) {
            from.encoding = Encoding::BigEndian;
        } else if one != 1 {
            return Err(wrong(format!("a byte order of {one:#x}")));
        }
    } else if kind != "0" {
        return Err(wrong(format!("file type {kind}")));
    }
    let encoding = from.encoding;
    from.skip_to("$EndMeshFormat")?;
    from.encoding = encoding;
    Ok(four)
}

/// The kind of cell that Gmsh's element type stands for, how many nodes it has, and whether it is curved.
fn kind_of(element_type: i64) -> Option<(CellKind, usize, bool)> {
    use CellKind::{Hexahedron, Line, Point, Prism, Pyramid, Quadrilateral, Tetrahedron, Triangle};
    let (kind, nodes) = match element_type {
        15 => (Point, 1),
        1 => (Line, 2),
        8 => (Line, 3),
        26 => (Line, 4),
        27 => (Line, 5),
        2 => (Triangle, 3),
        9 => (Triangle, 6),
        20 => (Triangle, 9),
        21 => (Triangle, 10),
        23 => (Triangle, 15),
        3 => (Quadrilateral, 4),
        10 => (Quadrilateral, 9),
        16 => (Quadrilateral, 8),
        36 => (Quadrilateral, 16),
        4 => (Tetrahedron, 4),
        11 => (Tetrahedron, 10),
        29 => (Tetrahedron, 20),
        30 => (Tetrahedron, 35),
        5 => (Hexahedron, 8),
        12 => (Hexahedron, 27),
        17 => (Hexahedron, 20),
        92 => (Hexahedron, 64),
        6 => (Prism, 6),
        13 => (Prism, 18),
        18 => (Prism, 15),
        7 => (Pyramid, 5),
        14 => (Pyramid, 14),
        19 => (Pyramid, 13),
        _ => return None,
    };
    Some((kind, nodes, nodes > kind.corners()))
}

impl Reader {
    fn physical_names(&mut self, from: &mut Numbers) -> Result<(), VolumeFileError> {
        let count = from.size("the number of physical names")?;
        for _ in 0..count {
            let line = from.line().unwrap_or("");
            let mut words = line.splitn(3, char::is_whitespace);
            let dimension = words.next().and_then(|w| w.parse::<u8>().ok());
            let tag = words.next().and_then(|w| w.parse::<i64>().ok());
            let name = words.next().map(|w| w.trim().trim_matches('"').to_string());
            let (Some(dimension @ 0..=3), Some(tag), Some(name)) = (dimension, tag, name) else {
                return Err(VolumeFileError::Syntax {
                    place: from.place_of_line(),
                    found: format!("{line:?}"),
                    expected: "a dimension, a number and a name in quotes".into(),
                });
            };
            self.names.insert((dimension, tag), name);
        }
        Ok(())
    }

    fn entities(&mut self, from: &mut Numbers) -> Result<(), VolumeFileError> {
        let what = "$Entities";
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = from.size(what)?;
        }
        for (dimension, count) in (0_u8..).zip(counts) {
            for _ in 0..count {
                let tag = from.int(what)?;
                // A point has a place, all others the corners of their bounds.
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    from.float(what)?;
                }
                let groups = from.size(what)?;
                let mut physical = Vec::new();
                for _ in 0..groups {
                    // The sign is an orientation.
                    physical.push(from.int(what)?.abs());
                }
                self.physical_of.insert((dimension, tag), physical);
                if dimension > 0 {
                    for _ in 0..from.size(what)? {
                        from.int(what)?;
                    }
                }
            }
        }
        Ok(())
    }

    fn nodes_4(&mut self, from: &mut Numbers) -> Result<(), VolumeFileError> {
        let what = "$Nodes";
        let blocks = from.size(what)?;
        for _ in 0..3 {
            from.size(what)?;
        }
        for _ in 0..blocks {
            let dimension = from.int(what)?.clamp(0, 3) as usize;
            from.int(what)?;
            let parametric = from.int(what)? != 0;
            let count = checked(from.size(what)?, from, "nodes")?;
            let start = self.raw.nodes.len();
            for _ in 0..count {
                let number = from.size(what)?;
                self.number_node(number, from)?;
            }
            for i in 0..count {
                let x = from.point(what)?;
                for _ in 0..if parametric { dimension } else { 0 } {
                    from.float(what)?;
                }
                self.raw.nodes[start + i] = Vec3::from(x);
            }
        }
        Ok(())
    }

    fn nodes_2(&mut self, from: &mut Numbers) -> Result<(), VolumeFileError> {
        let what = "$Nodes";
        let count = count_line(from, what)?;
        for _ in 0..checked(count, from, "nodes")? {
            let number = from.size(what)?;
            let x = from.point(what)?;
            self.number_node(number, from)?;
            if let Some(last) = self.raw.nodes.last_mut() {
                *last = Vec3::from(x);
            }
        }
        Ok(())
    }

    /// Adds a node, whose place is not known yet.
    fn number_node(&mut self, number: u64, from: &Numbers) -> Result<(), VolumeFileError> {
        let index = self.raw.nodes.len() as u32;
        if self.index_of.insert(number, index).is_some() {
            return Err(VolumeFileError::Syntax {
                place: from.place(),
                found: format!("node {number} a second time"),
                expected: "each node once".into(),
            });
        }
        self.raw.nodes.push(Vec3::zeros());
        self.raw.node_numbers.push(number);
        Ok(())
    }

    fn elements_4(&mut self, from: &mut Numbers) -> Result<(), VolumeFileError> {
        let what = "$Elements";
        let blocks = from.size(what)?;
        for _ in 0..3 {
            from.size(what)?;
        }
        for _ in 0..blocks {
            let dimension = from.int(what)?.clamp(0, 3) as u8;
            let entity = (dimension, from.int(what)?);
            let place = from.place();
            let element_type = from.int(what)?;
            let shape = known(element_type, &place)?;
            let count = checked(from.size(what)?, from, "elements")?;
            let physical = self.physical_of.get(&entity).cloned().unwrap_or_default();
            for _ in 0..count {
                let number = from.size(what)?;
                let cell = self.cell(from, shape, number)?;
                for &tag in &physical {
                    self.physical.entry((dimension, tag)).or_default().push(cell);
                }
                self.entities.entry(entity).or_default().push(cell);
            }
        }
        Ok(())
    }

    fn elements_2(&mut self, from: &mut Numbers) -> Result<(), VolumeFileError> {
        let what = "$Elements";
        let count = count_line(from, what)?;
        let count = checked(count, from, "elements")?;
        let mut read = 0;
        while read < count {
            // Text repeats the header for each element, and numbers it first.
            let (number, element_type, follow, tags) = if from.encoding == Encoding::Text {
                let number = from.size(what)?;
                (Some(number), from.int(what)?, 1, from.int(what)?)
            } else {
                (None, from.int(what)?, from.int(what)?, from.int(what)?)
            };
            let place = from.place();
            let shape = known(element_type, &place)?;
            if follow < 1 {
                return Err(VolumeFileError::Syntax {
                    place,
                    found: format!("a block of {follow} elements"),
                    expected: "at least one".into(),
                });
            }
            for _ in 0..follow {
                let number = match number {
                    Some(number) => number,
                    None => from.size(what)?,
                };
                let mut own = [0; 2];
                for k in 0..tags {
                    let tag = from.int(what)?;
                    if let Some(own) = own.get_mut(k as usize) {
                        *own = tag.abs();
                    }
                }
                let cell = self.cell(from, shape, number)?;
                let dimension = shape.0.dimension();
                if own[0] != 0 {
                    self.physical.entry((dimension, own[0])).or_default().push(cell);
                }
                self.entities.entry((dimension, own[1])).or_default().push(cell);
                read += 1;
            }
        }
        Ok(())
    }

    /// Reads a cell's nodes and adds it; its index.
    fn cell(
        &mut self,
        from: &mut Numbers,
        (kind, nodes, curved): (CellKind, usize, bool),
        number: u64,
    ) -> Result<u32, VolumeFileError> {
        let mut corners = [0; 8];
        for place in 0..nodes {
            let node = from.size("$Elements")?;
            let Some(&index) = self.index_of.get(&node) else {
                return Err(missing(from.place(), number, node, &self.raw.node_numbers));
            };
            match corners.get_mut(place).filter(|_| place < kind.corners()) {
                Some(corner) => *corner = index,
                None => {
                    self.raw.middles.insert(index);
                }
            }
        }
        self.raw.curved += usize::from(curved && kind.dimension() == 3);
        self.raw.cells.push(RawCell {
            kind,
            corners,
            number,
        });
        Ok((self.raw.cells.len() - 1) as u32)
    }

    fn finished(mut self) -> RawVolume {
        let entity_name = |&(dimension, tag): &Tag| format!("{} {tag}", ENTITIES[usize::from(dimension)]);
        self.raw.groups = if self.physical.is_empty() {
            self.entities
                .into_iter()
                .map(|(tag, cells)| (entity_name(&tag), cells))
                .collect()
        } else {
            let name = |tag: &Tag| self.names.get(tag).cloned();
            self.physical
                .into_iter()
                .map(|(tag, cells)| (name(&tag).unwrap_or_else(|| tag.1.to_string()), cells))
                .collect()
        };
        self.raw
    }
}

/// The count that begins a section of MSH 2: text in both encodings.
fn count_line(from: &mut Numbers, what: &str) -> Result<u64, VolumeFileError> {
    let line = from.line().unwrap_or("");
    let place = from.place_of_line();
    line.parse().map_err(|_| VolumeFileError::Syntax {
        place,
        found: format!("{line:?}"),
        expected: format!("the number of entries of {what}"),
    })
}

/// A count that the rest of the file has room for.
fn checked(count: u64, from: &Numbers, what: &str) -> Result<usize, VolumeFileError> {
    if count > from.left() as u64 {
        return Err(VolumeFileError::Truncated {
            what: format!("the list of {count} {what}"),
        });
    }
    Ok(count as usize)
}

fn known(element_type: i64, place: &str) -> Result<(CellKind, usize, bool), VolumeFileError> {
    kind_of(element_type).ok_or_else(|| VolumeFileError::Unsupported {
        place: place.to_string(),
        what: format!("Gmsh's element type {element_type}"),
        mend: "mesh with tetrahedra or hexahedra of order 1 or 2".into(),
    })
}
