//! A meshed object with its supports: which displacement components are unknown, how they are numbered, and where an
//! element's stiffness goes in the sparse matrix. Built once; every layout, load and load step reuses it.

use super::elements::{BadElement, Block, Discretisation, VolumetricStrain};
use super::forces::Materials;
use super::stiffness::{self, Kind};
use crate::geometry::volume::{Elements, VolumeMesh};
use crate::math::{Mat3, Vec3};
use crate::numerics::blocks::Sites;
use crate::numerics::cholesky::{CholeskyError, Pattern, Symbolic};
use crate::numerics::ordering::nested_dissection;
use std::sync::Arc;

/// Which components of a node's displacement are prescribed rather than unknown.
pub type Constrained = [bool; 3];

const CONSTRAINED: u32 = u32::MAX;
/// Components that must be held in every connected part: those of a rigid motion.
const HELD: usize = 6;

/// Why no model could be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// An element has no volume.
    #[error(transparent)]
    BadElement(#[from] BadElement),
    /// A node belongs to no element.
    #[error("node {node} at ({x:.2}, {y:.2}, {z:.2}) mm belongs to no element: remove it", x = place.x, y = place.y, z = place.z)]
    LooseNode {
        /// Number of the node, from 0.
        node: usize,
        /// Where it is \[mm\].
        place: Vec3,
    },
    /// A connected part of the mesh can move freely.
    #[error("the part of the object around ({x:.1}, {y:.1}, {z:.1}) mm ({elements} elements) is not held: {held} of its displacement components are fixed and 6 is the least; extend a [[fixed]] region to it", x = place.x, y = place.y, z = place.z)]
    NotHeld {
        /// A node of the part \[mm\].
        place: Vec3,
        /// How many elements it has.
        elements: usize,
        /// How many of its components are constrained.
        held: usize,
    },
    /// The matrix does not fit in memory.
    #[error(transparent)]
    Cholesky(#[from] CholeskyError),
}

/// A meshed, supported object.
#[derive(Clone, Debug)]
pub struct Model {
    /// The mesh.
    pub mesh: VolumeMesh,
    /// Its integration points.
    pub parts: Discretisation,
    /// Share of each integration point's volume inside the object, `(points)`, where the mesh does not follow the surface.
    pub fill: Option<Vec<f64>>,
    /// Constrained components of each node.
    pub constrained: Vec<Constrained>,
    unknown_of: Vec<[u32; 3]>,
    unknowns: usize,
    symbolic: Arc<Symbolic>,
    /// Place in the matrix of each entry of each cluster's lower triangle; `CONSTRAINED` for none.
    scatter: Vec<u32>,
    /// Where each cluster's entries begin in `scatter`, `(clusters + 1)`.
    scatter_starts: Vec<usize>,
}

impl Model {
    /// Numbers the unknowns and analyses the matrix; hexahedra and Kuhn cells have one volumetric strain each,
    /// tetrahedra are plain.
    ///
    /// `constrained`, `(nodes)`; `fill`, `(points)`: share of each integration point's volume inside the object.
    ///
    /// # Errors
    /// [`ModelError`]: a flat element, a loose node, a part that nothing holds, or too large a matrix.
    pub fn new(
        mesh: VolumeMesh,
        fill: Option<Vec<f64>>,
        constrained: Vec<Constrained>,
    ) -> Result<Model, ModelError> {
        let volumetric = match mesh.elements {
            Elements::Tetrahedra(_) => VolumetricStrain::Pointwise,
            _ => VolumetricStrain::Shared,
        };
        Model::with(mesh, fill, constrained, volumetric, None)
    }

    /// Numbers the unknowns and analyses the matrix, with volumetric strains as asked; patches of tetrahedra stay inside
    /// one of the `regions`, `(elements)`, if those are given.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn with(
        mesh: VolumeMesh,
        fill: Option<Vec<f64>>,
        constrained: Vec<Constrained>,
        volumetric: VolumetricStrain,
        regions: Option<&[u16]>,
    ) -> Result<Model, ModelError> {
        Model::held_by(HELD, mesh, fill, constrained, volumetric, regions)
    }

    /// The same for an object that supports need not hold: what it touches does, see [`super::contact`].
    ///
    /// # Errors
    /// As [`Model::new`], but no part is too loosely held.
    pub fn unheld(
        mesh: VolumeMesh,
        fill: Option<Vec<f64>>,
        constrained: Vec<Constrained>,
        volumetric: VolumetricStrain,
        regions: Option<&[u16]>,
    ) -> Result<Model, ModelError> {
        Model::held_by(0, mesh, fill, constrained, volumetric, regions)
    }

    fn held_by(
        least: usize,
        mesh: VolumeMesh,
        fill: Option<Vec<f64>>,
        constrained: Vec<Constrained>,
        volumetric: VolumetricStrain,
        regions: Option<&[u16]>,
    ) -> Result<Model, ModelError> {
        let parts = Discretisation::with(&mesh, fill.as_deref(), volumetric, regions)?;
        let neighbours = neighbours(&parts, mesh.nodes.len());
        check_supports(&mesh, &neighbours, &constrained, least)?;
        let order = nested_dissection(&mesh.nodes, &neighbours);
        let mut unknown_of = vec![[CONSTRAINED; 3]; mesh.nodes.len()];
        let mut unknowns = 0;
        for &node in &order {
            for c in 0..3 {
                if !constrained[node as usize][c] {
                    unknown_of[node as usize][c] = unknowns;
                    unknowns += 1;
                }
            }
        }
        let unknowns = unknowns as usize;
        let pattern = pattern(&neighbours, &unknown_of, unknowns);
        let (scatter, scatter_starts) = scatter_map(&parts, &unknown_of, &pattern);
        let sites = sites(&mesh.nodes, &order, &unknown_of);
        let symbolic = Arc::new(Symbolic::with_sites(pattern, sites)?);
        Ok(Model {
            mesh,
            parts,
            fill,
            constrained,
            unknown_of,
            unknowns,
            symbolic,
            scatter,
            scatter_starts,
        })
    }

    /// The same unknowns and the same matrix with other elements: those of `copies`, an element and a factor on its volume,
    /// over one another. `None` where elements are not hexahedra of eight points.
    pub(super) fn overlaid(&self, copies: &[(usize, f64)]) -> Option<Model> {
        let (Discretisation::Eight(block), Elements::Hexahedra(_)) = (&self.parts, &self.mesh.elements)
        else {
            return None;
        };
        let block = block.copied(copies);
        let mut scatter = Vec::new();
        let mut scatter_starts = vec![0];
        let mut fill = self.fill.as_ref().map(|_| Vec::new());
        for &(e, _) in copies {
            let own = self.scatter_starts[e]..self.scatter_starts[e + 1];
            scatter.extend_from_slice(&self.scatter[own]);
            scatter_starts.push(scatter.len());
            if let (Some(fill), Some(all)) = (&mut fill, &self.fill) {
                let per = block.points_per_element;
                fill.extend_from_slice(&all[e * per..(e + 1) * per]);
            }
        }
        Some(Model {
            mesh: VolumeMesh {
                nodes: self.mesh.nodes.clone(),
                elements: Elements::Hexahedra(block.nodes.clone()),
            },
            parts: Discretisation::Eight(block),
            fill,
            constrained: self.constrained.clone(),
            unknown_of: self.unknown_of.clone(),
            unknowns: self.unknowns,
            symbolic: self.symbolic.clone(),
            scatter,
            scatter_starts,
        })
    }

    /// The same elements, numbering and analysis of the matrix with the nodes elsewhere and other fills.
    ///
    /// # Errors
    /// [`ModelError::BadElement`] where an element is turned inside out.
    pub fn moved(&self, mesh: VolumeMesh, fill: Option<Vec<f64>>) -> Result<Model, ModelError> {
        let volumetric = match &self.parts {
            Discretisation::Eight(block) => block.volumetric,
            Discretisation::Four(block) => block.volumetric,
        };
        let parts = Discretisation::with(&mesh, fill.as_deref(), volumetric, None)?;
        Ok(Model {
            mesh,
            parts,
            fill,
            ..self.clone()
        })
    }

    /// Number of unknown displacement components.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// The symbolic factorisation of the stiffness.
    pub fn symbolic(&self) -> &Arc<Symbolic> {
        &self.symbolic
    }

    /// Copies the unknown components of a nodal field, `(nodes)`, into a vector, `(unknowns)`.
    pub fn gather(&self, field: &[Vec3], out: &mut [f64]) {
        for (value, unknown) in field.iter().zip(&self.unknown_of) {
            for c in 0..3 {
                if unknown[c] != CONSTRAINED {
                    out[unknown[c] as usize] = value[c];
                }
            }
        }
    }

    /// Copies a vector of unknowns into a nodal field; constrained components keep their values.
    pub fn spread(&self, values: &[f64], field: &mut [Vec3]) {
        for (value, unknown) in field.iter_mut().zip(&self.unknown_of) {
            for c in 0..3 {
                if unknown[c] != CONSTRAINED {
                    value[c] = values[unknown[c] as usize];
                }
            }
        }
    }

    /// The stiffness at the displacements `u`, `(nodes)` \[mm\], on the symbolic pattern, written to `values`, `(nnz)`:
    /// the symmetric part of the tangent where that is not symmetric.
    pub fn assemble(&self, u: &[Vec3], materials: &Materials, kind: Kind, values: &mut [f64]) {
        self.assemble_parts(u, materials, kind, values, None);
    }

    /// The tangent in two parts on the symbolic pattern, each `(nnz)`: `values` takes the symmetric part, `skew` the lower
    /// triangle of the skew one, `K = sym + skew`.
    pub fn assemble_tangent(&self, u: &[Vec3], materials: &Materials, values: &mut [f64], skew: &mut [f64]) {
        self.assemble_parts(u, materials, Kind::Tangent, values, Some(skew));
    }

    /// Adds the `block` of the nodes `a` (rows) and `b` (columns), which share an element, to the `values` of a symmetric
    /// matrix, `(nnz)`; of the two blocks (a, b) and (b, a) only one is to be given.
    pub fn add_pair(&self, a: usize, b: usize, block: &Mat3, values: &mut [f64]) {
        let pattern = self.symbolic.pattern();
        for i in 0..3 {
            for j in 0..3 {
                let (row, column) = (self.unknown_of[a][i], self.unknown_of[b][j]);
                // On the diagonal block both halves are given, and the matrix takes one.
                if row == CONSTRAINED || column == CONSTRAINED || (a == b && row < column) {
                    continue;
                }
                let (row, column) = (row.max(column) as usize, row.min(column) as usize);
                if let Some(place) = pattern.find(row, column) {
                    values[place] += block[(i, j)];
                }
            }
        }
    }

    fn assemble_parts(
        &self,
        u: &[Vec3],
        materials: &Materials,
        kind: Kind,
        values: &mut [f64],
        mut skew: Option<&mut [f64]>,
    ) {
        values.fill(0.0);
        if let Some(skew) = &mut skew {
            skew.fill(0.0);
        }
        match &self.parts {
            Discretisation::Eight(block) => self.assemble_block(block, u, materials, kind, values, skew),
            Discretisation::Four(block) => self.assemble_block(block, u, materials, kind, values, skew),
        }
    }

    fn assemble_block<const N: usize>(
        &self,
        block: &Block<N>,
        u: &[Vec3],
        materials: &Materials,
        kind: Kind,
        values: &mut [f64],
        mut skew: Option<&mut [f64]>,
    ) {
        let mut matrix = Vec::new();
        for c in 0..block.clusters() {
            stiffness::cluster(block, c, u, materials, kind, &mut matrix);
            let size = 3 * block.nodes_of_cluster(c).len();
            let places = &self.scatter[self.scatter_starts[c]..self.scatter_starts[c + 1]];
            let mut k = 0;
            for a in 0..size {
                for b in 0..=a {
                    if places[k] != CONSTRAINED {
                        values[places[k] as usize] += 0.5 * (matrix[a * size + b] + matrix[b * size + a]);
                    }
                    k += 1;
                }
            }
            if let Some(skew) = &mut skew {
                self.scatter_skew(block.nodes_of_cluster(c), &matrix, places, skew);
            }
        }
    }

    /// Adds ½ (K − Kᵀ) of a cluster; the sign follows which of the two unknowns is the row.
    fn scatter_skew(&self, nodes: &[u32], matrix: &[f64], places: &[u32], skew: &mut [f64]) {
        let size = 3 * nodes.len();
        let unknown = |a: usize| self.unknown_of[nodes[a / 3] as usize][a % 3];
        let mut k = 0;
        for a in 0..size {
            for b in 0..=a {
                if places[k] != CONSTRAINED {
                    let half = 0.5 * (matrix[a * size + b] - matrix[b * size + a]);
                    skew[places[k] as usize] += if unknown(a) >= unknown(b) { half } else { -half };
                }
                k += 1;
            }
        }
    }
}

