//! Several laws fitted to the same coupon tests, and which of them to trust where.
//!
//! ```text
//! AICc = n ln S + 2k + 2k(k + 1)/(n − k − 1),      S = Σ_t w_t e_t² / Σ_t w_t
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | n | stresses and widths compared, over all tests |
//! | e_t | relative RMS error of a test's stresses, or of its widths; w_t its weight |
//! | k | fitted numbers, plus one for the size of the noise |
//!
//! S is what the fits minimise (but for ties), so the first term is the logarithm of the likelihood of normal noise whose
//! size in each test goes with the test's stress. The last term is Hurvich and Tsai's for few points; it vanishes for many.
//! Neighbouring residuals of a machine's curve are not independent, so n counts more than the data knows, and small
//! differences of AICc mean little: below about 10 the simpler law is as good. Sources: Akaike 1974; Hurvich & Tsai 1989;
//! Burnham & Anderson 2002.
//!
//! Beyond the range nothing is known, but some laws can be ruled out: one whose nominal stress falls, whose tangent
//! ∂T/∂ε has a negative eigenvalue (of its symmetric part) on the path of a test before 1.5 times the range, or that
//! was given nearly constant volume and does not keep it.

use super::file::{LawChoice, Poisson, TestKind};
use super::fit::{CouponError, CouponFit, CouponTest, fit, points};
use super::state::response;
use crate::material::law::Law;
use rayon::prelude::*;

/// How far beyond the range laws are followed.
pub const BEYOND: f64 = 1.5;
/// No coupon is pressed further than this.
const MOST_COMPRESSION: f64 = 0.95;
/// Above this Poisson's ratio a material counts as nearly incompressible.
const NEARLY_INCOMPRESSIBLE: f64 = 0.45;
/// Change of volume that such a material may show in its tests.
const VOLUME: f64 = 0.1;
/// Error up to which a hyperelastic law describes the data well enough to be followed beyond it.
const GOOD: f64 = 0.05;
/// Steps along a test's path.
const STEPS: usize = 120;

/// Where a law stops being sound on the path of one test; strains of the test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path {
    /// The test.
    pub kind: TestKind,
    /// Strain at the end of the measured range, and at the end of the path.
    pub ends: [f64; 2],
    /// Where nominal stress stops rising.
    pub falls_at: Option<f64>,
    /// Where the tangent is first not positive definite.
    pub indefinite_at: Option<f64>,
    /// det(I + ε) at the end of the measured range; not positive where the law turned the coupon inside out.
    pub volume_ratio: f64,
    /// Stress at the end of the path \[MPa\].
    pub stress_beyond: f64,
}

/// One law of a comparison.
#[derive(Clone, Debug)]
pub struct Row {
    /// The fit.
    pub fit: CouponFit,
    /// k above, without the one for the noise.
    pub parameters: usize,
    /// AICc above.
    pub aicc: f64,
    /// One per test.
    pub paths: Vec<Path>,
    /// Why it should not be followed beyond the range; empty if nothing speaks against it.
    pub faults: Vec<String>,
}

/// Laws of the same tests.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The laws, the least AICc first.
    pub rows: Vec<Row>,
    /// Laws that could not be fitted, and why.
    pub failed: Vec<(LawChoice, String)>,
    /// n above.
    pub points: usize,
    /// Which row to trust beyond the range.
    pub outside: Option<usize>,
    /// The verdict in words, inside and outside.
    pub verdict: [String; 2],
}

/// The laws that a comparison tries: foams' energies only where the material may change its volume.
pub fn candidates(poisson: Poisson) -> Vec<LawChoice> {
    let foam = |c: &LawChoice| {
        matches!(
            c,
            LawChoice::Hyperfoam1 | LawChoice::Hyperfoam2 | LawChoice::Hyperfoam3
        )
    };
    let all = LawChoice::ALL.into_iter();
    all.filter(|c| !foam(c) || !keeps_volume(poisson)).collect()
}

fn keeps_volume(poisson: Poisson) -> bool {
    match poisson {
        Poisson::Assumed(ratio) | Poisson::AtRest(ratio) => ratio > NEARLY_INCOMPRESSIBLE,
        Poisson::Fitted(_) => false,
    }
}

