//! A scene on a volume mesh as people write it, in TOML or JSON. `docs/formats.md` explains every key; the files beside
//! check the values.

use super::super::scene_text::SolverText;
use super::super::setup::CylinderText;
use crate::material::law_text::LawText;
use crate::units::document::{Document, Mistake};
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;

/// The whole file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VolumeSceneText {
    /// Version of this format.
    pub schema: Spanned<u32>,
    /// The object's name; the file's if absent.
    pub name: Option<String>,
    /// The mesh.
    pub mesh: Spanned<MeshText>,
    /// Named sets of nodes.
    #[serde(default)]
    pub set: Vec<SetText>,
    /// Materials of this scene alone.
    #[serde(default)]
    pub material: Vec<Spanned<LawText>>,
    /// Parts of the object with their materials; the first that contains an element takes it.
    pub region: Spanned<Vec<RegionText>>,
    /// What holds the object in every case.
    #[serde(default)]
    pub fixed: Vec<Spanned<FixedText>>,
    /// Rigid bodies that meet the object, in every case.
    #[serde(default)]
    pub probe: Vec<ProbeText>,
    /// A flat floor, in every case.
    pub floor: Option<Spanned<FloorText>>,
    /// What is done to it, each a case of its own.
    pub load: Spanned<Vec<LoadText>>,
    /// How to solve.
    #[serde(default)]
    pub solver: SolverText,
    /// What to report.
    #[serde(default)]
    pub output: OutputText,
}

/// `[mesh]`: a file, or arrays.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshText {
    /// MSH, VTU or JSON, from the folder of this file.
    pub file: Option<Spanned<String>>,
    /// Unit of the file's numbers.
    pub unit: Option<Spanned<String>>,
    /// Nodes \[mm\].
    pub nodes_mm: Option<Spanned<Vec<[f64; 3]>>>,
    /// Tetrahedra, nodes from 0.
    pub tetrahedra: Option<Spanned<Vec<[u32; 4]>>>,
    /// Hexahedra in VTK's order, nodes from 0.
    pub hexahedra: Option<Spanned<Vec<[u32; 8]>>>,
    /// "shared" or "pointwise": against locking, or as the papers have it.
    pub volumetric_strain: Option<Spanned<String>>,
}

/// `[[set]]`: nodes with a name.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SetText {
    /// Its name.
    pub name: Spanned<String>,
    /// A group of the mesh file.
    pub group: Option<Spanned<String>>,
    /// Nodes, as the file numbers them.
    pub nodes: Option<Spanned<Vec<u64>>>,
    /// Two corners of a box \[mm\].
    pub box_mm: Option<Spanned<[[f64; 3]; 2]>>,
    /// A cylinder.
    pub cylinder: Option<Spanned<CylinderText>>,
    /// true: those of them that lie on the boundary alone.
    pub surface: Option<bool>,
}

/// `[[region]]`: elements with their material.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionText {
    /// Its name.
    pub name: Spanned<String>,
    /// A group of elements of the mesh file.
    pub group: Option<Spanned<String>>,
    /// Elements, as the file numbers them.
    pub elements: Option<Spanned<Vec<u64>>>,
    /// Two corners of a box \[mm\]: elements whose middle lies in it.
    pub box_mm: Option<Spanned<[[f64; 3]; 2]>>,
    /// A cylinder.
    pub cylinder: Option<Spanned<CylinderText>>,
    /// Id of the material.
    pub material: Spanned<String>,
    /// Its axis (of a transversely isotropic material); its own if absent.
    pub axis: Option<Spanned<[f64; 3]>>,
}

/// `[[fixed]]`: a set that is held.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FixedText {
    /// Name of the set.
    pub set: Spanned<String>,
    /// Which components are held: some of "xyz". All if absent.
    pub components: Option<Spanned<String>>,
}

/// `[[load]]`: a case. Everything in it grows together from rest.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadText {
    /// Its name, which its files bear.
    pub name: Spanned<String>,
    /// Shares of everything below, ascending; or how many equal steps. 1 if absent.
    pub levels: Option<Spanned<LevelsText>>,
    /// Node by node: `[node, fx, fy, fz]` \[N\].
    pub forces_n: Option<Spanned<Vec<Spanned<[f64; 4]>>>>,
    /// Acceleration of gravity \[m/s²\].
    pub gravity_m_s2: Option<Spanned<[f64; 3]>>,
    /// Forces over sets.
    #[serde(default)]
    pub force: Vec<ForceText>,
    /// Pressures on the boundary.
    #[serde(default)]
    pub pressure: Vec<PressureText>,
    /// Displacements.
    #[serde(default, rename = "move")]
    pub moves: Vec<MoveText>,
    /// Where probes go, or how they press.
    #[serde(default)]
    pub push: Vec<PushText>,
}

/// `[[load.push]]`: a probe that travels along its direction, or is pressed along it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PushText {
    /// Name of the probe, or "floor".
    pub probe: Spanned<String>,
    /// Its travel \[mm\]: one number, which grows with the load, or a list of one for each level.
    pub travel_mm: Option<Spanned<NumbersText>>,
    /// The force that presses it \[N\], likewise.
    pub force_n: Option<Spanned<NumbersText>>,
    /// A way in addition \[mm\], which grows with the load.
    pub across_mm: Option<Spanned<[f64; 3]>>,
}

