//! `pliant db list`.

use super::super::Answer;
use super::super::terminal::{say, warn};
use crate::material::database::Database;
use crate::material::law::Law;
use crate::material::record::{Kind, MaterialRecord};
use crate::material::selection::{Order, Selection};
use crate::report::database::{MaterialSummary, kind_words, percent, range_words, short_source, tests_words};
use crate::report::table::{Look, drawn};
use crate::units::quantity::stress;
use clap::ValueEnum;
use miette::IntoDiagnostic;
use serde_json::json;

/// Which materials, in which order.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Only materials of this symmetry
    #[arg(long, value_enum)]
    kind: Option<KindWord>,
    /// Only materials whose Young's modulus at rest lies between: "0.1 MPa..1 MPa", "..300 kPa", "1 MPa.."
    #[arg(long, value_name = "LOW..HIGH", value_parser = stiffness)]
    stiffness: Option<[f64; 2]>,
    /// Only materials that a multi-material printer can lay down
    #[arg(long)]
    printable: bool,
    /// Only materials made so: words of the process, as "cast"
    #[arg(long, value_name = "WORDS")]
    printer: Option<String>,
    /// Only materials whose citation, licence or link holds these words
    #[arg(long, value_name = "WORDS")]
    source: Option<String>,
    /// Only materials that are estimated
    #[arg(long, conflicts_with = "measured")]
    synthetic: bool,
    /// Only materials that were measured
    #[arg(long)]
    measured: bool,
    /// Sorted by this, rising; what was not measured has the largest error
    #[arg(long, value_enum, default_value = "id", value_name = "KEY")]
    sort: SortKey,
    /// As a Markdown table
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum KindWord {
    Isotropic,
    TransverselyIsotropic,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SortKey {
    Id,
    Stiffness,
    Error,
    Density,
}

/// A range of moduli \[MPa\] from text such as `0.1 MPa..1 MPa`, open where nothing stands.
fn stiffness(text: &str) -> Result<[f64; 2], String> {
    let (low, high) = text
        .split_once("..")
        .ok_or_else(|| format!("found {text:?}, expected LOW..HIGH with units, as 0.1 MPa..1 MPa"))?;
    let end = |text: &str, open: f64| match text.trim() {
        "" => Ok(open),
        text => stress(text).map_err(|e| e.to_string()),
    };
    let range = [end(low, 0.0)?, end(high, f64::INFINITY)?];
    match range[0] <= range[1] {
        true => Ok(range),
        false => Err(format!("found {text:?}: the lower end is above the upper one")),
    }
}

impl Arguments {
    fn selection(&self) -> Selection {
        Selection {
            kind: self.kind.map(|kind| match kind {
                KindWord::Isotropic => Kind::Isotropic,
                KindWord::TransverselyIsotropic => Kind::TransverselyIsotropic,
            }),
            stiffness_mpa: self.stiffness,
            printable: self.printable.then_some(true),
            printer: self.printer.clone(),
            source: self.source.clone(),
            synthetic: match (self.synthetic, self.measured) {
                (true, _) => Some(true),
                (_, true) => Some(false),
                _ => None,
            },
        }
    }

    fn order(&self) -> Order {
        match self.sort {
            SortKey::Id => Order::Id,
            SortKey::Stiffness => Order::Stiffness,
            SortKey::Error => Order::Error,
            SortKey::Density => Order::Density,
        }
    }
}

/// Lists the materials.
pub(super) fn run(database: &Database, options: &Arguments, json: bool) -> miette::Result<Answer> {
    for broken in database.broken() {
        warn(&format!("warning: {broken}"));
    }
    let selection = options.selection();
    let mut materials = Vec::new();
    for record in database.records() {
        match record.law() {
            Ok(law) if selection.takes(record, &law) => materials.push((record, law)),
            Ok(_) => {}
            Err(error) => warn(&format!("warning: {error}")),
        }
    }
    materials.sort_by(|a, b| options.order().of((a.0, &a.1), (b.0, &b.1)));
    let rows: Vec<Row<'_>> = materials.iter().map(|(record, law)| row(record, law)).collect();
    if json {
        let values: Vec<_> = rows.iter().map(|(record, s)| summary_json(record, s)).collect();
        say(&serde_json::to_string_pretty(&values).into_diagnostic()?);
    } else if options.markdown {
        say(markdown_table(&rows).trim_end());
    } else if rows.is_empty() {
        say("no material is like that");
    } else {
        say(&table(&rows));
    }
    Ok(Answer::Done)
}

type Row<'a> = (&'a MaterialRecord, MaterialSummary);

