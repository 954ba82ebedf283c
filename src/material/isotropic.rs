//! Isotropic strain-dependent elasticity.
//!
//! ```text
//! T = 2μ(q) dev ε + K(q) tr ε I,      (ln μ, ln K)(q) = c + Σ_i w_i |q − q_i|,   Σ_i w_i = 0
//!
//! q = ( tr ε / √3,  |dev ε|,  |dev ε| cos 3θ ),      cos 3θ = 3√6 det(dev ε) / |dev ε|³
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | μ, K | secant shear and bulk modulus | MPa |
//! | q | strain invariants, all of degree one in strain | – |
//! | θ | Lode angle: cos 3θ = 1 in uniaxial tension, −1 in uniaxial compression, 0 in pure shear | – |
//! | w, c | weights, one pair per centre, and constants | ln MPa |
//!
//! The first two invariants are the norms of the volumetric and the deviatoric part, so |ε|² = q₁² + q₂². The third
//! tells compression from tension. A cube root of det(dev ε) would do the same and is of the same degree, but its
//! gradient is infinite at every pure shear; det over the squared norm has a gradient of at most 3 everywhere.
//! At rest, |dev ε| is smoothed by [`SMOOTHING_STRAIN`] (and its square in the third invariant by that squared), so
//! the tangent is continuous there.
//!
//! Being a function of invariants the law stays isotropic whatever direction the coupon was pressed in, which fixed
//! tensors as centres do not grant; being interpolated in logarithms, μ and K are positive at every strain. Source:
//! the strain-space interpolation of Bickel 2010, section 7.2.2, with these changes.

use super::law::{LawError, Range, SMOOTHING_STRAIN, expect_count, smooth_norm};
use crate::math::mandel::{Mandel, Mandel6, deviator, trace};
use crate::math::rbf::{Cardinal, ConstantTerm, LinearRbf};
use std::f64::consts::SQRT_2;

/// 1/√3.
pub(super) const INV_SQRT_3: f64 = 0.577_350_269_189_625_8;
/// 3√6, which makes the third invariant |dev ε| cos 3θ.
pub(super) const THREE_SQRT_6: f64 = 7.348_469_228_349_534;

/// An isotropic material with strain-dependent moduli.
#[derive(Clone, Debug, PartialEq)]
pub struct IsotropicRbf {
    log_moduli: LinearRbf<3, 2>,
    /// None without centres.
    cardinal: Option<Cardinal>,
    range: Range<3>,
}

impl IsotropicRbf {
    /// Constant Young's modulus \[MPa\] and Poisson's ratio, without limits of strain.
    ///
    /// # Errors
    /// If the modulus is not positive or the ratio lies outside (−1, 0.5).
    pub fn linear(young_mpa: f64, poisson: f64) -> Result<Self, LawError> {
        let (shear, bulk) = shear_and_bulk(young_mpa, poisson)?;
        Ok(IsotropicRbf {
            log_moduli: LinearRbf::constant([shear.ln(), bulk.ln()]),
            cardinal: None,
            range: Range::UNBOUNDED,
        })
    }

    /// The material with `moduli[i]` = (μ, K) \[MPa\] at the invariants `centres[i]`.
    ///
    /// # Errors
    /// If a modulus is not positive, or two centres are one point.
    pub fn interpolating(
        centres: &[[f64; 3]],
        moduli: &[[f64; 2]],
        range: Range<3>,
    ) -> Result<Self, LawError> {
        for &[shear, bulk] in moduli {
            positive("shear modulus", shear)?;
            positive("bulk modulus", bulk)?;
        }
        let logarithms: Vec<[f64; 2]> = moduli.iter().map(|m| [m[0].ln(), m[1].ln()]).collect();
        let log_moduli = LinearRbf::interpolating(centres, &logarithms)?;
        Ok(IsotropicRbf {
            cardinal: cardinal_of(&log_moduli)?,
            log_moduli,
            range,
        })
    }

    /// The material with these weights, as a record stores them.
    ///
    /// # Errors
    /// If the counts differ, a number is not finite, or the weights do not sum to zero.
    pub fn from_weights(log_moduli: LinearRbf<3, 2>, range: Range<3>) -> Result<Self, LawError> {
        check_weights(&log_moduli.centres, &log_moduli.weights, &log_moduli.constant)?;
        Ok(IsotropicRbf {
            cardinal: cardinal_of(&log_moduli)?,
            log_moduli,
            range,
        })
    }

