//! Stiffness of a cluster of points: the secant one and the consistent tangent.
//!
//! ```text
//! secant   K = Σ_q w B̄ᵀ E(ε̄) B̄                     R, E frozen; symmetric positive definite
//! tangent  K = ∂f/∂u                                 exact: R, the law, averages and [v]× follow u
//!
//! RᵀδP = Ω (T' + [v]×) + C' δU + [δv]×,   δU = sym(RᵀδF − Ω U),   Ω = [ω]×,   (tr(U) I − U) ω = axial(RᵀδF)
//! K    = Σ_q w ∇N · ∂P/∂F · ∇N  +  Σ_g A mᵀ + m Bᵀ + c m mᵀ
//! m = ∂ḡ/∂u,   A = Σ w Gᵀ ∂S/∂ḡ,   B = Σ w Gᵀ ∂p/∂U,   c = Σ w ∂p/∂ḡ,   C' = ∂S/∂U + p̄ ∂²g/∂U²
//! ```
//!
//! Symbols as in [`super::forces`]; G maps nodal displacements to δU; the sum over g and its three products of vectors
//! couple the points that share a volumetric strain. The secant matrix at rest is that of linear elasticity. For a
//! hyperelastic law, which has no secant, its tangent made positive definite takes the place of E. The tangent is
//! symmetric for laws with an energy; a strain-space law has none, and its tangent is not.

use super::elements::{Block, VolumetricStrain};
use super::forces::{self, Materials};
use super::response::{Means, rotation_stress, spin_matrix, strain_of, twice_axial};
use crate::material::isotropic::invariants;
use crate::material::law::{Law, Volumetric};
use crate::math::mandel::{self, Mandel, Mandel6};
use crate::math::polar::{cofactor, polar};
use crate::math::{Mat3, Vec3};

/// Which matrix to build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Linear elasticity about the current state, rotations and moduli frozen.
    Secant,
    /// The derivative of the internal forces.
    Tangent,
}

/// A linear map from RᵀδF to RᵀδP, or from δF to δP; rows and columns run over (component, direction), `(9 × 9)` \[MPa\].
type Moduli9 = [[f64; 9]; 9];

/// One point of a cluster.
struct Local<'a, const N: usize> {
    q: usize,
    places: [usize; N],
    weight: f64,
    law: &'a Law,
    rotation: Mat3,
    stretch: Mat3,
    /// S, and T' once the pressures are known; zero for the secant.
    stress: Mat3,
    /// p.
    pressure: f64,
    /// ∂S/∂U, and C' once the pressures are known.
    moduli: Mandel6,
    /// ∂S/∂ḡ.
    stress_by_mean: Mandel,
    /// ∂p/∂U.
    pressure_by_stretch: Mandel,
    /// ∂p/∂ḡ.
    pressure_by_mean: f64,
}

/// What the points that bound one measure of volume add.
struct Coupling {
    measure: Volumetric,
    /// p̄.
    pressure: f64,
    mean_gradient: Vec<f64>,
    stress_by_mean: Vec<f64>,
    pressure_by_stretch: Vec<f64>,
    pressure_by_mean: f64,
}

/// The stiffness of cluster `c` at the displacements `u`, `(nodes)`, written to `out`, row-major over the components of the
/// cluster's nodes. Not symmetric where the law's tangent is not.
pub(super) fn cluster<const N: usize>(
    block: &Block<N>,
    c: usize,
    u: &[Vec3],
    materials: &Materials,
    kind: Kind,
    out: &mut Vec<f64>,
) {
    let size = 3 * block.nodes_of_cluster(c).len();
    out.clear();
    out.resize(size * size, 0.0);
    let mut points = points(block, c, u, materials);
    let means = Means::over(
        points.iter().map(|p| &p.weight),
        points.iter().map(|p| &p.stretch),
    );
    if means.volume <= 0.0 {
        return;
    }
    // A point alone is its own mean.
    let shares = block.volumetric == VolumetricStrain::Shared || points.len() == 1;
    if shares && kind == Kind::Secant && points.iter().all(|p| matches!(p.law, Law::Isotropic(_))) {
        return isotropic_secant(block, &points, &means, size, out);
    }
    if block.volumetric == VolumetricStrain::Pointwise {
        for point in &mut points {
            point.respond_alone(kind);
            add_point(block, point, kind, size, out);
        }
        return;
    }
    points.iter_mut().for_each(|p| p.respond(&means, kind));
    let couplings: Vec<Coupling> = [Volumetric::Trace, Volumetric::Jacobian]
        .into_iter()
        .filter_map(|measure| coupling(block, &points, measure, &means, size))
        .collect();
    for point in &mut points {
        couplings.iter().for_each(|c| point.take_pressure(c, kind));
        add_point(block, point, kind, size, out);
    }
    for coupling in &couplings {
        coupling.add_to(size, out);
    }
}

