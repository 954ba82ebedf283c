//! What a simulation with contact is given and answers: options, levels, forces, areas and pressures of every body.

use super::body::{BodyError, Drive};
use super::law::Status;
use crate::fem::load_curve::{BadOption, Stop, Work};
use crate::math::Vec3;
use crate::numerics::cholesky::CholeskyError;

/// How to solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactOptions {
    /// A state is in equilibrium when the residual force is below this share of loads, reactions and contact forces.
    /// Default 1e-8.
    pub tolerance: f64,
    /// Largest penetration, and largest slip where points stick, as a share of the distance between contact points.
    /// Default 1e-6.
    pub penetration: f64,
    /// Stiffness of the penalty, as a multiple of the object's own at the point. Changes the work, not the answer.
    /// Default 30.
    pub penalty: f64,
    /// Most Newton iterations of one increment. Default 60.
    pub newton_iterations: usize,
    /// How often an increment may be halved. Default 8.
    pub halvings: usize,
    /// Least fill of an integration point whose inversion counts. Default 0.25.
    pub least_fill: f64,
    /// Springs from every node to where it was at the last equilibrium, as a share of the object's own stiffness: for an
    /// object that nothing but its contacts holds ([`crate::fem::model::Model::unheld`]), where 1e-6 is enough. Default 0.
    pub anchor: f64,
}

impl Default for ContactOptions {
    fn default() -> ContactOptions {
        ContactOptions {
            tolerance: 1e-8,
            penetration: 1e-6,
            penalty: 30.0,
            newton_iterations: 60,
            halvings: 8,
            least_fill: 0.25,
            anchor: 0.0,
        }
    }
}

impl ContactOptions {
    /// # Errors
    /// [`BadOption`] names the first field outside its range.
    pub fn check(&self) -> Result<(), BadOption> {
        let within = |field, value: f64, low: f64, high: f64, expected| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            Err(BadOption {
                field,
                value,
                expected,
            })
        };
        let (small, ratio) = ("between 1e-14 and 0.1", "between 0.1 and 1e6");
        within("tolerance", self.tolerance, 1e-14, 1e-1, small)?;
        within("penetration", self.penetration, 1e-14, 1e-1, small)?;
        within("penalty", self.penalty, 0.1, 1e6, ratio)?;
        within("least_fill", self.least_fill, 0.0, 1.0, "between 0 and 1")?;
        within("anchor", self.anchor, 0.0, 1e-2, "between 0 and 0.01")?;
        let iterations = self.newton_iterations as f64;
        within("newton_iterations", iterations, 1.0, 1e6, "at least 1")
    }
}

/// Why a simulation with contact cannot start.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BadContact {
    /// A body, or where it is wanted.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// An option.
    #[error(transparent)]
    Option(#[from] BadOption),
    /// The matrix does not fit in memory.
    #[error(transparent)]
    Cholesky(#[from] CholeskyError),
    /// The object has no contact points.
    #[error("no point of the object can touch a rigid body: its surface has no contact points that can move")]
    NoPoints,
    /// Loads that are not for this object, or hold no finite numbers.
    #[error("the load has {found} nodal vectors for {nodes} nodes, or a number that is not finite")]
    Load {
        /// How many vectors.
        found: usize,
        /// How many nodes.
        nodes: usize,
    },
}

/// What is wanted at one moment of the simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Factor of the nodal forces and of the prescribed displacements.
    pub load_factor: f64,
    /// Where each body is wanted, `(bodies)`.
    pub drives: Vec<Drive>,
}

/// One point that touches a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointContact {
    /// Number of the contact point.
    pub point: u32,
    /// Where it is \[mm\].
    pub place: Vec3,
    /// Force of the body on the object there \[N\].
    pub force_n: Vec3,
    /// Normal force over the deformed area that the point stands for \[MPa\].
    pub pressure_mpa: f64,
    /// Deformed area that it stands for \[mm²\].
    pub area_mm2: f64,
    /// Gap, negative for penetration \[mm\].
    pub gap_mm: f64,
    /// Smooth, stuck or sliding.
    pub status: Status,
}

/// What one body does to the object.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyContact {
    /// Its travel along its direction \[mm\].
    pub travel_mm: f64,
    /// Its whole translation from the start \[mm\].
    pub translation_mm: Vec3,
    /// Force on the object \[N\].
    pub force_n: Vec3,
    /// Moment on the object about the body's present position \[N mm\].
    pub moment_n_mm: Vec3,
    /// Area of the points that touch, deformed \[mm²\].
    pub area_mm2: f64,
    /// Deepest penetration of a point \[mm\], zero or more.
    pub penetration_mm: f64,
    /// The points that touch.
    pub points: Vec<PointContact>,
}

impl BodyContact {
    /// The largest pressure \[MPa\].
    pub fn largest_pressure_mpa(&self) -> f64 {
        self.points.iter().map(|p| p.pressure_mpa).fold(0.0, f64::max)
    }

    /// The mean pressure, normal force over area \[MPa\]; zero without contact.
    pub fn mean_pressure_mpa(&self) -> f64 {
        let normal: f64 = self.points.iter().map(|p| p.pressure_mpa * p.area_mm2).sum();
        if self.area_mm2 > 0.0 {
            normal / self.area_mm2
        } else {
            0.0
        }
    }
}

/// The object in equilibrium at one level.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactLevel {
    /// Displacements, `(nodes)` \[mm\].
    pub displacements: Vec<Vec3>,
    /// What each body does, `(bodies)`.
    pub bodies: Vec<BodyContact>,
    /// Residual force as a share of loads, reactions and contact forces.
    pub residual: f64,
}

/// What a simulation came to.
#[derive(Clone, Debug)]
pub struct ContactCurve {
    /// The levels that were reached.
    pub levels: Vec<ContactLevel>,
    /// Why it ended.
    pub stop: Stop,
    /// How far it came: whole levels and the share of the next one.
    pub reached: f64,
    /// What it cost.
    pub work: Work,
}
