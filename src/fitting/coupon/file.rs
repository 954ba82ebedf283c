//! The coupon file: which tests make a material, where their curves lie, and what is assumed.
//!
//! `docs/formats.md` holds a commented example. Reading checks every number; the curves themselves are read
//! by [`super::curve`].

use crate::material::check::{is_colour, is_id};
use crate::material::record::{
    Printability, RecordError, Source, Unknown, field_error, read_toml, unknown_fields,
};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The version of the coupon file that this program reads.
pub const SCHEMA: u32 = 1;

/// A material and the tests that make it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CouponFile {
    /// Version of the format.
    pub schema: u32,
    /// Id of the record to make.
    pub id: String,
    /// The name for people.
    pub name: String,
    /// Display colour, `#rrggbb`.
    pub colour: String,
    /// Density \[g/cm³\].
    pub density_g_per_cm3: f64,
    /// The law that the record holds. Default the strain-dependent one.
    #[serde(default)]
    pub model: LawChoice,
    /// Number of centres of the interpolation. Default 6.
    #[serde(default = "six")]
    pub centres: usize,
    /// What the record should name as assumed, beside what the fit itself assumes.
    #[serde(default)]
    pub assumptions: Vec<String>,
    /// How objects of it are made.
    pub printability: Printability,
    /// Where the measurement comes from.
    pub source: Source,
    /// How Poisson's ratio is found; needed with tests.
    #[serde(default)]
    pub poisson: Option<Poisson>,
    /// The tests.
    #[serde(default)]
    pub tests: Vec<Test>,
}

fn six() -> usize {
    6
}

/// A family of laws that coupons can be fitted with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LawChoice {
    /// Moduli that depend on strain by radial basis functions.
    #[default]
    #[serde(rename = "rbf")]
    Rbf,
    /// Neo-Hookean, distortion and volume apart.
    #[serde(rename = "neo-hookean")]
    NeoHookean,
    /// Mooney–Rivlin.
    #[serde(rename = "mooney-rivlin")]
    MooneyRivlin,
    /// Ogden, one term.
    #[serde(rename = "ogden-1")]
    Ogden1,
    /// Ogden, two terms.
    #[serde(rename = "ogden-2")]
    Ogden2,
    /// Ogden, three terms.
    #[serde(rename = "ogden-3")]
    Ogden3,
    /// Hyperfoam, one term.
    #[serde(rename = "hyperfoam-1")]
    Hyperfoam1,
    /// Hyperfoam, two terms.
    #[serde(rename = "hyperfoam-2")]
    Hyperfoam2,
    /// Hyperfoam, three terms.
    #[serde(rename = "hyperfoam-3")]
    Hyperfoam3,
}

impl LawChoice {
    /// All of them, from the default on.
    pub const ALL: [LawChoice; 9] = [
        LawChoice::Rbf,
        LawChoice::NeoHookean,
        LawChoice::MooneyRivlin,
        LawChoice::Ogden1,
        LawChoice::Ogden2,
        LawChoice::Ogden3,
        LawChoice::Hyperfoam1,
        LawChoice::Hyperfoam2,
        LawChoice::Hyperfoam3,
    ];

    /// The word of the file.
    pub fn word(self) -> &'static str {
        match self {
            LawChoice::Rbf => "rbf",
            LawChoice::NeoHookean => "neo-hookean",
            LawChoice::MooneyRivlin => "mooney-rivlin",
            LawChoice::Ogden1 => "ogden-1",
            LawChoice::Ogden2 => "ogden-2",
            LawChoice::Ogden3 => "ogden-3",
            LawChoice::Hyperfoam1 => "hyperfoam-1",
            LawChoice::Hyperfoam2 => "hyperfoam-2",
            LawChoice::Hyperfoam3 => "hyperfoam-3",
        }
    }
}

