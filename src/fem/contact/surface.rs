//! Contact points of the deformable object: places of its surface that rigid bodies may press.
//!
//! ```text
//! x_p = Σ_a N_a (X_a + u_a)                       where a point is
//! A_p = Σ_f s_f | a₁ × a₂ |,  a_i = Σ_a N_a,i (X_a + u_a)    the area that it stands for, deformed
//! ```
//!
//! A point is a set of nodes of one element with their shape functions' values, so its stiffness has a place in the
//! matrix. There is one point for each surface node of a mesh that follows the surface, and one for each element that
//! the true surface cuts in a grid that does not: as many constraints as the elements can follow. With more (several
//! quadrature points a face) a non-penetration condition locks, and pressures alternate from point to point.
//!
//! Symbols: X place in the undeformed object \[mm\], u displacement \[mm\], N shape functions, s share of a facet,
//! a₁, a₂ its edges \[mm\]. Source: Wriggers, Computational Contact Mechanics, 2nd ed. 2006, chapters 6 and 9; the
//! embedded points are our own.

use crate::fem::elements::trilinear;
use crate::geometry::boundary::boundary_faces;
use crate::geometry::grid::Grid;
use crate::geometry::solid::Solid;
use crate::geometry::surface::area_vector;
use crate::geometry::volume::{CORNERS, VolumeMesh};
use crate::math::{Mat3, Vec3};

/// A place of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPoint {
    /// Nodes of one element with their shape functions' values.
    pub weights: Vec<(u32, f64)>,
    /// The area that it stands for in the undeformed object \[mm²\].
    pub area_mm2: f64,
    /// Outward normal in the undeformed object, a unit vector.
    pub normal: Vec3,
}

/// A piece of surface that belongs to a point.
#[derive(Clone, Debug, PartialEq)]
struct Facet {
    point: u32,
    share: f64,
    /// Nodes with the derivatives of their shape functions along the two edges.
    along: Vec<(u32, [f64; 2])>,
}

/// The contact points of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// The points.
    pub points: Vec<ContactPoint>,
    facets: Vec<Facet>,
    spacing_mm: f64,
}

impl Surface {
    /// A point at each surface node of a mesh that follows the object's surface.
    pub fn of_mesh(mesh: &VolumeMesh) -> Surface {
        let faces = boundary_faces(mesh);
        let mut point_of = vec![u32::MAX; mesh.nodes.len()];
        let mut points = Vec::new();
        let mut facets = Vec::new();
        for face in &faces {
            for (corner, &node) in face.nodes().iter().enumerate() {
                let slot = &mut point_of[node as usize];
                if *slot == u32::MAX {
                    *slot = points.len() as u32;
                    points.push(ContactPoint {
                        weights: vec![(node, 1.0)],
                        area_mm2: 0.0,
                        normal: Vec3::zeros(),
                    });
                }
                facets.push(facet(*slot, face.nodes(), corner));
            }
        }
        Surface::finished(points, facets, &mesh.nodes)
    }

    /// Points on the surface of `solid` in a grid that does not follow it: one in each element that it cuts (and for each of
    /// the six directions that it looks along there), at the sample nearest to the middle of the surface in the element.
    pub fn embedded(solid: &Solid, grid: &Grid) -> Surface {
        let mut samples = surface_samples(solid, grid);
        samples.sort_by_key(Sample::key);
        let nodes = &grid.mesh.nodes;
        let (mut points, mut facets) = (Vec::new(), Vec::new());
        for group in samples.chunk_by(|a, b| a.key() == b.key()) {
            let area: Vec3 = group.iter().map(|s| s.area).sum();
            let whole: f64 = group.iter().map(|s| s.area.norm()).sum();
            if whole <= 0.0 {
                continue;
            }
            let middle = group.iter().map(|s| s.place * s.area.norm()).sum::<Vec3>() / whole;
            let off = |s: &Sample| (s.place - middle).norm_squared();
            let nearest = group
                .iter()
                .fold(&group[0], |best, s| if off(s) < off(best) { s } else { best });
            let cell = grid.mesh.elements.nodes_of(nearest.element);
            let values = trilinear(&nearest.reference);
            let gradients = trilinear_gradients(cell, nodes, &nearest.reference);
            let normal = area.normalize();
            let mut first = Vec3::zeros();
            first[normal.map(f64::abs).imin()] = 1.0;
            let first = normal.cross(&first).normalize();
            let edges = [first, normal.cross(&first)];
            facets.push(Facet {
                point: points.len() as u32,
                share: whole,
                along: cell
                    .iter()
                    .zip(&gradients)
                    .map(|(&n, g)| (n, edges.map(|e| e.dot(g))))
                    .collect(),
            });
            points.push(ContactPoint {
                weights: cell.iter().copied().zip(values).collect(),
                area_mm2: 0.0,
                normal: Vec3::zeros(),
            });
        }
        Surface::finished(points, facets, nodes)
    }

