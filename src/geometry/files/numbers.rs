//! The numbers of a mesh file one after the other, whether it holds them as text or as bytes.

use super::volume_error::VolumeFileError;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    /// As words.
    Text,
    /// As bytes, the least first.
    LittleEndian,
    /// As bytes, the greatest first.
    BigEndian,
}

/// A place in a file from which numbers are taken.
#[derive(Clone, Debug)]
pub(super) struct Numbers<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    line_read: usize,
    pub encoding: Encoding,
    /// Bytes of a whole number without sign, where the encoding is binary: 4 or 8.
    pub size_bytes: usize,
}

impl<'a> Numbers<'a> {
    pub fn new(bytes: &'a [u8]) -> Numbers<'a> {
        Numbers {
            bytes,
            at: 0,
            line: 1,
            line_read: 1,
            encoding: Encoding::Text,
            size_bytes: 8,
        }
    }

    /// Where the next number stands, for messages.
    pub fn place(&self) -> String {
        match self.encoding {
            Encoding::Text => format!("line {}", self.line),
            _ => format!("byte {}", self.at),
        }
    }

    /// The line that [`Numbers::line`] answered last, for messages.
    pub fn place_of_line(&self) -> String {
        format!("line {}", self.line_read)
    }

    /// How many bytes are left: no list can be longer.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next line that is not blank, without its ends; `None` at the end of the file.
    pub fn line(&mut self) -> Option<&'a str> {
        loop {
            let rest = self.bytes.get(self.at..).filter(|r| !r.is_empty())?;
            let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
            self.line_read = self.line;
            self.advance((end + 1).min(rest.len()));
            // What is no text is a line that fits nothing.
            let line = std::str::from_utf8(&rest[..end]).unwrap_or("\u{fffd}").trim();
            if !line.is_empty() {
                return Some(line);
            }
        }
    }

    /// Passes over everything up to and with the line `end`.
    pub fn skip_to(&mut self, end: &str) -> Result<(), VolumeFileError> {
        let marker = [b"\n", end.as_bytes()].concat();
        let rest = &self.bytes[self.at..];
        // An empty section has no line before its end.
        if rest.starts_with(end.as_bytes()) {
            self.advance(end.len());
            return Ok(());
        }
        let found = rest.windows(marker.len()).position(|w| w == marker);
        let Some(found) = found else {
            return Err(VolumeFileError::Truncated {
                what: format!("the section before {end}"),
            });
        };
        self.advance(found + marker.len());
        Ok(())
    }

    fn advance(&mut self, by: usize) {
        if self.encoding == Encoding::Text {
            let passed = &self.bytes[self.at..self.at + by];
            self.line += passed.iter().filter(|&&b| b == b'\n').count();
        }
        self.at += by;
    }

    /// The next word of the text.
    fn word(&mut self, what: &str) -> Result<&'a str, VolumeFileError> {
        let blank = |b: &u8| b.is_ascii_whitespace();
        let rest = &self.bytes[self.at..];
        let start = rest.iter().position(|b| !blank(b)).unwrap_or(rest.len());
        self.advance(start);
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(blank).unwrap_or(rest.len());
        if length == 0 {
            return Err(VolumeFileError::Truncated { what: what.into() });
        }
        self.at += length;
        Ok(std::str::from_utf8(&rest[..length]).unwrap_or("\u{fffd}"))
    }

    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N], VolumeFileError> {
        let taken = self.bytes.get(self.at..self.at + N);
        let Some(Ok(mut array)) = taken.map(<[u8; N]>::try_from) else {
            return Err(VolumeFileError::Truncated { what: what.into() });
        };
        self.at += N;
        if self.encoding == Encoding::BigEndian {
            array.reverse();
        }
        Ok(array)
    }

    /// A whole number of 32 bits.
    pub fn int(&mut self, what: &str) -> Result<i64, VolumeFileError> {
        if self.encoding != Encoding::Text {
            return Ok(i64::from(i32::from_le_bytes(self.take(what)?)));
        }
        self.parsed(what, "a whole number")
    }

    /// A whole number without sign: a count, a number of a node or element.
    pub fn size(&mut self, what: &str) -> Result<u64, VolumeFileError> {
        match self.encoding {
            Encoding::Text => self.parsed(what, "a whole number, 0 or more"),
            _ if self.size_bytes == 8 => Ok(u64::from_le_bytes(self.take(what)?)),
            _ => Ok(u64::from(u32::from_le_bytes(self.take(what)?))),
        }
    }

    /// A number, which may be none that is finite.
    pub fn float(&mut self, what: &str) -> Result<f64, VolumeFileError> {
        if self.encoding != Encoding::Text {
            return Ok(f64::from_le_bytes(self.take(what)?));
        }
        self.parsed(what, "a number")
    }

    /// Three coordinates, finite.
    pub fn point(&mut self, what: &str) -> Result<[f64; 3], VolumeFileError> {
        let mut x = [0.0; 3];
        for c in &mut x {
            *c = self.float(what)?;
            if !c.is_finite() {
                return Err(VolumeFileError::NotFinite {
                    place: self.place(),
                    value: c.to_string(),
                });
            }
        }
        Ok(x)
    }

    fn parsed<T: std::str::FromStr>(&mut self, what: &str, kind: &str) -> Result<T, VolumeFileError> {
        let word = self.word(what)?;
        word.parse().map_err(|_| VolumeFileError::Syntax {
            place: self.place(),
            found: format!("{word:?}"),
            expected: format!("{kind} ({what})"),
        })
    }
}
