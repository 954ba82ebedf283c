//! Hyperelastic laws fitted to coupon tests.
//!
//! ```text
//! neo-hookean     θ = ln μ                    mooney-rivlin   θ = (ln μ, s),  C10 = μ (1 − s)/2,  C01 = μ s/2
//! ogden-N         θ = (ln μ_k, α_k)           hyperfoam-N     θ = (ln μ_k, α_k)
//! and ν where it is fitted:  K = 2μ(1 + ν)/(3(1 − 2ν)),  μ = Σ μ_k;   of a foam by strain one ν_k for each term
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | μ, μ_k | shear modulus at rest and its shares | MPa |
//! | s | share of C01, between 0 and 1 | – |
//! | α_k | exponents, each held to the sign of its start, between 0.1 and 30 in size | – |
//! | K, ν | bulk modulus and Poisson's ratio at rest: assumed, or fitted | MPa, – |
//!
//! The energies are those of [`crate::material::hyperelastic`]. Logarithms keep every μ_k positive. With the energies
//! written as Σ 2μ_k/α_k² λ^α_k each term is then convex in the logarithms of the stretches, and so is their sum: the
//! material obeys Drucker's rule at every distortion, whatever the data says. A rise of nominal stress asks for more, and
//! is looked at afterwards ([`super::compare`]).
//!
//! For given exponents stress is nearly linear in the μ_k, so each start takes its μ_k from a non-negative linear fit.
//! Starts are a fixed list of exponents of both signs; the best few of them are minimised by Levenberg and Marquardt's
//! method, and the least sum of squares wins. Sources: Ogden, Saccomandi & Sgura 2004, Comput. Mech. 34, on the many
//! minima of such fits; Storåkers 1986 for the foam.

use super::file::{FittedPoisson, LawChoice, Poisson};
use super::fit::{CouponError, CouponTest, Family, Found, POISSON_BOUNDS, mean_log_shear, residuals, rms};
use super::state::response;
use crate::material::hyperelastic::{FoamTerm, Form, Hyperelastic, OgdenTerm, VolumeEnergy};
use crate::material::law::{Law, LawError};
use crate::material::record::significant;
use crate::numerics::least_squares::{Options, Outcome};

/// Least and largest size of an exponent.
const EXPONENTS: (f64, f64) = (0.1, 30.0);
/// How far below the first guess of the shear modulus a share may fall: e⁻²⁰ of it still counts at 7 times the length
/// with an exponent of 10.
const LOWEST_SHARE: f64 = -20.0;
/// How many of the starts are minimised.
const MINIMISED: usize = 5;

/// Exponents to start from.
const ONE: [[f64; 1]; 8] = [[2.0], [1.0], [5.0], [12.0], [-1.0], [-2.0], [-5.0], [-12.0]];
const TWO: [[f64; 2]; 10] = [
    [2.0, -2.0],
    [1.3, 5.0],
    [2.0, 8.0],
    [4.0, -4.0],
    [8.0, -2.0],
    [1.5, 15.0],
    [12.0, -4.0],
    [-2.0, -8.0],
    [1.0, -10.0],
    [20.0, 4.0],
];
const THREE: [[f64; 3]; 10] = [
    [1.3, 5.0, -2.0],
    [2.0, 8.0, -2.0],
    [1.0, 4.0, 10.0],
    [2.0, -2.0, -8.0],
    [1.0, 6.0, -4.0],
    [3.0, 12.0, -4.0],
    [6.0, -6.0, -1.5],
    [1.5, 20.0, -5.0],
    [12.0, 4.0, -10.0],
    [0.5, 3.0, -1.0],
];

/// Hyperelastic laws of one form.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretching {
    choice: LawChoice,
    poisson: Poisson,
    pub(super) bounds: Vec<(f64, f64)>,
}

/// The number of terms and whether they are a foam's.
fn terms(choice: LawChoice) -> (usize, bool) {
    match choice {
        LawChoice::Rbf | LawChoice::NeoHookean | LawChoice::MooneyRivlin => (0, false),
        LawChoice::Ogden1 => (1, false),
        LawChoice::Ogden2 => (2, false),
        LawChoice::Ogden3 => (3, false),
        LawChoice::Hyperfoam1 => (1, true),
        LawChoice::Hyperfoam2 => (2, true),
        LawChoice::Hyperfoam3 => (3, true),
    }
}

