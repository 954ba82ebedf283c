//! A body of one material with its supports: what most checks solve.

use super::CheckError;
use crate::fem::elements::{VolumetricStrain, trilinear};
use crate::fem::equilibrium::{Curve, Load, Options, Solver, Stop};
use crate::fem::forces::{Materials, add_internal_forces};
use crate::fem::model::{Constrained, Model};
use crate::geometry::volume::CORNERS;
use crate::geometry::volume::{Elements, KUHN, VolumeMesh};
use crate::material::law::Law;
use crate::math::{Mat3, Vec3};

/// The kinds of elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Eight-node hexahedra.
    Hexahedra,
    /// Cells of six tetrahedra that share one volume change.
    KuhnCells,
    /// Four-node tetrahedra, each with its own volume change.
    Tetrahedra,
    /// Four-node tetrahedra in patches that share one.
    Patches,
}

impl Kind {
    /// All of them.
    pub const ALL: [Kind; 4] = [Kind::Hexahedra, Kind::KuhnCells, Kind::Tetrahedra, Kind::Patches];
    /// Those that do not lock near incompressibility.
    pub const SHARING: [Kind; 3] = [Kind::Hexahedra, Kind::KuhnCells, Kind::Patches];

    /// What the page calls them.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Hexahedra => "hexahedra",
            Kind::KuhnCells => "Kuhn cells",
            Kind::Tetrahedra => "tetrahedra",
            Kind::Patches => "patched tetrahedra",
        }
    }

    /// A box `[0, size]` \[mm\] of `counts` cells along each axis.
    pub fn cuboid(self, size: Vec3, counts: [usize; 3]) -> VolumeMesh {
        let mesh = VolumeMesh::cuboid(size, counts, false);
        let elements = match mesh.elements {
            Elements::Hexahedra(cells) => self.of_cells(cells),
            other => other,
        };
        VolumeMesh {
            nodes: mesh.nodes,
            elements,
        }
    }

    /// Elements of this kind from the nodes of hexahedral cells, `(cells × 8)`.
    pub fn of_cells(self, cells: Vec<[u32; 8]>) -> Elements {
        match self {
            Kind::Hexahedra => Elements::Hexahedra(cells),
            Kind::KuhnCells => Elements::KuhnCells(cells),
            Kind::Tetrahedra | Kind::Patches => {
                let tets = cells.iter().flat_map(|c| KUHN.map(|t| t.map(|i| c[i])));
                Elements::Tetrahedra(tets.collect())
            }
        }
    }

    fn volumetric(self) -> VolumetricStrain {
        match self {
            Kind::Tetrahedra => VolumetricStrain::Pointwise,
            _ => VolumetricStrain::Shared,
        }
    }
}

/// Moves the nodes inside the box `[0, size]`, by up to `share` of `spacing` in each component \[mm\], the same way each
/// time; those on the border stay.
pub fn distort(mesh: &mut VolumeMesh, size: Vec3, spacing: f64, share: f64) {
    for (i, x) in mesh.nodes.iter_mut().enumerate() {
        if !on_border(x, &size) {
            let t = i as f64;
            *x += share * spacing * Vec3::new((3.1 * t).sin(), (1.7 * t).cos(), (2.3 * t).sin());
        }
    }
}

/// Is a point on the border of the box `[0, size]`?
pub fn on_border(x: &Vec3, size: &Vec3) -> bool {
    (0..3).any(|c| x[c] < 1e-9 * size[c] || x[c] > (1.0 - 1e-9) * size[c])
}

/// A body of one material.
#[derive(Debug)]
pub struct Specimen {
    /// Mesh and supports.
    pub model: Model,
    /// The material.
    pub law: Law,
    cell_of_point: Vec<u16>,
}

impl Specimen {
    /// A body of elements of one `kind` and of one `law`, held where `held` says.
    ///
    /// # Errors
    /// A mesh or supports that make no model.
    pub fn new(
        kind: Kind,
        mesh: VolumeMesh,
        law: Law,
        held: impl Fn(&Vec3) -> Constrained,
    ) -> Result<Specimen, CheckError> {
        let constrained = mesh.nodes.iter().map(held).collect();
        let model = Model::with(mesh, None, constrained, kind.volumetric(), None)?;
        let cell_of_point = vec![0; model.parts.points()];
        Ok(Specimen {
            model,
            law,
            cell_of_point,
        })
    }

    /// Positions of the nodes at rest, `(n × 3)` \[mm\].
    pub fn nodes(&self) -> &[Vec3] {
        &self.model.mesh.nodes
    }

    /// Internal forces at the displacements `u`, `(n × 3)` \[N\]; on held components they are the reactions.
    pub fn internal_forces(&self, u: &[Vec3]) -> Vec<Vec3> {
        let mut forces = vec![Vec3::zeros(); u.len()];
        self.with_materials(|materials| {
            add_internal_forces(&self.model.parts, u, materials, &mut forces);
        });
        forces
    }

