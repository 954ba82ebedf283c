//! The materials of a scene: those that it defines itself, and those of the database, which is opened when the first of
//! them is asked for.

use super::setup;
use super::volume_scene::text::{MaterialTable, span_of};
use crate::material::database::Database;
use crate::material::law::{Law, LawError};
use crate::units;
use crate::units::document::{Document, Mistake};
use std::path::Path;
use toml::Spanned;

/// A material of a scene.
#[derive(Clone, Debug)]
pub struct SceneMaterial {
    /// Its id.
    pub id: String,
    /// Its law.
    pub law: Law,
    /// Mass per volume \[t/mm³\], if known.
    pub density: Option<f64>,
    /// Does it come from the database?
    pub from_database: bool,
    /// Is the database's record synthetic?
    pub synthetic: bool,
}

/// Tonnes per cubic millimetre in a gram per cubic centimetre.
const GRAM_PER_CM3: f64 = 1e-9;

/// The materials of a scene at hand and taken.
pub(super) struct Shelf<'a> {
    document: &'a Document,
    own: Vec<SceneMaterial>,
    folder: &'a Path,
    database: Option<Database>,
    pub taken: Vec<SceneMaterial>,
}

impl<'a> Shelf<'a> {
    pub fn new(
        document: &'a Document,
        texts: &[Spanned<MaterialTable>],
        folder: &'a Path,
    ) -> Result<Shelf<'a>, Mistake> {
        let mut own: Vec<SceneMaterial> = Vec::new();
        for text in texts {
            let material = read_material(document, text)?;
            if own.iter().any(|m| m.id == material.id) {
                let message = format!("material {:?} stands twice", material.id);
                return Err(document.mistake(&span_of(text, "id"), message));
            }
            own.push(material);
        }
        Ok(Shelf {
            document,
            own,
            folder,
            database: None,
            taken: Vec::new(),
        })
    }

    /// The number of the material `id` among those taken.
    pub fn take(&mut self, id: &Spanned<String>) -> Result<u8, Mistake> {
        if let Some(index) = self.taken.iter().position(|m| m.id == *id.get_ref()) {
            return Ok(index as u8);
        }
        let index = u8::try_from(self.taken.len()).map_err(|_| {
            self.document
                .mistake(&id.span(), "found more than 256 materials in one scene")
        })?;
        let material = match self.own.iter().find(|m| m.id == *id.get_ref()) {
            Some(own) => own.clone(),
            None => self.borrow(id)?,
        };
        self.taken.push(material);
        Ok(index)
    }

    fn borrow(&mut self, id: &Spanned<String>) -> Result<SceneMaterial, Mistake> {
        let fail = |reason: String| {
            let message = format!("{reason}; or define it here with [[material]]");
            self.document.mistake(&id.span(), message)
        };
        if self.database.is_none() {
            self.database = Some(Database::open(self.folder).map_err(|e| fail(e.to_string()))?);
        }
        let Some(database) = &self.database else {
            return Err(fail(format!("no database {}", self.folder.display())));
        };
        let record = database.find(id.get_ref()).map_err(|e| fail(e.to_string()))?;
        Ok(SceneMaterial {
            id: record.id.clone(),
            law: record.law().map_err(|e| fail(e.to_string()))?,
            density: Some(record.density_g_per_cm3 * GRAM_PER_CM3),
            from_database: true,
            synthetic: record.synthetic,
        })
    }
}

/// A text under a key of a material.
fn text_of(
    document: &Document,
    table: &Spanned<MaterialTable>,
    key: &str,
) -> Result<Option<Spanned<String>>, Mistake> {
    let Some(value) = table.get_ref().get(key) else {
        return Ok(None);
    };
    match value.get_ref().as_str() {
        Some(text) => Ok(Some(Spanned::new(value.span(), text.to_string()))),
        None => {
            let message = format!("found {key} = {}, expected a text in quotes", value.get_ref());
            Err(document.mistake(&value.span(), message))
        }
    }
}

fn read_material(document: &Document, table: &Spanned<MaterialTable>) -> Result<SceneMaterial, Mistake> {
    let Some(id) = text_of(document, table, "id")? else {
        return Err(document.mistake(&table.span(), "missing field `id` of [[material]]"));
    };
    let density = match text_of(document, table, "density")? {
        Some(text) => Some(super::volume_scene::sets::density(document, &text)?),
        None => None,
    };
    Ok(SceneMaterial {
        id: id.into_inner(),
        law: linear_law(document, table)?,
        density,
        from_database: false,
        synthetic: false,
    })
}

fn linear_law(document: &Document, table: &Spanned<MaterialTable>) -> Result<Law, Mistake> {
    let known = ["id", "density", "young", "poisson"];
    if let Some((key, value)) = table.get_ref().iter().find(|(k, _)| !known.contains(&k.as_str())) {
        let message = format!("unknown field `{key}`, expected one of {known:?}");
        return Err(document.mistake(&value.span(), message));
    }
    let missing =
        |key: &str| document.mistake(&table.span(), format!("missing field `{key}` of [[material]]"));
    let young = text_of(document, table, "young")?.ok_or_else(|| missing("young"))?;
    let young_mpa = setup::quantity(document, &young, units::stress)?;
    let value = table.get_ref().get("poisson").ok_or_else(|| missing("poisson"))?;
    let poisson = number(value.get_ref()).ok_or_else(|| {
        let message = format!("found poisson = {}, expected a number", value.get_ref());
        document.mistake(&value.span(), message)
    })?;
    Law::linear_isotropic(young_mpa, poisson).map_err(|e| {
        let key = if matches!(e, LawError::Poisson(_)) {
            "poisson"
        } else {
            "young"
        };
        document.mistake(&span_of(table, key), e.to_string())
    })
}

fn number(value: &toml::Value) -> Option<f64> {
    match value {
        toml::Value::Float(x) => Some(*x),
        toml::Value::Integer(i) => Some(*i as f64),
        _ => None,
    }
}
