//! A specimen on the test bench: what a measurement set says, wired for the solver.
//!
//! ```text
//! f_a = s_a F      nodal forces of a press with force F;      x_m = Σ_a N_a(X_m) u_a      displacement of a marker
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | s_a | share of node a in a force that is spread evenly over the patch, Σ s_a = 1 | – |
//! | F | force of the probe at a level, its tangential part included | N |
//! | N_a(X_m) | shape functions at the marker's place in the undeformed specimen | – |
//!
//! A marker lies where it was glued, not at a node: residuals live at markers. Loads keep their direction and act on the patch
//! as it was at rest.

use super::equilibrium::Load;
use super::example::Sensor;
use super::forces::Materials;
use super::measurement_set::{Experiment, MeasurementSet};
use super::model::{Model, ModelError};
use crate::geometry::boundary::boundary_surface;
use crate::geometry::embedding::Locator;
use crate::geometry::solid::Solid;
use crate::material::law::Law;
use crate::math::Vec3;
use crate::units::document::Mistake;

/// A marker may lie outside the mesh by this share of the specimen's diagonal: it was glued on, and scanned.
const REACH: f64 = 0.02;

/// One press, wired.
#[derive(Clone, Debug)]
pub struct WiredExperiment {
    /// Share of each node in the probe's force, `(nodes)`.
    pub shares: Vec<f64>,
    /// The contact point on the surface \[mm\].
    pub contact_point: Vec3,
    /// The contact point's displacement, read from the nodes.
    pub probe: Sensor,
    /// One for each measured point of the experiment, in its order.
    pub sensors: Vec<Sensor>,
    /// Which of the measured points lie under the probe.
    pub under_probe: Vec<bool>,
}

/// A specimen of one material, held and wired.
#[derive(Clone, Debug)]
pub struct Specimen {
    /// Unknowns and matrix.
    pub model: Model,
    /// All zero: there is one material.
    pub cell_of_point: Vec<u16>,
    /// One for each experiment of the set.
    pub experiments: Vec<WiredExperiment>,
}

/// Why a set cannot be put on the bench.
#[derive(Debug, thiserror::Error)]
pub enum SpecimenError {
    /// Something in the set does not fit its specimen.
    #[error(transparent)]
    Mistake(#[from] Mistake),
    /// The specimen cannot be simulated.
    #[error("{file}: {error}")]
    Model {
        /// The set's file.
        file: String,
        /// What is wrong.
        error: ModelError,
    },
}

impl Specimen {
    /// Puts the specimen of a set on the bench.
    ///
    /// # Errors
    /// [`SpecimenError`]: a contact or a marker off the specimen, a mesh with no inside, a specimen that nothing holds.
    pub fn new(set: &MeasurementSet) -> Result<Specimen, SpecimenError> {
        let experiments = wire(set)?;
        let model = Model::with(
            set.mesh.clone(),
            None,
            set.constrained.clone(),
            set.volumetric,
            None,
        );
        let model = model.map_err(|error| SpecimenError::Model {
            file: set.document.file.display().to_string(),
            error,
        })?;
        Ok(Specimen {
            cell_of_point: vec![0; model.parts.points()],
            model,
            experiments,
        })
    }

    /// The whole specimen of one law, which stands alone in `laws`.
    pub fn materials<'a>(&'a self, laws: &'a [&'a Law]) -> Materials<'a> {
        Materials {
            laws,
            cell_of_point: &self.cell_of_point,
        }
    }
}

impl WiredExperiment {
    /// The load of a press with `force` \[N\].
    pub fn load(&self, force: &Vec3) -> Load {
        Load {
            forces: self.shares.iter().map(|s| force * *s).collect(),
            prescribed: None,
        }
    }
}

fn wire(set: &MeasurementSet) -> Result<Vec<WiredExperiment>, Mistake> {
    let document = &set.document;
    let fail = |message: String| document.mistake(&(0..0), message);
    let solid = Solid::new(boundary_surface(&set.mesh)).map_err(|e| fail(format!("the specimen: {e}")))?;
    let locator = Locator::new(&set.mesh).map_err(|e| fail(e.to_string()))?;
    let (low, high) = set.bounds();
    let reach = REACH * (high - low).norm();
    let one = |experiment: &Experiment| {
        let fail = |message: String| fail(format!("example {:?}: {message}", experiment.name));
        let weights = |x: &Vec3| -> (f64, Vec<(usize, f64)>) {
            let held = locator.nearest(x);
            let nodes = held.nodes.iter().map(|&n| n as usize);
            (
                held.distance_mm,
                nodes.zip(held.weights.iter().copied()).collect(),
            )
        };
        let contact = &experiment.contact;
        let (shares, contact_point) = contact
            .shares(&solid, set.mesh.nodes.len(), |spot| Some(weights(spot).1))
            .map_err(|e| fail(e.to_string()))?;
        let mut sensors = Vec::new();
        let mut under_probe = Vec::new();
        for point in &experiment.points {
            let at_contact = point.place == contact.point;
            let place = if at_contact { contact_point } else { point.place };
            let (off, weights) = weights(&place);
            if off > reach {
                let message = format!(
                    "the marker at ({:.1}, {:.1}, {:.1}) mm lies {off:.1} mm off the specimen, which spans ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1}) mm: is the unit right, and do both share their origin?",
                    place.x, place.y, place.z, low.x, low.y, low.z, high.x, high.y, high.z
                );
                return Err(fail(message));
            }
            sensors.push(Sensor { weights });
            let from = place - contact_point;
            let along = from.dot(&contact.direction);
            let across = (from - contact.direction * along).norm();
            under_probe.push(across <= contact.radius_mm && along.abs() <= contact.radius_mm);
        }
        Ok(WiredExperiment {
            shares,
            contact_point,
            probe: Sensor {
                weights: weights(&contact_point).1,
            },
            sensors,
            under_probe,
        })
    };
    set.experiments.iter().map(one).collect()
}
