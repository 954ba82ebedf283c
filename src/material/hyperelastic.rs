//! Hyperelastic rubbers and foams at finite strain.
//!
//! ```text
//! neo-Hooke, logarithmic   W = μ/2 (I1 − 3 − 2 ln J) + λ/2 (ln J)²
//! neo-Hooke, isochoric     W = μ/2 (Ī1 − 3) + K/2 (J − 1)²                     C10 = μ/2, D1 = 2/K
//! Mooney–Rivlin            W = C10 (Ī1 − 3) + C01 (Ī2 − 3) + K/2 (J − 1)²
//! Ogden                    W = Σ_k 2μ_k/α_k² (λ̄_1^α_k + λ̄_2^α_k + λ̄_3^α_k − 3) + U(J)
//!                          U = Σ_k 1/D_k (J − 1)^2k    or    U = K/2 (ln J)²
//! hyperfoam                W = Σ_k 2μ_k/α_k² [λ_1^α_k + λ_2^α_k + λ_3^α_k − 3 + (J^(−α_k β_k) − 1)/β_k],  β = ν/(1 − 2ν)
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | W | energy per undeformed volume | MPa |
//! | λ_i, J | principal stretches of U = I + ε, their product | – |
//! | λ̄_i = J^(−1/3) λ_i, Ī1 = Σ λ̄_i², Ī2 = Σ λ̄_i⁻² | stretches and invariants at constant volume | – |
//! | μ, λ, K, C10, C01, 1/D | moduli | MPa |
//! | α, ν | exponents, Poisson's ratios of a foam's terms | – |
//!
//! Neo-Hooke (isochoric) is Ogden's law with α = 2, Mooney–Rivlin that with α = 2 and −2. With x_i = ln λ_i all are
//! written through τ_i = ∂W/∂x_i and D_ij = ∂τ_i/∂x_j, from which t_i = τ_i/λ_i and
//! H_ij = (D_ij − δ_ij τ_i)/(λ_i λ_j); see [`super::principal`] for the rest.
//!
//! Valid for positive stretches. Where a principal stretch is not positive the energy is not defined and stress and
//! tangent are NaN: a solver must refuse the state. Sources: Ogden 1972, Proc. R. Soc. A 326 and 328; Storåkers 1986,
//! J. Mech. Phys. Solids 34 (foam); conventions of the Abaqus Theory Guide, 4.6.1 and 4.6.2.

use super::law::LawError;
use super::neo_hookean::{self, Volumetry};
use super::principal::{Axes, Principal};
use super::stretch_terms::{
    Logarithmic, Stretches, foam_beta, foam_tau, foam_tau_by_shape, ogden_tau, ogden_tau_by_exponent,
};
use crate::math::mandel::{Mandel, Mandel6};
use serde::{Deserialize, Serialize};

/// One term of Ogden's law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OgdenTerm {
    /// Share μ_k of the shear modulus \[MPa\]; may be negative as long as the sum is positive.
    pub shear_mpa: f64,
    /// Exponent α_k, not zero.
    pub exponent: f64,
}

/// One term of the hyperfoam law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoamTerm {
    /// Share μ_k of the shear modulus \[MPa\].
    pub shear_mpa: f64,
    /// Exponent α_k, not zero.
    pub exponent: f64,
    /// Poisson's ratio ν_k, above −1 and below ½; zero is allowed and means β = 0.
    pub poisson: f64,
}

/// The energy of a change of volume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VolumeEnergy {
    /// Σ_k c_k (J − 1)^2k with c_k = 1/D_k \[MPa\]; K = 2 c_1.
    Powers(Vec<f64>),
    /// K/2 (ln J)², K \[MPa\].
    Logarithm(f64),
}

