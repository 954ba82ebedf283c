//! The element of a mesh that contains a point, and the point's shape functions there.
//!
//! ```text
//! x = Σ_a N_a(ξ) x_a        ξ barycentric in a tetrahedron, in [−1, 1]³ in a hexahedron (by Newton)
//! ```
//!
//! A point outside the mesh belongs to the element whose nearest point is nearest to it; its shape functions are those of
//! that nearest point's neighbourhood, continued as far as the point lies outside.

use super::volume::{Elements, VolumeMesh};
use crate::math::{Mat3, Vec3};

/// Where a point lies.
#[derive(Clone, Debug, PartialEq)]
pub struct Location {
    /// The element.
    pub element: usize,
    /// Its nodes with their shape functions' values, which add up to one.
    pub weights: Vec<(usize, f64)>,
    /// How far outside the element the point lies \[mm\]; 0 inside.
    pub distance: f64,
}

/// How far outside counts as rounding, as a share of the element.
const ROUNDING: f64 = 1e-9;

/// The place of `point` \[mm\]; `None` if the mesh is empty or nothing lies within `reach` \[mm\].
pub fn locate(mesh: &VolumeMesh, point: &Vec3, reach: f64) -> Option<Location> {
    let mut best: Option<Location> = None;
    for e in 0..mesh.elements.len() {
        let nodes = mesh.elements.nodes_of(e);
        let corners = || nodes.iter().map(|&n| mesh.nodes[n as usize]);
        let low = corners().fold(Vec3::from_element(f64::INFINITY), |a, b| a.inf(&b));
        let high = corners().fold(Vec3::from_element(f64::NEG_INFINITY), |a, b| a.sup(&b));
        let beyond = (low - point).sup(&(point - high)).sup(&Vec3::zeros()).norm();
        let nearest = best.as_ref().map_or(reach, |b| b.distance);
        if beyond > nearest {
            continue;
        }
        let at: Vec<Vec3> = corners().collect();
        let (values, distance) = match mesh.elements {
            Elements::Tetrahedra(_) => in_tetrahedron(&at, point),
            _ => in_hexahedron(&at, point),
        };
        if distance <= reach && best.as_ref().is_none_or(|b| distance < b.distance) {
            let weights = nodes.iter().zip(values).map(|(&n, v)| (n as usize, v));
            best = Some(Location {
                element: e,
                weights: weights.collect(),
                distance,
            });
            if distance == 0.0 {
                break;
            }
        }
    }
    best
}

/// Barycentric coordinates, and how far outside the point lies: the distance to the place that clamped coordinates name.
fn in_tetrahedron(at: &[Vec3], point: &Vec3) -> (Vec<f64>, f64) {
    let edges = Mat3::from_columns(&[at[1] - at[0], at[2] - at[0], at[3] - at[0]]);
    let Some(inverse) = edges.try_inverse() else {
        return (vec![0.25; 4], f64::INFINITY);
    };
    let b = inverse * (point - at[0]);
    let values = vec![1.0 - b.sum(), b.x, b.y, b.z];
    if values.iter().all(|&v| v >= -ROUNDING) {
        return (values, 0.0);
    }
    let clamped: Vec<f64> = values.iter().map(|v| v.max(0.0)).collect();
    let sum: f64 = clamped.iter().sum();
    let near: Vec3 = at.iter().zip(&clamped).map(|(x, v)| x * (v / sum)).sum();
    let distance = (point - near).norm();
    (values, distance)
}

