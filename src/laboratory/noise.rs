//! Seeded errors of measurement: independent, normally distributed, of zero mean, by the transform of Box and Muller (1958).

use super::read::Noise;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// A stream of errors.
#[derive(Clone, Debug)]
pub struct Errors {
    deviation_mm: f64,
    source: Xoshiro256PlusPlus,
    spare: Option<f64>,
}

impl Errors {
    /// The stream of a laboratory's noise; the same seed gives the same errors.
    pub fn new(noise: &Noise) -> Errors {
        Errors {
            deviation_mm: noise.deviation_mm,
            source: Xoshiro256PlusPlus::seed_from_u64(noise.seed),
            spare: None,
        }
    }

    /// The next error \[mm\].
    pub fn next_mm(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        // 1 − u lies in (0, 1], where the logarithm is finite.
        let (u, v): (f64, f64) = (self.source.r#gen(), self.source.r#gen());
        let size = self.deviation_mm * (-2.0 * (1.0 - u).ln()).sqrt();
        let (sin, cos) = (TAU * v).sin_cos();
        self.spare = Some(size * sin);
        size * cos
    }
}
