//! What happens between one contact point and one rigid body.
//!
//! ```text
//! normal      f_n = max(0, λ − κ g)                    unilateral;  λ − κ (g − g₀) bilateral
//! tangential  t* = P (λ_T − κ m),  P = I − n nᵀ,  m = β ((x − c) − (x₀ − c₀))
//!             t = t*                                   sticking: |t*| ≤ μ f_n, or no limit
//!             t = μ f_n t* / |t*|                      sliding
//! force       f = f_n n + t,   J = ∂f/∂x               exact, from n and H = ∇n
//! ```
//!
//! An augmented Lagrangian: the multipliers λ, λ_T take the place of f_n, t again and again until the penetration and
//! the elastic slip that the penalty κ leaves are below a tolerance. Friction starts each increment at the tangential
//! force of the last equilibrium, turned into the present tangent plane; where a point touches for the first time, only the
//! share β of the increment in which it does so counts as slip.
//!
//! Symbols: x place of the point, c translation of the body \[mm\], x₀, c₀ at the last equilibrium; g gap \[mm\], negative
//! inside; n outward normal of the body; f force on the object \[N\]; κ penalty \[N/mm\]; μ coefficient of friction. The
//! forces are whole ones, not pressures: what a point carries follows from the constraint and needs no area. Sources:
//! Simo and Laursen, An augmented Lagrangian treatment of contact problems involving friction, Computers & Structures
//! 42, 1992; Alart and Curnier, Computer Methods in Applied Mechanics and Engineering 92, 1991.

use super::body::{Bond, Friction};
use super::shape::Distance;
use crate::math::{Mat3, Vec3};

/// What a point remembers about a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    /// λ \[N\].
    pub normal_n: f64,
    /// λ_T \[N\].
    pub tangential_n: Vec3,
    /// x₀ − c₀ \[mm\].
    pub place: Vec3,
    /// g₀ \[mm\].
    pub rest_gap_mm: f64,
    /// Gap at the last equilibrium \[mm\].
    pub gap_mm: f64,
    /// Outward normal of the body there.
    pub normal: Vec3,
}

impl Memory {
    /// The share β of an increment in which a point that did not touch at its start does, from the gap and how far the body
    /// comes towards it; 1 for a point that touched.
    pub fn touching_share(&self, body_moved: &Vec3) -> f64 {
        if self.gap_mm <= 0.0 {
            return 1.0;
        }
        let approach = body_moved.dot(&self.normal);
        if approach > self.gap_mm {
            1.0 - self.gap_mm / approach
        } else {
            0.0
        }
    }
}

/// How a point meets a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It does not.
    Open,
    /// Touches without friction.
    Smooth,
    /// Touches and does not slide.
    Stuck,
    /// Touches and slides against friction.
    Sliding,
}

/// Force of the body on the object at one point, with what Newton's method needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// How they meet.
    pub status: Status,
    /// f on the object \[N\].
    pub force: Vec3,
    /// J \[N/mm\].
    pub jacobian: Mat3,
    /// A symmetric, positive semi-definite stand-in for −J, without the body's curvature and without the change of the
    /// friction's limit \[N/mm\].
    pub stiffness: Mat3,
    /// f_n \[N\].
    pub normal_n: f64,
    /// t \[N\].
    pub tangential_n: Vec3,
    /// g \[mm\].
    pub gap_mm: f64,
    /// How far the constraint is from being kept: penetration, gap under pressure, slip where it sticks \[mm\].
    pub violation_mm: f64,
}

