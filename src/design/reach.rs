//! Is the goal within the palette's reach? Judged before any search, by the object made of each material alone.
//!
//! ```text
//! min_m u_m(F) ≤ ū(F) + τ        max_m u_m(F) ≥ ū(F) − τ        at every force F of every example
//! ```
//!
//! u_m is the displacement along the force of the example's telling point when the object is all of material m, ū the target,
//! τ its tolerance \[mm\]. Mixed layouts are expected between these extremes along the press (Bickel 2010, 8.4.2), so a target
//! outside is out of reach. That is an expectation and no theorem, so the search goes on.
//!
//! What is missing follows from the laws: with every stress s times as large, equilibrium at the force F is the old one at
//! F/s,
//!
//! ```text
//! u(F; s) = u(F/s; 1)
//! ```
//!
//! so where the softest material reaches the target at the force F*, a material of s = F/F* times its stiffness reaches it at
//! F. Only displacements along the press are judged; what moves sideways is not.

use crate::fem::equilibrium::Options;
use crate::fem::example::Example;
use crate::fem::rig::{Bench, Rig};
use rayon::prelude::*;

/// A target this little outside, as a share of what a material gives, is within reach.
const MARGIN: f64 = 0.01;
/// A material is not pressed with more than this many times the force to find what is missing.
const MOST_FORCE: f64 = 16.0;
/// The force at which a material gives as asked is found to this share of the displacement.
const CLOSE: f64 = 1e-4;

/// What the palette lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Missing {
    /// A softer material.
    Softer,
    /// A stiffer material.
    Stiffer,
}

/// Stiffness of the missing material as a share of the nearest one's.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// So many times.
    Times(f64),
    /// Less than so many times: the material has no equilibrium at the force that would say how much, or gives less than asked
    /// at 16 times the force.
    LessThan(f64),
    /// No finite stiffness is enough: no displacement at all is asked for.
    Rigid,
    /// The simulation did not say.
    Unknown,
}

/// An example whose target lies outside what the palette gives, at the force where it is farthest out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shortfall {
    /// Number of the example.
    pub example: usize,
    /// Number of the force in the example.
    pub level: usize,
    /// What is missing.
    pub missing: Missing,
    /// The palette's nearest material.
    pub material: u8,
    /// The force \[N\].
    pub force_n: f64,
    /// Target displacement \[mm\].
    pub asked_mm: f64,
    /// Its tolerance \[mm\].
    pub tolerance_mm: f64,
    /// What the nearest material gives alone \[mm\].
    pub gives_mm: f64,
    /// Stiffness of the missing material against the nearest one's.
    pub scale: Scale,
}

/// What the palette gives at one force of an example.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// The force \[N\].
    pub force_n: f64,
    /// Target displacement \[mm\]; `None` where it is not known.
    pub asked_mm: Option<f64>,
    /// The least that a material gives alone \[mm\]; `None` if none is in equilibrium.
    pub stiffest_mm: Option<f64>,
    /// The most \[mm\]; `None` if a material has no equilibrium at this force, so that nothing bounds it.
    pub softest_mm: Option<f64>,
}

impl Level {
    /// The displacement nearest to the target between what the palette's extremes give \[mm\].
    pub fn nearest_mm(&self) -> Option<f64> {
        let raised = self.asked_mm?.max(self.stiffest_mm.unwrap_or(0.0));
        Some(raised.min(self.softest_mm.unwrap_or(f64::INFINITY)))
    }
}

/// What a palette can do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reach {
    /// For each example, each of its forces; empty for an example without a telling point.
    pub examples: Vec<Vec<Level>>,
    /// The examples that are out of reach: at most one softer and one stiffer shortfall for each.
    pub shortfalls: Vec<Shortfall>,
}