fn points<'a, const N: usize>(
    block: &Block<N>,
    c: usize,
    u: &[Vec3],
    materials: &Materials<'a>,
) -> Vec<Local<'a, N>> {
    block
        .points_of_cluster(c)
        .map(|(q, places)| {
            let own = block.nodes[block.element_of(q)].map(|n| u[n as usize]);
            let p = polar(&forces::deformation_gradient(&block.points[q], &own));
            Local {
                q,
                places,
                weight: block.points[q].weight,
                law: materials.at(q),
                rotation: p.rotation,
                stretch: p.stretch,
                stress: Mat3::zeros(),
                pressure: 0.0,
                moduli: Mandel6::zeros(),
                stress_by_mean: Mandel::zeros(),
                pressure_by_stretch: Mandel::zeros(),
                pressure_by_mean: 0.0,
            }
        })
        .collect()
}

impl<const N: usize> Local<'_, N> {
    /// The law's stress, zero for the secant, and its matrix.
    fn law_response(&self, strain: &Mandel, kind: Kind) -> (Mandel, Mandel6) {
        match kind {
            Kind::Tangent => self.law.stress_and_tangent(strain),
            Kind::Secant => (Mandel::zeros(), self.law.stress_and_secant(strain).1),
        }
    }

    fn respond_alone(&mut self, kind: Kind) {
        let (stress, moduli) = self.law_response(&strain_of(&self.stretch), kind);
        self.stress = mandel::to_tensor(&stress);
        self.moduli = moduli;
    }

    fn respond(&mut self, means: &Means, kind: Kind) {
        let measure = self.law.volumetric();
        let strain = means.shown(&self.stretch, measure);
        let (t, c) = self.law_response(&strain, kind);
        match measure {
            Volumetric::Trace => self.respond_in_trace(&t, &c),
            Volumetric::Jacobian => self.respond_in_jacobian(means, &strain, &t, &c, kind),
        }
    }

    /// S = dev T and p = tr T/3 at the strain dev ε + ḡ/3 I.
    fn respond_in_trace(&mut self, t: &Mandel, c: &Mandel6) {
        let identity = Mandel::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
        let third = identity / 3.0;
        self.pressure = mandel::trace(t) / 3.0;
        self.stress = mandel::to_tensor(&mandel::deviator(t));
        let (by_mean, by_trace) = (c * third, c.tr_mul(&third));
        self.pressure_by_mean = third.dot(&by_mean);
        self.stress_by_mean = mandel::deviator(&by_mean);
        self.pressure_by_stretch = mandel::deviator(&by_trace);
        // dev ∘ C ∘ dev = C − I⊗(Cᵀ I/3) − (C I/3)⊗I + (I:C I/9) I⊗I
        self.moduli = c - identity * by_trace.transpose() - by_mean * identity.transpose()
            + identity * identity.transpose() * self.pressure_by_mean;
    }

    /// S = sT − πU⁻¹ and p = π/ḡ at the stretch Ū = sU; with i = U⁻¹, A = 1 − U⊗i/3, h = (CᵀŪ + T)/3 = ∂π/∂Ū:
    /// ∂S/∂U = s²CA − s T⊗i/3 − s i⊗Aᵀh + π U⁻¹⊠U⁻¹, ∂S/∂ḡ = (s(T + CŪ) − (h:Ū) i)/3ḡ, ∂p/∂U = s Aᵀh/ḡ,
    /// ∂p/∂ḡ = (h:Ū/3 − π)/ḡ². For the secant, T = 0 and no geometry changes: AᵀCA and its neighbours.
    fn respond_in_jacobian(&mut self, means: &Means, strain: &Mandel, t: &Mandel, c: &Mandel6, kind: Kind) {
        let s = means.scale(&self.stretch);
        let g = means.jacobian;
        let inverse_tensor = cofactor(&self.stretch) / self.stretch.determinant();
        let (u, inverse) = (
            mandel::from_tensor(&self.stretch),
            mandel::from_tensor(&inverse_tensor),
        );
        let mut shown = *strain;
        (0..3).for_each(|k| shown[k] += 1.0);
        let deviate = Mandel6::identity() - u * inverse.transpose() / 3.0;
        if kind == Kind::Secant {
            let by_mean = c * shown / (3.0 * g);
            self.moduli = deviate.tr_mul(&(c * deviate)) * (s * s);
            self.stress_by_mean = deviate.tr_mul(&by_mean) * s;
            self.pressure_by_stretch = self.stress_by_mean;
            self.pressure_by_mean = shown.dot(&by_mean) / (3.0 * g);
            return;
        }
        let kirchhoff = t.dot(&shown) / 3.0;
        let h = (c.tr_mul(&shown) + t) / 3.0;
        let along = h.dot(&shown);
        let turned = deviate.tr_mul(&h) * s;
        self.pressure = kirchhoff / g;
        self.stress = mandel::to_tensor(t) * s - inverse_tensor * kirchhoff;
        self.moduli =
            c * deviate * (s * s) - t * inverse.transpose() * (s / 3.0) - inverse * turned.transpose()
                + sandwich(&inverse_tensor) * kirchhoff;
        self.stress_by_mean = ((t + c * shown) * s - inverse * along) / (3.0 * g);
        self.pressure_by_stretch = turned / g;
        self.pressure_by_mean = (along / 3.0 - kirchhoff) / (g * g);
    }

    /// Adds p̄ ∂g/∂U to the stress and p̄ ∂²g/∂U² to the moduli.
    fn take_pressure(&mut self, coupling: &Coupling, kind: Kind) {
        if kind == Kind::Secant {
            return;
        }
        self.stress += slope(&self.stretch, coupling.measure) * coupling.pressure;
        if coupling.measure == Volumetric::Jacobian {
            let j = self.stretch.determinant();
            let inverse_tensor = cofactor(&self.stretch) / j;
            let inverse = mandel::from_tensor(&inverse_tensor);
            let curvature = inverse * inverse.transpose() - sandwich(&inverse_tensor);
            self.moduli += curvature * (coupling.pressure * j);
        }
    }
}

