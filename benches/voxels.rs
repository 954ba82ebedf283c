//! The search for a layout of voxels against a genetic algorithm: a block of 50 × 40 × 25 mm in 20 × 16 × 10 voxels of three
//! silicones, ten presses at two forces, a hidden layout. Both are seeded; the genetic algorithm gets the time that the
//! search took, at least `--seconds=`, or `--genetic=` simulations.
//!
//! `cargo bench --bench voxels -- --counts=20,16,10 --simulations=80 --genetic=2000`

#[path = "../tests/voxels/genetic.rs"]
mod genetic;
#[path = "../tests/voxels/support.rs"]
mod support;
#[path = "../tests/voxels/twin.rs"]
mod twin;

use pliant::design::voxels::Options;
use std::time::Duration;

fn main() {
    let argument = |name: &str| {
        let start = format!("--{name}=");
        std::env::args().find_map(|a| a.strip_prefix(&start).map(str::to_string))
    };
    let counts = argument("counts").unwrap_or_else(|| "20,16,10".into());
    let counts: Vec<usize> = counts.split(',').filter_map(|c| c.parse().ok()).collect();
    let counts: [usize; 3] = counts.try_into().expect("--counts= takes three counts");
    let number = |name: &str| argument(name).and_then(|text| text.parse().ok());
    let default = Options::default();
    let options = Options {
        most_simulations: number("simulations").unwrap_or(default.most_simulations),
        ..default
    };
    // A number of simulations carries from machine to machine, a time does not.
    let (most, seconds) = match number("genetic") {
        Some(most) => (most, u64::MAX),
        None => (usize::MAX, number("seconds").unwrap_or(0) as u64),
    };
    twin::compare(counts, &options, most, Duration::from_secs(seconds));
}