/// An energy and its coefficients; in a record, a table with the `form` and these fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "form", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Form {
    /// Neo-Hooke with logarithms of J.
    NeoHookeanLogarithmic {
        /// μ \[MPa\].
        shear_mpa: f64,
        /// Lamé's λ \[MPa\].
        lame_lambda_mpa: f64,
    },
    /// Neo-Hooke with distortion and volume apart.
    NeoHookeanIsochoric {
        /// μ = 2 C10 \[MPa\].
        shear_mpa: f64,
        /// K = 2/D1 \[MPa\].
        bulk_mpa: f64,
    },
    /// Mooney–Rivlin.
    MooneyRivlin {
        /// C10 \[MPa\].
        c10_mpa: f64,
        /// C01 \[MPa\].
        c01_mpa: f64,
        /// K = 2/D1 \[MPa\].
        bulk_mpa: f64,
    },
    /// Ogden.
    Ogden {
        /// The terms, at least one.
        terms: Vec<OgdenTerm>,
        /// U(J).
        volume: VolumeEnergy,
    },
    /// Ogden and Storåkers' foam.
    Hyperfoam {
        /// The terms, at least one.
        terms: Vec<FoamTerm>,
    },
}

/// A material with an energy of the principal stretches.
#[derive(Clone, Debug, PartialEq)]
pub struct Hyperelastic {
    form: Form,
    shear: f64,
    bulk: f64,
}

/// The secant's eigenvalues are raised to this share of the shear stiffness 2μ at rest.
const LEAST_STIFFNESS: f64 = 0.01;

impl Hyperelastic {
    /// The material of an energy.
    ///
    /// # Errors
    /// A coefficient that is not finite, no term, an exponent of zero, a Poisson's ratio outside (−1, ½), a shear or bulk
    /// modulus at rest that is not positive. The message names the field.
    pub fn new(form: Form) -> Result<Self, LawError> {
        for parameter in form.coefficients() {
            if !parameter.1.is_finite() {
                return Err(wrong(parameter.0, parameter.1, "a finite number"));
            }
        }
        let exponents: Vec<f64> = match &form {
            Form::Ogden { terms, .. } => terms.iter().map(|t| t.exponent).collect(),
            Form::Hyperfoam { terms } => terms.iter().map(|t| t.exponent).collect(),
            _ => vec![2.0],
        };
        if exponents.is_empty() {
            return Err(wrong("terms".into(), 0.0, "at least one term"));
        }
        for (i, exponent) in exponents.iter().enumerate() {
            if *exponent == 0.0 {
                return Err(wrong(
                    format!("terms[{i}].exponent"),
                    0.0,
                    "a number that is not 0",
                ));
            }
        }
        if let Form::Hyperfoam { terms } = &form {
            for (i, term) in terms.iter().enumerate() {
                if !(term.poisson > -1.0 && term.poisson < 0.5) {
                    let field = format!("terms[{i}].poisson");
                    return Err(wrong(field, term.poisson, "a ratio above −1 and below 0.5"));
                }
            }
        }
        let (shear, bulk) = form.moduli_at_rest();
        super::isotropic::positive("shear modulus at rest", shear)?;
        super::isotropic::positive("bulk modulus at rest", bulk)?;
        Ok(Hyperelastic { form, shear, bulk })
    }

    /// The energy and its coefficients.
    pub fn form(&self) -> &Form {
        &self.form
    }

    /// Shear and bulk modulus at rest \[MPa\].
    pub fn moduli_at_rest(&self) -> (f64, f64) {
        (self.shear, self.bulk)
    }

    /// For a neo-Hookean law its form, μ and its second modulus (Lamé's λ or K) \[MPa\], for elements that need no stretch.
    #[inline]
    pub fn neo_hookean(&self) -> Option<(Volumetry, f64, f64)> {
        match self.form {
            Form::NeoHookeanLogarithmic {
                shear_mpa,
                lame_lambda_mpa,
            } => Some((Volumetry::Logarithmic, shear_mpa, lame_lambda_mpa)),
            Form::NeoHookeanIsochoric { shear_mpa, bulk_mpa } => {
                Some((Volumetry::Isochoric, shear_mpa, bulk_mpa))
            }
            _ => None,
        }
    }

