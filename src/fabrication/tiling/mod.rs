//! One closed mesh per material, together tiling an object.
//!
//! The object is the set where a level set `f` is negative, and each border between two design cells (a layer's
//! boundary, the rim of a region) is the zero set of a level set `g_i`:
//!
//! ```text
//! object    Ω   = { x : f(x) < 0 }                    [mm]
//! piece     P_s = { x ∈ Ω : sign g_i(x) = s_i for all i }
//! part      M_k = union of the pieces whose label is k
//! ```
//!
//! A lattice of tetrahedra over the bounds (six to a box, all with the same long diagonal: Kuhn 1960) is cut by `f`
//! and then by every `g_i` in turn, each of them taken as linear along the edges that it crosses, with the crossing
//! itself found on the true function. A cut edge carries one new vertex, a cut face is split by its smallest vertex
//! number, so both neighbours of a face always see the same triangles. The faces between tetrahedra of two materials
//! are the parts' meshes: neighbours share them exactly, whatever the functions were, hence no gap and no overlap.
//!
//! Vertices that a cut passes closely are moved onto it before it is made (the warping of Labelle and Shewchuk 2007,
//! "Isosurface stuffing"), so no edge of the result vanishes in single precision. The lattice's outermost planes are
//! those of the bounds: a flat face of the object that lies there comes out exact, with sharp rims.
//!
//! Valid for objects and cells thicker than about one lattice spacing `h`; sharp rims away from the planes of the
//! bounds lose about `h²/8` of cross-section. [`TilingOptions::volume_mm3`] makes such a loss an error.
//!
//! The cutting itself is [`crate::geometry::cutting`]. Rooms: `border` (the parts' meshes), and [`check`], which says
//! whether meshes do tile.

mod border;
pub mod check;

use crate::geometry::cutting::complex::{
    self, Complex, FIRST_INTERFACE_BIT, MAX_INTERFACES, SURFACE_BIT, even_lines,
};
use crate::geometry::cutting::cut::{self, Keep, Knife};
use crate::geometry::cutting::labels::labels;
use crate::geometry::cutting::{CutError, LevelSet};
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;
use thiserror::Error;

/// Most lattice nodes that a tiling may ask for; at this size it needs some 4 GB.
const MAX_NODES: f64 = 8.0e6;
/// Lattice boxes over the bounds when no spacing is asked for: a sole of 260 × 100 × 20 mm gets 1.7 mm.
const DEFAULT_BOXES: f64 = 1.0e5;
/// How often the default spacing is made finer for the volume's sake, and by how much.
const REFINEMENTS: (usize, f64) = (3, 0.75);
/// A crossing nearer than this to a vertex, over the spacing, moves it. More would make better tetrahedra, which nobody
/// prints.
const NEAR: f64 = 0.15;
/// The object's level set is taken at this fraction of the bounds' diagonal above zero, so that lattice nodes on one
/// of its flat faces count as inside in spite of rounding.
const RIND: f64 = 1e-8;

/// How finely to tile.
#[derive(Clone, Debug, Default)]
pub struct TilingOptions {
    /// Lattice spacing \[mm\]. Default: what puts 100 000 boxes over the bounds, but no more than `thinnest_mm`; and
    /// finer, up to three times by a quarter, where that alone misses `volume_mm3`.
    pub spacing_mm: Option<f64>,
    /// The thinnest layer or region \[mm\], an upper limit for the default spacing.
    pub thinnest_mm: Option<f64>,
    /// The object's volume \[mm³\] where it is known. Default: not checked.
    pub volume_mm3: Option<f64>,
    /// How far the tiling's volume may be from `volume_mm3`, as a fraction. Default 0.005.
    pub volume_tolerance: Option<f64>,
}

