//! A homogeneous material held against the fine structure: the same presses on a block of it, marker by marker.
//!
//! ```text
//! e = √(Σ |u_m − û_m|² / Σ |û_m|²)         over the markers of one press at one level
//! e_p = |d·(v − v̂)| / |d·v̂|               under the probe, along its direction d
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | u_m, û_m | displacement of a marker on the homogeneous block, on the fine structure | mm |
//! | v, v̂ | mean displacement under the probe | mm |

use super::measure::Press;
use crate::fem::equilibrium::{Options, Solver};
use crate::fem::example::Sensor;
use crate::fem::measurement_set::{Experiment, MeasurementSet};
use crate::fem::specimen::{Specimen, SpecimenError};
use crate::material::law::Law;
use crate::math::Vec3;
use crate::numerics::cholesky::CholeskyError;
use serde::Serialize;

/// Why nothing can be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// The set cannot be put on the bench.
    #[error(transparent)]
    Specimen(#[from] SpecimenError),
    /// The homogeneous block's matrix.
    #[error("the homogeneous block cannot be solved: {0}")]
    Matrix(#[from] CholeskyError),
}

/// One press at one level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelError {
    /// The probe.
    pub probe: String,
    /// Size of its force \[N\].
    pub force_n: f64,
    /// RMS distance of the markers from where they should be \[mm\].
    pub rms_mm: f64,
    /// The largest of these distances \[mm\].
    pub largest_mm: f64,
    /// RMS displacement of the set's markers \[mm\].
    pub moved_rms_mm: f64,
    /// Displacement under the probe along its direction: of the fine structure, of the homogeneous block \[mm\]. `None` where the
    /// set alone is known.
    pub probe_mm: Option<[f64; 2]>,
}

impl LevelError {
    /// e.
    pub fn relative(&self) -> f64 {
        self.rms_mm / self.moved_rms_mm
    }

    /// e_p.
    pub fn relative_at_probe(&self) -> Option<f64> {
        self.probe_mm.map(|[fine, own]| ((own - fine) / fine).abs())
    }
}

/// Presses the set's block of `law`, its axis as in the specimen, and compares: markers with the set's, displacements under the probe
/// with those of the `presses` of the fine structure, as far as these are at hand. Levels that the homogeneous block does not reach
/// are left out.
///
/// # Errors
/// [`CompareError`].
pub fn compare(
    set: &MeasurementSet,
    presses: &[Press],
    law: &Law,
    options: &Options,
) -> Result<Vec<LevelError>, CompareError> {
    let specimen = Specimen::new(set)?;
    let laws = [law];
    let materials = specimen.materials(&laws);
    let mut solver = Solver::new(&specimen.model)?;
    solver.start(&materials)?;
    let mut errors = Vec::new();
    for (experiment, wired) in set.experiments.iter().zip(&specimen.experiments) {
        let full = experiment.forces.last().copied().unwrap_or_else(Vec3::zeros);
        let load = wired.load(&full);
        let factors: Vec<f64> = experiment.forces.iter().map(|f| f.norm() / full.norm()).collect();
        let curve = solver.curve(&materials, &load, &factors, options, &|| false);
        let press = presses.iter().find(|p| p.name == experiment.name);
        for (level, u) in curve.levels.iter().enumerate() {
            let mean: Vec3 = u.iter().zip(&wired.shares).map(|(u, s)| u * *s).sum();
            let along = |v: &Vec3| v.dot(&experiment.contact.direction);
            let under = press.and_then(|p| p.probe_mm.get(level));
            let mut error = at_markers(experiment, &wired.sensors, level, u);
            error.probe_mm = under.map(|fine| [along(&Vec3::from(*fine)), along(&mean)]);
            errors.push(error);
        }
    }
    Ok(errors)
}

/// The markers of a press at a level, of which each measured direction counts.
fn at_markers(experiment: &Experiment, sensors: &[Sensor], level: usize, u: &[Vec3]) -> LevelError {
    let (mut sum, mut own, mut largest, mut count) = (0.0, 0.0, 0.0_f64, 0.0);
    for (point, sensor) in experiment.points.iter().zip(sensors) {
        let moved = sensor.read(u);
        let (mut off, mut seen) = (0.0, false);
        for (direction, measured) in point.directions.iter().zip(&point.displacements_mm[level]) {
            if let Some(measured) = measured {
                off += (direction.dot(&moved) - measured).powi(2);
                own += measured * measured;
                seen = true;
            }
        }
        sum += off;
        largest = largest.max(off.sqrt());
        count += f64::from(u8::from(seen));
    }
    LevelError {
        probe: experiment.name.clone(),
        force_n: experiment.forces[level].norm(),
        rms_mm: (sum / count).sqrt(),
        largest_mm: largest,
        moved_rms_mm: (own / count).sqrt(),
        probe_mm: None,
    }
}
