//! Sparse Cholesky factorisation, `A = L Lᵀ`: the symbolic part once, the numeric part as often as values change.
//!
//! faer's supernodal factorisation on one thread. The unknowns are expected in a fill-reducing order already (see
//! [`super::ordering`]), so nothing is permuted between the assembled matrix and the factor. One thread, because the
//! result's bits must not depend on the number of threads, and because below some 20 000 unknowns a second thread
//! inside a factorisation costs more than it gives; parallelism belongs outside, over designs.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use std::sync::Arc;

/// What can go wrong in a factorisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CholeskyError {
    /// A pivot was not positive: the matrix has no Cholesky factor.
    #[error("the matrix is not positive definite (pivot of unknown {unknown})")]
    NotPositiveDefinite {
        /// The unknown whose pivot failed.
        unknown: usize,
    },
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

/// The symbolic factorisation of one pattern, shared by all its numeric ones.
#[derive(Debug)]
pub struct Symbolic {
    pattern: Pattern,
    symbolic: SymbolicCholesky<usize>,
}

impl Symbolic {
    /// Analyses `pattern`.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`].
    pub fn new(pattern: Pattern) -> Result<Symbolic, CholeskyError> {
        let n = pattern.unknowns();
        // Without a permutation faer reads the upper triangle here, and the lower one in the numeric step.
        let upper = pattern.transposed();
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let matrix = SymbolicSparseColMatRef::new_checked(n, n, &upper.columns, None, &upper.rows);
        let symbolic = factorize_symbolic_cholesky(matrix, Side::Upper, SymmetricOrdering::Identity, params)
            .map_err(|_| CholeskyError::OutOfMemory { unknowns: n })?;
        Ok(Symbolic { pattern, symbolic })
    }

    /// The pattern that was analysed.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// Number of entries of the factor L, explicit zeros of the supernodes counted.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }
}

/// A numeric factorisation and the memory that it works in; make one a thread and reuse it.
pub struct Cholesky {
    symbolic: Arc<Symbolic>,
    values: Vec<f64>,
    memory: MemBuffer,
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
        let numeric = symbolic
            .symbolic
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let solve = symbolic.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        let memory = MemBuffer::try_new(numeric.or(solve)).map_err(|_| out_of_memory)?;
        let mut values = Vec::new();
        values
            .try_reserve_exact(symbolic.factor_entries())
            .map_err(|_| out_of_memory)?;
        values.resize(symbolic.factor_entries(), 0.0);
        Ok(Cholesky {
            symbolic,
            values,
            memory,
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
        let outcome = self.symbolic.symbolic.factorize_numeric_llt(
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
        if !self.is_factored {
            right_hand_side.fill(f64::NAN);
            return;
        }
        let n = right_hand_side.len();
        let factor = LltRef::<usize, f64>::new(&self.symbolic.symbolic, &self.values);
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
}
