//! What can be wrong with a mesh file.

use crate::units::LengthUnit;
use std::path::PathBuf;
use thiserror::Error;

/// A mesh file that cannot be used. Each message says where, what was found, and how to mend it.
#[derive(Debug, Error)]
pub enum MeshFileError {
    #[error("{name}: expected a mesh file ending in .stl, .obj, .ply or .3mf")]
    UnknownFormat { name: String },
    // The cause stands in the message, and is no `source` as well, or reports would say it twice.
    #[error("{path}: {cause}")]
    Open { path: PathBuf, cause: std::io::Error },
    /// An error inside the named file.
    #[error("{path}: {cause}")]
    In {
        path: PathBuf,
        cause: Box<MeshFileError>,
    },
    #[error("line {line}: found {found}, expected {expected}")]
    Syntax {
        line: usize,
        found: String,
        expected: String,
    },
    #[error("{place}: the coordinate \"{value}\" is not a finite number")]
    NotFinite { place: String, value: String },
    #[error(
        "{place}: vertex {index} does not exist, the file has {count} vertices{}",
        if *.from_one { " (numbered from 1)" } else { " (numbered from 0)" }
    )]
    IndexOutOfRange {
        place: String,
        index: String,
        count: usize,
        from_one: bool,
    },
    #[error("the file holds no triangles{}", if .hint.is_empty() { String::new() } else { format!(": {}", .hint) })]
    Empty { hint: String },
    #[error("the file is cut off: {what}")]
    Truncated { what: String },
    #[error(
        "the header of the binary STL counts {declared} triangles, which take {expected_bytes} bytes, but the file has \
         {bytes} bytes, room for {room} triangles: the file was cut or written wrongly, export it again"
    )]
    StlCount {
        declared: u32,
        expected_bytes: u64,
        bytes: u64,
        room: u64,
    },
    #[error("{message}")]
    Ply { message: String },
    #[error("{part}: {message}")]
    ThreeMf { part: String, message: String },
    #[error("the file holds more than {limit} {what}: this is no mesh of an object")]
    TooLarge { what: &'static str, limit: u64 },
    #[error(
        "the file does not say its unit, and the surface measures {} × {} × {} in it; state the unit: in mm the largest \
         extent would be {}, in cm {}, in m {}", short(*.x), short(*.y), short(*.z), in_unit(*.x, *.y, *.z, LengthUnit::Millimetre),
        in_unit(*.x, *.y, *.z, LengthUnit::Centimetre), in_unit(*.x, *.y, *.z, LengthUnit::Metre)
    )]
    UnitMissing { x: f64, y: f64, z: f64 },
    #[error(
        "the file declares {declared} as its unit, but {stated} was stated: leave the unit out, or mend the file"
    )]
    UnitConflict {
        declared: LengthUnit,
        stated: LengthUnit,
    },
    #[error(
        "with the unit {unit} the object is {} long, where 5 mm to 3 m is expected{}",
        readable(*.largest_mm), guess(*.largest_mm / .unit.to_mm(), *.declared)
    )]
    ImplausibleSize {
        largest_mm: f64,
        unit: LengthUnit,
        declared: bool,
    },
}

/// Three significant digits.
fn short(value: f64) -> String {
    if !(1e-6..1e9).contains(&value.abs()) {
        return value.to_string();
    }
    let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}

/// A length in a readable unit.
fn readable(mm: f64) -> String {
    match mm {
        mm if !mm.is_finite() || mm == 0.0 => format!("{mm} mm"),
        mm if !(1e-3..1e9).contains(&mm) => format!("{mm:.2e} mm"),
        mm if mm < 1000.0 => format!("{} mm", short(mm)),
        mm => format!("{} m", short(mm / 1000.0)),
    }
}

fn in_unit(x: f64, y: f64, z: f64, unit: LengthUnit) -> String {
    readable(x.max(y).max(z) * unit.to_mm())
}

/// The units with which a raw extent would be the size of an object, as a question.
fn guess(raw: f64, declared: bool) -> String {
    let plausible: Vec<&str> = LengthUnit::ALL
        .iter()
        .filter(|unit| super::read::is_plausible(raw * unit.to_mm()))
        .map(|unit| unit.name())
        .collect();
    match (plausible.as_slice(), declared) {
        ([], _) => ": no unit makes it the size of an object, check the file".to_string(),
        (units, false) => format!(": is the unit {}?", units.join(" or ")),
        (units, true) => format!(": should the file declare {}?", units.join(" or ")),
    }
}