fn row<'a>(record: &'a MaterialRecord, law: &Law) -> Row<'a> {
    (record, MaterialSummary::of(law))
}

fn table(rows: &[Row<'_>]) -> String {
    let header = [
        "id",
        "name",
        "kind",
        "E at rest\n[MPa]",
        "E at −30 %\n[MPa]",
        "density\n[g/cm³]",
        "range",
        "error",
        "source",
    ];
    let cells = rows.iter().map(|(record, s)| {
        vec![
            record.id.clone(),
            record.name.clone(),
            kind_words(record),
            format!("{:.3}", s.young_at_rest_mpa),
            format!("{:.3}", s.young_pressed_mpa),
            format!("{}", record.density_g_per_cm3),
            range_words(record),
            record.relative_rms().map_or("–".into(), percent),
            short_source(record),
        ]
    });
    // Terminals fold long lines themselves; folded here, an id would be cut and could not be copied.
    drawn(&header, cells, &[0, 1, 2, 6, 8], Look::Plain)
}

/// What the table says, for machines.
pub(super) fn summary_json(record: &MaterialRecord, s: &MaterialSummary) -> serde_json::Value {
    json!({
        "id": record.id,
        "version": record.version,
        "name": record.name,
        "kind": record.kind.word(),
        "synthetic": record.synthetic,
        "young_at_rest_mpa": s.young_at_rest_mpa,
        "young_at_30_percent_compression_mpa": s.young_pressed_mpa,
        "poisson_at_rest": s.poisson_at_rest,
        "engineering_strain": record.model.range.engineering_strain,
        "relative_rms": record.relative_rms(),
        "density_g_per_cm3": record.density_g_per_cm3,
        "colour": record.colour,
        "printable": record.printability.printable,
        "process": record.printability.process,
        "source": record.source.citation,
    })
}

fn markdown_table(rows: &[Row<'_>]) -> String {
    let mut text = String::from(
        "# Materials of the database\n\n\
         Made by `pliant db list --markdown`. E is the secant Young's modulus (along the axis for transversely\n\
         isotropic materials), ν Poisson's ratio in Biot strain at rest. The error of a test is the root mean square of\n\
         the law's stress error over that of the measured stress, over the range of strain that was fitted; with a\n\
         tracked width, the same for lateral strain.\n\n\
         | id | name | kind | E at rest [MPa] | E at −30 % [MPa] | ν | range | error of each test | source |\n\
         |---|---|---|---:|---:|---:|---|---|---|\n",
    );
    for (record, s) in rows {
        text.push_str(&format!(
            "| `{}` | {} | {} | {:.3} | {:.3} | {:.2} | {} | {} | {} |\n",
            record.id,
            record.name,
            kind_words(record),
            s.young_at_rest_mpa,
            s.young_pressed_mpa,
            s.poisson_at_rest,
            range_words(record),
            tests_words(record),
            short_source(record),
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::stiffness;

    #[test]
    fn ranges_of_stiffness() {
        assert_eq!(stiffness("0.1 MPa..1 MPa"), Ok([0.1, 1.0]));
        assert_eq!(stiffness("..300kPa"), Ok([0.0, 0.3]));
        assert_eq!(stiffness("1 MPa.."), Ok([1.0, f64::INFINITY]));
        for wrong in ["1 MPa", "0.1..1", "1 MPa..0.1 MPa", "a..b", "", "NaN MPa..1 MPa"] {
            assert!(stiffness(wrong).is_err(), "{wrong}");
        }
    }
}
