//! `pliant db export`: a material for another program.

use super::super::Answer;
use super::super::terminal::{say, warn};
use crate::fitting::coupon::file::{LawChoice, TestKind};
use crate::fitting::stand_in::{StandIn, stand_in};
use crate::material::database::Database;
use crate::material::export::{ExportError, ExportedMaterial, Program};
use crate::material::hyperelastic::Form;
use crate::material::law::Law;
use crate::material::record::{Kind, MaterialRecord};
use crate::report::database::percent;
use crate::units::whole_file::replace_file;
use clap::ValueEnum;
use miette::{IntoDiagnostic, miette};
use serde_json::json;
use std::path::PathBuf;

/// Which material, for which program.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Its id; ID@N for its version N
    id: String,
    /// The program; json is the whole record
    #[arg(long = "for", value_enum, value_name = "PROGRAM")]
    program: ProgramWord,
    /// Where the program lacks the law, write the one of its own that stays within this error of stress, as "5 %"
    #[arg(long, value_name = "PERCENT", value_parser = part)]
    within: Option<f64>,
    /// Write to this file [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ProgramWord {
    Febio,
    Calculix,
    Abaqus,
    Json,
}

/// A part of 1 from text such as `5 %` or `5`.
fn part(text: &str) -> Result<f64, String> {
    let number: Result<f64, _> = text.trim().trim_end_matches('%').trim().parse();
    match number {
        Ok(percent) if percent > 0.0 && percent <= 100.0 => Ok(percent / 100.0),
        _ => Err(format!(
            "found {text:?}, expected percent above 0 and up to 100, as 5 %"
        )),
    }
}

/// Exports a material.
pub(super) fn run(database: &Database, options: &Arguments, json: bool) -> miette::Result<Answer> {
    let entry = database.entry(&options.id).into_diagnostic()?;
    let record = &entry.record;
    let program = match options.program {
        ProgramWord::Febio => Program::Febio,
        ProgramWord::Calculix => Program::Calculix,
        ProgramWord::Abaqus => Program::Abaqus,
        ProgramWord::Json => {
            // The file itself, so that fields unknown to this program are there too.
            let value: toml::Value = toml::from_str(&entry.text).into_diagnostic()?;
            let text = serde_json::to_string_pretty(&value).into_diagnostic()? + "\n";
            return write(options, text, json, None);
        }
    };
    let law = record.law().into_diagnostic()?;
    if let Law::Hyperelastic(energy) = &law {
        match exported(record, energy.form().clone(), "the law itself").text(program) {
            Ok(text) => return write(options, text, json, None),
            Err(error) if options.within.is_none() => return Err(refusal(&error, options)),
            Err(_) => {}
        }
    }
    if record.kind == Kind::TransverselyIsotropic {
        return Err(miette!(
            "{}: {} has no transversely isotropic law whose moduli depend on strain; --for json writes the whole record",
            record.id,
            program.name()
        ));
    }
    let Some(within) = options.within else {
        let error = ExportError {
            program: program.name(),
            law: "moduli that depend on strain",
            reason: "its laws have energies of stretches".into(),
        };
        return Err(refusal(&error, options));
    };
    let range = record.model.range.engineering_strain;
    let sheared = record
        .measurements
        .iter()
        .any(|m| m.test == TestKind::SimpleShear.word());
    let found = stand_in(&law, range, sheared, forms(program), within).into_diagnostic()?;
    if found.worst() > within {
        return Err(miette!(
            "{}: the nearest law of {} is {}, off by {} of the RMS stress; --within {} would take it",
            record.id,
            program.name(),
            found.choice.word(),
            percent(found.worst()),
            percent((1000.0 * found.worst()).ceil() / 1000.0)
        ));
    }
    let mut material = exported(record, found.form.clone(), "a stand-in for the record's law");
    material.remarks.extend(gaps(&found));
    let text = material.text(program).into_diagnostic()?;
    for line in &material.remarks {
        warn(line);
    }
    write(options, text, json, Some(&found))
}

fn refusal(error: &ExportError, options: &Arguments) -> miette::Report {
    miette!(
        "{}: {error}. With --within \"5 %\" the nearest law that it has is written, if it stays so near, and its error told; --for json \
         writes the whole record",
        options.id
    )
}

/// The forms that a stand-in may have, the fewest numbers first.
fn forms(program: Program) -> &'static [LawChoice] {
    const RUBBERS: [LawChoice; 5] = [
        LawChoice::NeoHookean,
        LawChoice::MooneyRivlin,
        LawChoice::Ogden1,
        LawChoice::Ogden2,
        LawChoice::Ogden3,
    ];
    const ALL: [LawChoice; 8] = [
        LawChoice::NeoHookean,
        LawChoice::MooneyRivlin,
        LawChoice::Ogden1,
        LawChoice::Hyperfoam1,
        LawChoice::Ogden2,
        LawChoice::Hyperfoam2,
        LawChoice::Ogden3,
        LawChoice::Hyperfoam3,
    ];
    match program {
        Program::Febio => &RUBBERS,
        Program::Calculix | Program::Abaqus => &ALL,
    }
}

fn exported(record: &MaterialRecord, form: Form, what: &str) -> ExportedMaterial {
    let [low, high] = record.model.range.engineering_strain.map(|e| 100.0 * e);
    ExportedMaterial {
        id: record.id.clone(),
        density_g_per_cm3: record.density_g_per_cm3,
        remarks: vec![
            format!("{} version {} from pliant: {what}", record.id, record.version),
            format!("fitted from {low:.0} to {high:.0} % engineering strain"),
            format!("source: {} ({})", record.source.citation, record.source.licence),
        ],
        form,
    }
}

fn gaps(found: &StandIn) -> Vec<String> {
    let gap = |e: &crate::fitting::stand_in::TestGap| {
        let [low, high] = e.strain.map(|s| 100.0 * s);
        let lateral = e
            .lateral_relative_rms
            .map_or(String::new(), |l| format!(", of lateral strain {}", percent(l)));
        format!(
            "{}, {low:.0} to {high:.0} %: error of stress {}{lateral}{}",
            e.kind.word(),
            percent(e.relative_rms),
            if e.fitted {
                ""
            } else {
                " (not fitted: nobody measured it)"
            }
        )
    };
    let mut lines = vec![format!("{}, fitted to the record's law", found.choice.word())];
    lines.extend(found.errors.iter().map(gap));
    lines
}

fn write(options: &Arguments, text: String, json: bool, found: Option<&StandIn>) -> miette::Result<Answer> {
    if let Some(file) = &options.out {
        replace_file(file, text.as_bytes()).map_err(|e| miette!("{}: {e}", file.display()))?;
    }
    if json {
        let errors = found.map(|f| {
            let error = |e: &crate::fitting::stand_in::TestGap| {
                json!({
                    "test": e.kind.word(),
                    "strain": e.strain,
                    "fitted": e.fitted,
                    "relative_rms": e.relative_rms,
                    "lateral_relative_rms": e.lateral_relative_rms,
                })
            };
            f.errors.iter().map(error).collect::<Vec<_>>()
        });
        let file = options.out.as_ref().map(|f| f.display().to_string());
        let value = json!({"exact": found.is_none(), "errors": errors, "file": file, "text": text});
        say(&serde_json::to_string_pretty(&value).into_diagnostic()?);
        return Ok(Answer::Done);
    }
    match &options.out {
        Some(file) => say(&format!("wrote {}", file.display())),
        None => say(text.trim_end()),
    }
    Ok(Answer::Done)
}
