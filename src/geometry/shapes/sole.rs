//! The sole of a flip-flop for a left foot: heel at y = 0, toes towards +y, the big toe at +x, the ground at z = 0.

use super::error::{ShapeError, within};
use super::plane::{Flat, closed_spline, perimeter};
use super::slab::{Slab, slab};
use crate::geometry::surface::TriMesh;

/// The measures of a sole \[mm\]. The defaults fit a shoe size of about EU 41.
#[derive(Clone, Debug, PartialEq)]
pub struct SoleOptions {
    /// Heel to toes.
    pub length: f64,
    /// Largest width, at the ball of the foot.
    pub ball_width: f64,
    /// Largest width of the heel.
    pub heel_width: f64,
    /// Thickness at the heel, before the footbed is hollowed.
    pub heel_thickness: f64,
    /// Thickness at the toes.
    pub toe_thickness: f64,
    /// Depth of the hollow for the heel.
    pub footbed_depth: f64,
    /// How far the tip rises off the ground.
    pub toe_spring: f64,
    /// Radius of the upper rim.
    pub rim_radius: f64,
    /// Side of the triangles.
    pub spacing: f64,
}

impl Default for SoleOptions {
    fn default() -> SoleOptions {
        SoleOptions {
            length: 260.0,
            ball_width: 98.0,
            heel_width: 70.0,
            heel_thickness: 22.0,
            toe_thickness: 14.0,
            footbed_depth: 1.5,
            toe_spring: 0.0,
            rim_radius: 3.0,
            spacing: 6.0,
        }
    }
}

impl SoleOptions {
    /// Checks the measures.
    ///
    /// # Errors
    /// [`ShapeError`] names the option, its value, and what it may be.
    pub fn check(&self) -> Result<(), ShapeError> {
        within("length", self.length, 80.0, 500.0)?;
        within(
            "ball_width",
            self.ball_width,
            0.25 * self.length,
            0.55 * self.length,
        )?;
        within(
            "heel_width",
            self.heel_width,
            0.5 * self.ball_width,
            self.ball_width,
        )?;
        within("heel_thickness", self.heel_thickness, 3.0, 120.0)?;
        within("toe_thickness", self.toe_thickness, 3.0, 120.0)?;
        let thinnest = self.heel_thickness.min(self.toe_thickness);
        within("footbed_depth", self.footbed_depth, 0.0, 0.5 * thinnest)?;
        within("toe_spring", self.toe_spring, 0.0, 0.2 * self.length)?;
        // Less than the tightest curve of the outline, or the rim would fold over itself.
        within(
            "rim_radius",
            self.rim_radius,
            0.0,
            (0.5 * thinnest).min(0.1 * self.heel_width),
        )?;
        within("spacing", self.spacing, self.length / 200.0, self.length / 15.0)
    }
}

/// The outline of a left foot: x as a share of the width there, y as a share of the length, counter-clockwise from above.
const OUTLINE: [Flat; 16] = [
    [-0.02, 0.0],
    [0.34, 0.035],
    [0.49, 0.135],
    [0.44, 0.28],
    [0.31, 0.42],
    [0.37, 0.57],
    [0.49, 0.71],
    [0.50, 0.82],
    [0.42, 0.925],
    [0.18, 0.995],
    [-0.12, 0.965],
    [-0.36, 0.87],
    [-0.49, 0.72],
    [-0.50, 0.55],
    [-0.49, 0.30],
    [-0.43, 0.09],
];

/// Shares of the length between which the heel's width passes into the ball's.
const WAIST: (f64, f64) = (0.30, 0.56);

/// A sole, closed and outward, of some thousand triangles.
///
/// # Errors
/// [`ShapeError`] for measures that make no sole.
pub fn flip_flop_sole(options: &SoleOptions) -> Result<TriMesh, ShapeError> {
    options.check()?;
    let outline = outline(options);
    let along = |p: Flat| p[1] / options.length;
    let bottom = |p: Flat| options.toe_spring * ((along(p) - 0.65) / 0.35).clamp(0.0, 1.0).powi(2);
    let top = |p: Flat| {
        let blend = smoothstep((along(p) - 0.25) / 0.5);
        let thickness = options.heel_thickness + blend * (options.toe_thickness - options.heel_thickness);
        // A bell around the middle of the heel.
        let (dx, dy) = (p[0] / (0.35 * options.heel_width), (along(p) - 0.16) / 0.12);
        bottom(p) + thickness - options.footbed_depth * (-(dx * dx + dy * dy)).exp()
    };
    Ok(slab(&Slab {
        outline: &outline,
        bottom: &bottom,
        top: &top,
        bottom_rim: 0.0,
        top_rim: options.rim_radius,
        spacing: options.spacing,
    }))
}

/// The outline in mm, with exactly the length and the widths that the options ask for.
fn outline(options: &SoleOptions) -> Vec<Flat> {
    let dense = fitted(&closed_spline(&OUTLINE, 200), options);
    let count = ((perimeter(&dense) / options.spacing).round() as usize).max(24);
    // Sampling cuts the extremes by some µm: back to the shares, and fit once more.
    let shares: Vec<Flat> = closed_spline(&dense, count)
        .iter()
        .map(|p| [p[0], p[1] / options.length])
        .collect();
    fitted(&shares, options)
}

/// Scales points with y in shares of the length: the widest places of heel and ball get their widths, and between them
/// one factor passes into the other.
fn fitted(points: &[Flat], options: &SoleOptions) -> Vec<Flat> {
    let extent = |c: usize, chosen: fn(&Flat) -> bool| {
        let range = points.iter().filter(|p| chosen(p)).map(|p| p[c]);
        range.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| {
            (lo.min(x), hi.max(x))
        })
    };
    let (back, front) = extent(1, |_| true);
    let (left, right) = extent(0, |p| p[1] < WAIST.0);
    let heel = options.heel_width / (right - left);
    let (left, right) = extent(0, |p| p[1] > WAIST.1);
    let ball = options.ball_width / (right - left);
    let scaled = |p: &Flat| {
        let blend = smoothstep((p[1] - WAIST.0) / (WAIST.1 - WAIST.0));
        [
            p[0] * (heel + blend * (ball - heel)),
            (p[1] - back) / (front - back) * options.length,
        ]
    };
    points.iter().map(scaled).collect()
}

fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
