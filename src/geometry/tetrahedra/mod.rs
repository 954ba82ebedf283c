//! Tetrahedral meshes of solids that follow the borders between cells, with a bound on their dihedral angles.
//!
//! ```text
//! β ≤ θ ≤ 180° − β          for all six dihedral angles θ of every tetrahedron
//! ```
//!
//! A lattice of tetrahedra over the solid's bounds, with planes at flat borders where they leave room, is cut along the object's
//! surface and along every border ([`super::cutting`]). Being inside is a winding number above one half, so holes, overlaps
//! and doubled walls of a scan do no harm. What the cuts leave is conforming, but has flat tetrahedra; they are mended one by
//! one, the worst first: edges collapse, edges and faces are exchanged, vertices move. Vertices stay on the surfaces they lie
//! on; only where the bound is missed otherwise, as in the wedge where a border meets the object's surface at less than β,
//! they may leave them by [`MeshOptions::slack`]. The result says how far it is from the object and from the borders, and
//! a mesh that misses the bound is refused.
//!
//! Valid for objects thicker than about one edge length; sharp rims away from the planes of the bounds are chamfered by
//! about a third of one. The answer is the same on any number of threads.
//!
//! Sources: F. Labelle and J. R. Shewchuk, "Isosurface stuffing", 2007 (moving lattice vertices onto the surface before
//! cutting); B. M. Klingner and J. R. Shewchuk, "Aggressive tetrahedral mesh improvement", 2007 (which changes to try).

mod collapse;
mod improve;
mod manifold;
mod measure;
mod rims;
mod rings;
mod shape;
mod smooth;
mod surfaces;
mod workpiece;

pub use shape::dihedral_angles_deg;

use super::cells::{Cells, Style};
use super::cutting::complex::{Complex, FIRST_INTERFACE_BIT, MAX_INTERFACES, SURFACE_BIT, sample};
use super::cutting::cut::{Keep, Knife, cut};
use super::cutting::labels::{NOTHING, labels};
use super::cutting::{CutError, LevelSet};
use super::region::Region;
use super::solid::Solid;
use super::volume::VolumeMesh;
use crate::math::Vec3;
use serde::Serialize;
use surfaces::Surfaces;
use thiserror::Error;
use workpiece::Workpiece;

/// Most lattice boxes; each inside makes six tetrahedra and more.
const MOST_BOXES: f64 = 1.0e6;
/// A crossing nearer than this to a vertex, over the edge length, moves it before a cut.
const NEAR: f64 = 0.3;
/// The object's level set is taken at this fraction of the bounds' diagonal above zero, so that lattice nodes on one
/// of its flat faces count as inside in spite of rounding.
const RIND: f64 = 1e-8;
/// Least distance between planes of the lattice, over the edge length.
const LEAST_STEP: f64 = 0.5;

/// Whether elements follow the borders between cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Borders {
    /// Each element lies in one cell.
    #[default]
    Follow,
    /// An element takes the cell of its centroid.
    Cross,
}

/// How to mesh.
#[derive(Clone, Debug)]
pub struct MeshOptions {
    /// Edge length of the lattice \[mm\]; diagonals are longer, up to √3 times.
    pub edge_mm: f64,
    /// β, which no dihedral angle may be below, and 180° − β, which none may be above \[°\]. Default 10; up to 30.
    pub least_dihedral_deg: f64,
    /// Whether elements follow the borders between cells.
    pub borders: Borders,
    /// How far a vertex may leave the object's surface or a border where the bound is missed otherwise, as a share of the
    /// edge length. Default 0.2.
    pub slack: f64,
}

impl MeshOptions {
    /// The defaults, at an edge length \[mm\].
    pub fn new(edge_mm: f64) -> MeshOptions {
        MeshOptions {
            edge_mm,
            least_dihedral_deg: 10.0,
            borders: Borders::Follow,
            slack: 0.2,
        }
    }

