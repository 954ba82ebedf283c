//! A block with a hidden layout of voxels, searched, and searched by a genetic algorithm.

use crate::genetic;
use crate::support::{PLACES, goal, goal_text, rig};
use pliant::design::goal::Goal;
use pliant::design::misfit::Target;
use pliant::design::search::Aim;
use pliant::design::space::Space;
use pliant::design::voxels::bench::OwnMixtures;
use pliant::design::voxels::rules::VoxelRules;
use pliant::design::voxels::{Found, Milestone, Options, search};
use pliant::fem::equilibrium;
use pliant::fem::example::MeasuredPoint;
use pliant::fem::mixture::Mixtures;
use pliant::fem::rig::Rig;
use pliant::math::Vec3;
use std::time::{Duration, Instant};

pub const MATERIALS: [&str; 3] = ["ecoflex-00-30", "mold-star-16", "dragon-skin-30"];

/// A goal with hidden layout: nine points around each press, whole displacements.
pub struct Twin {
    pub goal: Goal,
    pub rig: Rig,
    pub target: Target,
}

/// A soft block with a stiff ball, a firm slab at one side and a stiff column: structure at several sizes.
pub fn hidden(counts: [usize; 3]) -> Vec<u8> {
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

/// A block of `counts` voxels; `more` stands in its goal.
pub fn twin(counts: [usize; 3], more: &str) -> Twin {
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

impl Twin {
    /// All layouts.
    pub fn space(&self) -> Space {
        Space::free(self.goal.setup.cells.count(), MATERIALS.len())
    }

    /// Searches `space`, with a price on cost if any.
    pub fn search(&self, space: &Space, cost_weight_mm: f64, rules: &VoxelRules, options: &Options) -> Found {
        let aim = Aim {
            space,
            target: &self.target,
            cost_weight_mm,
        };
        let mut bench = OwnMixtures::new(Mixtures::new(&self.rig, space.cells), rules, &|| false);
        search(&self.rig, &aim, rules, options, &mut bench, &|_, _| ()).unwrap()
    }
}

/// Simulations and linearisations; a linearisation counts as a simulation.
fn cost(own: &Milestone) -> usize {
    own.simulations + own.linearisations
}

/// Searches, and lets the genetic algorithm search for as long, at least `least_budget` and at most `most` simulations. How many times as
/// many simulations that takes to the error where it ends.
pub fn compare(counts: [usize; 3], options: &Options, most: usize, least_budget: Duration) -> (Found, f64) {
    let twin = twin(counts, "");
    let cells = counts.iter().product();
    let began = Instant::now();
    let found = twin.search(&twin.space(), 0.0, &VoxelRules::free(cells), options);
    let own_time = began.elapsed();
    let best = found.outcome.best[0].misfit;
    println!(
        "search: {:.3e} mm RMS, {:.3e} mm at most, mixtures {:.3e} mm, one material {:.3e} mm; {} simulations, {} linearisations, {own_time:.1?}",
        best.rms_mm,
        best.max_mm,
        found.relaxed_rms_mm,
        found.outcome.best_uniform.as_ref().unwrap().misfit.rms_mm,
        found.outcome.simulations,
        found.linearisations
    );
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
    println!(
        "genetic algorithm: {:.3e} mm RMS, {} simulations, {:.1?}",
        genetic.best_rms_mm,
        genetic.simulations,
        began.elapsed()
    );
    println!("error mm | search: simulations, linearisations | genetic algorithm: simulations | ratio");
    for own in &found.history {
        let reached = genetic.history.iter().find(|(_, rms_mm)| *rms_mm <= own.rms_mm);
        let (sign, count) = reached.map_or((">", genetic.simulations), |r| ("", r.0));
        println!(
            "{:.3e} | {}, {} | {sign}{count} | {sign}{:.0}",
            own.rms_mm,
            own.simulations,
            own.linearisations,
            count as f64 / cost(own) as f64
        );
    }
    let better = found.history.iter().find(|own| own.rms_mm <= genetic.best_rms_mm);
    let ratio = better.map_or(0.0, |own| genetic.simulations as f64 / cost(own) as f64);
    println!("at the error where the genetic algorithm ends: {ratio:.0} times fewer");
    (found, ratio)
}
