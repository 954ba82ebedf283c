//! All drives of a simulation at one moment, and what lies between two of them: in an increment every number changes in
//! proportion, `q(τ) = q₀ + τ (q₁ − q₀)`.

use super::body::Push;
use crate::math::Vec3;

/// All drives at one moment.
#[derive(Clone, Debug)]
pub(super) struct Moment {
    pub load_factor: f64,
    pub push: Vec<Push>,
    pub across: Vec<Vec3>,
}

impl Moment {
    /// Between two moments with the same kinds of push.
    pub fn between(&self, end: &Moment, share: f64) -> Moment {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        let push = self.push.iter().zip(&end.push).map(|pair| match pair {
            (Push::Travel(a), Push::Travel(b)) => Push::Travel(mix(*a, *b)),
            (Push::Force(a), Push::Force(b)) => Push::Force(mix(*a, *b)),
            (_, end) => *end,
        });
        Moment {
            load_factor: mix(self.load_factor, end.load_factor),
            push: push.collect(),
            across: self
                .across
                .iter()
                .zip(&end.across)
                .map(|(a, b)| a + (b - a) * share)
                .collect(),
        }
    }

    /// Change of all numbers up to `end`.
    pub fn change(&self, end: &Moment) -> Vec<f64> {
        let value = |p: &Push| match p {
            Push::Travel(x) | Push::Force(x) => *x,
        };
        let mut all = vec![end.load_factor - self.load_factor];
        all.extend(self.push.iter().zip(&end.push).map(|(a, b)| value(b) - value(a)));
        all.extend(self.across.iter().zip(&end.across).flat_map(|(a, b)| {
            let way = b - a;
            [way.x, way.y, way.z]
        }));
        all
    }
}
