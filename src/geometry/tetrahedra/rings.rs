//! Removing an edge: the tetrahedra around it give way to others without it. And its opposite for one face.
//!
//! The vertices around the edge `ab`, counter-clockwise seen from its end `b`, form a ring, or on a border one or two arcs
//! with a label each. Each arc is a polygon to be divided into triangles, and each triangle gives a tetrahedron with `a` and
//! one with `b`. The division with the best worst sine is found by Klincsek's recursion (1980; Shewchuk 2002):
//!
//! ```text
//! q(i, j) = max over i < k < j of min( q(i, k), q(k, j), sine of (c_i, c_k, c_j) with a and with b )
//! ```
//!
//! On a border the edge gives way to the one between the ends of the arcs. An arc of one tetrahedron leaves nothing: a
//! sliver on the object's surface disappears, one on a border between cells goes over to the other cell.

use super::collapse::Leave;
use super::shape::least_sine;
use super::surfaces::Surfaces;
use super::workpiece::{NewTet, OUTSIDE, Workpiece};

/// Longest arc that is looked at; an edge with more around it is not why a tetrahedron is bad.
const LONGEST: usize = 9;

/// Tetrahedra for others.
#[derive(Debug)]
pub(super) struct Exchange {
    old: Vec<u32>,
    new: Vec<NewTet>,
    /// The least sine of the new ones.
    pub sine: f64,
}

impl Exchange {
    pub fn perform(self, piece: &mut Workpiece) {
        piece.replace(&self.old, &self.new);
    }
}

/// Vertices along an arc, and the label of the tetrahedra between them.
struct Arc {
    label: u32,
    vertices: Vec<u32>,
}

/// The removal of the edge `ab`, if all that it makes is better than `least`. Borders may change as `leave` says.
pub(super) fn removal(
    piece: &Workpiece,
    surfaces: &Surfaces,
    [a, b]: [u32; 2],
    leave: Leave,
    least: f64,
) -> Option<Exchange> {
    let old = piece.around(a, b);
    let (arcs, closed) = arcs(piece, &old, [a, b])?;
    let on_border = !closed || arcs.len() > 1;
    if on_border {
        let ends = [*arcs[0].vertices.first()?, *arcs[0].vertices.last()?];
        if !border_allows(piece, surfaces, [a, b], ends, !closed && arcs.len() == 1, leave)
            || arcs.len() == 1 && !opens(piece, &old, ends)
        {
            return None;
        }
    }
    let (mut new, mut sine) = (Vec::new(), f64::INFINITY);
    for arc in &arcs {
        sine = sine.min(divide(piece, [a, b], arc, least, &mut new)?);
    }
    (sine > least).then_some(Exchange { old, new, sine })
}

/// The tetrahedron as `[a, b, x, y]`, an even permutation: `x` to `y` runs counter-clockwise seen from `b`.
fn seen_from(tet: [u32; 4], a: u32, b: u32) -> [u32; 4] {
    // The twelve even permutations, as places.
    const EVEN: [[usize; 4]; 12] = [
        [0, 1, 2, 3],
        [0, 2, 3, 1],
        [0, 3, 1, 2],
        [1, 0, 3, 2],
        [1, 2, 0, 3],
        [1, 3, 2, 0],
        [2, 0, 1, 3],
        [2, 1, 3, 0],
        [2, 3, 0, 1],
        [3, 0, 2, 1],
        [3, 1, 0, 2],
        [3, 2, 1, 0],
    ];
    let turned = EVEN.iter().map(|places| places.map(|i| tet[i]));
    turned.into_iter().find(|v| v[0] == a && v[1] == b).unwrap_or(tet)
}

/// The arcs around an edge, the whole ring if one label holds all of it (`true`) or two share it; `None` where more meet.
fn arcs(piece: &Workpiece, around: &[u32], [a, b]: [u32; 2]) -> Option<(Vec<Arc>, bool)> {
    let mut steps: Vec<([u32; 2], u32)> = Vec::with_capacity(around.len());
    for &t in around {
        let [_, _, x, y] = seen_from(piece.tet(t), a, b);
        steps.push(([x, y], piece.label(t)));
    }
    let n = steps.len();
    if n > 2 * LONGEST {
        return None;
    }
    let before = |k: usize| steps.iter().find(|s| s.0[1] == steps[k].0[0]);
    // An arc starts where the one before has another label, or is the outside.
    let starts: Vec<usize> = (0..n)
        .filter(|&k| before(k).is_none_or(|s| s.1 != steps[k].1))
        .collect();
    let open = (0..n).any(|k| before(k).is_none());
    if starts.len() > 2 || open && starts.len() > 1 {
        return None;
    }
    let closed = starts.is_empty();
    let walk = |start: usize| {
        let (mut vertices, mut at) = (vec![steps[start].0[0]], start);
        loop {
            let end = steps[at].0[1];
            if end == vertices[0] {
                break;
            }
            vertices.push(end);
            match (0..n).find(|&k| steps[k].0[0] == end && steps[k].1 == steps[start].1) {
                Some(next) if vertices.len() <= n => at = next,
                _ => break,
            }
        }
        Arc {
            label: steps[start].1,
            vertices,
        }
    };
    let arcs: Vec<Arc> = if closed {
        vec![walk(0)]
    } else {
        starts.into_iter().map(walk).collect()
    };
    let count: usize = arcs
        .iter()
        .map(|arc| arc.vertices.len() - usize::from(!closed))
        .sum();
    let short = arcs.iter().all(|arc| arc.vertices.len() <= LONGEST);
    (count == n && short).then_some((arcs, closed))
}

