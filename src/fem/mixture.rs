//! Cells that hold shares of several materials at once, and how readings change with the shares.
//!
//! ```text
//! s_em = Σ_c v_ec w_cm                              share of material m in element e
//! f_int(u) = Σ_e Σ_m s_em f_em(u)                   every material strained alike (Voigt 1889)
//! dx/dw_cm = −Σ_e v_ec λ_e · f_em,    Kᵀ λ = ∂x/∂u
//! ```
//!
//! An element's force is the sum of those of its materials, each as if it filled the element alone, times the share that
//! it has: elements of one material each over one another, on the same nodes. Each keeps its own volumetric strain, so
//! laws over tr ε and laws over J mix, and an element of one material alone is what it is in [`super::rig`]. The forces are
//! linear in the shares, so the derivative is exact.
//!
//! Symbols: u displacement \[mm\], w share of a material in a cell, v share of a cell in an element's volume, f_em nodal
//! forces of element e filled with material m \[N\], x a reading \[mm\], λ its adjoint, K the consistent tangent. Valid at
//! equilibria that are not limit points. An element that lies in several cells is one mixture of all of them; the rig
//! gives each of its points the material of its own cell.

use super::elements::{Block, Discretisation};
use super::equilibrium::{Options, Solver, Stop};
use super::forces::{self, Materials};
use super::model::Model;
use super::response::{self, Laws};
use super::rig::{Press, Response, Rig};
use crate::math::Vec3;
use crate::numerics::cholesky::CholeskyError;
use crate::numerics::gmres::Side;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// The rig for mixtures.
#[derive(Debug)]
pub struct Mixtures<'a> {
    rig: &'a Rig,
    /// For each element, the cells that it lies in with their shares of its volume.
    cells_of_element: Vec<Vec<(u16, f64)>>,
    cells: usize,
    /// Which presses of the rig.
    presses: Range<usize>,
}

/// Mixtures, pressed.
#[derive(Debug)]
pub struct Pressed {
    model: Model,
    material_of_point: Vec<u16>,
    /// Displacements of each press at the levels that were reached, each `(nodes)` \[mm\].
    levels: Vec<Vec<Vec<Vec3>>>,
    /// What the sensors read.
    pub response: Response,
}

/// A weighted sum of the components of one press at one level.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Which press.
    pub press: usize,
    /// Which level.
    pub level: usize,
    /// Weights, `(components of the press)`.
    pub weights: Vec<f64>,
}

/// Why mixtures cannot be pressed.
#[derive(Debug, thiserror::Error)]
pub enum MixtureError {
    /// Elements that cannot lie over one another.
    #[error("mixtures need hexahedra of eight points")]
    Elements,
    /// The matrix.
    #[error(transparent)]
    Cholesky(#[from] CholeskyError),
}

impl<'a> Mixtures<'a> {
    /// Mixtures in the `cells` cells of a rig.
    pub fn new(rig: &'a Rig, cells: usize) -> Mixtures<'a> {
        let per = rig.model.parts.points_per_element();
        let cells_of_element = (0..rig.model.mesh.elements.len())
            .map(|e| {
                let mut volumes: BTreeMap<u16, f64> = BTreeMap::new();
                for q in e * per..(e + 1) * per {
                    *volumes.entry(rig.cell_of_point[q]).or_default() += rig.model.parts.weight(q);
                }
                let whole: f64 = volumes.values().sum();
                volumes.into_iter().map(|(c, v)| (c, v / whole)).collect()
            })
            .collect();
        Mixtures {
            rig,
            cells_of_element,
            cells,
            presses: 0..rig.presses.len(),
        }
    }

    /// The same with some of the rig's presses alone: what is asked of others is not answered.
    pub fn only(self, presses: Range<usize>) -> Mixtures<'a> {
        Mixtures { presses, ..self }
    }

    /// The rig.
    pub fn rig(&self) -> &Rig {
        self.rig
    }

    /// The presses that are answered.
    pub fn presses(&self) -> Range<usize> {
        self.presses.clone()
    }

    /// Volume of the object in each cell \[mm³\], `(cells)`.
    pub fn volumes_mm3(&self) -> Vec<f64> {
        let mut volumes = vec![0.0; self.cells];
        for (q, &cell) in self.rig.cell_of_point.iter().enumerate() {
            volumes[cell as usize] += self.rig.model.parts.weight(q);
        }
        volumes
    }