/// Judges `examples` on `rig` by the object made of each of `materials` alone, `cells` cells. `None` if `cancelled`.
pub fn judge(
    examples: &[Example],
    rig: &Rig,
    cells: usize,
    materials: &[u8],
    options: &Options,
    cancelled: &(dyn Fn() -> bool + Sync),
) -> Option<Reach> {
    let judge = Judge {
        examples,
        rig,
        cells,
        options,
        cancelled,
    };
    let alone: Vec<Vec<Vec<f64>>> = materials
        .par_iter()
        .map_init(
            || rig.bench(),
            |bench, &m| {
                let Ok(bench) = bench else {
                    return vec![Vec::new(); examples.len()];
                };
                let path = |k: usize| judge.path(bench, m, k, &rig.presses[k].factors);
                (0..examples.len()).map(path).collect()
            },
        )
        .collect();
    let mut bench = rig.bench().ok()?;
    let mut reach = Reach::default();
    for (k, example) in examples.iter().enumerate() {
        let curves: Vec<(u8, &[f64])> = materials
            .iter()
            .zip(&alone)
            .map(|(&m, all)| (m, all[k].as_slice()))
            .collect();
        let Some(point) = example.telling_point() else {
            reach.examples.push(Vec::new());
            continue;
        };
        for missing in [Missing::Softer, Missing::Stiffer] {
            if let Some(farthest) = farthest(example, k, point, &curves, missing) {
                let scale = judge.scale(&mut bench, &farthest);
                reach.shortfalls.push(Shortfall { scale, ..farthest });
            }
        }
        let level = |f: usize| Level {
            force_n: example.forces_n[f],
            asked_mm: example.along(point, f),
            stiffest_mm: extreme(&curves, f, Missing::Stiffer).map(|(_, u)| u),
            softest_mm: extreme(&curves, f, Missing::Softer).map(|(_, u)| u),
        };
        reach
            .examples
            .push((0..example.forces_n.len()).map(level).collect());
    }
    if cancelled() { None } else { Some(reach) }
}

/// The material that gives most or least at level `force`, and how much; none where nothing bounds that side.
fn extreme(curves: &[(u8, &[f64])], force: usize, side: Missing) -> Option<(u8, f64)> {
    let at = curves.iter().map(|(m, curve)| curve.get(force).map(|u| (*m, *u)));
    match side {
        // A material that falls under the load gives without end.
        Missing::Softer => at
            .collect::<Option<Vec<_>>>()?
            .into_iter()
            .max_by(|a, b| a.1.total_cmp(&b.1)),
        Missing::Stiffer => at.flatten().min_by(|a, b| a.1.total_cmp(&b.1)),
    }
}

/// The force at which the target is farthest beyond one side, by the ratio of what is asked and given.
fn farthest(
    example: &Example,
    index: usize,
    point: usize,
    curves: &[(u8, &[f64])],
    missing: Missing,
) -> Option<Shortfall> {
    let at = |level: usize| {
        let (material, gives_mm) = extreme(curves, level, missing)?;
        let shortfall = Shortfall {
            example: index,
            level,
            missing,
            material,
            force_n: example.forces_n[level],
            asked_mm: example.along(point, level)?,
            tolerance_mm: example.tolerances_mm[point][level],
            gives_mm,
            scale: Scale::Rigid,
        };
        (shortfall.ratio() > 1.0 + MARGIN).then_some(shortfall)
    };
    (0..example.forces_n.len())
        .filter_map(at)
        .max_by(|a, b| a.ratio().total_cmp(&b.ratio()).then(b.level.cmp(&a.level)))
}

impl Shortfall {
    /// The displacement nearest to what the material gives that is still allowed \[mm\].
    pub fn edge_mm(&self) -> f64 {
        match self.missing {
            Missing::Softer => self.asked_mm - self.tolerance_mm,
            Missing::Stiffer => self.asked_mm + self.tolerance_mm,
        }
    }

    /// How far outside the target is: above 1.
    fn ratio(&self) -> f64 {
        match self.missing {
            Missing::Softer => self.edge_mm() / self.gives_mm,
            Missing::Stiffer => self.gives_mm / self.edge_mm().max(0.0),
        }
    }
}

