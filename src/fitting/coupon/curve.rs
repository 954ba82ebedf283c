//! From the file of a testing machine to a curve of strain and nominal stress.
//!
//! Steps, in this order: read the named columns; turn units and signs into engineering strain and MPa, compression
//! negative; pick the loading branch of a cycle; take out the slack at the start, if asked; average over equal
//! intervals of strain. Each refuses what it can't make sense of, with file, line and column.

use super::file::{Branch, Column, Lateral, Measure, Test, TestKind};

/// One test, ready to be fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Engineering strain, or shear; compression negative.
    pub strain: Vec<f64>,
    /// Nominal stress \[MPa\].
    pub stress: Vec<f64>,
    /// Pairs of axial and lateral engineering strain, where the width was tracked.
    pub lateral: Vec<(f64, f64)>,
    /// The strain that was taken off as slack.
    pub slack: f64,
}

/// What is wrong with a curve.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// A column is not there.
    #[error("{file}, line {line}: no column {column:?}; it has {found:?}")]
    Column {
        /// The file.
        file: String,
        /// Where the names stand.
        line: usize,
        /// The name looked for.
        column: String,
        /// The names found.
        found: Vec<String>,
    },
    /// A cell is no number.
    #[error("{file}, line {line}, column {column:?}: {value:?} is not a finite number")]
    Cell {
        /// The file.
        file: String,
        /// The line, from 1.
        line: usize,
        /// Name of the column.
        column: String,
        /// What stands there.
        value: String,
    },
    /// Too few rows, or too few in the range asked for.
    #[error("{file}: {found} points {what}: expected at least {expected}")]
    Few {
        /// The file.
        file: String,
        /// Points found.
        found: usize,
        /// Of which kind.
        what: String,
        /// Points needed.
        expected: usize,
    },
    /// Strain or stress has the wrong sign.
    #[error("{file}: the largest {what} is {value:.4}: expected {expected}; set `negate` for its column")]
    Sign {
        /// The file.
        file: String,
        /// Strain or stress.
        what: &'static str,
        /// What was found.
        value: f64,
        /// What was expected.
        expected: &'static str,
    },
    /// Strain goes back in a curve that should be one branch.
    #[error(
        "{file}, line {line}: strain goes back from {from:.4} to {to:.4}: expected one branch (branch = \"loading\" picks one)"
    )]
    Backwards {
        /// The file.
        file: String,
        /// The line, from 1.
        line: usize,
        /// Strain before.
        from: f64,
        /// Strain after.
        to: f64,
    },
    /// A number that no soft material shows.
    #[error("{file}: the largest {what} is {value:.3e}: expected at most {most:.0e}; is the unit right?")]
    Implausible {
        /// The file.
        file: String,
        /// Which number.
        what: &'static str,
        /// What was found.
        value: f64,
        /// What is plausible.
        most: f64,
    },
    /// The line through the start of the curve does not rise.
    #[error("{file}: stress does not rise between the strains {low} and {high} of `toe_compensation`")]
    Toe {
        /// The file.
        file: String,
        /// Lower strain.
        low: f64,
        /// Upper strain.
        high: f64,
    },
}

/// One sample of a test: line in the file, strain, stress \[MPa\].
#[derive(Clone, Copy, Debug)]
struct Sample {
    line: usize,
    strain: f64,
    stress: f64,
}