    /// Centres, weights and constants of (ln μ, ln K).
    pub fn log_moduli(&self) -> &LinearRbf<3, 2> {
        &self.log_moduli
    }

    /// The fitted range of the invariants.
    pub fn range(&self) -> &Range<3> {
        &self.range
    }

    /// Secant moduli (μ, K) \[MPa\] at the invariants `q`, held to the fitted range.
    #[inline]
    pub fn moduli(&self, q: &[f64; 3]) -> [f64; 2] {
        let [shear, bulk] = self.log_moduli.value(&self.range.nearest(q));
        [shear.exp(), bulk.exp()]
    }

    /// See [`super::law::Law::stress`].
    #[inline]
    pub fn stress(&self, strain: &Mandel) -> Mandel {
        let dev = deviator(strain);
        let [shear, bulk] = self.moduli(&invariants_of(trace(strain), &dev));
        scaled_stress(shear, bulk, strain, &dev)
    }

    /// See [`super::law::Law::stress_and_secant`].
    #[inline]
    pub fn stress_and_secant(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        let dev = deviator(strain);
        let [shear, bulk] = self.moduli(&invariants_of(trace(strain), &dev));
        (scaled_stress(shear, bulk, strain, &dev), stiffness(shear, bulk))
    }

    /// See [`super::law::Law::stress_and_tangent`].
    ///
    /// dT/dε = E + 2μ dev ε ⊗ ∂ln μ/∂ε + K tr ε I ⊗ ∂ln K/∂ε.
    #[inline]
    pub fn stress_and_tangent(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        let dev = deviator(strain);
        let q = invariants_of(trace(strain), &dev);
        let (logs, mut slopes) = self.log_moduli.value_and_gradient(&self.range.nearest(&q));
        self.range.hold(&q, &mut slopes);
        let (shear, bulk) = (logs[0].exp(), logs[1].exp());
        let stress = scaled_stress(shear, bulk, strain, &dev);
        let mut tangent = stiffness(shear, bulk);
        if !self.log_moduli.centres.is_empty() {
            let [by_trace, by_norm, by_lode] = invariant_gradients(&dev);
            let of_shear = by_trace * slopes[0][0] + by_norm * slopes[0][1] + by_lode * slopes[0][2];
            let of_bulk = by_trace * slopes[1][0] + by_norm * slopes[1][1] + by_lode * slopes[1][2];
            let pressure = bulk * trace(strain);
            for j in 0..6 {
                for i in 0..6 {
                    tangent[(i, j)] += 2.0 * shear * dev[i] * of_shear[j];
                }
                for i in 0..3 {
                    tangent[(i, j)] += pressure * of_bulk[j];
                }
            }
        }
        (stress, tangent)
    }

    /// See [`super::law::Law::young_modulus`].
    pub fn young_modulus(&self, strain: &Mandel) -> f64 {
        let [shear, bulk] = self.moduli(&invariants(strain));
        young(shear, bulk)
    }

    /// See [`super::law::Law::in_range`].
    #[inline]
    pub fn in_range(&self, strain: &Mandel) -> bool {
        self.range.contains(&invariants(strain))
    }

    /// See [`super::law::Law::poisson_ratio_at_rest`].
    pub fn poisson_ratio_at_rest(&self) -> f64 {
        let [shear, bulk] = self.moduli(&[0.0; 3]);
        poisson(shear, bulk)
    }

    /// See [`super::law::Law::energy`]: ½ T·ε where the moduli do not depend on strain.
    pub fn energy(&self, strain: &Mandel) -> Option<f64> {
        let constant = self.log_moduli.weights.iter().flatten().all(|w| *w == 0.0);
        constant.then(|| 0.5 * self.stress(strain).dot(strain))
    }

    /// (ln μ, ln K) at the centres, `(n × 2)`; the constants if there are no centres.
    pub fn values(&self) -> Vec<[f64; 2]> {
        if self.log_moduli.centres.is_empty() {
            return vec![self.log_moduli.constant];
        }
        let at = |q| self.log_moduli.value(q);
        self.log_moduli.centres.iter().map(at).collect()
    }

    /// The same centres with other values of (ln μ, ln K), two numbers a centre.
    ///
    /// # Errors
    /// A wrong count, or a number that is no logarithm of a modulus.
    pub fn with_values(&self, values: &[f64]) -> Result<Self, LawError> {
        expect_count(self.values().len() * 2, values.len())?;
        expect_logarithms(values)?;
        let rows: Vec<[f64; 2]> = values.chunks_exact(2).map(|v| [v[0], v[1]]).collect();
        let mut law = self.clone();
        if self.log_moduli.centres.is_empty() {
            law.log_moduli.constant = rows[0];
        } else {
            law.log_moduli = LinearRbf::interpolating(&self.log_moduli.centres, &rows)?;
        }
        Ok(law)
    }

