//! The terms that hyperelastic energies are made of, over the logarithms x_i = ln λ_i of the principal stretches.
//!
//! ```text
//! Ogden       2μ/α² (Σ λ̄_i^α − 3)                         τ_i = 2μ/α (λ̄_i^α − m),  m = Σ λ̄_k^α / 3
//!                                                        D_ij = 2μ (δ_ij λ̄_i^α − (λ̄_i^α + λ̄_j^α − m)/3)
//! foam        2μ/α² [Σ λ_i^α − 3 + (J^(−αβ) − 1)/β]       τ_i = 2μ/α (λ_i^α − J^(−αβ))
//!                                                        D_ij = 2μ (δ_ij λ_i^α + β J^(−αβ))
//! powers      Σ_k c_k (J − 1)^2k = U                      τ_i = J U',  D_ij = J U' + J² U''
//! logarithm   K/2 (ln J)²                                τ_i = K ln J,  D_ij = K
//! ```
//!
//! τ_i = ∂W/∂x_i and D_ij = ∂τ_i/∂x_j \[MPa\]; other symbols and sources in [`super::hyperelastic`]. Everything is written
//! with `exp_m1` and `ln_1p`, so that stresses keep their digits near rest.

/// W, τ = ∂W/∂x and ∂τ/∂x over the logarithms x of the principal stretches \[MPa\].
pub(super) struct Logarithmic {
    pub energy: f64,
    pub tau: [f64; 3],
    pub slope: [[f64; 3]; 3],
}

/// Logarithms of the principal stretches and what follows from them.
pub(super) struct Stretches {
    pub logs: [f64; 3],
    pub log_volume: f64,
    /// J − 1.
    pub growth: f64,
}

impl Stretches {
    /// None unless all stretches are positive.
    #[inline]
    pub fn of(e: &[f64; 3]) -> Option<Stretches> {
        if !e.iter().all(|e| *e > -1.0 && e.is_finite()) {
            return None;
        }
        let logs = e.map(f64::ln_1p);
        Some(Stretches {
            logs,
            log_volume: logs[0] + logs[1] + logs[2],
            growth: e[0] + e[1] + e[2] + e[0] * e[1] + e[0] * e[2] + e[1] * e[2] + e[0] * e[1] * e[2],
        })
    }

    /// λ̄_i^α − 1.
    #[inline]
    fn isochoric_powers(&self, exponent: f64) -> [f64; 3] {
        self.logs
            .map(|x| (exponent * (x - self.log_volume / 3.0)).exp_m1())
    }
}

impl Logarithmic {
    /// No energy.
    pub const ZERO: Logarithmic = Logarithmic {
        energy: 0.0,
        tau: [0.0; 3],
        slope: [[0.0; 3]; 3],
    };

    /// 2μ/α² (Σ λ̄^α − 3).
    pub fn add_ogden(&mut self, s: &Stretches, shear: f64, exponent: f64) {
        let p = s.isochoric_powers(exponent);
        let mean = (p[0] + p[1] + p[2]) / 3.0;
        self.energy += 6.0 * shear / (exponent * exponent) * mean;
        for i in 0..3 {
            self.tau[i] += 2.0 * shear / exponent * (p[i] - mean);
            for j in 0..3 {
                // The ones that p lacks add up to −1/3 here and to 1 on the diagonal.
                self.slope[i][j] += 2.0 * shear * ((mean - p[i] - p[j] - 1.0) / 3.0);
            }
            self.slope[i][i] += 2.0 * shear * (p[i] + 1.0);
        }
    }

    /// 2μ/α² [Σ λ^α − 3 + (J^(−αβ) − 1)/β]; for β = 0 the bracket's last term is −α ln J.
    pub fn add_foam(&mut self, s: &Stretches, shear: f64, exponent: f64, beta: f64) {
        let p = s.logs.map(|x| (exponent * x).exp_m1());
        let v = (-exponent * beta * s.log_volume).exp_m1();
        let volume = if beta == 0.0 {
            -exponent * s.log_volume
        } else {
            v / beta
        };
        self.energy += 2.0 * shear / (exponent * exponent) * (p[0] + p[1] + p[2] + volume);
        for (i, p) in p.iter().enumerate() {
            self.tau[i] += 2.0 * shear / exponent * (p - v);
            for slope in &mut self.slope[i] {
                *slope += 2.0 * shear * beta * (v + 1.0);
            }
            self.slope[i][i] += 2.0 * shear * (p + 1.0);
        }
    }

