//! The page of coupon fits, in Markdown: what was fitted, how well it predicts what was held out, which law to trust.

use super::coupon_table::{comparison_markdown, error_words};
use super::ticks::fixed;
use crate::fitting::coupon::bootstrap::Bootstrap;
use crate::fitting::coupon::compare::Comparison;
use crate::fitting::coupon::file::LawChoice;
use crate::fitting::coupon::record::Fitted;

/// One material of the page.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its record, tests and fit.
    pub fitted: Fitted,
    /// Other laws, if they were compared.
    pub comparison: Option<Comparison>,
    /// Its band, if residuals were resampled.
    pub bootstrap: Option<Bootstrap>,
    /// Links from the page to its drawings, with what they show.
    pub drawings: Vec<(String, String)>,
}

/// The whole page. `command` is what made it.
pub fn page(entries: &[Entry], command: &str) -> String {
    let mut text = format!(
        "# Coupon fits\n\nMade by `{command}`.\n\n\
         The error of a test is the root mean square of the law's stress error over that of the measured stress, over the \
         strains that were fitted; `width` is the same for lateral strain. `all` is the root of the mean of the squares over \
         the tests, by their weights. A held-out test (a repeat, another specimen, another range) took no part in the fit. \
         AICc = n ln S + 2k + 2k(k + 1)/(n − k − 1), with S the square of `all`, n points and k − 1 fitted numbers; \
         neighbouring residuals are alike, so differences below about 10 say little.\n\n"
    );
    text.push_str(&overview(entries));
    for entry in entries.iter().filter(|e| e.fitted.fit.is_some()) {
        text.push_str(&section(entry));
    }
    text
}

fn overview(entries: &[Entry]) -> String {
    let mut text = String::from(
        "| material | law of the record | fitted: error % | held out: error % | best AICc | outside the range |\n\
         |---|---|---|---|---|---|\n",
    );
    for entry in entries {
        let Some(fit) = &entry.fitted.fit else { continue };
        let fitted = entry.fitted.tests.iter().zip(&fit.errors);
        let fitted: Vec<String> = fitted
            .map(|(t, e)| format!("{} {}", t.kind.word(), error_words(e)))
            .collect();
        let held: Vec<String> = entry
            .fitted
            .held_out
            .iter()
            .map(|h| format!("{} {}", h.test.kind.word(), error_words(&h.error)))
            .collect();
        let law = |i: usize| {
            let row = entry.comparison.as_ref().and_then(|c| c.rows.get(i));
            row.map_or("–", |r| r.fit.choice.word())
        };
        let outside = entry.comparison.as_ref().map(|c| match c.outside.map(law) {
            None => "none".to_string(),
            Some(word) if word == LawChoice::Rbf.word() => format!("{word}, a guess"),
            Some(word) => word.to_string(),
        });
        let record = &entry.fitted.record;
        text.push_str(&format!(
            "| [{}](#{}) | {} | {} | {} | {} | {} |\n",
            record.name,
            record.id,
            fit.choice.word(),
            fitted.join(", "),
            if held.is_empty() {
                "–".into()
            } else {
                held.join(", ")
            },
            law(0),
            outside.unwrap_or("–".into())
        ));
    }
    text
}

fn section(entry: &Entry) -> String {
    let record = &entry.fitted.record;
    let mut text = format!(
        "\n## {}\n\n{}\n\nData: {}",
        record.id, record.name, record.source.citation
    );
    text.push_str(&format!(" ({}).\n\n", record.source.licence));
    for (link, words) in &entry.drawings {
        text.push_str(&format!("![{words}]({link})\n"));
    }
    for held in &entry.fitted.held_out {
        text.push_str(&format!(
            "\nHeld out: {}, `{}`: {} % of its RMS stress, {} MPa at most.\n",
            held.specimen,
            held.file,
            error_words(&held.error),
            super::ticks::significant(held.error.largest_mpa, 2)
        ));
    }
    if let Some(knowledge) = &entry.fitted.knowledge {
        let loose: Vec<&str> = knowledge
            .numbers
            .iter()
            .filter(|n| !n.determined)
            .map(|n| n.name.as_str())
            .collect();
        if !loose.is_empty() {
            text.push_str(&format!("\nThe tests do not determine: {}.\n", loose.join(", ")));
        }
    }
    if let Some(bootstrap) = &entry.bootstrap {
        text.push_str(&format!(
            "\nBand: {} % of the laws refitted to {} sets of resampled residuals.\n",
            fixed(100.0 * bootstrap.confidence, 0),
            bootstrap.samples
        ));
    }
    if let Some(comparison) = &entry.comparison {
        text.push('\n');
        text.push_str(&comparison_markdown(comparison));
        for words in &comparison.verdict {
            text.push_str(&format!("\n{}.\n", upper(words)));
        }
    }
    text
}

fn upper(words: &str) -> String {
    let mut chars = words.chars();
    match chars.next() {
        Some(first) => first.to_uppercase().collect::<String>() + chars.as_str(),
        None => String::new(),
    }
}