    /// ∂T/∂(ln μ_j), ∂T/∂(ln K_j) at fixed strain for each centre j, `(2n)`: the cardinal functions times
    /// 2μ dev ε and K tr ε I.
    pub fn stress_by_values(&self, strain: &Mandel) -> Vec<Mandel> {
        let dev = deviator(strain);
        let q = self.range.nearest(&invariants_of(trace(strain), &dev));
        let [shear, bulk] = self.log_moduli.value(&q).map(f64::exp);
        let by_shear = dev * (2.0 * shear);
        let by_bulk = Mandel::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0) * (bulk * trace(strain));
        let shares = match &self.cardinal {
            Some(cardinal) => cardinal.values(&self.log_moduli.distances(&q)),
            None => vec![1.0],
        };
        shares
            .iter()
            .flat_map(|l| [by_shear * *l, by_bulk * *l])
            .collect()
    }

    /// The same moduli at other centres, three invariants a centre.
    ///
    /// # Errors
    /// A wrong count, or two centres at one point.
    pub fn with_centres(&self, centres: &[f64]) -> Result<Self, LawError> {
        expect_count(self.log_moduli.centres.len() * 3, centres.len())?;
        if centres.is_empty() {
            return Ok(self.clone());
        }
        let rows: Vec<[f64; 3]> = centres.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let log_moduli = LinearRbf::interpolating(&rows, &self.values())?;
        IsotropicRbf::from_weights(log_moduli, self.range)
    }

    /// ∂T/∂(invariant of a centre) at fixed strain and fixed moduli at the centres, in the order of
    /// [`IsotropicRbf::with_centres`] \[MPa\].
    pub fn stress_by_centres(&self, strain: &Mandel) -> Vec<Mandel> {
        let Some(cardinal) = &self.cardinal else {
            return Vec::new();
        };
        let dev = deviator(strain);
        let q = self.range.nearest(&invariants_of(trace(strain), &dev));
        let [shear, bulk] = self.log_moduli.value(&q).map(f64::exp);
        let by_shear = dev * (2.0 * shear);
        let by_bulk = Mandel::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0) * (bulk * trace(strain));
        let slopes = self.log_moduli.value_by_centres(&q, cardinal);
        slopes
            .iter()
            .flat_map(|[of_shear, of_bulk]| {
                std::array::from_fn::<Mandel, 3, _>(|d| by_shear * of_shear[d] + by_bulk * of_bulk[d])
            })
            .collect()
    }
}

/// Whether all numbers are logarithms of moduli.
pub(super) fn expect_logarithms(values: &[f64]) -> Result<(), LawError> {
    match values.iter().find(|v| !v.exp().is_normal()) {
        None => Ok(()),
        Some(value) => Err(LawError::Coefficient {
            field: "ln modulus".into(),
            value: *value,
            expected: "the logarithm of a positive modulus",
        }),
    }
}

/// The invariants q of a strain, `(3)`.
#[inline]
pub fn invariants(strain: &Mandel) -> [f64; 3] {
    invariants_of(trace(strain), &deviator(strain))
}

/// Young's modulus \[MPa\] from shear and bulk modulus.
pub fn young(shear: f64, bulk: f64) -> f64 {
    9.0 * bulk * shear / (3.0 * bulk + shear)
}

/// Poisson's ratio from shear and bulk modulus.
pub fn poisson(shear: f64, bulk: f64) -> f64 {
    (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))
}

/// Shear and bulk modulus \[MPa\] from Young's modulus \[MPa\] and Poisson's ratio.
///
/// # Errors
/// If the modulus is not positive or the ratio lies outside (−1, 0.5).
pub fn shear_and_bulk(young_mpa: f64, poisson: f64) -> Result<(f64, f64), LawError> {
    positive("Young's modulus", young_mpa)?;
    if !(poisson > -1.0 && poisson < 0.5) {
        return Err(LawError::Poisson(poisson));
    }
    Ok((
        young_mpa / (2.0 * (1.0 + poisson)),
        young_mpa / (3.0 * (1.0 - 2.0 * poisson)),
    ))
}

pub(super) fn positive(name: &'static str, value: f64) -> Result<(), LawError> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(LawError::Modulus { name, value })
    }
}

