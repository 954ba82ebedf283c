//! Polar decomposition of eight matrices at once.
//!
//! The same iteration as [`super::polar`], R ← (R + R⁻ᵀ) / 2, with the eight matrices side by side so that the compiler can
//! use vector instructions. All lanes iterate until the slowest has converged; a lane near inversion is done alone by the
//! singular value decomposition. The eight points of a hexahedron are the use.

// Index loops say here which numbers lie side by side.
#![allow(clippy::needless_range_loop)]

use super::Mat3;
use super::polar;

/// One number of each of eight matrices.
pub type Lanes = [f64; 8];
/// Eight matrices, `(3 × 3 × 8)`, rows first.
pub type Matrices = [[Lanes; 3]; 3];

/// Zero in all lanes.
pub const ZERO: Lanes = [0.0; 8];

/// The rotations of the polar decompositions of `f`.
#[inline(always)]
pub fn rotations(f: &Matrices) -> Matrices {
    let mut r = *f;
    let singular = nearly_singular(f);
    if singular.contains(&true) {
        for lane in (0..8).filter(|&l| singular[l]) {
            for i in 0..3 {
                for j in 0..3 {
                    r[i][j][lane] = f64::from(i == j);
                }
            }
        }
    }
    for _ in 0..30 {
        if step(&mut r) < 1e-17 {
            break;
        }
    }
    for lane in (0..8).filter(|&l| singular[l]) {
        let own = polar::rotation(&extract(f, lane));
        for i in 0..3 {
            for j in 0..3 {
                r[i][j][lane] = own[(i, j)];
            }
        }
    }
    r
}

/// The matrix of lane `lane`.
#[inline(always)]
pub fn extract(a: &Matrices, lane: usize) -> Mat3 {
    Mat3::from_fn(|i, j| a[i][j][lane])
}

/// One step of the iteration; answers the largest squared change of a lane.
#[inline(always)]
fn step(r: &mut Matrices) -> f64 {
    let c = cofactors(r);
    let mut half_inverse = ZERO;
    for l in 0..8 {
        half_inverse[l] = 0.5 / (r[0][0][l] * c[0][0][l] + r[0][1][l] * c[0][1][l] + r[0][2][l] * c[0][2][l]);
    }
    let mut change = ZERO;
    for i in 0..3 {
        for j in 0..3 {
            for l in 0..8 {
                let next = 0.5 * r[i][j][l] + half_inverse[l] * c[i][j][l];
                let d = next - r[i][j][l];
                change[l] += d * d;
                r[i][j][l] = next;
            }
        }
    }
    // A lane that is not a number stays so: it must not keep the others from ending.
    change.iter().fold(0.0, |m, &c| if c > m { c } else { m })
}

/// The matrices of cofactors.
#[inline(always)]
pub fn cofactors(a: &Matrices) -> Matrices {
    let mut c = [[ZERO; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
            for l in 0..8 {
                c[i][j][l] = a[i1][j1][l] * a[i2][j2][l] - a[i1][j2][l] * a[i2][j1][l];
            }
        }
    }
    c
}

/// Lanes that the iteration should not be given: the same test as [`super::polar`] has.
#[inline(always)]
fn nearly_singular(f: &Matrices) -> [bool; 8] {
    let (mut det, mut squares) = (ZERO, ZERO);
    let c = cofactors(f);
    for j in 0..3 {
        for l in 0..8 {
            det[l] += f[0][j][l] * c[0][j][l];
            for row in f {
                squares[l] += row[j][l] * row[j][l];
            }
        }
    }
    std::array::from_fn(|l| !polar::is_regular(det[l], squares[l].sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    #[test]
    fn agrees_with_the_single_decomposition_in_every_lane() {
        let matrices: Vec<Mat3> = (0..8)
            .map(|k| {
                let t = k as f64;
                let turn = nalgebra::Rotation3::from_scaled_axis(Vec3::new(t, 1.0 - t, 0.5 * t)).into_inner();
                // Lane 3 is inverted, lane 5 flat.
                let third = [0.6, 0.9, 1.3, -0.4, 2.0, 0.0, 1.0, 0.3][k];
                turn * Mat3::new(1.1, 0.1, 0.0, 0.1, 0.8, 0.05, 0.0, 0.05, third)
            })
            .collect();
        let mut f = [[ZERO; 3]; 3];
        for (l, m) in matrices.iter().enumerate() {
            for i in 0..3 {
                for j in 0..3 {
                    f[i][j][l] = m[(i, j)];
                }
            }
        }
        let found = rotations(&f);
        for (l, m) in matrices.iter().enumerate() {
            assert!(
                (extract(&found, l) - polar::rotation(m)).norm() < 1e-14,
                "lane {l}"
            );
        }
    }

    #[test]
    fn a_lane_that_is_not_a_number_leaves_the_others_alone() {
        let mut f = [[ZERO; 3]; 3];
        for (i, row) in f.iter_mut().enumerate() {
            row[i] = [1.2; 8];
        }
        f[0][1][2] = f64::NAN;
        let found = rotations(&f);
        assert!(extract(&found, 2)[(0, 0)].is_nan());
        assert!((extract(&found, 1) - Mat3::identity()).norm() < 1e-14);
    }
}
