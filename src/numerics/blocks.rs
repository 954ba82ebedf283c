//! A symmetric sparse matrix in blocks of 3 × 3, one block row a site, both triangles stored by rows.
//!
//! A displacement problem couples sites (nodes), not single unknowns; a block costs one index for nine numbers, and a
//! smoother can invert a site's own block. A site with held components has zeros in their rows and columns.
//!
//! Every product works row by row, and rows are handed to threads in fixed chunks, so the bits of a result do not
//! depend on how many threads there are.

use super::cholesky::Pattern;
use crate::math::{Mat3, Vec3};
use rayon::prelude::*;

/// Rows that one task works on. Small enough to share a coarse level, large enough to hide a task's start.
pub(super) const CHUNK: usize = 512;
/// So few rows are done by the calling thread: handing them over and waiting costs more than they do.
const FEW: usize = 3000;

/// Where the unknowns of a matrix act.
#[derive(Clone, Debug, PartialEq)]
pub struct Sites {
    /// Positions, `(sites × 3)` \[mm\].
    pub positions: Vec<Vec3>,
    /// Three times the site plus the component of each unknown, strictly ascending, `(n)`.
    pub slots: Vec<u32>,
}

impl Sites {
    /// Spreads a vector over the unknowns, `(n)`, into one over all components of the sites, `(sites)`; held ones are 0.
    pub fn spread(&self, values: &[f64], out: &mut [Vec3]) {
        out.fill(Vec3::zeros());
        for (value, &slot) in values.iter().zip(&self.slots) {
            out[slot as usize / 3][slot as usize % 3] = *value;
        }
    }

    /// The reverse of [`Sites::spread`].
    pub fn gather(&self, field: &[Vec3], out: &mut [f64]) {
        for (value, &slot) in out.iter_mut().zip(&self.slots) {
            *value = field[slot as usize / 3][slot as usize % 3];
        }
    }
}

/// One 3 × 3 block, row-major.
pub type Block = [f64; 9];

/// Which blocks a matrix holds: both triangles, by rows, columns ascending, the diagonal always there.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockPattern {
    /// Start of each row in `columns`, `(sites + 1)`.
    pub starts: Vec<usize>,
    /// Column of each block.
    pub columns: Vec<u32>,
    /// Place of each row's diagonal block, `(sites)`.
    pub diagonal: Vec<usize>,
}

impl BlockPattern {
    /// The blocks behind a pattern of single unknowns.
    pub fn new(pattern: &Pattern, sites: &Sites) -> BlockPattern {
        let n = sites.positions.len();
        // Upper rows (columns of the lower triangle) first; the lower ones are their mirror.
        let mut upper: Vec<Vec<u32>> = (0..n).map(|i| vec![i as u32]).collect();
        for (column, slot) in sites.slots.iter().enumerate() {
            let row = &mut upper[*slot as usize / 3];
            let mut last = u32::MAX;
            for &r in &pattern.rows[pattern.columns[column]..pattern.columns[column + 1]] {
                let site = sites.slots[r] / 3;
                if site != last {
                    row.push(site);
                    last = site;
                }
            }
        }
        upper.par_iter_mut().for_each(|row| {
            row.sort_unstable();
            row.dedup();
        });
        let mut starts = vec![0; n + 1];
        for (i, row) in upper.iter().enumerate() {
            starts[i + 1] += row.len();
            for &j in &row[1..] {
                starts[j as usize + 1] += 1;
            }
        }
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut columns = vec![0; starts[n]];
        let mut free: Vec<usize> = starts[..n].to_vec();
        let mut diagonal = vec![0; n];
        for (i, row) in upper.iter().enumerate() {
            diagonal[i] = free[i];
            for &j in row {
                columns[free[i]] = j;
                free[i] += 1;
            }
            for &j in &row[1..] {
                columns[free[j as usize]] = i as u32;
                free[j as usize] += 1;
            }
        }
        BlockPattern {
            starts,
            columns,
            diagonal,
        }
    }