    /// For each cell the cells that it touches with a face of an element, ascending.
    pub fn touching(&self) -> Vec<Vec<u32>> {
        const FACES: [[usize; 4]; 6] = [
            [0, 1, 2, 3],
            [4, 5, 6, 7],
            [0, 1, 5, 4],
            [1, 2, 6, 5],
            [2, 3, 7, 6],
            [3, 0, 4, 7],
        ];
        let mut touching = vec![Vec::new(); self.cells];
        let mut join = |a: u16, b: u16| {
            if a != b {
                touching[a as usize].push(u32::from(b));
                touching[b as usize].push(u32::from(a));
            }
        };
        let mut open: BTreeMap<[u32; 4], usize> = BTreeMap::new();
        for e in 0..self.cells_of_element.len() {
            let own = &self.cells_of_element[e];
            own.windows(2).for_each(|pair| join(pair[0].0, pair[1].0));
            let nodes = self.rig.model.mesh.elements.nodes_of(e);
            for face in FACES {
                let mut key = face.map(|a| nodes[a]);
                key.sort_unstable();
                if let Some(other) = open.insert(key, e) {
                    let main = |e: usize| {
                        let most = |a: &&(u16, f64), b: &&(u16, f64)| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0));
                        self.cells_of_element[e].iter().max_by(most).map(|&(c, _)| c)
                    };
                    if let (Some(a), Some(b)) = (main(e), main(other)) {
                        join(a, b);
                    }
                }
            }
        }
        for list in &mut touching {
            list.sort_unstable();
            list.dedup();
        }
        touching
    }

    /// Presses as the examples say, side by side on all threads. `shares`, `(cells × materials)`, none negative.
    ///
    /// # Errors
    /// [`MixtureError`]: memory.
    pub fn press(
        &self,
        shares: &[f64],
        options: &Options,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Pressed, MixtureError> {
        let (model, material_of_point) = self.overlaid(shares)?;
        let laws: Vec<_> = self.rig.laws.iter().collect();
        let materials = Materials {
            laws: &laws,
            cell_of_point: &material_of_point,
        };
        let own = &self.rig.presses[self.presses.clone()];
        let curves = on_threads(own, |_, presses| {
            let mut solver = Solver::new(&model)?;
            if solver.start(&materials).is_err() {
                return Ok(presses.iter().map(|_| (Vec::new(), false)).collect());
            }
            let curve = |press: &Press| {
                let curve = solver.curve(&materials, &press.load, &press.factors, options, cancelled);
                (curve.levels, curve.stop == Stop::Converged)
            };
            Ok(presses.iter().map(curve).collect())
        })?;
        let mut response = Response {
            displacements: Vec::new(),
            complete: true,
        };
        let mut levels = Vec::with_capacity(curves.len());
        for (press, (reached, complete)) in own.iter().zip(curves) {
            response.displacements.extend(press.series(&reached));
            response.complete &= complete;
            levels.push(reached);
        }
        Ok(Pressed {
            model,
            material_of_point,
            levels,
            response,
        })
    }

    /// Elements over one another, one for each material that an element holds.
    fn overlaid(&self, shares: &[f64]) -> Result<(Model, Vec<u16>), MixtureError> {
        let materials = self.rig.laws.len();
        let mut copies = Vec::with_capacity(self.cells_of_element.len());
        let mut material_of_point = Vec::new();
        let per = self.rig.model.parts.points_per_element();
        for (e, cells) in self.cells_of_element.iter().enumerate() {
            for m in 0..materials {
                let share: f64 = cells
                    .iter()
                    .map(|&(c, v)| v * shares[c as usize * materials + m])
                    .sum();
                if share > 0.0 {
                    copies.push((e, share));
                    material_of_point.resize(material_of_point.len() + per, m as u16);
                }
            }
        }
        let model = self.rig.model.overlaid(&copies).ok_or(MixtureError::Elements)?;
        Ok((model, material_of_point))
    }

    /// Derivatives of `readings`, ordered by press and all of presses that are answered, with respect to the share of each material in each variable,
    /// `(readings × (variables · materials))` \[mm\], by one adjoint solve each to `tolerance`. `variable_of_cell` says which
    /// cells share a variable. At a level that was not reached, or where the tangent is not positive definite, they are those
    /// of the last level before in proportion to the load, or zero.
    ///
    /// # Errors
    /// [`MixtureError`]: memory.
    pub fn derivatives(
        &self,
        pressed: &Pressed,
        readings: &[Reading],
        variable_of_cell: &[u32],
        tolerance: f64,
    ) -> Result<DMatrix<f64>, MixtureError> {
        let Discretisation::Eight(block) = &self.rig.model.parts else {
            return Err(MixtureError::Elements);
        };
        let columns = self.rig.laws.len() * variable_of_cell.iter().max().map_or(0, |&v| v as usize + 1);
        let laws: Vec<_> = self.rig.laws.iter().collect();
        let materials = Materials {
            laws: &laws,
            cell_of_point: &pressed.material_of_point,
        };
        let own = self.presses.clone();
        let blocks = on_threads(&self.rig.presses[own.clone()], |first, presses| {
            let mut solver = Solver::new(&pressed.model)?;
            let mut parts = Vec::new();
            for k in own.start + first..own.start + first + presses.len() {
                let own: Vec<&Reading> = readings.iter().filter(|r| r.press == k).collect();
                let mut part = DMatrix::zeros(own.len(), columns);
                let mut done: Option<usize> = None;
                for level in 0..self.rig.presses[k].factors.len() {
                    let rows: Vec<usize> = (0..own.len()).filter(|&i| own[i].level == level).collect();
                    let u = pressed.levels[k - self.presses.start].get(level);
                    if let Some(u) = u.filter(|u| solver.tangent_at(u, &materials).is_ok()) {
                        let adjoints = self.adjoints(&mut solver, k, &own, &rows, tolerance);
                        self.add_products(block, u, &adjoints, &rows, variable_of_cell, &mut part);
                        done = Some(level);
                    } else if let Some(before) = done {
                        let factors = &self.rig.presses[k].factors;
                        self.go_on(&own, &rows, before, factors[level] / factors[before], &mut part);
                    }
                }
                parts.push(part);
            }
            Ok(parts)
        })?;
        let mut all = DMatrix::zeros(readings.len(), columns);
        let mut row = 0;
        for part in blocks {
            all.rows_mut(row, part.nrows()).copy_from(&part);
            row += part.nrows();
        }
        Ok(all)
    }

    /// λ of the readings `rows` of press `k`, each `(nodes)`.
    fn adjoints(
        &self,
        solver: &mut Solver,
        k: usize,
        own: &[&Reading],
        rows: &[usize],
        tolerance: f64,
    ) -> Vec<Vec<Vec3>> {
        let model = solver.model;
        let mut right = vec![0.0; model.unknowns()];
        rows.iter()
            .map(|&i| {
                let mut field = vec![Vec3::zeros(); model.mesh.nodes.len()];
                let sensors = &self.rig.presses[k].sensors;
                let directions = sensors
                    .iter()
                    .flat_map(|(s, along)| along.iter().map(move |d| (s, d)));
                for ((sensor, direction), weight) in directions.zip(&own[i].weights) {
                    for &(n, w) in &sensor.weights {
                        field[n] += direction * (w * weight);
                    }
                }
                model.gather(&field, &mut right);
                // The factor is there: `tangent_at` made it.
                let solved = solver.solve_tangent(&mut right, Side::Transposed, tolerance);
                field.fill(Vec3::zeros());
                if solved.is_some() {
                    model.spread(&right, &mut field);
                }
                field
            })
            .collect()
    }

    /// Subtracts v λ·f of every element and material from the derivatives.
    fn add_products(
        &self,
        block: &Block<8>,
        u: &[Vec3],
        adjoints: &[Vec<Vec3>],
        rows: &[usize],
        variable_of_cell: &[u32],
        part: &mut DMatrix<f64>,
    ) {
        let count = self.rig.laws.len();
        let mut products = vec![0.0; rows.len()];
        for (e, batch) in block.batches.iter().enumerate() {
            let f = forces::deformation_gradients(block, batch, u);
            let nodes = &block.nodes[e];
            for (m, law) in self.rig.laws.iter().enumerate() {
                let piola = response::weighted_piola(&f, &batch.weight, &Laws::Same(law), block.volumetric);
                let nodal: [Vec3; 8] = std::array::from_fn(|a| {
                    let lanes = forces::products(&piola, &batch.gradients[a]);
                    Vec3::new(
                        lanes[0].iter().sum(),
                        lanes[1].iter().sum(),
                        lanes[2].iter().sum(),
                    )
                });
                for (product, adjoint) in products.iter_mut().zip(adjoints) {
                    *product = nodes
                        .iter()
                        .zip(&nodal)
                        .map(|(&n, f)| adjoint[n as usize].dot(f))
                        .sum::<f64>();
                }
                for &(cell, share) in &self.cells_of_element[e] {
                    let column = variable_of_cell[cell as usize] as usize * count + m;
                    for (&row, product) in rows.iter().zip(&products) {
                        part[(row, column)] -= share * product;
                    }
                }
            }
        }
    }

    /// Copies the rows of the level `before` to `rows`, times a factor: readings at both levels have the same weights, in
    /// order, or there is nothing to copy.
    fn go_on(&self, own: &[&Reading], rows: &[usize], before: usize, factor: f64, part: &mut DMatrix<f64>) {
        let from: Vec<usize> = (0..own.len()).filter(|&i| own[i].level == before).collect();
        for (&to, &from) in rows.iter().zip(&from) {
            if own[to].weights == own[from].weights {
                let row = part.row(from) * factor;
                part.set_row(to, &row);
            }
        }
    }
}

/// Runs `work` on runs of `presses` side by side, one a thread, with the number of the first; the answers in order. What
/// a press answers may not depend on its company.
fn on_threads<T: Send>(
    presses: &[Press],
    work: impl Fn(usize, &[Press]) -> Result<Vec<T>, MixtureError> + Sync,
) -> Result<Vec<T>, MixtureError> {
    let run = presses.len().div_ceil(rayon::current_num_threads()).max(1);
    let runs: Vec<Vec<T>> = presses
        .par_chunks(run)
        .enumerate()
        .map(|(k, presses)| work(k * run, presses))
        .collect::<Result<_, _>>()?;
    Ok(runs.into_iter().flatten().collect())
}
