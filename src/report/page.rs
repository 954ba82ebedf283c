//! The page of a replicated object: how close the layout comes, what it is made of, and how it was found. One HTML
//! file without scripts or anything from elsewhere, for a screen, a phone and a printer.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::colour::Colour;
use super::layouts::{CellChoice, LayoutRow};
use super::style::STYLE;
use super::svg::Svg;
use super::ticks::{fixed, significant};

/// A name and what is to be said of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fact {
    /// As in `simulations`.
    pub name: String,
    /// As in `1 204`, with its unit.
    pub value: String,
}

impl Fact {
    /// A fact.
    pub fn new(name: impl Into<String>, value: impl ToString) -> Self {
        Self {
            name: name.into(),
            value: value.to_string(),
        }
    }
}

/// A drawing and what it shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Figure {
    /// Its name, as a file may bear it.
    pub name: String,
    /// The drawing.
    pub drawing: Svg,
    /// What it shows, in a sentence; may be empty.
    pub caption: String,
}

impl Figure {
    /// A drawing with its name and caption.
    pub fn new(name: impl Into<String>, drawing: Svg, caption: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            drawing,
            caption: caption.into(),
        }
    }
}

/// A base material of the palette.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialRow {
    /// Its identifier in the database.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Its display colour.
    pub colour: Colour,
    /// Whether the best layout uses it.
    pub used: bool,
    /// As in `isotropic`; a synthetic material says so here.
    pub kind: String,
    /// Young's modulus at rest \[MPa\]; `None` where one number doesn't say it.
    pub young_modulus: Option<f64>,
    /// Poisson's ratio at rest.
    pub poisson_ratio: Option<f64>,
    /// Density \[g/cm³\].
    pub density: Option<f64>,
    /// Where its data come from.
    pub source: String,
}

/// A section of its own: what it is about, figures and a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PageSection {
    /// Its heading.
    pub heading: String,
    /// What it says; may be empty.
    pub note: String,
    /// Its figures.
    pub figures: Vec<Figure>,
    /// The table's columns.
    pub header: Vec<String>,
    /// The table's rows, each as long as the header.
    pub rows: Vec<Vec<String>>,
    /// The columns that hold words; the others hold numbers.
    pub words: Vec<usize>,
}

impl PageSection {
    fn body(&self) -> Markup {
        let number = |column: usize| !self.words.contains(&column);
        html! {
            @if !self.note.is_empty() { p { (self.note) } }
            (figures(&self.figures))
            div.scroll {
                table {
                    thead { tr { @for (k, name) in self.header.iter().enumerate() { th.number[number(k)] { (name) } } } }
                    tbody {
                        @for row in &self.rows {
                            tr { @for (k, cell) in row.iter().enumerate() { td.number[number(k)] { (cell) } } }
                        }
                    }
                }
            }
        }
    }
}

/// Everything that the page of a replicated object says, in its order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReplicatePage {
    /// The object's name.
    pub title: String,
    /// A line under it; may be empty.
    pub subtitle: String,
    /// The outcome in a sentence or two.
    pub summary: String,
    /// What the reader must know before believing the rest.
    pub warnings: Vec<String>,
    /// The object: its size, volume, cells, examples.
    pub object: Vec<Fact>,
    /// The best layouts, the best first, and rows to compare with.
    pub layouts: Vec<LayoutRow>,
    /// Pictures of the object.
    pub pictures: Vec<Figure>,
    /// Curves of the examples.
    pub plots: Vec<Figure>,
    /// Sections that some goals and options bring, such as what is out of reach.
    pub sections: Vec<PageSection>,
    /// How it was found: method, seed, K, simulations, culled, time.
    pub search: Vec<Fact>,
    /// The palette.
    pub materials: Vec<MaterialRow>,
    /// Version, files and their digests. A date only if the page need not be reproducible.
    pub provenance: Vec<Fact>,
}

