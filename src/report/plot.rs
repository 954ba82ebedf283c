//! Curves in a frame: force against displacement above all, the target in black marks, what was found in a solid line,
//! and the base materials' own curves dotted beside them (as in the thesis' figure 8.11).

use super::colour::Colour;
use super::svg::{self, Anchor, Drawing, Stroke, Svg, Type};
use super::ticks::{Ticks, axis_range, drawable};

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A strong line: what the plot is about.
    Solid,
    /// A dashed line: something to compare with.
    Dashed,
    /// A thin dotted line: the background, which may leave the frame.
    Dotted,
    /// Filled circles: measured points.
    Marks,
}

/// Named points. A point that is not finite interrupts a line and has no mark.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// What the legend says.
    pub name: String,
    /// The points `(n × 2)`, in the units of the axes, in the order in which the line goes through them.
    pub points: Vec<[f64; 2]>,
    /// How they are drawn.
    pub style: Style,
    /// Their colour; lines of light colours are darkened until they can be seen on white.
    pub colour: Colour,
    /// A shaded band about the line: lower and upper y of each point `(n × 2)`. Empty for none.
    pub band: Vec<[f64; 2]>,
}

impl Series {
    /// A series without a band.
    pub fn new(name: impl Into<String>, points: Vec<[f64; 2]>, style: Style, colour: Colour) -> Self {
        Self {
            name: name.into(),
            points,
            style,
            colour,
            band: Vec::new(),
        }
    }

    /// What was measured or asked for: black marks.
    pub fn target(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, Style::Marks, Colour::qualitative(0))
    }

    /// What was found: a solid vermilion line.
    pub fn prediction(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self::new(name, points, Style::Solid, Colour::qualitative(2))
    }

    /// What one base material alone would do: thin dots in its display colour.
    pub fn base_material(name: impl Into<String>, points: Vec<[f64; 2]>, colour: Colour) -> Self {
        Self::new(name, points, Style::Dotted, colour)
    }

    /// The same with a band about it.
    pub fn with_band(self, band: Vec<[f64; 2]>) -> Self {
        Self { band, ..self }
    }
}

/// Curves over one pair of axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinePlot {
    /// Above the frame; may be empty.
    pub title: String,
    /// Quantity and unit, as in `force [N]`.
    pub x_label: String,
    /// Quantity and unit, as in `displacement [mm]`.
    pub y_label: String,
    /// What is drawn, the last on top, but marks over lines and lines over dots.
    pub series: Vec<Series>,
    /// The ends of the x axis; `None` for what the series need.
    pub x_limits: Option<[f64; 2]>,
    /// The ends of the y axis; `None` for what the series need.
    pub y_limits: Option<[f64; 2]>,
}

/// A linear scale from a quantity to pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// The quantity at the two ends.
    pub range: [f64; 2],
    /// The pixel coordinate at the two ends.
    pub pixels: [f64; 2],
}

impl Axis {
    /// The pixel coordinate of a value.
    pub fn at(&self, value: f64) -> f64 {
        let fraction = (value - self.range[0]) / (self.range[1] - self.range[0]);
        self.pixels[0] + fraction * (self.pixels[1] - self.pixels[0])
    }
}

/// Width of a plot \[px\]. The height follows from the legend.
pub const WIDTH: f64 = 600.0;
const FRAME_HEIGHT: f64 = 300.0;
const TEXT: f64 = 13.0;
const LEGEND_ROW: f64 = 20.0;
/// Room for the line sample beside a name in the legend.
const SAMPLE: f64 = 34.0;

