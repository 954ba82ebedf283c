//! Isotropic strain-dependent elasticity that has an energy.
//!
//! ```text
//! W(ε) = μ(q̂) |dev ε|² + ½ K(q̂) (tr ε)²,     T = ∂W/∂ε
//! (ln μ, ln K)(q̂) = a + Σ_i w_i √(|q̂ − q_i|² + c²),   Σ_i w_i = 0,     q̂_k = hold(q_k)
//! q = ( tr ε / √3,  √(|dev ε|² + δ²) − δ,  3√6 det(dev ε) / (|dev ε|² + δ²) )
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | W | energy per undeformed volume | MPa |
//! | μ, K | moduli of the energy: those of `T = 2μ dev ε + K tr ε I` only where they don't change with strain | MPa |
//! | q, q̂ | the invariants of [`super::isotropic`], and what is left of them outside the fitted range | – |
//! | w, a, c | weights, constants, the kernel's offset | ln MPa, ln MPa, – |
//! | δ | [`SMOOTHING_STRAIN`] | – |
//!
//! The secant law of [`super::isotropic`] interpolates stiffness and has no energy: a closed path of strain makes or
//! swallows work. Here one energy is interpolated and stress is its exact derivative, with the terms
//! |dev ε|² ∂μ/∂ε + ½ (tr ε)² ∂K/∂ε; the tangent is symmetric. The kernel has no kink, so Newton's method keeps its
//! quadratic convergence across the centres.
//!
//! Beyond an end of the fitted range of extent r, an invariant goes on for r/2 while its slope falls smoothly to zero,
//! and stands r/4 beyond the end from there: with x = (q − end)/(r/2), `hold = end + r/2 (x − x³ + x⁴/2)`. The hold
//! is part of the energy and is differentiated with it. A sudden stop would have an energy too, but the stress would
//! jump by the lost terms. Valid in the fitted range; positive definite near rest, not necessarily everywhere. Source:
//! the strain-space interpolation of Bickel 2010, section 7.2.3, put into an energy.

use super::isotropic::{
    check_weights, expect_logarithms, invariants, poisson, positive, shear_and_bulk, young,
};
use super::law::{LawError, Range, SMOOTHING_STRAIN, expect_count};
use super::principal::{Axes, Principal};
use crate::math::mandel::{Mandel, Mandel6, deviator, trace};
use crate::math::multiquadric::{Multiquadric, mean_spacing};
use crate::math::rbf::Cardinal;

/// 1/√3.
const INV_SQRT_3: f64 = 0.577_350_269_189_625_8;
/// 3√6.
const THREE_SQRT_6: f64 = 7.348_469_228_349_534;
/// The secant's eigenvalues are raised to this share of the shear stiffness 2μ at rest.
const LEAST_STIFFNESS: f64 = 0.01;

/// An isotropic material with strain-dependent moduli and an energy.
#[derive(Clone, Debug, PartialEq)]
pub struct EnergyRbf {
    log_moduli: Multiquadric<3, 2>,
    /// None without centres.
    cardinal: Option<Cardinal>,
    range: Range<3>,
}

/// q, ∂q_k/∂e_i and ∂²q_k/∂e_i∂e_j over the principal strains e.
struct Invariants {
    value: [f64; 3],
    slope: [[f64; 3]; 3],
    bend: [[[f64; 3]; 3]; 3],
}

/// A modulus and its derivatives over the principal strains.
struct Modulus {
    value: f64,
    slope: [f64; 3],
    bend: [[f64; 3]; 3],
}

impl EnergyRbf {
    /// Constant Young's modulus \[MPa\] and Poisson's ratio: Hooke's law in Biot strain.
    ///
    /// # Errors
    /// If the modulus is not positive or the ratio lies outside (−1, 0.5).
    pub fn linear(young_mpa: f64, poisson: f64) -> Result<Self, LawError> {
        let (shear, bulk) = shear_and_bulk(young_mpa, poisson)?;
        Ok(EnergyRbf {
            log_moduli: Multiquadric::constant([shear.ln(), bulk.ln()]),
            cardinal: None,
            range: Range::UNBOUNDED,
        })
    }

