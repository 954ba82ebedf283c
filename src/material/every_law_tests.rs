//! Checks that every kind of law must pass: derivatives against differences, isotropy, definiteness, work round a cycle.

use super::*;
use crate::material::hyperelastic::{FoamTerm, Form, OgdenTerm, VolumeEnergy};
use crate::material::paper::{PaperParameters, StrainNorm};
use crate::math::Mat3;
use crate::math::mandel::{from_tensor, to_tensor};
use crate::math::rbf::ConstantTerm;
use nalgebra::Rotation3;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const CENTRES: [[f64; 3]; 6] = [
    [0.0, 0.0, 0.0],
    [-0.05, 0.15, -0.15],
    [-0.1, 0.3, -0.3],
    [-0.2, 0.5, -0.5],
    [0.05, 0.3, 0.25],
    [0.1, 0.4, 0.05],
];
const MODULI: [[f64; 2]; 6] = [
    [0.2, 1.0],
    [0.15, 0.9],
    [0.25, 1.5],
    [0.6, 4.0],
    [0.18, 0.8],
    [0.3, 0.4],
];

fn range() -> Range<3> {
    Range::new([-0.25, 0.0, -0.5], [0.15, 0.5, 0.4]).unwrap()
}

fn secant() -> Law {
    Law::Isotropic(IsotropicRbf::interpolating(&CENTRES, &MODULI, range()).unwrap())
}

fn energy() -> Law {
    let offset = EnergyRbf::default_offset(&CENTRES);
    Law::Energy(Box::new(
        EnergyRbf::interpolating(&CENTRES, &MODULI, offset, range()).unwrap(),
    ))
}

fn hyperelastic() -> Vec<Law> {
    let term = |shear_mpa, exponent| OgdenTerm { shear_mpa, exponent };
    let foam = |shear_mpa, exponent, poisson| FoamTerm {
        shear_mpa,
        exponent,
        poisson,
    };
    [
        Form::NeoHookeanLogarithmic {
            shear_mpa: 0.4,
            lame_lambda_mpa: 1.2,
        },
        Form::NeoHookeanIsochoric {
            shear_mpa: 0.3,
            bulk_mpa: 5.0,
        },
        Form::MooneyRivlin {
            c10_mpa: 0.15,
            c01_mpa: 0.05,
            bulk_mpa: 2.0,
        },
        // The three terms of Ogden 1972 for Treloar's rubber, in this convention: μ α/2.
        Form::Ogden {
            terms: vec![term(0.4095, 1.3), term(0.003, 5.0), term(0.01, -2.0)],
            volume: VolumeEnergy::Powers(vec![2.5, 0.3]),
        },
        Form::Ogden {
            terms: vec![term(0.3, 3.0)],
            volume: VolumeEnergy::Logarithm(1.7),
        },
        Form::Hyperfoam {
            terms: vec![foam(0.2, 8.0, 0.1), foam(0.05, -2.5, 0.0)],
        },
    ]
    .map(|form| Law::Hyperelastic(Hyperelastic::new(form).unwrap()))
    .to_vec()
}

fn paper(parameters: PaperParameters, norm: StrainNorm, constant: ConstantTerm) -> Law {
    let centres = [
        Mandel::zeros(),
        Mandel::new(-0.1, -0.1, 0.2, 0.05, 0.0, 0.0),
        Mandel::new(0.15, 0.1, -0.4, 0.0, 0.1, -0.2),
        Mandel::new(0.0, 0.0, 0.0, 0.3, -0.1, 0.2),
    ];
    let values: Vec<Vec<f64>> = match parameters {
        PaperParameters::LambdaAlpha => vec![vec![0.5, 0.2], vec![0.6, 0.1], vec![0.9, 0.3], vec![0.4, 0.15]],
        PaperParameters::Lame => vec![vec![0.5, 0.2], vec![0.6, 0.1], vec![0.9, 0.3], vec![0.4, 0.15]],
        PaperParameters::YoungPoisson => {
            vec![vec![0.5, 0.3], vec![0.6, 0.4], vec![0.9, 0.1], vec![0.4, 0.25]]
        }
        PaperParameters::Transverse => vec![
            vec![0.10, 0.04, 0.03, 0.40, 0.08],
            vec![0.12, 0.05, 0.02, 0.30, 0.06],
            vec![0.30, 0.12, 0.15, 0.90, 0.20],
            vec![0.50, 0.10, -0.05, 0.45, 0.10],
        ],
    };
    Law::Paper(Box::new(
        PaperRbf::interpolating(&centres, &values, parameters, norm, constant).unwrap(),
    ))
}

