//! What changed from one record of a material to another: fields, parameters of the law, and the curve.
//!
//! ```text
//! moved = √(mean (P₂ − P₁)²) / √(mean P₁²)      over the strains that both were fitted in
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | P₁, P₂ | nominal stress of the uniaxial test by the law before and after, at the same engineering strain | MPa |

use super::homogeneous::uniaxial;
use super::law::Law;
use super::record::MaterialRecord;

/// A field that holds something else, appeared or went.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldChange {
    /// Path of the field, as `source.citation`.
    pub field: String,
    /// What it held, shortened; none where it was missing.
    pub before: Option<String>,
    /// What it holds; none where it is missing.
    pub after: Option<String>,
}

/// A parameter of the law that moved.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterChange {
    /// Its name, as [`Law::parameters`] gives it.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Its value before.
    pub before: f64,
    /// Its value after.
    pub after: f64,
}

/// How far the uniaxial curve moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveChange {
    /// Engineering strains that were compared.
    pub strain: [f64; 2],
    /// RMS of the stress change over the RMS of the stress before.
    pub relative_rms: f64,
    /// The largest stress change \[MPa\].
    pub largest_mpa: f64,
    /// The engineering strain of the largest change.
    pub largest_at: f64,
}

/// Everything that changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Difference {
    /// Fields but those of the law and the versions' own.
    pub fields: Vec<FieldChange>,
    /// Parameters that moved; empty where the laws have others altogether, as `other_law` says.
    pub parameters: Vec<ParameterChange>,
    /// The laws are of different kinds, or have other centres.
    pub other_law: bool,
    /// How far the curve moved; none where a law can't be made, or the two were fitted in no common range.
    pub curve: Option<CurveChange>,
}

impl Difference {
    /// What changed from `before` to `after`.
    pub fn between(before: &MaterialRecord, after: &MaterialRecord) -> Self {
        let mut difference = Difference {
            fields: field_changes(before, after),
            ..Difference::default()
        };
        let (Ok(first), Ok(second)) = (before.law(), after.law()) else {
            difference.other_law = before.model != after.model;
            return difference;
        };
        match parameter_changes(&first, &second) {
            Some(changes) => difference.parameters = changes,
            None => difference.other_law = true,
        }
        let centres = |r: &MaterialRecord| -> Vec<Vec<f64>> {
            r.model.centres.iter().map(|c| c.invariants.clone()).collect()
        };
        difference.other_law |= centres(before) != centres(after);
        let [a, b] = [
            before.model.range.engineering_strain,
            after.model.range.engineering_strain,
        ];
        let common = [a[0].max(b[0]), a[1].min(b[1])];
        if common[0] < common[1] {
            difference.curve = Some(CurveChange::between(&first, &second, common));
        }
        difference
    }

    /// Whether nothing changed.
    pub fn is_empty(&self) -> bool {
        self.fields.is_empty() && self.parameters.is_empty() && !self.other_law
    }
}

impl CurveChange {
    const STEPS: usize = 100;

    /// From the law `before` to the law `after`, over engineering strains from `low` to `high`.
    pub fn between(before: &Law, after: &Law, [low, high]: [f64; 2]) -> Self {
        let (mut change, mut size) = (0.0, 0.0);
        let (mut largest, mut largest_at) = (0.0_f64, low);
        for i in 0..=Self::STEPS {
            let axial = low + (high - low) * i as f64 / Self::STEPS as f64;
            let (p1, p2) = (uniaxial(before, axial).stress, uniaxial(after, axial).stress);
            change += (p2 - p1) * (p2 - p1);
            size += p1 * p1;
            if (p2 - p1).abs() > largest {
                (largest, largest_at) = ((p2 - p1).abs(), axial);
            }
        }
        CurveChange {
            strain: [low, high],
            relative_rms: match change == 0.0 {
                true => 0.0,
                false => (change / size).sqrt(),
            },
            largest_mpa: largest,
            largest_at,
        }
    }
}

/// The parameters that moved by more than rounding; none where their names differ.
fn parameter_changes(before: &Law, after: &Law) -> Option<Vec<ParameterChange>> {
    let (first, second) = (before.parameters(), after.parameters());
    let names =
        |list: &[super::law::Parameter]| -> Vec<String> { list.iter().map(|p| p.name.clone()).collect() };
    if std::mem::discriminant(before) != std::mem::discriminant(after) || names(&first) != names(&second) {
        return None;
    }
    let pairs = first.into_iter().zip(second);
    Some(
        pairs
            .filter(|(a, b)| (a.value - b.value).abs() > 1e-12 * a.value.abs().max(1.0))
            .map(|(a, b)| ParameterChange {
                name: a.name,
                unit: a.unit,
                before: a.value,
                after: b.value,
            })
            .collect(),
    )
}

/// Fields that are told apart by the version, or spoken of by parameters and curve.
const PASSED_OVER: [&str; 6] = [
    "schema",
    "version",
    "previous_sha256",
    "model.constant",
    "model.centres",
    "checks",
];

fn field_changes(before: &MaterialRecord, after: &MaterialRecord) -> Vec<FieldChange> {
    let mut changes = Vec::new();
    if let (Ok(a), Ok(b)) = (toml::Value::try_from(before), toml::Value::try_from(after)) {
        compare(Some(&a), Some(&b), "", &mut changes);
    }
    changes
}

