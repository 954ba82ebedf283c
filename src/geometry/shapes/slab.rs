//! A slab: an outline in the plane, a bottom and a top over it, and rims that may be rounded.

use super::plane::{Flat, Patch, inset, patch};
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;
use std::f64::consts::FRAC_PI_2;

/// The making of a slab. Lengths in mm.
pub(super) struct Slab<'a> {
    /// Counter-clockwise from above.
    pub outline: &'a [Flat],
    /// Heights of the two faces over a point of the plane.
    pub bottom: &'a dyn Fn(Flat) -> f64,
    pub top: &'a dyn Fn(Flat) -> f64,
    /// Radii of the rims; zero leaves an edge. Together below the height at the rim.
    pub bottom_rim: f64,
    pub top_rim: f64,
    /// Length of the triangles' sides.
    pub spacing: f64,
}

/// The closed, outward surface of the slab.
pub(super) fn slab(slab: &Slab) -> TriMesh {
    let around = slab.outline.len() as u32;
    let rings = rings(slab);
    let mut mesh = TriMesh::default();
    for ring in &rings {
        mesh.vertices.extend(ring);
    }
    for lower in 0..rings.len() as u32 - 1 {
        for k in 0..around {
            let at = |ring: u32, k: u32| ring * around + k % around;
            let [a, b] = [at(lower, k), at(lower, k + 1)];
            let [d, c] = [at(lower + 1, k), at(lower + 1, k + 1)];
            // Alternating diagonals, so that the wall has no grain.
            let pair = if (lower + k) % 2 == 0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            };
            mesh.triangles.extend(pair);
        }
    }
    let flat = |ring: &[Vec3]| -> Vec<Flat> { ring.iter().map(|v| [v.x, v.y]).collect() };
    let last = rings.len() - 1;
    let cap = |ring: usize| patch(&flat(&rings[ring]), slab.spacing);
    close(
        &mut mesh,
        &cap(last),
        last as u32 * around,
        around,
        slab.top,
        false,
    );
    close(&mut mesh, &cap(0), 0, around, slab.bottom, true);
    mesh
}

/// Rings of the wall from the rim of the bottom to the rim of the top.
fn rings(slab: &Slab) -> Vec<Vec<Vec3>> {
    let arc_steps = |radius: f64| match radius {
        radius if radius > 0.0 => (FRAC_PI_2 * radius / slab.spacing).ceil().max(3.0) as usize,
        _ => 0,
    };
    let ring = |by: f64, height: &dyn Fn(Flat) -> f64| -> Vec<Vec3> {
        let points = inset(slab.outline, by);
        points
            .into_iter()
            .map(|p| Vec3::new(p[0], p[1], height(p)))
            .collect()
    };
    let mut rings = Vec::new();
    let steps = arc_steps(slab.bottom_rim);
    for step in 0..steps {
        let angle = FRAC_PI_2 * step as f64 / steps as f64;
        let radius = slab.bottom_rim;
        let rise = radius * (1.0 - angle.cos());
        rings.push(ring(radius * (1.0 - angle.sin()), &|p| (slab.bottom)(p) + rise));
    }
    let from = |p: Flat| (slab.bottom)(p) + slab.bottom_rim;
    let to = |p: Flat| (slab.top)(p) - slab.top_rim;
    let tallest = slab.outline.iter().map(|&p| to(p) - from(p)).fold(0.0, f64::max);
    let levels = (tallest / slab.spacing).round().max(1.0) as usize;
    for level in 0..=levels {
        let share = level as f64 / levels as f64;
        rings.push(ring(0.0, &|p| from(p) + share * (to(p) - from(p))));
    }
    let steps = arc_steps(slab.top_rim);
    for step in 1..=steps {
        let angle = FRAC_PI_2 * step as f64 / steps as f64;
        let radius = slab.top_rim;
        let drop = radius * (1.0 - angle.sin());
        rings.push(ring(radius * (1.0 - angle.cos()), &|p| (slab.top)(p) - drop));
    }
    rings
}

/// Closes the wall with a cap whose outline is the ring that begins at vertex `ring`.
fn close(
    mesh: &mut TriMesh,
    cap: &Patch,
    ring: u32,
    around: u32,
    height: &dyn Fn(Flat) -> f64,
    downward: bool,
) {
    let inner = mesh.vertices.len() as u32;
    mesh.vertices.extend(
        cap.points
            .iter()
            .skip(around as usize)
            .map(|&p| Vec3::new(p[0], p[1], height(p))),
    );
    let number = |v: u32| if v < around { ring + v } else { inner + v - around };
    for t in &cap.triangles {
        let [a, b, c] = t.map(number);
        mesh.triangles.push(if downward { [a, c, b] } else { [a, b, c] });
    }
}
