//! A few combinations of readings in place of very many readings.

use rand::Rng;
use rand_xoshiro::Xoshiro256Plus;

/// Up to `most` orthonormal combinations of the measured ones among `residuals`: each alone if they are so few, else the
/// residual itself and random ones.
pub(super) fn combinations(
    residuals: &[Option<f64>],
    most: usize,
    random: &mut Xoshiro256Plus,
) -> Vec<Vec<f64>> {
    let measured: Vec<usize> = (0..residuals.len()).filter(|&i| residuals[i].is_some()).collect();
    let unit = |i: usize| {
        (0..residuals.len())
            .map(|j| f64::from(u8::from(i == j)))
            .collect()
    };
    if measured.len() <= most {
        return measured.into_iter().map(unit).collect();
    }
    let mut all: Vec<Vec<f64>> = Vec::new();
    for k in 0..most {
        let mut own = vec![0.0; residuals.len()];
        for &i in &measured {
            own[i] = if k == 0 {
                residuals[i].unwrap_or(0.0)
            } else {
                random.gen_range(-1.0..1.0)
            };
        }
        // Twice is enough for Gram and Schmidt.
        for _ in 0..2 {
            for other in &all {
                let along: f64 = own.iter().zip(other).map(|(a, b)| a * b).sum();
                own.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
            }
        }
        let norm = own.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm > 1e-9 && norm.is_finite() {
            all.push(own.into_iter().map(|x| x / norm).collect());
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn combinations_hold_the_residual_and_are_orthonormal() {
        let residuals: Vec<Option<f64>> = (0..20)
            .map(|i| (i != 7).then(|| (i * 13 % 11) as f64 - 4.0))
            .collect();
        let mut random = Xoshiro256Plus::seed_from_u64(3);
        let few = combinations(&residuals, 5, &mut random);
        assert_eq!(few.len(), 5);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for (i, a) in few.iter().enumerate() {
            assert_eq!(a[7], 0.0);
            for (j, b) in few.iter().enumerate() {
                assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
        let own: Vec<f64> = residuals.iter().map(|r| r.unwrap_or(0.0)).collect();
        assert!((dot(&own, &few[0]).abs() - dot(&own, &own).sqrt()).abs() < 1e-12);
        assert_eq!(combinations(&residuals, 19, &mut random).len(), 19);
    }
}
