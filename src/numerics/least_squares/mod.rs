//! Nonlinear least squares by Levenberg and Marquardt's method.
//!
//! ```text
//! min_x ½ |r(x)|²,   l ≤ x ≤ u:      (JᵀJ + λ D) s = −Jᵀ r,   x⁺ = clamp(x + s),   D = diag(JᵀJ)
//! ```
//!
//! | symbol | meaning | size |
//! |---|---|---|
//! | x, l, u | parameters and their bounds | n |
//! | r | residuals | m ≥ 1 |
//! | J = ∂r/∂x | Jacobian, the problem's own or by central differences | m × n |
//! | λ | damping, divided by 9 after a step that helps and multiplied by 11 after one that does not | – |
//!
//! D holds the largest squared column norms met so far (Moré 1978), so a scale of one parameter does not matter. A
//! parameter at its bound whose gradient points outward is left out of the step. Made for a few dozen parameters and
//! smooth residuals: the normal equations square the condition number, which costs half the digits. Sources: Marquardt
//! 1963; Moré 1978, The Levenberg–Marquardt algorithm: implementation and theory; Transtrum & Sethna 2012 for the
//! factors. [`Covariance`] says how well the data determine what was found.

mod covariance;
mod differences;

pub use covariance::{Covariance, SILENT, Undetermined};

use differences::Differences;
use nalgebra::{DMatrix, DVector};

/// How to minimise.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Most steps tried (each one a Jacobian or a rejected step). Default 200.
    pub max_iterations: usize,
    /// Stops when no component of Jᵀr, scaled by |J_j| |r|, is larger than this. Default 1e-10.
    pub gradient_tolerance: f64,
    /// Stops when the step is smaller than this times the parameters. Default 1e-12.
    pub step_tolerance: f64,
    /// Stops when a step lowers the cost by less than this part of it. Default 1e-14.
    pub cost_tolerance: f64,
    /// Stops when the cost is no larger than this: nothing is left that the residual could tell. Default 0.
    pub negligible_cost: f64,
    /// λ at the start. Default 1e-3.
    pub initial_damping: f64,
    /// Step of the central differences relative to max(|x_j|, 1e-3). Default 6e-6, the cube root of the rounding unit.
    pub difference_step: f64,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            max_iterations: 200,
            gradient_tolerance: 1e-10,
            step_tolerance: 1e-12,
            cost_tolerance: 1e-14,
            negligible_cost: 0.0,
            initial_damping: 1e-3,
            difference_step: 6e-6,
        }
    }
}

/// Why a minimisation could not start or go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LeastSquaresError {
    /// An option out of its range.
    #[error("option {field} = {value}: expected {expected}")]
    Option {
        /// Name of the field.
        field: &'static str,
        /// The value found.
        value: f64,
        /// What was expected.
        expected: &'static str,
    },
    /// Bounds that don't fit the parameters.
    #[error(
        "parameter {index}: bounds {low} to {high} are no interval, or their count is not that of the parameters"
    )]
    Bounds {
        /// Which parameter, from 0.
        index: usize,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// Nothing to fit.
    #[error("{parameters} parameters and {residuals} residuals: both must be at least 1")]
    Empty {
        /// Number of parameters.
        parameters: usize,
        /// Number of residuals.
        residuals: usize,
    },
    /// The residual or its derivatives can't be evaluated at the start.
    #[error("the residual or its derivatives can't be evaluated at the start")]
    NoStart,
    /// The residual at the start is not finite.
    #[error("residual {index} is {value} at the start")]
    Start {
        /// Which residual, from 0.
        index: usize,
        /// The value found.
        value: f64,
    },
}

/// Why the minimisation stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The gradient vanished: a stationary point.
    Gradient,
    /// The step became negligible.
    Step,
    /// The cost no longer falls.
    Cost,
    /// The iterations ran out.
    Iterations,
    /// The problem asked to end.
    Cancelled,
}

