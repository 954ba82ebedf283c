//! What a layout of voxels may weigh and cost, what its cost is worth, and which materials must not touch.
//!
//! ```text
//! g(w) = Σ_vm s_vm w_vm ≤ ĝ           s_vm = Σ_{c in v} V_c ρ_m (mass) or V_c π_m (cost)
//! min R(w) + K(w),  K = ω Σ V_c π_m w_cm     as  min ½ n R² + ½ β² K²,   β² = n R / K
//! ```
//!
//! Both are sums over the shares, so they join the linearised problem as rows. A limit's row is there where a step would
//! break it, heavy beside the readings. The row of a weighted cost has the factor β, renewed at each linearisation: where
//! nothing changes any more, the gradients of the two problems are in proportion.
//!
//! Materials that must not touch have no counterpart among mixtures: layouts keep them apart while they are rounded, and
//! what is left is mended.
//!
//! Symbols: w shares, V volume of a cell \[cm³\], ρ density \[g/cm³\], π price \[per cm³\], R RMS error \[mm\] over n
//! pairs, ω what a unit of cost is worth \[mm\].

use super::linear::Linear;
use crate::design::search::Aim;

/// A limit's row is as heavy as this many typical readings.
const WEIGHT: f64 = 10.0;
/// Where a limit's row aims, as a share of the limit: a little below, as rows give way a little.
const INSIDE: f64 = 0.999;
/// Rounds of mending.
const ROUNDS: usize = 8;
/// R in β is at least this share of the largest target displacement.
const LEAST: f64 = 1e-3;

/// A sum over the shares, at most so much.
struct Limit {
    slopes: Vec<f64>,
    most: f64,
}

/// The rules of a space, for variables.
pub(super) struct Limits {
    limits: Vec<Limit>,
    /// Slopes of K \[mm\]; empty where cost does not count.
    worth: Vec<f64>,
    /// For each variable those that it touches.
    touching: Vec<Vec<u32>>,
    apart: Vec<[u8; 2]>,
    materials: usize,
}

impl Limits {
    pub fn new(aim: &Aim, variable_of_cell: &[u32], variables: usize) -> Limits {
        let space = aim.space;
        let slopes = |per_cm3: &[f64], factor: f64| {
            let mut slopes = vec![0.0; variables * space.materials];
            for (&v, volume) in variable_of_cell.iter().zip(&space.volumes_cm3) {
                for (m, density) in per_cm3.iter().enumerate() {
                    slopes[v as usize * space.materials + m] += factor * volume * density;
                }
            }
            slopes
        };
        let limits = [
            (&space.densities_g_per_cm3, space.most_mass_g),
            (&space.prices_per_cm3, space.most_cost),
        ];
        let bounded = limits.into_iter().filter(|(_, most)| most.is_finite());
        let mut touching = vec![Vec::new(); variables];
        for (cell, others) in space.touching.iter().enumerate() {
            let own = variable_of_cell[cell];
            let others = others.iter().map(|&o| variable_of_cell[o as usize]);
            touching[own as usize].extend(others.filter(|&o| o != own));
        }
        for list in &mut touching {
            list.sort_unstable();
            list.dedup();
        }
        Limits {
            limits: bounded
                .map(|(per_cm3, most)| Limit {
                    slopes: slopes(per_cm3, 1.0),
                    most,
                })
                .collect(),
            worth: match aim.cost_weight_mm {
                0.0 => Vec::new(),
                weight => slopes(&space.prices_per_cm3, weight),
            },
            touching,
            apart: space.apart.clone(),
            materials: space.materials,
        }
    }

    /// K of some shares \[mm\].
    pub fn worth_mm(&self, shares: &[f64]) -> f64 {
        sum(&self.worth, shares)
    }

    /// How much the shares are above the limits, as a share of each.
    pub fn excess(&self, shares: &[f64]) -> f64 {
        let over = |l: &Limit| (sum(&l.slopes, shares) / l.most - 1.0).max(0.0);
        self.limits.iter().map(over).sum()
    }

