//! What a fit to presses looks like: the table of errors by force (the thesis' Table 8.1), force–displacement curves with their
//! bands, and the errors of the markers where they are on the specimen.

use super::colour::{Colour, sequential};
use super::legend::{ColourBar, Legend};
use super::page::{Fact, Figure, facts, figures, section};
use super::plot::{LinePlot, Series, Style, WIDTH};
use super::style::STYLE;
use super::svg::{Anchor, Drawing, Stroke, Svg, Type};
use super::table::{Look, drawn};
use super::ticks::{duration, fixed, significant};
use crate::fitting::probe::errors::{Errors, LevelErrors, MarkerErrors};
use crate::fitting::probe::fit::{ProbeFit, Tangential};
use crate::fitting::probe::spread::{PressCurve, WEAK};
use crate::math::Vec3;
use maud::{DOCTYPE, PreEscaped, html};

const HEADER: [&str; 8] = [
    "examples",
    "force",
    "N",
    "average mm",
    "std. dev. mm",
    "max mm",
    "of mm",
    "markers",
];

fn row(group: &str, level: &LevelErrors) -> Vec<String> {
    let [low, high] = level.forces_n;
    let force = if high - low <= 1e-9 * high.abs() {
        significant(high, 3)
    } else {
        format!("{}–{}", significant(low, 3), significant(high, 3))
    };
    vec![
        group.to_string(),
        level.size.to_string(),
        force,
        significant(level.average_mm, 3),
        significant(level.deviation_mm, 3),
        significant(level.largest_mm, 3),
        significant(level.displacement_mm, 3),
        level.markers.to_string(),
    ]
}

fn rows(fit: &ProbeFit) -> Vec<Vec<String>> {
    let mut rows: Vec<Vec<String>> = fit.errors.levels.iter().map(|l| row("fitted", l)).collect();
    if let Some(Ok(errors)) = &fit.held_out {
        rows.extend(errors.levels.iter().map(|l| row("held out", l)));
    }
    rows
}

/// The table of errors by force for a terminal or a file.
pub fn table(fit: &ProbeFit, look: Look) -> String {
    drawn(&HEADER, rows(fit).into_iter(), &[0, 1], look)
}

/// What the reader must know before believing the rest; empty where all is well.
pub fn warnings(fit: &ProbeFit) -> Vec<String> {
    let mut list = Vec::new();
    if !fit.has_converged() {
        list.push(format!("not converged: {}", fit.stop));
    }
    if !fit.has_settled {
        list.push("the centres had not settled when the rounds ended".to_string());
    }
    if let Some(Err(failure)) = &fit.held_out {
        list.push(format!(
            "the held-out examples cannot be compared: the law does not stand them ({failure})"
        ));
    }
    let Some(spread) = &fit.spread else {
        list.push("too few readings for a covariance".to_string());
        return list;
    };
    let weak = spread.deviations.iter().filter(|(_, d)| *d > WEAK);
    for (name, deviation) in weak {
        let words = if deviation.is_finite() {
            format!("± {deviation:.2}")
        } else {
            "nothing".to_string()
        };
        list.push(format!("the data hardly determine {name} ({words})"));
    }
    list.extend(
        spread
            .at_bound
            .iter()
            .map(|name| format!("{name} is at its bound")),
    );
    list
}

/// Facts of the fit in lines, as `name: value`.
pub fn summary(fit: &ProbeFit) -> Vec<Fact> {
    let centres = fit.rounds.last().map_or(0, |r| r.centres);
    let evaluations: usize = fit.rounds.iter().map(|r| r.evaluations).sum();
    let tangential = match &fit.tangential {
        Tangential::Off => "not estimated".to_string(),
        Tangential::Untold => "no marker under a probe tells them".to_string(),
        Tangential::Dropped => "estimated and dropped: the other markers were no better for them".to_string(),
        Tangential::Used { forces, elsewhere } => {
            let largest = forces.iter().flat_map(|(_, f)| f).map(Vec3::norm);
            format!(
                "estimated, up to {} N; error of the other markers {} → {} standard deviations",
                significant(largest.fold(0.0, f64::max), 3),
                significant(elsewhere[0], 3),
                significant(elsewhere[1], 3)
            )
        }
    };
    let mut list = vec![
        Fact::new("readings fitted", fit.readings),
        Fact::new(
            "error",
            format!(
                "{} mm RMS, {} % of the displacements; largest {} mm",
                significant(fit.errors.rms_mm, 3),
                fixed(100.0 * fit.errors.relative(), 2),
                significant(fit.errors.largest_mm, 3)
            ),
        ),
        Fact::new("centres", centres),
        Fact::new("tangential forces", tangential),
        Fact::new("stopped", fit.stop),
        Fact::new(
            "work",
            format!(
                "{} minimisations, {evaluations} laws, {} start(s), {}",
                fit.rounds.len(),
                fit.starts,
                duration(fit.seconds)
            ),
        ),
    ];
    if let Some(Ok(errors)) = &fit.held_out {
        let words = format!(
            "{} mm RMS, {} % of the displacements; largest {} mm",
            significant(errors.rms_mm, 3),
            fixed(100.0 * errors.relative(), 2),
            significant(errors.largest_mm, 3)
        );
        list.insert(2, Fact::new("error, held out", words));
    }
    if let Some(spread) = &fit.spread {
        list.push(Fact::new("uncertainty from", &spread.basis));
    }
    list
}