impl std::fmt::Display for Stop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Stop::Gradient => "the gradient vanished",
            Stop::Step => "no step helps any more",
            Stop::Cost => "the error no longer falls",
            Stop::Iterations => "the iterations ran out",
            Stop::Cancelled => "stopped on request",
        })
    }
}

/// What a minimisation found.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The best parameters, `(n)`.
    pub parameters: Vec<f64>,
    /// ½ |r|² there.
    pub cost: f64,
    /// Steps tried.
    pub iterations: usize,
    /// Calls of the residual function.
    pub evaluations: usize,
    /// Why it stopped.
    pub stop: Stop,
    /// r there, `(m)`.
    pub residual: Vec<f64>,
    /// J there, `(m × n)`.
    pub jacobian: DMatrix<f64>,
}

impl Outcome {
    /// Whether it stopped because there was nothing left to gain.
    pub fn converged(&self) -> bool {
        !matches!(self.stop, Stop::Iterations | Stop::Cancelled)
    }
}

impl Options {
    /// # Errors
    /// Names the first field that is out of its range.
    pub fn check(&self) -> Result<(), LeastSquaresError> {
        let positive = [
            ("gradient_tolerance", self.gradient_tolerance),
            ("step_tolerance", self.step_tolerance),
            ("cost_tolerance", self.cost_tolerance),
            ("initial_damping", self.initial_damping),
            ("difference_step", self.difference_step),
        ];
        for (field, value) in positive {
            if !(value > 0.0 && value < 1e3) {
                return Err(LeastSquaresError::Option {
                    field,
                    value,
                    expected: "a number in (0, 1000)",
                });
            }
        }
        if self.negligible_cost.is_nan() || self.negligible_cost < 0.0 {
            return Err(LeastSquaresError::Option {
                field: "negligible_cost",
                value: self.negligible_cost,
                expected: "0 or a positive number",
            });
        }
        if self.max_iterations == 0 {
            let expected = "at least 1";
            return Err(LeastSquaresError::Option {
                field: "max_iterations",
                value: 0.0,
                expected,
            });
        }
        Ok(())
    }
}

/// What is minimised.
pub trait Problem {
    /// r(x), `(m)`; `None`, or numbers that are not finite, where it can't be evaluated: the step is then shortened.
    fn residual(&mut self, x: &[f64]) -> Option<Vec<f64>>;

    /// ∂r/∂x, `(m × n)`, at the point where the residual was asked last; `None` counts as a residual that can't be
    /// evaluated.
    fn jacobian(&mut self, x: &[f64]) -> Option<DMatrix<f64>>;

    /// Told of the start and of each better point; false ends the minimisation there.
    fn goes_on(&mut self, _news: &News) -> bool {
        true
    }
}

/// Where a minimisation is.
#[derive(Clone, Copy, Debug)]
pub struct News<'a> {
    /// Steps tried so far.
    pub iterations: usize,
    /// The best point, `(n)`.
    pub parameters: &'a [f64],
    /// ½ |r|² there.
    pub cost: f64,
}

/// Minimises ½ |r(x)|² from `start`, `(n)`, within `bounds` (lower and upper per parameter; an empty slice for none),
/// with Jacobians by central differences. A step to a point where the residual is not finite is rejected.
///
/// # Errors
/// Options, bounds or sizes that make no problem, or a residual that is not finite at the start.
pub fn minimise(
    residual: &mut dyn FnMut(&[f64]) -> Vec<f64>,
    start: &[f64],
    bounds: &[(f64, f64)],
    options: &Options,
) -> Result<Outcome, LeastSquaresError> {
    options.check()?;
    check_bounds(bounds, start.len())?;
    let mut first = start.to_vec();
    clamp(&mut first, bounds);
    let rows = residual(&first).len();
    let mut problem = Differences {
        residual,
        bounds,
        step: options.difference_step,
        rows,
        evaluations: 1,
    };
    let mut outcome = minimise_problem(&mut problem, start, bounds, options)?;
    outcome.evaluations += problem.evaluations;
    Ok(outcome)
}

/// The best point of a minimisation.
struct Best {
    x: Vec<f64>,
    r: DVector<f64>,
    jacobian: DMatrix<f64>,
    cost: f64,
}

