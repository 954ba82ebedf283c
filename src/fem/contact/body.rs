//! Rigid bodies that meet the object: probes that move, floors that stay, a bone that tissue slides on.
//!
//! A body never turns. Its translation is `c = s d + a`: the travel s along its direction d, which is prescribed or
//! follows from a force, and a prescribed way a across it. So a probe may be pressed by a force and dragged at the
//! same time.

use super::field::{DistanceField, FieldError};
use super::shape::{Distance, Pose, Shape, ShapeError, direction, finite};
use crate::geometry::solid::Solid;
use crate::math::Vec3;
use std::sync::Arc;

/// What resists sliding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// Nothing.
    Frictionless,
    /// Points that touch do not slide at all; they come off when pulled.
    Sticking,
    /// Coulomb's law: points slide where the tangential force exceeds the coefficient times the normal force.
    Coulomb {
        /// μ.
        coefficient: f64,
    },
}

/// Which way normal forces may act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bond {
    /// The body pushes and never pulls: a probe, a floor.
    Unilateral,
    /// Points keep the distance from the body that they have at the start, and slide: tissue on a skull.
    Bilateral,
}

/// A rigid body.
#[derive(Clone, Debug)]
pub struct RigidBody {
    /// Its shape.
    pub shape: Shape,
    /// Where it starts.
    pub pose: Pose,
    /// Unit vector that its travel and its force are counted along; towards the object for a probe.
    pub direction: Vec3,
    /// What resists sliding on it.
    pub friction: Friction,
    /// Push only, or push and pull.
    pub bond: Bond,
    /// Numbers of the contact points that it may meet, ascending; all if `None`.
    pub points: Option<Vec<u32>>,
}

/// How a body is moved along its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Push {
    /// Its travel from the start \[mm\].
    Travel(f64),
    /// The force that presses it along its direction \[N\], zero or more; the travel follows.
    Force(f64),
}

/// Where a body is wanted at a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Along its direction.
    pub push: Push,
    /// Way from the start, in addition \[mm\]; across the direction where a force presses.
    pub across_mm: Vec3,
}

/// Why a body is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// Its shape or pose.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// Its coefficient of friction.
    #[error(
        "the coefficient of friction is {coefficient}: expected a number from 0 to 10; \"sticking\" stands for more"
    )]
    Coefficient {
        /// What it was.
        coefficient: f64,
    },
    /// A point that the surface does not have.
    #[error("contact point {point} does not exist: the surface has {points}")]
    Point {
        /// Its number.
        point: u32,
        /// How many there are.
        points: usize,
    },
    /// A force that pulls, or that is no number.
    #[error("the force on a rigid body is {force_n} N: expected zero or more, along its direction")]
    Force {
        /// What it was \[N\].
        force_n: f64,
    },
    /// A level with another number of drives than there are bodies.
    #[error("level {level} moves {drives} rigid bodies, but there are {bodies}")]
    Drives {
        /// Number of the level, from 0.
        level: usize,
        /// Its drives.
        drives: usize,
        /// The bodies.
        bodies: usize,
    },
}

impl Drive {
    /// Stays where it started.
    pub const HELD: Drive = Drive {
        push: Push::Travel(0.0),
        across_mm: Vec3::new(0.0, 0.0, 0.0),
    };

    /// Travels `way_mm` along its direction.
    pub fn travel(way_mm: f64) -> Drive {
        Drive {
            push: Push::Travel(way_mm),
            ..Drive::HELD
        }
    }

    /// Is pressed along its direction.
    pub fn force(force_n: f64) -> Drive {
        Drive {
            push: Push::Force(force_n),
            ..Drive::HELD
        }
    }

    /// The same, moved by `way_mm` in addition.
    #[must_use]
    pub fn across(self, way_mm: Vec3) -> Drive {
        Drive {
            across_mm: way_mm,
            ..self
        }
    }

    pub(super) fn check(&self) -> Result<(), BodyError> {
        finite("way across", &self.across_mm)?;
        match self.push {
            Push::Travel(way) => finite("travel", &Vec3::new(way, 0.0, 0.0)).map(|_| ())?,
            Push::Force(force_n) => {
                if !(force_n >= 0.0 && force_n.is_finite()) {
                    return Err(BodyError::Force { force_n });
                }
            }
        }
        Ok(())
    }
}

impl RigidBody {
    /// A probe of the given shape; `direction` is any vector but zero.
    ///
    /// # Errors
    /// [`BodyError`] names the number that is out of range.
    pub fn probe(
        shape: Shape,
        pose: Pose,
        direction_of_push: Vec3,
        friction: Friction,
    ) -> Result<RigidBody, BodyError> {
        let body = RigidBody {
            direction: direction("direction of the push", &direction_of_push)?,
            shape,
            pose,
            friction,
            bond: Bond::Unilateral,
            points: None,
        };
        body.check(usize::MAX)?;
        Ok(body)
    }

    /// A flat floor or wall through `point` \[mm\] that looks along `normal`, towards the object; pressed, it moves that way.
    ///
    /// # Errors
    /// [`BodyError`] names the number that is out of range.
    pub fn floor(point: Vec3, normal: Vec3, friction: Friction) -> Result<RigidBody, BodyError> {
        RigidBody::probe(Shape::Plane, Pose::new(point, normal)?, normal, friction)
    }

    /// A closed surface as a body, where its file has it, or moved by `offset` \[mm\]; `spacing_mm` as in
    /// [`DistanceField::new`].
    ///
    /// # Errors
    /// [`BodyError`] names the number that is out of range.
    pub fn of_solid(
        solid: &Solid,
        spacing_mm: Option<f64>,
        offset: Vec3,
        direction_of_push: Vec3,
        friction: Friction,
    ) -> Result<RigidBody, BodyError> {
        let field = DistanceField::new(solid, spacing_mm).map_err(|e: FieldError| ShapeError::from(e))?;
        let shape = Shape::Mesh(Arc::new(field));
        RigidBody::probe(shape, Pose::at(offset)?, direction_of_push, friction)
    }

    /// The same, but it holds the given contact points at their distance from it, and lets them slide.
    #[must_use]
    pub fn holding(self, points: Vec<u32>) -> RigidBody {
        RigidBody {
            bond: Bond::Bilateral,
            points: Some(points),
            ..self
        }
    }

    /// # Errors
    /// [`BodyError`] names the first number out of range; `points` is how many contact points there are.
    pub fn check(&self, points: usize) -> Result<(), BodyError> {
        self.shape.check()?;
        finite("position", &self.pose.position)?;
        for column in self.pose.rotation.column_iter() {
            direction("axis", &column.into_owned())?;
        }
        direction("direction of the push", &self.direction)?;
        if let Friction::Coulomb { coefficient } = self.friction
            && !(0.0..=10.0).contains(&coefficient)
        {
            return Err(BodyError::Coefficient { coefficient });
        }
        match self.points.iter().flatten().find(|&&p| p as usize >= points) {
            Some(&point) => Err(BodyError::Point { point, points }),
            None => Ok(()),
        }
    }

    /// Distance of the place `x` \[mm\] from the body, translated by `translation` \[mm\].
    #[inline]
    pub fn distance(&self, translation: &Vec3, x: &Vec3) -> Distance {
        self.shape.distance_in_space(&self.pose, translation, x)
    }
}