impl ReplicatePage {
    /// The HTML document.
    pub fn html(&self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="generator" content="pliant";
                    title { (self.title) " – replicated" }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    main {
                        (self.header())
                        (section("Layouts", !self.layouts.is_empty(), self.layout_table()))
                        (section("The object", !self.pictures.is_empty(), figures(&self.pictures)))
                        (section("Force and displacement", !self.plots.is_empty(), figures(&self.plots)))
                        @for part in &self.sections { (section(&part.heading, true, part.body())) }
                        (section("Base materials", !self.materials.is_empty(), self.material_table()))
                        (section("The search", !self.search.is_empty(), facts(&self.search)))
                        (section("Provenance", !self.provenance.is_empty(), facts(&self.provenance)))
                    }
                }
            }
        };
        page.into_string()
    }

    fn header(&self) -> Markup {
        html! {
            header {
                p.kicker { "Replicated with pliant" }
                h1 { (self.title) }
                @if !self.subtitle.is_empty() { p.subtitle { (self.subtitle) } }
            }
            @if !self.summary.is_empty() { p.summary { (self.summary) } }
            @if !self.warnings.is_empty() {
                div.warnings role="note" {
                    strong { @if self.warnings.len() == 1 { "A caution" } @else { "Cautions" } }
                    ul { @for warning in &self.warnings { li { (warning) } } }
                }
            }
            (facts(&self.object))
        }
    }

    fn layout_table(&self) -> Markup {
        let massive = self.layouts.iter().any(|row| row.mass_g.is_some());
        html! {
            div.scroll {
                table.layouts {
                    thead {
                        tr {
                            th rowspan="2" { "Rank" }
                            th rowspan="2" { "Materials" }
                            th.number colspan="2" { "RMS error" }
                            th.number colspan="2" { "Largest error" }
                            @if massive { th.number { "Mass" } }
                        }
                        tr.units {
                            th.number { "mm" } th.number { "%" } th.number { "mm" } th.number { "%" }
                            @if massive { th.number { "g" } }
                        }
                    }
                    tbody {
                        @for row in &self.layouts {
                            tr.best[row.rank == Some(1)] .compared[row.rank.is_none()] {
                                td { (row.heading()) }
                                td { (chips(&row.runs())) }
                                td.number { (significant(row.rms_mm, 3)) }
                                td.number { (fixed(row.rms_percent, 1)) }
                                td.number { (significant(row.max_mm, 3)) }
                                td.number { (fixed(row.max_percent, 1)) }
                                @if massive { td.number { (optional(row.mass_g, 3)) } }
                            }
                        }
                    }
                }
            }
            p.note {
                "Errors of the displacements over all examples and forces; "
                "percentages are of the largest target displacement."
            }
        }
    }

    fn material_table(&self) -> Markup {
        html! {
            div.scroll {
                table {
                    thead {
                        tr {
                            th { "Material" } th { "Kind" }
                            th.number { "Young’s modulus" } th.number { "Poisson’s ratio" } th.number { "Density" }
                            th { "Source" }
                        }
                        tr.units { th {} th {} th.number { "MPa" } th.number {} th.number { "g/cm³" } th {} }
                    }
                    tbody {
                        @for row in &self.materials {
                            tr.best[row.used] {
                                td {
                                    (chip(row.colour)) " " (row.name)
                                    @if row.id != row.name { " " code { (row.id) } }
                                }
                                td { (row.kind) }
                                td.number { (optional(row.young_modulus, 3)) }
                                td.number { (optional(row.poisson_ratio, 3)) }
                                td.number { (optional(row.density, 3)) }
                                td.source { (row.source) }
                            }
                        }
                    }
                }
            }
            @if self.materials.iter().any(|row| row.used) { p.note { "Materials in bold are in the best layout." } }
        }
    }
}

pub(super) fn section(heading: &str, wanted: bool, body: Markup) -> Markup {
    html! { @if wanted { section { h2 { (heading) } (body) } } }
}

pub(super) fn facts(facts: &[Fact]) -> Markup {
    html! {
        @if !facts.is_empty() {
            dl { @for fact in facts { div { dt { (fact.name) } dd { (fact.value) } } } }
        }
    }
}

pub(super) fn figures(figures: &[Figure]) -> Markup {
    html! {
        div.figures {
            @for figure in figures {
                figure {
                    (PreEscaped(figure.drawing.as_str()))
                    @if !figure.caption.is_empty() { figcaption { (figure.caption) } }
                }
            }
        }
    }
}

fn chips(cells: &[CellChoice]) -> Markup {
    html! {
        ul.chips {
            @for cell in cells {
                li { (chip(cell.colour)) " " span.cell { (cell.cell) } " " (cell.material) }
            }
        }
    }
}

fn chip(colour: Colour) -> Markup {
    html! { span.chip style={ "background:" (colour.hex()) } {} }
}

fn optional(value: Option<f64>, digits: usize) -> String {
    significant(value.unwrap_or(f64::NAN), digits)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page() -> ReplicatePage {
        ReplicatePage {
            title: "Sole <script>alert(1)</script>".to_owned(),
            warnings: vec!["a & b".to_owned()],
            object: vec![Fact::new("volume <b>", "12 cm³")],
            layouts: vec![LayoutRow {
                rank: Some(1),
                note: String::new(),
                cells: vec![CellChoice {
                    cell: "heel \"1\"".to_owned(),
                    material: "<img src=x onerror=y>".to_owned(),
                    colour: Colour::qualitative(1),
                }],
                rms_mm: 0.0673,
                rms_percent: f64::NAN,
                max_mm: 0.2,
                max_percent: 3.0,
                mass_g: None,
            }],
            sections: vec![PageSection {
                heading: "Out <b>of</b> reach".to_owned(),
                note: "c < d".to_owned(),
                header: vec!["example <i>".to_owned(), "mm".to_owned()],
                rows: vec![vec!["heel <script>".to_owned(), "1.25".to_owned()]],
                words: vec![0],
                ..PageSection::default()
            }],
            ..ReplicatePage::default()
        }
    }

    #[test]
    fn nothing_from_outside_becomes_markup() {
        let html = page().html();
        assert!(html.contains("Sole &lt;script&gt;alert(1)&lt;/script&gt;"));
        assert!(html.contains("&lt;img src=x onerror=y&gt;"));
        assert!(html.contains("a &amp; b"));
        assert!(html.contains("<h2>Out &lt;b&gt;of&lt;/b&gt; reach</h2><p>c &lt; d</p>"));
        assert!(html.contains(">heel &lt;script&gt;</td>") && html.contains(">1.25</td>"));
        for forbidden in ["<script", "<img", "<b>", "http://", "https://", "NaN", "src="] {
            let found = html.replace("&lt;img src=x", "").contains(forbidden);
            assert!(!found, "{forbidden} in the page");
        }
    }

    #[test]
    fn errors_are_in_the_table_and_unknown_ones_are_dashes() {
        let html = page().html();
        assert!(
            html.contains("<td class=\"number\">0.0673</td><td class=\"number\">–</td>"),
            "{html}"
        );
    }

    #[test]
    fn empty_sections_are_left_out() {
        let html = ReplicatePage {
            title: "t".to_owned(),
            ..ReplicatePage::default()
        }
        .html();
        assert!(!html.contains("<h2>") && !html.contains("<table"));
    }
}
