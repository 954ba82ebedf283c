//! The element that holds a point, and its shape functions there.
//!
//! In a tetrahedron the barycentric coordinates are λ_i = V_i / V, with V_i the volume that is left when the point takes the
//! place of node i. In a hexahedron the reference coordinates ξ solve
//!
//! ```text
//! Σ_i N_i(ξ) x_i = x          N_i = ⅛ Π_k (1 + ξ_ik ξ_k)
//! ```
//!
//! by Newton's method. A Kuhn cell is six tetrahedra. Outside, the nearest element's functions go on: a hexahedron's are carried on
//! linearly from the nearest point in it, so that they do not grow with a power of the distance.

use super::EmbeddingError;
use super::index::Boxes;
use crate::geometry::closest::closest_on_triangle;
use crate::geometry::volume::{CORNERS, Elements, KUHN, VolumeMesh};
use crate::math::{Mat3, Vec3};

/// Barycentric and reference coordinates may be outside by this much and count as inside: rounding.
const INSIDE: f64 = 1e-9;
/// Newton's steps for a hexahedron's map; it is quadratic and mostly needs four.
const STEPS: usize = 30;

/// Where a point lies.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// The element.
    pub element: usize,
    /// Its nodes; of a Kuhn cell those of one tetrahedron.
    pub nodes: Vec<u32>,
    /// Their shape functions at the point, which add up to one.
    pub weights: Vec<f64>,
    /// Distance from the element, zero inside \[mm\].
    pub distance_mm: f64,
    /// The element's longest edge \[mm\].
    pub longest_edge_mm: f64,
}

/// Finds the elements of a mesh.
#[derive(Clone, Debug)]
pub struct Locator<'a> {
    mesh: &'a VolumeMesh,
    boxes: Boxes,
}

impl<'a> Locator<'a> {
    /// An index of the elements of `mesh`.
    ///
    /// # Errors
    /// [`EmbeddingError`]: a mesh without elements, or with nodes that are missing or nowhere.
    pub fn new(mesh: &'a VolumeMesh) -> Result<Locator<'a>, EmbeddingError> {
        if mesh.elements.is_empty() {
            return Err(EmbeddingError::NoElements);
        }
        let mut items = Vec::with_capacity(mesh.elements.len());
        for element in 0..mesh.elements.len() {
            let mut bounds = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
            for &node in mesh.elements.nodes_of(element) {
                let Some(x) = mesh
                    .nodes
                    .get(node as usize)
                    .filter(|x| x.iter().all(|c| c.is_finite()))
                else {
                    return Err(EmbeddingError::BadNode { element, node });
                };
                bounds = (bounds.0.inf(x), bounds.1.sup(x));
            }
            items.push(bounds);
        }
        Ok(Locator {
            mesh,
            boxes: Boxes::new(&items),
        })
    }

    /// The element that holds `x`, or the nearest one.
    pub fn nearest(&self, x: &Vec3) -> Held {
        let at = |e: u32| {
            let nodes = self.mesh.elements.nodes_of(e as usize);
            let corners = |places: &[usize; 4]| places.map(|i| self.mesh.nodes[nodes[i] as usize]);
            match &self.mesh.elements {
                Elements::Tetrahedra(_) => {
                    let (distance, weights) = in_tetrahedron(&corners(&[0, 1, 2, 3]), x);
                    (distance, (nodes.to_vec(), weights.to_vec()))
                }
                Elements::KuhnCells(_) => {
                    let parts = KUHN.iter().map(|tet| (in_tetrahedron(&corners(tet), x), tet));
                    let nearest = parts.min_by(|p, q| p.0.0.total_cmp(&q.0.0));
                    let ((distance, weights), tet) =
                        nearest.unwrap_or(((f64::INFINITY, [0.25; 4]), &KUHN[0]));
                    (distance, (tet.map(|i| nodes[i]).to_vec(), weights.to_vec()))
                }
                Elements::Hexahedra(cells) => {
                    let corners = cells[e as usize].map(|n| self.mesh.nodes[n as usize]);
                    let (distance, weights) = in_hexahedron(&corners, x);
                    (distance, (nodes.to_vec(), weights.to_vec()))
                }
            }
        };
        // There are elements, so one of them is nearest.
        let (element, distance_mm, (nodes, weights)) =
            self.boxes
                .nearest(x, at)
                .unwrap_or((0, f64::INFINITY, (Vec::new(), Vec::new())));
        let all = self.mesh.elements.nodes_of(element as usize);
        let place = |n: &u32| self.mesh.nodes[*n as usize];
        let lengths = all
            .iter()
            .flat_map(|a| all.iter().map(move |b| (place(a) - place(b)).norm()));
        Held {
            element: element as usize,
            nodes,
            weights,
            distance_mm,
            longest_edge_mm: lengths.fold(0.0, f64::max),
        }
    }
}

/// Distance from a tetrahedron, zero inside \[mm\], and barycentric coordinates.
fn in_tetrahedron(p: &[Vec3; 4], x: &Vec3) -> (f64, [f64; 4]) {
    let six = |a: &Vec3, b: &Vec3, c: &Vec3, d: &Vec3| (b - a).cross(&(c - a)).dot(&(d - a));
    let whole = six(&p[0], &p[1], &p[2], &p[3]);
    // From the differences to one node, so that the weights add up to one.
    let [b, c, d] = [
        six(&p[0], x, &p[2], &p[3]) / whole,
        six(&p[0], &p[1], x, &p[3]) / whole,
        six(&p[0], &p[1], &p[2], x) / whole,
    ];
    let weights = [1.0 - b - c - d, b, c, d];
    if !weights.iter().all(|w| w.is_finite()) {
        return (f64::INFINITY, [0.25; 4]);
    }
    if weights.iter().all(|w| *w >= -INSIDE) {
        return (0.0, weights);
    }
    let faces = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];
    let distances = faces.map(|face| (closest_on_triangle(&face.map(|i| p[i]), x) - x).norm());
    (distances.into_iter().fold(f64::INFINITY, f64::min), weights)
}