    fn finished(mut points: Vec<ContactPoint>, facets: Vec<Facet>, nodes: &[Vec3]) -> Surface {
        let still = vec![Vec3::zeros(); nodes.len()];
        for f in &facets {
            let area = f.area_vector(nodes, &still);
            let point = &mut points[f.point as usize];
            point.area_mm2 += area.norm();
            point.normal += area;
        }
        for p in &mut points {
            p.normal = p.normal.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        }
        let whole: f64 = points.iter().map(|p| p.area_mm2).sum();
        let spacing_mm = (whole / points.len().max(1) as f64).sqrt();
        Surface {
            points,
            facets,
            spacing_mm,
        }
    }

    /// The same without the points that `keep` refuses; it is asked with the place in the undeformed object \[mm\] and the
    /// outward normal there.
    #[must_use]
    pub fn only(&self, nodes: &[Vec3], keep: impl Fn(&Vec3, &Vec3) -> bool) -> Surface {
        let mut number = vec![u32::MAX; self.points.len()];
        let mut points = Vec::new();
        for (slot, point) in number.iter_mut().zip(&self.points) {
            if keep(&point.rest(nodes), &point.normal) {
                *slot = points.len() as u32;
                points.push(point.clone());
            }
        }
        let renumbered = |f: &Facet| Facet {
            point: number[f.point as usize],
            ..f.clone()
        };
        let kept = self
            .facets
            .iter()
            .filter(|f| number[f.point as usize] != u32::MAX);
        Surface {
            points,
            facets: kept.map(renumbered).collect(),
            spacing_mm: self.spacing_mm,
        }
    }

    /// A typical distance between points \[mm\].
    pub fn spacing_mm(&self) -> f64 {
        self.spacing_mm
    }

    /// The deformed area that each point stands for, `(points)` \[mm²\].
    pub fn areas(&self, nodes: &[Vec3], u: &[Vec3]) -> Vec<f64> {
        let mut areas = vec![0.0; self.points.len()];
        for f in &self.facets {
            areas[f.point as usize] += f.area_vector(nodes, u).norm();
        }
        areas
    }
}

impl ContactPoint {
    /// Where it is in the undeformed object \[mm\].
    pub fn rest(&self, nodes: &[Vec3]) -> Vec3 {
        self.weights.iter().map(|&(n, w)| nodes[n as usize] * w).sum()
    }

    /// Where it is at the displacements `u`, `(nodes)` \[mm\].
    #[inline]
    pub fn place(&self, nodes: &[Vec3], u: &[Vec3]) -> Vec3 {
        self.rest(nodes) + self.moved(u)
    }

    /// Its displacement \[mm\].
    #[inline]
    pub fn moved(&self, u: &[Vec3]) -> Vec3 {
        self.weights.iter().map(|&(n, w)| u[n as usize] * w).sum()
    }
}

impl Facet {
    fn area_vector(&self, nodes: &[Vec3], u: &[Vec3]) -> Vec3 {
        let (mut first, mut second) = (Vec3::zeros(), Vec3::zeros());
        for &(n, [d1, d2]) in &self.along {
            let x = nodes[n as usize] + u[n as usize];
            first += x * d1;
            second += x * d2;
        }
        first.cross(&second) * self.share
    }
}

/// The part of a face that belongs to one of its corners: a third of a triangle, the quarter of a quadrilateral nearest
/// to the corner, in the middle of which the edges are taken.
fn facet(point: u32, face: &[u32], corner: usize) -> Facet {
    if let &[a, b, c] = face {
        return Facet {
            point,
            share: 1.0 / 6.0,
            along: vec![(a, [-1.0, -1.0]), (b, [1.0, 0.0]), (c, [0.0, 1.0])],
        };
    }
    let at = |k: usize| (CORNERS[k].x, CORNERS[k].y);
    let (x, y) = (0.5 * at(corner).0, 0.5 * at(corner).1);
    let along = face.iter().enumerate().map(|(k, &n)| {
        let (cx, cy) = at(k);
        (n, [0.25 * cx * (1.0 + cy * y), 0.25 * cy * (1.0 + cx * x)])
    });
    Facet {
        point,
        share: 1.0,
        along: along.collect(),
    }
}

/// A small piece of the true surface.
struct Sample {
    element: usize,
    reference: Vec3,
    place: Vec3,
    area: Vec3,
}

impl Sample {
    /// Pieces of one element that look along the same of the six directions belong together: at an edge of the object
    /// both sides have their point.
    fn key(&self) -> (usize, usize, bool) {
        let along = self.area.map(f64::abs).imax();
        (self.element, along, self.area[along] > 0.0)
    }
}

