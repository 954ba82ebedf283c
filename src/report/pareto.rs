//! Error against mass and cost: the layouts that none beats in both, as a table and a plot.

use super::colour::Colour;
use super::layouts::{CellChoice, LayoutRow};
use super::page::{Figure, PageSection};
use super::plot::{LinePlot, Series, Style};
use super::replicate::shares;
use super::table::{Look, drawn};
use super::ticks::significant;
use crate::design::goal::Goal;
use crate::design::pareto::{Against, Choice};

/// The table for the terminal.
pub fn table(goal: &Goal, against: Against, choices: &[Choice]) -> String {
    let header = header(goal);
    let names: Vec<&str> = header.iter().map(String::as_str).collect();
    let words = [header.len() - 1];
    let rows = rows(goal, choices).into_iter();
    format!(
        "{}:\n{}",
        heading(against),
        drawn(&names, rows, &words, Look::of_standard_output())
    )
}

/// The page's section.
pub fn section(goal: &Goal, against: Against, choices: &[Choice]) -> PageSection {
    let header = header(goal);
    PageSection {
        heading: heading(against).into(),
        note: format!(
            "Of the simulated layouts those that no other beats in both error and {}. Layouts that the search did not look at may beat them.",
            word(against)
        ),
        figures: vec![figure(goal, against, choices)],
        words: vec![header.len() - 1],
        header,
        rows: rows(goal, choices),
    }
}

fn word(against: Against) -> &'static str {
    match against {
        Against::Mass => "mass",
        Against::Cost => "cost",
    }
}

fn heading(against: Against) -> &'static str {
    match against {
        Against::Mass => "Error against mass",
        Against::Cost => "Error against cost",
    }
}

fn header(goal: &Goal) -> Vec<String> {
    let mut header = vec!["RMS mm".to_string(), "max mm".into(), "mass g".into()];
    header.extend(goal.rules.currency.as_ref().map(|c| format!("cost {c}")));
    header.push("materials".into());
    header
}

fn rows(goal: &Goal, choices: &[Choice]) -> Vec<Vec<String>> {
    let row = |choice: &Choice| {
        let mut row = vec![
            significant(choice.misfit.rms_mm, 3),
            significant(choice.misfit.max_mm, 3),
            significant(choice.mass_g, 4),
        ];
        row.extend(goal.rules.currency.is_some().then(|| significant(choice.cost, 4)));
        row.push(materials(goal, &choice.layout));
        row
    };
    choices.iter().map(row).collect()
}

fn materials(goal: &Goal, layout: &[u8]) -> String {
    if goal.setup.cells.has_voxels() {
        let name = |m: u8| &goal.palette[m as usize].record.name;
        let words: Vec<String> = shares(layout, goal.palette.len())
            .map(|(m, percent)| format!("{percent:.1} % {}", name(m)))
            .collect();
        return words.join("; ");
    }
    let cells = layout.iter().enumerate().map(|(cell, &m)| {
        let record = &goal.palette[m as usize].record;
        CellChoice {
            cell: goal.setup.cells.name(cell),
            material: record.name.clone(),
            colour: Colour::from_hex(&record.colour).unwrap_or(super::colour::NO_VALUE),
        }
    });
    let row = LayoutRow {
        rank: None,
        note: String::new(),
        cells: cells.collect(),
        rms_mm: f64::NAN,
        rms_percent: f64::NAN,
        max_mm: f64::NAN,
        max_percent: f64::NAN,
        mass_g: None,
    };
    let runs = row.runs();
    let words: Vec<String> = runs
        .iter()
        .map(|run| format!("{}: {}", run.cell, run.material))
        .collect();
    words.join("; ")
}

/// Error over mass or cost: what is to be had for a given amount is the step at or to the left of it.
fn figure(goal: &Goal, against: Against, choices: &[Choice]) -> Figure {
    let unit = match (against, &goal.rules.currency) {
        (Against::Mass, _) => "g",
        (Against::Cost, currency) => currency.as_deref().unwrap_or("–"),
    };
    let points: Vec<[f64; 2]> = choices
        .iter()
        .map(|c| [c.against(against), c.misfit.rms_mm])
        .collect();
    let mut steps = Vec::new();
    for pair in points.windows(2) {
        steps.extend([pair[0], [pair[1][0], pair[0][1]]]);
    }
    steps.extend(points.last());
    let plot = LinePlot::new(
        heading(against),
        format!("{} [{unit}]", word(against)),
        "RMS error [mm]",
    )
    .with(Series::new(
        "least error for this much",
        steps,
        Style::Dashed,
        Colour::qualitative(2),
    ))
    .with(Series::new(
        "layouts",
        points,
        Style::Marks,
        Colour::qualitative(0),
    ));
    let caption = format!(
        "Each mark is a layout that no simulated one beats in error and {}.",
        word(against)
    );
    Figure::new(format!("pareto-{}", word(against)), plot.svg(), caption)
}
