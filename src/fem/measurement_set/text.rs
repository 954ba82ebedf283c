//! A measurement set as people write it. `docs/formats.md` explains every key; [`super`] checks the values.

use super::super::setup::{ContactText, FixedText};
use super::card::MaterialText;
use serde::Deserialize;
use toml::Spanned;

/// The whole file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasurementSetText {
    /// Version of this format.
    pub schema: Spanned<u32>,
    /// "measured" or "computed".
    pub origin: Spanned<String>,
    /// Of a computed set: what was computed, by what.
    pub computed_from: Option<String>,
    /// The material that was pressed.
    pub material: Spanned<MaterialText>,
    /// Its specimen.
    pub specimen: Spanned<SpecimenText>,
    /// What holds the specimen.
    pub fixed: Spanned<Vec<FixedText>>,
    /// What was done to it and what was measured.
    pub example: Spanned<Vec<ExampleText>>,
}

/// `[specimen]`: a block, or a volume mesh.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpecimenText {
    /// Edges of a block that lies between the origin and this corner \[mm\].
    pub size_mm: Option<Spanned<[f64; 3]>>,
    /// Edge length of the block's elements.
    pub element_size: Option<Spanned<String>>,
    /// "hexahedra" (the default) or "tetrahedra" for a block.
    pub elements: Option<Spanned<String>>,
    /// A volume mesh from elsewhere: MSH or VTU.
    pub mesh: Option<Spanned<String>>,
    /// Unit of the mesh's numbers.
    pub unit: Option<Spanned<String>>,
    /// "shared" (the default) or "pointwise".
    pub volumetric_strain: Option<Spanned<String>>,
}

/// `[[example]]`: one place where the specimen was pressed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExampleText {
    /// Its name.
    pub name: Spanned<String>,
    /// Middle of the patch \[mm\].
    pub point_mm: Spanned<[f64; 3]>,
    /// Direction of the press.
    pub direction: Spanned<[f64; 3]>,
    /// Radius of the patch, with unit.
    pub radius: Spanned<String>,
    /// Forces along the direction, rising \[N\].
    pub forces_n: Option<Spanned<Vec<f64>>>,
    /// Displacement of the contact point along the direction at each force \[mm\].
    pub displacements_mm: Option<Spanned<Vec<f64>>>,
    /// CSV file with displacements of points of the surface, and forces.
    pub file: Option<Spanned<String>>,
    /// Standard deviation of a displacement, with unit, where the file says none.
    pub deviation: Option<Spanned<String>>,
    /// How much its residuals count beside those of the others.
    pub weight: Option<Spanned<f64>>,
    /// Not fitted, but compared.
    pub held_out: Option<bool>,
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