    /// The offset that [`EnergyRbf::interpolating`] takes if none is given: half the mean distance of neighbouring
    /// centres.
    pub fn default_offset(centres: &[[f64; 3]]) -> f64 {
        0.5 * mean_spacing(centres)
    }

    /// The material whose energy has the moduli `moduli[i]` = (μ, K) \[MPa\] at the invariants `centres[i]`; `offset` is
    /// the kernel's c, in strain.
    ///
    /// # Errors
    /// If a modulus is not positive, two centres are one point, or the offset is negative.
    pub fn interpolating(
        centres: &[[f64; 3]],
        moduli: &[[f64; 2]],
        offset: f64,
        range: Range<3>,
    ) -> Result<Self, LawError> {
        for &[shear, bulk] in moduli {
            positive("shear modulus", shear)?;
            positive("bulk modulus", bulk)?;
        }
        let logarithms: Vec<[f64; 2]> = moduli.iter().map(|m| [m[0].ln(), m[1].ln()]).collect();
        let (log_moduli, cardinal) = Multiquadric::interpolating(centres, &logarithms, offset)?;
        Ok(EnergyRbf {
            log_moduli,
            cardinal: Some(cardinal),
            range,
        })
    }

    /// The material with these weights, as a record stores them.
    ///
    /// # Errors
    /// If the counts differ, a number is not finite, or the weights do not sum to zero.
    pub fn from_weights(log_moduli: Multiquadric<3, 2>, range: Range<3>) -> Result<Self, LawError> {
        check_weights(&log_moduli.centres, &log_moduli.weights, &log_moduli.constant)?;
        let cardinal = if log_moduli.centres.is_empty() {
            None
        } else {
            let values = vec![[0.0; 1]; log_moduli.centres.len()];
            Some(Multiquadric::interpolating(&log_moduli.centres, &values, log_moduli.offset)?.1)
        };
        Ok(EnergyRbf {
            log_moduli,
            cardinal,
            range,
        })
    }

    /// Centres, weights, constants and offset of (ln μ, ln K).
    pub fn log_moduli(&self) -> &Multiquadric<3, 2> {
        &self.log_moduli
    }

    /// The fitted range of the invariants.
    pub fn range(&self) -> &Range<3> {
        &self.range
    }

    /// The energy's moduli (μ, K) \[MPa\] at the invariants `q`, held outside the fitted range.
    pub fn moduli(&self, q: &[f64; 3]) -> [f64; 2] {
        self.log_moduli.value(&self.held(q).map(|h| h[0])).map(f64::exp)
    }

    /// See [`super::law::Law::energy`].
    pub fn energy(&self, strain: &Mandel) -> f64 {
        let [shear, bulk] = self.moduli(&invariants(strain));
        let sum = trace(strain);
        shear * deviator(strain).norm_squared() + 0.5 * bulk * sum * sum
    }

    /// See [`super::law::Law::stress`].
    pub fn stress(&self, strain: &Mandel) -> Mandel {
        let axes = Axes::of(strain);
        axes.tensor(&self.principal(&axes.strains).stress)
    }

    /// See [`super::law::Law::stress_and_tangent`]; the tangent is symmetric.
    pub fn stress_and_tangent(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        let axes = Axes::of(strain);
        let at = self.principal(&axes.strains);
        (axes.tensor(&at.stress), axes.tangent(&at))
    }

    /// See [`super::law::Law::stress_and_secant`]: the tangent with its eigenvalues raised to a hundredth of 2μ at rest.
    pub fn stress_and_secant(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        let axes = Axes::of(strain);
        let at = self.principal(&axes.strains);
        let [shear, _] = self.moduli(&[0.0; 3]);
        let floor = LEAST_STIFFNESS * 2.0 * shear;
        (axes.tensor(&at.stress), axes.definite_tangent(&at, floor))
    }

    /// See [`super::law::Law::young_modulus`]: of the energy's moduli.
    pub fn young_modulus(&self, strain: &Mandel) -> f64 {
        let [shear, bulk] = self.moduli(&invariants(strain));
        young(shear, bulk)
    }

    /// See [`super::law::Law::in_range`].
    pub fn in_range(&self, strain: &Mandel) -> bool {
        self.range.contains(&invariants(strain))
    }

