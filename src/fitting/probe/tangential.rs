//! Forces across the probe's direction that a force sensor did not measure.
//!
//! ```text
//! min_t  Σ |x(t) − x̄|²/σ²  +  |t|²/(ρ F)²      over the markers under the probe,     x(t + δ) = x(t) + S K_T⁻¹ f₁ δ
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | t | tangential force of a level, two components | N |
//! | x, x̄, σ | displacement of a marker under the probe, simulated, measured, its deviation | mm |
//! | f₁ | nodal forces of 1 N over the patch, along each of two directions across the probe | N |
//! | F | force along the probe | N |
//! | ρ = 0.5 | friction bounds the tangential force; this keeps noise from making large ones | – |
//!
//! Bickel 2010, 8.3: the forces that would make the probed points match are put back as known, and the law is fitted again.

use super::press::{Failure, Levels, Press, PressedSpecimen};
use crate::fem::example::Sensor;
use crate::material::law::Law;
use crate::math::Vec3;
use crate::math::mandel::Mandel;
use nalgebra::{Matrix2, Vector2};

/// ρ.
const FRICTION: f64 = 0.5;

/// Can the tangential force of a press be told: do markers under the probe have a direction measured across it?
pub fn is_told(press: &Press) -> bool {
    under(press)
        .iter()
        .any(|(_, directions)| directions.iter().any(|d| d.cross(&press.direction).norm() > 0.5))
}

/// The points under the probe.
fn under(press: &Press) -> Vec<(Sensor, Vec<Vec3>)> {
    let all = press.sensors.iter().zip(&press.under_probe);
    all.filter(|(_, is_under)| **is_under)
        .map(|(s, _)| s.clone())
        .collect()
}

/// Better tangential forces of the presses `which`, `(presses × levels)` \[N\], at the equilibria of `law`: one Gauss–Newton
/// step from those that the presses hold.
///
/// # Errors
/// [`Failure`]: no derivatives at an equilibrium.
pub fn estimate(
    pressed: &PressedSpecimen,
    law: &Law,
    which: &[usize],
    equilibria: &[Levels],
) -> Result<Vec<Vec<Vec3>>, Failure> {
    let nothing = |_: &Law, _: &Mandel| Vec::new();
    let across = |press: &Press| press.across().to_vec();
    let slopes = pressed.derivatives(law, which, equilibria, &nothing, &under, &across)?;
    let mut forces = Vec::new();
    for ((&k, levels), slopes) in which.iter().zip(equilibria).zip(&slopes) {
        let press = &pressed.presses[k];
        let across = press.across();
        let points = press.point_of_component();
        let components: Vec<usize> = (0..points.len())
            .filter(|&c| press.under_probe[points[c]])
            .collect();
        let one = |(level, u): (usize, &Vec<Vec3>)| {
            let held = press.tangential[level];
            let now = Vector2::new(held.dot(&across[0]), held.dot(&across[1]));
            let along = press.forces[level].dot(&press.direction).abs();
            let stiffness = 1.0 / (FRICTION * along).powi(2).max(f64::MIN_POSITIVE);
            let mut normal = Matrix2::identity() * stiffness;
            let mut right = -now * stiffness;
            let simulated = press.read(u);
            for (row, &c) in components.iter().enumerate() {
                let Some(measured) = press.readings[level][c] else {
                    continue;
                };
                let weight = press.deviations[level][c].powi(-2);
                let slope = Vector2::new(slopes[level][(row, 0)], slopes[level][(row, 1)]);
                normal += slope * slope.transpose() * weight;
                right += slope * (weight * (measured - simulated[c]));
            }
            let step = normal.cholesky().map_or(Vector2::zeros(), |c| c.solve(&right));
            let new = now + step;
            across[0] * new.x + across[1] * new.y
        };
        forces.push(levels.iter().enumerate().map(one).collect());
    }
    Ok(forces)
}
