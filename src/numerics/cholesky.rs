//! Sparse Cholesky factorisation, `A = L Lᵀ`: the symbolic part once, the numeric part as often as values change.
//!
//! faer's supernodal factorisation on one thread. The unknowns are expected in a fill-reducing order already (see
//! [`super::ordering`]), so nothing is permuted between the assembled matrix and the factor. One thread, because the
//! result's bits must not depend on the number of threads, and because below some 20 000 unknowns a second thread
//! inside a factorisation costs more than it gives; parallelism belongs outside, over designs.

use super::blocks::Sites;
use super::multigrid::Hierarchy;
use super::supernodal;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use std::sync::{Arc, OnceLock};

/// What can go wrong in a factorisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CholeskyError {
    /// A pivot was not positive: the matrix has no Cholesky factor.
    #[error("the matrix is not positive definite (pivot of unknown {unknown})")]
    NotPositiveDefinite {
        /// The unknown whose pivot failed.
        unknown: usize,
    },
    /// An iterative solver has to know where the unknowns act.
    #[error("an iterative solver needs the positions of the unknowns")]
    NoSites,
    /// The factor does not fit in memory.
    #[error("the factor of {unknowns} unknowns does not fit in memory: use larger elements")]
    OutOfMemory {
        /// Size of the matrix.
        unknowns: usize,
    },
}

/// The pattern of the lower triangle of a symmetric matrix, compressed by columns with ascending rows; the diagonal is
/// present in every column.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Start of each column in `rows`, `(n + 1)`.
    pub columns: Vec<usize>,
    /// Row of each entry, `(nnz)`.
    pub rows: Vec<usize>,
}

impl Pattern {
    /// Number of unknowns n.
    pub fn unknowns(&self) -> usize {
        self.columns.len() - 1
    }

    /// Place of the entry `(row, column)` with `row ≥ column` among the values, if the pattern holds it.
    pub fn find(&self, row: usize, column: usize) -> Option<usize> {
        let (start, end) = (self.columns[column], self.columns[column + 1]);
        self.rows[start..end].binary_search(&row).ok().map(|k| start + k)
    }

    /// The column that the value at `place` belongs to.
    pub fn column_of(&self, place: usize) -> usize {
        self.columns.partition_point(|&start| start <= place) - 1
    }

    fn transposed(&self) -> Pattern {
        let n = self.unknowns();
        let mut columns = vec![0; n + 1];
        for &row in &self.rows {
            columns[row + 1] += 1;
        }
        for i in 0..n {
            columns[i + 1] += columns[i];
        }
        let mut free = columns.clone();
        let mut rows = vec![0; self.rows.len()];
        for column in 0..n {
            for &row in &self.rows[self.columns[column]..self.columns[column + 1]] {
                rows[free[row]] = column;
                free[row] += 1;
            }
        }
        Pattern { columns, rows }
    }
}

/// How systems on a pattern are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// A Cholesky factor.
    Direct,
    /// Conjugate gradients with multigrid, see [`super::linear_solver`].
    Iterative,
}

/// From this many unknowns on, systems whose sites are known are solved iteratively: a factor of 130 000 unknowns in
/// three dimensions takes 1 GiB and as long as a dozen iterative solves, and both grow faster than the mesh.
const ITERATIVE_FROM: usize = 130_000;

/// The symbolic factorisation of one pattern, shared by all its numeric ones; for large systems what an iterative solver
/// knows before it has seen a matrix. Either is made when it is first wanted.
#[derive(Debug)]
pub struct Symbolic {
    pattern: Pattern,
    sites: Option<Sites>,
    method: Method,
    factor: OnceLock<Option<SymbolicCholesky<usize>>>,
    hierarchy: OnceLock<Result<Arc<Hierarchy>, CholeskyError>>,
}

impl Symbolic {
    /// For factorisations on `pattern`.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`].
    pub fn new(pattern: Pattern) -> Result<Symbolic, CholeskyError> {
        Symbolic::by(Method::Direct, pattern, None)
    }