    /// From complete rows, columns ascending.
    pub fn from_rows(rows: &[Vec<u32>]) -> BlockPattern {
        let (mut starts, mut columns, mut diagonal) = (vec![0], Vec::new(), Vec::new());
        for (i, row) in rows.iter().enumerate() {
            let own = row.partition_point(|&j| (j as usize) < i);
            diagonal.push(columns.len() + own);
            columns.extend_from_slice(row);
            starts.push(columns.len());
        }
        BlockPattern {
            starts,
            columns,
            diagonal,
        }
    }

    /// Number of sites.
    pub fn sites(&self) -> usize {
        self.diagonal.len()
    }

    /// Columns of row `i`.
    #[inline]
    pub fn row(&self, i: usize) -> &[u32] {
        &self.columns[self.starts[i]..self.starts[i + 1]]
    }

    /// Splits the blocks of all rows into those of each chunk of rows.
    pub(super) fn chunks<'a>(&self, mut values: &'a mut [Block]) -> Vec<&'a mut [Block]> {
        let mut chunks = Vec::new();
        for first in (0..self.sites()).step_by(CHUNK) {
            let past = (first + CHUNK).min(self.sites());
            let (own, rest) = values.split_at_mut(self.starts[past] - self.starts[first]);
            chunks.push(own);
            values = rest;
        }
        chunks
    }

    /// The rows of chunk `k`.
    pub(super) fn rows_of_chunk(&self, k: usize) -> std::ops::Range<usize> {
        k * CHUNK..((k + 1) * CHUNK).min(self.sites())
    }

    /// Writes the matrix whose lower triangle has `values` on `pattern` into blocks.
    pub fn fill(&self, pattern: &Pattern, sites: &Sites, values: &[f64], blocks: &mut [Block]) {
        blocks.fill([0.0; 9]);
        let n = self.sites();
        // Rows are passed in ascending order, so a row's mirrored blocks come in ascending order too.
        let mut mirrored: Vec<usize> = self.starts[..n].to_vec();
        let mut column = 0;
        for i in 0..n {
            let first = column;
            while column < sites.slots.len() && sites.slots[column] as usize / 3 == i {
                column += 1;
            }
            let mut cursors = [0; 3];
            for (cursor, c) in cursors.iter_mut().zip(first..column) {
                *cursor = pattern.columns[c];
            }
            for place in self.diagonal[i]..self.starts[i + 1] {
                let site = self.columns[place];
                let mut block = [0.0; 9];
                for (cursor, c) in cursors.iter_mut().zip(first..column) {
                    let here = sites.slots[c] as usize % 3;
                    while *cursor < pattern.columns[c + 1] && sites.slots[pattern.rows[*cursor]] / 3 == site {
                        let there = sites.slots[pattern.rows[*cursor]] as usize % 3;
                        block[3 * here + there] = values[*cursor];
                        if site as usize == i {
                            block[3 * there + here] = values[*cursor];
                        }
                        *cursor += 1;
                    }
                }
                blocks[place] = block;
                if site as usize != i {
                    let at = &mut mirrored[site as usize];
                    blocks[*at] = transposed(&block);
                    *at += 1;
                }
            }
        }
    }
}

#[inline]
fn transposed(b: &Block) -> Block {
    [b[0], b[3], b[6], b[1], b[4], b[7], b[2], b[5], b[8]]
}

/// `sum += block · x`.
#[inline(always)]
fn add_product(block: &Block, x: &Vec3, sum: &mut [f64; 3]) {
    for r in 0..3 {
        sum[r] += block[3 * r] * x.x + block[3 * r + 1] * x.y + block[3 * r + 2] * x.z;
    }
}

/// A block matrix: where its blocks are, and what they hold.
#[derive(Clone, Copy, Debug)]
pub struct BlockMatrix<'a> {
    /// Which blocks.
    pub pattern: &'a BlockPattern,
    /// Their values, `(blocks)`.
    pub values: &'a [Block],
}

