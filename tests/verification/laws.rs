//! Hyperelastic laws in homogeneous tests against formulae written by hand from the energies.
//!
//! Incompressible formulae are compared with a bulk modulus K of 10⁶ times the shear modulus: the volume then changes by
//! about σ/K with the true stress σ = λP, and the stress relatively by some times as much, up to twice the largest exponent.
//! Simple shear keeps the volume by itself and is exact.

use pliant::material::homogeneous::{equibiaxial, shear_stress, uniaxial};
use pliant::material::hyperelastic::{FoamTerm, Form, Hyperelastic, OgdenTerm, VolumeEnergy};
use pliant::material::law::Law;

const STRETCHES: [f64; 7] = [0.3, 0.5, 0.8, 1.05, 1.5, 2.0, 3.0];
const SHEARS: [f64; 4] = [-0.4, 0.1, 0.7, 2.0];

fn law(form: Form) -> Law {
    Law::Hyperelastic(Hyperelastic::new(form).unwrap())
}

/// The stress of a law in the three tests against three formulae of stretch, stretch and shear, which hold to
/// `tolerance` for the bulk modulus `bulk` \[MPa\].
fn compare(
    law: &Law,
    in_tension: impl Fn(f64) -> f64,
    in_plane: impl Fn(f64) -> f64,
    in_shear: impl Fn(f64) -> f64,
    bulk: f64,
    tolerance: f64,
) {
    let near = |found: f64, expected: f64, stretch: f64, what: &str| {
        let allowed = tolerance + 10.0 * (stretch * expected / bulk).abs();
        let gap = (found / expected - 1.0).abs();
        assert!(
            gap < allowed,
            "{what} {stretch}: {found}, expected {expected}, {gap:e} off"
        );
    };
    for l in STRETCHES {
        near(uniaxial(law, l - 1.0).stress, in_tension(l), l, "uniaxial");
        near(equibiaxial(law, l - 1.0).stress, in_plane(l), l, "equibiaxial");
    }
    for g in SHEARS {
        let (found, expected) = (shear_stress(law, g), in_shear(g));
        assert!(
            (found / expected - 1.0).abs() < tolerance,
            "shear {g}: {found} {expected}"
        );
    }
}

#[test]
fn incompressible_rubbers() {
    // W = μ/2 (I1 − 3) at J = 1: P = μ (λ − λ⁻²), μ (λ − λ⁻⁵), μ γ.
    let shear_mpa = 0.4;
    let neo = |l: f64| shear_mpa * (l - l.powi(-2));
    let plane = |l: f64| shear_mpa * (l - l.powi(-5));
    for form in [
        Form::NeoHookeanIsochoric {
            shear_mpa,
            bulk_mpa: 4e5,
        },
        Form::NeoHookeanLogarithmic {
            shear_mpa,
            lame_lambda_mpa: 4e5,
        },
    ] {
        compare(&law(form), neo, plane, |g| shear_mpa * g, 4e5, 1e-6);
    }
    // Rivlin 1948: P = 2 (C10 + C01/λ)(λ − λ⁻²), 2 (C10 + C01 λ²)(λ − λ⁻⁵), 2 (C10 + C01) γ.
    let (c10_mpa, c01_mpa) = (0.15, 0.05);
    compare(
        &law(Form::MooneyRivlin {
            c10_mpa,
            c01_mpa,
            bulk_mpa: 4e5,
        }),
        |l| 2.0 * (c10_mpa + c01_mpa / l) * (l - l.powi(-2)),
        |l| 2.0 * (c10_mpa + c01_mpa * l * l) * (l - l.powi(-5)),
        |g| 2.0 * (c10_mpa + c01_mpa) * g,
        4e5,
        1e-6,
    );
}

