//! Internal forces of co-rotational elements with one volumetric strain each.
//!
//! ```text
//! F = R U,  ε = U − I                      Biot strain at every integration point
//! θ = tr ε,  θ̄ = Σ_q w_q θ_q / Σ_q w_q     its trace, averaged over the element
//! ε̄ = ε + (θ̄ − θ)/3 I                      the strain that the material sees
//! f_a = Σ_q w_q P_q ∇N_a,  P = R (dev T + p̄ I + [v]×),  T = σ(ε̄),  p̄ = Σ_q w_q tr T_q / 3 / Σ_q w_q
//! ```
//!
//! This is the virtual work Σ w T : δε̄ written out, with δ tr U = R : δF. Averaging the trace alone (the B-bar idea of
//! Hughes 1980, in Biot strain) leaves one volumetric constraint an element, so hexahedra and Kuhn cells do not lock at
//! a Poisson's ratio near ½; a lone tetrahedron has one point, nothing to average, and does lock.
//!
//! `[v]×`, with `(tr(U) I − U) v = axial(U T)`, is the part of T : δU that comes from the change of R. It vanishes when T
//! and U share their axes, so for every isotropic law. The papers leave it out (P = R σ, Müller and Gross 2004); without
//! it the Cauchy stress of a transversely isotropic material is not symmetric and moments do not balance.
//!
//! Symbols: u displacement \[mm\], R rotation, U right stretch, T Biot stress \[MPa\], P first Piola–Kirchhoff stress
//! \[MPa\], w volume \[mm³\], N shape functions. Valid at any rotation and at strains inside the law's fitted range;
//! det F ≤ 0 is found by [`smallest_jacobian`], not here. Source: Bickel 2010, sections 7.2 and 8.2.

use super::elements::{Block, Discretisation, IntegrationPoint};
use crate::material::law::Law;
use crate::math::mandel::{self, Mandel};
use crate::math::polar::polar;
use crate::math::polar_lanes::{Lanes, Matrices, ZERO, extract, rotations};
use crate::math::{Mat3, Vec3};

/// More points than any element has.
pub(super) const MOST_POINTS: usize = 8;

/// Which law acts at each integration point.
#[derive(Clone, Copy, Debug)]
pub struct Materials<'a> {
    /// The laws, by cell.
    pub laws: &'a [&'a Law],
    /// The cell of each integration point, `(points)`.
    pub cell_of_point: &'a [u16],
}

impl<'a> Materials<'a> {
    /// The law at point `q`.
    #[inline]
    pub fn at(&self, q: usize) -> &'a Law {
        self.laws[self.cell_of_point[q] as usize]
    }
}

/// Rotation and strain at one point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kinematics {
    pub rotation: Mat3,
    pub stretch: Mat3,
    /// ε̄, Mandel notation.
    pub strain: Mandel,
}

impl Kinematics {
    pub const NONE: Kinematics = Kinematics {
        rotation: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        stretch: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        strain: Mandel::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };
}

/// Adds the internal forces at the displacements `u`, `(nodes)` \[mm\], to `forces`, `(nodes)` \[N\].
pub fn add_internal_forces(parts: &Discretisation, u: &[Vec3], materials: &Materials, forces: &mut [Vec3]) {
    match parts {
        Discretisation::Eight(block) => {
            pulp::Arch::new().dispatch(InLanes {
                block,
                u,
                materials,
                forces,
            });
        }
        Discretisation::Four(block) => add_block(block, u, materials, forces),
    }
}

/// The deformation gradient at a point of an element whose nodes moved by `u`.
#[inline]
pub(super) fn deformation_gradient<const N: usize>(point: &IntegrationPoint<N>, u: &[Vec3; N]) -> Mat3 {
    let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (u, g) in u.iter().zip(&point.gradients) {
        for (column, g) in f.iter_mut().zip([g.x, g.y, g.z]) {
            column[0] += u.x * g;
            column[1] += u.y * g;
            column[2] += u.z * g;
        }
    }
    Mat3::from_columns(&[Vec3::from(f[0]), Vec3::from(f[1]), Vec3::from(f[2])])
}

