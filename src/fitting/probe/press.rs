//! Presses of a specimen, ready to be fitted: forces and readings beside the model that is to answer them.

use crate::fem::equilibrium::{Options, Solver, Stop};
use crate::fem::example::{MeasuredPoint, Sensor};
use crate::fem::forces::Materials;
use crate::fem::measurement_set::{Experiment, MeasurementSet};
use crate::fem::model::Model;
use crate::fem::sensitivity::{SensitivityError, Slopes};
use crate::fem::specimen::{Specimen, WiredExperiment};
use crate::material::law::Law;
use crate::math::Vec3;
use crate::numerics::cholesky::CholeskyError;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// One example of a measurement set, wired.
#[derive(Clone, Debug)]
pub struct Press {
    /// Its name.
    pub name: String,
    /// Direction of the probe, a unit vector.
    pub direction: Vec3,
    /// Middle of the patch on the surface \[mm\].
    pub contact_point: Vec3,
    /// Share of each node in the probe's force, `(nodes)`.
    pub shares: Vec<f64>,
    /// The probe's force as measured, `(levels)` \[N\].
    pub forces: Vec<Vec3>,
    /// What was not measured of it, across the direction, `(levels)` \[N\]; zero until it is estimated.
    pub tangential: Vec<Vec3>,
    /// The contact point's displacement.
    pub probe: Sensor,
    /// Measured points with the directions that were measured.
    pub sensors: Vec<(Sensor, Vec<Vec3>)>,
    /// Where they are in the undeformed specimen \[mm\].
    pub places: Vec<Vec3>,
    /// Which of them lie under the probe.
    pub under_probe: Vec<bool>,
    /// Measured displacements, `(levels × components)` \[mm\]; a component is one direction of one point, in order. `None`
    /// where a marker was lost.
    pub readings: Vec<Vec<Option<f64>>>,
    /// Their standard deviations, `(levels × components)` \[mm\].
    pub deviations: Vec<Vec<f64>>,
    /// How much its squared residuals count.
    pub weight: f64,
    /// Not fitted, but compared.
    pub held_out: bool,
}

impl Press {
    /// The point that each component belongs to, `(components)`.
    pub fn point_of_component(&self) -> Vec<usize> {
        let of = |(k, (_, directions)): (usize, &(Sensor, Vec<Vec3>))| vec![k; directions.len()];
        self.sensors.iter().enumerate().flat_map(of).collect()
    }

    /// Displacements along the measured directions where the nodes' are `u`, `(components)` \[mm\].
    pub fn read(&self, u: &[Vec3]) -> Vec<f64> {
        let read = |(sensor, directions): &(Sensor, Vec<Vec3>)| {
            let displacement = sensor.read(u);
            directions.iter().map(|d| displacement.dot(d)).collect::<Vec<_>>()
        };
        self.sensors.iter().flat_map(read).collect()
    }

    /// Two unit vectors across the direction, and across one another.
    pub fn across(&self) -> [Vec3; 2] {
        let mut axis = Vec3::zeros();
        axis[self.direction.map(f64::abs).imin()] = 1.0;
        let first = self.direction.cross(&axis).normalize();
        [first, self.direction.cross(&first)]
    }

    /// Nodal forces at each level, `(levels × nodes)` \[N\].
    fn loads(&self) -> Vec<Vec<Vec3>> {
        self.forces
            .iter()
            .zip(&self.tangential)
            .map(|(f, t)| self.shares.iter().map(|s| (f + t) * *s).collect())
            .collect()
    }
}

/// A press that the model does not stand.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Failure {
    /// No equilibrium at one of the loads.
    #[error("example {press:?}, level {level} of {levels}: {stop}")]
    Unreached {
        /// Name of the example.
        press: String,
        /// The level that is not reached, from 1.
        level: usize,
        /// How many there are.
        levels: usize,
        /// Why.
        stop: Stop,
    },
    /// No derivatives there.
    #[error("example {press:?}: {error}")]
    Sensitivity {
        /// Name of the example.
        press: String,
        /// Why.
        error: SensitivityError,
    },
    /// Memory.
    #[error(transparent)]
    Cholesky(#[from] CholeskyError),
}

/// Displacements of the nodes at each level of a press, `(levels × nodes)` \[mm\].
pub type Levels = Vec<Vec<Vec3>>;

/// The examples of a set as its specimen wires them.
fn presses_of(set: &MeasurementSet, specimen: &Specimen) -> Vec<Press> {
    let one = |(experiment, wired): (&Experiment, &WiredExperiment)| {
        let levels = experiment.forces.len();
        let at = |point: &MeasuredPoint, level: usize| -> Vec<Option<f64>> {
            let row = point.displacements_mm.get(level);
            row.map_or(vec![None; point.directions.len()], Clone::clone)
        };
        let spread = |level: usize| -> Vec<f64> {
            let points = experiment.points.iter().zip(&experiment.deviations_mm);
            points
                .flat_map(|(p, d)| vec![d[level]; p.directions.len()])
                .collect()
        };
        Press {
            name: experiment.name.clone(),
            direction: experiment.contact.direction,
            contact_point: wired.contact_point,
            shares: wired.shares.clone(),
            forces: experiment.forces.clone(),
            tangential: vec![Vec3::zeros(); levels],
            probe: wired.probe.clone(),
            sensors: wired
                .sensors
                .iter()
                .zip(&experiment.points)
                .map(|(s, p)| (s.clone(), p.directions.clone()))
                .collect(),
            places: experiment.points.iter().map(|p| p.place).collect(),
            under_probe: wired.under_probe.clone(),
            readings: (0..levels)
                .map(|l| experiment.points.iter().flat_map(|p| at(p, l)).collect())
                .collect(),
            deviations: (0..levels).map(spread).collect(),
            weight: experiment.weight,
            held_out: experiment.held_out,
        }
    };
    set.experiments
        .iter()
        .zip(&specimen.experiments)
        .map(one)
        .collect()
}

