//! Collapsing an edge: vertex `a` goes into its neighbour `b`, and the tetrahedra at the edge vanish.
//!
//! The mesh stays one if what the two vertices have in common is what their edge has (the link condition of Dey,
//! Edelsbrunner, Guha and Nekhayev 1999), with all of the outside counted as one more vertex, and if every tetrahedron that
//! stays has a positive volume. Borders stay if the edge lies on every surface that `a` lies on; where a slack is given,
//! `a` may leave a surface that passes `b` within it.

use super::surfaces::{Surfaces, each};
use super::workpiece::{NewTet, OUTSIDE, Wall, Workpiece};
use crate::geometry::cutting::complex::SURFACE_BIT;
use crate::math::Vec3;

/// Longest edge that a collapse may make, over the edge length asked for. A box of the lattice has diagonals of √3.
const LONGEST: f64 = 2.2;
/// A collapse that would do.
#[derive(Debug)]
pub(super) struct Collapse {
    from: u32,
    into: u32,
    new: Vec<NewTet>,
    loose: u128,
    /// The least sine that it leaves around.
    pub sine: f64,
}

/// What a collapse may do to surfaces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leave {
    /// How far a vertex may leave its surfaces \[mm\].
    pub slack: f64,
    /// How far the middle of a new face of a border may be from it \[mm\].
    pub sag: f64,
    /// The least cosine of the angle by which a face of a border may turn.
    pub turn: f64,
}

/// The collapse of `a` into `b`, if it leaves everything around better than `least`.
pub(super) fn collapse(
    piece: &Workpiece,
    surfaces: &Surfaces,
    [a, b]: [u32; 2],
    leave: Leave,
    least: f64,
) -> Option<Collapse> {
    let on = piece.on[a as usize];
    let walls = piece.walls(a);
    if on == 0 && !walls.is_empty() {
        // It separates cells, but nothing says along which surface.
        return None;
    }
    let along = walls.iter().filter(|w| w.edge.contains(&b));
    let shared = along.fold(0, |bits, w| bits | piece.bits([a, w.edge[0], w.edge[1]]));
    let leaves = on & !shared;
    if leaves != 0 && leave.slack == 0.0 {
        return None;
    }
    let mut new = Vec::with_capacity(piece.star(a).len());
    let mut sine = f64::INFINITY;
    for &t in piece.star(a) {
        let tet = piece.tet(t);
        if tet.contains(&b) {
            continue;
        }
        let v = tet.map(|v| if v == a { b } else { v });
        let corners = piece.corners(v);
        sine = sine.min(super::shape::least_sine(&corners));
        if sine <= least {
            return None;
        }
        new.push((v, piece.label(t)));
    }
    let target = piece.points[b as usize];
    let short = |(v, _): &NewTet| {
        v.iter()
            .all(|&i| (piece.points[i as usize] - target).norm() <= LONGEST * surfaces.edge)
    };
    if new.is_empty() || !new.iter().all(short) || !is_sound(piece, a, b) {
        return None;
    }
    let home = piece.anchors[a as usize].is_some() && piece.on[b as usize] >> SURFACE_BIT & 1 == 1;
    let far =
        |bit: u32| surfaces.farthest(1 << bit, on, &target) > leave.slack && !(home && bit == SURFACE_BIT);
    let labels = || new.iter().map(|(_, label)| *label);
    let strays = !surfaces.belongs(&target, labels(), leave.slack)
        && surfaces.belongs(&piece.points[a as usize], labels(), leave.slack);
    if strays || each(leaves).any(far) || walls.iter().any(|w| spoils(piece, surfaces, [a, b], w, leave)) {
        return None;
    }
    Some(Collapse {
        from: a,
        into: b,
        new,
        loose: leaves & !piece.on[b as usize],
        sine,
    })
}

impl Collapse {
    pub fn perform(self, piece: &mut Workpiece) {
        let old = piece.star(self.from).to_vec();
        piece.replace(&old, &self.new);
        piece.on[self.into as usize] |= self.loose;
        piece.loose[self.into as usize] |= self.loose;
    }
}

/// Whether the wall at `a` turns or leaves its surface too much when `a` goes into `b`.
fn spoils(piece: &Workpiece, surfaces: &Surfaces, [a, b]: [u32; 2], wall: &Wall, leave: Leave) -> bool {
    let [x, y] = wall.edge;
    if wall.edge.contains(&b) {
        return false;
    }
    let [p, q, from, to] = [x, y, a, b].map(|v| piece.points[v as usize]);
    let normal = |r: &Vec3| {
        let n = (q - p).cross(&(r - p));
        n.try_normalize(0.0).unwrap_or_else(Vec3::zeros)
    };
    if normal(&from).dot(&normal(&to)) < leave.turn {
        return true;
    }
    let off = |v: u32| surfaces.off(piece, [x, y, v], wall.labels[1] == OUTSIDE);
    let after = off(b);
    after > leave.sag && after > off(a)
}

