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
//! | J = ∂r/∂x | Jacobian, by central differences | m × n |
//! | λ | damping, divided by 9 after a step that helps and multiplied by 11 after one that does not | – |
//!
//! D holds the largest squared column norms met so far (Moré 1978), so a scale of one parameter does not matter. A
//! parameter at its bound whose gradient points outward is left out of the step. Made for a few dozen parameters and
//! smooth residuals: the normal equations square the condition number, which costs half the digits. Sources: Marquardt
//! 1963; Moré 1978, The Levenberg–Marquardt algorithm: implementation and theory; Transtrum & Sethna 2012 for the
//! factors.

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
}

impl Outcome {
    /// Whether it stopped because there was nothing left to gain.
    pub fn converged(&self) -> bool {
        self.stop != Stop::Iterations
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

/// Minimises ½ |r(x)|² from `start`, `(n)`, within `bounds` (lower and upper per parameter; an empty slice for none).
/// A step to a point where the residual is not finite is rejected.
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
    let n = start.len();
    check_bounds(bounds, n)?;
    let mut x: Vec<f64> = start.to_vec();
    clamp(&mut x, bounds);
    let mut r = DVector::from_vec(residual(&x));
    let mut evaluations = 1;
    check_start(&r, n)?;
    let mut cost = 0.5 * r.norm_squared();
    let mut damping = options.initial_damping;
    let mut scale = DVector::<f64>::zeros(n);
    let mut iterations = 0;
    let mut stop = Stop::Iterations;
    'outer: while iterations < options.max_iterations {
        let jacobian = differences(residual, &x, r.len(), bounds, options.difference_step);
        evaluations += 2 * n;
        let gradient = jacobian.tr_mul(&r);
        let mut normal = jacobian.tr_mul(&jacobian);
        let free: Vec<bool> = (0..n)
            .map(|j| is_free(x[j], gradient[j], bounds.get(j)))
            .collect();
        let flat = (0..n).all(|j| {
            !free[j] || gradient[j].abs() <= options.gradient_tolerance * normal[(j, j)].sqrt() * r.norm()
        });
        if flat {
            stop = Stop::Gradient;
            break;
        }
        rescale(&mut scale, &mut normal, &free);
        loop {
            iterations += 1;
            let attempt = step(&normal, &gradient, &scale, &free, damping)
                .map(|s| attempt(residual, &x, &s, bounds, cost, r.len()));
            evaluations += usize::from(attempt.is_some());
            match attempt {
                Some(Attempt::Better(trial, trial_r, trial_cost)) => {
                    let small = cost - trial_cost <= options.cost_tolerance * cost;
                    (x, r, cost) = (trial, trial_r, trial_cost);
                    damping = (damping / 9.0).max(1e-15);
                    if small || cost == 0.0 {
                        stop = Stop::Cost;
                        break 'outer;
                    }
                    break;
                }
                Some(Attempt::Worse { moved }) if moved <= options.step_tolerance => {
                    stop = Stop::Step;
                    break 'outer;
                }
                // A worse point, or normal equations that are not definite: shorter steps, nearer to descent.
                _ => damping *= 11.0,
            }
            if damping > 1e18 {
                stop = Stop::Step;
                break 'outer;
            }
            if iterations >= options.max_iterations {
                break 'outer;
            }
        }
    }
    Ok(Outcome {
        parameters: x,
        cost,
        iterations,
        evaluations,
        stop,
    })
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
    /// Parameters, residual and cost of a better point.
    Better(Vec<f64>, DVector<f64>, f64),
    /// The point is no better, or not finite; how far the largest move was, relative to its parameter.
    Worse { moved: f64 },
}

