//! Shapes of rigid bodies as signed distances.
//!
//! ```text
//! φ(x) distance of x from the body's surface, negative inside;   n = ∇φ,  |n| = 1;   H = ∇²φ its curvature
//! rounded body:  φ = |max(q, 0)| + min(max_i q_i, 0) − e,   q = distance beyond the core, the body shrunk by e
//! solid of revolution:  H = (second derivatives of the profile) + (φ_ρ / ρ) e_θ ⊗ e_θ
//! ```
//!
//! Symbols: x place \[mm\], φ distance \[mm\], n outward normal, H \[1/mm\], e edge radius \[mm\], ρ distance from the axis
//! \[mm\]. Exact everywhere outside; inside, the distance of the nearest face, with a kink on the medial axis, far deeper
//! than any contact goes. Sources: Hart, Sphere tracing, The Visual Computer 12 (1996), for distances of primitives;
//! the Hessians are their derivatives.

use super::field::{DistanceField, FieldError};
use crate::math::{Mat3, Vec3};
use std::sync::Arc;

/// The shape of a rigid body in its own frame, whose z axis is the pose's axis.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A ball about the origin.
    Sphere {
        /// Its radius \[mm\].
        radius_mm: f64,
    },
    /// The flat end of a shaft: its face lies in z = 0 and looks along +z, the shaft goes to −z without end.
    Disc {
        /// Radius of the shaft \[mm\]; the flat part of the face ends `edge_mm` before it.
        radius_mm: f64,
        /// Radius of the rounded edge \[mm\], from zero to `radius_mm`.
        edge_mm: f64,
    },
    /// A solid cylinder about the z axis, the origin in its middle.
    Cylinder {
        /// Its radius \[mm\].
        radius_mm: f64,
        /// Its whole length \[mm\].
        length_mm: f64,
        /// Radius of its rounded edges \[mm\].
        edge_mm: f64,
    },
    /// A box, the origin in its middle.
    Cuboid {
        /// Its extents \[mm\].
        size_mm: Vec3,
        /// Radius of its rounded edges and corners \[mm\].
        edge_mm: f64,
    },
    /// Everything below z = 0: a floor or wall that looks along +z.
    Plane,
    /// A closed surface, as sampled on a grid around it.
    Mesh(Arc<DistanceField>),
}

/// Where a body is, and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Where the origin of the body's frame is \[mm\].
    pub position: Vec3,
    /// Turns the body's frame into space; its last column is the axis.
    pub rotation: Mat3,
}

/// Why a shape or a pose is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A length out of range.
    #[error("{field} is {value} mm: {expected}")]
    Length {
        /// Which length.
        field: &'static str,
        /// What it was \[mm\].
        value: f64,
        /// What it may be.
        expected: &'static str,
    },
    /// A vector with a coordinate that is not a finite number.
    #[error("{field} is ({x}, {y}, {z}): expected finite numbers")]
    NotFinite {
        /// Which vector.
        field: &'static str,
        /// Its coordinates.
        x: f64,
        /// Second coordinate.
        y: f64,
        /// Third coordinate.
        z: f64,
    },
    /// A direction of no length, or a second one along the first.
    #[error(
        "{field} is ({x}, {y}, {z}): expected a direction, neither zero nor along the axis; for instance 0, 0, −1 to press from above"
    )]
    NoDirection {
        /// Which direction.
        field: &'static str,
        /// Its coordinates.
        x: f64,
        /// Second coordinate.
        y: f64,
        /// Third coordinate.
        z: f64,
    },
    /// The surface has no distance field.
    #[error(transparent)]
    Field(#[from] FieldError),
}

/// Signed distance of a place with its first and second derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// φ \[mm\], negative inside.
    pub value: f64,
    /// ∇φ, the outward normal.
    pub gradient: Vec3,
    /// ∇²φ \[1/mm\].
    pub hessian: Mat3,
}

/// A vector whose coordinates are all finite.
///
/// # Errors
/// [`ShapeError::NotFinite`] names the `field`.
pub fn finite(field: &'static str, v: &Vec3) -> Result<Vec3, ShapeError> {
    if v.iter().all(|c| c.is_finite()) {
        return Ok(*v);
    }
    let [x, y, z] = (*v).into();
    Err(ShapeError::NotFinite { field, x, y, z })
}

