//! Transversely isotropic strain-dependent elasticity.
//!
//! ```text
//!         ⎡ E11 E12 E13               ⎤
//!         ⎢ E12 E11 E13               ⎥      axis along z, Mandel order xx yy zz yz xz xy
//! E  =    ⎢ E13 E13 E33               ⎥      (Bickel 2010, (8.5), there for engineering shear)
//!         ⎢             2E44          ⎥
//!         ⎢                 2E44      ⎥
//!         ⎣                    E11−E12⎦
//!
//! q = ( a·ε,  p·ε,  |S ε|,  |G ε| ),     a = n⊗n,  p = (I − n⊗n)/√2,  S = 1 − a⊗a − p⊗p − G
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | n | the axis of symmetry (fibres, tubes), unit length | – |
//! | a·ε, p·ε | strain along the axis; in-plane area strain over √2 | – |
//! | S ε, G ε | in-plane deviator; axial shear (the part n⊗w + w⊗n with w ⟂ n) | – |
//! | E11 … E44 | the five secant moduli | MPa |
//!
//! The four invariants are the norms of ε's orthogonal parts, |ε|² = Σ q_k². The fifth one of the general theory, the
//! angle between in-plane deviator and axial shear, is left out: coupons don't resolve it. Norms are smoothed at zero
//! by [`super::law::SMOOTHING_STRAIN`].
//!
//! Interpolated are five unconstrained numbers, so that E is positive definite at every strain:
//!
//! ```text
//! ln E44,  ln(E11 − E12),  ln l11,  l21 [√MPa],  ln l22     with  L Lᵀ = ⎡ E11+E12  √2 E13 ⎤ ,  L = ⎡ l11     ⎤
//!                                                                        ⎣ √2 E13   E33    ⎦        ⎣ l21 l22 ⎦
//! ```

use super::isotropic::{cardinal_of, check_weights, expect_logarithms, positive};
use super::law::{LawError, Range, expect_count, smooth_norm};
use crate::math::mandel::{Mandel, Mandel6, from_tensor};
use crate::math::rbf::{Cardinal, LinearRbf};
use crate::math::{Mat3, Vec3};
use std::f64::consts::SQRT_2;

/// The five moduli of a transversely isotropic stiffness \[MPa\], named as in Bickel 2010, (8.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransverseModuli {
    /// In-plane normal stiffness.
    pub e11: f64,
    /// In-plane coupling.
    pub e12: f64,
    /// Coupling of axis and plane.
    pub e13: f64,
    /// Normal stiffness along the axis.
    pub e33: f64,
    /// Shear modulus of planes that hold the axis.
    pub e44: f64,
}

impl TransverseModuli {
    /// The moduli from engineering constants: Young's moduli along the axis and across it, Poisson's ratios for load
    /// along the axis and in the plane, shear modulus of planes that hold the axis. Moduli in MPa.
    ///
    /// # Errors
    /// If they are not those of a positive definite stiffness.
    pub fn from_engineering(
        young_axial: f64,
        young_plane: f64,
        poisson_axial: f64,
        poisson_plane: f64,
        shear_axial: f64,
    ) -> Result<Self, LawError> {
        positive("axial Young's modulus", young_axial)?;
        positive("in-plane Young's modulus", young_plane)?;
        positive("axial shear modulus", shear_axial)?;
        // Inverting the compliance: with m = 1 − ν_p − 2 ν_a² E_p/E_a,
        // E11+E12 = E_p/m, E13 = ν_a (E11+E12), E33 = E_a + 2 ν_a E13, E11−E12 = E_p/(1+ν_p).
        let m = 1.0 - poisson_plane - 2.0 * poisson_axial * poisson_axial * young_plane / young_axial;
        let sum = young_plane / m;
        let difference = young_plane / (1.0 + poisson_plane);
        let e13 = poisson_axial * sum;
        let moduli = TransverseModuli {
            e11: 0.5 * (sum + difference),
            e12: 0.5 * (sum - difference),
            e13,
            e33: young_axial + 2.0 * poisson_axial * e13,
            e44: shear_axial,
        };
        moduli.parameters()?;
        Ok(moduli)
    }

