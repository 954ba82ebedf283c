//! The linearised problem: the step of mixtures, and a layout that reads like one.
//!
//! ```text
//! min ½ |r + J Δ|² + ½ μ |Δ − g|²,   w + Δ in the simplex of each variable
//! Δ = g − P Jᵀ (J P Jᵀ + μ I)⁻¹ (r + J g)             inside: the system is as large as there are readings
//! ```
//!
//! P takes the mean over the shares of a variable that are free to move, so that they still add up to one. Shares that
//! the step would make negative are held at zero and the step is solved again (an active set, for a few rounds).
//!
//! Symbols: r residual of the readings \[mm\], J its derivatives by the shares \[mm\], w shares, g where the step would
//! go if the residual did not matter. Source: Levenberg 1944 in the dual form; the rounding is coordinate descent.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Rounds of the active set.
const ROUNDS: usize = 6;
/// Rounds through all variables of a rounding.
const SWEEPS: usize = 3;

/// Residuals and derivatives at some shares.
#[derive(Clone, Debug)]
pub struct Linear {
    /// r, `(readings)` \[mm\].
    pub residual: DVector<f64>,
    /// J, `(readings × (variables · materials))` \[mm\].
    pub derivatives: DMatrix<f64>,
    /// Number of materials.
    pub materials: usize,
    /// How many of the last rows are no readings: sums over the shares, exact whatever changes (`limits`).
    pub sums: usize,
}

/// Shares of the materials in each variable, `(variables × materials)`.
pub type Shares = Vec<f64>;

impl Linear {
    /// The same with one row more, a sum over the shares.
    pub fn with_sum(&self, residual: f64, slopes: &[f64]) -> Linear {
        let row = self.residual.len();
        let mut more = Linear {
            residual: self.residual.clone().insert_row(row, residual),
            derivatives: self.derivatives.clone().insert_row(row, 0.0),
            sums: self.sums + 1,
            ..*self
        };
        more.derivatives
            .row_mut(row)
            .iter_mut()
            .zip(slopes)
            .for_each(|(d, s)| *d = *s);
        more
    }

    /// The shares of the step from `shares` towards `goal`; `damping` is μ as a share of the mean diagonal of J P Jᵀ, and
    /// `free` says which shares may be above zero.
    pub fn step(&self, shares: &[f64], goal: &[f64], damping: f64, free: &[bool]) -> Shares {
        let m = self.materials;
        let mut free = free.to_vec();
        let mut here = goal.to_vec();
        let mut rest = self.moved(shares, &here);
        let mut mu = None;
        for _ in 0..ROUNDS {
            let projected = self.projected(&free);
            let mut gram = &projected * projected.transpose();
            let rows = gram.nrows();
            let mu = *mu.get_or_insert(damping * (gram.trace() / rows.max(1) as f64).max(f64::MIN_POSITIVE));
            (0..rows).for_each(|i| gram[(i, i)] += mu);
            let Some(factor) = Cholesky::new(gram) else {
                break;
            };
            let step = projected.tr_mul(&factor.solve(&rest));
            let mut next: Shares = here.iter().zip(step.iter()).map(|(x, s)| x - s).collect();
            let wanted = next.clone();
            next.chunks_mut(m)
                .zip(free.chunks(m))
                .for_each(|(own, free)| project(own, free));
            let left = self.moved(shares, &next);
            if left.norm() > rest.norm() {
                break;
            }
            let settled = left.norm() > 0.98 * rest.norm();
            (here, rest) = (next, left);
            let mut held = false;
            for (k, free) in free.iter_mut().enumerate() {
                if *free && here[k] == 0.0 && wanted[k] < 0.0 {
                    (*free, held) = (false, true);
                }
            }
            if settled || !held {
                break;
            }
        }
        here
    }

    /// r + J (to − from), `(readings)` \[mm\].
    pub fn moved(&self, from: &[f64], to: &[f64]) -> DVector<f64> {
        let change = DVector::from_iterator(to.len(), to.iter().zip(from).map(|(b, a)| b - a));
        &self.residual + &self.derivatives * change
    }

    /// J P: the columns of a variable's free shares less their mean, those of others zero.
    fn projected(&self, free: &[bool]) -> DMatrix<f64> {
        let m = self.materials;
        let mut result = DMatrix::zeros(self.derivatives.nrows(), self.derivatives.ncols());
        for v in 0..free.len() / m {
            let own: Vec<usize> = (v * m..(v + 1) * m).filter(|&k| free[k]).collect();
            if own.len() < 2 {
                continue;
            }
            let mut mean = DVector::zeros(self.derivatives.nrows());
            own.iter().for_each(|&k| mean += self.derivatives.column(k));
            mean /= own.len() as f64;
            for k in own {
                result.set_column(k, &(self.derivatives.column(k) - &mean));
            }
        }
        result
    }

