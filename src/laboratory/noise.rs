//! Seeded errors of measurement: independent, normally distributed, of zero mean, by the transform of Box and Muller (1958).

use super::read::Noise;
use crate::math::normal::normal_pair;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

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
        let [a, b] = normal_pair(&mut self.source);
        self.spare = Some(self.deviation_mm * b);
        self.deviation_mm * a
    }
}