    /// For systems whose unknowns act at `sites`, by factorisation or iteration as the size demands.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`].
    pub fn with_sites(pattern: Pattern, sites: Sites) -> Result<Symbolic, CholeskyError> {
        let method = if pattern.unknowns() < ITERATIVE_FROM {
            Method::Direct
        } else {
            Method::Iterative
        };
        Symbolic::by(method, pattern, Some(sites))
    }

    /// For systems solved by `method`, whatever their size.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`]; [`CholeskyError::NoSites`] for an iterative method without sites.
    pub fn by(method: Method, pattern: Pattern, sites: Option<Sites>) -> Result<Symbolic, CholeskyError> {
        let symbolic = Symbolic {
            pattern,
            sites,
            method,
            factor: OnceLock::new(),
            hierarchy: OnceLock::new(),
        };
        match method {
            Method::Direct => symbolic.factor().map(|_| ())?,
            Method::Iterative => symbolic.hierarchy().map(|_| ())?,
        }
        Ok(symbolic)
    }

    /// How systems on the pattern are solved.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Where the unknowns act, if that was said.
    pub fn sites(&self) -> Option<&Sites> {
        self.sites.as_ref()
    }

    fn factor(&self) -> Result<&SymbolicCholesky<usize>, CholeskyError> {
        let factor = self.factor.get_or_init(|| analysed(&self.pattern));
        factor.as_ref().ok_or(CholeskyError::OutOfMemory {
            unknowns: self.pattern.unknowns(),
        })
    }

    /// The lattices of the multigrid method.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`]; [`CholeskyError::NoSites`].
    pub fn hierarchy(&self) -> Result<Arc<Hierarchy>, CholeskyError> {
        let sites = self.sites.as_ref().ok_or(CholeskyError::NoSites)?;
        self.hierarchy
            .get_or_init(|| Hierarchy::new(&self.pattern, sites).map(Arc::new))
            .clone()
    }

    /// The pattern that was analysed.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// Number of entries of the factor L, explicit zeros of the supernodes counted; analyses the pattern if that was not
    /// yet done.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`].
    pub fn factor_entries(&self) -> Result<usize, CholeskyError> {
        Ok(self.factor()?.len_val())
    }
}

fn analysed(pattern: &Pattern) -> Option<SymbolicCholesky<usize>> {
    let n = pattern.unknowns();
    // Without a permutation faer reads the upper triangle here, and the lower one in the numeric step.
    let upper = pattern.transposed();
    let params = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        ..Default::default()
    };
    let matrix = SymbolicSparseColMatRef::new_checked(n, n, &upper.columns, None, &upper.rows);
    factorize_symbolic_cholesky(matrix, Side::Upper, SymmetricOrdering::Identity, params).ok()
}

/// A numeric factorisation and the memory that it works in; make one a thread and reuse it.
pub struct Cholesky {
    symbolic: Arc<Symbolic>,
    values: Vec<f64>,
    memory: MemBuffer,
    room: Vec<f64>,
    is_factored: bool,
}

impl std::fmt::Debug for Cholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Cholesky")
            .field("unknowns", &self.symbolic.pattern.unknowns())
            .finish_non_exhaustive()
    }
}

impl Cholesky {
    /// Memory for factorisations with the pattern of `symbolic`.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`].
    pub fn new(symbolic: Arc<Symbolic>) -> Result<Cholesky, CholeskyError> {
        let out_of_memory = CholeskyError::OutOfMemory {
            unknowns: symbolic.pattern.unknowns(),
        };
        let factor = symbolic.factor()?;
        let numeric = factor.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let solve = factor.solve_in_place_scratch::<f64>(1, Par::Seq);
        let memory = MemBuffer::try_new(numeric.or(solve)).map_err(|_| out_of_memory)?;
        let mut values = Vec::new();
        values
            .try_reserve_exact(factor.len_val())
            .map_err(|_| out_of_memory)?;
        values.resize(factor.len_val(), 0.0);
        Ok(Cholesky {
            symbolic,
            values,
            memory,
            room: Vec::new(),
            is_factored: false,
        })
    }

