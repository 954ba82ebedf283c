//! What a mesh is like: its angles, and how far it is from the object and the borders that it should follow.

use super::shape::dihedral_angles_deg;
use super::surfaces::{Surfaces, each};
use super::workpiece::{OUTSIDE, Workpiece};
use super::{Quality, manifold};
use crate::geometry::TriMesh;
use crate::geometry::cutting::complex::FIRST_INTERFACE_BIT;
use crate::geometry::tree::TriangleTree;
use crate::geometry::volume::{Elements, VolumeMesh};
use crate::math::Vec3;
use rayon::prelude::*;

/// Most samples along a side of a triangle of the object's surface.
const FINEST: usize = 12;

/// The mesh with its labels, vertices numbered in the order of their first use.
pub(super) fn finished(piece: &Workpiece) -> (VolumeMesh, Vec<u32>) {
    let mut number = vec![u32::MAX; piece.points.len()];
    let (mut nodes, mut tets, mut labels) = (Vec::new(), Vec::new(), Vec::new());
    for t in piece.alive() {
        tets.push(piece.tet(t).map(|v| {
            let slot = &mut number[v as usize];
            if *slot == u32::MAX {
                *slot = nodes.len() as u32;
                nodes.push(piece.points[v as usize]);
            }
            *slot
        }));
        labels.push(piece.label(t));
    }
    let elements = Elements::Tetrahedra(tets);
    (VolumeMesh { nodes, elements }, labels)
}

/// Measures everything.
pub(super) fn quality(piece: &Workpiece, surfaces: &Surfaces, bound_deg: f64) -> Quality {
    let alive: Vec<u32> = piece.alive().collect();
    let angles: Vec<[f64; 2]> = alive
        .par_iter()
        .map(|&t| dihedral_angles_deg(&piece.corners(piece.tet(t))))
        .collect();
    let range = angles.iter().fold([180.0_f64, 0.0_f64], |range, a| {
        [range[0].min(a[0]), range[1].max(a[1])]
    });
    let volume_mm3: f64 = alive.iter().map(|&t| piece.volume(t)).sum();
    Quality {
        bound_deg,
        least_dihedral_deg: range[0],
        greatest_dihedral_deg: range[1],
        below_bound: angles.iter().filter(|a| a[0] < bound_deg).count(),
        volume_mm3,
        volume_error: volume_mm3 / surfaces.solid.volume() - 1.0,
        surface_distance_mm: surface_distance(piece, surfaces),
        border_distance_mm: border_distance(piece, surfaces),
    }
}

/// The largest distance found between the object's surface and the mesh's, both ways.
fn surface_distance(piece: &Workpiece, surfaces: &Surfaces) -> f64 {
    let border: Vec<[Vec3; 3]> = manifold::border(piece)
        .into_iter()
        .map(|(face, _)| face.map(|v| piece.points[v as usize]))
        .collect();
    let from_mesh = |corners: &[Vec3; 3]| {
        let middle = corners.iter().sum::<Vec3>() / 3.0;
        let ends = [corners[0], corners[1], corners[2], middle];
        ends.iter()
            .map(|p| surfaces.solid.closest(p).distance)
            .fold(0.0, f64::max)
    };
    let outward = border.par_iter().map(from_mesh).reduce(|| 0.0, f64::max);
    let tree = TriangleTree::new(&border);
    let mesh = surfaces.solid.mesh();
    let mut inward: Vec<(f64, usize, Vec3)> = (0..mesh.triangles.len())
        .into_par_iter()
        .flat_map_iter(|t| samples(mesh, t, surfaces.edge).into_iter().map(move |p| (t, p)))
        .filter_map(|(t, p)| Some((tree.closest(&p)?.distance, t, p)))
        .filter(|(distance, ..)| *distance > outward)
        .collect();
    inward.sort_by(|p, q| q.0.total_cmp(&p.0).then(p.1.cmp(&q.1)));
    // A sheet inside the object, where parts overlap, is no surface of it.
    let real = |(_, t, p): &&(f64, usize, Vec3)| {
        let [a, b, c] = mesh.corners(*t);
        let out = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vec3::z) * (0.05 * surfaces.edge);
        surfaces.solid.contains(&(p - out)) != surfaces.solid.contains(&(p + out))
    };
    inward
        .iter()
        .find(real)
        .map_or(outward, |(distance, ..)| *distance)
}

/// Points of a triangle, about half an edge length apart, at its corners at least.
fn samples(mesh: &TriMesh, t: usize, edge: f64) -> Vec<Vec3> {
    let [a, b, c] = mesh.corners(t);
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let n = ((2.0 * longest / edge).ceil() as usize).clamp(1, FINEST);
    let at = |i: usize, j: usize| a + (b - a) * (i as f64 / n as f64) + (c - a) * (j as f64 / n as f64);
    (0..=n)
        .flat_map(|i| (0..=n - i).map(move |j| (i, j)))
        .map(|(i, j)| at(i, j))
        .collect()
}

/// The largest distance of a face between two cells from the border that it stands for, at its corners and its middle.
fn border_distance(piece: &Workpiece, surfaces: &Surfaces) -> f64 {
    let vertices: Vec<u32> = (0..piece.points.len() as u32).collect();
    let off = |&v: &u32| {
        let walls = piece.walls(v).into_iter().filter(|w| w.labels[1] != OUTSIDE);
        let of = |edge: [u32; 2]| {
            let corners = [v, edge[0], edge[1]].map(|i| piece.points[i as usize]);
            let middle = corners.iter().sum::<Vec3>() / 3.0;
            let bits = piece.bits([v, edge[0], edge[1]]) >> FIRST_INTERFACE_BIT << FIRST_INTERFACE_BIT;
            let distance = |x: &Vec3| {
                each(bits)
                    .map(|bit| surfaces.farthest(1 << bit, 0, x))
                    .fold(f64::INFINITY, f64::min)
                    .min(if bits == 0 {
                        surfaces.nearest_border(x)
                    } else {
                        f64::INFINITY
                    })
            };
            distance(&corners[0]).max(distance(&middle))
        };
        walls.map(|w| of(w.edge)).fold(0.0, f64::max)
    };
    vertices.par_iter().map(off).reduce(|| 0.0, f64::max)
}
