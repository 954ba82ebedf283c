//! Errors side by side: one horizontal bar for each thing compared.

use super::colour::Colour;
use super::svg::{self, Anchor, Drawing, Stroke, Svg, Type};
use super::ticks::{Ticks, drawable, extent, significant};

/// One bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// What it stands for.
    pub name: String,
    /// Its length, in the unit of the plot; one that is not finite is written as `–`.
    pub value: f64,
    /// Its colour.
    pub colour: Colour,
}

/// Bars from zero, the first on top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BarPlot {
    /// Above the bars; may be empty.
    pub title: String,
    /// Quantity and unit, as in `RMS error [mm]`.
    pub value_label: String,
    /// The bars.
    pub bars: Vec<Bar>,
    /// A value to compare with, and its name: a dashed line across.
    pub mark: Option<(f64, String)>,
}

const WIDTH: f64 = super::plot::WIDTH;
const ROW: f64 = 26.0;

impl Bar {
    /// Draws the bar in a row whose upper edge is at `y`, its name to the left and its value to the right.
    fn draw(&self, drawing: &mut Drawing, axis: &super::plot::Axis, y: f64) {
        let name = svg::fitted(&self.name, 12.5, axis.pixels[0] - 20.0);
        drawing.text(
            [axis.pixels[0] - 8.0, y + 17.5],
            &name,
            Type::of(12.5).anchored(Anchor::End),
            false,
        );
        let value = if drawable(self.value) { self.value } else { 0.0 };
        let (from, to) = (axis.at(value.min(0.0)), axis.at(value.max(0.0)));
        drawing.rectangle(
            [from, y + 5.0],
            [to - from, ROW - 10.0],
            0.0,
            self.colour.on_white(),
        );
        let label = Type {
            rim: true,
            ..Type::of(12.0)
        };
        drawing.text([to + 6.0, y + 17.5], &significant(self.value, 3), label, false);
    }
}

impl BarPlot {
    /// A plot without bars.
    pub fn new(title: impl Into<String>, value_label: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            value_label: value_label.into(),
            ..Self::default()
        }
    }

    /// The same with one more bar.
    pub fn with(mut self, name: impl Into<String>, value: f64, colour: Colour) -> Self {
        self.bars.push(Bar {
            name: name.into(),
            value,
            colour,
        });
        self
    }

    /// The drawing.
    pub fn svg(&self) -> Svg {
        let names = self
            .bars
            .iter()
            .map(|bar| svg::text_width(&bar.name, 12.5))
            .fold(0.0, f64::max);
        let (left, right) = (24.0 + names.min(0.45 * WIDTH), WIDTH - 70.0);
        let mark = self.mark.as_ref().filter(|(value, _)| drawable(*value));
        let values = self
            .bars
            .iter()
            .map(|bar| bar.value)
            .chain(mark.map(|(value, _)| *value));
        let [low, high] = extent(values.chain([0.0])).unwrap_or([0.0, 1.0]);
        let high = if high - low < 1e-90 { low + 1.0 } else { high };
        let axis = super::plot::Axis {
            range: [low, high],
            pixels: [left, right],
        };
        let top = if self.title.is_empty() { 12.0 } else { 40.0 } + if mark.is_some() { 16.0 } else { 0.0 };
        let bottom = top + ROW * self.bars.len() as f64;
        let mut drawing = Drawing::new(WIDTH, bottom + 50.0);
        let title = svg::fitted(&self.title, 15.0, WIDTH - 40.0);
        drawing.text(
            [16.0, 24.0],
            &title,
            Type {
                bold: true,
                ..Type::of(15.0)
            },
            false,
        );
        let small = Type::of(12.0).coloured(svg::SOFT_INK).anchored(Anchor::Middle);
        let ticks = Ticks::between(low, high, 5);
        for tick in &ticks.values {
            let x = axis.at(*tick);
            drawing.line(&[[x, top], [x, bottom]], Stroke::solid(svg::GRID, 1.0));
            drawing.text([x, bottom + 18.0], &ticks.label(*tick), small, false);
        }
        for (index, bar) in self.bars.iter().enumerate() {
            bar.draw(&mut drawing, &axis, top + ROW * index as f64);
        }
        drawing.line(
            &[[axis.at(0.0), top], [axis.at(0.0), bottom]],
            Stroke::solid(svg::SOFT_INK, 1.0),
        );
        if let Some((value, name)) = mark {
            let x = axis.at(*value);
            let stroke = Stroke {
                colour: svg::SOFT_INK,
                width: 1.4,
                dashes: "5 4",
            };
            drawing.line(&[[x, top - 6.0], [x, bottom]], stroke);
            let anchor = if x > 0.5 * (left + right) {
                Anchor::End
            } else {
                Anchor::Start
            };
            drawing.text([x, top - 10.0], name, small.anchored(anchor), false);
        }
        let middle = 0.5 * (left + right);
        drawing.text(
            [middle, bottom + 40.0],
            &self.value_label,
            Type::of(13.0).anchored(Anchor::Middle),
            false,
        );
        drawing.finish(&self.title)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_their_values() {
        let colour = Colour::qualitative(1);
        let svg = BarPlot::new("", "mm")
            .with("a", 2.0, colour)
            .with("b", 1.0, colour)
            .svg();
        let widths: Vec<f64> = svg
            .as_str()
            .lines()
            .filter(|line| line.starts_with("<rect") && line.contains("#0072b2"))
            .filter_map(|line| line.split("width=\"").nth(1)?.split('"').next()?.parse().ok())
            .collect();
        assert_eq!(widths.len(), 2);
        // Written with two decimals.
        assert!((widths[0] - 2.0 * widths[1]).abs() < 0.02, "{widths:?}");
    }

    #[test]
    fn odd_values_do_no_harm() {
        let colour = Colour::qualitative(1);
        for values in [
            vec![],
            vec![f64::NAN],
            vec![0.0],
            vec![-1.0, f64::INFINITY],
            vec![1e300],
        ] {
            let mut plot = BarPlot::new("t", "mm");
            plot.mark = Some((f64::NAN, "none".to_owned()));
            for value in values {
                plot = plot.with("bar", value, colour);
            }
            let svg = plot.svg();
            assert!(!svg.as_str().contains("NaN") && !svg.as_str().contains("inf"));
        }
    }
}
