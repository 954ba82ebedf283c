//! The presses of a laboratory, simulated on the fine mesh.
//!
//! ```text
//! f_a = s_a F_l       u: equilibrium under f at each level l       marker: Σ_a N_a(X) u_a       probe: Σ_a s_a u_a
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | s_a | share of node a in the force ([`super::patch`]) | – |
//! | F_l | force of the probe at level l | N |
//! | Σ s_a u_a | mean displacement under the probe, on which the force does its work | mm |
//!
//! Each press starts from rest, so presses do not depend on one another, nor on how many run side by side.

use super::markers::{Marker, markers};
use super::patch::shares;
use super::read::Laboratory;
use crate::fem::elements::VolumetricStrain;
use crate::fem::equilibrium::{Load, Options, Solver, Stop};
use crate::fem::forces::Materials;
use crate::fem::model::{Model, ModelError};
use crate::math::Vec3;
use crate::numerics::cholesky::CholeskyError;
use crate::units::document::Mistake;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Why a laboratory cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// Something in the file does not fit the structure.
    #[error(transparent)]
    Mistake(#[from] Mistake),
    /// The mesh cannot be simulated.
    #[error("{file}: {error}")]
    Model {
        /// The laboratory's file.
        file: String,
        /// What is wrong.
        error: ModelError,
    },
    /// The matrix does not fit in memory, or the base material is not stable.
    #[error("{file}: {error}; fewer jobs side by side, or a coarser mesh, need less memory")]
    Matrix {
        /// The laboratory's file.
        file: String,
        /// What is wrong.
        error: CholeskyError,
    },
}

/// What a press came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Press {
    /// The probe's name.
    pub name: String,
    /// Displacement of each marker at each level that was reached, `(levels × markers)` \[mm\].
    pub markers_mm: Vec<Vec<[f64; 3]>>,
    /// Mean displacement under the probe at each of these levels \[mm\].
    pub probe_mm: Vec<[f64; 3]>,
    /// Are all levels reached?
    pub is_complete: bool,
    /// Why it ended, in words.
    pub stop: String,
    /// Residual force of the last level, as a share of the load.
    pub residual: f64,
    /// Matrices that were factorised.
    pub factorisations: usize,
}

/// A laboratory wired for the solver.
#[derive(Debug)]
pub struct Wired<'a> {
    laboratory: &'a Laboratory,
    /// Unknowns and matrix of the fine mesh.
    pub model: Model,
    /// The markers.
    pub markers: Vec<Marker>,
    /// For each probe, share of each node in its force, `(probes × nodes)`.
    pub shares: Vec<Vec<f64>>,
    cell_of_point: Vec<u16>,
}

/// What a run is told as presses end; the number is that of the probe.
pub type Finished<'a> = &'a (dyn Fn(usize, &Press) + Sync);

