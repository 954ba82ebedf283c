//! The strain-space interpolation as the papers print it, for comparison.
//!
//! ```text
//! T = E(p(ε)) ε,     p(ε) = [c +] Σ_i w_i |ε − ε_i|                  (7.10), (8.2)
//! |a|² = Σ of the squares of six components of (7.2) (`vector`)   or   A : A (`tensor`)
//!
//! isotropic      E ε = 2μ ε + λ tr ε I
//!   (λ₇, α)      2μ = λ₇ − 2α,  λ = α                               (7.7), with engineering shear in (7.5), (7.6)
//!   (λ, μ)       as they stand                                      (8.1)
//!   (E, ν)       2μ = E/(1 + ν),  λ = Eν/((1 + ν)(1 − 2ν))          (7.4)
//! transversely isotropic  (E11, E12, E13, E33, E44) about z, in the order of super::transverse        (8.5)
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | ε, ε_i | Biot strain, the i-th centre: a tensor in the material's frame | – |
//! | p | stiffness parameters, interpolated as they are, not their logarithms | MPa; ν – |
//! | w, c | weights, and the constant with Σw = 0 that Carr et al. have and the papers leave out | as p |
//!
//! What this form lacks is said in `docs/theory/material.md`: positive definiteness is not inherited between the centres
//! ([`PaperRbf::is_definite`] tells where it is lost), a centre is a direction, so an isotropic E does not make an isotropic
//! material, the `vector` norm depends on the axes, and without the constant equal moduli at all centres are not given
//! back. There is no fitted range: the interpolant is taken wherever it is asked. Elements use P = R T without the
//! skew part that the other transversely isotropic law adds. Source: Bickel 2010, sections 7.2 and 8.2.

use super::isotropic::{poisson, young};
use super::law::LawError;
use crate::math::mandel::{Mandel, Mandel6, from_tensor, to_tensor, trace};
use crate::math::rbf::{Cardinal, ConstantTerm, LinearRbf};
use crate::math::{Mat3, Vec3};
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Which numbers describe the stiffness at a centre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PaperParameters {
    /// (λ, α) of chapter 7, \[MPa\]: λ = 2μ + Lamé's λ, α = Lamé's λ.
    LambdaAlpha,
    /// (λ, μ) of (8.1) \[MPa\].
    Lame,
    /// Young's modulus \[MPa\] and Poisson's ratio.
    YoungPoisson,
    /// E11, E12, E13, E33, E44 \[MPa\].
    Transverse,
}

impl PaperParameters {
    /// The names, with units.
    pub fn names(self) -> &'static [(&'static str, &'static str)] {
        match self {
            PaperParameters::LambdaAlpha => &[("lambda", "MPa"), ("alpha", "MPa")],
            PaperParameters::Lame => &[("lame_lambda", "MPa"), ("shear", "MPa")],
            PaperParameters::YoungPoisson => &[("young", "MPa"), ("poisson", "–")],
            PaperParameters::Transverse => &[
                ("e11", "MPa"),
                ("e12", "MPa"),
                ("e13", "MPa"),
                ("e33", "MPa"),
                ("e44", "MPa"),
            ],
        }
    }
}

/// The norm of a strain 6-vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrainNorm {
    /// Euclidean, of the components xx yy zz xy xz yz of (7.2).
    Vector,
    /// Frobenius, of the tensor: shears count twice.
    Tensor,
}

/// The papers' material.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperRbf {
    parameters: PaperParameters,
    norm: StrainNorm,
    constant: ConstantTerm,
    /// Strains of the centres, Mandel notation, material frame.
    centres: Vec<Mandel>,
    /// Parameters at the centres; the last three are 0 for an isotropic E.
    values: Vec<[f64; 5]>,
    /// Over the strain components scaled by the norm.
    rbf: LinearRbf<6, 5>,
    cardinal: Cardinal,
    /// Turns the material's frame, axis z, into that of the strain.
    frame: Option<Mat3>,
}

/// An indefinite secant's eigenvalues are raised to this share of the largest.
const LEAST_STIFFNESS: f64 = 0.01;