    /// See [`super::law::Law::energy`]; NaN where a principal stretch is not positive.
    pub fn energy(&self, strain: &Mandel) -> f64 {
        match self.neo_hookean() {
            Some((form, shear, second)) => neo_hookean::energy(form, shear, second, strain),
            None => self.principal(&Axes::of(strain).strains).energy,
        }
    }

    /// See [`super::law::Law::stress`].
    #[inline]
    pub fn stress(&self, strain: &Mandel) -> Mandel {
        if let Some((form, shear, second)) = self.neo_hookean() {
            return neo_hookean::stress(form, shear, second, strain);
        }
        let axes = Axes::of(strain);
        axes.tensor(&self.principal(&axes.strains).stress)
    }

    /// See [`super::law::Law::stress_and_tangent`]; the tangent is symmetric.
    pub fn stress_and_tangent(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        if let Some((form, shear, second)) = self.neo_hookean() {
            return neo_hookean::stress_and_tangent(form, shear, second, strain);
        }
        let axes = Axes::of(strain);
        let at = self.principal(&axes.strains);
        (axes.tensor(&at.stress), axes.tangent(&at))
    }

    /// See [`super::law::Law::stress_and_secant`]: the tangent with its eigenvalues raised to a hundredth of 2μ at rest.
    pub fn stress_and_secant(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        let axes = Axes::of(strain);
        let at = self.principal(&axes.strains);
        let floor = LEAST_STIFFNESS * 2.0 * self.shear;
        (self.stress(strain), axes.definite_tangent(&at, floor))
    }

    /// Energy and its derivatives at the principal strains `e`; NaN unless all are above −1.
    pub fn principal(&self, e: &[f64; 3]) -> Principal {
        let Some(stretches) = Stretches::of(e) else {
            return Principal {
                energy: f64::NAN,
                stress: [f64::NAN; 3],
                hessian: [[f64::NAN; 3]; 3],
            };
        };
        let l = self.form.logarithmic(&stretches);
        let inverse = e.map(|e| 1.0 / (1.0 + e));
        let mut hessian = l.slope;
        for i in 0..3 {
            hessian[i][i] -= l.tau[i];
            for j in 0..3 {
                hessian[i][j] *= inverse[i] * inverse[j];
            }
        }
        Principal {
            energy: l.energy,
            stress: std::array::from_fn(|i| l.tau[i] * inverse[i]),
            hessian,
        }
    }

    /// Names, values and units of the coefficients; see [`super::law::Law::parameters`].
    pub fn coefficients(&self) -> Vec<(String, f64, &'static str)> {
        self.form.coefficients()
    }

    /// The same energy with other coefficients, in the order of [`Hyperelastic::coefficients`].
    ///
    /// # Errors
    /// A wrong count, or what [`Hyperelastic::new`] refuses.
    pub fn with_coefficients(&self, values: &[f64]) -> Result<Self, LawError> {
        super::law::expect_count(self.coefficients().len(), values.len())?;
        Hyperelastic::new(self.form.with_coefficients(values))
    }

    /// ∂T/∂(coefficient) at fixed strain, in the order of [`Hyperelastic::coefficients`].
    pub fn stress_by_coefficients(&self, strain: &Mandel) -> Vec<Mandel> {
        let axes = Axes::of(strain);
        let Some(stretches) = Stretches::of(&axes.strains) else {
            return vec![Mandel::repeat(f64::NAN); self.coefficients().len()];
        };
        let slopes = self.form.tau_by_coefficients(&stretches);
        let e = axes.strains;
        slopes
            .iter()
            .map(|tau| axes.tensor(&std::array::from_fn(|i| tau[i] / (1.0 + e[i]))))
            .collect()
    }
}

fn wrong(field: String, value: f64, expected: &'static str) -> LawError {
    LawError::Coefficient {
        field,
        value,
        expected,
    }
}