fn in_hexahedron(at: &[Vec3], point: &Vec3) -> (Vec<f64>, f64) {
    let mut xi = Vec3::zeros();
    for _ in 0..30 {
        let (values, slopes) = shapes(&xi);
        let here: Vec3 = at.iter().zip(&values).map(|(x, v)| x * *v).sum();
        let mut jacobian = Mat3::zeros();
        for (x, s) in at.iter().zip(&slopes) {
            jacobian += x * s.transpose();
        }
        let Some(inverse) = jacobian.try_inverse() else {
            break;
        };
        let step = inverse * (point - here);
        // Far outside, the map of a skewed element may fold: steps are kept within it.
        xi = (xi + step).map(|c| c.clamp(-2.0, 2.0));
        if step.amax() < 1e-14 {
            break;
        }
    }
    let inside = xi.map(|c| c.clamp(-1.0, 1.0));
    let place = |xi: &Vec3| -> Vec3 { at.iter().zip(shapes(xi).0).map(|(x, v)| x * v).sum() };
    let values = shapes(&xi).0.to_vec();
    if (xi - inside).amax() <= ROUNDING {
        // An iteration that did not arrive is outside too.
        let miss = (place(&xi) - point).norm();
        let size = (at[6] - at[0]).norm();
        return (values, if miss <= ROUNDING * size { 0.0 } else { miss });
    }
    (values, (place(&inside) - point).norm())
}

/// Trilinear shape functions and their slopes.
fn shapes(xi: &Vec3) -> ([f64; 8], [Vec3; 8]) {
    const SIGNS: [[f64; 3]; 8] = [
        [-1.0, -1.0, -1.0],
        [1.0, -1.0, -1.0],
        [1.0, 1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
        [1.0, -1.0, 1.0],
        [1.0, 1.0, 1.0],
        [-1.0, 1.0, 1.0],
    ];
    let term = |s: &[f64; 3]| [0, 1, 2].map(|c| 1.0 + s[c] * xi[c]);
    let values = SIGNS.map(|s| {
        let [a, b, c] = term(&s);
        0.125 * a * b * c
    });
    let slopes = SIGNS.map(|s| {
        let [a, b, c] = term(&s);
        0.125 * Vec3::new(s[0] * b * c, s[1] * a * c, s[2] * a * b)
    });
    (values, slopes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::volume::KUHN;

    fn meshes() -> [VolumeMesh; 2] {
        let mut hexahedra = VolumeMesh::cuboid(Vec3::new(3.0, 2.0, 2.0), [3, 2, 2], false);
        for (i, x) in hexahedra.nodes.iter_mut().enumerate() {
            let t = i as f64;
            *x += 0.1 * Vec3::new((3.1 * t).sin(), (1.7 * t).cos(), (2.3 * t).sin());
        }
        let cells = (0..hexahedra.elements.len()).map(|e| hexahedra.elements.nodes_of(e).to_vec());
        let tets = cells
            .flat_map(|cell| KUHN.map(|tet| tet.map(|k| cell[k])))
            .collect();
        let tetrahedra = VolumeMesh {
            nodes: hexahedra.nodes.clone(),
            elements: Elements::Tetrahedra(tets),
        };
        [hexahedra, tetrahedra]
    }

    /// The shape functions carry a point back to itself: inside, on a node, and a little outside.
    #[test]
    fn points_are_found_where_they_are() {
        for mesh in meshes() {
            for point in [
                Vec3::new(1.2, 0.7, 0.9),
                Vec3::new(2.6, 1.6, 1.5),
                mesh.nodes[17],
                Vec3::new(1.5, 1.0, 2.3),
            ] {
                let found = locate(&mesh, &point, 1.0).unwrap();
                let back: Vec3 = found.weights.iter().map(|&(n, w)| mesh.nodes[n] * w).sum();
                assert!((back - point).norm() < 1e-12, "{point} became {back}");
                assert_eq!(found.distance > 0.0, point.z > 2.2, "{point}");
            }
            // Nodes are moved by at most 0.1 mm each way.
            let far = locate(&mesh, &Vec3::new(1.5, 1.0, 5.0), 10.0).unwrap();
            assert!((2.9..3.1).contains(&far.distance), "{}", far.distance);
            assert!(locate(&mesh, &Vec3::new(1.5, 1.0, 5.0), 2.0).is_none());
        }
    }
}
