//! How equilibrium displacements change with the parameters of the materials.
//!
//! ```text
//! f_int(u, p) = f_ext:     K du/dp = −∂f_int/∂p                            direct: one solve a parameter
//! J(u):   dJ/dp = −λᵀ ∂f_int/∂p,   Kᵀ λ = ∂J/∂u                            adjoint: one solve a functional
//! ∂f_int/∂p = Σ_q w (∂P/∂p) ∇N,   ∂P/∂p from ∂T/∂p as P from T
//! ```
//!
//! K is the consistent tangent at the equilibrium, rotations and strains included, its skew part too; appendix B of
//! Bickel 2010 holds rotation and strain fixed, which is off by some percent. The forces are linear in the laws' stresses, so
//! ∂f_int/∂p is the force of the stresses ∂T/∂p at fixed strain. Loads keep their direction and do not depend on p.
//!
//! Symbols: u displacement \[mm\], p a parameter of [`crate::material::law::Law::parameters`] in its unit, J a functional
//! of the displacements, λ its adjoint. Valid at an equilibrium that is not a limit point.

use super::elements::{BATCH, Block, Discretisation};
use super::equilibrium::Solver;
use super::example::Sensor;
use super::forces::{self, Materials};
use super::response;
use crate::material::law::Law;
use crate::math::Vec3;
use crate::math::mandel::Mandel;
use crate::math::polar_lanes::ZERO;
use crate::numerics::gmres::Side;
use nalgebra::DMatrix;

/// Residual of the linear systems, as a share of their right-hand sides.
pub(super) const TOLERANCE: f64 = 1e-12;
/// The same for readings, which fits ask for by the thousand and need less exactly.
pub(super) const READING_TOLERANCE: f64 = 1e-6;

/// Why there are no derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SensitivityError {
    /// The tangent has no Cholesky factor.
    #[error(
        "the tangent at this equilibrium is not positive definite (a limit point): ask at a smaller load"
    )]
    Unstable,
    /// There is no such cell.
    #[error("cell {cell} has no law: there are {cells}")]
    NoSuchCell {
        /// The cell asked for.
        cell: usize,
        /// How many there are.
        cells: usize,
    },
}

/// Derivatives of a law's stress at fixed strain by numbers that it depends on.
pub type Slopes<'a> = dyn Fn(&Law, &Mandel) -> Vec<Mandel> + Sync + 'a;

