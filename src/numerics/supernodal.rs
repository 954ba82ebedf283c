//! Triangular solves with a supernodal Cholesky factor, `L Lᵀ x = b`, for one right-hand side.
//!
//! Neighbouring columns of L with the same rows are one supernode, a dense column-major panel of its own columns and
//! the rows below them:
//!
//! ```text
//! forward    x_s ← L_ss⁻¹ x_s,              x_rows ← x_rows − L_rows,s x_s
//! backward   x_s ← L_ss⁻ᵀ (x_s − L_rows,sᵀ x_rows)
//! ```
//!
//! Each panel is read once, from front to back, and the part of x that it touches is gathered before; a solve costs
//! what reading L twice costs. faer's own solve calls matrix products made for many right-hand sides, and takes half as
//! long again. Sums run in fixed lanes, without fused multiplication, so the bits are the same on every processor.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// Partial sums of a scalar product.
const LANES: usize = 4;

/// Solves `L Lᵀ x = b` in place; `values` is the factor, `room` space for one panel's part of x.
pub(super) fn solve(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    values: &[f64],
    x: &mut [f64],
    room: &mut Vec<f64>,
) {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            for s in 0..symbolic.n_supernodes() {
                let panel = Panel::new(symbolic, values, s);
                panel.gather(x, room);
                forward(&panel, room);
                x[panel.first..panel.first + panel.columns].copy_from_slice(&room[..panel.columns]);
                for (&row, value) in panel.rows.iter().zip(&room[panel.columns..]) {
                    x[row] = *value;
                }
            }
            for s in (0..symbolic.n_supernodes()).rev() {
                let panel = Panel::new(symbolic, values, s);
                panel.gather(x, room);
                backward(&panel, room);
                x[panel.first..panel.first + panel.columns].copy_from_slice(&room[..panel.columns]);
            }
        },
    );
}

/// One supernode.
struct Panel<'a> {
    first: usize,
    columns: usize,
    rows: &'a [usize],
    values: &'a [f64],
}

impl<'a> Panel<'a> {
    #[inline(always)]
    fn new(symbolic: &'a SymbolicSupernodalCholesky<usize>, values: &'a [f64], s: usize) -> Panel<'a> {
        let first = symbolic.supernode_begin()[s];
        let rows = &symbolic.row_idx()[symbolic.col_ptr_for_row_idx()[s]..][..symbolic.nnz_per_super()[s]];
        Panel {
            first,
            columns: symbolic.supernode_end()[s] - first,
            rows,
            values: &values[symbolic.col_ptr_for_val()[s]..symbolic.col_ptr_for_val()[s + 1]],
        }
    }

    #[inline(always)]
    fn gather(&self, x: &[f64], room: &mut Vec<f64>) {
        room.clear();
        room.extend_from_slice(&x[self.first..self.first + self.columns]);
        room.extend(self.rows.iter().map(|&row| x[row]));
    }

    #[inline(always)]
    fn column(&self, j: usize) -> &[f64] {
        let height = self.columns + self.rows.len();
        &self.values[j * height..(j + 1) * height]
    }
}

/// Columns that are worked on at once: w is then loaded, and stored, once for all of them.
const TOGETHER: usize = 4;

#[inline(always)]
fn forward(panel: &Panel, w: &mut [f64]) {
    let whole = panel.columns - panel.columns % TOGETHER;
    for j in (0..whole).step_by(TOGETHER) {
        let columns = [0, 1, 2, 3].map(|k| panel.column(j + k));
        let mut x = [0.0; TOGETHER];
        for k in 0..TOGETHER {
            let known: f64 = (0..k).map(|i| columns[i][j + k] * x[i]).sum();
            x[k] = (w[j + k] - known) / columns[k][j + k];
            w[j + k] = x[k];
        }
        let below = j + TOGETHER;
        let [a, b, c, d] = columns.map(|column| &column[below..]);
        for ((((w, a), b), c), d) in w[below..].iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *w -= (x[0] * a + x[1] * b) + (x[2] * c + x[3] * d);
        }
    }
    for j in whole..panel.columns {
        let column = panel.column(j);
        w[j] /= column[j];
        let x = w[j];
        for (w, a) in w[j + 1..].iter_mut().zip(&column[j + 1..]) {
            *w -= x * a;
        }
    }
}

#[inline(always)]
fn backward(panel: &Panel, w: &mut [f64]) {
    let whole = panel.columns - panel.columns % TOGETHER;
    for j in (whole..panel.columns).rev() {
        let column = panel.column(j);
        let [below] = dots([&column[j + 1..]], &w[j + 1..]);
        w[j] = (w[j] - below) / column[j];
    }
    for j in (0..whole).step_by(TOGETHER).rev() {
        let columns = [0, 1, 2, 3].map(|k| panel.column(j + k));
        let past = j + TOGETHER;
        let below = dots(columns.map(|column| &column[past..]), &w[past..]);
        for k in (0..TOGETHER).rev() {
            let known: f64 = (k + 1..TOGETHER).map(|i| columns[k][j + i] * w[j + i]).sum();
            w[j + k] = (w[j + k] - below[k] - known) / columns[k][j + k];
        }
    }
}

/// `Σ a·w` for each of the columns `a`.
#[inline(always)]
fn dots<const K: usize>(columns: [&[f64]; K], w: &[f64]) -> [f64; K] {
    let columns = columns.map(|a| &a[..w.len()]);
    let whole = w.len() - w.len() % LANES;
    let mut sums = [[0.0; LANES]; K];
    for start in (0..whole).step_by(LANES) {
        let w = &w[start..start + LANES];
        for (sums, a) in sums.iter_mut().zip(&columns) {
            let a = &a[start..start + LANES];
            for l in 0..LANES {
                sums[l] += a[l] * w[l];
            }
        }
    }
    let mut totals = [0.0; K];
    for ((total, sums), a) in totals.iter_mut().zip(&sums).zip(&columns) {
        *total = sums.iter().sum();
        for (a, w) in a[whole..].iter().zip(&w[whole..]) {
            *total += a * w;
        }
    }
    totals
}
