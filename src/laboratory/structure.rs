//! The fine mesh of a structure, one of four.
//!
//! Tubes are meshed along their walls ([`crate::geometry::shapes::tubes`]). A surface and a voxel image are one period of a lattice:
//! hexahedra over its box, whose octants know their share of material (the finite cell method, as in
//! [`crate::geometry::grid`]), are repeated side by side; nodes at one place are one. A voxel image may give each voxel an element of
//! its own, or each two by two by two, which then are its octants.

use crate::geometry::axis::Axis;
use crate::geometry::files::nrrd::VoxelImage;
use crate::geometry::grid::{Grid, Levels};
use crate::geometry::shapes::TubeBlock;
use crate::geometry::solid::Solid;
use crate::geometry::volume::{CORNERS, Elements, VolumeMesh};
use crate::math::Vec3;
use std::collections::HashMap;

/// More elements than this are refused.
const MOST_ELEMENTS: usize = 2_000_000;
/// Elements with less material than this are left out.
const LEAST_FILL: f64 = 0.1;

/// A structure at fine resolution.
#[derive(Clone, Debug)]
pub struct Fine {
    /// Hexahedra.
    pub mesh: VolumeMesh,
    /// Share of material in each octant, `(8 × elements)`, where the mesh does not follow the structure.
    pub fill: Option<Vec<f64>>,
    /// Edges of the block, which lies between the origin and this corner \[mm\].
    pub size: Vec3,
    /// Share of material in the block, as meshed.
    pub solid_share: f64,
}

impl Fine {
    /// The nodes of element `e`; the mesh holds hexahedra alone.
    pub fn cell(&self, e: usize) -> [u32; 8] {
        match &self.mesh.elements {
            Elements::Hexahedra(cells) => cells[e],
            _ => [0; 8],
        }
    }

    /// Share of material next to node `corner` (0 to 7) of element `e`.
    pub fn octant(&self, e: usize, corner: usize) -> f64 {
        self.fill.as_ref().map_or(1.0, |fill| fill[8 * e + corner])
    }

    /// Tubes.
    ///
    /// # Errors
    /// A sentence that names the size that is wrong.
    pub fn tubes(block: &TubeBlock) -> Result<Fine, String> {
        let mesh = block.mesh().map_err(|e| e.to_string())?;
        Ok(Fine {
            mesh,
            fill: None,
            size: block.size(),
            solid_share: 1.0 - block.share(),
        })
    }

    /// A block without holes, in elements of about `element_mm`.
    ///
    /// # Errors
    /// A sentence: too many elements.
    pub fn solid(size: Vec3, element_mm: f64) -> Result<Fine, String> {
        let counts = size.map(|s| (s / element_mm).round().max(1.0));
        check_count(counts.product())?;
        Ok(Fine {
            mesh: VolumeMesh::cuboid(size, [0, 1, 2].map(|c| counts[c] as usize), false),
            fill: None,
            size,
            solid_share: 1.0,
        })
    }

    /// A closed surface, whose bounding box is repeated.
    ///
    /// # Errors
    /// A sentence: too many elements, or nothing in them.
    pub fn surface(solid: &Solid, element_mm: f64, repeat: [usize; 3]) -> Result<Fine, String> {
        let (low, high) = solid.bounds();
        let period = high - low;
        let counts = period.map(|p| (p / element_mm).round().max(1.0));
        check_count(counts.product() * repeat.iter().map(|&r| r as f64).product::<f64>())?;
        let layers = counts.z as usize;
        let levels = (0..=layers)
            .map(|k| low.z + period.z * k as f64 / counts.z)
            .collect();
        let grid = Grid::new(solid, Axis::Z, element_mm, Levels::Flat(levels), [&[], &[]]);
        let grid = grid.map_err(|e| e.to_string())?;
        let Elements::Hexahedra(cells) = &grid.mesh.elements else {
            return Err("the grid over the surface holds no hexahedra".into());
        };
        let corners = |cell: &[u32; 8]| cell.map(|n| grid.mesh.nodes[n as usize] - low);
        let octants = |e: usize| std::array::from_fn(|k| grid.fill[8 * e + k]);
        let cells = cells
            .iter()
            .enumerate()
            .map(|(e, cell)| (corners(cell), octants(e)));
        repeated(&cells.collect::<Vec<_>>(), period, repeat)
    }