    /// Factorises the matrix whose lower triangle has the `values`, `(nnz)`, on the pattern.
    ///
    /// # Errors
    /// [`CholeskyError::NotPositiveDefinite`]; the factor is then unusable until the next success.
    pub fn factorise(&mut self, values: &[f64]) -> Result<(), CholeskyError> {
        let n = self.symbolic.pattern.unknowns();
        self.is_factored = false;
        if n == 0 {
            return Ok(());
        }
        let pattern = &self.symbolic.pattern;
        let structure = SymbolicSparseColMatRef::new_checked(n, n, &pattern.columns, None, &pattern.rows);
        let matrix = SparseColMatRef::new(structure, values);
        let outcome = self.symbolic.factor()?.factorize_numeric_llt(
            &mut self.values,
            matrix,
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.memory),
            Spec::default(),
        );
        match outcome {
            Ok(_) => {
                self.is_factored = true;
                Ok(())
            }
            Err(LltError::NonPositivePivot { index }) => {
                Err(CholeskyError::NotPositiveDefinite { unknown: index })
            }
        }
    }

    /// Is there a factor to solve with?
    pub fn is_factored(&self) -> bool {
        self.is_factored
    }

    /// Solves `A x = b` in place, `(n)`. Without a factor the right-hand side turns to NaN.
    pub fn solve(&mut self, right_hand_side: &mut [f64]) {
        if right_hand_side.is_empty() {
            return;
        }
        let (Ok(symbolic), true) = (self.symbolic.factor(), self.is_factored) else {
            right_hand_side.fill(f64::NAN);
            return;
        };
        if let SymbolicCholeskyRaw::Supernodal(panels) = symbolic.raw() {
            supernodal::solve(panels, &self.values, right_hand_side, &mut self.room);
            return;
        }
        let n = right_hand_side.len();
        let factor = LltRef::<usize, f64>::new(symbolic, &self.values);
        let rhs = MatMut::from_column_major_slice_mut(right_hand_side, n, 1);
        factor.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut self.memory));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The one-dimensional Laplacian with fixed ends, 2 on and −1 beside the diagonal.
    fn laplacian(n: usize) -> (Pattern, Vec<f64>) {
        let (mut columns, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for j in 0..n {
            rows.push(j);
            values.push(2.0);
            if j + 1 < n {
                rows.push(j + 1);
                values.push(-1.0);
            }
            columns.push(rows.len());
        }
        (Pattern { columns, rows }, values)
    }

    #[test]
    fn solves_the_laplacian_exactly() {
        let n = 200;
        let (pattern, values) = laplacian(n);
        let mut factor = Cholesky::new(Arc::new(Symbolic::new(pattern).unwrap())).unwrap();
        factor.factorise(&values).unwrap();
        let mut x = vec![1.0; n];
        factor.solve(&mut x);
        for (i, x) in x.iter().enumerate() {
            // −u'' = 1 on unit spacing with zero ends: u = i (n + 1 − i) / 2.
            let exact = (i + 1) as f64 * (n - i) as f64 / 2.0;
            assert!((x - exact).abs() < 1e-9 * exact, "{x} at {i} is not {exact}");
        }
    }

    #[test]
    fn an_indefinite_matrix_is_said_and_the_memory_stays_usable() {
        let (pattern, mut values) = laplacian(20);
        let mut factor = Cholesky::new(Arc::new(Symbolic::new(pattern).unwrap())).unwrap();
        let good = values.clone();
        values[10] = -5.0;
        assert!(matches!(
            factor.factorise(&values),
            Err(CholeskyError::NotPositiveDefinite { .. })
        ));
        let mut x = vec![1.0; 20];
        factor.solve(&mut x);
        assert!(x[0].is_nan());
        factor.factorise(&good).unwrap();
        let mut x = vec![1.0; 20];
        factor.solve(&mut x);
        assert!((x[0] - 10.0).abs() < 1e-12);
    }

    #[test]
    fn an_iterative_method_without_sites_is_refused() {
        let (pattern, _) = laplacian(5);
        let refused = Symbolic::by(Method::Iterative, pattern, None);
        assert_eq!(refused.unwrap_err(), CholeskyError::NoSites);
    }
}
