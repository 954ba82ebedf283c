//! Voxel images in NRRD, the "nearly raw raster data" format of the Teem library: a text header, an empty line, numbers.
//!
//! Read are three-dimensional images with `encoding: raw` or `gzip` in the same file, of types of one or two bytes or floats, the
//! first axis running fastest. Spacings come from `spacings` or from the lengths of `space directions`. What the header asks
//! beyond that (detached data, skipped lines, other encodings) is refused. Source: teem.sourceforge.net/nrrd/format.html.

use crate::math::Vec3;
use std::io::Read;

/// A voxel image.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelImage {
    /// Voxels along x, y, z.
    pub sizes: [usize; 3],
    /// Edges of a voxel, in the file's unit until [`VoxelImage::scaled`] \[mm\].
    pub spacing_mm: Vec3,
    /// Values, x running fastest, `(x · y · z)`.
    values: Vec<f64>,
}

/// Why a file is no voxel image.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: {message}")]
pub struct NrrdError {
    /// Line of the header, from 1.
    pub line: usize,
    /// What was found and what was expected.
    pub message: String,
}

/// More voxels than this are refused.
const MOST_VOXELS: usize = 200_000_000;

impl VoxelImage {
    /// The value of the voxel at `place` (x, y, z); zero outside.
    pub fn value(&self, place: [usize; 3]) -> f64 {
        let [nx, ny, nz] = self.sizes;
        if place[0] >= nx || place[1] >= ny || place[2] >= nz {
            return 0.0;
        }
        self.values[place[0] + nx * (place[1] + ny * place[2])]
    }

