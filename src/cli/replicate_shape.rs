//! What `pliant replicate` does after the search: `--robust` ranks layouts by what is not known of their materials, and
//! `--thickness` moves the borders between the layers of the best.

use super::stop;
use crate::design::found::{Found, FoundBorders, FoundThickness};
use crate::design::goal::Goal;
use crate::design::robust::{self, Forecast, Judge};
use crate::design::search::{Aim, Outcome};
use crate::design::thickness::{self, Refined, default_least_mm, refine};
use crate::fem::rig::{Layout, Rig};
use crate::fem::rig_sensitivity::Doubt;
use crate::geometry::cells::Style;
use crate::report::page::Fact;
use crate::report::ticks::significant;
use miette::IntoDiagnostic;
use nalgebra::DMatrix;
use serde_json::{Value, json};

/// How many of the nearest layouts are judged before exchanges.
const JUDGED: usize = 50;
/// How many of the best layouts have their borders moved.
const MOVED: usize = 3;

/// What was asked for, checked.
pub(super) struct Shaping {
    robust: Option<(robust::Options, Vec<Option<Doubt>>)>,
    thickness: Option<thickness::Options>,
}

/// What came of it; nothing where nothing was asked.
#[derive(Default)]
pub(super) struct Shape {
    quantile: Option<f64>,
    /// Forecasts of the outcome's best layouts, in their order.
    forecasts: Vec<Forecast>,
    /// Modes of the best layout's response.
    pub modes: Vec<DMatrix<f64>>,
    /// Materials of the best layout without a covariance.
    known_exactly: Vec<usize>,
    /// The best layout's borders, and the least thickness that they were given.
    refined: Option<(Refined, f64)>,
    /// Did a user stop these steps?
    stopped: bool,
}

impl Shaping {
    /// Checks the options before a long search.
    pub fn asked(robust: Option<f64>, thickness: bool, seed: u64, goal: &Goal) -> miette::Result<Shaping> {
        let robust = robust
            .map(|quantile| {
                let options = robust::Options {
                    quantile,
                    seed,
                    ..robust::Options::default()
                };
                options.check()?;
                Ok::<_, robust::RobustError>((options, robust::doubts(&goal.palette)?))
            })
            .transpose()
            .into_diagnostic()?;
        let thickness = thickness.then(|| thickness::Options {
            least_mm: goal
                .least_layer_mm
                .unwrap_or_else(|| default_least_mm(&goal.setup)),
            ..thickness::Options::default()
        });
        if let Some(options) = &thickness {
            thickness::check(&goal.setup, options).into_diagnostic()?;
        }
        Ok(Shaping { robust, thickness })
    }

    /// How many of the search's layouts are needed.
    pub fn candidates(&self) -> usize {
        if self.robust.is_some() { JUDGED } else { 0 }
    }

    /// Judges and moves; the best layout, its cells and its rig become what came out. At most `listed` layouts are left. A stop
    /// keeps what the search found.
    pub fn shape(
        &self,
        goal: &mut Goal,
        rig: &mut Rig,
        aim: &Aim,
        outcome: &mut Outcome,
        listed: usize,
    ) -> miette::Result<Shape> {
        let mut shape = Shape::default();
        let target = aim.target;
        let flag = stop::flag();
        if let Some((options, doubts)) = &self.robust {
            let judge = Judge::new(rig, target, doubts.clone(), *options, flag).into_diagnostic()?;
            // Voxels have too many neighbours to exchange with: what the search simulated on its way is judged.
            if goal.voxels.is_some() {
                let near = outcome.simulated.iter().take(JUDGED);
                shape.forecasts = judge.ranked(&near.map(|r| r.layout.clone()).collect::<Vec<_>>());
            } else {
                let near = outcome.best.iter().map(|r| r.layout.clone());
                shape.forecasts = judge.improved(aim.space, &near.collect::<Vec<_>>());
            }
            shape.forecasts.truncate(listed);
            shape.quantile = Some(options.quantile);
            if !shape.forecasts.is_empty() {
                let judged = shape.forecasts.iter();
                outcome.best = judged.map(|f| aim.ranked(&f.layout, f.misfit)).collect();
            }
        }
        outcome.best.truncate(listed);
        if let Some(options) = &self.thickness {
            shape.thicken(options, goal, rig, aim, outcome)?;
        }
        if let (Some((options, doubts)), Some(best)) = (&self.robust, outcome.best.first()) {
            let judge = Judge::new(rig, target, doubts.clone(), *options, flag).into_diagnostic()?;
            let mut bench = rig.bench().into_diagnostic()?;
            let modes = judge.modes(&mut bench, &best.layout);
            shape.modes = modes.map(|(_, modes)| modes).unwrap_or_default();
            if let (Some(now), Some(first)) = (
                judge.forecast(&mut bench, &best.layout),
                shape.forecasts.first_mut(),
            ) {
                *first = now;
            }
            let unknown = judge.known_exactly().into_iter();
            shape.known_exactly = unknown.filter(|&m| best.layout.contains(&(m as u8))).collect();
        }
        let asked = self.robust.is_some() || self.thickness.is_some();
        shape.stopped = asked && flag.load(std::sync::atomic::Ordering::Relaxed);
        Ok(shape)
    }
}

