//! Multigrid for large displacement problems on any mesh: one cycle approximates `A⁻¹` at a cost in proportion to the
//! number of unknowns.
//!
//! ```text
//! x ← S(0, b);   x ← x + P A_c⁻¹ Pᵀ (b − A x);   x ← Sᵀ(x, b);     A_c = Pᵀ A P
//! ```
//!
//! S is a Gauss–Seidel sweep over the sites' 3 × 3 blocks in one order of colours, Sᵀ the same in the opposite order, so
//! a cycle, a W-cycle of these steps, is a symmetric positive definite operator and may precondition conjugate gradients
//! ([`super::conjugate_gradients`]). P interpolates from lattices laid over the object ([`super::transfer`]); the
//! coarsest one is solved by [`super::cholesky`]. The matrices of the lattices follow from A alone (Galerkin), so
//! contrast between materials, partly filled elements, held components and large deformations need no other treatment.
//!
//! Held components are zero rows of the block matrix and stay out of everything. Stiffness in N/mm, positions in mm.
//! Iterations do not grow with the mesh; they do grow towards ν = ½, where displacements with div u = 0, which the
//! sweeps cannot see, decide. Sources: Brandt 1977; Hackbusch 1985; Trottenberg, Oosterlee and Schüller 2001.

use super::blocks::{Block, BlockMatrix, BlockPattern, Sites};
use super::cholesky::{Cholesky, CholeskyError, Pattern, Symbolic};
use super::ordering::nested_dissection;
use super::transfer::{Lattice, Transfer};
use crate::math::Vec3;
use std::sync::Arc;

/// A lattice of at most this many points is solved directly: one solve then costs less than a cycle above it.
const COARSEST: usize = 700;
/// A lattice that leaves more than this share of the sites is not worth its level.
const LEAST_GAIN: f64 = 0.7;
/// Gauss–Seidel sweeps before and after each coarse correction. One does as well where stiffness is even; with a contrast
/// of 100, two need half as many iterations.
const SWEEPS: usize = 2;
/// How often a cycle visits each level below the finest (a W-cycle). They cost little, and with contrast a fifth of the
/// iterations goes.
const VISITS: usize = 2;

/// What depends on the pattern and the positions alone; shared by all matrices on it.
#[derive(Debug)]
pub struct Hierarchy {
    levels: Vec<Level>,
    coarsest: Arc<Symbolic>,
}

#[derive(Debug)]
struct Level {
    pattern: BlockPattern,
    colours: Colours,
    /// To the next level; the last has none.
    transfer: Option<Transfer>,
}

/// Rows by colour: rows of one colour do not touch each other.
#[derive(Debug)]
struct Colours {
    starts: Vec<usize>,
    rows: Vec<u32>,
}

impl Colours {
    fn new(pattern: &BlockPattern) -> Colours {
        let mut colour = vec![u32::MAX; pattern.sites()];
        let mut taken_by: Vec<u32> = Vec::new();
        for i in 0..pattern.sites() {
            for &j in pattern.row(i) {
                if let Some(taken) = taken_by.get_mut(colour[j as usize] as usize) {
                    *taken = i as u32;
                }
            }
            let free = taken_by.iter().position(|&by| by != i as u32);
            let own = free.unwrap_or_else(|| {
                taken_by.push(u32::MAX);
                taken_by.len() - 1
            });
            colour[i] = own as u32;
        }
        let mut starts = vec![0; taken_by.len() + 1];
        for &c in &colour {
            starts[c as usize + 1] += 1;
        }
        for c in 0..taken_by.len() {
            starts[c + 1] += starts[c];
        }
        let mut free = starts.clone();
        let mut rows = vec![0; colour.len()];
        for (i, &c) in colour.iter().enumerate() {
            rows[free[c as usize]] = i as u32;
            free[c as usize] += 1;
        }
        Colours { starts, rows }
    }

    fn count(&self) -> usize {
        self.starts.len() - 1
    }

    fn rows(&self, colour: usize) -> &[u32] {
        &self.rows[self.starts[colour]..self.starts[colour + 1]]
    }
}

