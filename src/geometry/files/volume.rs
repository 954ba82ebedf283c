//! From bytes to a volume mesh in millimetres, with the named parts that its file knows.
//!
//! Readers answer cells of all dimensions as the file lists them (`RawVolume`); what makes a mesh of them is the same
//! for all: one kind of element, each turned so that its volume is positive, no element flat or folded, no node loose.
//! Nodes that only edges, faces or the middles of curved elements' edges name are left out; the others keep the numbers
//! of the file, and so do elements.

use super::volume_error::VolumeFileError;
use super::{arrays, msh, vtu_read};
use crate::geometry::volume::{CORNERS, Elements, VolumeMesh};
use crate::math::{Mat3, Vec3};
use crate::units::LengthUnit;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;
use std::path::Path;

/// Largest extents that a mesh may have \[mm\]: a specimen of a millimetre, a mattress.
pub(super) const SIZES: RangeInclusive<f64> = 0.5..=3000.0;
/// Below this size a unit that is ten times too small is likelier than such an object \[mm\].
const SMALL: f64 = 5.0;
/// An element is flat below this share of its longest edge, cubed: rounding errors of its coordinates make as much.
const FLAT: f64 = 1e-12;

/// A file format of volume meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeFormat {
    /// Gmsh's MSH, versions 2 and 4, text or binary.
    Msh,
    /// VTK's XML file of an unstructured grid.
    Vtu,
    /// JSON with arrays of nodes and elements.
    Arrays,
}

impl VolumeFormat {
    /// The format that the ending of a path names, small or capital.
    ///
    /// # Errors
    /// [`VolumeFileError::UnknownFormat`] for any other ending.
    pub fn from_path(path: &Path) -> Result<VolumeFormat, VolumeFileError> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("msh") => Ok(VolumeFormat::Msh),
            Some("vtu") => Ok(VolumeFormat::Vtu),
            Some("json") => Ok(VolumeFormat::Arrays),
            _ => Err(VolumeFileError::UnknownFormat {
                name: path.display().to_string(),
            }),
        }
    }
}

/// A named part of a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Its name in the file.
    pub name: String,
    /// Its elements or nodes, ascending, as the mesh numbers them from 0.
    pub members: Vec<u32>,
}

/// A volume mesh as it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeFile {
    /// The mesh \[mm\]: tetrahedra or hexahedra, all of positive volume, every node used.
    pub mesh: VolumeMesh,
    /// The unit of the numbers in the file.
    pub unit: LengthUnit,
    /// The file's number of each node, `(nodes)`.
    pub node_numbers: Vec<u64>,
    /// The file's number of each element, `(elements)`.
    pub element_numbers: Vec<u64>,
    /// Named groups of elements, in the file's order.
    pub element_groups: Vec<Group>,
    /// Named sets of nodes: those of the file's points, lines and faces, and those of its groups of elements.
    pub node_sets: Vec<Group>,
    /// Remarks for the user about what was passed over or mended.
    pub notes: Vec<String>,
}

/// What a cell of a file is. Corners come first in all of them, in VTK's order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum CellKind {
    Point,
    Line,
    Triangle,
    Quadrilateral,
    Tetrahedron,
    Hexahedron,
    Prism,
    Pyramid,
}

impl CellKind {
    pub fn corners(self) -> usize {
        match self {
            CellKind::Point => 1,
            CellKind::Line => 2,
            CellKind::Triangle => 3,
            CellKind::Quadrilateral | CellKind::Tetrahedron => 4,
            CellKind::Pyramid => 5,
            CellKind::Prism => 6,
            CellKind::Hexahedron => 8,
        }
    }

    pub fn dimension(self) -> u8 {
        match self {
            CellKind::Point => 0,
            CellKind::Line => 1,
            CellKind::Triangle | CellKind::Quadrilateral => 2,
            _ => 3,
        }
    }

    fn plural(self) -> &'static str {
        match self {
            CellKind::Point => "points",
            CellKind::Line => "lines",
            CellKind::Triangle => "triangles",
            CellKind::Quadrilateral => "quadrilaterals",
            CellKind::Tetrahedron => "tetrahedra",
            CellKind::Hexahedron => "hexahedra",
            CellKind::Prism => "prisms",
            CellKind::Pyramid => "pyramids",
        }
    }
}

