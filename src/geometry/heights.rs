//! Where an object begins and ends along one axis: the lowest and the highest surface over a grid of lines, carried on
//! smoothly beyond the outline. Layers that follow the object's own height live between the two.

use super::axis::Axis;
use super::solid::Solid;
use crate::math::Vec3;
use rayon::prelude::*;

/// Lower and upper surface along an axis, bilinear between grid lines.
#[derive(Clone, Debug)]
pub struct Heights {
    axis: Axis,
    origin: [f64; 2],
    spacing: [f64; 2],
    counts: [usize; 2],
    low: Vec<f64>,
    high: Vec<f64>,
}

/// Where the object is thinner than this share of its median thickness, the layers keep this thickness: at a rounded rim
/// they would otherwise shrink to nothing.
const LEAST_THICKNESS: f64 = 0.25;

impl Heights {
    /// Samples `solid` along `axis` on lines about `spacing_mm` apart.
    pub fn new(solid: &Solid, axis: Axis, spacing_mm: f64) -> Heights {
        let (low, high) = solid.bounds();
        let (a, b) = axis.others();
        let extent = [high[a] - low[a], high[b] - low[b]];
        let counts = extent.map(|e| ((e / spacing_mm).ceil() as usize).clamp(2, 2000) + 1);
        let spacing = [
            extent[0] / (counts[0] - 1) as f64,
            extent[1] / (counts[1] - 1) as f64,
        ];
        let origin = [low[a], low[b]];
        let columns: Vec<Option<[f64; 2]>> = (0..counts[0] * counts[1])
            .into_par_iter()
            .map(|n| {
                let (i, j) = (n % counts[0], n / counts[0]);
                // Lines on the very border would graze the outline: draw them in by a hair.
                let inward = |k: usize, axis: usize| {
                    let t = (k as f64 / (counts[axis] - 1) as f64).clamp(1e-4, 1.0 - 1e-4);
                    origin[axis] + t * extent[axis]
                };
                let spans = solid.intervals(axis, inward(i, 0), inward(j, 1));
                Some([spans.first()?[0], spans.last()?[1]])
            })
            .collect();
        let floor =
            LEAST_THICKNESS * median_thickness(&columns).unwrap_or(high[axis.index()] - low[axis.index()]);
        let known: Vec<Option<[f64; 2]>> = columns
            .into_iter()
            .map(|c| {
                c.map(|[l, h]| {
                    if h - l < floor {
                        [0.5 * (l + h - floor), 0.5 * (l + h + floor)]
                    } else {
                        [l, h]
                    }
                })
            })
            .collect();
        let fallback = [low[axis.index()], high[axis.index()]];
        let filled = carried_on(known, counts, fallback);
        Heights {
            axis,
            origin,
            spacing,
            counts,
            low: filled.iter().map(|s| s[0]).collect(),
            high: filled.iter().map(|s| s[1]).collect(),
        }
    }

    /// The axis along which heights are measured.
    pub fn axis(&self) -> Axis {
        self.axis
    }

    /// Lower and upper surface \[mm\] over the point with the two other coordinates `a` and `b`, in cyclic order.
    pub fn at(&self, a: f64, b: f64) -> [f64; 2] {
        let (i, s) = self.cell(a, 0);
        let (j, t) = self.cell(b, 1);
        let n = i + j * self.counts[0];
        let blend = |v: &[f64]| {
            let lower = v[n] * (1.0 - s) + v[n + 1] * s;
            let upper = v[n + self.counts[0]] * (1.0 - s) + v[n + self.counts[0] + 1] * s;
            lower * (1.0 - t) + upper * t
        };
        [blend(&self.low), blend(&self.high)]
    }

    /// Height of `point` between the lower (0) and the upper (1) surface.
    pub fn relative(&self, point: &Vec3) -> f64 {
        let (a, b) = self.axis.others();
        let [low, high] = self.at(point[a], point[b]);
        (point[self.axis.index()] - low) / (high - low)
    }

    fn cell(&self, x: f64, axis: usize) -> (usize, f64) {
        let t = ((x - self.origin[axis]) / self.spacing[axis]).clamp(0.0, (self.counts[axis] - 1) as f64);
        let i = (t as usize).min(self.counts[axis] - 2);
        (i, t - i as f64)
    }
}

fn median_thickness(columns: &[Option<[f64; 2]>]) -> Option<f64> {
    let mut thickness: Vec<f64> = columns.iter().flatten().map(|[l, h]| h - l).collect();
    thickness.sort_by(f64::total_cmp);
    thickness.get(thickness.len() / 2).copied()
}

/// Fills columns outside the outline ring by ring with the mean of their known neighbours.
fn carried_on(mut known: Vec<Option<[f64; 2]>>, counts: [usize; 2], fallback: [f64; 2]) -> Vec<[f64; 2]> {
    while known.iter().any(Option::is_none) {
        let before = known.clone();
        let mut changed = false;
        for n in 0..known.len() {
            if before[n].is_some() {
                continue;
            }
            let (i, j) = ((n % counts[0]) as isize, (n / counts[0]) as isize);
            let near = [
                (-1, 0),
                (1, 0),
                (0, -1),
                (0, 1),
                (-1, -1),
                (1, -1),
                (-1, 1),
                (1, 1),
            ];
            let values: Vec<[f64; 2]> = near
                .iter()
                .map(|(di, dj)| (i + di, j + dj))
                .filter(|&(p, q)| p >= 0 && q >= 0 && p < counts[0] as isize && q < counts[1] as isize)
                .filter_map(|(p, q)| before[p as usize + q as usize * counts[0]])
                .collect();
            if !values.is_empty() {
                let mean = |c: usize| values.iter().map(|v| v[c]).sum::<f64>() / values.len() as f64;
                known[n] = Some([mean(0), mean(1)]);
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    known.into_iter().map(|k| k.unwrap_or(fallback)).collect()
}
