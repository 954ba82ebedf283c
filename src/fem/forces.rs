//! Internal forces of co-rotational elements whose clusters of points may share one volumetric strain.
//!
//! ```text
//! F = R U,  ε = U − I                      Biot strain at every integration point
//! f_a = Σ_q w_q P_q ∇N_a,  P = R (T' + [v]×)
//!
//! alone    T' = σ(ε)
//! shared   g(U) = tr ε  or  J = det U,     ḡ = Σ_q w_q g_q / Σ_q w_q       averaged over the cluster
//!          T' = S + p̄ ∂g/∂U,               p̄ = Σ_q w_q p_q / Σ_q w_q
//!   g = tr ε    T = σ(ε + (ḡ − g)/3 I),    S = dev T,                  p = tr T / 3
//!   g = J       T = σ(sU − I),             S = s T − π U⁻¹,            p = π / ḡ,    s³ = ḡ/J,  π = T : sU / 3
//! ```
//!
//! Both are the derivative of the work of the material at the strain that it is shown, so a law with an energy keeps
//! it. Laws over Biot strain bound the volume by tr ε, hyperelastic ones by J: each is averaged in what it bounds. One
//! volumetric constraint a cluster in place of one a point keeps elements from locking near ν = ½ (mean dilatation:
//! Nagtegaal, Parks and Rice 1974; B-bar: Hughes 1980; patches of tetrahedra: de Souza Neto et al. 2005).
//!
//! `[v]×`, with `(tr(U) I − U) v = axial(U T')`, is the part of T : δU that comes from the change of R. It vanishes when T
//! and U share their axes, so for every isotropic law. The papers leave it out (P = R σ, Müller and Gross 2004); without
//! it the Cauchy stress of a transversely isotropic material is not symmetric and moments do not balance.
//!
//! Symbols: u displacement \[mm\], R rotation, U right stretch, T Biot stress \[MPa\], P first Piola–Kirchhoff stress
//! \[MPa\], w volume \[mm³\], N shape functions, π mean Kirchhoff stress \[MPa\]. Valid at any rotation and at strains
//! inside the law's fitted range; det F ≤ 0 is found by [`smallest_jacobian`], not here. Source: Bickel 2010, sections
//! 7.2 and 8.2; derivations in `docs/theory/elements.md`.

use super::elements::{BATCH, Batch, Block, Discretisation, IntegrationPoint, NO_POINT};
use super::response::{self, Laws};
use crate::material::law::Law;
use crate::math::mandel::Mandel;
use crate::math::polar_lanes::{Lanes, Matrices, ZERO, extract};
use crate::math::{Mat3, Vec3};

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

/// Adds the internal forces at the displacements `u`, `(nodes)` \[mm\], to `forces`, `(nodes)` \[N\].
pub fn add_internal_forces(parts: &Discretisation, u: &[Vec3], materials: &Materials, forces: &mut [Vec3]) {
    let arch = pulp::Arch::new();
    match parts {
        Discretisation::Eight(block) => arch.dispatch(InLanes {
            block,
            u,
            materials,
            forces,
        }),
        Discretisation::Four(block) => arch.dispatch(InLanes {
            block,
            u,
            materials,
            forces,
        }),
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

/// A call of [`add_block`], which is compiled for each generation of vector instructions and chosen when the program
/// runs. A struct, because a closure is not inlined into the place that may use those instructions.
struct InLanes<'a, const N: usize> {
    block: &'a Block<N>,
    u: &'a [Vec3],
    materials: &'a Materials<'a>,
    forces: &'a mut [Vec3],
}

impl<const N: usize> pulp::NullaryFnOnce for InLanes<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        add_block(self.block, self.u, self.materials, self.forces);
    }
}

#[inline(always)]
fn add_block<const N: usize>(block: &Block<N>, u: &[Vec3], materials: &Materials, forces: &mut [Vec3]) {
    for batch in &block.batches {
        let f = deformation_gradients(block, batch, u);
        let laws = laws_of(batch, materials);
        let piola = response::weighted_piola(&f, &batch.weight, &laws, block.volumetric);
        add_nodal_forces(block, batch, &piola, forces);
    }
}

/// The laws at a batch's points; where there is no point, that of the first.
#[inline(always)]
pub(super) fn laws_of<'a, const N: usize>(batch: &Batch<N>, materials: &Materials<'a>) -> Laws<'a> {
    let first = materials.cell_of_point[batch.points[0] as usize];
    let cells = batch.points.map(|q| match q {
        NO_POINT => first,
        q => materials.cell_of_point[q as usize],
    });
    if cells.iter().all(|&c| c == first) {
        return Laws::Same(materials.laws[first as usize]);
    }
    Laws::Mixed(cells.map(|c| materials.laws[c as usize]))
}

