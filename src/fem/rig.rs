//! The object on the test bench: a layout goes in, the displacements of the measured points come out.
//!
//! Everything that does not depend on the layout is made once: grid, supports, numbering, symbolic factorisation, nodal
//! loads, sensors. A layout costs one numeric factorisation and one load curve for each example.

use super::elements::{gauss_points, trilinear};
use super::equilibrium::{Load, Options, Solver, Stop, Work};
use super::example::{Example, Sensor};
use super::forces::{Materials, point_fields};
use super::model::{Model, ModelError};
use super::planes::Planes;
use super::setup::Setup;
use crate::geometry::cells::Cells;
use crate::geometry::grid::{Grid, GridError, Levels};
use crate::geometry::region::Region;
use crate::geometry::solid::Solid;
use crate::material::law::Law;
use crate::math::Vec3;
use crate::numerics::cholesky::CholeskyError;
use crate::units::document::Mistake;

/// A layout: for each cell, the index of its material in the palette.
pub type Layout = Vec<u8>;

/// One example made ready.
#[derive(Clone, Debug)]
pub struct Press {
    /// Nodal forces at the largest force.
    pub load: Load,
    /// Share of the largest force at each level.
    pub factors: Vec<f64>,
    /// The contact point on the surface \[mm\].
    pub contact_point: Vec3,
    pub(super) sensors: Vec<(Sensor, Vec<Vec3>)>,
}

/// The object, held and wired.
#[derive(Clone, Debug)]
pub struct Rig {
    /// The grid over the object.
    pub grid: Grid,
    /// Unknowns and matrix.
    pub model: Model,
    /// The cell of each integration point, `(points)`.
    pub cell_of_point: Vec<u16>,
    /// The examples.
    pub presses: Vec<Press>,
    /// The laws of the palette.
    pub laws: Vec<Law>,
    components: usize,
}

/// What a layout answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Displacement components in the order of `design::misfit::Target` \[mm\]; beyond the load that was reached they
    /// continue the last increment.
    pub displacements: Vec<f64>,
    /// Is every level in equilibrium?
    pub complete: bool,
}

/// Why an object cannot be put on the bench.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// The grid.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// A support or a contact.
    #[error(transparent)]
    Mistake(#[from] Mistake),
    /// The supports, taken together.
    #[error("{file}: {error}")]
    Model {
        /// The file.
        file: String,
        /// What is wrong.
        error: ModelError,
    },
    /// The matrix.
    #[error(transparent)]
    Cholesky(#[from] CholeskyError),
}

/// Below this strain a law answers as it does at rest, whatever range it was fitted in.
const NOTICEABLE_STRAIN: f64 = 0.01;
/// Least number of elements through the thickness of the object.
const LEAST_LEVELS: usize = 3;

impl Rig {
    /// Puts an object on the bench; `laws` is the palette that layouts refer to.
    ///
    /// # Errors
    /// [`RigError`]: too fine a grid, supports or contacts that miss the object.
    pub fn new(setup: &Setup, laws: Vec<Law>) -> Result<Rig, RigError> {
        let grid = grid_for(&setup.object.solid, &setup.cells, setup.element_size_mm)?;
        let mut constrained = vec![[false; 3]; grid.mesh.nodes.len()];
        for fixed in &setup.fixed {
            fixed.hold(&setup.document, &grid, &mut constrained)?;
        }
        let model = Model::new(grid.mesh.clone(), Some(grid.fill.clone()), constrained)
            .map_err(|error| of_model(setup, error))?;
        let cell_of_point = cells_of_points(&grid, &setup.cells);
        let presses = presses(setup, &grid)?;
        let components = setup.examples.iter().map(components_of).sum();
        Ok(Rig {
            grid,
            model,
            cell_of_point,
            presses,
            laws,
            components,
        })
    }

    /// The same rig with the borders of `setup`'s cells elsewhere: its elements, numbering and supports stay, the levels move. What
    /// is pressed and measured is wired anew.
    ///
    /// # Errors
    /// [`RigError`]: borders that the grid cannot follow, contacts that miss the object.
    pub fn moved(&self, setup: &Setup) -> Result<Rig, RigError> {
        let solid = &setup.object.solid;
        let planes = Planes::of(solid, &setup.cells)?;
        let levels = levels_for(solid, &setup.cells, &planes, setup.element_size_mm);
        let grid = self.grid.with_levels(solid, levels);
        let model = self
            .model
            .moved(grid.mesh.clone(), Some(grid.fill.clone()))
            .map_err(|error| of_model(setup, error))?;
        Ok(Rig {
            model,
            cell_of_point: self.cell_of_point.clone(),
            presses: presses(setup, &grid)?,
            laws: self.laws.clone(),
            components: self.components,
            grid,
        })
    }

    /// Number of displacement components in a response.
    pub fn components(&self) -> usize {
        self.components
    }

    /// A bench of one's own for a thread.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`].
    pub fn bench(&self) -> Result<Bench<'_>, CholeskyError> {
        Ok(Bench {
            rig: self,
            solver: Solver::new(&self.model)?,
        })
    }

    pub(super) fn laws_of(&self, layout: &[u8]) -> Vec<&Law> {
        layout.iter().map(|&m| &self.laws[m as usize]).collect()
    }
}