fn papers() -> Vec<Law> {
    use ConstantTerm::{With, Without};
    vec![
        paper(PaperParameters::LambdaAlpha, StrainNorm::Vector, Without),
        paper(PaperParameters::Lame, StrainNorm::Tensor, With),
        paper(PaperParameters::YoungPoisson, StrainNorm::Vector, With),
        paper(PaperParameters::Transverse, StrainNorm::Tensor, Without).rotated(&Vec3::new(1.0, -2.0, 0.5)),
    ]
}

fn transverse() -> Law {
    use crate::material::transverse::TransverseModuli;
    let centres = [
        [0.0; 4],
        [-0.2, 0.05, 0.0, 0.0],
        [0.05, 0.02, 0.3, 0.05],
        [0.0, 0.1, 0.05, 0.4],
    ];
    let moduli = [
        [0.10, 0.04, 0.03, 0.40, 0.08],
        [0.12, 0.05, 0.02, 0.30, 0.06],
        [0.15, -0.02, 0.03, 0.50, 0.11],
        [0.09, 0.04, 0.06, 0.35, 0.30],
    ]
    .map(TransverseModuli::from_array);
    let law = TransverseRbf::interpolating(&centres, &moduli, Range::UNBOUNDED).unwrap();
    Law::TransverselyIsotropic(Box::new(law)).rotated(&Vec3::new(0.3, -0.2, 0.5))
}

fn with_energy() -> Vec<Law> {
    let mut list = hyperelastic();
    list.push(energy());
    list
}

fn all() -> Vec<Law> {
    let mut list = with_energy();
    list.extend(papers());
    list.extend([secant(), transverse(), Law::linear_isotropic(0.3, 0.4).unwrap()]);
    list
}

fn rotation(rng: &mut Xoshiro256PlusPlus) -> Rotation3<f64> {
    Rotation3::new(Vec3::from_fn(|_, _| rng.gen_range(-3.0..3.0)))
}

fn turn(strain: &Mandel, rotation: &Rotation3<f64>) -> Mandel {
    let r: &Mat3 = rotation.matrix();
    from_tensor(&(r * to_tensor(strain) * r.transpose()))
}

/// Strains of every kind: tiny, small, large, with two or three principal strains equal or nearly so.
fn sample(rng: &mut Xoshiro256PlusPlus, trial: usize) -> Mandel {
    let mut any = |size: f64| rng.gen_range(-size..size);
    let e = match trial % 7 {
        0 => [any(1e-4), any(1e-4), any(1e-4)],
        1 => [any(0.02), any(0.02), any(0.02)],
        2 => [any(0.3), any(0.3), any(0.3)],
        3 => [any(0.55), any(0.55), any(0.55)],
        4 => {
            let a = any(0.3);
            [a, a, any(0.3)]
        }
        5 => {
            let a = any(0.3);
            [a, a + any(1e-6), any(0.3)]
        }
        _ => {
            let a = any(0.3);
            [a, a, a + any(1e-9)]
        }
    };
    let diagonal = Mandel::new(e[0], e[1], e[2], 0.0, 0.0, 0.0);
    // Every second one on the axes, where equal strains are equal to the last bit.
    if trial.is_multiple_of(2) {
        diagonal
    } else {
        turn(&diagonal, &rotation(rng))
    }
}

fn unit(j: usize, size: f64) -> Mandel {
    let mut step = Mandel::zeros();
    step[j] = size;
    step
}

#[test]
fn stress_is_the_derivative_of_the_energy() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let h = 1e-5;
    for (number, law) in with_energy().iter().enumerate() {
        for trial in 0..210 {
            let strain = sample(&mut rng, trial);
            let stress = law.stress(&strain);
            assert!(stress.iter().all(|x| x.is_finite()));
            for j in 0..6 {
                let at = |step: f64| law.energy(&(strain + unit(j, step))).unwrap();
                let quotient = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                // Rounding of an energy of order 1 MPa over h; truncation is h⁴ times a fifth derivative, at most the
                // fourth power of 1/δ = 1000 near rest.
                let allowed = 1e-9 + 1e-7 * stress.norm();
                let gap = (stress[j] - quotient).abs();
                assert!(
                    gap < allowed,
                    "law {number}, trial {trial}, {j}: {gap:e} of {:e}",
                    stress[j]
                );
            }
        }
    }
}