    fn check(&self) -> Result<(), MeshError> {
        let option = |field, value, range| Err(MeshError::Option { field, value, range });
        if !(self.edge_mm.is_finite() && self.edge_mm > 0.0) {
            return option("edge_mm", self.edge_mm, "positive");
        }
        if !(0.0..=30.0).contains(&self.least_dihedral_deg) {
            return option("least_dihedral_deg", self.least_dihedral_deg, "between 0 and 30");
        }
        if !(0.0..=0.5).contains(&self.slack) {
            return option("slack", self.slack, "between 0 and 0.5");
        }
        Ok(())
    }
}

/// A mesh of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct TetMesh {
    /// Nodes and tetrahedra, all of positive volume.
    pub mesh: VolumeMesh,
    /// The cell of each element, `(elements)`; all 0 where no cells were given.
    pub cell_of_element: Vec<u16>,
    /// What the mesh is like.
    pub quality: Quality,
}

/// What a mesh is like.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// The bound β that was asked for \[°\].
    pub bound_deg: f64,
    /// The least dihedral angle \[°\].
    pub least_dihedral_deg: f64,
    /// The greatest dihedral angle \[°\].
    pub greatest_dihedral_deg: f64,
    /// Elements with an angle below the bound: none in a mesh that was not refused.
    pub below_bound: usize,
    /// The elements' volume \[mm³\].
    pub volume_mm3: f64,
    /// The elements' volume over that of the solid, less one.
    pub volume_error: f64,
    /// The largest distance found between the solid's surface and the mesh's, both ways \[mm\]. Over a hole it is that to its rim.
    pub surface_distance_mm: f64,
    /// The largest distance of a face between two cells from the border there \[mm\]; 0 where borders are not followed.
    pub border_distance_mm: f64,
}

/// Why there is no mesh.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MeshError {
    /// An option out of its range.
    #[error("mesh option `{field}` is {value}; it must be {range}")]
    Option {
        /// Its name.
        field: &'static str,
        /// What it was.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// More elements than a direct solver takes.
    #[error(
        "edges of {edge_mm:.4} mm need {boxes:.3e} lattice boxes, more than {most:.0e}; use at least {coarser:.4} mm"
    )]
    TooFine {
        /// The edge length asked for \[mm\].
        edge_mm: f64,
        /// The boxes that it needs.
        boxes: f64,
        /// The boxes allowed.
        most: f64,
        /// An edge length that is allowed \[mm\].
        coarser: f64,
    },
    /// More borders than a vertex can remember.
    #[error(
        "{found} borders between cells, at most {most} can be followed; use fewer layers, or do not follow borders"
    )]
    TooManyBorders {
        /// How many there are.
        found: usize,
        /// How many there may be.
        most: usize,
    },
    /// More cells than an element's mark can name.
    #[error("{found} cells, at most {most} can be told apart in a mesh; use fewer layers")]
    TooManyCells {
        /// How many there are.
        found: usize,
        /// How many there may be.
        most: usize,
    },
    /// A distance without an answer.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// Nothing inside.
    #[error("no tetrahedron with edges of {edge_mm:.4} mm fits into the object; use shorter edges")]
    Empty {
        /// The edge length \[mm\].
        edge_mm: f64,
    },
    /// A part of the object in no cell.
    #[error("the object at {point:?} mm is in no region; add one without a shape, which takes the rest")]
    NoCell {
        /// Where.
        point: [f64; 3],
    },
    /// A border that stays pinched.
    #[error(
        "the object's border stays pinched with edges of {edge_mm:.4} mm; use other edges, about a fifth shorter or longer"
    )]
    Pinched {
        /// The edge length \[mm\].
        edge_mm: f64,
    },
    /// The bound is missed.
    #[error(
        "{count} of {elements} tetrahedra have a dihedral angle below {bound_deg}°, the least {least_deg:.2}° near {place:?} mm; \
         use edges no longer than the object and its layers are thick, or a lower bound"
    )]
    BoundMissed {
        /// How many.
        count: usize,
        /// Of how many.
        elements: usize,
        /// The bound \[°\].
        bound_deg: f64,
        /// The least angle \[°\].
        least_deg: f64,
        /// A corner of the worst element \[mm\].
        place: [f64; 3],
    },
}

