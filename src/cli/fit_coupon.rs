//! One coupon file of `pliant fit`: fits, reports, draws, writes.

use super::Answer;
use super::fit::Arguments;
use super::terminal::{say, warn};
use crate::fitting::coupon::bootstrap::{Bootstrap, bootstrap};
use crate::fitting::coupon::compare::{Comparison, candidates, compare};
use crate::fitting::coupon::file::CouponFile;
use crate::fitting::coupon::record::{Fitted, fit_coupon};
use crate::material::check::check;
use crate::material::database::Database;
use crate::material::put::{Change, Put};
use crate::material::record::Uncertainty;
use crate::numerics::least_squares::Stop;
use crate::report::coupon_page::{Entry, page};
use crate::report::coupon_plots::{error_plot, laws_plot, stress_plot};
use crate::report::coupon_table::{comparison_table, error_words};
use crate::report::svg::Svg;
use crate::report::ticks::significant;
use crate::units::whole_file::{folder_of, replace_file};
use miette::{IntoDiagnostic, WrapErr, miette};
use serde_json::{Value, json};
use std::path::Path;

/// Share of the refitted laws in a band.
const CONFIDENCE: f64 = 0.95;

/// What came of one file.
pub struct Done {
    /// Negative if the record would not pass its checks.
    pub answer: Answer,
    /// For `--json`.
    pub value: Value,
    /// For the page.
    pub entry: Entry,
}

/// Fits the coupon file `path` with the contents `text`, and does what `arguments` ask.
///
/// # Errors
/// A file or curve that makes no sense, something that can't be written.
pub fn run(arguments: &Arguments, path: &Path, text: &str) -> miette::Result<Done> {
    let (coupon, mut fitted) = fit_file(path, text, arguments.data.as_deref())?;
    let comparison = match (&fitted.fit, arguments.compare) {
        (Some(fit), true) => {
            let laws = candidates(fit.poisson);
            Some(compare(&fitted.tests, fit.poisson, &laws, coupon.centres).into_diagnostic()?)
        }
        _ => None,
    };
    let resampled = match (&fitted.fit, arguments.bootstrap) {
        (Some(fit), Some(count)) => Some(bootstrap(
            fit,
            &fitted.tests,
            count as usize,
            arguments.seed,
            CONFIDENCE,
        )),
        _ => None,
    };
    if let (Some(fit), Some(b)) = (&fitted.fit, &resampled) {
        let basis = format!("bootstrap of {}, seed {}", b.samples, arguments.seed);
        fitted.record.uncertainty = Uncertainty::of(&fit.law, &b.covariance, basis);
    }
    let record_text = fitted.record.to_toml().into_diagnostic()?;
    let findings = check(&fitted.record, &record_text);
    if !arguments.json {
        report(&fitted, comparison.as_ref(), resampled.as_ref());
    }
    let id = fitted.record.id.clone();
    for f in &findings {
        warn(&format!("{id}: {}: {}", f.field, f.message));
    }
    let mut answer = Answer::Done;
    let mut written = Vec::new();
    let (mut record_file, mut fresh) = (None, false);
    if !findings.is_empty() {
        answer = Answer::Negative;
        warn(&format!(
            "{id}: not written, since the record would not pass `pliant db check`"
        ));
    } else if !arguments.dry_run {
        // Only a recipe that the database holds can be found again.
        let recipe = fitted.record.recipe.take();
        fitted.record.recipe = recipe.filter(|recipe| arguments.out.join(recipe).is_file());
        let put = Database::put(&arguments.out, &fitted.record).into_diagnostic()?;
        if !arguments.json {
            note(&put);
        }
        fresh = put.change != Change::Same;
        record_file = Some(put.file.display().to_string());
    }
    let mut drawings = Vec::new();
    if let Some(folder) = &arguments.plots {
        let target = arguments.page.as_deref().map_or(folder.as_path(), folder_of);
        for (name, words, svg) in draw(&fitted, comparison.as_ref(), resampled.as_ref()) {
            let file = folder.join(name);
            replace_file(&file, &svg.into_bytes()).map_err(|e| miette!("{}: {e}", file.display()))?;
            written.push(file.display().to_string());
            drawings.push((link(target, &file), words));
        }
    }
    if !arguments.json {
        let files = record_file.iter().filter(|_| fresh).chain(&written);
        files.for_each(|file| say(&format!("  wrote {file}")));
    }
    let mut value = value(&fitted, comparison.as_ref(), resampled.as_ref())?;
    value["findings"] = findings.iter().map(|f| f.message.clone()).collect();
    value["file"] = record_file.into();
    value["drawings"] = written.into();
    Ok(Done {
        answer,
        value,
        entry: Entry {
            fitted,
            comparison,
            bootstrap: resampled,
            drawings,
        },
    })
}

/// Says which version a record became, where it is not the first.
pub(super) fn note(put: &Put) {
    match put.change {
        Change::First => {}
        Change::Revised => say(&format!("  version {}; the one before is kept", put.version)),
        Change::Same => say(&format!("  version {} holds the same already", put.version)),
    }
}