/// A unit vector along `v`.
///
/// # Errors
/// [`ShapeError`] names the `field` if `v` is not finite or has no length.
pub fn direction(field: &'static str, v: &Vec3) -> Result<Vec3, ShapeError> {
    let v = finite(field, v)?;
    if v.norm() > 1e-9 {
        return Ok(v.normalize());
    }
    let [x, y, z] = v.into();
    Err(ShapeError::NoDirection { field, x, y, z })
}

impl Pose {
    /// At `position` \[mm\], the z axis of the body along `axis` (any length but zero); how it is turned about that axis
    /// does not matter to bodies of revolution and is left to chance.
    ///
    /// # Errors
    /// [`ShapeError`]: a coordinate that is not finite, an axis of no length.
    pub fn new(position: Vec3, axis: Vec3) -> Result<Pose, ShapeError> {
        let axis = direction("axis", &axis)?;
        let mut across = Vec3::zeros();
        across[axis.map(f64::abs).imin()] = 1.0;
        Pose::turned(position, axis, across)
    }

    /// The same with the x axis of the body as near to `across` as it can be: for boxes and meshes.
    ///
    /// # Errors
    /// [`ShapeError`]: a coordinate that is not finite, a direction of no length, or `across` along `axis`.
    pub fn turned(position: Vec3, axis: Vec3, across: Vec3) -> Result<Pose, ShapeError> {
        let position = finite("position", &position)?;
        let z = direction("axis", &axis)?;
        let across = finite("across", &across)?;
        let x = direction("across", &(across - z * across.dot(&z)))?;
        let rotation = Mat3::from_columns(&[x, z.cross(&x), z]);
        Ok(Pose { position, rotation })
    }

    /// At `position`, not turned.
    ///
    /// # Errors
    /// [`ShapeError::NotFinite`].
    pub fn at(position: Vec3) -> Result<Pose, ShapeError> {
        Pose::new(position, Vec3::z()).map(|p| Pose {
            rotation: Mat3::identity(),
            ..p
        })
    }
}

impl Shape {
    /// # Errors
    /// [`ShapeError`] names the first length out of range.
    pub fn check(&self) -> Result<(), ShapeError> {
        match *self {
            Shape::Sphere { radius_mm } => positive("radius", radius_mm),
            Shape::Disc { radius_mm, edge_mm } => {
                positive("radius", radius_mm)?;
                edge(edge_mm, radius_mm)
            }
            Shape::Cylinder {
                radius_mm,
                length_mm,
                edge_mm,
            } => {
                positive("radius", radius_mm)?;
                positive("length", length_mm)?;
                edge(edge_mm, radius_mm.min(0.5 * length_mm))
            }
            Shape::Cuboid { size_mm, edge_mm } => {
                for length in size_mm.iter() {
                    positive("size", *length)?;
                }
                edge(edge_mm, 0.5 * size_mm.min())
            }
            Shape::Plane | Shape::Mesh(_) => Ok(()),
        }
    }

    /// How deep inside a place can be \[mm\]; infinite for a plane and a shaft. A body that moves half as far at
    /// a time cannot jump over a point.
    pub fn depth_mm(&self) -> f64 {
        match self {
            Shape::Sphere { radius_mm } => *radius_mm,
            Shape::Disc { .. } | Shape::Plane => f64::INFINITY,
            Shape::Cylinder {
                radius_mm, length_mm, ..
            } => radius_mm.min(0.5 * length_mm),
            Shape::Cuboid { size_mm, .. } => 0.5 * size_mm.min(),
            Shape::Mesh(field) => field.depth_mm(),
        }
    }

    /// Distance of `x` \[mm\], in the body's frame.
    pub fn distance(&self, x: &Vec3) -> Distance {
        match self {
            Shape::Sphere { radius_mm } => sphere(x, *radius_mm),
            Shape::Disc { radius_mm, edge_mm } => of_revolution(x, *radius_mm, *edge_mm, x.z + edge_mm, 1.0),
            Shape::Cylinder {
                radius_mm,
                length_mm,
                edge_mm,
            } => {
                let beyond = x.z.abs() - (0.5 * length_mm - edge_mm);
                of_revolution(x, *radius_mm, *edge_mm, beyond, 1f64.copysign(x.z))
            }
            Shape::Cuboid { size_mm, edge_mm } => cuboid(x, size_mm, *edge_mm),
            Shape::Plane => Distance {
                value: x.z,
                gradient: Vec3::z(),
                hessian: Mat3::zeros(),
            },
            Shape::Mesh(field) => field.distance(x),
        }
    }