/// Divides an arc's polygon, appends its tetrahedra, and answers their worst sine.
fn divide(piece: &Workpiece, [a, b]: [u32; 2], arc: &Arc, least: f64, new: &mut Vec<NewTet>) -> Option<f64> {
    let (c, n) = (&arc.vertices, arc.vertices.len());
    if n < 3 {
        return Some(f64::INFINITY);
    }
    let pair = |i: usize, k: usize, j: usize| [[c[i], c[k], c[j], b], [c[i], c[j], c[k], a]];
    let mut best = [[f64::INFINITY; LONGEST]; LONGEST];
    let mut choice = [[0; LONGEST]; LONGEST];
    for width in 2..n {
        for i in 0..n - width {
            let j = i + width;
            best[i][j] = f64::NEG_INFINITY;
            for k in i + 1..j {
                let bound = best[i][k].min(best[k][j]);
                if bound <= best[i][j].max(least) {
                    continue;
                }
                let [s, t] = pair(i, k, j).map(|v| least_sine(&piece.corners(v)));
                if bound.min(s).min(t) > best[i][j] {
                    best[i][j] = bound.min(s).min(t);
                    choice[i][j] = k;
                }
            }
        }
    }
    let sine = best[0][n - 1];
    if sine <= least {
        return None;
    }
    let mut pending = vec![(0, n - 1)];
    while let Some((i, j)) = pending.pop() {
        if j - i >= 2 {
            let k = choice[i][j];
            new.extend(pair(i, k, j).map(|v| (v, arc.label)));
            pending.extend([(i, k), (k, j)]);
        }
    }
    Some(sine)
}

/// Whether the border at the edge `ab` may run along the edge between `ends` instead.
fn border_allows(
    piece: &Workpiece,
    surfaces: &Surfaces,
    [a, b]: [u32; 2],
    [c, d]: [u32; 2],
    outer: bool,
    leave: Leave,
) -> bool {
    let bits = piece.bits([a, b, c]);
    if bits == 0 || bits != piece.bits([a, b, d]) || bits & piece.bits([c, d, c]) != bits {
        return false;
    }
    let [pa, pb, pc, pd] = [a, b, c, d].map(|v| piece.points[v as usize]);
    let normals = [
        (pb - pa).cross(&(pc - pa)),
        (pd - pa).cross(&(pb - pa)),
        (pd - pa).cross(&(pc - pa)),
        (pc - pb).cross(&(pd - pb)),
    ]
    .map(|n| n.try_normalize(0.0).unwrap_or_default());
    // The two faces there are and the two to come, all seen from one side of the border.
    let flat = normals[..2]
        .iter()
        .all(|n| n.dot(&normals[2]) > leave.turn && n.dot(&normals[3]) > leave.turn);
    let off = |face| surfaces.off(piece, face, outer);
    let [before, after] =
        [[[a, b, c], [a, b, d]], [[c, d, a], [c, d, b]]].map(|pair| off(pair[0]).max(off(pair[1])));
    flat && (after <= leave.sag || after <= before)
}

/// Whether the object's border may run along the edge `cd` in place of the one that `old` surround: the edge is not there
/// yet, or where a sliver goes, neither it nor the sliver's other faces are on the border.
fn opens(piece: &Workpiece, old: &[u32], [c, d]: [u32; 2]) -> bool {
    if let [sliver] = old {
        let inner = (0..4).filter(|&k| piece.across(*sliver, k).is_some()).count();
        let walls = piece.walls(c);
        return inner == 2
            && !walls
                .iter()
                .any(|w| w.labels[1] == OUTSIDE && w.edge.contains(&d));
    }
    piece.around(c, d).is_empty()
}

