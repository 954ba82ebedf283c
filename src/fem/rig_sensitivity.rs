//! How the response of a layout changes with the borders of its layers, and with the materials where those are not known
//! exactly.
//!
//! ```text
//! x = S u,  f_int(u, s) = t f_ext(s):     dx/ds = ∂S/∂s u + S K⁻¹ (t ∂f_ext/∂s − ∂f_int/∂s)
//! ∂/∂s at fixed u by central differences over moved meshes:   (g(s + h) − g(s − h)) / 2h,   no solve
//! p = p̄ + B z:                            dx/dz = −S K⁻¹ Σ_p ∂f_int/∂p B_pz
//! ```
//!
//! K is the consistent tangent at the equilibrium of each level. A border moves the nodes of its plane, those of the levels
//! beside it in proportion, the octants' fills, and where sensors and contacts lie in their elements; numbering and supports
//! stay. Fills are smooth in s but for kinks where a level passes an edge of the surface; the difference is one-sided there.
//!
//! Symbols: u nodal displacement \[mm\], S shape functions at the sensors, s place of a plane (\[mm\] or share of the height),
//! t load factor, p parameters of a law, z independent numbers of deviation one. Valid at equilibria that are no limit points.

use super::equilibrium::Options;
use super::forces::{Materials, add_internal_forces};
use super::planes::Planes;
use super::rig::{Bench, Response, Rig, RigError};
use super::sensitivity::{READING_TOLERANCE, SensitivityError, TOLERANCE};
use super::setup::Setup;
use crate::geometry::cells::BorderError;
use crate::material::law::Law;
use crate::math::Vec3;
use crate::math::mandel::Mandel;
use nalgebra::DMatrix;

/// Step of the differences, as a share of the thinner slab beside a plane.
const STEP: f64 = 1e-4;

/// A layout's response in full.
#[derive(Clone, Debug)]
pub struct Responded {
    /// What the sensors read.
    pub response: Response,
    /// For each press the displacements at every level reached, `(presses × levels × nodes)` \[mm\].
    pub fields: Vec<Vec<Vec<Vec3>>>,
}

/// A law's parameters that are not known exactly: p = p̄ + B z.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubt {
    /// B, `(parameters × numbers)`, in the units of [`Law::parameters`].
    pub spread: DMatrix<f64>,
}