impl PaperRbf {
    /// The material with the parameters `values[i]` (two or five numbers, see [`PaperParameters::names`]) at the strain
    /// `centres[i]`, Mandel notation.
    ///
    /// # Errors
    /// Unequal counts, numbers that are not finite, a centre whose stiffness is not positive definite, two centres at one
    /// point, and without a constant a single centre.
    pub fn interpolating(
        centres: &[Mandel],
        values: &[Vec<f64>],
        parameters: PaperParameters,
        norm: StrainNorm,
        constant: ConstantTerm,
    ) -> Result<Self, LawError> {
        super::law::expect_count(centres.len(), values.len())?;
        let width = parameters.names().len();
        let mut rows = Vec::with_capacity(values.len());
        for (i, row) in values.iter().enumerate() {
            super::law::expect_count(width, row.len())?;
            let mut five = [0.0; 5];
            five[..width].copy_from_slice(row);
            if !is_definite(parameters, &five) {
                return Err(LawError::Centre {
                    centre: i,
                    values: row.clone(),
                });
            }
            rows.push(five);
        }
        let scaled: Vec<[f64; 6]> = centres.iter().map(|c| coordinates(norm, c)).collect();
        let cardinal = Cardinal::new(&scaled, |r| r, constant)?;
        let (weights, constants) = cardinal.weights(&rows);
        let rbf = LinearRbf {
            centres: scaled,
            weights,
            constant: constants,
        };
        Ok(PaperRbf {
            parameters,
            norm,
            constant,
            centres: centres.to_vec(),
            values: rows,
            rbf,
            cardinal,
            frame: None,
        })
    }

    /// Which numbers stand at the centres.
    pub fn parameters(&self) -> PaperParameters {
        self.parameters
    }

    /// The norm of strain.
    pub fn norm(&self) -> StrainNorm {
        self.norm
    }

    /// Strains of the centres, Mandel notation, `(n × 6)`.
    pub fn centres(&self) -> &[Mandel] {
        &self.centres
    }

    /// The parameters at the centres, `(n × 2)` or `(n × 5)`.
    pub fn values(&self) -> Vec<Vec<f64>> {
        let width = self.parameters.names().len();
        self.values.iter().map(|v| v[..width].to_vec()).collect()
    }

    /// The same centres with other values, centre by centre.
    ///
    /// # Errors
    /// As [`PaperRbf::interpolating`].
    pub fn with_values(&self, values: &[f64]) -> Result<Self, LawError> {
        let width = self.parameters.names().len();
        super::law::expect_count(width * self.centres.len(), values.len())?;
        let rows: Vec<Vec<f64>> = values.chunks_exact(width).map(<[f64]>::to_vec).collect();
        let law = PaperRbf::interpolating(&self.centres, &rows, self.parameters, self.norm, self.constant)?;
        Ok(PaperRbf {
            frame: self.frame,
            ..law
        })
    }

    /// The parameters at a strain, `(2)` or `(5)`.
    pub fn values_at(&self, strain: &Mandel) -> Vec<f64> {
        let p = self.at(&self.to_material(strain));
        p[..self.parameters.names().len()].to_vec()
    }

    /// Whether the secant stiffness at `strain` is positive definite.
    pub fn is_definite(&self, strain: &Mandel) -> bool {
        is_definite(self.parameters, &self.at(&self.to_material(strain)))
    }

    /// See [`super::law::Law::stress`].
    pub fn stress(&self, strain: &Mandel) -> Mandel {
        let own = self.to_material(strain);
        let stress = stiffness(self.parameters, &self.at(&own)) * own;
        self.to_space(&stress)
    }

    /// See [`super::law::Law::stress_and_secant`]; where E is not positive definite its eigenvalues are raised to a
    /// hundredth of the largest, and the secant times strain is not the stress.
    pub fn stress_and_secant(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        let own = self.to_material(strain);
        let p = self.at(&own);
        let mut e = stiffness(self.parameters, &p);
        let stress = self.to_space(&(e * own));
        if !is_definite(self.parameters, &p) && e.iter().all(|x| x.is_finite()) {
            let mut eigen = e.symmetric_eigen();
            let floor = (LEAST_STIFFNESS * eigen.eigenvalues.amax()).max(f64::MIN_POSITIVE);
            eigen.eigenvalues.apply(|v| *v = v.max(floor));
            e = eigen.recompose();
        }
        (stress, self.turned(&e))
    }