/// Meshes a solid, with one cell to each element.
///
/// # Errors
/// [`MeshError`]: options out of their range, edges too short for memory or too long for the object, a part of the object in no
/// cell, or a quality bound that cannot be kept.
pub fn tetrahedral_mesh(
    solid: &Solid,
    cells: Option<&Cells>,
    options: &MeshOptions,
) -> Result<TetMesh, MeshError> {
    options.check()?;
    let followed = cells.filter(|_| options.borders == Borders::Follow);
    let borders = followed.map(Cells::borders).unwrap_or_default();
    check_counts(cells, borders.len())?;
    let lines = lattice_lines(solid, followed, options.edge_mm)?;
    let (low, high) = solid.bounds();
    let rind = RIND * (high - low).norm();
    let raised = |x: &Vec3| solid.signed_distance(x) - rind;
    let level_sets: Vec<LevelSet> = borders.iter().map(|b| b.as_ref() as LevelSet).collect();
    let complex = cut_lattice(&raised, &lines, &level_sets, options.edge_mm)?;
    if complex.tets.is_empty() {
        return Err(MeshError::Empty {
            edge_mm: options.edge_mm,
        });
    }
    let cell_at = |x: &Vec3| cells.map_or(Some(0), |cells| cells.cell_at(x));
    // Where borders are not followed all is one piece until the end.
    let labels = match followed {
        Some(_) => labels(&complex, &level_sets, &cell_at),
        None => vec![0; complex.tets.len()],
    };
    if let Some(t) = labels.iter().position(|l| *l == NOTHING) {
        return Err(MeshError::NoCell {
            point: complex.centroid(&complex.tets[t]).into(),
        });
    }
    let planes = [low.x, high.x, low.y, high.y, low.z, high.z];
    let surfaces = Surfaces {
        solid,
        cells: followed,
        borders: &borders,
        planes,
        edge: options.edge_mm,
        rest: surfaces::off_the_bounds(solid, &planes),
    };
    let mut piece = Workpiece::new(&complex, &labels);
    drop(complex);
    if !manifold::mend(&mut piece, options.edge_mm) {
        return Err(MeshError::Pinched {
            edge_mm: options.edge_mm,
        });
    }
    surfaces.anchor(&mut piece);
    improve::improve(
        &mut piece,
        &surfaces,
        options.least_dihedral_deg,
        options.slack * options.edge_mm,
    );
    let quality = measure::quality(&piece, &surfaces, options.least_dihedral_deg);
    refuse_bad(&piece, &quality)?;
    let (mesh, labels) = measure::finished(&piece);
    let cell_of_element = match (followed, cells) {
        (None, Some(cells)) => crossing_cells(&mesh, cells)?,
        _ => labels.into_iter().map(|l| l as u16).collect(),
    };
    Ok(TetMesh {
        mesh,
        cell_of_element,
        quality,
    })
}

fn check_counts(cells: Option<&Cells>, borders: usize) -> Result<(), MeshError> {
    let found = cells.map_or(1, Cells::count);
    if found > u16::MAX as usize {
        let most = u16::MAX as usize;
        return Err(MeshError::TooManyCells { found, most });
    }
    if borders > MAX_INTERFACES {
        return Err(MeshError::TooManyBorders {
            found: borders,
            most: MAX_INTERFACES,
        });
    }
    Ok(())
}