    /// Distance of `x` \[mm\] in space from the body in `pose`, moved by `translation` \[mm\].
    pub fn distance_in_space(&self, pose: &Pose, translation: &Vec3, x: &Vec3) -> Distance {
        let own = self.distance(&pose.rotation.tr_mul(&(x - pose.position - translation)));
        Distance {
            value: own.value,
            gradient: pose.rotation * own.gradient,
            hessian: pose.rotation * own.hessian * pose.rotation.transpose(),
        }
    }
}

fn positive(field: &'static str, value: f64) -> Result<(), ShapeError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(ShapeError::Length {
        field,
        value,
        expected: "expected a length above zero",
    })
}

fn edge(value: f64, most: f64) -> Result<(), ShapeError> {
    if (0.0..=most).contains(&value) {
        return Ok(());
    }
    Err(ShapeError::Length {
        field: "edge radius",
        value,
        expected: "expected zero or more, and no more than the radius and half the shortest side",
    })
}

fn sphere(x: &Vec3, radius: f64) -> Distance {
    let r = x.norm();
    // In the very middle every direction is outward.
    let n = if r > 0.0 { x / r } else { Vec3::z() };
    Distance {
        value: r - radius,
        gradient: n,
        hessian: (Mat3::identity() - n * n.transpose()) / r.max(1e-3 * radius),
    }
}

/// A rounded solid of revolution about z: `beyond` is how far x lies past the core's end, on the side `sign`.
fn of_revolution(x: &Vec3, radius: f64, edge: f64, beyond: f64, sign: f64) -> Distance {
    let rho = x.x.hypot(x.y);
    let outward = if rho > 0.0 {
        Vec3::new(x.x / rho, x.y / rho, 0.0)
    } else {
        Vec3::x()
    };
    let along = Vec3::z() * sign;
    let aside = rho - (radius - edge);
    if aside > 0.0 && beyond > 0.0 {
        let r = aside.hypot(beyond);
        let (s, c) = (aside / r, beyond / r);
        let n = outward * s + along * c;
        let profile = outward * c - along * s;
        let around = Vec3::z().cross(&outward);
        // On the axis of a round end φ_ρ / ρ has the limit 1/r.
        let hoop = if rho > 1e-12 * radius { s / rho } else { 1.0 / r };
        return Distance {
            value: r - edge,
            gradient: n,
            hessian: profile * profile.transpose() / r + around * around.transpose() * hoop,
        };
    }
    if aside > beyond {
        let around = Vec3::z().cross(&outward);
        return Distance {
            value: aside - edge,
            gradient: outward,
            hessian: around * around.transpose() / rho.max(1e-3 * radius),
        };
    }
    Distance {
        value: beyond - edge,
        gradient: along,
        hessian: Mat3::zeros(),
    }
}