/// Rotations and averaged strains of one element's points; returns the element's volume \[mm³\].
#[inline]
pub(super) fn kinematics<const N: usize>(
    points: &[IntegrationPoint<N>],
    u: &[Vec3; N],
    state: &mut [Kinematics; MOST_POINTS],
) -> f64 {
    let (mut volume, mut trace) = (0.0, 0.0);
    for (point, k) in points.iter().zip(state.iter_mut()) {
        let p = polar(&deformation_gradient(point, u));
        k.rotation = p.rotation;
        k.stretch = p.stretch;
        k.strain = mandel::from_tensor(&p.stretch);
        for i in 0..3 {
            k.strain[i] -= 1.0;
        }
        volume += point.weight;
        trace += point.weight * mandel::trace(&k.strain);
    }
    if points.len() > 1 && volume > 0.0 {
        let mean = trace / volume;
        for k in state[..points.len()].iter_mut() {
            let shift = (mean - mandel::trace(&k.strain)) / 3.0;
            for i in 0..3 {
                k.strain[i] += shift;
            }
        }
    }
    volume
}

/// A call of [`add_block_in_lanes`], which is compiled for each generation of vector instructions and chosen when the
/// program runs. A struct, because a closure is not inlined into the place that may use those instructions.
struct InLanes<'a> {
    block: &'a Block<8>,
    u: &'a [Vec3],
    materials: &'a Materials<'a>,
    forces: &'a mut [Vec3],
}

impl pulp::NullaryFnOnce for InLanes<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        add_block_in_lanes(self.block, self.u, self.materials, self.forces);
    }
}

/// [`add_block`] with the points of an element side by side.
#[inline(always)]
fn add_block_in_lanes(block: &Block<8>, u: &[Vec3], materials: &Materials, forces: &mut [Vec3]) {
    let n = block.points_per_element;
    let mut strain = [Mandel::zeros(); MOST_POINTS];
    let mut stress = [Mandel::zeros(); MOST_POINTS];
    for (e, nodes) in block.nodes.iter().enumerate() {
        let points = &block.points[e * n..(e + 1) * n];
        let gradients = &block.lanes[e];
        let f = deformation_gradients(gradients, &nodes.map(|i| u[i as usize]));
        let r = rotations(&f);
        let stretch = stretches(&r, &f);
        let (mut volume, mut trace) = (0.0, 0.0);
        for (i, point) in points.iter().enumerate() {
            let s = |a: usize, b: usize| stretch[a][b][i];
            let root = std::f64::consts::SQRT_2;
            strain[i] = Mandel::new(
                s(0, 0) - 1.0,
                s(1, 1) - 1.0,
                s(2, 2) - 1.0,
                root * s(1, 2),
                root * s(0, 2),
                root * s(0, 1),
            );
            volume += point.weight;
            trace += point.weight * mandel::trace(&strain[i]);
        }
        if volume <= 0.0 {
            continue;
        }
        let mut pressure = 0.0;
        for (i, point) in points.iter().enumerate() {
            let shift = (trace / volume - mandel::trace(&strain[i])) / 3.0;
            (0..3).for_each(|c| strain[i][c] += shift);
            stress[i] = materials.at(e * n + i).stress(&strain[i]);
            pressure += point.weight * mandel::trace(&stress[i]) / 3.0;
        }
        pressure /= volume;
        let mut bracket = [[ZERO; 3]; 3];
        for (i, point) in points.iter().enumerate() {
            let law = materials.at(e * n + i);
            let t = unrotated_stress(&extract(&stretch, i), &stress[i], pressure, law) * point.weight;
            for a in 0..3 {
                for b in 0..3 {
                    bracket[a][b][i] = t[(a, b)];
                }
            }
        }
        let sum = nodal_forces(gradients, &product(&r, &bracket));
        for (&i, f) in nodes.iter().zip(&sum) {
            forces[i as usize] += f;
        }
    }
}

#[inline(always)]
fn deformation_gradients(gradients: &[[Lanes; 3]; 8], u: &[Vec3; 8]) -> Matrices {
    let mut f = [[ZERO; 3]; 3];
    for (i, row) in f.iter_mut().enumerate() {
        row[i] = [1.0; 8];
        for (g, u) in gradients.iter().zip(u) {
            for (entry, g) in row.iter_mut().zip(g) {
                for l in 0..8 {
                    entry[l] += u[i] * g[l];
                }
            }
        }
    }
    f
}

