//! What `pliant replicate` says of the palette's reach, and of error against mass and cost.

use super::stop;
use super::terminal::{say, warn};
use crate::design::found::FoundChoice;
use crate::design::goal::Goal;
use crate::design::misfit::Misfit;
use crate::design::pareto::{self, Against, Choice};
use crate::design::reach::{self, Reach, Scale};
use crate::design::search::{Aim, Bench, Outcome, Progress};
use crate::design::space::Space;
use crate::design::workbench::Workbench;
use crate::fem::equilibrium::Options;
use crate::fem::rig::{Layout, Rig};
use crate::report;
use serde_json::{Value, json};
use std::sync::atomic::Ordering;

/// Judges whether the goal is within the palette's reach and says at once what is not.
pub fn judge(goal: &Goal, rig: &Rig, space: &Space, quiet: bool) -> Reach {
    let usable = |m: &u8| space.allowed.iter().any(|allowed| allowed.contains(m));
    let materials: Vec<u8> = (0..goal.palette.len())
        .filter_map(|m| u8::try_from(m).ok())
        .filter(usable)
        .collect();
    let cancelled = || stop::flag().load(Ordering::Relaxed);
    let solver = Options::for_search(1e-5);
    let reach = reach::judge(
        &goal.setup.examples,
        rig,
        space.cells,
        &materials,
        &solver,
        &cancelled,
    )
    .unwrap_or_default();
    for sentence in report::reach::sentences(&reach, goal) {
        warn(&format!("warning: out of reach: {sentence}"));
    }
    if let Some(table) = report::reach::table(&reach, goal).filter(|_| !quiet) {
        say(&table);
    }
    reach
}

/// What is out of reach, for machines.
pub fn reach_json(reach: &Reach, goal: &Goal) -> Value {
    let rows = reach.shortfalls.iter().map(|s| {
        let (scale, limit) = match s.scale {
            Scale::Times(scale) => (Some(scale), None),
            Scale::LessThan(limit) => (None, Some(limit)),
            Scale::Rigid | Scale::Unknown => (None, None),
        };
        json!({
            "example": goal.setup.examples[s.example].name,
            "force_n": s.force_n,
            "asked_mm": s.asked_mm,
            "tolerance_mm": s.tolerance_mm,
            "gives_mm": s.gives_mm,
            "material": goal.palette[s.material as usize].record.id,
            "missing": s.missing,
            "stiffness_times": scale,
            "stiffness_times_less_than": limit,
            "nearest": reach.examples[s.example].iter().map(|level| json!({
                "force_n": level.force_n,
                "asked_mm": level.asked_mm,
                "nearest_mm": level.nearest_mm(),
            })).collect::<Vec<_>>(),
        })
    });
    rows.collect()
}

/// The layouts that none beats in error and mass, or error and cost.
pub struct Front {
    /// What stands against the error.
    pub against: Against,
    /// The layouts.
    pub choices: Vec<Choice>,
}

/// The sets against mass and, where the goal names prices, cost; their layouts are simulated again at the default
/// tolerance.
pub fn fronts(goal: &Goal, rig: &Rig, aim: &Aim, outcome: &Outcome) -> Vec<Front> {
    let mut fine = Workbench::new(rig, Options::default(), stop::flag(), &|_, _| {});
    let space = aim.space;
    let simulated: Vec<(Layout, Misfit)> = outcome
        .simulated
        .iter()
        .map(|r| (r.layout.clone(), r.misfit))
        .collect();
    let mut kinds = vec![Against::Mass];
    kinds.extend(goal.rules.currency.is_some().then_some(Against::Cost));
    kinds
        .into_iter()
        .map(|against| {
            let coarse = pareto::set(space, &simulated, against);
            let layouts: Vec<Layout> = coarse.iter().map(|c| c.layout.clone()).collect();
            let progress = Progress {
                phase: "refining",
                level: [0, 0],
                batch: layouts.len(),
                best_mm: outcome.best.first().map_or(f64::INFINITY, |r| r.score_mm),
                bound_mm: outcome.bound.score_mm,
            };
            let responses = fine.respond(&layouts, &progress);
            let refined: Option<Vec<(Layout, Misfit)>> = layouts
                .into_iter()
                .zip(responses)
                .map(|(layout, response)| {
                    let misfit = aim.rate(&layout, &response?).misfit;
                    Some((layout, misfit))
                })
                .collect();
            // Stopped on the way: as accurate as the search was.
            let choices = refined.map_or(coarse, |refined| pareto::set(space, &refined, against));
            Front { against, choices }
        })
        .collect()
}

/// What must be said of a layout that weighs or costs more than the goal allows, as moved layer borders can make it.
pub fn overweight(goal: &Goal, weighed: &Space, layout: &[u8]) -> Vec<String> {
    let currency = goal.rules.currency.as_deref().unwrap_or_default();
    let over = |what: &str, found: f64, most: f64, unit: &str| {
        (found > most * (1.0 + 1e-9)).then(|| {
            format!("The best layout {what} {found:.2} {unit}, more than the goal allows ({most:.2} {unit}).")
        })
    };
    let mass = over("weighs", weighed.mass_g(layout), goal.rules.most_mass_g, "g");
    let cost = over("costs", weighed.cost(layout), goal.rules.most_cost, currency);
    mass.into_iter().chain(cost).collect()
}

/// The rows of `layout.toml`.
pub fn found_choices(goal: &Goal, fronts: &[Front]) -> Vec<FoundChoice> {
    let currency = &goal.rules.currency;
    let rows = fronts.iter().flat_map(|front| {
        front.choices.iter().map(|choice| FoundChoice {
            against: front.against,
            rms_mm: choice.misfit.rms_mm,
            max_mm: choice.misfit.max_mm,
            mass_g: choice.mass_g,
            cost: currency.is_some().then_some(choice.cost),
            currency: currency.clone(),
            materials: materials(goal, &choice.layout),
        })
    });
    rows.collect()
}

/// Ids of the materials: each cell's, or with voxels, which are too many, each once.
fn materials(goal: &Goal, layout: &[u8]) -> Vec<String> {
    let mut numbers = layout.to_vec();
    if goal.voxels.is_some() {
        numbers.sort_unstable();
        numbers.dedup();
    }
    let id = |&m: &u8| goal.palette[m as usize].record.id.clone();
    numbers.iter().map(id).collect()
}

/// The page's sections: what is out of reach, and the sets.
pub fn sections(goal: &Goal, reach: &Reach, fronts: &[Front]) -> Vec<report::page::PageSection> {
    let sets = fronts
        .iter()
        .map(|front| report::pareto::section(goal, front.against, &front.choices));
    report::reach::section(reach, goal)
        .into_iter()
        .chain(sets)
        .collect()
}

/// Says the sets.
pub fn tell_fronts(goal: &Goal, fronts: &[Front]) {
    for front in fronts {
        say(&report::pareto::table(goal, front.against, &front.choices));
    }
}