/// Fits all `choices` to `tests` and compares them.
///
/// # Errors
/// If no law at all can be fitted; the first reason.
pub fn compare(
    tests: &[CouponTest],
    poisson: Poisson,
    choices: &[LawChoice],
    centres: usize,
) -> Result<Comparison, CouponError> {
    let fits: Vec<(LawChoice, Result<CouponFit, CouponError>)> = choices
        .par_iter()
        .map(|&choice| (choice, fit(tests, poisson, choice, centres)))
        .collect();
    let points = points(tests);
    let (mut rows, mut failed, mut first_error) = (Vec::new(), Vec::new(), None);
    for (choice, fitted) in fits {
        match fitted {
            Ok(fit) => rows.push(row(fit, tests, points, keeps_volume(poisson))),
            Err(error) => {
                failed.push((choice, error.to_string()));
                first_error.get_or_insert(error);
            }
        }
    }
    if rows.is_empty() {
        return Err(first_error.unwrap_or(CouponError::Tests("there is no law to compare")));
    }
    rows.sort_by(|a, b| a.aicc.total_cmp(&b.aicc));
    let outside = most_trusted(&rows);
    Ok(Comparison {
        verdict: [inside_words(&rows), outside_words(&rows, outside)],
        rows,
        failed,
        points,
        outside,
    })
}

/// AICc of a mean squared relative error `s`, `n` points and `fitted` numbers; infinite where there are too few points.
pub fn aicc(s: f64, n: usize, fitted: usize) -> f64 {
    let (n, k) = (n as f64, fitted as f64 + 1.0);
    if n <= k + 1.0 {
        return f64::INFINITY;
    }
    // Rounding is no information: below 10⁻¹² relative error all fits are the same.
    n * s.max(1e-24).ln() + 2.0 * k + 2.0 * k * (k + 1.0) / (n - k - 1.0)
}

fn row(fit: CouponFit, tests: &[CouponTest], points: usize, keeps_volume: bool) -> Row {
    let paths: Vec<Path> = tests.iter().map(|t| follow(&fit.law, t)).collect();
    let parameters = fit.theta.len();
    let mut faults = Vec::new();
    for path in &paths {
        let test = path.kind.word();
        if let Some(at) = path.falls_at {
            faults.push(format!("stress falls at {:.0} % ({test})", 100.0 * at));
        }
        if let Some(at) = path.indefinite_at {
            faults.push(format!("tangent not definite at {:.0} % ({test})", 100.0 * at));
        }
        if keeps_volume && (path.volume_ratio - 1.0).abs() > VOLUME {
            let at = 100.0 * path.ends[0];
            faults.push(if path.volume_ratio > 0.0 {
                format!(
                    "volume ratio {:.2} at {at:.0} % ({test}), where volume should stay",
                    path.volume_ratio
                )
            } else {
                format!("turned inside out at {at:.0} % ({test})")
            });
        }
    }
    Row {
        aicc: aicc(fit.relative_rms.powi(2), points, parameters),
        fit,
        parameters,
        paths,
        faults,
    }
}

/// The largest strain of a test, with its sign.
fn end_of(test: &CouponTest) -> f64 {
    let strains = test.curve.strain.iter();
    strains.fold(0.0, |end: f64, &e| if e.abs() > end.abs() { e } else { end })
}

/// Strain to which a test's path is followed.
pub fn beyond(test: &CouponTest) -> f64 {
    let end = end_of(test);
    let further = BEYOND * end;
    if end < 0.0 {
        further.max(-MOST_COMPRESSION).min(end)
    } else {
        further
    }
}

fn follow(law: &Law, test: &CouponTest) -> Path {
    let ends = [end_of(test), beyond(test)];
    let mut path = Path {
        kind: test.kind,
        ends,
        falls_at: None,
        indefinite_at: None,
        volume_ratio: volume_ratio(&response(law, test.kind, ends[0]).strain),
        stress_beyond: response(law, test.kind, ends[1]).stress,
    };
    let mut before = 0.0;
    for i in 1..=STEPS {
        let given = ends[1] * i as f64 / STEPS as f64;
        let state = response(law, test.kind, given);
        let size = state.stress * ends[1].signum();
        // Written so that NaN counts as falling.
        let rises = size > before;
        if !rises && path.falls_at.is_none() {
            path.falls_at = Some(given);
        }
        before = size;
        if path.indefinite_at.is_none() {
            let (_, tangent) = law.stress_and_tangent(&state.strain);
            let least = (0.5 * (tangent + tangent.transpose()))
                .symmetric_eigenvalues()
                .min();
            if least.is_nan() || least <= 0.0 {
                path.indefinite_at = Some(given);
            }
        }
    }
    path
}

