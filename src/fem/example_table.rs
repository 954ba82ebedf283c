//! Displacements of many points of the surface under rising forces, as a CSV file.
//!
//! One row for each point and force: `force_n` along the contact's direction, or the whole vector `fx_n,fy_n,fz_n`; the point
//! in the undeformed object, `x_mm,y_mm,z_mm`; its displacement, `dx_mm,dy_mm,dz_mm`, empty where a marker was lost; where
//! known its standard deviation, `sd_mm`, which each of the three components has; for a goal, how far the displacement may be
//! off, `tol_mm`.

use super::example::MeasuredPoint;
use crate::math::Vec3;
use crate::units::document::{Document, Mistake};
use serde::Deserialize;
use toml::Spanned;

const PLACE_AND_MOVE: [&str; 6] = ["x_mm", "y_mm", "z_mm", "dx_mm", "dy_mm", "dz_mm"];
const FORCE_VECTOR: [&str; 3] = ["fx_n", "fy_n", "fz_n"];
const EXPECTED: &str =
    "force_n (or fx_n,fy_n,fz_n),x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm and where known sd_mm, tol_mm";

/// What such a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct ExampleTable {
    /// Force at each level, its part along the direction rising \[N\].
    pub forces: Vec<Vec3>,
    /// The points with their displacements at each level.
    pub points: Vec<MeasuredPoint>,
    /// Standard deviation of each component of a displacement, `(points × levels)` \[mm\]; `None` where the file has none.
    pub deviations_mm: Vec<Vec<Option<f64>>>,
    /// How far a displacement may be off, `(points × levels)` \[mm\]; `None` where the file says nothing.
    pub tolerances_mm: Vec<Vec<Option<f64>>>,
}

#[derive(Deserialize)]
struct Row {
    force_n: Option<f64>,
    fx_n: Option<f64>,
    fy_n: Option<f64>,
    fz_n: Option<f64>,
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
    dx_mm: Option<f64>,
    dy_mm: Option<f64>,
    dz_mm: Option<f64>,
    sd_mm: Option<f64>,
    tol_mm: Option<f64>,
}

impl Row {
    fn force(&self, direction: &Vec3) -> Option<Vec3> {
        match (self.force_n, self.fx_n, self.fy_n, self.fz_n) {
            (Some(along), None, None, None) => Some(direction * along),
            (None, Some(x), Some(y), Some(z)) => Some(Vec3::new(x, y, z)),
            _ => None,
        }
    }

    fn is_finite(&self) -> bool {
        let optional = [
            self.force_n,
            self.fx_n,
            self.fy_n,
            self.fz_n,
            self.dx_mm,
            self.dy_mm,
            self.dz_mm,
            self.sd_mm,
            self.tol_mm,
        ];
        let places = [self.x_mm, self.y_mm, self.z_mm];
        places
            .iter()
            .chain(optional.iter().flatten())
            .all(|x| x.is_finite())
    }
}

