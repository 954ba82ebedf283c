//! The parts that goals and scenes have in common, as people write them: an object, what holds it, regions, contacts.
//! Each is read with the unit of every number and turned into the plain data that the solver takes; mistakes are
//! answered with their place in the file.

use super::elements::VolumetricStrain;
use super::example::{Contact, Example};
use super::model::Constrained;
use crate::geometry::axis::Axis;
use crate::geometry::cells::Cells;
use crate::geometry::files::{self, SurfaceFormat};
use crate::geometry::grid::Grid;
use crate::geometry::region::Region;
use crate::geometry::solid::Solid;
use crate::math::Vec3;
use crate::units::document::{Document, Mistake};
use crate::units::{self, LengthUnit, UnitError};
use serde::Deserialize;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;

/// `[object]`: the surface and its unit.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectText {
    /// File of the surface, from the folder of this file.
    pub mesh: Spanned<String>,
    /// Unit of the mesh's numbers.
    pub unit: Option<Spanned<String>>,
    /// Edge length of the elements across the layers.
    pub element_size: Option<Spanned<String>>,
}

/// `[[fixed]]`: what holds the object.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixedText {
    /// "bottom" or "top": that end of the object along the layer axis.
    pub face: Option<Spanned<String>>,
    /// Two corners of a box \[mm\].
    pub box_mm: Option<Spanned<[[f64; 3]; 2]>>,
    /// A cylinder.
    pub cylinder: Option<Spanned<CylinderText>>,
    /// Which components are held: some of "x", "y", "z". All if absent.
    pub components: Option<Spanned<String>>,
}

/// `cylinder = { axis, centre_mm, radius, from, to }`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CylinderText {
    /// Direction of the cylinder's axis.
    pub axis: Axis,
    /// The two other coordinates of its axis, in cyclic order \[mm\].
    pub centre_mm: [f64; 2],
    /// Its radius, with unit.
    pub radius: Spanned<String>,
    /// Where it begins along its axis, with unit; without end if absent.
    pub from: Option<Spanned<String>>,
    /// Where it ends, with unit; without end if absent.
    pub to: Option<Spanned<String>>,
}

/// Where a region is: one of these, or none for the rest of the object.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct ShapeText {
    /// Two corners of a box \[mm\].
    pub box_mm: Option<Spanned<[[f64; 3]; 2]>>,
    /// A cylinder.
    pub cylinder: Option<Spanned<CylinderText>>,
    /// File of a closed surface, in the object's unit.
    pub mesh: Option<Spanned<String>>,
}

/// `point_mm`, `direction`, `radius`: where a force acts.
#[derive(Clone, Debug, Deserialize)]
pub struct ContactText {
    /// Middle of the patch \[mm\].
    pub point_mm: Spanned<[f64; 3]>,
    /// Direction of the force; any length but zero.
    pub direction: Spanned<[f64; 3]>,
    /// Radius of the patch, with unit.
    pub radius: Spanned<String>,
}

/// An object as read, with what to tell the user about it.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its inside and outside.
    pub solid: Arc<Solid>,
    /// The unit of its file.
    pub unit: LengthUnit,
    /// Small defects that were survived.
    pub warnings: Vec<String>,
}

/// An object on its supports, cut into cells, with the examples that press it: what goals and scenes share.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The file that it was read from, for messages about later findings.
    pub document: Document,
    /// The object.
    pub object: Object,
    /// What holds it.
    pub fixed: Vec<FixedText>,
    /// Its cells.
    pub cells: Cells,
    /// Edge length of the elements across the layers \[mm\].
    pub element_size_mm: f64,
    /// How it is pressed.
    pub examples: Vec<Example>,
}

impl Setup {
    /// The same with other cells.
    pub fn with_cells(&self, cells: Cells) -> Setup {
        Setup {
            cells,
            ..self.clone()
        }
    }
}

/// A quantity with its unit, or a mistake that says what is expected.
///
/// # Errors
/// [`Mistake`] at the text's place.
pub fn quantity(
    document: &Document,
    text: &Spanned<String>,
    read: impl Fn(&str) -> Result<f64, UnitError>,
) -> Result<f64, Mistake> {
    read(text.get_ref()).map_err(|error| document.mistake(&text.span(), error.to_string()))
}

/// A length above zero.
///
/// # Errors
/// [`Mistake`] at the text's place.
pub fn positive_length(document: &Document, text: &Spanned<String>) -> Result<f64, Mistake> {
    let value = quantity(document, text, units::length)?;
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(document.mistake(
        &text.span(),
        format!("found {:?}, expected a length above zero", text.get_ref()),
    ))
}

