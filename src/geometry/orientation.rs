//! Turning triangles so that a surface faces outward.
//!
//! Neighbours over an edge with exactly two triangles must run through it in opposite directions. Within each piece that
//! hangs together over such edges, the smaller area gives way. A piece that is closed, or nearly so, must then have a positive
//! volume, unless it is the wall of a cavity inside another piece. If a piece was inside out, so was what it contains.

use super::health::{Health, Side, sides};
use super::surface::{TriMesh, area_vector};
use super::tree::TriangleTree;
use crate::math::Vec3;

/// A piece whose open edges are longer than this share of its edges has no volume to go by, and keeps its orientation.
const NEARLY_CLOSED: f64 = 0.05;

/// A connected piece of the surface.
struct Piece {
    triangles: Vec<u32>,
    /// Volume about the piece's own centre \[mm³\], meaningful for closed pieces.
    volume: f64,
    nearly_closed: bool,
}

/// Turns triangles outward in place, and counts pieces, contradictions and what was turned into `health`.
pub(super) fn face_outward(mesh: &mut TriMesh, health: &mut Health) {
    let sides = sides(mesh);
    let (pieces, turned) = consistent_pieces(mesh, &sides, health);
    for (t, turn) in turned.iter().enumerate() {
        if *turn {
            mesh.triangles[t].swap(1, 2);
            health.flipped += 1;
        }
    }
    health.components = pieces.len();
    let mut pieces: Vec<Piece> = measured(mesh, &sides, pieces);
    pieces.retain(|piece| piece.nearly_closed && piece.volume != 0.0);
    // Containers first; ties by number.
    pieces.sort_by(|p, q| {
        q.volume
            .abs()
            .total_cmp(&p.volume.abs())
            .then(p.triangles[0].cmp(&q.triangles[0]))
    });
    let mut settled: Vec<(TriangleTree, bool)> = Vec::new();
    for piece in &pieces {
        let sample = samples(mesh, piece);
        let around: Vec<f64> = settled
            .iter()
            .map(|(tree, _)| mean_winding(tree, &sample))
            .collect();
        // The innermost container is the latest, since volumes fall.
        let container = (0..settled.len()).rev().find(|&k| around[k].abs() > 0.5);
        let mut turn = container.is_some_and(|k| settled[k].1);
        let outward = (piece.volume > 0.0) != turn;
        if !outward && around.iter().sum::<f64>() < 0.5 {
            turn = !turn;
        }
        if turn {
            for &t in &piece.triangles {
                mesh.triangles[t as usize].swap(1, 2);
            }
            health.inverted_components += 1;
        }
        let corners: Vec<[Vec3; 3]> = piece
            .triangles
            .iter()
            .map(|&t| mesh.corners(t as usize))
            .collect();
        settled.push((TriangleTree::new(&corners), turn));
    }
}

/// Floods each piece, and answers which triangles must be turned so that the piece agrees with itself.
fn consistent_pieces(mesh: &TriMesh, sides: &[Side], health: &mut Health) -> (Vec<Vec<u32>>, Vec<bool>) {
    let count = mesh.triangles.len();
    // Up to three neighbours, and whether they disagree: both run through the edge in the same direction.
    let mut neighbours: Vec<Vec<(u32, bool)>> = vec![Vec::new(); count];
    for edge in sides.chunk_by(|s, t| s.edge == t.edge) {
        if let [s, t] = edge {
            let disagree = s.forward == t.forward;
            neighbours[s.triangle as usize].push((t.triangle, disagree));
            neighbours[t.triangle as usize].push((s.triangle, disagree));
        }
    }
    let mut turned = vec![false; count];
    let mut seen = vec![false; count];
    let mut pieces = Vec::new();
    for seed in 0..count {
        if seen[seed] {
            continue;
        }
        seen[seed] = true;
        let mut piece = vec![seed as u32];
        let mut next = 0;
        while next < piece.len() {
            let t = piece[next] as usize;
            next += 1;
            for &(u, disagree) in &neighbours[t] {
                let wanted = turned[t] != disagree;
                if !seen[u as usize] {
                    seen[u as usize] = true;
                    turned[u as usize] = wanted;
                    piece.push(u);
                } else if turned[u as usize] != wanted && (u as usize) < t {
                    health.contradictions += 1;
                }
            }
        }
        let area = |wanted: bool| -> f64 {
            let chosen = piece.iter().filter(|&&t| turned[t as usize] == wanted);
            chosen
                .map(|&t| area_vector(&mesh.corners(t as usize)).norm())
                .sum()
        };
        if area(true) > area(false) {
            piece
                .iter()
                .for_each(|&t| turned[t as usize] = !turned[t as usize]);
        }
        pieces.push(piece);
    }
    (pieces, turned)
}

fn measured(mesh: &TriMesh, sides: &[Side], pieces: Vec<Vec<u32>>) -> Vec<Piece> {
    let mut home = vec![0_u32; mesh.triangles.len()];
    for (number, piece) in pieces.iter().enumerate() {
        piece.iter().for_each(|&t| home[t as usize] = number as u32);
    }
    let mut lengths = vec![[0.0; 2]; pieces.len()];
    for edge in sides.chunk_by(|s, t| s.edge == t.edge) {
        let [from, to] = edge[0].edge.map(|v| mesh.vertices[v as usize]);
        let length = (to - from).norm();
        for side in edge {
            let [all, open] = &mut lengths[home[side.triangle as usize] as usize];
            *all += length;
            *open += if edge.len() == 2 { 0.0 } else { length };
        }
    }
    let piece = |(number, triangles): (usize, Vec<u32>)| {
        let [all, open] = lengths[number];
        let corners = || triangles.iter().map(|&t| mesh.corners(t as usize));
        let centre = corners().flatten().sum::<Vec3>() / (3 * triangles.len()) as f64;
        let volume = corners()
            .map(|c| c.map(|v| v - centre))
            .map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0)
            .sum();
        Piece {
            volume,
            nearly_closed: open <= NEARLY_CLOSED * all,
            triangles,
        }
    };
    pieces.into_iter().enumerate().map(piece).collect()
}

/// A few points on the piece, spread over its triangles.
fn samples(mesh: &TriMesh, piece: &Piece) -> Vec<Vec3> {
    let count = piece.triangles.len();
    let centroid = |t: u32| mesh.corners(t as usize).iter().sum::<Vec3>() / 3.0;
    (0..count.min(5))
        .map(|k| centroid(piece.triangles[k * count / count.min(5)]))
        .collect()
}

fn mean_winding(tree: &TriangleTree, points: &[Vec3]) -> f64 {
    points.iter().map(|point| tree.winding_number(point)).sum::<f64>() / points.len() as f64
}