impl Shape {
    fn thicken(
        &mut self,
        options: &thickness::Options,
        goal: &mut Goal,
        rig: &mut Rig,
        aim: &Aim,
        outcome: &mut Outcome,
    ) -> miette::Result<()> {
        // A layout that was chosen for its certainty stays the one.
        let count = if self.forecasts.is_empty() { MOVED } else { 1 };
        let layouts: Vec<Layout> = outcome
            .best
            .iter()
            .take(count)
            .map(|r| r.layout.clone())
            .collect();
        let refined =
            refine(rig, &goal.setup, aim.target, &layouts, options, stop::flag()).into_diagnostic()?;
        let Some(best) = refined.into_iter().next() else {
            return Ok(());
        };
        let Some(place) = outcome.best.iter().position(|r| r.layout == best.layout) else {
            return Ok(());
        };
        outcome.best.remove(place);
        outcome.best.insert(0, aim.ranked(&best.layout, best.after));
        goal.setup.cells = best.cells.clone();
        *rig = Rig::new(&goal.setup, rig.laws.clone()).into_diagnostic()?;
        self.refined = Some((best, options.least_mm));
        Ok(())
    }

    /// Writes it into the record of the search.
    pub fn note(&self, record: &mut Found) {
        record.error.quantile = self.quantile.filter(|_| !self.forecasts.is_empty());
        record.error.pessimistic_rms_mm = self.forecasts.first().map(|f| f.pessimistic_rms_mm);
        for (runner_up, forecast) in record.runner_up.iter_mut().zip(self.forecasts.iter().skip(1)) {
            runner_up.pessimistic_rms_mm = Some(forecast.pessimistic_rms_mm);
        }
        record.thickness = self.refined.as_ref().map(|(refined, least_mm)| FoundThickness {
            rms_before_mm: refined.before.rms_mm,
            least_mm: *least_mm,
            thinnest: refined.thinnest.iter().map(|&c| refined.cells.name(c)).collect(),
            region: refined
                .cells
                .regions()
                .iter()
                .map(|r| FoundBorders {
                    name: r.name.clone(),
                    borders: r.borders.clone(),
                })
                .collect(),
        });
    }

    /// A word to each of the best layouts.
    pub fn notes(&self) -> Vec<String> {
        let quantile = 100.0 * self.quantile.unwrap_or_default();
        let note = |f: &Forecast| {
            let error = significant(f.pessimistic_rms_mm, 3);
            format!("below {error} mm in {quantile} of 100 cases")
        };
        self.forecasts.iter().map(note).collect()
    }

    /// Lines for the report and the terminal.
    pub fn facts(&self, goal: &Goal) -> Vec<Fact> {
        let mut facts = Vec::new();
        if let (Some(quantile), Some(best)) = (self.quantile, self.forecasts.first()) {
            facts.push(Fact::new(
                "pessimistic error",
                format!(
                    "{} mm RMS, not exceeded in {} of 100 cases as far as the materials' fits can tell; {} mm with the materials as fitted",
                    significant(best.pessimistic_rms_mm, 3),
                    100.0 * quantile,
                    significant(best.misfit.rms_mm, 3)
                ),
            ));
        }
        let Some((refined, _)) = &self.refined else {
            return facts;
        };
        facts.push(Fact::new(
            "error by moving borders",
            format!(
                "{} mm RMS, {} mm with equal layers",
                significant(refined.after.rms_mm, 3),
                significant(refined.before.rms_mm, 3)
            ),
        ));
        let cells = &refined.cells;
        let mut cell = 0;
        for (region, drawn) in cells.regions().iter().zip(cells.drawn_borders()) {
            let height = match region.style {
                Style::Follow => 100.0,
                Style::Flat => 1.0,
            };
            let unit = match region.style {
                Style::Follow => "% of the height",
                Style::Flat => "mm",
            };
            for (now, before) in region.borders.windows(2).zip(drawn.windows(2)) {
                let thickness = |pair: &[f64]| significant(height * (pair[1] - pair[0]), 4);
                facts.push(Fact::new(
                    format!("thickness of {}", goal.setup.cells.name(cell)),
                    format!("{} {unit}, drawn {}", thickness(now), thickness(before)),
                ));
                cell += 1;
            }
        }
        facts
    }

    /// What the reader must know.
    pub fn warnings(&self, goal: &Goal) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.stopped {
            warnings.push("--robust and --thickness were stopped before their end: what they had not done is as the search left it.".into());
        }
        if !self.known_exactly.is_empty() {
            let names: Vec<&str> = self
                .known_exactly
                .iter()
                .map(|&m| goal.palette[m].record.name.as_str())
                .collect();
            warnings.push(format!(
                "How well the fit determines {} is not recorded: no band is drawn for it. `pliant db refit` makes it.",
                names.join(", ")
            ));
        }
        if let Some((refined, least_mm)) = self.refined.as_ref().filter(|(r, _)| !r.thinnest.is_empty()) {
            let names: Vec<String> = refined.thinnest.iter().map(|&c| refined.cells.name(c)).collect();
            warnings.push(format!(
                "As thin as layers may be ({least_mm} mm): {}. The object may do without.",
                names.join(", ")
            ));
        }
        warnings
    }

    /// Adds it to the answer for machines.
    pub fn put(&self, answer: &mut Value) {
        if let Some(best) = self.forecasts.first() {
            answer["quantile"] = json!(self.quantile);
            answer["pessimistic_rms_mm"] = json!(best.pessimistic_rms_mm);
        }
        if let Some((refined, least_mm)) = &self.refined {
            let borders =
                |r: &crate::geometry::cells::LayeredRegion| json!({"name": r.name, "borders": r.borders});
            answer["thickness"] = json!({
                "rms_before_mm": refined.before.rms_mm,
                "least_mm": least_mm,
                "thinnest": refined.thinnest.iter().map(|&c| refined.cells.name(c)).collect::<Vec<_>>(),
                "regions": refined.cells.regions().iter().map(borders).collect::<Vec<_>>(),
            });
        }
    }
}
