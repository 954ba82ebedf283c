//! What eight points answer to their deformation gradients: the kernel of [`super::forces`], whose equations it follows.
//!
//! Three ways, the same in result: in lanes for one strain-space law and for one law in the invariants of F, point by point for
//! all others and for batches of several materials.

// Index loops say here which numbers lie side by side.
#![allow(clippy::needless_range_loop)]

use super::elements::{BATCH, VolumetricStrain};
use crate::material::isotropic::IsotropicRbf;
use crate::material::law::{Law, Volumetric};
use crate::material::neo_hookean::Volumetry;
use crate::math::mandel::{self, Mandel};
use crate::math::polar::cofactor;
use crate::math::polar_lanes::{Lanes, Matrices, ZERO, cofactors, extract, rotations};
use crate::math::roots::inverse_cube_root;
use crate::math::{Mat3, Vec3};

/// The laws at a batch's points.
#[derive(Clone, Copy, Debug)]
pub(super) enum Laws<'a> {
    /// One for all.
    Same(&'a Law),
    /// One each.
    Mixed([&'a Law; BATCH]),
}

impl<'a> Laws<'a> {
    /// The law at lane `l`.
    #[inline]
    pub fn at(&self, l: usize) -> &'a Law {
        match self {
            Laws::Same(law) => law,
            Laws::Mixed(laws) => laws[l],
        }
    }
}

/// Rotation, strain and stress at one point.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    /// R.
    pub rotation: Mat3,
    /// U.
    pub stretch: Mat3,
    /// The strain that the law is shown, Mandel notation.
    pub strain: Mandel,
    /// T' + \[v\]×.
    pub stress: Mat3,
}

impl State {
    pub const NONE: State = State {
        rotation: Mat3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        stretch: Mat3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        strain: Mandel::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        stress: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// P = R (T' + \[v\]×).
    pub fn piola(&self) -> Mat3 {
        self.rotation * self.stress
    }
}

/// Averages over a cluster: its volume, mean tr ε and mean J.
#[derive(Clone, Copy, Debug)]
pub(super) struct Means {
    /// Σ w.
    pub volume: f64,
    /// Mean of tr ε.
    pub trace: f64,
    /// Mean of det U.
    pub jacobian: f64,
}

impl Means {
    /// The averages over points with volumes `weights` and right stretches `stretches`.
    pub fn over<'a>(
        weights: impl Iterator<Item = &'a f64>,
        stretches: impl Iterator<Item = &'a Mat3>,
    ) -> Means {
        let mut means = Means {
            volume: 0.0,
            trace: 0.0,
            jacobian: 0.0,
        };
        for (w, u) in weights.zip(stretches) {
            means.volume += w;
            means.trace += w * (u.trace() - 3.0);
            means.jacobian += w * u.determinant();
        }
        if means.volume > 0.0 {
            means.trace /= means.volume;
            means.jacobian /= means.volume;
        }
        means
    }

    /// The strain that a law is shown at a point with right stretch `u`, Mandel notation.
    #[inline]
    pub fn shown(&self, u: &Mat3, measure: Volumetric) -> Mandel {
        let mut strain = strain_of(u);
        match measure {
            Volumetric::Trace => {
                let shift = (self.trace - mandel::trace(&strain)) / 3.0;
                (0..3).for_each(|c| strain[c] += shift);
                strain
            }
            Volumetric::Jacobian => strain_of(&(u * self.scale(u))),
        }
    }

    /// s = (J̄/J)^⅓; not a number for an inverted point, which no hyperelastic law can answer.
    #[inline]
    pub fn scale(&self, u: &Mat3) -> f64 {
        (self.jacobian / u.determinant()).powf(1.0 / 3.0)
    }
}

/// U − I, Mandel notation.
#[inline]
pub(super) fn strain_of(u: &Mat3) -> Mandel {
    let mut strain = mandel::from_tensor(u);
    (0..3).for_each(|c| strain[c] -= 1.0);
    strain
}

/// w P in the lanes of a batch with deformation gradients `f` and volumes `weight`.
#[inline(always)]
pub(super) fn weighted_piola(
    f: &Matrices,
    weight: &Lanes,
    laws: &Laws,
    volumetric: VolumetricStrain,
) -> Matrices {
    match laws {
        Laws::Same(Law::Isotropic(law)) => return isotropic(f, weight, law, volumetric),
        Laws::Same(Law::Hyperelastic(law)) => {
            if let Some((form, shear, second)) = law.neo_hookean() {
                return neo_hookean(f, weight, form, [shear, second], volumetric);
            }
        }
        _ => {}
    }
    let states = states(f, weight, laws, volumetric);
    let mut piola = [[ZERO; 3]; 3];
    for (l, state) in states.iter().enumerate() {
        let p = state.piola() * weight[l];
        for i in 0..3 {
            for j in 0..3 {
                piola[i][j][l] = p[(i, j)];
            }
        }
    }
    piola
}

