//! The point of a surface closest to a given point: best first through the tree, and for one triangle by the Voronoi
//! region of its features that the point falls into (Ericson, "Real-Time Collision Detection", 2005, 5.1.5).

use super::tree::TriangleTree;
use crate::math::Vec3;

/// The closest point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// The point on the surface \[mm\].
    pub point: Vec3,
    /// Number of the triangle it lies on.
    pub triangle: u32,
    /// Distance to it \[mm\], never negative.
    pub distance: f64,
}

impl TriangleTree {
    /// The point closest to `point`; `None` on an empty tree. Of several equally close triangles, any one.
    pub fn closest(&self, point: &Vec3) -> Option<Closest> {
        let mut best: Option<(f64, Vec3, u32)> = None;
        if !self.nodes.is_empty() {
            self.search_closest(0, point, &mut best);
        }
        best.map(|(squared, on, place)| Closest {
            point: on,
            triangle: self.original[place as usize],
            distance: squared.sqrt(),
        })
    }

    fn search_closest(&self, place: u32, point: &Vec3, best: &mut Option<(f64, Vec3, u32)>) {
        let node = &self.nodes[place as usize];
        if node.is_leaf() {
            for t in node.start..node.end {
                let on = closest_on_triangle(&self.corners[t as usize], point);
                let squared = (on - point).norm_squared();
                if best.is_none_or(|(closest, ..)| squared < closest) {
                    *best = Some((squared, on, t));
                }
            }
            return;
        }
        let mut children = [(self.squared_distance(place + 1, point), place + 1), {
            let second = node.second;
            (self.squared_distance(second, point), second)
        }];
        if children[1].0 < children[0].0 {
            children.swap(0, 1);
        }
        for (squared, child) in children {
            if best.is_none_or(|(closest, ..)| squared < closest) {
                self.search_closest(child, point, best);
            }
        }
    }

    /// Squared distance \[mm²\] from the point to the node's box, zero inside.
    fn squared_distance(&self, place: u32, point: &Vec3) -> f64 {
        let node = &self.nodes[place as usize];
        (node.lo - point)
            .sup(&(point - node.hi))
            .sup(&Vec3::zeros())
            .norm_squared()
    }
}

/// The point of a triangle closest to `p` \[mm\]. A degenerate triangle is treated as its edges.
pub fn closest_on_triangle([a, b, c]: &[Vec3; 3], p: &Vec3) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * ratio(d1, d1 - d3);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * ratio(d2, d2 - d6);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ratio(d4 - d3, (d4 - d3) + (d5 - d6));
    }
    let sum = va + vb + vc;
    a + ab * ratio(vb, sum) + ac * ratio(vc, sum)
}

/// part / whole, and 0 where a degenerate triangle makes the whole vanish.
fn ratio(part: f64, whole: f64) -> f64 {
    if whole == 0.0 { 0.0 } else { part / whole }
}
