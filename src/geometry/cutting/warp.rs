//! Moving vertices that a cut passes closely onto it, before it is made.
//!
//! A crossing at distance `d` from the nearer end `v` of its edge would leave an edge of length `d`. For `d ≤ near · h`
//! the vertex is moved to the crossing, if it
//!
//! - stays on every plane and surface on which it lies: the edge's other end lies on all of them, too;
//! - inverts and flattens nothing: each tetrahedron around it keeps a quarter of its volume;
//! - keeps the object's volume, when it lies on the object's surface: the volumes around it keep their sum. Both ends
//!   of an edge can lie on the surface while the edge runs inside, and this is what notices.
//!
//! A vertex nearer than `0.001 h` that may not be moved counts as on the cut where it stands.

use super::complex::{Complex, SURFACE_BIT};
use super::cut::{Crossing, Keep, Knife};

/// A crossing nearer than this, over `h`, is taken to be at its vertex even where that may not move.
const AT: f64 = 1e-3;
/// Least share of its volume that a tetrahedron must keep when a vertex moves.
const SHARE: f64 = 0.25;
/// Most change of the object's volume, over `h³`, by one vertex.
const DENT: f64 = 2e-3;

/// Moves the vertices, sets `values` to zero there, and marks them as on the cut.
pub(super) fn warp(complex: &mut Complex, values: &mut [f64], crossings: &[Crossing], knife: &Knife) {
    let candidates = candidates(complex, crossings, knife);
    let mut slot = vec![u32::MAX; complex.points.len()];
    for (k, candidate) in candidates.iter().enumerate() {
        slot[candidate.vertex as usize] = k as u32;
    }
    let mut stars: Vec<Vec<u32>> = vec![Vec::new(); candidates.len()];
    for (t, tet) in complex.tets.iter().enumerate() {
        for v in tet.v {
            if slot[v as usize] != u32::MAX {
                stars[slot[v as usize] as usize].push(t as u32);
            }
        }
    }
    for (candidate, star) in candidates.iter().zip(&stars) {
        let v = candidate.vertex as usize;
        if candidate.may_move && moves(complex, v, star, candidate.crossing, knife)
            || candidate.distance <= AT * knife.h
        {
            values[v] = 0.0;
            complex.on[v] |= 1 << knife.bit;
        }
    }
}

#[derive(Clone, Copy)]
struct Candidate<'a> {
    vertex: u32,
    crossing: &'a Crossing,
    distance: f64,
    may_move: bool,
}

/// Each vertex's nearest crossing, if it is near enough, by ascending vertex.
fn candidates<'a>(complex: &Complex, crossings: &'a [Crossing], knife: &Knife) -> Vec<Candidate<'a>> {
    let mut found = Vec::new();
    for crossing in crossings {
        let (a, b) = crossing.ends;
        let distance = |v: u32| (complex.points[v as usize] - crossing.point).norm();
        let (vertex, other, distance) = if distance(a) <= distance(b) {
            (a, b, distance(a))
        } else {
            (b, a, distance(b))
        };
        let may_move = distance <= knife.near * knife.h
            && complex.on[vertex as usize] & !complex.on[other as usize] == 0;
        if may_move || distance <= AT * knife.h {
            found.push(Candidate {
                vertex,
                crossing,
                distance,
                may_move,
            });
        }
    }
    // Stable: among equals the first crossing stays first. One that can move its vertex goes before one that cannot.
    found.sort_by(|p, q| {
        (p.vertex, !p.may_move)
            .cmp(&(q.vertex, !q.may_move))
            .then(p.distance.total_cmp(&q.distance))
    });
    found.dedup_by_key(|c| c.vertex);
    found
}

/// Moves vertex `v` to the crossing if the tetrahedra around it allow it.
fn moves(complex: &mut Complex, v: usize, star: &[u32], crossing: &Crossing, knife: &Knife) -> bool {
    let volumes = |complex: &Complex| -> Vec<f64> {
        star.iter()
            .map(|&t| complex.six_volumes(complex.tets[t as usize].v))
            .collect()
    };
    let home = complex.points[v];
    let before = volumes(complex);
    complex.points[v] = crossing.point;
    let after = volumes(complex);
    let whole = before.iter().zip(&after).all(|(b, a)| *a >= SHARE * b);
    let on_object = knife.keep == Keep::Both && complex.on[v] & 1 << SURFACE_BIT != 0;
    let dent = (after.iter().sum::<f64>() - before.iter().sum::<f64>()).abs() / 6.0;
    if whole && (!on_object || dent <= DENT * knife.h.powi(3)) {
        return true;
    }
    complex.points[v] = home;
    false
}