/// Fits the hyperelastic law `choice`.
///
/// # Errors
/// Data without a positive modulus.
pub(super) fn solve(
    tests: &[CouponTest],
    poisson: Poisson,
    choice: LawChoice,
    ratio: f64,
) -> Result<Found, CouponError> {
    let shear = mean_log_shear(tests, ratio)?;
    let mut starts = Vec::new();
    for exponents in start_exponents(choice) {
        let family = Stretching::new(choice, poisson, shear, &exponents);
        let start = family.start(tests, shear, &exponents, ratio);
        // A start that makes no law, or whose stress leaves the numbers, is no start.
        let cost = family.law(&start).map_or(f64::NAN, |law| {
            residuals(&law, tests).concat().iter().map(|r| r * r).sum()
        });
        if cost.is_finite() {
            starts.push((cost, family, start));
        }
    }
    let tried = starts.len();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Option<(Stretching, Outcome)> = None;
    let mut iterations = 0;
    let options = Options {
        max_iterations: 300,
        cost_tolerance: 1e-12,
        ..Options::default()
    };
    for (_, family, start) in starts.into_iter().take(MINIMISED) {
        let wrapped = Family::Stretching(family.clone());
        let outcome = wrapped.minimise(tests, &start, &options)?;
        iterations += outcome.iterations;
        if best.as_ref().is_none_or(|(_, b)| outcome.cost < b.cost) {
            best = Some((family, outcome));
        }
    }
    let (family, outcome) = best.ok_or(CouponError::Tests(
        "no start makes a hyperelastic law of this form",
    ))?;
    let theta: Vec<f64> = outcome
        .parameters
        .iter()
        .map(|x| (x * 1e6).round() / 1e6)
        .collect();
    Ok(Found {
        law: family.law(&theta)?,
        family: Family::Stretching(family),
        theta,
        stop: outcome.stop,
        iterations,
        starts: tried.min(MINIMISED),
    })
}

fn start_exponents(choice: LawChoice) -> Vec<Vec<f64>> {
    match terms(choice).0 {
        0 => vec![Vec::new()],
        1 => ONE.iter().map(|e| e.to_vec()).collect(),
        2 => TWO.iter().map(|e| e.to_vec()).collect(),
        _ => THREE.iter().map(|e| e.to_vec()).collect(),
    }
}

impl Stretching {
    fn new(choice: LawChoice, poisson: Poisson, shear: f64, exponents: &[f64]) -> Self {
        let mut bounds = Vec::new();
        let of_share = (shear + LOWEST_SHARE, shear + 5.0);
        match terms(choice).0 {
            0 => bounds.push((shear - 7.0, shear + 7.0)),
            _ => {
                for exponent in exponents {
                    let (least, most) = EXPONENTS;
                    bounds.push(of_share);
                    bounds.push(if *exponent > 0.0 {
                        (least, most)
                    } else {
                        (-most, -least)
                    });
                }
            }
        }
        if choice == LawChoice::MooneyRivlin {
            bounds.push((0.0, 1.0));
        }
        let family = Stretching {
            choice,
            poisson,
            bounds,
        };
        let mut bounds = family.bounds.clone();
        bounds.extend(std::iter::repeat_n(POISSON_BOUNDS, family.ratios()));
        Stretching { bounds, ..family }
    }

    /// How many Poisson's ratios are fitted.
    fn ratios(&self) -> usize {
        match (self.poisson, terms(self.choice)) {
            (Poisson::Assumed(_) | Poisson::AtRest(_), _) => 0,
            (Poisson::Fitted(FittedPoisson::ByStrain), (count, true)) => count,
            (Poisson::Fitted(_), _) => 1,
        }
    }

    /// Poisson's ratio of term `k` at θ.
    fn ratio(&self, theta: &[f64], k: usize) -> f64 {
        match self.poisson {
            Poisson::Assumed(ratio) | Poisson::AtRest(ratio) => ratio,
            Poisson::Fitted(_) => {
                let count = self.ratios();
                theta[theta.len() - count + k.min(count - 1)]
            }
        }
    }

