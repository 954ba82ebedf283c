//! Where a line parallel to an axis meets a surface.

use super::axis::Axis;
use super::surface::area_vector;
use super::tree::{STACK, TriangleTree};
use crate::math::Vec3;

impl TriangleTree {
    /// The coordinates along `axis` \[mm\], ascending, where the line through (a, b) meets the surface.
    ///
    /// A triangle counts if the line meets it or passes its rim within `slack` \[mm\], so no crossing is lost between
    /// two triangles. The same crossing may appear more than once, and a line that only grazes an edge leaves a
    /// crossing where inside and outside do not change: ask for the winding number in between. A triangle
    /// parallel to the line has no crossing of its own, its neighbours have.
    pub fn crossings(&self, axis: Axis, a: f64, b: f64, slack: f64) -> Vec<f64> {
        let (i, j) = axis.others();
        let mut found = Vec::new();
        let mut pending = [0_u32; STACK];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let place = pending[depth];
            let node = &self.nodes[place as usize];
            let missed = a < node.lo[i] - slack
                || a > node.hi[i] + slack
                || b < node.lo[j] - slack
                || b > node.hi[j] + slack;
            if missed {
                continue;
            }
            if node.is_leaf() {
                let corners = &self.corners[node.start as usize..node.end as usize];
                found.extend(
                    corners
                        .iter()
                        .filter_map(|corners| crossing(corners, axis, a, b, slack)),
                );
            } else {
                pending[depth] = node.second;
                pending[depth + 1] = place + 1;
                depth += 2;
            }
        }
        found.sort_by(f64::total_cmp);
        found
    }
}

fn crossing(corners: &[Vec3; 3], axis: Axis, a: f64, b: f64, slack: f64) -> Option<f64> {
    let (i, j) = axis.others();
    let flat = corners.map(|corner| [corner[i] - a, corner[j] - b]);
    // Twice the projected area, positive where the face looks along the axis.
    let area = 2.0 * area_vector(corners)[axis.index()];
    if area == 0.0 {
        return None;
    }
    let mut weights = [0.0; 3];
    for (k, weight) in weights.iter_mut().enumerate() {
        let (p, q) = (flat[(k + 1) % 3], flat[(k + 2) % 3]);
        let outside = (p[0] * q[1] - p[1] * q[0]) * area.signum();
        // `outside` over the edge's length is the signed distance of the line from the edge.
        let length = (p[0] - q[0]).hypot(p[1] - q[1]);
        if outside < -slack * length {
            return None;
        }
        *weight = outside.max(0.0);
    }
    let sum: f64 = weights.iter().sum();
    if sum <= 0.0 {
        return None;
    }
    Some((0..3).map(|k| weights[k] * corners[k][axis.index()]).sum::<f64>() / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes::block;

    #[test]
    fn no_line_slips_between_two_triangles() {
        // Faces of 1 mm squares with diagonals: every quarter point lies in a face, on an edge, a diagonal or a vertex.
        let mesh = block(Vec3::new(4.0, 4.0, 4.0), 1.0).unwrap();
        let corners: Vec<_> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let tree = TriangleTree::new(&corners);
        for axis in Axis::ALL {
            for n in 0..17 * 17 {
                let (a, b) = (f64::from(n % 17) / 4.0, f64::from(n / 17) / 4.0);
                for (da, db) in [(0.0, 0.0), (5e-10, 0.0), (-5e-10, -5e-10)] {
                    let found = tree.crossings(axis, a + da, b + db, 1e-9);
                    let near = |place: f64| found.iter().any(|x| (x - place).abs() < 1e-12);
                    assert!(near(0.0) && near(4.0), "{axis} {a} {b}: {found:?}");
                }
            }
        }
        assert!(tree.crossings(Axis::X, 4.1, 2.0, 1e-9).is_empty());
    }
}
