//! Numbers with a unit, as a person writes them: `25 mm`, `12N`, `300 kPa`, `1070 kg/m3`.

use super::LengthUnit;
use thiserror::Error;

/// A quantity that could not be read. Each message says what was found, what was expected, and what to write.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum UnitError {
    #[error("\"{text}\" is no {quantity}: expected a number and a unit, such as \"{example}\"")]
    NotANumber {
        quantity: &'static str,
        text: String,
        example: &'static str,
    },
    #[error("\"{text}\" is a number without a unit: write a {quantity} with its unit, such as \"{example}\"")]
    NoUnit {
        quantity: &'static str,
        text: String,
        example: &'static str,
    },
    #[error("\"{unit}\" (in \"{text}\") is no unit of {quantity}: expected one of {known}")]
    UnknownUnit {
        quantity: &'static str,
        unit: String,
        text: String,
        known: &'static str,
    },
    #[error("\"{text}\" is not finite: expected a {quantity} such as \"{example}\"")]
    NotFinite {
        quantity: &'static str,
        text: String,
        example: &'static str,
    },
}

/// A length \[mm\] from text such as `25 mm`, `2.5cm`, `1 in`.
///
/// # Errors
/// [`UnitError`] for a missing or unknown unit, and for text that is no finite number.
pub fn length(text: &str) -> Result<f64, UnitError> {
    let (value, unit) = split("length", text, "25 mm")?;
    let unit: LengthUnit = unit.parse().map_err(|error| match error {
        UnitError::UnknownUnit {
            quantity,
            unit,
            known,
            ..
        } => UnitError::UnknownUnit {
            quantity,
            unit,
            text: text.to_string(),
            known,
        },
        other => other,
    })?;
    finite("length", text, "25 mm", value * unit.to_mm())
}

/// A force \[N\] from text such as `12 N`, `350 mN`, `0.2 kN`.
///
/// # Errors
/// As [`length`]. Grams and kilograms are refused: a mass is no force.
pub fn force(text: &str) -> Result<f64, UnitError> {
    scaled("force", text, "12 N", "N, mN, kN", |unit| match unit {
        "N" => Some(1.0),
        "mN" => Some(1e-3),
        "kN" => Some(1e3),
        _ => None,
    })
}

/// A stress or a modulus \[MPa\] from text such as `0.3 MPa`, `300 kPa`, `0.3 N/mm2`.
///
/// # Errors
/// As [`length`]. Case matters: a `mPa` is a billionth of a `MPa`, and neither `mPa` nor `mpa` is accepted.
pub fn stress(text: &str) -> Result<f64, UnitError> {
    scaled(
        "stress",
        text,
        "0.3 MPa",
        "Pa, kPa, MPa, GPa, N/mm2, N/cm2, N/m2",
        |unit| match unit {
            "Pa" | "N/m2" | "N/m²" | "N/m^2" => Some(1e-6),
            "kPa" => Some(1e-3),
            "MPa" | "N/mm2" | "N/mm²" | "N/mm^2" => Some(1.0),
            "GPa" => Some(1e3),
            "N/cm2" | "N/cm²" | "N/cm^2" => Some(1e-2),
            _ => None,
        },
    )
}

/// A stiffness \[N/mm\] from text such as `8 N/mm`, `2 kN/m`.
///
/// # Errors
/// As [`length`].
pub fn stiffness(text: &str) -> Result<f64, UnitError> {
    let known = "N/mm, N/cm, N/m, kN/mm, kN/m, mN/mm";
    scaled("stiffness", text, "8 N/mm", known, |unit| match unit {
        "N/mm" | "kN/m" => Some(1.0),
        "N/cm" => Some(1e-1),
        "N/m" | "mN/mm" => Some(1e-3),
        "kN/mm" => Some(1e3),
        _ => None,
    })
}

/// A mass \[tonne\] from text such as `120 g`, `0.4 kg`.
///
/// # Errors
/// As [`length`].
pub fn mass(text: &str) -> Result<f64, UnitError> {
    scaled("mass", text, "120 g", "mg, g, kg, t", |unit| match unit {
        "mg" => Some(1e-9),
        "g" => Some(1e-6),
        "kg" => Some(1e-3),
        "t" => Some(1.0),
        _ => None,
    })
}

/// A density \[tonne/mm³\] from text such as `1070 kg/m3`, `1.07 g/cm3`. The tonne is the unit of mass that goes with
/// N and mm: 1 N = 1 t · mm/s². So 1000 kg/m³ is 1e-9 t/mm³.
///
/// # Errors
/// As [`length`].
pub fn density(text: &str) -> Result<f64, UnitError> {
    scaled(
        "density",
        text,
        "1070 kg/m3",
        "kg/m3, g/cm3, t/m3, t/mm3",
        |unit| match unit {
            "kg/m3" | "kg/m³" | "kg/m^3" => Some(1e-12),
            "g/cm3" | "g/cm³" | "g/cm^3" | "t/m3" | "t/m³" | "t/m^3" => Some(1e-9),
            "t/mm3" | "t/mm³" | "t/mm^3" => Some(1.0),
            _ => None,
        },
    )
}