/// Reads the file that `document` names; `direction` is the contact's, a unit vector.
///
/// # Errors
/// [`Mistake`] with the file and the line: a column that is missing, a number that is not finite, forces that do not rise, a point
/// that stands twice, no row at all.
pub fn read_table(
    document: &Document,
    file: &Spanned<String>,
    direction: &Vec3,
) -> Result<ExampleTable, Mistake> {
    let path = document.resolve(file.get_ref());
    let bad = |line: u64, message: String| {
        let place = if line > 0 {
            format!(", line {line}")
        } else {
            String::new()
        };
        document.mistake(&file.span(), format!("{}{place}: {message}", path.display()))
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(&path)
        .map_err(|e| bad(0, e.to_string()))?;
    let headers = reader.headers().map_err(|e| bad(1, e.to_string()))?;
    check_columns(headers).map_err(|message| bad(1, message))?;
    let mut table = ExampleTable {
        forces: Vec::new(),
        points: Vec::new(),
        deviations_mm: Vec::new(),
        tolerances_mm: Vec::new(),
    };
    let headers = headers.clone();
    let mut record = csv::StringRecord::new();
    loop {
        let more = reader.read_record(&mut record);
        let line = record.position().map_or(1, csv::Position::line);
        if !more.map_err(|e| bad(line, e.to_string()))? {
            break;
        }
        let row: Row = record
            .deserialize(Some(&headers))
            .map_err(|e| bad(line, unreadable(&e, &headers, &record)))?;
        table.add(&row, direction).map_err(|message| bad(line, message))?;
    }
    if table.points.is_empty() {
        return Err(bad(1, format!("found no rows, expected {EXPECTED}")));
    }
    let levels = table.forces.len();
    for point in &mut table.points {
        point.displacements_mm.resize(levels, vec![None; 3]);
    }
    for list in table.deviations_mm.iter_mut().chain(&mut table.tolerances_mm) {
        list.resize(levels, None);
    }
    Ok(table)
}

/// A cell that is no number, by the name of its column.
fn unreadable(error: &csv::Error, headers: &csv::StringRecord, record: &csv::StringRecord) -> String {
    if let csv::ErrorKind::Deserialize { err, .. } = error.kind()
        && let Some(field) = err.field().map(|f| f as usize)
        && let (Some(name), Some(value)) = (headers.get(field), record.get(field))
    {
        return format!("found {name} = {value:?}, expected a number");
    }
    error.to_string()
}

/// An absent column would read as markers that were all lost.
fn check_columns(headers: &csv::StringRecord) -> Result<(), String> {
    let has = |name: &&str| headers.iter().any(|h| h == *name);
    if let Some(absent) = PLACE_AND_MOVE.iter().find(|c| !has(c)) {
        return Err(format!("found no column {absent}, expected {EXPECTED}"));
    }
    let whole = FORCE_VECTOR.iter().filter(|c| has(c)).count();
    match (has(&"force_n"), whole) {
        (true, 0) | (false, 3) => Ok(()),
        (true, _) => Err(format!(
            "found force_n beside a force vector, expected {EXPECTED}"
        )),
        (false, _) => Err(format!("found no column force_n, expected {EXPECTED}")),
    }
}

impl ExampleTable {
    fn add(&mut self, row: &Row, direction: &Vec3) -> Result<(), String> {
        if !row.is_finite() {
            return Err("found a number that is not finite".into());
        }
        if let Some(sd) = row.sd_mm.filter(|sd| *sd <= 0.0) {
            return Err(format!(
                "found sd_mm = {sd}, expected a length above zero, or nothing"
            ));
        }
        if let Some(tolerance) = row.tol_mm.filter(|t| *t < 0.0) {
            return Err(format!(
                "found tol_mm = {tolerance}, expected a length that is not negative, or nothing"
            ));
        }
        let force = row.force(direction).ok_or("found no force in this row")?;
        if self.forces.last() != Some(&force) {
            let before = self.forces.last().map_or(0.0, |f| f.dot(direction));
            let along = force.dot(direction);
            if along <= before {
                return Err(format!(
                    "found a force of {along} N, expected rising forces above zero (measured along the direction of the press)"
                ));
            }
            self.forces.push(force);
        }
        let level = self.forces.len() - 1;
        let place = Vec3::new(row.x_mm, row.y_mm, row.z_mm);
        let index = match self.points.iter().position(|p| p.place == place) {
            Some(index) => index,
            None => {
                self.points.push(MeasuredPoint {
                    place,
                    directions: vec![Vec3::x(), Vec3::y(), Vec3::z()],
                    displacements_mm: Vec::new(),
                });
                self.deviations_mm.push(Vec::new());
                self.tolerances_mm.push(Vec::new());
                self.points.len() - 1
            }
        };
        let series = &mut self.points[index].displacements_mm;
        if series.len() > level {
            return Err(format!(
                "the point {:?} stands twice at {} N",
                [place.x, place.y, place.z],
                force.dot(direction)
            ));
        }
        series.resize(level, vec![None; 3]);
        series.push(vec![row.dx_mm, row.dy_mm, row.dz_mm]);
        self.deviations_mm[index].resize(level, None);
        self.deviations_mm[index].push(row.sd_mm);
        self.tolerances_mm[index].resize(level, None);
        self.tolerances_mm[index].push(row.tol_mm);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<ExampleTable, Mistake> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("points.csv"), text).unwrap();
        #[derive(Deserialize)]
        struct Holder {
            file: Spanned<String>,
        }
        let document = Document {
            file: folder.path().join("set.toml"),
            text: "file = \"points.csv\"\n".into(),
        };
        let holder: Holder = document.parse().unwrap();
        read_table(&document, &holder.file, &-Vec3::z())
    }

    #[test]
    fn lost_markers_and_deviations_are_kept_apart_by_level() {
        let table = read(
            "fx_n,fy_n,fz_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm,sd_mm\n\
             0.1,0,-2,0,0,25,0,0,-1,0.05\n0.1,0,-2,5,0,25,0,0,-0.5,\n0.2,0,-4,5,0,25,,0,-0.9,0.1\n",
        )
        .unwrap();
        assert_eq!(
            table.forces,
            [Vec3::new(0.1, 0.0, -2.0), Vec3::new(0.2, 0.0, -4.0)]
        );
        assert_eq!(table.points[0].displacements_mm[1], [None; 3]);
        assert_eq!(table.points[1].displacements_mm[1], [None, Some(0.0), Some(-0.9)]);
        assert_eq!(
            table.deviations_mm,
            [vec![Some(0.05), None], vec![None, Some(0.1)]]
        );
    }

    #[test]
    fn wrong_tables_name_the_line() {
        let head = "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n";
        for (rows, line, what) in [
            ("2,0,0,0,0,0,0\n2,0,0,0,0,0,0\n", 3, "stands twice"),
            ("2,0,0,0,0,0,0\n1,0,0,0,0,0,0\n", 3, "rising"),
            ("2,0,0,nan,0,0,0\n", 2, "not finite"),
            ("2,0,0,zero,0,0,0\n", 2, "z_mm = \"zero\""),
            ("", 1, "no rows"),
        ] {
            let error = read(&format!("{head}{rows}")).unwrap_err().to_string();
            assert!(
                error.contains(&format!("line {line}")) && error.contains(what),
                "{error}"
            );
        }
        let error = read("force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm\n")
            .unwrap_err()
            .to_string();
        assert!(error.contains("dz_mm"), "{error}");
    }
}