/// ∂g/∂U.
fn slope(stretch: &Mat3, measure: Volumetric) -> Mat3 {
    match measure {
        Volumetric::Trace => Mat3::identity(),
        Volumetric::Jacobian => cofactor(stretch),
    }
}

/// The map X → A X A of symmetric tensors, Mandel notation.
fn sandwich(a: &Mat3) -> Mandel6 {
    let mut map = Mandel6::zeros();
    for k in 0..6 {
        let mut unit = Mandel::zeros();
        unit[k] = 1.0;
        map.set_column(k, &mandel::from_tensor(&(a * mandel::to_tensor(&unit) * a)));
    }
    map
}

/// What the points whose laws bound `measure` add; `None` if there are none.
fn coupling<const N: usize>(
    block: &Block<N>,
    points: &[Local<N>],
    measure: Volumetric,
    means: &Means,
    size: usize,
) -> Option<Coupling> {
    if points.iter().all(|p| p.law.volumetric() != measure) {
        return None;
    }
    let mut result = Coupling {
        measure,
        pressure: 0.0,
        mean_gradient: vec![0.0; size],
        stress_by_mean: vec![0.0; size],
        pressure_by_stretch: vec![0.0; size],
        pressure_by_mean: 0.0,
    };
    for point in points {
        let w = point.weight;
        let gradients = &block.points[point.q].gradients;
        let slope = slope(&point.stretch, measure);
        add_nodal(
            point,
            gradients,
            &slope,
            w / means.volume,
            &mut result.mean_gradient,
        );
        if point.law.volumetric() != measure {
            continue;
        }
        result.pressure += w * point.pressure / means.volume;
        result.pressure_by_mean += w * point.pressure_by_mean;
        let turned = |v: &Mandel| {
            let v = mandel::to_tensor(v);
            v + rotation_stress(&point.stretch, &v)
        };
        add_nodal(
            point,
            gradients,
            &turned(&point.stress_by_mean),
            w,
            &mut result.stress_by_mean,
        );
        add_nodal(
            point,
            gradients,
            &turned(&point.pressure_by_stretch),
            w,
            &mut result.pressure_by_stretch,
        );
    }
    Some(result)
}

