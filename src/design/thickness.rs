//! Layers of other thickness: the borders of a layout's layers move until its response is as near to the target as they can
//! bring it.
//!
//! ```text
//! min_s ½ |r(s)|²,   r_i = e_i(s) / √n,   |r|² = RMS²         s_{k+1} − s_k ≥ d_k
//! ```
//!
//! s_k is the place of plane k ([`crate::fem::planes`]), e(s) the error x(s) − x̄ of the response with its layers there, beyond the
//! tolerances ([`super::misfit::Target::excess`]), n the pairs of a point and a force, d_k the least thickness of the slab between two planes. Between two planes that stay, the slabs'
//! thicknesses but one are the unknowns of a Levenberg–Marquardt minimisation within bounds; the one left out takes the rest.
//! It is the thickest, and is chosen anew where it runs into its own bound. dx/ds is exact at each level's equilibrium
//! ([`crate::fem::rig_sensitivity`]): a step costs one simulation and its derivatives.
//!
//! d_k is such that every layer that a slab is part of keeps the least thickness: the layer's least, by the slab's share of the
//! layer as drawn. A layer that was drawn thinner than that may grow and not shrink.
//!
//! The minimum is a local one, near the layout that the search found with equal layers. The elements stay as they are while
//! borders move; the result is simulated again on a grid made for it, and kept only if it is better there.

use super::misfit::{Misfit, Target};
use crate::fem::equilibrium;
use crate::fem::planes::Planes;
use crate::fem::rig::{Layout, Rig, RigError};
use crate::fem::rig_sensitivity::{Nudged, Responded};
use crate::fem::setup::Setup;
use crate::geometry::cells::{BorderError, Cells};
use crate::geometry::grid::GridError;
use crate::numerics::cholesky::CholeskyError;
use crate::numerics::least_squares::{self, LeastSquaresError, News, Problem, minimise_problem};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// About the least that multi-material printers and casting manage \[mm\].
const LEAST_MADE_MM: f64 = 0.5;
/// No layer shrinks to less than this share of the thinnest as drawn, if the goal does not ask for it: printer's files take
/// their resolution from the thinnest layer.
const LEAST_SHARE: f64 = 0.25;
/// How often the slab that takes the rest is chosen anew.
const ROUNDS: usize = 4;

/// How to move borders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The least thickness of a layer \[mm\]; of layers that follow the object's height, at its fifth percentile. Default 0.5.
    pub least_mm: f64,
    /// Most steps of one minimisation. Default 40.
    pub most_steps: usize,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            least_mm: LEAST_MADE_MM,
            most_steps: 40,
        }
    }
}

/// The least thickness of layers where a goal names none \[mm\]: 0.5 mm, or a quarter of the thinnest layer as drawn if that is
/// more.
pub fn default_least_mm(setup: &Setup) -> f64 {
    let regions = setup.cells.regions().iter();
    let thinnest = regions.map(|r| setup.cells.thinnest_layer(r, &setup.object.solid));
    let share = LEAST_SHARE * thinnest.fold(f64::INFINITY, f64::min);
    match share.is_finite() {
        true => share.max(LEAST_MADE_MM),
        false => LEAST_MADE_MM,
    }
}

/// A layout whose borders were moved.
#[derive(Clone, Debug)]
pub struct Refined {
    /// Material of each cell.
    pub layout: Layout,
    /// The cells with their borders where they are best.
    pub cells: Cells,
    /// Error with the borders as they were.
    pub before: Misfit,
    /// Error now.
    pub after: Misfit,
    /// Cells that are as thin as they may be: the object may do without them.
    pub thinnest: Vec<usize>,
    /// Simulations that it took.
    pub simulations: usize,
}

