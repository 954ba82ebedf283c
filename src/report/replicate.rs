//! The page of a search: its curves, pictures and tables, made from the goal, the rig and what was found.

use super::colour::Colour;
use super::layouts::{CellChoice, LayoutRow};
use super::page::{Fact, Figure, MaterialRow, ReplicatePage};
use super::picture::{ColouredPart, CutOpen, Marker, PictureError, SurfaceMap};
use super::plot::{LinePlot, Series};
use super::raster::Camera;
use super::ticks::{fixed, significant};
use crate::design::goal::Goal;
use crate::design::misfit::{Misfit, Target};
use crate::design::robust::{BAND, deviation};
use crate::design::search::{Outcome, Ranked, Stop};
use crate::fabrication::layout::{Cut, tile_layout};
use crate::fabrication::tiling::{TilingError, TilingOptions};
use crate::fem::equilibrium::Options;
use crate::fem::example::Example;
use crate::fem::rig::{Bench, PressOutcome, Rig};
use crate::math::Vec3;
use crate::math::mandel::Mandel;
use crate::numerics::cholesky::CholeskyError;
use nalgebra::DMatrix;

/// What a search came to, with what the report needs to show it.
#[derive(Clone, Copy, Debug)]
pub struct Replica<'a> {
    /// The goal.
    pub goal: &'a Goal,
    /// Its object on the bench.
    pub rig: &'a Rig,
    /// The target displacements.
    pub target: &'a Target,
    /// What the search found.
    pub outcome: &'a Outcome,
    /// Volume of each material of the best layout by palette index \[mm³\].
    pub volumes_mm3: &'a [(usize, f64)],
    /// What becomes of the best layout's response with what is uncertain of the materials, [`crate::design::robust::Judge::modes`];
    /// empty where that was not asked.
    pub modes: &'a [DMatrix<f64>],
    /// A word to each of the best layouts; may be fewer.
    pub notes: &'a [String],
}