/// Writes the page of all fits.
///
/// # Errors
/// What the system says.
pub fn write_page(file: &Path, entries: &[Entry]) -> miette::Result<()> {
    // What stands on the command line, without the place of the program: a page that a reader can make again.
    let words: Vec<String> = std::env::args().skip(1).collect();
    let command = format!("pliant {}", words.join(" "));
    let short = if words.len() > 20 {
        shortened(&words)
    } else {
        command
    };
    replace_file(file, page(entries, &short).as_bytes()).map_err(|e| miette!("{}: {e}", file.display()))
}

/// A long list of coupon files of one folder as the shell's pattern.
fn shortened(words: &[String]) -> String {
    let mut list: Vec<String> = Vec::new();
    for word in words {
        let path = Path::new(word);
        let coupon = path.extension().is_some_and(|e| e == "toml");
        let word = if coupon {
            folder_of(path).join("*.toml").display().to_string()
        } else {
            word.clone()
        };
        if list.last() != Some(&word) {
            list.push(word);
        }
    }
    format!("pliant {}", list.join(" "))
}

/// `file` as seen from the folder `from`, both relative to where the command runs, with `/` between.
fn link(from: &Path, file: &Path) -> String {
    let names = |path: &Path| -> Vec<String> {
        let parts = path
            .components()
            .map(|c| c.as_os_str().to_string_lossy().into_owned());
        parts.filter(|p| p != ".").collect()
    };
    let (from, file) = (names(from), names(file));
    let common = from.iter().zip(&file).take_while(|(a, b)| a == b).count();
    let mut parts = vec!["..".to_string(); from.len() - common];
    parts.extend(file[common..].iter().cloned());
    parts.join("/")
}

fn fit_file(path: &Path, text: &str, data: Option<&Path>) -> miette::Result<(CouponFile, Fitted)> {
    let (coupon, unknown) = CouponFile::parse(text, path).into_diagnostic()?;
    for u in unknown {
        warn(&format!(
            "warning: {}, line {}: {} is not a field that this version knows",
            path.display(),
            u.line,
            u.field
        ));
    }
    let own = path.parent().unwrap_or(Path::new("."));
    let folder = data.unwrap_or(own);
    let fitted = fit_coupon(&coupon, &|file| std::fs::read(folder.join(file)))
        .into_diagnostic()
        .wrap_err_with(|| format!("fitting {} (curves in {})", path.display(), folder.display()))?;
    Ok((coupon, fitted))
}

fn draw(
    fitted: &Fitted,
    comparison: Option<&Comparison>,
    resampled: Option<&Bootstrap>,
) -> Vec<(String, String, Svg)> {
    let id = &fitted.record.id;
    let mut list = Vec::new();
    let mut add = |ending: &str, words: &str, svg: Option<Svg>| {
        if let Some(svg) = svg {
            list.push((format!("{id}{ending}.svg"), format!("{id}: {words}"), svg));
        }
    };
    add(
        "",
        "measured points and the fitted law",
        stress_plot(fitted, resampled),
    );
    add("-errors", "what the law leaves", error_plot(fitted));
    if let Some(comparison) = comparison {
        add(
            "-laws",
            "laws beyond the range",
            Some(laws_plot(fitted, comparison)),
        );
    }
    list
}

fn stop_words(stop: Stop) -> &'static str {
    match stop {
        Stop::Gradient => "the gradient vanished",
        Stop::Step => "the step became negligible",
        Stop::Cost => "the error no longer falls",
        Stop::Iterations => "the iterations ran out: not converged",
        Stop::Cancelled => "stopped on request: not converged",
    }
}

fn report(fitted: &Fitted, comparison: Option<&Comparison>, resampled: Option<&Bootstrap>) {
    let record = &fitted.record;
    let law = match &fitted.fit {
        Some(fit) if record.model.hyperelastic.is_some() => fit.choice.word().to_string(),
        _ => format!("{} centres", record.model.centres.len()),
    };
    say(&format!("{} ({}), {law}", record.id, record.name));
    for m in &record.measurements {
        let [low, high] = m.strain;
        let width = m
            .lateral_relative_rms
            .map_or(String::new(), |e| format!(", width {:.2} %", 100.0 * e));
        say(&format!(
            "  {:21} {:6.1} to {:6.1} %: error {:5.2} % of the RMS stress{width}",
            m.test,
            100.0 * low,
            100.0 * high,
            100.0 * m.relative_rms
        ));
    }
    for held in &fitted.held_out {
        say(&format!(
            "  held out, {}: {} {} % of the RMS stress, {} MPa at most",
            held.file,
            held.test.kind.word(),
            error_words(&held.error),
            significant(held.error.largest_mpa, 2)
        ));
    }
    if let Some(fit) = &fitted.fit {
        say(&format!(
            "  all tests {:.2} %; {} steps from {} start{}, stopped since {}",
            100.0 * fit.relative_rms,
            fit.iterations,
            fit.starts,
            if fit.starts == 1 { "" } else { "s" },
            stop_words(fit.stop)
        ));
    }
    if let Some(knowledge) = &fitted.knowledge {
        for n in &knowledge.numbers {
            let error = match (n.standard_error, n.at_bound) {
                (_, true) => "at its bound".to_string(),
                (Some(e), _) => format!("± {}", significant(e, 2)),
                (None, _) => "silent".to_string(),
            };
            let loose = if n.determined {
                ""
            } else {
                ", not determined by the tests"
            };
            let value = significant(n.value, 5);
            say(&format!("  {} = {value} {error} {}{loose}", n.name, n.unit));
        }
    }
    if let Some(b) = resampled {
        say(&format!(
            "  {} sets of resampled residuals refitted, {} failed",
            b.samples, b.failed
        ));
        for (band, test) in b.bands.iter().zip(&fitted.tests) {
            say(&format!("  {}", band_words(band, test.kind.word(), b.confidence)));
        }
    }
    for assumption in &record.assumptions {
        say(&format!("  assumed: {assumption}"));
    }
    if let Some(comparison) = comparison {
        say(&comparison_table(comparison));
        for (choice, why) in &comparison.failed {
            say(&format!("  {} could not be fitted: {why}", choice.word()));
        }
        for words in &comparison.verdict {
            say(&format!("  {words}"));
        }
    }
}