/// Why no borders can be moved.
#[derive(Debug, thiserror::Error)]
pub enum ThicknessError {
    /// An option.
    #[error("the least thickness of a layer is {0} mm: expected more than zero")]
    Least(f64),
    /// There are no borders between layers.
    #[error(
        "no layer border can move: expected a region of two layers or more, along the axis of the first region, none thinner than {least_mm} mm"
    )]
    NoBorders {
        /// The least thickness of a layer \[mm\].
        least_mm: f64,
    },
    /// A rig.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// Borders.
    #[error(transparent)]
    Border(#[from] BorderError),
    /// Memory.
    #[error(transparent)]
    Cholesky(#[from] CholeskyError),
    /// The minimisation.
    #[error(transparent)]
    LeastSquares(#[from] LeastSquaresError),
}

impl From<GridError> for ThicknessError {
    fn from(error: GridError) -> ThicknessError {
        RigError::from(error).into()
    }
}

/// Moves the borders of each of `layouts`, best first by what comes out. `rig` is that of `setup`. Setting `stop` keeps the
/// borders of layouts that are not done.
///
/// # Errors
/// [`ThicknessError`]: nothing can move.
pub fn refine(
    rig: &Rig,
    setup: &Setup,
    target: &Target,
    layouts: &[Layout],
    options: &Options,
    stop: &AtomicBool,
) -> Result<Vec<Refined>, ThicknessError> {
    check(setup, options)?;
    let slabs = Slabs::new(setup, options.least_mm)?;
    let one = |layout: &Layout| refine_one(rig, setup, target, layout, &slabs, options, stop);
    let mut refined = layouts.par_iter().map(one).collect::<Result<Vec<Refined>, _>>()?;
    let by_error = |a: &Refined, b: &Refined| {
        let errors = a.after.rms_mm.total_cmp(&b.after.rms_mm);
        errors.then_with(|| a.layout.cmp(&b.layout))
    };
    refined.sort_by(by_error);
    Ok(refined)
}

/// Can borders move at all?
///
/// # Errors
/// As [`refine`].
pub fn check(setup: &Setup, options: &Options) -> Result<(), ThicknessError> {
    if options.least_mm.is_nan() || options.least_mm <= 0.0 {
        return Err(ThicknessError::Least(options.least_mm));
    }
    Slabs::new(setup, options.least_mm).map(|_| ())
}

fn refine_one(
    rig: &Rig,
    setup: &Setup,
    target: &Target,
    layout: &Layout,
    slabs: &Slabs,
    options: &Options,
    stop: &AtomicBool,
) -> Result<Refined, ThicknessError> {
    let settled = |rig: &Rig| -> Result<Misfit, ThicknessError> {
        let exact = equilibrium::Options::default();
        let response = rig.bench()?.respond(layout, &exact, &|| false);
        Ok(match response.complete {
            true => target.misfit(&response.displacements),
            false => Misfit::FAILED,
        })
    };
    let before = settled(rig)?;
    let mut refined = Refined {
        layout: layout.clone(),
        cells: setup.cells.clone(),
        before,
        after: before,
        thinnest: Vec::new(),
        simulations: 1,
    };
    // With one material borders part nothing: moving them would change the elements and the error of the mesh alone.
    if before == Misfit::FAILED || super::space::distinct(layout) == 1 {
        return Ok(refined);
    }
    let mut places = slabs.planes.now.clone();
    for _ in 0..ROUNDS {
        let chains = slabs.chains(&places);
        let mut bending = Bending {
            rig,
            setup,
            target,
            layout,
            slabs,
            chains: &chains,
            start: &places,
            stop,
            last: None,
            simulations: 0,
        };
        let (start, bounds) = slabs.unknowns(&chains, &places);
        let minimised = minimise_problem(&mut bending, &start, &bounds, &precision(options));
        refined.simulations += bending.simulations;
        if stop.load(Ordering::Relaxed) {
            return Ok(refined);
        }
        let outcome = match minimised {
            // At a limit point there are no derivatives; borders stay where they are.
            Err(LeastSquaresError::NoStart) => break,
            other => other?,
        };
        let Some(found) = slabs.places(&chains, &places, &outcome.parameters) else {
            break;
        };
        places = found;
        if !chains.iter().any(|chain| slabs.is_thin(chain.rest, &places)) {
            break;
        }
    }
    let cells = setup
        .cells
        .moved(&slabs.planes.borders_at(&setup.cells, &places))?;
    let after = settled(&Rig::new(&setup.with_cells(cells.clone()), rig.laws.clone())?)?;
    refined.simulations += 1;
    if after.rms_mm < before.rms_mm {
        refined.thinnest = slabs.thinnest(&cells, &places);
        (refined.cells, refined.after) = (cells, after);
    }
    Ok(refined)
}

fn precision(options: &Options) -> least_squares::Options {
    least_squares::Options {
        max_iterations: options.most_steps,
        gradient_tolerance: 1e-8,
        step_tolerance: 1e-9,
        cost_tolerance: 1e-9,
        // Below a micrometre nothing can be printed, and readings hold no more.
        negligible_cost: 0.5e-12,
        ..least_squares::Options::default()
    }
}

/// The slabs between planes, and how thin each may be.
struct Slabs {
    planes: Planes,
    /// Which planes may move.
    free: Vec<bool>,
    /// Least thickness of slab k, between the planes k and k + 1, in the planes' unit.
    least: Vec<f64>,
}

/// Slabs between two planes that stay; the planes between them move.
struct Chain {
    /// The first plane, which stays.
    first: usize,
    /// The last one, which stays too.
    last: usize,
    /// The slab that takes what the others leave.
    rest: usize,
}

impl Slabs {
    fn new(setup: &Setup, least_mm: f64) -> Result<Slabs, ThicknessError> {
        let cells = &setup.cells;
        let planes = Planes::of(&setup.object.solid, cells)?;
        let gap = |k: usize| planes.drawn[k + 1] - planes.drawn[k];
        let mut least: Vec<f64> = vec![0.0; planes.drawn.len() - 1];
        for (r, region) in cells.regions().iter().enumerate() {
            let on: Vec<usize> = (0..planes.drawn.len())
                .filter(|&k| planes.borders[k].iter().any(|b| b[0] == r))
                .collect();
            let unit_mm = match planes.follows {
                true => cells.height_of(region, &setup.object.solid),
                false => 1.0,
            };
            for pair in on.windows(2) {
                let drawn = planes.drawn[pair[1]] - planes.drawn[pair[0]];
                let own = (least_mm / unit_mm).min(drawn);
                for (k, least) in least.iter_mut().enumerate().take(pair[1]).skip(pair[0]) {
                    *least = least.max(own * gap(k) / drawn);
                }
            }
        }
        // A slab that belongs to no layer, or to one without extent, keeps a share of itself.
        for (k, least) in least.iter_mut().enumerate() {
            if !(*least > 0.0 && least.is_finite()) {
                *least = 0.05 * gap(k);
            }
        }
        let free = (0..planes.drawn.len())
            .map(|k| planes.may_move(k, cells))
            .collect();
        let slabs = Slabs { planes, free, least };
        match slabs.chains(&slabs.planes.now).is_empty() {
            true => Err(ThicknessError::NoBorders { least_mm }),
            false => Ok(slabs),
        }
    }

    /// The chains with room to move in, with planes at `places`; of each, the slab that has most to give takes the rest.
    fn chains(&self, places: &[f64]) -> Vec<Chain> {
        let fixed: Vec<usize> = (0..self.free.len()).filter(|&k| !self.free[k]).collect();
        let slack = |k: usize| places[k + 1] - places[k] - self.least[k];
        let mut chains = Vec::new();
        for pair in fixed.windows(2) {
            let (first, last) = (pair[0], pair[1]);
            let whole = places[last] - places[first];
            let needed: f64 = self.least[first..last].iter().sum();
            if last - first < 2 || whole - needed <= 1e-6 * whole {
                continue;
            }
            let rest = (first..last).max_by(|&a, &b| slack(a).total_cmp(&slack(b)).then(b.cmp(&a)));
            chains.extend(rest.map(|rest| Chain { first, last, rest }));
        }
        chains
    }

    /// The slabs that are unknowns, chain by chain.
    fn unknown_slabs<'a>(&self, chains: &'a [Chain]) -> impl Iterator<Item = (&'a Chain, usize)> + 'a {
        let of = |chain: &'a Chain| {
            let others = (chain.first..chain.last).filter(move |&k| k != chain.rest);
            others.map(move |k| (chain, k))
        };
        chains.iter().flat_map(of)
    }

    /// The unknowns at `places`, and their bounds.
    fn unknowns(&self, chains: &[Chain], places: &[f64]) -> (Vec<f64>, Vec<(f64, f64)>) {
        let mut unknowns = Vec::new();
        let mut bounds = Vec::new();
        for (chain, k) in self.unknown_slabs(chains) {
            let whole = places[chain.last] - places[chain.first];
            let others: f64 = (chain.first..chain.last)
                .filter(|&j| j != k)
                .map(|j| self.least[j])
                .sum();
            unknowns.push(places[k + 1] - places[k]);
            bounds.push((self.least[k], whole - others));
        }
        (unknowns, bounds)
    }

    /// Where the planes are, given the unknowns; `None` if the slab that takes the rest is left too thin.
    fn places(&self, chains: &[Chain], before: &[f64], unknowns: &[f64]) -> Option<Vec<f64>> {
        let mut thickness: Vec<f64> = before.windows(2).map(|pair| pair[1] - pair[0]).collect();
        for ((_, k), &t) in self.unknown_slabs(chains).zip(unknowns) {
            thickness[k] = t;
        }
        let mut places = before.to_vec();
        for chain in chains {
            for k in chain.first..chain.rest {
                places[k + 1] = places[k] + thickness[k];
            }
            for k in (chain.rest + 1..chain.last).rev() {
                places[k] = places[k + 1] - thickness[k];
            }
            let rest = places[chain.rest + 1] - places[chain.rest];
            if rest < self.least[chain.rest] * (1.0 - 1e-9) {
                return None;
            }
        }
        Some(places)
    }

    /// ∂(planes that move)/∂(unknowns), `(planes × unknowns)`.
    fn slopes(&self, chains: &[Chain], moving: &[usize]) -> DMatrix<f64> {
        let unknowns: Vec<(&Chain, usize)> = self.unknown_slabs(chains).collect();
        DMatrix::from_fn(moving.len(), unknowns.len(), |row, column| {
            let (chain, slab) = unknowns[column];
            let plane = moving[row];
            if plane <= chain.first || plane >= chain.last {
                0.0
            } else if plane <= chain.rest {
                f64::from(u8::from(slab < plane))
            } else {
                -f64::from(u8::from(slab >= plane))
            }
        })
    }

    fn is_thin(&self, slab: usize, places: &[f64]) -> bool {
        places[slab + 1] - places[slab] <= self.least[slab] * (1.0 + 1e-3)
    }

    /// Cells all of whose slabs are as thin as they may be, and thinner than they were drawn.
    fn thinnest(&self, cells: &Cells, places: &[f64]) -> Vec<usize> {
        let place_of = |region: usize, border: usize| {
            self.planes
                .borders
                .iter()
                .position(|on| on.contains(&[region, border]))
        };
        let mut thin = Vec::new();
        let mut cell = 0;
        for (r, region) in cells.regions().iter().enumerate() {
            for layer in 0..region.borders.len() - 1 {
                if let (Some(from), Some(to)) = (place_of(r, layer), place_of(r, layer + 1)) {
                    let shrunk = places[to] - places[from] < self.planes.drawn[to] - self.planes.drawn[from];
                    if shrunk && (from..to).all(|k| self.is_thin(k, places)) {
                        thin.push(cell);
                    }
                }
                cell += 1;
            }
        }
        thin
    }
}

/// The error of one layout as a function of its slabs.
struct Bending<'a> {
    rig: &'a Rig,
    setup: &'a Setup,
    target: &'a Target,
    layout: &'a [u8],
    slabs: &'a Slabs,
    chains: &'a [Chain],
    start: &'a [f64],
    stop: &'a AtomicBool,
    /// What was simulated last.
    last: Option<(Setup, Rig, Responded)>,
    simulations: usize,
}