/// Makes the curve of `test` from the bytes of its file, and of the file of widths where there is one.
///
/// # Errors
/// See [`CurveError`].
pub fn read_curve(test: &Test, bytes: &[u8], widths: Option<&[u8]>) -> Result<Curve, CurveError> {
    let text = latin(bytes);
    let file = test.file.as_str();
    let delimiter = test.delimiter.chars().next().unwrap_or(',');
    let columns = [test.deformation.column.as_str(), test.load.column.as_str()];
    let rows = read_columns(&text, file, delimiter, test.names_line, test.skip_lines, columns)?;
    let samples: Vec<Sample> = rows
        .iter()
        .map(|&(line, [deformation, load])| Sample {
            line,
            strain: to_strain(&test.deformation, deformation, test.height_mm),
            stress: to_stress(&test.load, load, test.area_mm2),
        })
        .collect();
    let sign = test.kind.sign();
    check_plausible(test, &samples, sign)?;
    let mut branches = pick_branches(test, &samples)?;
    let mut slack = 0.0;
    if let Some([low, high]) = test.toe_compensation {
        slack = toe(&branches, sign, low, high).ok_or_else(|| CurveError::Toe {
            file: file.into(),
            low,
            high,
        })?;
        for sample in branches.iter_mut().flatten() {
            sample.strain -= slack * sign;
        }
    }
    let curves: Vec<Vec<Option<(f64, f64)>>> = branches.iter().map(|b| average(b, sign, test)).collect();
    let mut curve = Curve {
        strain: Vec::new(),
        stress: Vec::new(),
        lateral: Vec::new(),
        slack,
    };
    for bin in 0..test.points {
        // A bin counts where every branch has something to say.
        let here: Option<Vec<(f64, f64)>> = curves.iter().map(|c| c[bin]).collect();
        if let Some(here) = here.filter(|h| !h.is_empty()) {
            let n = here.len() as f64;
            curve.strain.push(here.iter().map(|p| p.0).sum::<f64>() / n);
            curve.stress.push(here.iter().map(|p| p.1).sum::<f64>() / n);
        }
    }
    if curve.strain.len() < 10 {
        let what = format!("between the strains {} and {}", test.range[0], test.range[1]);
        return Err(CurveError::Few {
            file: file.into(),
            found: curve.strain.len(),
            what,
            expected: 10,
        });
    }
    if let (Some(lateral), Some(widths)) = (&test.lateral, widths) {
        curve.lateral = read_lateral(lateral, widths, sign, test.range)?;
    }
    Ok(curve)
}

