use super::*;

/// The residual's and the parameters' standard deviations against NIST's.
fn deviate_as_certified(outcome: &Outcome, residual: f64, certified: &[f64]) {
    let free = vec![true; certified.len()];
    let covariance = Covariance::new(&outcome.residual, &outcome.jacobian, &free).unwrap();
    assert!((covariance.variance.sqrt() / residual - 1.0).abs() < 1e-8);
    assert!(covariance.undetermined.is_empty());
    for (s, c) in covariance.deviations().iter().zip(certified) {
        // The Jacobian at the solution is by differences, with about nine digits, and its inverse loses some of them.
        assert!((s / c - 1.0).abs() < 1e-4, "{s} against {c}");
    }
}

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
        deviate_as_certified(&outcome, 1.0187876330E-01, &[2.7070075241E+00, 7.2668688436E-06]);
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
    deviate_as_certified(
        &outcome,
        6.6279236551E-03,
        &[
            1.1435312227E-02,
            1.9633220911E-01,
            8.0842031232E-02,
            9.0025542308E-02,
        ],
    );
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

/// A problem with its own Jacobian: Misra1a's model on exact data, which can't be evaluated beyond b1 = 600.
struct Walled {
    x: Vec<f64>,
    y: Vec<f64>,
    refused: usize,
    told: Vec<f64>,
    patience: usize,
}

impl Walled {
    fn new(patience: usize) -> Walled {
        let x: Vec<f64> = (1..=14).map(|i| 55.0 * f64::from(i)).collect();
        let y = x.iter().map(|x| 240.0 * (1.0 - (-5.5e-4 * x).exp())).collect();
        Walled {
            x,
            y,
            refused: 0,
            told: Vec::new(),
            patience,
        }
    }
}

impl Problem for Walled {
    fn residual(&mut self, b: &[f64]) -> Option<Vec<f64>> {
        if b[0] > 600.0 {
            self.refused += 1;
            return None;
        }
        let of = |(x, y): (&f64, &f64)| b[0] * (1.0 - (-b[1] * x).exp()) - y;
        Some(self.x.iter().zip(&self.y).map(of).collect())
    }

    fn jacobian(&mut self, b: &[f64]) -> Option<DMatrix<f64>> {
        Some(DMatrix::from_fn(self.x.len(), 2, |i, j| {
            let e = (-b[1] * self.x[i]).exp();
            if j == 0 { 1.0 - e } else { b[0] * self.x[i] * e }
        }))
    }

    fn goes_on(&mut self, news: &News) -> bool {
        self.told.push(news.cost);
        self.told.len() < self.patience
    }
}

#[test]
fn a_point_that_cannot_be_evaluated_shortens_the_step() {
    let mut problem = Walled::new(1000);
    let options = Options {
        initial_damping: 1e-9,
        ..Options::default()
    };
    let outcome = minimise_problem(&mut problem, &[250.0, 1e-4], &[], &options).unwrap();
    assert!(problem.refused > 0, "the start does not lead to the wall");
    assert!(outcome.converged(), "{outcome:?}");
    assert!((outcome.parameters[0] - 240.0).abs() < 1e-6, "{outcome:?}");
    assert!(problem.told.windows(2).all(|c| c[1] < c[0]));
    let beyond = minimise_problem(&mut problem, &[700.0, 2e-4], &[], &options);
    assert_eq!(beyond, Err(LeastSquaresError::NoStart));
}

#[test]
fn ends_with_the_best_so_far_when_asked() {
    let mut problem = Walled::new(3);
    let outcome = minimise_problem(&mut problem, &[250.0, 2e-4], &[], &Options::default()).unwrap();
    assert_eq!(outcome.stop, Stop::Cancelled);
    assert_eq!(outcome.cost, *problem.told.last().unwrap());
    assert!(outcome.cost < problem.told[0]);
}

/// y = (a + b) x + c with a residual that a fourth parameter does not enter: the data tell a + b, c, and nothing of a − b and d.
#[test]
fn names_what_the_data_do_not_tell() {
    let x = [0.0, 1.0, 2.0, 3.0, 4.0];
    let noise = [0.1, -0.1, 0.05, -0.1, 0.05];
    let jacobian = DMatrix::from_fn(5, 4, |i, j| [x[i], x[i], 1.0, 0.0][j]);
    let covariance = Covariance::new(&noise, &jacobian, &[true; 4]).unwrap();
    assert_eq!((covariance.freedom, covariance.undetermined.len()), (3, 2));
    assert_eq!(covariance.undetermined[0].direction, [0.0, 0.0, 0.0, 1.0]);
    let difference = &covariance.undetermined[1].direction;
    assert!((difference[0] + difference[1]).abs() < 1e-9 && difference[2].abs() < 1e-9);
    // The straight line's closed form: var(slope) = s²/Σ(x − x̄)², var(intercept) = s² (1/m + x̄²/Σ(x − x̄)²).
    let s2 = noise.iter().map(|e| e * e).sum::<f64>() / 3.0;
    let c = &covariance.matrix;
    let slope = c[(0, 0)] + 2.0 * c[(0, 1)] + c[(1, 1)];
    assert!((slope / (s2 / 10.0) - 1.0).abs() < 1e-9);
    assert!((c[(2, 2)] / (s2 * (0.2 + 4.0 / 10.0)) - 1.0).abs() < 1e-9);
    // What is known takes no part.
    let held = Covariance::new(&noise, &jacobian, &[true, false, true, false]).unwrap();
    assert!(held.undetermined.is_empty() && held.matrix[(1, 1)] == 0.0);
    assert!((held.matrix[(0, 0)] / (s2 / 10.0) - 1.0).abs() < 1e-9);
    assert_eq!(
        Covariance::new(&noise[..2], &jacobian.rows(0, 2).into(), &[true; 4]),
        None
    );
}