/// The nodes that share a cluster with each node, ascending, without itself.
fn neighbours(parts: &Discretisation, nodes: usize) -> Vec<Vec<u32>> {
    let mut near = vec![Vec::new(); nodes];
    for c in 0..parts.clusters() {
        let own = parts.nodes_of_cluster(c);
        for &a in own {
            near[a as usize].extend(own.iter().filter(|&&b| b != a));
        }
    }
    for list in &mut near {
        list.sort_unstable();
        list.dedup();
    }
    near
}

/// The nodes with unknown components, in the order of the unknowns.
fn sites(nodes: &[Vec3], order: &[u32], unknown_of: &[[u32; 3]]) -> Sites {
    let (mut positions, mut slots) = (Vec::new(), Vec::new());
    for &node in order {
        let unknowns = &unknown_of[node as usize];
        let site = positions.len() as u32;
        slots.extend(
            (0..3)
                .filter(|&c| unknowns[c as usize] != CONSTRAINED)
                .map(|c| 3 * site + c),
        );
        if unknowns.iter().any(|&u| u != CONSTRAINED) {
            positions.push(nodes[node as usize]);
        }
    }
    Sites { positions, slots }
}

fn pattern(neighbours: &[Vec<u32>], unknown_of: &[[u32; 3]], unknowns: usize) -> Pattern {
    let mut rows_of = vec![Vec::new(); unknowns];
    for (node, near) in neighbours.iter().enumerate() {
        for column in unknown_of[node].into_iter().filter(|&u| u != CONSTRAINED) {
            let all = near.iter().map(|&n| n as usize).chain([node]);
            let rows = all
                .flat_map(|n| unknown_of[n])
                .filter(|&r| r != CONSTRAINED && r >= column);
            rows_of[column as usize] = rows.map(|r| r as usize).collect();
        }
    }
    // Grown step by step these would need twice their size, which is the largest there is in a model.
    let mut rows = Vec::with_capacity(rows_of.iter().map(Vec::len).sum());
    let mut columns = vec![0];
    for mut list in rows_of {
        list.sort_unstable();
        rows.extend(list);
        columns.push(rows.len());
    }
    Pattern { columns, rows }
}

