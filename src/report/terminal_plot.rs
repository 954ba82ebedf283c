//! The curves of a [`LinePlot`] in letters, for a terminal: dots of Braille, eight to a letter, or plain ASCII.

use super::plot::{Axis, LinePlot, Series, Style};
use super::ticks::Ticks;

/// What the curves are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Glyphs {
    /// Braille patterns, for terminals that show Unicode.
    Braille,
    /// Letters of ASCII, for everything else.
    Ascii,
}

/// Rows of the frame.
const ROWS: usize = 16;
/// Between a tick's label and the frame.
const GAP: usize = 1;
/// Steps of a line in one letter: fine enough that no dot is left out.
const STEPS: usize = 8;

/// The plot as lines of text, at most `columns` letters wide (40 at least), each ended by a newline but the last. Several
/// named lines are told apart by letters; dotted ones are drawn thin.
pub fn terminal_plot(plot: &LinePlot, columns: usize, glyphs: Glyphs) -> String {
    let [x, y] = plot.axes().map(|axis| axis.range);
    let ticks = Ticks::between(y[0], y[1], 4);
    let labels: Vec<String> = ticks.values.iter().map(|t| ticks.label(*t)).collect();
    let margin = labels.iter().map(|l| l.chars().count()).max().unwrap_or(0) + GAP;
    let width = columns.clamp(40, 200).saturating_sub(margin + 1).max(10);
    let mut canvas = Canvas::new(width, glyphs, x, y);
    canvas.zero_lines();
    let names = letters(plot);
    for series in plot.series.iter().filter(|s| s.style == Style::Dotted) {
        canvas.line(series, '.');
    }
    for (series, letter) in plot.series.iter().zip(&names) {
        if series.style != Style::Dotted {
            canvas.line(series, letter.unwrap_or('*'));
        }
    }
    for (series, letter) in plot.series.iter().zip(&names) {
        if let (Some(letter), Glyphs::Braille) = (letter, glyphs) {
            canvas.name(series, *letter);
        }
    }
    let mut lines = vec![plot.y_label.clone()];
    for row in 0..ROWS {
        let tick = (0..labels.len()).find(|i| canvas.row(ticks.values[*i]) == Some(row));
        let label = tick.map_or("", |i| labels[i].as_str());
        lines.push(format!(
            "{label:>0$}{1}{2}",
            margin - GAP,
            canvas.edge(),
            canvas.text(row)
        ));
    }
    lines.push(format!("{:margin$}{}", "", canvas.floor(width)));
    lines.push(format!("{:1$}{2}", "", margin + 1, x_labels(x, width)));
    lines.push(format!("{:>1$}", plot.x_label, margin + 1 + width));
    lines.extend(legend(plot, &names, glyphs));
    let lines: Vec<&str> = lines.iter().map(|l| l.trim_end()).collect();
    match glyphs {
        Glyphs::Braille => lines.join("\n"),
        Glyphs::Ascii => plain(&lines.join("\n")),
    }
}

/// The marks of labels in ASCII; what has no such form becomes a question mark.
fn plain(text: &str) -> String {
    let text = text
        .replace('−', "-")
        .replace('±', "+-")
        .replace('–', "-")
        .replace("ν", "nu");
    text.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect()
}

/// A letter for each line that the legend names, where there are several.
fn letters(plot: &LinePlot) -> Vec<Option<char>> {
    let named = |s: &Series| s.style != Style::Dotted && !s.name.is_empty();
    let several = plot.series.iter().filter(|s| named(s)).count() > 1;
    let mut next = ('A'..='Z').chain('a'..='z').cycle();
    plot.series
        .iter()
        .map(|s| if several && named(s) { next.next() } else { None })
        .collect()
}

fn legend(plot: &LinePlot, names: &[Option<char>], glyphs: Glyphs) -> Vec<String> {
    let line = |(series, letter): (&Series, &Option<char>)| {
        let sample = match (letter, series.style, glyphs) {
            (Some(letter), ..) => letter.to_string(),
            (None, Style::Dotted, Glyphs::Braille) => "⠄⠂⠁".into(),
            (None, Style::Dotted, Glyphs::Ascii) => "...".into(),
            (None, _, Glyphs::Braille) => "⣀⠤⠒".into(),
            (None, _, Glyphs::Ascii) => "***".into(),
        };
        format!("  {sample}  {}", series.name)
    };
    let named = plot.series.iter().zip(names).filter(|(s, _)| !s.name.is_empty());
    named.map(line).collect()
}

