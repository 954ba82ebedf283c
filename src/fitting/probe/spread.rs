//! What the data leave open: the law's covariance, a bootstrap, and a band on each press's force–displacement curve.
//!
//! ```text
//! C_p = M s² (JᵀJ)⁻¹ Mᵀ,   M = ∂p/∂θ                        J with the ties' rows: they are what is known beforehand
//!
//! θ_b = θ̂ − (JᵀJ)⁻¹ Jᵀ (η_b ∘ r),   η_b = ±1 a marker       the b-th refit, linearised, of readings with other errors
//! x_b = x̂ + (∂x/∂θ)(θ_b − θ̂)                                its curve; the band holds 95 of 100
//! ```
//!
//! A marker's residuals at all levels change sign together: they are not independent, since glue, calibration and what the
//! model cannot follow are the same at every level (wild bootstrap by clusters, Cameron, Gelbach and Miller 2008). Residuals
//! are enlarged by (m/(m − n))^½ for the parameters that were fitted to them. Linearised: no equilibrium is solved again, so
//! the band is trustworthy where it is narrow.

use super::coordinates::Coordinates;
use super::press::{Failure, Levels, Press, PressedSpecimen};
use crate::fem::example::Sensor;
use crate::material::law::Law;
use crate::math::Vec3;
use crate::numerics::least_squares::{Covariance, Undetermined};
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A parameter less certain than this, in logarithms or as a ratio, is one that the data hardly tell: a factor of 1.6.
pub const WEAK: f64 = 0.5;

/// A press's force–displacement curve.
#[derive(Clone, Debug, PartialEq)]
pub struct PressCurve {
    /// Name of the example.
    pub press: String,
    /// Was it fitted, or held out?
    pub held_out: bool,
    /// Force along the probe at each level \[N\].
    pub forces_n: Vec<f64>,
    /// Displacement of the contact point along the probe \[mm\].
    pub fitted_mm: Vec<f64>,
    /// The same of the marker nearest to the contact point, simulated and measured where it was seen \[mm\].
    pub marker_mm: Vec<(f64, Option<f64>)>,
    /// Lower and upper end of the band on `fitted_mm`; empty without a bootstrap \[mm\].
    pub band_mm: Vec<[f64; 2]>,
}

/// How well the law is determined.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// Covariance of [`Law::parameters`], `(n × n)`.
    pub covariance: DMatrix<f64>,
    /// Where it comes from, in words.
    pub basis: String,
    /// Standard deviations of θ from the data alone, with their names; infinite where the data tell nothing.
    pub deviations: Vec<(String, f64)>,
    /// Combinations of θ that the data do not tell at all.
    pub undetermined: Vec<Undetermined>,
    /// Parameters at a bound, by name.
    pub at_bound: Vec<String>,
}

/// What the last minimisation leaves.
pub(super) struct Final<'a> {
    pub coordinates: Coordinates,
    pub theta: &'a [f64],
    pub free: &'a [bool],
    /// Residuals and Jacobian, the ties' rows last.
    pub residual: &'a [f64],
    pub jacobian: &'a DMatrix<f64>,
    /// Number of readings among them.
    pub data_rows: usize,
}

impl Final<'_> {
    /// (JᵀJ)⁻¹ with the ties; held parameters have zero rows. `None` if it is singular all the same.
    fn inverse(&self) -> Option<DMatrix<f64>> {
        let n = self.theta.len();
        let mut normal = self.jacobian.tr_mul(self.jacobian);
        for j in (0..n).filter(|&j| !self.free[j]) {
            normal.row_mut(j).fill(0.0);
            normal.column_mut(j).fill(0.0);
            normal[(j, j)] = 1.0;
        }
        let mut inverse = normal.cholesky()?.inverse();
        for j in (0..n).filter(|&j| !self.free[j]) {
            inverse.row_mut(j).fill(0.0);
            inverse.column_mut(j).fill(0.0);
        }
        inverse.iter().all(|x| x.is_finite()).then_some(inverse)
    }

    /// Covariance from the residuals.
    pub fn spread(&self) -> Option<Spread> {
        let data = self.jacobian.rows(0, self.data_rows).into_owned();
        let residual = &self.residual[..self.data_rows];
        let told = Covariance::new(residual, &data, self.free)?;
        let slope = self.coordinates.slope(self.theta);
        let covariance = &slope * self.inverse()? * slope.transpose() * told.variance;
        let silent = |k: usize| told.undetermined.iter().any(|u| u.direction[k].abs() > 0.1);
        let deviations = told.deviations();
        let named = |k: usize| {
            let deviation = if silent(k) { f64::INFINITY } else { deviations[k] };
            (self.coordinates.name(k), deviation)
        };
        Some(Spread {
            covariance,
            basis: "residuals".into(),
            deviations: (0..self.theta.len())
                .filter(|&k| self.free[k])
                .map(named)
                .collect(),
            undetermined: told.undetermined,
            at_bound: (0..self.theta.len())
                .filter(|&k| !self.free[k])
                .map(|k| self.coordinates.name(k))
                .collect(),
        })
    }

    /// Changes of θ in `count` refits, `(count × n)`; `marker_of_row` tells which residuals go together, `(readings)`.
    pub fn refits(&self, marker_of_row: &[usize], count: usize, seed: u64) -> Option<Vec<DVector<f64>>> {
        let inverse = self.inverse()?;
        let markers = marker_of_row.iter().max().map_or(0, |m| m + 1);
        let free = self.free.iter().filter(|f| **f).count();
        let rows = self.data_rows as f64;
        let enlarged = (rows / (rows - free as f64).max(1.0)).sqrt();
        // Σ of J_iᵀ r_i over each marker's rows: a refit is then a sum of as many vectors as there are markers.
        let mut pulls = vec![DVector::<f64>::zeros(self.theta.len()); markers];
        for (i, &marker) in marker_of_row.iter().enumerate() {
            pulls[marker] += self.jacobian.row(i).transpose() * (enlarged * self.residual[i]);
        }
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let refit = |_| {
            let mut pull = DVector::<f64>::zeros(self.theta.len());
            for p in &pulls {
                if random.r#gen::<bool>() {
                    pull += p;
                } else {
                    pull -= p;
                }
            }
            &inverse * pull * -1.0
        };
        Some((0..count).map(refit).collect())
    }
}