/// A cell as the file lists it.
#[derive(Clone, Copy, Debug)]
pub(super) struct RawCell {
    pub kind: CellKind,
    /// Indices of its corners; those beyond the kind's count are 0.
    pub corners: [u32; 8],
    /// Its number in the file.
    pub number: u64,
}

/// What a reader of one format found, in the file's own unit.
#[derive(Clone, Debug, Default)]
pub(super) struct RawVolume {
    pub nodes: Vec<Vec3>,
    pub node_numbers: Vec<u64>,
    pub cells: Vec<RawCell>,
    /// Named groups of cells, by their places in `cells`; names may come again.
    pub groups: Vec<(String, Vec<u32>)>,
    /// Named sets of nodes, by index.
    pub node_sets: Vec<(String, Vec<u32>)>,
    /// Nodes inside edges, faces or volumes of curved cells.
    pub middles: BTreeSet<u32>,
    /// How many cells of dimension 3 were curved.
    pub curved: usize,
    pub notes: Vec<String>,
}

/// Reads a volume mesh. `unit` is the unit of the file's numbers, which no format declares.
///
/// # Errors
/// [`VolumeFileError`]: bytes that are no such file, a coordinate that is not finite, an element that names no node or is
/// flat or folded, a node of no element, several kinds of elements, a unit that is missing or makes no sense.
pub fn read_volume(
    bytes: &[u8],
    format: VolumeFormat,
    unit: Option<LengthUnit>,
) -> Result<VolumeFile, VolumeFileError> {
    let raw = match format {
        VolumeFormat::Msh => msh::read(bytes)?,
        VolumeFormat::Vtu => vtu_read::read(bytes)?,
        VolumeFormat::Arrays => arrays::read(bytes)?,
    };
    in_millimetres(raw, unit)
}

/// Reads a volume mesh from a file, in the format that its name says.
///
/// # Errors
/// As [`read_volume`], with the path before the message.
pub fn open_volume(path: &Path, unit: Option<LengthUnit>) -> Result<VolumeFile, VolumeFileError> {
    let format = VolumeFormat::from_path(path)?;
    let bytes = std::fs::read(path).map_err(|cause| VolumeFileError::Open {
        path: path.to_path_buf(),
        cause,
    })?;
    read_volume(&bytes, format, unit).map_err(|error| VolumeFileError::In {
        path: path.to_path_buf(),
        cause: Box::new(error),
    })
}

/// A mesh from arrays that were written by hand: as from a file in millimetres, numbers from 0.
///
/// # Errors
/// As [`read_volume`], but for the size, which nothing is expected of.
pub fn volume_from_arrays(nodes: Vec<Vec3>, elements: Elements) -> Result<VolumeFile, VolumeFileError> {
    let (kind, flat): (CellKind, Vec<&[u32]>) = match &elements {
        Elements::Tetrahedra(tets) => (CellKind::Tetrahedron, tets.iter().map(|t| &t[..]).collect()),
        Elements::Hexahedra(cells) | Elements::KuhnCells(cells) => {
            (CellKind::Hexahedron, cells.iter().map(|c| &c[..]).collect())
        }
    };
    let mut raw = RawVolume {
        node_numbers: (0..nodes.len() as u64).collect(),
        nodes,
        ..RawVolume::default()
    };
    if let Some(i) = raw.nodes.iter().position(|x| !x.iter().all(|c| c.is_finite())) {
        return Err(VolumeFileError::NotFinite {
            place: format!("node {i}"),
            value: format!("{:?}", raw.nodes[i].as_slice()),
        });
    }
    for (e, nodes) in flat.iter().enumerate() {
        let mut corners = [0; 8];
        for (corner, &node) in corners.iter_mut().zip(nodes.iter()) {
            if node as usize >= raw.nodes.len() {
                return Err(missing("elements", e as u64, node, &raw.node_numbers));
            }
            *corner = node;
        }
        raw.cells.push(RawCell {
            kind,
            corners,
            number: e as u64,
        });
    }
    finished(raw, LengthUnit::Millimetre)
}