/// The numbers below the frame, each begun under its place.
fn x_labels(range: [f64; 2], width: usize) -> String {
    let ticks = Ticks::between(range[0], range[1], 6);
    let mut text = String::new();
    for tick in &ticks.values {
        let label = ticks.label(*tick);
        let share = (tick - range[0]) / (range[1] - range[0]);
        let middle = (share * (width - 1) as f64).round().max(0.0) as usize;
        let letters = label.chars().count();
        let start = middle
            .saturating_sub(letters / 2)
            .min(width.saturating_sub(letters));
        let there = text.chars().count();
        if there == 0 || start > there {
            text.push_str(&" ".repeat(start - there));
            text.push_str(&label);
        }
    }
    text
}

struct Canvas {
    width: usize,
    glyphs: Glyphs,
    x: Axis,
    y: Axis,
    /// Letters, row by row.
    cells: Vec<char>,
}

const BLANK: char = '\u{2800}';

impl Canvas {
    fn new(width: usize, glyphs: Glyphs, x: [f64; 2], y: [f64; 2]) -> Self {
        // In letters: the middles of the first and the last are the ends of the range.
        let axis = |range: [f64; 2], cells: usize| Axis {
            range,
            pixels: [0.5, cells as f64 - 0.5],
        };
        Canvas {
            width,
            glyphs,
            x: axis(x, width),
            y: axis([y[1], y[0]], ROWS),
            cells: vec![' '; width * ROWS],
        }
    }

    /// The row of a value, if it is in the frame.
    fn row(&self, value: f64) -> Option<usize> {
        let at = self.y.at(value);
        (at >= 0.0 && at < ROWS as f64).then_some(at as usize)
    }

    fn zero_lines(&mut self) {
        let ascii = self.glyphs == Glyphs::Ascii;
        let column = self.x.at(0.0);
        if column >= 0.0 && column < self.width as f64 {
            for row in 0..ROWS {
                self.cells[row * self.width + column as usize] = if ascii { ':' } else { '┊' };
            }
        }
        if let Some(row) = self.row(0.0) {
            self.cells[row * self.width..(row + 1) * self.width].fill(if ascii { '-' } else { '┈' });
        }
    }