/// Bytes as text; machines write Latin-1 into headers, so every byte is a character.
fn latin(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.trim_start_matches('\u{feff}').to_string(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

/// The cells of a row, without quotes; between cells stands `delimiter`, a blank for any run of blanks and tabs.
fn cells_of(row: &str, delimiter: char) -> Vec<String> {
    let clean = |cell: &str| cell.trim().trim_matches('"').trim().to_string();
    if delimiter == ' ' {
        row.split_whitespace().map(clean).collect()
    } else {
        row.split(delimiter).map(clean).collect()
    }
}

/// The numbers of the named columns with their lines. Blank lines are passed over.
fn read_columns<const N: usize>(
    text: &str,
    file: &str,
    delimiter: char,
    names_line: usize,
    skip: usize,
    columns: [&str; N],
) -> Result<Vec<(usize, [f64; N])>, CurveError> {
    let names = match names_line.checked_sub(1) {
        Some(index) => cells_of(text.lines().nth(index).unwrap_or_default(), delimiter),
        None => {
            let first = text.lines().skip(skip).find(|l| !l.trim().is_empty());
            let count = cells_of(first.unwrap_or_default(), delimiter).len();
            (1..=count).map(|k| k.to_string()).collect()
        }
    };
    let mut index = [0; N];
    for (k, column) in columns.iter().enumerate() {
        index[k] = names
            .iter()
            .position(|n| n == column)
            .ok_or_else(|| CurveError::Column {
                file: file.into(),
                line: names_line.max(1),
                column: column.to_string(),
                found: names.clone(),
            })?;
    }
    let mut rows = Vec::new();
    for (i, row) in text.lines().enumerate().skip(names_line + skip) {
        if row.trim().is_empty() {
            continue;
        }
        let cells = cells_of(row, delimiter);
        let mut numbers = [0.0; N];
        for k in 0..N {
            let cell = cells.get(index[k]).map_or("", String::as_str);
            numbers[k] =
                cell.parse()
                    .ok()
                    .filter(|x: &f64| x.is_finite())
                    .ok_or_else(|| CurveError::Cell {
                        file: file.into(),
                        line: i + 1,
                        column: columns[k].to_string(),
                        value: cell.to_string(),
                    })?;
        }
        rows.push((i + 1, numbers));
    }
    if rows.len() < 10 {
        let what = "in the file".to_string();
        return Err(CurveError::Few {
            file: file.into(),
            found: rows.len(),
            what,
            expected: 10,
        });
    }
    Ok(rows)
}

fn to_strain(column: &Column, value: f64, height_mm: Option<f64>) -> f64 {
    let scaled = match column.unit.as_str() {
        "%" => value / 100.0,
        "um" => value / 1000.0,
        "m" => value * 1000.0,
        _ => value,
    };
    let height = height_mm.unwrap_or(1.0);
    let sign = if column.negate { -1.0 } else { 1.0 };
    match column.measure.unwrap_or(Measure::Strain) {
        Measure::Strain => sign * scaled,
        Measure::Stretch => sign * (scaled - 1.0),
        Measure::Displacement => sign * scaled / height,
        Measure::Height => sign * (scaled / height - 1.0),
    }
}

fn to_stress(column: &Column, value: f64, area_mm2: Option<f64>) -> f64 {
    let area = area_mm2.unwrap_or(1.0);
    let mpa = match column.unit.as_str() {
        "Pa" => value / 1e6,
        "kPa" => value / 1e3,
        "N" => value / area,
        "kN" => value * 1e3 / area,
        _ => value,
    };
    if column.negate { -mpa } else { mpa }
}

/// The extremes must have a plausible size, strain the test's sign (shear has none), and stress must go with strain.
fn check_plausible(test: &Test, samples: &[Sample], sign: f64) -> Result<(), CurveError> {
    let file = &test.file;
    let extreme = |f: &dyn Fn(&Sample) -> f64| {
        samples
            .iter()
            .map(f)
            .fold(0.0_f64, |worst, x| if x.abs() > worst.abs() { x } else { worst })
    };
    let (strain, stress) = (extreme(&|s| s.strain), extreme(&|s| s.stress));
    for (what, value, most) in [("strain", strain, 30.0), ("stress", stress, 100.0)] {
        if value.abs() > most {
            return Err(CurveError::Implausible {
                file: file.clone(),
                what,
                value,
                most,
            });
        }
    }
    if test.kind != TestKind::SimpleShear && strain * sign <= 0.0 {
        let expected = if sign < 0.0 {
            "negative in compression"
        } else {
            "positive in tension"
        };
        return Err(CurveError::Sign {
            file: file.clone(),
            what: "strain",
            value: strain,
            expected,
        });
    }
    if samples.iter().map(|s| s.strain * s.stress).sum::<f64>() <= 0.0 {
        let expected = "of the sign of strain";
        return Err(CurveError::Sign {
            file: file.clone(),
            what: "stress",
            value: stress,
            expected,
        });
    }
    Ok(())
}

/// One list of samples for the loading branch, two for loading and unloading.
fn pick_branches(test: &Test, samples: &[Sample]) -> Result<Vec<Vec<Sample>>, CurveError> {
    let sign = test.kind.sign();
    let magnitude: Vec<f64> = samples.iter().map(|s| s.strain * sign).collect();
    let amplitude = magnitude.iter().copied().fold(0.0, f64::max);
    if test.branch == Branch::Whole {
        return Ok(vec![samples.to_vec()]);
    }
    let turns = turning_points(&magnitude, 0.3 * amplitude);
    // Turns alternate low, high, low, …; a loading branch runs from a low to the next high.
    let low = 2 * (test.cycle - 1);
    if low + 1 >= turns.len() {
        let what = format!("of loading branch {}", test.cycle);
        return Err(CurveError::Few {
            file: test.file.clone(),
            found: 0,
            what,
            expected: 10,
        });
    }
    let loading = samples[turns[low]..=turns[low + 1]].to_vec();
    let mut branches = vec![loading];
    if test.branch == Branch::Average {
        let end = turns.get(low + 2).copied().unwrap_or(samples.len() - 1);
        branches.push(samples[turns[low + 1]..=end].to_vec());
    }
    check_one_way(&test.file, &branches[0], sign, amplitude)?;
    Ok(branches)
}

/// Indices of the lows and highs of `x`, beginning with a low; a turn counts once `x` has come back by `threshold`.
fn turning_points(x: &[f64], threshold: f64) -> Vec<usize> {
    let mut turns = Vec::new();
    let (mut rising, mut extreme) = (false, 0);
    for i in 0..x.len() {
        let further = if rising {
            x[i] > x[extreme]
        } else {
            x[i] <= x[extreme]
        };
        if further {
            extreme = i;
        } else if (x[i] - x[extreme]).abs() > threshold {
            turns.push(extreme);
            rising = !rising;
            extreme = i;
        }
    }
    turns.push(extreme);
    turns
}

fn check_one_way(file: &str, branch: &[Sample], sign: f64, amplitude: f64) -> Result<(), CurveError> {
    let mut furthest = f64::NEG_INFINITY;
    for sample in branch {
        let here = sample.strain * sign;
        // Machines jitter; 5 % of the test is more than jitter.
        if here < furthest - 0.05 * amplitude {
            let (from, to) = (furthest * sign, sample.strain);
            return Err(CurveError::Backwards {
                file: file.into(),
                line: sample.line,
                from,
                to,
            });
        }
        furthest = furthest.max(here);
    }
    Ok(())
}

/// Where the straight line through the points between two strains meets zero stress.
fn toe(branches: &[Vec<Sample>], sign: f64, low: f64, high: f64) -> Option<f64> {
    let points: Vec<(f64, f64)> = branches
        .first()?
        .iter()
        .map(|s| (s.strain * sign, s.stress * sign))
        .filter(|p| p.0 >= low && p.0 <= high)
        .collect();
    let n = points.len() as f64;
    let (mx, my) = (
        points.iter().map(|p| p.0).sum::<f64>() / n,
        points.iter().map(|p| p.1).sum::<f64>() / n,
    );
    let sxx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let sxy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    let slope = sxy / sxx;
    // Fewer than two points make this NaN, which the filter refuses too.
    Some(mx - my / slope).filter(|slack| slope > 0.0 && slack.is_finite() && slack.abs() < high)
}

/// Means of strain and stress over equal intervals of strain, `(points)`; `None` where an interval is empty.
fn average(branch: &[Sample], sign: f64, test: &Test) -> Vec<Option<(f64, f64)>> {
    let [low, high] = test.range;
    let mut sums = vec![(0.0, 0.0, 0usize); test.points];
    for sample in branch {
        let magnitude = sample.strain * sign;
        if magnitude <= 0.0 || magnitude < low || magnitude > high {
            continue;
        }
        let bin = (((magnitude - low) / (high - low)) * test.points as f64) as usize;
        let sum = &mut sums[bin.min(test.points - 1)];
        *sum = (sum.0 + sample.strain, sum.1 + sample.stress, sum.2 + 1);
    }
    sums.into_iter()
        .map(|(a, b, n)| (n > 0).then(|| (a / n as f64, b / n as f64)))
        .collect()
}

/// Axial and lateral strain from tracked widths and heights, averaged over 30 intervals of the range.
fn read_lateral(
    lateral: &Lateral,
    bytes: &[u8],
    sign: f64,
    range: [f64; 2],
) -> Result<Vec<(f64, f64)>, CurveError> {
    const INTERVALS: usize = 30;
    let text = latin(bytes);
    let delimiter = lateral.delimiter.chars().next().unwrap_or(',');
    let rows = read_columns(
        &text,
        &lateral.file,
        delimiter,
        1,
        0,
        [&lateral.width, &lateral.height],
    )?;
    let rest = &rows[..lateral.rest_rows.clamp(1, rows.len())];
    let mean = |k: usize| rest.iter().map(|r| r.1[k]).sum::<f64>() / rest.len() as f64;
    let (width, height) = (mean(0), mean(1));
    let mut sums = vec![(0.0, 0.0, 0usize); INTERVALS];
    for (_, [w, h]) in &rows {
        let axial = h / height - 1.0;
        let magnitude = axial * sign;
        if magnitude > 0.0 && magnitude >= range[0] && magnitude <= range[1] {
            let bin = ((magnitude - range[0]) / (range[1] - range[0]) * INTERVALS as f64) as usize;
            let sum = &mut sums[bin.min(INTERVALS - 1)];
            *sum = (sum.0 + axial, sum.1 + w / width - 1.0, sum.2 + 1);
        }
    }
    let pairs: Vec<_> = sums
        .iter()
        .filter(|s| s.2 > 0)
        .map(|s| (s.0 / s.2 as f64, s.1 / s.2 as f64))
        .collect();
    if pairs.len() < 5 {
        let what = "of width in the range".to_string();
        return Err(CurveError::Few {
            file: lateral.file.clone(),
            found: pairs.len(),
            what,
            expected: 5,
        });
    }
    Ok(pairs)
}

#[cfg(test)]
#[path = "curve_tests.rs"]
mod tests;
