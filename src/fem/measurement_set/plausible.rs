//! Whether a set's numbers make sense together: units, orders of magnitude, drift, outliers.
//!
//! ```text
//! E ≈ F/(2 a d)                                        stiffness that a press speaks of
//! r_l = u_l − (1 − s) u_(l−1) − s u_(l+1)              a displacement against its neighbours in force
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | F, a, d | largest force of an example, radius of its patch, largest displacement | N, mm, mm |
//! | u_l, s | a component of a marker at level l; where F_l lies between its neighbours | mm, – |
//!
//! The first is a flat punch's stiffness on a half-space (Sneddon 1965) without its factor 1 − ν², right to a factor of two. A marker
//! was misread where r stands out of all r of its example by eight robust standard deviations (median absolute deviation
//! times 1.4826). What no soft object shows is refused; what is only odd is said, and fitted all the same.

use super::{Experiment, MeasurementSet};
use crate::math::Vec3;

/// Moduli that a press may speak of \[MPa\]: from softer than any gel to the hardest rubber and beyond.
const MODULI_MPA: [f64; 2] = [1e-6, 1e3];
/// No press moves a point by more than this share of the specimen's diagonal.
const MOST_SHARE: f64 = 0.9;
/// Robust standard deviations beyond which a displacement is an outlier.
const OUTLIER: f64 = 8.0;
/// An outlier, and a drift, is at least this share of the example's largest displacement.
const NOTICEABLE: f64 = 0.02;
/// Markers nearer to a support than this share of the diagonal should hardly move.
const NEAR_SUPPORT: f64 = 0.05;
/// How much faster than in proportion to its distance from the support a marker near it may move.
const STEEPER: f64 = 4.0;

/// Something odd about a set.
#[derive(Clone, Debug, PartialEq)]
pub struct Oddity {
    /// The example.
    pub example: String,
    /// What was found, and the mend.
    pub message: String,
    /// Must it be mended before a fit?
    pub is_fatal: bool,
}

impl std::fmt::Display for Oddity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "example {:?}: {}", self.example, self.message)
    }
}

/// Everything odd, in the order of the examples; the fatal ones of an example first.
pub fn oddities(set: &MeasurementSet) -> Vec<Oddity> {
    let (low, high) = set.bounds();
    let diagonal = (high - low).norm();
    let held: Vec<Vec3> = set
        .mesh
        .nodes
        .iter()
        .zip(&set.constrained)
        .filter(|(_, held)| **held == [true; 3])
        .map(|(x, _)| *x)
        .collect();
    let mut list = Vec::new();
    for experiment in &set.experiments {
        let mut add = |message: String, is_fatal: bool| {
            list.push(Oddity {
                example: experiment.name.clone(),
                message,
                is_fatal,
            });
        };
        let largest = largest(experiment);
        if let Some(message) = sizes(experiment, largest, diagonal) {
            add(message, true);
            continue;
        }
        falling(experiment).into_iter().for_each(|m| add(m, false));
        drift(experiment, &held, largest, diagonal)
            .into_iter()
            .for_each(|m| add(m, false));
        outliers(experiment, largest)
            .into_iter()
            .for_each(|m| add(m, false));
        lost(experiment).into_iter().for_each(|m| add(m, false));
    }
    list
}

/// The largest known component of a displacement \[mm\].
fn largest(experiment: &Experiment) -> f64 {
    let known = experiment
        .points
        .iter()
        .flat_map(|p| &p.displacements_mm)
        .flatten()
        .flatten();
    known.fold(0.0, |most: f64, d| most.max(d.abs()))
}

fn sizes(experiment: &Experiment, largest: f64, diagonal: f64) -> Option<String> {
    if largest == 0.0 {
        return Some("no marker moves at all, expected displacements in mm".into());
    }
    if largest > MOST_SHARE * diagonal {
        return Some(format!(
            "a displacement of {largest:.3} mm on a specimen with a diagonal of {diagonal:.1} mm: are displacements in mm, and the specimen too?"
        ));
    }
    let force = experiment.forces.last()?.dot(&experiment.contact.direction);
    let modulus = force / (2.0 * experiment.contact.radius_mm * largest);
    let [least, most] = MODULI_MPA;
    if (least..=most).contains(&modulus) {
        return None;
    }
    Some(format!(
        "{force:.3e} N on a patch of {:.2} mm radius for {largest:.3e} mm speak of about {modulus:.1e} MPa, expected {least:.0e} to {most:.0e}: are forces in N and displacements in mm?",
        experiment.contact.radius_mm
    ))
}

/// The point that moves most along the direction should move on as the force rises.
fn falling(experiment: &Experiment) -> Option<String> {
    let along = |point: &crate::fem::example::MeasuredPoint, level: usize| -> Option<f64> {
        let moved = point.displacements_mm.get(level)?;
        let parts = point.directions.iter().zip(moved);
        parts
            .map(|(d, u)| u.map(|u| u * d.dot(&experiment.contact.direction)))
            .sum::<Option<f64>>()
    };
    let last = experiment.forces.len().checked_sub(1)?;
    let reach = |p: &&crate::fem::example::MeasuredPoint| along(p, last).unwrap_or(f64::NEG_INFINITY);
    let first = experiment
        .points
        .iter()
        .max_by(|a, b| reach(a).total_cmp(&reach(b)))?;
    for level in 1..=last {
        let (Some(before), Some(here)) = (along(first, level - 1), along(first, level)) else {
            continue;
        };
        if here < before {
            let f = |l: usize| experiment.forces[l].dot(&experiment.contact.direction);
            return Some(format!(
                "under {:.3} N the point at ({:.1}, {:.1}, {:.1}) mm has gone back to {here:.3} mm from {before:.3} mm under {:.3} N: a slip, or loading and unloading mixed",
                f(level),
                first.place.x,
                first.place.y,
                first.place.z,
                f(level - 1)
            ));
        }
    }
    None
}