fn cuboid(x: &Vec3, size: &Vec3, edge: f64) -> Distance {
    let q = x.abs() - (size * 0.5).add_scalar(-edge);
    let sign = x.map(|c| 1f64.copysign(c));
    let positive = q.map(|c| c.max(0.0));
    let r = positive.norm();
    if r > 0.0 {
        let n = (positive / r).component_mul(&sign);
        let free = Mat3::from_diagonal(&q.map(|c| f64::from(c > 0.0)));
        return Distance {
            value: r - edge,
            gradient: n,
            hessian: (free - n * n.transpose()) / r,
        };
    }
    let nearest = q.imax();
    let mut n = Vec3::zeros();
    n[nearest] = sign[nearest];
    Distance {
        value: q[nearest] - edge,
        gradient: n,
        hessian: Mat3::zeros(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> Vec<Shape> {
        vec![
            Shape::Sphere { radius_mm: 3.0 },
            Shape::Disc {
                radius_mm: 3.0,
                edge_mm: 0.7,
            },
            Shape::Disc {
                radius_mm: 3.0,
                edge_mm: 3.0,
            },
            Shape::Cylinder {
                radius_mm: 2.0,
                length_mm: 5.0,
                edge_mm: 0.4,
            },
            Shape::Cuboid {
                size_mm: Vec3::new(3.0, 4.0, 5.0),
                edge_mm: 0.5,
            },
            Shape::Plane,
        ]
    }

    fn places() -> impl Iterator<Item = Vec3> {
        (0..400).map(|k| {
            let t = f64::from(k);
            4.0 * Vec3::new((1.3 * t).sin(), (2.1 * t).cos(), (0.7 * t + 0.3).sin())
        })
    }

    /// Central differences at a step of 1e-5 leave 1e-9 of rounding and truncation; kinks of the medial axis are left out.
    #[test]
    fn gradient_and_hessian_are_derivatives_of_the_distance() {
        const STEP: f64 = 1e-5;
        for shape in shapes() {
            let mut checked = 0;
            for x in places() {
                let d = shape.distance(&x);
                let mut smooth = true;
                let (mut slope, mut curvature) = (Vec3::zeros(), Mat3::zeros());
                for c in 0..3 {
                    let mut step = Vec3::zeros();
                    step[c] = STEP;
                    let (ahead, behind) = (shape.distance(&(x + step)), shape.distance(&(x - step)));
                    slope[c] = (ahead.value - behind.value) / (2.0 * STEP);
                    smooth &= (ahead.gradient - behind.gradient).norm() < 1e-2;
                    smooth &= (ahead.hessian - behind.hessian).norm() < 1e-2;
                    curvature.set_column(c, &((ahead.gradient - behind.gradient) / (2.0 * STEP)));
                }
                if !smooth || d.value < -1.5 {
                    continue;
                }
                checked += 1;
                assert!((d.gradient.norm() - 1.0).abs() < 1e-12, "{shape:?} {x:?}");
                assert!((slope - d.gradient).norm() < 1e-8, "{shape:?} {x:?}");
                assert!(
                    (curvature - d.hessian).norm() < 1e-6,
                    "{shape:?} {x:?} {curvature} {}",
                    d.hessian
                );
            }
            assert!(checked > 100, "{shape:?}: only {checked} places checked");
        }
    }

    /// Values by hand: above the face, beside the shaft, past the edge.
    #[test]
    fn distances_by_hand() {
        let disc = Shape::Disc {
            radius_mm: 3.0,
            edge_mm: 1.0,
        };
        assert!((disc.distance(&Vec3::new(1.0, 0.0, 0.5)).value - 0.5).abs() < 1e-15);
        assert!((disc.distance(&Vec3::new(0.0, 5.0, -4.0)).value - 2.0).abs() < 1e-15);
        // The edge's circle has its middle at (2, −1): 3-4-5 from there.
        assert!((disc.distance(&Vec3::new(5.0, 0.0, 3.0)).value - 4.0).abs() < 1e-15);
        let turned = Pose::new(Vec3::new(0.0, 0.0, 10.0), -Vec3::z()).unwrap();
        let below = disc.distance_in_space(&turned, &Vec3::new(0.0, 0.0, -2.0), &Vec3::new(1.0, 1.0, 7.5));
        assert!((below.value - 0.5).abs() < 1e-15);
        assert!((below.gradient + Vec3::z()).norm() < 1e-15);
        let cuboid = Shape::Cuboid {
            size_mm: Vec3::new(2.0, 2.0, 2.0),
            edge_mm: 0.0,
        };
        assert!((cuboid.distance(&Vec3::new(2.0, 3.0, 3.0)).value - 3.0).abs() < 1e-15);
        assert!((cuboid.distance(&Vec3::new(0.2, -0.9, 0.0)).value + 0.1).abs() < 1e-15);
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let refused = |shape: Shape, text: &str| {
            let error = shape.check().unwrap_err().to_string();
            assert!(error.contains(text), "{error}");
        };
        refused(Shape::Sphere { radius_mm: 0.0 }, "radius is 0 mm");
        refused(Shape::Sphere { radius_mm: f64::NAN }, "radius is NaN");
        refused(
            Shape::Disc {
                radius_mm: 1.0,
                edge_mm: 2.0,
            },
            "edge radius is 2 mm",
        );
        assert!(Pose::new(Vec3::new(f64::NAN, 0.0, 0.0), Vec3::z()).is_err());
        assert!(Pose::new(Vec3::zeros(), Vec3::zeros()).is_err());
        assert!(Pose::turned(Vec3::zeros(), Vec3::z(), Vec3::z()).is_err());
    }
}