/// One number, or one for each level.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum NumbersText {
    /// At a share of 1.
    One(f64),
    /// At each level.
    List(Vec<f64>),
}

/// `friction`.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum FrictionText {
    /// Coulomb's coefficient.
    Coefficient(f64),
    /// "none" or "sticking".
    Word(String),
}

/// `[[probe]]`: a rigid body.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeText {
    /// Its name.
    pub name: Spanned<String>,
    /// "sphere", "disc", "cylinder", "box" or "mesh".
    pub shape: Spanned<String>,
    /// Radius, with unit.
    pub radius: Option<Spanned<String>>,
    /// Whole length of a cylinder, with unit.
    pub length: Option<Spanned<String>>,
    /// Extents of a box \[mm\].
    pub size_mm: Option<Spanned<[f64; 3]>>,
    /// Radius of rounded edges, with unit; 0 if absent.
    pub edge: Option<Spanned<String>>,
    /// A closed surface.
    pub mesh: Option<Spanned<String>>,
    /// Unit of its numbers.
    pub unit: Option<Spanned<String>>,
    /// Where it starts \[mm\]: its middle, of a disc the middle of its face, of a mesh its offset.
    pub position_mm: Spanned<[f64; 3]>,
    /// Which way it is pushed.
    pub direction: Spanned<[f64; 3]>,
    /// The axis of a cylinder or box, or which way a disc's face looks.
    pub axis: Option<Spanned<[f64; 3]>>,
    /// The x axis of a box.
    pub across: Option<Spanned<[f64; 3]>>,
    /// What resists sliding; nothing if absent.
    pub friction: Option<Spanned<FrictionText>>,
    /// A set of nodes that stay on it and slide.
    pub holds: Option<Spanned<String>>,
}

/// `[floor]`: a plane.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FloorText {
    /// A point of it \[mm\].
    pub point_mm: Spanned<[f64; 3]>,
    /// Which way it looks; z if absent.
    pub normal: Option<Spanned<[f64; 3]>>,
    /// What resists sliding; nothing if absent.
    pub friction: Option<Spanned<FrictionText>>,
}

/// `levels`.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum LevelsText {
    /// So many equal steps.
    Count(usize),
    /// Shares.
    Shares(Vec<f64>),
}

/// `[[load.force]]`: a force over a set of nodes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceText {
    /// Name of the set.
    pub set: Spanned<String>,
    /// The whole force, spread equally over the nodes \[N\].
    pub total_n: Option<Spanned<[f64; 3]>>,
    /// The force on each node \[N\].
    pub each_n: Option<Spanned<[f64; 3]>>,
}

/// `[[load.pressure]]`: an even pressure on the faces of the boundary all of whose nodes are in the set.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PressureText {
    /// Name of the set.
    pub set: Spanned<String>,
    /// Pressure into the object, with unit.
    pub pressure: Spanned<String>,
}

/// `[[load.move]]`: a set that is displaced.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MoveText {
    /// Name of the set.
    pub set: Spanned<String>,
    /// `[dx, dy, dz]`, or `{ z = dz }` where the other components stay free \[mm\].
    pub displacement_mm: Option<Spanned<toml::Value>>,
    /// `{ x = [x1, x2, …], z = [z1, z2, …] }`: one waypoint a level \[mm\].
    pub path_mm: Option<Spanned<BTreeMap<String, Spanned<Vec<f64>>>>>,
}

/// `[output]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputText {
    /// Points to report \[mm\].
    #[serde(default)]
    pub points_mm: Vec<Spanned<[f64; 3]>>,
    /// A fine surface that follows the mesh, written for every level.
    pub surface: Option<SurfaceText>,
    /// At which levels strains and stresses stand in the JSON: "last" (the default), "all" or "none".
    pub strains: Option<Spanned<String>>,
}

/// `surface = { file, unit, follow }`: a surface of more detail than the mesh.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceText {
    /// STL, OBJ, PLY or 3MF, from the folder of this file.
    pub file: Spanned<String>,
    /// Unit of the file's numbers.
    pub unit: Option<Spanned<String>>,
    /// "moving-least-squares" (the default), which is smooth across elements, or "elements": by their shape functions.
    pub follow: Option<Spanned<String>>,
}

impl VolumeSceneText {
    /// Is this document a scene on a volume mesh?
    pub fn fits(document: &Document) -> bool {
        #[derive(Deserialize)]
        struct Keys {
            mesh: Option<serde::de::IgnoredAny>,
        }
        document.parse::<Keys>().is_ok_and(|keys| keys.mesh.is_some())
    }
}

/// Some of "x", "y", "z", as written; all if absent.
///
/// # Errors
/// [`Mistake`] for other letters, or none.
pub fn components(document: &Document, text: &Option<Spanned<String>>) -> Result<[bool; 3], Mistake> {
    let Some(text) = text else {
        return Ok([true; 3]);
    };
    let letters = text.get_ref();
    if letters.is_empty() || letters.chars().any(|c| !"xyz".contains(c)) {
        let message = format!("found components {letters:?}, expected some of \"xyz\"");
        return Err(document.mistake(&text.span(), message));
    }
    Ok(['x', 'y', 'z'].map(|c| letters.contains(c)))
}