impl LinePlot {
    /// An empty plot.
    pub fn new(title: impl Into<String>, x_label: impl Into<String>, y_label: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            x_label: x_label.into(),
            y_label: y_label.into(),
            ..Self::default()
        }
    }

    /// Target against prediction, force on the x axis \[N\] and displacement on the y axis \[mm\], with the base
    /// materials behind them. The axes are made for the first two; a very soft material leaves the frame.
    pub fn force_displacement(
        title: impl Into<String>,
        target: Series,
        prediction: Series,
        base: Vec<Series>,
    ) -> Self {
        let mut plot = Self::new(title, "force [N]", "displacement [mm]");
        plot.series = base;
        plot.series.push(prediction);
        plot.series.push(target);
        plot.focused(2.0)
    }

    /// The same with one more series.
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Ends the y axis where the series that are not dotted end, or at `reach` times that if dotted ones go so far.
    pub fn focused(mut self, reach: f64) -> Self {
        let strong = self.series.iter().filter(|series| series.style != Style::Dotted);
        let strong = axis_range(strong.flat_map(|series| series.points.iter().map(|point| point[1])));
        let whole = axis_range(
            self.series
                .iter()
                .flat_map(|series| series.points.iter().map(|point| point[1])),
        );
        let any_strong = self
            .series
            .iter()
            .any(|series| series.style != Style::Dotted && !series.points.is_empty());
        if any_strong && reach >= 1.0 {
            let low = whole[0].max(reach * strong[0].min(0.0)).min(strong[0]);
            let high = whole[1].min(reach * strong[1].max(0.0)).max(strong[1]);
            self.y_limits = Some([low, high]);
        }
        self
    }

    /// The scales of the two axes, x then y, as they are drawn.
    pub fn axes(&self) -> [Axis; 2] {
        let drawn = || {
            self.series
                .iter()
                .flat_map(|series| series.points.iter())
                .filter(|point| visible(point))
        };
        let bands = self
            .series
            .iter()
            .flat_map(|series| series.band.iter().flatten().copied());
        let x_range = checked(self.x_limits).unwrap_or_else(|| axis_range(drawn().map(|point| point[0])));
        let y_range =
            checked(self.y_limits).unwrap_or_else(|| axis_range(drawn().map(|point| point[1]).chain(bands)));
        let ticks = Ticks::between(y_range[0], y_range[1], 5);
        let widest = ticks
            .values
            .iter()
            .map(|tick| svg::text_width(&ticks.label(*tick), 12.0))
            .fold(0.0, f64::max);
        let left = 14.0 + if self.y_label.is_empty() { 0.0 } else { 20.0 } + widest;
        let top = self.top();
        [
            Axis {
                range: x_range,
                pixels: [left, WIDTH - 18.0],
            },
            Axis {
                range: y_range,
                pixels: [top + FRAME_HEIGHT, top],
            },
        ]
    }

    fn top(&self) -> f64 {
        if self.title.is_empty() { 14.0 } else { 40.0 }
    }

    /// The drawing.
    pub fn svg(&self) -> Svg {
        let axes = self.axes();
        let bottom = axes[1].pixels[0] + 26.0 + if self.x_label.is_empty() { 0.0 } else { 20.0 };
        let legend = Legend::of(&self.series, axes[0].pixels);
        let mut drawing = Drawing::new(WIDTH, bottom + legend.height() + 8.0);
        draw_grid(&mut drawing, axes);
        for series in &self.series {
            draw_band(&mut drawing, series, axes);
        }
        for layer in [
            &[Style::Dotted][..],
            &[Style::Dashed, Style::Solid],
            &[Style::Marks],
        ] {
            for (index, series) in self
                .series
                .iter()
                .enumerate()
                .filter(|(_, series)| layer.contains(&series.style))
            {
                draw_series(&mut drawing, series, index, axes);
            }
        }
        let middle = 0.5 * (axes[0].pixels[0] + axes[0].pixels[1]);
        let title = svg::fitted(&self.title, 15.0, WIDTH - axes[0].pixels[0] - 8.0);
        drawing.text(
            [axes[0].pixels[0], 24.0],
            &title,
            Type {
                bold: true,
                ..Type::of(15.0)
            },
            false,
        );
        let label = Type::of(TEXT).anchored(Anchor::Middle);
        drawing.text([middle, axes[1].pixels[0] + 40.0], &self.x_label, label, false);
        let height = 0.5 * (axes[1].pixels[0] + axes[1].pixels[1]);
        drawing.text([18.0, height], &self.y_label, label, true);
        legend.draw(&mut drawing, &self.series, bottom);
        drawing.finish(&self.title)
    }
}