/// How Poisson's ratio (in Biot strain) is found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Poisson {
    /// `assumed = 0.12`: taken as known and the same at all strains, so that K follows μ.
    Assumed(f64),
    /// `at-rest = 0.49`: taken as known at rest, with a bulk modulus that does not depend on strain.
    AtRest(f64),
    /// `fitted = "constant"`: one number for all strains; `"by-strain"`: one per centre.
    Fitted(FittedPoisson),
}

/// What is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FittedPoisson {
    /// One ratio for all strains.
    Constant,
    /// One per centre.
    ByStrain,
}

/// The kind of a test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TestKind {
    /// A free cylinder or block between plates.
    UniaxialCompression,
    /// A pulled strip or dumbbell.
    UniaxialTension,
    /// A sheet pulled alike along two directions, or a balloon.
    EquibiaxialTension,
    /// A wide sheet pulled between clamps, its width kept: pure shear.
    PlanarTension,
    /// A cylinder pressed in a smooth rigid sleeve.
    ConfinedCompression,
    /// A block between plates that slide, heights kept.
    SimpleShear,
}

impl TestKind {
    /// The word of the file.
    pub fn word(self) -> &'static str {
        match self {
            TestKind::UniaxialCompression => "uniaxial-compression",
            TestKind::UniaxialTension => "uniaxial-tension",
            TestKind::EquibiaxialTension => "equibiaxial-tension",
            TestKind::PlanarTension => "planar-tension",
            TestKind::ConfinedCompression => "confined-compression",
            TestKind::SimpleShear => "simple-shear",
        }
    }

    /// −1 for compression, else 1: the sign that strain and stress must have.
    pub fn sign(self) -> f64 {
        match self {
            TestKind::UniaxialCompression | TestKind::ConfinedCompression => -1.0,
            _ => 1.0,
        }
    }

    /// Whether a direction is free of stress, so that its strain can be measured: the width, or a sheet's thickness.
    pub fn has_free_side(self) -> bool {
        !matches!(self, TestKind::ConfinedCompression | TestKind::SimpleShear)
    }

    /// Whether it is pulled or pressed along one axis with free sides.
    pub fn is_uniaxial(self) -> bool {
        matches!(self, TestKind::UniaxialCompression | TestKind::UniaxialTension)
    }
}

/// One test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Test {
    /// The kind.
    pub kind: TestKind,
    /// The specimen, in words.
    pub specimen: String,
    /// When it was tested.
    #[serde(default)]
    pub date: Option<String>,
    /// What it counts in the fit beside the others. Default 1.
    #[serde(default = "unit_weight")]
    pub weight: f64,
    /// Not fitted but predicted, its error reported apart.
    #[serde(default)]
    pub held_out: bool,
    /// The raw curve, relative to the data folder.
    pub file: String,
    /// Separator of columns: `,`, `;`, a tab, or a blank for any run of blanks and tabs. Default `,`.
    #[serde(default = "comma")]
    pub delimiter: String,
    /// The line, from 1, that holds the names of the columns; 0 for a file without, whose columns are called `1`, `2`
    /// and so on. Default 1.
    #[serde(default = "one")]
    pub names_line: usize,
    /// Lines between the names and the first numbers. Default 0.
    #[serde(default)]
    pub skip_lines: usize,
    /// What says how far it was deformed.
    pub deformation: Column,
    /// What says how hard it pushed back.
    pub load: Column,
    /// Height of the specimen \[mm\], where deformation is a length.
    #[serde(default)]
    pub height_mm: Option<f64>,
    /// Area of the specimen \[mm²\], where the load is a force.
    #[serde(default)]
    pub area_mm2: Option<f64>,
    /// Which part of the record counts.
    #[serde(default)]
    pub branch: Branch,
    /// Which loading branch, from 1. Default 1, the first.
    #[serde(default = "one")]
    pub cycle: usize,
    /// Least and largest strain to fit, as magnitudes.
    pub range: [f64; 2],
    /// Strains (magnitudes) between which a straight line is drawn and extended to zero stress, where strain then
    /// begins: takes slack out of the start of a curve.
    #[serde(default)]
    pub toe_compensation: Option<[f64; 2]>,
    /// Number of intervals of strain that the curve is averaged over. Default 50.
    #[serde(default = "fifty")]
    pub points: usize,
    /// The width of the specimen during the test (the thickness of a sheet).
    #[serde(default)]
    pub lateral: Option<Lateral>,
}