    /// In the order E11, E12, E13, E33, E44 \[MPa\].
    pub fn to_array(&self) -> [f64; 5] {
        [self.e11, self.e12, self.e13, self.e33, self.e44]
    }

    /// From the order E11, E12, E13, E33, E44 \[MPa\].
    pub fn from_array(m: [f64; 5]) -> Self {
        TransverseModuli {
            e11: m[0],
            e12: m[1],
            e13: m[2],
            e33: m[3],
            e44: m[4],
        }
    }

    /// The unconstrained numbers that are interpolated, `(5)`.
    ///
    /// # Errors
    /// If the stiffness is not positive definite.
    pub fn parameters(&self) -> Result<[f64; 5], LawError> {
        let bad = |what| LawError::Indefinite(self.to_array(), what);
        if !self.to_array().iter().all(|x| x.is_finite()) {
            return Err(bad("not all are finite"));
        }
        let sum = self.e11 + self.e12;
        let difference = self.e11 - self.e12;
        if self.e44 <= 0.0 {
            return Err(bad("E44 must be positive"));
        }
        if difference <= 0.0 {
            return Err(bad("E11 must exceed E12"));
        }
        if sum <= 0.0 {
            return Err(bad("E11 + E12 must be positive"));
        }
        let l11 = sum.sqrt();
        let l21 = SQRT_2 * self.e13 / l11;
        let rest = self.e33 - l21 * l21;
        if rest <= 0.0 {
            return Err(bad("E33 (E11 + E12) must exceed 2 E13²"));
        }
        Ok([self.e44.ln(), difference.ln(), l11.ln(), l21, 0.5 * rest.ln()])
    }

    /// The moduli of a set of parameters.
    pub fn from_parameters(p: &[f64; 5]) -> Self {
        let parts = Parts::new(p);
        TransverseModuli {
            e11: 0.5 * (parts.plane + parts.difference),
            e12: 0.5 * (parts.plane - parts.difference),
            e13: parts.coupling / SQRT_2,
            e33: parts.axial,
            e44: 0.5 * parts.shear,
        }
    }
}

/// The stiffness in Walpole's basis: E = shear·G + difference·S + plane·pp + coupling·(pa + ap) + axial·aa.
#[derive(Clone, Copy)]
struct Parts {
    shear: f64,
    difference: f64,
    plane: f64,
    coupling: f64,
    axial: f64,
}

impl Parts {
    #[inline]
    fn new(p: &[f64; 5]) -> Self {
        let (l11, l21, l22) = (p[2].exp(), p[3], p[4].exp());
        Parts {
            shear: 2.0 * p[0].exp(),
            difference: p[1].exp(),
            plane: l11 * l11,
            coupling: l11 * l21,
            axial: l21 * l21 + l22 * l22,
        }
    }
}

/// The orthogonal parts of strain about an axis, as 6-vectors and one projector.
#[derive(Clone, Debug, PartialEq)]
struct Frame {
    axis: Vec3,
    /// n⊗n.
    along: Mandel,
    /// (I − n⊗n)/√2.
    across: Mandel,
    /// Projector onto axial shear.
    shear: Mandel6,
}

impl Frame {
    fn new(axis: Vec3) -> Self {
        let along_tensor = axis * axis.transpose();
        let across_tensor = (Mat3::identity() - along_tensor) / SQRT_2;
        // Two unit vectors across the axis, the first from the coordinate direction least along it.
        let least = axis.iamin();
        let mut seed = Vec3::zeros();
        seed[least] = 1.0;
        let u = (seed - axis * axis[least]).normalize();
        let v = axis.cross(&u);
        let mut shear = Mandel6::zeros();
        for w in [u, v] {
            let basis = from_tensor(&((axis * w.transpose() + w * axis.transpose()) / SQRT_2));
            shear += basis * basis.transpose();
        }
        Frame {
            axis,
            along: from_tensor(&along_tensor),
            across: from_tensor(&across_tensor),
            shear,
        }
    }
}

/// ε taken apart.
struct Split {
    along: f64,
    across: f64,
    /// S ε.
    deviator: Mandel,
    /// G ε.
    shear: Mandel,
}