#[test]
fn tangent_is_the_derivative_of_the_stress() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    let h = 1e-6;
    for (number, law) in all().iter().enumerate() {
        for trial in 0..210 {
            let strain = sample(&mut rng, trial);
            let (stress, tangent) = law.stress_and_tangent(&strain);
            assert!((stress - law.stress(&strain)).norm() <= 1e-14 * stress.norm());
            // The secant laws and the papers' have kinks at the centres, of which one is rest.
            if law.energy(&strain).is_none() && strain.norm() < 1e-3 {
                continue;
            }
            for j in 0..6 {
                let quotient =
                    (law.stress(&(strain + unit(j, h))) - law.stress(&(strain - unit(j, h)))) / (2.0 * h);
                let gap = (tangent.column(j) - quotient).norm();
                // Rounding 1e-16/h; truncation: curvature over the smoothing length, (h/δ)² = 1e-6.
                assert!(
                    gap < 3e-6 * tangent.norm(),
                    "law {number}, trial {trial}, column {j}: {:e}",
                    gap / tangent.norm()
                );
            }
            if law.energy(&strain).is_some() {
                assert!((tangent - tangent.transpose()).norm() < 1e-12 * tangent.norm());
            }
        }
    }
}

#[test]
fn secants_are_positive_definite() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(13);
    for (number, law) in all().iter().enumerate() {
        for trial in 0..210 {
            let strain = sample(&mut rng, trial);
            let (stress, secant) = law.stress_and_secant(&strain);
            assert!((stress - law.stress(&strain)).norm() <= 1e-14 * stress.norm());
            assert!((secant - secant.transpose()).norm() < 1e-12 * secant.norm());
            let least = secant.symmetric_eigenvalues().min();
            assert!(
                least > 1e-4,
                "law {number}, trial {trial}: least eigenvalue {least}"
            );
        }
    }
}

#[test]
fn where_the_tangent_is_definite_the_secant_of_an_energy_is_the_tangent() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(14);
    let (mut same, mut raised) = (0, 0);
    for law in hyperelastic() {
        for trial in 0..210 {
            let strain = sample(&mut rng, trial);
            let (_, tangent) = law.stress_and_tangent(&strain);
            let (_, secant) = law.stress_and_secant(&strain);
            if tangent.symmetric_eigenvalues().min() > 0.1 {
                assert!((tangent - secant).norm() < 1e-12 * tangent.norm());
                same += 1;
            } else if tangent.symmetric_eigenvalues().min() < 0.0 {
                assert!((tangent - secant).norm() > 1e-6 * tangent.norm());
                raised += 1;
            }
        }
    }
    assert!(same > 500 && raised > 10, "{same} {raised}");
}

#[test]
fn neo_hooke_without_axes_is_neo_hooke_on_its_axes() {
    use crate::material::principal::Axes;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(15);
    for law in &hyperelastic()[..2] {
        let Law::Hyperelastic(own) = law else {
            unreachable!()
        };
        for trial in 0..210 {
            let strain = sample(&mut rng, trial);
            let axes = Axes::of(&strain);
            let at = own.principal(&axes.strains);
            let (stress, tangent) = law.stress_and_tangent(&strain);
            // U − U⁻¹ cancels to its last digits near rest: an absolute bound of a few roundings of the moduli.
            assert!((axes.tensor(&at.stress) - stress).norm() < 1e-14 * 30.0);
            // The limit of the quotient of stress differences has 1e-10.
            assert!((axes.tangent(&at) - tangent).norm() < 1e-9 * tangent.norm());
            assert!((at.energy - law.energy(&strain).unwrap()).abs() < 1e-14);
        }
    }
}

