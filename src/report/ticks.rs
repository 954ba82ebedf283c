//! Round numbers on axes, and numbers as a reader wants them.
//!
//! A tick step is 1, 2 or 5 times a power of ten, the one that comes closest to the number of intervals asked for.

/// Where an axis has its ticks, and how to write them.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks {
    /// Distance from tick to tick, in the axis' unit.
    pub step: f64,
    /// The ticks inside the axis' range, ascending.
    pub values: Vec<f64>,
}

impl Ticks {
    /// Ticks between `low` and `high`, about `intervals` of them. Where the ends are not finite or not in order, one
    /// tick or none.
    pub fn between(low: f64, high: f64, intervals: usize) -> Self {
        let span = high - low;
        if !drawable(low) || !drawable(high) || span <= 0.0 {
            return Self {
                step: 1.0,
                values: if drawable(low) && low == high {
                    vec![low]
                } else {
                    Vec::new()
                },
            };
        }
        let raw = span / intervals.max(1) as f64;
        let power = 10f64.powf(raw.log10().floor());
        // Borders at the geometric means of 1, 2, 5 and 10.
        let step = power
            * match raw / power {
                ratio if ratio < std::f64::consts::SQRT_2 => 1.0,
                ratio if ratio < 3.162_277_7 => 2.0,
                ratio if ratio < 7.071_067_8 => 5.0,
                _ => 10.0,
            };
        // An end that misses a tick by rounding only keeps it.
        let first = (low / step - 1e-9).ceil();
        let last = (high / step + 1e-9).floor();
        let count = (last - first).clamp(-1.0, 1000.0) as i64;
        let values = (0..=count)
            .map(|index| (first + index as f64) * step + 0.0)
            .collect();
        Self { step, values }
    }

    /// A tick in words: as many decimals as the step needs, and a power of ten for very large and small steps.
    pub fn label(&self, value: f64) -> String {
        let value = if value.abs() < self.step * 1e-9 {
            0.0
        } else {
            value
        };
        let exponent = self.step.log10().floor();
        if !(-5.0..5.0).contains(&exponent) {
            return if value == 0.0 {
                "0".to_owned()
            } else {
                scientific(value, 3)
            };
        }
        with_minus(format!("{:.*}", (-exponent).max(0.0) as usize, value))
    }
}

/// Whether a number can be put on an axis: finite, and small enough that differences do not overflow.
pub fn drawable(value: f64) -> bool {
    value.is_finite() && value.abs() < 1e100
}

/// A range for an axis over `values`: from a little below the smallest to a little above the largest, starting at zero
/// where zero is near. Values that can't be drawn are passed over; `[0, 1]` if none is left.
pub fn axis_range(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let Some([low, high]) = extent(values) else {
        return [0.0, 1.0];
    };
    let span = high - low;
    if span <= 1e-12 * low.abs().max(high.abs()) || span < 1e-90 {
        let half = if low.abs().max(high.abs()) < 1e-80 {
            1.0
        } else {
            0.5 * high.abs().max(low.abs())
        };
        return [low - half, high + half];
    }
    let pad = 0.04 * span;
    // A curve that starts near zero is read against zero.
    let near_zero = 0.35 * span;
    let bottom = if low >= 0.0 && low <= near_zero {
        0.0
    } else {
        low - pad
    };
    let top = if high <= 0.0 && -high <= near_zero {
        0.0
    } else {
        high + pad
    };
    [bottom, top]
}

/// The smallest and the largest value that can be drawn.
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    values
        .into_iter()
        .filter(|value| drawable(*value))
        .fold(None, |range, value| match range {
            None => Some([value, value]),
            Some([low, high]) => Some([value.min(low), value.max(high)]),
        })
}

/// A number with `digits` significant digits, `–` if it is not finite.
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = digits.clamp(1, 15);
    // The exponent after rounding: 9.996 with three digits is 10.0, not 10.00.
    let rounded = format!("{:.*e}", digits - 1, value);
    let exponent = rounded
        .split_once('e')
        .and_then(|(_, text)| text.parse::<i32>().ok())
        .unwrap_or(0);
    if !(-4..6).contains(&exponent) {
        return scientific(value, digits);
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    with_minus(format!("{value:.decimals$}"))
}