/// An inverse modulus \[1/MPa\], as D1 of a rubber, from text such as `0.02 1/MPa`.
///
/// # Errors
/// As [`length`].
pub fn compliance(text: &str) -> Result<f64, UnitError> {
    scaled(
        "compliance",
        text,
        "0.02 1/MPa",
        "1/MPa, 1/kPa, 1/Pa, mm2/N",
        |unit| match unit {
            "1/MPa" | "/MPa" | "mm2/N" | "mm²/N" | "mm^2/N" => Some(1.0),
            "1/kPa" | "/kPa" => Some(1e3),
            "1/Pa" | "/Pa" | "m2/N" | "m²/N" | "m^2/N" => Some(1e6),
            _ => None,
        },
    )
}

fn scaled(
    quantity: &'static str,
    text: &str,
    example: &'static str,
    known: &'static str,
    factor: impl Fn(&str) -> Option<f64>,
) -> Result<f64, UnitError> {
    let (value, unit) = split(quantity, text, example)?;
    match factor(unit) {
        Some(factor) => finite(quantity, text, example, value * factor),
        None => Err(UnitError::UnknownUnit {
            quantity,
            unit: unit.to_string(),
            text: text.to_string(),
            known,
        }),
    }
}

/// The number and the unit behind it. The number is the longest prefix that reads as one, so `1e3 mm` and `12N` both
/// work, and `1 em` does not lose its `e`.
pub(super) fn split<'a>(
    quantity: &'static str,
    text: &'a str,
    example: &'static str,
) -> Result<(f64, &'a str), UnitError> {
    let text = text.trim();
    let numeral = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
    let mut end = text.find(|c| !numeral(c)).unwrap_or(text.len());
    while end > 0 {
        // All characters before `end` are ASCII, so every cut is at a character.
        if let Ok(value) = text[..end].parse::<f64>() {
            let unit = text[end..].trim();
            if unit.is_empty() {
                return Err(UnitError::NoUnit {
                    quantity,
                    text: text.to_string(),
                    example,
                });
            }
            return Ok((value, unit));
        }
        end -= 1;
    }
    Err(UnitError::NotANumber {
        quantity,
        text: text.to_string(),
        example,
    })
}

pub(super) fn finite(
    quantity: &'static str,
    text: &str,
    example: &'static str,
    value: f64,
) -> Result<f64, UnitError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(UnitError::NotFinite {
            quantity,
            text: text.to_string(),
            example,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    #[test]
    fn quantities_come_out_in_newtons_millimetres_and_megapascals() {
        // Definitions of the units; 1 in = 25.4 mm by the 1959 agreement.
        for (text, expected) in [
            ("25 mm", 25.0),
            ("2.5cm", 25.0),
            ("0.25 m", 250.0),
            ("1 in", 25.4),
            ("-3e2 um", -0.3),
        ] {
            assert_relative_eq!(length(text).unwrap(), expected, max_relative = 1e-15);
        }
        for (text, expected) in [("12N", 12.0), ("350 mN", 0.35), ("0.2 kN", 200.0)] {
            assert_relative_eq!(force(text).unwrap(), expected, max_relative = 1e-15);
        }
        for (text, expected) in [
            ("0.3 MPa", 0.3),
            ("300 kPa", 0.3),
            ("30 N/cm²", 0.3),
            ("2 GPa", 2000.0),
        ] {
            assert_relative_eq!(stress(text).unwrap(), expected, max_relative = 1e-15);
        }
        for (text, expected) in [
            ("8 N/mm", 8.0),
            ("2 kN/m", 2.0),
            ("500 N/m", 0.5),
            ("20N/cm", 2.0),
        ] {
            assert_relative_eq!(stiffness(text).unwrap(), expected, max_relative = 1e-15);
        }
        for (text, expected) in [("120 g", 1.2e-4), ("0.12 kg", 1.2e-4), ("3 mg", 3e-9)] {
            assert_relative_eq!(mass(text).unwrap(), expected, max_relative = 1e-15);
        }
        for text in ["1070 kg/m3", "1.07 g/cm^3", "1.07 t/m³"] {
            assert_relative_eq!(density(text).unwrap(), 1.07e-9, max_relative = 1e-14);
        }
    }

    #[test]
    fn mistakes_name_what_was_found_and_what_to_write() {
        assert_eq!(
            length("25").unwrap_err(),
            UnitError::NoUnit {
                quantity: "length",
                text: "25".into(),
                example: "25 mm"
            }
        );
        for (message, parts) in [
            (force("2 kg").unwrap_err().to_string(), ["\"kg\"", "mN"]),
            (stress("3 mPa").unwrap_err().to_string(), ["\"mPa\"", "MPa"]),
            (length("long").unwrap_err().to_string(), ["\"long\"", "25 mm"]),
            (
                length("1e400 mm").unwrap_err().to_string(),
                ["1e400 mm", "not finite"],
            ),
            (length("3 yd").unwrap_err().to_string(), ["3 yd", "cm"]),
        ] {
            assert!(parts.iter().all(|part| message.contains(part)), "{message}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_answered(text in "\\PC{0,12}") {
            for read in [length, force, stress, stiffness, mass, density, compliance] {
                if let Ok(value) = read(&text) {
                    prop_assert!(value.is_finite());
                }
            }
        }
    }
}
