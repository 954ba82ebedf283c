//! The way of a pressed body to the object.
//!
//! ```text
//! s ← s + max(g(s), h/20)   until   d · Σ f_p ≥ F,   then halving
//! ```
//!
//! A body that touches nothing has no stiffness to find its travel s by. Its gap g to the nearest point is a way that it can
//! surely go (sphere tracing, Hart 1996); where it meets the object, held still, with more than its force, s is halved down
//! to that force. Symbols: h distance of contact points \[mm\], F force on the body \[N\], d its direction.

use super::balance::{Balance, State, Target};
use crate::fem::load_curve::Stop;

/// Steps on a body's way to the object.
const APPROACH: usize = 500;

impl Balance<'_> {
    /// Brings bodies that a force presses and that touch nothing to the object: as far as the force asks for, the object at
    /// rest. Says whether any moved.
    pub fn approach(&mut self, state: &mut State, target: &Target) -> Result<bool, Stop> {
        let mut moved = false;
        for body in 0..target.push.len() {
            let Some(force) = target.push[body].filter(|f| *f > 0.0) else {
                continue;
            };
            self.meet(state);
            if self.push_of(body) > 1e-9 * force {
                continue;
            }
            moved = true;
            self.advance_body(state, body, force)?;
        }
        Ok(moved)
    }

    fn advance_body(&mut self, state: &mut State, body: usize, force: f64) -> Result<(), Stop> {
        let spacing = self.surface.spacing_mm();
        let mut low = state.travel[body];
        let mut pushes = |balance: &mut Self, travel: f64| {
            state.travel[body] = travel;
            balance.meet(state);
            (balance.push_of(body), balance.nearest(state, body))
        };
        let (_, mut gap) = pushes(self, low);
        for _ in 0..APPROACH {
            let high = low + gap.max(0.05 * spacing);
            let (push, next_gap) = pushes(self, high);
            if push >= force {
                let (mut below, mut above) = (low, high);
                for _ in 0..60 {
                    let middle = 0.5 * (below + above);
                    if pushes(self, middle).0 < force {
                        below = middle;
                    } else {
                        above = middle;
                    }
                }
                pushes(self, above);
                return Ok(());
            }
            if !next_gap.is_finite() {
                break;
            }
            (low, gap) = (high, next_gap);
        }
        // It passes the object by.
        Err(Stop::NotConverged)
    }
}
