//! Plots of coupon fits: measured points with the fitted law and its band, what is left between the two, and several
//! laws beyond the range.

use super::colour::Colour;
use super::plot::{LinePlot, Series, Style};
use super::svg::Svg;
use crate::fitting::coupon::bootstrap::Bootstrap;
use crate::fitting::coupon::compare::{Comparison, beyond};
use crate::fitting::coupon::file::LawChoice;
use crate::fitting::coupon::fit::{CouponTest, stress_errors};
use crate::fitting::coupon::record::Fitted;
use crate::fitting::coupon::state::response;
use crate::material::law::Law;

/// Marks of one test; more would hide the line behind them.
const MARKS: usize = 25;
/// Points of a law's line.
const LINE: usize = 80;
/// Laws that miss the tests by more are left out of the drawing; the table has them.
const WORTH_DRAWING: f64 = 0.2;
/// A law beyond the range may leave the frame at so many times the measured stress.
const REACH: f64 = 2.5;

/// One unit of stress for a whole plot.
struct Unit {
    factor: f64,
    label: &'static str,
}

/// kPa for soft materials, so that the axis has no leading zeros.
fn unit_of<'a>(tests: impl Iterator<Item = &'a CouponTest>) -> Unit {
    let largest = tests
        .flat_map(|t| &t.curve.stress)
        .fold(0.0_f64, |m, p| m.max(p.abs()));
    if largest < 0.1 {
        Unit {
            factor: 1e3,
            label: "nominal stress [kPa]",
        }
    } else {
        Unit {
            factor: 1.0,
            label: "nominal stress [MPa]",
        }
    }
}

fn percent(strain: f64) -> f64 {
    100.0 * strain
}

/// Every few points of a test; `late` starts half a gap later, so that two like curves don't hide each other.
fn marks(test: &CouponTest, unit: &Unit, late: bool) -> Vec<[f64; 2]> {
    let step = test.curve.strain.len().div_ceil(MARKS).max(1);
    let points = test.curve.strain.iter().zip(&test.curve.stress);
    points
        .skip(if late { step / 2 } else { 0 })
        .step_by(step)
        .map(|(e, p)| [percent(*e), unit.factor * p])
        .collect()
}

/// The law's stress from rest to the strain `end` of a test.
fn line(law: &Law, test: &CouponTest, end: f64, unit: &Unit) -> Vec<[f64; 2]> {
    (0..=LINE)
        .map(|i| {
            let e = end * i as f64 / LINE as f64;
            [percent(e), unit.factor * response(law, test.kind, e).stress]
        })
        .collect()
}

fn furthest(test: &CouponTest) -> f64 {
    let strains = test.curve.strain.iter();
    strains.fold(0.0, |end: f64, &e| if e.abs() > end.abs() { e } else { end })
}

/// Measured points, the fitted law, and its band where there is one; held-out tests beside them. None for a material that
/// was not measured.
pub fn stress_plot(fitted: &Fitted, bootstrap: Option<&Bootstrap>) -> Option<Svg> {
    let fit = fitted.fit.as_ref()?;
    let held = fitted.held_out.iter().map(|h| &h.test);
    let unit = unit_of(fitted.tests.iter().chain(held));
    let title = format!("{}: {}", fitted.record.name, fit.choice.word());
    let mut plot = LinePlot::new(title, "engineering strain, or shear [%]", unit.label);
    for (k, test) in fitted.tests.iter().enumerate() {
        let colour = Colour::qualitative(k + 1);
        let word = test.kind.word();
        let mut law = Series::new(
            format!("{word}, {}", fit.choice.word()),
            line(&fit.law, test, furthest(test), &unit),
            Style::Solid,
            colour,
        );
        if let Some(band) = bootstrap.and_then(|b| b.bands.get(k)) {
            let inside = |e: &f64| e.abs() <= furthest(test).abs() * (1.0 + 1e-9);
            let (points, edges): (Vec<_>, Vec<_>) = band
                .strain
                .iter()
                .zip(&band.stress)
                .filter(|(e, _)| inside(e))
                .map(|(e, [low, high])| {
                    let stress = response(&fit.law, test.kind, *e).stress;
                    let edges = [unit.factor * low, unit.factor * high];
                    ([percent(*e), unit.factor * stress], edges)
                })
                .unzip();
            law.points = points;
            law.band = edges;
        }
        plot = plot.with(law);
        plot = plot.with(Series::new(
            format!("{word}, measured"),
            marks(test, &unit, false),
            Style::Marks,
            colour,
        ));
    }
    for held in &fitted.held_out {
        let name = format!("{}, held out ({})", held.test.kind.word(), held.file);
        plot = plot.with(Series::new(
            name,
            marks(&held.test, &unit, true),
            Style::Marks,
            Colour::qualitative(0),
        ));
        // The line ends where the fitted tests end; a held-out one may go further.
        let end = furthest(&held.test);
        if fitted
            .tests
            .iter()
            .all(|t| furthest(t).abs() < 0.99 * end.abs() || t.kind != held.test.kind)
        {
            plot = plot.with(Series::new(
                format!("{}, extrapolated", held.test.kind.word()),
                line(&fit.law, &held.test, end, &unit),
                Style::Dashed,
                Colour::qualitative(0),
            ));
        }
    }
    Some(plot.svg())
}