impl<'a> Wired<'a> {
    /// Wires a laboratory.
    ///
    /// # Errors
    /// [`MeasureError`]: a probe off the block, a block that nothing holds, no markers.
    pub fn new(laboratory: &'a Laboratory) -> Result<Wired<'a>, MeasureError> {
        let (document, fine) = (&laboratory.document, &laboratory.fine);
        let nodes = &fine.mesh.nodes;
        let thin = 1e-6 * fine.size.z;
        let end = |top: bool| -> Vec<usize> {
            let place = if top { fine.size.z } else { 0.0 };
            let there = |n: &usize| (nodes[*n].z - place).abs() <= thin;
            (0..nodes.len()).filter(there).collect()
        };
        let mut constrained = vec![[false; 3]; nodes.len()];
        for fixed in &laboratory.fixed {
            fixed.hold_nodes(document, nodes, &end, &mut constrained)?;
        }
        let whole = |message: String| document.mistake(&(0..0), message);
        let mut all = Vec::new();
        for probe in &laboratory.probes {
            let shares = shares(fine, &probe.contact);
            all.push(shares.map_err(|m| whole(format!("probe {:?}: {m}", probe.name)))?);
        }
        let markers = markers(fine, &laboratory.markers).map_err(whole)?;
        if markers.is_empty() {
            return Err(whole("no marker lies on material: choose finer grids of [[markers]]".into()).into());
        }
        let model = Model::with(
            fine.mesh.clone(),
            fine.fill.clone(),
            constrained,
            VolumetricStrain::Shared,
            None,
        );
        let model = model.map_err(|error| MeasureError::Model {
            file: document.file.display().to_string(),
            error,
        })?;
        Ok(Wired {
            laboratory,
            cell_of_point: vec![0; model.parts.points()],
            model,
            markers,
            shares: all,
        })
    }

    /// Simulates the probes `wanted`, `jobs` of them side by side, and tells `finished` of each that ends by itself; answers
    /// those, in the order of `wanted`. What was cancelled is left out.
    ///
    /// # Errors
    /// [`MeasureError::Matrix`].
    pub fn measure(
        &self,
        wanted: &[usize],
        jobs: usize,
        options: &Options,
        finished: Finished,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<(usize, Press)>, MeasureError> {
        let jobs = jobs.clamp(1, wanted.len().max(1));
        // Round robin: presses in a row are alike and cost alike.
        let groups: Vec<Vec<usize>> = (0..jobs)
            .map(|j| wanted.iter().copied().skip(j).step_by(jobs).collect())
            .collect();
        let done: Result<Vec<Vec<(usize, Press)>>, CholeskyError> = groups
            .par_iter()
            .map(|group| self.in_turn(group, options, finished, cancelled))
            .collect();
        let mut done = done.map_err(|error| MeasureError::Matrix {
            file: self.laboratory.document.file.display().to_string(),
            error,
        })?;
        let mut presses: Vec<(usize, Press)> = done.drain(..).flatten().collect();
        presses.sort_by_key(|(k, _)| *k);
        Ok(presses)
    }

    fn in_turn(
        &self,
        group: &[usize],
        options: &Options,
        finished: Finished,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<(usize, Press)>, CholeskyError> {
        let laws = [&self.laboratory.base.law];
        let materials = Materials {
            laws: &laws,
            cell_of_point: &self.cell_of_point,
        };
        let mut solver = Solver::new(&self.model)?;
        solver.start(&materials)?;
        let mut presses = Vec::new();
        for &k in group {
            if cancelled() {
                break;
            }
            let press = self.press(k, &mut solver, &materials, options, cancelled);
            if let Some(press) = press {
                finished(k, &press);
                presses.push((k, press));
            }
        }
        Ok(presses)
    }

    fn press(
        &self,
        k: usize,
        solver: &mut Solver,
        materials: &Materials,
        options: &Options,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Option<Press> {
        let (probe, shares) = (&self.laboratory.probes[k], &self.shares[k]);
        let full = probe.forces.last().copied().unwrap_or_else(Vec3::zeros);
        let load = Load {
            forces: shares.iter().map(|s| full * *s).collect(),
            prescribed: None,
        };
        let factors: Vec<f64> = probe.forces.iter().map(|f| f.norm() / full.norm()).collect();
        let curve = solver.curve(materials, &load, &factors, options, &|| cancelled());
        if curve.stop == Stop::Cancelled {
            return None;
        }
        let moved = |u: &Vec<Vec3>| -> Vec<[f64; 3]> {
            self.markers.iter().map(|m| m.sensor.read(u).into()).collect()
        };
        let under = |u: &Vec<Vec3>| -> [f64; 3] {
            let mean: Vec3 = u.iter().zip(shares).map(|(u, s)| u * *s).sum();
            mean.into()
        };
        Some(Press {
            name: probe.name.clone(),
            markers_mm: curve.levels.iter().map(moved).collect(),
            probe_mm: curve.levels.iter().map(under).collect(),
            is_complete: curve.levels.len() == factors.len(),
            stop: curve.stop.to_string(),
            residual: curve.residual,
            factorisations: curve.work.factorisations,
        })
    }
}