/// The band at the end of the measured range, two thirds of the way for most tests, and at its own end.
fn band_words(band: &crate::fitting::coupon::bootstrap::Band, test: &str, confidence: f64) -> String {
    let at = |i: usize| match (band.strain.get(i), band.stress.get(i)) {
        (Some(e), Some([low, high])) => format!(
            "{} to {} MPa at {:.0} %",
            significant(*low, 4),
            significant(*high, 4),
            100.0 * e
        ),
        _ => "–".into(),
    };
    let last = band.strain.len().saturating_sub(1);
    format!(
        "{:.0} % band of {test}: {}, {}",
        100.0 * confidence,
        at(2 * last / 3),
        at(last)
    )
}

fn value(
    fitted: &Fitted,
    comparison: Option<&Comparison>,
    resampled: Option<&Bootstrap>,
) -> miette::Result<Value> {
    let record = &fitted.record;
    let numbers = fitted.knowledge.iter().flat_map(|k| &k.numbers).map(|n| {
        json!({
            "name": n.name, "value": n.value, "unit": n.unit, "standard_error": n.standard_error,
            "at_bound": n.at_bound, "determined": n.determined,
        })
    });
    let held = fitted.held_out.iter().map(|h| {
        json!({
            "specimen": h.specimen, "file": h.file, "test": h.test.kind.word(),
            "relative_rms": h.error.relative_rms, "largest_mpa": h.error.largest_mpa,
            "lateral_relative_rms": h.error.lateral_relative_rms,
        })
    });
    let laws = comparison.map(|c| {
        let rows = c.rows.iter().enumerate().map(|(i, r)| {
            json!({
                "law": r.fit.choice.word(), "numbers": r.parameters, "relative_rms": r.fit.relative_rms,
                "each": r.fit.errors.iter().map(|e| e.relative_rms).collect::<Vec<_>>(),
                "aicc": r.aicc, "faults": r.faults, "trusted_outside": c.outside == Some(i),
            })
        });
        json!({ "points": c.points, "rows": rows.collect::<Vec<_>>(), "verdict": c.verdict })
    });
    let bands = resampled.map(|b| {
        let bands = b.bands.iter().zip(&fitted.tests).map(|(band, test)| {
            json!({ "test": test.kind.word(), "strain": band.strain, "stress_mpa": band.stress })
        });
        json!({
            "samples": b.samples, "failed": b.failed, "confidence": b.confidence,
            "bands": bands.collect::<Vec<_>>(),
        })
    });
    Ok(json!({
        "id": record.id,
        "law": fitted.fit.as_ref().map(|f| f.choice.word()),
        "measurements": serde_json::to_value(&record.measurements).into_diagnostic()?,
        "relative_rms": fitted.fit.as_ref().map(|f| f.relative_rms),
        "held_out": held.collect::<Vec<_>>(),
        "numbers": numbers.collect::<Vec<_>>(),
        "assumptions": record.assumptions,
        "converged": fitted.fit.as_ref().map(|f| f.stop != Stop::Iterations),
        "stopped": fitted.fit.as_ref().map(|f| stop_words(f.stop)),
        "comparison": laws,
        "bootstrap": bands,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_go_from_the_page_to_the_drawing() {
        let at = |from: &str, file: &str| link(Path::new(from), Path::new(file));
        assert_eq!(at("docs", "docs/pictures/fits/a.svg"), "pictures/fits/a.svg");
        assert_eq!(at("out/pages", "out/plots/a.svg"), "../plots/a.svg");
        assert_eq!(at(".", "./a.svg"), "a.svg");
    }

    #[test]
    fn a_long_command_names_a_pattern() {
        let mut words: Vec<String> = vec!["fit".into()];
        words.extend((0..30).map(|i| format!("db/coupons/{i}.toml")));
        words.push("--compare".into());
        assert_eq!(shortened(&words), "pliant fit db/coupons/*.toml --compare");
    }
}