fn volume_ratio(strain: &crate::math::mandel::Mandel) -> f64 {
    (crate::math::mandel::to_tensor(strain) + crate::math::Mat3::identity()).determinant()
}

/// Among the hyperelastic laws without faults that describe the data, the one with the fewest numbers whose AICc is
/// within 10 of the best of them; without any, the strain-dependent law if it has no faults and describes the data.
fn most_trusted(rows: &[Row]) -> Option<usize> {
    let good = |r: &Row| r.faults.is_empty() && r.fit.relative_rms <= GOOD;
    let (guess, energies): (Vec<usize>, Vec<usize>) = (0..rows.len())
        .filter(|&i| good(&rows[i]))
        .partition(|&i| rows[i].fit.choice == LawChoice::Rbf);
    let Some(&best) = energies.first() else {
        return guess.first().copied();
    };
    energies
        .into_iter()
        .filter(|&i| rows[i].aicc - rows[best].aicc <= 10.0)
        .min_by_key(|&i| rows[i].parameters)
}

fn inside_words(rows: &[Row]) -> String {
    let best = &rows[0];
    let mut words = format!(
        "inside the range {}: the least AICc, error {:.2} %",
        best.fit.choice.word(),
        100.0 * best.fit.relative_rms
    );
    if let Some(second) = rows.get(1) {
        words.push_str(&format!(
            "; {} follows at +{:.0}",
            second.fit.choice.word(),
            second.aicc - best.aicc
        ));
    }
    words
}

fn outside_words(rows: &[Row], outside: Option<usize>) -> String {
    let Some(chosen) = outside.and_then(|i| rows.get(i)) else {
        return format!(
            "outside the range trust none of them: each falls, loses its definite tangent or does not keep its volume before \
             {BEYOND} times the range, or misses the tests by more than {:.0} %; measure further",
            100.0 * GOOD
        );
    };
    let word = chosen.fit.choice.word();
    let mut words = if chosen.fit.choice == LawChoice::Rbf {
        format!(
            "outside the range no hyperelastic law without faults comes within {:.0} %; {word} holds the stiffness of the \
             border there, which is a guess",
            100.0 * GOOD
        )
    } else {
        format!(
            "outside the range trust {word}: its stress rises and its tangent is definite to {BEYOND} times the range in \
             every test, error {:.2} % inside",
            100.0 * chosen.fit.relative_rms
        )
    };
    if let Some((spread, path)) = spread(rows, chosen) {
        words.push_str(&format!(
            "; laws with an error below {:.0} % differ by up to {:.0} % of its stress at {:.0} % strain ({})",
            100.0 * GOOD,
            100.0 * spread,
            100.0 * path.ends[1],
            path.kind.word()
        ));
    }
    words
}

/// How far the laws that describe the data are from the chosen one at the end of a path, the worst of all tests.
fn spread<'a>(rows: &[Row], chosen: &'a Row) -> Option<(f64, &'a Path)> {
    let others: Vec<&Row> = rows
        .iter()
        .filter(|r| r.fit.relative_rms <= GOOD && r.fit.choice != chosen.fit.choice)
        .collect();
    let at = |(i, path): (usize, &'a Path)| {
        let differences = others.iter().filter_map(|r| r.paths.get(i));
        let gap = differences.map(|p| (p.stress_beyond / path.stress_beyond - 1.0).abs());
        (gap.fold(0.0, f64::max), path)
    };
    let worst = chosen.paths.iter().enumerate().map(at);
    worst
        .filter(|(gap, _)| *gap > 0.0)
        .max_by(|a, b| a.0.total_cmp(&b.0))
}

#[cfg(test)]
#[path = "compare_tests.rs"]
mod tests;
