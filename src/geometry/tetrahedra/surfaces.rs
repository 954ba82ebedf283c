//! The surfaces that vertices stay on, and the way back to them.
//!
//! A vertex on surfaces i = 1 … k, given near it by their distances c_i and unit normals n_i, is moved by the shortest
//! step d with
//!
//! ```text
//! n_i · d = −c_i        i = 1 … k
//! ```
//!
//! which Gram–Schmidt on the n_i gives one component at a time; a normal that lies in the span of those before it (a flat
//! side of the object on a plane of its bounds) adds nothing. A few steps follow curved surfaces. For a border with the
//! level set g, c = g/|∇g| and n = ∇g/|∇g| by differences; for the object's surface both come from its closest point.

use super::workpiece::Workpiece;
use crate::geometry::Solid;
use crate::geometry::cells::{Border, Cells};
use crate::geometry::cutting::complex::{FIRST_INTERFACE_BIT, SURFACE_BIT};
use crate::geometry::tree::TriangleTree;
use crate::math::Vec3;

/// Steps back to the surfaces.
const STEPS: usize = 6;
/// A vertex counts as on its surfaces below this distance, over the edge length.
pub(super) const ON: f64 = 1e-6;
/// A vertex of the object's border that is this far from the object's surface, over the edge length, lies over a hole.
const OVER_A_HOLE: f64 = 0.02;
/// The same for one that a border left on a chord of the surface.
const CHORD: f64 = 0.3;
/// The share of a normal that must be new for it to count.
const NEW: f64 = 0.05;

/// All surfaces that a vertex can be on.
pub(super) struct Surfaces<'a> {
    pub solid: &'a Solid,
    /// The cells whose borders are followed.
    pub cells: Option<&'a Cells>,
    pub borders: &'a [Border<'a>],
    /// The planes of the bounds: lower and upper coordinate along x, y, z.
    pub planes: [f64; 6],
    /// Edge length \[mm\].
    pub edge: f64,
    /// The object's surface without what lies in the planes of its bounds. A vertex in such a plane that is also on the
    /// surface is on the rim, and would slide off it if the flat side counted.
    pub rest: TriangleTree,
}

/// The triangles of a solid's surface that do not lie in a plane of its bounds.
pub(super) fn off_the_bounds(solid: &Solid, planes: &[f64; 6]) -> TriangleTree {
    let mesh = solid.mesh();
    let near = 1e-6 * solid.size().norm();
    let flat = |corners: &[Vec3; 3]| {
        let on = |plane: usize| {
            corners
                .iter()
                .all(|x| (x[plane / 2] - planes[plane]).abs() <= near)
        };
        (0..6).any(on)
    };
    let all = (0..mesh.triangles.len()).map(|t| mesh.corners(t));
    let rest: Vec<[Vec3; 3]> = all.filter(|corners| !flat(corners)).collect();
    TriangleTree::new(&rest)
}

/// The bits of the planes of the bounds.
const PLANES: u128 = (1 << SURFACE_BIT) - 1;