/// One isotropic strain-space law in all lanes.
#[inline(always)]
fn isotropic(f: &Matrices, weight: &Lanes, law: &IsotropicRbf, volumetric: VolumetricStrain) -> Matrices {
    let r = rotations(f);
    let u = stretches(&r, f);
    let mut trace = ZERO;
    for l in 0..BATCH {
        trace[l] = u[0][0][l] + u[1][1][l] + u[2][2][l] - 3.0;
    }
    let mean = mean(weight, &trace);
    let mut shown = trace;
    if volumetric == VolumetricStrain::Shared {
        shown = [mean; BATCH];
    }
    // dev ε, the upper triangle.
    let mut dev = u;
    for i in 0..3 {
        for l in 0..BATCH {
            dev[i][i][l] -= 1.0 + trace[l] / 3.0;
        }
    }
    let [shear, bulk] = law.moduli_in_lanes(&shown, &dev);
    let mut pressure = ZERO;
    for l in 0..BATCH {
        pressure[l] = bulk[l] * shown[l];
    }
    if volumetric == VolumetricStrain::Shared {
        pressure = [self::mean(weight, &pressure); BATCH];
    }
    let mut stress = [[ZERO; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            for l in 0..BATCH {
                stress[i][j][l] = 2.0 * shear[l] * dev[i][j][l] * weight[l];
            }
        }
        for l in 0..BATCH {
            stress[i][i][l] += pressure[l] * weight[l];
        }
    }
    product(&r, &stress)
}

/// One neo-Hookean law in all lanes, which needs no rotation: P = a F + b F⁻ᵀ.
#[inline(always)]
fn neo_hookean(
    f: &Matrices,
    weight: &Lanes,
    form: Volumetry,
    moduli: [f64; 2],
    volumetric: VolumetricStrain,
) -> Matrices {
    let cofactors = cofactors(f);
    let (mut jacobian, mut first) = (ZERO, ZERO);
    for i in 0..3 {
        for l in 0..BATCH {
            jacobian[l] += f[0][i][l] * cofactors[0][i][l];
            for row in f {
                first[l] += row[i][l] * row[i][l];
            }
        }
    }
    let is_shared = volumetric == VolumetricStrain::Shared;
    // The J that the law is shown, and the square of s = (ḡ/J)^⅓ by which it is shown F.
    let (mut shown, mut square) = (jacobian, [1.0; BATCH]);
    if is_shared {
        let mean = mean(weight, &jacobian);
        let root = inverse_cube_root(&jacobian);
        let own = inverse_cube_root(&[mean; BATCH]);
        for l in 0..BATCH {
            square[l] = root[l] * root[l] / (own[l] * own[l]);
        }
        shown = [mean; BATCH];
    }
    let (mut a, mut b) = neo_hookean_factors(form, moduli, &shown, &first, &square);
    if is_shared {
        let mut pressure = ZERO;
        for l in 0..BATCH {
            let kirchhoff = (a[l] * square[l] * first[l] + 3.0 * b[l]) / 3.0;
            b[l] -= kirchhoff;
            pressure[l] = kirchhoff / shown[l];
        }
        let mean = mean(weight, &pressure);
        for l in 0..BATCH {
            a[l] *= square[l];
            b[l] += mean * jacobian[l];
        }
    }
    let mut piola = [[ZERO; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            for l in 0..BATCH {
                // Beyond inversion the energy is not defined.
                let b = if jacobian[l] > 0.0 {
                    b[l] / jacobian[l]
                } else {
                    f64::NAN
                };
                piola[i][j][l] = (a[l] * f[i][j][l] + b * cofactors[i][j][l]) * weight[l];
            }
        }
    }
    piola
}

/// a and b of P = a F + b F⁻ᵀ where the law is shown the volume ratio `shown` and the first invariant `first · square`.
#[inline(always)]
fn neo_hookean_factors(
    form: Volumetry,
    moduli: [f64; 2],
    shown: &Lanes,
    first: &Lanes,
    square: &Lanes,
) -> (Lanes, Lanes) {
    let (mut a, mut b) = (ZERO, ZERO);
    match form {
        Volumetry::Logarithmic => {
            for l in 0..BATCH {
                a[l] = moduli[0];
                b[l] = moduli[1] * shown[l].ln() - moduli[0];
            }
        }
        Volumetry::Isochoric => {
            let root = inverse_cube_root(shown);
            for l in 0..BATCH {
                a[l] = moduli[0] * root[l] * root[l];
                b[l] = moduli[1] * shown[l] * (shown[l] - 1.0) - a[l] * first[l] * square[l] / 3.0;
            }
        }
    }
    (a, b)
}

/// Σ w a / Σ w, zero without volume.
#[inline(always)]
fn mean(weight: &Lanes, a: &Lanes) -> f64 {
    let (mut volume, mut sum) = (0.0, 0.0);
    for l in 0..BATCH {
        volume += weight[l];
        sum += weight[l] * a[l];
    }
    if volume > 0.0 { sum / volume } else { 0.0 }
}