    /// See [`super::law::Law::stress_and_tangent`]: dT/dε = E + Σ_k ∂T/∂p_k ⊗ ∂p_k/∂ε.
    pub fn stress_and_tangent(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        let own = self.to_material(strain);
        let (p, slopes) = self.rbf.value_and_gradient(&coordinates(self.norm, &own));
        let mut tangent = stiffness(self.parameters, &p);
        let stress = tangent * own;
        for (by_parameter, slope) in stress_by_parameter(self.parameters, &p, &own).iter().zip(&slopes) {
            // The scaling of the coordinates is its own derivative.
            let over_strain = Mandel::from(coordinates(self.norm, &Mandel::from(*slope)));
            tangent += by_parameter * over_strain.transpose();
        }
        (self.to_space(&stress), self.turned(&tangent))
    }

    /// ∂T/∂(value) at fixed strain, in the order of [`PaperRbf::with_values`].
    pub fn stress_by_values(&self, strain: &Mandel) -> Vec<Mandel> {
        let own = self.to_material(strain);
        let at = coordinates(self.norm, &own);
        let shares = self.cardinal.values(&self.rbf.distances(&at));
        let by_parameter = stress_by_parameter(self.parameters, &self.rbf.value(&at), &own);
        shares
            .iter()
            .flat_map(|share| {
                by_parameter
                    .iter()
                    .map(move |slope| self.to_space(&(slope * *share)))
            })
            .collect()
    }

    /// See [`super::law::Law::young_modulus`].
    pub fn young_modulus(&self, strain: &Mandel) -> f64 {
        self.engineering(&self.at(&self.to_material(strain))).0
    }

    /// See [`super::law::Law::poisson_ratio_at_rest`].
    pub fn poisson_ratio_at_rest(&self) -> f64 {
        self.engineering(&self.at(&Mandel::zeros())).1
    }

    /// See [`super::law::Law::rotated`]: the centres turn with the material, by the shortest way from z to `axis`. An
    /// isotropic E stays as it is.
    pub fn rotated(&self, axis: &Vec3) -> Self {
        let mut turned = self.clone();
        let unit = axis
            .try_normalize(0.0)
            .filter(|u| u.iter().all(|x| x.is_finite()));
        if let (PaperParameters::Transverse, Some(unit)) = (self.parameters, unit) {
            let half_turn = nalgebra::Rotation3::from_axis_angle(&Vec3::x_axis(), PI);
            let rotation = nalgebra::Rotation3::rotation_between(&Vec3::z(), &unit).unwrap_or(half_turn);
            turned.frame = Some(*rotation.matrix());
        }
        turned
    }

    fn at(&self, own: &Mandel) -> [f64; 5] {
        self.rbf.value(&coordinates(self.norm, own))
    }

    /// Young's modulus and Poisson's ratio, along the axis if there is one.
    fn engineering(&self, p: &[f64; 5]) -> (f64, f64) {
        if self.parameters == PaperParameters::Transverse {
            let ratio = p[2] / (p[0] + p[1]);
            return (p[3] - 2.0 * p[2] * ratio, ratio);
        }
        let (twice_shear, lambda) = isotropic_moduli(self.parameters, p);
        let (shear, bulk) = (0.5 * twice_shear, lambda + twice_shear / 3.0);
        (young(shear, bulk), poisson(shear, bulk))
    }

    fn to_material(&self, strain: &Mandel) -> Mandel {
        match &self.frame {
            Some(q) => from_tensor(&(q.transpose() * to_tensor(strain) * q)),
            None => *strain,
        }
    }

    fn to_space(&self, stress: &Mandel) -> Mandel {
        match &self.frame {
            Some(q) => from_tensor(&(q * to_tensor(stress) * q.transpose())),
            None => *stress,
        }
    }

