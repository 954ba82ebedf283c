//! Twins: curves of a known law, fitted back.

use super::*;
use crate::material::homogeneous::{simple_shear, uniaxial};
use crate::material::isotropic::{IsotropicRbf, invariants, shear_and_bulk};
use crate::material::law::Range;
use crate::math::mandel::Mandel;

fn fit_rbf(tests: &[CouponTest], poisson: Poisson, centres: usize) -> Result<CouponFit, CouponError> {
    fit(tests, poisson, LawChoice::Rbf, centres)
}

fn rbf_of(fitted: &CouponFit) -> &IsotropicRbf {
    match &fitted.law {
        Law::Isotropic(law) => law,
        other => panic!("{other:?}"),
    }
}

fn known() -> Law {
    let at = |axial: f64| invariants(&Mandel::new(-0.3 * axial, -0.3 * axial, axial, 0.0, 0.0, 0.0));
    let centres = [
        [0.0; 3],
        at(-0.15),
        at(-0.3),
        at(-0.6),
        at(0.3),
        invariants(&simple_shear(0.4).0),
    ];
    let moduli = [0.30, 0.22, 0.26, 0.9, 0.5, 0.2].map(|e| {
        let (shear, bulk) = shear_and_bulk(e, 0.3).unwrap();
        [shear, bulk]
    });
    Law::Isotropic(IsotropicRbf::interpolating(&centres, &moduli, Range::UNBOUNDED).unwrap())
}

/// The curve of `law` in a test, without noise.
pub(in crate::fitting) fn measured(law: &Law, kind: TestKind, end: f64, widths: bool) -> CouponTest {
    let strain: Vec<f64> = (1..=50).map(|i| end * f64::from(i) / 50.0).collect();
    let stress = strain.iter().map(|&e| response(law, kind, e).stress).collect();
    let lateral = if widths {
        strain
            .iter()
            .map(|&a| (a, response(law, kind, a).free.unwrap()))
            .collect()
    } else {
        Vec::new()
    };
    CouponTest {
        kind,
        weight: 1.0,
        curve: Curve {
            strain,
            stress,
            lateral,
            slack: 0.0,
        },
    }
}

#[test]
fn one_test_comes_back_within_a_percent() {
    let law = known();
    let test = measured(&law, TestKind::UniaxialCompression, -0.6, false);
    let fitted = fit_rbf(std::slice::from_ref(&test), Poisson::Assumed(0.3), 6).unwrap();
    assert!(fitted.errors[0].relative_rms < 0.01, "{:?}", fitted.errors);
    assert_eq!(fitted.engineering_strain, [-0.6, 0.0]);
    assert!(fitted.law.in_range(&uniaxial(&fitted.law, -0.5).strain()));
    // The comparison has teeth: the law of another material does not pass.
    let other = Law::linear_isotropic(0.3, 0.3).unwrap();
    assert!(test_error(&other, &test).relative_rms > 0.2);
}

#[test]
fn three_tests_with_widths_come_back_within_a_percent() {
    let law = known();
    let tests = [
        measured(&law, TestKind::UniaxialCompression, -0.6, true),
        measured(&law, TestKind::UniaxialTension, 0.3, true),
        measured(&law, TestKind::SimpleShear, 0.4, false),
    ];
    for poisson in [FittedPoisson::Constant, FittedPoisson::ByStrain] {
        let fitted = fit_rbf(&tests, Poisson::Fitted(poisson), 14).unwrap();
        for e in &fitted.errors {
            assert!(e.relative_rms < 0.01, "{poisson:?} {e:?}");
            assert!(
                e.lateral_relative_rms.is_none_or(|e| e < 0.01),
                "{poisson:?} {e:?}"
            );
        }
        let ratio = fitted.law.poisson_ratio_at_rest();
        assert!(
            (ratio - 0.3).abs() < 0.02,
            "{poisson:?}: Poisson's ratio {ratio} at rest"
        );
    }
}

/// Hooke's law has nothing to interpolate: every centre must find its moduli.
#[test]
fn finds_hookes_moduli() {
    let law = Law::linear_isotropic(0.4, 0.25).unwrap();
    let tests = [
        measured(&law, TestKind::UniaxialTension, 0.5, false),
        measured(&law, TestKind::SimpleShear, 0.5, false),
    ];
    let fitted = fit_rbf(&tests, Poisson::Fitted(FittedPoisson::Constant), 6).unwrap();
    let law = rbf_of(&fitted);
    for q in &law.log_moduli().centres {
        // Parameters are rounded to six decimals.
        let [shear, bulk] = law.moduli(q);
        assert!(
            (shear - 0.16).abs() < 1e-5 && (bulk - 0.4 / 1.5).abs() < 1e-5,
            "{shear} {bulk} at {q:?}"
        );
    }
}

#[test]
fn says_what_the_tests_cannot_tell() {
    let law = known();
    let test = measured(&law, TestKind::UniaxialCompression, -0.6, false);
    let one = std::slice::from_ref(&test);
    let error = fit_rbf(one, Poisson::Fitted(FittedPoisson::Constant), 6).unwrap_err();
    assert!(error.to_string().contains("shear beside a uniaxial test"));
    assert!(fit_rbf(one, Poisson::Fitted(FittedPoisson::ByStrain), 6).is_err());
    assert!(fit_rbf(&[], Poisson::Assumed(0.3), 6).is_err());
    let mut upside = test.clone();
    upside.curve.stress.iter_mut().for_each(|p| *p = -*p);
    assert!(matches!(
        fit_rbf(&[upside], Poisson::Assumed(0.3), 6),
        Err(CouponError::Start { index: 1, .. })
    ));
}

