//! `[material]` of a measurement set or a laboratory: what the material's record is to say beside its law.

use super::super::setup::finite;
use crate::material::check::{is_colour, is_id};
use crate::material::record::{Kind, Printability, Source};
use crate::math::Vec3;
use crate::units::document::{Document, Mistake};
use serde::Deserialize;
use toml::Spanned;

/// `[material]` as people write it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialText {
    /// Id of the record: lower-case letters, digits, hyphens.
    pub id: Spanned<String>,
    /// The name for people.
    pub name: String,
    /// Isotropic, or transversely isotropic.
    pub kind: Kind,
    /// The axis of a transversely isotropic material in the specimen; z if absent.
    pub axis: Option<Spanned<[f64; 3]>>,
    /// Display colour, `#rrggbb`.
    pub colour: Spanned<String>,
    /// Of the block, holes included; a laboratory knows it without.
    pub density_g_per_cm3: Option<Spanned<f64>>,
    /// What the measurement does not say.
    #[serde(default)]
    pub assumptions: Vec<String>,
    /// How it is made.
    pub printability: Printability,
    /// Where the measurement comes from.
    pub source: Source,
}

/// What the material's record is to say beside its law.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialCard {
    /// Id of the record.
    pub id: String,
    /// The name for people.
    pub name: String,
    /// The symmetry.
    pub kind: Kind,
    /// The axis in the specimen, a unit vector; z for an isotropic material.
    pub axis: Vec3,
    /// Display colour, `#rrggbb`.
    pub colour: String,
    /// Of the block, holes included \[g/cm³\].
    pub density_g_per_cm3: f64,
    /// What the measurement does not say.
    pub assumptions: Vec<String>,
    /// How it is made.
    pub printability: Printability,
    /// Where the measurement comes from.
    pub source: Source,
}

impl MaterialText {
    /// The card of a material with a density \[g/cm³\].
    ///
    /// # Errors
    /// [`Mistake`]: an id, a colour or an axis that is none.
    pub fn card(&self, document: &Document, density_g_per_cm3: f64) -> Result<MaterialCard, Mistake> {
        if !is_id(self.id.get_ref()) {
            let message = format!(
                "found id {:?}, expected lower-case letters, digits and hyphens",
                self.id.get_ref()
            );
            return Err(document.mistake(&self.id.span(), message));
        }
        if !is_colour(self.colour.get_ref()) {
            let message = format!("found colour {:?}, expected #rrggbb", self.colour.get_ref());
            return Err(document.mistake(&self.colour.span(), message));
        }
        Ok(MaterialCard {
            id: self.id.get_ref().clone(),
            name: self.name.clone(),
            kind: self.kind,
            axis: self.axis(document)?,
            colour: self.colour.get_ref().clone(),
            density_g_per_cm3,
            assumptions: self.assumptions.clone(),
            printability: self.printability.clone(),
            source: self.source.clone(),
        })
    }

    fn axis(&self, document: &Document) -> Result<Vec3, Mistake> {
        let Some(written) = &self.axis else {
            return Ok(Vec3::z());
        };
        let axis = finite(document, written)?;
        if axis.norm() < 1e-9 {
            let message = "found an axis of no length, expected for instance [0, 0, 1]";
            return Err(document.mistake(&written.span(), message));
        }
        if self.kind == Kind::Isotropic {
            let message = "found an axis of an isotropic material, expected none";
            return Err(document.mistake(&written.span(), message));
        }
        Ok(axis.normalize())
    }
}