/// Why a report cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The search found no layout that stands all loads.
    #[error(
        "no layout is in equilibrium under all loads: lower the forces, or add stiffer materials to the palette"
    )]
    NothingFound,
    /// A picture.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The cut through the object.
    #[error(transparent)]
    Tiling(#[from] TilingError),
    /// Memory.
    #[error(transparent)]
    Cholesky(#[from] CholeskyError),
}

impl Replica<'_> {
    /// The rows of the layouts' table: the best ones, and the best single material to compare with.
    pub fn rows(&self) -> Vec<LayoutRow> {
        let mut rows: Vec<LayoutRow> = self
            .outcome
            .best
            .iter()
            .enumerate()
            .map(|(k, r)| self.row(r, Some(k + 1), self.notes.get(k).map_or("", String::as_str)))
            .collect();
        if let Some(uniform) = &self.outcome.best_uniform {
            rows.push(self.row(uniform, None, "best single material"));
        }
        rows
    }

    fn row(&self, ranked: &Ranked, rank: Option<usize>, note: &str) -> LayoutRow {
        let Misfit { rms_mm, max_mm } = ranked.misfit;
        let largest = self.target.largest_mm();
        let choice = |cell: String, m: u8| {
            let record = &self.goal.palette[m as usize].record;
            CellChoice {
                cell,
                material: record.name.clone(),
                colour: colour(&record.colour),
            }
        };
        let cells: Vec<CellChoice> = if self.goal.setup.cells.has_voxels() {
            shares(&ranked.layout, self.goal.palette.len())
                .map(|(m, percent)| choice(format!("{percent:.1} % of the cells"), m))
                .collect()
        } else {
            let named = ranked.layout.iter().enumerate();
            named
                .map(|(cell, &m)| choice(self.goal.setup.cells.name(cell), m))
                .collect()
        };
        let is_best = rank == Some(1);
        LayoutRow {
            rank,
            note: note.into(),
            cells,
            rms_mm,
            rms_percent: 100.0 * rms_mm / largest,
            max_mm,
            max_percent: 100.0 * max_mm / largest,
            mass_g: is_best.then(|| self.mass_g()),
        }
    }

    fn mass_g(&self) -> f64 {
        self.volumes_mm3
            .iter()
            .map(|(m, v)| 1e-3 * v * self.goal.palette[*m].record.density_g_per_cm3)
            .sum()
    }

    /// The whole page. `facts` are further lines about the search, such as its time.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn page(&self, facts: Vec<Fact>, provenance: Vec<Fact>) -> Result<ReplicatePage, ReportError> {
        let best = self.outcome.best.first().ok_or(ReportError::NothingFound)?;
        let options = Options::default();
        let mut bench = self.rig.bench()?;
        let presses: Vec<PressOutcome> = (0..self.goal.setup.examples.len())
            .map(|k| bench.press(&best.layout, k, &options))
            .collect();
        Ok(ReplicatePage {
            title: self.goal.name.clone(),
            subtitle: "a layout of base materials that gives like the original".into(),
            summary: self.summary(best),
            warnings: self.warnings(&presses),
            object: self.object_facts(),
            layouts: self.rows(),
            pictures: vec![self.cut_open(best)?, self.error_map(&presses)?],
            plots: self.plots(&mut bench, &presses),
            sections: Vec::new(),
            search: facts,
            materials: self.materials(best),
            provenance,
        })
    }

    /// The outcome in a sentence.
    pub fn summary(&self, best: &Ranked) -> String {
        let largest = self.target.largest_mm();
        let share = |mm: f64| fixed(100.0 * mm / largest, 1);
        let mut text = format!(
            "The best layout is {} mm ({} %) off the target displacements in the root mean square and {} mm ({} %) at most; the largest target displacement is {} mm.",
            significant(best.misfit.rms_mm, 3),
            share(best.misfit.rms_mm),
            significant(best.misfit.max_mm, 3),
            share(best.misfit.max_mm),
            significant(largest, 3),
        );
        if self.target.is_tolerant() {
            text += " Only what is beyond the goal's tolerances counts.";
        }
        if let Some(uniform) = &self.outcome.best_uniform {
            let name = &self.goal.palette[uniform.layout[0] as usize].record.name;
            text += &format!(
                " The best single material, {name}, is {} mm off.",
                significant(uniform.misfit.rms_mm, 3)
            );
        }
        text
    }

    /// What the reader must know: a search cut short, synthetic materials, strain outside the fitted ranges.
    pub fn warnings(&self, presses: &[PressOutcome]) -> Vec<String> {
        let mut warnings = self.goal.setup.object.warnings.clone();
        if self.outcome.stop == Stop::Interrupted {
            warnings.push("The search was stopped before its end: this is the best layout so far.".into());
        }
        if self.outcome.failed > 0 {
            warnings.push(format!(
                "{} of {} simulated layouts have no equilibrium under all loads and were left out.",
                self.outcome.failed, self.outcome.simulations
            ));
        }
        for (press, example) in presses.iter().zip(&self.goal.setup.examples) {
            let percent = 100.0 * press.share_outside_range;
            if percent >= 0.5 {
                warnings.push(format!(
                    "Example {:?}: at its largest force {percent:.1} % of the integration points are strained beyond the range that their material was fitted in; the law is held at the border of the range there.",
                    example.name
                ));
            }
        }
        if let Some(best) = self.outcome.best.first() {
            let mut synthetic: Vec<&str> = best
                .layout
                .iter()
                .map(|&m| &self.goal.palette[m as usize].record)
                .filter(|r| r.synthetic)
                .map(|r| r.name.as_str())
                .collect();
            synthetic.sort_unstable();
            synthetic.dedup();
            if !synthetic.is_empty() {
                warnings.push(format!("Estimated, not measured: {}.", synthetic.join(", ")));
            }
        }
        warnings
    }

    fn object_facts(&self) -> Vec<Fact> {
        let solid = &self.goal.setup.object.solid;
        let (low, high) = solid.bounds();
        let size = high - low;
        let mut facts = vec![
            Fact::new(
                "size",
                format!("{:.1} × {:.1} × {:.1} mm", size.x, size.y, size.z),
            ),
            Fact::new("volume", format!("{:.1} cm³", 1e-3 * solid.volume())),
            Fact::new("mass of the best layout", format!("{:.0} g", self.mass_g())),
            Fact::new("cells", self.goal.setup.cells.count()),
            Fact::new("elements", self.rig.model.mesh.elements.len()),
            Fact::new("unknowns", self.rig.model.unknowns()),
        ];
        for example in &self.goal.setup.examples {
            let (first, last) = (example.forces_n[0], example.forces_n[example.forces_n.len() - 1]);
            facts.push(Fact::new(
                format!("example {}", example.name),
                format!(
                    "{} forces from {first} to {last} N on a disc of {} mm radius, {} measured points; {}",
                    example.forces_n.len(),
                    example.contact.radius_mm,
                    example.points.len(),
                    example.origin
                ),
            ));
        }
        facts
    }

    fn materials(&self, best: &Ranked) -> Vec<MaterialRow> {
        let row = |(m, base): (usize, &crate::design::goal::BaseMaterial)| MaterialRow {
            id: base.record.id.clone(),
            name: base.record.name.clone(),
            colour: colour(&base.record.colour),
            used: best.layout.contains(&(m as u8)),
            kind: format!(
                "{}{}",
                base.record.kind.word(),
                if base.record.synthetic { ", synthetic" } else { "" }
            ),
            young_modulus: Some(base.law.young_modulus(&Mandel::zeros())),
            poisson_ratio: Some(base.law.poisson_ratio_at_rest()),
            density: Some(base.record.density_g_per_cm3),
            source: base.record.source.citation.clone(),
        };
        self.goal.palette.iter().enumerate().map(row).collect()
    }

    /// One plot an example: displacement of its most telling point along the force.
    fn plots(&self, bench: &mut Bench, presses: &[PressOutcome]) -> Vec<Figure> {
        let options = Options {
            tolerance: 1e-5,
            ..Options::default()
        };
        let uniform: Vec<Vec<f64>> = (0..self.goal.palette.len())
            .map(|m| {
                let layout = vec![m as u8; self.goal.setup.cells.count()];
                bench.respond(&layout, &options, &|| false).displacements
            })
            .collect();
        let mut figures = Vec::new();
        let mut start = 0;
        for (example, press) in self.goal.setup.examples.iter().zip(presses) {
            let curve = Curve::new(example, start);
            start = curve.end;
            let Some(point) = curve.point else { continue };
            let measured = |f: usize| example.along(point, f);
            let target: Vec<[f64; 2]> = (0..example.forces_n.len())
                .filter_map(|f| Some([example.forces_n[f], measured(f)?]))
                .collect();
            let allowed = tolerance_band(example, point);
            let predicted = press.levels.iter().enumerate().map(|(f, u)| {
                let sensor = self.rig.presses[curve.index(self.goal)].read(point, u);
                [example.forces_n[f], sensor.dot(&example.contact.direction)]
            });
            let band = self.band(&curve, point, press);
            let base = uniform.iter().enumerate().map(|(m, x)| {
                let record = &self.goal.palette[m].record;
                let points = example
                    .forces_n
                    .iter()
                    .enumerate()
                    .map(|(f, n)| [*n, curve.along(point, f, x)]);
                Series::base_material(&record.name, from_rest(points), colour(&record.colour))
            });
            let place = example.points[point].place;
            let plot = LinePlot::force_displacement(
                format!("{}: displacement along the force", example.name),
                Series::target("target", target).with_band(allowed),
                Series::prediction("best layout", from_rest(predicted)).with_band(band),
                base.collect(),
            );
            let mut caption = format!(
                "At the point ({:.0}, {:.0}, {:.0}) mm; dotted: the object made of one base material alone. Target: {}.",
                place.x, place.y, place.z, example.origin
            );
            if !self.modes.is_empty() {
                caption +=
                    " Shaded: where 90 of 100 objects lie, as far as the fits of their materials can tell.";
            }
            figures.push(Figure::new(&example.name, plot.svg(), caption));
        }
        figures
    }

    /// Lower and upper end of the prediction from rest on; none where nothing is uncertain.
    fn band(&self, curve: &Curve, point: usize, press: &PressOutcome) -> Vec<[f64; 2]> {
        if self.modes.is_empty() {
            return Vec::new();
        }
        let at = |(force, u): (usize, &Vec<Vec3>)| {
            let moved = self.rig.presses[curve.index(self.goal)].read(point, u);
            let x = moved.dot(&curve.example.contact.direction);
            let half = BAND * deviation(self.modes, &curve.weights(point, force));
            [x - half, x + half]
        };
        let levels = press.levels.iter().enumerate().map(at);
        std::iter::once([0.0, 0.0]).chain(levels).collect()
    }

    fn cut_open(&self, best: &Ranked) -> Result<Figure, ReportError> {
        let solid = &self.goal.setup.object.solid;
        let (low, high) = solid.bounds();
        let size = high - low;
        // Across the narrower of the two horizontal sides, through the middle of the first contact.
        let across = if size.x < size.y { Vec3::x() } else { -Vec3::y() };
        let through = self
            .goal
            .setup
            .examples
            .first()
            .map_or(0.5 * (low + high), |e| e.contact.point);
        let cut = Cut {
            point: through,
            normal: across,
        };
        // Between two neighbouring nodes lies one border at most.
        let cells = &self.goal.setup.cells;
        let voxels = cells.regions().iter().filter(|r| r.is_voxels());
        let narrowest = voxels
            .map(|r| cells.narrowest(r, solid))
            .fold(f64::INFINITY, f64::min);
        let spacing = TilingOptions {
            spacing_mm: Some((size.product() / 2.0e5).cbrt().min(narrowest)),
            ..TilingOptions::default()
        };
        let tiling = tile_layout(self.goal, &best.layout, Some(cut), &spacing)?;
        let parts = tiling
            .parts
            .iter()
            .map(|part| {
                let record = &self.goal.palette[part.label].record;
                ColouredPart {
                    name: record.name.clone(),
                    colour: colour(&record.colour),
                    mesh: &part.mesh,
                }
            })
            .collect();
        let camera = Camera::looking(
            -across * 0.85 - Vec3::z() * 0.35 - across.cross(&Vec3::z()) * 0.25,
            Vec3::z(),
        );
        let picture = CutOpen::new(format!("{} cut open", self.goal.name), parts).picture(&camera)?;
        Ok(Figure::new(
            "cut",
            picture.svg(),
            "The best layout, cut open through the first contact.",
        ))
    }

    fn error_map(&self, presses: &[PressOutcome]) -> Result<Figure, ReportError> {
        let mesh = self.goal.setup.object.solid.mesh();
        let mut errors: Vec<(Vec3, f64)> = Vec::new();
        for (k, (example, press)) in self.goal.setup.examples.iter().zip(presses).enumerate() {
            let Some(u) = press.levels.last() else { continue };
            let force = press.levels.len() - 1;
            for (p, point) in example.points.iter().enumerate() {
                let moved = self.rig.presses[k].read(p, u);
                let differences = point.directions.iter().zip(&point.displacements_mm[force]);
                let known: Vec<f64> = differences
                    .filter_map(|(d, x)| Some(moved.dot(d) - (*x)?))
                    .collect();
                if !known.is_empty() {
                    errors.push((point.place, known.iter().map(|d| d * d).sum::<f64>().sqrt()));
                }
            }
        }
        let (low, high) = self.goal.setup.object.solid.bounds();
        let values = interpolated(&mesh.vertices, &errors, 0.15 * (high - low).norm());
        let markers = self
            .goal
            .setup
            .examples
            .iter()
            .zip(&self.rig.presses)
            .map(|(e, p)| Marker::load(p.contact_point, e.contact.direction, &e.name))
            .collect();
        let title = format!("displacement error of the {}", self.goal.name.to_lowercase());
        let largest = errors.iter().map(|(_, e)| *e).fold(0.0, f64::max);
        let picture = SurfaceMap::new(title, mesh, &values, "displacement error", "mm")
            .ranged([0.0, if largest > 0.0 { largest } else { 1.0 }])
            .marked(markers)
            .picture(&Camera::three_quarter())?;
        let caption = "Displacement error at the largest forces, the worst of the examples, interpolated between the measured points; grey: too far from any of them.";
        Ok(Figure::new("error", picture.svg(), caption))
    }
}