/// F in the lanes of a batch; the identity where there is no point.
#[inline(always)]
pub(super) fn deformation_gradients<const N: usize>(
    block: &Block<N>,
    batch: &Batch<N>,
    u: &[Vec3],
) -> Matrices {
    let mut f = [[ZERO; 3]; 3];
    for (i, row) in f.iter_mut().enumerate() {
        row[i] = [1.0; BATCH];
    }
    if block.points_per_element > 1 {
        // All points belong to one element.
        let nodes = &block.nodes[block.element_of(batch.points[0] as usize)];
        for (g, &n) in batch.gradients.iter().zip(nodes) {
            let u = &u[n as usize];
            add_products(&mut f, &[[u.x; BATCH], [u.y; BATCH], [u.z; BATCH]], g);
        }
        return f;
    }
    for (a, g) in batch.gradients.iter().enumerate() {
        let mut own = [ZERO; 3];
        for (l, &q) in batch.points.iter().enumerate() {
            if q != NO_POINT {
                let u = &u[block.nodes[q as usize][a] as usize];
                (own[0][l], own[1][l], own[2][l]) = (u.x, u.y, u.z);
            }
        }
        add_products(&mut f, &own, g);
    }
    f
}

/// f += u ⊗ g
#[inline(always)]
fn add_products(f: &mut Matrices, u: &[Lanes; 3], g: &[Lanes; 3]) {
    for (row, u) in f.iter_mut().zip(u) {
        for (entry, g) in row.iter_mut().zip(g) {
            for l in 0..BATCH {
                entry[l] += u[l] * g[l];
            }
        }
    }
}

/// Adds P ∇N_a at every point to the forces of its nodes; `piola` carries the points' volumes.
#[inline(always)]
pub(super) fn add_nodal_forces<const N: usize>(
    block: &Block<N>,
    batch: &Batch<N>,
    piola: &Matrices,
    forces: &mut [Vec3],
) {
    if block.points_per_element > 1 {
        let nodes = &block.nodes[block.element_of(batch.points[0] as usize)];
        for (g, &n) in batch.gradients.iter().zip(nodes) {
            let lanes = products(piola, g);
            for (f, lanes) in forces[n as usize].iter_mut().zip(&lanes) {
                *f += lanes.iter().sum::<f64>();
            }
        }
        return;
    }
    for (a, g) in batch.gradients.iter().enumerate() {
        let lanes = products(piola, g);
        for (l, &q) in batch.points.iter().enumerate() {
            if q != NO_POINT {
                let force = &mut forces[block.nodes[q as usize][a] as usize];
                for c in 0..3 {
                    force[c] += lanes[c][l];
                }
            }
        }
    }
}

/// P g in all lanes.
#[inline(always)]
pub(super) fn products(piola: &Matrices, g: &[Lanes; 3]) -> [Lanes; 3] {
    let mut result = [ZERO; 3];
    for (row, out) in piola.iter().zip(result.iter_mut()) {
        for (p, g) in row.iter().zip(g) {
            for l in 0..BATCH {
                out[l] += p[l] * g[l];
            }
        }
    }
    result
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
    let points = block.points.len();
    let mut fields = PointFields {
        strain: vec![Mandel::zeros(); points],
        cauchy_stress: vec![Mat3::zeros(); points],
        young_modulus: vec![0.0; points],
        jacobian: vec![0.0; points],
        in_range: vec![true; points],
    };
    for batch in &block.batches {
        let f = deformation_gradients(block, batch, u);
        let laws = laws_of(batch, materials);
        let states = response::states(&f, &batch.weight, &laws, block.volumetric);
        for (l, state) in states.iter().enumerate() {
            let q = batch.points[l] as usize;
            if batch.points[l] == NO_POINT {
                continue;
            }
            let (f, law) = (extract(&f, l), laws.at(l));
            fields.strain[q] = state.strain;
            fields.cauchy_stress[q] = state.piola() * f.transpose() / f.determinant();
            fields.young_modulus[q] = law.young_modulus(&state.strain);
            fields.jacobian[q] = f.determinant();
            fields.in_range[q] = law.in_range(&state.strain);
        }
    }
    fields
}
