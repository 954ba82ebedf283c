//! `SCENE.toml` as people write it. `docs/formats.md` explains every key; [`super::scene`] checks the values.

use super::regions::RegionText;
use super::setup::{ContactText, CylinderText, FixedText, ObjectText};
use crate::geometry::axis::Axis;
use crate::geometry::cells::Style;
use crate::material::law_text::LawText;
use crate::units::document::{Document, Mistake};
use serde::Deserialize;
use toml::Spanned;

/// The whole file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneText {
    /// Version of this format.
    pub schema: Spanned<u32>,
    /// The object's name; the file's if absent.
    pub name: Option<String>,
    /// The surface.
    pub object: ObjectText,
    /// What holds the object in every case.
    #[serde(default)]
    pub fixed: Vec<FixedText>,
    /// Its regions with their materials; the first that contains a point takes it.
    pub region: Spanned<Vec<SceneRegionText>>,
    /// Materials of this scene alone.
    #[serde(default)]
    pub material: Vec<Spanned<LawText>>,
    /// Known forces, each a case of its own.
    #[serde(default)]
    pub press: Vec<PressText>,
    /// Prescribed displacements, each a case of its own.
    #[serde(default, rename = "move")]
    pub moves: Vec<MoveText>,
    /// How to solve.
    #[serde(default)]
    pub solver: SolverText,
    /// What to report.
    #[serde(default)]
    pub output: OutputText,
}

/// `[[region]]` of a scene: as in a goal, with its materials in place of a number of layers.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneRegionText {
    /// Its name.
    pub name: Spanned<String>,
    /// Two corners of a box \[mm\].
    pub box_mm: Option<Spanned<[[f64; 3]; 2]>>,
    /// A cylinder.
    pub cylinder: Option<Spanned<CylinderText>>,
    /// File of a closed surface.
    pub mesh: Option<Spanned<String>>,
    /// The axis that the layers are stacked along; z if absent.
    pub along: Option<Axis>,
    /// How the layers are cut; "flat" if absent.
    pub style: Option<Spanned<Style>>,
    /// Id of the one material.
    pub material: Option<Spanned<String>>,
    /// Ids of the layers' materials, from the lowest layer up.
    pub materials: Option<Spanned<Vec<Spanned<String>>>>,
}

impl SceneRegionText {
    /// Ids of the layers' materials, from the lowest layer up.
    ///
    /// # Errors
    /// [`Mistake`] if there is none, or both keys are given.
    pub fn layers(&self, document: &Document) -> Result<Vec<Spanned<String>>, Mistake> {
        let name = self.name.get_ref();
        match (&self.material, &self.materials) {
            (Some(one), None) => Ok(vec![one.clone()]),
            (None, Some(list)) if !list.get_ref().is_empty() => Ok(list.get_ref().clone()),
            (None, Some(list)) => {
                let message = format!(
                    "region {name:?} has an empty list of materials, expected one a layer, the lowest first"
                );
                Err(document.mistake(&list.span(), message))
            }
            (Some(_), Some(list)) => {
                let message =
                    format!("region {name:?} has both material and materials, expected one of them");
                Err(document.mistake(&list.span(), message))
            }
            (None, None) => {
                let message = format!(
                    "region {name:?} has no material, expected material = \"id\", or materials = [\"id\", …] from the lowest layer up"
                );
                Err(document.mistake(&self.name.span(), message))
            }
        }
    }

    /// The same region as a goal writes it, with `layers` layers.
    pub fn as_region(&self, layers: usize) -> RegionText {
        let span = self.materials.as_ref().map_or(self.name.span(), Spanned::span);
        RegionText {
            name: self.name.get_ref().clone(),
            box_mm: self.box_mm.clone(),
            cylinder: self.cylinder.clone(),
            mesh: self.mesh.clone(),
            layers: Some(Spanned::new(span, layers)),
            voxels: None,
            columns: None,
            along: self.along,
            style: self.style.clone(),
        }
    }
}

/// `[[press]]`: a known force spread over a patch.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PressText {
    /// Its name, which its files bear.
    pub name: Spanned<String>,
    /// Middle of the patch \[mm\].
    pub point_mm: Spanned<[f64; 3]>,
    /// Direction of the force.
    pub direction: Spanned<[f64; 3]>,
    /// Radius of the patch, with unit.
    pub radius: Spanned<String>,
    /// The forces, ascending \[N\].
    pub forces_n: Spanned<Vec<f64>>,
}

impl PressText {
    /// The keys that say where the force acts.
    pub fn contact(&self) -> ContactText {
        ContactText {
            point_mm: self.point_mm.clone(),
            direction: self.direction.clone(),
            radius: self.radius.clone(),
        }
    }
}

