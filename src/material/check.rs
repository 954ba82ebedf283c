//! Whether a material record can be trusted.
//!
//! The file being readable is not enough: the weights must belong to the moduli that people read beside them, the
//! stiffness must be positive definite and the uniaxial curve must rise over the fitted range and half again beyond it
//! in compression (a curve that falls makes folds in a pressed object), the check pairs must reproduce, and a source
//! must be named.

use super::homogeneous::first_fold;
use super::law::Law;
use super::record::{MaterialRecord, line_of_field};
use crate::math::mandel::Mandel;

/// Something in a record that is not as it should be.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The line in the file, from 1.
    pub line: usize,
    /// Path of the field.
    pub field: String,
    /// What was found, and what was expected.
    pub message: String,
}

/// Stored stresses and moduli must come back within this, relative to the largest of them.
const REPRODUCES: f64 = 1e-9;
/// Least ratio of the smallest to the largest eigenvalue of the secant stiffness.
const LEAST_CONDITION: f64 = 1e-7;
/// Compression that every material must stand without a fold, whatever it was measured in: objects are pressed.
const LEAST_COMPRESSION: f64 = -0.5;
/// No test presses further than this.
const MOST_COMPRESSION: f64 = -0.95;

/// All findings on a record whose file holds `text`; empty when it is sound.
pub fn check(record: &MaterialRecord, text: &str) -> Vec<Finding> {
    let mut findings = Findings {
        text,
        list: Vec::new(),
    };
    check_words(record, &mut findings);
    check_numbers(record, &mut findings);
    match record.law() {
        Ok(law) => {
            check_weights(record, &law, &mut findings);
            check_stability(record, &law, &mut findings);
            check_pairs(record, &law, &mut findings);
            check_uncertainty(record, &law, &mut findings);
        }
        Err(error) => findings.add("model", error.to_string()),
    }
    findings.list
}

struct Findings<'a> {
    text: &'a str,
    list: Vec<Finding>,
}

impl Findings<'_> {
    fn add(&mut self, field: &str, message: String) {
        self.list.push(Finding {
            line: line_of_field(self.text, field),
            field: field.into(),
            message,
        });
    }

    fn require(&mut self, holds: bool, field: &str, value: impl std::fmt::Display, expected: &str) {
        if !holds {
            self.add(field, format!("{value}: expected {expected}"));
        }
    }
}

/// Whether `id` is made of lower-case letters, digits and single hyphens.
pub fn is_id(id: &str) -> bool {
    !id.is_empty()
        && id.split('-').all(|part| {
            !part.is_empty() && part.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit())
        })
}

/// Whether `colour` reads #rrggbb.
pub fn is_colour(colour: &str) -> bool {
    colour.len() == 7 && colour.starts_with('#') && colour.bytes().skip(1).all(|b| b.is_ascii_hexdigit())
}

fn check_words(record: &MaterialRecord, findings: &mut Findings<'_>) {
    let id = &record.id;
    findings.require(
        is_id(id),
        "id",
        format!("{id:?}"),
        "lower-case letters, digits and hyphens",
    );
    findings.require(
        !record.name.trim().is_empty(),
        "name",
        "empty",
        "a name for people",
    );
    findings.require(
        is_colour(&record.colour),
        "colour",
        format!("{:?}", record.colour),
        "#rrggbb",
    );
    let source = &record.source;
    findings.require(
        !source.citation.trim().is_empty(),
        "source.citation",
        "empty",
        "whom to cite",
    );
    findings.require(
        !source.licence.trim().is_empty(),
        "source.licence",
        "empty",
        "the licence of the data",
    );
    let measured = record.synthetic || !record.measurements.is_empty();
    findings.require(
        measured,
        "measurements",
        "none",
        "at least one test, or synthetic = true",
    );
    findings.require(
        !record.checks.is_empty(),
        "checks",
        "none",
        "at least one strain with its stress",
    );
    for (i, m) in record.measurements.iter().enumerate() {
        let at = |name: &str| format!("measurements[{i}].{name}");
        findings.require(
            !m.specimen.trim().is_empty(),
            &at("specimen"),
            "empty",
            "a description",
        );
        findings.require(
            !m.file.trim().is_empty(),
            &at("file"),
            "empty",
            "the file in the source",
        );
        let error = m.relative_rms;
        findings.require(
            (0.0..=1.0).contains(&error),
            &at("relative_rms"),
            error,
            "a part of 1",
        );
        findings.require(m.points >= 2, &at("points"), m.points, "at least 2");
        let rising = m.strain[0] < m.strain[1] && m.strain[0] > -1.0;
        findings.require(
            rising,
            &at("strain"),
            format!("{:?}", m.strain),
            "from low to high, above −1",
        );
    }
}

