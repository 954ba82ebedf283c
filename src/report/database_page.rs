//! The page of the database: every material with its curve, numbers, errors and origin. One HTML file with its plots and a
//! small script that filters and sorts; without scripts it shows everything. Nothing comes from elsewhere.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::database::{MaterialSummary, kind_words, percent, range_words, short_source, tests_words};
use super::database_curve::material_plot;
use super::style::STYLE;
use super::ticks::significant;
use crate::material::database::{Database, Entry};
use crate::material::difference::Difference;
use crate::material::law::Law;
use crate::material::record::MaterialRecord;

const SCRIPT: &str = include_str!("database_page.js");

const OWN_STYLE: &str = "
form { display: flex; flex-wrap: wrap; gap: .6rem 1.1rem; align-items: end; margin: 1.4rem 0; }
form[hidden], [hidden] { display: none; }
label { color: var(--soft); font-size: .82rem; }
label input, label select { display: block; font: inherit; color: var(--ink); padding: .25rem .4rem; border: 1px solid \
var(--rule); border-radius: 4px; background: #fff; }
label input[type=number] { width: 6.5rem; }
label input[type=checkbox] { display: inline; margin-right: .4rem; }
form button { font: inherit; padding: .25rem .8rem; border: 1px solid var(--rule); border-radius: 4px; background: var(--faint); }
#shown { color: var(--soft); font-size: .85rem; }
th button { all: unset; cursor: pointer; }
th button:focus-visible { outline: 2px solid #2f6fae; }
th[aria-sort=ascending] button::after { content: ' ▲'; }
th[aria-sort=descending] button::after { content: ' ▼'; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 30rem), 1fr)); gap: 2.4rem 2.2rem; margin-top: 2rem; }
article { border-top: 1.5px solid var(--ink); padding-top: .8rem; break-inside: avoid; }
article h3 { margin: 0; font-size: 1.05rem; }
article svg { display: block; width: 100%; max-width: 40rem; height: auto; margin: .6rem 0; }
article ul { margin: .6rem 0 0; padding-left: 1.1rem; font-size: .88rem; color: var(--soft); }
article a, td a { color: #2f6fae; }
";

/// A material at hand for the page.
struct Material<'a> {
    record: &'a MaterialRecord,
    law: Law,
    summary: MaterialSummary,
    history: Vec<&'a Entry>,
}

/// The HTML document of all materials of a database whose laws can be made, and the messages of the others.
pub fn database_page(database: &Database) -> (String, Vec<String>) {
    let mut troubles: Vec<String> = database.broken().iter().map(ToString::to_string).collect();
    let mut materials = Vec::new();
    for record in database.records() {
        match record.law() {
            Ok(law) => materials.push(Material {
                record,
                summary: MaterialSummary::of(&law),
                history: database.history(&record.id),
                law,
            }),
            Err(error) => troubles.push(error.to_string()),
        }
    }
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content="pliant";
                title { "Materials" }
                style { (PreEscaped(STYLE)) (PreEscaped(OWN_STYLE)) }
            }
            body {
                main {
                    header {
                        p.kicker { "Database of pliant" }
                        h1 { "Materials" }
                        p.subtitle { (counted(&materials)) }
                    }
                    (controls())
                    (table(&materials))
                    p.note {
                        "E is Young’s modulus at rest and the secant modulus at −30 %, along the axis z. The error is the \
                         largest over a material’s tests: the root mean square of the law’s stress error over that of the \
                         stress, in the fitted range."
                    }
                    div.cards { @for material in &materials { (card(material)) } }
                }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    (page.into_string(), troubles)
}