#[test]
fn stress_by_parameters_is_a_difference_quotient() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(16);
    for (number, law) in all().iter().enumerate() {
        let parameters = law.parameters();
        let values: Vec<f64> = parameters.iter().map(|p| p.value).collect();
        let back = law.with_parameters(&values).unwrap();
        for trial in 0..28 {
            let strain = sample(&mut rng, trial);
            let stress = law.stress(&strain);
            assert!((back.stress(&strain) - stress).norm() <= 1e-11 * stress.norm());
            let slopes = law.stress_by_parameters(&strain);
            assert_eq!(slopes.len(), parameters.len());
            let size = slopes.iter().map(|s| s.norm()).fold(0.0, f64::max);
            assert!(size > 0.0 && size.is_finite());
            for (k, slope) in slopes.iter().enumerate() {
                let h = 1e-5;
                let moved = |step: f64| {
                    let mut v = values.clone();
                    v[k] += step;
                    law.with_parameters(&v).unwrap().stress(&strain)
                };
                let quotient = (moved(h) - moved(-h)) / (2.0 * h);
                let gap = (slope - quotient).norm();
                // h² times a third derivative, and 1e-11 of the interpolation's solve over h.
                assert!(gap < 1e-6 * size, "law {number}, {}: {gap:e}", parameters[k].name);
            }
        }
        assert!(law.with_parameters(&values[1..]).is_err());
        let mut bad = values.clone();
        bad[0] = f64::NAN;
        assert!(law.with_parameters(&bad).is_err(), "law {number}");
    }
}

#[test]
fn energies_turn_with_the_strain() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(17);
    for law in with_energy() {
        for trial in 0..70 {
            let strain = sample(&mut rng, trial);
            let r = rotation(&mut rng);
            let gap = (law.stress(&turn(&strain, &r)) - turn(&law.stress(&strain), &r)).norm();
            assert!(gap < 1e-12 * (1.0 + law.stress(&strain).norm()), "{gap:e}");
        }
    }
}

/// The papers' form is not isotropic even with isotropic moduli: its centres are directions. Only there the turned stress
/// differs.
#[test]
fn tensor_centres_are_directions() {
    let law = paper(PaperParameters::Lame, StrainNorm::Tensor, ConstantTerm::With);
    let strain = Mandel::new(0.1, 0.1, -0.3, 0.0, 0.0, 0.0);
    let r = Rotation3::new(Vec3::new(1.2, 0.0, 0.0));
    let gap = (law.stress(&turn(&strain, &r)) - turn(&law.stress(&strain), &r)).norm();
    assert!(gap > 0.01 * law.stress(&strain).norm(), "{gap:e}");
    let Law::Paper(turned) = paper(
        PaperParameters::Transverse,
        StrainNorm::Tensor,
        ConstantTerm::With,
    ) else {
        unreachable!()
    };
    let about = Rotation3::rotation_between(&Vec3::z(), &Vec3::x()).unwrap();
    let carried = turned.rotated(&Vec3::x()).stress(&turn(&strain, &about));
    assert!((carried - turn(&turned.stress(&strain), &about)).norm() < 1e-14);
}

/// Work round a closed path of strain, ∮ T·dε, and the largest energy ½ T·ε on it.
fn work_round(law: &Law, a: &Mandel, b: &Mandel) -> (f64, f64) {
    // The trapezoidal rule on a period converges faster than any power for a smooth integrand.
    let n = 2000;
    let (mut work, mut largest) = (0.0, 0.0_f64);
    for i in 0..n {
        let t = std::f64::consts::TAU * i as f64 / n as f64;
        let strain = a * (1.0 - t.cos()) + b * t.sin();
        let rate = a * t.sin() + b * t.cos();
        let stress = law.stress(&strain);
        work += stress.dot(&rate) * std::f64::consts::TAU / n as f64;
        largest = largest.max(0.5 * stress.dot(&strain).abs());
    }
    (work, largest)
}

#[test]
fn energies_make_no_work_round_a_cycle_and_secants_do() {
    let a = Mandel::new(0.05, 0.03, -0.2, 0.02, 0.0, 0.05);
    let b = Mandel::new(-0.05, 0.08, 0.03, 0.1, -0.1, 0.15);
    for law in with_energy() {
        let (work, largest) = work_round(&law, &a, &b);
        // The path leaves the fitted range, where the second derivative of the hold has kinks: n⁻³ of the energy.
        assert!(work.abs() < 1e-8 * largest, "{work:e} of {largest:e}");
    }
    for law in [secant(), papers().remove(1)] {
        let (work, largest) = work_round(&law, &a, &b);
        assert!(work.abs() > 0.01 * largest, "{work:e} of {largest:e}");
    }
}

