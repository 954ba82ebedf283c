//! A hyperelastic law that stands in for another law, for programs that have no law with moduli that depend on strain.
//!
//! The law is put through the tests that it was fitted in: pressed and pulled along z over its fitted range, and sheared where
//! that was measured. Hyperelastic laws are fitted to its answers as they would be to a specimen's, [`super::coupon::fit::fit`].
//! The first whose stress stays within the error asked for is taken, those with the fewest terms first. Shear that was
//! not measured is not fitted, since the law extrapolates there itself; how far the two are apart in it is told.
//!
//! Where Poisson's ratio at rest is 0.45 or more, the ratio is taken over and the lateral strain is not fitted: a law
//! in Biot strain with such a ratio keeps its volume at small strain only, the stand-in keeps it at large strain too. Its
//! error is told all the same. Valid for isotropic laws, in the strains compared.

use super::coupon::curve::Curve;
use super::coupon::file::{FittedPoisson, LawChoice, Poisson, TestKind};
use super::coupon::fit::{CouponError, CouponTest, fit, test_error};
use super::coupon::state::response;
use crate::material::hyperelastic::Form;
use crate::material::law::Law;

/// The law that stands in, and how near it is.
#[derive(Clone, Debug, PartialEq)]
pub struct StandIn {
    /// Its form, in a coupon file's word.
    pub choice: LawChoice,
    /// The energy.
    pub form: Form,
    /// How near it is in each test.
    pub errors: Vec<TestGap>,
}

/// How near it is in one test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestGap {
    /// The test.
    pub kind: TestKind,
    /// Whether the stand-in was fitted to it.
    pub fitted: bool,
    /// Engineering strain or shear compared, from and to.
    pub strain: [f64; 2],
    /// RMS error of stress over RMS stress.
    pub relative_rms: f64,
    /// RMS error of lateral strain over RMS lateral strain; none in shear.
    pub lateral_relative_rms: Option<f64>,
}

impl StandIn {
    /// The largest error of stress in the tests that it was fitted to.
    pub fn worst(&self) -> f64 {
        let fitted = self.errors.iter().filter(|e| e.fitted);
        fitted.map(|e| e.relative_rms).fold(0.0, f64::max)
    }
}

/// Poisson's ratio at rest from which the lateral strain is not fitted.
const INCOMPRESSIBLE: f64 = 0.45;
/// The largest ratio at rest that a stand-in gets.
const MOST_POISSON: f64 = 0.495;
const POINTS: usize = 40;
/// Shear compared, where the fitted range goes so far.
const MOST_SHEAR: f64 = 0.3;

/// The first of `choices` whose stress stays within `within` (a part of 1) of an isotropic `law`'s over its fitted
/// `engineering_strain`, and in shear where it was `sheared`; else the nearest of all.
///
/// # Errors
/// No range, or a law that no start fits.
pub fn stand_in(
    law: &Law,
    engineering_strain: [f64; 2],
    sheared: bool,
    choices: &[LawChoice],
    within: f64,
) -> Result<StandIn, CouponError> {
    let tests = answers(law, engineering_strain);
    let ratio = law.poisson_ratio_at_rest();
    let stiff = ratio >= INCOMPRESSIBLE;
    let poisson = match stiff {
        true => Poisson::AtRest(ratio.min(MOST_POISSON)),
        false => Poisson::Fitted(FittedPoisson::ByStrain),
    };
    let takes = |kind: TestKind| sheared || kind != TestKind::SimpleShear;
    let mut fitted = tests.clone();
    fitted.retain(|test| takes(test.kind));
    if stiff {
        fitted.iter_mut().for_each(|test| test.curve.lateral.clear());
    }
    let mut best: Option<StandIn> = None;
    for choice in choices {
        // A form that does not fit at all is passed over: the next may.
        let Ok(found) = fit(&fitted, poisson, *choice, 1) else {
            continue;
        };
        let Law::Hyperelastic(energy) = &found.law else {
            continue;
        };
        let gaps = tests.iter().map(|test| {
            let error = test_error(&found.law, test);
            TestGap {
                kind: test.kind,
                fitted: takes(test.kind),
                strain: ends(&test.curve.strain),
                relative_rms: error.relative_rms,
                lateral_relative_rms: error.lateral_relative_rms,
            }
        });
        let candidate = StandIn {
            choice: *choice,
            form: energy.form().clone(),
            errors: gaps.collect(),
        };
        let near = candidate.worst() <= within;
        // Written so that an error that is no number is never the best.
        if best.as_ref().is_none_or(|b| candidate.worst() < b.worst()) && candidate.worst().is_finite() {
            best = Some(candidate);
        }
        if near {
            break;
        }
    }
    best.ok_or(CouponError::Tests(
        "no hyperelastic law of these forms comes near",
    ))
}