/// A specimen of one material with its presses.
#[derive(Clone, Debug)]
pub struct PressedSpecimen<'a> {
    /// Unknowns and matrix.
    pub model: &'a Model,
    /// All zero.
    pub cell_of_point: &'a [u16],
    /// The presses.
    pub presses: Vec<Press>,
}

/// How the presses of a fit are solved. A law that needs smaller increments than an eighth is no candidate.
pub fn solver_options() -> Options {
    Options {
        tolerance: 1e-8,
        newton_iterations: 15,
        halvings: 3,
        ..Options::default()
    }
}

impl<'a> PressedSpecimen<'a> {
    /// The specimen of a set with the set's examples.
    pub fn new(set: &MeasurementSet, specimen: &'a Specimen) -> PressedSpecimen<'a> {
        PressedSpecimen {
            model: &specimen.model,
            cell_of_point: &specimen.cell_of_point,
            presses: presses_of(set, specimen),
        }
    }
}

impl PressedSpecimen<'_> {
    /// Equilibria of the presses `which` with `law`, one entry each. Side by side on all threads, the same on any number.
    ///
    /// # Errors
    /// The first [`Failure`] in the order of `which`.
    pub fn equilibria(
        &self,
        law: &Law,
        which: &[usize],
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<Levels>, Failure> {
        let laws = [law];
        let materials = self.materials(&laws);
        // All presses of a thread share the factor at rest.
        let start = || -> Result<Solver, CholeskyError> {
            let mut solver = Solver::new(self.model)?;
            solver.start(&materials)?;
            Ok(solver)
        };
        let solved: Vec<Result<Levels, Failure>> = which
            .par_iter()
            .map_init(start, |solver, &k| {
                let solver = solver.as_mut().map_err(|e| Failure::Cholesky(*e))?;
                press(solver, &materials, &self.presses[k], cancelled)
            })
            .collect();
        solved.into_iter().collect()
    }
    /// The specimen of one law.
    pub fn materials<'b>(&'b self, laws: &'b [&'b Law]) -> Materials<'b> {
        Materials {
            laws,
            cell_of_point: self.cell_of_point,
        }
    }

    /// Derivatives of `read` of each press `which` at each of its levels, with respect to the numbers of the law that `slopes`
    /// stands for and then to a force of 1 N along each of the press's vectors in `along`, `(presses × levels)` matrices of
    /// `(components × (numbers + forces))`.
    ///
    /// # Errors
    /// The first [`Failure`].
    pub fn derivatives(
        &self,
        law: &Law,
        which: &[usize],
        equilibria: &[Levels],
        slopes: &Slopes,
        read: &(impl Fn(&Press) -> Vec<(Sensor, Vec<Vec3>)> + Sync),
        along: &(dyn Fn(&Press) -> Vec<Vec3> + Sync),
    ) -> Result<Vec<Vec<DMatrix<f64>>>, Failure> {
        let tasks: Vec<(usize, &Vec<Vec3>)> = which
            .iter()
            .zip(equilibria)
            .flat_map(|(&k, levels)| levels.iter().map(move |u| (k, u)))
            .collect();
        let laws = [law];
        let materials = self.materials(&laws);
        let found: Vec<Result<DMatrix<f64>, Failure>> = tasks
            .par_iter()
            .map_init(
                || Solver::new(self.model),
                |solver, &(k, u)| {
                    let solver = solver.as_mut().map_err(|e| Failure::Cholesky(*e))?;
                    let press = &self.presses[k];
                    let loads: Vec<Vec<Vec3>> = along(press)
                        .iter()
                        .map(|f| press.shares.iter().map(|s| f * *s).collect())
                        .collect();
                    let loads: Vec<&[Vec3]> = loads.iter().map(Vec::as_slice).collect();
                    solver
                        .reading_derivatives(u, &materials, 0, slopes, &loads, &read(press))
                        .map_err(|error| Failure::Sensitivity {
                            press: press.name.clone(),
                            error,
                        })
                },
            )
            .collect();
        let mut found = found.into_iter();
        equilibria
            .iter()
            .map(|levels| found.by_ref().take(levels.len()).collect())
            .collect()
    }
}

/// Equilibria of one press, by a solver that has been started.
fn press(
    solver: &mut Solver,
    materials: &Materials,
    press: &Press,
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Result<Levels, Failure> {
    let curve = solver.route(materials, &press.loads(), &solver_options(), &|| cancelled());
    if curve.stop == Stop::Converged {
        return Ok(curve.levels);
    }
    Err(Failure::Unreached {
        press: press.name.clone(),
        level: curve.levels.len() + 1,
        levels: press.forces.len(),
        stop: curve.stop,
    })
}
