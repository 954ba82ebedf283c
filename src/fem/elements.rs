//! Integration points: where an element samples the deformation gradient.
//!
//! ```text
//! F = I + Σ_a u_a ⊗ ∇N_a
//! ```
//!
//! Hexahedra have eight Gauss points with trilinear shape functions; a tetrahedron is one point with constant
//! gradients; a Kuhn cell is its six tetrahedra taken as one element of eight nodes, so that they can share one
//! volumetric strain (see [`super::forces`]). A point's weight is the volume it stands for, times the share of that
//! volume that lies inside the object.

use crate::geometry::volume::{Elements, KUHN, VolumeMesh};
use crate::math::polar_lanes::{Lanes, ZERO};
use crate::math::{Mat3, Vec3};

/// One place where strain and stress live.
#[derive(Clone, Debug)]
pub struct IntegrationPoint<const N: usize> {
    /// Gradients of the shape functions in the undeformed object, `(N × 3)` \[1/mm\].
    pub gradients: [Vec3; N],
    /// Volume that the point stands for \[mm³\].
    pub weight: f64,
}

/// All elements of one kind with `N` nodes each.
#[derive(Clone, Debug)]
pub struct Block<const N: usize> {
    /// Nodes of each element.
    pub nodes: Vec<[u32; N]>,
    /// Points of all elements, those of one element together.
    pub points: Vec<IntegrationPoint<N>>,
    /// How many points an element has.
    pub points_per_element: usize,
    /// The gradients again, the points of an element side by side: `(elements × N × 3 × 8)`, zero where an element has fewer
    /// than eight points; empty for elements of one point.
    pub lanes: Vec<[[Lanes; 3]; N]>,
}

/// A mesh's elements with their points.
#[derive(Clone, Debug)]
pub enum Discretisation {
    /// Hexahedra and Kuhn cells.
    Eight(Block<8>),
    /// Tetrahedra.
    Four(Block<4>),
}

/// An element that cannot carry strain.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("element {element} near ({x:.2}, {y:.2}, {z:.2}) mm is flat or inside out in the undeformed mesh (volume {volume_mm3:.3e} mm³): mend the mesh", x = place.x, y = place.y, z = place.z)]
pub struct BadElement {
    /// Number of the element, from 0.
    pub element: usize,
    /// Its first node's position \[mm\].
    pub place: Vec3,
    /// The volume that one of its points stands for \[mm³\].
    pub volume_mm3: f64,
}

impl Discretisation {
    /// The points of `mesh`; `fill`, `(points)`, is the share of each point's volume inside the object, all if `None`.
    ///
    /// # Errors
    /// [`BadElement`] for an element of no or negative volume.
    pub fn new(mesh: &VolumeMesh, fill: Option<&[f64]>) -> Result<Discretisation, BadElement> {
        let mut result = match &mesh.elements {
            Elements::Hexahedra(cells) => {
                Discretisation::Eight(block(&mesh.nodes, cells, 8, |corners, points| {
                    points.extend(gauss_points().map(|at| hexahedron_point(corners, &at)));
                })?)
            }
            Elements::KuhnCells(cells) => {
                Discretisation::Eight(block(&mesh.nodes, cells, 6, |corners, points| {
                    points.extend(KUHN.iter().map(|tet| kuhn_point(corners, tet)));
                })?)
            }
            Elements::Tetrahedra(tets) => {
                Discretisation::Four(block(&mesh.nodes, tets, 1, |corners, points| {
                    let (gradients, weight) = tetrahedron(corners);
                    points.push(IntegrationPoint { gradients, weight });
                })?)
            }
        };
        if let Some(fill) = fill {
            match &mut result {
                Discretisation::Eight(b) => b.points.iter_mut().zip(fill).for_each(|(p, f)| p.weight *= f),
                Discretisation::Four(b) => b.points.iter_mut().zip(fill).for_each(|(p, f)| p.weight *= f),
            }
        }
        Ok(result)
    }

    /// How many points an element has.
    pub fn points_per_element(&self) -> usize {
        match self {
            Discretisation::Eight(b) => b.points_per_element,
            Discretisation::Four(b) => b.points_per_element,
        }
    }

    /// How many points there are.
    pub fn points(&self) -> usize {
        match self {
            Discretisation::Eight(b) => b.points.len(),
            Discretisation::Four(b) => b.points.len(),
        }
    }

    /// The volume that point `q` stands for \[mm³\].
    pub fn weight(&self, q: usize) -> f64 {
        match self {
            Discretisation::Eight(b) => b.points[q].weight,
            Discretisation::Four(b) => b.points[q].weight,
        }
    }
}

/// Reference coordinates of the eight Gauss points in [−1, 1]³, in the order of the nodes they are next to.
pub fn gauss_points() -> [Vec3; 8] {
    let g = 1.0 / 3.0_f64.sqrt();
    CORNERS.map(|c| c * g)
}

/// Reference coordinates of a hexahedron's nodes.
pub const CORNERS: [Vec3; 8] = [
    Vec3::new(-1.0, -1.0, -1.0),
    Vec3::new(1.0, -1.0, -1.0),
    Vec3::new(1.0, 1.0, -1.0),
    Vec3::new(-1.0, 1.0, -1.0),
    Vec3::new(-1.0, -1.0, 1.0),
    Vec3::new(1.0, -1.0, 1.0),
    Vec3::new(1.0, 1.0, 1.0),
    Vec3::new(-1.0, 1.0, 1.0),
];

