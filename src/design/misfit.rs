//! How far a layout's displacements are from the target.
//!
//! ```text
//! e_ij = max(0, |x_ij − x̄_ij| − τ_ij)
//! RMS  = √( Σ e_ij² / n ),   max = max e_ij
//! ```
//!
//! over the n pairs of a measured point i and a force j; x displacement, x̄ target displacement, τ the tolerance that the goal
//! allows there, zero where it names none \[mm\] (without tolerances Bickel 2010, 8.4.1: ‖x − x̄‖). At a point where one
//! direction was measured, the difference is that direction's.
//!
//! Over a box low ≤ x ≤ high the least |x − x̄| of a pair is its distance from the box, and e rises with it; so the least
//! RMS over a box is that of the distances, less their tolerances.

use crate::fem::example::Example;

/// Target displacements in one long vector, with the grouping into points.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Measured components \[mm\]; `None` where a marker was lost, `(components)`.
    pub components: Vec<Option<f64>>,
    /// For each pair of point and force, its first component; `(pairs + 1)`.
    pub pairs: Vec<usize>,
    /// How far each pair may be off without counting \[mm\], `(pairs)`.
    pub tolerances_mm: Vec<f64>,
}

/// The error of one layout.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Misfit {
    /// Root mean square displacement error beyond the tolerances \[mm\].
    pub rms_mm: f64,
    /// Largest displacement error beyond its tolerance \[mm\].
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
            tolerances_mm: Vec::new(),
        };
        for example in examples {
            for force in 0..example.forces_n.len() {
                for (point, tolerances) in example.points.iter().zip(&example.tolerances_mm) {
                    target.components.extend(&point.displacements_mm[force]);
                    target.pairs.push(target.components.len());
                    target.tolerances_mm.push(tolerances[force]);
                }
            }
        }
        target
    }

    /// The largest target displacement of a point \[mm\].
    pub fn largest_mm(&self) -> f64 {
        self.lengths(|_, target| target)
            .fold(0.0, |m: f64, (length, _, _)| m.max(length))
    }

    /// Number of pairs that were measured.
    pub fn measured_pairs(&self) -> usize {
        self.lengths(|_, target| target)
            .filter(|(_, measured, _)| *measured > 0)
            .count()
    }

    /// Does any pair have a tolerance?
    pub fn is_tolerant(&self) -> bool {
        self.tolerances_mm.iter().any(|t| *t > 0.0)
    }

    /// The error of `displacements`, `(components)` \[mm\].
    pub fn misfit(&self, displacements: &[f64]) -> Misfit {
        let (mut sum, mut largest, mut n) = (0.0, 0.0f64, 0);
        for (length, measured, tolerance) in self.lengths(|i, target| displacements[i] - target) {
            if measured > 0 {
                let error = beyond(length, tolerance);
                sum += error * error;
                largest = largest.max(error);
                n += 1;
            }
        }
        if n == 0 || !sum.is_finite() {
            return Misfit::FAILED;
        }
        Misfit {
            rms_mm: (sum / n as f64).sqrt(),
            max_mm: largest,
        }
    }

    /// Root mean square difference of two responses where the target was measured, `(components)` \[mm\]. The errors of the
    /// two differ by no more.
    pub fn between(&self, a: &[f64], b: &[f64]) -> f64 {
        let (mut sum, mut n) = (0.0, 0);
        for (length, measured, _) in self.lengths(|i, _| a[i] - b[i]) {
            if measured > 0 {
                sum += length * length;
                n += 1;
            }
        }
        if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
    }

    /// Least root mean square error in the box `low ≤ x ≤ high` \[mm\]: no layout inside it is better.
    pub fn distance_to_box(&self, low: &[f64], high: &[f64]) -> f64 {
        let (mut sum, mut n) = (0.0, 0);
        for (length, measured, tolerance) in
            self.lengths(|i, target| (low[i] - target).max(target - high[i]).max(0.0))
        {
            if measured > 0 {
                sum += beyond(length, tolerance).powi(2);
                n += 1;
            }
        }
        if n == 0 { 0.0 } else { (sum / n as f64).sqrt() }
    }

    /// The part of each error vector that lies beyond its tolerance, `(components)` \[mm\]; zero where nothing was measured.
    ///
    /// Its squares add up to n RMS², whose derivative with respect to the displacements is twice this vector.
    pub fn excess(&self, displacements: &[f64]) -> Vec<f64> {
        let mut result = vec![0.0; self.components.len()];
        let lengths = self.lengths(|i, target| displacements[i] - target);
        for (range, (length, _, tolerance)) in self.pairs.windows(2).zip(lengths) {
            let share = match beyond(length, tolerance) {
                error if error > 0.0 => error / length,
                error => error,
            };
            for i in range[0]..range[1] {
                if let Some(target) = self.components[i] {
                    result[i] = share * (displacements[i] - target);
                }
            }
        }
        result
    }

    /// For each pair of point and force the length of the vector `of(component, target)`, how many components were measured,
    /// and the tolerance.
    fn lengths<'a>(
        &'a self,
        of: impl Fn(usize, f64) -> f64 + 'a,
    ) -> impl Iterator<Item = (f64, usize, f64)> + 'a {
        let pairs = self.pairs.windows(2).zip(&self.tolerances_mm);
        pairs.map(move |(range, &tolerance)| {
            let (mut sum, mut measured) = (0.0, 0);
            for i in range[0]..range[1] {
                if let Some(target) = self.components[i] {
                    sum += of(i, target).powi(2);
                    measured += 1;
                }
            }
            (sum.sqrt(), measured, tolerance)
        })
    }
}