#[cfg(test)]
mod tests {
    use super::super::complex::{FIRST_INTERFACE_BIT, Tet};
    use super::*;
    use crate::math::Vec3;

    /// Two tetrahedra on both sides of the triangle 0 1 2, and a crossing near vertex 0 on the edge to `other`.
    fn warped(on: [u128; 5], apex: f64, other: u32, at: f64) -> (Complex, Vec<f64>) {
        let points = vec![
            Vec3::zeros(),
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(0.0, 1.0, 0.0),
            Vec3::new(0.3, 0.3, apex),
            Vec3::new(0.3, 0.3, -1.0),
        ];
        let tets = vec![
            Tet {
                v: [0, 1, 2, 3],
                class: 0,
            },
            Tet {
                v: [0, 2, 1, 4],
                class: 0,
            },
        ];
        let mut complex = Complex {
            points,
            on: on.to_vec(),
            tets,
            sides: vec![Vec::new()],
            boxes: Vec3::repeat(1.0),
        };
        assert!(complex.tets.iter().all(|t| complex.six_volumes(t.v) > 0.0));
        let mut values = vec![1.0; 5];
        let point = complex.points[other as usize] * at;
        let knife = Knife {
            level: &|_| 0.0,
            bit: FIRST_INTERFACE_BIT,
            keep: Keep::Both,
            h: 1.0,
            near: 0.15,
        };
        warp(
            &mut complex,
            &mut values,
            &[Crossing {
                ends: (0, other),
                point,
            }],
            &knife,
        );
        (complex, values)
    }

    #[test]
    fn a_free_vertex_moves() {
        let (complex, values) = warped([0; 5], 1.0, 4, 0.1);
        assert_eq!(values[0], 0.0);
        assert_eq!(complex.points[0], Vec3::new(0.03, 0.03, -0.1));
        assert_eq!(complex.on[0], 1 << FIRST_INTERFACE_BIT);
    }

    /// Apex 3 lies 0.05 above vertices 0, 1, 2. Up to 0.14 beside it, vertex 0 would turn the tetrahedron over.
    #[test]
    fn nothing_is_flattened() {
        let (mut complex, _) = warped([0; 5], 0.05, 4, 0.9);
        let knife = Knife {
            level: &|_| 0.0,
            bit: FIRST_INTERFACE_BIT,
            keep: Keep::Both,
            h: 1.0,
            near: 0.15,
        };
        let mut values = vec![1.0; 5];
        let crossing = Crossing {
            ends: (0, 3),
            point: Vec3::new(0.01, 0.01, 0.14),
        };
        warp(&mut complex, &mut values, &[crossing], &knife);
        assert_eq!((complex.points[0], values[0]), (Vec3::zeros(), 1.0));
    }

    #[test]
    fn a_vertex_stays_on_its_surfaces() {
        let other_bit = 1 << (FIRST_INTERFACE_BIT + 5);
        let (complex, values) = warped([other_bit, 0, 0, 0, 0], 1.0, 4, 0.1);
        assert_eq!((complex.points[0], values[0]), (Vec3::zeros(), 1.0));
        let (complex, _) = warped([other_bit, 0, 0, 0, other_bit], 1.0, 4, 0.1);
        assert_ne!(complex.points[0], Vec3::zeros());
        // Near enough to count as there.
        let (complex, values) = warped([other_bit, 0, 0, 0, 0], 1.0, 4, 5e-4);
        assert_eq!((complex.points[0], values[0]), (Vec3::zeros(), 0.0));
    }

    /// Vertex 0 and 4 on the object's surface, the edge between them inside: moving along it would dent the object.
    #[test]
    fn the_object_is_not_dented() {
        let surface = 1 << SURFACE_BIT;
        let (complex, values) = warped([surface, 0, 0, 0, surface], 1.0, 4, 0.1);
        assert_eq!((complex.points[0], values[0]), (Vec3::zeros(), 1.0));
    }
}
