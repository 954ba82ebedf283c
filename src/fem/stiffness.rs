//! Element stiffness: the secant one and the consistent tangent.
//!
//! ```text
//! secant   K = Σ_q w B̄ᵀ E(ε̄) B̄                     R, E frozen; symmetric positive definite
//! tangent  K = Σ_q w ∇N_b · ∂P/∂u_a                  R, E and the averaged trace follow u
//! δP = R (Ω T' + dev(C δε̄) + δp̄ I),  C = ∂σ/∂ε,  δε̄ = δU + (δθ̄ − tr δU)/3 I
//! δU = RᵀδF − Ω U,  Ω = [ω]×,  (tr(U) I − U) ω = axial(RᵀδF)
//! ```
//!
//! Symbols as in [`super::forces`]; T' is the bracket there. The secant matrix at rest is the matrix of linear
//! elasticity. The tangent is the exact derivative of the internal forces for isotropic laws; for transversely
//! isotropic ones the change of `[v]×` is left out, so that Newton's iteration converges linearly there. A strain-space
//! law has no energy: its tangent is not symmetric, and [`tangent`] gives the symmetric part, which the Cholesky
//! factorisation takes.

use super::elements::{Block, IntegrationPoint};
use super::forces::{self, Kinematics, MOST_POINTS, Materials};
use crate::material::isotropic::invariants;
use crate::material::law::Law;
use crate::math::mandel::{self, Mandel};
use crate::math::{Mat3, Vec3};

/// Which matrix to build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Linear elasticity about the current state, rotations and moduli frozen.
    Secant,
    /// The symmetric part of the derivative of the internal forces.
    Tangent,
}

/// Room for one element's computation.
pub(super) struct Scratch {
    state: [Kinematics; MOST_POINTS],
    columns: Vec<Mandel>,
}

impl Scratch {
    pub fn new() -> Scratch {
        Scratch {
            state: [forces::Kinematics::NONE; MOST_POINTS],
            columns: Vec::new(),
        }
    }
}

/// The stiffness of element `e` at the displacements `u` of its nodes, written to `out`, row-major `(3N × 3N)`.
pub(super) fn element<const N: usize>(
    block: &Block<N>,
    e: usize,
    u: &[Vec3; N],
    materials: &Materials,
    kind: Kind,
    scratch: &mut Scratch,
    out: &mut [f64],
) {
    out.fill(0.0);
    let n = block.points_per_element;
    let points = &block.points[e * n..(e + 1) * n];
    let volume = forces::kinematics(points, u, &mut scratch.state);
    if volume <= 0.0 {
        return;
    }
    match kind {
        Kind::Secant => secant(points, e * n, volume, materials, scratch, out),
        Kind::Tangent => tangent(points, e * n, volume, materials, scratch, out),
    }
}

/// Mandel columns of sym(Rᵀ (e_i ⊗ g)) for i = x, y, z.
#[inline]
fn strain_columns(rotation: &Mat3, g: &Vec3) -> [Mandel; 3] {
    let s = std::f64::consts::FRAC_1_SQRT_2;
    // Row i of R is the image of e_i under Rᵀ.
    [0, 1, 2].map(|i| {
        let r = rotation.row(i);
        Mandel::new(
            r[0] * g.x,
            r[1] * g.y,
            r[2] * g.z,
            s * (r[1] * g.z + r[2] * g.y),
            s * (r[0] * g.z + r[2] * g.x),
            s * (r[0] * g.y + r[1] * g.x),
        )
    })
}

/// Gradient of θ̄ with respect to the nodes: Σ w R g / Σ w.
fn mean_trace_gradient<const N: usize>(
    points: &[IntegrationPoint<N>],
    state: &[Kinematics; MOST_POINTS],
    volume: f64,
) -> [Vec3; N] {
    let mut mean = [Vec3::zeros(); N];
    for (point, k) in points.iter().zip(state) {
        for (m, g) in mean.iter_mut().zip(&point.gradients) {
            *m += k.rotation * g * (point.weight / volume);
        }
    }
    mean
}

/// Puts the averaged trace in place of the column's own.
#[inline]
fn with_trace(mut column: Mandel, trace: f64) -> Mandel {
    let shift = (trace - mandel::trace(&column)) / 3.0;
    for i in 0..3 {
        column[i] += shift;
    }
    column
}

