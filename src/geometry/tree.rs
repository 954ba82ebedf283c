//! A bounding volume hierarchy over the triangles of a surface, split at the median along the longest side, so the
//! same surface always gives the same tree. The queries stand beside it: [`super::winding`], [`super::closest`],
//! [`super::crossings`].

use super::surface::area_vector;
use crate::math::{Mat3, Vec3};

/// Triangles in a leaf. Fewer cost memory, more cost exact solid angles.
const LEAF: usize = 4;
/// Deep enough for any stack of pending nodes: the median split halves 2³² triangles at most 32 times.
pub(super) const STACK: usize = 64;

/// A box of triangles with the moments that its far field needs.
#[derive(Clone, Debug)]
pub(super) struct Node {
    /// Box around the triangles \[mm\].
    pub lo: Vec3,
    pub hi: Vec3,
    /// Range of triangles in [`TriangleTree::corners`].
    pub start: u32,
    pub end: u32,
    /// The second child; the first one follows its parent. Zero for a leaf.
    pub second: u32,
    /// Area-weighted centre p, and the largest distance of a corner from it \[mm\].
    pub centre: Vec3,
    pub radius: f64,
    /// Σ A n \[mm²\].
    pub dipole: Vec3,
    /// Σ A n ⊗ (c − p) with c the triangle's centroid \[mm³\].
    pub quadrupole: Mat3,
}

impl Node {
    pub fn is_leaf(&self) -> bool {
        self.second == 0
    }
}

/// The hierarchy. Triangles lie in the order of the leaves; answers carry their number in the mesh.
#[derive(Clone, Debug, Default)]
pub struct TriangleTree {
    pub(super) nodes: Vec<Node>,
    pub(super) corners: Vec<[Vec3; 3]>,
    pub(super) original: Vec<u32>,
}

impl TriangleTree {
    /// Builds the tree over triangles given by their corners, `(m × 3)` \[mm\]. At most `u32::MAX` triangles.
    pub fn new(triangles: &[[Vec3; 3]]) -> TriangleTree {
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let centroids: Vec<Vec3> = triangles.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let mut tree = TriangleTree::default();
        if !triangles.is_empty() {
            tree.split(triangles, &centroids, &mut order, 0);
        }
        tree.corners = order.iter().map(|&t| triangles[t as usize]).collect();
        tree.original = order;
        tree
    }

    /// Appends the node over `order`, whose first triangle stands at `start` in the whole, and its children.
    fn split(&mut self, triangles: &[[Vec3; 3]], centroids: &[Vec3], order: &mut [u32], start: usize) {
        let place = self.nodes.len();
        self.nodes.push(node_over(triangles, order, start));
        if order.len() <= LEAF {
            return;
        }
        let spread = |i: usize| {
            let along = order.iter().map(|&t| centroids[t as usize][i]);
            let (lo, hi) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| {
                (lo.min(x), hi.max(x))
            });
            hi - lo
        };
        let extents = [spread(0), spread(1), spread(2)];
        let axis = (0..3).fold(0, |best, i| if extents[i] > extents[best] { i } else { best });
        let middle = order.len() / 2;
        // Ties by number, so that the order does not depend on the selection algorithm.
        order.select_nth_unstable_by(middle, |&s, &t| {
            centroids[s as usize][axis]
                .total_cmp(&centroids[t as usize][axis])
                .then(s.cmp(&t))
        });
        let (first, second) = order.split_at_mut(middle);
        self.split(triangles, centroids, first, start);
        self.nodes[place].second = self.nodes.len() as u32;
        self.split(triangles, centroids, second, start + middle);
    }
}

fn node_over(triangles: &[[Vec3; 3]], order: &[u32], start: usize) -> Node {
    let here = || order.iter().map(|&t| &triangles[t as usize]);
    let mut lo = Vec3::repeat(f64::INFINITY);
    let mut hi = Vec3::repeat(f64::NEG_INFINITY);
    let (mut area, mut moment, mut dipole) = (0.0, Vec3::zeros(), Vec3::zeros());
    for corners in here() {
        for corner in corners {
            lo = lo.inf(corner);
            hi = hi.sup(corner);
        }
        let vector = area_vector(corners);
        dipole += vector;
        area += vector.norm();
        moment += vector.norm() * corners.iter().sum::<Vec3>() / 3.0;
    }
    let centre = if area > 0.0 {
        moment / area
    } else {
        (lo + hi) / 2.0
    };
    let mut radius_squared = 0.0_f64;
    let mut quadrupole = Mat3::zeros();
    for corners in here() {
        for corner in corners {
            radius_squared = radius_squared.max((corner - centre).norm_squared());
        }
        let arm = corners.iter().sum::<Vec3>() / 3.0 - centre;
        quadrupole += area_vector(corners) * arm.transpose();
    }
    Node {
        lo,
        hi,
        start: start as u32,
        end: (start + order.len()) as u32,
        second: 0,
        centre,
        radius: radius_squared.sqrt(),
        dipole,
        quadrupole,
    }
}
