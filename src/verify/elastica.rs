//! The plane cantilever under a dead tip load, by shooting: a second source for [`super::cantilever`].
//!
//! ```text
//! x' = (1 + ε) cos θ − γ sin θ,   y' = (1 + ε) sin θ + γ cos θ,   θ' = κ,   κ' = −α x'
//! ε = α a sin θ,   γ = α s cos θ;      x = y = θ = 0 at the clamp, κ = 0 at the tip
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | x, y | position along and across the undeformed beam, over its length L | – |
//! | θ, κ | angle of the cross-section; its rate along the beam, times L | – |
//! | α | load, P L² / EI | – |
//! | a, s | EI / (EA L²) and EI / (k GA L²): how easily the beam stretches and shears; zero for the elastica | – |
//!
//! Geometrically exact, for any rotation, while the material is linear in the strains ε, γ, κ. Sources: Bisshopp and
//! Drucker 1945 (the elastica), Reissner 1972 (stretch and shear).

/// How a beam gives other than by bending.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slenderness {
    /// a = EI / (EA L²).
    pub stretch: f64,
    /// s = EI / (k GA L²).
    pub shear: f64,
}

impl Slenderness {
    /// Bending alone.
    pub const ELASTICA: Slenderness = Slenderness {
        stretch: 0.0,
        shear: 0.0,
    };

    /// A rectangular beam of height `height` over length, at Poisson's ratio zero: E/G = 2, and k = 5/6.
    pub fn rectangle(height: f64) -> Slenderness {
        let stretch = height * height / 12.0;
        Slenderness {
            stretch,
            shear: stretch * 2.0 / (5.0 / 6.0),
        }
    }
}

/// Where the tip goes: shortening 1 − x and deflection y, over the length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tip {
    /// 1 − x.
    pub shortening: f64,
    /// y.
    pub deflection: f64,
}

/// Runge–Kutta steps along the beam; the error, of the fourth order, is then below 1e-10.
const STEPS: usize = 400;

/// The tip under the load α ≥ 0.
pub fn tip(load: f64, slenderness: Slenderness) -> Tip {
    // The curvature at the tip falls as that at the clamp is lowered; at the clamp it is at most α, the moment of an arm 1.
    let (mut low, mut high) = (0.0, load);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if shoot(load, slenderness, middle)[3] > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    let end = shoot(load, slenderness, 0.5 * (low + high));
    Tip {
        shortening: 1.0 - end[0],
        deflection: end[1],
    }
}

/// x, y, θ, κ at the tip, given κ at the clamp.
fn shoot(load: f64, slenderness: Slenderness, curvature: f64) -> [f64; 4] {
    let slope = |[_, _, angle, curvature]: [f64; 4]| {
        let (sin, cos) = angle.sin_cos();
        let stretch = 1.0 + load * slenderness.stretch * sin;
        let shear = load * slenderness.shear * cos;
        let along = stretch * cos - shear * sin;
        [along, stretch * sin + shear * cos, curvature, -load * along]
    };
    let mut state = [0.0, 0.0, 0.0, curvature];
    let h = 1.0 / STEPS as f64;
    for _ in 0..STEPS {
        let moved = |k: [f64; 4], share: f64| std::array::from_fn(|i| state[i] + share * h * k[i]);
        let a = slope(state);
        let b = slope(moved(a, 0.5));
        let c = slope(moved(b, 0.5));
        let d = slope(moved(c, 1.0));
        for i in 0..4 {
            state[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
    }
    state
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small loads: y = α/3 + α s, the Timoshenko beam.
    #[test]
    fn small_loads_give_the_linear_beam() {
        let beam = Slenderness::rectangle(0.1);
        let found = tip(1e-3, beam).deflection;
        assert!(
            (found / 1e-3 - (1.0 / 3.0 + 0.01 / 12.0 * 2.4)).abs() < 1e-6,
            "{found}"
        );
    }
}
