//! `[[example]]` tables: force–displacement examples as people write them.

use super::example::{Contact, Example, MeasuredPoint};
use super::example_table::{ExampleTable, read_table};
use super::setup::{ContactText, quantity};
use crate::units;
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
    /// Force over displacement of the contact point, with unit: one, or a list.
    pub stiffness: Option<Spanned<toml::Value>>,
    /// The force at which it has that stiffness, with unit: one, or a list.
    pub at: Option<Spanned<toml::Value>>,
    /// How far a displacement or stiffness may be off without counting: with unit or in percent, one or one for each force.
    pub tolerance: Option<Spanned<toml::Value>>,
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

/// What an example asks for.
struct Asked {
    forces_n: Vec<f64>,
    points: Vec<MeasuredPoint>,
    tolerances_mm: Vec<Vec<f64>>,
}

fn example(document: &Document, text: &ExampleText) -> Result<Example, Mistake> {
    let contact = text.contact().read(document)?;
    let name = text.name.get_ref().clone();
    let (asked, origin) = match (
        &text.forces_n,
        &text.displacements_mm,
        &text.file,
        &text.stiffness,
    ) {
        (Some(forces), Some(displacements), None, None) => {
            let curve = curve(document, forces, displacements, &contact, &text.tolerance)?;
            (curve, "origin not stated")
        }
        (None, None, Some(file), None) => {
            let points = read_points(document, file, &contact, &text.tolerance)?;
            (points, "origin not stated")
        }
        (None, None, None, Some(stiffness)) => (
            stiffnesses(document, text, stiffness, &contact)?,
            "a stiffness that is asked for",
        ),
        _ => {
            let message = format!(
                "example {name:?} needs either forces_n and displacements_mm, or a file with displacements of points, or stiffness and at"
            );
            return Err(document.mistake(&text.name.span(), message));
        }
    };
    if let (Some(at), None) = (&text.at, &text.stiffness) {
        let message = "found at without stiffness, expected for instance stiffness = \"8 N/mm\" beside it";
        return Err(document.mistake(&at.span(), message));
    }
    Ok(Example {
        name,
        contact,
        forces_n: asked.forces_n,
        points: asked.points,
        tolerances_mm: asked.tolerances_mm,
        origin: text.origin.clone().unwrap_or_else(|| origin.into()),
    })
}

/// The contact point's own path along the force.
fn path_of(contact: &Contact, along_mm: impl Iterator<Item = f64>) -> MeasuredPoint {
    MeasuredPoint {
        place: contact.point,
        directions: vec![contact.direction],
        displacements_mm: along_mm.map(|d| vec![Some(d)]).collect(),
    }
}

/// `forces_n` and `displacements_mm`: it does not matter which of the two was driven and which was measured.
fn curve(
    document: &Document,
    forces: &Spanned<Vec<f64>>,
    displacements: &Spanned<Vec<f64>>,
    contact: &Contact,
    tolerance: &Option<Spanned<toml::Value>>,
) -> Result<Asked, Mistake> {
    let list = displacements.get_ref();
    let driven = list.first().is_some_and(|&d| d > 0.0) && list.windows(2).all(|w| w[0] < w[1]);
    check_forces(document, forces).map_err(|mut mistake| {
        let falls = forces.get_ref().windows(2).any(|w| w[0] >= w[1]);
        if driven && falls && list.len() == forces.get_ref().len() {
            mistake.message += "; displacements of a force that falls or stays have no single answer: keep the part of the curve on which the force rises";
        }
        mistake
    })?;
    let n = forces.get_ref().len();
    if list.len() != n {
        let found = list.len();
        let message = format!("found {found} displacements for {n} forces, expected one for each force");
        return Err(document.mistake(&displacements.span(), message));
    }
    if list.iter().any(|d| !d.is_finite()) {
        return Err(document.mistake(
            &displacements.span(),
            "found a displacement that is not a finite number",
        ));
    }
    if let Some(negative) = list.iter().find(|d| **d < 0.0) {
        let message = format!(
            "found a displacement of {negative} mm, expected none below zero: displacements are counted along the force"
        );
        return Err(document.mistake(&displacements.span(), message));
    }
    let allowed = allowances(document, tolerance, n, false)?;
    let tolerances = allowed.iter().zip(list).map(|(a, d)| a.of(*d)).collect();
    Ok(Asked {
        forces_n: forces.get_ref().clone(),
        points: vec![path_of(contact, list.iter().copied())],
        tolerances_mm: vec![tolerances],
    })
}