/// The error of an element that names a node which is not there.
pub(super) fn missing(
    place: impl Into<String>,
    element: u64,
    node: impl ToString,
    numbers: &[u64],
) -> VolumeFileError {
    VolumeFileError::MissingNode {
        place: place.into(),
        element,
        node: node.to_string(),
        low: numbers.iter().copied().min().unwrap_or(1),
        high: numbers.iter().copied().max().unwrap_or(0),
    }
}

fn in_millimetres(mut raw: RawVolume, unit: Option<LengthUnit>) -> Result<VolumeFile, VolumeFileError> {
    let (mut low, mut high) = (
        Vec3::from_element(f64::INFINITY),
        Vec3::from_element(f64::NEG_INFINITY),
    );
    for x in &raw.nodes {
        low = low.inf(x);
        high = high.sup(x);
    }
    let size = high - low;
    let Some(unit) = unit else {
        return Err(VolumeFileError::UnitMissing {
            x: size.x,
            y: size.y,
            z: size.z,
        });
    };
    let largest_mm = size.max() * unit.to_mm();
    // A file without nodes has no size, and is refused for that below.
    if !raw.nodes.is_empty() && !SIZES.contains(&largest_mm) {
        return Err(VolumeFileError::ImplausibleSize { largest_mm, unit });
    }
    if largest_mm < SMALL {
        raw.notes.push(format!(
            "the mesh is {largest_mm:.3} mm long: is {unit} its unit?"
        ));
    }
    raw.nodes.iter_mut().for_each(|x| *x *= unit.to_mm());
    finished(raw, unit)
}

/// A mesh of the cells of dimension 3, with its groups.
fn finished(mut raw: RawVolume, unit: LengthUnit) -> Result<VolumeFile, VolumeFileError> {
    let kind = one_kind(&raw)?;
    let (kept, place_of) = without_copies(&mut raw, kind);
    let node_place = used_nodes(&mut raw, &kept, kind)?;
    let nodes: Vec<Vec3> = chosen(&raw.nodes, &node_place);
    let node_numbers = chosen(&raw.node_numbers, &node_place);
    let mut turned = 0;
    let mut cells: Vec<[u32; 8]> = Vec::with_capacity(kept.len());
    for cell in &kept {
        let mut corners = [0; 8];
        for k in 0..kind.corners() {
            corners[k] = node_place[cell.corners[k] as usize];
        }
        turned += usize::from(turn_positive(&mut corners, kind, cell.number, &nodes)?);
        cells.push(corners);
    }
    let mut notes = std::mem::take(&mut raw.notes);
    if turned > 0 {
        notes.push(format!(
            "{turned} of {} elements were inside out and were turned",
            cells.len()
        ));
    }
    if raw.curved > 0 {
        notes.push(format!(
            "{} curved elements were read as their corners alone: edges are straight",
            raw.curved
        ));
    }
    let (element_groups, node_sets) = groups(&raw, &place_of, &node_place, &mut notes);
    let elements = match kind {
        CellKind::Tetrahedron => {
            Elements::Tetrahedra(cells.iter().map(|c| [c[0], c[1], c[2], c[3]]).collect())
        }
        _ => Elements::Hexahedra(cells),
    };
    Ok(VolumeFile {
        mesh: VolumeMesh { nodes, elements },
        unit,
        node_numbers,
        element_numbers: kept.iter().map(|c| c.number).collect(),
        element_groups,
        node_sets,
        notes,
    })
}

fn chosen<T: Copy>(all: &[T], place: &[u32]) -> Vec<T> {
    let kept = all.iter().zip(place).filter(|(_, p)| **p != NONE);
    kept.map(|(x, _)| *x).collect()
}

