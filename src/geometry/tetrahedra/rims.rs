//! Sharp rims of the object: cuts chamfer them, because they meet the lattice's edges on both sides of a rim and never on it.
//!
//! Where the middle of a face lies off the surface, the planes that touch the surface next to its corners and its middle meet near the rim
//! (the idea of Kobbelt, Botsch, Schwanecke and Seidel 2001, "Feature sensitive surface extraction from volume data"). Each
//! corner tries the place nearest to it where they meet, and stays there if the faces around it lie closer to the surface then.

use super::surfaces::{Surfaces, step_onto};
use super::workpiece::{OUTSIDE, Wall, Workpiece};
use crate::geometry::cutting::complex::SURFACE_BIT;
use crate::math::Vec3;

/// A face is cut off a rim where its middle is farther than this from the surface, over the edge length.
const CHAMFER: f64 = 0.04;
/// The sine of the angle between two planes that make a rim.
const SHARP: f64 = 0.45;
/// The farthest way to a rim, over the edge length.
const FARTHEST: f64 = 0.5;
/// What must be left at most of the sum of squared distances of the faces around a vertex.
const GAIN: f64 = 0.8;
/// Faces around a vertex may turn by up to acos of this.
const LEAST_TURN: f64 = 0.2;

/// Moves vertices onto rims as far as the least sine around them stays above `least`.
pub(super) fn sharpen(piece: &mut Workpiece, surfaces: &Surfaces, least: f64) {
    for v in 0..piece.points.len() as u32 {
        let i = v as usize;
        let outer = piece.on[i] >> SURFACE_BIT & 1 == 1 && piece.anchors[i].is_none();
        if outer && piece.loose[i] == 0 && !piece.star(v).is_empty() {
            sharpen_at(piece, surfaces, v, least);
        }
    }
}

fn sharpen_at(piece: &mut Workpiece, surfaces: &Surfaces, v: u32, least: f64) {
    let mut walls = piece.walls(v);
    walls.retain(|w| w.labels[1] == OUTSIDE);
    let off = |piece: &Workpiece, w: &Wall| surfaces.off(piece, [v, w.edge[0], w.edge[1]], true);
    let chamfered = |w: &&Wall| off(piece, w) > CHAMFER * surfaces.edge;
    let candidates: Vec<Vec3> = walls
        .iter()
        .filter(chamfered)
        .filter_map(|w| meeting(piece, surfaces, v, w))
        .collect();
    if candidates.is_empty() {
        return;
    }
    let cost = |piece: &Workpiece| walls.iter().map(|w| off(piece, w).powi(2)).sum::<f64>();
    let normals = |piece: &Workpiece| -> Vec<Vec3> {
        let at = |w: &u32| piece.points[*w as usize] - piece.points[v as usize];
        let normal = |w: &Wall| at(&w.edge[0]).cross(&at(&w.edge[1])).try_normalize(0.0);
        walls.iter().map(|w| normal(w).unwrap_or_default()).collect()
    };
    let (home, facing) = (piece.points[v as usize], normals(piece));
    let mut best = (GAIN * cost(piece), home);
    for x in candidates {
        let labels = piece.star(v).iter().map(|&t| piece.label(t));
        if !surfaces.belongs(&x, labels, 0.0) {
            continue;
        }
        piece.relocate(v, x);
        let turned = normals(piece)
            .iter()
            .zip(&facing)
            .all(|(n, before)| n.dot(before) > LEAST_TURN);
        if turned && piece.worst(piece.star(v)) > least {
            let cost = cost(piece);
            if cost < best.0 {
                best = (cost, x);
            }
        }
    }
    piece.relocate(v, best.1);
}

/// The place nearest to `v` where the planes next to a wall's corners and its middle meet, if they are different planes and it is
/// near and on the surface.
fn meeting(piece: &Workpiece, surfaces: &Surfaces, v: u32, wall: &Wall) -> Option<Vec3> {
    let home = piece.points[v as usize];
    let corners = [v, wall.edge[0], wall.edge[1]].map(|i| piece.points[i as usize]);
    let middle = corners.iter().sum::<Vec3>() / 3.0;
    let places = [middle, corners[0], corners[1], corners[2]];
    let planes = places.map(|place| {
        let closest = surfaces.solid.closest(&place);
        let [a, b, c] = surfaces.solid.mesh().corners(closest.triangle as usize);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
        (normal.dot(&(home - closest.point)), normal)
    });
    let (step, rank) = step_onto(planes.into_iter(), SHARP);
    if rank < 2 || step.norm() > FARTHEST * surfaces.edge {
        return None;
    }
    let x = surfaces.onto(piece.on[v as usize], home + step)?;
    ((x - home - step).norm() < CHAMFER * surfaces.edge).then_some(x)
}