/// `stiffness` and `at`: k = F/u at each force. A tolerance t on k allows displacements from F/(k + t) to F/(k − t): the
/// target is the middle of these, and its tolerance half of their distance.
fn stiffnesses(
    document: &Document,
    text: &ExampleText,
    stiffness: &Spanned<toml::Value>,
    contact: &Contact,
) -> Result<Asked, Mistake> {
    let Some(at) = &text.at else {
        let message = "found stiffness without at, expected the force at which it holds beside it, such as at = \"10 N\"";
        return Err(document.mistake(&stiffness.span(), message));
    };
    let forces_n = positive(document, at, "10 N", units::force)?;
    if forces_n.windows(2).any(|w| w[0] >= w[1]) {
        let message = format!("found forces {forces_n:?}, expected rising numbers above zero [N]");
        return Err(document.mistake(&at.span(), message));
    }
    let list = positive(document, stiffness, "8 N/mm", units::stiffness)?;
    let n = forces_n.len();
    if list.len() != n {
        let message = format!(
            "found {} stiffnesses for {n} forces in at, expected one for each force",
            list.len()
        );
        return Err(document.mistake(&stiffness.span(), message));
    }
    let allowed = allowances(document, &text.tolerance, n, true)?;
    let (mut middles, mut tolerances) = (Vec::new(), Vec::new());
    for ((force, k), allowance) in forces_n.iter().zip(&list).zip(&allowed) {
        let t = allowance.of(*k);
        if t >= *k {
            let span = text.tolerance.as_ref().map_or(0..0, Spanned::span);
            let message =
                format!("found a tolerance of {t} N/mm on a stiffness of {k} N/mm, expected less than that");
            return Err(document.mistake(&span, message));
        }
        let (least, most) = (force / (k + t), force / (k - t));
        middles.push(0.5 * (least + most));
        tolerances.push(0.5 * (most - least));
    }
    Ok(Asked {
        points: vec![path_of(contact, middles.into_iter())],
        tolerances_mm: vec![tolerances],
        forces_n,
    })
}

/// One quantity or a list of them, each above zero.
fn positive(
    document: &Document,
    text: &Spanned<toml::Value>,
    example: &str,
    read: impl Fn(&str) -> Result<f64, units::UnitError> + Copy,
) -> Result<Vec<f64>, Mistake> {
    words(document, text, example)?
        .into_iter()
        .map(|word| {
            let value = quantity(document, &Spanned::new(text.span(), word.clone()), read)?;
            if value > 0.0 {
                return Ok(value);
            }
            let message = format!("found {word:?}, expected a number above zero, such as \"{example}\"");
            Err(document.mistake(&text.span(), message))
        })
        .collect()
}

/// The texts of a key that takes one or a list.
fn words(document: &Document, text: &Spanned<toml::Value>, example: &str) -> Result<Vec<String>, Mistake> {
    let wrong = || {
        let message = format!(
            "found {}, expected a text with its unit such as \"{example}\", or a list of such texts",
            text.get_ref()
        );
        document.mistake(&text.span(), message)
    };
    match text.get_ref() {
        toml::Value::String(word) => Ok(vec![word.clone()]),
        toml::Value::Array(list) if !list.is_empty() => list
            .iter()
            .map(|v| v.as_str().map(str::to_string).ok_or_else(wrong))
            .collect(),
        _ => Err(wrong()),
    }
}

/// How far a value may be off.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Allowance {
    /// By so much \[mm, or N/mm of a stiffness\].
    Absolute(f64),
    /// By this share of the value.
    Share(f64),
}

impl Allowance {
    fn of(self, value: f64) -> f64 {
        match self {
            Allowance::Absolute(a) => a,
            Allowance::Share(s) => s * value.abs(),
        }
    }
}