/// `[[move]]`: a prescribed displacement.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MoveText {
    /// Its name, which its files bear.
    pub name: Spanned<String>,
    /// "bottom" or "top".
    pub face: Option<Spanned<String>>,
    /// Two corners of a box \[mm\].
    pub box_mm: Option<Spanned<[[f64; 3]; 2]>>,
    /// A cylinder.
    pub cylinder: Option<Spanned<CylinderText>>,
    /// `[dx, dy, dz]`, or `{ z = dz }` where the other components stay free \[mm\].
    pub displacement_mm: Spanned<toml::Value>,
    /// In how many equal steps it is reported; 1 if absent.
    pub steps: Option<Spanned<usize>>,
}

impl MoveText {
    /// The place, as a support is written.
    ///
    /// # Errors
    /// [`Mistake`] unless exactly one place is given.
    pub fn place(&self, document: &Document) -> Result<FixedText, Mistake> {
        let given = [
            self.face.as_ref().map(Spanned::span),
            self.box_mm.as_ref().map(Spanned::span),
            self.cylinder.as_ref().map(Spanned::span),
        ];
        let found = given.iter().flatten().count();
        if found != 1 {
            let message = format!(
                "move {:?} has {found} places, expected one of face, box_mm, cylinder",
                self.name.get_ref()
            );
            return Err(document.mistake(&self.name.span(), message));
        }
        Ok(FixedText {
            face: self.face.clone(),
            box_mm: self.box_mm.clone(),
            cylinder: self.cylinder.clone(),
            components: None,
        })
    }

    /// The displacement's components \[mm\]; `None` where a component stays free.
    ///
    /// # Errors
    /// [`Mistake`]: not three numbers nor a table of x, y, z; a number that is not finite; nothing that moves.
    pub fn displacement(&self, document: &Document) -> Result<[Option<f64>; 3], Mistake> {
        let moved = displacement(document, &self.displacement_mm)?;
        if moved.iter().flatten().all(|d| *d == 0.0) {
            let message = "found a displacement of nothing, expected at least one component that moves";
            return Err(document.mistake(&self.displacement_mm.span(), message));
        }
        Ok(moved)
    }
}

/// A displacement as people write it \[mm\]; `None` where a component stays free.
///
/// # Errors
/// [`Mistake`]: not three numbers nor a table of x, y, z; a number that is not finite; no component.
pub fn displacement(document: &Document, text: &Spanned<toml::Value>) -> Result<[Option<f64>; 3], Mistake> {
    let wrong = |found: String| {
        let message = format!(
            "found {found}, expected [dx, dy, dz] in mm, or for instance {{ z = -2.0 }} where x and y stay free"
        );
        document.mistake(&text.span(), message)
    };
    let value = text.get_ref();
    let mut moved = [None; 3];
    match value {
        toml::Value::Array(list) if list.len() == 3 => {
            for (component, item) in moved.iter_mut().zip(list) {
                *component = Some(number(item).ok_or_else(|| wrong(value.to_string()))?);
            }
        }
        toml::Value::Table(table) if !table.is_empty() => {
            for (key, item) in table {
                let c = ["x", "y", "z"].iter().position(|k| k == key);
                let c = c.ok_or_else(|| wrong(format!("the component {key:?}")))?;
                moved[c] = Some(number(item).ok_or_else(|| wrong(format!("{key} = {item}")))?);
            }
        }
        other => return Err(wrong(other.to_string())),
    }
    Ok(moved)
}

fn number(value: &toml::Value) -> Option<f64> {
    let value = match value {
        toml::Value::Float(x) => *x,
        toml::Value::Integer(i) => *i as f64,
        _ => return None,
    };
    Some(value).filter(|x| x.is_finite())
}

/// `[solver]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolverText {
    /// Accuracy, as a share of load and displacement.
    pub tolerance: Option<Spanned<f64>>,
    /// Load steps from one level to the next; the answer does not depend on it.
    pub steps: Option<Spanned<usize>>,
    /// Newton alone, without the accelerated iteration before it.
    pub newton_only: Option<bool>,
}

/// `[output]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputText {
    /// Points to report in every case \[mm\].
    #[serde(default)]
    pub points_mm: Vec<Spanned<[f64; 3]>>,
    /// Nodes of the simulation's grid to report, from 0.
    #[serde(default)]
    pub nodes: Vec<Spanned<usize>>,
    /// How many points of the surface around each press to report.
    pub surface_points: Option<Spanned<usize>>,
    /// How far around a press they spread, with unit; three times its own radius if absent.
    pub surface_radius: Option<Spanned<String>>,
}
