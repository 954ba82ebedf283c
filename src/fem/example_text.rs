//! `[[example]]` tables: force–displacement examples as people write them.

use super::example::{Contact, Example, MeasuredPoint};
use super::example_table::read_table;
use super::setup::ContactText;
use crate::units::document::{Document, Mistake};
use serde::Deserialize;
use toml::Spanned;

/// A force this little across the direction, as a share of it, counts as along it.
const ALONG: f64 = 1e-6;

/// `[[example]]`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExampleText {
    /// Its name.
    pub name: Spanned<String>,
    /// Middle of the patch \[mm\].
    pub point_mm: Spanned<[f64; 3]>,
    /// Direction of the force.
    pub direction: Spanned<[f64; 3]>,
    /// Radius of the patch, with unit.
    pub radius: Spanned<String>,
    /// The forces, ascending \[N\].
    pub forces_n: Option<Spanned<Vec<f64>>>,
    /// Displacement of the contact point along the force at each force \[mm\].
    pub displacements_mm: Option<Spanned<Vec<f64>>>,
    /// CSV file with displacements of points of the surface.
    pub file: Option<Spanned<String>>,
    /// Where the displacements come from.
    pub origin: Option<String>,
}

impl ExampleText {
    /// The keys that say where the force acts.
    pub fn contact(&self) -> ContactText {
        ContactText {
            point_mm: self.point_mm.clone(),
            direction: self.direction.clone(),
            radius: self.radius.clone(),
        }
    }
}

/// Reads all examples.
///
/// # Errors
/// [`Mistake`]: none at all, forces that do not rise, displacements that do not fit them, a file that is wrong.
pub fn read_examples(
    document: &Document,
    texts: &Spanned<Vec<ExampleText>>,
) -> Result<Vec<Example>, Mistake> {
    if texts.get_ref().is_empty() {
        return Err(document.mistake(&texts.span(), "found no [[example]], expected at least one"));
    }
    texts
        .get_ref()
        .iter()
        .map(|text| example(document, text))
        .collect()
}

fn example(document: &Document, text: &ExampleText) -> Result<Example, Mistake> {
    let contact = text.contact().read(document)?;
    let name = text.name.get_ref().clone();
    let origin = text.origin.clone().unwrap_or_else(|| "origin not stated".into());
    let (forces_n, points) = match (&text.forces_n, &text.displacements_mm, &text.file) {
        (Some(forces), Some(displacements), None) => {
            check_forces(document, forces)?;
            let n = forces.get_ref().len();
            if displacements.get_ref().len() != n {
                let found = displacements.get_ref().len();
                let message =
                    format!("found {found} displacements for {n} forces, expected one for each force");
                return Err(document.mistake(&displacements.span(), message));
            }
            if displacements.get_ref().iter().any(|d| !d.is_finite()) {
                return Err(document.mistake(
                    &displacements.span(),
                    "found a displacement that is not a finite number",
                ));
            }
            let displacements_mm = displacements.get_ref().iter().map(|&d| vec![Some(d)]).collect();
            let point = MeasuredPoint {
                place: contact.point,
                directions: vec![contact.direction],
                displacements_mm,
            };
            (forces.get_ref().clone(), vec![point])
        }
        (None, None, Some(file)) => read_points(document, file, &contact)?,
        _ => {
            let message = format!(
                "example {name:?} needs either forces_n and displacements_mm, or a file with displacements of points"
            );
            return Err(document.mistake(&text.name.span(), message));
        }
    };
    Ok(Example {
        name,
        contact,
        forces_n,
        points,
        origin,
    })
}

/// Forces rise from above zero.
///
/// # Errors
/// [`Mistake`] at their place.
pub fn check_forces(document: &Document, forces: &Spanned<Vec<f64>>) -> Result<(), Mistake> {
    let list = forces.get_ref();
    let rising = list.first().is_some_and(|&f| f > 0.0) && list.windows(2).all(|w| w[0] < w[1]);
    if rising && list.iter().all(|f| f.is_finite()) {
        return Ok(());
    }
    Err(document.mistake(
        &forces.span(),
        format!("found forces {list:?}, expected rising numbers above zero [N]"),
    ))
}

/// A search presses along the contact's direction alone.
fn read_points(
    document: &Document,
    file: &Spanned<String>,
    contact: &Contact,
) -> Result<(Vec<f64>, Vec<MeasuredPoint>), Mistake> {
    let table = read_table(document, file, &contact.direction)?;
    let along: Vec<f64> = table.forces.iter().map(|f| f.dot(&contact.direction)).collect();
    for (force, along) in table.forces.iter().zip(&along) {
        let across = (force - contact.direction * *along).norm();
        if across > ALONG * along {
            let message = format!(
                "{}: found a force of {along:.3} N with {across:.3} N across the direction, expected forces along it (give force_n)",
                file.get_ref()
            );
            return Err(document.mistake(&file.span(), message));
        }
    }
    Ok((along, table.points))
}
