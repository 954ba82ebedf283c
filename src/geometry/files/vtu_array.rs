//! One array of a VTU file: from text or bytes to numbers.

use super::volume_error::VolumeFileError;
use flate2::read::ZlibDecoder;
use std::collections::BTreeMap;
use std::io::Read;

/// How the arrays of a file are laid out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    big_endian: bool,
    /// Bytes of a number in the headers.
    header: usize,
    compressed: bool,
}

impl Layout {
    /// From the attributes of `<VTKFile>`.
    pub fn new(attributes: &BTreeMap<String, String>, place: &str) -> Result<Layout, VolumeFileError> {
        let of = |name: &str| attributes.get(name).map(String::as_str);
        if of("type") != Some("UnstructuredGrid") {
            return Err(VolumeFileError::Syntax {
                place: place.into(),
                found: format!("type={:?}", of("type").unwrap_or("")),
                expected: "\"UnstructuredGrid\"".into(),
            });
        }
        let unsupported = |what: String, mend: &str| VolumeFileError::Unsupported {
            place: place.into(),
            what,
            mend: mend.into(),
        };
        let compressed = match of("compressor") {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => {
                return Err(unsupported(
                    format!("compression with {other}"),
                    "save it with zlib or without compression",
                ));
            }
        };
        let header = match of("header_type") {
            None | Some("UInt32") => 4,
            Some("UInt64") => 8,
            Some(other) => return Err(unsupported(format!("header_type {other:?}"), "use UInt64")),
        };
        Ok(Layout {
            big_endian: of("byte_order") == Some("BigEndian"),
            header,
            compressed,
        })
    }
}

/// The data after the XML.
#[derive(Clone, Copy, Debug)]
pub(super) struct Appended<'a> {
    /// Where `<AppendedData` begins: where the XML ends.
    start: usize,
    base64: bool,
    data: &'a [u8],
}

impl<'a> Appended<'a> {
    pub fn find(bytes: &'a [u8]) -> Result<Appended<'a>, VolumeFileError> {
        const TAG: &[u8] = b"<AppendedData";
        let Some(start) = bytes.windows(TAG.len()).position(|w| w == TAG) else {
            return Ok(Appended {
                start: bytes.len(),
                base64: false,
                data: &[],
            });
        };
        let cut = || VolumeFileError::Truncated {
            what: "<AppendedData>, before its underscore".into(),
        };
        let rest = &bytes[start..];
        let end = rest.iter().position(|&b| b == b'>').ok_or_else(cut)?;
        let tag = String::from_utf8_lossy(&rest[..end]);
        let underscore = rest[end..].iter().position(|&b| b == b'_').ok_or_else(cut)?;
        Ok(Appended {
            start,
            base64: tag.contains("base64"),
            data: &rest[end + underscore + 1..],
        })
    }

    /// Where the XML ends.
    pub fn start(&self) -> usize {
        self.start
    }
}

/// `<DataArray>` as written.
#[derive(Clone, Debug)]
pub(super) struct ArrayText {
    pub name: String,
    pub components: usize,
    /// Where it stands, for messages.
    pub place: String,
    /// What stands between its tags.
    pub text: Vec<u8>,
    number_type: String,
    format: String,
    offset: usize,
}

impl ArrayText {
    pub fn new(attributes: &BTreeMap<String, String>, line: String) -> Result<ArrayText, VolumeFileError> {
        let of = |name: &str| attributes.get(name).cloned().unwrap_or_default();
        let name = of("Name");
        let whole = |key: &str, default: usize| match attributes.get(key) {
            None => Ok(default),
            Some(text) => text.trim().parse().map_err(|_| VolumeFileError::Syntax {
                place: format!("{line}, array {name:?}"),
                found: format!("{key}={text:?}"),
                expected: "a whole number".into(),
            }),
        };
        Ok(ArrayText {
            // VTK says 0 where it means 1.
            components: whole("NumberOfComponents", 1)?.max(1),
            offset: whole("offset", 0)?,
            place: format!("{line}, array {name:?}"),
            text: Vec::new(),
            number_type: of("type"),
            format: of("format"),
            name,
        })
    }

    /// Whether it holds numbers rather than texts.
    pub fn is_number(&self) -> bool {
        self.width().is_some()
    }

    /// Bytes of one number.
    fn width(&self) -> Option<usize> {
        match self.number_type.as_str() {
            "Int8" | "UInt8" => Some(1),
            "Int16" | "UInt16" => Some(2),
            "Int32" | "UInt32" | "Float32" => Some(4),
            "Int64" | "UInt64" | "Float64" => Some(8),
            _ => None,
        }
    }

    fn syntax(&self, found: impl Into<String>, expected: &str) -> VolumeFileError {
        VolumeFileError::Syntax {
            place: self.place.clone(),
            found: found.into(),
            expected: expected.into(),
        }
    }