/// "shared" or "pointwise": how elements sample their volumetric strain.
///
/// # Errors
/// [`Mistake`] at another word's place.
pub fn volumetric_strain(document: &Document, text: &Spanned<String>) -> Result<VolumetricStrain, Mistake> {
    match text.get_ref().as_str() {
        "shared" => Ok(VolumetricStrain::Shared),
        "pointwise" => Ok(VolumetricStrain::Pointwise),
        other => {
            let message =
                format!("found volumetric_strain = {other:?}, expected \"shared\" or \"pointwise\"");
            Err(document.mistake(&text.span(), message))
        }
    }
}

/// The unit of a file's numbers, where one is written.
///
/// # Errors
/// [`Mistake`] at the text's place.
pub fn length_unit(
    document: &Document,
    text: &Option<Spanned<String>>,
) -> Result<Option<LengthUnit>, Mistake> {
    let read = |text: &Spanned<String>| {
        let wrong = |e: UnitError| document.mistake(&text.span(), e.to_string());
        text.get_ref().parse().map_err(wrong)
    };
    text.as_ref().map(read).transpose()
}

impl ObjectText {
    /// Reads the surface.
    ///
    /// # Errors
    /// [`Mistake`]: a file that cannot be read, an implausible size, a surface with no inside.
    pub fn read(&self, document: &Document) -> Result<Object, Mistake> {
        let unit = length_unit(document, &self.unit)?;
        let path = document.resolve(self.mesh.get_ref());
        let fail = |message: String| document.mistake(&self.mesh.span(), message);
        read_object(&path, unit).map_err(fail)
    }
}

impl ObjectText {
    /// Edge length of the elements across the layers \[mm\]; about thirty along the longest side if not given.
    ///
    /// # Errors
    /// [`Mistake`] if it is not a length above zero.
    pub fn element_size_mm(&self, document: &Document, object: &Object) -> Result<f64, Mistake> {
        if let Some(size) = &self.element_size {
            return positive_length(document, size);
        }
        let (low, high) = object.solid.bounds();
        Ok((high - low).max() / 30.0)
    }
}

/// Reads a surface file and finds its inside.
///
/// # Errors
/// One sentence that names the file, what is wrong and the mend.
pub fn read_object(path: &Path, unit: Option<LengthUnit>) -> Result<Object, String> {
    let name = path.display();
    let format = SurfaceFormat::from_path(path).map_err(|e| format!("{name}: {e}"))?;
    let bytes = std::fs::read(path).map_err(|e| format!("{name}: cannot be read: {e}"))?;
    let file = files::read_surface(&bytes, format, unit).map_err(|e| format!("{name}: {e}"))?;
    let solid = Solid::new(file.mesh).map_err(|e| format!("{name}: {e}"))?;
    let mut warnings: Vec<String> = file.notes.iter().map(|w| format!("{name}: {w}")).collect();
    warnings.extend(
        solid
            .health()
            .warnings()
            .into_iter()
            .map(|w| format!("{name}: {w}")),
    );
    Ok(Object {
        solid: Arc::new(solid),
        unit: file.unit,
        warnings,
    })
}

impl ShapeText {
    /// The region; [`Region::Everything`] if no shape is given.
    ///
    /// # Errors
    /// [`Mistake`]: two shapes at once, a box without volume, a mesh that cannot be read.
    pub fn read(&self, document: &Document, unit: LengthUnit) -> Result<Region, Mistake> {
        let given = [
            self.box_mm.as_ref().map(Spanned::span),
            self.cylinder.as_ref().map(Spanned::span),
            self.mesh.as_ref().map(Spanned::span),
        ];
        let mut given = given.into_iter().flatten();
        if let (Some(_), Some(second)) = (given.next(), given.next()) {
            return Err(document.mistake(
                &second,
                "found a second shape, expected one of box_mm, cylinder, mesh",
            ));
        }
        if let Some(corners) = &self.box_mm {
            return box_region(document, corners);
        }
        if let Some(cylinder) = &self.cylinder {
            return cylinder_region(document, cylinder.get_ref());
        }
        if let Some(mesh) = &self.mesh {
            let object = read_object(&document.resolve(mesh.get_ref()), Some(unit))
                .map_err(|e| document.mistake(&mesh.span(), e))?;
            return Ok(Region::Mesh(object.solid));
        }
        Ok(Region::Everything)
    }
}

fn box_region(document: &Document, corners: &Spanned<[[f64; 3]; 2]>) -> Result<Region, Mistake> {
    let [min, max] = corners.get_ref().map(Vec3::from);
    if (0..3).all(|c| min[c] < max[c]) && (min + max).iter().all(|x| x.is_finite()) {
        return Ok(Region::Box { min, max });
    }
    let found = corners.get_ref();
    Err(document.mistake(
        &corners.span(),
        format!(
            "found corners {:?} and {:?}, expected the lower corner first, below the upper in x, y and z",
            found[0], found[1]
        ),
    ))
}

