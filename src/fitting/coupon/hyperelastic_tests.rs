//! Known hyperelastic laws, fitted back from their own curves.

use super::*;
use crate::fitting::coupon::file::TestKind;
use crate::fitting::coupon::fit::tests::measured;
use crate::fitting::coupon::fit::{CouponFit, fit};
use crate::fitting::coupon::uncertainty::knowledge;

fn law_of(form: Form) -> Law {
    Law::Hyperelastic(Hyperelastic::new(form).unwrap())
}

/// K of Poisson's ratio 0.49 at a shear modulus.
fn bulk(shear: f64) -> f64 {
    2.0 * shear * 1.49 / (3.0 * 0.02)
}

fn rubber_tests(law: &Law) -> Vec<CouponTest> {
    vec![
        measured(law, TestKind::UniaxialTension, 3.0, false),
        measured(law, TestKind::EquibiaxialTension, 2.0, false),
        measured(law, TestKind::PlanarTension, 3.0, false),
        measured(law, TestKind::UniaxialCompression, -0.5, false),
    ]
}

fn fitted_stress_is_that_of(fitted: &CouponFit, law: &Law, tests: &[CouponTest]) {
    for test in tests {
        for e in &test.curve.strain {
            let (a, b) = (response(&fitted.law, test.kind, *e), response(law, test.kind, *e));
            assert!(
                (a.stress / b.stress - 1.0).abs() < 1e-3,
                "{:?} at {e}: {} for {}",
                test.kind,
                a.stress,
                b.stress
            );
        }
    }
}

#[test]
fn rubbers_come_back() {
    let neo = law_of(Form::NeoHookeanIsochoric {
        shear_mpa: 0.4,
        bulk_mpa: bulk(0.4),
    });
    let mooney = law_of(Form::MooneyRivlin {
        c10_mpa: 0.16,
        c01_mpa: 0.04,
        bulk_mpa: bulk(0.4),
    });
    let ogden = |terms: &[(f64, f64)]| {
        let shear = terms.iter().map(|t| t.0).sum();
        let term = |&(shear_mpa, exponent): &(f64, f64)| OgdenTerm { shear_mpa, exponent };
        law_of(Form::Ogden {
            terms: terms.iter().map(term).collect(),
            volume: VolumeEnergy::Powers(vec![0.5 * bulk(shear)]),
        })
    };
    let cases = [
        (LawChoice::NeoHookean, neo),
        (LawChoice::MooneyRivlin, mooney),
        (LawChoice::Ogden1, ogden(&[(0.4, 1.7)])),
        (LawChoice::Ogden2, ogden(&[(0.35, 1.4), (0.02, 4.5)])),
        (
            LawChoice::Ogden3,
            ogden(&[(0.35, 1.4), (0.01, 5.5), (0.04, -2.0)]),
        ),
    ];
    for (choice, law) in cases {
        let tests = rubber_tests(&law);
        let fitted = fit(&tests, Poisson::AtRest(0.49), choice, 6).unwrap();
        assert!(fitted.relative_rms < 1e-3, "{choice:?}: {:?}", fitted.errors);
        fitted_stress_is_that_of(&fitted, &law, &tests);
        assert!((fitted.law.poisson_ratio_at_rest() - 0.49).abs() < 1e-8);
        let coefficients = fitted.law.parameters();
        // Three terms can stand in for one another; the others are found one by one.
        if choice != LawChoice::Ogden3 {
            let mut found: Vec<f64> = coefficients.iter().map(|p| p.value).collect();
            let mut known: Vec<f64> = law.parameters().iter().map(|p| p.value).collect();
            found.sort_by(f64::total_cmp);
            known.sort_by(f64::total_cmp);
            for (a, b) in found.iter().zip(&known) {
                assert!((a / b - 1.0).abs() < 1e-3, "{choice:?}: {found:?} for {known:?}");
            }
        }
    }
}

