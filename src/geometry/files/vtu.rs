//! VTU, VTK's XML file of an unstructured grid, as ParaView opens it: arrays by name at points and cells, appended in
//! binary after the XML, each compressed with zlib in blocks.
//!
//! ```text
//! array = header blocks…     header = n, size, last, c_1 … c_n     (64 bit, little-endian)
//! ```
//!
//! `n` blocks of `size` bytes before compression, the last of `last` bytes (0 where it is full), block `i` taking
//! `c_i` bytes in the file ("VTK file formats", The VTK User's Guide, section 19.3).

use crate::math::mandel::{self, Mandel};
use crate::math::{Mat3, Vec3};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::{self, Write};
use thiserror::Error;

/// Bytes of a block before compression.
const BLOCK: usize = 1 << 20;

/// The cells of a grid, by their points; all of one kind.
#[derive(Clone, Copy, Debug)]
pub enum VtuCells<'a> {
    /// Eight points each, `(m × 8)`: four around the lower face counter-clockwise seen from above, then the four
    /// above them (VTK's type 12).
    Hexahedra(&'a [[u32; 8]]),
    /// Four points each, `(m × 4)` (VTK's type 10).
    Tetrahedra(&'a [[u32; 4]]),
    /// Three points each, `(m × 3)`: a surface (VTK's type 5).
    Triangles(&'a [[u32; 3]]),
}

impl VtuCells<'_> {
    /// The number of cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Hexahedra(cells) => cells.len(),
            Self::Tetrahedra(cells) => cells.len(),
            Self::Triangles(cells) => cells.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// VTK's number for the kind, and how many points a cell has.
    fn kind(&self) -> (u8, usize) {
        match self {
            Self::Hexahedra(_) => (12, 8),
            Self::Tetrahedra(_) => (10, 4),
            Self::Triangles(_) => (5, 3),
        }
    }

    fn points(&self) -> &[u32] {
        match self {
            Self::Hexahedra(cells) => cells.as_flattened(),
            Self::Tetrahedra(cells) => cells.as_flattened(),
            Self::Triangles(cells) => cells.as_flattened(),
        }
    }
}

/// Points and cells.
#[derive(Clone, Copy, Debug)]
pub struct VtuGrid<'a> {
    /// Positions, `(n × 3)` \[mm\].
    pub points: &'a [Vec3],
    /// Cells.
    pub cells: VtuCells<'a>,
}