impl BlockMatrix<'_> {
    #[inline(always)]
    fn row_product(&self, i: usize, x: &[Vec3]) -> Vec3 {
        let range = self.pattern.starts[i]..self.pattern.starts[i + 1];
        let mut sum = [0.0; 3];
        for (block, &j) in self.values[range.clone()]
            .iter()
            .zip(&self.pattern.columns[range])
        {
            add_product(block, &x[j as usize], &mut sum);
        }
        Vec3::from(sum)
    }

    /// What site `i` moves to when its own equations are solved with all others as they are.
    #[inline(always)]
    fn relaxed(&self, i: usize, inverses: &[Block], b: &[Vec3], x: &[Vec3]) -> Vec3 {
        let left = b[i] - self.row_product(i, x);
        let mut step = [0.0; 3];
        add_product(&inverses[i], &left, &mut step);
        x[i] + Vec3::from(step)
    }

    /// `y = A x`, both `(sites)`.
    pub fn product(&self, x: &[Vec3], y: &mut [Vec3]) {
        in_chunks(y, |k, y| {
            for (i, y) in self.pattern.rows_of_chunk(k).zip(y) {
                *y = self.row_product(i, x);
            }
        });
    }

    /// `r = b − A x`, all `(sites)`.
    pub fn residual(&self, b: &[Vec3], x: &[Vec3], r: &mut [Vec3]) {
        in_chunks(r, |k, r| {
            for (i, r) in self.pattern.rows_of_chunk(k).zip(r) {
                *r = b[i] - self.row_product(i, x);
            }
        });
    }

    /// One Gauss–Seidel step on the `rows` of one colour, none of which touch each other: every row's own equations are
    /// solved exactly. `inverses` are those of the diagonal blocks; `fresh` is room for as many values.
    pub fn relax_rows(
        &self,
        rows: &[u32],
        inverses: &[Block],
        b: &[Vec3],
        x: &mut [Vec3],
        fresh: &mut Vec<Vec3>,
    ) {
        if rows.len() <= FEW {
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || {
                    for &i in rows {
                        x[i as usize] = self.relaxed(i as usize, inverses, b, x);
                    }
                },
            );
            return;
        }
        fresh.resize(rows.len(), Vec3::zeros());
        let old = &*x;
        fresh
            .par_chunks_mut(CHUNK)
            .zip(rows.par_chunks(CHUNK))
            .for_each(|(fresh, rows)| {
                pulp::Arch::new().dispatch(
                    #[inline(always)]
                    || {
                        for (fresh, &i) in fresh.iter_mut().zip(rows) {
                            *fresh = self.relaxed(i as usize, inverses, b, old);
                        }
                    },
                );
            });
        for (fresh, &i) in fresh.iter().zip(rows) {
            x[i as usize] = *fresh;
        }
    }

    /// Inverses of the diagonal blocks on the components that are not held, zero on the others, `(sites)`.
    ///
    /// # Errors
    /// The first site whose block is not positive definite.
    pub fn diagonal_inverses(&self) -> Result<Vec<Block>, usize> {
        let inverse = |(i, &place): (usize, &usize)| inverse(&self.values[place]).ok_or(i);
        self.pattern.diagonal.iter().enumerate().map(inverse).collect()
    }
}

/// The inverse on the components whose diagonal is not zero.
fn inverse(block: &Block) -> Option<Block> {
    // Components of a coarse site that few fine ones hang on can depend on each other: a little of its own diagonal
    // keeps the block invertible, whatever the scale of each.
    const SHIFT: f64 = 1e-9;
    let held = [0, 1, 2].map(|c| block[4 * c] == 0.0);
    let mut matrix = Mat3::from_row_slice(block);
    for c in 0..3 {
        matrix[(c, c)] = if held[c] {
            1.0
        } else {
            matrix[(c, c)] * (1.0 + SHIFT)
        };
    }
    let mut inverse = matrix.cholesky()?.inverse();
    for c in (0..3).filter(|&c| held[c]) {
        inverse[(c, c)] = 0.0;
    }
    // The inverse is symmetric: its columns are its rows.
    inverse.as_slice().try_into().ok()
}