/// The one kind of element that the file's cells of dimension 3 are.
fn one_kind(raw: &RawVolume) -> Result<CellKind, VolumeFileError> {
    let mut counts: BTreeMap<CellKind, usize> = BTreeMap::new();
    for cell in &raw.cells {
        *counts.entry(cell.kind).or_default() += 1;
    }
    let told = |volumes: bool| {
        let list: Vec<String> = counts
            .iter()
            .filter(|(k, _)| !volumes || k.dimension() == 3)
            .map(|(k, n)| format!("{n} {}", k.plural()))
            .collect();
        list.join(", ")
    };
    let mut volumes = counts.keys().filter(|k| k.dimension() == 3);
    match (volumes.next(), volumes.next()) {
        (Some(kind @ (CellKind::Tetrahedron | CellKind::Hexahedron)), None) => {
            if raw.cells.len() >= NONE as usize {
                return Err(VolumeFileError::TooLarge {
                    what: "elements",
                    found: raw.cells.len() as u64,
                    most: u64::from(NONE),
                });
            }
            Ok(*kind)
        }
        (None, _) => Err(VolumeFileError::NoVolume {
            found: if counts.is_empty() {
                "no elements at all".into()
            } else {
                told(false)
            },
        }),
        _ => Err(VolumeFileError::Mixed { found: told(true) }),
    }
}

/// Stands for nothing among indices.
const NONE: u32 = u32::MAX;

/// The elements, each once, and for each cell of the file its element. MSH 2 lists an element of several groups several
/// times.
fn without_copies(raw: &mut RawVolume, kind: CellKind) -> (Vec<RawCell>, Vec<u32>) {
    let sorted = |cell: &RawCell| {
        let mut corners = cell.corners;
        corners.sort_unstable();
        corners
    };
    let mut order: Vec<usize> = (0..raw.cells.len())
        .filter(|&i| raw.cells[i].kind == kind)
        .collect();
    order.sort_by_key(|&i| (sorted(&raw.cells[i]), i));
    let mut first: Vec<usize> = (0..raw.cells.len()).collect();
    for pair in order.windows(2) {
        if sorted(&raw.cells[pair[0]]) == sorted(&raw.cells[pair[1]]) {
            first[pair[1]] = first[pair[0]];
        }
    }
    let mut kept = Vec::new();
    let mut place_of = vec![NONE; raw.cells.len()];
    let mut copies = 0;
    for (i, cell) in raw.cells.iter().enumerate() {
        if cell.kind != kind {
            continue;
        }
        if first[i] == i {
            place_of[i] = kept.len() as u32;
            kept.push(*cell);
        } else {
            place_of[i] = place_of[first[i]];
            copies += 1;
        }
    }
    if copies > 0 {
        raw.notes.push(format!(
            "{copies} elements stand in the file again and were taken once"
        ));
    }
    (kept, place_of)
}

/// For each node of the file its place in the mesh.
fn used_nodes(raw: &mut RawVolume, kept: &[RawCell], kind: CellKind) -> Result<Vec<u32>, VolumeFileError> {
    let (mut used, mut named) = (vec![false; raw.nodes.len()], vec![false; raw.nodes.len()]);
    for cell in &raw.cells {
        for &c in &cell.corners[..cell.kind.corners()] {
            named[c as usize] = true;
        }
    }
    for cell in kept {
        for &c in &cell.corners[..kind.corners()] {
            used[c as usize] = true;
        }
    }
    let loose: Vec<usize> = (0..named.len())
        .filter(|&i| !named[i] && !raw.middles.contains(&(i as u32)))
        .collect();
    if let Some(&node) = loose.first() {
        return Err(VolumeFileError::LooseNode {
            node: raw.node_numbers[node],
            place: raw.nodes[node],
            count: loose.len(),
        });
    }
    let mut place = vec![NONE; used.len()];
    let taken = place.iter_mut().zip(&used).filter(|(_, used)| **used);
    for (next, (own, _)) in (0_u32..).zip(taken) {
        *own = next;
    }
    let beside = (0..used.len())
        .filter(|&i| !used[i] && !raw.middles.contains(&(i as u32)))
        .count();
    if beside > 0 {
        raw.notes.push(format!(
            "{beside} nodes belong to points, lines or faces alone and were left out"
        ));
    }
    Ok(place)
}

