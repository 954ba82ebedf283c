//! Moving one vertex to where the worst tetrahedron around it is best.
//!
//! The least sine around a vertex has kinks, so it is climbed without derivatives: steps of shrinking length along the
//! axes, towards the middle of the neighbours, and away from the worst tetrahedron's far face. A vertex on surfaces is led back onto them after
//! every step.

use super::shape::least_sine;
use super::surfaces::Surfaces;
use super::workpiece::Workpiece;
use crate::math::Vec3;

/// Step lengths over the edge length.
const STEPS: [f64; 4] = [0.2, 0.08, 0.03, 0.01];
/// Steps of one length.
const MOST: usize = 4;
/// A step must improve by this.
const GAIN: f64 = 1e-3;

/// Moves vertex `v`; answers whether it did. It may be off its loose surfaces by `slack` \[mm\].
pub(super) fn smooth(piece: &mut Workpiece, surfaces: &Surfaces, v: u32, slack: f64) -> bool {
    if piece.anchors[v as usize].is_some() && slack == 0.0 || piece.star(v).is_empty() {
        return false;
    }
    if piece.on[v as usize] == 0 && !piece.walls(v).is_empty() {
        // It separates cells, but nothing says along which surface.
        return false;
    }
    let start = piece.worst(piece.star(v));
    let (mut best, mut place) = (start, piece.points[v as usize]);
    for step in STEPS {
        for _ in 0..MOST {
            let found = directions(piece, v, &place).into_iter().find_map(|direction| {
                let x = place + direction * (step * surfaces.edge);
                // Most steps make it worse, with or without the way back onto the surfaces.
                around(piece, v, &x, best * (1.0 + GAIN))?;
                let x = surfaces.allowed(piece, v, x, slack)?;
                Some((around(piece, v, &x, best * (1.0 + GAIN))?, x))
            });
            match found {
                Some(better) => (best, place) = better,
                None => break,
            }
        }
    }
    let moved = best > start;
    if moved {
        piece.relocate(v, place);
    }
    moved
}

/// The least sine around `v` if it stood at `x`; `None` if that is not above `least`.
fn around(piece: &Workpiece, v: u32, x: &Vec3, least: f64) -> Option<f64> {
    let mut worst = f64::INFINITY;
    for &t in piece.star(v) {
        let tet = piece.tet(t);
        let mut corners = piece.corners(tet);
        for (corner, w) in corners.iter_mut().zip(tet) {
            if w == v {
                *corner = *x;
            }
        }
        worst = worst.min(least_sine(&corners));
        if worst <= least {
            return None;
        }
    }
    Some(worst)
}

/// Unit directions worth trying from `x`.
fn directions(piece: &Workpiece, v: u32, x: &Vec3) -> Vec<Vec3> {
    let star = piece.star(v);
    let (mut sum, mut count) = (Vec3::zeros(), 0.0);
    let mut worst = (f64::INFINITY, Vec3::zeros());
    for &t in star {
        let tet = piece.tet(t);
        let mut corners = piece.corners(tet);
        let Some(k) = tet.iter().position(|&w| w == v) else {
            continue;
        };
        corners[k] = *x;
        let sine = least_sine(&corners);
        let far = [1, 2, 3].map(|i| corners[(k + i) % 4]);
        far.iter().for_each(|p| sum += p);
        count += 3.0;
        if sine < worst.0 {
            let normal = (far[1] - far[0]).cross(&(far[2] - far[0]));
            worst = (sine, normal * normal.dot(&(x - far[0])).signum());
        }
    }
    let unit = |d: Vec3| d.try_normalize(0.0);
    let mut list: Vec<Vec3> = [unit(worst.1), unit(sum / count - x)]
        .into_iter()
        .flatten()
        .collect();
    if let Some(away) = unit(worst.1) {
        list.push(-away);
    }
    for k in 0..3 {
        list.extend([Vec3::ith(k, 1.0), Vec3::ith(k, -1.0)]);
    }
    list
}
