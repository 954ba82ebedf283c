//! How far a layout's displacements are from the target.
//!
//! ```text
//! RMS = √( Σ |x_ij − x̄_ij|² / n ),   max = max |x_ij − x̄_ij|
//! ```
//!
//! over the n pairs of a measured point i and a force j; x displacement, x̄ measured displacement \[mm\] (Bickel 2010,
//! 8.4.1: ‖x − x̄‖). At a point where one direction was measured, the difference is that direction's.

use crate::fem::example::Example;

/// Target displacements in one long vector, with the grouping into points.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Measured components \[mm\]; `None` where a marker was lost, `(components)`.
    pub components: Vec<Option<f64>>,
    /// For each pair of point and force, its first component; `(pairs + 1)`.
    pub pairs: Vec<usize>,
}

/// The error of one layout.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Misfit {
    /// Root mean square displacement error \[mm\].
    pub rms_mm: f64,
    /// Largest displacement error \[mm\].
    pub max_mm: f64,
}

impl Misfit {
    /// The error of a layout that has no equilibrium under the loads.
    pub const FAILED: Misfit = Misfit {
        rms_mm: f64::INFINITY,
        max_mm: f64::INFINITY,
    };
}

impl Target {
    /// The displacements of all examples: example by example, force by force, point by point.
    pub fn new(examples: &[Example]) -> Target {
        let mut target = Target {
            components: Vec::new(),
            pairs: vec![0],
        };
        for example in examples {
            for force in 0..example.forces_n.len() {
                for point in &example.points {
                    target.components.extend(&point.displacements_mm[force]);
                    target.pairs.push(target.components.len());
                }
            }
        }
        target
    }

    /// The largest target displacement of a point \[mm\].
    pub fn largest_mm(&self) -> f64 {
        self.squares(|_, target| target)
            .fold(0.0, |m: f64, (s, _)| m.max(s))
            .sqrt()
    }

    /// The error of `displacements`, `(components)` \[mm\].
    pub fn misfit(&self, displacements: &[f64]) -> Misfit {
        let (mut sum, mut largest, mut n) = (0.0, 0.0f64, 0);
        for (square, measured) in self.squares(|i, target| displacements[i] - target) {
            if measured > 0 {
                sum += square;
                largest = largest.max(square);
                n += 1;
            }
        }
        if n == 0 || !sum.is_finite() {
            return Misfit::FAILED;
        }
        Misfit {
            rms_mm: (sum / n as f64).sqrt(),
            max_mm: largest.sqrt(),
        }
    }

    /// Root mean square difference of two responses where the target was measured, `(components)` \[mm\].
    pub fn between(&self, a: &[f64], b: &[f64]) -> f64 {
        let squares = self.squares(|i, _| a[i] - b[i]);
        let (sum, n) = squares
            .filter(|(_, measured)| *measured > 0)
            .fold((0.0, 0), |(sum, n), (square, _)| (sum + square, n + 1));
        if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
    }

    /// Root mean square distance of the target from the box `low ≤ x ≤ high` \[mm\]: no layout inside it is better.
    pub fn distance_to_box(&self, low: &[f64], high: &[f64]) -> f64 {
        let (mut sum, mut n) = (0.0, 0);
        for (square, measured) in self.squares(|i, target| (low[i] - target).max(target - high[i]).max(0.0)) {
            if measured > 0 {
                sum += square;
                n += 1;
            }
        }
        if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
    }

    /// For each pair of point and force the sum of squares of `of(component, target)`, and how many were measured.
    fn squares<'a>(&'a self, of: impl Fn(usize, f64) -> f64 + 'a) -> impl Iterator<Item = (f64, usize)> + 'a {
        self.pairs.windows(2).map(move |range| {
            let (mut sum, mut measured) = (0.0, 0);
            for i in range[0]..range[1] {
                if let Some(target) = self.components[i] {
                    sum += of(i, target).powi(2);
                    measured += 1;
                }
            }
            (sum, measured)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_of_vectors_not_of_components() {
        let target = Target {
            components: vec![
                Some(1.0),
                Some(2.0),
                Some(2.0),
                Some(0.0),
                None,
                Some(0.0),
                None,
                None,
                None,
            ],
            pairs: vec![0, 3, 6, 9],
        };
        assert_eq!(target.largest_mm(), 3.0);
        // First point off by (3, 4, 0): 5 mm. Second by (0, –, 0). Third was not measured.
        let misfit = target.misfit(&[4.0, 6.0, 2.0, 0.0, 99.0, 0.0, 7.0, 7.0, 7.0]);
        assert!((misfit.rms_mm - (25.0f64 / 2.0).sqrt()).abs() < 1e-12);
        assert_eq!(misfit.max_mm, 5.0);
        assert_eq!(target.misfit(&[f64::NAN; 9]), Misfit::FAILED);
    }

    #[test]
    fn the_box_bounds_the_error_of_everything_inside_it() {
        let target = Target {
            components: vec![Some(0.0), Some(1.0)],
            pairs: vec![0, 1, 2],
        };
        let (low, high) = ([1.0, 0.0], [3.0, 2.0]);
        let bound = target.distance_to_box(&low, &high);
        assert!((bound - 0.5f64.sqrt()).abs() < 1e-12);
        for x in [[1.0, 0.0], [2.0, 1.5], [3.0, 1.0]] {
            assert!(target.misfit(&x).rms_mm >= bound);
        }
    }
}
