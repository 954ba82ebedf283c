//! What the colours of a picture mean: names beside chips, or a bar from the smallest value to the largest.

use super::colour::{Colour, NO_VALUE, sequential};
use super::plot::{Axis, WIDTH};
use super::raster::fraction;
use super::svg::{self, Anchor, Drawing, Stroke, Type};
use super::ticks::{Ticks, significant};

/// How the colours of a quantity are read.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourBar {
    /// The quantity's name.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// The values at the two ends.
    pub range: [f64; 2],
    /// Whether some places have no value.
    pub unknown: bool,
}

/// What the colours of a picture mean.
#[derive(Clone, Debug, PartialEq)]
pub enum Legend {
    /// Names and colours of parts.
    Parts(Vec<(String, Colour)>),
    /// A scale of values.
    Scale(ColourBar),
}

const ROW: f64 = 21.0;

impl Legend {
    /// The height that it takes \[px\].
    pub(super) fn height(&self) -> f64 {
        match self {
            Self::Parts(entries) => entries.len().div_ceil(columns(entries)) as f64 * ROW + 6.0,
            Self::Scale(_) => 66.0,
        }
    }

    /// Draws it below `top`.
    pub(super) fn draw(&self, drawing: &mut Drawing, top: f64) {
        match self {
            Self::Parts(entries) => draw_entries(drawing, entries, top),
            Self::Scale(bar) => draw_bar(drawing, bar, top + 4.0),
        }
    }
}

fn columns(entries: &[(String, Colour)]) -> usize {
    let widest = entries
        .iter()
        .map(|(name, _)| svg::text_width(name, 12.5))
        .fold(0.0, f64::max);
    ((WIDTH - 32.0) / (widest + 44.0)).floor().clamp(1.0, 4.0) as usize
}

fn draw_entries(drawing: &mut Drawing, entries: &[(String, Colour)], top: f64) {
    let columns = columns(entries);
    let width = (WIDTH - 32.0) / columns as f64;
    for (index, (name, colour)) in entries.iter().enumerate() {
        let x = 16.0 + (index % columns) as f64 * width;
        let y = top + 14.0 + (index / columns) as f64 * ROW;
        drawing.rectangle([x, y - 11.0], [14.0, 14.0], 3.0, *colour);
        drawing.frame(
            [x + 0.5, y - 10.5],
            [13.0, 13.0],
            Stroke::solid(svg::SOFT_INK, 0.6),
        );
        drawing.text(
            [x + 22.0, y],
            &svg::fitted(name, 12.5, width - 30.0),
            Type::of(12.5),
            false,
        );
    }
}

fn draw_bar(drawing: &mut Drawing, bar: &ColourBar, top: f64) {
    let small = Type::of(12.0).coloured(svg::SOFT_INK);
    let unit = if bar.unit.is_empty() {
        String::new()
    } else {
        format!(" [{}]", bar.unit)
    };
    drawing.text(
        [16.0, top + 8.0],
        &format!("{}{unit}", bar.quantity),
        Type::of(13.0),
        false,
    );
    if bar.unknown {
        drawing.rectangle([WIDTH - 84.0, top - 3.0], [12.0, 12.0], 2.0, NO_VALUE);
        drawing.text([WIDTH - 67.0, top + 8.0], "no value", small, false);
    }
    let axis = bar_axis(bar.range);
    let (left, right) = (axis.pixels[0], axis.pixels[1]);
    let steps = 71;
    let width = (right - left) / f64::from(steps);
    for step in 0..steps {
        let x = left + f64::from(step) * width;
        let colour = sequential(fraction(f64::from(step) + 0.5, [0.0, f64::from(steps)]));
        // A little overlap, so that no seams show between them.
        let overlap = if step + 1 < steps { 0.6 } else { 0.0 };
        drawing.rectangle([x, top + 16.0], [width + overlap, 14.0], 0.0, colour);
    }
    let mark = Stroke::solid(svg::SOFT_INK, 1.0);
    let mut labels = bar_labels(bar.range);
    labels.dedup_by(|later, earlier| later.1 == earlier.1);
    for (value, label) in labels {
        let x = if bar.range[1] > bar.range[0] {
            axis.at(value)
        } else {
            left
        };
        drawing.line(&[[x, top + 30.0], [x, top + 34.0]], mark);
        drawing.text([x, top + 47.0], &label, small.anchored(Anchor::Middle), false);
    }
}

fn bar_axis(range: [f64; 2]) -> Axis {
    Axis {
        range,
        pixels: [28.0, WIDTH - 28.0],
    }
}

/// The values written on a colour bar: both ends, and round ones between that don't crowd them.
fn bar_labels([low, high]: [f64; 2]) -> Vec<(f64, String)> {
    let end = |value: f64| {
        let text = significant(value, 3);
        let short = text.trim_end_matches('0').trim_end_matches('.');
        if text.contains('.') && !text.contains('×') {
            short.to_owned()
        } else {
            text
        }
    };
    let mut labels = vec![(low, end(low))];
    if high > low {
        let ticks = Ticks::between(low, high, 5);
        let clear = 0.09 * (high - low);
        let between = ticks
            .values
            .iter()
            .filter(|tick| **tick - low > clear && high - **tick > clear);
        labels.extend(between.map(|tick| (*tick, ticks.label(*tick))));
        labels.push((high, end(high)));
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_is_labelled_from_end_to_end() {
        let range = [0.137, 2.46];
        let labels = bar_labels(range);
        assert_eq!(labels.first().map(|label| label.1.as_str()), Some("0.137"));
        assert_eq!(labels.last().map(|label| label.1.as_str()), Some("2.46"));
        assert!(labels.windows(2).all(|pair| pair[0].0 < pair[1].0), "{labels:?}");
        assert_eq!(bar_axis(range).at(0.137), 28.0);
        assert_eq!(bar_axis(range).at(2.46), WIDTH - 28.0);
        assert_eq!(bar_labels([3.0, 3.0]).len(), 1);
    }
}