impl TilingOptions {
    /// Checks each field, and answers the lattice spacing for an object of these extents `(3)` \[mm\].
    fn check(&self, extents: &Vec3) -> Result<f64, TilingError> {
        let fields = [
            ("spacing_mm", self.spacing_mm),
            ("thinnest_mm", self.thinnest_mm),
            ("volume_mm3", self.volume_mm3),
            ("volume_tolerance", self.volume_tolerance),
        ];
        for (field, value) in fields {
            if let Some(value) = value
                && !(value.is_finite() && value > 0.0)
            {
                return Err(TilingError::Option { field, value });
            }
        }
        let even = (extents.product() / DEFAULT_BOXES).cbrt();
        let spacing = self
            .spacing_mm
            .unwrap_or(even.min(self.thinnest_mm.unwrap_or(even)));
        Ok(spacing)
    }
}

/// Refuses a lattice that would not fit into memory.
fn check_nodes(extents: &Vec3, spacing: f64) -> Result<(), TilingError> {
    let nodes: f64 = extents.iter().map(|e| (e / spacing).ceil() + 1.0).product();
    if nodes > MAX_NODES {
        let coarser = spacing * (nodes / MAX_NODES).cbrt() * 1.01;
        return Err(TilingError::TooFine {
            spacing,
            nodes,
            most: MAX_NODES,
            coarser,
        });
    }
    Ok(())
}

/// One material's share of the object.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// What `label` answered for its pieces.
    pub label: usize,
    /// Its border: closed, every edge in exactly two triangles of opposite direction, every vertex in one fan,
    /// counter-clockwise from outside \[mm\].
    pub mesh: TriMesh,
    /// Its volume \[mm³\], positive.
    pub volume_mm3: f64,
}

/// An object as parts that tile it.
#[derive(Clone, Debug, PartialEq)]
pub struct Tiling {
    /// The parts, by ascending label; labels without volume are left out.
    pub parts: Vec<Part>,
    /// Edge lengths of a lattice box, `(3)` \[mm\].
    pub spacing_mm: Vec3,
    /// Volume of all parts \[mm³\].
    pub volume_mm3: f64,
}

/// Why an object could not be tiled.
#[derive(Debug, Error)]
pub enum TilingError {
    /// An option out of its range.
    #[error("tiling option `{field}` is {value}; it must be a positive number")]
    Option {
        /// Its name.
        field: &'static str,
        /// What it was.
        value: f64,
    },
    /// Bounds without volume.
    #[error(
        "the object's bounds run from {low:?} to {high:?} mm: they must be finite and each extent positive"
    )]
    Bounds {
        /// Lower corner.
        low: [f64; 3],
        /// Upper corner.
        high: [f64; 3],
    },
    /// More lattice than memory.
    #[error(
        "a tiling spacing of {spacing:.4} mm needs {nodes:.3e} lattice nodes, more than {most:.0e}; \
         use at least {coarser:.4} mm"
    )]
    TooFine {
        /// The spacing asked for.
        spacing: f64,
        /// The nodes that it needs.
        nodes: f64,
        /// The nodes allowed.
        most: f64,
        /// A spacing that is allowed.
        coarser: f64,
    },
    /// More interfaces than a vertex can remember.
    #[error("{found} level sets, at most {most} can be cut in one tiling; join those that never meet")]
    TooManyLevelSets {
        /// How many there were.
        found: usize,
        /// How many there may be.
        most: usize,
    },
    /// A level set without an answer.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// Nothing inside.
    #[error(
        "no lattice node or label lies inside the object at a spacing of {spacing:.4} mm; use a smaller spacing"
    )]
    Empty {
        /// The spacing \[mm\].
        spacing: f64,
    },
    /// Volume lost or won.
    #[error(
        "the parts hold {found:.1} mm³ but the object holds {expected:.1} mm³ ({percent:+.2} %); \
         use a tiling spacing below {spacing:.4} mm"
    )]
    Volume {
        /// Volume of all parts.
        found: f64,
        /// Volume of the object.
        expected: f64,
        /// Their difference in percent of the object's.
        percent: f64,
        /// The spacing used \[mm\].
        spacing: f64,
    },
    /// A bug of ours, said rather than hidden.
    #[error(
        "the tiling's border could not be made manifold ({detail}); use another spacing, and report this"
    )]
    NotManifold {
        /// What was found.
        detail: String,
    },
}

