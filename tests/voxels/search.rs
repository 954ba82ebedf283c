//! The search for layouts of voxels: against a genetic algorithm, and with its rules.

use crate::genetic;
use crate::support::{PLACES, goal, goal_text, rig};
use pliant::design::goal::Goal;
use pliant::design::misfit::Target;
use pliant::design::space::Space;
use pliant::design::voxels::rules::Rules;
use pliant::design::voxels::{Found, Options, search};
use pliant::fem::equilibrium;
use pliant::fem::example::MeasuredPoint;
use pliant::fem::rig::Rig;
use pliant::math::Vec3;
use std::time::{Duration, Instant};

const MATERIALS: [&str; 3] = ["ecoflex-00-30", "mold-star-16", "dragon-skin-30"];

/// A goal with hidden layout: nine points around each press, whole displacements.
struct Twin {
    goal: Goal,
    rig: Rig,
    target: Target,
}

/// A soft block with a stiff ball, a firm slab at one side and a stiff column: structure at several sizes.
fn hidden(counts: [usize; 3]) -> Vec<u8> {
    let [nx, ny, nz] = counts;
    (0..nx * ny * nz)
        .map(|c| {
            let index = [c % nx, c / nx % ny, c / (nx * ny)];
            let at = |k: usize, size: f64| size * (index[k] as f64 + 0.5) / counts[k] as f64;
            let p = Vec3::new(at(0, 50.0), at(1, 40.0), at(2, 25.0));
            let column = (p.x - 10.0).hypot(p.y - 29.0);
            match () {
                () if (p - Vec3::new(33.0, 15.0, 15.0)).norm() < 9.0 || column < 5.5 => 2,
                () if p.z < 8.0 && p.x < 26.0 || p.z > 21.0 && p.y > 22.0 => 1,
                () => 0,
            }
        })
        .collect()
}

fn twin(counts: [usize; 3], more: &str) -> Twin {
    let text = goal_text(
        &format!("voxels = {counts:?}"),
        &MATERIALS,
        more,
        PLACES.len(),
        &[0.6, 1.2],
    );
    let mut goal = goal(&text).unwrap();
    for example in &mut goal.setup.examples {
        let middle = example.contact.point;
        let around =
            (0..9).map(|k| middle + Vec3::new(4.0 * (k % 3) as f64 - 4.0, 4.0 * (k / 3) as f64 - 4.0, 0.0));
        example.points = around
            .map(|place| MeasuredPoint {
                place,
                directions: vec![Vec3::x(), Vec3::y(), Vec3::z()],
                displacements_mm: vec![vec![Some(0.0); 3]; 2],
            })
            .collect();
        example.tolerances_mm = vec![vec![0.0; 2]; 9];
    }
    let rig = rig(&goal);
    let options = equilibrium::Options::default();
    let response = rig.bench().unwrap().respond(&hidden(counts), &options, &|| false);
    assert!(response.complete);
    let mut target = Target::new(&goal.setup.examples);
    target.components = response.displacements.into_iter().map(Some).collect();
    Twin { goal, rig, target }
}

fn found(twin: &Twin, rules: &Rules, options: &Options) -> Found {
    let space = Space::free(twin.goal.setup.cells.count(), MATERIALS.len());
    search(
        &twin.rig,
        &twin.target,
        &space,
        rules,
        options,
        &|_, _| (),
        &|| false,
    )
    .unwrap()
}

/// Simulations and linearisations that the search takes to be as good as `rms_mm`. A linearisation counts as a simulation.
fn needed(found: &Found, rms_mm: f64) -> Option<usize> {
    let reached = found.history.iter().find(|own| own.rms_mm <= rms_mm)?;
    Some(reached.simulations + reached.linearisations)
}

fn compare(counts: [usize; 3], options: &Options, most: usize, least_budget: Duration) -> (Found, f64) {
    let twin = twin(counts, "");
    let cells = counts.iter().product();
    let began = Instant::now();
    let found = found(&twin, &Rules::free(cells), options);
    let own_time = began.elapsed();
    let best = found.outcome.best[0].misfit;
    println!(
        "search: {:.3e} mm RMS, {:.3e} mm at most, relaxed {:.3e} mm, uniform {:.3e} mm; {} simulations, {} linearisations, {own_time:.1?}",
        best.rms_mm,
        best.max_mm,
        found.relaxed_rms_mm,
        found.outcome.best_uniform.as_ref().unwrap().misfit.rms_mm,
        found.outcome.simulations,
        found.linearisations
    );
    for own in &found.history {
        println!(
            "  {:3} simulations, {:3} linearisations: {:.3e} mm",
            own.simulations, own.linearisations, own.rms_mm
        );
    }
    let began = Instant::now();
    let budget = own_time.max(least_budget);
    let genetic = genetic::run(
        &twin.rig,
        &twin.target,
        counts,
        1,
        options.tolerance,
        most,
        budget,
    );
    let needed = needed(&found, genetic.best_rms_mm);
    let ratio = needed.map_or(0.0, |n| genetic.simulations as f64 / n as f64);
    println!(
        "genetic: {:.3e} mm RMS, {} simulations, {:.1?}; the search needs {needed:?} for that: {ratio:.0} times fewer",
        genetic.best_rms_mm,
        genetic.simulations,
        began.elapsed()
    );
    (found, ratio)
}

/// The small sister of `full_size`. The ratio grows with the number of simulations that the genetic algorithm is given; here
/// they are few.
#[test]
fn slow_needs_far_fewer_simulations_than_a_genetic_algorithm() {
    let options = Options {
        most_simulations: 60,
        ..Options::default()
    };
    let (found, ratio) = compare([8, 6, 4], &options, 800, Duration::from_secs(15));
    let best = found.outcome.best[0].misfit.rms_mm;
    let uniform = found.outcome.best_uniform.unwrap().misfit.rms_mm;
    assert!(best < 0.05 * uniform, "{best} of {uniform}");
    assert!(ratio > 20.0, "{ratio}");
}

/// 20 × 16 × 10 voxels, ten presses: `cargo test --release --test voxels full_size -- --ignored --nocapture`; minutes.
/// `PLIANT_VOXEL_SECONDS` is what the genetic algorithm is given at least.
#[test]
#[ignore = "takes many minutes"]
fn full_size() {
    let seconds = std::env::var("PLIANT_VOXEL_SECONDS")
        .ok()
        .and_then(|s| s.parse().ok());
    let budget = Duration::from_secs(seconds.unwrap_or(0));
    let options = Options {
        most_simulations: 80,
        ..Options::default()
    };
    let (_, ratio) = compare([20, 16, 10], &options, usize::MAX, budget);
    assert!(ratio > 1.0, "{ratio}");
}