/// The lattice's planes: the bounds', flat borders where there is room, and evenly between them.
fn lattice_lines(solid: &Solid, cells: Option<&Cells>, edge: f64) -> Result<[Vec<f64>; 3], MeshError> {
    let (low, high) = solid.bounds();
    let boxes: f64 = (high - low).iter().map(|e| (e / edge).ceil().max(1.0)).product();
    if boxes > MOST_BOXES {
        return Err(MeshError::TooFine {
            edge_mm: edge,
            boxes,
            most: MOST_BOXES,
            coarser: edge * (boxes / MOST_BOXES).cbrt() * 1.02,
        });
    }
    let mut wanted: [Vec<f64>; 3] = Default::default();
    for region in cells.map(Cells::regions).unwrap_or_default() {
        if region.style == Style::Flat {
            wanted[region.axis.index()].extend(&region.borders);
        }
        match &region.region {
            Region::Box { min, max } => (0..3).for_each(|k| wanted[k].extend([min[k], max[k]])),
            Region::Cylinder { axis, range, .. } => wanted[axis.index()].extend(range),
            Region::Mesh(_) | Region::Everything => {}
        }
    }
    Ok(std::array::from_fn(|k| {
        spaced(low[k], high[k], edge, &mut wanted[k])
    }))
}

/// Coordinates from `low` to `high`, about `edge` apart, through those of `wanted` that leave room.
fn spaced(low: f64, high: f64, edge: f64, wanted: &mut [f64]) -> Vec<f64> {
    wanted.sort_by(f64::total_cmp);
    let mut firm = vec![low];
    for &x in wanted.iter() {
        let before = firm[firm.len() - 1];
        if x - before >= LEAST_STEP * edge && high - x >= LEAST_STEP * edge {
            firm.push(x);
        }
    }
    firm.push(high);
    let mut lines = vec![low];
    for pair in firm.windows(2) {
        let n = ((pair[1] - pair[0]) / edge).round().max(1.0) as usize;
        lines.extend((1..n).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / n as f64));
        lines.push(pair[1]);
    }
    lines
}

/// The lattice, cut by the object's surface and by every border.
fn cut_lattice(
    surface: LevelSet,
    lines: &[Vec<f64>; 3],
    level_sets: &[LevelSet],
    edge: f64,
) -> Result<Complex, CutError> {
    let (mut complex, values) = Complex::lattice(surface, lines)?;
    let h = complex.boxes.min().min(edge);
    let knife = Knife {
        level: surface,
        bit: SURFACE_BIT,
        keep: Keep::Negative,
        h,
        near: NEAR,
    };
    cut(&mut complex, values, &knife);
    for (i, level) in level_sets.iter().enumerate() {
        let values = sample(level, &complex.points, || format!("border {i}"))?;
        let knife = Knife {
            level,
            bit: FIRST_INTERFACE_BIT + i as u32,
            keep: Keep::Both,
            h,
            near: NEAR,
        };
        cut(&mut complex, values, &knife);
    }
    Ok(complex)
}

fn refuse_bad(piece: &Workpiece, quality: &Quality) -> Result<(), MeshError> {
    let mut elements = 0;
    let mut worst = (f64::INFINITY, Vec3::zeros());
    for t in piece.alive() {
        elements += 1;
        if piece.sine(t) < worst.0 {
            worst = (piece.sine(t), piece.points[piece.tet(t)[0] as usize]);
        }
    }
    let sharpest = quality
        .least_dihedral_deg
        .min(180.0 - quality.greatest_dihedral_deg);
    if sharpest >= quality.bound_deg {
        return Ok(());
    }
    Err(MeshError::BoundMissed {
        count: quality.below_bound.max(1),
        elements,
        bound_deg: quality.bound_deg,
        least_deg: sharpest,
        place: worst.1.into(),
    })
}

/// The cell at each element's centroid.
fn crossing_cells(mesh: &VolumeMesh, cells: &Cells) -> Result<Vec<u16>, MeshError> {
    (0..mesh.elements.len())
        .map(|e| {
            let nodes = mesh.elements.nodes_of(e);
            let centroid = nodes.iter().map(|&n| mesh.nodes[n as usize]).sum::<Vec3>() / 4.0;
            cells
                .cell_at(&centroid)
                .map(|c| c as u16)
                .ok_or(MeshError::NoCell {
                    point: centroid.into(),
                })
        })
        .collect()
}