    fn line(&mut self, series: &Series, letter: char) {
        let place = |p: &[f64; 2]| [self.x.at(p[0]), self.y.at(p[1])];
        let places: Vec<[f64; 2]> = series.points.iter().map(place).collect();
        if series.style == Style::Marks {
            for at in &places {
                self.mark(
                    *at,
                    if self.glyphs == Glyphs::Braille {
                        'o'
                    } else {
                        letter
                    },
                );
            }
            return;
        }
        let mut way = 0.0;
        for pair in places.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            let length = (to[0] - from[0]).hypot(to[1] - from[1]);
            if !length.is_finite() {
                continue;
            }
            let steps = ((length * STEPS as f64).ceil() as usize).clamp(1, 4000);
            for i in 0..=steps {
                let t = i as f64 / steps as f64;
                // A dotted line is there in one half of each letter's length.
                let gap = series.style == Style::Dotted && (way + t * length).rem_euclid(1.0) >= 0.5;
                if self.glyphs == Glyphs::Braille && gap {
                    continue;
                }
                let at = [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])];
                match self.glyphs {
                    Glyphs::Braille => self.dot(at),
                    Glyphs::Ascii => self.mark(at, letter),
                }
            }
            way += length;
        }
    }

    fn cell(&mut self, [column, row]: [f64; 2]) -> Option<&mut char> {
        let inside = column >= 0.0 && row >= 0.0 && column < self.width as f64 && row < ROWS as f64;
        // Written so that NaN is outside.
        if !inside {
            return None;
        }
        self.cells.get_mut(row as usize * self.width + column as usize)
    }

    fn mark(&mut self, at: [f64; 2], letter: char) {
        if let Some(cell) = self.cell(at) {
            *cell = letter;
        }
    }

    /// A dot of a Braille pattern: two columns and four rows of them in a letter.
    fn dot(&mut self, at: [f64; 2]) {
        const BITS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
        if let Some(cell) = self.cell(at) {
            let bit = BITS[(4.0 * at[1].fract()) as usize % 4][(2.0 * at[0].fract()) as usize % 2];
            let before = u32::from(*cell);
            let pattern = if before >= u32::from(BLANK) {
                before
            } else {
                u32::from(BLANK)
            };
            *cell = char::from_u32(pattern | bit).unwrap_or(BLANK);
        }
    }

    /// Names a line by its letter, at the last of its points in the frame.
    fn name(&mut self, series: &Series, letter: char) {
        let places: Vec<[f64; 2]> = series
            .points
            .iter()
            .map(|p| [self.x.at(p[0]), self.y.at(p[1])])
            .collect();
        for at in places.iter().rev() {
            if self.cell(*at).is_some_and(|cell| !cell.is_alphabetic()) {
                self.mark(*at, letter);
                return;
            }
        }
    }

    fn edge(&self) -> &'static str {
        match self.glyphs {
            Glyphs::Braille => " │",
            Glyphs::Ascii => " |",
        }
    }

    fn floor(&self, width: usize) -> String {
        match self.glyphs {
            Glyphs::Braille => format!("└{}", "─".repeat(width)),
            Glyphs::Ascii => format!("+{}", "-".repeat(width)),
        }
    }

    fn text(&self, row: usize) -> String {
        self.cells[row * self.width..(row + 1) * self.width]
            .iter()
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::colour::Colour;

    fn line(name: &str, points: Vec<[f64; 2]>, style: Style) -> Series {
        Series::new(name, points, style, Colour::qualitative(1))
    }

    fn rising() -> LinePlot {
        let mut plot = LinePlot::new("", "strain [%]", "stress [MPa]")
            .with(line("up", vec![[0.0, 0.0], [10.0, 1.0]], Style::Solid))
            .with(line("on", vec![[10.0, 1.0], [20.0, 1.0]], Style::Dotted));
        (plot.x_limits, plot.y_limits) = (Some([0.0, 20.0]), Some([0.0, 1.0]));
        plot
    }

    /// The straight line starts in the lowest row at the left and ends in the highest in the middle; then dots go on.
    #[test]
    fn a_line_in_ascii() {
        let text = terminal_plot(&rising(), 48, Glyphs::Ascii);
        assert!(text.is_ascii(), "{text}");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "stress [MPa]");
        let frame = |row: usize| lines[1 + row].split_once('|').unwrap().1;
        assert!(frame(ROWS - 1).starts_with('*'), "{text}");
        let top = frame(0);
        assert!(
            top.contains("*.") && top.ends_with('.') && top.find('*').unwrap() > 15,
            "{text}"
        );
        for row in 0..ROWS {
            let line = frame(row);
            let stars = line.chars().filter(|c| *c == '*').count();
            assert!((1..=4).contains(&stars), "row {row}: {text}");
        }
        assert!(text.contains("***  up") && text.contains("...  on") && text.contains("strain [%]"));
        assert!(lines.iter().all(|l| l.len() <= 48), "{text}");
    }

    #[test]
    fn a_line_in_braille() {
        let text = terminal_plot(&rising(), 60, Glyphs::Braille);
        let dots = |row: usize| -> u32 {
            let pattern = |c: char| u32::from(c).checked_sub(u32::from(BLANK)).filter(|b| *b < 256);
            let line = text.lines().nth(1 + row).unwrap();
            line.chars().filter_map(pattern).map(u32::count_ones).sum()
        };
        // Four rows of dots in each row of letters, and the slope is flatter than 1.
        for row in 1..ROWS - 1 {
            assert!(dots(row) >= 4, "row {row}: {text}");
        }
        assert!(text.lines().all(|l| l.chars().count() <= 60), "{text}");
    }

    /// Two lines are told apart; nothing that is no number stops the plot, and no width is too small.
    #[test]
    fn several_lines_and_odd_numbers() {
        let mut plot = rising().with(line(
            "down",
            vec![[0.0, 1.0], [f64::NAN, 0.0], [20.0, 0.0]],
            Style::Solid,
        ));
        let text = terminal_plot(&plot, 70, Glyphs::Braille);
        assert!(text.contains("A  up") && text.contains("B  down"), "{text}");
        plot.series.clear();
        for columns in [0, 3, 10_000] {
            terminal_plot(&plot, columns, Glyphs::Ascii);
            terminal_plot(&rising(), columns, Glyphs::Braille);
        }
        let odd = vec![[f64::INFINITY, 1.0], [1.0, f64::NEG_INFINITY], [1e300, -1e300]];
        let text = terminal_plot(
            &LinePlot::new("", "", "").with(line("odd", odd, Style::Marks)),
            60,
            Glyphs::Ascii,
        );
        assert!(text.contains("odd"));
    }
}
