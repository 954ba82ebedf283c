//! Moduli that depend on strain, fitted to coupon tests (Bickel 2010, section 8.2).
//!
//! ```text
//! θ = (ln μ_j, ν or ν_j),    ties(θ) = α² Σ_j (θ_j − θ_j')²
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | μ_j | shear modulus at centre j | MPa |
//! | ν, ν_j | Poisson's ratio where it is fitted, one for all centres or one each | – |
//! | α = 10⁻³ | ties neighbouring centres (each to the nearest one before it, j') where the data is silent | – |
//!
//! K follows from μ and Poisson's ratio, K = 2μ(1 + ν)/(3(1 − 2ν)), at every centre, or at rest alone where K is taken
//! as constant. The latter is for nearly incompressible materials: a K fifty times μ that grew with shear would throw
//! large pressures about, and make the tangent's symmetric part indefinite at every fourth of random strains up to a
//! norm of 0.6. The centres lie on the paths of the tests in the space of invariants, at rest and then at equal
//! distances along each test, long tests getting more. Levenberg–Marquardt from the mean secant modulus.
//!
//! Validity: a law in Biot strain with constant ν near ½ keeps volume at small strains only; the record says so.

use super::file::{FittedPoisson, Poisson};
use super::fit::{CouponError, CouponTest, Family, Found, POISSON_BOUNDS, mean_log_shear};
use super::state::{guessed_strain, response};
use crate::material::isotropic::{IsotropicRbf, invariants, shear_and_bulk};
use crate::material::law::{Law, LawError, Range};
use crate::numerics::least_squares::Options;

/// Ties neighbouring centres; a factor e between them then costs as much as a stress error of 0.1 %.
const TIE: f64 = 1e-3;
/// Rest counts as one of the centres; two centres nearer than this are one.
const MERGE: f64 = 1e-3;

/// Laws with the same centres.
#[derive(Clone, Debug, PartialEq)]
pub struct Rbf {
    pub(super) centres: Vec<[f64; 3]>,
    pub(super) poisson: Poisson,
    pub(super) range: Range<3>,
    pub(super) bounds: Vec<(f64, f64)>,
}

/// Fits a law with `count` centres.
///
/// # Errors
/// Data without a positive modulus.
pub(super) fn solve(
    tests: &[CouponTest],
    poisson: Poisson,
    count: usize,
    start: f64,
) -> Result<Found, CouponError> {
    // The first pass places the centres with a guessed lateral strain, the second with that of the fitted law.
    let mut guess: Option<Law> = None;
    let mut ratio = start;
    loop {
        let paths: Vec<Vec<[f64; 3]>> = tests.iter().map(|t| path(t, guess.as_ref(), ratio)).collect();
        let mut family = Rbf {
            centres: place_centres(&paths, count),
            poisson,
            range: Range::UNBOUNDED,
            bounds: Vec::new(),
        };
        let (theta, stop, iterations) = family.minimise(tests, ratio)?;
        let law = family.law(&theta)?;
        if guess.is_some() || matches!(poisson, Poisson::Assumed(_)) {
            family.range = range_of(&law, tests)?;
            return Ok(Found {
                law: family.law(&theta)?,
                family: Family::Rbf(family),
                theta,
                stop,
                iterations,
                starts: 1,
            });
        }
        ratio = law.poisson_ratio_at_rest();
        guess = Some(law);
    }
}

impl Rbf {
    /// The centres, invariants of strain `(n × 3)`.
    pub fn centres(&self) -> &[[f64; 3]] {
        &self.centres
    }

    pub(super) fn law(&self, theta: &[f64]) -> Result<Law, LawError> {
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
        IsotropicRbf::interpolating(&self.centres, &moduli, self.range).map(Law::Isotropic)
    }

    pub(super) fn names(&self) -> Vec<(String, &'static str)> {
        let n = self.centres.len();
        let mut names: Vec<_> = (0..n)
            .map(|i| (format!("ln shear modulus at centre {i}"), "ln MPa"))
            .collect();
        match self.poisson {
            Poisson::Fitted(FittedPoisson::Constant) => names.push(("Poisson's ratio".into(), "–")),
            Poisson::Fitted(FittedPoisson::ByStrain) => {
                names.extend((0..n).map(|i| (format!("Poisson's ratio at centre {i}"), "–")));
            }
            _ => {}
        }
        names
    }

    pub(super) fn ties(&self, theta: &[f64]) -> Vec<f64> {
        let n = self.centres.len();
        let mut r = Vec::new();
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

    /// θ rounded, why it stopped, steps.
    fn minimise(
        &mut self,
        tests: &[CouponTest],
        ratio: f64,
    ) -> Result<(Vec<f64>, crate::numerics::least_squares::Stop, usize), CouponError> {
        let n = self.centres.len();
        let shear = mean_log_shear(tests, ratio)?;
        let mut start = vec![shear; n];
        // Three decades to both sides of the mean keep exp from overflowing.
        self.bounds = vec![(shear - 7.0, shear + 7.0); n];
        let ratios = match self.poisson {
            Poisson::Assumed(_) | Poisson::AtRest(_) => 0,
            Poisson::Fitted(FittedPoisson::Constant) => 1,
            Poisson::Fitted(FittedPoisson::ByStrain) => n,
        };
        start.extend(std::iter::repeat_n(ratio, ratios));
        self.bounds.extend(std::iter::repeat_n(POISSON_BOUNDS, ratios));
        let outcome = Family::Rbf(self.clone()).minimise(tests, &start, &Options::default())?;
        // Six decimals: far below the fit's error, and a refit on another machine gives the same record.
        let theta = outcome.parameters.iter().map(|x| (x * 1e6).round() / 1e6);
        Ok((theta.collect(), outcome.stop, outcome.iterations))
    }
}

/// The path of a test in the space of invariants, `(n × 3)`.
fn path(test: &CouponTest, law: Option<&Law>, ratio: f64) -> Vec<[f64; 3]> {
    let strain = |a: f64| match law {
        Some(law) => response(law, test.kind, a).strain,
        None => guessed_strain(test.kind, a, ratio),
    };
    test.curve
        .strain
        .iter()
        .map(|&a| invariants(&strain(a)))
        .collect()
}

/// The box of invariants that the tests meet, outward to four digits.
fn range_of(law: &Law, tests: &[CouponTest]) -> Result<Range<3>, LawError> {
    let (mut low, mut high) = ([0.0_f64; 3], [0.0_f64; 3]);
    for test in tests {
        for q in path(test, Some(law), 0.0) {
            for d in 0..3 {
                low[d] = low[d].min((q[d] * 1e4).floor() / 1e4);
                high[d] = high[d].max((q[d] * 1e4).ceil() / 1e4);
            }
        }
    }
    Range::new(low, high)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deals_centres_by_length() {
        let line = |end: f64, d: usize| -> Vec<[f64; 3]> {
            (1..=120)
                .map(|i| {
                    let mut q = [0.0; 3];
                    q[d] = end * f64::from(i) / 120.0;
                    q
                })
                .collect()
        };
        let centres = place_centres(&[line(-0.6, 2), line(0.2, 1)], 5);
        // Three gaps of 0.2 on the long path, one on the short.
        let expected = [
            [0.0; 3],
            [0.0, 0.0, -0.2],
            [0.0, 0.0, -0.4],
            [0.0, 0.0, -0.6],
            [0.0, 0.2, 0.0],
        ];
        assert_eq!(centres, expected);
    }
}