/// What a specimen of `law` would answer.
fn answers(law: &Law, [low, high]: [f64; 2]) -> Vec<CouponTest> {
    let mut tests = Vec::new();
    let shear = low.abs().max(high).min(MOST_SHEAR);
    for (kind, end) in [
        (TestKind::UniaxialCompression, low),
        (TestKind::UniaxialTension, high),
        (TestKind::SimpleShear, shear),
    ] {
        if end == 0.0 {
            continue;
        }
        let strain: Vec<f64> = (1..=POINTS).map(|i| end * i as f64 / POINTS as f64).collect();
        let states: Vec<_> = strain.iter().map(|e| response(law, kind, *e)).collect();
        let lateral = strain
            .iter()
            .zip(&states)
            .filter_map(|(e, s)| Some((*e, s.free?)));
        tests.push(CouponTest {
            kind,
            weight: 1.0,
            curve: Curve {
                lateral: lateral.collect(),
                stress: states.iter().map(|s| s.stress).collect(),
                strain,
                slack: 0.0,
            },
        });
    }
    tests
}

fn ends(strain: &[f64]) -> [f64; 2] {
    let fold = |start, f: fn(f64, f64) -> f64| strain.iter().copied().fold(start, f);
    [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::hyperelastic::{FoamTerm, Hyperelastic, OgdenTerm, VolumeEnergy};

    /// A law that is of the form itself is found again.
    #[test]
    fn a_hyperelastic_law_stands_in_for_itself() {
        let foam = Form::Hyperfoam {
            terms: vec![FoamTerm {
                shear_mpa: 0.1,
                exponent: 6.0,
                poisson: 0.2,
            }],
        };
        let law = Law::Hyperelastic(Hyperelastic::new(foam.clone()).unwrap());
        let found = stand_in(&law, [-0.5, 0.2], true, &[LawChoice::Hyperfoam1], 0.05).unwrap();
        assert!(found.worst() < 1e-4, "{found:?}");
        let Form::Hyperfoam { terms } = &found.form else {
            panic!("{found:?}")
        };
        assert!((terms[0].shear_mpa - 0.1).abs() < 1e-4 && (terms[0].exponent - 6.0).abs() < 1e-2);
        assert!((terms[0].poisson - 0.2).abs() < 1e-3, "{terms:?}");
    }

    /// A rubber of two terms: neither the neo-Hookean law nor one term is near enough, two are.
    #[test]
    fn as_few_terms_as_are_needed() {
        let term = |shear_mpa, exponent| OgdenTerm { shear_mpa, exponent };
        let rubber = Form::Ogden {
            terms: vec![term(0.1, 1.3), term(0.004, 8.0)],
            volume: VolumeEnergy::Powers(vec![0.104 * 0.5 * 2.0 * 1.49 / (3.0 * 0.02)]),
        };
        let law = Law::Hyperelastic(Hyperelastic::new(rubber).unwrap());
        let choices = [LawChoice::NeoHookean, LawChoice::Ogden1, LawChoice::Ogden2];
        let found = stand_in(&law, [-0.3, 2.0], false, &choices, 0.005).unwrap();
        assert_eq!(found.choice, LawChoice::Ogden2);
        assert!(found.worst() < 0.005);
        // Shear was not fitted, and yet it is told.
        assert!(
            found
                .errors
                .iter()
                .any(|e| !e.fitted && e.kind == TestKind::SimpleShear)
        );
        // What is out of reach is answered with the nearest.
        let nearest = stand_in(&law, [-0.3, 2.0], false, &choices[..2], 0.005).unwrap();
        assert!(nearest.worst() > 0.005);
    }
}