impl Form {
    /// Shear and bulk modulus at rest \[MPa\].
    fn moduli_at_rest(&self) -> (f64, f64) {
        match self {
            Form::NeoHookeanLogarithmic {
                shear_mpa,
                lame_lambda_mpa,
            } => (*shear_mpa, lame_lambda_mpa + 2.0 / 3.0 * shear_mpa),
            Form::NeoHookeanIsochoric { shear_mpa, bulk_mpa } => (*shear_mpa, *bulk_mpa),
            Form::MooneyRivlin {
                c10_mpa,
                c01_mpa,
                bulk_mpa,
            } => (2.0 * (c10_mpa + c01_mpa), *bulk_mpa),
            Form::Ogden { terms, volume } => {
                let bulk = match volume {
                    VolumeEnergy::Powers(c) => 2.0 * c.first().copied().unwrap_or(0.0),
                    VolumeEnergy::Logarithm(bulk) => *bulk,
                };
                (terms.iter().map(|t| t.shear_mpa).sum(), bulk)
            }
            Form::Hyperfoam { terms } => {
                let bulk = |t: &FoamTerm| 2.0 * t.shear_mpa * (1.0 / 3.0 + foam_beta(t.poisson));
                (
                    terms.iter().map(|t| t.shear_mpa).sum(),
                    terms.iter().map(bulk).sum(),
                )
            }
        }
    }

    fn logarithmic(&self, s: &Stretches) -> Logarithmic {
        let mut l = Logarithmic::ZERO;
        match self {
            Form::NeoHookeanLogarithmic {
                shear_mpa,
                lame_lambda_mpa,
            } => {
                // λ² − 1 − 2 ln λ is a foam's term with α = 2 and β = 0.
                l.add_foam(s, *shear_mpa, 2.0, 0.0);
                l.add_logarithm(s, *lame_lambda_mpa);
            }
            Form::NeoHookeanIsochoric { shear_mpa, bulk_mpa } => {
                l.add_ogden(s, *shear_mpa, 2.0);
                l.add_powers(s, &[0.5 * bulk_mpa]);
            }
            Form::MooneyRivlin {
                c10_mpa,
                c01_mpa,
                bulk_mpa,
            } => {
                l.add_ogden(s, 2.0 * c10_mpa, 2.0);
                l.add_ogden(s, 2.0 * c01_mpa, -2.0);
                l.add_powers(s, &[0.5 * bulk_mpa]);
            }
            Form::Ogden { terms, volume } => {
                for t in terms {
                    l.add_ogden(s, t.shear_mpa, t.exponent);
                }
                match volume {
                    VolumeEnergy::Powers(c) => l.add_powers(s, c),
                    VolumeEnergy::Logarithm(bulk) => l.add_logarithm(s, *bulk),
                }
            }
            Form::Hyperfoam { terms } => {
                for t in terms {
                    l.add_foam(s, t.shear_mpa, t.exponent, foam_beta(t.poisson));
                }
            }
        }
        l
    }

    fn coefficients(&self) -> Vec<(String, f64, &'static str)> {
        let mpa = |name: &str, value: f64| (name.to_string(), value, "MPa");
        match self {
            Form::NeoHookeanLogarithmic {
                shear_mpa,
                lame_lambda_mpa,
            } => vec![mpa("shear", *shear_mpa), mpa("lame_lambda", *lame_lambda_mpa)],
            Form::NeoHookeanIsochoric { shear_mpa, bulk_mpa } => {
                vec![mpa("shear", *shear_mpa), mpa("bulk", *bulk_mpa)]
            }
            Form::MooneyRivlin {
                c10_mpa,
                c01_mpa,
                bulk_mpa,
            } => vec![mpa("c10", *c10_mpa), mpa("c01", *c01_mpa), mpa("bulk", *bulk_mpa)],
            Form::Ogden { terms, volume } => {
                let mut list = Vec::new();
                for (i, t) in terms.iter().enumerate() {
                    list.push(mpa(&format!("terms[{i}].shear"), t.shear_mpa));
                    list.push((format!("terms[{i}].exponent"), t.exponent, "–"));
                }
                match volume {
                    VolumeEnergy::Powers(c) => {
                        let one = |(i, c): (usize, &f64)| mpa(&format!("1/d[{i}]"), *c);
                        list.extend(c.iter().enumerate().map(one));
                    }
                    VolumeEnergy::Logarithm(bulk) => list.push(mpa("bulk", *bulk)),
                }
                list
            }
            Form::Hyperfoam { terms } => {
                let mut list = Vec::new();
                for (i, t) in terms.iter().enumerate() {
                    list.push(mpa(&format!("terms[{i}].shear"), t.shear_mpa));
                    list.push((format!("terms[{i}].exponent"), t.exponent, "–"));
                    list.push((format!("terms[{i}].poisson"), t.poisson, "–"));
                }
                list
            }
        }
    }