/// The materials of a layout, each with its share of the cells in percent.
pub(super) fn shares(layout: &[u8], materials: usize) -> impl Iterator<Item = (u8, f64)> {
    let count = |m: u8| layout.iter().filter(|&&own| own == m).count();
    let all = layout.len().max(1) as f64;
    let rows: Vec<(u8, f64)> = (0..materials)
        .map(|m| (m as u8, 100.0 * count(m as u8) as f64 / all))
        .filter(|(_, percent)| *percent > 0.0)
        .collect();
    rows.into_iter()
}

/// Where an example's numbers stand in the long vectors, and which of its points is plotted.
struct Curve<'a> {
    example: &'a Example,
    start: usize,
    end: usize,
    /// The point that moves most along the force.
    point: Option<usize>,
}

impl<'a> Curve<'a> {
    fn new(example: &'a Example, start: usize) -> Curve<'a> {
        let width: usize = example.points.iter().map(|p| p.directions.len()).sum();
        let end = start + width * example.forces_n.len();
        Curve {
            example,
            start,
            end,
            point: example.telling_point(),
        }
    }

    fn index(&self, goal: &Goal) -> usize {
        goal.setup
            .examples
            .iter()
            .position(|e| std::ptr::eq(e, self.example))
            .unwrap_or(0)
    }

    /// Displacement of a point along the force out of a vector of all components.
    fn along(&self, point: usize, force: usize, components: &[f64]) -> f64 {
        self.weights(point, force)
            .iter()
            .map(|&(i, w)| components[i] * w)
            .sum()
    }

    /// The components that make it up, each with its factor.
    fn weights(&self, point: usize, force: usize) -> Vec<(usize, f64)> {
        let widths: Vec<usize> = self.example.points.iter().map(|p| p.directions.len()).collect();
        let first = self.start + force * widths.iter().sum::<usize>() + widths[..point].iter().sum::<usize>();
        let directions = self.example.points[point].directions.iter().enumerate();
        directions
            .map(|(i, d)| (first + i, d.dot(&self.example.contact.direction)))
            .collect()
    }
}

/// Lower and upper end of what is allowed at each force where the target is known; empty where no tolerance is.
fn tolerance_band(example: &Example, point: usize) -> Vec<[f64; 2]> {
    let tolerances = &example.tolerances_mm[point];
    if tolerances.iter().all(|t| *t == 0.0) {
        return Vec::new();
    }
    let known = (0..tolerances.len()).filter_map(|f| Some((example.along(point, f)?, tolerances[f])));
    known.map(|(x, t)| [x - t, x + t]).collect()
}

fn from_rest(points: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    std::iter::once([0.0, 0.0])
        .chain(points.filter(|p| p[1].is_finite()))
        .collect()
}

/// Shepard's interpolation with weights 1/d⁴, NaN beyond `reach` of every sample; samples at one place count by their largest.
fn interpolated(vertices: &[Vec3], samples: &[(Vec3, f64)], reach: f64) -> Vec<f64> {
    let mut places: Vec<(Vec3, f64)> = Vec::new();
    for (place, value) in samples {
        match places.iter_mut().find(|(p, _)| (p - place).norm_squared() < 1e-6) {
            Some((_, largest)) => *largest = largest.max(*value),
            None => places.push((*place, *value)),
        }
    }
    let at = |v: &Vec3| {
        let (mut sum, mut weights, mut nearest) = (0.0, 0.0, f64::INFINITY);
        for (place, value) in &places {
            let d2 = (place - v).norm_squared().max(1e-6);
            nearest = nearest.min(d2);
            sum += value / (d2 * d2);
            weights += 1.0 / (d2 * d2);
        }
        if nearest.sqrt() <= reach {
            sum / weights
        } else {
            f64::NAN
        }
    };
    vertices.iter().map(at).collect()
}

fn colour(text: &str) -> Colour {
    Colour::from_hex(text).unwrap_or(super::colour::NO_VALUE)
}
