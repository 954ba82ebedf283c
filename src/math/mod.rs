//! Small dense algebra that every floor above shares: three-dimensional vectors and matrices, and symmetric tensors in
//! Mandel notation. Rooms: [`mandel`], [`rbf`].

pub mod mandel;
pub mod rbf;

/// A point, displacement or force in space, `(3)`.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A second-order tensor in space, `(3 × 3)`.
pub type Mat3 = nalgebra::Matrix3<f64>;