impl Hierarchy {
    /// Lays lattices over the sites until one is small enough to solve directly.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`] if even the coarsest lattice is too large.
    pub fn new(pattern: &Pattern, sites: &Sites) -> Result<Hierarchy, CholeskyError> {
        let mut pattern = BlockPattern::new(pattern, sites);
        let mut positions = sites.positions.clone();
        let mut lattice = Lattice::over(&positions, &pattern);
        let mut levels = Vec::new();
        while pattern.sites() > COARSEST {
            let Some(next) = lattice.coarsened() else { break };
            lattice = next;
            let mut transfer = Transfer::new(&positions, &lattice);
            if transfer.coarse_sites() as f64 > LEAST_GAIN * pattern.sites() as f64 {
                continue;
            }
            let mut coarse = transfer.coarse_pattern(&pattern);
            if transfer.coarse_sites() <= COARSEST {
                let neighbours: Vec<Vec<u32>> = (0..coarse.sites())
                    .map(|i| {
                        coarse
                            .row(i)
                            .iter()
                            .copied()
                            .filter(|&j| j as usize != i)
                            .collect()
                    })
                    .collect();
                let order = nested_dissection(&transfer.positions, &neighbours);
                transfer = transfer.renumbered(&order);
                coarse = transfer.coarse_pattern(&pattern);
            }
            positions.clone_from(&transfer.positions);
            levels.push(Level {
                colours: Colours::new(&pattern),
                pattern,
                transfer: Some(transfer),
            });
            pattern = coarse;
        }
        let coarsest = Arc::new(Symbolic::new(lower_triangle(&pattern))?);
        levels.push(Level {
            colours: Colours {
                starts: vec![0],
                rows: Vec::new(),
            },
            pattern,
            transfer: None,
        });
        Ok(Hierarchy { levels, coarsest })
    }

    /// Sites on each level, the finest first.
    pub fn sites(&self) -> Vec<usize> {
        self.levels.iter().map(|l| l.pattern.sites()).collect()
    }

    /// Blocks of all levels over those of the finest.
    pub fn operator_complexity(&self) -> f64 {
        let blocks = |l: &Level| l.pattern.columns.len() as f64;
        self.levels.iter().map(blocks).sum::<f64>() / blocks(&self.levels[0])
    }
}

/// All components of all sites as single unknowns.
fn lower_triangle(blocks: &BlockPattern) -> Pattern {
    let (mut columns, mut rows) = (vec![0], Vec::new());
    for i in 0..blocks.sites() {
        for c in 0..3 {
            for &j in &blocks.columns[blocks.diagonal[i]..blocks.starts[i + 1]] {
                let from = if j as usize == i { c } else { 0 };
                rows.extend((from..3).map(|r| 3 * j as usize + r));
            }
            columns.push(rows.len());
        }
    }
    Pattern { columns, rows }
}

/// Values of [`lower_triangle`]; the diagonal grows by the share `shift`, and is 1 where a component is held.
fn lower_values(matrix: &BlockMatrix, shift: f64, out: &mut Vec<f64>) {
    let pattern = matrix.pattern;
    out.clear();
    for i in 0..pattern.sites() {
        for c in 0..3 {
            for place in pattern.diagonal[i]..pattern.starts[i + 1] {
                let from = if place == pattern.diagonal[i] { c } else { 0 };
                let first = out.len();
                out.extend((from..3).map(|r| matrix.values[place][3 * c + r]));
                if place == pattern.diagonal[i] {
                    out[first] = if out[first] == 0.0 {
                        1.0
                    } else {
                        out[first] * (1.0 + shift)
                    };
                }
            }
        }
    }
}

/// One level's numbers and room for a cycle.
#[derive(Debug, Default)]
struct Numbers {
    values: Vec<Block>,
    inverses: Vec<Block>,
    right_hand_side: Vec<Vec3>,
    solution: Vec<Vec3>,
    residual: Vec<Vec3>,
}

/// The multigrid operator of one matrix and the memory that it works in.
#[derive(Debug)]
pub struct Multigrid {
    hierarchy: Arc<Hierarchy>,
    levels: Vec<Numbers>,
    coarsest: Cholesky,
    coarsest_values: Vec<f64>,
    flat: Vec<f64>,
    fresh: Vec<Vec3>,
}

impl Multigrid {
    /// Memory for matrices on the pattern of `hierarchy`.
    ///
    /// # Errors
    /// [`CholeskyError::OutOfMemory`].
    pub fn new(hierarchy: Arc<Hierarchy>) -> Result<Multigrid, CholeskyError> {
        let out_of_memory = CholeskyError::OutOfMemory {
            unknowns: 3 * hierarchy.levels[0].pattern.sites(),
        };
        let mut levels = Vec::new();
        for level in &hierarchy.levels {
            let n = level.pattern.sites();
            let mut values = Vec::new();
            values
                .try_reserve_exact(level.pattern.columns.len())
                .map_err(|_| out_of_memory)?;
            values.resize(level.pattern.columns.len(), [0.0; 9]);
            levels.push(Numbers {
                values,
                inverses: Vec::new(),
                right_hand_side: vec![Vec3::zeros(); n],
                solution: vec![Vec3::zeros(); n],
                residual: vec![Vec3::zeros(); n],
            });
        }
        let last = hierarchy.levels.last().map_or(0, |l| l.pattern.sites());
        Ok(Multigrid {
            coarsest: Cholesky::new(hierarchy.coarsest.clone())?,
            hierarchy,
            levels,
            coarsest_values: Vec::new(),
            flat: vec![0.0; 3 * last],
            fresh: Vec::new(),
        })
    }

