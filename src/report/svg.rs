//! A drawing in SVG 1.1: shapes and text, nothing outside it needed. No identifiers are used, so that any number of
//! drawings can stand in one page.

use std::fmt;

use super::colour::Colour;

/// The font families of all text, generic at the end so that it reads the same wherever it is opened.
pub const FONT: &str = "Helvetica Neue, Helvetica, Arial, Liberation Sans, sans-serif";
/// Text, axes.
pub const INK: Colour = Colour::rgb(0x22, 0x26, 0x2b);
/// Tick labels, captions.
pub const SOFT_INK: Colour = Colour::rgb(0x55, 0x5b, 0x63);
/// Grid lines.
pub const GRID: Colour = Colour::rgb(0xe6, 0xe8, 0xeb);

/// A finished SVG document: one `<svg>` element, well-formed, with its own white ground. Only this module makes one, so
/// a page can take it in as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Svg(String);

impl Svg {
    /// The markup.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The markup, as bytes for a file.
    pub fn into_bytes(self) -> Vec<u8> {
        self.0.into_bytes()
    }
}

impl fmt::Display for Svg {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// Which end of a text its place is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// The text runs to the right of its place.
    Start,
    /// The text is centred on its place.
    Middle,
    /// The text ends at its place.
    End,
}

/// A line's look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub colour: Colour,
    /// Its width \[px\].
    pub width: f64,
    /// Dashes and gaps, as SVG's `stroke-dasharray`; empty for a solid line.
    pub dashes: &'static str,
}

impl Stroke {
    /// A solid line.
    pub const fn solid(colour: Colour, width: f64) -> Self {
        Self {
            colour,
            width,
            dashes: "",
        }
    }
}

/// A text's look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Type {
    /// Size \[px\].
    pub size: f64,
    /// Weight: bold or not.
    pub bold: bool,
    /// Colour.
    pub colour: Colour,
    /// Which end its place is.
    pub anchor: Anchor,
    /// Whether a white rim sets it off from a picture below.
    pub rim: bool,
}

impl Type {
    /// Ordinary text of a size, starting at its place.
    pub const fn of(size: f64) -> Self {
        Self {
            size,
            bold: false,
            colour: INK,
            anchor: Anchor::Start,
            rim: false,
        }
    }

    /// The same at another anchor.
    pub const fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// The same in another colour.
    pub const fn coloured(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }
}

/// A drawing under way. Lengths in px, origin at the top left, y down.
#[derive(Clone, Debug)]
pub struct Drawing {
    width: f64,
    height: f64,
    body: String,
}

impl Drawing {
    /// An empty white drawing of a size \[px\].
    pub fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            body: String::new(),
        }
    }

    /// A filled rectangle, its corners rounded by `radius`.
    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], radius: f64, fill: Colour) {
        let round = if radius > 0.0 {
            format!(" rx=\"{}\"", number(radius))
        } else {
            String::new()
        };
        self.push(&format!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"{round} fill=\"{}\"/>",
            number(x),
            number(y),
            number(width),
            number(height),
            fill.hex()
        ));
    }

    /// The outline of a rectangle.
    pub fn frame(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], stroke: Stroke) {
        self.push(&format!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\"{}/>",
            number(x),
            number(y),
            number(width),
            number(height),
            stroke_attributes(stroke)
        ));
    }

    /// A line through points; fewer than two draw nothing.
    pub fn line(&mut self, points: &[[f64; 2]], stroke: Stroke) {
        if points.len() >= 2 {
            let path = path(points);
            self.push(&format!(
                "<path d=\"{path}\" fill=\"none\"{}/>",
                stroke_attributes(stroke)
            ));
        }
    }

    /// A filled polygon, `opacity` 0 to 1.
    pub fn polygon(&mut self, points: &[[f64; 2]], fill: Colour, opacity: f64) {
        if points.len() >= 3 {
            let path = path(points);
            self.push(&format!(
                "<path d=\"{path}Z\" fill=\"{}\" fill-opacity=\"{}\"/>",
                fill.hex(),
                number(opacity)
            ));
        }
    }

    /// A filled circle with a white rim.
    pub fn dot(&mut self, [x, y]: [f64; 2], radius: f64, fill: Colour) {
        self.push(&format!(
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{}\" stroke=\"#ffffff\" stroke-width=\"1\"/>",
            number(x),
            number(y),
            number(radius),
            fill.hex()
        ));
    }

    /// A text; `turned` writes it from bottom to top.
    pub fn text(&mut self, [x, y]: [f64; 2], text: &str, style: Type, turned: bool) {
        let anchor = match style.anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let turn = if turned {
            format!(" transform=\"rotate(-90 {} {})\"", number(x), number(y))
        } else {
            String::new()
        };
        let bold = if style.bold { " font-weight=\"600\"" } else { "" };
        let rim = if style.rim {
            " stroke=\"#ffffff\" stroke-width=\"3\" stroke-linejoin=\"round\" paint-order=\"stroke\""
        } else {
            ""
        };
        self.push(&format!(
            "<text x=\"{}\" y=\"{}\" font-size=\"{}\" fill=\"{}\"{anchor}{bold}{rim}{turn}>{}</text>",
            number(x),
            number(y),
            number(style.size),
            style.colour.hex(),
            escaped(text)
        ));
    }

    /// A picture in PNG bytes.
    pub fn png(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], png: &[u8]) {
        use base64::Engine as _;
        let data = base64::engine::general_purpose::STANDARD.encode(png);
        self.push(&format!(
            "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" href=\"data:image/png;base64,{data}\"/>",
            number(x),
            number(y),
            number(width),
            number(height),
        ));
    }

    /// The finished drawing; `title` is read aloud to those who don't see it.
    pub fn finish(self, title: &str) -> Svg {
        let (width, height, title) = (number(self.width), number(self.height), escaped(title));
        Svg(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" role=\"img\" font-family=\"{FONT}\"><title>{title}</title>\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>{}\n</svg>",
            self.body
        ))
    }

    fn push(&mut self, element: &str) {
        self.body.push('\n');
        self.body.push_str(element);
    }
}

