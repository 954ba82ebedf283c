//! Weights from moving least squares with a linear basis.
//!
//! At every point x the plane a + bᵀ(y − x) that fits the nodes' displacements u_i at x_i best,
//!
//! ```text
//! min Σ_i w_i(x) |a + bᵀ(x_i − x) − u_i|²        u(x) = a = Σ_i φ_i(x) u_i
//! φ_i = w_i e₁ᵀ M⁻¹ p_i      M = Σ_i w_i p_i p_iᵀ      p_i = (1, (x_i − x)/r)
//! w_i = (1 − d²)³ for d < 1, else 0      d = |x_i − x| / r_i
//! ```
//!
//! gives the point's displacement (Lancaster and Salkauskas 1981; Kaufmann and others 2008). `r_i` is the support times the mean
//! length of the edges at node i, so that graded meshes are covered everywhere, and `r` a length that keeps M of order one. The w_i have two
//! continuous derivatives, and so does u wherever M can be inverted.

use super::index::Boxes;
use crate::geometry::volume::VolumeMesh;
use crate::math::Vec3;
use nalgebra::{Matrix4, Vector4};

/// M is singular where its least eigenvalue is below this share of the greatest: the nodes lie nearly in a plane.
const SINGULAR: f64 = 1e-4;

/// The nodes with their radii.
pub(super) struct Nodes<'a> {
    places: &'a [Vec3],
    radii: Vec<f64>,
    boxes: Boxes,
}

impl<'a> Nodes<'a> {
    pub fn new(mesh: &'a VolumeMesh, support: f64) -> Nodes<'a> {
        let mut sums = vec![(0.0, 0_u32); mesh.nodes.len()];
        for (node, near) in mesh.neighbours().iter().enumerate() {
            let length: f64 = near
                .iter()
                .map(|&n| (mesh.nodes[n as usize] - mesh.nodes[node]).norm())
                .sum();
            sums[node] = (length, near.len() as u32);
        }
        // A node without elements moves nobody.
        let radii: Vec<f64> = sums
            .iter()
            .map(|(l, n)| if *n > 0 { support * l / f64::from(*n) } else { 0.0 })
            .collect();
        let items: Vec<(Vec3, Vec3)> = mesh
            .nodes
            .iter()
            .zip(&radii)
            .map(|(x, r)| (x - Vec3::repeat(*r), x + Vec3::repeat(*r)))
            .collect();
        Nodes {
            places: &mesh.nodes,
            radii,
            boxes: Boxes::new(&items),
        }
    }

    /// The weights at `x`, by ascending node; `None` where the nodes around determine no plane.
    pub fn weights(&self, x: &Vec3) -> Option<(Vec<u32>, Vec<f64>)> {
        let mut near: Vec<(u32, f64)> = Vec::new();
        self.boxes.holding(x, |node| {
            let radius = self.radii[node as usize];
            let d = (self.places[node as usize] - x).norm_squared() / (radius * radius);
            if d < 1.0 {
                near.push((node, (1.0 - d).powi(3)));
            }
        });
        near.sort_unstable_by_key(|(node, _)| *node);
        if near.len() < 4 {
            return None;
        }
        let total: f64 = near.iter().map(|(_, w)| w).sum();
        let scale = near.iter().map(|(n, w)| w * self.radii[*n as usize]).sum::<f64>() / total;
        let basis = |node: u32| {
            let r = (self.places[node as usize] - x) / scale;
            Vector4::new(1.0, r.x, r.y, r.z)
        };
        let moment = near.iter().fold(Matrix4::zeros(), |m, (node, w)| {
            let p = basis(*node);
            m + p * p.transpose() * (*w / total)
        });
        let values = moment.symmetric_eigenvalues();
        if values.min() <= SINGULAR * values.max() {
            return None;
        }
        let row = moment.cholesky()?.solve(&Vector4::new(1.0, 0.0, 0.0, 0.0));
        let weights = near.iter().map(|(node, w)| w / total * row.dot(&basis(*node)));
        Some((near.iter().map(|(n, _)| *n).collect(), weights.collect()))
    }
}
