//! Fits to presses: twins whose material is known.

use crate::twin::{Block, bench, displacement_error, measure, stress_error};
use pliant::fem::specimen::Specimen;
use pliant::fitting::probe::fit::{ProbeFit, ProbeOptions, fit};
use pliant::fitting::probe::press::Bench;
use pliant::fitting::probe::start::Symmetry;
use pliant::material::hyperelastic::{FoamTerm, Form, Hyperelastic};
use pliant::material::isotropic::{IsotropicRbf, invariants, shear_and_bulk};
use pliant::material::law::{Law, Range};
use pliant::material::record::{Formulation, Kind};
use pliant::material::transverse::{TransverseModuli, TransverseRbf};
use pliant::math::Vec3;
use pliant::math::mandel::Mandel;

/// A foam-like law of six centres: soft in the middle of compression, stiff beyond, with a Poisson's ratio that falls.
pub fn foam() -> Law {
    let path = [0.0, -0.1, -0.25, -0.45, 0.15];
    let young = [0.3, 0.2, 0.16, 0.3, 0.25];
    let ratio = [0.3, 0.22, 0.15, 0.1, 0.32];
    let mut centres: Vec<[f64; 3]> = path
        .iter()
        .zip(ratio)
        .map(|(e, r)| invariants(&Mandel::new(-r * e, -r * e, *e, 0.0, 0.0, 0.0)))
        .collect();
    centres.push(invariants(&Mandel::new(0.0, 0.0, 0.0, 0.0, 0.4, 0.0)));
    let mut moduli: Vec<[f64; 2]> = young
        .iter()
        .zip(ratio)
        .map(|(e, r)| shear_and_bulk(*e, r).map(|(s, b)| [s, b]).unwrap())
        .collect();
    let (shear, bulk) = shear_and_bulk(0.22, 0.25).unwrap();
    moduli.push([shear, bulk]);
    Law::Isotropic(IsotropicRbf::interpolating(&centres, &moduli, Range::UNBOUNDED).unwrap())
}

fn rubber() -> Law {
    let form = Form::NeoHookeanLogarithmic {
        shear_mpa: 0.1,
        lame_lambda_mpa: 0.2,
    };
    Law::Hyperelastic(Hyperelastic::new(form).unwrap())
}

fn fitted(bench: &mut Bench, symmetry: Symmetry, options: &ProbeOptions) -> ProbeFit {
    let mut told = 0;
    let fit = fit(bench, symmetry, options, &|| false, &mut |_| told += 1).unwrap();
    assert!(told >= fit.rounds.len());
    fit
}

fn print(fit: &ProbeFit) {
    for r in &fit.rounds {
        println!(
            "  {:22} {:2} centres, {:3} steps, {:3} laws, rms/σ {:9.5}, {:?}",
            r.stage, r.centres, r.iterations, r.evaluations, r.scaled_rms, r.stop
        );
    }
    println!(
        "  settled {}, {:.1} s, relative {:.3e}",
        fit.has_settled,
        fit.seconds,
        fit.errors.relative()
    );
}

fn number(name: &str, default: f64) -> f64 {
    std::env::var(name)
        .ok()
        .and_then(|v| v.parse().ok())
        .unwrap_or(default)
}