/// The rig with one thread's memory.
#[derive(Debug)]
pub struct Bench<'a> {
    pub(super) rig: &'a Rig,
    pub(super) solver: Solver<'a>,
}

/// A layout under one example, in full.
#[derive(Clone, Debug)]
pub struct PressOutcome {
    /// Displacements at every level reached, each `(nodes)` \[mm\].
    pub levels: Vec<Vec<Vec3>>,
    /// Why it ended.
    pub stop: Stop,
    /// Share of the largest force that was reached.
    pub reached: f64,
    /// What it cost.
    pub work: Work,
    /// Share of the integration points that are noticeably strained, and outside their material's fitted range.
    pub share_outside_range: f64,
}

impl Bench<'_> {
    /// Presses one layout as all examples say.
    pub fn respond(&mut self, layout: &[u8], options: &Options, cancelled: &dyn Fn() -> bool) -> Response {
        self.respond_with(layout, options, cancelled, &mut |_| {})
    }

    /// The same, and gives the displacements at the levels of each press, `(levels × nodes)` \[mm\], to `keep`.
    pub(super) fn respond_with(
        &mut self,
        layout: &[u8],
        options: &Options,
        cancelled: &dyn Fn() -> bool,
        keep: &mut dyn FnMut(Vec<Vec<Vec3>>),
    ) -> Response {
        let laws = self.rig.laws_of(layout);
        let materials = Materials {
            laws: &laws,
            cell_of_point: &self.rig.cell_of_point,
        };
        let mut response = Response {
            displacements: Vec::with_capacity(self.rig.components),
            complete: true,
        };
        if self.solver.start(&materials).is_err() {
            response.complete = false;
            response.displacements.resize(self.rig.components, f64::NAN);
            return response;
        }
        for press in &self.rig.presses {
            let curve = self
                .solver
                .curve(&materials, &press.load, &press.factors, options, cancelled);
            response.complete &= curve.stop == Stop::Converged;
            response.displacements.extend(press.series(&curve.levels));
            keep(curve.levels);
        }
        response
    }

    /// Presses one layout as example `index` says and keeps the whole displacement field.
    pub fn press(&mut self, layout: &[u8], index: usize, options: &Options) -> PressOutcome {
        let factors = &self.rig.presses[index].factors;
        self.press_at(layout, index, factors, options, &|| false)
    }

    /// The same at other forces: `factors`, rising from above zero, are shares of the example's largest force.
    pub fn press_at(
        &mut self,
        layout: &[u8],
        index: usize,
        factors: &[f64],
        options: &Options,
        cancelled: &dyn Fn() -> bool,
    ) -> PressOutcome {
        let laws = self.rig.laws_of(layout);
        let materials = Materials {
            laws: &laws,
            cell_of_point: &self.rig.cell_of_point,
        };
        let press = &self.rig.presses[index];
        if self.solver.start(&materials).is_err() {
            let (levels, work) = (Vec::new(), Work::default());
            return PressOutcome {
                levels,
                stop: Stop::Unstable,
                reached: 0.0,
                work,
                share_outside_range: 0.0,
            };
        }
        let curve = self
            .solver
            .curve(&materials, &press.load, factors, options, cancelled);
        let share_outside_range = curve.levels.last().map_or(0.0, |u| {
            let fields = point_fields(&self.rig.model.parts, u, &materials);
            let strained = fields.strain.iter().map(|e| e.norm() > NOTICEABLE_STRAIN);
            let outside = strained
                .zip(&fields.in_range)
                .filter(|(strained, inside)| *strained && !**inside)
                .count();
            outside as f64 / fields.in_range.len().max(1) as f64
        });
        PressOutcome {
            levels: curve.levels,
            stop: curve.stop,
            reached: curve.reached,
            work: curve.work,
            share_outside_range,
        }
    }
}