fn counted(materials: &[Material<'_>]) -> String {
    let synthetic = materials.iter().filter(|m| m.record.synthetic).count();
    let measured = materials.len() - synthetic;
    format!("{measured} measured, {synthetic} synthetic. Solid curves: fitted range; dotted: extrapolated.")
}

/// The filter; shown by the script, since it does nothing without one.
fn controls() -> Markup {
    html! {
        form hidden {
            label { "Words" input id="words" type="search" placeholder="id, name, source, process"; }
            label { "Kind" select id="kind" {
                option value="" { "any" }
                option value="isotropic" { "isotropic" }
                option value="transversely-isotropic" { "transversely isotropic" }
            } }
            label { "Origin" select id="origin" {
                option value="" { "any" }
                option value="measured" { "measured" }
                option value="synthetic" { "synthetic" }
            } }
            label { "E at rest from [MPa]" input id="least" type="number" min="0" step="any"; }
            label { "to [MPa]" input id="most" type="number" min="0" step="any"; }
            label { input id="printable" type="checkbox"; "printable" }
            button type="reset" { "Clear" }
            output id="shown" {}
        }
    }
}

fn table(materials: &[Material<'_>]) -> Markup {
    let sortable = |key: &str, name: &str, number: bool| {
        html! { th.number[number] data-sort=(key) { button type="button" { (name) } } }
    };
    html! {
        div.scroll {
            table {
                thead {
                    tr {
                        (sortable("id", "Material", false))
                        th { "Kind" }
                        (sortable("stiffness", "E at rest", true))
                        (sortable("pressed", "E at −30 %", true))
                        (sortable("density", "Density", true))
                        th { "Range" }
                        (sortable("error", "Error", true))
                        th { "Source" }
                    }
                    tr.units {
                        th {} th {} th.number { "MPa" } th.number { "MPa" } th.number { "g/cm³" } th {} th.number { "%" } th {}
                    }
                }
                tbody { @for material in materials { (row(material)) } }
            }
        }
    }
}

fn row(
    Material {
        record, summary: s, ..
    }: &Material<'_>,
) -> Markup {
    let error = record.relative_rms();
    let origin = match record.synthetic {
        true => "synthetic",
        false => "measured",
    };
    let words = [
        record.id.as_str(),
        &record.name,
        &record.source.citation,
        &record.printability.process,
    ];
    html! {
        tr data-id=(record.id) data-kind=(record.kind.word()) data-origin=(origin)
            data-printable=(record.printability.printable) data-stiffness=(s.young_at_rest_mpa)
            data-pressed=(s.young_pressed_mpa) data-density=(record.density_g_per_cm3)
            data-error=(error.unwrap_or(1e9)) data-words=(words.join(" ").to_lowercase()) {
            td {
                span.chip style=(format!("background:{}", chip_colour(record))) {} " "
                a href=(format!("#{}", record.id)) { (record.id) }
            }
            td { (kind_words(record)) }
            td.number { (significant(s.young_at_rest_mpa, 3)) }
            td.number { (significant(s.young_pressed_mpa, 3)) }
            td.number { (significant(record.density_g_per_cm3, 3)) }
            td { (range_words(record)) }
            td.number { (error.map_or("–".to_string(), |e| format!("{:.1}", 100.0 * e))) }
            td.source { (short_source(record)) }
        }
    }
}

/// The display colour, if it is one: a record that is not sound must not write into the style.
fn chip_colour(record: &MaterialRecord) -> &str {
    match crate::material::check::is_colour(&record.colour) {
        true => &record.colour,
        false => "#ffffff",
    }
}

fn card(material: &Material<'_>) -> Markup {
    let Material {
        record,
        law,
        summary: s,
        history,
    } = material;
    let source = &record.source;
    // Other schemes than these would run as a script when clicked.
    let link = source
        .link
        .as_ref()
        .filter(|l| l.starts_with("https://") || l.starts_with("http://"));
    html! {
        article id=(record.id) data-id=(record.id) {
            h3 { (record.name) " " code { (record.id) } }
            (PreEscaped(material_plot(record, law).svg().as_str()))
            dl {
                (fact("E at rest", &format!("{} MPa", significant(s.young_at_rest_mpa, 3))))
                (fact("E at −30 %, secant", &format!("{} MPa", significant(s.young_pressed_mpa, 3))))
                (fact("Poisson’s ratio at rest", &format!("{:.3}", s.poisson_at_rest)))
                (fact("Density", &format!("{} g/cm³", significant(record.density_g_per_cm3, 3))))
                (fact("Made by", &made_by(record)))
                (fact("Version", &record.version.to_string()))
            }
            ul {
                li { (tests_words(record)) }
                @if let Some(u) = &record.uncertainty { li { "Uncertainty of parameters from " (u.basis) } }
                @for assumption in &record.assumptions { li { (assumption) } }
                @for line in changes(history) { li { (line) } }
                li {
                    @if let Some(link) = link { a href=(link) { (source.citation) } } @else { (source.citation) }
                    " (" (source.licence) ")"
                }
                @if let Some(recipe) = &record.recipe { li { "Fitted from " code { (recipe) } } }
            }
        }
    }
}

fn fact(name: &str, value: &str) -> Markup {
    html! { div { dt { (name) } dd { (value) } } }
}

fn made_by(record: &MaterialRecord) -> String {
    match record.printability.printable {
        true => format!("{}, printable", record.printability.process),
        false => record.printability.process.clone(),
    }
}

/// What each version changed, the newest first.
fn changes(history: &[&Entry]) -> Vec<String> {
    let change = |pair: &[&Entry]| {
        let [before, after] = [&pair[0].record, &pair[1].record];
        let difference = Difference::between(before, after);
        let moved = match difference.curve {
            Some(curve) => format!("the curve moved by {}", percent(curve.relative_rms)),
            None => "the curves can’t be compared".into(),
        };
        format!("Version {} after {}: {moved}", after.version, before.version)
    };
    history.windows(2).rev().map(change).collect()
}