    /// Its numbers. Whole ones beyond 2⁵³ lose their last digits, and name nothing that exists.
    pub fn numbers(&self, layout: &Layout, appended: &Appended) -> Result<Vec<f64>, VolumeFileError> {
        let Some(width) = self.width() else {
            return Err(self.syntax(
                format!("type={:?}", self.number_type),
                "Int8 to UInt64, Float32 or Float64",
            ));
        };
        let mut source = match self.format.as_str() {
            "ascii" => return self.words(),
            "binary" => Source::new(&self.text, true),
            "appended" => {
                let data = appended.data.get(self.offset..).unwrap_or(&[]);
                Source::new(data, appended.base64)
            }
            other => return Err(self.syntax(format!("format={other:?}"), "ascii, binary or appended")),
        };
        let bytes = if layout.compressed {
            self.inflated(&mut source, layout)
        } else {
            let length = source.header(1, layout).map(|h| h[0]);
            length.and_then(|n| source.take(n))
        };
        let bytes = bytes.ok_or_else(|| VolumeFileError::Truncated {
            what: self.place.clone(),
        })?;
        if bytes.len() % width != 0 {
            return Err(self.syntax(format!("{} bytes", bytes.len()), "whole numbers of its type"));
        }
        Ok(bytes
            .chunks_exact(width)
            .map(|b| self.number(b, layout.big_endian))
            .collect())
    }

    fn words(&self) -> Result<Vec<f64>, VolumeFileError> {
        let text = String::from_utf8_lossy(&self.text);
        text.split_ascii_whitespace()
            .map(|word| {
                word.parse()
                    .map_err(|_| self.syntax(format!("{word:?}"), "a number"))
            })
            .collect()
    }

    /// The blocks of a compressed array, one after the other; `None` if they are cut off or broken.
    fn inflated(&self, source: &mut Source, layout: &Layout) -> Option<Vec<u8>> {
        let blocks = source.header(1, layout)?[0];
        // A block takes some bytes of header.
        if blocks > source.left() {
            return None;
        }
        let sizes = source.header(2 + blocks, layout)?;
        let (size, last) = (sizes[0], sizes[1]);
        let mut bytes = Vec::new();
        for (i, &packed) in sizes[2..].iter().enumerate() {
            let whole = if i + 1 == blocks && last != 0 { last } else { size };
            let packed = source.take(packed)?;
            let before = bytes.len();
            // One byte more than there should be, so that too many show.
            let mut unpacker = ZlibDecoder::new(packed.as_slice()).take(whole as u64 + 1);
            unpacker.read_to_end(&mut bytes).ok()?;
            if bytes.len() - before != whole {
                return None;
            }
        }
        Some(bytes)
    }

    fn number(&self, bytes: &[u8], big_endian: bool) -> f64 {
        let mut b = [0_u8; 8];
        b[..bytes.len()].copy_from_slice(bytes);
        if big_endian {
            b[..bytes.len()].reverse();
        }
        match self.number_type.as_str() {
            "Int8" => f64::from(b[0] as i8),
            "UInt8" => f64::from(b[0]),
            "Int16" => f64::from(i16::from_le_bytes([b[0], b[1]])),
            "UInt16" => f64::from(u16::from_le_bytes([b[0], b[1]])),
            "Int32" => f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            "UInt32" => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            "Float32" => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            "Int64" => i64::from_le_bytes(b) as f64,
            "UInt64" => u64::from_le_bytes(b) as f64,
            _ => f64::from_le_bytes(b),
        }
    }
}

/// Bytes, raw or in base64. Some writers close the base64 after a header and open it anew, others go on: each group of
/// four letters is read by itself, so both are the same.
struct Source<'a> {
    data: &'a [u8],
    at: usize,
    base64: bool,
    /// Bytes of the last group that were not asked for yet.
    rest: Vec<u8>,
}

impl<'a> Source<'a> {
    fn new(data: &'a [u8], base64: bool) -> Source<'a> {
        Source {
            data,
            at: 0,
            base64,
            rest: Vec::new(),
        }
    }

    fn left(&self) -> usize {
        self.data.len() - self.at
    }

    fn take(&mut self, count: usize) -> Option<Vec<u8>> {
        if count > self.left() + self.rest.len() {
            return None;
        }
        if !self.base64 {
            let taken = self.data[self.at..self.at + count].to_vec();
            self.at += count;
            return Some(taken);
        }
        let mut bytes = std::mem::take(&mut self.rest);
        while bytes.len() < count {
            bytes.extend(self.group()?);
        }
        self.rest = bytes.split_off(count);
        Some(bytes)
    }

    /// The bytes of the next four letters.
    fn group(&mut self) -> Option<Vec<u8>> {
        let mut value = 0_u32;
        let (mut letters, mut padding) = (0, 0);
        while letters < 4 {
            let letter = *self.data.get(self.at)?;
            self.at += 1;
            let digit = match letter {
                b'A'..=b'Z' => letter - b'A',
                b'a'..=b'z' => letter - b'a' + 26,
                b'0'..=b'9' => letter - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                b'=' => {
                    padding += 1;
                    0
                }
                _ if letter.is_ascii_whitespace() => continue,
                _ => return None,
            };
            value = value << 6 | u32::from(digit);
            letters += 1;
        }
        let bytes = value.to_be_bytes();
        Some(bytes[1..4 - 2.min(padding)].to_vec())
    }

    /// So many numbers of a header.
    fn header(&mut self, count: usize, layout: &Layout) -> Option<Vec<usize>> {
        let bytes = self.take(count.checked_mul(layout.header)?)?;
        let number = |b: &[u8]| {
            let mut array = [0_u8; 8];
            array[..b.len()].copy_from_slice(b);
            if layout.big_endian {
                array[..b.len()].reverse();
            }
            usize::try_from(u64::from_le_bytes(array)).ok()
        };
        bytes.chunks_exact(layout.header).map(number).collect()
    }
}