/// Text for an XML element or attribute: markup characters escaped, characters that XML forbids replaced.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' | '\r' => out.push(' '),
            '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            other => out.push(other),
        }
    }
    out
}

/// The width of a text \[px\], estimated from the widths of Helvetica's letters, a little too wide rather than too
/// narrow.
pub fn text_width(text: &str, size: f64) -> f64 {
    let ems: f64 = text
        .chars()
        .map(|character| match character {
            'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' | ' ' => 0.29,
            'f' | 't' | 'r' | '(' | ')' | '-' | '/' => 0.36,
            'm' | 'w' | 'M' | 'W' | '%' | '@' => 0.90,
            'A'..='Z' | '×' | '–' | '−' => 0.70,
            character if character.is_ascii() => 0.57,
            character if (character as u32) < 0x2e80 => 0.64,
            _ => 1.0,
        })
        .sum();
    ems * size
}

/// A text cut to a width \[px\], with an ellipsis where something went.
pub fn fitted(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_owned();
    }
    let mut kept = String::new();
    for character in text.chars() {
        kept.push(character);
        if text_width(&kept, size) + 0.8 * size > width {
            kept.pop();
            break;
        }
    }
    format!("{}…", kept.trim_end())
}

/// A coordinate with two decimals, without trailing zeros. Anything that is not finite is a fault of the caller's
/// filter and is put at zero, where it can be seen.
fn number(value: f64) -> String {
    let value = if value.is_finite() { value } else { 0.0 };
    let text = format!("{:.2}", value + 0.0);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".to_owned()
    } else {
        text.to_owned()
    }
}

fn path(points: &[[f64; 2]]) -> String {
    let mut path = String::new();
    for (index, [x, y]) in points.iter().enumerate() {
        path.push(if index == 0 { 'M' } else { 'L' });
        path.push_str(&number(*x));
        path.push(' ');
        path.push_str(&number(*y));
    }
    path
}

fn stroke_attributes(stroke: Stroke) -> String {
    let dashes = if stroke.dashes.is_empty() {
        String::new()
    } else {
        format!(" stroke-dasharray=\"{}\"", stroke.dashes)
    };
    format!(
        " stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\" stroke-linejoin=\"round\"{dashes}",
        stroke.colour.hex(),
        number(stroke.width)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_short_and_finite() {
        assert_eq!(number(1.0), "1");
        assert_eq!(number(-0.001), "0");
        assert_eq!(number(12.345_6), "12.35");
        assert_eq!(number(100.0), "100");
        assert_eq!(number(f64::NAN), "0");
    }

    #[test]
    fn text_cannot_leave_its_element() {
        let mut drawing = Drawing::new(10.0, 10.0);
        drawing.text([0.0, 0.0], "</text><script>&\"'\u{1}", Type::of(10.0), false);
        let svg = drawing.finish("<b>");
        assert!(
            svg.as_str()
                .contains("&lt;/text&gt;&lt;script&gt;&amp;&quot;&#39;\u{fffd}")
        );
        assert!(!svg.as_str().contains("<script>") && !svg.as_str().contains("<b>"));
    }

    #[test]
    fn long_text_is_cut_to_its_width() {
        let cut = fitted("a very long name of a material", 12.0, 80.0);
        assert!(cut.ends_with('…') && text_width(&cut, 12.0) <= 84.0, "{cut}");
        assert_eq!(fitted("short", 12.0, 80.0), "short");
    }
}
