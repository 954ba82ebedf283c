//! Force–displacement examples: how an object gives under a known force.
//!
//! An example is one place where a probe presses, a series of forces, and what was measured at each: displacements of
//! points of the surface, whole vectors or one direction of them (a probe's own path is the displacement of the contact
//! point along the force). Fitting and design share it.

use crate::geometry::grid::{Grid, Place};
use crate::geometry::ray;
use crate::geometry::solid::Solid;
use crate::math::Vec3;

use super::elements::trilinear;

/// A rigid, frictionless disc that presses with an even pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Middle of the patch, on or near the surface \[mm\].
    pub point: Vec3,
    /// Direction of the force, a unit vector.
    pub direction: Vec3,
    /// Radius of the patch \[mm\].
    pub radius_mm: f64,
}

/// A point of the surface with what was measured there.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredPoint {
    /// Where the point is in the undeformed object \[mm\].
    pub place: Vec3,
    /// The measured directions, unit vectors: one, or x, y and z.
    pub directions: Vec<Vec3>,
    /// Displacement along each direction at each force, `(forces × directions)` \[mm\]; `None` where a marker was lost.
    pub displacements_mm: Vec<Vec<Option<f64>>>,
}

/// One place where an object was pressed.
#[derive(Clone, Debug, PartialEq)]
pub struct Example {
    /// Its name, as the reports show it.
    pub name: String,
    /// Where and how it was pressed.
    pub contact: Contact,
    /// The forces, ascending \[N\].
    pub forces_n: Vec<f64>,
    /// What was measured.
    pub points: Vec<MeasuredPoint>,
    /// How far a displacement may be off without counting as an error, `(points × forces)` \[mm\]; 0 where nothing is allowed.
    pub tolerances_mm: Vec<Vec<f64>>,
    /// Where the displacements come from: a measurement, or a simulation that is named.
    pub origin: String,
}

impl Example {
    /// The measured point that moves most along the force at the largest force: the one that tells most of how the object
    /// gives. `None` where no point has all its components there.
    pub fn telling_point(&self) -> Option<usize> {
        let last = self.forces_n.len().checked_sub(1)?;
        let give = |p: &usize| self.along(*p, last);
        (0..self.points.len())
            .filter(|p| give(p).is_some())
            .max_by(|a, b| {
                let (of_a, of_b) = (give(a).unwrap_or(0.0), give(b).unwrap_or(0.0));
                of_a.total_cmp(&of_b).then(b.cmp(a))
            })
    }

    /// Measured displacement of a point along the force at level `force` \[mm\]; `None` where a component that it needs was
    /// lost.
    pub fn along(&self, point: usize, force: usize) -> Option<f64> {
        let point = &self.points[point];
        let measured = point.directions.iter().zip(&point.displacements_mm[force]);
        measured
            .map(|(d, x)| (d.dot(&self.contact.direction), x))
            .filter(|(share, _)| share.abs() > 1e-9)
            .map(|(share, x)| Some((*x)? * share))
            .sum()
    }
}

/// Why a contact cannot act on an object.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ContactError {
    /// The patch lies beside the object.
    #[error(
        "the contact at ({x:.1}, {y:.1}, {z:.1}) mm, radius {radius_mm} mm, meets the object with {percent:.0} % of its area; the object spans ({lx:.1}, {ly:.1}, {lz:.1}) to ({hx:.1}, {hy:.1}, {hz:.1}) mm: move the point onto the surface",
        x = point.x, y = point.y, z = point.z, lx = low.x, ly = low.y, lz = low.z, hx = high.x, hy = high.y, hz = high.z
    )]
    BesideTheObject {
        /// Middle of the patch \[mm\].
        point: Vec3,
        /// Its radius \[mm\].
        radius_mm: f64,
        /// Share of the patch that meets the object, percent.
        percent: f64,
        /// Lower corner of the object's bounds \[mm\].
        low: Vec3,
        /// Upper corner \[mm\].
        high: Vec3,
    },
}

/// Points that stand for the patch's area. Vogel's spiral: each stands for an equal share.
const SPOTS: usize = 500;
/// Least share of a patch that must meet the object.
const LEAST_SHARE: f64 = 0.5;

