//! From a coupon file and its curves to a material record.

use super::curve::{Curve, CurveError, read_curve};
use super::file::{CouponFile, LawChoice, Poisson, TestKind};
use super::fit::{CouponError, CouponFit, CouponTest, TestError, fit, test_error};
use super::uncertainty::{Knowledge, knowledge};
use crate::material::law::Law;
use crate::material::record::{
    CheckPair, Kind, MaterialRecord, Measurement, Model, SCHEMA, Uncertainty, rounded,
};

/// A record and what was fitted on the way.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The record.
    pub record: MaterialRecord,
    /// The curves that were fitted, one per test.
    pub tests: Vec<CouponTest>,
    /// The curves that were predicted, and how well.
    pub held_out: Vec<HeldOut>,
    /// The fit.
    pub fit: Option<CouponFit>,
    /// How well the tests determine its numbers.
    pub knowledge: Option<Knowledge>,
}

/// A test that took no part in the fit.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// The specimen, in words.
    pub specimen: String,
    /// The raw curve's file.
    pub file: String,
    /// The curve.
    pub test: CouponTest,
    /// The fitted law's error in it.
    pub error: TestError,
}

/// Why a coupon file makes no record.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// A file named in the coupon can't be read.
    #[error("{file}: {message} (paths are relative to the folder that --data names)")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        message: String,
    },
    /// A curve makes no sense.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// No law fits.
    #[error(transparent)]
    Coupon(#[from] CouponError),
}

/// Fits what `coupon` describes; `read` gives the bytes of a file by its path in the coupon.
///
/// # Errors
/// A file that can't be read, a curve that makes no sense, no law that fits.
pub fn fit_coupon(
    coupon: &CouponFile,
    read: &dyn Fn(&str) -> std::io::Result<Vec<u8>>,
) -> Result<Fitted, FitError> {
    let open = |file: &str| {
        read(file).map_err(|e| FitError::Read {
            file: file.to_string(),
            message: e.to_string(),
        })
    };
    let mut tests = Vec::new();
    let mut predicted = Vec::new();
    for test in &coupon.tests {
        let bytes = open(&test.file)?;
        let widths = test.lateral.as_ref().map(|l| open(&l.file)).transpose()?;
        let read = CouponTest {
            kind: test.kind,
            weight: test.weight,
            curve: read_curve(test, &bytes, widths.as_deref())?,
        };
        if test.held_out {
            predicted.push((test, read));
        } else {
            tests.push(read);
        }
    }
    let poisson = coupon.poisson.ok_or(CouponError::Tests(
        "the coupon does not say how Poisson's ratio is found",
    ))?;
    let fit = fit(&tests, poisson, coupon.model, coupon.centres)?;
    let mut record = skeleton(coupon, Kind::Isotropic, &fit.law, fit.engineering_strain)?;
    record.measurements = measurements(coupon, &tests, &fit.errors);
    record
        .assumptions
        .extend(assumptions(coupon, poisson, &tests, &fit.law));
    let knowledge = knowledge(&fit, &tests);
    record.uncertainty = Uncertainty::of(&fit.law, &knowledge.covariance, "residuals".into());
    let held_out = predicted.into_iter().map(|(source, test)| HeldOut {
        specimen: source.specimen.clone(),
        file: source.file.clone(),
        error: test_error(&fit.law, &test),
        test,
    });
    Ok(Fitted {
        held_out: held_out.collect(),
        knowledge: Some(knowledge),
        record,
        tests,
        fit: Some(fit),
    })
}

fn measurements(coupon: &CouponFile, tests: &[CouponTest], errors: &[TestError]) -> Vec<Measurement> {
    let fitted = coupon.tests.iter().filter(|t| !t.held_out);
    let mut list = Vec::new();
    for ((test, fitted), error) in fitted.zip(tests).zip(errors) {
        let (low, high) = span(&fitted.curve);
        list.push(Measurement {
            test: test.kind.word().into(),
            specimen: test.specimen.clone(),
            date: test.date.clone(),
            file: test.file.clone(),
            strain: [rounded(low, 4), rounded(high, 4)],
            points: fitted.curve.strain.len(),
            relative_rms: rounded(error.relative_rms, 5),
            lateral_relative_rms: error.lateral_relative_rms.map(|e| rounded(e, 5)),
            rms_mm: None,
            largest_mm: None,
        });
    }
    list
}

