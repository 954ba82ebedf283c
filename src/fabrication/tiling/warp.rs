//! Moving vertices that a cut passes closely onto it, before it is made.
//!
//! A crossing at distance `d` from the nearer end `v` of its edge would leave an edge of length `d`. For `d ≤ 0.15 h`
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

/// A crossing nearer than this, over `h`, moves its vertex.
const NEAR: f64 = 0.15;
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
        let may_move =
            distance <= NEAR * knife.h && complex.on[vertex as usize] & !complex.on[other as usize] == 0;
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