impl Surfaces<'_> {
    /// Distance \[mm\] from the surface of a bit, and its unit normal there, for a vertex that is `on` these surfaces.
    fn distance(&self, bit: u32, on: u128, x: &Vec3) -> (f64, Vec3) {
        if bit < SURFACE_BIT {
            let normal = Vec3::ith(bit as usize / 2, 1.0);
            return (x.dot(&normal) - self.planes[bit as usize], normal);
        }
        if bit == SURFACE_BIT {
            let rim = if on & PLANES == 0 {
                None
            } else {
                self.rest.closest(x)
            };
            let closest = rim.unwrap_or_else(|| self.solid.closest(x));
            let away = x - closest.point;
            return if closest.distance > 1e-9 * self.edge {
                (closest.distance, away / closest.distance)
            } else {
                (0.0, Vec3::zeros())
            };
        }
        let level = &self.borders[(bit - FIRST_INTERFACE_BIT) as usize];
        let (step, here) = (1e-5 * self.edge, level(x));
        let slope = Vec3::from_fn(|k, _| (level(&(x + Vec3::ith(k, step))) - here) / step);
        let steepness = slope.norm();
        if steepness > 1e-9 {
            (here / steepness, slope / steepness)
        } else {
            (here, Vec3::z())
        }
    }

    /// How far `x` is from the farthest of the surfaces `bits`, among all those that a vertex is `on` \[mm\].
    pub fn farthest(&self, bits: u128, on: u128, x: &Vec3) -> f64 {
        each(bits)
            .map(|bit| self.distance(bit, on, x).0.abs())
            .fold(0.0, f64::max)
    }

    /// How far `x` is from the nearest border between cells \[mm\].
    pub fn nearest_border(&self, x: &Vec3) -> f64 {
        (0..self.borders.len() as u32)
            .map(|i| self.distance(FIRST_INTERFACE_BIT + i, 0, x).0.abs())
            .fold(f64::INFINITY, f64::min)
    }

    /// How far the middle of a face with different labels on its sides is from where it should be \[mm\]: the object's surface
    /// if it bounds the object, else its border, or the nearest one where it stands for none.
    pub fn off(&self, piece: &Workpiece, face: [u32; 3], outer: bool) -> f64 {
        let middle = face.iter().map(|&v| piece.points[v as usize]).sum::<Vec3>() / 3.0;
        if outer {
            let over_a_hole = face.iter().any(|&v| piece.anchors[v as usize].is_some());
            return if over_a_hole {
                0.0
            } else {
                self.solid.closest(&middle).distance
            };
        }
        let bits = piece.bits(face) >> FIRST_INTERFACE_BIT << FIRST_INTERFACE_BIT;
        if bits == 0 {
            self.nearest_border(&middle)
        } else {
            self.farthest(bits, 0, &middle)
        }
    }

    /// The place near `x` on all surfaces `bits`; `None` if none is found.
    pub fn onto(&self, bits: u128, mut x: Vec3) -> Option<Vec3> {
        self.onto_planes(bits, &mut x);
        if bits >> SURFACE_BIT == 0 {
            return Some(x);
        }
        for _ in 0..STEPS {
            let mut farthest = 0.0_f64;
            let planes = each(bits).map(|bit| self.distance(bit, bits, &x));
            let seen = planes.inspect(|(distance, _)| farthest = farthest.max(distance.abs()));
            let (step, _) = step_onto(seen, NEW);
            if farthest <= ON * self.edge {
                return Some(x);
            }
            x += step;
            self.onto_planes(bits, &mut x);
        }
        (self.farthest(bits, bits, &x) <= ON * self.edge).then_some(x)
    }

    fn onto_planes(&self, bits: u128, x: &mut Vec3) {
        for bit in each(bits).take_while(|bit| *bit < SURFACE_BIT) {
            x[bit as usize / 2] = self.planes[bit as usize];
        }
    }

    /// Whether a corner of tetrahedra of these labels may stand at `x`: in their cells, or out of them by less than `slack` \[mm\].
    /// The mesh does not see to that itself where the tip of a cell has given way to its neighbour.
    pub fn belongs(&self, x: &Vec3, labels: impl Iterator<Item = u32>, slack: f64) -> bool {
        let Some(cells) = self.cells else { return true };
        let own = cells.cell_at(x).map(|cell| cell as u32);
        let mut others = labels.filter(|label| own != Some(*label));
        others.next().is_none() || self.nearest_border(x) <= slack.max(ON * self.edge)
    }

    /// Where vertex `v` may go when it wants to go to `x`: on its surfaces, or near them where it is loose by up to
    /// `slack` \[mm\].
    pub fn allowed(&self, piece: &Workpiece, v: u32, x: Vec3, slack: f64) -> Option<Vec3> {
        let (on, loose) = (piece.on[v as usize], piece.loose[v as usize]);
        let mut firm = on & !loose;
        if let Some(anchor) = piece.anchors[v as usize] {
            if (x - anchor).norm() > slack {
                return None;
            }
            firm &= !(1 << SURFACE_BIT);
        }
        let x = self.onto(firm, x)?;
        let near = |bit: u32| self.distance(bit, on, &x).0.abs() <= slack;
        let labels = || piece.star(v).iter().map(|&t| piece.label(t));
        let stays =
            self.belongs(&x, labels(), slack) || !self.belongs(&piece.points[v as usize], labels(), slack);
        (stays && each(on & loose).all(near)).then_some(x)
    }

    /// Moves vertices onto surfaces that they are only near, as far as the least sine around them stays above `least` or grows.
    ///
    /// A cut takes the surface as straight along every edge, so a border that crosses an edge on a curved surface leaves its
    /// vertex on the chord; and a vertex that had to leave its surfaces may not have to any more.
    pub fn settle(&self, piece: &mut Workpiece, least: f64) {
        for v in 0..piece.points.len() as u32 {
            let (on, home) = (piece.on[v as usize], piece.points[v as usize]);
            if on == 0 || piece.anchors[v as usize].is_some() || piece.star(v).is_empty() {
                continue;
            }
            let Some(place) = self.onto(on, home) else {
                piece.loose[v as usize] |= on & !PLANES;
                continue;
            };
            let before = piece.worst(piece.star(v));
            let settled = [1.0, 0.75, 0.5, 0.25, 0.0].into_iter().find(|share| {
                piece.relocate(v, home + (place - home) * *share);
                piece.worst(piece.star(v)) >= least.min(before)
            });
            piece.loose[v as usize] = if settled == Some(1.0) { 0 } else { on & !PLANES };
        }
    }

    /// Anchors the vertices of the object's border that lie over a hole of the surface.
    pub fn anchor(&self, piece: &mut Workpiece) {
        if self.solid.health().is_closed() {
            return;
        }
        for v in 0..piece.points.len() {
            // A border that crosses an edge of the cut surface leaves its vertex on the chord, less far away than a hole is wide.
            let on_chord = piece.on[v] >> FIRST_INTERFACE_BIT != 0;
            let least = if on_chord { CHORD } else { OVER_A_HOLE };
            let over = piece.on[v] >> SURFACE_BIT & 1 == 1
                && self.solid.closest(&piece.points[v]).distance > least * self.edge;
            piece.anchors[v] = over.then_some(piece.points[v]);
        }
    }
}

/// The shortest step onto planes, given by distance from each and its unit normal, and how many of them are different: a
/// normal less than the share `new` of which is outside the span of those before it is left out.
pub(super) fn step_onto(planes: impl Iterator<Item = (f64, Vec3)>, new: f64) -> (Vec3, usize) {
    let (mut step, mut basis, mut rank) = (Vec3::zeros(), [Vec3::zeros(); 3], 0);
    for (distance, normal) in planes {
        let rest = basis[..rank]
            .iter()
            .fold(normal, |rest, q| rest - q * q.dot(&normal));
        let length = rest.norm();
        if length > new && rank < 3 {
            let q = rest / length;
            step -= q * ((distance + normal.dot(&step)) / length);
            basis[rank] = q;
            rank += 1;
        }
    }
    (step, rank)
}

/// The numbers of the bits that are set, ascending.
pub(super) fn each(bits: u128) -> impl Iterator<Item = u32> {
    let mut left = bits;
    std::iter::from_fn(move || {
        let bit = (left != 0).then(|| left.trailing_zeros())?;
        left &= left - 1;
        Some(bit)
    })
}
