//! Units of length that mesh files and people use.

use super::UnitError;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A unit of length. Written and read as its symbol: `um`, `mm`, `cm`, `m`, `in`, `ft`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum LengthUnit {
    Micrometre,
    Millimetre,
    Centimetre,
    Metre,
    Inch,
    Foot,
}

impl LengthUnit {
    /// Every unit, small to large among the metric ones.
    pub const ALL: [LengthUnit; 6] = [
        LengthUnit::Micrometre,
        LengthUnit::Millimetre,
        LengthUnit::Centimetre,
        LengthUnit::Metre,
        LengthUnit::Inch,
        LengthUnit::Foot,
    ];

    /// Millimetres in one of this unit.
    pub const fn to_mm(self) -> f64 {
        match self {
            LengthUnit::Micrometre => 1e-3,
            LengthUnit::Millimetre => 1.0,
            LengthUnit::Centimetre => 10.0,
            LengthUnit::Metre => 1000.0,
            LengthUnit::Inch => 25.4,
            LengthUnit::Foot => 304.8,
        }
    }

    /// The symbol, as it is written in records and on the command line.
    pub const fn symbol(self) -> &'static str {
        match self {
            LengthUnit::Micrometre => "um",
            LengthUnit::Millimetre => "mm",
            LengthUnit::Centimetre => "cm",
            LengthUnit::Metre => "m",
            LengthUnit::Inch => "in",
            LengthUnit::Foot => "ft",
        }
    }

    /// The name in words.
    pub const fn name(self) -> &'static str {
        match self {
            LengthUnit::Micrometre => "micrometres",
            LengthUnit::Millimetre => "millimetres",
            LengthUnit::Centimetre => "centimetres",
            LengthUnit::Metre => "metres",
            LengthUnit::Inch => "inches",
            LengthUnit::Foot => "feet",
        }
    }
}

impl fmt::Display for LengthUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

impl From<LengthUnit> for &'static str {
    fn from(unit: LengthUnit) -> &'static str {
        unit.symbol()
    }
}

impl TryFrom<String> for LengthUnit {
    type Error = UnitError;
    fn try_from(text: String) -> Result<LengthUnit, UnitError> {
        text.parse()
    }
}

impl FromStr for LengthUnit {
    type Err = UnitError;

    /// Reads a symbol or a name: `mm`, `millimetre`, `millimeters`, `µm`, `micron`, `inch`, …
    ///
    /// # Errors
    /// [`UnitError::UnknownUnit`] for anything else. Case matters for symbols only where it changes the meaning:
    /// `MM` is read as millimetres, since a megametre is no length of an object.
    fn from_str(text: &str) -> Result<LengthUnit, UnitError> {
        match text.trim().to_lowercase().as_str() {
            // U+00B5 (micro sign) and U+03BC (Greek mu) look alike and both occur.
            "um" | "\u{b5}m" | "\u{3bc}m" | "micron" | "microns" | "micrometre" | "micrometres"
            | "micrometer" | "micrometers" => Ok(LengthUnit::Micrometre),
            "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => Ok(LengthUnit::Millimetre),
            "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters" => Ok(LengthUnit::Centimetre),
            "m" | "metre" | "metres" | "meter" | "meters" => Ok(LengthUnit::Metre),
            "in" | "\"" | "inch" | "inches" => Ok(LengthUnit::Inch),
            "ft" | "foot" | "feet" => Ok(LengthUnit::Foot),
            _ => Err(UnitError::UnknownUnit {
                quantity: "length",
                unit: text.trim().to_string(),
                text: text.to_string(),
                known: "um, mm, cm, m, in, ft",
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_symbol_and_name_is_read_back() {
        for unit in LengthUnit::ALL {
            assert_eq!(unit.symbol().parse::<LengthUnit>().unwrap(), unit);
            assert_eq!(unit.name().parse::<LengthUnit>().unwrap(), unit);
        }
        assert_eq!(
            " Millimeter ".parse::<LengthUnit>().unwrap(),
            LengthUnit::Millimetre
        );
        assert_eq!("\u{3bc}m".parse::<LengthUnit>().unwrap(), LengthUnit::Micrometre);
        assert!("furlong".parse::<LengthUnit>().is_err());
    }

    #[test]
    fn records_hold_the_symbol() {
        assert_eq!(serde_json::to_string(&LengthUnit::Metre).unwrap(), "\"m\"");
        assert_eq!(
            serde_json::from_str::<LengthUnit>("\"inch\"").unwrap(),
            LengthUnit::Inch
        );
        let error = serde_json::from_str::<LengthUnit>("\"parsec\"")
            .unwrap_err()
            .to_string();
        assert!(error.contains("parsec") && error.contains("mm"), "{error}");
    }
}