/// A transversely isotropic material with strain-dependent moduli.
#[derive(Clone, Debug, PartialEq)]
pub struct TransverseRbf {
    parameters: LinearRbf<4, 5>,
    /// None without centres.
    cardinal: Option<Cardinal>,
    range: Range<4>,
    frame: Frame,
}

impl TransverseRbf {
    /// Constant moduli \[MPa\], axis along z, without limits of strain.
    ///
    /// # Errors
    /// If the stiffness is not positive definite.
    pub fn linear(moduli: &TransverseModuli) -> Result<Self, LawError> {
        let parameters = LinearRbf::constant(moduli.parameters()?);
        Ok(TransverseRbf {
            parameters,
            cardinal: None,
            range: Range::UNBOUNDED,
            frame: Frame::new(Vec3::z()),
        })
    }

    /// The material with `moduli[i]` \[MPa\] at the invariants `centres[i]`, axis along z.
    ///
    /// # Errors
    /// If a stiffness is not positive definite, or two centres are one point.
    pub fn interpolating(
        centres: &[[f64; 4]],
        moduli: &[TransverseModuli],
        range: Range<4>,
    ) -> Result<Self, LawError> {
        let values = moduli
            .iter()
            .map(TransverseModuli::parameters)
            .collect::<Result<Vec<_>, _>>()?;
        let parameters = LinearRbf::interpolating(centres, &values)?;
        Ok(TransverseRbf {
            cardinal: cardinal_of(&parameters)?,
            parameters,
            range,
            frame: Frame::new(Vec3::z()),
        })
    }

    /// The material with these weights, as a record stores them, axis along z.
    ///
    /// # Errors
    /// If the counts differ, a number is not finite, or the weights do not sum to zero.
    pub fn from_weights(parameters: LinearRbf<4, 5>, range: Range<4>) -> Result<Self, LawError> {
        check_weights(&parameters.centres, &parameters.weights, &parameters.constant)?;
        Ok(TransverseRbf {
            cardinal: cardinal_of(&parameters)?,
            parameters,
            range,
            frame: Frame::new(Vec3::z()),
        })
    }

    /// Centres, weights and constants of the unconstrained parameters.
    pub fn parameters(&self) -> &LinearRbf<4, 5> {
        &self.parameters
    }

    /// The fitted range of the invariants.
    pub fn range(&self) -> &Range<4> {
        &self.range
    }

    /// The axis of symmetry, unit length.
    pub fn axis(&self) -> &Vec3 {
        &self.frame.axis
    }

    /// The invariants q of a strain, `(4)`.
    #[inline]
    pub fn invariants(&self, strain: &Mandel) -> [f64; 4] {
        invariants_of(&self.split(strain))
    }

    /// The secant moduli \[MPa\] at the invariants `q`, held to the fitted range.
    pub fn moduli(&self, q: &[f64; 4]) -> TransverseModuli {
        TransverseModuli::from_parameters(&self.parameters.value(&self.range.nearest(q)))
    }

    /// See [`super::law::Law::stress`].
    #[inline]
    pub fn stress(&self, strain: &Mandel) -> Mandel {
        let split = self.split(strain);
        let q = self.range.nearest(&invariants_of(&split));
        self.assemble_stress(&Parts::new(&self.parameters.value(&q)), &split)
    }

    /// See [`super::law::Law::stress_and_secant`].
    #[inline]
    pub fn stress_and_secant(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        let split = self.split(strain);
        let q = self.range.nearest(&invariants_of(&split));
        let parts = Parts::new(&self.parameters.value(&q));
        (
            self.assemble_stress(&parts, &split),
            self.assemble_stiffness(&parts),
        )
    }