/// Turns an element whose volume is negative; was it?
fn turn_positive(
    corners: &mut [u32; 8],
    kind: CellKind,
    number: u64,
    nodes: &[Vec3],
) -> Result<bool, VolumeFileError> {
    let at = |k: usize| nodes[corners[k] as usize];
    let place = at(0);
    let count = kind.corners();
    let mut edge: f64 = 0.0;
    for a in 0..count {
        for b in 0..a {
            edge = edge.max((at(a) - at(b)).norm());
        }
    }
    let determinants = match kind {
        CellKind::Tetrahedron => {
            let [a, b, c] = [1, 2, 3].map(|k| at(k) - at(0));
            vec![a.dot(&b.cross(&c)) / 6.0]
        }
        _ => determinants(&std::array::from_fn(at)),
    };
    let volume: f64 = determinants.iter().sum();
    if volume.abs() <= FLAT * edge.powi(3) || volume.is_nan() {
        return Err(VolumeFileError::Flat {
            element: number,
            place,
            volume_mm3: volume,
            edge_mm: edge,
        });
    }
    let least = determinants
        .iter()
        .map(|d| d * volume.signum())
        .fold(f64::INFINITY, f64::min);
    if least <= 0.0 {
        let largest = determinants.iter().map(|d| d.abs()).fold(0.0, f64::max);
        return Err(VolumeFileError::Folded {
            element: number,
            place,
            least: least / largest,
        });
    }
    if volume > 0.0 {
        return Ok(false);
    }
    match kind {
        CellKind::Tetrahedron => corners.swap(2, 3),
        // Lower and upper face change places: a mirror image.
        _ => corners.rotate_left(4),
    }
    Ok(true)
}

/// Jacobian determinants of a hexahedron at its eight Gauss points \[mm³\]; their sum is its volume.
fn determinants(corners: &[Vec3; 8]) -> Vec<f64> {
    let point = |at: &Vec3| {
        let mut jacobian = Mat3::zeros();
        for (x, s) in corners.iter().zip(&CORNERS) {
            let t = s.component_mul(at) / 3f64.sqrt() + Vec3::from_element(1.0);
            let slope = 0.125 * Vec3::new(s.x * t.y * t.z, s.y * t.x * t.z, s.z * t.x * t.y);
            jacobian += x * slope.transpose();
        }
        jacobian.determinant()
    };
    CORNERS.iter().map(point).collect()
}

/// Groups of elements and sets of nodes; names that come again are joined.
fn groups(
    raw: &RawVolume,
    place_of: &[u32],
    node_place: &[u32],
    notes: &mut Vec<String>,
) -> (Vec<Group>, Vec<Group>) {
    let mut elements: Vec<(String, BTreeSet<u32>)> = Vec::new();
    let mut sets: Vec<(String, BTreeSet<u32>)> = Vec::new();
    for (name, cells) in &raw.groups {
        let solid = cells.iter().map(|&c| place_of[c as usize]).filter(|&p| p != NONE);
        add(&mut elements, name, solid);
        let corners = cells.iter().flat_map(|&c| {
            let cell = &raw.cells[c as usize];
            &cell.corners[..cell.kind.corners()]
        });
        add(
            &mut sets,
            name,
            corners.map(|&n| node_place[n as usize]).filter(|&p| p != NONE),
        );
    }
    for (name, members) in &raw.node_sets {
        let own = members.iter().map(|&n| node_place[n as usize]);
        add(&mut sets, name, own.filter(|&p| p != NONE));
    }
    for (name, _) in raw.groups.iter().chain(&raw.node_sets) {
        if !sets.iter().any(|(n, _)| n == name) {
            let note = format!("the group {name:?} holds no node of the volume and was left out");
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
    }
    let list = |all: Vec<(String, BTreeSet<u32>)>| {
        let group = |(name, members): (String, BTreeSet<u32>)| Group {
            name,
            members: members.into_iter().collect(),
        };
        all.into_iter().map(group).collect()
    };
    (list(elements), list(sets))
}

fn add(groups: &mut Vec<(String, BTreeSet<u32>)>, name: &str, members: impl Iterator<Item = u32>) {
    let mut members = members.peekable();
    if members.peek().is_none() {
        return;
    }
    match groups.iter_mut().find(|(n, _)| n == name) {
        Some((_, all)) => all.extend(members),
        None => groups.push((name.to_string(), members.collect())),
    }
}