/// `tolerance`, `(forces)`: none if absent; of displacements or of stiffnesses.
fn allowances(
    document: &Document,
    text: &Option<Spanned<toml::Value>>,
    forces: usize,
    of_stiffness: bool,
) -> Result<Vec<Allowance>, Mistake> {
    let Some(text) = text else {
        return Ok(vec![Allowance::Absolute(0.0); forces]);
    };
    let example = if of_stiffness { "0.5 N/mm" } else { "0.5 mm" };
    let list: Vec<Allowance> = words(document, text, example)?
        .iter()
        .map(|word| {
            let read = |word: &str| match word.trim().strip_suffix('%') {
                Some(number) => match number.trim().parse::<f64>() {
                    Ok(percent) if percent.is_finite() => Ok(Allowance::Share(0.01 * percent)),
                    _ => Err(format!("found {word:?}, expected a share such as \"5 %\"")),
                },
                None if of_stiffness => units::stiffness(word)
                    .map(Allowance::Absolute)
                    .map_err(|e| e.to_string()),
                None => units::length(word)
                    .map(Allowance::Absolute)
                    .map_err(|e| e.to_string()),
            };
            let allowance = read(word).map_err(|message| document.mistake(&text.span(), message))?;
            if allowance.of(1.0) < 0.0 {
                let message = format!("found a tolerance of {word:?}, expected none below zero");
                return Err(document.mistake(&text.span(), message));
            }
            Ok(allowance)
        })
        .collect::<Result<_, Mistake>>()?;
    match list.len() {
        1 => Ok(vec![list[0]; forces]),
        n if n == forces => Ok(list),
        n => {
            let message =
                format!("found {n} tolerances for {forces} forces, expected one, or one for each force");
            Err(document.mistake(&text.span(), message))
        }
    }
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

/// A search presses along the contact's direction alone. A tolerance of the file's own column goes before the example's.
fn read_points(
    document: &Document,
    file: &Spanned<String>,
    contact: &Contact,
    tolerance: &Option<Spanned<toml::Value>>,
) -> Result<Asked, Mistake> {
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
    let allowed = allowances(document, tolerance, along.len(), false)?;
    let tolerances_mm = tolerances_of(&table, &allowed);
    Ok(Asked {
        forces_n: along,
        points: table.points,
        tolerances_mm,
    })
}

fn tolerances_of(table: &ExampleTable, allowed: &[Allowance]) -> Vec<Vec<f64>> {
    let lists = table.points.iter().zip(&table.tolerances_mm);
    lists
        .map(|(point, own)| {
            let levels = point.displacements_mm.iter().zip(own).zip(allowed);
            levels
                .map(|((displacement, own), allowance)| {
                    let known = displacement.iter().flatten();
                    let length = known.map(|x| x * x).sum::<f64>().sqrt();
                    own.unwrap_or(allowance.of(length))
                })
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "name = \"p\"\npoint_mm = [0, 0, 25]\ndirection = [0, 0, -1]\nradius = \"8 mm\"\n";

    fn read(keys: &str) -> Result<Example, Mistake> {
        let folder = tempfile::tempdir().unwrap();
        let csv = "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm,tol_mm\n4,0,0,25,0.3,0,-0.4,\n4,9,0,25,,0,-0.2,0.05\n8,0,0,25,0,0,-1,0\n";
        std::fs::write(folder.path().join("points.csv"), csv).unwrap();
        let document = Document {
            file: folder.path().join("goal.toml"),
            text: format!("{HEAD}{keys}"),
        };
        example(&document, &document.parse()?)
    }

    #[test]
    fn tolerances_are_lengths_shares_and_columns() {
        let curve = "forces_n = [4, 8]\ndisplacements_mm = [1, 3]\n";
        for (tolerance, expected) in [
            ("", [0.0, 0.0]),
            ("tolerance = \"0.2 mm\"", [0.2, 0.2]),
            ("tolerance = \"5 %\"", [0.05, 0.15]),
            ("tolerance = [\"10%\", \"100 um\"]", [0.1, 0.1]),
        ] {
            let example = read(&format!("{curve}{tolerance}")).unwrap();
            let found = &example.tolerances_mm[0];
            assert!(
                (found[0] - expected[0]).abs() < 1e-12 && (found[1] - expected[1]).abs() < 1e-12,
                "{found:?}"
            );
        }
        // Of the first point's 0.5 mm a tenth; the column goes first; the second point's second row is missing.
        let points = read("file = \"points.csv\"\ntolerance = \"10 %\"").unwrap();
        assert!((points.tolerances_mm[0][0] - 0.05).abs() < 1e-12);
        assert_eq!(
            (points.tolerances_mm[0][1], points.tolerances_mm[1][0]),
            (0.0, 0.05)
        );
        assert_eq!(points.tolerances_mm[1].len(), 2);
    }

    #[test]
    fn a_stiffness_is_force_over_displacement_with_its_band() {
        let one = read("stiffness = \"8 N/mm\"\nat = \"10 N\"").unwrap();
        assert_eq!(
            (one.forces_n.as_slice(), one.along(0, 0)),
            ([10.0].as_slice(), Some(1.25))
        );
        assert_eq!(one.tolerances_mm, [[0.0]]);
        let two =
            read("stiffness = [\"8 N/mm\", \"1 N/mm\"]\nat = [\"10 N\", \"0.02 kN\"]\ntolerance = [\"25 %\", \"0.2 N/mm\"]")
                .unwrap();
        // From 10/(8·1.25) = 1 to 10/(8·0.75) = 5/3 mm, and from 20/1.2 to 20/0.8 mm.
        for (level, least, most) in [(0, 1.0, 5.0 / 3.0), (1, 20.0 / 1.2, 25.0)] {
            let (middle, half) = (two.along(0, level).unwrap(), two.tolerances_mm[0][level]);
            assert!((middle - half - least).abs() < 1e-12 && (middle + half - most).abs() < 1e-12);
        }
    }

    #[test]
    fn mistakes_say_where_and_what() {
        let curve = "forces_n = [4, 8]\ndisplacements_mm = [1, 3]\n";
        for (keys, line, words) in [
            (format!("{curve}tolerance = \"0.2\""), 7, "without a unit"),
            (format!("{curve}tolerance = \"0.2 N/mm\""), 7, "N/mm"),
            (format!("{curve}tolerance = \"five %\""), 7, "5 %"),
            (format!("{curve}tolerance = \"-5 %\""), 7, "below zero"),
            (format!("{curve}tolerance = 0.2"), 7, "found 0.2"),
            (
                format!("{curve}tolerance = [\"1 mm\", 2]"),
                7,
                "list of such texts",
            ),
            (format!("{curve}tolerance = []"), 7, "found []"),
            (
                format!("{curve}tolerance = [\"1 mm\", \"1 mm\", \"1 mm\"]"),
                7,
                "3 tolerances for 2",
            ),
            (format!("{curve}at = \"3 N\""), 7, "without stiffness"),
            (
                "forces_n = [4, 8]\ndisplacements_mm = [-1, -3]".into(),
                6,
                "along the force",
            ),
            (
                "forces_n = [4, 3]\ndisplacements_mm = [1, 3]".into(),
                5,
                "the force rises",
            ),
            ("stiffness = \"8 N/mm\"".into(), 5, "without at"),
            ("stiffness = \"8 N\"\nat = \"3 N\"".into(), 5, "stiffness"),
            ("stiffness = \"0 N/mm\"\nat = \"3 N\"".into(), 5, "above zero"),
            ("stiffness = \"8 N/mm\"\nat = \"3 mm\"".into(), 6, "\"mm\""),
            (
                "stiffness = \"8 N/mm\"\nat = [\"3 N\", \"4 N\"]".into(),
                5,
                "1 stiffnesses for 2",
            ),
            (
                "stiffness = [\"8 N/mm\", \"8 N/mm\"]\nat = [\"3 N\", \"2 N\"]".into(),
                6,
                "rising",
            ),
            (
                "stiffness = \"8 N/mm\"\nat = \"3 N\"\ntolerance = \"100 %\"".into(),
                7,
                "less than",
            ),
            (
                "stiffness = \"8 N/mm\"\nat = \"3 N\"\nfile = \"points.csv\"".into(),
                1,
                "needs either",
            ),
        ] {
            let mistake = read(&keys).unwrap_err();
            assert!(mistake.message.contains(words), "{keys}: {mistake}");
            assert_eq!(mistake.line, line, "{keys}: {mistake}");
        }
    }
}
