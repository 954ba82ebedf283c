//! Twins: curves of a known law, fitted back.

use super::*;

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

fn measured(law: &Law, kind: TestKind, end: f64, widths: bool) -> CouponTest {
    let strain: Vec<f64> = (1..=50).map(|i| end * f64::from(i) / 50.0).collect();
    let stress = strain.iter().map(|&e| stress_in(law, kind, e)).collect();
    let lateral = if widths {
        strain.iter().map(|&a| (a, uniaxial(law, a).lateral)).collect()
    } else {
        Vec::new()
    };
    CouponTest {
        kind,
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
    let fitted = fit(std::slice::from_ref(&test), Poisson::Assumed(0.3), 6).unwrap();
    assert!(fitted.errors[0].relative_rms < 0.01, "{:?}", fitted.errors);
    assert_eq!(fitted.engineering_strain, [-0.6, 0.0]);
    assert!(
        fitted
            .law
            .in_range(&uniaxial(&Law::Isotropic(fitted.law.clone()), -0.5).strain())
    );
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
        let fitted = fit(&tests, Poisson::Fitted(poisson), 14).unwrap();
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
    let fitted = fit(&tests, Poisson::Fitted(FittedPoisson::Constant), 6).unwrap();
    for q in &fitted.law.log_moduli().centres {
        // Parameters are rounded to six decimals.
        let [shear, bulk] = fitted.law.moduli(q);
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
    let error = fit(one, Poisson::Fitted(FittedPoisson::Constant), 6).unwrap_err();
    assert!(error.to_string().contains("shear beside a uniaxial test"));
    assert!(fit(one, Poisson::Fitted(FittedPoisson::ByStrain), 6).is_err());
    assert!(fit(&[], Poisson::Assumed(0.3), 6).is_err());
    let mut upside = test.clone();
    upside.curve.stress.iter_mut().for_each(|p| *p = -*p);
    assert!(matches!(
        fit(&[upside], Poisson::Assumed(0.3), 6),
        Err(CouponError::Start { index: 1, .. })
    ));
}

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
/// With the bulk modulus held, Poisson's ratio follows from μ at each strain.
#[test]
fn keeps_the_bulk_modulus() {
    let law = known();
    let test = measured(&law, TestKind::UniaxialCompression, -0.6, false);
    let fitted = fit(std::slice::from_ref(&test), Poisson::AtRest(0.49), 6).unwrap();
    assert!((fitted.law.poisson_ratio_at_rest() - 0.49).abs() < 1e-9);
    let bulk: Vec<f64> = fitted
        .law
        .log_moduli()
        .centres
        .iter()
        .map(|q| fitted.law.moduli(q)[1])
        .collect();
    assert!(bulk.iter().all(|k| (k / bulk[0] - 1.0).abs() < 1e-9), "{bulk:?}");
    assert!(fitted.errors[0].relative_rms < 0.01, "{:?}", fitted.errors);
}
