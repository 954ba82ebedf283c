//! The signed distance of a closed surface, sampled on a grid and interpolated smoothly.
//!
//! ```text
//! φ(x) = Σ_ijk w_i(x) w_j(y) w_k(z) φ_ijk,    w the cubic convolution weights (Keys 1981)
//! ```
//!
//! A triangle surface's own distance has a normal that jumps from facet to facet; Newton's method then hops between
//! two facets for ever. The interpolant has a continuous normal, reproduces parabolas, and rounds what is sharper than
//! a grid step. Near the surface, within two steps, samples are exact; farther off they are interpolated from every
//! fourth, which only says "far". Sign by the generalised winding number.
//!
//! Symbols: φ_ijk samples \[mm\]. Valid inside the sampled box, which is larger than the solid by a quarter of its
//! longest side; beyond it a bound that grows with the distance from the box. Source: R. Keys, Cubic convolution
//! interpolation for digital image processing, IEEE Transactions on Acoustics 29, 1981.

use super::shape::Distance;
use crate::geometry::solid::Solid;
use crate::math::{Mat3, Vec3};
use rayon::prelude::*;

/// Samples between two exact ones far from the surface.
const BLOCK: usize = 4;
/// More samples than this are refused.
const MOST_SAMPLES: usize = 20_000_000;
/// Grid steps on each side of the surface that are sampled exactly: the interpolation reaches two steps.
const BAND: f64 = 3.0;
/// Grid steps along the longest side where nothing else is said.
const STEPS: f64 = 64.0;

/// Samples of a signed distance.
#[derive(Clone)]
pub struct DistanceField {
    origin: Vec3,
    spacing: f64,
    counts: [usize; 3],
    values: Vec<f64>,
}

impl std::fmt::Debug for DistanceField {
    /// In short: thousands of samples say nothing.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DistanceField")
            .field("counts", &self.counts)
            .field("spacing", &self.spacing)
            .finish_non_exhaustive()
    }
}

/// Why a surface has no distance field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// A spacing that is not a length.
    #[error("the distance field's spacing is {spacing_mm} mm: expected a length above zero")]
    Spacing {
        /// What it was \[mm\].
        spacing_mm: f64,
    },
    /// Too many samples.
    #[error(
        "a spacing of {spacing_mm} mm makes {samples:.1e} samples of the rigid body's distance, more than {most:.1e}: choose a larger one"
    )]
    TooFine {
        /// What it was \[mm\].
        spacing_mm: f64,
        /// How many samples it makes.
        samples: f64,
        /// The most.
        most: f64,
    },
}

impl DistanceField {
    /// Samples the distance of `solid` every `spacing_mm`; a sixty-fourth of its longest side if `None`. What is sharper
    /// than a step is rounded.
    ///
    /// # Errors
    /// [`FieldError`]: a spacing that is not above zero, or that makes too many samples.
    pub fn new(solid: &Solid, spacing_mm: Option<f64>) -> Result<DistanceField, FieldError> {
        let (low, high) = solid.bounds();
        let longest = (high - low).max();
        let spacing = spacing_mm.unwrap_or(longest / STEPS);
        if spacing.is_nan() || spacing <= 0.0 || spacing.is_infinite() {
            return Err(FieldError::Spacing { spacing_mm: spacing });
        }
        let margin = 0.25 * longest + 4.0 * spacing;
        let steps = ((high - low).add_scalar(2.0 * margin) / (spacing * BLOCK as f64)).map(f64::ceil);
        let samples = steps.iter().map(|s| s * BLOCK as f64 + 1.0).product::<f64>();
        if samples > MOST_SAMPLES as f64 {
            return Err(FieldError::TooFine {
                spacing_mm: spacing,
                samples,
                most: MOST_SAMPLES as f64,
            });
        }
        let blocks = [0, 1, 2].map(|c| steps[c] as usize);
        let counts = blocks.map(|n| n * BLOCK + 1);
        let origin = low.add_scalar(-margin);
        let mut field = DistanceField {
            origin,
            spacing,
            counts,
            values: Vec::new(),
        };
        let coarse = DistanceField {
            origin,
            spacing: spacing * BLOCK as f64,
            counts: blocks.map(|n| n + 1),
            values: Vec::new(),
        }
        .sampled(solid);
        field.fill(solid, &coarse);
        Ok(field)
    }