#[test]
fn ogdens_rubber() {
    // Ogden 1972, Treloar's rubber: μ_k, α_k of Σ μ/α (Σ λ^α − 3) in MPa; here 2μ/α² stands for μ/α.
    let terms = [(0.63, 1.3), (0.0012, 5.0), (-0.01, -2.0)];
    let form = Form::Ogden {
        terms: terms
            .iter()
            .map(|&(m, exponent)| OgdenTerm {
                shear_mpa: 0.5 * m * exponent,
                exponent,
            })
            .collect(),
        volume: VolumeEnergy::Powers(vec![2e5]),
    };
    let sum = |of: &dyn Fn(f64, f64) -> f64| terms.iter().map(|&(m, a)| of(m, a)).sum::<f64>();
    compare(
        &law(form),
        |l| sum(&|m, a| m * (l.powf(a - 1.0) - l.powf(-0.5 * a - 1.0))),
        |l| sum(&|m, a| m * (l.powf(a - 1.0) - l.powf(-2.0 * a - 1.0))),
        // γ = λ − 1/λ, so dW/dγ = Σ μ (λ^α − λ^−α)/(λ + 1/λ).
        |g| {
            let l = 0.5 * g + (1.0 + 0.25 * g * g).sqrt();
            sum(&|m, a| m * (l.powf(a) - l.powf(-a)) / (l + 1.0 / l))
        },
        4e5,
        1e-6,
    );
}

#[test]
fn hyperfoam() {
    // With one ν for all terms the lateral stretch is λ^−ν in the uniaxial test and λ^(−2ν/(1−ν)) in the equibiaxial one,
    // for every α: each term's lateral stress λ_t^α − J^(−αβ) vanishes by itself. All is exact.
    let poisson = 0.2;
    let terms = [(0.2, 8.0), (0.05, -2.5)];
    let form = Form::Hyperfoam {
        terms: terms
            .iter()
            .map(|&(shear_mpa, exponent)| FoamTerm {
                shear_mpa,
                exponent,
                poisson,
            })
            .collect(),
    };
    let sum = |of: &dyn Fn(f64) -> f64| terms.iter().map(|&(m, a)| 2.0 * m / a * of(a)).sum::<f64>();
    let law = law(form);
    compare(
        &law,
        |l| sum(&|a| (l.powf(a) - l.powf(-a * poisson)) / l),
        |l| sum(&|a| (l.powf(a) - l.powf(-2.0 * a * poisson / (1.0 - poisson))) / l),
        |g| {
            let l = 0.5 * g + (1.0 + 0.25 * g * g).sqrt();
            sum(&|a| (l.powf(a) - l.powf(-a)) / (l + 1.0 / l))
        },
        f64::INFINITY,
        1e-9,
    );
    for l in STRETCHES {
        let lateral = uniaxial(&law, l - 1.0).lateral;
        assert!((lateral + 1.0 - l.powf(-poisson)).abs() < 1e-12, "{lateral}");
        let thickness = equibiaxial(&law, l - 1.0).thickness;
        assert!((thickness + 1.0 - l.powf(-2.0 * poisson / (1.0 - poisson))).abs() < 1e-11);
    }
}

#[test]
fn compressible_neo_hooke() {
    // Lateral balance by bisection on the energies' own derivatives, E = 0.15 MPa, ν = 0.4.
    let (shear_mpa, bulk_mpa) = (0.15 / 2.8, 0.15 / 0.6);
    let lame_lambda_mpa = bulk_mpa - 2.0 / 3.0 * shear_mpa;
    // λ_t ∂W/∂λ_t and λ ∂W/∂λ of both forms at stretches λ along and t across.
    let logarithmic = |x: f64, l: f64, t: f64| shear_mpa * (x * x - 1.0) + lame_lambda_mpa * (l * t * t).ln();
    let isochoric = |x: f64, l: f64, t: f64| {
        let j = l * t * t;
        shear_mpa * j.powf(-2.0 / 3.0) * (x * x - (l * l + 2.0 * t * t) / 3.0) + bulk_mpa * j * (j - 1.0)
    };
    type Balance<'a> = &'a dyn Fn(f64, f64, f64) -> f64;
    let forms: [(Form, Balance); 2] = [
        (
            Form::NeoHookeanLogarithmic {
                shear_mpa,
                lame_lambda_mpa,
            },
            &logarithmic,
        ),
        (Form::NeoHookeanIsochoric { shear_mpa, bulk_mpa }, &isochoric),
    ];
    for (form, balance) in forms {
        let law = law(form);
        for l in STRETCHES {
            let (mut low, mut high) = (0.1, 3.0);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if balance(middle, l, middle) > 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            let state = uniaxial(&law, l - 1.0);
            assert!(
                (state.lateral + 1.0 - low).abs() < 1e-12,
                "{l}: {} {low}",
                state.lateral
            );
            assert!((state.stress - balance(l, l, low) / l).abs() < 1e-12);
        }
    }
}
