//! `goal.toml` as people write it. `docs/formats.md` explains every key; [`super::goal`] checks the values.

use super::rules_text::{Ids, PriceText, SurfaceText};
use super::voxels::rules::VoxelsText;
use crate::fem::example_text::ExampleText;
use crate::fem::regions::RegionText;
use crate::fem::setup::{FixedText, ObjectText};
use serde::Deserialize;
use toml::Spanned;

/// The whole file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GoalText {
    /// Version of this format.
    pub schema: Spanned<u32>,
    /// The object's name.
    pub name: String,
    /// The surface.
    pub object: ObjectText,
    /// What holds the object.
    pub fixed: Vec<FixedText>,
    /// Its regions, the first that contains a point takes it.
    pub region: Spanned<Vec<RegionText>>,
    /// What ties voxels together.
    pub voxels: Option<Spanned<VoxelsText>>,
    /// The base materials.
    pub palette: PaletteText,
    /// The force–displacement examples.
    pub example: Spanned<Vec<ExampleText>>,
}

/// `[palette]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaletteText {
    /// Ids of base materials. Without it, the filter below picks from the whole database.
    pub materials: Option<Spanned<Vec<Spanned<String>>>>,
    /// "isotropic" or "transversely-isotropic".
    pub kind: Option<Spanned<String>>,
    /// Largest Young's modulus at rest, with unit.
    pub stiffest: Option<Spanned<String>>,
    /// Least Young's modulus at rest, with unit.
    pub softest: Option<Spanned<String>>,
    /// Printable materials alone.
    pub printable: Option<bool>,
    /// May synthetic materials be used? No if absent.
    pub synthetic: Option<bool>,
    /// At most how many materials in one layout; any number if absent.
    pub most_materials: Option<Spanned<usize>>,
    /// The thinnest layer that may be made, with unit.
    pub least_layer: Option<Spanned<String>>,
    /// Pairs of materials that must not touch.
    pub apart: Option<Spanned<Vec<Ids>>>,
    /// What may lie on the surface.
    pub surface: Option<Vec<SurfaceText>>,
    /// Most mass of the object, with unit.
    pub most_mass: Option<Spanned<String>>,
    /// What each material costs, with currency and unit.
    pub price: Option<PriceText>,
    /// Most cost of the object, with currency.
    pub most_cost: Option<Spanned<String>>,
    /// The error that a unit of cost is worth, such as "0.05 mm/EUR".
    pub cost_weight: Option<Spanned<String>>,
}