    /// Calls `act` with the one material at every point.
    pub fn with_materials<T>(&self, act: impl FnOnce(&Materials) -> T) -> T {
        act(&Materials {
            laws: &[&self.law],
            cell_of_point: &self.cell_of_point,
        })
    }

    /// The load curve through `factors`.
    ///
    /// # Errors
    /// If the stiffness at rest has no factor.
    pub fn curve(&self, load: &Load, factors: &[f64], options: &Options) -> Result<Curve, CheckError> {
        let mut solver = Solver::new(&self.model)?;
        self.with_materials(|materials| {
            solver.start(materials)?;
            Ok(solver.curve(materials, load, factors, options, &|| false))
        })
    }

    /// The equilibrium under the whole load, reached through `steps` equal ones.
    ///
    /// # Errors
    /// If it is not reached.
    pub fn settled(&self, load: &Load, steps: usize, options: &Options) -> Result<Vec<Vec3>, CheckError> {
        let factors: Vec<f64> = (1..=steps).map(|k| k as f64 / steps as f64).collect();
        let mut curve = self.curve(load, &factors, options)?;
        match (curve.stop, curve.levels.pop()) {
            (Stop::Converged, Some(u)) => Ok(u),
            (stop, _) => Err(CheckError::NotReached {
                stop,
                share: curve.reached,
            }),
        }
    }
}

/// A load of nodal forces, `(n × 3)` \[N\].
pub fn forces(forces: Vec<Vec3>) -> Load {
    Load {
        forces,
        prescribed: None,
    }
}

/// Held components go to the displacements `target`, `(n × 3)` \[mm\].
pub fn prescribed(target: Vec<Vec3>) -> Load {
    Load {
        forces: vec![Vec3::zeros(); target.len()],
        prescribed: Some(target),
    }
}

/// Shares of the total force at the nodes of one face of a box of equal cells, as a uniform traction on bilinear faces
/// gives them; they sum to one. `on_face` picks the face, `across` names its two axes, `size` \[mm\] is the box.
pub fn uniform_traction(
    mesh: &VolumeMesh,
    size: &Vec3,
    across: [usize; 2],
    on_face: impl Fn(&Vec3) -> bool,
) -> Vec<f64> {
    let inner = |x: &Vec3, c: usize| {
        if x[c] > 1e-9 * size[c] && x[c] < (1.0 - 1e-9) * size[c] {
            2.0
        } else {
            1.0
        }
    };
    let share = |x: &Vec3| {
        if on_face(x) {
            inner(x, across[0]) * inner(x, across[1])
        } else {
            0.0
        }
    };
    let shares: Vec<f64> = mesh.nodes.iter().map(share).collect();
    let sum: f64 = shares.iter().sum();
    shares.iter().map(|s| s / sum).collect()
}

/// One point of a quadrature over the undeformed body.
#[derive(Debug)]
pub struct Sample<'a> {
    /// Nodes of the element, or of the tetrahedron in it.
    pub nodes: &'a [u32],
    /// Values of their shape functions.
    pub shape: &'a [f64],
    /// Their gradients \[1/mm\].
    pub gradients: &'a [Vec3],
    /// Where the point is \[mm\].
    pub place: Vec3,
    /// Volume that it stands for \[mm³\].
    pub weight: f64,
}

/// How finely to integrate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// Two points along each axis of a hexahedron, four in a tetrahedron: for smooth forces times shape functions.
    Loads,
    /// Three along each axis of a hexahedron, and twenty-seven in a tetrahedron: for squares of errors, which must not be
    /// sampled at the elements' own points, where they happen to be small.
    Errors,
}

/// Calls `at` with every point of a quadrature over the undeformed body.
pub fn integrate(mesh: &VolumeMesh, rule: Rule, mut at: impl FnMut(&Sample)) {
    let (cube, simplex) = (cube(rule), simplex(rule));
    let mut tetrahedron = |tet: [u32; 4]| integrate_tetrahedron(mesh, &tet, &simplex, &mut at);
    match &mesh.elements {
        Elements::Hexahedra(cells) => cells
            .iter()
            .for_each(|c| integrate_hexahedron(mesh, c, &cube, &mut at)),
        Elements::KuhnCells(cells) => cells
            .iter()
            .for_each(|c| KUHN.iter().for_each(|t| tetrahedron(t.map(|i| c[i])))),
        Elements::Tetrahedra(tets) => tets.iter().for_each(|t| tetrahedron(*t)),
    }
}

/// Gauss points and weights on [0, 1].
fn line(rule: Rule) -> Vec<(f64, f64)> {
    match rule {
        Rule::Loads => {
            let off = (1.0f64 / 3.0).sqrt() / 2.0;
            vec![(0.5 - off, 0.5), (0.5 + off, 0.5)]
        }
        Rule::Errors => {
            let off = 0.6f64.sqrt() / 2.0;
            vec![
                (0.5 - off, 5.0 / 18.0),
                (0.5, 8.0 / 18.0),
                (0.5 + off, 5.0 / 18.0),
            ]
        }
    }
}