    /// Takes the matrix whose lower triangle has `values` on `pattern`, and builds those of the lattices.
    ///
    /// # Errors
    /// [`CholeskyError::NotPositiveDefinite`] where a site's own block or the coarsest matrix shows it; an indefinite
    /// matrix can pass here, and conjugate gradients find it.
    pub fn factorise(
        &mut self,
        pattern: &Pattern,
        sites: &Sites,
        values: &[f64],
    ) -> Result<(), CholeskyError> {
        let hierarchy = self.hierarchy.clone();
        let shapes = &hierarchy.levels;
        shapes[0]
            .pattern
            .fill(pattern, sites, values, &mut self.levels[0].values);
        for (l, shape) in shapes.iter().enumerate() {
            let Some(transfer) = &shape.transfer else { break };
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let matrix = BlockMatrix {
                pattern: &shape.pattern,
                values: &fine[l].values,
            };
            transfer.coarse_values(&matrix, &shapes[l + 1].pattern, &mut coarse[0].values);
            fine[l].inverses = matrix.diagonal_inverses().map_err(|site| {
                // Coarse sites have no unknown of their own to name.
                let unknown = if l == 0 { first_unknown(sites, site) } else { 0 };
                CholeskyError::NotPositiveDefinite { unknown }
            })?;
        }
        let last = shapes.len() - 1;
        let matrix = BlockMatrix {
            pattern: &shapes[last].pattern,
            values: &self.levels[last].values,
        };
        // Lattice points that too few sites hang on depend on each other, and the coarsest matrix is then singular.
        let mut outcome = Ok(());
        for shift in [1e-11, 1e-8, 1e-5] {
            lower_values(&matrix, shift, &mut self.coarsest_values);
            outcome = self.coarsest.factorise(&self.coarsest_values);
            if outcome.is_ok() {
                break;
            }
        }
        outcome
    }

    /// The matrix on the finest level.
    pub fn matrix(&self) -> BlockMatrix<'_> {
        BlockMatrix {
            pattern: &self.hierarchy.levels[0].pattern,
            values: &self.levels[0].values,
        }
    }

    /// One cycle: `x ≈ A⁻¹ b`, both `(sites)`.
    pub fn cycle(&mut self, b: &[Vec3], x: &mut [Vec3]) {
        self.levels[0].right_hand_side.copy_from_slice(b);
        self.descend(0);
        x.copy_from_slice(&self.levels[0].solution);
    }

    fn descend(&mut self, l: usize) {
        let hierarchy = self.hierarchy.clone();
        let shape = &hierarchy.levels[l];
        let Some(transfer) = &shape.transfer else {
            self.solve_coarsest(l);
            return;
        };
        self.levels[l].solution.fill(Vec3::zeros());
        let visits = if l == 0 { 1 } else { VISITS };
        for _ in 0..visits {
            self.visit(l, shape, transfer);
        }
    }

    /// Smooths the solution on level `l`, corrects it from the next level, and smooths again the other way round.
    fn visit(&mut self, l: usize, shape: &Level, transfer: &Transfer) {
        for _ in 0..SWEEPS {
            for colour in 0..shape.colours.count() {
                self.relax(l, shape, colour);
            }
        }
        let (fine, coarse) = self.levels.split_at_mut(l + 1);
        let own = &mut fine[l];
        BlockMatrix {
            pattern: &shape.pattern,
            values: &own.values,
        }
        .residual(&own.right_hand_side, &own.solution, &mut own.residual);
        transfer.restrict(&own.residual, &mut coarse[0].right_hand_side);
        self.descend(l + 1);
        let (fine, coarse) = self.levels.split_at_mut(l + 1);
        transfer.prolong(&coarse[0].solution, &mut fine[l].solution);
        for _ in 0..SWEEPS {
            for colour in (0..shape.colours.count()).rev() {
                self.relax(l, shape, colour);
            }
        }
    }

    fn relax(&mut self, l: usize, shape: &Level, colour: usize) {
        let own = &mut self.levels[l];
        let matrix = BlockMatrix {
            pattern: &shape.pattern,
            values: &own.values,
        };
        let rows = shape.colours.rows(colour);
        matrix.relax_rows(
            rows,
            &own.inverses,
            &own.right_hand_side,
            &mut own.solution,
            &mut self.fresh,
        );
    }

    fn solve_coarsest(&mut self, l: usize) {
        let own = &mut self.levels[l];
        for (flat, b) in self.flat.chunks_exact_mut(3).zip(&own.right_hand_side) {
            flat.copy_from_slice(b.as_slice());
        }
        self.coarsest.solve(&mut self.flat);
        for (flat, x) in self.flat.chunks_exact(3).zip(&mut own.solution) {
            *x = Vec3::from_column_slice(flat);
        }
    }
}

fn first_unknown(sites: &Sites, site: usize) -> usize {
    sites.slots.partition_point(|&slot| (slot as usize / 3) < site)
}
