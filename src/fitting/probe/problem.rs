//! Residual and Jacobian of all presses at equilibrium.
//!
//! ```text
//! r = √w (x(θ) − x̄)/σ  over all readings,      s (θ_j − θ_j')/τ  over neighbouring centres
//!
//! ∂x/∂θ = S ∂u/∂p ∂p/∂θ,    K_T ∂u/∂p = −∂f_int/∂p
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | θ, p | what the fit moves; the law's parameters | see [`super::coordinates`] |
//! | x, x̄, σ, w | displacement of a marker along a direction, simulated, measured, its deviation, the example's weight | mm, mm, mm, – |
//! | S, K_T | shape functions at the markers; the consistent tangent at the equilibrium | –, N/mm |
//! | s | root mean square of r/√w in the fit before: noise and what the model cannot follow | – |
//! | τ = 1 | neighbouring centres differ by about a factor e, unless the data say more | – |
//!
//! Where the centres move too, each of their invariants has a third kind of row, s (c − c₀)/(½ d), with d the distance to the
//! nearest centre at the start.
//!
//! The second kind of row is what a Bayesian would call a prior. With thousands of readings it moves what they tell by less
//! than their own uncertainty, and it decides what they don't. Equation (8.3) of Bickel 2010, all examples at once, with
//! derivatives that include the change of rotation and strain (his appendix B leaves both out).

use super::coordinates::Coordinates;
use super::press::{Failure, Levels, Press, PressedSpecimen};
use crate::fem::sensitivity::Slopes;
use crate::material::law::{Law, LawError};
use crate::math::mandel::Mandel;
use crate::numerics::least_squares::{News, Problem};
use nalgebra::DMatrix;

/// τ.
const TIE_WIDTH: f64 = 1.0;
/// A centre moves by about this share of the distance to its nearest neighbour, unless the data say more.
const CENTRE_WIDTH: f64 = 0.5;
/// The same about the start, for the homogeneous law, which has no neighbours.
const ANCHOR_WIDTH: f64 = 3.0;

/// What holds parameters where the data are silent: one row each, `scale (θ_a − b)`.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Tie {
    /// θ_a to θ_b.
    Neighbour(usize, usize),
    /// θ_a to a value.
    Value(usize, f64),
}

/// Do the centres move, but for the one at rest?
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CentresMove {
    Yes,
    No,
}

/// Invariants of all centres of `law` but the first, which stays at rest.
pub(super) fn free_centres(law: &Law) -> Vec<f64> {
    let all = law.centres();
    all.get(at_rest(law)..).map_or(Vec::new(), <[f64]>::to_vec)
}

/// Number of invariants of one centre.
fn at_rest(law: &Law) -> usize {
    match law {
        Law::TransverselyIsotropic(_) => 4,
        _ => 3,
    }
}

/// `law` with θ: its moduli, then its centres if they move.
pub(super) fn put(coordinates: Coordinates, law: &Law, theta: &[f64], moved: usize) -> Result<Law, LawError> {
    let (values, places) = theta.split_at(theta.len().saturating_sub(moved));
    let law = coordinates.put(law, values)?;
    if places.is_empty() {
        return Ok(law);
    }
    let mut centres = law.centres();
    let first = at_rest(&law).min(centres.len());
    for (centre, place) in centres[first..].iter_mut().zip(places) {
        *centre = *place;
    }
    law.with_centres(&centres)
}

/// The least-squares problem of one law's parameters.
pub(super) struct ProbeProblem<'a> {
    pub pressed: &'a PressedSpecimen<'a>,
    /// The presses that are fitted.
    pub which: &'a [usize],
    /// Its parameters are replaced.
    pub law: Law,
    pub coordinates: Coordinates,
    /// Each with its scale.
    ties: Vec<(Tie, f64)>,
    /// Numbers of θ that are invariants of centres; they come last.
    moved: usize,
    pub cancelled: &'a (dyn Fn() -> bool + Sync),
    pub news: &'a mut dyn FnMut(&News),
    /// The state that was asked last.
    last: Option<(Law, Vec<Levels>)>,
    /// The best state.
    pub best: Option<(Law, Vec<Levels>)>,
    /// Why the last state could not be evaluated.
    pub failure: Option<Failure>,
}

impl<'a> ProbeProblem<'a> {
    /// Ties between the centres of `law`, or to its values if it has no centres; `noise` is s, `centres` whether they move.
    pub fn new(
        pressed: &'a PressedSpecimen<'a>,
        which: &'a [usize],
        law: &Law,
        coordinates: Coordinates,
        (noise, centres): (f64, CentresMove),
        cancelled: &'a (dyn Fn() -> bool + Sync),
        news: &'a mut dyn FnMut(&News),
    ) -> ProbeProblem<'a> {
        let n = coordinates.per_centre();
        let theta = coordinates.read(law);
        let (ties, width): (Vec<Tie>, f64) = if theta.len() == n {
            let anchors = theta.iter().enumerate().map(|(k, t)| Tie::Value(k, *t));
            (anchors.collect(), ANCHOR_WIDTH)
        } else {
            let pairs = super::centres::neighbours(law);
            let all = pairs
                .iter()
                .flat_map(|&(i, j)| (0..n).map(move |k| Tie::Neighbour(i * n + k, j * n + k)));
            (all.collect(), TIE_WIDTH)
        };
        let mut ties: Vec<(Tie, f64)> = ties.into_iter().map(|t| (t, noise / width)).collect();
        let mut moved = 0;
        if centres == CentresMove::Yes {
            let free = free_centres(law);
            moved = free.len();
            let places = free.iter().zip(super::centres::spacings(law));
            ties.extend(places.enumerate().map(|(k, (place, spacing))| {
                let width = (CENTRE_WIDTH * spacing).max(f64::MIN_POSITIVE);
                (Tie::Value(theta.len() + k, *place), noise / width)
            }));
        }
        ProbeProblem {
            pressed,
            which,
            law: law.clone(),
            coordinates,
            ties,
            moved,
            cancelled,
            news,
            last: None,
            best: None,
            failure: None,
        }
    }

    fn data(&self, equilibria: &[Levels]) -> Vec<f64> {
        residuals(self.pressed, self.which, equilibria)
    }
}