    /// Σ c_k (J − 1)^2k.
    pub fn add_powers(&mut self, s: &Stretches, coefficients: &[f64]) {
        let (x, j) = (s.growth, 1.0 + s.growth);
        let (mut first, mut second) = (0.0, 0.0);
        // x^(2k − 2), growing.
        let mut power = 1.0;
        for (i, c) in coefficients.iter().enumerate() {
            let n = 2.0 * (i as f64 + 1.0);
            self.energy += c * power * x * x;
            first += n * c * power * x;
            second += n * (n - 1.0) * c * power;
            power *= x * x;
        }
        for i in 0..3 {
            self.tau[i] += j * first;
            for k in 0..3 {
                self.slope[i][k] += j * (first + j * second);
            }
        }
    }

    /// K/2 (ln J)².
    pub fn add_logarithm(&mut self, s: &Stretches, bulk: f64) {
        self.energy += 0.5 * bulk * s.log_volume * s.log_volume;
        for i in 0..3 {
            self.tau[i] += bulk * s.log_volume;
            for j in 0..3 {
                self.slope[i][j] += bulk;
            }
        }
    }
}

/// τ of an Ogden term with μ = 1.
pub(super) fn ogden_tau(s: &Stretches, exponent: f64) -> [f64; 3] {
    let p = s.isochoric_powers(exponent);
    let mean = (p[0] + p[1] + p[2]) / 3.0;
    p.map(|p| 2.0 / exponent * (p - mean))
}

/// ∂τ/∂α of an Ogden term: with y = ln λ̄, ∂(λ̄^α/α)/∂α = λ̄^α (y/α − 1/α²).
pub(super) fn ogden_tau_by_exponent(s: &Stretches, shear: f64, exponent: f64) -> [f64; 3] {
    let a = exponent;
    let p = s.isochoric_powers(a);
    let d: [f64; 3] = std::array::from_fn(|i| {
        let y = s.logs[i] - s.log_volume / 3.0;
        (p[i] + 1.0) * y / a - p[i] / (a * a)
    });
    let mean = (d[0] + d[1] + d[2]) / 3.0;
    d.map(|d| 2.0 * shear * (d - mean))
}

/// τ of a foam's term with μ = 1.
pub(super) fn foam_tau(s: &Stretches, exponent: f64, beta: f64) -> [f64; 3] {
    let v = (-exponent * beta * s.log_volume).exp_m1();
    s.logs.map(|x| 2.0 / exponent * ((exponent * x).exp_m1() - v))
}

/// ∂τ/∂α and ∂τ/∂ν of a foam's term, with dβ/dν = 1/(1 − 2ν)².
pub(super) fn foam_tau_by_shape(s: &Stretches, shear: f64, exponent: f64, poisson: f64) -> [[f64; 3]; 2] {
    let (a, beta) = (exponent, foam_beta(poisson));
    let v = (-a * beta * s.log_volume).exp_m1();
    let by_exponent = s.logs.map(|x| {
        let p = (a * x).exp_m1();
        let slope = (p + 1.0) * x + (v + 1.0) * beta * s.log_volume;
        2.0 * shear * (slope / a - (p - v) / (a * a))
    });
    let stretch = 1.0 - 2.0 * poisson;
    let by_poisson = 2.0 * shear * (v + 1.0) * s.log_volume / (stretch * stretch);
    [by_exponent, [by_poisson; 3]]
}

/// β of Poisson's ratio.
pub(super) fn foam_beta(poisson: f64) -> f64 {
    poisson / (1.0 - 2.0 * poisson)
}