/// Adds the nodal vector of the work `v : RᵀδF`, times `factor`.
fn add_nodal<const N: usize>(
    point: &Local<N>,
    gradients: &[Vec3; N],
    v: &Mat3,
    factor: f64,
    out: &mut [f64],
) {
    let spatial = point.rotation * v * factor;
    for (&place, g) in point.places.iter().zip(gradients) {
        let f = spatial * g;
        for i in 0..3 {
            out[3 * place + i] += f[i];
        }
    }
}

impl Coupling {
    fn add_to(&self, size: usize, out: &mut [f64]) {
        for (i, row) in out.chunks_exact_mut(size).enumerate() {
            let of_stress = self.stress_by_mean[i] + self.pressure_by_mean * self.mean_gradient[i];
            let of_mean = self.mean_gradient[i];
            let columns = self.mean_gradient.iter().zip(&self.pressure_by_stretch);
            for (entry, (m, b)) in row.iter_mut().zip(columns) {
                *entry += of_stress * m + of_mean * b;
            }
        }
    }
}

/// Adds Σ ∇N · ∂P/∂F · ∇N of one point.
fn add_point<const N: usize>(block: &Block<N>, point: &Local<N>, kind: Kind, size: usize, out: &mut [f64]) {
    let moduli = in_space(&unrotated(point, kind), &point.rotation);
    let gradients = &block.points[point.q].gradients;
    for (&b, g) in point.places.iter().zip(gradients) {
        // (component, direction) of δP for each component of the node's displacement.
        let mut by_node = [[0.0; 3]; 9];
        for (row, entries) in by_node.iter_mut().zip(&moduli) {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = point.weight
                    * (entries[3 * j] * g.x + entries[3 * j + 1] * g.y + entries[3 * j + 2] * g.z);
            }
        }
        for (&a, g) in point.places.iter().zip(gradients) {
            for i in 0..3 {
                let row = &mut out[(3 * a + i) * size + 3 * b..][..3];
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry +=
                        by_node[3 * i][j] * g.x + by_node[3 * i + 1][j] * g.y + by_node[3 * i + 2][j] * g.z;
                }
            }
        }
    }
}

/// The map RᵀδF → RᵀδP: C' of its symmetric part, and for each of the three axes of its skew part what a spin does,
/// `Ω (T' + [v]×) − C' sym(Ω U)`, for only the skew part turns R.
fn unrotated<const N: usize>(point: &Local<N>, kind: Kind) -> Moduli9 {
    let mut map = [[0.0; 9]; 9];
    for (row, entries) in map.iter_mut().enumerate() {
        let (m, by_row) = MANDEL_PLACE[row];
        for (column, entry) in entries.iter_mut().enumerate() {
            let (n, by_column) = MANDEL_PLACE[column];
            *entry = by_row * by_column * point.moduli[(m, n)];
        }
    }
    if kind == Kind::Secant {
        return map;
    }
    let to_spin = spin_matrix(&point.stretch)
        .try_inverse()
        .unwrap_or_else(Mat3::zeros);
    if point.law.turns_stress() {
        add_turned_stress(point, &to_spin, &mut map);
    }
    for axis in 0..3 {
        let spin = to_spin.column(axis).into_owned().cross_matrix();
        let whole = if point.law.turns_stress() {
            point.stress + rotation_stress(&point.stretch, &point.stress)
        } else {
            point.stress
        };
        let stretched = mandel::from_tensor(&(spin * point.stretch));
        let mut change = spin * whole - mandel::to_tensor(&(point.moduli * stretched));
        if point.law.turns_stress() {
            change -= turned_stress(point, &to_spin, &mandel::to_tensor(&stretched));
        }
        // The axis' component of axial(RᵀδF): A₂₁ − A₁₂ and so on round.
        let (i, j) = ((axis + 2) % 3, (axis + 1) % 3);
        for (row, entries) in map.iter_mut().enumerate() {
            let entry = change[(row / 3, row % 3)];
            entries[3 * i + j] += entry;
            entries[3 * j + i] -= entry;
        }
    }
    map
}