fn compare(a: Option<&toml::Value>, b: Option<&toml::Value>, path: &str, changes: &mut Vec<FieldChange>) {
    use toml::Value::{Array, Table};
    if a == b || PASSED_OVER.contains(&path) {
        return;
    }
    match (a, b) {
        (Some(Table(a)), Some(Table(b))) => {
            let new = b.keys().filter(|key| !a.contains_key(*key));
            for key in a.keys().chain(new) {
                let inner = match path.is_empty() {
                    true => key.clone(),
                    false => format!("{path}.{key}"),
                };
                compare(a.get(key), b.get(key), &inner, changes);
            }
        }
        // Lists of tables row by row, lists of words by what came and went, lists of numbers as a whole.
        (Some(Array(a)), Some(Array(b))) if a.iter().chain(b).all(toml::Value::is_table) => {
            for i in 0..a.len().max(b.len()) {
                compare(a.get(i), b.get(i), &format!("{path}[{i}]"), changes);
            }
        }
        (Some(Array(a)), Some(Array(b)))
            if a.iter().chain(b).all(toml::Value::is_str) && came(a, b).chain(came(b, a)).count() > 0 =>
        {
            let change = |before: Option<&toml::Value>, after: Option<&toml::Value>| FieldChange {
                field: path.into(),
                before: before.map(shortened),
                after: after.map(shortened),
            };
            changes.extend(came(b, a).map(|gone| change(Some(gone), None)));
            changes.extend(came(a, b).map(|new| change(None, Some(new))));
        }
        _ => changes.push(FieldChange {
            field: path.into(),
            before: a.map(shortened),
            after: b.map(shortened),
        }),
    }
}

/// What stands in `new` and not in `old`.
fn came<'a>(old: &'a [toml::Value], new: &'a [toml::Value]) -> impl Iterator<Item = &'a toml::Value> {
    new.iter().filter(|value| !old.contains(value))
}

/// A value as text, cut where it is long.
fn shortened(value: &toml::Value) -> String {
    const MOST: usize = 120;
    let text = match value {
        toml::Value::Table(table) => format!("{{{} fields}}", table.len()),
        value => value.to_string(),
    };
    match text.chars().count() > MOST {
        true => text.chars().take(MOST).chain(['…']).collect(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::hyperelastic::{Form, Hyperelastic};
    use crate::material::record::Model;
    use std::path::Path;

    fn silk() -> MaterialRecord {
        let text = include_str!("../../materials-db/body-double-silk.toml");
        MaterialRecord::parse(text, Path::new("body-double-silk.toml"))
            .unwrap()
            .0
    }

    #[test]
    fn nothing_changed() {
        let difference = Difference::between(&silk(), &silk());
        assert!(difference.is_empty(), "{difference:?}");
        assert_eq!(difference.curve.unwrap().relative_rms, 0.0);
    }

    /// All moduli 2 % larger: the curve moves by 2 % and every logarithm by ln 1.02.
    #[test]
    fn a_stiffer_law() {
        let before = silk();
        let law = before.law().unwrap();
        let values: Vec<f64> = law.parameters().iter().map(|p| p.value + 1.02_f64.ln()).collect();
        let mut after = before.clone();
        let stiffer = law.with_parameters(&values).unwrap();
        after.model = Model::of(&stiffer, before.model.range.engineering_strain).unwrap();
        let difference = Difference::between(&before, &after);
        assert!(
            difference.fields.is_empty() && !difference.other_law,
            "{difference:?}"
        );
        assert_eq!(difference.parameters.len(), values.len());
        for p in &difference.parameters {
            assert!((p.after - p.before - 1.02_f64.ln()).abs() < 1e-9, "{p:?}");
        }
        let curve = difference.curve.unwrap();
        assert!((curve.relative_rms - 0.02).abs() < 1e-6, "{curve:?}");
        let high = before.model.range.engineering_strain[1];
        assert!((curve.largest_at - high).abs() < 1e-12, "{curve:?}");
        let expected = 0.02 * uniaxial(&law, high).stress;
        assert!((curve.largest_mpa - expected).abs() < 1e-6 * expected);
    }

    #[test]
    fn fields_and_other_laws() {
        let before = silk();
        let mut after = before.clone();
        after.version = 2;
        after.density_g_per_cm3 = 1.2;
        after.source.link = None;
        after.measurements[0].points = 7;
        after.assumptions.push("another".into());
        let form = Form::NeoHookeanIsochoric {
            shear_mpa: 0.1,
            bulk_mpa: 5.0,
        };
        let law = Law::Hyperelastic(Hyperelastic::new(form).unwrap());
        after.model = Model::of(&law, [0.0, 1.0]).unwrap();
        let difference = Difference::between(&before, &after);
        let change = |field: &str| {
            difference
                .fields
                .iter()
                .find(|f| f.field == field)
                .unwrap_or_else(|| panic!("{field}"))
        };
        assert_eq!(change("density_g_per_cm3").after.as_deref(), Some("1.2"));
        assert_eq!(change("source.link").after, None);
        assert_eq!(change("measurements[0].points").after.as_deref(), Some("7"));
        // The word that came, without those that stayed.
        assert_eq!(change("assumptions").after.as_deref(), Some("\"another\""));
        assert_eq!(change("assumptions").before, None);
        assert!(difference.fields.iter().all(|f| f.field != "version"));
        assert!(difference.other_law && difference.parameters.is_empty());
        assert!(difference.curve.unwrap().relative_rms > 0.1);
    }
}