impl Solver<'_> {
    /// Derivatives of the displacements at the equilibrium `u`, `(nodes)` \[mm\], with respect to each parameter of the law
    /// of `cell`, `(parameters × nodes)` \[mm per unit of the parameter\].
    ///
    /// # Errors
    /// [`SensitivityError`]: a limit point, no such cell.
    pub fn displacement_derivatives(
        &mut self,
        u: &[Vec3],
        materials: &Materials,
        cell: usize,
    ) -> Result<Vec<Vec<Vec3>>, SensitivityError> {
        let by_parameter = self.force_derivatives(u, materials, cell, &Law::stress_by_parameters)?;
        self.tangent_at(u, materials)?;
        let mut derivatives = Vec::with_capacity(by_parameter.len());
        let mut right = vec![0.0; self.model.unknowns()];
        for force in &by_parameter {
            self.model.gather(force, &mut right);
            right.iter_mut().for_each(|f| *f = -*f);
            self.solve_tangent(&mut right, Side::Plain, TOLERANCE)
                .ok_or(SensitivityError::Unstable)?;
            let mut field = vec![Vec3::zeros(); u.len()];
            self.model.spread(&right, &mut field);
            derivatives.push(field);
        }
        Ok(derivatives)
    }

    /// Derivatives of a functional J of the displacements with respect to the parameters of every cell's law,
    /// `(cells × parameters)`, from its derivative by the displacements `by_displacement`, `(nodes)`, at the equilibrium
    /// `u`, `(nodes)` \[mm\].
    ///
    /// # Errors
    /// [`SensitivityError`]: a limit point.
    pub fn gradient(
        &mut self,
        u: &[Vec3],
        materials: &Materials,
        by_displacement: &[Vec3],
    ) -> Result<Vec<Vec<f64>>, SensitivityError> {
        self.tangent_at(u, materials)?;
        let mut right = vec![0.0; self.model.unknowns()];
        self.model.gather(by_displacement, &mut right);
        self.solve_tangent(&mut right, Side::Transposed, TOLERANCE)
            .ok_or(SensitivityError::Unstable)?;
        let mut adjoint = vec![Vec3::zeros(); u.len()];
        self.model.spread(&right, &mut adjoint);
        (0..materials.laws.len())
            .map(|cell| {
                let forces = self.force_derivatives(u, materials, cell, &Law::stress_by_parameters)?;
                let product = |f: &Vec<Vec3>| -f.iter().zip(&adjoint).map(|(f, a)| f.dot(a)).sum::<f64>();
                Ok(forces.iter().map(product).collect())
            })
            .collect()
    }

    /// Derivatives of what sensors read at the equilibrium `u`, `(nodes)` \[mm\]: with respect to each number of the law of
    /// `cell` by which `slopes` differentiates its stress at fixed strain ([`Law::stress_by_parameters`] for its parameters), then
    /// to a multiple of each of the `loads`, `(components × (numbers + loads))`. A component is one
    /// direction of one sensor, in order. One solve a column or one a row, whichever is less.
    ///
    /// # Errors
    /// [`SensitivityError`]: a limit point, no such cell.
    pub fn reading_derivatives(
        &mut self,
        u: &[Vec3],
        materials: &Materials,
        cell: usize,
        slopes: &Slopes,
        loads: &[&[Vec3]],
        sensors: &[(Sensor, Vec<Vec3>)],
    ) -> Result<DMatrix<f64>, SensitivityError> {
        let mut forces = self.force_derivatives(u, materials, cell, slopes)?;
        forces.iter_mut().flatten().for_each(|f| *f = -*f);
        forces.extend(loads.iter().map(|load| load.to_vec()));
        self.readings_by_forces(u, materials, &forces, sensors, READING_TOLERANCE)
    }

    /// How far the readings of sensors go along K⁻¹ f for each of the nodal `forces` f, `(forces × nodes)` \[N per unit\], at the
    /// equilibrium `u`, `(nodes)` \[mm\]: `(components × forces)`. A component is one direction of one sensor, in order. One
    /// solve a force or one a component, whichever is less, to a residual of `tolerance`.
    ///
    /// # Errors
    /// [`SensitivityError`]: a limit point.
    pub(super) fn readings_by_forces(
        &mut self,
        u: &[Vec3],
        materials: &Materials,
        forces: &[Vec<Vec3>],
        sensors: &[(Sensor, Vec<Vec3>)],
        tolerance: f64,
    ) -> Result<DMatrix<f64>, SensitivityError> {
        self.tangent_at(u, materials)?;
        let rows: usize = sensors.iter().map(|(_, directions)| directions.len()).sum();
        let mut derivatives = DMatrix::zeros(rows, forces.len());
        let mut right = vec![0.0; self.model.unknowns()];
        let mut field = vec![Vec3::zeros(); u.len()];
        let components = || {
            sensors
                .iter()
                .flat_map(|(sensor, directions)| directions.iter().map(move |d| (sensor, d)))
        };
        if forces.len() <= rows {
            for (column, force) in forces.iter().enumerate() {
                self.model.gather(force, &mut right);
                self.solve_tangent(&mut right, Side::Plain, tolerance)
                    .ok_or(SensitivityError::Unstable)?;
                self.model.spread(&right, &mut field);
                for (row, (sensor, direction)) in components().enumerate() {
                    derivatives[(row, column)] = sensor.read(&field).dot(direction);
                }
            }
        } else {
            for (row, (sensor, direction)) in components().enumerate() {
                field.fill(Vec3::zeros());
                sensor
                    .weights
                    .iter()
                    .for_each(|&(n, w)| field[n] += direction * w);
                self.model.gather(&field, &mut right);
                self.solve_tangent(&mut right, Side::Transposed, tolerance)
                    .ok_or(SensitivityError::Unstable)?;
                // A held component does not move: the adjoint is zero there.
                field.fill(Vec3::zeros());
                self.model.spread(&right, &mut field);
                for (column, force) in forces.iter().enumerate() {
                    derivatives[(row, column)] = force.iter().zip(&field).map(|(f, a)| f.dot(a)).sum();
                }
            }
        }
        Ok(derivatives)
    }

    pub(super) fn tangent_at(&mut self, u: &[Vec3], materials: &Materials) -> Result<(), SensitivityError> {
        if self.factorise_tangent(u, materials) {
            // Newton makes up for what an iterative solver leaves; here nothing would.
            self.newton.iter_mut().for_each(|n| n.set_tolerance(TOLERANCE));
            Ok(())
        } else {
            Err(SensitivityError::Unstable)
        }
    }

    /// ∂f_int/∂p at fixed `u`, `(parameters × nodes)`.
    pub(super) fn force_derivatives(
        &self,
        u: &[Vec3],
        materials: &Materials,
        cell: usize,
        slopes: &Slopes,
    ) -> Result<Vec<Vec<Vec3>>, SensitivityError> {
        let cells = materials.laws.len();
        let law = materials
            .laws
            .get(cell)
            .ok_or(SensitivityError::NoSuchCell { cell, cells })?;
        let mut forces = vec![vec![Vec3::zeros(); u.len()]; slopes(law, &Mandel::zeros()).len()];
        match &self.model.parts {
            Discretisation::Eight(block) => add_derivatives(block, u, materials, cell, slopes, &mut forces),
            Discretisation::Four(block) => add_derivatives(block, u, materials, cell, slopes, &mut forces),
        }
        Ok(forces)
    }
}

fn add_derivatives<const N: usize>(
    block: &Block<N>,
    u: &[Vec3],
    materials: &Materials,
    cell: usize,
    slopes: &Slopes,
    forces: &mut [Vec<Vec3>],
) {
    let belongs = |q: u32| {
        materials
            .cell_of_point
            .get(q as usize)
            .is_some_and(|&c| c as usize == cell)
    };
    for batch in &block.batches {
        if !batch.points.iter().any(|&q| belongs(q)) {
            continue;
        }
        let f = forces::deformation_gradients(block, batch, u);
        let laws = forces::laws_of(batch, materials);
        let mut states = response::strained(&f, &batch.weight, &laws, block.volumetric);
        let by_parameter: Vec<Vec<Mandel>> = (0..BATCH)
            .map(|l| match belongs(batch.points[l]) && batch.weight[l] > 0.0 {
                true => slopes(laws.at(l), &states[l].strain),
                false => vec![Mandel::zeros(); forces.len()],
            })
            .collect();
        for (p, force) in forces.iter_mut().enumerate() {
            let stresses = std::array::from_fn(|l| by_parameter[l][p]);
            response::put_stress(&mut states, &batch.weight, &laws, block.volumetric, &stresses);
            let mut piola = [[ZERO; 3]; 3];
            for (l, state) in states.iter().enumerate() {
                let weighted = state.piola() * batch.weight[l];
                for (i, row) in piola.iter_mut().enumerate() {
                    for (j, entry) in row.iter_mut().enumerate() {
                        entry[l] = weighted[(i, j)];
                    }
                }
            }
            forces::add_nodal_forces(block, batch, &piola, force);
        }
    }
}
