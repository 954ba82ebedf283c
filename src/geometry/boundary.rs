//! The boundary of a volume mesh: faces that belong to one element alone, corners counter-clockwise seen from outside.

use super::surface::TriMesh;
use super::volume::{Elements, VolumeMesh};
use crate::math::Vec3;
use std::collections::BTreeMap;

/// A face of the boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryFace {
    corners: [u32; 4],
    count: usize,
    /// The element that it belongs to.
    pub element: u32,
}

impl BoundaryFace {
    /// Its three or four nodes, counter-clockwise seen from outside.
    pub fn nodes(&self) -> &[u32] {
        &self.corners[..self.count]
    }

    /// ∫ N_a n dA \[mm²\] for each of its nodes: what an even pressure of −1 MPa exerts on them \[N\].
    ///
    /// A triangle's area vector goes to its nodes in thirds. On a bilinear quadrilateral the integrand is a polynomial of
    /// degree two in each coordinate, which 2 × 2 Gauss points integrate exactly.
    pub fn area_vectors(&self, nodes: &[Vec3]) -> Vec<Vec3> {
        let x: Vec<Vec3> = self.nodes().iter().map(|&n| nodes[n as usize]).collect();
        if let [a, b, c] = x[..] {
            return vec![(b - a).cross(&(c - a)) / 6.0; 3];
        }
        let signs = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let mut areas = vec![Vec3::zeros(); 4];
        for at in signs.map(|s: [f64; 2]| s.map(|c| c / 3f64.sqrt())) {
            let (mut along, mut across) = (Vec3::zeros(), Vec3::zeros());
            for (x, s) in x.iter().zip(&signs) {
                along += x * (0.25 * s[0] * (1.0 + s[1] * at[1]));
                across += x * (0.25 * s[1] * (1.0 + s[0] * at[0]));
            }
            let normal = along.cross(&across);
            for (area, s) in areas.iter_mut().zip(&signs) {
                *area += normal * (0.25 * (1.0 + s[0] * at[0]) * (1.0 + s[1] * at[1]));
            }
        }
        areas
    }
}

/// Faces of a hexahedron, outward.
const HEXAHEDRON: [[usize; 4]; 6] = [
    [0, 3, 2, 1],
    [4, 5, 6, 7],
    [0, 1, 5, 4],
    [1, 2, 6, 5],
    [2, 3, 7, 6],
    [3, 0, 4, 7],
];
/// Faces of a tetrahedron, outward.
const TETRAHEDRON: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// The faces of the boundary, in the order of their elements; a Kuhn cell has those of its hexahedron.
pub fn boundary_faces(mesh: &VolumeMesh) -> Vec<BoundaryFace> {
    let mut faces = Vec::new();
    for e in 0..mesh.elements.len() {
        let own = mesh.elements.nodes_of(e);
        let mut add = |local: &[usize]| {
            let mut corners = [0; 4];
            for (corner, &k) in corners.iter_mut().zip(local) {
                *corner = own[k];
            }
            faces.push(BoundaryFace {
                corners,
                count: local.len(),
                element: e as u32,
            });
        };
        match mesh.elements {
            Elements::Tetrahedra(_) => TETRAHEDRON.iter().for_each(|f| add(f)),
            _ => HEXAHEDRON.iter().for_each(|f| add(f)),
        }
    }
    let key = |face: &BoundaryFace| {
        let mut corners = face.corners;
        corners[..face.count].sort_unstable();
        corners
    };
    let mut times: BTreeMap<[u32; 4], u32> = BTreeMap::new();
    for face in &faces {
        *times.entry(key(face)).or_default() += 1;
    }
    faces.retain(|face| times.get(&key(face)) == Some(&1));
    faces
}

/// The boundary as triangles, quadrilaterals cut along a diagonal; its vertices are all nodes of the mesh.
pub fn boundary_surface(mesh: &VolumeMesh) -> TriMesh {
    let mut triangles = Vec::new();
    for face in boundary_faces(mesh) {
        match *face.nodes() {
            [a, b, c] => triangles.push([a, b, c]),
            [a, b, c, d] => triangles.extend([[a, b, c], [a, c, d]]),
            _ => {}
        }
    }
    TriMesh {
        vertices: mesh.nodes.clone(),
        triangles,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of 3 × 2 × 1 mm: 22 mm² of surface, the upper end at 6 mm²; a closed surface's area vectors add up to zero.
    #[test]
    fn area_vectors_of_a_block() {
        let mut mesh = VolumeMesh::cuboid(Vec3::new(3.0, 2.0, 1.0), [3, 2, 2], false);
        let faces = boundary_faces(&mesh);
        assert_eq!(faces.len(), 2 * (6 + 6 + 4));
        let upper = |mesh: &VolumeMesh| -> Vec3 {
            let faces = boundary_faces(mesh);
            let at_top = faces.iter().filter(|f| f.nodes().iter().all(|&n| n >= 24));
            at_top.flat_map(|f| f.area_vectors(&mesh.nodes)).sum()
        };
        assert!((upper(&mesh) - Vec3::new(0.0, 0.0, 6.0)).norm() < 1e-13);
        let size: f64 = faces
            .iter()
            .map(|f| f.area_vectors(&mesh.nodes).iter().sum::<Vec3>().norm())
            .sum();
        assert!((size - 22.0).abs() < 1e-12);
        for (i, x) in mesh.nodes.iter_mut().enumerate() {
            *x += 0.1
                * Vec3::new(
                    (1.3 * i as f64).sin(),
                    (2.1 * i as f64).cos(),
                    (0.7 * i as f64).sin(),
                );
        }
        let whole: Vec3 = boundary_faces(&mesh)
            .iter()
            .flat_map(|f| f.area_vectors(&mesh.nodes))
            .sum();
        assert!(whole.norm() < 1e-13, "{whole}");
    }
}
