//! One face for both ways to solve `A x = b`: a Cholesky factor for small and middle systems, conjugate gradients with a
//! multigrid cycle for large ones. [`super::cholesky::Symbolic`] has chosen by size.

use super::cholesky::{Cholesky, CholeskyError, Method, Symbolic};
use super::conjugate_gradients::{self, Ended, Outcome, Room};
use super::multigrid::Multigrid;
use crate::math::Vec3;
use std::sync::Arc;

/// Iterations after which conjugate gradients give up; ordinary systems take 10 to 60.
const MOST_ITERATIONS: usize = 600;

/// A solver for matrices on one pattern, and the memory that it works in; make one a thread and reuse it.
#[derive(Debug)]
pub enum LinearSolver {
    /// A factor of the matrix.
    Direct(Cholesky),
    /// Conjugate gradients.
    Iterative(Box<Iterative>),
}

/// Counts of a solver's work since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct LinearWork {
    /// Matrices that were taken by [`LinearSolver::factorise`].
    pub factorisations: usize,
    /// Right-hand sides solved for.
    pub solves: usize,
    /// Conjugate gradient iterations of all solves.
    pub iterations: usize,
}

/// The iterative solver's parts.
#[derive(Debug)]
pub struct Iterative {
    symbolic: Arc<Symbolic>,
    multigrid: Multigrid,
    is_ready: bool,
    /// Residual at which a solve ends, as a share of the right-hand side. Default 1e-8.
    pub tolerance: f64,
    work: LinearWork,
    last: Option<Outcome>,
    b: Vec<Vec3>,
    x: Vec<Vec3>,
    room: Room,
}

impl LinearSolver {
    /// Memory for matrices with the pattern of `symbolic`, by the method that it chose.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`].
    pub fn new(symbolic: Arc<Symbolic>) -> Result<LinearSolver, CholeskyError> {
        match symbolic.method() {
            Method::Direct => Ok(LinearSolver::Direct(Cholesky::new(symbolic)?)),
            Method::Iterative => Ok(LinearSolver::Iterative(Box::new(Iterative::new(symbolic)?))),
        }
    }

    /// Takes the matrix whose lower triangle has the `values`, `(nnz)`, on the pattern.
    ///
    /// # Errors
    /// [`CholeskyError::NotPositiveDefinite`]. An iterative solver can find this later, in a solve.
    pub fn factorise(&mut self, values: &[f64]) -> Result<(), CholeskyError> {
        match self {
            LinearSolver::Direct(cholesky) => cholesky.factorise(values),
            LinearSolver::Iterative(iterative) => iterative.factorise(values),
        }
    }

    /// Is there a matrix to solve with?
    pub fn is_factored(&self) -> bool {
        match self {
            LinearSolver::Direct(cholesky) => cholesky.is_factored(),
            LinearSolver::Iterative(iterative) => iterative.is_ready,
        }
    }

    /// Solves `A x = b` in place, `(n)`. Without a matrix, or where the iteration finds that the matrix is not positive
    /// definite, the right-hand side turns to NaN. Where it stalls, the best answer so far is left: see
    /// [`LinearSolver::last`].
    pub fn solve(&mut self, right_hand_side: &mut [f64]) {
        match self {
            LinearSolver::Direct(cholesky) => cholesky.solve(right_hand_side),
            LinearSolver::Iterative(iterative) => iterative.solve(right_hand_side),
        }
    }

    /// Sets the residual, as a share of the right-hand side, at which iterative solves end; a factor has no use for it.
    pub fn set_tolerance(&mut self, tolerance: f64) {
        if let LinearSolver::Iterative(iterative) = self {
            iterative.tolerance = tolerance;
        }
    }

    /// How the last iterative solve ended.
    pub fn last(&self) -> Option<Outcome> {
        match self {
            LinearSolver::Direct(_) => None,
            LinearSolver::Iterative(iterative) => iterative.last,
        }
    }

    /// Work done so far by an iterative solver; a factor does not count.
    pub fn work(&self) -> LinearWork {
        match self {
            LinearSolver::Direct(_) => LinearWork::default(),
            LinearSolver::Iterative(iterative) => iterative.work,
        }
    }
}

impl Iterative {
    fn new(symbolic: Arc<Symbolic>) -> Result<Iterative, CholeskyError> {
        let hierarchy = symbolic.hierarchy()?;
        let n = symbolic.sites().map_or(0, |s| s.positions.len());
        Ok(Iterative {
            multigrid: Multigrid::new(hierarchy)?,
            symbolic,
            is_ready: false,
            tolerance: 1e-8,
            work: LinearWork::default(),
            last: None,
            b: vec![Vec3::zeros(); n],
            x: vec![Vec3::zeros(); n],
            room: Room::default(),
        })
    }

    fn factorise(&mut self, values: &[f64]) -> Result<(), CholeskyError> {
        self.is_ready = false;
        self.work.factorisations += 1;
        if let Some(unknown) = values.iter().position(|v| !v.is_finite()) {
            return Err(CholeskyError::NotPositiveDefinite {
                unknown: self.symbolic.pattern().column_of(unknown),
            });
        }
        if let Some(sites) = self.symbolic.sites() {
            self.multigrid.factorise(self.symbolic.pattern(), sites, values)?;
            self.is_ready = true;
        }
        Ok(())
    }

    fn solve(&mut self, right_hand_side: &mut [f64]) {
        self.work.solves += 1;
        let symbolic = self.symbolic.clone();
        let (Some(sites), true) = (symbolic.sites(), self.is_ready) else {
            right_hand_side.fill(f64::NAN);
            return;
        };
        sites.spread(right_hand_side, &mut self.b);
        let outcome = conjugate_gradients::solve(
            &mut self.multigrid,
            &self.b,
            &mut self.x,
            self.tolerance,
            MOST_ITERATIONS,
            &mut self.room,
        );
        self.work.iterations += outcome.iterations;
        self.last = Some(outcome);
        if outcome.ended == Ended::Indefinite {
            right_hand_side.fill(f64::NAN);
        } else {
            sites.gather(&self.x, right_hand_side);
        }
    }
}
