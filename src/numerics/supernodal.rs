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
//! long again. Sums run in eight fixed lanes, without fused multiplication, so the bits are the same on every processor.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

const LANES: usize = 8;

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

#[inline(always)]
fn forward(panel: &Panel, w: &mut [f64]) {
    let mut j = 0;
    // Two columns at once: w is then loaded and stored half as often.
    while j + 1 < panel.columns {
        let (a, b) = (panel.column(j), panel.column(j + 1));
        let first = w[j] / a[j];
        let second = (w[j + 1] - first * a[j + 1]) / b[j + 1];
        (w[j], w[j + 1]) = (first, second);
        for ((w, a), b) in w[j + 2..].iter_mut().zip(&a[j + 2..]).zip(&b[j + 2..]) {
            *w -= first * a + second * b;
        }
        j += 2;
    }
    if j < panel.columns {
        let a = panel.column(j);
        w[j] /= a[j];
        let first = w[j];
        for (w, a) in w[j + 1..].iter_mut().zip(&a[j + 1..]) {
            *w -= first * a;
        }
    }
}

#[inline(always)]
fn backward(panel: &Panel, w: &mut [f64]) {
    let mut past = panel.columns;
    while past >= 2 {
        let (i, j) = (past - 2, past - 1);
        let (a, b) = (panel.column(i), panel.column(j));
        let [below_a, below_b] = two_dots(&a[past..], &b[past..], &w[past..]);
        w[j] = (w[j] - below_b) / b[j];
        w[i] = (w[i] - below_a - a[j] * w[j]) / a[i];
        past -= 2;
    }
    if past == 1 {
        let a = panel.column(0);
        let [below, _] = two_dots(&a[1..], &a[1..], &w[1..]);
        w[0] = (w[0] - below) / a[0];
    }
}

/// `[Σ a·w, Σ b·w]`.
#[inline(always)]
fn two_dots(a: &[f64], b: &[f64], w: &[f64]) -> [f64; 2] {
    let (mut sum_a, mut sum_b) = ([0.0; LANES], [0.0; LANES]);
    let whole = w.len() - w.len() % LANES;
    let lanes = a[..whole]
        .chunks_exact(LANES)
        .zip(b[..whole].chunks_exact(LANES))
        .zip(w[..whole].chunks_exact(LANES));
    for ((a, b), w) in lanes {
        for l in 0..LANES {
            sum_a[l] += a[l] * w[l];
            sum_b[l] += b[l] * w[l];
        }
    }
    let (mut total_a, mut total_b) = (0.0, 0.0);
    for l in 0..LANES {
        total_a += sum_a[l];
        total_b += sum_b[l];
    }
    for ((a, b), w) in a[whole..].iter().zip(&b[whole..]).zip(&w[whole..]) {
        total_a += a * w;
        total_b += b * w;
    }
    [total_a, total_b]
}