/// A fit of the size that the environment asks for, printed.
#[test]
#[ignore = "a measurement, minutes long"]
fn measure_twin() {
    let counts = [
        number("NX", 6.0) as usize,
        number("NY", 5.0) as usize,
        number("NZ", 3.0) as usize,
    ];
    let block = Block::standard(
        counts,
        number("PRESSES", 4.0) as usize,
        number("LEVELS", 4.0) as usize,
        number("FORCE", 12.0),
    );
    let which = std::env::var("TRUTH").unwrap_or("foam".into());
    let truth = match which.as_str() {
        "foam" => foam(),
        "rubber" => rubber(),
        "hyperfoam" => hyperfoam(),
        _ => fibres(),
    };
    let kind = match which.as_str() {
        "fibres" => Kind::TransverselyIsotropic,
        _ => Kind::Isotropic,
    };
    let set = block.set(kind, Vec3::z());
    let specimen = Specimen::new(&set).unwrap();
    let mut bench = bench(&set, &specimen);
    let began = std::time::Instant::now();
    let data = measure(&mut bench, &truth, number("NOISE", 0.0), 7);
    println!(
        "{} unknowns, truth in {:.1} s",
        specimen.model.unknowns(),
        began.elapsed().as_secs_f64()
    );
    let largest = data
        .equilibria
        .iter()
        .flatten()
        .flatten()
        .map(Vec3::norm)
        .fold(0.0, f64::max);
    println!("largest displacement {largest:.2} mm");
    let centres = number("CENTRES", 0.0) as usize;
    let options = ProbeOptions {
        tangential: number("TANGENTIAL", 0.0) > 0.0,
        centres: (centres > 0).then_some(centres),
        rounds: number("ROUNDS", 6.0) as usize,
        ..ProbeOptions::default()
    };
    let mut symmetry = Symmetry::of(&set.material);
    if number("ENERGY", 0.0) > 0.0 {
        symmetry.formulation = Formulation::Energy;
    }
    let fit = fitted(&mut bench, symmetry, &options);
    println!("floor {:.3} %", 100.0 * floor(&truth, &data.met));
    print(&fit);
    println!(
        "stress error {:.3} %, homogeneous {:.3} %",
        100.0 * stress_error(&fit.law, &truth, &data.met),
        100.0 * stress_error(&fit.homogeneous, &truth, &data.met)
    );
    if let Some(spread) = &fit.spread {
        for (name, d) in &spread.deviations {
            println!("  {name}: ± {d:.4}");
        }
    }
    let all: Vec<usize> = (0..bench.presses.len()).collect();
    let predicted = bench.equilibria(&fit.law, &all, &|| false).unwrap();
    println!(
        "displacements {:.3} %",
        100.0 * displacement_error(&predicted, &data.equilibria)
    );
}

fn hyperfoam() -> Law {
    let form = Form::Hyperfoam {
        terms: vec![FoamTerm {
            shear_mpa: 0.1,
            exponent: 8.0,
            poisson: 0.15,
        }],
    };
    Law::Hyperelastic(Hyperelastic::new(form).unwrap())
}

/// Fibres along z whose matrix softens in compression and shear.
pub fn fibres() -> Law {
    let at = |young: [f64; 2], ratios: [f64; 2], shear: f64| {
        TransverseModuli::from_engineering(young[0], young[1], ratios[0], ratios[1], shear).unwrap()
    };
    let strains = [
        Mandel::zeros(),
        Mandel::new(0.03, 0.03, -0.15, 0.0, 0.0, 0.0),
        Mandel::new(0.06, 0.06, -0.4, 0.0, 0.0, 0.0),
        Mandel::new(-0.03, -0.03, 0.15, 0.0, 0.0, 0.0),
        Mandel::new(-0.2, 0.05, 0.05, 0.0, 0.0, 0.0),
        Mandel::new(0.0, 0.0, -0.1, 0.3, 0.2, 0.0),
    ];
    let moduli = [
        at([0.4, 0.2], [0.3, 0.3], 0.1),
        at([0.3, 0.18], [0.25, 0.3], 0.09),
        at([0.25, 0.2], [0.2, 0.3], 0.08),
        at([0.35, 0.16], [0.3, 0.3], 0.1),
        at([0.4, 0.25], [0.3, 0.35], 0.1),
        at([0.32, 0.2], [0.25, 0.3], 0.13),
    ];
    let zero = TransverseRbf::linear(&moduli[0]).unwrap();
    let centres: Vec<[f64; 4]> = strains.iter().map(|e| zero.invariants(e)).collect();
    Law::TransverselyIsotropic(Box::new(
        TransverseRbf::interpolating(&centres, &moduli, Range::UNBOUNDED).unwrap(),
    ))
}

/// The least stress error of any secant law T = 2μ dev ε + K tr ε I with positive moduli, were they free at every strain.
fn floor(truth: &Law, met: &[pliant::fitting::probe::centres::Met]) -> f64 {
    use pliant::math::mandel::{deviator, trace};
    let (mut error, mut size) = (0.0, 0.0);
    for m in met {
        let stress = truth.stress(&m.strain);
        let (dev, pressure) = (deviator(&m.strain), trace(&stress) / 3.0);
        let part = deviator(&stress);
        let along = part.dot(&dev).max(0.0) / dev.norm_squared().max(1e-30);
        error += m.volume * (part - dev * along).norm_squared();
        if pressure * trace(&m.strain) < 0.0 {
            error += m.volume * 3.0 * pressure * pressure;
        }
        size += m.volume * stress.norm_squared();
    }
    (error / size).sqrt()
}