/// Pieces of the surface of `solid`, smaller than a quarter of an element, with their places in the grid.
fn surface_samples(solid: &Solid, grid: &Grid) -> Vec<Sample> {
    let smallest = (0..grid.mesh.elements.len())
        .map(|e| {
            let cell = grid.mesh.elements.nodes_of(e);
            let x = |i: usize| grid.mesh.nodes[cell[i] as usize];
            let edges = [x(1) - x(0), x(3) - x(0), x(4) - x(0)];
            edges.iter().map(Vec3::norm).fold(f64::INFINITY, f64::min)
        })
        .fold(f64::INFINITY, f64::min);
    let mesh = solid.mesh();
    let mut samples = Vec::new();
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let n = (4.0 * longest / smallest).ceil().clamp(1.0, 512.0) as usize;
        let at = |i: usize, j: usize| a + ((b - a) * i as f64 + (c - a) * j as f64) / n as f64;
        for i in 0..n {
            for j in 0..n - i {
                let mut pieces = vec![[at(i, j), at(i + 1, j), at(i, j + 1)]];
                if i + j + 1 < n {
                    pieces.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
                for piece in pieces {
                    let place = (piece[0] + piece[1] + piece[2]) / 3.0;
                    let Some(found) = grid.locate(&place) else {
                        continue;
                    };
                    samples.push(Sample {
                        element: found.element,
                        reference: found.reference,
                        place,
                        area: area_vector(&piece),
                    });
                }
            }
        }
    }
    samples
}

/// Gradients of the trilinear shape functions in space, `(8 × 3)` \[1/mm\].
fn trilinear_gradients(cell: &[u32], nodes: &[Vec3], at: &Vec3) -> [Vec3; 8] {
    let local = CORNERS.map(|c| {
        let (x, y, z) = (1.0 + c.x * at.x, 1.0 + c.y * at.y, 1.0 + c.z * at.z);
        0.125 * Vec3::new(c.x * y * z, c.y * x * z, c.z * x * y)
    });
    let mut jacobian = Mat3::zeros();
    for (&n, g) in cell.iter().zip(&local) {
        jacobian += nodes[n as usize] * g.transpose();
    }
    let inverse = jacobian.try_inverse().unwrap_or_else(Mat3::zeros);
    local.map(|g| inverse.tr_mul(&g))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::axis::Axis;
    use crate::geometry::grid::Levels;
    use crate::geometry::shapes::block;
    use crate::geometry::volume::{Elements, KUHN};

    fn stretched(nodes: &[Vec3]) -> Vec<Vec3> {
        nodes
            .iter()
            .map(|x| Vec3::new(0.5 * x.x, 0.2 * x.y, -0.1 * x.z))
            .collect()
    }

    /// A box of 3 × 2 × 4 has a surface of 52, stretched to 4.5 × 2.4 × 3.6 of 71.28; the normals point outward.
    #[test]
    fn areas_add_up_before_and_after_deformation() {
        let hexahedra = VolumeMesh::cuboid(Vec3::new(3.0, 2.0, 4.0), [3, 2, 2], false);
        let Elements::Hexahedra(cells) = hexahedra.elements.clone() else {
            unreachable!()
        };
        let tets = cells.iter().flat_map(|c| KUHN.map(|t| t.map(|i| c[i]))).collect();
        let tetrahedra = VolumeMesh {
            nodes: hexahedra.nodes.clone(),
            elements: Elements::Tetrahedra(tets),
        };
        for mesh in [hexahedra, tetrahedra] {
            let surface = Surface::of_mesh(&mesh);
            // 4 × 3 × 3 nodes, of which 2 × 1 × 1 lie inside.
            assert_eq!(surface.points.len(), 34);
            let whole: f64 = surface.points.iter().map(|p| p.area_mm2).sum();
            assert!((whole - 52.0).abs() < 1e-12, "{whole}");
            let deformed: f64 = surface.areas(&mesh.nodes, &stretched(&mesh.nodes)).iter().sum();
            assert!((deformed - 71.28).abs() < 1e-12, "{deformed}");
            for p in &surface.points {
                let outward = p.rest(&mesh.nodes) - Vec3::new(1.5, 1.0, 2.0);
                assert!(p.normal.dot(&outward) > 0.0);
            }
        }
    }

    /// A box whose grid ends on its faces: the embedded points lie on the surface, and their areas are its.
    #[test]
    fn embedded_points_carry_the_whole_surface() {
        let solid = Solid::new(block(Vec3::new(12.0, 8.0, 6.0), 4.0).unwrap()).unwrap();
        let levels = Levels::Flat(vec![0.0, 2.0, 4.0, 6.0]);
        let grid = Grid::new(&solid, Axis::Z, 2.0, levels, [&[], &[]]).unwrap();
        let surface = Surface::embedded(&solid, &grid);
        let nodes = &grid.mesh.nodes;
        let whole: f64 = surface.points.iter().map(|p| p.area_mm2).sum();
        assert!((whole - 432.0).abs() < 1e-9, "{whole}");
        assert!(
            surface
                .points
                .iter()
                .all(|p| solid.closest(&p.rest(nodes)).distance < 1e-9)
        );
        // A face's middle elements stretch as the field does: 1.5 × 1.2 on the upper face.
        let areas = surface.areas(nodes, &stretched(nodes));
        let middle = surface
            .points
            .iter()
            .position(|p| (p.rest(nodes) - Vec3::new(5.0, 3.0, 6.0)).norm() < 1.0)
            .unwrap();
        assert!((areas[middle] / surface.points[middle].area_mm2 - 1.8).abs() < 1e-9);
    }
}