    pub(super) fn law(&self, theta: &[f64]) -> Result<Law, LawError> {
        let (count, foam) = terms(self.choice);
        let bulk = |shear: f64| {
            let ratio = self.ratio(theta, 0);
            significant(2.0 * shear * (1.0 + ratio) / (3.0 * (1.0 - 2.0 * ratio)), 10)
        };
        // Ten digits: what a record shows is what the law holds.
        let shear = |k: usize| significant(theta[2 * k].exp(), 10);
        let form = match self.choice {
            LawChoice::Rbf | LawChoice::NeoHookean => Form::NeoHookeanIsochoric {
                shear_mpa: shear(0),
                bulk_mpa: bulk(shear(0)),
            },
            LawChoice::MooneyRivlin => Form::MooneyRivlin {
                c10_mpa: significant(0.5 * shear(0) * (1.0 - theta[1]), 10),
                c01_mpa: significant(0.5 * shear(0) * theta[1], 10),
                bulk_mpa: bulk(shear(0)),
            },
            _ if foam => Form::Hyperfoam {
                terms: (0..count)
                    .map(|k| FoamTerm {
                        shear_mpa: shear(k),
                        exponent: theta[2 * k + 1],
                        poisson: self.ratio(theta, k),
                    })
                    .collect(),
            },
            _ => Form::Ogden {
                terms: (0..count)
                    .map(|k| OgdenTerm {
                        shear_mpa: shear(k),
                        exponent: theta[2 * k + 1],
                    })
                    .collect(),
                volume: VolumeEnergy::Powers(vec![0.5 * bulk((0..count).map(shear).sum())]),
            },
        };
        Hyperelastic::new(form).map(Law::Hyperelastic)
    }

    pub(super) fn names(&self) -> Vec<(String, &'static str)> {
        let mut names = Vec::new();
        match terms(self.choice).0 {
            0 => names.push(("ln shear modulus".to_string(), "ln MPa")),
            count => {
                for k in 0..count {
                    names.push((format!("ln shear modulus of term {k}"), "ln MPa"));
                    names.push((format!("exponent of term {k}"), "–"));
                }
            }
        }
        if self.choice == LawChoice::MooneyRivlin {
            names.push(("share of C01".into(), "–"));
        }
        match self.ratios() {
            0 => {}
            1 => names.push(("Poisson's ratio".into(), "–")),
            count => names.extend((0..count).map(|k| (format!("Poisson's ratio of term {k}"), "–"))),
        }
        names
    }

    /// θ with the exponents given and the shares of a non-negative linear fit to the stresses.
    fn start(&self, tests: &[CouponTest], shear: f64, exponents: &[f64], ratio: f64) -> Vec<f64> {
        let mut theta = vec![shear];
        if self.choice == LawChoice::MooneyRivlin {
            theta.push(0.2);
        }
        if !exponents.is_empty() {
            let shares = self.shares(tests, shear, exponents, ratio);
            theta = exponents
                .iter()
                .zip(&shares)
                // No share is quite zero, or its exponent would not be felt.
                .flat_map(|(exponent, share)| [shear + share.max(1e-4).ln(), *exponent])
                .collect();
        }
        let (low, high) = POISSON_BOUNDS;
        theta.extend(std::iter::repeat_n(ratio.clamp(low, high), self.ratios()));
        theta
    }

    /// The shares x ≥ 0 of terms with the whole shear modulus each whose stresses add up best to the measured ones, by
    /// cyclic coordinate descent.
    fn shares(&self, tests: &[CouponTest], shear: f64, exponents: &[f64], ratio: f64) -> Vec<f64> {
        let (_, foam) = terms(self.choice);
        let single = if foam {
            LawChoice::Hyperfoam1
        } else {
            LawChoice::Ogden1
        };
        let mut target = Vec::new();
        for test in tests {
            let scale = 1.0 / (rms(&test.curve.stress) * (test.curve.stress.len() as f64).sqrt());
            target.extend(test.curve.stress.iter().map(|p| scale * p));
        }
        let columns: Vec<Vec<f64>> = exponents
            .iter()
            .map(|exponent| {
                let family = Stretching::new(single, Poisson::Assumed(ratio), shear, &[*exponent]);
                let Ok(law) = family.law(&[shear, *exponent]) else {
                    return vec![0.0; target.len()];
                };
                let mut column = Vec::new();
                for test in tests {
                    let scale = 1.0 / (rms(&test.curve.stress) * (test.curve.stress.len() as f64).sqrt());
                    let stress = |e: &f64| scale * response(&law, test.kind, *e).stress;
                    column.extend(test.curve.strain.iter().map(stress));
                }
                column
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let mut shares = vec![0.0; columns.len()];
        let mut rest = target;
        // A handful of columns: a few hundred sweeps are exact enough for a start.
        for _ in 0..300 {
            for (share, column) in shares.iter_mut().zip(&columns) {
                let square = dot(column, column);
                if !(square > 0.0 && square.is_finite()) {
                    continue;
                }
                let new = (*share + dot(column, &rest) / square).max(0.0);
                let change = new - *share;
                rest.iter_mut().zip(column).for_each(|(r, c)| *r -= change * c);
                *share = new;
            }
        }
        shares
    }
}

#[cfg(test)]
#[path = "hyperelastic_tests.rs"]
mod tests;