fn check_numbers(record: &MaterialRecord, findings: &mut Findings<'_>) {
    let density = record.density_g_per_cm3;
    findings.require(
        density > 0.005 && density < 5.0,
        "density_g_per_cm3",
        density,
        "0.005 to 5 g/cm³ (is it in kg/m³?)",
    );
    findings.require(
        !record.model.centres.is_empty() || record.model.hyperelastic.is_some(),
        "model.centres",
        "none",
        "at least one centre",
    );
    let [low, high] = record.model.range.engineering_strain;
    let holds = low > -1.0 && low <= 0.0 && high >= 0.0 && low < high && high < 20.0;
    let found = format!("[{low}, {high}]");
    let expected = "from compression (above −1, at most 0) to tension (at least 0)";
    findings.require(holds, "model.range.engineering_strain", found, expected);
    for (i, centre) in record.model.centres.iter().enumerate() {
        let field = format!("model.centres[{i}].moduli_mpa");
        let plausible = centre.moduli_mpa.iter().all(|m| m.is_finite() && m.abs() < 1e6);
        // A soft material is below 1 GPa; the bulk modulus of a nearly incompressible one may be 1000 times its shear.
        findings.require(
            plausible,
            &field,
            format!("{:?}", centre.moduli_mpa),
            "MPa, below 10⁶ (is it in Pa?)",
        );
    }
}

fn check_weights(record: &MaterialRecord, law: &Law, findings: &mut Findings<'_>) {
    let other = match record.law_from_moduli() {
        Ok(other) => other,
        Err(error) => return findings.add("model.centres", error.to_string()),
    };
    match (law, &other) {
        (Law::Isotropic(a), Law::Isotropic(b)) => same_values(&a.values(), &b.values(), findings),
        (Law::TransverselyIsotropic(a), Law::TransverselyIsotropic(b)) => {
            same_values(&a.values(), &b.values(), findings)
        }
        (Law::Energy(a), Law::Energy(b)) => same_values(&a.values(), &b.values(), findings),
        _ => {}
    }
}

/// The weights must take the values of the moduli at the centres.
fn same_values<const V: usize>(stored: &[[f64; V]], from_moduli: &[[f64; V]], findings: &mut Findings<'_>) {
    for (i, (a, b)) in stored.iter().zip(from_moduli).enumerate() {
        if (0..V).any(|k| (a[k] - b[k]).abs() > REPRODUCES * b[k].abs().max(1.0)) {
            let field = format!("model.centres[{i}].moduli_mpa");
            findings.add(
                &field,
                format!("the weights give {a:?} here, the moduli {b:?} (interpolated form)"),
            );
        }
    }
}

