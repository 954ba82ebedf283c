//! A laboratory as people write it. `docs/formats.md` explains every key; [`super::read`] checks the values.

use crate::fem::measurement_set::card::MaterialText;
use crate::fem::setup::{ContactText, FixedText};
use crate::geometry::shapes::TubeArray;
use crate::material::law_text::LawText;
use serde::Deserialize;
use toml::Spanned;

/// The whole file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LaboratoryText {
    /// Version of this format.
    pub schema: Spanned<u32>,
    /// What the record of the structure, seen as one material, is to say.
    pub material: Spanned<MaterialText>,
    /// What the structure is made of.
    pub base: Spanned<BaseText>,
    /// The structure, one of four: tubes,
    pub tubes: Option<Spanned<TubesText>>,
    /// a surface that is repeated,
    pub surface: Option<Spanned<SurfaceText>>,
    /// a voxel image that is repeated,
    pub voxels: Option<Spanned<VoxelsText>>,
    /// or none, a solid block.
    pub solid: Option<Spanned<SolidText>>,
    /// The homogeneous specimen that stands for the structure in the set.
    pub specimen: Option<SpecimenText>,
    /// What holds the block.
    pub fixed: Spanned<Vec<FixedText>>,
    /// Where markers are.
    pub markers: Spanned<Vec<MarkersText>>,
    /// What is done to the block.
    pub probe: Spanned<Vec<ProbeText>>,
    /// Errors of measurement; none if absent.
    pub noise: Option<NoiseText>,
}

/// `[base]`: a record of the database, or a law in place with its density.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseText {
    /// Id of a record.
    pub record: Option<Spanned<String>>,
    /// A law in place, with `density`.
    pub law: Option<Spanned<LawText>>,
}

/// `[tubes]`: round tubes along z.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TubesText {
    /// Diameter, with unit.
    pub diameter: Spanned<String>,
    /// Distance of neighbouring axes, with unit.
    pub spacing: Spanned<String>,
    /// `hexagonal` or `square`.
    pub array: TubeArray,
    /// Tubes in a row along x, rows along y.
    pub count: [usize; 2],
    /// Height of the block, with unit.
    pub height: Spanned<String>,
    /// Elements along each side of the cell around a tube. 2 if absent.
    pub along_side: Option<usize>,
    /// Elements from a tube to its cell's border. 2 if absent.
    pub rings: Option<usize>,
    /// Elements along z. As high as half a spacing if absent.
    pub layers: Option<usize>,
}

/// `[surface]`: a closed surface whose bounding box is repeated.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceText {
    /// File of the surface.
    pub file: Spanned<String>,
    /// Unit of its numbers.
    pub unit: Option<Spanned<String>>,
    /// How often along x, y, z.
    pub repeat: Spanned<[usize; 3]>,
    /// Edge length of the elements, with unit.
    pub element_size: Spanned<String>,
}

/// `[voxels]`: a voxel image that is repeated.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VoxelsText {
    /// NRRD file.
    pub file: Spanned<String>,
    /// Unit of the spacings in it. Millimetres if absent.
    pub unit: Option<Spanned<String>>,
    /// Voxels with at least this value are material. 1 if absent.
    pub threshold: Option<f64>,
    /// Voxels along an element's edge, 1 or 2. 1 if absent.
    pub per_element: Option<Spanned<usize>>,
    /// How often along x, y, z.
    pub repeat: Spanned<[usize; 3]>,
}

/// `[solid]`: a block without holes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolidText {
    /// Edges \[mm\].
    pub size_mm: Spanned<[f64; 3]>,
    /// Edge length of the elements, with unit.
    pub element_size: Spanned<String>,
}

/// `[specimen]`: the homogeneous block in the set.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpecimenText {
    /// Edge length of its elements, with unit; a sixth of its least edge if absent.
    pub element_size: Spanned<String>,
}

/// `[[markers]]`: a grid of markers on a face of the block.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkersText {
    /// `x-`, `x+`, `y-`, `y+`, `z-` or `z+`.
    pub face: Spanned<String>,
    /// How many along the two other axes, in their order x, y, z.
    pub count: Spanned<[usize; 2]>,
}

/// `[[probe]]`: one place where the block is pressed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeText {
    /// Its name.
    pub name: Spanned<String>,
    /// Middle of the patch, on a face \[mm\].
    pub point_mm: Spanned<[f64; 3]>,
    /// Direction of the press.
    pub direction: Spanned<[f64; 3]>,
    /// Radius of the patch, with unit.
    pub radius: Spanned<String>,
    /// Sizes of the force, rising \[N\].
    pub forces_n: Spanned<Vec<f64>>,
    /// Direction of the force, where a probe that sticks also drags: that of the press if absent.
    pub drags: Option<Spanned<[f64; 3]>>,
    /// Not for the fit, but for comparison.
    pub held_out: Option<bool>,
}

impl ProbeText {
    /// The keys that say where the force acts.
    pub fn contact(&self) -> ContactText {
        ContactText {
            point_mm: self.point_mm.clone(),
            direction: self.direction.clone(),
            radius: self.radius.clone(),
        }
    }
}

/// `[noise]`: errors of measurement.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoiseText {
    /// Standard deviation of each component, with unit.
    pub deviation: Spanned<String>,
    /// Seed of the random numbers. 1 if absent.
    pub seed: Option<u64>,
}
