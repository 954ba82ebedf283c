//! Volume meshes: nodes, and the elements between them.

use crate::math::Vec3;

/// The elements of a mesh; one mesh holds one kind.
#[derive(Clone, Debug, PartialEq)]
pub enum Elements {
    /// Eight-node hexahedra, nodes in VTK's order: four around the lower face, counter-clockwise seen from above, then
    /// the four above them.
    Hexahedra(Vec<[u32; 8]>),
    /// Hexahedral cells, each cut into six tetrahedra along one diagonal (Kuhn); nodes in the same order.
    KuhnCells(Vec<[u32; 8]>),
    /// Four-node tetrahedra with positive volume: node 3 lies on the side that the normal of (0, 1, 2) points to.
    Tetrahedra(Vec<[u32; 4]>),
}

impl Elements {
    /// Number of elements.
    pub fn len(&self) -> usize {
        match self {
            Elements::Hexahedra(cells) | Elements::KuhnCells(cells) => cells.len(),
            Elements::Tetrahedra(tets) => tets.len(),
        }
    }

    /// Is there none?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The nodes of element `e`.
    pub fn nodes_of(&self, e: usize) -> &[u32] {
        match self {
            Elements::Hexahedra(cells) | Elements::KuhnCells(cells) => &cells[e],
            Elements::Tetrahedra(tets) => &tets[e],
        }
    }
}

/// Reference coordinates of a hexahedron's nodes in [−1, 1]³, in their order.
pub const CORNERS: [Vec3; 8] = [
    Vec3::new(-1.0, -1.0, -1.0),
    Vec3::new(1.0, -1.0, -1.0),
    Vec3::new(1.0, 1.0, -1.0),
    Vec3::new(-1.0, 1.0, -1.0),
    Vec3::new(-1.0, -1.0, 1.0),
    Vec3::new(1.0, -1.0, 1.0),
    Vec3::new(1.0, 1.0, 1.0),
    Vec3::new(-1.0, 1.0, 1.0),
];

/// The six tetrahedra of a Kuhn cell, by the cell's node numbers; all positive for a convex cell.
pub const KUHN: [[usize; 4]; 6] = [
    [0, 1, 2, 6],
    [0, 5, 1, 6],
    [0, 4, 5, 6],
    [0, 2, 3, 6],
    [0, 3, 7, 6],
    [0, 7, 4, 6],
];

/// A volume mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeMesh {
    /// Node positions, `(n × 3)` \[mm\].
    pub nodes: Vec<Vec3>,
    /// The elements.
    pub elements: Elements,
}

impl VolumeMesh {
    /// The nodes that share an element with each node, ascending, without itself, `(n)`.
    pub fn neighbours(&self) -> Vec<Vec<u32>> {
        let mut near = vec![Vec::new(); self.nodes.len()];
        for e in 0..self.elements.len() {
            let nodes = self.elements.nodes_of(e);
            for &a in nodes {
                near[a as usize].extend(nodes.iter().filter(|&&b| b != a));
            }
        }
        for list in &mut near {
            list.sort_unstable();
            list.dedup();
        }
        near
    }

    /// A box `[0, size]` of `counts` equal cells along each axis, the first axis running fastest.
    pub fn cuboid(size: Vec3, counts: [usize; 3], tetrahedra: bool) -> VolumeMesh {
        let [nx, ny, nz] = counts;
        let mut nodes = Vec::with_capacity((nx + 1) * (ny + 1) * (nz + 1));
        for k in 0..=nz {
            for j in 0..=ny {
                for i in 0..=nx {
                    nodes.push(Vec3::new(
                        size.x * i as f64 / nx as f64,
                        size.y * j as f64 / ny as f64,
                        size.z * k as f64 / nz as f64,
                    ));
                }
            }
        }
        let id = |i: usize, j: usize, k: usize| (i + (nx + 1) * (j + (ny + 1) * k)) as u32;
        let mut cells = Vec::with_capacity(nx * ny * nz);
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    let ring = |k| [id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k)];
                    let ([a, b, c, d], [e, f, g, h]) = (ring(k), ring(k + 1));
                    cells.push([a, b, c, d, e, f, g, h]);
                }
            }
        }
        let elements = if tetrahedra {
            Elements::KuhnCells(cells)
        } else {
            Elements::Hexahedra(cells)
        };
        VolumeMesh { nodes, elements }
    }
}
