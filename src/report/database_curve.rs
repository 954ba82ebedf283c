//! The uniaxial curve of a material of the database: over the range that it was fitted in, and beyond.
//!
//! ```text
//! s(a)² = gᵀ C g,   g = ∂P/∂p at fixed a
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | a, P | engineering strain; nominal stress of the uniaxial test | –, MPa |
//! | p, C | fitted parameters of the law, and their covariance in the record | theirs |
//! | s | standard deviation of P that the covariance of the parameters makes, to first order | MPa |

use super::colour::Colour;
use super::plot::{LinePlot, Series, Style};
use crate::material::homogeneous::{uniaxial, uniaxial_by_parameters};
use crate::material::law::Law;
use crate::material::record::MaterialRecord;

/// Nominal stress \[MPa\] over engineering strain \[%\].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MaterialCurve {
    /// Where the law was fitted, `(n × 2)`.
    pub fitted: Vec<[f64; 2]>,
    /// Two standard deviations below and above the stress of each fitted point \[MPa\], `(n × 2)`; empty where the record
    /// has no covariance.
    pub band: Vec<[f64; 2]>,
    /// Beyond the fitted range in compression, up to where that begins.
    pub below: Vec<[f64; 2]>,
    /// Beyond it in tension, from where that ends.
    pub above: Vec<[f64; 2]>,
}

const FITTED_STEPS: usize = 60;
const BEYOND_STEPS: usize = 24;

impl MaterialCurve {
    /// The curve of a record and its law: half as far again as the fitted range, and to 30 % at least in both directions.
    pub fn of(record: &MaterialRecord, law: &Law) -> Self {
        let [low, high] = record.model.range.engineering_strain;
        let least = (1.5 * low).clamp(-0.95, -0.3);
        let most = (1.5 * high).max(0.3);
        let between = |from: f64, to: f64, steps: usize| -> Vec<f64> {
            match from < to {
                true => (0..=steps)
                    .map(|i| from + (to - from) * i as f64 / steps as f64)
                    .collect(),
                false => Vec::new(),
            }
        };
        let curve = |strains: Vec<f64>| -> Vec<[f64; 2]> {
            let point = |a: f64| [100.0 * a, uniaxial(law, a).stress];
            strains.into_iter().map(point).collect()
        };
        let strains = between(low, high, FITTED_STEPS);
        let deviations: Option<Vec<f64>> = strains.iter().map(|a| deviation(record, law, *a)).collect();
        let fitted = curve(strains);
        let band = deviations.map_or(Vec::new(), |deviations| {
            let about = |(point, s): (&[f64; 2], f64)| [point[1] - 2.0 * s, point[1] + 2.0 * s];
            fitted.iter().zip(deviations).map(about).collect()
        });
        MaterialCurve {
            band,
            fitted,
            below: curve(between(least, low, BEYOND_STEPS)),
            above: curve(between(high, most, BEYOND_STEPS)),
        }
    }

    fn series(&self, name: &str, colour: Colour) -> Series {
        Series::new(name, self.fitted.clone(), Style::Solid, colour).with_band(self.band.clone())
    }

    fn beyond(&self, name: &str, colour: Colour) -> Series {
        // A point that is not a number interrupts the line between the two sides.
        let mut points = self.below.clone();
        points.push([f64::NAN; 2]);
        points.extend(&self.above);
        Series::new(name, points, Style::Dotted, colour)
    }
}

/// Standard deviation of the nominal stress at engineering strain `axial` \[MPa\]; none without a covariance.
pub fn deviation(record: &MaterialRecord, law: &Law, axial: f64) -> Option<f64> {
    let uncertainty = record.uncertainty.as_ref()?;
    let names: Vec<String> = law.parameters().into_iter().map(|p| p.name).collect();
    let slopes = uniaxial_by_parameters(law, &uniaxial(law, axial));
    let of = |name: &String| {
        let at = names.iter().position(|n| n == name)?;
        slopes.get(at).copied()
    };
    let g: Vec<f64> = uncertainty.parameters.iter().map(of).collect::<Option<_>>()?;
    let rows = uncertainty.covariance.iter().zip(&g);
    let variance: f64 = rows
        .map(|(row, gi)| gi * row.iter().zip(&g).map(|(c, gj)| c * gj).sum::<f64>())
        .sum();
    // Rounding may leave a little below zero where nothing is uncertain.
    Some(variance.max(0.0).sqrt())
}

const STRAIN: &str = "engineering strain [%]";
const STRESS: &str = "nominal stress [MPa]";

/// The plot of one material.
pub fn material_plot(record: &MaterialRecord, law: &Law) -> LinePlot {
    let curve = MaterialCurve::of(record, law);
    let colour = Colour::from_hex(&record.colour).unwrap_or(Colour::qualitative(2));
    let title = format!(
        "{} (version {}), pressed and pulled along z",
        record.id, record.version
    );
    let fitted = match (record.synthetic, curve.band.is_empty()) {
        (true, _) => "estimated range",
        (false, true) => "fitted range",
        (false, false) => "fitted range, ± 2 standard deviations",
    };
    LinePlot::new(title, STRAIN, STRESS)
        .with(curve.series(fitted, colour))
        .with(curve.beyond("extrapolated", colour))
        .focused(1.6)
}

/// The plot of several materials over the strains that any of them was fitted in.
pub fn comparison_plot(materials: &[(&MaterialRecord, &Law)]) -> LinePlot {
    let mut plot = LinePlot::new("Pressed and pulled along z", STRAIN, STRESS);
    let (mut low, mut high) = (0.0_f64, 0.0_f64);
    for (index, (record, law)) in materials.iter().enumerate() {
        let curve = MaterialCurve::of(record, law);
        let colour = Colour::qualitative(index + 1);
        plot = plot
            .with(curve.series(&name_of(materials, record), colour))
            .with(curve.beyond("", colour));
        let range = record.model.range.engineering_strain;
        (low, high) = (low.min(100.0 * range[0]), high.max(100.0 * range[1]));
    }
    plot.x_limits = Some([low, high]);
    plot.focused(1.0)
}

/// The id; with its version where another version is compared with it.
pub fn name_of(materials: &[(&MaterialRecord, &Law)], record: &MaterialRecord) -> String {
    let same = materials
        .iter()
        .filter(|(other, _)| other.id == record.id)
        .count();
    match same > 1 {
        true => format!("{}@{}", record.id, record.version),
        false => record.id.clone(),
    }
}
