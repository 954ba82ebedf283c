//! The rules of `[palette]` as people write them, and their reading: what must not touch, what belongs on the surface, what
//! the whole may weigh and cost. [`super::rules`] turns them into a [`super::space::Space`].

use super::goal::BaseMaterial;
use super::goal_text::PaletteText;
use super::rules::{Face, Rules, SurfaceRule};
use crate::units::document::{Document, Mistake};
use crate::units::price::{self, Per};
use crate::units::{self, UnitError};
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;

/// Ids of materials.
pub type Ids = Spanned<Vec<Spanned<String>>>;

/// `[[palette.surface]]`: one of `never` and `only`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceText {
    /// "top", "bottom", "sides" or "outside".
    pub face: Spanned<String>,
    /// Materials that must not be there.
    pub never: Option<Ids>,
    /// The materials that may be there, no others.
    pub only: Option<Ids>,
}

/// `[palette.price]`: for each material's id a price.
pub type PriceText = Spanned<BTreeMap<String, Spanned<String>>>;

const G_PER_TONNE: f64 = 1e6;
const MM3_PER_CM3: f64 = 1e3;

/// Reads the rules.
///
/// # Errors
/// [`Mistake`]: a material that the palette lacks, a pair that is none, an unknown face, a quantity that is not above zero,
/// a price that is missing or in another currency.
pub fn read_rules(
    document: &Document,
    text: &PaletteText,
    palette: &[BaseMaterial],
) -> Result<Rules, Mistake> {
    let reader = Reader { document, palette };
    let mut rules = Rules {
        apart: reader.apart(text)?,
        surface: reader.surface(text)?,
        most_mass_g: f64::INFINITY,
        most_cost: f64::INFINITY,
        prices_per_cm3: Vec::new(),
        currency: None,
        cost_weight_mm: 0.0,
        apart_at: text.apart.as_ref().map_or(0..0, Spanned::span),
        most_materials_at: text.most_materials.as_ref().map_or(0..0, Spanned::span),
        most_mass_at: text.most_mass.as_ref().map_or(0..0, Spanned::span),
        most_cost_at: text.most_cost.as_ref().map_or(0..0, Spanned::span),
    };
    if let Some(mass) = &text.most_mass {
        let read = |text: &str| units::mass(text).map(|tonnes| (tonnes, String::new()));
        rules.most_mass_g = G_PER_TONNE * reader.above_zero(mass, read, "120 g")?.0;
    }
    if let Some(prices) = &text.price {
        reader.prices(prices, &mut rules)?;
    }
    if let Some(cost) = &text.most_cost {
        rules.most_cost = reader.money(cost, price::money, &rules, "most_cost")?;
    }
    if let Some(weight) = &text.cost_weight {
        rules.cost_weight_mm = reader.money(weight, price::length_per_money, &rules, "cost_weight")?;
    }
    Ok(rules)
}

struct Reader<'a> {
    document: &'a Document,
    palette: &'a [BaseMaterial],
}