/// The symmetric part of RᵀF.
#[inline(always)]
fn stretches(r: &Matrices, f: &Matrices) -> Matrices {
    let mut full = [[ZERO; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            for k in 0..3 {
                for l in 0..8 {
                    full[i][j][l] += r[k][i][l] * f[k][j][l];
                }
            }
        }
    }
    let mut stretch = full;
    for i in 0..3 {
        for j in 0..3 {
            for l in 0..8 {
                stretch[i][j][l] = 0.5 * (full[i][j][l] + full[j][i][l]);
            }
        }
    }
    stretch
}

#[inline(always)]
fn product(a: &Matrices, b: &Matrices) -> Matrices {
    let mut c = [[ZERO; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            for k in 0..3 {
                for l in 0..8 {
                    c[i][j][l] += a[i][k][l] * b[k][j][l];
                }
            }
        }
    }
    c
}

/// Σ over the points of P ∇N, for each node.
#[inline(always)]
fn nodal_forces(gradients: &[[Lanes; 3]; 8], piola: &Matrices) -> [Vec3; 8] {
    let mut forces = [Vec3::zeros(); 8];
    for (force, g) in forces.iter_mut().zip(gradients) {
        for (i, row) in piola.iter().enumerate() {
            let mut lanes = ZERO;
            for (p, g) in row.iter().zip(g) {
                for l in 0..8 {
                    lanes[l] += p[l] * g[l];
                }
            }
            // Pairwise, the same order on every machine.
            let [a, b, c, d, e, f, g, h] = lanes;
            force[i] = ((a + b) + (c + d)) + ((e + f) + (g + h));
        }
    }
    forces
}

fn add_block<const N: usize>(block: &Block<N>, u: &[Vec3], materials: &Materials, forces: &mut [Vec3]) {
    let n = block.points_per_element;
    let mut state = [Kinematics::NONE; MOST_POINTS];
    let mut stress = [Mandel::zeros(); MOST_POINTS];
    for (e, nodes) in block.nodes.iter().enumerate() {
        let points = &block.points[e * n..(e + 1) * n];
        let u = nodes.map(|i| u[i as usize]);
        let volume = kinematics(points, &u, &mut state);
        if volume <= 0.0 {
            continue;
        }
        let mut pressure = 0.0;
        for (i, point) in points.iter().enumerate() {
            stress[i] = materials.at(e * n + i).stress(&state[i].strain);
            pressure += point.weight * mandel::trace(&stress[i]) / 3.0;
        }
        pressure /= volume;
        let mut sum = [Vec3::zeros(); N];
        for (i, point) in points.iter().enumerate() {
            let law = materials.at(e * n + i);
            let piola = piola_stress(&state[i], &stress[i], pressure, law) * point.weight;
            for (f, g) in sum.iter_mut().zip(&point.gradients) {
                *f += piola * g;
            }
        }
        for (&i, f) in nodes.iter().zip(&sum) {
            forces[i as usize] += f;
        }
    }
}

/// P = R (dev T + p̄ I + \[v\]×).
#[inline]
pub(super) fn piola_stress(k: &Kinematics, stress: &Mandel, pressure: f64, law: &Law) -> Mat3 {
    k.rotation * unrotated_stress(&k.stretch, stress, pressure, law)
}

/// dev T + p̄ I + \[v\]×.
#[inline]
fn unrotated_stress(stretch: &Mat3, stress: &Mandel, pressure: f64, law: &Law) -> Mat3 {
    let shift = pressure - mandel::trace(stress) / 3.0;
    let mut t = mandel::to_tensor(stress);
    for i in 0..3 {
        t[(i, i)] += shift;
    }
    if matches!(law, Law::TransverselyIsotropic(_)) {
        t += rotation_stress(stretch, &t);
    }
    t
}

/// The skew tensor `[v]×` with `(tr(U) I − U) v = axial(U T)`.
pub(super) fn rotation_stress(stretch: &Mat3, stress: &Mat3) -> Mat3 {
    let axial = twice_axial(&(stretch * stress));
    match spin_matrix(stretch).try_inverse() {
        Some(inverse) => (inverse * axial).cross_matrix(),
        None => Mat3::zeros(),
    }
}

/// `tr(U) I − U`: maps the axial vector of RᵀδR to twice the axial vector of RᵀδF.
#[inline]
pub(super) fn spin_matrix(stretch: &Mat3) -> Mat3 {
    Mat3::from_diagonal_element(stretch.trace()) - stretch
}