/// The symmetric part of RᵀF.
#[inline(always)]
fn stretches(r: &Matrices, f: &Matrices) -> Matrices {
    let mut u = [[ZERO; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            for k in 0..3 {
                for l in 0..BATCH {
                    u[i][j][l] += r[k][i][l] * f[k][j][l];
                }
            }
        }
    }
    for i in 0..3 {
        for j in 0..i {
            for l in 0..BATCH {
                let mean = 0.5 * (u[i][j][l] + u[j][i][l]);
                u[i][j][l] = mean;
                u[j][i][l] = mean;
            }
        }
    }
    u
}

#[inline(always)]
fn product(a: &Matrices, b: &Matrices) -> Matrices {
    let mut c = [[ZERO; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            for k in 0..3 {
                for l in 0..BATCH {
                    c[i][j][l] += a[i][k][l] * b[k][j][l];
                }
            }
        }
    }
    c
}

/// Rotation, strain and stress in every lane; lanes without volume answer rest.
pub(super) fn states(
    f: &Matrices,
    weight: &Lanes,
    laws: &Laws,
    volumetric: VolumetricStrain,
) -> [State; BATCH] {
    let mut states = strained(f, weight, laws, volumetric);
    let stresses = std::array::from_fn(|l| match weight[l] > 0.0 {
        true => laws.at(l).stress(&states[l].strain),
        false => Mandel::zeros(),
    });
    put_stress(&mut states, weight, laws, volumetric, &stresses);
    states
}

/// Rotation, stretch and the strain that the law is shown, in every lane; stresses are not known yet.
pub(super) fn strained(
    f: &Matrices,
    weight: &Lanes,
    laws: &Laws,
    volumetric: VolumetricStrain,
) -> [State; BATCH] {
    let r = rotations(f);
    let u = stretches(&r, f);
    let mut states = [State::NONE; BATCH];
    for l in 0..BATCH {
        states[l].rotation = extract(&r, l);
        states[l].stretch = extract(&u, l);
    }
    let means = Means::over(weight.iter(), states.iter().map(|s| &s.stretch));
    for (l, state) in states.iter_mut().enumerate().filter(|(l, _)| weight[*l] > 0.0) {
        state.strain = match volumetric {
            VolumetricStrain::Shared => means.shown(&state.stretch, laws.at(l).volumetric()),
            VolumetricStrain::Pointwise => strain_of(&state.stretch),
        };
    }
    states
}

/// T' + \[v\]× where the laws answer `stresses`, `(8)`: linear in them.
pub(super) fn put_stress(
    states: &mut [State; BATCH],
    weight: &Lanes,
    laws: &Laws,
    volumetric: VolumetricStrain,
    stresses: &[Mandel; BATCH],
) {
    if volumetric == VolumetricStrain::Shared {
        share(states, weight, laws, stresses);
    } else {
        for (state, t) in states.iter_mut().zip(stresses) {
            state.stress = mandel::to_tensor(t);
        }
    }
    for (l, state) in states.iter_mut().enumerate() {
        if weight[l] > 0.0 && laws.at(l).turns_stress() {
            state.stress += rotation_stress(&state.stretch, &state.stress);
        }
    }
}

/// T' where the points share their volumetric strain.
fn share(states: &mut [State; BATCH], weight: &Lanes, laws: &Laws, stresses: &[Mandel; BATCH]) {
    let means = Means::over(weight.iter(), states.iter().map(|s| &s.stretch));
    if means.volume <= 0.0 {
        return;
    }
    // p̄ of the laws that bound the trace and of those that bound J.
    let mut pressure = [0.0; 2];
    for (l, state) in states.iter_mut().enumerate().filter(|(l, _)| weight[*l] > 0.0) {
        let t = mandel::to_tensor(&stresses[l]);
        match laws.at(l).volumetric() {
            Volumetric::Trace => {
                let p = t.trace() / 3.0;
                pressure[0] += weight[l] * p;
                state.stress = t - Mat3::from_diagonal_element(p);
            }
            Volumetric::Jacobian => {
                let s = means.scale(&state.stretch);
                let kirchhoff = s * t.component_mul(&state.stretch).sum() / 3.0;
                pressure[1] += weight[l] * kirchhoff / means.jacobian;
                let inverse = cofactor(&state.stretch) / state.stretch.determinant();
                state.stress = t * s - inverse * kirchhoff;
            }
        }
    }
    let [of_trace, of_jacobian] = pressure.map(|p| p / means.volume);
    for (_, state) in states.iter_mut().enumerate().filter(|(l, _)| weight[*l] > 0.0) {
        state.stress += Mat3::from_diagonal_element(of_trace);
        if of_jacobian != 0.0 {
            state.stress += cofactor(&state.stretch) * of_jacobian;
        }
    }
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