fn visible(point: &[f64; 2]) -> bool {
    point.iter().all(|value| drawable(*value))
}

fn checked(limits: Option<[f64; 2]>) -> Option<[f64; 2]> {
    limits.filter(|[low, high]| drawable(*low) && drawable(*high) && high - low > 1e-90)
}

/// Frame, grid lines and tick labels.
fn draw_grid(drawing: &mut Drawing, [x, y]: [Axis; 2]) {
    let small = Type::of(12.0).coloured(svg::SOFT_INK);
    let grid = Stroke::solid(svg::GRID, 1.0);
    let ticks = Ticks::between(x.range[0], x.range[1], 6);
    for tick in &ticks.values {
        let at = x.at(*tick);
        drawing.line(&[[at, y.pixels[0]], [at, y.pixels[1]]], grid);
        let label = small.anchored(Anchor::Middle);
        drawing.text([at, y.pixels[0] + 18.0], &ticks.label(*tick), label, false);
    }
    let ticks = Ticks::between(y.range[0], y.range[1], 5);
    for tick in &ticks.values {
        let at = y.at(*tick);
        drawing.line(&[[x.pixels[0], at], [x.pixels[1], at]], grid);
        drawing.text(
            [x.pixels[0] - 7.0, at + 4.2],
            &ticks.label(*tick),
            small.anchored(Anchor::End),
            false,
        );
    }
    let rule = Stroke::solid(svg::SOFT_INK, 1.0);
    drawing.line(
        &[
            [x.pixels[0], y.pixels[1]],
            [x.pixels[0], y.pixels[0]],
            [x.pixels[1], y.pixels[0]],
        ],
        rule,
    );
}

fn draw_band(drawing: &mut Drawing, series: &Series, [x, y]: [Axis; 2]) {
    let edges = series
        .points
        .iter()
        .zip(&series.band)
        .filter(|(point, edge)| visible(point) && visible(edge));
    let inside = |[px, py]: [f64; 2]| {
        [
            px.clamp(x.pixels[0], x.pixels[1]),
            py.clamp(y.pixels[1], y.pixels[0]),
        ]
    };
    let lower = edges
        .clone()
        .map(|(point, edge)| inside([x.at(point[0]), y.at(edge[0])]));
    let upper = edges
        .rev()
        .map(|(point, edge)| inside([x.at(point[0]), y.at(edge[1])]));
    drawing.polygon(&lower.chain(upper).collect::<Vec<_>>(), series.colour, 0.16);
}

fn draw_series(drawing: &mut Drawing, series: &Series, index: usize, axes: [Axis; 2]) {
    let colour = series.colour.on_white();
    let place = |point: &[f64; 2]| [axes[0].at(point[0]), axes[1].at(point[1])];
    for run in series.points.split(|point| !visible(point)) {
        let places: Vec<[f64; 2]> = run.iter().map(place).collect();
        let alone = places.len() == 1;
        if series.style == Style::Marks || alone {
            let radius = if series.style == Style::Dotted { 2.5 } else { 4.2 };
            for dot in places.iter().filter(|place| inside(place, axes)) {
                drawing.dot(*dot, radius, colour);
            }
        } else {
            for piece in clipped(&places, axes) {
                drawing.line(&piece, stroke(series.style, colour, index));
            }
        }
    }
}

fn stroke(style: Style, colour: Colour, index: usize) -> Stroke {
    match style {
        Style::Solid | Style::Marks => Stroke::solid(colour, 2.4),
        Style::Dashed => Stroke {
            colour,
            width: 1.8,
            dashes: "7 5",
        },
        // Three rhythms of dots, so that neighbours differ in more than colour.
        Style::Dotted => Stroke {
            colour,
            width: 1.5,
            dashes: ["0.1 3.6", "2.5 3.5", "0.1 6"][index % 3],
        },
    }
}