fn attempt(
    residual: &mut dyn FnMut(&[f64]) -> Vec<f64>,
    x: &[f64],
    step: &DVector<f64>,
    bounds: &[(f64, f64)],
    cost: f64,
    rows: usize,
) -> Attempt {
    let mut trial: Vec<f64> = x.iter().zip(step.iter()).map(|(x, s)| x + s).collect();
    clamp(&mut trial, bounds);
    let r = DVector::from_vec(residual(&trial));
    let trial_cost = 0.5 * r.norm_squared();
    if r.len() == rows && trial_cost < cost {
        return Attempt::Better(trial, r, trial_cost);
    }
    let moved = trial
        .iter()
        .zip(x)
        .map(|(t, x)| (t - x).abs() / (x.abs() + 1e-12));
    Attempt::Worse {
        moved: moved.fold(0.0, f64::max),
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

/// Central differences, one-sided where a bound is in the way; a column that is not finite counts as zero.
fn differences(
    residual: &mut dyn FnMut(&[f64]) -> Vec<f64>,
    x: &[f64],
    rows: usize,
    bounds: &[(f64, f64)],
    relative: f64,
) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(rows, x.len());
    for j in 0..x.len() {
        let h = relative * x[j].abs().max(1e-3);
        let (mut up, mut down) = (x.to_vec(), x.to_vec());
        up[j] += h;
        down[j] -= h;
        clamp(&mut up, bounds);
        clamp(&mut down, bounds);
        let width = up[j] - down[j];
        let (above, below) = (residual(&up), residual(&down));
        for i in 0..rows.min(above.len()).min(below.len()) {
            let slope = (above[i] - below[i]) / width;
            jacobian[(i, j)] = if slope.is_finite() { slope } else { 0.0 };
        }
    }
    jacobian
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NIST StRD, Misra1a (lower difficulty): y = b1 (1 − exp(−b2 x)). Certified values from the data file.
    #[test]
    fn nist_misra1a() {
        let y = [
            10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78,
        ];
        let x = [
            77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0,
        ];
        let mut residual = |b: &[f64]| {
            (0..14)
                .map(|i| b[0] * (1.0 - (-b[1] * x[i]).exp()) - y[i])
                .collect::<Vec<_>>()
        };
        for start in [[500.0, 0.0001], [250.0, 0.0005]] {
            let outcome = minimise(&mut residual, &start, &[], &Options::default()).unwrap();
            assert!(outcome.converged(), "{outcome:?}");
            let certified = [2.3894212918E+02, 5.5015643181E-04];
            for (b, c) in outcome.parameters.iter().zip(certified) {
                assert!((b / c - 1.0).abs() < 1e-7, "{b} against {c}");
            }
            assert!((2.0 * outcome.cost / 1.2455138894E-01 - 1.0).abs() < 1e-9);
        }
    }

    /// NIST StRD, MGH09 (higher difficulty): y = b1 (x² + b2 x)/(x² + b3 x + b4).
    #[test]
    fn nist_mgh09() {
        let y = [
            1.957000E-01,
            1.947000E-01,
            1.735000E-01,
            1.600000E-01,
            8.440000E-02,
            6.270000E-02,
            4.560000E-02,
            3.420000E-02,
            3.230000E-02,
            2.350000E-02,
            2.460000E-02,
        ];
        let x = [
            4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625,
        ];
        let mut residual = |b: &[f64]| {
            let f = |x: f64| b[0] * (x * x + b[1] * x) / (x * x + b[2] * x + b[3]);
            (0..11).map(|i| f(x[i]) - y[i]).collect::<Vec<_>>()
        };
        let outcome = minimise(
            &mut residual,
            &[0.25, 0.39, 0.415, 0.39],
            &[],
            &Options::default(),
        )
        .unwrap();
        assert!(outcome.converged(), "{outcome:?}");
        let certified = [
            1.9280693458E-01,
            1.9128232873E-01,
            1.2305650693E-01,
            1.3606233068E-01,
        ];
        for (b, c) in outcome.parameters.iter().zip(certified) {
            assert!((b / c - 1.0).abs() < 1e-5, "{b} against {c}");
        }
        assert!((2.0 * outcome.cost / 3.0750560385E-04 - 1.0).abs() < 1e-8);
    }

    /// The Rosenbrock valley; with x ≤ 0.5 its minimum lies at (0.5, 0.25) with cost ½ · 0.5².
    #[test]
    fn keeps_to_its_bounds() {
        let mut residual = |x: &[f64]| vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
        let free = minimise(&mut residual, &[-1.2, 1.0], &[], &Options::default()).unwrap();
        assert!((free.parameters[0] - 1.0).abs() < 1e-8 && (free.parameters[1] - 1.0).abs() < 1e-8);
        let bounds = [(-2.0, 0.5), (-2.0, 2.0)];
        let held = minimise(&mut residual, &[-1.2, 1.0], &bounds, &Options::default()).unwrap();
        assert!((held.parameters[0] - 0.5).abs() < 1e-12 && (held.parameters[1] - 0.25).abs() < 1e-7);
        assert!((held.cost - 0.125).abs() < 1e-9);
    }

    #[test]
    fn names_what_makes_no_problem() {
        let mut residual = |x: &[f64]| vec![x[0].ln()];
        let options = Options {
            step_tolerance: 0.0,
            ..Options::default()
        };
        let error = minimise(&mut residual, &[1.0], &[], &options).unwrap_err();
        assert!(error.to_string().contains("step_tolerance = 0"), "{error}");
        let nan = minimise(&mut residual, &[-1.0], &[], &Options::default());
        assert!(matches!(nan, Err(LeastSquaresError::Start { index: 0, .. })));
        let bounds = minimise(&mut residual, &[1.0], &[(2.0, 1.0)], &Options::default());
        assert!(matches!(bounds, Err(LeastSquaresError::Bounds { index: 0, .. })));
    }
}