/// A number with a fixed count of decimals, `–` if it is not finite.
pub fn fixed(value: f64, decimals: usize) -> String {
    if value.is_finite() {
        with_minus(format!("{value:.decimals$}"))
    } else {
        "–".to_owned()
    }
}

/// Seconds as a person says them: `0.42 s`, `12 s`, `2 min 5 s`, `1 h 4 min`.
pub fn duration(seconds: f64) -> String {
    if !seconds.is_finite() || seconds < 0.0 {
        return "–".to_owned();
    }
    if seconds < 9.95 {
        return format!("{} s", significant(seconds, 2));
    }
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{whole} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// `1.5×10⁻⁶`.
fn scientific(value: f64, digits: usize) -> String {
    let text = format!("{:.*e}", digits.max(1) - 1, value);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let mantissa = if mantissa.contains('.') {
        mantissa.trim_end_matches('0').trim_end_matches('.')
    } else {
        mantissa
    };
    let raised: String = exponent
        .chars()
        .map(|character| match character.to_digit(10) {
            Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
            None => '⁻',
        })
        .collect();
    with_minus(format!("{mantissa}×10{raised}"))
}

/// A true minus sign, and none before a zero.
fn with_minus(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|character| matches!(character, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, intervals: usize) -> Vec<String> {
        let ticks = Ticks::between(low, high, intervals);
        ticks.values.iter().map(|value| ticks.label(*value)).collect()
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(labels(0.0, 20.0, 4), ["0", "5", "10", "15", "20"]);
        assert_eq!(
            labels(-0.31, 0.29, 6),
            ["−0.3", "−0.2", "−0.1", "0.0", "0.1", "0.2"]
        );
        assert_eq!(labels(0.0, 9.0, 4), ["0", "2", "4", "6", "8"]);
        assert_eq!(labels(0.0, 0.003, 3), ["0.000", "0.001", "0.002", "0.003"]);
        assert_eq!(labels(0.0, 2e-7, 2), ["0", "1×10⁻⁷", "2×10⁻⁷"]);
    }

    #[test]
    fn every_range_has_few_ticks_and_they_are_inside() {
        for power in -12..12 {
            for mantissa in [1.0, 1.3, 2.2, 4.9, 5.1, 9.7] {
                let high = mantissa * 10f64.powi(power);
                let ticks = Ticks::between(-0.3 * high, high, 5);
                assert!((3..=10).contains(&ticks.values.len()), "{high}: {ticks:?}");
                let slack = 1e-6 * high;
                assert!(
                    ticks
                        .values
                        .iter()
                        .all(|tick| *tick >= -0.3 * high - slack && *tick <= high + slack)
                );
            }
        }
    }

    #[test]
    fn empty_and_wrong_ranges_do_no_harm() {
        assert_eq!(Ticks::between(2.0, 2.0, 5).values, [2.0]);
        assert!(Ticks::between(3.0, 2.0, 5).values.is_empty());
        assert!(Ticks::between(f64::NAN, 2.0, 5).values.is_empty());
        assert!(Ticks::between(-1e308, 1e308, 5).values.is_empty());
        assert_eq!(axis_range([]), [0.0, 1.0]);
        assert_eq!(axis_range([f64::NAN, f64::INFINITY]), [0.0, 1.0]);
    }

    #[test]
    fn ranges_start_at_a_near_zero() {
        assert_eq!(axis_range([0.2, 10.0])[0], 0.0);
        // Far from zero, the axis starts 4 % of the span below the smallest value: 100 − 0.04 · 10.
        assert_eq!(axis_range([100.0, 110.0])[0], 99.6);
        assert_eq!(axis_range([5.0]), [2.5, 7.5]);
        assert_eq!(axis_range([0.0]), [-1.0, 1.0]);
    }

    #[test]
    fn numbers_as_read() {
        assert_eq!(significant(0.067_31, 3), "0.0673");
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(significant(-1.5, 2), "−1.5");
        assert_eq!(significant(12_345.6, 3), "12346");
        assert_eq!(significant(3.2e-7, 3), "3.2×10⁻⁷");
        assert_eq!(significant(f64::NAN, 3), "–");
        assert_eq!(fixed(-0.001, 1), "0.0");
        assert_eq!(duration(0.4167), "0.42 s");
        assert_eq!(duration(125.0), "2 min 5 s");
        assert_eq!(duration(3840.0), "1 h 4 min");
    }
}