/// Positive definite at a lattice of strains in the fitted range and around it, and no fold on the uniaxial path.
fn check_stability(record: &MaterialRecord, law: &Law, findings: &mut Findings<'_>) {
    let [low, high] = record.model.range.engineering_strain;
    let reach = low.abs().max(high).clamp(0.1, 2.0);
    // A hyperelastic secant is definite by construction, and its energy is not defined on the whole lattice.
    let lattice = match law {
        Law::Hyperelastic(_) => Vec::new(),
        _ => sampled_strains(reach),
    };
    for strain in lattice {
        let (_, secant) = law.stress_and_secant(&strain);
        let eigenvalues = secant.symmetric_eigenvalues();
        if eigenvalues.min().is_nan() || eigenvalues.min() <= LEAST_CONDITION * eigenvalues.max() {
            let range = format!("{:e} to {:e} MPa", eigenvalues.min(), eigenvalues.max());
            let at: Vec<f64> = strain.iter().copied().collect();
            findings.add(
                "model",
                format!("stiffness eigenvalues {range} at strain {at:?}: expected positive"),
            );
            break;
        }
    }
    let press = (1.5 * low).clamp(MOST_COMPRESSION, LEAST_COMPRESSION);
    for end in [press, high] {
        if end == 0.0 {
            continue;
        }
        if let Some(at) = first_fold(law, end, 150) {
            let place = if at >= low && at <= high {
                "inside"
            } else {
                "outside"
            };
            let message = format!(
                "the uniaxial stress falls at strain {at:.3}, {place} the fitted range: expected rising"
            );
            findings.add("model", message);
        }
    }
}

/// Uniaxial, plane and shear strains and their mixtures, on a fixed lattice up to `reach`.
fn sampled_strains(reach: f64) -> Vec<Mandel> {
    let steps = [-1.0, -0.4, 0.0, 0.4, 1.0];
    let mut strains = Vec::new();
    for a in steps {
        for b in steps {
            for c in steps {
                let k = reach;
                strains.push(Mandel::new(a * k, b * k, c * k, 0.0, 0.0, 0.0));
                strains.push(Mandel::new(
                    -0.3 * a * k,
                    -0.3 * a * k,
                    a * k,
                    b * k,
                    0.3 * c * k,
                    c * k,
                ));
            }
        }
    }
    strains
}

fn check_pairs(record: &MaterialRecord, law: &Law, findings: &mut Findings<'_>) {
    for (i, pair) in record.checks.iter().enumerate() {
        let stored = Mandel::from(pair.stress_mpa);
        let found = law.stress(&Mandel::from(pair.strain));
        let gap = (found - stored).norm();
        // Written so that NaN counts as wrong.
        let reproduces = gap <= REPRODUCES * stored.norm().max(1e-6);
        if !reproduces {
            let now: Vec<f64> = found.iter().copied().collect();
            let message = format!(
                "the law now answers {now:?}: expected the stored {:?}",
                pair.stress_mpa
            );
            findings.add(&format!("checks[{i}].stress_mpa"), message);
        }
    }
}

fn check_uncertainty(record: &MaterialRecord, law: &Law, findings: &mut Findings<'_>) {
    let Some(uncertainty) = &record.uncertainty else {
        return;
    };
    let known: Vec<String> = law.parameters().into_iter().map(|p| p.name).collect();
    let mut last = None;
    for (i, name) in uncertainty.parameters.iter().enumerate() {
        let field = format!("uncertainty.parameters[{i}]");
        match known.iter().position(|k| k == name) {
            None => findings.add(
                &field,
                format!("{name:?} is no parameter of the law: expected one of {known:?}"),
            ),
            place if place <= last => findings.add(
                &field,
                format!("{name:?}: expected each once, in the law's order"),
            ),
            place => last = place,
        }
    }
    let rows = &uncertainty.covariance;
    let n = rows.len();
    let matrix = nalgebra::DMatrix::from_fn(n, n, |i, j| rows[i].get(j).copied().unwrap_or(f64::NAN));
    let field = "uncertainty.covariance";
    if matrix.iter().any(|c| !c.is_finite()) {
        return findings.add(field, "found a number that is not finite".into());
    }
    let size = matrix.amax();
    findings.require(
        (&matrix - matrix.transpose()).amax() <= REPRODUCES * size,
        field,
        "not the same across its diagonal",
        "a symmetric matrix",
    );
    let least = matrix.symmetric_eigenvalues().iter().copied().fold(0.0, f64::min);
    // A parameter that the data leave free has an eigenvalue of zero, give or take rounding.
    findings.require(
        least >= -1e-6 * size,
        field,
        format!("a negative eigenvalue, {least:e}"),
        "a covariance",
    );
    findings.require(
        !uncertainty.basis.trim().is_empty(),
        "uncertainty.basis",
        "empty",
        "where the covariance comes from",
    );
}
