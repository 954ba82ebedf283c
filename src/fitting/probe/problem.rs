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
//! The second kind of row is what a Bayesian would call a prior. With thousands of readings it moves what they tell by less
//! than their own uncertainty, and it decides what they don't. Equation (8.3) of Bickel 2010, all examples at once, with
//! derivatives that include the change of rotation and strain (his appendix B leaves both out).

use super::coordinates::Coordinates;
use super::press::{Bench, Failure, Levels};
use crate::material::law::Law;
use crate::numerics::least_squares::{News, Problem};
use nalgebra::DMatrix;

/// τ.
const TIE_WIDTH: f64 = 1.0;
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

/// The least-squares problem of one law's parameters.
pub(super) struct ProbeProblem<'a> {
    pub bench: &'a Bench<'a>,
    /// The presses that are fitted.
    pub which: &'a [usize],
    /// Its parameters are replaced.
    pub law: Law,
    pub coordinates: Coordinates,
    ties: Vec<Tie>,
    tie_scale: f64,
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
    /// Ties between the centres of `law`, or to its values if it has no centres; `noise` is s.
    pub fn new(
        bench: &'a Bench<'a>,
        which: &'a [usize],
        law: &Law,
        coordinates: Coordinates,
        noise: f64,
        cancelled: &'a (dyn Fn() -> bool + Sync),
        news: &'a mut dyn FnMut(&News),
    ) -> ProbeProblem<'a> {
        let n = coordinates.per_centre();
        let theta = coordinates.read(law);
        let (ties, width) = if theta.len() == n {
            let anchors = theta.iter().enumerate().map(|(k, t)| Tie::Value(k, *t));
            (anchors.collect(), ANCHOR_WIDTH)
        } else {
            let pairs = super::centres::neighbours(law);
            let all = pairs
                .iter()
                .flat_map(|&(i, j)| (0..n).map(move |k| Tie::Neighbour(i * n + k, j * n + k)));
            (all.collect::<Vec<_>>(), TIE_WIDTH)
        };
        ProbeProblem {
            bench,
            which,
            law: law.clone(),
            coordinates,
            ties,
            tie_scale: noise / width,
            cancelled,
            news,
            last: None,
            best: None,
            failure: None,
        }
    }

    fn data(&self, equilibria: &[Levels]) -> Vec<f64> {
        residuals(self.bench, self.which, equilibria)
    }
}

/// Number of readings of the presses `which`.
pub(super) fn count(bench: &Bench, which: &[usize]) -> usize {
    let seen = |&k: &usize| bench.presses[k].readings.iter().flatten().flatten().count();
    which.iter().map(seen).sum()
}

/// √w (x − x̄)/σ over the readings of the presses `which`, level by level.
pub(super) fn residuals(bench: &Bench, which: &[usize], equilibria: &[Levels]) -> Vec<f64> {
    let mut rows = Vec::new();
    for (&k, levels) in which.iter().zip(equilibria) {
        let press = &bench.presses[k];
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

/// The rows of ∂x/∂p that belong to [`residuals`], scaled alike, `(readings × parameters)`.
pub(super) fn data_jacobian(
    bench: &Bench,
    which: &[usize],
    law: &Law,
    equilibria: &[Levels],
) -> Result<DMatrix<f64>, Failure> {
    let found = bench.derivatives(law, which, equilibria, &|press| press.sensors.clone(), &|_| {
        Vec::new()
    })?;
    let parameters = law.parameters().len();
    let mut rows: Vec<nalgebra::RowDVector<f64>> = Vec::new();
    for (&k, levels) in which.iter().zip(&found) {
        let press = &bench.presses[k];
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
        let law = self.coordinates.put(&self.law, theta).ok()?;
        match self.bench.equilibria(&law, self.which, self.cancelled) {
            Ok(equilibria) => {
                let mut rows = self.data(&equilibria);
                rows.extend(self.ties.iter().map(|tie| {
                    self.tie_scale
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
        let data = match data_jacobian(self.bench, self.which, law, equilibria) {
            Ok(data) => data * self.coordinates.slope(theta),
            Err(failure) => {
                self.failure = Some(failure);
                return None;
            }
        };
        let rows = data.nrows();
        let mut jacobian = data.resize_vertically(rows + self.ties.len(), 0.0);
        for (i, tie) in self.ties.iter().enumerate() {
            match *tie {
                Tie::Neighbour(a, b) => {
                    jacobian[(rows + i, a)] = self.tie_scale;
                    jacobian[(rows + i, b)] = -self.tie_scale;
                }
                Tie::Value(a, _) => jacobian[(rows + i, a)] = self.tie_scale,
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