#[test]
fn an_interpolated_energy_has_its_moduli_at_the_centres_and_is_hookes_law_with_one_modulus() {
    let Law::Energy(law) = energy() else {
        unreachable!()
    };
    for (q, moduli) in CENTRES.iter().zip(&MODULI) {
        let [shear, bulk] = law.moduli(q);
        assert!((shear - moduli[0]).abs() < 1e-12 && (bulk - moduli[1]).abs() < 1e-11);
    }
    let same = [[0.37, 2.1]; 6];
    let one = Law::Energy(Box::new(
        EnergyRbf::interpolating(&CENTRES, &same, 0.1, range()).unwrap(),
    ));
    let (young, poisson) = (
        crate::material::isotropic::young(0.37, 2.1),
        crate::material::isotropic::poisson(0.37, 2.1),
    );
    let hooke = Law::linear_isotropic(young, poisson).unwrap();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(18);
    for trial in 0..70 {
        let strain = sample(&mut rng, trial);
        let gap = (one.stress(&strain) - hooke.stress(&strain)).norm();
        assert!(gap < 1e-11 * hooke.stress(&strain).norm(), "{gap:e}");
        assert!((one.energy(&strain).unwrap() / hooke.energy(&strain).unwrap() - 1.0).abs() < 1e-11);
    }
}

#[test]
fn beyond_the_range_an_energys_moduli_stand() {
    let Law::Energy(law) = energy() else {
        unreachable!()
    };
    // The first invariant's range is 0.4 wide: it stands 0.1 beyond its ends from 0.2 beyond them on.
    let at = |q: f64| law.moduli(&[q, 0.1, 0.0]);
    assert_eq!(at(0.36), at(7.0));
    assert_ne!(at(0.33), at(0.36));
    // The smooth stand is the value of the interpolant a tenth beyond the end.
    let stand = law.log_moduli().value(&[0.25, 0.1, 0.0]).map(f64::exp);
    assert!((at(7.0)[0] - stand[0]).abs() < 1e-15);
    assert!(law.in_range(&Mandel::zeros()) && !law.in_range(&Mandel::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)));
}

#[test]
fn the_papers_form_by_hand() {
    // One centre at rest and one at 0.2 along x, without constant: φ matrix [[0, 0.2], [0.2, 0]], so
    // w = (p2, p1)/0.2 and p(0.1) = 0.1 (p1 + p2)/0.2 = the mean. Chapter 7: λ = E/((1+ν)(1−2ν)), α = λν.
    let centres = [Mandel::zeros(), unit(0, 0.2)];
    let values = [vec![0.5, 0.2], vec![0.7, 0.1]];
    let law = PaperRbf::interpolating(
        &centres,
        &values,
        PaperParameters::LambdaAlpha,
        StrainNorm::Vector,
        ConstantTerm::Without,
    )
    .unwrap();
    let p = law.values_at(&unit(0, 0.1));
    assert!((p[0] - 0.6).abs() < 1e-15 && (p[1] - 0.15).abs() < 1e-15);
    // σ = (λ − α) ε along x, α ε across: (7.4) with E = λ G + α H.
    let stress = law.stress(&unit(0, 0.1));
    let expected = Mandel::new(0.045, 0.015, 0.015, 0.0, 0.0, 0.0);
    assert!((stress - expected).norm() < 1e-15, "{stress}");
    // Science notes, point 6: on the far side, where distances grow, equal moduli are not given back.
    let same = PaperRbf::interpolating(
        &[unit(0, 0.1), unit(1, 0.1)],
        &[vec![0.5, 0.2], vec![0.5, 0.2]],
        PaperParameters::LambdaAlpha,
        StrainNorm::Vector,
        ConstantTerm::Without,
    )
    .unwrap();
    assert!((same.values_at(&Mandel::zeros())[0] - 0.5 * 2.0 / 2.0_f64.sqrt()).abs() < 1e-14);
    // `vector` counts a shear once: (7.2) holds 0.1 where Mandel holds 0.1 √2.
    let shear = Mandel::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.1 * 2.0_f64.sqrt());
    assert!((law.values_at(&shear)[1] - 0.1 * (0.1 + 0.2 * 5.0_f64.sqrt()) / 0.2).abs() < 1e-14);
    // 0.7 at 0.2 and 0.5 at rest: λ runs away beyond, α falls: nothing keeps λ − 2α and 1 + … positive.
    assert!(law.is_definite(&unit(0, 0.1)));
    let lost = PaperRbf::interpolating(
        &[Mandel::zeros(), unit(0, 0.1)],
        &[vec![0.1, 0.01], vec![1.0, 0.45]],
        PaperParameters::LambdaAlpha,
        StrainNorm::Tensor,
        ConstantTerm::Without,
    )
    .unwrap();
    let far = unit(1, 0.5);
    let p = lost.values_at(&far);
    assert_eq!(lost.is_definite(&far), p[0] > 2.0 * p[1] && p[0] > -p[1]);
}