struct Judge<'a> {
    examples: &'a [Example],
    rig: &'a Rig,
    cells: usize,
    options: &'a Options,
    cancelled: &'a (dyn Fn() -> bool + Sync),
}

impl Judge<'_> {
    /// Displacements of the telling point of example `k` along its force at each factor that is reached \[mm\].
    fn path(&self, bench: &mut Bench, material: u8, k: usize, factors: &[f64]) -> Vec<f64> {
        let example = &self.examples[k];
        let Some(point) = example.telling_point() else {
            return Vec::new();
        };
        let layout = vec![material; self.cells];
        let outcome = bench.press_at(&layout, k, factors, self.options, self.cancelled);
        let read = |u| self.rig.presses[k].read(point, u).dot(&example.contact.direction);
        outcome.levels.iter().map(|u| read(u)).collect()
    }

    /// How stiff the missing material is against the nearest one.
    fn scale(&self, bench: &mut Bench, shortfall: &Shortfall) -> Scale {
        let factors = &self.rig.presses[shortfall.example].factors;
        let start = factors[shortfall.level];
        let edge = shortfall.edge_mm();
        if edge <= 0.0 {
            return Scale::Rigid;
        }
        let mut give = |factor: f64, steps: &[f64]| {
            let mut all: Vec<f64> = steps
                .iter()
                .copied()
                .filter(|s| *s < factor * (1.0 - 1e-9))
                .collect();
            all.push(factor);
            let path = self.path(bench, shortfall.material, shortfall.example, &all);
            path.get(all.len() - 1).copied()
        };
        let mut steps = factors[..=shortfall.level].to_vec();
        let bracket = match shortfall.missing {
            Missing::Stiffer => Ok([(0.0, 0.0), (start, shortfall.gives_mm)]),
            Missing::Softer => climbed(&mut give, &mut steps, (start, shortfall.gives_mm), edge),
        };
        match bracket {
            Ok(bracket) => match crossing(|factor| give(factor, &steps), bracket, edge) {
                Some(factor) => Scale::Times(start / factor),
                None => Scale::Unknown,
            },
            Err(reached) => Scale::LessThan(start / reached),
        }
    }
}

/// Raises the factor until the displacement passes `edge`; the two factors on its sides with their displacements, or the
/// last factor in equilibrium. Factors passed are added to `steps`, the way to later ones.
fn climbed(
    give: &mut impl FnMut(f64, &[f64]) -> Option<f64>,
    steps: &mut Vec<f64>,
    start: (f64, f64),
    edge: f64,
) -> Result<[(f64, f64); 2], f64> {
    let (mut low, mut stride) = (start, 1.5);
    while low.0 < MOST_FORCE * start.0 && stride > 1.02 {
        let next = low.0 * stride;
        match give(next, steps) {
            Some(u) if u >= edge => return Ok([low, (next, u)]),
            Some(u) => {
                steps.push(next);
                low = (next, u);
            }
            None => stride = f64::sqrt(stride),
        }
    }
    Err(low.0)
}

/// The factor at which the displacement is `edge`, between two on its sides: regula falsi with the end that stays weighed
/// down (Illinois).
fn crossing(mut give: impl FnMut(f64) -> Option<f64>, bracket: [(f64, f64); 2], edge: f64) -> Option<f64> {
    let [mut low, mut high] = bracket.map(|(factor, u)| (factor, u - edge));
    let mut side = 0;
    let mut factor = high.0;
    for _ in 0..40 {
        factor = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
        let off = give(factor)? - edge;
        if off.abs() <= CLOSE * edge {
            return Some(factor);
        }
        if off < 0.0 {
            low = (factor, off);
            if side == -1 {
                high.1 *= 0.5;
            }
            side = -1;
        } else {
            high = (factor, off);
            if side == 1 {
                low.1 *= 0.5;
            }
            side = 1;
        }
    }
    Some(factor)
}

#[cfg(test)]
#[path = "reach_tests.rs"]
mod tests;
