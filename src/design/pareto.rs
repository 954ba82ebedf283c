//! Error against mass or cost: the layouts that are not beaten in both.
//!
//! Layout a *beats* b if its error and its mass (or cost) are at most those of b, and one of them is less. The set holds the
//! layouts, of those that were simulated and may be built, that none beats. It says nothing of layouts that the search never
//! looked at.

use super::misfit::Misfit;
use super::space::Space;
use crate::fem::rig::Layout;

/// What stands against the error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Against {
    /// The object's mass \[g\].
    Mass,
    /// Its cost, in the goal's currency.
    Cost,
}

/// A layout of the set.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Material of each cell.
    pub layout: Layout,
    /// Its error.
    pub misfit: Misfit,
    /// Its mass \[g\].
    pub mass_g: f64,
    /// Its cost, in the goal's currency.
    pub cost: f64,
}

impl Choice {
    /// A layout with what it weighs and costs.
    pub fn new(space: &Space, layout: &[u8], misfit: Misfit) -> Choice {
        Choice {
            layout: layout.to_vec(),
            misfit,
            mass_g: space.mass_g(layout),
            cost: space.cost(layout),
        }
    }

    /// Its mass or cost.
    pub fn against(&self, against: Against) -> f64 {
        match against {
            Against::Mass => self.mass_g,
            Against::Cost => self.cost,
        }
    }
}

/// The layouts of `simulated` that none beats, from the lightest or cheapest on; of equals the first by its materials. Layouts
/// that may not be built, or have no equilibrium, are left out.
pub fn set(space: &Space, simulated: &[(Layout, Misfit)], against: Against) -> Vec<Choice> {
    let mut all: Vec<Choice> = simulated
        .iter()
        .filter(|(layout, misfit)| misfit.rms_mm.is_finite() && space.allows(layout))
        .map(|(layout, misfit)| Choice::new(space, layout, *misfit))
        .collect();
    all.sort_by(|a, b| {
        let by_price = a.against(against).total_cmp(&b.against(against));
        by_price
            .then(a.misfit.rms_mm.total_cmp(&b.misfit.rms_mm))
            .then_with(|| a.layout.cmp(&b.layout))
    });
    let mut best = f64::INFINITY;
    all.retain(|choice| {
        let is_better = choice.misfit.rms_mm < best;
        best = best.min(choice.misfit.rms_mm);
        is_better
    });
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn space() -> Space {
        Space {
            volumes_cm3: vec![1.0, 2.0, 1.0],
            densities_g_per_cm3: vec![1.0, 1.5, 2.0],
            prices_per_cm3: vec![3.0, 1.0, 2.0],
            apart: vec![[0, 2]],
            touching: vec![vec![1], vec![0, 2], vec![1]],
            ..Space::free(3, 3)
        }
    }

    proptest! {
        /// Errors in steps, so that there are ties; every tenth layout fails.
        #[test]
        fn the_set_is_what_none_beats(steps in prop::collection::vec(0u8..10, 27), by_cost in any::<bool>()) {
            let against = if by_cost { Against::Cost } else { Against::Mass };
            let simulated: Vec<(Layout, Misfit)> = steps
                .iter()
                .enumerate()
                .map(|(n, &step)| {
                    let layout = vec![(n % 3) as u8, (n / 3 % 3) as u8, (n / 9) as u8];
                    let rms_mm = f64::from(step);
                    (layout, if step == 9 { Misfit::FAILED } else { Misfit { rms_mm, max_mm: rms_mm } })
                })
                .collect();
            let found = set(&space(), &simulated, against);
            let of = |l: &[u8]| Choice::new(&space(), l, Misfit::FAILED).against(against);
            let may: Vec<&(Layout, Misfit)> =
                simulated.iter().filter(|(l, m)| m.rms_mm < 9.0 && space().allows(l)).collect();
            let beats = |a: &(Layout, Misfit), b: &(Layout, Misfit)| {
                let (ea, eb, pa, pb) = (a.1.rms_mm, b.1.rms_mm, of(&a.0), of(&b.0));
                ea <= eb && pa <= pb && (ea < eb || pa < pb)
            };
            for candidate in &may {
                let is_in = found.iter().any(|c| c.layout == candidate.0);
                let has_twin = found.iter().any(|c| {
                    c.misfit.rms_mm == candidate.1.rms_mm && c.against(against) == of(&candidate.0)
                });
                let is_beaten = may.iter().any(|other| beats(other, candidate));
                prop_assert_eq!(has_twin, !is_beaten);
                prop_assert!(!is_in || has_twin);
            }
            prop_assert!(found.iter().all(|c| space().allows(&c.layout)));
            prop_assert!(found.windows(2).all(|w| w[0].against(against) < w[1].against(against)));
        }
    }
}