/// Why a layout has no derivatives.
#[derive(Debug, thiserror::Error)]
pub enum DerivativeError {
    /// A plane cannot move.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// Borders out of order.
    #[error(transparent)]
    Border(#[from] BorderError),
    /// A limit point.
    #[error(transparent)]
    Sensitivity(#[from] SensitivityError),
    /// A factorisation.
    #[error(transparent)]
    Cholesky(#[from] crate::numerics::cholesky::CholeskyError),
}

/// A rig with one plane a little above and a little below its place.
struct Pair {
    above: Rig,
    below: Rig,
    width: f64,
}

/// Rigs to take differences of, two for each plane.
pub struct Nudged(Vec<Pair>);

impl Nudged {
    /// The rig with each of `planes` moved up and down; `setup` holds the cells of `rig` as they are now.
    ///
    /// # Errors
    /// [`DerivativeError`]: a plane that cannot move.
    pub fn new(rig: &Rig, setup: &Setup, planes: &[usize]) -> Result<Nudged, DerivativeError> {
        let all = Planes::of(&setup.object.solid, &setup.cells).map_err(RigError::from)?;
        let mut pairs = Vec::with_capacity(planes.len());
        for &k in planes {
            let step = STEP * (all.now[k] - all.now[k - 1]).min(all.now[k + 1] - all.now[k]);
            let at = |shift: f64| -> Result<Rig, DerivativeError> {
                let mut places = all.now.clone();
                places[k] += shift;
                let cells = setup.cells.moved(&all.borders_at(&setup.cells, &places))?;
                Ok(rig.moved(&setup.with_cells(cells))?)
            };
            pairs.push(Pair {
                above: at(step)?,
                below: at(-step)?,
                width: 2.0 * step,
            });
        }
        Ok(Nudged(pairs))
    }
}

impl Bench<'_> {
    /// Presses one layout as all examples say, and keeps the displacement fields.
    pub fn respond_in_full(
        &mut self,
        layout: &[u8],
        options: &Options,
        cancelled: &dyn Fn() -> bool,
    ) -> Responded {
        let mut fields = Vec::with_capacity(self.rig.presses.len());
        let response = self.respond_with(layout, options, cancelled, &mut |levels| fields.push(levels));
        Responded { response, fields }
    }

    /// Derivatives of a response with respect to the places of planes, `(components × planes)` \[mm per mm, or per share\].
    ///
    /// `responded` is this layout's response, complete.
    ///
    /// # Errors
    /// [`DerivativeError::Sensitivity`]: a limit point.
    pub fn derivatives_by_planes(
        &mut self,
        layout: &[u8],
        nudged: &Nudged,
        responded: &Responded,
    ) -> Result<DMatrix<f64>, DerivativeError> {
        let rig = self.rig;
        let laws = rig.laws_of(layout);
        let materials = Materials {
            laws: &laws,
            cell_of_point: &rig.cell_of_point,
        };
        let mut derivatives = DMatrix::zeros(rig.components(), nudged.0.len());
        let mut first = 0;
        for (p, (press, levels)) in rig.presses.iter().zip(&responded.fields).enumerate() {
            for (u, &factor) in levels.iter().zip(&press.factors) {
                let forces: Vec<Vec<Vec3>> = nudged
                    .0
                    .iter()
                    .map(|pair| pair.out_of_balance(p, u, factor, &materials))
                    .collect();
                let sensors = &press.sensors;
                let moved = self
                    .solver
                    .readings_by_forces(u, &materials, &forces, sensors, TOLERANCE)?;
                for (k, pair) in nudged.0.iter().enumerate() {
                    let wired = pair.reading_change(p, u);
                    for row in 0..moved.nrows() {
                        derivatives[(first + row, k)] = moved[(row, k)] + wired[row];
                    }
                }
                first += moved.nrows();
            }
        }
        Ok(derivatives)
    }

    /// Derivatives of a response with respect to what is uncertain of the materials, a matrix `(components × numbers)` \[mm\] for
    /// each material of the palette; without columns where nothing is, or where the layout does not use it.
    ///
    /// `responded` is this layout's response, complete; `doubts`, `(palette)`.
    ///
    /// # Errors
    /// [`DerivativeError::Sensitivity`]: a limit point.
    pub fn derivatives_by_doubts(
        &mut self,
        layout: &[u8],
        doubts: &[Option<Doubt>],
        responded: &Responded,
    ) -> Result<Vec<DMatrix<f64>>, DerivativeError> {
        let rig = self.rig;
        let all: Vec<&Law> = rig.laws.iter().collect();
        // By material in place of by cell: one set of numbers for all cells of a material.
        let material_of_point: Vec<u16> = rig
            .cell_of_point
            .iter()
            .map(|&c| u16::from(layout[c as usize]))
            .collect();
        let materials = Materials {
            laws: &all,
            cell_of_point: &material_of_point,
        };
        let columns = |m: usize| match &doubts[m] {
            Some(doubt) if layout.contains(&(m as u8)) => doubt.spread.ncols(),
            _ => 0,
        };
        let counts: Vec<usize> = (0..all.len()).map(columns).collect();
        let mut derivatives: Vec<DMatrix<f64>> = counts
            .iter()
            .map(|&n| DMatrix::zeros(rig.components(), n))
            .collect();
        if counts.iter().all(|&n| n == 0) {
            return Ok(derivatives);
        }
        let mut first = 0;
        for (press, levels) in rig.presses.iter().zip(&responded.fields) {
            for u in levels {
                let mut forces = Vec::new();
                for (m, doubt) in doubts.iter().enumerate() {
                    let Some(doubt) = doubt.as_ref().filter(|_| counts[m] > 0) else {
                        continue;
                    };
                    let slopes = |law: &Law, strain: &Mandel| doubt.slopes(law, strain);
                    forces.extend(self.solver.force_derivatives(u, &materials, m, &slopes)?);
                }
                forces.iter_mut().flatten().for_each(|f| *f = -*f);
                let sensors = &press.sensors;
                let moved =
                    self.solver
                        .readings_by_forces(u, &materials, &forces, sensors, READING_TOLERANCE)?;
                let mut column = 0;
                for (own, &count) in derivatives.iter_mut().zip(&counts) {
                    own.view_mut((first, 0), (moved.nrows(), count))
                        .copy_from(&moved.columns(column, count));
                    column += count;
                }
                first += moved.nrows();
            }
        }
        Ok(derivatives)
    }
}

impl Doubt {
    /// ∂T/∂z at fixed strain \[MPa\], `(numbers)`.
    fn slopes(&self, law: &Law, strain: &Mandel) -> Vec<Mandel> {
        let by_parameter = law.stress_by_parameters(strain);
        self.spread
            .column_iter()
            .map(|b| by_parameter.iter().zip(b.iter()).map(|(t, b)| t * *b).sum())
            .collect()
    }
}

impl Pair {
    /// t ∂f_ext/∂s − ∂f_int/∂s at the nodes, `(nodes)`.
    fn out_of_balance(&self, press: usize, u: &[Vec3], factor: f64, materials: &Materials) -> Vec<Vec3> {
        let forces = |rig: &Rig| {
            let mut forces = vec![Vec3::zeros(); u.len()];
            add_internal_forces(&rig.model.parts, u, materials, &mut forces);
            for (f, e) in forces.iter_mut().zip(&rig.presses[press].load.forces) {
                *f = e * factor - *f;
            }
            forces
        };
        let (above, below) = (forces(&self.above), forces(&self.below));
        above
            .iter()
            .zip(&below)
            .map(|(a, b)| (a - b) / self.width)
            .collect()
    }

    /// ∂S/∂s u, `(components of a level)`.
    fn reading_change(&self, press: usize, u: &[Vec3]) -> Vec<f64> {
        let sensors = |rig: &'_ Rig| -> Vec<f64> {
            let sensors = &rig.presses[press].sensors;
            sensors
                .iter()
                .flat_map(|(sensor, along)| {
                    let moved = sensor.read(u);
                    along.iter().map(move |d| moved.dot(d)).collect::<Vec<f64>>()
                })
                .collect()
        };
        let (above, below) = (sensors(&self.above), sensors(&self.below));
        above
            .iter()
            .zip(&below)
            .map(|(a, b)| (a - b) / self.width)
            .collect()
    }
}
