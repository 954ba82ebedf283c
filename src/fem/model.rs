//! A meshed object with its supports: which displacement components are unknown, how they are numbered, and where an
//! element's stiffness goes in the sparse matrix. Built once; every layout, load and load step reuses it.

use super::elements::{BadElement, Block, Discretisation};
use super::forces::Materials;
use super::stiffness::{self, Kind, Scratch};
use crate::geometry::volume::VolumeMesh;
use crate::math::{Mat3, Vec3};
use crate::numerics::cholesky::{CholeskyError, Pattern, Symbolic};
use crate::numerics::ordering::nested_dissection;
use std::sync::Arc;

/// Which components of a node's displacement are prescribed rather than unknown.
pub type Constrained = [bool; 3];

const CONSTRAINED: u32 = u32::MAX;

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
    /// Place in the matrix of each entry of each element's lower triangle; `CONSTRAINED` for none.
    scatter: Vec<u32>,
}

impl Model {
    /// Numbers the unknowns and analyses the matrix.
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
        let parts = Discretisation::new(&mesh, fill.as_deref())?;
        let neighbours = mesh.neighbours();
        check_supports(&mesh, &neighbours, &constrained)?;
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
        let scatter = scatter_map(&mesh, &unknown_of, &pattern);
        let symbolic = Arc::new(Symbolic::new(pattern)?);
        Ok(Model {
            mesh,
            parts,
            fill,
            constrained,
            unknown_of,
            unknowns,
            symbolic,
            scatter,
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

    /// The stiffness at the displacements `u`, `(nodes)` \[mm\], on the symbolic pattern, written to `values`, `(nnz)`.
    pub fn assemble(&self, u: &[Vec3], materials: &Materials, kind: Kind, values: &mut [f64]) {
        values.fill(0.0);
        match &self.parts {
            Discretisation::Eight(block) => self.assemble_block(block, u, materials, kind, values),
            Discretisation::Four(block) => self.assemble_block(block, u, materials, kind, values),
        }
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

    fn assemble_block<const N: usize>(
        &self,
        block: &Block<N>,
        u: &[Vec3],
        materials: &Materials,
        kind: Kind,
        values: &mut [f64],
    ) {
        let size = 3 * N;
        let entries = size * (size + 1) / 2;
        let mut scratch = Scratch::new();
        let mut matrix = vec![0.0; size * size];
        for (e, nodes) in block.nodes.iter().enumerate() {
            let own = nodes.map(|i| u[i as usize]);
            stiffness::element(block, e, &own, materials, kind, &mut scratch, &mut matrix);
            let places = &self.scatter[e * entries..(e + 1) * entries];
            let mut k = 0;
            for a in 0..size {
                for b in 0..=a {
                    if places[k] != CONSTRAINED {
                        values[places[k] as usize] += matrix[a * size + b];
                    }
                    k += 1;
                }
            }
        }
    }
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
    let mut columns = vec![0];
    let mut rows = Vec::new();
    for mut list in rows_of {
        list.sort_unstable();
        rows.extend(list);
        columns.push(rows.len());
    }
    Pattern { columns, rows }
}

fn scatter_map(mesh: &VolumeMesh, unknown_of: &[[u32; 3]], pattern: &Pattern) -> Vec<u32> {
    let mut scatter = Vec::new();
    for e in 0..mesh.elements.len() {
        let unknowns: Vec<u32> = mesh
            .elements
            .nodes_of(e)
            .iter()
            .flat_map(|&n| unknown_of[n as usize])
            .collect();
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
    }
    scatter
}

/// Every connected part needs at least six constrained components; whether they are the right six shows in the
/// factorisation.
fn check_supports(
    mesh: &VolumeMesh,
    neighbours: &[Vec<u32>],
    constrained: &[Constrained],
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
        if held < 6 {
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