impl Bending<'_> {
    fn moving(&self) -> Vec<usize> {
        let inside = |c: &Chain| c.first + 1..c.last;
        self.chains.iter().flat_map(inside).collect()
    }

    /// 1/√n.
    fn scale(&self) -> f64 {
        let measured = |pair: &&[usize]| {
            self.target.components[pair[0]..pair[1]]
                .iter()
                .any(Option::is_some)
        };
        let pairs = self.target.pairs.windows(2).filter(measured).count();
        1.0 / (pairs.max(1) as f64).sqrt()
    }
}

impl Problem for Bending<'_> {
    fn residual(&mut self, x: &[f64]) -> Option<Vec<f64>> {
        let cancelled = || self.stop.load(Ordering::Relaxed);
        let places = self.slabs.places(self.chains, self.start, x)?;
        let borders = self.slabs.planes.borders_at(&self.setup.cells, &places);
        let setup = self.setup.with_cells(self.setup.cells.moved(&borders).ok()?);
        let rig = self.rig.moved(&setup).ok()?;
        let exact = equilibrium::Options::default();
        let responded = rig.bench().ok()?.respond_in_full(self.layout, &exact, &cancelled);
        self.simulations += 1;
        if !responded.response.complete {
            return None;
        }
        let scale = self.scale();
        let excess = self.target.excess(&responded.response.displacements);
        let residual = excess.iter().map(|e| scale * e).collect();
        self.last = Some((setup, rig, responded));
        Some(residual)
    }

    fn jacobian(&mut self, _x: &[f64]) -> Option<DMatrix<f64>> {
        let moving = self.moving();
        let (setup, rig, responded) = self.last.as_ref()?;
        let nudged = Nudged::new(rig, setup, &moving).ok()?;
        let by_planes = rig
            .bench()
            .ok()?
            .derivatives_by_planes(self.layout, &nudged, responded)
            .ok()?;
        let mut jacobian = by_planes * self.slabs.slopes(self.chains, &moving) * self.scale();
        to_excess(self.target, &responded.response.displacements, &mut jacobian);
        Some(jacobian)
    }

    fn goes_on(&mut self, _news: &News) -> bool {
        !self.stop.load(Ordering::Relaxed)
    }
}