/// The law's stress less the measured one, in percent of the test's RMS stress.
pub fn error_plot(fitted: &Fitted) -> Option<Svg> {
    let fit = fitted.fit.as_ref()?;
    let title = format!("{}: what {} leaves", fitted.record.name, fit.choice.word());
    let mut plot = LinePlot::new(
        title,
        "engineering strain, or shear [%]",
        "law less measured [% of the RMS stress]",
    );
    let errors = |test: &CouponTest| -> Vec<[f64; 2]> {
        let squares: f64 = test.curve.stress.iter().map(|p| p * p).sum();
        let size = (squares / test.curve.stress.len().max(1) as f64).sqrt();
        let errors = stress_errors(&fit.law, test);
        let points = test.curve.strain.iter().zip(errors);
        points
            .map(|(e, error)| [percent(*e), 100.0 * error / size])
            .collect()
    };
    for (k, test) in fitted.tests.iter().enumerate() {
        let series = Series::new(
            test.kind.word(),
            errors(test),
            Style::Solid,
            Colour::qualitative(k + 1),
        );
        plot = plot.with(series);
    }
    for held in &fitted.held_out {
        let name = format!("{}, held out ({})", held.test.kind.word(), held.file);
        plot = plot.with(Series::new(
            name,
            errors(&held.test),
            Style::Dashed,
            Colour::qualitative(0),
        ));
    }
    Some(plot.svg())
}

/// The laws of a comparison that come near the tests, to 1.5 times the range, over the measured points.
pub fn laws_plot(fitted: &Fitted, comparison: &Comparison) -> Svg {
    let unit = unit_of(fitted.tests.iter());
    let title = format!("{}: laws beyond the range", fitted.record.name);
    let mut plot = LinePlot::new(title, "engineering strain, or shear [%]", unit.label);
    for (k, row) in comparison.rows.iter().enumerate() {
        let chosen = comparison.outside == Some(k);
        if row.fit.relative_rms > WORTH_DRAWING && !chosen {
            continue;
        }
        let mut points = Vec::new();
        for test in &fitted.tests {
            points.extend(line(&row.fit.law, test, beyond(test), &unit));
            points.push([f64::NAN; 2]);
        }
        let style = match (chosen, row.fit.choice) {
            (true, _) => Style::Solid,
            (false, LawChoice::Rbf) => Style::Dotted,
            (false, _) => Style::Dashed,
        };
        let mark = if chosen { ", chosen beyond the range" } else { "" };
        let name = format!("{}{mark}", row.fit.choice.word());
        plot = plot.with(Series::new(name, points, style, Colour::qualitative(k + 1)));
    }
    let mut measured = Vec::new();
    let (mut low, mut high) = (0.0_f64, 0.0_f64);
    for test in &fitted.tests {
        measured.extend(marks(test, &unit, false));
        for p in &test.curve.stress {
            low = low.min(REACH * unit.factor * p);
            high = high.max(REACH * unit.factor * p);
        }
    }
    plot = plot.with(Series::target("measured", measured));
    let [_, axis] = plot.axes();
    plot.y_limits = Some([axis.range[0].max(low), axis.range[1].min(high)]);
    plot.svg()
}