fn scatter_map(parts: &Discretisation, unknown_of: &[[u32; 3]], pattern: &Pattern) -> (Vec<u32>, Vec<usize>) {
    let entries = |c: usize| {
        let size = 3 * parts.nodes_of_cluster(c).len();
        size * (size + 1) / 2
    };
    let mut scatter = Vec::with_capacity((0..parts.clusters()).map(entries).sum());
    let mut starts = vec![0];
    for c in 0..parts.clusters() {
        let nodes = parts.nodes_of_cluster(c);
        let unknowns: Vec<u32> = nodes.iter().flat_map(|&n| unknown_of[n as usize]).collect();
        for a in 0..unknowns.len() {
            for b in 0..=a {
                let (row, column) = (unknowns[a].max(unknowns[b]), unknowns[a].min(unknowns[b]));
                let place = if row == CONSTRAINED {
                    None
                } else {
                    pattern.find(row as usize, column as usize)
                };
                scatter.push(place.map_or(CONSTRAINED, |p| p as u32));
            }
        }
        starts.push(scatter.len());
    }
    (scatter, starts)
}

/// Every connected part needs at least six constrained components; whether they are the right six shows in the
/// factorisation.
fn check_supports(
    mesh: &VolumeMesh,
    neighbours: &[Vec<u32>],
    constrained: &[Constrained],
    least: usize,
) -> Result<(), ModelError> {
    if let Some(node) = neighbours.iter().position(Vec::is_empty) {
        return Err(ModelError::LooseNode {
            node,
            place: mesh.nodes[node],
        });
    }
    let mut part = vec![usize::MAX; mesh.nodes.len()];
    for start in 0..mesh.nodes.len() {
        if part[start] != usize::MAX {
            continue;
        }
        let (mut stack, mut held) = (vec![start], 0);
        part[start] = start;
        while let Some(node) = stack.pop() {
            held += constrained[node].iter().filter(|&&c| c).count();
            for &next in &neighbours[node] {
                if part[next as usize] == usize::MAX {
                    part[next as usize] = start;
                    stack.push(next as usize);
                }
            }
        }
        if held < least {
            let elements = (0..mesh.elements.len())
                .filter(|&e| part[mesh.elements.nodes_of(e)[0] as usize] == start)
                .count();
            return Err(ModelError::NotHeld {
                place: mesh.nodes[start],
                elements,
                held,
            });
        }
    }
    Ok(())
}