/// The link condition for the edge from `a` to `b`.
fn is_sound(piece: &Workpiece, a: u32, b: u32) -> bool {
    let (mut near_a, mut rim_a) = link(piece, a);
    let (near_b, rim_b) = link(piece, b);
    near_a.retain(|v| near_b.binary_search(v).is_ok());
    rim_a.retain(|e| rim_b.binary_search(e).is_ok());
    let mut near = Vec::new();
    let mut rim = Vec::new();
    let around = piece.around(a, b);
    for &t in &around {
        let mut rest = piece.tet(t).into_iter().filter(|&v| v != a && v != b);
        let [x, y] = std::array::from_fn(|_| rest.next().unwrap_or(OUTSIDE));
        near.extend([x, y]);
        rim.push([x.min(y), x.max(y)]);
    }
    near.sort_unstable();
    // A vertex that has one tetrahedron at the edge has the outside on its other side.
    let open: Vec<u32> = near
        .chunk_by(|v, w| v == w)
        .filter(|c| c.len() == 1)
        .map(|c| c[0])
        .collect();
    if !open.is_empty() {
        near.push(OUTSIDE);
        rim.extend(open.iter().map(|&v| [v, OUTSIDE]));
    }
    near.dedup();
    rim.sort_unstable();
    near_a == near && rim_a == rim
}

/// Vertices and edges across from a vertex, sorted; the outside is one vertex of them where `v` is on the border.
fn link(piece: &Workpiece, v: u32) -> (Vec<u32>, Vec<[u32; 2]>) {
    let (mut near, mut rim) = (Vec::new(), Vec::new());
    for &t in piece.star(v) {
        let tet = piece.tet(t);
        for i in 0..4 {
            if tet[i] != v {
                near.push(tet[i]);
            }
            for j in i + 1..4 {
                if tet[i] != v && tet[j] != v {
                    rim.push([tet[i].min(tet[j]), tet[i].max(tet[j])]);
                }
            }
        }
    }
    rim.sort_unstable();
    let open: Vec<[u32; 2]> = rim
        .chunk_by(|e, f| e == f)
        .filter(|c| c.len() == 1)
        .map(|c| c[0])
        .collect();
    for [x, y] in open {
        near.push(OUTSIDE);
        rim.extend([[x, OUTSIDE], [y, OUTSIDE]]);
    }
    near.sort_unstable();
    near.dedup();
    rim.sort_unstable();
    rim.dedup();
    (near, rim)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Solid;
    use crate::geometry::cutting::complex::{Complex, even_lines};
    use crate::geometry::shapes::block;
    use crate::geometry::tetrahedra::surfaces::off_the_bounds;

    /// Eight boxes of 1 mm, 27 vertices, number 13 in the middle; the planes are those of the bounds.
    fn cube() -> Workpiece {
        let (complex, _) =
            Complex::lattice(&|_| -1.0, &even_lines((Vec3::zeros(), Vec3::repeat(2.0)), 1.0)).unwrap();
        Workpiece::new(&complex, &vec![0; complex.tets.len()])
    }

    fn volume(piece: &Workpiece) -> f64 {
        piece.alive().map(|t| piece.volume(t)).sum()
    }

    #[test]
    fn only_sound_collapses_that_keep_the_surfaces_are_found() {
        let solid = Solid::new(block(Vec3::repeat(2.0), 1.0).unwrap()).unwrap();
        let planes = [0.0, 2.0, 0.0, 2.0, 0.0, 2.0];
        let surfaces = Surfaces {
            solid: &solid,
            cells: None,
            borders: &[],
            planes,
            // So that no new edge is too long.
            edge: 2.0,
            rest: off_the_bounds(&solid, &planes),
        };
        let leave = Leave {
            slack: 0.0,
            sag: 0.1,
            turn: 0.5,
        };
        let mut piece = cube();
        let number = |x: [f64; 3]| piece.points.iter().position(|p| *p == Vec3::from(x)).unwrap() as u32;
        let [middle, face, edge, corner] =
            [[1.0, 1.0, 1.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3]].map(number);
        let opposite = number([1.0, 1.0, 2.0]);
        let found = |a, b| collapse(&piece, &surfaces, [a, b], leave, 0.01).is_some();
        // Inwards a vertex would leave its plane, along an edge of the cube it stays on both.
        assert!(!found(face, middle) && !found(edge, face) && !found(corner, edge));
        assert!(found(edge, corner) && found(middle, face));
        // With a slack of a whole edge the face's middle may go in, if the surface turns by less than 60°.
        let wide = Leave {
            slack: 1.0,
            sag: 1.0,
            turn: 0.5,
        };
        assert!(collapse(&piece, &surfaces, [face, middle], wide, 0.01).is_some());
        // No volume is lost, and what goes into the face's middle leaves no way through the cube to the other side.
        collapse(&piece, &surfaces, [middle, face], leave, 0.01)
            .unwrap()
            .perform(&mut piece);
        assert!((volume(&piece) - 8.0).abs() < 1e-12);
        assert!(piece.star(middle).is_empty());
        assert!(!is_sound(&piece, face, opposite) || piece.around(face, opposite).is_empty());
    }
}