    fn place(&self, n: usize) -> (usize, usize, usize) {
        let [nx, ny, _] = self.counts;
        (n % nx, n / nx % ny, n / (nx * ny))
    }

    fn node(&self, (i, j, k): (usize, usize, usize)) -> Vec3 {
        self.origin + Vec3::new(i as f64, j as f64, k as f64) * self.spacing
    }

    fn value(&self, i: usize, j: usize, k: usize) -> f64 {
        self.values[i + self.counts[0] * (j + self.counts[1] * k)]
    }

    fn sampled(mut self, solid: &Solid) -> DistanceField {
        let count: usize = self.counts.iter().product();
        self.values = (0..count)
            .into_par_iter()
            .map(|n| solid.signed_distance(&self.node(self.place(n))))
            .collect();
        self
    }

    /// Exact samples where a block may hold some of the surface, trilinear ones elsewhere.
    fn fill(&mut self, solid: &Solid, coarse: &DistanceField) {
        // A distance changes by no more than the way: half a block's diagonal and the band are surely near.
        let near = (3f64.sqrt() * 0.5 * BLOCK as f64 + BAND) * self.spacing;
        let count: usize = self.counts.iter().product();
        let blocks = coarse.counts.map(|n| n - 1);
        self.values = (0..count)
            .into_par_iter()
            .map(|n| {
                let place = self.place(n);
                let at = [place.0, place.1, place.2];
                let block = [0, 1, 2].map(|c| (at[c] / BLOCK).min(blocks[c] - 1));
                let corner =
                    |s: usize| coarse.value(block[0] + (s & 1), block[1] + (s >> 1 & 1), block[2] + (s >> 2));
                let least = (0..8).map(|s| corner(s).abs()).fold(f64::INFINITY, f64::min);
                if least <= near {
                    return solid.signed_distance(&self.node(place));
                }
                let t = [0, 1, 2].map(|c| (at[c] - block[c] * BLOCK) as f64 / BLOCK as f64);
                let weight = |s: usize, c: usize| if s >> c & 1 == 1 { t[c] } else { 1.0 - t[c] };
                (0..8)
                    .map(|s| corner(s) * weight(s, 0) * weight(s, 1) * weight(s, 2))
                    .sum()
            })
            .collect();
    }

    /// The largest depth of a sample \[mm\].
    pub fn depth_mm(&self) -> f64 {
        -self.values.iter().copied().fold(-self.spacing, f64::min)
    }

    /// Distance of `x` \[mm\], in the frame of the solid.
    pub fn distance(&self, x: &Vec3) -> Distance {
        let inner = |c: usize| {
            let along = (x[c] - self.origin[c]) / self.spacing;
            along.clamp(1.0, (self.counts[c] - 2) as f64)
        };
        let along = Vec3::new(inner(0), inner(1), inner(2));
        let clamped = self.origin + along * self.spacing;
        let beyond = x - clamped;
        let outside = beyond.norm();
        let mut found = self.interpolated(&along);
        if outside > 1e-9 * self.spacing {
            found.value += outside;
            found.gradient = beyond / outside;
            found.hessian = Mat3::zeros();
        }
        found
    }