fn comma() -> String {
    ",".into()
}

fn one() -> usize {
    1
}

fn unit_weight() -> f64 {
    1.0
}

fn fifty() -> usize {
    50
}

/// A column and what its numbers mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Name of the column, as it stands in the file.
    pub column: String,
    /// Its unit: `1`, `%`, `um`, `mm`, `m`, `N`, `kN`, `Pa`, `kPa`, `MPa`.
    pub unit: String,
    /// What it measures; the default fits the test (engineering strain or shear) and the load (nominal stress or force).
    #[serde(default)]
    pub measure: Option<Measure>,
    /// Whether the file counts compression as positive (or shear the other way round).
    #[serde(default)]
    pub negate: bool,
}

/// What a deformation column measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// Change of length over length; shear in simple shear.
    Strain,
    /// Length over length at rest.
    Stretch,
    /// Change of length; needs `height_mm`.
    Displacement,
    /// The length itself, as between plates; needs `height_mm`.
    Height,
}

/// Which part of a recorded curve counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Branch {
    /// From rest to the turning point of the cycle.
    #[default]
    Loading,
    /// The mean of loading and unloading of the cycle.
    Average,
    /// All of it: a curve that was selected or averaged before.
    Whole,
}

/// The width of the specimen during the test, tracked against its height.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lateral {
    /// The file, relative to the data folder.
    pub file: String,
    /// Separator of columns. Default `,`.
    #[serde(default = "comma")]
    pub delimiter: String,
    /// Name of the column of widths, in the same unit as the heights.
    pub width: String,
    /// Name of the column of heights.
    pub height: String,
    /// Rows at the start whose mean is the size at rest. Default 5.
    #[serde(default = "five")]
    pub rest_rows: usize,
}

fn five() -> usize {
    5
}

impl CouponFile {
    /// Reads a coupon file; `file` is for messages. Also answers the fields that it did not know.
    ///
    /// # Errors
    /// No TOML, a missing field, a wrong type, a number out of its range, with file and line.
    pub fn parse(text: &str, file: &Path) -> Result<(Self, Vec<Unknown>), RecordError> {
        let coupon: CouponFile = read_toml(text, file)?;
        coupon.validate(text, file)?;
        let unknown = unknown_fields(text, &coupon);
        Ok((coupon, unknown))
    }

    fn validate(&self, text: &str, file: &Path) -> Result<(), RecordError> {
        let wrong = |field: &str, value: String, expected: &str| {
            Err(field_error(text, file, field, &value, expected))
        };
        if self.schema != SCHEMA {
            return wrong("schema", self.schema.to_string(), "1");
        }
        if !is_id(&self.id) {
            return wrong(
                "id",
                format!("{:?}", self.id),
                "lower-case letters, digits and hyphens",
            );
        }
        if !is_colour(&self.colour) {
            return wrong("colour", format!("{:?}", self.colour), "#rrggbb");
        }
        if !(2..=40).contains(&self.centres) {
            return wrong("centres", self.centres.to_string(), "2 to 40");
        }
        if self.source.citation.trim().is_empty() || self.source.licence.trim().is_empty() {
            return wrong("source", "empty".into(), "a citation and a licence");
        }
        if self.tests.is_empty() {
            return wrong("tests", "none".into(), "at least one [[tests]]");
        }
        match self.poisson {
            None => {
                let expected =
                    "at-rest = 0.49, assumed = 0.3, fitted = \"constant\" or fitted = \"by-strain\"";
                return wrong("poisson", "missing".into(), expected);
            }
            Some(Poisson::Assumed(v) | Poisson::AtRest(v)) if !(-0.9..=0.4999).contains(&v) => {
                let field = match self.poisson {
                    Some(Poisson::AtRest(_)) => "poisson.at-rest",
                    _ => "poisson.assumed",
                };
                return wrong(field, v.to_string(), "a number between −0.9 and 0.4999");
            }
            _ => {}
        }
        if self.tests.iter().all(|t| t.held_out) {
            return wrong("tests", "all held out".into(), "at least one test that is fitted");
        }
        for (i, test) in self.tests.iter().enumerate() {
            if let Err((field, value, expected)) = test.validate() {
                return wrong(&format!("tests[{i}].{field}"), value, &expected);
            }
        }
        Ok(())
    }