pub(super) fn check_weights<const D: usize, const V: usize>(
    centres: &[[f64; D]],
    weights: &[[f64; V]],
    constant: &[f64; V],
) -> Result<(), LawError> {
    if centres.len() != weights.len() {
        let (n, m) = (centres.len(), weights.len());
        return Err(LawError::Weights(format!("{m} rows of weights for {n} centres")));
    }
    let mut numbers = centres
        .iter()
        .flatten()
        .chain(weights.iter().flatten())
        .chain(constant);
    if !numbers.all(|x| x.is_finite()) {
        return Err(LawError::Weights(
            "a centre, weight or constant is not finite".into(),
        ));
    }
    for k in 0..V {
        let sum: f64 = weights.iter().map(|w| w[k]).sum();
        let size: f64 = weights.iter().map(|w| w[k].abs()).sum();
        if sum.abs() > 1e-6 * size.max(1e-3) {
            return Err(LawError::Weights(format!(
                "column {} sums to {sum:e} instead of 0",
                k + 1
            )));
        }
    }
    Ok(())
}

/// The cardinal functions of the linear kernel; none without centres.
pub(super) fn cardinal_of<const D: usize, const V: usize>(
    rbf: &LinearRbf<D, V>,
) -> Result<Option<Cardinal>, LawError> {
    if rbf.centres.is_empty() {
        return Ok(None);
    }
    Ok(Some(Cardinal::new(&rbf.centres, |r| r, ConstantTerm::With)?))
}

#[inline]
fn scaled_stress(shear: f64, bulk: f64, strain: &Mandel, dev: &Mandel) -> Mandel {
    let pressure = bulk * trace(strain);
    let mut stress = dev * (2.0 * shear);
    for i in 0..3 {
        stress[i] += pressure;
    }
    stress
}

#[inline]
fn stiffness(shear: f64, bulk: f64) -> Mandel6 {
    let lame_lambda = bulk - 2.0 / 3.0 * shear;
    let mut e = Mandel6::zeros();
    for i in 0..6 {
        e[(i, i)] = 2.0 * shear;
    }
    for i in 0..3 {
        for j in 0..3 {
            e[(i, j)] += lame_lambda;
        }
    }
    e
}

#[inline]
fn invariants_of(trace: f64, dev: &Mandel) -> [f64; 3] {
    let squared = dev.norm_squared();
    let (norm, _) = smooth_norm(squared);
    let lode = THREE_SQRT_6 * determinant(dev) / (squared + SMOOTHING_STRAIN * SMOOTHING_STRAIN);
    [trace * INV_SQRT_3, norm, lode]
}

/// ∂q_k/∂ε, three 6-vectors.
#[inline]
fn invariant_gradients(dev: &Mandel) -> [Mandel; 3] {
    let squared = dev.norm_squared();
    let (_, inverse_norm) = smooth_norm(squared);
    let inverse = 1.0 / (squared + SMOOTHING_STRAIN * SMOOTHING_STRAIN);
    let det = determinant(dev);
    let by_trace = Mandel::new(INV_SQRT_3, INV_SQRT_3, INV_SQRT_3, 0.0, 0.0, 0.0);
    // dev of the cofactor: ∂det(dev ε)/∂ε.
    let by_det = deviator(&cofactor(dev));
    let by_lode = (by_det - dev * (2.0 * det * inverse)) * (THREE_SQRT_6 * inverse);
    [by_trace, dev * inverse_norm, by_lode]
}

/// det A of the symmetric tensor with 6-vector `a`.
#[inline]
fn determinant(a: &Mandel) -> f64 {
    a[0] * a[1] * a[2] + a[3] * a[4] * a[5] / SQRT_2
        - 0.5 * (a[0] * a[3] * a[3] + a[1] * a[4] * a[4] + a[2] * a[5] * a[5])
}

/// The cofactor of a symmetric tensor, ∂det A/∂A, in Mandel notation.
#[inline]
fn cofactor(a: &Mandel) -> Mandel {
    Mandel::new(
        a[1] * a[2] - 0.5 * a[3] * a[3],
        a[0] * a[2] - 0.5 * a[4] * a[4],
        a[0] * a[1] - 0.5 * a[5] * a[5],
        a[4] * a[5] / SQRT_2 - a[0] * a[3],
        a[3] * a[5] / SQRT_2 - a[1] * a[4],
        a[3] * a[4] / SQRT_2 - a[2] * a[5],
    )
}