/// Fills `out` by chunks of rows, side by side if there are many; `rows` is given the number of the chunk.
#[inline(always)]
pub(super) fn in_chunks(out: &mut [Vec3], rows: impl Fn(usize, &mut [Vec3]) + Sync) {
    let fill = |(k, out): (usize, &mut [Vec3])| {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || rows(k, out),
        );
    };
    if out.len() <= FEW {
        out.chunks_mut(CHUNK).enumerate().for_each(fill);
    } else {
        out.par_chunks_mut(CHUNK).enumerate().for_each(fill);
    }
}

/// `Σ a·b`, summed in fixed chunks.
pub fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    let partial: Vec<f64> = a
        .par_chunks(8 * CHUNK)
        .zip(b.par_chunks(8 * CHUNK))
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>())
        .collect();
    partial.iter().sum()
}

/// `y += factor x`.
pub fn add_scaled(y: &mut [Vec3], factor: f64, x: &[Vec3]) {
    y.par_chunks_mut(8 * CHUNK)
        .zip(x.par_chunks(8 * CHUNK))
        .for_each(|(y, x)| {
            for (y, x) in y.iter_mut().zip(x) {
                *y += x * factor;
            }
        });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five unknowns at three sites: the first and the last have held components. The lower triangle is full, but for (4, 0).
    fn system() -> (Pattern, Sites, Vec<f64>) {
        let pattern = Pattern {
            columns: vec![0, 4, 8, 11, 13, 14],
            rows: vec![0, 1, 2, 3, 1, 2, 3, 4, 2, 3, 4, 3, 4, 4],
        };
        let values = vec![
            9.0, 1.0, 2.0, 3.0, 8.0, -1.0, 0.5, 0.25, 7.0, 1.5, -2.0, 6.0, 0.75, 5.0,
        ];
        let sites = Sites {
            positions: vec![Vec3::zeros(), Vec3::x(), Vec3::y()],
            slots: vec![1, 3, 4, 5, 8],
        };
        (pattern, sites, values)
    }

    #[test]
    fn blocks_multiply_as_the_triangle_that_they_were_filled_from() {
        let (pattern, sites, values) = system();
        let blocks = BlockPattern::new(&pattern, &sites);
        let mut filled = vec![[0.0; 9]; blocks.columns.len()];
        blocks.fill(&pattern, &sites, &values, &mut filled);
        let matrix = BlockMatrix {
            pattern: &blocks,
            values: &filled,
        };
        let x = [1.0, -2.0, 3.0, 0.5, -1.5];
        let mut expected = [0.0; 5];
        for column in 0..5 {
            let own = pattern.columns[column]..pattern.columns[column + 1];
            for (&row, value) in pattern.rows[own.clone()].iter().zip(&values[own]) {
                expected[row] += value * x[column];
                if row != column {
                    expected[column] += value * x[row];
                }
            }
        }
        let (mut spread, mut product) = (vec![Vec3::zeros(); 3], vec![Vec3::zeros(); 3]);
        sites.spread(&x, &mut spread);
        matrix.product(&spread, &mut product);
        let mut y = [0.0; 5];
        sites.gather(&product, &mut y);
        // All numbers are short binary fractions: no rounding.
        assert_eq!(y, expected);
        // Held components stay out of the product and of the inverses.
        assert_eq!((product[0].x, product[0].z, product[2].x), (0.0, 0.0, 0.0));
        let inverses = matrix.diagonal_inverses().unwrap();
        assert_eq!((inverses[0][0], inverses[0][8]), (0.0, 0.0));
        assert!((inverses[0][4] - 1.0 / 9.0).abs() < 1e-9);
    }

    #[test]
    fn a_site_whose_block_is_not_positive_definite_is_named() {
        let (pattern, sites, mut values) = system();
        values[8] = -7.0;
        let blocks = BlockPattern::new(&pattern, &sites);
        let mut filled = vec![[0.0; 9]; blocks.columns.len()];
        blocks.fill(&pattern, &sites, &values, &mut filled);
        let matrix = BlockMatrix {
            pattern: &blocks,
            values: &filled,
        };
        assert_eq!(matrix.diagonal_inverses(), Err(1));
    }
}