/// Number of readings of the presses `which`.
pub(super) fn count(pressed: &PressedSpecimen, which: &[usize]) -> usize {
    let seen = |&k: &usize| pressed.presses[k].readings.iter().flatten().flatten().count();
    which.iter().map(seen).sum()
}

/// √w (x − x̄)/σ over the readings of the presses `which`, level by level.
pub(super) fn residuals(pressed: &PressedSpecimen, which: &[usize], equilibria: &[Levels]) -> Vec<f64> {
    let mut rows = Vec::new();
    for (&k, levels) in which.iter().zip(equilibria) {
        let press = &pressed.presses[k];
        let weight = press.weight.sqrt();
        for ((u, readings), deviations) in levels.iter().zip(&press.readings).zip(&press.deviations) {
            let simulated = press.read(u);
            for ((x, reading), deviation) in simulated.iter().zip(readings).zip(deviations) {
                if let Some(measured) = reading {
                    rows.push(weight * (x - measured) / deviation);
                }
            }
        }
    }
    rows
}

/// The rows of ∂x/∂p that belong to [`residuals`], scaled alike, `(readings × numbers)`.
pub(super) fn data_jacobian(
    pressed: &PressedSpecimen,
    which: &[usize],
    law: &Law,
    equilibria: &[Levels],
    slopes: &Slopes,
) -> Result<DMatrix<f64>, Failure> {
    let sensors = |press: &Press| press.sensors.clone();
    let found = pressed.derivatives(law, which, equilibria, slopes, &sensors, &|_| Vec::new())?;
    let parameters = slopes(law, &Mandel::zeros()).len();
    let mut rows: Vec<nalgebra::RowDVector<f64>> = Vec::new();
    for (&k, levels) in which.iter().zip(&found) {
        let press = &pressed.presses[k];
        let weight = press.weight.sqrt();
        for ((level, readings), deviations) in levels.iter().zip(&press.readings).zip(&press.deviations) {
            for ((row, reading), deviation) in level.row_iter().zip(readings).zip(deviations) {
                if reading.is_some() {
                    rows.push(row.columns(0, parameters) * (weight / deviation));
                }
            }
        }
    }
    Ok(DMatrix::from_fn(rows.len(), parameters, |i, j| rows[i][j]))
}

impl Problem for ProbeProblem<'_> {
    fn residual(&mut self, theta: &[f64]) -> Option<Vec<f64>> {
        self.last = None;
        let law = put(self.coordinates, &self.law, theta, self.moved).ok()?;
        match self.pressed.equilibria(&law, self.which, self.cancelled) {
            Ok(equilibria) => {
                let mut rows = self.data(&equilibria);
                rows.extend(self.ties.iter().map(|(tie, scale)| {
                    scale
                        * match *tie {
                            Tie::Neighbour(a, b) => theta[a] - theta[b],
                            Tie::Value(a, value) => theta[a] - value,
                        }
                }));
                self.last = Some((law, equilibria));
                Some(rows)
            }
            Err(failure) => {
                self.failure = Some(failure);
                None
            }
        }
    }

    fn jacobian(&mut self, theta: &[f64]) -> Option<DMatrix<f64>> {
        let (law, equilibria) = self.last.as_ref()?;
        let numbers = match self.moved {
            0 => data_jacobian(
                self.pressed,
                self.which,
                law,
                equilibria,
                &Law::stress_by_parameters,
            ),
            _ => {
                let first = at_rest(law);
                let all = move |law: &Law, strain: &Mandel| {
                    let mut slopes = law.stress_by_parameters(strain);
                    slopes.extend(law.stress_by_centres(strain).split_off(first));
                    slopes
                };
                data_jacobian(self.pressed, self.which, law, equilibria, &all)
            }
        };
        let values = theta.len() - self.moved;
        let data = match numbers {
            Ok(mut data) => {
                let own = data.columns(0, values) * self.coordinates.slope(&theta[..values]);
                data.columns_mut(0, values).copy_from(&own);
                data
            }
            Err(failure) => {
                self.failure = Some(failure);
                return None;
            }
        };
        let rows = data.nrows();
        let mut jacobian = data.resize_vertically(rows + self.ties.len(), 0.0);
        for (i, (tie, scale)) in self.ties.iter().enumerate() {
            match *tie {
                Tie::Neighbour(a, b) => {
                    jacobian[(rows + i, a)] = *scale;
                    jacobian[(rows + i, b)] = -scale;
                }
                Tie::Value(a, _) => jacobian[(rows + i, a)] = *scale,
            }
        }
        Some(jacobian)
    }

    fn goes_on(&mut self, news: &News) -> bool {
        // It was asked last, and found better than those before.
        self.best = self.last.take();
        (self.news)(news);
        !(self.cancelled)()
    }
}
