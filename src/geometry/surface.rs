//! Triangle surfaces.

use crate::math::Vec3;

/// A triangle surface. Counter-clockwise from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions, `(n × 3)` \[mm\].
    pub vertices: Vec<Vec3>,
    /// Vertex indices of each triangle, `(m × 3)`.
    pub triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// The corners of triangle `t` \[mm\].
    ///
    /// # Panics
    /// If `t`, or an index of the triangle, is out of range.
    pub fn corners(&self, t: usize) -> [Vec3; 3] {
        self.triangles[t].map(|v| self.vertices[v as usize])
    }

    /// Lower and upper corner of the box around the vertices \[mm\]; `None` without vertices.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.vertices.first()?;
        Some(
            self.vertices
                .iter()
                .fold((first, first), |(lo, hi), v| (lo.inf(v), hi.sup(v))),
        )
    }

    /// Surface area \[mm²\].
    pub fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| area_vector(&self.corners(t)).norm())
            .sum()
    }

    /// Volume by the divergence theorem, V = ⅓ ∮ x·n dA \[mm³\]: the enclosed volume of a closed, consistently oriented
    /// surface (negative if it is inside out), and of no meaning for any other.
    pub fn signed_volume(&self) -> f64 {
        // About the centre of the box: far from the origin the terms would cancel and lose digits.
        let Some((lo, hi)) = self.bounds() else { return 0.0 };
        let origin = (lo + hi) / 2.0;
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t).map(|v| v - origin);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }

    /// The same surface without vertices that no triangle uses; the order of the others stays.
    #[must_use]
    pub fn without_loose_vertices(&self) -> TriMesh {
        let mut used = vec![false; self.vertices.len()];
        for v in self.triangles.iter().flatten() {
            used[*v as usize] = true;
        }
        let mut number = vec![0_u32; self.vertices.len()];
        let mut vertices = Vec::new();
        for (v, position) in self.vertices.iter().enumerate() {
            if used[v] {
                // There are no more vertices than `u32` indices can name.
                number[v] = vertices.len() as u32;
                vertices.push(*position);
            }
        }
        let triangles = self
            .triangles
            .iter()
            .map(|t| t.map(|v| number[v as usize]))
            .collect();
        TriMesh { vertices, triangles }
    }
}

/// The area vector of a triangle, ½ (b − a) × (c − a) \[mm²\]: its length is the area, its direction the normal.
pub fn area_vector([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (b - a).cross(&(c - a)) / 2.0
}