/// Turns derivatives of displacements, `(components × n)`, into those of [`Target::excess`] at `displacements`.
///
/// With d = (x − x̄)/L of a pair and τ its tolerance, e = (L − τ) d and ∂e/∂x = (1 − τ/L) I + τ/L d dᵀ beyond it, zero within.
fn to_excess(target: &Target, displacements: &[f64], derivatives: &mut DMatrix<f64>) {
    for (pair, &tolerance) in target.pairs.windows(2).zip(&target.tolerances_mm) {
        let errors: Vec<Option<f64>> = (pair[0]..pair[1])
            .map(|i| target.components[i].map(|t| displacements[i] - t))
            .collect();
        let length = errors.iter().flatten().map(|e| e * e).sum::<f64>().sqrt();
        // Without a tolerance the excess is the error itself, where that is zero too.
        let (own, along) = match () {
            () if tolerance == 0.0 => (1.0, 0.0),
            () if length > tolerance => (1.0 - tolerance / length, tolerance / length),
            () => (0.0, 0.0),
        };
        for column in 0..derivatives.ncols() {
            let projected: f64 = match along > 0.0 {
                true => (errors.iter().enumerate())
                    .map(|(k, e)| e.unwrap_or(0.0) / length * derivatives[(pair[0] + k, column)])
                    .sum(),
                false => 0.0,
            };
            for (k, error) in errors.iter().enumerate() {
                let entry = &mut derivatives[(pair[0] + k, column)];
                *entry = match error {
                    Some(error) if along > 0.0 => own * *entry + along * projected * error / length,
                    Some(_) => own * *entry,
                    None => 0.0,
                };
            }
        }
    }
}

#[cfg(test)]
#[path = "thickness_tests.rs"]
mod tests;