impl Press {
    /// Displacement of the measured point `index`, given the nodes', `(nodes)` \[mm\].
    pub fn read(&self, index: usize, u: &[Vec3]) -> Vec3 {
        self.sensors[index].0.read(u)
    }

    /// Number of displacement components at one level.
    pub fn components(&self) -> usize {
        self.sensors.iter().map(|(_, along)| along.len()).sum()
    }

    /// All components at all levels, of the displacements at the `levels` that were reached, each `(nodes)` \[mm\]; beyond
    /// them the last increment goes on.
    pub(super) fn series(&self, levels: &[Vec<Vec3>]) -> Vec<f64> {
        let read = |u: &Vec<Vec3>| -> Vec<f64> {
            self.sensors
                .iter()
                .flat_map(|(s, along)| {
                    let moved = s.read(u);
                    along.iter().map(move |d| moved.dot(d)).collect::<Vec<f64>>()
                })
                .collect()
        };
        let mut series: Vec<Vec<f64>> = levels.iter().map(read).collect();
        for level in levels.len()..self.factors.len() {
            series.push(continued(&series, &self.factors, level, self.components()));
        }
        series.into_iter().flatten().collect()
    }
}

/// The displacements of a level that was not reached: the last increment goes on, or grows from rest.
fn continued(series: &[Vec<f64>], factors: &[f64], level: usize, components: usize) -> Vec<f64> {
    let Some(last) = series.last() else {
        return vec![f64::NAN; components];
    };
    let (t1, t) = (factors[level - 1], factors[level]);
    match level.checked_sub(2).map(|k| (&series[k], factors[k])) {
        Some((older, t0)) => last
            .iter()
            .zip(older)
            .map(|(b, a)| b + (b - a) * (t - t1) / (t1 - t0))
            .collect(),
        None => last.iter().map(|b| b * t / t1).collect(),
    }
}

fn components_of(example: &Example) -> usize {
    example.points.iter().map(|p| p.directions.len()).sum::<usize>() * example.forces_n.len()
}

fn of_model(setup: &Setup, error: ModelError) -> RigError {
    RigError::Model {
        file: setup.document.file.display().to_string(),
        error,
    }
}

fn presses(setup: &Setup, grid: &Grid) -> Result<Vec<Press>, Mistake> {
    let one = |example| press(setup, example, grid);
    setup.examples.iter().map(one).collect()
}

fn press(setup: &Setup, example: &Example, grid: &Grid) -> Result<Press, Mistake> {
    let fail = |message: String| {
        setup
            .document
            .mistake(&(0..0), format!("example {:?}: {message}", example.name))
    };
    let (mut forces, contact_point) = example
        .contact
        .unit_load(&setup.object.solid, grid)
        .map_err(|e| fail(e.to_string()))?;
    let largest = *example
        .forces_n
        .last()
        .ok_or_else(|| fail("has no forces".into()))?;
    forces.iter_mut().for_each(|f| *f *= largest);
    let (low, high) = setup.object.solid.bounds();
    let margin = 0.05 * (high - low).norm();
    let mut sensors = Vec::new();
    for point in &example.points {
        let off = (low - point.place).sup(&(point.place - high)).max();
        let place = if point.place == example.contact.point {
            contact_point
        } else {
            point.place
        };
        let sensor = Sensor::at(grid, &place)
            .filter(|_| off <= margin)
            .ok_or_else(|| {
                fail(format!(
                    "the measured point ({:.1}, {:.1}, {:.1}) mm lies {off:.1} mm off the object",
                    place.x, place.y, place.z
                ))
            })?;
        sensors.push((sensor, point.directions.clone()));
    }
    let factors = example.forces_n.iter().map(|f| f / largest).collect();
    Ok(Press {
        load: Load {
            forces,
            prescribed: None,
        },
        factors,
        contact_point,
        sensors,
    })
}

