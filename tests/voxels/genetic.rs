//! What the search is compared with: a genetic algorithm, seeded.
//!
//! Tournaments of three, one child in two crossed by a box of voxels and the other voxel by voxel, mutation of single voxels
//! and, in one child of two, of a box that takes one material; the two best live on. It starts from all uniform layouts,
//! random boxes on a uniform ground, and noise.

use pliant::design::misfit::Target;
use pliant::fem::equilibrium::Options;
use pliant::fem::rig::Rig;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256Plus;
use rayon::prelude::*;
use std::time::{Duration, Instant};

const POPULATION: usize = 24;
const ELITE: usize = 2;

/// A layout with its RMS error \[mm\].
type Rated = (Vec<u8>, f64);

/// What came out.
pub struct Outcome {
    pub best_rms_mm: f64,
    pub simulations: usize,
    /// Simulations and best error after each generation \[mm\].
    pub history: Vec<(usize, f64)>,
}

/// Runs until `most` simulations or `budget` are spent. `counts` are the voxels along x, y and z, x running fastest.
pub fn run(
    rig: &Rig,
    target: &Target,
    counts: [usize; 3],
    seed: u64,
    tolerance: f64,
    most: usize,
    budget: Duration,
) -> Outcome {
    let mut random = Xoshiro256Plus::seed_from_u64(seed);
    let materials = rig.laws.len() as u8;
    let began = Instant::now();
    let options = Options::for_search(tolerance);
    let rate = |layouts: Vec<Vec<u8>>| -> Vec<Rated> {
        layouts
            .into_par_iter()
            .map_init(
                || rig.bench().expect("memory"),
                |bench, layout| {
                    let response = bench.respond(&layout, &options, &|| false);
                    let misfit = target.misfit(&response.displacements);
                    let rms_mm = if response.complete {
                        misfit.rms_mm
                    } else {
                        f64::INFINITY
                    };
                    (layout, rms_mm)
                },
            )
            .collect()
    };
    let cells = counts.iter().product();
    let first = (0..POPULATION).map(|k| {
        let mut layout = vec![k as u8 % materials; cells];
        if k >= materials as usize {
            (0..k % 8).for_each(|_| paint(&mut layout, counts, materials, &mut random));
        }
        if k % 8 == 7 {
            layout
                .iter_mut()
                .for_each(|m| *m = random.gen_range(0..materials));
        }
        layout
    });
    let mut population = rate(first.collect());
    let mut simulations = POPULATION;
    sort(&mut population);
    let mut history = vec![(simulations, population[0].1)];
    while simulations < most && began.elapsed() < budget {
        let children = (ELITE..POPULATION)
            .map(|k| {
                let (a, b) = (tournament(&mut random), tournament(&mut random));
                let mut child = population[a].0.clone();
                let other = &population[b].0;
                if k % 2 == 0 {
                    let area = area(counts, &mut random);
                    (0..cells)
                        .filter(|&c| inside(c, counts, &area))
                        .for_each(|c| child[c] = other[c]);
                } else {
                    (0..cells)
                        .filter(|_| random.gen_bool(0.5))
                        .collect::<Vec<_>>()
                        .into_iter()
                        .for_each(|c| child[c] = other[c]);
                }
                for m in child.iter_mut() {
                    if random.gen_bool(0.005) {
                        *m = random.gen_range(0..materials);
                    }
                }
                if random.gen_bool(0.5) {
                    paint(&mut child, counts, materials, &mut random);
                }
                child
            })
            .collect();
        let rated = rate(children);
        simulations += rated.len();
        population.truncate(ELITE);
        population.extend(rated);
        sort(&mut population);
        history.push((simulations, population[0].1));
    }
    Outcome {
        best_rms_mm: population[0].1,
        simulations,
        history,
    }
}

fn sort(population: &mut [Rated]) {
    population.sort_by(|a, b| a.1.total_cmp(&b.1));
}

/// The best of three of a sorted population.
fn tournament(random: &mut Xoshiro256Plus) -> usize {
    (0..3).map(|_| random.gen_range(0..POPULATION)).min().unwrap_or(0)
}

/// A random box: its first and last voxel along each axis.
fn area(counts: [usize; 3], random: &mut Xoshiro256Plus) -> [[usize; 2]; 3] {
    counts.map(|n| {
        let (a, b) = (random.gen_range(0..n), random.gen_range(0..n));
        [a.min(b), a.max(b)]
    })
}

fn inside(cell: usize, [nx, ny, _]: [usize; 3], area: &[[usize; 2]; 3]) -> bool {
    let index = [cell % nx, cell / nx % ny, cell / (nx * ny)];
    (0..3).all(|c| (area[c][0]..=area[c][1]).contains(&index[c]))
}

/// Gives a random box one material.
fn paint(layout: &mut [u8], counts: [usize; 3], materials: u8, random: &mut Xoshiro256Plus) {
    let (area, m) = (area(counts, random), random.gen_range(0..materials));
    for (c, own) in layout.iter_mut().enumerate() {
        if inside(c, counts, &area) {
            *own = m;
        }
    }
}
