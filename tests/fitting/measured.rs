//! Twins of the size that the environment asks for, to be run by hand: what the documents say of accuracy and speed.
//!
//! `TRUTH=fibres NX=9 NY=8 NZ=5 PRESSES=10 LEVELS=5 cargo test --release --test fitting -- --ignored --nocapture twin_by_hand`

use crate::laws::{fibres, foam, hyperfoam, rubber};
use crate::probe::fitted;
use crate::twin::{Block, displacement_error, measure, pressed, stress_error};
use pliant::fem::specimen::Specimen;
use pliant::fitting::probe::centres::Met;
use pliant::fitting::probe::fit::{ProbeFit, ProbeOptions};
use pliant::fitting::probe::start::Symmetry;
use pliant::material::law::Law;
use pliant::material::record::{Formulation, Kind};
use pliant::math::Vec3;
use pliant::math::mandel::{deviator, trace};

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
fn twin_by_hand() {
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
    let mut pressed = pressed(&set, &specimen);
    let began = std::time::Instant::now();
    let data = measure(&mut pressed, &truth, number("NOISE", 0.0), 7);
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
        moves_centres: number("MOVES", 1.0) > 0.0,
        move_tolerance: number("CREEP", 5e-3),
        rounds: number("ROUNDS", 6.0) as usize,
        ..ProbeOptions::default()
    };
    let mut symmetry = Symmetry::of(&set.material);
    if number("ENERGY", 0.0) > 0.0 {
        symmetry.formulation = Formulation::Energy;
    }
    let fit = fitted(&mut pressed, symmetry, &options);
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
    let all: Vec<usize> = (0..pressed.presses.len()).collect();
    let predicted = pressed.equilibria(&fit.law, &all, &|| false).unwrap();
    println!(
        "displacements {:.3} %",
        100.0 * displacement_error(&predicted, &data.equilibria)
    );
}

/// The least stress error of any secant law T = 2μ dev ε + K tr ε I with positive moduli, were they free at every strain.
fn floor(truth: &Law, met: &[Met]) -> f64 {
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
