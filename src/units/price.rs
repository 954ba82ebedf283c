//! Money, and what materials cost, as a person writes them: `4.50 EUR`, `28 EUR/kg`, `0.04 EUR/cm3`, `0.05 mm/EUR`.
//!
//! The currency is a word of letters that pliant does not know and does not convert.

use super::quantity::{UnitError, finite, split};

/// What a material costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Price {
    /// Amount \[currency per tonne, or currency per mm³\].
    pub amount: f64,
    /// What the amount is for.
    pub per: Per,
    /// The currency's name.
    pub currency: String,
}

/// What a price is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Per {
    /// A mass: a tonne.
    Mass,
    /// A volume: a mm³.
    Volume,
}

const MONEY: [&str; 2] = ["amount of money", "4.50 EUR"];
const PRICE: [&str; 2] = ["price", "28 EUR/kg"];
const WORTH: [&str; 2] = ["error for a unit of cost", "0.05 mm/EUR"];

/// An amount with its currency.
///
/// # Errors
/// [`UnitError`] for a missing currency, and for text that is no finite number.
pub fn money(text: &str) -> Result<(f64, String), UnitError> {
    let [quantity, example] = MONEY;
    let (value, unit) = split(quantity, text, example)?;
    let currency =
        currency(unit).ok_or_else(|| unknown(quantity, unit, text, "a currency's name, as EUR"))?;
    Ok((finite(quantity, text, example, value)?, currency))
}

/// A price per mass or volume.
///
/// # Errors
/// As [`money`]; a unit after the slash that is no mass or volume.
pub fn price(text: &str) -> Result<Price, UnitError> {
    let [quantity, example] = PRICE;
    let (value, unit) = split(quantity, text, example)?;
    let known = "a currency per kg, g, t, cm3, ml, l, dm3, mm3 or m3, as EUR/kg";
    let wrong = || unknown(quantity, unit, text, known);
    let (word, of) = unit.split_once('/').ok_or_else(wrong)?;
    let (scale, per) = match of.trim() {
        "g" => (1e6, Per::Mass),
        "kg" => (1e3, Per::Mass),
        "t" => (1.0, Per::Mass),
        "mm3" | "mm³" | "mm^3" => (1.0, Per::Volume),
        "cm3" | "cm³" | "cm^3" | "ml" => (1e-3, Per::Volume),
        "l" | "dm3" | "dm³" | "dm^3" => (1e-6, Per::Volume),
        "m3" | "m³" | "m^3" => (1e-9, Per::Volume),
        _ => return Err(wrong()),
    };
    Ok(Price {
        amount: finite(quantity, text, example, value * scale)?,
        per,
        currency: currency(word.trim()).ok_or_else(wrong)?,
    })
}

/// A length that a unit of money is worth \[mm per currency\], with the currency.
///
/// # Errors
/// As [`money`]; a unit before the slash that is no length.
pub fn length_per_money(text: &str) -> Result<(f64, String), UnitError> {
    let [quantity, example] = WORTH;
    let (value, unit) = split(quantity, text, example)?;
    let wrong = || unknown(quantity, unit, text, "a length per currency, as mm/EUR");
    let (length, word) = unit.split_once('/').ok_or_else(wrong)?;
    let length: super::LengthUnit = length.trim().parse().map_err(|_| wrong())?;
    let currency = currency(word.trim()).ok_or_else(wrong)?;
    Ok((finite(quantity, text, example, value * length.to_mm())?, currency))
}

fn currency(word: &str) -> Option<String> {
    let named = !word.is_empty() && word.chars().all(|c| c.is_alphabetic() || "€$£¥".contains(c));
    named.then(|| word.to_string())
}

fn unknown(quantity: &'static str, unit: &str, text: &str, known: &'static str) -> UnitError {
    UnitError::UnknownUnit {
        quantity,
        unit: unit.to_string(),
        text: text.to_string(),
        known,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn prices_are_per_tonne_or_cubic_millimetre() {
        for (text, amount, per) in [
            ("28 EUR/kg", 28e3, Per::Mass),
            ("0.028 EUR / g", 28e3, Per::Mass),
            ("0.04 EUR/cm3", 4e-5, Per::Volume),
            ("40 EUR/l", 4e-5, Per::Volume),
        ] {
            let found = price(text).unwrap();
            assert!((found.amount / amount - 1.0).abs() < 1e-12, "{text}: {found:?}");
            assert_eq!((found.per, found.currency.as_str()), (per, "EUR"));
        }
        assert_eq!(money("4.50 €").unwrap(), (4.5, "€".into()));
        assert_eq!(length_per_money("0.5 cm/CHF").unwrap(), (5.0, "CHF".into()));
    }

    #[test]
    fn mistakes_name_what_to_write() {
        for (message, words) in [
            (price("28 EUR").unwrap_err().to_string(), "EUR/kg"),
            (price("28").unwrap_err().to_string(), "28 EUR/kg"),
            (price("28 EUR/hour").unwrap_err().to_string(), "EUR/hour"),
            (price("28 /kg").unwrap_err().to_string(), "EUR/kg"),
            (money("4.5").unwrap_err().to_string(), "4.50 EUR"),
            (money("4.5 1").unwrap_err().to_string(), "currency"),
            (length_per_money("1 N/EUR").unwrap_err().to_string(), "mm/EUR"),
        ] {
            assert!(message.contains(words), "{message}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_answered(text in "\\PC{0,12}") {
            if let Ok((value, _)) = money(&text) {
                prop_assert!(value.is_finite());
            }
            if let Ok(found) = price(&text) {
                prop_assert!(found.amount.is_finite());
            }
            if let Ok((value, _)) = length_per_money(&text) {
                prop_assert!(value.is_finite());
            }
        }
    }
}