    /// A material for each variable, allowed by `free`, so that the linearised readings are near the targets: variables
    /// one after the other in the given `order`, each with the material that leaves least. A material costs more the smaller its
    /// share is: `firmness` 1 makes a whole share worth as much as a typical change of the readings. Materials that the
    /// choice so far does not `permit` are passed over where others are left.
    pub fn rounded(
        &self,
        shares: &[f64],
        free: &[bool],
        order: &[u32],
        firmness: f64,
        permit: &dyn Fn(usize, u8, &[u8]) -> bool,
    ) -> Vec<u8> {
        let m = self.materials;
        let variables = shares.len() / m;
        let scale = firmness * self.derivatives.norm_squared() / self.derivatives.ncols().max(1) as f64;
        let mut choice = vec![u8::MAX; variables];
        let mut rest = self.residual.clone();
        for _ in 0..SWEEPS {
            let mut changed = false;
            for &v in order {
                let (v, from) = (v as usize, v as usize * m);
                // Without what the variable adds now.
                let mut bare = rest.clone();
                let now = choice[v];
                for k in 0..m {
                    let held = if now == u8::MAX {
                        shares[from + k]
                    } else {
                        f64::from(u8::from(now as usize == k))
                    };
                    if held != 0.0 {
                        bare.axpy(-held, &self.derivatives.column(from + k), 1.0);
                    }
                }
                let price = |k: usize| {
                    let column = self.derivatives.column(from + k);
                    2.0 * bare.dot(&column) + column.norm_squared() + scale * (1.0 - shares[from + k])
                };
                let best = (0..m)
                    .filter(|&k| free[from + k])
                    .map(|k| (!permit(v, k as u8, &choice), price(k), k))
                    .min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
                let Some((_, _, best)) = best else { continue };
                bare.axpy(1.0, &self.derivatives.column(from + best), 1.0);
                rest = bare;
                changed |= now as usize != best;
                choice[v] = best as u8;
            }
            if !changed {
                break;
            }
        }
        choice
    }
}

/// The shares of a layout, `(variables)`.
pub fn shares_of(choice: &[u8], materials: usize) -> Shares {
    let mut shares = vec![0.0; choice.len() * materials];
    for (v, &m) in choice.iter().enumerate() {
        shares[v * materials + m as usize] = 1.0;
    }
    shares
}

/// Moves `own` to the nearest point with no negative share, none where not `free`, and sum one (Held, Wolfe and
/// Crowder 1974). Without a free share it stays.
pub fn project(own: &mut [f64], free: &[bool]) {
    let mut sorted: Vec<f64> = own
        .iter()
        .zip(free)
        .filter(|(_, f)| **f)
        .map(|(x, _)| *x)
        .collect();
    if sorted.is_empty() {
        return;
    }
    sorted.sort_by(|a, b| b.total_cmp(a));
    let (mut sum, mut shift) = (0.0, 0.0);
    for (k, x) in sorted.iter().enumerate() {
        sum += x;
        let level = (sum - 1.0) / (k + 1) as f64;
        if x - level > 0.0 {
            shift = level;
        }
    }
    for (x, free) in own.iter_mut().zip(free) {
        *x = if *free { (*x - shift).max(0.0) } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_projection_is_the_nearest_point() {
        let mut own = [0.9, 0.5, -0.2];
        project(&mut own, &[true; 3]);
        // By hand: 0.9 and 0.5 are 0.4 too much, 0.2 off each.
        assert!((own[0] - 0.7).abs() < 1e-15 && (own[1] - 0.3).abs() < 1e-15 && own[2] == 0.0);
        let mut own = [0.9, 0.5, 0.4];
        project(&mut own, &[false, true, true]);
        assert!(own[0] == 0.0 && (own[1] - 0.55).abs() < 1e-15 && (own[2] - 0.45).abs() < 1e-15);
    }

    /// Many variables, few readings.
    fn wide(variables: usize, rows: usize) -> Linear {
        // Middle digits of squares: no two columns are alike.
        let at = |i: usize, j: usize| {
            let mixed = (i * 7919 + j * 104_729 + 12_345).pow(2);
            (mixed / 1000 % 1000) as f64 / 1000.0 - 0.5
        };
        Linear {
            residual: DVector::from_fn(rows, |i, _| 0.3 * at(i, 1000)),
            derivatives: DMatrix::from_fn(rows, 3 * variables, at),
            materials: 3,
            sums: 0,
        }
    }

    #[test]
    fn a_step_fits_the_readings_inside_the_simplex() {
        let linear = wide(40, 5);
        let shares = vec![1.0 / 3.0; 120];
        let free = vec![true; 120];
        let next = linear.step(&shares, &shares, 1e-9, &free);
        assert!(linear.residual.norm() > 0.1);
        assert!(linear.moved(&shares, &next).norm() < 1e-6);
        for own in next.chunks(3) {
            assert!(own.iter().all(|&x| x >= 0.0) && (own.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        // Every share of the second material forbidden.
        let free: Vec<bool> = (0..120).map(|k| k % 3 != 1).collect();
        let shares = [0.5, 0.0, 0.5].repeat(40);
        let next = linear.step(&shares, &shares, 1e-9, &free);
        assert!(next != shares && next.iter().skip(1).step_by(3).all(|&x| x == 0.0));
    }

    #[test]
    fn rounding_keeps_the_readings() {
        let linear = wide(200, 5);
        let shares = vec![1.0 / 3.0; 600];
        let order: Vec<u32> = (0..200).collect();
        let choice = linear.rounded(&shares, &[true; 600], &order, 0.0, &|_, _, _| true);
        let left = linear.moved(&shares, &shares_of(&choice, 3)).norm();
        // Where no single exchange helps, less is left than one is worth.
        let worth = (0..200)
            .map(|v| (linear.derivatives.column(3 * v) - linear.derivatives.column(3 * v + 1)).norm());
        let typical = worth.sum::<f64>() / 200.0;
        assert!(left < 0.6 * typical, "{left} of {typical}");
        let firm = linear.rounded(&shares_of(&choice, 3), &[true; 600], &order, 1e6, &|_, _, _| true);
        assert_eq!(firm, choice);
    }
}
