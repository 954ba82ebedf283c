//! Numbers of the standard normal distribution.
//!
//! ```text
//! a = √(−2 ln(1 − u)) cos 2πv,   b = √(−2 ln(1 − u)) sin 2πv,    u, v uniform in [0, 1)
//! ```
//!
//! Source: Box and Muller 1958.

use rand::Rng;
use std::f64::consts::TAU;

/// Two independent numbers.
pub fn normal_pair(random: &mut impl Rng) -> [f64; 2] {
    // 1 − u lies in (0, 1], where the logarithm is finite.
    let (u, v): (f64, f64) = (random.r#gen(), random.r#gen());
    let size = (-2.0 * (1.0 - u).ln()).sqrt();
    let (sin, cos) = (TAU * v).sin_cos();
    [size * cos, size * sin]
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn moments_are_those_of_the_distribution() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let n = 100_000;
        let pairs: Vec<[f64; 2]> = (0..n).map(|_| normal_pair(&mut random)).collect();
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| pairs.iter().map(of).sum::<f64>() / n as f64;
        for k in 0..2 {
            assert!(mean(&|p| p[k]).abs() < 0.01);
            assert!((mean(&|p| p[k].powi(2)) - 1.0).abs() < 0.02);
            assert!((mean(&|p| p[k].powi(4)) - 3.0).abs() < 0.1);
        }
        assert!(mean(&|p| p[0] * p[1]).abs() < 0.01);
    }
}
