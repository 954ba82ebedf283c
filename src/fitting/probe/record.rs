//! From a fit to a material record.

use super::errors::Errors;
use super::fit::{ProbeFit, Tangential};
use super::spread::WEAK;
use crate::fem::measurement_set::{MeasurementSet, Origin};
use crate::material::law::{Law, LawError};
use crate::material::record::{CheckPair, MaterialRecord, Measurement, Model, SCHEMA, Uncertainty, rounded};

/// The record of the material that was fitted to `set`; `recipe` is the set's file as the database's folder sees it.
///
/// # Errors
/// A law that records don't hold.
pub fn record(
    set: &MeasurementSet,
    fit: &ProbeFit,
    recipe: Option<String>,
) -> Result<MaterialRecord, LawError> {
    let card = &set.material;
    let strain = fit.strain.map(|e| rounded(e, 4));
    let file = set.document.file.file_name().map_or_else(
        || "the measurement set".to_string(),
        |n| n.to_string_lossy().into_owned(),
    );
    let mut measurements = vec![measurement("probe", set, &fit.errors, strain, &file)];
    if let Some(Ok(errors)) = &fit.held_out {
        measurements.push(measurement("probe, held out", set, errors, strain, &file));
    }
    let mut assumptions = card.assumptions.clone();
    assumptions.extend(own_assumptions(set, fit));
    Ok(MaterialRecord {
        schema: SCHEMA,
        version: 0,
        recipe,
        previous_sha256: None,
        id: card.id.clone(),
        name: card.name.clone(),
        kind: card.kind,
        // Computed displacements are no measurement: searches take such a record only when asked to.
        synthetic: matches!(set.origin, Origin::Computed(_)),
        colour: card.colour.clone(),
        density_g_per_cm3: card.density_g_per_cm3,
        assumptions,
        printability: card.printability.clone(),
        source: card.source.clone(),
        model: Model::of(&fit.law, strain)?,
        uncertainty: uncertainty(fit),
        measurements,
        checks: CheckPair::over(&along_z(&fit.law), strain),
    })
}

/// A record's law has its axis along z.
fn along_z(law: &Law) -> Law {
    law.rotated(&crate::math::Vec3::z())
}

fn measurement(
    test: &str,
    set: &MeasurementSet,
    errors: &Errors,
    strain: [f64; 2],
    file: &str,
) -> Measurement {
    let (low, high) = set.bounds();
    let size = high - low;
    let points = errors
        .markers
        .iter()
        .map(|m| m.errors_mm.iter().flatten().count());
    Measurement {
        test: test.into(),
        specimen: format!("{:.1} × {:.1} × {:.1} mm, pressed", size.x, size.y, size.z),
        date: None,
        file: file.into(),
        strain,
        points: points.sum(),
        relative_rms: rounded(errors.relative(), 5),
        lateral_relative_rms: None,
        rms_mm: Some(rounded(errors.rms_mm, 5)),
        largest_mm: Some(rounded(errors.largest_mm, 5)),
    }
}

fn uncertainty(fit: &ProbeFit) -> Option<Uncertainty> {
    let spread = fit.spread.as_ref()?;
    let rows = spread.covariance.row_iter();
    let rows: Vec<Vec<f64>> = rows.map(|row| row.iter().copied().collect()).collect();
    Uncertainty::of(&fit.law, &rows, spread.basis.clone())
}

/// What the fit itself had to assume, in words.
fn own_assumptions(set: &MeasurementSet, fit: &ProbeFit) -> Vec<String> {
    let mut list = vec![format!(
        "fitted through a finite-element model of {} elements: its own error is in the moduli",
        set.mesh.elements.len()
    )];
    if let Origin::Computed(from) = &set.origin {
        list.push(format!("not measured: the displacements are computed ({from})"));
    }
    match &fit.tangential {
        Tangential::Used { forces, .. } => {
            let largest = forces.iter().flat_map(|(_, f)| f).map(|f| f.norm());
            let largest = largest.fold(0.0, f64::max);
            list.push(format!(
                "tangential forces under the probe were estimated from the markers there, up to {largest:.2} N"
            ));
        }
        Tangential::Off | Tangential::Untold => {
            list.push("the probe's force is taken as measured, without tangential parts of its own".into());
        }
        Tangential::Dropped => {}
    }
    if let Some(spread) = &fit.spread {
        let weak: Vec<&str> = spread
            .deviations
            .iter()
            .filter(|(_, d)| *d > WEAK)
            .map(|(name, _)| name.as_str())
            .collect();
        if !weak.is_empty() {
            list.push(format!(
                "hardly determined by the data, and held near their neighbours: {}",
                weak.join(", ")
            ));
        }
        if !spread.at_bound.is_empty() {
            list.push(format!("at a bound of the fit: {}", spread.at_bound.join(", ")));
        }
    }
    if !fit.has_converged() {
        list.push(format!("the fit had not converged: {}", fit.stop));
    }
    list
}