/// Tiles the object where `surface` is negative.
///
/// `bounds` are the object's own, tight \[mm\]; `level_sets` are zero on the interfaces between design cells;
/// `label` answers the material at a point strictly inside one piece, `None` to leave the piece out. The answer is
/// the same on any number of threads.
///
/// # Errors
/// Options, bounds or functions that make no sense, a lattice too fine for memory, an object that vanishes between
/// the lattice's nodes, a volume off by more than the tolerance where the object's is given.
pub fn tile(
    surface: LevelSet,
    bounds: (Vec3, Vec3),
    level_sets: &[LevelSet],
    label: &(dyn Fn(&Vec3) -> Option<usize> + Sync),
    options: &TilingOptions,
) -> Result<Tiling, TilingError> {
    let extents = bounds.1 - bounds.0;
    if !extents.iter().all(|e| e.is_finite() && *e > 0.0) {
        return Err(TilingError::Bounds {
            low: bounds.0.into(),
            high: bounds.1.into(),
        });
    }
    let mut spacing = options.check(&extents)?;
    if level_sets.len() > MAX_INTERFACES {
        return Err(TilingError::TooManyLevelSets {
            found: level_sets.len(),
            most: MAX_INTERFACES,
        });
    }
    let mut finer = if options.spacing_mm.is_none() {
        REFINEMENTS.0
    } else {
        0
    };
    loop {
        check_nodes(&extents, spacing)?;
        match tile_at(spacing, surface, bounds, level_sets, label, options) {
            // Rims lose in proportion to the spacing's square.
            Err(TilingError::Volume { .. }) if finer > 0 => spacing *= REFINEMENTS.1,
            done => return done,
        }
        finer -= 1;
    }
}

/// Tiles at one spacing \[mm\].
fn tile_at(
    spacing: f64,
    surface: LevelSet,
    bounds: (Vec3, Vec3),
    level_sets: &[LevelSet],
    label: &(dyn Fn(&Vec3) -> Option<usize> + Sync),
    options: &TilingOptions,
) -> Result<Tiling, TilingError> {
    let rind = RIND * (bounds.1 - bounds.0).norm();
    let raised = |x: &Vec3| surface(x) - rind;
    let (mut complex, values) = Complex::lattice(&raised, &even_lines(bounds, spacing))?;
    let h = complex.boxes.min();
    cut::cut(
        &mut complex,
        values,
        &Knife {
            level: &raised,
            bit: SURFACE_BIT,
            keep: Keep::Negative,
            h,
            near: NEAR,
        },
    );
    for (i, level) in level_sets.iter().enumerate() {
        let values = complex::sample(level, &complex.points, || format!("level set {i}"))?;
        let bit = FIRST_INTERFACE_BIT + i as u32;
        cut::cut(
            &mut complex,
            values,
            &Knife {
                level,
                bit,
                keep: Keep::Both,
                h,
                near: NEAR,
            },
        );
    }
    let labels = labels(&complex, level_sets, label);
    let parts = border::parts(&mut complex, labels)?;
    finish(parts, complex.boxes, spacing, options)
}

/// Adds up the volumes and holds them against the object's.
fn finish(
    parts: Vec<Part>,
    boxes: Vec3,
    spacing: f64,
    options: &TilingOptions,
) -> Result<Tiling, TilingError> {
    if parts.is_empty() {
        return Err(TilingError::Empty { spacing });
    }
    let found: f64 = parts.iter().map(|p| p.volume_mm3).sum();
    if let Some(expected) = options.volume_mm3 {
        let off = found / expected - 1.0;
        if off.abs() > options.volume_tolerance.unwrap_or(0.005) {
            return Err(TilingError::Volume {
                found,
                expected,
                percent: 100.0 * off,
                spacing,
            });
        }
    }
    Ok(Tiling {
        parts,
        spacing_mm: boxes,
        volume_mm3: found,
    })
}