/// Markers beside a support that move much further than their distance from it explains: the specimen slid as a whole.
fn drift(experiment: &Experiment, held: &[Vec3], largest: f64, diagonal: f64) -> Option<String> {
    let near: Vec<(usize, f64)> = experiment
        .points
        .iter()
        .enumerate()
        .filter(|(_, p)| p.directions.len() == 3)
        .map(|(i, p)| {
            (
                i,
                held.iter()
                    .map(|x| (x - p.place).norm())
                    .fold(f64::INFINITY, f64::min),
            )
        })
        .filter(|(_, distance)| *distance < NEAR_SUPPORT * diagonal)
        .collect();
    if near.len() < 3 {
        return None;
    }
    for level in 0..experiment.forces.len() {
        let mut moved: Vec<(Vec3, f64)> = Vec::new();
        for &(i, distance) in &near {
            if let [Some(x), Some(y), Some(z)] = experiment.points[i].displacements_mm[level][..] {
                moved.push((Vec3::new(x, y, z), distance));
            }
        }
        if moved.len() < 3 {
            continue;
        }
        let common = [0, 1, 2].map(|c| median(moved.iter().map(|(u, _)| u[c]).collect()));
        let common = Vec3::from(common);
        let distance = median(moved.iter().map(|m| m.1).collect());
        let deviation = near
            .iter()
            .map(|&(i, _)| experiment.deviations_mm[i][level])
            .fold(0.0, f64::max);
        let allowed = (NOTICEABLE * largest)
            .max(STEEPER * largest * distance / diagonal)
            .max(3.0 * deviation);
        if common.norm() > allowed {
            return Some(format!(
                "under {:.3} N the {} markers beside the supports have moved together by ({:.3}, {:.3}, {:.3}) mm, expected less than {allowed:.3} mm: the specimen or the cameras drifted; take that motion off all markers",
                experiment.forces[level].dot(&experiment.contact.direction),
                moved.len(),
                common.x,
                common.y,
                common.z
            ));
        }
    }
    None
}

/// A displacement against its neighbours in force: marker, component, level, r \[mm\].
fn jumps(experiment: &Experiment) -> Vec<(usize, usize, usize, f64)> {
    let force: Vec<f64> = experiment
        .forces
        .iter()
        .map(|f| f.dot(&experiment.contact.direction))
        .collect();
    let mut jumps = Vec::new();
    for (i, point) in experiment.points.iter().enumerate() {
        for c in 0..point.directions.len() {
            for level in 1..force.len().saturating_sub(1) {
                let at = |l: usize| point.displacements_mm[l][c];
                if let (Some(before), Some(here), Some(after)) = (at(level - 1), at(level), at(level + 1)) {
                    let s = (force[level] - force[level - 1]) / (force[level + 1] - force[level - 1]);
                    jumps.push((i, c, level, here - (1.0 - s) * before - s * after));
                }
            }
        }
    }
    jumps
}

fn outliers(experiment: &Experiment, largest: f64) -> Vec<String> {
    let jumps = jumps(experiment);
    if jumps.len() < 10 {
        return Vec::new();
    }
    let centre = median(jumps.iter().map(|j| j.3).collect());
    let spread = 1.4826 * median(jumps.iter().map(|j| (j.3 - centre).abs()).collect());
    let mut found = Vec::new();
    for (k, &(i, c, level, r)) in jumps.iter().enumerate() {
        // One wrong reading bends the curve at its neighbours too, by half as much.
        let beside = [k.checked_sub(1), Some(k + 1)].into_iter().flatten();
        let beside = beside
            .filter_map(|n| jumps.get(n))
            .filter(|j| (j.0, j.1) == (i, c));
        let is_peak = beside.map(|j| j.3.abs()).all(|other| other <= r.abs());
        let bound = (OUTLIER * spread)
            .max(NOTICEABLE * largest)
            .max(3.0 * experiment.deviations_mm[i][level]);
        if is_peak && (r - centre).abs() > bound {
            let point = &experiment.points[i];
            let d = point.directions[c];
            found.push(format!(
                "under {:.3} N the marker at ({:.1}, {:.1}, {:.1}) mm is {r:.3} mm off the line between its neighbours in force (along ({:.0}, {:.0}, {:.0})), others at most {bound:.3} mm: if it was misread, leave that displacement empty",
                experiment.forces[level].dot(&experiment.contact.direction),
                point.place.x, point.place.y, point.place.z, d.x, d.y, d.z
            ));
        }
    }
    found
}

fn lost(experiment: &Experiment) -> Option<String> {
    let all = || {
        experiment
            .points
            .iter()
            .flat_map(|p| &p.displacements_mm)
            .flatten()
    };
    let (lost, count) = (all().filter(|d| d.is_none()).count(), all().count());
    (2 * lost > count).then(|| format!("{lost} of {count} displacements are missing"))
}

/// NaN of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}