/// Force and displacement of the marker nearest to the probe, measured and fitted, and of the contact point with its band.
pub fn curve_plot(curve: &PressCurve) -> Svg {
    let with_rest = |values: &mut dyn Iterator<Item = f64>| -> Vec<[f64; 2]> {
        let points = curve.forces_n.iter().copied().zip(values).map(|(f, x)| [f, x]);
        std::iter::once([0.0, 0.0]).chain(points).collect()
    };
    let title = match curve.held_out {
        true => format!("{} (held out)", curve.press),
        false => curve.press.clone(),
    };
    let mut plot = LinePlot::new(title, "force [N]", "displacement along the probe [mm]");
    let mut contact = Series::new(
        "contact point, fitted",
        with_rest(&mut curve.fitted_mm.iter().copied()),
        Style::Dashed,
        Colour::qualitative(1),
    );
    if !curve.band_mm.is_empty() {
        let band = std::iter::once([0.0; 2]).chain(curve.band_mm.iter().copied());
        contact = contact.with_band(band.collect());
        contact.name = "contact point, fitted, with its 95 % band".into();
    }
    plot.series.push(contact);
    if !curve.marker_mm.is_empty() {
        plot.series.push(Series::prediction(
            "nearest marker, fitted",
            with_rest(&mut curve.marker_mm.iter().map(|m| m.0)),
        ));
        let measured = curve.forces_n.iter().zip(&curve.marker_mm);
        let points = measured.filter_map(|(f, m)| Some([*f, m.1?])).collect();
        plot.series
            .push(Series::target("nearest marker, measured", points));
    }
    plot.svg()
}

/// Errors of the markers over their places, seen from above and from the front; the colour is the RMS over the levels.
pub fn marker_map(title: &str, errors: &Errors) -> Svg {
    const PANEL: f64 = 270.0;
    let largest = errors
        .markers
        .iter()
        .map(MarkerErrors::rms_mm)
        .fold(f64::MIN_POSITIVE, f64::max);
    let nothing = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (low, high) = errors
        .markers
        .iter()
        .fold(nothing, |(l, h), m| (l.inf(&m.place), h.sup(&m.place)));
    let legend = Legend::Scale(ColourBar {
        quantity: "error of the marker".into(),
        unit: "mm".into(),
        range: [0.0, largest],
        unknown: false,
    });
    let widest = (high - low).max().max(1e-9);
    let scale = (PANEL - 20.0) / widest;
    let height = 40.0 + scale * (high.y - low.y).max(high.z - low.z).max(0.0) + 50.0;
    let mut drawing = Drawing::new(WIDTH, height + legend.height());
    drawing.text(
        [WIDTH / 2.0, 20.0],
        title,
        Type::of(13.0).anchored(Anchor::Middle),
        false,
    );
    for (panel, (axis, words)) in [(1, "from above (x, y)"), (2, "from the front (x, z)")]
        .into_iter()
        .enumerate()
    {
        let left = 20.0 + panel as f64 * (WIDTH / 2.0);
        let bottom = height - 34.0;
        let at = |x: &Vec3| {
            [
                left + scale * (x.x - low.x),
                bottom - scale * (x[axis] - low[axis]),
            ]
        };
        let [right, top] = at(&high);
        drawing.frame(
            [left - 8.0, top - 8.0],
            [right - left + 16.0, bottom - top + 16.0],
            Stroke::solid(Colour::rgb(0xb8, 0xb8, 0xb8), 1.0),
        );
        for marker in &errors.markers {
            let colour = sequential(marker.rms_mm() / largest);
            drawing.dot(at(&marker.place), 4.0, colour);
        }
        let middle = 0.5 * (left + right);
        drawing.text(
            [middle, bottom + 26.0],
            words,
            Type::of(12.0).anchored(Anchor::Middle),
            false,
        );
    }
    legend.draw(&mut drawing, height);
    drawing.finish(title)
}