fn secant<const N: usize>(
    points: &[IntegrationPoint<N>],
    first: usize,
    volume: f64,
    materials: &Materials,
    scratch: &mut Scratch,
    out: &mut [f64],
) {
    let mean = mean_trace_gradient(points, &scratch.state, volume);
    let size = 3 * N;
    let mut bulk_by_volume = 0.0;
    for (q, point) in points.iter().enumerate() {
        let k = &scratch.state[q];
        if let Law::Isotropic(law) = materials.at(first + q) {
            let [shear, bulk] = law.moduli(&invariants(&k.strain));
            add_shear(point, &k.rotation, shear * point.weight, out);
            bulk_by_volume += bulk * point.weight;
            continue;
        }
        let (_, moduli) = materials.at(first + q).stress_and_secant(&k.strain);
        let columns = &mut scratch.columns;
        columns.clear();
        for (g, mean) in point.gradients.iter().zip(&mean) {
            let own = strain_columns(&k.rotation, g);
            columns.extend((0..3).map(|i| with_trace(own[i], mean[i])));
        }
        for a in 0..size {
            let stress = moduli * columns[a] * point.weight;
            for b in 0..=a {
                out[a * size + b] += stress.dot(&columns[b]);
            }
        }
    }
    for a in 0..size {
        for b in 0..=a {
            out[a * size + b] += bulk_by_volume * mean[a / 3][a % 3] * mean[b / 3][b % 3];
        }
    }
    mirror(out, size);
}

/// Adds 2μ w dev sym(RᵀδF) : dev sym(RᵀδF), which for an isotropic law is all but the bulk part:
/// `K_ab = μ w ((∇N_a·∇N_b) I + r_b r_aᵀ − ⅔ r_a r_bᵀ)` with r = R ∇N.
fn add_shear<const N: usize>(point: &IntegrationPoint<N>, rotation: &Mat3, factor: f64, out: &mut [f64]) {
    let size = 3 * N;
    let turned = point.gradients.map(|g| rotation * g);
    for a in 0..N {
        for b in 0..=a {
            let (ra, rb) = (turned[a] * factor, &turned[b]);
            let both = ra.dot(rb);
            for i in 0..3 {
                let row = &mut out[(3 * a + i) * size + 3 * b..][..3];
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry += rb[i] * ra[j] - 2.0 / 3.0 * ra[i] * rb[j];
                }
                row[i] += both;
            }
        }
    }
}

fn tangent<const N: usize>(
    points: &[IntegrationPoint<N>],
    first: usize,
    volume: f64,
    materials: &Materials,
    scratch: &mut Scratch,
    out: &mut [f64],
) {
    let size = 3 * N;
    let mean = mean_trace_gradient(points, &scratch.state, volume);
    let responses: Vec<_> = (0..points.len())
        .map(|q| {
            materials
                .at(first + q)
                .stress_and_tangent(&scratch.state[q].strain)
        })
        .collect();
    let pressure = points
        .iter()
        .zip(&responses)
        .map(|(p, (t, _))| p.weight * mandel::trace(t) / 3.0)
        .sum::<f64>()
        / volume;
    // First sweep: the change of every point's stress and of the averaged pressure with each node's displacement.
    let mut changes: Vec<(Mandel, Mat3)> = Vec::with_capacity(points.len() * size);
    let mut pressure_change = vec![0.0; size];
    for (q, point) in points.iter().enumerate() {
        let k = &scratch.state[q];
        let (stress, moduli) = &responses[q];
        let bracket = bracket(k, stress, pressure, materials, first + q);
        let to_spin = forces::spin_matrix(&k.stretch)
            .try_inverse()
            .unwrap_or_else(Mat3::zeros);
        for a in 0..N {
            for i in 0..3 {
                // RᵀδF = (row i of R)ᵀ gᵀ
                let pulled = k.rotation.row(i).transpose() * point.gradients[a].transpose();
                let spin = (to_spin * forces::twice_axial(&pulled)).cross_matrix();
                let own = mandel::from_tensor(&(pulled - spin * k.stretch));
                let stress_change = moduli * with_trace(own, mean[a][i]);
                pressure_change[3 * a + i] += point.weight * mandel::trace(&stress_change) / 3.0 / volume;
                changes.push((stress_change, spin * bracket));
            }
        }
    }
    // Second sweep: δP and its product with the gradients.
    for (q, point) in points.iter().enumerate() {
        let k = &scratch.state[q];
        for column in 0..size {
            let (stress_change, turned) = &changes[q * size + column];
            let with_mean = with_trace(*stress_change, 3.0 * pressure_change[column]);
            let piola_change = k.rotation * (turned + mandel::to_tensor(&with_mean)) * point.weight;
            for b in 0..N {
                let force = piola_change * point.gradients[b];
                for j in 0..3 {
                    out[(3 * b + j) * size + column] += force[j];
                }
            }
        }
    }
    for a in 0..size {
        for b in 0..a {
            let both = 0.5 * (out[a * size + b] + out[b * size + a]);
            out[a * size + b] = both;
            out[b * size + a] = both;
        }
    }
}

/// T' = Rᵀ P at the current state.
fn bracket(k: &Kinematics, stress: &Mandel, pressure: f64, materials: &Materials, q: usize) -> Mat3 {
    k.rotation
        .tr_mul(&forces::piola_stress(k, stress, pressure, materials.at(q)))
}

fn mirror(out: &mut [f64], size: usize) {
    for a in 0..size {
        for b in 0..a {
            out[b * size + a] = out[a * size + b];
        }
    }
}
