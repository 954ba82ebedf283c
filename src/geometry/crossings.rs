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