/// The exchange of two tetrahedra of one label at a face, across corner `k` of `t`, for three around a new edge.
pub(super) fn two_to_three(piece: &Workpiece, t: u32, k: usize, least: f64) -> Option<Exchange> {
    let s = piece.across(t, k)?;
    if piece.label(s) != piece.label(t) {
        return None;
    }
    let tet = piece.tet(t);
    let d = tet[k];
    let e = piece.tet(s).into_iter().find(|v| !tet.contains(v))?;
    let [_, p, q, r] = seen_from(tet, d, tet[(k + 1) % 4]);
    let mut sine = f64::INFINITY;
    let mut new = Vec::with_capacity(3);
    for (x, y) in [(p, q), (q, r), (r, p)] {
        let v = [d, e, x, y];
        sine = sine.min(least_sine(&piece.corners(v)));
        new.push((v, piece.label(t)));
    }
    (sine > least).then_some(Exchange {
        old: vec![t, s],
        new,
        sine,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Solid;
    use crate::geometry::cutting::complex::{Complex, SURFACE_BIT, Tet};
    use crate::geometry::shapes::block;
    use crate::geometry::tree::TriangleTree;
    use crate::math::Vec3;

    /// Two tetrahedra at the triangle 0 1 2, apexes 3 above and 4 below.
    fn two() -> Workpiece {
        let third = 2.0 * std::f64::consts::PI / 3.0;
        let around = |k: f64| Vec3::new((third * k).cos(), (third * k).sin(), 0.0);
        let points = vec![
            around(0.0),
            around(1.0),
            around(2.0),
            Vec3::new(0.0, 0.0, 0.4),
            Vec3::new(0.0, 0.0, -0.4),
        ];
        let tet = |v| Tet { v, class: 0 };
        let complex = Complex {
            on: vec![1 << SURFACE_BIT; 5],
            points,
            tets: vec![tet([0, 1, 2, 3]), tet([0, 2, 1, 4])],
            sides: vec![Vec::new()],
            boxes: Vec3::repeat(1.0),
        };
        Workpiece::new(&complex, &[7, 7])
    }

    /// Flat ones become three around the short axis, and those are not turned back; the volume stays.
    #[test]
    fn two_flat_tetrahedra_become_three_and_back() {
        let mut piece = two();
        let volume = |piece: &Workpiece| piece.alive().map(|t| piece.volume(t)).sum::<f64>();
        let (whole, before) = (volume(&piece), piece.worst(&[0, 1]));
        let exchange = two_to_three(&piece, 0, 3, before).unwrap();
        assert!(exchange.sine > before);
        exchange.perform(&mut piece);
        let three: Vec<u32> = piece.alive().collect();
        assert_eq!(three.len(), 3);
        assert!(
            three
                .iter()
                .all(|&t| piece.label(t) == 7 && piece.volume(t) > 0.0)
        );
        assert!((volume(&piece) - whole).abs() < 1e-15);
        // Its way back makes two of the angles that were there, which is only better than nothing.
        let solid = Solid::new(block(Vec3::repeat(2.0), 1.0).unwrap()).unwrap();
        let surfaces = Surfaces {
            solid: &solid,
            cells: None,
            borders: &[],
            planes: [0.0, 2.0, 0.0, 2.0, 0.0, 2.0],
            edge: 1.0,
            rest: TriangleTree::default(),
        };
        let leave = Leave {
            slack: 0.0,
            sag: 0.1,
            turn: 0.8,
        };
        assert!(removal(&piece, &surfaces, [3, 4], leave, before + 1e-9).is_none());
        removal(&piece, &surfaces, [3, 4], leave, 0.0)
            .unwrap()
            .perform(&mut piece);
        let two: Vec<u32> = piece.alive().collect();
        assert!((piece.worst(&two) - before).abs() < 1e-12 && two.len() == 2);
        assert!((volume(&piece) - whole).abs() < 1e-15);
        // The rim of the triangle turns by far more than the surface may: no edge of it goes.
        assert!(removal(&piece, &surfaces, [0, 1], leave, 0.0).is_none());
    }

    #[test]
    fn tetrahedra_are_turned_evenly() {
        for a in 0..4 {
            for b in (0..4).filter(|b| *b != a) {
                let turned = seen_from([0, 1, 2, 3], a, b);
                assert_eq!(turned[..2], [a, b]);
                let swaps = (0..4)
                    .flat_map(|i| (i + 1..4).map(move |j| (i, j)))
                    .filter(|&(i, j)| turned[i] > turned[j])
                    .count();
                assert_eq!(swaps % 2, 0, "{turned:?}");
            }
        }
    }
}
