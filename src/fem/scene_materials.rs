//! The materials of a scene: those that it defines itself, and those of the database, which is opened when the first of
//! them is asked for.

use super::setup;
use crate::material::database::Database;
use crate::material::law::Law;
use crate::material::law_text::LawText;
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
        texts: &[Spanned<LawText>],
        folder: &'a Path,
    ) -> Result<Shelf<'a>, Mistake> {
        let mut own: Vec<SceneMaterial> = Vec::new();
        for text in texts {
            let material = read_material(document, text)?;
            if own.iter().any(|m| m.id == material.id) {
                let message = format!("material {:?} stands twice", material.id);
                let id = text.get_ref().id.as_ref().map(Spanned::span);
                return Err(document.mistake(&id.unwrap_or_else(|| text.span()), message));
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
            // As the scene names it: two versions of one record are two materials.
            id: id.get_ref().clone(),
            law: record.law().map_err(|e| fail(e.to_string()))?,
            density: Some(record.density_g_per_cm3 * GRAM_PER_CM3),
            from_database: true,
            synthetic: record.synthetic,
        })
    }
}

fn read_material(document: &Document, text: &Spanned<LawText>) -> Result<SceneMaterial, Mistake> {
    let (span, text) = (text.span(), text.get_ref());
    let Some(id) = &text.id else {
        return Err(document.mistake(&span, "missing field `id` of [[material]]"));
    };
    let law = text
        .law()
        .map_err(|e| document.mistake(&e.span.clone().unwrap_or(span), e.to_string()))?;
    let density = match &text.density {
        Some(text) => Some(density(document, text)?),
        None => None,
    };
    Ok(SceneMaterial {
        id: id.get_ref().clone(),
        law,
        density,
        from_database: false,
        synthetic: false,
    })
}

/// A density \[t/mm³\] above zero.
fn density(document: &Document, text: &Spanned<String>) -> Result<f64, Mistake> {
    let value = setup::quantity(document, text, units::density)?;
    if value > 0.0 {
        return Ok(value);
    }
    let message = format!("found {:?}, expected a density above zero", text.get_ref());
    Err(document.mistake(&text.span(), message))
}