    /// As many `values` as there are coefficients.
    fn with_coefficients(&self, values: &[f64]) -> Form {
        match self {
            Form::NeoHookeanLogarithmic { .. } => Form::NeoHookeanLogarithmic {
                shear_mpa: values[0],
                lame_lambda_mpa: values[1],
            },
            Form::NeoHookeanIsochoric { .. } => Form::NeoHookeanIsochoric {
                shear_mpa: values[0],
                bulk_mpa: values[1],
            },
            Form::MooneyRivlin { .. } => Form::MooneyRivlin {
                c10_mpa: values[0],
                c01_mpa: values[1],
                bulk_mpa: values[2],
            },
            Form::Ogden { terms, volume } => {
                let (of_terms, of_volume) = values.split_at(2 * terms.len());
                Form::Ogden {
                    terms: of_terms
                        .chunks_exact(2)
                        .map(|v| OgdenTerm {
                            shear_mpa: v[0],
                            exponent: v[1],
                        })
                        .collect(),
                    volume: match volume {
                        VolumeEnergy::Powers(_) => VolumeEnergy::Powers(of_volume.to_vec()),
                        VolumeEnergy::Logarithm(_) => VolumeEnergy::Logarithm(of_volume[0]),
                    },
                }
            }
            Form::Hyperfoam { .. } => Form::Hyperfoam {
                terms: values
                    .chunks_exact(3)
                    .map(|v| FoamTerm {
                        shear_mpa: v[0],
                        exponent: v[1],
                        poisson: v[2],
                    })
                    .collect(),
            },
        }
    }

    /// ∂τ/∂(coefficient), in the order of the coefficients.
    fn tau_by_coefficients(&self, s: &Stretches) -> Vec<[f64; 3]> {
        let powers = |i: usize| {
            let k = 2.0 * (i as f64 + 1.0);
            [(1.0 + s.growth) * k * s.growth.powi(2 * i as i32 + 1); 3]
        };
        let twice = |t: [f64; 3]| t.map(|t| 2.0 * t);
        let half = |t: [f64; 3]| t.map(|t| 0.5 * t);
        match self {
            Form::NeoHookeanLogarithmic { .. } => vec![foam_tau(s, 2.0, 0.0), [s.log_volume; 3]],
            Form::NeoHookeanIsochoric { .. } => vec![ogden_tau(s, 2.0), half(powers(0))],
            Form::MooneyRivlin { .. } => vec![
                twice(ogden_tau(s, 2.0)),
                twice(ogden_tau(s, -2.0)),
                half(powers(0)),
            ],
            Form::Ogden { terms, volume } => {
                let mut list = Vec::new();
                for t in terms {
                    list.push(ogden_tau(s, t.exponent));
                    list.push(ogden_tau_by_exponent(s, t.shear_mpa, t.exponent));
                }
                match volume {
                    VolumeEnergy::Powers(c) => list.extend((0..c.len()).map(powers)),
                    VolumeEnergy::Logarithm(_) => list.push([s.log_volume; 3]),
                }
                list
            }
            Form::Hyperfoam { terms } => {
                let mut list = Vec::new();
                for t in terms {
                    list.push(foam_tau(s, t.exponent, foam_beta(t.poisson)));
                    list.extend(foam_tau_by_shape(s, t.shear_mpa, t.exponent, t.poisson));
                }
                list
            }
        }
    }
}
