//! What a solve is given and what it answers: the load and the options, the curve, why it ended and what it cost.
//! [`super::equilibrium`] solves.

use crate::math::Vec3;

/// The matrix of Newton's iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NewtonMatrix {
    /// The derivative of the internal forces.
    #[default]
    Tangent,
    /// Its symmetric part, which costs no inner iterations and converges linearly where a law has no energy.
    SymmetricPart,
}

/// How to solve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// A state is in equilibrium when the residual force is below this share of the load, and the next step below this
    /// share of the largest displacement. Default 1e-8.
    pub tolerance: f64,
    /// Most Anderson iterations of one level before Newton takes over. Default 40; 0 for Newton alone.
    pub accelerated_iterations: usize,
    /// Most Newton iterations of one level. Default 30.
    pub newton_iterations: usize,
    /// The matrix of Newton's iteration. Default [`NewtonMatrix::Tangent`].
    pub newton_matrix: NewtonMatrix,
    /// How often a load increment may be halved. Default 6.
    pub halvings: usize,
    /// Least fill of an integration point whose inversion counts: a corner that is mostly outside the object may fold.
    /// Default 0.25.
    pub least_fill: f64,
}

impl Options {
    /// For searches, which meet many layouts that no load curve can be found for: gives up early. A layout that needs
    /// smaller increments than a half is not worth building.
    pub fn for_search(tolerance: f64) -> Options {
        Options {
            tolerance,
            accelerated_iterations: 40,
            newton_iterations: 6,
            halvings: 1,
            ..Options::default()
        }
    }
}

impl Default for Options {
    fn default() -> Options {
        Options {
            tolerance: 1e-8,
            accelerated_iterations: 40,
            newton_iterations: 30,
            newton_matrix: NewtonMatrix::Tangent,
            halvings: 6,
            least_fill: 0.25,
        }
    }
}

/// An option outside its range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("solver option {field} is {value}: {expected}")]
pub struct BadOption {
    /// Name of the option.
    pub field: &'static str,
    /// What it was set to.
    pub value: f64,
    /// What it may be.
    pub expected: &'static str,
}

impl Options {
    /// # Errors
    /// [`BadOption`] names the first field outside its range.
    pub fn check(&self) -> Result<(), BadOption> {
        if !(1e-14..=1e-1).contains(&self.tolerance) {
            let expected = "between 1e-14 and 0.1";
            return Err(BadOption {
                field: "tolerance",
                value: self.tolerance,
                expected,
            });
        }
        if !(0.0..=1.0).contains(&self.least_fill) {
            let expected = "between 0 and 1";
            return Err(BadOption {
                field: "least_fill",
                value: self.least_fill,
                expected,
            });
        }
        if self.newton_iterations == 0 {
            return Err(BadOption {
                field: "newton_iterations",
                value: 0.0,
                expected: "at least 1",
            });
        }
        Ok(())
    }
}

/// A load at factor 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// Force on each node, `(nodes)` \[N\].
    pub forces: Vec<Vec3>,
    /// Displacement of each node's constrained components, `(nodes)` \[mm\]; other components are ignored.
    pub prescribed: Option<Vec<Vec3>>,
}

/// Why a curve ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// Every level is in equilibrium.
    Converged,
    /// The iterations did not arrive, however small the increment.
    NotConverged,
    /// The load can hardly grow: the object buckles, snaps or gives in.
    LimitPoint {
        /// The stiffness along the load at the last equilibrium, as a share of that at rest; zero if indefinite.
        stiffness: f64,
    },
    /// The interpolated stiffness of a material is not positive definite at the strain that an element would have.
    Indefinite {
        /// Number of the element, from 0.
        element: usize,
        /// Its first node in the undeformed object \[mm\].
        place: Vec3,
    },
    /// The next state would turn an element inside out.
    Inverted {
        /// Number of the element, from 0.
        element: usize,
        /// Its first node in the undeformed object \[mm\].
        place: Vec3,
    },
    /// The stiffness at rest has no Cholesky factor: the object is not held, or a material is not stable.
    Unstable,
    /// A caller asked to stop.
    Cancelled,
}

impl std::fmt::Display for Stop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Stop::Converged => write!(f, "in equilibrium at every level"),
            Stop::NotConverged => write!(f, "no equilibrium found beyond this load"),
            Stop::LimitPoint { stiffness } => write!(
                f,
                "limit point: the load can hardly grow beyond this, the stiffness along it is down to {:.1} % of that at rest",
                100.0 * stiffness
            ),
            Stop::Indefinite { element, place } => write!(
                f,
                "the interpolated stiffness is not positive definite in element {element} near ({:.1}, {:.1}, {:.1}) mm beyond this load: fit the material over larger strains, or with a form that cannot lose it",
                place.x, place.y, place.z
            ),
            Stop::Inverted { element, place } => write!(
                f,
                "element {element} near ({:.1}, {:.1}, {:.1}) mm would turn inside out beyond this load",
                place.x, place.y, place.z
            ),
            Stop::Unstable => write!(
                f,
                "the stiffness at rest is not positive definite: is the object held?"
            ),
            Stop::Cancelled => write!(f, "stopped on request"),
        }
    }
}

/// Counts of the solver's work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Work {
    /// Anderson iterations.
    pub accelerated_iterations: usize,
    /// Newton iterations.
    pub newton_iterations: usize,
    /// Iterations for the skew part of the tangent.
    pub linear_iterations: usize,
    /// Numeric factorisations.
    pub factorisations: usize,
    /// Evaluations of the internal forces.
    pub residuals: usize,
    /// Load increments that were halved.
    pub halvings: usize,
}

/// What a load curve came to.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Displacements at every level that was reached, each `(nodes)` \[mm\].
    pub levels: Vec<Vec<Vec3>>,
    /// Why it ended.
    pub stop: Stop,
    /// The last load factor in equilibrium; between two levels where increments were halved.
    pub reached: f64,
    /// Residual force of the last level, as a share of the load.
    pub residual: f64,
    /// What it cost.
    pub work: Work,
}
