//! The exponential function of eight numbers at once.
//!
//! ```text
//! x = k ln 2 + r,  |r| ≤ ½ ln 2:     eˣ = 2ᵏ Σ_{n ≤ 13} rⁿ / n!
//! ```
//!
//! ln 2 is taken in two parts (Cody and Waite 1980), so that r is exact to rounding; the neglected terms of the series
//! are below 5e-18. The result is within 1e-15 of eˣ for −700 ≤ x ≤ 700; beyond, x is held at these ends, which no
//! logarithm of a modulus comes near. The standard library's function is called number by number and cannot use vector
//! instructions, which made it the dearest part of a strain-dependent law.

// Index loops say here which numbers lie side by side.
#![allow(clippy::needless_range_loop)]

use super::polar_lanes::Lanes;

const INVERSE_LN_2: f64 = std::f64::consts::LOG2_E;
/// The leading 32 bits of ln 2, and the rest.
const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// 1.5 · 2⁵²: added and taken away again, it rounds to a whole number, which stands in the last bits of the sum.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// 1/n! for n = 13 … 2.
const COEFFICIENTS: [f64; 12] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
];

/// eˣ in all lanes.
#[inline(always)]
pub fn exp(x: &Lanes) -> Lanes {
    let mut result = [0.0; 8];
    for l in 0..8 {
        // Written so that a NaN stays one.
        let held = if x[l] > 700.0 { 700.0 } else { x[l] };
        let held = if held < -700.0 { -700.0 } else { held };
        let shifted = held * INVERSE_LN_2 + ROUND;
        let k = shifted - ROUND;
        let r = (held - k * LN_2_HIGH) - k * LN_2_LOW;
        let mut sum = COEFFICIENTS[0];
        for c in &COEFFICIENTS[1..] {
            sum = sum * r + c;
        }
        let series = 1.0 + (r + r * r * sum);
        let exponent = shifted.to_bits().wrapping_add(1023) << 52;
        result[l] = series * f64::from_bits(exponent);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_standard_library() {
        for i in 0..40_000 {
            let x = -690.0 + 1380.0 * i as f64 / 40_000.0;
            let small = x * 1e-3;
            for x in [x, small] {
                let (found, expected) = (exp(&[x; 8])[3], x.exp());
                assert!(
                    (found / expected - 1.0).abs() < 1e-15,
                    "{x}: {found:e} {expected:e}"
                );
            }
        }
        assert!(exp(&[f64::NAN; 8])[0].is_nan());
        assert_eq!(exp(&[0.0; 8])[0], 1.0);
        assert!(exp(&[1e9; 8])[0].is_finite());
    }
}