    /// The same image with its spacings multiplied by `factor`, from the file's unit to millimetres.
    pub fn scaled(mut self, factor: f64) -> VoxelImage {
        self.spacing_mm *= factor;
        self
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Number {
    U8,
    I8,
    U16,
    I16,
    F32,
    F64,
}

impl Number {
    fn named(word: &str) -> Option<Number> {
        Some(match word {
            "uchar" | "unsigned char" | "uint8" | "uint8_t" => Number::U8,
            "signed char" | "int8" | "int8_t" => Number::I8,
            "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Number::U16,
            "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Number::I16,
            "float" => Number::F32,
            "double" => Number::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Number::U8 | Number::I8 => 1,
            Number::U16 | Number::I16 => 2,
            Number::F32 => 4,
            Number::F64 => 8,
        }
    }

    /// The number in the little-endian `bytes`.
    fn read(self, bytes: &[u8]) -> f64 {
        let mut word = [0; 8];
        for (to, from) in word.iter_mut().zip(bytes) {
            *to = *from;
        }
        let two = u16::from_le_bytes([word[0], word[1]]);
        match self {
            Number::U8 => f64::from(word[0]),
            Number::I8 => f64::from(word[0] as i8),
            Number::U16 => f64::from(two),
            Number::I16 => f64::from(two as i16),
            Number::F32 => f64::from(f32::from_le_bytes([word[0], word[1], word[2], word[3]])),
            Number::F64 => f64::from_le_bytes(word),
        }
    }
}

/// What a header says.
#[derive(Default)]
struct Header {
    number: Option<Number>,
    sizes: Option<[usize; 3]>,
    spacing: Option<Vec3>,
    encoding: Option<bool>,
    is_big_endian: bool,
    lines: usize,
}

/// Reads an image.
///
/// # Errors
/// [`NrrdError`]: no NRRD, a field that is missing or not understood, too few numbers, a number that is not finite.
pub fn read_nrrd(bytes: &[u8]) -> Result<VoxelImage, NrrdError> {
    let (text, data) = split(bytes)?;
    let header = read_header(&text)?;
    let at_end = |message: String| NrrdError {
        line: header.lines,
        message,
    };
    let missing = |field: &str| at_end(format!("the header has no {field}"));
    let number = header.number.ok_or_else(|| missing("type"))?;
    let sizes = header.sizes.ok_or_else(|| missing("sizes"))?;
    let spacing_mm = header
        .spacing
        .ok_or_else(|| missing("spacings and no space directions: the size of a voxel must be known"))?;
    let is_gzip = header.encoding.ok_or_else(|| missing("encoding"))?;
    let count = sizes
        .iter()
        .try_fold(1usize, |n, &k| n.checked_mul(k))
        .filter(|n| *n <= MOST_VOXELS && *n > 0);
    let Some(count) = count else {
        return Err(at_end(format!(
            "found {sizes:?} voxels, expected 1 to {MOST_VOXELS}"
        )));
    };
    let wanted = count * number.bytes();
    let mut unpacked = Vec::new();
    let data = if is_gzip {
        // One byte more than wanted is enough to see that there is too much.
        flate2::read::GzDecoder::new(data)
            .take(wanted as u64 + 1)
            .read_to_end(&mut unpacked)
            .map_err(|e| at_end(format!("the numbers cannot be unpacked: {e}")))?;
        &unpacked
    } else {
        data
    };
    if data.len() != wanted {
        let found = if is_gzip && data.len() > wanted {
            "more"
        } else {
            "other"
        };
        return Err(at_end(format!(
            "found {found} numbers than the header promises: {} bytes in place of {wanted}",
            data.len()
        )));
    }
    let mut values = Vec::with_capacity(count);
    for chunk in data.chunks_exact(number.bytes()) {
        let mut word = [0; 8];
        let word = &mut word[..chunk.len()];
        word.copy_from_slice(chunk);
        if header.is_big_endian {
            word.reverse();
        }
        let value = number.read(word);
        if !value.is_finite() {
            return Err(at_end(format!(
                "found {value} among the voxels, expected finite numbers"
            )));
        }
        values.push(value);
    }
    Ok(VoxelImage {
        sizes,
        spacing_mm,
        values,
    })
}

/// The header's text and what follows the empty line.
fn split(bytes: &[u8]) -> Result<(String, &[u8]), NrrdError> {
    let first = |message: &str| NrrdError {
        line: 1,
        message: message.into(),
    };
    if !bytes.starts_with(b"NRRD000") {
        return Err(first(
            "found no NRRD file: expected NRRD0001 to NRRD0005 in the first line",
        ));
    }
    let ends = [(&b"\n\n"[..], 2), (&b"\r\n\r\n"[..], 4)];
    let end = ends
        .iter()
        .filter_map(|(mark, n)| Some((bytes.windows(*n).position(|w| w == *mark)?, *n)))
        .min();
    let Some((at, n)) = end else {
        return Err(first(
            "found no empty line after the header; a detached header is not read",
        ));
    };
    let text = String::from_utf8_lossy(&bytes[..at]).into_owned();
    Ok((text, &bytes[at + n..]))
}

fn read_header(text: &str) -> Result<Header, NrrdError> {
    let mut header = Header::default();
    for (index, line) in text.lines().enumerate() {
        header.lines = index + 1;
        let wrong = |expected: &str| NrrdError {
            line: index + 1,
            message: format!("found {line:?}, expected {expected}"),
        };
        if index == 0 || line.starts_with('#') || line.contains(":=") {
            continue;
        }
        let Some((field, value)) = line.split_once(':') else {
            return Err(wrong("a field such as `sizes: 32 32 32`"));
        };
        let value = value.trim();
        match field.trim().to_ascii_lowercase().as_str() {
            "type" => {
                let number = Number::named(value);
                header.number =
                    Some(number.ok_or_else(|| wrong("uint8, int8, uint16, int16, float or double"))?);
            }
            "dimension" if value != "3" => return Err(wrong("three dimensions")),
            "sizes" => {
                let sizes: Vec<usize> = value.split_whitespace().filter_map(|w| w.parse().ok()).collect();
                header.sizes = Some(sizes.try_into().map_err(|_| wrong("three whole numbers"))?);
            }
            "spacings" => {
                let steps: Vec<f64> = value.split_whitespace().filter_map(|w| w.parse().ok()).collect();
                header.spacing = Some(spacing(&steps).ok_or_else(|| wrong("three lengths above zero"))?);
            }
            "space directions" => {
                let lengths = directions(value).ok_or_else(|| wrong("three vectors along x, y and z"))?;
                header.spacing = Some(lengths);
            }
            "encoding" => {
                header.encoding = match value.to_ascii_lowercase().as_str() {
                    "raw" => Some(false),
                    "gzip" | "gz" => Some(true),
                    _ => return Err(wrong("encoding raw or gzip")),
                }
            }
            "endian" => header.is_big_endian = value.eq_ignore_ascii_case("big"),
            "data file" | "datafile" | "line skip" | "lineskip" | "byte skip" | "byteskip" => {
                return Err(wrong("the numbers in the same file, right after the header"));
            }
            _ => {}
        }
    }
    Ok(header)
}

fn spacing(steps: &[f64]) -> Option<Vec3> {
    let [x, y, z] = *steps else { return None };
    let sound = steps.iter().all(|s| s.is_finite() && *s > 0.0);
    sound.then(|| Vec3::new(x, y, z))
}

/// Edges from `(dx,0,0) (0,dy,0) (0,0,dz)`; turned images are refused.
fn directions(value: &str) -> Option<Vec3> {
    let mut steps = Vec::new();
    for (axis, vector) in value.split('(').skip(1).enumerate() {
        let inside = vector.split(')').next()?;
        let parts: Vec<f64> = inside.split(',').filter_map(|w| w.trim().parse().ok()).collect();
        if parts.len() != 3 || axis > 2 {
            return None;
        }
        let along = parts[axis];
        let across = (0..3)
            .filter(|c| *c != axis)
            .map(|c| parts[c].abs())
            .fold(0.0, f64::max);
        if across > 1e-6 * along {
            return None;
        }
        steps.push(along);
    }
    spacing(&steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    const HEADER: &str =
        "NRRD0004\n# made by hand\ntype: uint8\ndimension: 3\nsizes: 2 3 1\nspacings: 0.5 0.5 2\n";

    fn file(rest: &str, data: &[u8]) -> Vec<u8> {
        [HEADER.as_bytes(), rest.as_bytes(), b"\n\n", data].concat()
    }

    #[test]
    fn raw_and_packed_images_are_the_same() {
        let data = [0, 1, 2, 3, 4, 5];
        let raw = read_nrrd(&file("encoding: raw", &data)).unwrap();
        assert_eq!((raw.sizes, raw.spacing_mm), ([2, 3, 1], Vec3::new(0.5, 0.5, 2.0)));
        assert_eq!(
            (raw.value([1, 2, 0]), raw.value([0, 1, 0]), raw.value([2, 0, 0])),
            (5.0, 2.0, 0.0)
        );
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        packed.write_all(&data).unwrap();
        let packed = packed.finish().unwrap();
        assert_eq!(read_nrrd(&file("encoding: gzip", &packed)).unwrap(), raw);
    }

    #[test]
    fn big_endian_and_directions_are_read() {
        let text = "NRRD0005\ntype: short\ndimension: 3\nsizes: 1 1 2\nspace directions: (1,0,0) (0,2,0) (0,0,3)\nendian: big\nencoding: raw\n\n";
        let bytes = [text.as_bytes(), &[0x01, 0x00, 0xff, 0xff]].concat();
        let image = read_nrrd(&bytes).unwrap();
        assert_eq!((image.value([0, 0, 0]), image.value([0, 0, 1])), (256.0, -1.0));
        assert_eq!(image.spacing_mm, Vec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn what_is_not_understood_is_refused_with_its_line() {
        let short = read_nrrd(&file("encoding: raw", &[1, 2])).unwrap_err();
        assert!(short.message.contains("2 bytes in place of 6"), "{short}");
        let other = read_nrrd(&file("encoding: bzip2", &[0; 6])).unwrap_err();
        assert_eq!(other.line, 7);
        assert!(read_nrrd(b"PNG").is_err());
        assert!(read_nrrd(&file("data file: other.raw", &[])).is_err());
        let turned = "NRRD0005\nspace directions: (0,1,0) (1,0,0) (0,0,1)\n\n";
        assert_eq!(read_nrrd(turned.as_bytes()).unwrap_err().line, 2);
        let huge = "NRRD0004\ntype: uint8\nsizes: 4000000000 4000000000 4000000000\nspacings: 1 1 1\nencoding: raw\n\n";
        assert!(read_nrrd(huge.as_bytes()).is_err());
    }
}