/// With the bulk modulus held, Poisson's ratio follows from μ at each strain.
#[test]
fn keeps_the_bulk_modulus() {
    let law = known();
    let test = measured(&law, TestKind::UniaxialCompression, -0.6, false);
    let fitted = fit_rbf(std::slice::from_ref(&test), Poisson::AtRest(0.49), 6).unwrap();
    assert!((fitted.law.poisson_ratio_at_rest() - 0.49).abs() < 1e-9);
    let law = rbf_of(&fitted);
    let bulk: Vec<f64> = law
        .log_moduli()
        .centres
        .iter()
        .map(|q| law.moduli(q)[1])
        .collect();
    assert!(bulk.iter().all(|k| (k / bulk[0] - 1.0).abs() < 1e-9), "{bulk:?}");
    assert!(fitted.errors[0].relative_rms < 0.01, "{:?}", fitted.errors);
}

/// Two tests that contradict each other: the weights say whose word counts. With P = E e in both and moduli 1 and 2 MPa
/// (each test scaled by its own size), Σ w (E/E_t − 1)² is least at E = Σ w/E_t / Σ w/E_t².
#[test]
fn weights_decide_between_tests() {
    let linear = |young: f64| Law::linear_isotropic(young, 0.3).unwrap();
    let mut tests = [
        measured(&linear(1.0), TestKind::UniaxialTension, 0.2, false),
        measured(&linear(2.0), TestKind::UniaxialTension, 0.2, false),
    ];
    for weight in [1.0, 9.0] {
        tests[1].weight = weight;
        let fitted = fit_rbf(&tests, Poisson::Assumed(0.3), 2).unwrap();
        let expected = (1.0 + weight / 2.0) / (1.0 + weight / 4.0);
        // The ties pull at the fourth digit.
        let young = uniaxial(&fitted.law, 0.1).stress / 0.1;
        assert!((young / expected - 1.0).abs() < 2e-4, "{young} for {expected}");
        let own = [young - 1.0, young / 2.0 - 1.0];
        let all = ((own[0].powi(2) + weight * own[1].powi(2)) / (1.0 + weight)).sqrt();
        assert!((fitted.relative_rms / all - 1.0).abs() < 1e-2);
    }
}

/// Every kind of test, with widths where a side is free, and a Poisson's ratio that only they tell.
#[test]
fn all_kinds_together_come_back() {
    let law = known();
    let tests = [
        measured(&law, TestKind::UniaxialCompression, -0.5, true),
        measured(&law, TestKind::ConfinedCompression, -0.4, false),
        measured(&law, TestKind::EquibiaxialTension, 0.2, true),
        measured(&law, TestKind::PlanarTension, 0.3, true),
        measured(&law, TestKind::SimpleShear, 0.4, false),
    ];
    let fitted = fit_rbf(&tests, Poisson::Fitted(FittedPoisson::Constant), 20).unwrap();
    for error in &fitted.errors {
        assert!(error.relative_rms < 0.02, "{:?}", fitted.errors);
        assert!(
            error.lateral_relative_rms.is_none_or(|e| e < 0.02),
            "{:?}",
            fitted.errors
        );
    }
    assert_eq!(fitted.engineering_strain, [-0.5, 0.0], "the uniaxial test alone");
    // Confined beside uniaxial compression tells Poisson's ratio without any width.
    let two = [
        measured(&law, TestKind::UniaxialCompression, -0.5, false),
        measured(&law, TestKind::ConfinedCompression, -0.4, false),
    ];
    let fitted = fit_rbf(&two, Poisson::Fitted(FittedPoisson::Constant), 10).unwrap();
    let ratio = fitted.law.poisson_ratio_at_rest();
    assert!((ratio - 0.3).abs() < 0.02, "{ratio}");
}

/// A curve that begins at 30 %: the modulus at rest is what its tie says, those at the points are not.
#[test]
fn a_centre_without_data_is_not_determined() {
    let law = known();
    let mut test = measured(&law, TestKind::UniaxialCompression, -0.6, false);
    test.curve.strain.drain(..25);
    test.curve.stress.drain(..25);
    // Half a percent of noise, so that there is an error to speak of.
    for (i, p) in test.curve.stress.iter_mut().enumerate() {
        *p *= 1.0 + 0.005 * if i % 2 == 0 { 1.0 } else { -1.0 };
    }
    let tests = [test];
    let fitted = fit_rbf(&tests, Poisson::Assumed(0.3), 5).unwrap();
    let known = crate::fitting::coupon::uncertainty::knowledge(&fitted, &tests);
    let determined: Vec<bool> = known.numbers.iter().map(|n| n.determined).collect();
    assert!(!determined[0], "{known:?}");
    assert!(determined[1..].iter().all(|d| *d), "{known:?}");
    // Two parameters a centre, ln μ and ln K, which an assumed Poisson's ratio ties to one another.
    let n = known.covariance.len();
    assert_eq!(n, 2 * known.numbers.len());
    let last = known.numbers[n / 2 - 1].standard_error.unwrap();
    assert!((known.covariance[n - 2][n - 2].sqrt() / last - 1.0).abs() < 1e-6);
    assert!((known.covariance[n - 1][n - 2].sqrt() / last - 1.0).abs() < 1e-6);
}