    /// See [`super::law::Law::stress_and_tangent`].
    ///
    /// dT/dε = E + Σ_k (∂E/∂p_k ε) ⊗ ∂p_k/∂ε, part by part.
    pub fn stress_and_tangent(&self, strain: &Mandel) -> (Mandel, Mandel6) {
        let split = self.split(strain);
        let q = invariants_of(&split);
        let (p, mut slopes) = self.parameters.value_and_gradient(&self.range.nearest(&q));
        self.range.hold(&q, &mut slopes);
        let parts = Parts::new(&p);
        let mut tangent = self.assemble_stiffness(&parts);
        if !self.parameters.centres.is_empty() {
            let (_, by_deviator) = smooth_norm(split.deviator.norm_squared());
            let (_, by_shear) = smooth_norm(split.shear.norm_squared());
            let gradients = [
                self.frame.along,
                self.frame.across,
                split.deviator * by_deviator,
                split.shear * by_shear,
            ];
            let by_parameter = self.stress_by_parameter(&p, &parts, &split);
            for (stress_slope, row) in by_parameter.iter().zip(&slopes) {
                let slope = gradients[0] * row[0]
                    + gradients[1] * row[1]
                    + gradients[2] * row[2]
                    + gradients[3] * row[3];
                tangent += stress_slope * slope.transpose();
            }
        }
        (self.assemble_stress(&parts, &split), tangent)
    }

    /// See [`super::law::Law::young_modulus`]: E33 − 2 E13²/(E11 + E12), which is l22².
    pub fn young_modulus(&self, strain: &Mandel) -> f64 {
        let q = self.range.nearest(&self.invariants(strain));
        (2.0 * self.parameters.value(&q)[4]).exp()
    }

    /// See [`super::law::Law::in_range`].
    #[inline]
    pub fn in_range(&self, strain: &Mandel) -> bool {
        self.range.contains(&self.invariants(strain))
    }

    /// See [`super::law::Law::poisson_ratio_at_rest`]: E13/(E11 + E12).
    pub fn poisson_ratio_at_rest(&self) -> f64 {
        let m = self.moduli(&[0.0; 4]);
        m.e13 / (m.e11 + m.e12)
    }

    /// See [`super::law::Law::energy`]: ½ T·ε where the moduli do not depend on strain.
    pub fn energy(&self, strain: &Mandel) -> Option<f64> {
        let constant = self.parameters.weights.iter().flatten().all(|w| *w == 0.0);
        constant.then(|| 0.5 * self.stress(strain).dot(strain))
    }

    /// The unconstrained parameters at the centres, `(n × 5)`; the constants if there are no centres.
    pub fn values(&self) -> Vec<[f64; 5]> {
        if self.parameters.centres.is_empty() {
            return vec![self.parameters.constant];
        }
        let at = |q| self.parameters.value(q);
        self.parameters.centres.iter().map(at).collect()
    }

    /// The same centres and axis with other values of the unconstrained parameters, five numbers a centre.
    ///
    /// # Errors
    /// A wrong count, or a number that is no logarithm of a modulus (for l21: that is not finite).
    pub fn with_values(&self, values: &[f64]) -> Result<Self, LawError> {
        expect_count(self.values().len() * 5, values.len())?;
        let rows: Vec<[f64; 5]> = values
            .chunks_exact(5)
            .map(|v| [v[0], v[1], v[2], v[3], v[4]])
            .collect();
        for [axial_shear, difference, l11, l21, l22] in &rows {
            expect_logarithms(&[*axial_shear, *difference, *l11, *l22])?;
            if !l21.is_finite() {
                return Err(LawError::Coefficient {
                    field: "l21".into(),
                    value: *l21,
                    expected: "a finite number",
                });
            }
        }
        let mut law = self.clone();
        if self.parameters.centres.is_empty() {
            law.parameters.constant = rows[0];
        } else {
            law.parameters = LinearRbf::interpolating(&self.parameters.centres, &rows)?;
        }
        Ok(law)
    }

    /// ∂T/∂(value) at fixed strain, in the order of [`TransverseRbf::with_values`]: the cardinal functions times
    /// ∂T/∂p_k.
    pub fn stress_by_values(&self, strain: &Mandel) -> Vec<Mandel> {
        let split = self.split(strain);
        let q = self.range.nearest(&invariants_of(&split));
        let p = self.parameters.value(&q);
        let by_parameter = self.stress_by_parameter(&p, &Parts::new(&p), &split);
        let shares = match &self.cardinal {
            Some(cardinal) => cardinal.values(&self.parameters.distances(&q)),
            None => vec![1.0],
        };
        shares
            .iter()
            .flat_map(|share| by_parameter.map(|slope| slope * *share))
            .collect()
    }