/// What of `length` lies beyond `tolerance`; a length that is no number stays none.
fn beyond(length: f64, tolerance: f64) -> f64 {
    if length <= tolerance {
        0.0
    } else {
        length - tolerance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
            tolerances_mm: vec![0.0; 3],
        };
        assert_eq!(target.largest_mm(), 3.0);
        // First point off by (3, 4, 0): 5 mm. Second by (0, –, 0). Third was not measured.
        let displacements = [4.0, 6.0, 2.0, 0.0, 99.0, 0.0, 7.0, 7.0, 7.0];
        let misfit = target.misfit(&displacements);
        assert!((misfit.rms_mm - (25.0f64 / 2.0).sqrt()).abs() < 1e-12);
        assert_eq!(misfit.max_mm, 5.0);
        assert_eq!(target.misfit(&[f64::NAN; 9]), Misfit::FAILED);
        // Of the 5 mm, 2 are allowed: the vector keeps three fifths of itself.
        let tolerant = Target {
            tolerances_mm: vec![2.0, 0.0, 1.0],
            ..target
        };
        let misfit = tolerant.misfit(&displacements);
        assert!((misfit.rms_mm - (9.0f64 / 2.0).sqrt()).abs() < 1e-12 && misfit.max_mm == 3.0);
        let excess = tolerant.excess(&displacements);
        assert!((excess[0] - 1.8).abs() < 1e-12 && (excess[1] - 2.4).abs() < 1e-12);
        assert_eq!(excess[2..], [0.0; 7]);
        // Tolerance forgives no layout that fell apart.
        let endless = Target {
            tolerances_mm: vec![1e9; 3],
            ..tolerant
        };
        assert_eq!(endless.misfit(&[f64::NAN; 9]), Misfit::FAILED);
        assert_eq!(endless.misfit(&displacements).rms_mm, 0.0);
    }

    #[test]
    fn the_box_bounds_the_error_of_everything_inside_it() {
        let target = Target {
            components: vec![Some(0.0), Some(1.0)],
            pairs: vec![0, 1, 2],
            tolerances_mm: vec![0.0; 2],
        };
        let (low, high) = ([1.0, 0.0], [3.0, 2.0]);
        let bound = target.distance_to_box(&low, &high);
        assert!((bound - 0.5f64.sqrt()).abs() < 1e-12);
        for x in [[1.0, 0.0], [2.0, 1.5], [3.0, 1.0]] {
            assert!(target.misfit(&x).rms_mm >= bound);
        }
    }

    fn six(range: std::ops::Range<f64>) -> impl Strategy<Value = Vec<f64>> {
        prop::collection::vec(range, 6)
    }

    proptest! {
        /// Two vectors and a lost component. The bound holds for all points of the box, and the nearest point of the box
        /// reaches it: the bound is not only safe but exact.
        #[test]
        fn the_box_is_a_bound_that_is_reached(
            wanted in six(-1.0..1.0), low in six(-1.0..1.0), size in six(0.0..1.0), share in six(0.0..1.0),
            tolerances_mm in prop::collection::vec(0.0..0.8, 2),
        ) {
            let mut components: Vec<Option<f64>> = wanted.iter().copied().map(Some).collect();
            components[4] = None;
            let target = Target { components, pairs: vec![0, 3, 6], tolerances_mm };
            let high: Vec<f64> = low.iter().zip(&size).map(|(l, s)| l + s).collect();
            let inside: Vec<f64> = (0..6).map(|i| low[i] + share[i] * size[i]).collect();
            let nearest: Vec<f64> = (0..6).map(|i| wanted[i].clamp(low[i], high[i])).collect();
            let bound = target.distance_to_box(&low, &high);
            prop_assert!(target.misfit(&inside).rms_mm >= bound - 1e-12);
            prop_assert!((target.misfit(&nearest).rms_mm - bound).abs() < 1e-12);
        }

        /// Central differences of n RMS².
        #[test]
        fn excess_is_half_the_derivative(wanted in six(-1.0..1.0), x in six(-1.0..1.0), tolerance in 0.0..0.3) {
            let components: Vec<Option<f64>> = wanted.iter().copied().map(Some).collect();
            let target = Target { components, pairs: vec![0, 3, 6], tolerances_mm: vec![tolerance, 0.1] };
            let energy = |x: &[f64]| 2.0 * target.misfit(x).rms_mm.powi(2);
            let excess = target.excess(&x);
            prop_assert!((excess.iter().map(|e| e * e).sum::<f64>() - energy(&x)).abs() < 1e-12);
            for i in 0..6 {
                let (mut up, mut down) = (x.clone(), x.clone());
                (up[i], down[i]) = (up[i] + 1e-6, down[i] - 1e-6);
                let slope = (energy(&up) - energy(&down)) / 2e-6;
                prop_assert!((slope - 2.0 * excess[i]).abs() < 1e-4, "{slope} {}", excess[i]);
            }
        }
    }
}