    /// `linear` at `shares` with the row of the cost: there are `pairs` pairs, `rms_mm` off.
    pub fn with_worth(
        &self,
        linear: Linear,
        shares: &[f64],
        pairs: usize,
        rms_mm: f64,
        largest_mm: f64,
    ) -> Linear {
        let worth = self.worth_mm(shares);
        if worth <= 0.0 {
            return linear;
        }
        let beta = (pairs as f64 * rms_mm.max(LEAST * largest_mm) / worth).sqrt();
        let slopes: Vec<f64> = self.worth.iter().map(|s| beta * s).collect();
        linear.with_sum(beta * worth, &slopes)
    }

    /// `linear` at `shares` with a row for each limit that `next` would break; `None` if it breaks none.
    pub fn binding(&self, linear: &Linear, shares: &[f64], next: &[f64]) -> Option<Linear> {
        let readings = (linear.derivatives.nrows() - linear.sums).max(1);
        let typical = linear.derivatives.norm() / (readings as f64).sqrt();
        let mut bound: Option<Linear> = None;
        for limit in self.limits.iter().filter(|l| sum(&l.slopes, next) > l.most) {
            let size = limit.slopes.iter().map(|s| s * s).sum::<f64>().sqrt();
            let weight = WEIGHT * typical.max(f64::MIN_POSITIVE) / size.max(f64::MIN_POSITIVE);
            let slopes: Vec<f64> = limit.slopes.iter().map(|s| weight * s).collect();
            let residual = weight * (sum(&limit.slopes, shares) - INSIDE * limit.most);
            bound = Some(bound.as_ref().unwrap_or(linear).with_sum(residual, &slopes));
        }
        bound
    }

    /// May variable `v` take material `m` beside what `choice` has decided?
    pub fn permit(&self, v: usize, m: u8, choice: &[u8]) -> bool {
        self.apart.is_empty() || self.clashes(v, m, choice) == 0
    }

    /// With how many neighbours material `m` at `v` must not touch.
    fn clashes(&self, v: usize, m: u8, choice: &[u8]) -> usize {
        let clash = |&&o: &&u32| {
            let other = choice[o as usize];
            self.apart
                .iter()
                .any(|&pair| pair == [m, other] || pair == [other, m])
        };
        self.touching[v].iter().filter(clash).count()
    }

