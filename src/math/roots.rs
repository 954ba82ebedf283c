//! The inverse cube root of eight numbers at once.
//!
//! ```text
//! y = x^(−1/3):     y ← y (4 − x y³) / 3
//! ```
//!
//! Newton's iteration for y⁻³ = x needs no division. It starts within 4 % of the answer, from a third of the number's
//! exponent taken off its bits (Lomont 2003 for the square root), and squares the relative error twice over in each of four
//! steps. Valid for normal numbers x > 0; the rest answers NaN.

use super::polar_lanes::Lanes;

/// Bits of (4/3) · 1023 · 2⁵², less what makes the first guess's error even on both sides.
const START: u64 = 0x553E_F0FF_289D_D796;

/// x^(−1/3) in all lanes.
#[inline(always)]
pub fn inverse_cube_root(x: &Lanes) -> Lanes {
    let mut y = [0.0; 8];
    for l in 0..8 {
        y[l] = f64::from_bits(START.wrapping_sub(x[l].to_bits() / 3));
    }
    for _ in 0..4 {
        for l in 0..8 {
            y[l] *= (4.0 - x[l] * y[l] * y[l] * y[l]) * (1.0 / 3.0);
        }
    }
    for l in 0..8 {
        y[l] = if x[l] >= f64::MIN_POSITIVE { y[l] } else { f64::NAN };
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_standard_library() {
        for i in 1..20_000 {
            let x = 1e-3 * f64::from(i) * 1.37;
            for x in [x, 1e-9 * x, 1e9 * x] {
                let found = inverse_cube_root(&[x; 8])[5];
                assert!((found * x.cbrt() - 1.0).abs() < 1e-15, "{x}");
            }
        }
        assert!(inverse_cube_root(&[-1.0; 8])[0].is_nan());
        assert!(inverse_cube_root(&[0.0; 8])[0].is_nan());
        assert!(inverse_cube_root(&[f64::NAN; 8])[0].is_nan());
    }
}