fn inside(place: &[f64; 2], [x, y]: [Axis; 2]) -> bool {
    // Half a pixel of rounding: a point on the frame is inside.
    place[0] >= x.pixels[0] - 0.5
        && place[0] <= x.pixels[1] + 0.5
        && place[1] >= y.pixels[1] - 0.5
        && place[1] <= y.pixels[0] + 0.5
}

/// The parts of a line that are inside the frame.
fn clipped(line: &[[f64; 2]], [x, y]: [Axis; 2]) -> Vec<Vec<[f64; 2]>> {
    let low = [x.pixels[0], y.pixels[1]];
    let high = [x.pixels[1], y.pixels[0]];
    let mut pieces: Vec<Vec<[f64; 2]>> = Vec::new();
    for pair in line.windows(2) {
        let Some([start, end]) = clipped_segment(pair[0], pair[1], low, high) else {
            continue;
        };
        match pieces.last_mut() {
            Some(piece) if piece.last() == Some(&start) => piece.push(end),
            _ => pieces.push(vec![start, end]),
        }
    }
    pieces
}

/// The part of a segment inside a box (Liang and Barsky, 1984): the overlap of the parameter ranges of its two slabs.
fn clipped_segment(from: [f64; 2], to: [f64; 2], low: [f64; 2], high: [f64; 2]) -> Option<[[f64; 2]; 2]> {
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let way = to[axis] - from[axis];
        if way == 0.0 {
            if from[axis] < low[axis] || from[axis] > high[axis] {
                return None;
            }
            continue;
        }
        let (a, b) = ((low[axis] - from[axis]) / way, (high[axis] - from[axis]) / way);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    let at = |t: f64| match t {
        0.0 => from,
        1.0 => to,
        t => [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])],
    };
    (enter <= leave).then(|| [at(enter), at(leave)])
}

/// The names below the frame, in as many columns as fit.
struct Legend {
    left: f64,
    column: f64,
    columns: usize,
    order: Vec<usize>,
}

impl Legend {
    fn of(series: &[Series], [left, right]: [f64; 2]) -> Self {
        let widest = series
            .iter()
            .map(|series| svg::text_width(&series.name, 12.0))
            .fold(0.0, f64::max);
        let column = (SAMPLE + widest + 18.0).min(right - left);
        let columns = ((right - left) / column).floor().clamp(1.0, 4.0) as usize;
        let rank = |style: Style| match style {
            Style::Marks => 0,
            Style::Solid => 1,
            Style::Dashed => 2,
            Style::Dotted => 3,
        };
        let mut order: Vec<usize> = (0..series.len())
            .filter(|index| !series[*index].name.is_empty())
            .collect();
        order.sort_by_key(|index| rank(series[*index].style));
        Self {
            left,
            column: (right - left) / columns as f64,
            columns,
            order,
        }
    }

    fn height(&self) -> f64 {
        self.order.len().div_ceil(self.columns) as f64 * LEGEND_ROW
            + if self.order.is_empty() { 0.0 } else { 6.0 }
    }

