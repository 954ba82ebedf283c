//! `[[example]]` tables: force–displacement examples as people write them.

use super::example::{Example, MeasuredPoint};
use super::setup::ContactText;
use crate::math::Vec3;
use crate::units::document::{Document, Mistake};
use serde::Deserialize;
use toml::Spanned;

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
        (None, None, Some(file)) => read_points(document, file)?,
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

const COLUMNS: [&str; 7] = ["force_n", "x_mm", "y_mm", "z_mm", "dx_mm", "dy_mm", "dz_mm"];

#[derive(serde::Deserialize)]
struct PointRow {
    force_n: f64,
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    dx_mm: Option<f64>,
    dy_mm: Option<f64>,
    dz_mm: Option<f64>,
}

/// Reads `force_n, x_mm, y_mm, z_mm, dx_mm, dy_mm, dz_mm`: one row a point and force, every point at every force; an empty
/// displacement is a marker that was lost.
fn read_points(
    document: &Document,
    file: &Spanned<String>,
) -> Result<(Vec<f64>, Vec<MeasuredPoint>), Mistake> {
    let path = document.resolve(file.get_ref());
    let bad = |line: u64, message: String| {
        document.mistake(
            &file.span(),
            format!("{}, line {line}: {message}", path.display()),
        )
    };
    let mut reader = csv::Reader::from_path(&path).map_err(|e| bad(0, e.to_string()))?;
    let headers = reader.headers().map_err(|e| bad(1, e.to_string()))?;
    // An absent column would read as markers that were all lost.
    if let Some(absent) = COLUMNS.iter().find(|c| !headers.iter().any(|h| h == **c)) {
        return Err(bad(
            1,
            format!("found no column {absent}, expected {}", COLUMNS.join(",")),
        ));
    }
    let mut forces: Vec<f64> = Vec::new();
    let mut points: Vec<MeasuredPoint> = Vec::new();
    for (index, row) in reader.deserialize::<PointRow>().enumerate() {
        let line = index as u64 + 2;
        let row = row.map_err(|e| bad(line, e.to_string()))?;
        let place = Vec3::new(row.x_mm, row.y_mm, row.z_mm);
        let moved = [row.dx_mm, row.dy_mm, row.dz_mm];
        if !place.iter().chain(moved.iter().flatten()).all(|x| x.is_finite()) || !row.force_n.is_finite() {
            return Err(bad(line, "found a number that is not finite".into()));
        }
        if forces.last() != Some(&row.force_n) {
            if row.force_n <= forces.last().copied().unwrap_or(0.0) {
                return Err(bad(
                    line,
                    format!(
                        "found a force of {} N, expected rising forces above zero",
                        row.force_n
                    ),
                ));
            }
            forces.push(row.force_n);
        }
        let level = forces.len() - 1;
        let index = match points.iter().position(|p| p.place == place) {
            Some(index) => index,
            None => {
                let directions = vec![Vec3::x(), Vec3::y(), Vec3::z()];
                points.push(MeasuredPoint {
                    place,
                    directions,
                    displacements_mm: vec![vec![None; 3]; level],
                });
                points.len() - 1
            }
        };
        let series = &mut points[index].displacements_mm;
        if series.len() > level {
            return Err(bad(
                line,
                format!(
                    "the point {:?} stands twice at {} N",
                    [place.x, place.y, place.z],
                    row.force_n
                ),
            ));
        }
        series.resize(level, vec![None; 3]);
        series.push(moved.to_vec());
    }
    if points.is_empty() {
        return Err(bad(
            1,
            "found no rows, expected force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm".into(),
        ));
    }
    for point in &mut points {
        point.displacements_mm.resize(forces.len(), vec![None; 3]);
    }
    Ok((forces, points))
}