/// The place in Mandel notation of each pair (row, column), and what a tensor's component there is of the 6-vector's.
const MANDEL_PLACE: [(usize, f64); 9] = {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    [
        (0, 1.0),
        (5, half),
        (4, half),
        (5, half),
        (1, 1.0),
        (3, half),
        (4, half),
        (3, half),
        (2, 1.0),
    ]
};

/// Adds the change of \[v\]× with the symmetric part of RᵀδF.
fn add_turned_stress<const N: usize>(point: &Local<N>, to_spin: &Mat3, map: &mut Moduli9) {
    for column in 0..9 {
        let mut unit = Mat3::zeros();
        unit[(column / 3, column % 3)] += 0.5;
        unit[(column % 3, column / 3)] += 0.5;
        let change = turned_stress(point, to_spin, &unit);
        for (row, entries) in map.iter_mut().enumerate() {
            entries[column] += change[(row / 3, row % 3)];
        }
    }
}

/// The change of \[v\]× as U changes by `du`: `(tr(U) I − U) δv = axial(δU T' + U δT') − (tr(δU) I − δU) v`.
fn turned_stress<const N: usize>(point: &Local<N>, to_spin: &Mat3, du: &Mat3) -> Mat3 {
    let dt = mandel::to_tensor(&(point.moduli * mandel::from_tensor(du)));
    let skew = to_spin * twice_axial(&(point.stretch * point.stress));
    let axial = twice_axial(&(du * point.stress + point.stretch * dt));
    (to_spin * (axial - spin_matrix(du) * skew)).cross_matrix()
}

/// The map δF → δP, with R applied to the first index of both.
fn in_space(map: &Moduli9, rotation: &Mat3) -> Moduli9 {
    let mut rows = [[0.0; 9]; 9];
    for i in 0..3 {
        for m in 0..3 {
            for k in 0..3 {
                for (entry, own) in rows[3 * i + m].iter_mut().zip(&map[3 * k + m]) {
                    *entry += rotation[(i, k)] * own;
                }
            }
        }
    }
    let mut result = [[0.0; 9]; 9];
    for (out, row) in result.iter_mut().zip(&rows) {
        for j in 0..3 {
            for l in 0..3 {
                for n in 0..3 {
                    out[3 * j + n] += rotation[(j, l)] * row[3 * l + n];
                }
            }
        }
    }
    result
}

/// The secant of isotropic laws, cheaper by a closed form: shear point by point, bulk on the mean.
fn isotropic_secant<const N: usize>(
    block: &Block<N>,
    points: &[Local<N>],
    means: &Means,
    size: usize,
    out: &mut [f64],
) {
    let mut mean = vec![0.0; size];
    let mut bulk_by_volume = 0.0;
    for point in points {
        let Law::Isotropic(law) = point.law else { continue };
        let gradients = &block.points[point.q].gradients;
        let [shear, bulk] = law.moduli(&invariants(&means.shown(&point.stretch, Volumetric::Trace)));
        add_shear(point, gradients, shear * point.weight, size, out);
        bulk_by_volume += bulk * point.weight;
        add_nodal(
            point,
            gradients,
            &Mat3::identity(),
            point.weight / means.volume,
            &mut mean,
        );
    }
    for (i, row) in out.chunks_exact_mut(size).enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            *entry += bulk_by_volume * mean[i] * mean[j];
        }
    }
}

/// Adds 2μ w dev sym(RᵀδF) : dev sym(RᵀδF), which for an isotropic law is all but the bulk part:
/// `K_ab = μ w ((∇N_a·∇N_b) I + r_b r_aᵀ − ⅔ r_a r_bᵀ)` with r = R ∇N.
fn add_shear<const N: usize>(
    point: &Local<N>,
    gradients: &[Vec3; N],
    factor: f64,
    size: usize,
    out: &mut [f64],
) {
    let turned = gradients.map(|g| point.rotation * g);
    for (ra, &a) in turned.iter().zip(&point.places) {
        let ra = ra * factor;
        for (rb, &b) in turned.iter().zip(&point.places) {
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