/// Shape functions of a hexahedron and their gradients in reference coordinates.
fn trilinear(at: &Vec3) -> [(f64, Vec3); 8] {
    CORNERS.map(|s| {
        let [x, y, z] = std::array::from_fn(|k| 1.0 + s[k] * at[k]);
        let gradient = Vec3::new(s[0] * y * z, s[1] * x * z, s[2] * x * y);
        (x * y * z / 8.0, gradient / 8.0)
    })
}

/// The place of reference coordinates and the map's derivative there.
fn mapped(p: &[Vec3; 8], at: &Vec3) -> (Vec3, Mat3) {
    let functions = trilinear(at);
    let mut place = Vec3::zeros();
    let mut slope = Mat3::zeros();
    for (x, (n, gradient)) in p.iter().zip(functions) {
        place += x * n;
        slope += x * gradient.transpose();
    }
    (place, slope)
}

/// Distance from a hexahedron, zero inside \[mm\] (from the map of its clamped reference coordinates, hence at least the true one), and
/// its shape functions.
fn in_hexahedron(p: &[Vec3; 8], x: &Vec3) -> (f64, [f64; 8]) {
    let nowhere = (f64::INFINITY, [0.125; 8]);
    let mut at = Vec3::zeros();
    for _ in 0..STEPS {
        let (place, slope) = mapped(p, &at);
        let Some(inverse) = slope.try_inverse() else {
            return nowhere;
        };
        let step = inverse * (x - place);
        // Beyond the element the map may fold: stay near it.
        at = (at + step).map(|c| c.clamp(-2.0, 2.0));
        if step.amax() < 1e-14 {
            break;
        }
    }
    let held = at.map(|c| {
        if c.abs() <= 1.0 + INSIDE {
            c
        } else {
            c.clamp(-1.0, 1.0)
        }
    });
    let (place, slope) = mapped(p, &held);
    let Some(inverse) = slope.try_inverse() else {
        return nowhere;
    };
    // What is left to x, inside only rounding, is carried on linearly; then Σ N_i x_i = x holds exactly.
    let rest = inverse * (x - place);
    let weights = trilinear(&held).map(|(n, gradient)| n + gradient.dot(&rest));
    let distance = if held == at { 0.0 } else { (x - place).norm() };
    (distance, weights)
}