/// The vector a with `A − Aᵀ = [a]×`.
#[inline]
pub(super) fn twice_axial(a: &Mat3) -> Vec3 {
    Vec3::new(
        a[(2, 1)] - a[(1, 2)],
        a[(0, 2)] - a[(2, 0)],
        a[(1, 0)] - a[(0, 1)],
    )
}

/// The smallest det F over the points that stand for at least `least_fill` of their element's mean point volume, and
/// the element where it is. Zero or less: an element is flat or inside out.
pub fn smallest_jacobian(
    parts: &Discretisation,
    u: &[Vec3],
    fill: Option<&[f64]>,
    least_fill: f64,
) -> (f64, usize) {
    match parts {
        Discretisation::Eight(block) => smallest_in_block(block, u, fill, least_fill),
        Discretisation::Four(block) => smallest_in_block(block, u, fill, least_fill),
    }
}

fn smallest_in_block<const N: usize>(
    block: &Block<N>,
    u: &[Vec3],
    fill: Option<&[f64]>,
    least_fill: f64,
) -> (f64, usize) {
    let n = block.points_per_element;
    let mut smallest = (f64::INFINITY, 0);
    for (e, nodes) in block.nodes.iter().enumerate() {
        let u = nodes.map(|i| u[i as usize]);
        for q in e * n..(e + 1) * n {
            if fill.is_some_and(|fill| fill[q] < least_fill) {
                continue;
            }
            let j = deformation_gradient(&block.points[q], &u).determinant();
            // A NaN must count as failed, not as absent.
            if j.is_nan() || j < smallest.0 {
                smallest = (if j.is_nan() { f64::NEG_INFINITY } else { j }, e);
            }
        }
    }
    smallest
}

/// Strain and stress at every point, for output and for range checks, each `(points)`.
#[derive(Clone, Debug, Default)]
pub struct PointFields {
    /// ε̄ in the element's rotated frame, Mandel notation.
    pub strain: Vec<Mandel>,
    /// Cauchy stress in space, `P Fᵀ / det F` \[MPa\], symmetric.
    pub cauchy_stress: Vec<Mat3>,
    /// Secant Young's modulus of the law at the strain \[MPa\].
    pub young_modulus: Vec<f64>,
    /// det F.
    pub jacobian: Vec<f64>,
    /// Is the strain inside the range that the law was fitted in?
    pub in_range: Vec<bool>,
}

/// The fields at the displacements `u`.
pub fn point_fields(parts: &Discretisation, u: &[Vec3], materials: &Materials) -> PointFields {
    match parts {
        Discretisation::Eight(block) => fields_of_block(block, u, materials),
        Discretisation::Four(block) => fields_of_block(block, u, materials),
    }
}

fn fields_of_block<const N: usize>(block: &Block<N>, u: &[Vec3], materials: &Materials) -> PointFields {
    let n = block.points_per_element;
    let mut fields = PointFields::default();
    let mut state = [Kinematics::NONE; MOST_POINTS];
    for (e, nodes) in block.nodes.iter().enumerate() {
        let points = &block.points[e * n..(e + 1) * n];
        let u = nodes.map(|i| u[i as usize]);
        let volume = kinematics(points, &u, &mut state);
        let stresses: Vec<Mandel> = (0..n)
            .map(|i| materials.at(e * n + i).stress(&state[i].strain))
            .collect();
        let weighted = points
            .iter()
            .zip(&stresses)
            .map(|(p, t)| p.weight * mandel::trace(t) / 3.0);
        let pressure = if volume > 0.0 {
            weighted.sum::<f64>() / volume
        } else {
            0.0
        };
        for (i, point) in points.iter().enumerate() {
            let law = materials.at(e * n + i);
            let f = deformation_gradient(point, &u);
            let piola = piola_stress(&state[i], &stresses[i], pressure, law);
            fields.strain.push(state[i].strain);
            fields.cauchy_stress.push(piola * f.transpose() / f.determinant());
            fields.young_modulus.push(law.young_modulus(&state[i].strain));
            fields.jacobian.push(f.determinant());
            fields.in_range.push(law.in_range(&state[i].strain));
        }
    }
    fields
}