/// A grid whose faces lie on the layer borders: at shares of the height if a region follows it, flat otherwise.
pub(super) fn grid_for(solid: &Solid, cells: &Cells, size_mm: f64) -> Result<Grid, GridError> {
    let planes = Planes::of(solid, cells)?;
    let levels = levels_for(solid, cells, &planes, size_mm);
    let (a, b) = planes.axis.others();
    let across = [a, b].map(|c| lines_along(cells, c));
    Grid::new(solid, planes.axis, size_mm, levels, [&across[0], &across[1]])
}

/// The levels of a grid, on all `planes`.
fn levels_for(solid: &Solid, cells: &Cells, planes: &Planes, size_mm: f64) -> Levels {
    let (low, high) = solid.bounds();
    let scale_mm = match planes.follows {
        true => high[planes.axis.index()] - low[planes.axis.index()],
        false => 1.0,
    };
    let mut levels = refined(&planes.drawn, LEAST_LEVELS, scale_mm, size_mm);
    levels.iter_mut().for_each(|level| *level = planes.at(*level));
    match cells.heights() {
        Some(heights) => Levels::Following(heights.clone(), levels),
        None => Levels::Flat(levels),
    }
}

/// Ascending borders, cut further until there are at least `least` levels and none is thicker than `size_mm`; `scale_mm` is the
/// height of a share of one, or one where borders are coordinates already.
fn refined(borders: &[f64], least: usize, scale_mm: f64, size_mm: f64) -> Vec<f64> {
    let whole = borders[borders.len() - 1] - borders[0];
    let mut levels = vec![borders[0]];
    for pair in borders.windows(2) {
        let thickness = pair[1] - pair[0];
        let by_size = (thickness * scale_mm / size_mm).ceil();
        let by_count = (least as f64 * thickness / whole).round();
        let n = by_size.max(by_count).max(1.0) as usize;
        levels.extend((1..=n).map(|k| pair[0] + thickness * k as f64 / n as f64));
    }
    levels
}

/// Flat borders and box faces across the grid's axis, so that elements end where regions do.
fn lines_along(cells: &Cells, component: usize) -> Vec<f64> {
    let mut lines = Vec::new();
    for region in cells.regions() {
        if region.axis.index() == component {
            lines.extend(&region.borders);
        }
        let (a, b) = region.axis.others();
        for (own, borders) in [a, b].into_iter().zip(&region.across) {
            if own == component {
                lines.extend(borders);
            }
        }
        if let Region::Box { min, max } = &region.region {
            lines.extend([min[component], max[component]]);
        }
    }
    lines
}

/// The cell at the middle of each octant; a point outside all regions takes its hexahedron's most frequent cell.
pub(super) fn cells_of_points(grid: &Grid, cells: &Cells) -> Vec<u16> {
    let points = gauss_points();
    let mut result = Vec::with_capacity(grid.fill.len());
    for e in 0..grid.mesh.elements.len() {
        let nodes = grid.mesh.elements.nodes_of(e);
        let found: Vec<Option<usize>> = points
            .iter()
            .map(|at| {
                let weights = trilinear(at);
                let place: Vec3 = nodes
                    .iter()
                    .zip(weights)
                    .map(|(&n, w)| grid.mesh.nodes[n as usize] * w)
                    .sum();
                cells.cell_at(&place)
            })
            .collect();
        let fallback = found.iter().flatten().next().copied().unwrap_or(0);
        result.extend(found.iter().map(|c| c.unwrap_or(fallback) as u16));
    }
    result
}