    /// See [`super::law::Law::poisson_ratio_at_rest`].
    pub fn poisson_ratio_at_rest(&self) -> f64 {
        let [shear, bulk] = self.moduli(&[0.0; 3]);
        poisson(shear, bulk)
    }

    /// (ln μ, ln K) at the centres, `(n × 2)`; of the constants if there are no centres.
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
    /// A wrong count or a number that is not finite.
    pub fn with_values(&self, values: &[f64]) -> Result<Self, LawError> {
        expect_count(self.values().len() * 2, values.len())?;
        expect_logarithms(values)?;
        let rows: Vec<[f64; 2]> = values.chunks_exact(2).map(|v| [v[0], v[1]]).collect();
        let mut law = self.clone();
        match &self.cardinal {
            Some(cardinal) => (law.log_moduli.weights, law.log_moduli.constant) = cardinal.weights(&rows),
            None => law.log_moduli.constant = rows[0],
        }
        Ok(law)
    }

    /// ∂T/∂(ln μ_j), ∂T/∂(ln K_j) at fixed strain for each centre j, `(2n)`.
    ///
    /// With the cardinal function ℓ_j: ∂W/∂ln μ_j = μ |dev ε|² ℓ_j, and stress is the derivative of that over strain.
    pub fn stress_by_values(&self, strain: &Mandel) -> Vec<Mandel> {
        let axes = Axes::of(strain);
        let e = axes.strains;
        let q = Invariants::at(&e);
        let held = self.held(&q.value);
        let here = held.map(|h| h[0]);
        let [shear, bulk] = self.moduli_over_strain(&q, &held);
        let (shares, slopes) = match &self.cardinal {
            Some(cardinal) => (
                cardinal.values(&self.log_moduli.kernels(&here)),
                cardinal.gradients(&self.log_moduli.kernel_gradients(&here)),
            ),
            None => (vec![1.0], vec![[0.0; 3]]),
        };
        let sum = e[0] + e[1] + e[2];
        let dev = e.map(|e| e - sum / 3.0);
        let squared = dev[0] * dev[0] + dev[1] * dev[1] + dev[2] * dev[2];
        let mut list = Vec::with_capacity(2 * shares.len());
        for (share, slope) in shares.iter().zip(&slopes) {
            let share_slope: [f64; 3] =
                std::array::from_fn(|i| (0..3).map(|k| slope[k] * held[k][1] * q.slope[k][i]).sum());
            list.push(axes.tensor(&std::array::from_fn(|i| {
                2.0 * shear.value * dev[i] * share
                    + squared * (shear.slope[i] * share + shear.value * share_slope[i])
            })));
            list.push(axes.tensor(&std::array::from_fn(|i| {
                bulk.value * sum * share
                    + 0.5 * sum * sum * (bulk.slope[i] * share + bulk.value * share_slope[i])
            })));
        }
        list
    }

    /// The hold of each invariant with its first two derivatives.
    fn held(&self, q: &[f64; 3]) -> [[f64; 3]; 3] {
        std::array::from_fn(|k| hold(q[k], self.range.low()[k], self.range.high()[k]))
    }

    /// μ and K over the principal strains.
    fn moduli_over_strain(&self, q: &Invariants, held: &[[f64; 3]; 3]) -> [Modulus; 2] {
        let jet = self.log_moduli.jet(&held.map(|h| h[0]));
        // ∂q̂_k/∂e_i.
        let slope: [[f64; 3]; 3] = std::array::from_fn(|k| q.slope[k].map(|s| held[k][1] * s));
        [0, 1].map(|v| {
            let value = jet.value[v].exp();
            let first: [f64; 3] =
                std::array::from_fn(|i| (0..3).map(|k| jet.gradient[v][k] * slope[k][i]).sum());
            let mut bend = [[0.0; 3]; 3];
            for i in 0..3 {
                for j in 0..3 {
                    let mut second = first[i] * first[j];
                    for k in 0..3 {
                        second += jet.gradient[v][k]
                            * (held[k][2] * q.slope[k][i] * q.slope[k][j] + held[k][1] * q.bend[k][i][j]);
                        for l in 0..3 {
                            second += jet.hessian[v][k][l] * slope[k][i] * slope[l][j];
                        }
                    }
                    bend[i][j] = value * second;
                }
            }
            Modulus {
                value,
                slope: first.map(|f| value * f),
                bend,
            }
        })
    }