    /// A matrix of the material's frame in that of the strain.
    fn turned(&self, e: &Mandel6) -> Mandel6 {
        if self.frame.is_none() {
            return *e;
        }
        let mut turn = Mandel6::zeros();
        for j in 0..6 {
            turn.set_column(j, &self.to_space(&Mandel6::identity().column(j).into_owned()));
        }
        turn * e * turn.transpose()
    }
}

/// Strain components whose Euclidean distance is that of the norm.
#[inline]
fn coordinates(norm: StrainNorm, strain: &Mandel) -> [f64; 6] {
    let s = match norm {
        StrainNorm::Vector => FRAC_1_SQRT_2,
        StrainNorm::Tensor => 1.0,
    };
    [
        strain[0],
        strain[1],
        strain[2],
        s * strain[3],
        s * strain[4],
        s * strain[5],
    ]
}

/// (2μ, λ) of the two isotropic parameters.
fn isotropic_moduli(parameters: PaperParameters, p: &[f64; 5]) -> (f64, f64) {
    match parameters {
        PaperParameters::LambdaAlpha => (p[0] - 2.0 * p[1], p[1]),
        PaperParameters::Lame => (2.0 * p[1], p[0]),
        PaperParameters::YoungPoisson | PaperParameters::Transverse => {
            let (young, ratio) = (p[0], p[1]);
            (
                young / (1.0 + ratio),
                young * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio)),
            )
        }
    }
}

fn is_definite(parameters: PaperParameters, p: &[f64; 5]) -> bool {
    if parameters == PaperParameters::Transverse {
        let [e11, e12, e13, e33, e44] = *p;
        let sum = e11 + e12;
        return e44 > 0.0 && e11 > e12 && sum > 0.0 && e33 * sum > 2.0 * e13 * e13 && e33.is_finite();
    }
    let (twice_shear, lambda) = isotropic_moduli(parameters, p);
    twice_shear > 0.0 && lambda + twice_shear / 3.0 > 0.0 && (twice_shear + lambda).is_finite()
}

/// E in the material's frame.
fn stiffness(parameters: PaperParameters, p: &[f64; 5]) -> Mandel6 {
    let mut e = Mandel6::zeros();
    if parameters == PaperParameters::Transverse {
        let [e11, e12, e13, e33, e44] = *p;
        let normal = Mat3::new(e11, e12, e13, e12, e11, e13, e13, e13, e33);
        e.fixed_view_mut::<3, 3>(0, 0).copy_from(&normal);
        e[(3, 3)] = 2.0 * e44;
        e[(4, 4)] = 2.0 * e44;
        e[(5, 5)] = e11 - e12;
        return e;
    }
    let (twice_shear, lambda) = isotropic_moduli(parameters, p);
    for i in 0..6 {
        e[(i, i)] = twice_shear;
    }
    for i in 0..3 {
        for j in 0..3 {
            e[(i, j)] += lambda;
        }
    }
    e
}

/// ∂T/∂p_k in the material's frame, two or five.
fn stress_by_parameter(parameters: PaperParameters, p: &[f64; 5], strain: &Mandel) -> Vec<Mandel> {
    let pressure = Mandel::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0) * trace(strain);
    match parameters {
        PaperParameters::LambdaAlpha => vec![*strain, pressure - strain * 2.0],
        PaperParameters::Lame => vec![pressure, strain * 2.0],
        PaperParameters::YoungPoisson => {
            let (young, ratio) = (p[0], p[1]);
            let (a, b) = (1.0 + ratio, 1.0 - 2.0 * ratio);
            vec![
                strain / a + pressure * (ratio / (a * b)),
                strain * (-young / (a * a))
                    + pressure * (young * (1.0 + 2.0 * ratio * ratio) / (a * a * b * b)),
            ]
        }
        // E is linear in the five.
        PaperParameters::Transverse => (0..5)
            .map(|k| {
                let mut unit = [0.0; 5];
                unit[k] = 1.0;
                stiffness(parameters, &unit) * strain
            })
            .collect(),
    }
}
