//! Parts of space, as level sets: negative inside, zero on the boundary, positive outside.

use super::axis::Axis;
use super::solid::Solid;
use crate::math::Vec3;
use std::sync::Arc;

/// A part of space.
#[derive(Clone, Debug)]
pub enum Region {
    /// All points between two corners \[mm\].
    Box { min: Vec3, max: Vec3 },
    /// A cylinder around a line parallel to `axis`, through `centre`, the two other coordinates in cyclic order
    /// (x → (y, z), y → (z, x), z → (x, y)), with `range` along the axis. All in mm.
    Cylinder {
        axis: Axis,
        centre: [f64; 2],
        radius: f64,
        range: [f64; 2],
    },
    /// The inside of a solid.
    Mesh(Arc<Solid>),
    /// All of space.
    Everything,
}

/// The level of [`Region::Everything`] \[mm\]: deeper inside than any object is large, and finite, so that levels can still be
/// added and interpolated.
pub const DEEP: f64 = -1e6;

impl Region {
    /// Whether `point` \[mm\] lies inside; the rims of boxes and cylinders belong to them.
    pub fn contains(&self, point: &Vec3) -> bool {
        match self {
            Region::Mesh(solid) => solid.contains(point),
            _ => self.level(point) <= 0.0,
        }
    }

    /// The signed distance of `point` \[mm\] from the region's boundary, negative inside. It is exact, but for solids with
    /// holes ([`Solid::signed_distance`]).
    pub fn level(&self, point: &Vec3) -> f64 {
        match self {
            Region::Box { min, max } => {
                let beyond = (min - point).sup(&(point - max));
                outside_and_inside(&[beyond.x, beyond.y, beyond.z])
            }
            Region::Cylinder {
                axis,
                centre,
                radius,
                range,
            } => {
                let (i, j) = axis.others();
                let along = point[axis.index()];
                let sideways = (point[i] - centre[0]).hypot(point[j] - centre[1]) - radius;
                outside_and_inside(&[sideways, (range[0] - along).max(along - range[1])])
            }
            Region::Mesh(solid) => solid.signed_distance(point),
            Region::Everything => DEEP,
        }
    }
}

/// The signed distance from a set that is the product of slabs, from the signed distances to each slab: outside by
/// Pythagoras over those that are positive, inside the nearest one.
fn outside_and_inside(slabs: &[f64]) -> f64 {
    let outside = slabs.iter().map(|d| d.max(0.0).powi(2)).sum::<f64>().sqrt();
    let nearest = slabs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if nearest > 0.0 { outside } else { nearest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn regions() -> Vec<Region> {
        let block = crate::geometry::shapes::block(Vec3::new(20.0, 10.0, 6.0), 2.0).unwrap();
        vec![
            Region::Box {
                min: Vec3::zeros(),
                max: Vec3::new(20.0, 10.0, 6.0),
            },
            Region::Cylinder {
                axis: Axis::Y,
                centre: [3.0, 10.0],
                radius: 5.0,
                range: [0.0, 10.0],
            },
            Region::Mesh(Arc::new(Solid::new(block).unwrap())),
            Region::Everything,
        ]
    }

    #[test]
    fn levels_are_distances() {
        let [cube, cylinder, mesh, everything] = regions().try_into().unwrap();
        // 3-4-5 triangles from an edge of the box; 1 mm below its top; beside the cylinder around (z, x) = (3, 10).
        for (region, point, level) in [
            (&cube, [23.0, 14.0, 3.0], 5.0),
            (&cube, [10.0, 5.0, 5.0], -1.0),
            (&mesh, [23.0, 14.0, 3.0], 5.0),
            (&mesh, [10.0, 5.0, 5.0], -1.0),
            (&cylinder, [10.0, 5.0, 11.0], 3.0),
            (&cylinder, [18.0, 14.0, 3.0], 5.0),
            (&cylinder, [13.0, 5.0, 3.0], -2.0),
            (&everything, [1e5, 0.0, 0.0], DEEP),
        ] {
            assert_relative_eq!(region.level(&Vec3::from(point)), level, epsilon = 1e-9);
        }
    }

    #[test]
    fn the_mesh_of_a_box_is_the_box() {
        let [cube, _, mesh, _] = regions().try_into().unwrap();
        for number in 1..200 {
            let x = f64::from(number);
            let point = Vec3::new(
                (x * 0.3719) % 30.0 - 5.0,
                (x * 0.7127) % 20.0 - 5.0,
                (x * 0.5333) % 16.0 - 5.0,
            );
            assert_relative_eq!(cube.level(&point), mesh.level(&point), epsilon = 1e-9);
            assert_eq!(cube.contains(&point), mesh.contains(&point), "{point}");
        }
    }

    proptest! {
        /// A distance never grows faster than one goes, so the level is continuous.
        #[test]
        fn levels_are_continuous(p in [-30.0..30.0, -30.0..30.0, -30.0..30.0], step in [-1.0..1.0, -1.0..1.0, -1.0..1.0]) {
            let (p, step) = (Vec3::from(p), Vec3::from(step));
            for region in regions() {
                let change = region.level(&(p + step)) - region.level(&p);
                prop_assert!(change.abs() <= step.norm() + 1e-9, "{region:?} at {p}");
            }
        }
    }
}