    fn draw(&self, drawing: &mut Drawing, series: &[Series], top: f64) {
        for (place, index) in self.order.iter().enumerate() {
            let series = &series[*index];
            let x = self.left + (place % self.columns) as f64 * self.column;
            let y = top + 16.0 + (place / self.columns) as f64 * LEGEND_ROW;
            let colour = series.colour.on_white();
            if series.style == Style::Marks {
                drawing.dot([x + 13.0, y - 4.0], 4.2, colour);
            } else {
                drawing.line(
                    &[[x, y - 4.0], [x + 26.0, y - 4.0]],
                    stroke(series.style, colour, *index),
                );
            }
            let name = svg::fitted(&series.name, 12.0, self.column - SAMPLE - 8.0);
            drawing.text([x + SAMPLE, y], &name, Type::of(12.0), false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<[f64; 2]>) -> LinePlot {
        LinePlot::new("title", "x", "y").with(Series::prediction("found", points))
    }

    #[test]
    fn data_go_to_the_pixels_of_their_ticks() {
        let mut plot = plot(vec![[0.0, 0.0], [10.0, 4.0]]);
        (plot.x_limits, plot.y_limits) = (Some([0.0, 10.0]), Some([0.0, 4.0]));
        let [x, y] = plot.axes();
        assert_eq!(x.at(0.0), x.pixels[0]);
        assert_eq!(x.at(10.0), x.pixels[1]);
        assert!((x.at(2.5) - (0.75 * x.pixels[0] + 0.25 * x.pixels[1])).abs() < 1e-9);
        // Up is more: the frame is 300 px high, so 1 of 4 is 75 px above the bottom.
        assert!((y.pixels[0] - y.at(1.0) - 75.0).abs() < 1e-9);
        assert!(y.at(3.0) < y.at(1.0));
    }

    #[test]
    fn gaps_lone_points_and_nothing_at_all_are_drawn() {
        let broken = vec![
            [0.0, 0.0],
            [1.0, f64::NAN],
            [2.0, 1.0],
            [3.0, 2.0],
            [f64::INFINITY, 3.0],
        ];
        let svg = plot(broken).svg();
        assert!(!svg.as_str().contains("NaN") && !svg.as_str().contains("inf"));
        // One lone point, and a run of two in one line of the prediction's colour (and its legend sample).
        assert_eq!(svg.as_str().matches("<circle").count(), 1);
        assert_eq!(svg.as_str().matches("stroke=\"#d55e00\"").count(), 2);
        for points in [
            vec![],
            vec![[1.0, 1.0]],
            vec![[f64::NAN, f64::NAN]],
            vec![[1e300, -1e300], [0.0, 1.0]],
        ] {
            let svg = plot(points).svg();
            assert!(svg.as_str().ends_with("</svg>") && !svg.as_str().contains("NaN"));
        }
    }

    #[test]
    fn lines_end_at_the_frame() {
        let mut plot = plot(vec![[0.0, 0.0], [1.0, 10.0]]);
        plot.y_limits = Some([0.0, 5.0]);
        let axes = plot.axes();
        let places = [
            [axes[0].at(0.0), axes[1].at(0.0)],
            [axes[0].at(1.0), axes[1].at(10.0)],
        ];
        let pieces = clipped(&places, axes);
        assert_eq!(pieces.len(), 1);
        // The line leaves through the top (y = 5) where x = 0.5.
        let end = pieces[0][1];
        assert!((end[0] - axes[0].at(0.5)).abs() < 1e-9 && (end[1] - axes[1].pixels[1]).abs() < 1e-9);
        assert!(clipped_segment([-2.0, 0.5], [-1.0, 0.5], [0.0, 0.0], [1.0, 1.0]).is_none());
        assert!(clipped_segment([-1.0, 0.5], [0.5, 2.5], [0.0, 0.0], [1.0, 1.0]).is_none());
    }

    #[test]
    fn soft_materials_do_not_squash_the_target() {
        let line = |slope: f64| vec![[0.0, 0.0], [20.0, 20.0 * slope]];
        let soft = Series::base_material("soft", line(10.0), Colour::qualitative(3));
        let plot = LinePlot::force_displacement(
            "toe",
            Series::target("target", line(0.1)),
            Series::prediction("found", line(0.11)),
            vec![soft],
        );
        let [_, y] = plot.axes();
        // Strong curves end at 2.2 (4 % of air above: 2.288); twice that at most, far below the soft curve's 200.
        assert_eq!(y.range[0], 0.0);
        assert!((y.range[1] - 2.0 * 2.288).abs() < 1e-9, "{:?}", y.range);
    }

    #[test]
    fn a_band_is_drawn_once_between_its_edges() {
        let series =
            Series::prediction("fit", vec![[0.0, 1.0], [1.0, 2.0]]).with_band(vec![[0.5, 1.5], [1.5, 2.5]]);
        let svg = LinePlot::new("", "", "").with(series).svg();
        assert_eq!(svg.as_str().matches("fill-opacity").count(), 1);
    }
}