impl Reader<'_> {
    fn index(&self, id: &str) -> Option<u8> {
        let place = self.palette.iter().position(|m| m.record.id == id)?;
        u8::try_from(place).ok()
    }

    fn material(&self, id: &Spanned<String>) -> Result<u8, Mistake> {
        self.index(id.get_ref())
            .ok_or_else(|| self.document.mistake(&id.span(), self.absent(id.get_ref())))
    }

    fn absent(&self, id: &str) -> String {
        let known: Vec<&str> = self.palette.iter().map(|m| m.record.id.as_str()).collect();
        format!(
            "material {id:?} is not in the palette, expected one of {}",
            known.join(", ")
        )
    }

    fn apart(&self, text: &PaletteText) -> Result<Vec<[u8; 2]>, Mistake> {
        let pairs = text.apart.iter().flat_map(|pairs| pairs.get_ref());
        pairs
            .map(|pair| {
                let [a, b] = pair.get_ref().as_slice() else {
                    let message = format!(
                        "found {} materials, expected a pair such as [\"a\", \"b\"] of materials that must not touch",
                        pair.get_ref().len()
                    );
                    return Err(self.document.mistake(&pair.span(), message));
                };
                let (a, b) = (self.material(a)?, self.material(b)?);
                if a == b {
                    let message = "found the same material twice, expected two that must not touch";
                    return Err(self.document.mistake(&pair.span(), message));
                }
                Ok([a, b])
            })
            .collect()
    }

    fn surface(&self, text: &PaletteText) -> Result<Vec<SurfaceRule>, Mistake> {
        let rules = text.surface.iter().flatten();
        rules
            .map(|rule| {
                let face = match rule.face.get_ref().as_str() {
                    "top" => Face::Top,
                    "bottom" => Face::Bottom,
                    "sides" => Face::Sides,
                    "outside" => Face::Outside,
                    other => {
                        let message = format!(
                            "found face {other:?}, expected \"top\", \"bottom\", \"sides\" or \"outside\""
                        );
                        return Err(self.document.mistake(&rule.face.span(), message));
                    }
                };
                let (ids, listed_may) = match (&rule.never, &rule.only) {
                    (Some(ids), None) => (ids, false),
                    (None, Some(ids)) => (ids, true),
                    _ => {
                        let message = "expected either never or only beside this face: materials that must not be there, or the only ones that may";
                        return Err(self.document.mistake(&rule.face.span(), message));
                    }
                };
                if ids.get_ref().is_empty() {
                    return Err(self
                        .document
                        .mistake(&ids.span(), "found no material, expected at least one"));
                }
                let mut may = vec![!listed_may; self.palette.len()];
                for id in ids.get_ref() {
                    may[self.material(id)? as usize] = listed_may;
                }
                Ok(SurfaceRule {
                    face,
                    may,
                    at: rule.face.span(),
                })
            })
            .collect()
    }

    /// An amount above zero, and its currency if it has one.
    fn above_zero(
        &self,
        text: &Spanned<String>,
        read: impl Fn(&str) -> Result<(f64, String), UnitError>,
        example: &str,
    ) -> Result<(f64, String), Mistake> {
        let value = read(text.get_ref()).map_err(|e| self.document.mistake(&text.span(), e.to_string()))?;
        if value.0 > 0.0 {
            return Ok(value);
        }
        let message = format!(
            "found {:?}, expected a quantity above zero such as \"{example}\"",
            text.get_ref()
        );
        Err(self.document.mistake(&text.span(), message))
    }

    /// Prices of all materials, in one currency.
    fn prices(&self, text: &PriceText, rules: &mut Rules) -> Result<(), Mistake> {
        let mut prices = vec![None; self.palette.len()];
        // In the order of the file, so that of two currencies the second is the odd one.
        let mut lines: Vec<(&String, &Spanned<String>)> = text.get_ref().iter().collect();
        lines.sort_by_key(|(_, written)| written.span().start);
        for (id, written) in lines {
            let Some(m) = self.index(id) else {
                return Err(self.document.mistake(&written.span(), self.absent(id)));
            };
            let price = price::price(written.get_ref())
                .map_err(|e| self.document.mistake(&written.span(), e.to_string()))?;
            if price.amount < 0.0 {
                let message = format!(
                    "found a price of {:?}, expected none below zero",
                    written.get_ref()
                );
                return Err(self.document.mistake(&written.span(), message));
            }
            self.same_currency(written, &price.currency, &rules.currency)?;
            rules.currency = Some(price.currency);
            let density = self.palette[m as usize].record.density_g_per_cm3;
            prices[m as usize] = Some(match price.per {
                Per::Mass => price.amount / G_PER_TONNE * density,
                Per::Volume => price.amount * MM3_PER_CM3,
            });
        }
        if let Some(m) = prices.iter().position(Option::is_none) {
            let message = format!(
                "found no price of {:?}, expected one for each material of the palette",
                self.palette[m].record.id
            );
            return Err(self.document.mistake(&text.span(), message));
        }
        rules.prices_per_cm3 = prices.into_iter().flatten().collect();
        Ok(())
    }

    fn money(
        &self,
        text: &Spanned<String>,
        read: impl Fn(&str) -> Result<(f64, String), UnitError>,
        rules: &Rules,
        key: &str,
    ) -> Result<f64, Mistake> {
        let example = if key == "most_cost" {
            "4.50 EUR"
        } else {
            "0.05 mm/EUR"
        };
        let (amount, currency) = self.above_zero(text, read, example)?;
        if rules.currency.is_none() {
            let message = format!(
                "found {key} without prices, expected [palette.price] with one for each material, such as \"28 EUR/kg\""
            );
            return Err(self.document.mistake(&text.span(), message));
        }
        self.same_currency(text, &currency, &rules.currency)?;
        Ok(amount)
    }

    fn same_currency(
        &self,
        text: &Spanned<String>,
        found: &str,
        before: &Option<String>,
    ) -> Result<(), Mistake> {
        match before {
            Some(before) if before != found => {
                let message = format!(
                    "found the currency {found:?} beside {before:?}, expected one currency in a file"
                );
                Err(self.document.mistake(&text.span(), message))
            }
            _ => Ok(()),
        }
    }
}