#[test]
fn refuses_what_makes_no_material() {
    let hyper = |form| Hyperelastic::new(form).unwrap_err().to_string();
    let message = hyper(Form::NeoHookeanIsochoric {
        shear_mpa: -0.1,
        bulk_mpa: 1.0,
    });
    assert!(message.contains("shear modulus at rest = -0.1"), "{message}");
    let message = hyper(Form::NeoHookeanLogarithmic {
        shear_mpa: 0.3,
        lame_lambda_mpa: -0.3,
    });
    assert!(message.contains("bulk modulus at rest"), "{message}");
    let message = hyper(Form::Ogden {
        terms: vec![OgdenTerm {
            shear_mpa: 1.0,
            exponent: 0.0,
        }],
        volume: VolumeEnergy::Logarithm(1.0),
    });
    assert!(message.contains("terms[0].exponent = 0"), "{message}");
    let message = hyper(Form::Hyperfoam {
        terms: vec![FoamTerm {
            shear_mpa: 1.0,
            exponent: 2.0,
            poisson: 0.5,
        }],
    });
    assert!(message.contains("terms[0].poisson = 0.5"), "{message}");
    assert!(hyper(Form::Hyperfoam { terms: vec![] }).contains("at least one"));
    let message = hyper(Form::MooneyRivlin {
        c10_mpa: f64::NAN,
        c01_mpa: 0.0,
        bulk_mpa: 1.0,
    });
    assert!(message.contains("c10 = NaN"), "{message}");
    let centres = [Mandel::zeros(), unit(0, 0.1)];
    let indefinite = PaperRbf::interpolating(
        &centres,
        &[vec![0.5, 0.2], vec![0.5, 0.25]],
        PaperParameters::LambdaAlpha,
        StrainNorm::Tensor,
        ConstantTerm::With,
    );
    assert!(matches!(indefinite, Err(LawError::Centre { centre: 1, .. })));
    let alone = PaperRbf::interpolating(
        &centres[..1],
        &[vec![0.5, 0.2]],
        PaperParameters::LambdaAlpha,
        StrainNorm::Tensor,
        ConstantTerm::Without,
    );
    assert!(alone.is_err(), "φ(0) = 0: no stiffness at all");
    assert!(EnergyRbf::interpolating(&CENTRES, &MODULI, -1.0, range()).is_err());
}

#[test]
fn without_positive_stretches_there_is_no_answer() {
    for law in hyperelastic() {
        for strain in [
            Mandel::new(-1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            Mandel::new(0.1, 0.1, -1.2, 0.0, 0.0, 0.0),
            // Two negative stretches: J is positive, U is not.
            Mandel::new(-1.5, -1.5, 0.0, 0.0, 0.0, 0.0),
            Mandel::repeat(f64::NAN),
        ] {
            assert!(law.stress(&strain).iter().all(|x| x.is_nan()));
            assert!(law.stress_and_tangent(&strain).1.iter().any(|x| x.is_nan()));
            assert!(law.energy(&strain).unwrap().is_nan());
        }
        assert_eq!(law.volumetric(), Volumetric::Jacobian);
        let (_, tangent) = law.stress_and_tangent(&Mandel::zeros());
        let hooke = Law::linear_isotropic(law.young_modulus(&Mandel::zeros()), law.poisson_ratio_at_rest());
        let (_, expected) = hooke.unwrap().stress_and_tangent(&Mandel::zeros());
        assert!(
            (tangent - expected).norm() < 1e-13 * expected.norm(),
            "Hooke's law at rest"
        );
    }
}