/// The response at distance `d` for a relative move \[mm\] since the last equilibrium, of which the share β counts; κ is
/// `penalty` \[N/mm\].
pub fn response(
    d: &Distance,
    (moved, share): (&Vec3, f64),
    memory: &Memory,
    friction: Friction,
    bond: Bond,
    penalty: f64,
) -> Response {
    let off = match bond {
        Bond::Unilateral => d.value,
        Bond::Bilateral => d.value - memory.rest_gap_mm,
    };
    let trial = memory.normal_n - penalty * off;
    if bond == Bond::Unilateral && trial < 0.0 {
        return Response {
            status: Status::Open,
            force: Vec3::zeros(),
            jacobian: Mat3::zeros(),
            stiffness: Mat3::zeros(),
            normal_n: 0.0,
            tangential_n: Vec3::zeros(),
            gap_mm: d.value,
            violation_mm: memory.normal_n / penalty,
        };
    }
    let n = d.gradient;
    let along = n * n.transpose() * penalty;
    let mut found = Response {
        status: Status::Smooth,
        force: n * trial,
        jacobian: d.hessian * trial - along,
        stiffness: along,
        normal_n: trial,
        tangential_n: Vec3::zeros(),
        gap_mm: d.value,
        violation_mm: off.abs(),
    };
    let coefficient = match friction {
        Friction::Frictionless => return found,
        Friction::Sticking => f64::INFINITY,
        Friction::Coulomb { coefficient } => coefficient,
    };
    let limit = match friction {
        // Zero times infinity is no limit.
        Friction::Sticking => f64::INFINITY,
        _ => coefficient * trial.abs(),
    };
    let plane = Mat3::identity() - n * n.transpose();
    let slip = moved * share;
    let pull = memory.tangential_n - slip * penalty;
    let wanted = plane * pull;
    // δP = −(δn nᵀ + n δnᵀ) with δn = H δx.
    let change = plane * (-penalty * share) - d.hessian * n.dot(&pull) - n * (d.hessian * pull).transpose();
    let size = wanted.norm();
    if size <= limit {
        found.status = Status::Stuck;
        found.tangential_n = wanted;
        found.jacobian += change;
        found.stiffness += plane * (penalty * share);
        found.violation_mm = found.violation_mm.max((plane * slip).norm());
    } else {
        let along_slip = wanted / size;
        let across = Mat3::identity() - along_slip * along_slip.transpose();
        let rate = -penalty * coefficient * trial.signum();
        found.status = Status::Sliding;
        found.tangential_n = along_slip * limit;
        found.jacobian += across * change * (limit / size) + along_slip * n.transpose() * rate;
        found.stiffness += (plane - along_slip * along_slip.transpose()) * (penalty * share * limit / size);
    }
    found.force += found.tangential_n;
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::contact::shape::Shape;

    fn at(x: &Vec3, memory: &Memory, friction: Friction, bond: Bond) -> Response {
        let d = Shape::Sphere { radius_mm: 5.0 }.distance(x);
        response(&d, (&(x - memory.place), 0.8), memory, friction, bond, 20.0)
    }

    /// Central differences of the force; a step of 1e-6 leaves some 1e-8 of the entries, which are about 20.
    #[test]
    fn jacobian_is_the_derivative_of_the_force() {
        let memory = Memory {
            normal_n: 2.0,
            tangential_n: Vec3::new(0.3, -0.2, 0.1),
            place: Vec3::new(0.5, 0.3, 4.95),
            rest_gap_mm: -0.01,
            gap_mm: 0.0,
            normal: Vec3::z(),
        };
        let x = Vec3::new(0.52, 0.27, 4.93);
        let cases = [
            (Friction::Frictionless, Bond::Unilateral, Status::Smooth),
            (Friction::Sticking, Bond::Unilateral, Status::Stuck),
            (
                Friction::Coulomb { coefficient: 0.05 },
                Bond::Unilateral,
                Status::Sliding,
            ),
            (
                Friction::Coulomb { coefficient: 0.9 },
                Bond::Bilateral,
                Status::Stuck,
            ),
            (
                Friction::Coulomb { coefficient: 0.05 },
                Bond::Bilateral,
                Status::Sliding,
            ),
        ];
        for (friction, bond, status) in cases {
            let found = at(&x, &memory, friction, bond);
            assert_eq!(found.status, status);
            for c in 0..3 {
                let mut step = Vec3::zeros();
                step[c] = 1e-6;
                let ahead = at(&(x + step), &memory, friction, bond).force;
                let behind = at(&(x - step), &memory, friction, bond).force;
                let slope = (ahead - behind) / 2e-6;
                assert!(
                    (slope - found.jacobian.column(c)).norm() < 1e-6,
                    "{friction:?} {slope}"
                );
            }
            let lowest = found.stiffness.symmetric_eigenvalues().min();
            assert!(lowest > -1e-12, "{friction:?}: {lowest}");
        }
    }

    /// By hand: a gap of 0.1 mm, of which a body that comes 0.4 mm nearer leaves three quarters of the way.
    #[test]
    fn a_point_slips_only_once_it_touches() {
        let memory = Memory {
            normal_n: 0.0,
            tangential_n: Vec3::zeros(),
            place: Vec3::zeros(),
            rest_gap_mm: 0.0,
            gap_mm: 0.1,
            normal: -Vec3::z(),
        };
        assert!((memory.touching_share(&(Vec3::z() * -0.4)) - 0.75).abs() < 1e-15);
        assert_eq!(memory.touching_share(&(Vec3::x() * 5.0)), 0.0);
        assert_eq!(memory.touching_share(&(Vec3::z() * 0.4)), 0.0);
        let touching = Memory {
            gap_mm: 0.0,
            ..memory
        };
        assert_eq!(touching.touching_share(&Vec3::zeros()), 1.0);
    }

    #[test]
    fn sliding_forces_have_the_size_of_the_limit_and_open_points_none() {
        let memory = Memory {
            normal_n: 0.0,
            tangential_n: Vec3::zeros(),
            place: Vec3::new(-1.0, 0.0, 4.9),
            rest_gap_mm: 0.0,
            gap_mm: 0.0,
            normal: Vec3::z(),
        };
        let inside = at(
            &Vec3::new(0.0, 0.0, 4.9),
            &memory,
            Friction::Coulomb { coefficient: 0.3 },
            Bond::Unilateral,
        );
        // 0.1 mm deep at 20 N/mm; the point moved along +x, so friction pulls it back.
        assert!((inside.normal_n - 2.0).abs() < 1e-12);
        assert!((inside.tangential_n + Vec3::x() * 0.6).norm() < 1e-12);
        let outside = at(
            &Vec3::new(0.0, 0.0, 5.1),
            &memory,
            Friction::Sticking,
            Bond::Unilateral,
        );
        assert_eq!((outside.status, outside.force), (Status::Open, Vec3::zeros()));
    }
}
