//! What tables and pages say about the materials of the database: numbers of a law, and words for the rest.

use crate::material::homogeneous::uniaxial;
use crate::material::law::Law;
use crate::material::record::{Kind, MaterialRecord};
use crate::math::mandel::Mandel;

/// Compression at which a second modulus is given.
pub const PRESSED: f64 = -0.3;

/// The numbers that a material is told apart by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialSummary {
    /// Young's modulus at rest, along the axis of a transversely isotropic material \[MPa\].
    pub young_at_rest_mpa: f64,
    /// Secant modulus of the uniaxial test at [`PRESSED`] \[MPa\].
    pub young_pressed_mpa: f64,
    /// Poisson's ratio at rest, in Biot strain.
    pub poisson_at_rest: f64,
}

impl MaterialSummary {
    /// The numbers of a law.
    pub fn of(law: &Law) -> Self {
        MaterialSummary {
            young_at_rest_mpa: law.young_modulus(&Mandel::zeros()),
            young_pressed_mpa: uniaxial(law, PRESSED).stress / PRESSED,
            poisson_at_rest: law.poisson_ratio_at_rest(),
        }
    }
}

/// A part of 1 in percent, as `1.5 %`.
pub fn percent(part: f64) -> String {
    format!("{:.1} %", 100.0 * part)
}

/// The strain of the uniaxial tests, as `-59 to 30 %`.
pub fn range_words(record: &MaterialRecord) -> String {
    let [low, high] = record.model.range.engineering_strain;
    format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high)
}

/// Each test with its error.
pub fn tests_words(record: &MaterialRecord) -> String {
    let words: Vec<String> = record
        .measurements
        .iter()
        .map(|m| match m.lateral_relative_rms {
            Some(width) => format!("{} {}, width {}", m.test, percent(m.relative_rms), percent(width)),
            None => format!("{} {}", m.test, percent(m.relative_rms)),
        })
        .collect();
    match words.is_empty() {
        true => "not measured".into(),
        false => words.join("; "),
    }
}

/// The symmetry, and whether it is synthetic.
pub fn kind_words(record: &MaterialRecord) -> String {
    let kind = match record.kind {
        Kind::Isotropic => "isotropic",
        Kind::TransverselyIsotropic => "transverse",
    };
    match record.synthetic {
        true => format!("{kind}, synthetic"),
        false => kind.to_string(),
    }
}

/// The first author (or what the citation begins with) and the year in parentheses.
pub fn short_source(record: &MaterialRecord) -> String {
    let citation = &record.source.citation;
    let first: String = citation
        .split([',', '('])
        .next()
        .unwrap_or_default()
        .trim()
        .chars()
        .take(24)
        .collect();
    let year: String = citation
        .split('(')
        .skip(1)
        .map(|rest| rest.chars().take(4).collect::<String>())
        .find(|y| y.len() == 4 && y.bytes().all(|b| b.is_ascii_digit()))
        .unwrap_or_default();
    format!("{first} {year}").trim().to_string()
}
