//! Exchanges of single variables' materials that lower a linearised error most.
//!
//! ```text
//! δ = κ (J_b − J_a),   κ = 1/(1 + β (E_b/E_a − 1)),  β = 2/5        from material a to b
//! ```
//!
//! A cell that changes its material as a whole disturbs the strain in it: a stiffer one is strained less than the
//! derivative at the old material supposes, a softer one more. κ is that of a sphere in an incompressible matrix under
//! shear (Eshelby 1957), which a voxel among alike ones resembles. It is a guide for choosing; what is chosen is simulated.

use super::linear::Linear;
use nalgebra::{DMatrix, DVector};

/// Eshelby's β for a sphere at ν = ½.
const BETA: f64 = 0.4;

/// Exchanges that are looked at before none is taken to be allowed.
const TRIED: usize = 200;

/// Exchanges, best first: variable and its new material.
pub type Exchanges = Vec<(u32, u8)>;

/// Chooses up to `most` exchanges, each the one that lowers the linearised error most after those before it; `moduli`
/// are Young's moduli at rest \[MPa\], `allowed` says whether a layout that is one exchange further may be.
pub fn choose(
    linear: &Linear,
    choice: &[u8],
    free: &[bool],
    moduli: &[f64],
    most: usize,
    allowed: &dyn Fn(&[u8]) -> bool,
) -> Exchanges {
    let m = linear.materials;
    let changes = changes(linear, choice, free, moduli);
    let squares: Vec<f64> = changes.column_iter().map(|c| c.norm_squared()).collect();
    let mut rest: DVector<f64> = linear.residual.clone();
    let mut now = choice.to_vec();
    let mut open = vec![true; choice.len()];
    let mut chosen = Vec::new();
    while chosen.len() < most {
        let slopes = changes.tr_mul(&rest);
        let mut gains: Vec<(f64, usize)> = (0..squares.len())
            .filter(|&k| squares[k] > 0.0 && open[k / m])
            .map(|k| (2.0 * slopes[k] + squares[k], k))
            .filter(|(gain, _)| *gain < 0.0)
            .collect();
        gains.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let found = gains.into_iter().take(TRIED).find(|&(_, k)| {
            let before = std::mem::replace(&mut now[k / m], (k % m) as u8);
            let may = allowed(&now);
            now[k / m] = before;
            may
        });
        let Some((_, k)) = found else { break };
        now[k / m] = (k % m) as u8;
        open[k / m] = false;
        rest += changes.column(k);
        chosen.push(((k / m) as u32, (k % m) as u8));
    }
    chosen
}

/// κ (J_b − J_a) for every variable and material b, zero where that is no exchange.
///
/// Sums are exact.
fn changes(linear: &Linear, choice: &[u8], free: &[bool], moduli: &[f64]) -> DMatrix<f64> {
    let m = linear.materials;
    let mut changes = DMatrix::zeros(linear.derivatives.nrows(), linear.derivatives.ncols());
    for (v, &a) in choice.iter().enumerate() {
        let a = a as usize;
        for b in (0..m).filter(|&b| b != a && free[v * m + b]) {
            let factor = 1.0 / (1.0 + BETA * (moduli[b] / moduli[a] - 1.0));
            let mut change = linear.derivatives.column(v * m + b) - linear.derivatives.column(v * m + a);
            let readings = change.len() - linear.sums;
            change.rows_mut(0, readings).scale_mut(factor);
            changes.set_column(v * m + b, &change);
        }
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_exchanges_come_first_and_forbidden_ones_do_not() {
        // Two readings; variable v moves reading v % 2 by 0.1 (v + 1) when it takes material 1.
        let linear = Linear {
            residual: DVector::from_vec(vec![-0.3, -0.45]),
            derivatives: DMatrix::from_fn(2, 8, |i, k| {
                let (v, m) = (k / 2, k % 2);
                if v % 2 == i {
                    0.1 * (v + 1) as f64 * m as f64
                } else {
                    0.0
                }
            }),
            materials: 2,
            sums: 0,
        };
        let free = [true; 8];
        let all = choose(&linear, &[0; 4], &free, &[1.0, 1.0], 4, &|_| true);
        assert_eq!(all, [(3, 1), (2, 1)]);
        let some = choose(&linear, &[0; 4], &free, &[1.0, 1.0], 4, &|now| now[3] == 0);
        assert_eq!(some, [(1, 1), (2, 1)]);
    }
}