    /// The record's file in the folder of a database.
    pub fn record_path(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.toml", self.id))
    }
}

type Wrong = (&'static str, String, String);

impl Test {
    fn validate(&self) -> Result<(), Wrong> {
        let wrong = |field, value: String, expected: &str| Err((field, value, expected.to_string()));
        let [low, high] = self.range;
        let most = if self.kind.sign() < 0.0 { 0.95 } else { 20.0 };
        if !(low >= 0.0 && low < high && high <= most) {
            return wrong(
                "range",
                format!("{:?}", self.range),
                "two magnitudes of strain, rising (0.6 is 60 %)",
            );
        }
        if self.delimiter.len() != 1 {
            return wrong("delimiter", format!("{:?}", self.delimiter), "one character");
        }
        if self.cycle == 0 {
            return wrong("cycle", "0".into(), "cycles counted from 1");
        }
        if !(self.weight > 0.0 && self.weight <= 1e6) {
            return wrong("weight", self.weight.to_string(), "a number above 0, at most 10⁶");
        }
        if !(10..=500).contains(&self.points) {
            return wrong("points", self.points.to_string(), "10 to 500");
        }
        if let Some([a, b]) = self.toe_compensation
            && !(a >= 0.0 && a < b && b <= high)
        {
            return wrong(
                "toe_compensation",
                format!("[{a}, {b}]"),
                "two rising strains inside the range",
            );
        }
        if self.lateral.is_some() && !self.kind.has_free_side() {
            return wrong(
                "lateral",
                format!("in {}", self.kind.word()),
                "widths in tests with a free side alone (uniaxial, equibiaxial, planar)",
            );
        }
        self.validate_units()
    }

    /// Units fit what is measured, and the sizes that turn lengths and forces into strain and stress are there.
    fn validate_units(&self) -> Result<(), Wrong> {
        let wrong = |field, value: String, expected: &str| Err((field, value, expected.to_string()));
        for (field, size) in [("height_mm", self.height_mm), ("area_mm2", self.area_mm2)] {
            if let Some(value) = size
                && !(value > 0.0 && value < 1e6)
            {
                return wrong(field, value.to_string(), "a positive size in mm or mm²");
            }
        }
        let length = matches!(
            self.deformation.measure,
            Some(Measure::Displacement | Measure::Height)
        );
        if length && self.height_mm.is_none() {
            return wrong(
                "height_mm",
                "missing".into(),
                "the specimen's height, since deformation is a length",
            );
        }
        let units: &[&str] = if length { &["um", "mm", "m"] } else { &["1", "%"] };
        if !units.contains(&self.deformation.unit.as_str()) {
            let expected = format!("one of {units:?} for what it measures");
            return Err((
                "deformation.unit",
                format!("{:?}", self.deformation.unit),
                expected,
            ));
        }
        match self.load.unit.as_str() {
            "Pa" | "kPa" | "MPa" => {}
            "N" | "kN" if self.area_mm2.is_some() => {}
            "N" | "kN" => {
                return wrong(
                    "area_mm2",
                    "missing".into(),
                    "the specimen's area, since the load is a force",
                );
            }
            other => return wrong("load.unit", format!("{other:?}"), "N, kN, Pa, kPa or MPa"),
        }
        Ok(())
    }
}
