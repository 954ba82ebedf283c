//! Small dense algebra that every floor above shares: three-dimensional vectors and matrices.
//!
//! Rooms: [`mandel`] (symmetric tensors as 6-vectors), [`polar`] (rotation and stretch), [`rbf`] and [`multiquadric`]
//! (radial basis functions), [`normal`] (seeded random numbers); of eight numbers at once: [`polar_lanes`], [`exponential`], [`roots`].

pub mod exponential;
pub mod mandel;
pub mod multiquadric;
pub mod normal;
pub mod polar;
pub mod polar_lanes;
pub mod rbf;
pub mod roots;

/// A point, displacement or force in space, `(3)`.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A second-order tensor in space, `(3 × 3)`.
pub type Mat3 = nalgebra::Matrix3<f64>;