/// Minimises ½ |r(x)|² of a problem that gives its own Jacobian, as [`minimise`].
///
/// # Errors
/// Options, bounds or sizes that make no problem, or a residual or Jacobian that can't be evaluated at the start.
pub fn minimise_problem(
    problem: &mut dyn Problem,
    start: &[f64],
    bounds: &[(f64, f64)],
    options: &Options,
) -> Result<Outcome, LeastSquaresError> {
    options.check()?;
    check_bounds(bounds, start.len())?;
    let mut best = first(problem, start, bounds)?;
    let mut done = Progress {
        iterations: 0,
        evaluations: 1,
        damping: options.initial_damping,
        scale: DVector::zeros(start.len()),
    };
    let mut stop = (!tell(problem, &best, &done)).then_some(Stop::Cancelled);
    while stop.is_none() && done.iterations < options.max_iterations {
        stop = advance(problem, &mut best, &mut done, bounds, options);
        if stop.is_none() && !tell(problem, &best, &done) {
            stop = Some(Stop::Cancelled);
        }
    }
    Ok(Outcome {
        parameters: best.x,
        cost: best.cost,
        iterations: done.iterations,
        evaluations: done.evaluations,
        stop: stop.unwrap_or(Stop::Iterations),
        residual: best.r.as_slice().to_vec(),
        jacobian: best.jacobian,
    })
}

struct Progress {
    iterations: usize,
    evaluations: usize,
    damping: f64,
    /// Largest squared column norms met.
    scale: DVector<f64>,
}

fn tell(problem: &mut dyn Problem, best: &Best, done: &Progress) -> bool {
    problem.goes_on(&News {
        iterations: done.iterations,
        parameters: &best.x,
        cost: best.cost,
    })
}

fn first(problem: &mut dyn Problem, start: &[f64], bounds: &[(f64, f64)]) -> Result<Best, LeastSquaresError> {
    let mut x = start.to_vec();
    clamp(&mut x, bounds);
    let r = DVector::from_vec(problem.residual(&x).ok_or(LeastSquaresError::NoStart)?);
    check_start(&r, x.len())?;
    let jacobian = problem
        .jacobian(&x)
        .filter(|j| j.shape() == (r.len(), x.len()))
        .ok_or(LeastSquaresError::NoStart)?;
    let cost = 0.5 * r.norm_squared();
    Ok(Best { x, r, jacobian, cost })
}

/// Goes from the best point to a better one; why there is none, or no need for one.
fn advance(
    problem: &mut dyn Problem,
    best: &mut Best,
    done: &mut Progress,
    bounds: &[(f64, f64)],
    options: &Options,
) -> Option<Stop> {
    let n = best.x.len();
    let gradient = best.jacobian.tr_mul(&best.r);
    let mut normal = best.jacobian.tr_mul(&best.jacobian);
    let free: Vec<bool> = (0..n)
        .map(|j| is_free(best.x[j], gradient[j], bounds.get(j)))
        .collect();
    let flat = (0..n).all(|j| {
        !free[j] || gradient[j].abs() <= options.gradient_tolerance * normal[(j, j)].sqrt() * best.r.norm()
    });
    if flat {
        return Some(Stop::Gradient);
    }
    rescale(&mut done.scale, &mut normal, &free);
    loop {
        done.iterations += 1;
        let attempt = step(&normal, &gradient, &done.scale, &free, done.damping)
            .map(|s| attempt(problem, best, &s, bounds));
        done.evaluations += usize::from(attempt.is_some());
        match attempt {
            Some(Attempt::Better(better)) => {
                let small = best.cost - better.cost <= options.cost_tolerance * best.cost;
                *best = *better;
                done.damping = (done.damping / 9.0).max(1e-15);
                return (small || best.cost <= options.negligible_cost).then_some(Stop::Cost);
            }
            Some(Attempt::Worse { moved }) if moved <= options.step_tolerance => return Some(Stop::Step),
            // A worse point, or normal equations that are not definite: shorter steps, nearer to descent.
            _ => done.damping *= 11.0,
        }
        if done.damping > 1e18 {
            return Some(Stop::Step);
        }
        if done.iterations >= options.max_iterations {
            return Some(Stop::Iterations);
        }
    }
}

