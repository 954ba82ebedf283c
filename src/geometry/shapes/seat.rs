//! The padded seat of a stool: round, domed, with a shallow dimple around a button in the middle. Its underside lies at z = 0,
//! its axis on the z axis.

use super::error::{ShapeError, within};
use super::plane::Flat;
use super::slab::{Slab, slab};
use crate::geometry::axis::Axis;
use crate::geometry::region::Region;
use crate::geometry::surface::TriMesh;
use std::f64::consts::PI;

/// The measures of a seat \[mm\].
#[derive(Clone, Debug, PartialEq)]
pub struct SeatOptions {
    pub diameter: f64,
    /// Height of the dome's apex, before the dimple is pressed into it.
    pub thickness: f64,
    /// How much higher the apex is than the rim.
    pub dome: f64,
    /// Radius of the dimple, which is also where the inner region ends.
    pub button_radius: f64,
    /// Depth of the dimple.
    pub button_depth: f64,
    /// Radius of the upper rim.
    pub rim_radius: f64,
    /// Side of the triangles.
    pub spacing: f64,
}

impl Default for SeatOptions {
    fn default() -> SeatOptions {
        SeatOptions {
            diameter: 340.0,
            thickness: 60.0,
            dome: 10.0,
            button_radius: 45.0,
            button_depth: 6.0,
            rim_radius: 22.0,
            spacing: 11.0,
        }
    }
}

impl SeatOptions {
    /// Checks the measures.
    ///
    /// # Errors
    /// [`ShapeError`] names the option, its value, and what it may be.
    pub fn check(&self) -> Result<(), ShapeError> {
        within("diameter", self.diameter, 50.0, 1000.0)?;
        within("thickness", self.thickness, 5.0, 0.8 * self.diameter)?;
        within("dome", self.dome, 0.0, 0.6 * self.thickness)?;
        within(
            "rim_radius",
            self.rim_radius,
            0.0,
            0.7 * (self.thickness - self.dome).min(0.3 * self.diameter),
        )?;
        let flat = self.diameter / 2.0 - self.rim_radius;
        within("button_radius", self.button_radius, 5.0, 0.9 * flat)?;
        within("button_depth", self.button_depth, 0.0, 0.5 * self.thickness)?;
        within(
            "spacing",
            self.spacing,
            self.diameter / 200.0,
            self.diameter / 10.0,
        )
    }

    /// The region around the button; the rest of the seat is the other one.
    pub fn button(&self) -> Region {
        let range = [-1.0, self.thickness + 1.0];
        Region::Cylinder {
            axis: Axis::Z,
            centre: [0.0, 0.0],
            radius: self.button_radius,
            range,
        }
    }
}

/// A seat, closed and outward, of some thousand triangles.
///
/// # Errors
/// [`ShapeError`] for measures that make no seat.
pub fn stool_seat(options: &SeatOptions) -> Result<TriMesh, ShapeError> {
    options.check()?;
    let radius = options.diameter / 2.0;
    // A multiple of four, so that the seat is as wide as asked along both axes.
    let count = 4 * ((2.0 * PI * radius / options.spacing / 4.0).round() as usize).max(6);
    let at = |k: usize| {
        let angle = 2.0 * PI * k as f64 / count as f64;
        [radius * angle.cos(), radius * angle.sin()]
    };
    let outline: Vec<Flat> = (0..count).map(at).collect();
    let top = |p: Flat| {
        let from_axis = p[0].hypot(p[1]);
        let dome = options.dome * (1.0 - (from_axis / radius).powi(2));
        let dimple = 0.5 * (1.0 + (PI * (from_axis / options.button_radius).min(1.0)).cos());
        options.thickness - options.dome + dome - options.button_depth * dimple
    };
    Ok(slab(&Slab {
        outline: &outline,
        bottom: &|_| 0.0,
        top: &top,
        bottom_rim: 0.25 * options.rim_radius,
        top_rim: options.rim_radius,
        spacing: options.spacing,
    }))
}
