//! Which materials of the database are wanted, and in which order.

use super::law::Law;
use super::record::{Kind, MaterialRecord};
use crate::math::mandel::Mandel;
use std::cmp::Ordering;

/// What a material must be like. What is not set lets everything through.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// The symmetry.
    pub kind: Option<Kind>,
    /// Least and largest Young's modulus at rest, along the axis \[MPa\].
    pub stiffness_mpa: Option<[f64; 2]>,
    /// Whether a multi-material printer can lay it down.
    pub printable: Option<bool>,
    /// Words of how it is made; all must be there, in any case of letters.
    pub printer: Option<String>,
    /// Words of the citation, the licence or the link.
    pub source: Option<String>,
    /// Whether it is estimated rather than measured.
    pub synthetic: Option<bool>,
}

/// What materials are sorted by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// The id.
    #[default]
    Id,
    /// Young's modulus at rest, rising.
    Stiffness,
    /// The largest error of its tests, rising; what was not measured last.
    Error,
    /// The density, rising.
    Density,
}

impl Selection {
    /// Whether the material of `record`, with its `law`, is wanted.
    pub fn takes(&self, record: &MaterialRecord, law: &Law) -> bool {
        let source = &record.source;
        let source = [
            &source.citation,
            &source.licence,
            source.link.as_ref().unwrap_or(&source.licence),
        ]
        .map(String::as_str)
        .join(" ");
        let stiffness = law.young_modulus(&Mandel::zeros());
        self.kind.is_none_or(|kind| kind == record.kind)
            && self
                .stiffness_mpa
                .is_none_or(|[low, high]| stiffness >= low && stiffness <= high)
            && self.printable.is_none_or(|p| p == record.printability.printable)
            && has_words(&self.printer, &record.printability.process)
            && has_words(&self.source, &source)
            && self.synthetic.is_none_or(|s| s == record.synthetic)
    }
}

fn has_words(words: &Option<String>, text: &str) -> bool {
    let text = text.to_lowercase();
    words.as_ref().is_none_or(|words| {
        words
            .to_lowercase()
            .split_whitespace()
            .all(|word| text.contains(word))
    })
}

impl Order {
    /// The order of two materials; equal ones by their ids.
    pub fn of(self, a: (&MaterialRecord, &Law), b: (&MaterialRecord, &Law)) -> Ordering {
        let key = |(record, law): (&MaterialRecord, &Law)| match self {
            Order::Id => 0.0,
            Order::Stiffness => law.young_modulus(&Mandel::zeros()),
            Order::Error => record.relative_rms().unwrap_or(f64::INFINITY),
            Order::Density => record.density_g_per_cm3,
        };
        key(a).total_cmp(&key(b)).then_with(|| a.0.id.cmp(&b.0.id))
    }
}