/// All drawings of a fit, with names for files.
pub fn drawings(fit: &ProbeFit) -> Vec<Figure> {
    let mut list: Vec<Figure> = fit
        .curves
        .iter()
        .enumerate()
        .map(|(k, curve)| Figure::new(format!("curve-{}", k + 1), curve_plot(curve), ""))
        .collect();
    list.push(Figure::new(
        "markers",
        marker_map("Fitted examples", &fit.errors),
        "Root mean square of each marker's error over the levels, all examples over one another.",
    ));
    if let Some(Ok(errors)) = &fit.held_out {
        list.push(Figure::new(
            "markers-held-out",
            marker_map("Held-out examples", errors),
            "",
        ));
    }
    list
}

/// The page of a fit: an HTML document without anything from elsewhere.
pub fn page(title: &str, fit: &ProbeFit) -> String {
    let (maps, curves): (Vec<Figure>, Vec<Figure>) = drawings(fit)
        .into_iter()
        .partition(|f| f.name.starts_with("markers"));
    let warnings = warnings(fit);
    let worst = worst_markers(fit);
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content="pliant";
                title { (title) " – fitted" }
                style { (PreEscaped(STYLE)) }
            }
            body { main {
                p.kicker { "fitted material" }
                h1 { (title) }
                @if !warnings.is_empty() {
                    div.warnings { strong { "Before you believe it" } ul { @for w in &warnings { li { (w) } } } }
                }
                (facts(&summary(fit)))
                (section("Errors by force", true, html_table(&HEADER, &rows(fit), 2)))
                (section("Force and displacement", !curves.is_empty(), figures(&curves)))
                (section("Where the markers are off", true, figures(&maps)))
                (section("The markers that are off most", !worst.is_empty(), html_table(&WORST, &worst, 1)))
                (section("Parameters", true, html_table(&PARAMETERS, &parameters(fit), 1)))
                (section("Minimisations", true, html_table(&ROUNDS, &minimisations(fit), 1)))
            } }
        }
    };
    page.into_string()
}

const WORST: [&str; 5] = ["example", "marker", "place mm", "RMS mm", "largest mm"];
const PARAMETERS: [&str; 4] = ["parameter", "value", "std. dev.", "unit"];
const ROUNDS: [&str; 6] = [
    "stage",
    "centres",
    "error, standard deviations",
    "steps",
    "laws",
    "stopped",
];

fn worst_markers(fit: &ProbeFit) -> Vec<Vec<String>> {
    let held_out = match &fit.held_out {
        Some(Ok(errors)) => errors.markers.as_slice(),
        _ => &[],
    };
    let mut markers: Vec<&MarkerErrors> = fit.errors.markers.iter().chain(held_out).collect();
    markers.sort_by(|a, b| b.rms_mm().total_cmp(&a.rms_mm()));
    let row = |m: &&MarkerErrors| {
        let largest = m.errors_mm.iter().flatten().copied().fold(0.0, f64::max);
        vec![
            m.press.clone(),
            (m.point + 1).to_string(),
            format!("({:.1}, {:.1}, {:.1})", m.place.x, m.place.y, m.place.z),
            significant(m.rms_mm(), 3),
            significant(largest, 3),
        ]
    };
    markers.iter().take(12).map(row).collect()
}

fn parameters(fit: &ProbeFit) -> Vec<Vec<String>> {
    let deviation = |k: usize| {
        fit.spread
            .as_ref()
            .map_or(f64::NAN, |s| s.covariance[(k, k)].max(0.0).sqrt())
    };
    let all = fit.law.parameters().into_iter().enumerate();
    all.map(|(k, p)| {
        vec![
            p.name,
            significant(p.value, 5),
            significant(deviation(k), 2),
            p.unit.to_string(),
        ]
    })
    .collect()
}

fn minimisations(fit: &ProbeFit) -> Vec<Vec<String>> {
    let row = |r: &crate::fitting::probe::fit::Round| {
        vec![
            r.stage.clone(),
            r.centres.to_string(),
            significant(r.scaled_rms, 4),
            r.iterations.to_string(),
            r.evaluations.to_string(),
            r.stop.to_string(),
        ]
    };
    fit.rounds.iter().map(row).collect()
}

/// The first `words` columns to the left, the others as numbers.
fn html_table(header: &[&str], rows: &[Vec<String>], words: usize) -> maud::Markup {
    html! {
        div.scroll { table {
            thead { tr { @for (i, h) in header.iter().enumerate() { th.number[i >= words] { (h) } } } }
            tbody { @for row in rows {
                tr { @for (i, cell) in row.iter().enumerate() { td.number[i >= words] { (cell) } } }
            } }
        } }
    }
}