    fn interpolated(&self, along: &Vec3) -> Distance {
        let cell = [0, 1, 2].map(|c| (along[c] as usize).clamp(1, self.counts[c] - 3));
        let weights = [0, 1, 2].map(|c| cubic(along[c] - cell[c] as f64));
        let (mut value, mut gradient, mut hessian) = (0.0, Vec3::zeros(), Mat3::zeros());
        for k in 0..4 {
            for j in 0..4 {
                for i in 0..4 {
                    let sample = self.value(cell[0] + i - 1, cell[1] + j - 1, cell[2] + k - 1);
                    // w[c][order]: weight, first and second derivative along coordinate c.
                    let w = [weights[0][i], weights[1][j], weights[2][k]];
                    value += sample * w[0][0] * w[1][0] * w[2][0];
                    for a in 0..3 {
                        let (b, c) = ((a + 1) % 3, (a + 2) % 3);
                        gradient[a] += sample * w[a][1] * w[b][0] * w[c][0];
                        hessian[(a, a)] += sample * w[a][2] * w[b][0] * w[c][0];
                        let mixed = sample * w[a][1] * w[b][1] * w[c][0];
                        hessian[(a, b)] += mixed;
                        hessian[(b, a)] += mixed;
                    }
                }
            }
        }
        Distance {
            value,
            gradient: gradient / self.spacing,
            hessian: hessian / (self.spacing * self.spacing),
        }
    }
}

/// Weights of the four samples around a place at the share `t` of the middle interval, with two derivatives.
fn cubic(t: f64) -> [[f64; 3]; 4] {
    [
        [
            0.5 * t * (t * (2.0 - t) - 1.0),
            0.5 * (t * (4.0 - 3.0 * t) - 1.0),
            2.0 - 3.0 * t,
        ],
        [
            0.5 * (t * t * (3.0 * t - 5.0) + 2.0),
            0.5 * t * (9.0 * t - 10.0),
            9.0 * t - 5.0,
        ],
        [
            0.5 * t * (t * (4.0 - 3.0 * t) + 1.0),
            0.5 * (t * (8.0 - 9.0 * t) + 1.0),
            4.0 - 9.0 * t,
        ],
        [0.5 * t * t * (t - 1.0), 0.5 * t * (3.0 * t - 2.0), 3.0 * t - 1.0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes::block;

    /// Weights sum to one, their derivatives to zero; the derivatives are those of the weights.
    #[test]
    fn cubic_weights_are_consistent() {
        for t in [0.0, 0.3, 0.77, 1.0] {
            let w = cubic(t);
            let sum = |d: usize| w.iter().map(|w| w[d]).sum::<f64>();
            assert!((sum(0) - 1.0).abs() < 1e-15 && sum(1).abs() < 1e-15 && sum(2).abs() < 1e-14);
            let (ahead, behind) = (cubic(t + 1e-6), cubic(t - 1e-6));
            for (i, w) in w.iter().enumerate() {
                assert!(((ahead[i][0] - behind[i][0]) / 2e-6 - w[1]).abs() < 1e-8);
                assert!(((ahead[i][1] - behind[i][1]) / 2e-6 - w[2]).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn a_box_keeps_its_faces_and_its_sign() {
        let solid = Solid::new(block(Vec3::new(10.0, 8.0, 6.0), 2.0).unwrap()).unwrap();
        let (low, high) = solid.bounds();
        let field = DistanceField::new(&solid, None).unwrap();
        let middle = (low + high) / 2.0;
        for depth in [-0.4, -0.01, 0.0, 0.01, 0.5, 4.0] {
            let x = Vec3::new(middle.x, middle.y, high.z + depth);
            let d = field.distance(&x);
            // Flat faces are reproduced exactly; 4 mm is past the sampled box, where the bound is still exact here.
            assert!((d.value - depth).abs() < 1e-9, "{depth}: {}", d.value);
            assert!((d.gradient - Vec3::z()).norm() < 1e-9);
        }
        assert!(DistanceField::new(&solid, Some(0.0)).is_err());
        assert!(DistanceField::new(&solid, Some(f64::NAN)).is_err());
        assert!(DistanceField::new(&solid, Some(1e-4)).is_err());
    }
}