/// Values of the trilinear shape functions at the reference coordinates `at`, `(8)`.
pub fn trilinear(at: &Vec3) -> [f64; 8] {
    CORNERS.map(|c| 0.125 * (1.0 + c.x * at.x) * (1.0 + c.y * at.y) * (1.0 + c.z * at.z))
}

fn block<const N: usize>(
    nodes: &[Vec3],
    cells: &[[u32; N]],
    points_per_element: usize,
    sample: impl Fn(&[Vec3; N], &mut Vec<IntegrationPoint<N>>),
) -> Result<Block<N>, BadElement> {
    let mut points = Vec::with_capacity(cells.len() * points_per_element);
    for (element, cell) in cells.iter().enumerate() {
        let corners = cell.map(|i| nodes[i as usize]);
        let start = points.len();
        sample(&corners, &mut points);
        if let Some(bad) = points[start..]
            .iter()
            .find(|p| p.weight.is_nan() || p.weight <= 0.0)
        {
            return Err(BadElement {
                element,
                place: corners[0],
                volume_mm3: bad.weight,
            });
        }
    }
    let elements = if points_per_element > 1 { cells.len() } else { 0 };
    let of = |e: usize| side_by_side(&points[e * points_per_element..][..points_per_element]);
    let lanes = (0..elements).map(of).collect();
    Ok(Block {
        nodes: cells.to_vec(),
        points,
        points_per_element,
        lanes,
    })
}

fn side_by_side<const N: usize>(points: &[IntegrationPoint<N>]) -> [[Lanes; 3]; N] {
    let mut lanes = [[ZERO; 3]; N];
    for (l, point) in points.iter().enumerate() {
        for (a, g) in point.gradients.iter().enumerate() {
            for c in 0..3 {
                lanes[a][c][l] = g[c];
            }
        }
    }
    lanes
}

fn hexahedron_point(corners: &[Vec3; 8], at: &Vec3) -> IntegrationPoint<8> {
    let local = CORNERS.map(|c| {
        let (x, y, z) = (1.0 + c.x * at.x, 1.0 + c.y * at.y, 1.0 + c.z * at.z);
        0.125 * Vec3::new(c.x * y * z, c.y * x * z, c.z * x * y)
    });
    let mut jacobian = Mat3::zeros();
    for (x, g) in corners.iter().zip(&local) {
        jacobian += x * g.transpose();
    }
    let weight = jacobian.determinant();
    let inverse = jacobian.try_inverse().unwrap_or_else(Mat3::zeros);
    IntegrationPoint {
        gradients: local.map(|g| inverse.tr_mul(&g)),
        weight,
    }
}

fn kuhn_point(corners: &[Vec3; 8], tet: &[usize; 4]) -> IntegrationPoint<8> {
    let (own, weight) = tetrahedron(&tet.map(|i| corners[i]));
    let mut gradients = [Vec3::zeros(); 8];
    for (&i, g) in tet.iter().zip(own) {
        gradients[i] = g;
    }
    IntegrationPoint { gradients, weight }
}

/// Gradients of the barycentric coordinates \[1/mm\] and the volume \[mm³\] of a tetrahedron.
fn tetrahedron(corners: &[Vec3; 4]) -> ([Vec3; 4], f64) {
    let [a, b, c] = [1, 2, 3].map(|i| corners[i] - corners[0]);
    let six_volumes = a.dot(&b.cross(&c));
    let [ga, gb, gc] = [b.cross(&c), c.cross(&a), a.cross(&b)].map(|g| g / six_volumes);
    ([-(ga + gb + gc), ga, gb, gc], six_volumes / 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn skewed(tetrahedra: bool) -> VolumeMesh {
        let mut mesh = VolumeMesh::cuboid(Vec3::new(3.0, 2.0, 4.0), [3, 2, 2], tetrahedra);
        for (i, x) in mesh.nodes.iter_mut().enumerate() {
            let t = i as f64;
            *x += 0.12 * Vec3::new((3.1 * t).sin(), (1.7 * t).cos(), (2.3 * t).sin());
        }
        mesh
    }

    fn check_linear_field<const N: usize>(mesh: &VolumeMesh, block: &Block<N>) {
        let slope = Mat3::new(0.1, -0.2, 0.3, 0.05, 0.4, -0.1, 0.2, 0.15, -0.3);
        for (e, nodes) in block.nodes.iter().enumerate() {
            let n = block.points_per_element;
            for point in &block.points[e * n..(e + 1) * n] {
                let mut gradient = Mat3::zeros();
                for (&i, g) in nodes.iter().zip(&point.gradients) {
                    gradient += (slope * mesh.nodes[i as usize]) * g.transpose();
                }
                assert!((gradient - slope).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn linear_fields_have_their_exact_gradient_on_skewed_elements() {
        for mesh in [skewed(false), skewed(true)] {
            match Discretisation::new(&mesh, None).unwrap() {
                Discretisation::Eight(block) => check_linear_field(&mesh, &block),
                Discretisation::Four(block) => check_linear_field(&mesh, &block),
            }
        }
    }

    #[test]
    fn weights_add_up_to_the_volume_and_inverted_cells_are_named() {
        let mut mesh = VolumeMesh::cuboid(Vec3::new(3.0, 2.0, 4.0), [3, 2, 2], false);
        let points = Discretisation::new(&mesh, None).unwrap();
        let volume: f64 = (0..points.points()).map(|q| points.weight(q)).sum();
        assert!((volume - 24.0).abs() < 1e-12);
        mesh.nodes[0].x = 5.0;
        assert_eq!(Discretisation::new(&mesh, None).unwrap_err().element, 0);
    }
}
