//! What the palette can do against what the goal asks, in words, a table and a plot.

use super::page::{Figure, PageSection};
use super::plot::{LinePlot, Series, Style};
use super::table::{Look, drawn};
use super::ticks::significant;
use crate::design::goal::Goal;
use crate::design::reach::{Level, Missing, Reach, Scale, Shortfall};
use crate::report::colour::Colour;

/// A sentence for each shortfall, as in `heel at 15 N: asked 9.2 mm, the softest material (…) gives 6.1 mm: a material of 0.62
/// times its stiffness is missing`.
pub fn sentences(reach: &Reach, goal: &Goal) -> Vec<String> {
    reach.shortfalls.iter().map(|s| sentence(s, goal)).collect()
}

fn sentence(shortfall: &Shortfall, goal: &Goal) -> String {
    let (extreme, word) = match shortfall.missing {
        Missing::Softer => ("softest", "softer"),
        Missing::Stiffer => ("stiffest", "stiffer"),
    };
    let band = if shortfall.tolerance_mm > 0.0 {
        format!(" ± {}", significant(shortfall.tolerance_mm, 2))
    } else {
        String::new()
    };
    let missing = match shortfall.scale {
        Scale::Times(s) => format!(
            "a material of {} times its stiffness is missing",
            significant(s, 2)
        ),
        Scale::LessThan(s) => {
            format!(
                "a material of less than {} times its stiffness is missing",
                significant(s, 2)
            )
        }
        Scale::Rigid => "no stiffness is enough for this".to_string(),
        Scale::Unknown => format!("a {word} material is missing"),
    };
    format!(
        "{} at {} N: asked {}{band} mm, the {extreme} material alone ({}) gives {} mm: {missing}",
        goal.setup.examples[shortfall.example].name,
        significant(shortfall.force_n, 3),
        significant(shortfall.asked_mm, 3),
        goal.palette[shortfall.material as usize].record.id,
        significant(shortfall.gives_mm, 3),
    )
}

const HEADER: [&str; 6] = [
    "example",
    "force N",
    "asked mm",
    "stiffest alone mm",
    "softest alone mm",
    "nearest mm",
];

/// The numbers of the examples that are out of reach.
fn rows(reach: &Reach, goal: &Goal) -> Vec<Vec<String>> {
    let number = |value: Option<f64>| significant(value.unwrap_or(f64::NAN), 3);
    let mut rows = Vec::new();
    for k in out_of_reach(reach) {
        for level in &reach.examples[k] {
            rows.push(vec![
                goal.setup.examples[k].name.clone(),
                significant(level.force_n, 3),
                number(level.asked_mm),
                number(level.stiffest_mm),
                number(level.softest_mm),
                number(level.nearest_mm()),
            ]);
        }
    }
    rows
}

fn out_of_reach(reach: &Reach) -> Vec<usize> {
    let mut examples: Vec<usize> = reach.shortfalls.iter().map(|s| s.example).collect();
    examples.dedup();
    examples
}

/// The table for the terminal; `None` if all is within reach.
pub fn table(reach: &Reach, goal: &Goal) -> Option<String> {
    let rows = rows(reach, goal);
    (!rows.is_empty()).then(|| drawn(&HEADER, rows.into_iter(), &[0], Look::of_standard_output()))
}

/// The page's section; `None` if all is within reach.
pub fn section(reach: &Reach, goal: &Goal) -> Option<PageSection> {
    let rows = rows(reach, goal);
    if rows.is_empty() {
        return None;
    }
    let figure = |k: usize| figure(&goal.setup.examples[k].name, &reach.examples[k]);
    Some(PageSection {
        heading: "Out of reach".into(),
        note: format!(
            "{}. Judged along the force, by the object made of each material alone; mixed layouts are expected in between. \
             Nearest: the displacement in reach that is nearest to the one asked for; a dash: a material has no equilibrium there, so that nothing bounds it.",
            sentences(reach, goal).join(". ")
        ),
        figures: out_of_reach(reach).into_iter().map(figure).collect(),
        header: HEADER.map(String::from).to_vec(),
        rows,
        words: vec![0],
    })
}

/// Target, nearest curve in reach, and the band between the palette's extremes.
fn figure(name: &str, levels: &[Level]) -> Figure {
    let curve = |of: &dyn Fn(&Level) -> Option<f64>| -> Vec<[f64; 2]> {
        let points = levels
            .iter()
            .filter_map(|level| Some([level.force_n, of(level)?]));
        std::iter::once([0.0, 0.0]).chain(points).collect()
    };
    let target = levels
        .iter()
        .filter_map(|level| Some([level.force_n, level.asked_mm?]));
    let mut plot = LinePlot::new(
        format!("{name}: what the palette can reach"),
        "force [N]",
        "displacement [mm]",
    );
    let ends = [
        ("stiffest material alone", curve(&|l| l.stiffest_mm)),
        ("softest material alone", curve(&|l| l.softest_mm)),
    ];
    for (index, (name, points)) in ends.into_iter().enumerate() {
        plot.series.push(Series::new(
            name,
            points,
            Style::Dashed,
            Colour::qualitative(3 + index),
        ));
    }
    plot.series.push(Series::new(
        "nearest in reach",
        curve(&Level::nearest_mm),
        Style::Solid,
        Colour::qualitative(2),
    ));
    plot.series.push(Series::target("target", target.collect()));
    let caption = "Between the dashed curves lies what layouts of this palette are expected to give.";
    Figure::new(format!("reach-{name}"), plot.svg(), caption)
}
