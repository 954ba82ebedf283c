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