fn cylinder_region(document: &Document, text: &CylinderText) -> Result<Region, Mistake> {
    let end = |text: &Option<Spanned<String>>, open: f64| match text {
        None => Ok(open),
        Some(text) => quantity(document, text, units::length),
    };
    Ok(Region::Cylinder {
        axis: text.axis,
        centre: text.centre_mm,
        radius: positive_length(document, &text.radius)?,
        range: [end(&text.from, -1e6)?, end(&text.to, 1e6)?],
    })
}

impl FixedText {
    /// Marks the components that this support holds, `(nodes)`.
    ///
    /// # Errors
    /// [`Mistake`]: no place or several given, an unknown face or component, or a place that holds no node.
    pub fn hold(
        &self,
        document: &Document,
        grid: &Grid,
        constrained: &mut [Constrained],
    ) -> Result<(), Mistake> {
        self.hold_nodes(
            document,
            &grid.mesh.nodes,
            &|top| grid.end_nodes(top),
            constrained,
        )
    }

    /// Marks the components that this support holds among the places `nodes` \[mm\]; `end` answers the nodes at the lower
    /// (false) or upper end.
    ///
    /// # Errors
    /// As [`FixedText::hold`].
    pub fn hold_nodes(
        &self,
        document: &Document,
        nodes: &[Vec3],
        end: &dyn Fn(bool) -> Vec<usize>,
        constrained: &mut [Constrained],
    ) -> Result<(), Mistake> {
        let components = self.components(document)?;
        let (nodes, span) = match (&self.face, &self.box_mm, &self.cylinder) {
            (Some(face), None, None) => (end(is_top(document, face)?), face.span()),
            (None, Some(corners), None) => (nodes_in(&box_region(document, corners)?, nodes), corners.span()),
            (None, None, Some(cylinder)) => (
                nodes_in(&cylinder_region(document, cylinder.get_ref())?, nodes),
                cylinder.span(),
            ),
            (None, None, None) => {
                return Err(document.mistake(
                    &(0..0),
                    "found [[fixed]] without a place, expected face, box_mm or cylinder",
                ));
            }
            _ => {
                return Err(document.mistake(
                    &(0..0),
                    "found [[fixed]] with several places, expected one of face, box_mm, cylinder",
                ));
            }
        };
        if nodes.is_empty() {
            let message =
                "this place holds no node of the object: move or enlarge it, or use smaller elements";
            return Err(document.mistake(&span, message));
        }
        for node in nodes {
            for c in 0..3 {
                constrained[node][c] |= components[c];
            }
        }
        Ok(())
    }

    fn components(&self, document: &Document) -> Result<Constrained, Mistake> {
        let Some(text) = &self.components else {
            return Ok([true; 3]);
        };
        let letters = text.get_ref();
        let held = ['x', 'y', 'z'].map(|c| letters.contains(c));
        if letters.is_empty() || letters.chars().any(|c| !"xyz".contains(c)) {
            let message = format!("found components {letters:?}, expected some of \"xyz\"");
            return Err(document.mistake(&text.span(), message));
        }
        Ok(held)
    }
}

fn is_top(document: &Document, face: &Spanned<String>) -> Result<bool, Mistake> {
    match face.get_ref().as_str() {
        "bottom" => Ok(false),
        "top" => Ok(true),
        other => Err(document.mistake(
            &face.span(),
            format!("found face {other:?}, expected \"bottom\" or \"top\""),
        )),
    }
}

fn nodes_in(region: &Region, nodes: &[Vec3]) -> Vec<usize> {
    (0..nodes.len()).filter(|&n| region.contains(&nodes[n])).collect()
}

impl ContactText {
    /// The contact.
    ///
    /// # Errors
    /// [`Mistake`]: a coordinate that is not a number, a direction of no length, a radius that is not above zero.
    pub fn read(&self, document: &Document) -> Result<Contact, Mistake> {
        let point = finite(document, &self.point_mm)?;
        let direction = finite(document, &self.direction)?;
        if direction.norm() < 1e-9 {
            let message =
                "found a direction of no length, expected for instance [0, 0, -1] for a press from above";
            return Err(document.mistake(&self.direction.span(), message));
        }
        Ok(Contact {
            point,
            direction: direction.normalize(),
            radius_mm: positive_length(document, &self.radius)?,
        })
    }
}

/// A point or vector of finite numbers.
///
/// # Errors
/// [`Mistake`] at its place.
pub fn finite(document: &Document, text: &Spanned<[f64; 3]>) -> Result<Vec3, Mistake> {
    let value = Vec3::from(*text.get_ref());
    if value.iter().all(|x| x.is_finite()) {
        return Ok(value);
    }
    Err(document.mistake(
        &text.span(),
        format!("found {:?}, expected three finite numbers", text.get_ref()),
    ))
}