    /// A voxel image, repeated; `per_element` voxels along an element's edge, 1 or 2; voxels of at least `threshold` are material.
    ///
    /// # Errors
    /// A sentence: too many elements, no material, a count that does not divide the image.
    pub fn voxels(
        image: &VoxelImage,
        threshold: f64,
        per_element: usize,
        repeat: [usize; 3],
    ) -> Result<Fine, String> {
        if !(1..=2).contains(&per_element) {
            return Err(format!(
                "found {per_element} voxels along an element, expected 1 or 2"
            ));
        }
        if image.sizes.iter().any(|n| n % per_element != 0) {
            return Err(format!(
                "an image of {:?} voxels cannot be cut into elements of {per_element} along each edge",
                image.sizes
            ));
        }
        let counts = image.sizes.map(|n| n / per_element);
        let all = counts.iter().chain(&repeat).map(|&n| n as f64).product::<f64>();
        check_count(all)?;
        let edge = image.spacing_mm * per_element as f64;
        let mut cells = Vec::new();
        for k in 0..counts[2] {
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    let at = [i, j, k];
                    let octants = CORNERS.map(|corner| {
                        let voxel = [0, 1, 2].map(|c| {
                            let upper = usize::from(per_element == 2 && corner[c] > 0.0);
                            at[c] * per_element + upper
                        });
                        f64::from(u8::from(image.value(voxel) >= threshold))
                    });
                    if octants.iter().sum::<f64>() / 8.0 < LEAST_FILL {
                        continue;
                    }
                    let corners = CORNERS.map(|corner| {
                        let step = |c: usize| (at[c] as f64 + 0.5 + 0.5 * corner[c]) * edge[c];
                        Vec3::new(step(0), step(1), step(2))
                    });
                    cells.push((corners, octants));
                }
            }
        }
        let period = Vec3::from_fn(|c, _| edge[c] * counts[c] as f64);
        repeated(&cells, period, repeat)
    }
}

fn check_count(elements: f64) -> Result<(), String> {
    if elements <= MOST_ELEMENTS as f64 {
        return Ok(());
    }
    Err(format!(
        "that makes {elements:.1e} elements, expected at most {MOST_ELEMENTS}: choose larger elements or a smaller block"
    ))
}

/// One period's hexahedra, corners and octants, side by side.
fn repeated(cells: &[([Vec3; 8], [f64; 8])], period: Vec3, repeat: [usize; 3]) -> Result<Fine, String> {
    if cells.is_empty() || repeat.contains(&0) {
        return Err("the structure holds no material, or is repeated zero times".into());
    }
    let grain = 1e-6 * period.min();
    let mut nodes: Vec<Vec3> = Vec::new();
    let mut known: HashMap<[i64; 3], u32> = HashMap::new();
    let (mut hexahedra, mut fill) = (Vec::new(), Vec::new());
    let mut volume = 0.0;
    for k in 0..repeat[2] {
        for j in 0..repeat[1] {
            for i in 0..repeat[0] {
                let shift = period.component_mul(&Vec3::new(i as f64, j as f64, k as f64));
                for (corners, octants) in cells {
                    let diagonal = corners[6] - corners[0];
                    volume += diagonal.product() * octants.iter().sum::<f64>() / 8.0;
                    fill.extend(octants);
                    hexahedra.push(corners.map(|x| {
                        let place = x + shift;
                        node_at(place, grain, &mut nodes, &mut known)
                    }));
                }
            }
        }
    }
    let size = period.component_mul(&Vec3::from_fn(|c, _| repeat[c] as f64));
    let fill = fill.iter().any(|&f| f < 1.0).then_some(fill);
    Ok(Fine {
        mesh: VolumeMesh {
            nodes,
            elements: Elements::Hexahedra(hexahedra),
        },
        fill,
        size,
        solid_share: volume / size.product(),
    })
}

/// The node at `place`, a new one if there is none within the `grain`.
fn node_at(place: Vec3, grain: f64, nodes: &mut Vec<Vec3>, known: &mut HashMap<[i64; 3], u32>) -> u32 {
    let key = [0, 1, 2].map(|c| (place[c] / grain).round() as i64);
    // Rounding may put two neighbours into adjoining boxes.
    for step in 0..27 {
        let near = [
            key[0] + step % 3 - 1,
            key[1] + step / 3 % 3 - 1,
            key[2] + step / 9 - 1,
        ];
        if let Some(&node) = known.get(&near) {
            return node;
        }
    }
    nodes.push(place);
    let node = nodes.len() as u32 - 1;
    known.insert(key, node);
    node
}