    /// Energy and its derivatives at the principal strains `e`.
    pub fn principal(&self, e: &[f64; 3]) -> Principal {
        let q = Invariants::at(e);
        let [shear, bulk] = self.moduli_over_strain(&q, &self.held(&q.value));
        let sum = e[0] + e[1] + e[2];
        let dev = e.map(|e| e - sum / 3.0);
        let squared = dev[0] * dev[0] + dev[1] * dev[1] + dev[2] * dev[2];
        let half = 0.5 * sum * sum;
        let mut hessian = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let identity = if i == j { 1.0 } else { 0.0 };
                hessian[i][j] = shear.bend[i][j] * squared
                    + 2.0 * (shear.slope[i] * dev[j] + dev[i] * shear.slope[j])
                    + 2.0 * shear.value * (identity - 1.0 / 3.0)
                    + bulk.bend[i][j] * half
                    + (bulk.slope[i] + bulk.slope[j]) * sum
                    + bulk.value;
            }
        }
        Principal {
            energy: shear.value * squared + bulk.value * half,
            stress: std::array::from_fn(|i| {
                shear.slope[i] * squared
                    + 2.0 * shear.value * dev[i]
                    + bulk.slope[i] * half
                    + bulk.value * sum
            }),
            hessian,
        }
    }
}

impl Invariants {
    /// With N = Σ d² and D = d_1 d_2 d_3 of the principal deviator d: ∂N = 2d, ∂²N = 2(δ_ij − ⅓), ∂D_i = d_i² − N/3,
    /// ∂²D_ij = 2 d_i δ_ij − ⅔ (d_i + d_j).
    fn at(e: &[f64; 3]) -> Invariants {
        let sum = e[0] + e[1] + e[2];
        let d = e.map(|e| e - sum / 3.0);
        let n = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let m = n + SMOOTHING_STRAIN * SMOOTHING_STRAIN;
        let (root, det) = (m.sqrt(), d[0] * d[1] * d[2]);
        let det_slope = d.map(|d| d * d - n / 3.0);
        let mut bend = [[[0.0; 3]; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let identity = if i == j { 1.0 } else { 0.0 };
                let projector = identity - 1.0 / 3.0;
                bend[1][i][j] = projector / root - d[i] * d[j] / (m * root);
                let det_bend = 2.0 * d[i] * identity - 2.0 / 3.0 * (d[i] + d[j]);
                let mixed = 2.0 * (det_slope[i] * d[j] + d[i] * det_slope[j]);
                bend[2][i][j] = THREE_SQRT_6
                    * (det_bend / m - (mixed + 2.0 * det * projector) / (m * m)
                        + 8.0 * det * d[i] * d[j] / (m * m * m));
            }
        }
        Invariants {
            value: [sum * INV_SQRT_3, root - SMOOTHING_STRAIN, THREE_SQRT_6 * det / m],
            slope: [
                [INV_SQRT_3; 3],
                d.map(|d| d / root),
                std::array::from_fn(|i| THREE_SQRT_6 * (det_slope[i] / m - 2.0 * det * d[i] / (m * m))),
            ],
            bend,
        }
    }
}

/// q̂ and its first two derivatives; see the head of the module.
fn hold(q: f64, low: f64, high: f64) -> [f64; 3] {
    let (end, sign) = if q > high {
        (high, 1.0)
    } else if q < low {
        (low, -1.0)
    } else {
        return [q, 1.0, 0.0];
    };
    let extent = if (high - low).is_finite() {
        high - low
    } else {
        end.abs()
    };
    // A range without extent still needs a slope that falls smoothly.
    let width = (0.5 * extent).max(SMOOTHING_STRAIN);
    let x = (q - end) * sign / width;
    if x >= 1.0 {
        return [end + 0.5 * sign * width, 0.0, 0.0];
    }
    [
        end + sign * width * (x - x * x * x + 0.5 * x * x * x * x),
        1.0 - 3.0 * x * x + 2.0 * x * x * x,
        sign * 6.0 * (x * x - x) / width,
    ]
}