/// Points and weights of the unit cube.
fn cube(rule: Rule) -> Vec<(Vec3, f64)> {
    let one = line(rule);
    let mut points = Vec::new();
    for a in &one {
        for b in &one {
            points.extend(one.iter().map(|c| (Vec3::new(a.0, b.0, c.0), a.1 * b.1 * c.1)));
        }
    }
    points
}

/// Barycentric coordinates and weights, which sum to one sixth.
fn simplex(rule: Rule) -> Vec<([f64; 4], f64)> {
    match rule {
        // Exact to the second degree: a = (5 + 3 √5)/20, b = (5 − √5)/20.
        Rule::Loads => {
            let (a, b) = ((5.0 + 3.0 * 5f64.sqrt()) / 20.0, (5.0 - 5f64.sqrt()) / 20.0);
            (0..4)
                .map(|k| (std::array::from_fn(|i| if i == k { a } else { b }), 1.0 / 24.0))
                .collect()
        }
        // The cube with a face collapsed to an edge and an edge to a point (Duffy): the Jacobian is (1 − r)² (1 − s).
        Rule::Errors => cube(rule)
            .into_iter()
            .map(|(x, weight)| {
                let (r, s, t) = (x.x, x.y, x.z);
                let b = [
                    (1.0 - r) * (1.0 - s) * (1.0 - t),
                    r,
                    (1.0 - r) * s,
                    (1.0 - r) * (1.0 - s) * t,
                ];
                (b, weight * (1.0 - r).powi(2) * (1.0 - s))
            })
            .collect(),
    }
}

fn integrate_hexahedron(
    mesh: &VolumeMesh,
    cell: &[u32; 8],
    points: &[(Vec3, f64)],
    at: &mut impl FnMut(&Sample),
) {
    let corners = cell.map(|i| mesh.nodes[i as usize]);
    for (unit, weight) in points {
        let place = unit.map(|x| 2.0 * x - 1.0);
        let shape = trilinear(&place);
        let local = CORNERS.map(|c| {
            let (x, y, z) = (1.0 + c.x * place.x, 1.0 + c.y * place.y, 1.0 + c.z * place.z);
            0.125 * Vec3::new(c.x * y * z, c.y * x * z, c.z * x * y)
        });
        let mut jacobian = Mat3::zeros();
        for (x, g) in corners.iter().zip(&local) {
            jacobian += x * g.transpose();
        }
        let inverse = jacobian.try_inverse().unwrap_or_else(Mat3::zeros);
        at(&Sample {
            nodes: cell,
            shape: &shape,
            gradients: &local.map(|g| inverse.tr_mul(&g)),
            place: corners.iter().zip(shape).map(|(x, s)| x * s).sum(),
            weight: 8.0 * weight * jacobian.determinant(),
        });
    }
}

fn integrate_tetrahedron(
    mesh: &VolumeMesh,
    tet: &[u32; 4],
    points: &[([f64; 4], f64)],
    at: &mut impl FnMut(&Sample),
) {
    let corners = tet.map(|i| mesh.nodes[i as usize]);
    let [a, b, c] = [1, 2, 3].map(|i| corners[i] - corners[0]);
    let six_volumes = a.dot(&b.cross(&c));
    let [ga, gb, gc] = [b.cross(&c), c.cross(&a), a.cross(&b)].map(|g| g / six_volumes);
    let gradients = [-(ga + gb + gc), ga, gb, gc];
    for (shape, weight) in points {
        at(&Sample {
            nodes: tet,
            shape,
            gradients: &gradients,
            place: corners.iter().zip(shape).map(|(x, s)| x * *s).sum(),
            weight: weight * six_volumes,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over [0, 2] × [0, 1] × [0, 3], on any mesh of it: ∫ x² y = 8/3 · 1/2 · 3 = 4 and ∫ x y = 2 · 1/2 · 3 = 3; the shape
    /// functions sum to one.
    #[test]
    fn quadrature_is_exact_for_polynomials() {
        let size = Vec3::new(2.0, 1.0, 3.0);
        for kind in Kind::ALL {
            for rule in [Rule::Loads, Rule::Errors] {
                let mut mesh = kind.cuboid(size, [3, 3, 3]);
                distort(&mut mesh, size, 0.5, 0.2);
                let (mut cubic, mut quadratic, mut shapes) = (0.0, 0.0, 0.0);
                integrate(&mesh, rule, |s| {
                    cubic += s.weight * s.place.x * s.place.x * s.place.y;
                    quadratic += s.weight * s.place.x * s.place.y;
                    shapes += s.weight * s.shape.iter().sum::<f64>();
                });
                assert!(rule == Rule::Loads || (cubic - 4.0).abs() < 1e-12, "{cubic}");
                // Two Gauss points are exact for cubics in each of three axes; a distorted hexahedron has a Jacobian of two.
                let exact = kind != Kind::Hexahedra || rule == Rule::Errors;
                assert!(
                    (quadratic - 3.0).abs() < if exact { 1e-12 } else { 1e-3 },
                    "{quadratic}"
                );
                assert!((shapes - 6.0).abs() < 1e-12, "{shapes}");
            }
        }
    }
}