fn span(curve: &Curve) -> (f64, f64) {
    curve
        .strain
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &e| {
            (l.min(e), h.max(e))
        })
}

/// Everything of the record but what was measured.
fn skeleton(
    coupon: &CouponFile,
    kind: Kind,
    law: &Law,
    engineering_strain: [f64; 2],
) -> Result<MaterialRecord, CouponError> {
    Ok(MaterialRecord {
        schema: SCHEMA,
        version: 1,
        id: coupon.id.clone(),
        previous_sha256: None,
        recipe: Some(format!("coupons/{}.toml", coupon.id)),
        name: coupon.name.clone(),
        kind,
        synthetic: false,
        colour: coupon.colour.clone(),
        density_g_per_cm3: coupon.density_g_per_cm3,
        assumptions: coupon.assumptions.clone(),
        printability: coupon.printability.clone(),
        source: coupon.source.clone(),
        model: Model::of(law, engineering_strain.map(|e| rounded(e, 4)))?,
        uncertainty: None,
        measurements: Vec::new(),
        checks: CheckPair::over(law, engineering_strain),
    })
}

/// What the fit itself had to assume, in words.
fn assumptions(coupon: &CouponFile, poisson: Poisson, tests: &[CouponTest], law: &Law) -> Vec<String> {
    let mut list = vec![about_poisson(coupon.model, poisson, tests, law)];
    if let (LawChoice::Rbf, Poisson::AtRest(ratio)) = (coupon.model, poisson)
        && ratio > 0.45
    {
        list.push(
            "the law does not keep volume at large strain: in Biot strain that holds at small strain only"
                .into(),
        );
    }
    for (test, fitted) in coupon.tests.iter().filter(|t| !t.held_out).zip(tests) {
        if fitted.curve.slack != 0.0 {
            let percent = 100.0 * fitted.curve.slack;
            list.push(format!(
                "{}: {percent:.2} % strain taken off as slack at the start",
                test.file
            ));
        }
    }
    let pressed = tests.iter().any(|t| t.kind.sign() < 0.0);
    let pulled = tests.iter().any(|t| {
        matches!(
            t.kind,
            TestKind::UniaxialTension | TestKind::EquibiaxialTension | TestKind::PlanarTension
        )
    });
    // A sheet that is pulled from all sides is a coupon that is pressed: it tells both.
    let both = tests.iter().any(|t| t.kind == TestKind::EquibiaxialTension);
    if pressed != pulled && !both {
        let (other, measured) = if pressed {
            ("tension", "compression")
        } else {
            ("compression", "tension")
        };
        list.push(format!(
            "measured in {measured} alone: what it does in {other} is extrapolated"
        ));
    }
    list
}

fn about_poisson(model: LawChoice, poisson: Poisson, tests: &[CouponTest], law: &Law) -> String {
    match (poisson, model) {
        (Poisson::Assumed(ratio), LawChoice::Rbf) => {
            format!("Poisson's ratio in Biot strain assumed to be {ratio} at all strains; not measured")
        }
        (Poisson::AtRest(ratio), LawChoice::Rbf) => format!(
            "Poisson's ratio in Biot strain assumed to be {ratio} at rest, and the bulk modulus the same at all strains; \
             not measured"
        ),
        (Poisson::Assumed(ratio) | Poisson::AtRest(ratio), _) => {
            format!("Poisson's ratio assumed to be {ratio} at rest; not measured")
        }
        (Poisson::Fitted(_), _) => {
            let sideways = tests.iter().any(|t| !t.curve.lateral.is_empty());
            let from = if sideways {
                "the tracked width"
            } else {
                "all tests together; no width was measured"
            };
            let ratio = law.poisson_ratio_at_rest();
            format!("Poisson's ratio fitted to {from}: {ratio:.3} at rest")
        }
    }
}
