//! The law of an isotropic material from coupon tests.
//!
//! ```text
//! min_θ  Σ_t 1/(n_t s_t²) Σ_i (P(ε_i; θ) − P_i)²  +  Σ_t 1/(m_t r_t²) Σ_i (e(a_i; θ) − e_i)²  +  α² Σ_j (θ_j − θ_j')²
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | θ | ln μ at each centre; Poisson's ratio, one for all or one per centre, where it is fitted | ln MPa, – |
//! | P(ε; θ), P_i | nominal stress of the law in the homogeneous test and as measured | MPa |
//! | e(a; θ), e_i | lateral strain at axial strain a, from zero lateral stress and as measured | – |
//! | s_t, r_t | root mean square of the test's stress and lateral strain: each test counts equally | MPa, – |
//! | α = 10⁻³ | ties neighbouring centres (each to the nearest one before it) where the data is silent | – |
//!
//! No finite elements: the strain of a coupon is homogeneous. K follows from μ and Poisson's ratio,
//! K = 2μ(1 + ν)/(3(1 − 2ν)), at every centre, or at rest alone where K is taken as constant. The latter is for nearly
//! incompressible materials: a K fifty times μ that grew with shear would throw large pressures about, and make the
//! tangent's symmetric part indefinite at every fourth of random strains up to a norm of 0.6. The centres lie on the paths of the tests in the space of invariants, at rest and then at
//! equal distances along each test, long tests getting more. Levenberg–Marquardt from the mean secant modulus.
//!
//! Validity: a law in Biot strain with constant ν near ½ keeps volume at small strains only; the record says so.

use super::coupon_file::{FittedPoisson, Poisson, TestKind};
use super::curve::Curve;
use crate::material::homogeneous::{shear_stress, simple_shear, uniaxial};
use crate::material::isotropic::{IsotropicRbf, invariants, shear_and_bulk};
use crate::material::law::{Law, LawError, Range};
use crate::math::mandel::Mandel;
use crate::numerics::least_squares::{LeastSquaresError, Options, Stop, minimise};

/// Ties neighbouring centres; a factor e between them then costs as much as a stress error of 0.1 %.
const TIE: f64 = 1e-3;
/// Poisson's ratios that a fit may find. Above, the bulk modulus is so large that elements of a coarse mesh lock.
const POISSON_BOUNDS: (f64, f64) = (0.0, 0.49);
/// Rest counts as one of the centres; two centres nearer than this are one.
const MERGE: f64 = 1e-3;

/// A test to be fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct CouponTest {
    /// The kind.
    pub kind: TestKind,
    /// What was measured.
    pub curve: Curve,
}

/// How well the law answers one test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestError {
    /// Root mean square of the stress error over that of the stress.
    pub relative_rms: f64,
    /// Largest stress error \[MPa\].
    pub largest_mpa: f64,
    /// Root mean square of the lateral strain's error over that of the lateral strain.
    pub lateral_relative_rms: Option<f64>,
}

/// The fitted law.
#[derive(Clone, Debug, PartialEq)]
pub struct CouponFit {
    /// The law, its range the box of invariants that the tests met.
    pub law: IsotropicRbf,
    /// Least and largest engineering strain of the uniaxial tests; 0 where there is none.
    pub engineering_strain: [f64; 2],
    /// One per test.
    pub errors: Vec<TestError>,
    /// Why the minimisation stopped.
    pub stop: Stop,
    /// Steps it took.
    pub iterations: usize,
}