/// One value for each point or each cell.
#[derive(Clone, Copy, Debug)]
pub enum Array<'a> {
    /// Numbers.
    Scalars(&'a [f64]),
    /// Whole numbers: labels, counts.
    Integers(&'a [i32]),
    /// Vectors.
    Vectors(&'a [Vec3]),
    /// Symmetric tensors; written with VTK's six components XX YY ZZ XY YZ XZ, without Mandel's factors.
    SymmetricTensors(&'a [Mandel]),
    /// Tensors; written row by row, nine components.
    Tensors(&'a [Mat3]),
}

impl Array<'_> {
    fn len(&self) -> usize {
        match self {
            Self::Scalars(values) => values.len(),
            Self::Integers(values) => values.len(),
            Self::Vectors(values) => values.len(),
            Self::SymmetricTensors(values) => values.len(),
            Self::Tensors(values) => values.len(),
        }
    }

    fn components(&self) -> usize {
        match self {
            Self::Scalars(_) | Self::Integers(_) => 1,
            Self::Vectors(_) => 3,
            Self::SymmetricTensors(_) => 6,
            Self::Tensors(_) => 9,
        }
    }

    fn number_type(&self) -> &'static str {
        if matches!(self, Self::Integers(_)) {
            "Int32"
        } else {
            "Float64"
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Scalars(values) => floats(values.iter().copied()),
            Self::Integers(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Vectors(values) => floats(values.iter().flat_map(|v| [v.x, v.y, v.z])),
            Self::SymmetricTensors(values) => floats(values.iter().flat_map(|v| {
                let a = mandel::to_tensor(v);
                [a[(0, 0)], a[(1, 1)], a[(2, 2)], a[(0, 1)], a[(1, 2)], a[(0, 2)]]
            })),
            // nalgebra stores columns.
            Self::Tensors(values) => floats(
                values
                    .iter()
                    .flat_map(|a| (0..9).map(|k| a[(k / 3, k % 3)]).collect::<Vec<_>>()),
            ),
        }
    }
}

fn floats(values: impl Iterator<Item = f64>) -> Vec<u8> {
    values.flat_map(f64::to_le_bytes).collect()
}

/// Why a grid could not be written.
#[derive(Debug, Error)]
pub enum VtuError {
    /// An array of the wrong length.
    #[error("array `{name}` has {found} values for {expected} {place}; give one to each")]
    Length {
        /// The array's name.
        name: String,
        /// How many values it has.
        found: usize,
        /// How many it needs.
        expected: usize,
        /// `points` or `cells`.
        place: &'static str,
    },
    /// Two arrays of one name, or one without.
    #[error("array name `{0}` is empty or used twice among the same points or cells")]
    Name(String),
    /// A cell without its points.
    #[error("cell {cell} names point {point}, but there are {points} points")]
    Point {
        /// The cell.
        cell: usize,
        /// What it names.
        point: u32,
        /// How many points there are.
        points: usize,
    },
    /// The writer below failed.
    #[error("cannot write the VTU file: {0}")]
    Io(#[from] io::Error),
}

/// Writes a grid with named arrays at its points and cells.
///
/// # Errors
/// Arrays of the wrong length or without a name of their own, cells that name points which are not there, and the
/// errors of `out`.
pub fn write_vtu(
    mut out: impl Write,
    grid: &VtuGrid,
    point_data: &[(&str, Array)],
    cell_data: &[(&str, Array)],
) -> Result<(), VtuError> {
    let (n, m) = (grid.points.len(), grid.cells.len());
    check_arrays(point_data, n, "points")?;
    check_arrays(cell_data, m, "cells")?;
    let (kind, corners) = grid.cells.kind();
    if let Some(i) = grid.cells.points().iter().position(|&p| p as usize >= n) {
        return Err(VtuError::Point {
            cell: i / corners,
            point: grid.cells.points()[i],
            points: n,
        });
    }

    let mut blob = Blob::default();
    let mut xml = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n",
    );
    xml += &format!("<Piece NumberOfPoints=\"{n}\" NumberOfCells=\"{m}\">\n");
    for (tag, arrays) in [("PointData", point_data), ("CellData", cell_data)] {
        xml += &format!("<{tag}{}>\n", shown_first(arrays));
        for (name, array) in arrays {
            xml += &blob.array(name, array.number_type(), array.components(), &array.bytes())?;
        }
        xml += &format!("</{tag}>\n");
    }
    xml += "<Points>\n";
    xml += &blob.array("Points", "Float64", 3, &Array::Vectors(grid.points).bytes())?;
    xml += "</Points>\n<Cells>\n";
    let points = grid
        .cells
        .points()
        .iter()
        .flat_map(|&p| i64::from(p).to_le_bytes())
        .collect::<Vec<_>>();
    let ends = (1..=m)
        .flat_map(|i| ((i * corners) as i64).to_le_bytes())
        .collect::<Vec<_>>();
    xml += &blob.array("connectivity", "Int64", 1, &points)?;
    xml += &blob.array("offsets", "Int64", 1, &ends)?;
    xml += &blob.array("types", "UInt8", 1, &vec![kind; m])?;
    xml += "</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    out.write_all(xml.as_bytes())?;
    out.write_all(&blob.0)?;
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")?;
    out.flush()?;
    Ok(())
}

fn check_arrays(arrays: &[(&str, Array)], expected: usize, place: &'static str) -> Result<(), VtuError> {
    for (i, (name, array)) in arrays.iter().enumerate() {
        if name.is_empty() || arrays[..i].iter().any(|(other, _)| other == name) {
            return Err(VtuError::Name((*name).into()));
        }
        if array.len() != expected {
            return Err(VtuError::Length {
                name: (*name).into(),
                found: array.len(),
                expected,
                place,
            });
        }
    }
    Ok(())
}

/// The arrays that a viewer shows without being asked: the first of scalars, vectors and tensors.
fn shown_first(arrays: &[(&str, Array)]) -> String {
    let first = |kind: &str, components: &[usize]| {
        let array = arrays.iter().find(|(_, a)| components.contains(&a.components()));
        array
            .map(|(name, _)| format!(" {kind}=\"{}\"", escaped(name)))
            .unwrap_or_default()
    };
    first("Scalars", &[1]) + &first("Vectors", &[3]) + &first("Tensors", &[9])
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// The appended data.
#[derive(Default)]
struct Blob(Vec<u8>);

impl Blob {
    /// Appends an array, and answers the XML that points to it.
    fn array(
        &mut self,
        name: &str,
        number_type: &str,
        components: usize,
        bytes: &[u8],
    ) -> io::Result<String> {
        let offset = self.0.len();
        let blocks: Vec<Vec<u8>> = bytes.chunks(BLOCK).map(deflated).collect::<io::Result<_>>()?;
        let header = [blocks.len(), BLOCK, bytes.len() % BLOCK]
            .into_iter()
            .chain(blocks.iter().map(Vec::len));
        self.0
            .extend(header.flat_map(|number| (number as u64).to_le_bytes()));
        self.0.extend(blocks.iter().flatten());
        let names = match components {
            6 => ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]
                .iter()
                .enumerate()
                .fold(String::new(), |names, (k, c)| {
                    names + &format!(" ComponentName{k}=\"{c}\"")
                }),
            _ => String::new(),
        };
        Ok(format!(
            "<DataArray type=\"{number_type}\" Name=\"{}\" NumberOfComponents=\"{components}\"{names} \
             format=\"appended\" offset=\"{offset}\"/>\n",
            escaped(name)
        ))
    }
}

fn deflated(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes)?;
    encoder.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn write(tets: &[[u32; 4]], point_data: &[(&str, Array)]) -> Result<Vec<u8>, VtuError> {
        let points = POINTS.map(Vec3::from);
        let mut bytes = Vec::new();
        let grid = VtuGrid {
            points: &points,
            cells: VtuCells::Tetrahedra(tets),
        };
        write_vtu(&mut bytes, &grid, point_data, &[])?;
        Ok(bytes)
    }

    #[test]
    fn mistakes_are_named() {
        let short = write(&[[0, 1, 2, 3]], &[("load", Array::Scalars(&[1.0]))]);
        assert!(matches!(
            short,
            Err(VtuError::Length {
                found: 1,
                expected: 4,
                place: "points",
                ..
            })
        ));
        assert!(matches!(
            write(&[[0, 1, 2, 4]], &[]),
            Err(VtuError::Point {
                cell: 0,
                point: 4,
                points: 4
            })
        ));
        let twice = [("a", Array::Integers(&[0; 4])), ("a", Array::Scalars(&[0.0; 4]))];
        assert!(matches!(write(&[[0, 1, 2, 3]], &twice), Err(VtuError::Name(_))));
    }

    /// The first array starts right after the underscore: one block, 32 bytes before compression.
    #[test]
    fn header_of_the_first_array() {
        let bytes = write(
            &[[0, 1, 2, 3]],
            &[("load", Array::Scalars(&[1.0, 2.0, 3.0, 4.0]))],
        )
        .expect("memory");
        let start = bytes.windows(2).position(|w| w == b"\n_").expect("underscore") + 2;
        let number =
            |k: usize| u64::from_le_bytes(std::array::from_fn(|i| bytes[start + 8 * k + i])) as usize;
        assert_eq!([number(0), number(1), number(2)], [1, BLOCK, 32]);
        let packed = &bytes[start + 32..start + 32 + number(3)];
        let mut plain = Vec::new();
        io::Read::read_to_end(&mut flate2::read::ZlibDecoder::new(packed), &mut plain).expect("zlib");
        assert_eq!(plain, floats([1.0, 2.0, 3.0, 4.0].into_iter()));
    }
}