    /// The same moduli at other centres, four invariants a centre.
    ///
    /// # Errors
    /// A wrong count, or two centres at one point.
    pub fn with_centres(&self, centres: &[f64]) -> Result<Self, LawError> {
        expect_count(self.parameters.centres.len() * 4, centres.len())?;
        if centres.is_empty() {
            return Ok(self.clone());
        }
        let rows: Vec<[f64; 4]> = centres
            .chunks_exact(4)
            .map(|c| [c[0], c[1], c[2], c[3]])
            .collect();
        let parameters = LinearRbf::interpolating(&rows, &self.values())?;
        let mut law = TransverseRbf::from_weights(parameters, self.range)?;
        law.frame = self.frame.clone();
        Ok(law)
    }

    /// ∂T/∂(invariant of a centre) at fixed strain and fixed parameters at the centres, in the order of
    /// [`TransverseRbf::with_centres`] \[MPa\].
    pub fn stress_by_centres(&self, strain: &Mandel) -> Vec<Mandel> {
        let Some(cardinal) = &self.cardinal else {
            return Vec::new();
        };
        let split = self.split(strain);
        let q = self.range.nearest(&invariants_of(&split));
        let p = self.parameters.value(&q);
        let by_parameter = self.stress_by_parameter(&p, &Parts::new(&p), &split);
        let slopes = self.parameters.value_by_centres(&q, cardinal);
        slopes
            .iter()
            .flat_map(|slope| {
                std::array::from_fn::<Mandel, 4, _>(|d| (0..5).map(|k| by_parameter[k] * slope[k][d]).sum())
            })
            .collect()
    }

    /// See [`super::law::Law::rotated`].
    pub fn rotated(&self, axis: &Vec3) -> Self {
        let mut turned = self.clone();
        // `try_normalize` answers None for zero and for NaN.
        if let Some(unit) = axis
            .try_normalize(0.0)
            .filter(|u| u.iter().all(|x| x.is_finite()))
        {
            turned.frame = Frame::new(unit);
        }
        turned
    }

    /// ∂T/∂p_k = ∂E/∂p_k ε, written out part by part.
    fn stress_by_parameter(&self, p: &[f64; 5], parts: &Parts, split: &Split) -> [Mandel; 5] {
        let frame = &self.frame;
        let (l11, l21, l22) = (p[2].exp(), p[3], p[4].exp());
        [
            split.shear * parts.shear,
            split.deviator * parts.difference,
            frame.across * (2.0 * parts.plane * split.across + parts.coupling * split.along)
                + frame.along * (parts.coupling * split.across),
            frame.across * (l11 * split.along) + frame.along * (l11 * split.across + 2.0 * l21 * split.along),
            frame.along * (2.0 * l22 * l22 * split.along),
        ]
    }

    #[inline]
    fn split(&self, strain: &Mandel) -> Split {
        let along = self.frame.along.dot(strain);
        let across = self.frame.across.dot(strain);
        let shear = self.frame.shear * strain;
        let deviator = strain - self.frame.along * along - self.frame.across * across - shear;
        Split {
            along,
            across,
            deviator,
            shear,
        }
    }

    #[inline]
    fn assemble_stress(&self, parts: &Parts, split: &Split) -> Mandel {
        split.shear * parts.shear
            + split.deviator * parts.difference
            + self.frame.across * (parts.plane * split.across + parts.coupling * split.along)
            + self.frame.along * (parts.coupling * split.across + parts.axial * split.along)
    }

    fn assemble_stiffness(&self, parts: &Parts) -> Mandel6 {
        let (a, p) = (&self.frame.along, &self.frame.across);
        let d = parts.difference;
        // S is the identity less the other three projectors.
        let mut e = self.frame.shear * (parts.shear - d);
        for j in 0..6 {
            e[(j, j)] += d;
            let by_across = (parts.plane - d) * p[j] + parts.coupling * a[j];
            let by_along = parts.coupling * p[j] + (parts.axial - d) * a[j];
            for i in 0..6 {
                e[(i, j)] += p[i] * by_across + a[i] * by_along;
            }
        }
        e
    }
}

#[inline]
fn invariants_of(split: &Split) -> [f64; 4] {
    let (deviator, _) = smooth_norm(split.deviator.norm_squared());
    let (shear, _) = smooth_norm(split.shear.norm_squared());
    [split.along, split.across, deviator, shear]
}
