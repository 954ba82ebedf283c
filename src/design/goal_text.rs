//! `goal.toml` as people write it. `docs/formats.md` explains every key; [`super::goal`] checks the values.

use super::cells::Style;
use crate::fem::setup::{ContactText, FixedText, ObjectText, ShapeText};
use crate::geometry::axis::Axis;
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
    /// The base materials.
    pub palette: PaletteText,
    /// The force–displacement examples.
    pub example: Spanned<Vec<ExampleText>>,
}

/// `[[region]]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionText {
    /// Its name.
    pub name: String,
    /// Two corners of a box \[mm\].
    pub box_mm: Option<Spanned<[[f64; 3]; 2]>>,
    /// A cylinder.
    pub cylinder: Option<Spanned<crate::fem::setup::CylinderText>>,
    /// File of a closed surface.
    pub mesh: Option<Spanned<String>>,
    /// How many layers.
    pub layers: Spanned<usize>,
    /// The axis that the layers are stacked along; z if absent.
    pub along: Option<Axis>,
    /// How the layers are cut; "flat" if absent.
    pub style: Option<Spanned<Style>>,
}

impl RegionText {
    /// The keys that say where the region is.
    pub fn shape(&self) -> ShapeText {
        ShapeText { box_mm: self.box_mm.clone(), cylinder: self.cylinder.clone(), mesh: self.mesh.clone() }
    }
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
}

/// `[[example]]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExampleText {
    /// Its name.
    pub name: Spanned<String>,
    /// Middle of the patch \[mm\].
    pub point_mm: Spanned<[f64; 3]>,
    /// Direction of the force.
    pub direction: Spanned<[f64; 3]>,
    /// Radius of the patch, with unit.
    pub radius: Spanned<String>,
    /// The forces, ascending \[N\].
    pub forces_n: Option<Spanned<Vec<f64>>>,
    /// Displacement of the contact point along the force at each force \[mm\].
    pub displacements_mm: Option<Spanned<Vec<f64>>>,
    /// CSV file with displacements of points of the surface.
    pub file: Option<Spanned<String>>,
    /// Where the displacements come from.
    pub origin: Option<String>,
}

impl ExampleText {
    /// The keys that say where the force acts.
    pub fn contact(&self) -> ContactText {
        ContactText {
            point_mm: self.point_mm.clone(),
            direction: self.direction.clone(),
            radius: self.radius.clone(),
        }
    }
}