/// The largest curvature that each parameter has shown goes into `scale`; a parameter held at its bound leaves `normal`.
fn rescale(scale: &mut DVector<f64>, normal: &mut DMatrix<f64>, free: &[bool]) {
    for j in 0..free.len() {
        scale[j] = scale[j].max(normal[(j, j)]).max(1e-300);
        if !free[j] {
            normal.row_mut(j).fill(0.0);
            normal.column_mut(j).fill(0.0);
            normal[(j, j)] = 1.0;
        }
    }
}

/// What came of one step.
enum Attempt {
    /// A better point.
    Better(Box<Best>),
    /// The point is no better, or can't be evaluated; how far the largest move was, relative to its parameter.
    Worse { moved: f64 },
}

fn attempt(problem: &mut dyn Problem, best: &Best, step: &DVector<f64>, bounds: &[(f64, f64)]) -> Attempt {
    let mut x: Vec<f64> = best.x.iter().zip(step.iter()).map(|(x, s)| x + s).collect();
    clamp(&mut x, bounds);
    let moved = x
        .iter()
        .zip(&best.x)
        .map(|(t, x)| (t - x).abs() / (x.abs() + 1e-12))
        .fold(0.0, f64::max);
    let Some(r) = problem.residual(&x).map(DVector::from_vec) else {
        return Attempt::Worse { moved };
    };
    let cost = 0.5 * r.norm_squared();
    if r.len() != best.r.len() || cost.is_nan() || cost >= best.cost {
        return Attempt::Worse { moved };
    }
    match problem.jacobian(&x) {
        Some(jacobian) if jacobian.shape() == best.jacobian.shape() => {
            Attempt::Better(Box::new(Best { x, r, jacobian, cost }))
        }
        _ => Attempt::Worse { moved },
    }
}

/// Something to minimise, and finite at the start.
fn check_start(r: &DVector<f64>, parameters: usize) -> Result<(), LeastSquaresError> {
    if parameters == 0 || r.is_empty() {
        return Err(LeastSquaresError::Empty {
            parameters,
            residuals: r.len(),
        });
    }
    match r.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(LeastSquaresError::Start {
            index,
            value: r[index],
        }),
        None => Ok(()),
    }
}

fn check_bounds(bounds: &[(f64, f64)], n: usize) -> Result<(), LeastSquaresError> {
    for (index, &(low, high)) in bounds.iter().enumerate() {
        // NaN fails the comparison.
        if bounds.len() != n || !matches!(low.partial_cmp(&high), Some(std::cmp::Ordering::Less)) {
            return Err(LeastSquaresError::Bounds { index, low, high });
        }
    }
    Ok(())
}

fn clamp(x: &mut [f64], bounds: &[(f64, f64)]) {
    for (value, &(low, high)) in x.iter_mut().zip(bounds) {
        *value = value.max(low).min(high);
    }
}

/// A parameter takes part in the step unless it lies at a bound and descent would leave the interval.
fn is_free(x: f64, gradient: f64, bound: Option<&(f64, f64)>) -> bool {
    bound.is_none_or(|&(low, high)| !(x <= low && gradient > 0.0 || x >= high && gradient < 0.0))
}

fn step(
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    scale: &DVector<f64>,
    free: &[bool],
    damping: f64,
) -> Option<DVector<f64>> {
    let mut damped = normal.clone();
    for j in 0..free.len() {
        damped[(j, j)] += damping * scale[j];
    }
    let right = DVector::from_fn(free.len(), |j, _| if free[j] { -gradient[j] } else { 0.0 });
    damped
        .cholesky()
        .map(|factor| factor.solve(&right))
        .filter(|s| s.iter().all(|v| v.is_finite()))
}

#[cfg(test)]
mod tests;