/// Covariance of the law's parameters over refits, about the fit itself.
pub(super) fn bootstrap_covariance(slope: &DMatrix<f64>, refits: &[DVector<f64>]) -> DMatrix<f64> {
    let n = slope.nrows();
    let sum = refits
        .iter()
        .map(|d| slope * d)
        .fold(DMatrix::zeros(n, n), |sum, d| sum + &d * d.transpose());
    sum / refits.len().max(1) as f64
}

/// The marker of each row of the residuals, counted over all presses.
pub(super) fn markers_of_rows(pressed: &PressedSpecimen, which: &[usize]) -> Vec<usize> {
    let (mut rows, mut first) = (Vec::new(), 0);
    for &k in which {
        let press = &pressed.presses[k];
        let points = press.point_of_component();
        for readings in &press.readings {
            let seen = readings.iter().zip(&points).filter(|(r, _)| r.is_some());
            rows.extend(seen.map(|(_, point)| first + point));
        }
        first += press.places.len();
    }
    rows
}

/// Curves of the presses `which`; with `refits` of θ (and ∂p/∂θ) a band on each.
///
/// # Errors
/// [`Failure`]: no derivatives at an equilibrium.
pub(super) fn curves(
    pressed: &PressedSpecimen,
    which: &[usize],
    law: &Law,
    equilibria: &[Levels],
    refits: Option<(&DMatrix<f64>, &[DVector<f64>])>,
) -> Result<Vec<PressCurve>, Failure> {
    let along =
        |press: &Press| -> Vec<(Sensor, Vec<Vec3>)> { vec![(press.probe.clone(), vec![press.direction])] };
    let slopes = match refits {
        Some(_) => {
            let slopes = &Law::stress_by_parameters;
            pressed.derivatives(law, which, equilibria, slopes, &along, &|_| Vec::new())?
        }
        None => vec![Vec::new(); which.len()],
    };
    let curve = |((&k, levels), slopes): ((&usize, &Levels), &Vec<DMatrix<f64>>)| {
        let press = &pressed.presses[k];
        let fitted: Vec<f64> = levels
            .iter()
            .map(|u| press.probe.read(u).dot(&press.direction))
            .collect();
        let band = match refits {
            Some((slope, refits)) => fitted
                .iter()
                .zip(slopes)
                .map(|(x, by)| band(*x, &(by * slope), refits))
                .collect(),
            None => Vec::new(),
        };
        PressCurve {
            press: press.name.clone(),
            held_out: press.held_out,
            forces_n: press.forces.iter().map(|f| f.dot(&press.direction)).collect(),
            marker_mm: nearest_marker(press, levels),
            fitted_mm: fitted,
            band_mm: band,
        }
    };
    Ok(which.iter().zip(equilibria).zip(&slopes).map(curve).collect())
}

/// Ends between which 95 of 100 refits lie.
fn band(x: f64, by_theta: &DMatrix<f64>, refits: &[DVector<f64>]) -> [f64; 2] {
    let mut found: Vec<f64> = refits.iter().map(|d| x + (by_theta * d)[0]).collect();
    found.sort_by(f64::total_cmp);
    let at = |share: f64| found.get(((found.len() - 1) as f64 * share).round() as usize);
    match found.is_empty() {
        true => [x, x],
        false => [at(0.025), at(0.975)].map(|v| v.copied().unwrap_or(x)),
    }
}

/// Displacement along the probe of the marker nearest to the contact point that was measured that way.
fn nearest_marker(press: &Press, levels: &Levels) -> Vec<(f64, Option<f64>)> {
    let points = press.point_of_component();
    let measures = |point: usize| -> Option<Vec<(usize, f64)>> {
        let directions = &press.sensors[point].1;
        let first = points.iter().position(|&p| p == point)?;
        let parts: Vec<(usize, f64)> = directions
            .iter()
            .enumerate()
            .map(|(d, n)| (first + d, n.dot(&press.direction)))
            .collect();
        // Orthonormal directions that span the probe's, or nearly.
        (parts.iter().map(|p| p.1 * p.1).sum::<f64>() > 0.95).then_some(parts)
    };
    let distance = |point: usize| (press.places[point] - press.contact_point).norm();
    let nearest = (0..press.places.len())
        .filter_map(|point| Some((point, measures(point)?)))
        .min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)));
    let Some((_, parts)) = nearest else {
        return Vec::new();
    };
    levels
        .iter()
        .zip(&press.readings)
        .map(|(u, readings)| {
            let simulated = press.read(u);
            let measured = parts.iter().map(|&(c, w)| Some(readings[c]? * w)).sum();
            (parts.iter().map(|&(c, w)| simulated[c] * w).sum(), measured)
        })
        .collect()
}
