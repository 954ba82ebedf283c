//! How far the fitted model's markers are from the measured ones.
//!
//! ```text
//! e = ( Σ_d (x_d − x̄_d)² )^½      over the measured directions d of a marker at a level \[mm\]
//! ```
//!
//! The thesis' Table 8.1 gives average, standard deviation and maximum of e under small, medium and large force.

use super::press::{Levels, PressedSpecimen};
use crate::math::Vec3;

/// The errors of all markers at forces of one size.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelErrors {
    /// `small`, `medium` or `large`.
    pub size: &'static str,
    /// Least and largest force along the probe \[N\].
    pub forces_n: [f64; 2],
    /// Mean of e \[mm\].
    pub average_mm: f64,
    /// Standard deviation of e \[mm\].
    pub deviation_mm: f64,
    /// Largest e \[mm\].
    pub largest_mm: f64,
    /// Largest measured displacement \[mm\].
    pub displacement_mm: f64,
    /// Markers that were measured, over all examples.
    pub markers: usize,
}

/// The errors of one marker.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerErrors {
    /// The example.
    pub press: String,
    /// Number of the marker in its example, from 0.
    pub point: usize,
    /// Where it is in the undeformed specimen \[mm\].
    pub place: Vec3,
    /// Is it under the probe?
    pub under_probe: bool,
    /// e at each level, `(levels)` \[mm\]; `None` where it was lost.
    pub errors_mm: Vec<Option<f64>>,
    /// Measured displacements' sizes, `(levels)` \[mm\].
    pub displacements_mm: Vec<Option<f64>>,
}

impl MarkerErrors {
    /// Root mean square over the levels \[mm\]; zero for a marker that was never seen.
    pub fn rms_mm(&self) -> f64 {
        root_mean_square(self.errors_mm.iter().flatten())
    }
}

/// Errors of a group of presses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Errors {
    /// By size of the force: small, medium, large.
    pub levels: Vec<LevelErrors>,
    /// By marker.
    pub markers: Vec<MarkerErrors>,
    /// Root mean square of e over all levels \[mm\].
    pub rms_mm: f64,
    /// Root mean square of the measured displacements \[mm\].
    pub displacement_rms_mm: f64,
    /// Largest e over all levels \[mm\].
    pub largest_mm: f64,
    /// Largest measured displacement \[mm\].
    pub largest_displacement_mm: f64,
}

impl Errors {
    /// rms of e over that of the displacements.
    pub fn relative(&self) -> f64 {
        if self.displacement_rms_mm > 0.0 {
            self.rms_mm / self.displacement_rms_mm
        } else {
            0.0
        }
    }
}

fn root_mean_square<'a>(x: impl Iterator<Item = &'a f64>) -> f64 {
    let (sum, count) = x.fold((0.0, 0usize), |(s, n), e| (s + e * e, n + 1));
    (sum / count.max(1) as f64).sqrt()
}

/// Errors of the presses `which` at their `equilibria`.
pub fn errors(pressed: &PressedSpecimen, which: &[usize], equilibria: &[Levels]) -> Errors {
    let mut markers = Vec::new();
    for (&k, levels) in which.iter().zip(equilibria) {
        markers.extend(of_press(pressed, k, levels));
    }
    let all = || markers.iter().flat_map(|m| m.errors_mm.iter().flatten());
    let sizes = || markers.iter().flat_map(|m| m.displacements_mm.iter().flatten());
    Errors {
        rms_mm: root_mean_square(all()),
        displacement_rms_mm: root_mean_square(sizes()),
        largest_mm: all().copied().fold(0.0, f64::max),
        largest_displacement_mm: sizes().copied().fold(0.0, f64::max),
        levels: by_size(pressed, which, &markers),
        markers,
    }
}

fn of_press(pressed: &PressedSpecimen, k: usize, levels: &Levels) -> Vec<MarkerErrors> {
    let press = &pressed.presses[k];
    let points = press.point_of_component();
    let mut markers: Vec<MarkerErrors> = press
        .places
        .iter()
        .zip(&press.under_probe)
        .enumerate()
        .map(|(point, (place, under_probe))| MarkerErrors {
            press: press.name.clone(),
            point,
            place: *place,
            under_probe: *under_probe,
            errors_mm: Vec::new(),
            displacements_mm: Vec::new(),
        })
        .collect();
    for (u, readings) in levels.iter().zip(&press.readings) {
        // Sums of squares, and whether anything was seen.
        let mut sums = vec![(0.0, 0.0, false); markers.len()];
        for ((x, reading), &point) in press.read(u).iter().zip(readings).zip(&points) {
            if let Some(measured) = reading {
                let (error, size, seen) = &mut sums[point];
                *error += (x - measured).powi(2);
                *size += measured * measured;
                *seen = true;
            }
        }
        for (marker, (error, size, seen)) in markers.iter_mut().zip(sums) {
            marker.errors_mm.push(seen.then(|| error.sqrt()));
            marker.displacements_mm.push(seen.then(|| size.sqrt()));
        }
    }
    markers
}

/// The first, the middle and the last level of each press.
fn by_size(pressed: &PressedSpecimen, which: &[usize], markers: &[MarkerErrors]) -> Vec<LevelErrors> {
    let level = |size: usize, levels: usize| match size {
        0 => (levels > 2).then_some(0),
        1 => (levels > 1).then_some((levels - 1) / 2),
        _ => levels.checked_sub(1),
    };
    let mut rows = Vec::new();
    for (size, word) in ["small", "medium", "large"].into_iter().enumerate() {
        let at = |m: &MarkerErrors| {
            let l = level(size, m.errors_mm.len())?;
            Some((m.errors_mm[l]?, m.displacements_mm[l]?))
        };
        let found: Vec<(f64, f64)> = markers.iter().filter_map(at).collect();
        if found.is_empty() {
            continue;
        }
        let force = |&k: &usize| {
            let press = &pressed.presses[k];
            let l = level(size, press.forces.len())?;
            Some(press.forces[l].dot(&press.direction))
        };
        let forces: Vec<f64> = which.iter().filter_map(force).collect();
        let n = found.len() as f64;
        let average = found.iter().map(|f| f.0).sum::<f64>() / n;
        let variance = found.iter().map(|f| (f.0 - average).powi(2)).sum::<f64>() / n;
        rows.push(LevelErrors {
            size: word,
            forces_n: [
                forces.iter().copied().fold(f64::INFINITY, f64::min),
                forces.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            ],
            average_mm: average,
            deviation_mm: variance.sqrt(),
            largest_mm: found.iter().map(|f| f.0).fold(0.0, f64::max),
            displacement_mm: found.iter().map(|f| f.1).fold(0.0, f64::max),
            markers: found.len(),
        });
    }
    rows
}