    /// Mends `choice` until materials that must not touch do not, and limits are kept, if that can be done by changing one
    /// variable after the other; the cheapest by the linearised error first. `linear` stands at `shares`.
    pub fn mended(&self, linear: &Linear, shares: &[f64], mut choice: Vec<u8>, free: &[bool]) -> Vec<u8> {
        let mut rest = linear.moved(shares, &super::linear::shares_of(&choice, self.materials));
        let m = self.materials;
        let price = |rest: &nalgebra::DVector<f64>, v: usize, from: u8, to: usize| {
            let change =
                linear.derivatives.column(v * m + to) - linear.derivatives.column(v * m + from as usize);
            2.0 * rest.dot(&change) + change.norm_squared()
        };
        let change = |choice: &mut Vec<u8>, rest: &mut nalgebra::DVector<f64>, v: usize, to: usize| {
            *rest +=
                linear.derivatives.column(v * m + to) - linear.derivatives.column(v * m + choice[v] as usize);
            choice[v] = to as u8;
        };
        for _ in 0..if self.apart.is_empty() { 0 } else { ROUNDS } {
            let mut changed = false;
            for v in 0..choice.len() {
                if self.clashes(v, choice[v], &choice) == 0 {
                    continue;
                }
                let best = (0..m)
                    .filter(|&k| free[v * m + k])
                    .map(|k| {
                        (
                            self.clashes(v, k as u8, &choice),
                            price(&rest, v, choice[v], k),
                            k,
                        )
                    })
                    .min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
                if let Some((_, _, k)) = best.filter(|b| b.2 != choice[v] as usize) {
                    change(&mut choice, &mut rest, v, k);
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        for limit in &self.limits {
            let mut value: f64 = (0..choice.len())
                .map(|v| limit.slopes[v * m + choice[v] as usize])
                .sum();
            while value > limit.most {
                let saved =
                    |v: usize, k: usize| limit.slopes[v * m + choice[v] as usize] - limit.slopes[v * m + k];
                let best = (0..choice.len())
                    .flat_map(|v| (0..m).map(move |k| (v, k)))
                    .filter(|&(v, k)| {
                        free[v * m + k] && saved(v, k) > 0.0 && self.permit(v, k as u8, &choice)
                    })
                    .map(|(v, k)| (price(&rest, v, choice[v], k) / saved(v, k), v, k))
                    .min_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
                let Some((_, v, k)) = best else { break };
                value -= saved(v, k);
                change(&mut choice, &mut rest, v, k);
            }
        }
        choice
    }
}

fn sum(slopes: &[f64], shares: &[f64]) -> f64 {
    slopes.iter().zip(shares).map(|(s, w)| s * w).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Three variables in a row, three materials that weigh 1, 2 and 3.
    fn row(most: f64, worth: Vec<f64>, apart: Vec<[u8; 2]>) -> Limits {
        Limits {
            limits: vec![Limit {
                slopes: [1.0, 2.0, 3.0].repeat(3),
                most,
            }],
            worth,
            touching: vec![vec![1], vec![0, 2], vec![1]],
            apart,
            materials: 3,
        }
    }

    fn linear() -> Linear {
        Linear {
            residual: DVector::from_vec(vec![0.3, -0.2]),
            derivatives: DMatrix::from_fn(2, 9, |i, k| 0.1 * ((5 * i + 3 * k) % 7) as f64 - 0.25),
            materials: 3,
            sums: 0,
        }
    }

    /// The gradient of the linearised problem is n R times that of R + K, by central differences of the latter.
    #[test]
    fn a_weighted_cost_pulls_as_its_score_does() {
        let worth: Vec<f64> = (0..9).map(|k| 0.01 * (k % 4) as f64).collect();
        let limits = row(100.0, worth.clone(), Vec::new());
        let shares = [0.2, 0.5, 0.3].repeat(3);
        let plain = linear();
        let rms = |r: &DVector<f64>| (r.norm_squared() / 2.0).sqrt();
        let rms_mm = rms(&plain.residual);
        let with = limits.with_worth(plain.clone(), &shares, 2, rms_mm, 1.0);
        assert_eq!((with.sums, with.residual.len()), (1, 3));
        let gradient = with.derivatives.tr_mul(&with.residual);
        for k in 0..9 {
            let score = |step: f64| {
                let mut moved = shares.clone();
                moved[k] += step;
                rms(&plain.moved(&shares, &moved)) + sum(&worth, &moved)
            };
            let slope = (score(1e-6) - score(-1e-6)) / 2e-6;
            assert!((gradient[k] - 2.0 * rms_mm * slope).abs() < 1e-8, "{k}");
        }
    }

    #[test]
    fn clashes_and_what_is_too_heavy_are_mended() {
        let limits = row(5.0, Vec::new(), vec![[0, 2]]);
        let shares = vec![1.0 / 3.0; 9];
        assert!(!limits.permit(1, 2, &[0, u8::MAX, u8::MAX]) && limits.permit(1, 1, &[0, u8::MAX, u8::MAX]));
        for choice in [[2, 0, 2], [2, 2, 2], [0, 2, 0], [2, 1, 1]] {
            let mended = limits.mended(&linear(), &shares, choice.to_vec(), &[true; 9]);
            assert!((0..3).all(|v| limits.permit(v, mended[v], &mended)), "{choice:?}");
            assert!(
                mended.iter().map(|m| m + 1).sum::<u8>() <= 5,
                "{choice:?} {mended:?}"
            );
        }
        // Nothing is changed where nothing need be.
        let kept = limits.mended(&linear(), &shares, vec![0, 1, 1], &[true; 9]);
        assert_eq!(kept, [0, 1, 1]);
    }

    #[test]
    fn a_step_ends_at_its_limit() {
        let limits = row(5.0, Vec::new(), Vec::new());
        let (plain, free) = (linear(), [true; 9]);
        let shares = vec![1.0 / 3.0; 9];
        let heavy = [0.0, 0.0, 1.0].repeat(3);
        let bound = limits.binding(&plain, &shares, &heavy).expect("a row");
        let next = bound.step(&shares, &shares, 1e-6, &free);
        let weight = sum(&limits.limits[0].slopes, &next);
        assert!((weight / 5.0 - INSIDE).abs() < 1e-3, "{weight}");
        assert!(limits.binding(&plain, &shares, &next).is_none());
    }
}
