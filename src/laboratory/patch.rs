//! The probe's force on the fine mesh: spread evenly over the material under the disc.
//!
//! ```text
//! s_a = ∫_P N_a dA / ∫_P dA            P: the material of the face under the disc, seen along the probe's direction
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | s_a | share of node a in the force, Σ s_a = 1 | – |
//! | N_a | shape function on the face | – |
//!
//! A disc over holes presses on the walls alone, so the same force means more pressure there. The integral is a sum over
//! 8 × 8 spots of each element's face; octants without material do not count.

use super::read::Face;
use super::structure::Fine;
use crate::fem::example::Contact;
use crate::geometry::boundary::{BoundaryFace, boundary_faces};
use crate::math::Vec3;

/// Spots along each edge of an element's face.
const SAMPLES: usize = 8;
/// Reference coordinates of a face's corners.
const SIGNS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// An element's face on one of the block's faces.
#[derive(Clone, Debug)]
pub struct OuterFace {
    /// Its nodes, counter-clockwise seen from outside.
    pub nodes: [u32; 4],
    /// Share of material next to each of them.
    pub fill: [f64; 4],
}

impl OuterFace {
    /// Its shape functions at the reference coordinates `at`.
    pub fn shape(at: [f64; 2]) -> [f64; 4] {
        SIGNS.map(|s| 0.25 * (1.0 + s[0] * at[0]) * (1.0 + s[1] * at[1]))
    }
}

/// The element faces that lie on `face` of the block.
pub fn outer_faces(fine: &Fine, face: Face) -> Vec<OuterFace> {
    let axis = face.axis.index();
    let (place, thin) = (face.place(&fine.size), 1e-6 * fine.size.max());
    let on_plane = |own: &BoundaryFace| {
        let lies = |n: &u32| (fine.mesh.nodes[*n as usize][axis] - place).abs() <= thin;
        own.nodes().len() == 4 && own.nodes().iter().all(lies)
    };
    let mut faces = Vec::new();
    for own in boundary_faces(&fine.mesh).iter().filter(|f| on_plane(f)) {
        let cell = fine.cell(own.element as usize);
        let mut outer = OuterFace {
            nodes: [0; 4],
            fill: [0.0; 4],
        };
        for (k, node) in own.nodes().iter().enumerate() {
            outer.nodes[k] = *node;
            let corner = cell.iter().position(|n| n == node).unwrap_or(0);
            outer.fill[k] = fine.octant(own.element as usize, corner);
        }
        faces.push(outer);
    }
    faces
}

/// The face of the block that a press along `direction` meets: the one that looks most against it.
pub fn pressed(direction: &Vec3) -> Face {
    let mut best = Face::ALL[0];
    for face in Face::ALL {
        if face.normal().dot(direction) < best.normal().dot(direction) - 1e-12 {
            best = face;
        }
    }
    best
}

/// Share of each node, `(nodes)`, in the force of a press.
///
/// # Errors
/// A sentence: the point lies off its face, or no material lies under the disc.
pub fn shares(fine: &Fine, contact: &Contact) -> Result<Vec<f64>, String> {
    let face = pressed(&contact.direction);
    let (axis, place) = (face.axis.index(), face.place(&fine.size));
    let off = (contact.point[axis] - place).abs();
    let size = fine.size;
    let is_beside = face
        .across()
        .iter()
        .any(|&c| !(0.0..=size[c]).contains(&contact.point[c]));
    if off > contact.radius_mm || is_beside {
        return Err(format!(
            "the point {:?} mm does not lie on the face that the press meets; the block spans (0, 0, 0) to ({:.2}, {:.2}, {:.2}) mm",
            contact.point.as_slice(),
            size.x,
            size.y,
            size.z
        ));
    }
    let mut shares = vec![0.0; fine.mesh.nodes.len()];
    let mut area = 0.0;
    for own in outer_faces(fine, face) {
        let corners = own.nodes.map(|n| fine.mesh.nodes[n as usize]);
        for i in 0..SAMPLES * SAMPLES {
            let at = [i % SAMPLES, i / SAMPLES].map(|k| (2.0 * k as f64 + 1.0) / SAMPLES as f64 - 1.0);
            let shape = OuterFace::shape(at);
            let x: Vec3 = corners.iter().zip(shape).map(|(x, n)| x * n).sum();
            let from = x - contact.point;
            let across = from - contact.direction * from.dot(&contact.direction);
            if across.norm() > contact.radius_mm {
                continue;
            }
            let nearest = SIGNS
                .iter()
                .position(|s| s[0] * at[0] > 0.0 && s[1] * at[1] > 0.0);
            let weight = spot_area(&corners, at) * own.fill[nearest.unwrap_or(0)];
            area += weight;
            for (node, n) in own.nodes.iter().zip(shape) {
                shares[*node as usize] += weight * n;
            }
        }
    }
    if area <= 0.0 {
        return Err(format!(
            "no material lies under the disc of {} mm at {:?} mm: move the point or use a larger disc",
            contact.radius_mm,
            contact.point.as_slice()
        ));
    }
    shares.iter_mut().for_each(|s| *s /= area);
    Ok(shares)
}

/// Area that the spot at the reference coordinates `at` stands for, up to a factor that all spots share.
fn spot_area(corners: &[Vec3; 4], at: [f64; 2]) -> f64 {
    let (mut along, mut across) = (Vec3::zeros(), Vec3::zeros());
    for (x, s) in corners.iter().zip(&SIGNS) {
        along += x * (0.25 * s[0] * (1.0 + s[1] * at[1]));
        across += x * (0.25 * s[1] * (1.0 + s[0] * at[0]));
    }
    along.cross(&across).norm()
}