impl Contact {
    /// Force on each node, `(nodes)`, for a total force of 1 N; and the contact point moved onto the surface.
    ///
    /// # Errors
    /// [`ContactError`] if less than half of the patch meets the object.
    pub fn unit_load(&self, solid: &Solid, grid: &Grid) -> Result<(Vec<Vec3>, Vec3), ContactError> {
        let locate = |spot: &Vec3| grid.locate(spot).map(|place| Sensor::nodes(grid, &place));
        let (shares, middle) = self.shares(solid, grid.mesh.nodes.len(), locate)?;
        Ok((shares.iter().map(|s| self.direction * *s).collect(), middle))
    }

    /// Share of each node, `(nodes)`, in a force that is spread evenly over the patch; and the contact point moved onto the
    /// surface. `locate` answers a point with its nodes and their shape functions' values.
    ///
    /// # Errors
    /// [`ContactError`] if less than half of the patch meets the object.
    pub fn shares(
        &self,
        solid: &Solid,
        nodes: usize,
        locate: impl Fn(&Vec3) -> Option<Vec<(usize, f64)>>,
    ) -> Result<(Vec<f64>, Vec3), ContactError> {
        let spots = self.spots(solid);
        let share = spots.len() as f64 / SPOTS as f64;
        let Some(middle) = self
            .surface_point(solid, &Vec3::zeros())
            .filter(|_| share >= LEAST_SHARE)
        else {
            let (low, high) = solid.bounds();
            let percent = 100.0 * share;
            return Err(ContactError::BesideTheObject {
                point: self.point,
                radius_mm: self.radius_mm,
                percent,
                low,
                high,
            });
        };
        let mut shares = vec![0.0; nodes];
        for spot in &spots {
            for (node, weight) in locate(spot).unwrap_or_default() {
                shares[node] += weight / spots.len() as f64;
            }
        }
        Ok((shares, middle))
    }

    /// Points of the surface under the patch \[mm\].
    pub fn spots(&self, solid: &Solid) -> Vec<Vec3> {
        let first = self.direction.cross(&least_axis(&self.direction)).normalize();
        let second = self.direction.cross(&first);
        let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
        (0..SPOTS)
            .filter_map(|k| {
                let r = self.radius_mm * ((k as f64 + 0.5) / SPOTS as f64).sqrt();
                let (sin, cos) = (golden * k as f64).sin_cos();
                self.surface_point(solid, &(first * (r * cos) + second * (r * sin)))
            })
            .collect()
    }

    /// The place where the line along the force through `point + offset` enters the object, the nearest one to the plane of
    /// the patch.
    fn surface_point(&self, solid: &Solid, offset: &Vec3) -> Option<Vec3> {
        let origin = self.point + offset;
        let hits = ray::hits(solid.mesh(), &origin, &self.direction);
        let reach = 2.0 * self.radius_mm + 20.0;
        let nearest = hits
            .iter()
            .filter(|h| h.enters && h.distance.abs() <= reach)
            .min_by(|a, b| a.distance.abs().total_cmp(&b.distance.abs()))?;
        Some(origin + self.direction * nearest.distance)
    }
}

fn least_axis(direction: &Vec3) -> Vec3 {
    let mut axis = Vec3::zeros();
    axis[direction.map(f64::abs).imin()] = 1.0;
    axis
}

/// A point of the object whose displacement is read from the nodes around it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Nodes with their shape functions' values.
    pub weights: Vec<(usize, f64)>,
}

impl Sensor {
    /// The sensor at `place`; `None` if the grid holds nothing near it.
    pub fn at(grid: &Grid, place: &Vec3) -> Option<Sensor> {
        Some(Sensor {
            weights: Self::nodes(grid, &grid.locate(place)?),
        })
    }

    fn nodes(grid: &Grid, place: &Place) -> Vec<(usize, f64)> {
        let nodes = grid.mesh.elements.nodes_of(place.element);
        let values = trilinear(&place.reference);
        nodes.iter().zip(values).map(|(&n, v)| (n as usize, v)).collect()
    }

    /// Displacement of the point, given the nodes', `(nodes)` \[mm\].
    #[inline]
    pub fn read(&self, u: &[Vec3]) -> Vec3 {
        self.weights.iter().map(|&(n, w)| u[n] * w).sum()
    }
}