/// Why no law could be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CouponError {
    /// The data makes no start.
    #[error("test {index} ({test}): mean secant modulus {value} MPa: expected a positive number")]
    Start {
        /// Which test, from 1.
        index: usize,
        /// Its kind.
        test: &'static str,
        /// What was found \[MPa\].
        value: f64,
    },
    /// Nothing to fit, or nothing that tells Poisson's ratio.
    #[error("{0}")]
    Tests(&'static str),
    /// The minimiser.
    #[error(transparent)]
    LeastSquares(#[from] LeastSquaresError),
    /// Moduli that make no law.
    #[error(transparent)]
    Law(#[from] LawError),
}

/// Fits a law with `centres` centres to `tests`.
///
/// # Errors
/// No tests, Poisson's ratio asked for where nothing tells it, data without a positive modulus.
pub fn fit(tests: &[CouponTest], poisson: Poisson, centres: usize) -> Result<CouponFit, CouponError> {
    if tests.is_empty() {
        return Err(CouponError::Tests("there is no test to fit"));
    }
    let sideways = tests.iter().any(|t| !t.curve.lateral.is_empty());
    let kinds = |shear: bool| tests.iter().any(|t| (t.kind == TestKind::SimpleShear) == shear);
    match poisson {
        Poisson::Fitted(FittedPoisson::ByStrain) if !sideways => {
            return Err(CouponError::Tests(
                "Poisson's ratio by strain needs a test with lateral widths",
            ));
        }
        Poisson::Fitted(FittedPoisson::Constant) if !(sideways || kinds(true) && kinds(false)) => {
            return Err(CouponError::Tests(
                "a fitted Poisson's ratio needs lateral widths, or shear beside a uniaxial test",
            ));
        }
        _ => {}
    }
    let start = match poisson {
        Poisson::Assumed(ratio) | Poisson::AtRest(ratio) => ratio,
        Poisson::Fitted(_) => start_ratio(tests),
    };
    // The first pass places the centres with a guessed lateral strain, the second with that of the fitted law.
    let mut guess: Option<IsotropicRbf> = None;
    let mut ratio = start;
    loop {
        let paths: Vec<Vec<[f64; 3]>> = tests.iter().map(|t| path(t, guess.as_ref(), ratio)).collect();
        let problem = Problem {
            tests,
            centres: place_centres(&paths, centres),
            poisson,
        };
        let (law, stop, iterations) = problem.solve(ratio)?;
        if guess.is_some() || matches!(poisson, Poisson::Assumed(_)) {
            let law = with_range(&law, tests)?;
            let errors = tests
                .iter()
                .map(|t| test_error(&Law::Isotropic(law.clone()), t))
                .collect();
            return Ok(CouponFit {
                law,
                engineering_strain: uniaxial_range(tests),
                errors,
                stop,
                iterations,
            });
        }
        ratio = law.poisson_ratio_at_rest();
        guess = Some(law);
    }
}

/// The law's error in one test.
pub fn test_error(law: &Law, test: &CouponTest) -> TestError {
    let curve = &test.curve;
    let error: Vec<f64> = curve
        .strain
        .iter()
        .zip(&curve.stress)
        .map(|(&e, p)| stress_in(law, test.kind, e) - p)
        .collect();
    let sideways: Vec<f64> = curve
        .lateral
        .iter()
        .map(|&(a, e)| uniaxial(law, a).lateral - e)
        .collect();
    let widths: Vec<f64> = curve.lateral.iter().map(|l| l.1).collect();
    TestError {
        relative_rms: rms(&error) / rms(&curve.stress),
        largest_mpa: error.iter().fold(0.0, |worst: f64, e| worst.max(e.abs())),
        lateral_relative_rms: (!sideways.is_empty()).then(|| rms(&sideways) / rms(&widths)),
    }
}

fn stress_in(law: &Law, kind: TestKind, strain: f64) -> f64 {
    match kind {
        TestKind::SimpleShear => shear_stress(law, strain),
        _ => uniaxial(law, strain).stress,
    }
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// −Σ e a / Σ a² over all tracked widths; 0.3 without.
fn start_ratio(tests: &[CouponTest]) -> f64 {
    let pairs: Vec<_> = tests.iter().flat_map(|t| &t.curve.lateral).collect();
    let (ea, aa): (f64, f64) = pairs
        .iter()
        .fold((0.0, 0.0), |(s, q), (a, e)| (s - e * a, q + a * a));
    if aa > 0.0 {
        (ea / aa).clamp(0.01, 0.48)
    } else {
        0.3
    }
}

fn uniaxial_range(tests: &[CouponTest]) -> [f64; 2] {
    let strains = tests
        .iter()
        .filter(|t| t.kind != TestKind::SimpleShear)
        .flat_map(|t| &t.curve.strain);
    strains.fold([0.0, 0.0], |[low, high], &e| [low.min(e), high.max(e)])
}

/// The strain of a test at one point of its curve.
fn strain_at(test: &CouponTest, axial: f64, law: Option<&Law>, ratio: f64) -> Mandel {
    match (test.kind, law) {
        (TestKind::SimpleShear, _) => simple_shear(axial).0,
        (_, Some(law)) => uniaxial(law, axial).strain(),
        (_, None) => Mandel::new(-ratio * axial, -ratio * axial, axial, 0.0, 0.0, 0.0),
    }
}

/// The path of a test in the space of invariants, `(n × 3)`.
fn path(test: &CouponTest, law: Option<&IsotropicRbf>, ratio: f64) -> Vec<[f64; 3]> {
    let law = law.cloned().map(Law::Isotropic);
    test.curve
        .strain
        .iter()
        .map(|&a| invariants(&strain_at(test, a, law.as_ref(), ratio)))
        .collect()
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|d| (a[d] - b[d]).powi(2)).sum::<f64>().sqrt()
}

/// Rest and then `count − 1` centres, dealt to the paths so that the gaps on all of them are alike, at equal distances
/// along each. Rounded to six digits, so that a record shows what the law holds.
fn place_centres(paths: &[Vec<[f64; 3]>], count: usize) -> Vec<[f64; 3]> {
    let rest = [0.0; 3];
    let along: Vec<Vec<f64>> = paths
        .iter()
        .map(|path| {
            let mut sum = 0.0;
            let from = std::iter::once(&rest).chain(path);
            path.iter()
                .zip(from)
                .map(|(q, before)| {
                    sum += distance(q, before);
                    sum
                })
                .collect()
        })
        .collect();
    let length = |k: usize| along[k].last().copied().unwrap_or(0.0);
    let mut dealt = vec![0usize; paths.len()];
    for _ in 1..count {
        // The path with the largest gap; the earlier one where two are equal.
        let gap = |k: usize| length(k) / (dealt[k] + 1) as f64;
        let next = (0..paths.len()).fold(0, |best, k| {
            if gap(k) > gap(best) * (1.0 + 1e-12) {
                k
            } else {
                best
            }
        });
        dealt[next] += 1;
    }
    let mut centres = vec![rest];
    for k in 0..paths.len() {
        for i in 1..=dealt[k] {
            let target = length(k) * i as f64 / dealt[k] as f64;
            let off = |i: usize| (along[k][i] - target).abs();
            let index = (0..along[k].len()).fold(0, |best, i| if off(i) < off(best) { i } else { best });
            let Some(q) = paths[k].get(index) else { continue };
            let centre = q.map(|x| (x * 1e6).round() / 1e6);
            if centres.iter().all(|c| distance(c, &centre) > MERGE) {
                centres.push(centre);
            }
        }
    }
    centres
}

struct Problem<'a> {
    tests: &'a [CouponTest],
    centres: Vec<[f64; 3]>,
    poisson: Poisson,
}

impl Problem<'_> {
    fn law(&self, theta: &[f64]) -> Result<IsotropicRbf, LawError> {
        let n = self.centres.len();
        let moduli = (0..n)
            .map(|i| {
                let ratio = match self.poisson {
                    Poisson::Assumed(ratio) | Poisson::AtRest(ratio) => ratio,
                    Poisson::Fitted(FittedPoisson::Constant) => theta[n],
                    Poisson::Fitted(FittedPoisson::ByStrain) => theta[n + i],
                };
                let shear = theta[i].exp();
                // The first centre is rest.
                let bulk_of = if matches!(self.poisson, Poisson::AtRest(_)) {
                    theta[0].exp()
                } else {
                    shear
                };
                let (_, bulk) = shear_and_bulk(2.0 * (1.0 + ratio) * bulk_of, ratio)?;
                Ok([shear, bulk])
            })
            .collect::<Result<Vec<_>, LawError>>()?;
        IsotropicRbf::interpolating(&self.centres, &moduli, Range::UNBOUNDED)
    }

    fn residual(&self, theta: &[f64]) -> Vec<f64> {
        let Ok(law) = self.law(theta).map(Law::Isotropic) else {
            return vec![f64::NAN];
        };
        let mut r = Vec::new();
        for test in self.tests {
            let curve = &test.curve;
            let scale = 1.0 / (rms(&curve.stress) * (curve.stress.len() as f64).sqrt());
            let points = curve.strain.iter().zip(&curve.stress);
            r.extend(points.map(|(&e, p)| scale * (stress_in(&law, test.kind, e) - p)));
            let widths: Vec<f64> = curve.lateral.iter().map(|l| l.1).collect();
            let scale = 1.0 / (rms(&widths) * (widths.len().max(1) as f64).sqrt());
            r.extend(
                curve
                    .lateral
                    .iter()
                    .map(|&(a, e)| scale * (uniaxial(&law, a).lateral - e)),
            );
        }
        let n = self.centres.len();
        for i in 1..n {
            let gap = |j: usize| distance(&self.centres[i], &self.centres[j]);
            let near = (0..i).fold(0, |best, j| if gap(j) < gap(best) { j } else { best });
            r.push(TIE * (theta[i] - theta[near]));
            if self.poisson == Poisson::Fitted(FittedPoisson::ByStrain) {
                r.push(TIE * (theta[n + i] - theta[n + near]));
            }
        }
        r
    }

    fn solve(&self, ratio: f64) -> Result<(IsotropicRbf, Stop, usize), CouponError> {
        let n = self.centres.len();
        let mut shear = 0.0;
        for (k, test) in self.tests.iter().enumerate() {
            let curve = &test.curve;
            let (pe, ee) = curve
                .strain
                .iter()
                .zip(&curve.stress)
                .fold((0.0, 0.0), |(pe, ee), (e, p)| (pe + p * e, ee + e * e));
            let secant = pe / ee;
            let here = if test.kind == TestKind::SimpleShear {
                secant
            } else {
                secant / (2.0 * (1.0 + ratio))
            };
            if here.is_nan() || here <= 0.0 {
                return Err(CouponError::Start {
                    index: k + 1,
                    test: test.kind.word(),
                    value: here,
                });
            }
            shear += here.ln() / self.tests.len() as f64;
        }
        // Three decades to both sides of the mean keep exp from overflowing.
        let mut start = vec![shear; n];
        let mut bounds = vec![(shear - 7.0, shear + 7.0); n];
        let ratios = match self.poisson {
            Poisson::Assumed(_) | Poisson::AtRest(_) => 0,
            Poisson::Fitted(FittedPoisson::Constant) => 1,
            Poisson::Fitted(FittedPoisson::ByStrain) => n,
        };
        start.extend(std::iter::repeat_n(ratio, ratios));
        bounds.extend(std::iter::repeat_n(POISSON_BOUNDS, ratios));
        let outcome = minimise(
            &mut |theta| self.residual(theta),
            &start,
            &bounds,
            &Options::default(),
        )?;
        // Six decimals: far below the fit's error, and a refit on another machine gives the same record.
        let rounded: Vec<f64> = outcome
            .parameters
            .iter()
            .map(|x| (x * 1e6).round() / 1e6)
            .collect();
        Ok((self.law(&rounded)?, outcome.stop, outcome.iterations))
    }
}

/// The law with the box of invariants that the tests meet, outward to four digits, as its range.
fn with_range(law: &IsotropicRbf, tests: &[CouponTest]) -> Result<IsotropicRbf, LawError> {
    let (mut low, mut high) = ([0.0_f64; 3], [0.0_f64; 3]);
    for test in tests {
        for q in path(test, Some(law), 0.0) {
            for d in 0..3 {
                low[d] = low[d].min((q[d] * 1e4).floor() / 1e4);
                high[d] = high[d].max((q[d] * 1e4).ceil() / 1e4);
            }
        }
    }
    IsotropicRbf::from_weights(law.log_moduli().clone(), Range::new(low, high)?)
}

#[cfg(test)]
#[path = "coupon_tests.rs"]
mod tests;