#[test]
fn foams_come_back_with_their_poisson_ratios() {
    let foam = |terms: &[(f64, f64, f64)]| {
        let term = |&(shear_mpa, exponent, poisson): &(f64, f64, f64)| FoamTerm {
            shear_mpa,
            exponent,
            poisson,
        };
        law_of(Form::Hyperfoam {
            terms: terms.iter().map(term).collect(),
        })
    };
    let cases = [
        (
            LawChoice::Hyperfoam1,
            FittedPoisson::Constant,
            foam(&[(0.2, 6.0, 0.15)]),
        ),
        (
            LawChoice::Hyperfoam2,
            FittedPoisson::ByStrain,
            foam(&[(0.2, 9.0, 0.1), (0.05, -2.5, 0.2)]),
        ),
    ];
    for (choice, poisson, law) in cases {
        let tests = [
            measured(&law, TestKind::UniaxialCompression, -0.6, true),
            measured(&law, TestKind::UniaxialTension, 0.3, true),
            measured(&law, TestKind::ConfinedCompression, -0.4, false),
            measured(&law, TestKind::SimpleShear, 0.3, false),
        ];
        let fitted = fit(&tests, Poisson::Fitted(poisson), choice, 6).unwrap();
        assert!(fitted.relative_rms < 1e-3, "{choice:?}: {:?}", fitted.errors);
        fitted_stress_is_that_of(&fitted, &law, &tests);
    }
}

/// One curve of a neo-Hookean rubber tells one number; three terms of Ogden's ask for six.
#[test]
fn says_which_numbers_the_data_does_not_tell() {
    let law = law_of(Form::NeoHookeanIsochoric {
        shear_mpa: 0.4,
        bulk_mpa: bulk(0.4),
    });
    let mut test = measured(&law, TestKind::UniaxialTension, 0.5, false);
    // One percent of noise, alternating.
    for (i, p) in test.curve.stress.iter_mut().enumerate() {
        *p *= 1.0 + 0.01 * if i % 2 == 0 { 1.0 } else { -1.0 };
    }
    let tests = [test];
    let one = fit(&tests, Poisson::AtRest(0.49), LawChoice::NeoHookean, 6).unwrap();
    let known = knowledge(&one, &tests);
    assert!(known.numbers[0].determined, "{known:?}");
    // Noise of size s in 50 stresses that go with μ: the error of ln μ is near s/√50, weighted by the stresses.
    let error = known.numbers[0].standard_error.unwrap();
    let squares: f64 = tests[0].curve.stress.iter().map(|p| p * p).sum();
    let fourth: f64 = tests[0].curve.stress.iter().map(|p| p.powi(4)).sum();
    let exact = 0.01 * fourth.sqrt() / squares;
    assert!(error > 0.5 * exact && error < 2.0 * exact, "{error} for {exact}");
    // The covariance of (μ, K) follows: both go with μ.
    assert!((known.covariance[0][0].sqrt() / 0.4 / error - 1.0).abs() < 0.02);
    assert!((known.covariance[0][1] / known.covariance[0][0] / (bulk(0.4) / 0.4) - 1.0).abs() < 1e-3);
    let three = fit(&tests, Poisson::AtRest(0.49), LawChoice::Ogden3, 6).unwrap();
    let known = knowledge(&three, &tests);
    assert!(
        known.numbers.iter().filter(|n| !n.determined).count() >= 3,
        "{known:?}"
    );
}

#[test]
fn refuses_data_without_a_modulus() {
    let law = Law::linear_isotropic(0.3, 0.4).unwrap();
    let mut test = measured(&law, TestKind::PlanarTension, 0.5, false);
    test.curve.stress.iter_mut().for_each(|p| *p = -*p);
    let error = fit(&[test], Poisson::AtRest(0.49), LawChoice::Ogden2, 6).unwrap_err();
    assert!(error.to_string().contains("planar-tension"), "{error}");
}
