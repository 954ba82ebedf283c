//! A model of the displacements of all layouts, learned from those that were simulated.
//!
//! ```text
//! x(m) ≈ x₀ + Σ_k φ_k y_k(m),    y_k(m) = Σ_i α_ik k(m, m_i),    (K + ν I) α = y
//! k(m, m') = Π_c exp(−|z(m_c) − z(m'_c)|² / 2ℓ²)
//! e_i = [(K + ν I)⁻¹ y]_i / [(K + ν I)⁻¹]_ii                       error at m_i of the model without m_i
//! ```
//!
//! Symbols: φ_k principal directions of the simulated displacements; z(j) coordinates of material j: its uniform layout's
//! displacements along their own principal directions, scaled so that the spread is one; ℓ length, chosen by the errors e
//! among [`LENGTHS`]; ν nugget. Layers in a row give way by the sum of what each gives, so displacements are nearly
//! linear in these z, and a smooth kernel needs few simulations.
//!
//! Source: Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, (2.23) and (5.12).

use super::Aim;
use super::memory::{Entry, Memory};
use crate::fem::rig::Layout;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

/// Lengths that are tried.
const LENGTHS: [f64; 5] = [1.5, 2.5, 4.0, 7.0, 12.0];
/// Share of the kernel at zero distance that is taken for noise.
const NUGGET: f64 = 1e-8;
/// At most as many layouts are learned from: the best ones, and a spread of the others.
const MOST_LEARNED: usize = 600;
/// At most as many layouts say what the principal directions are, and choose the length.
const MOST_SPANNING: usize = 150;
/// Directions below this share of the largest one's spread are left out.
const LEAST_SPREAD: f64 = 1e-4;
/// Layouts that are looked at together.
const CHUNK: usize = 256;
/// Coordinates of a material.
const COORDINATES: usize = 3;

/// The model.
pub(super) struct Surrogate {
    layouts: Vec<Layout>,
    kernel: Kernel,
    /// α, `(layouts × directions)`.
    weights: DMatrix<f64>,
    /// φ, `(components × directions)`.
    directions: DMatrix<f64>,
    /// x₀, `(components)` \[mm\].
    middle: DVector<f64>,
}

/// Products over cells of the likeness of two materials.
struct Kernel {
    /// exp(−|z − z'|² / 2ℓ²), `(materials × materials)`.
    likeness: Vec<f64>,
    materials: usize,
}

impl Kernel {
    fn new(coordinates: &[Vec<f64>], length: f64) -> Kernel {
        let materials = coordinates.len();
        let mut likeness = Vec::with_capacity(materials * materials);
        for a in coordinates {
            for b in coordinates {
                let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
                likeness.push((-0.5 * squared / (length * length)).exp());
            }
        }
        Kernel { likeness, materials }
    }

    fn at(&self, a: &[u8], b: &[u8]) -> f64 {
        a.iter()
            .zip(b)
            .map(|(&a, &b)| self.likeness[a as usize * self.materials + b as usize])
            .product()
    }

    fn matrix(&self, layouts: &[&Layout]) -> DMatrix<f64> {
        let n = layouts.len();
        let mut k = DMatrix::from_fn(n, n, |i, j| {
            if i >= j {
                self.at(layouts[i], layouts[j])
            } else {
                0.0
            }
        });
        k.fill_upper_triangle_with_lower_triangle();
        (0..n).for_each(|i| k[(i, i)] += NUGGET);
        k
    }
}

impl Surrogate {
    /// Learns from the memory; `None` with fewer than three layouts that stand, or numbers that no model fits.
    pub fn learn(memory: &Memory) -> Option<Surrogate> {
        let learned = chosen(memory);
        let coordinates = coordinates(memory)?;
        let spanning: Vec<&Entry> = spread(&learned, MOST_SPANNING);
        let (middle, directions) = principal(&spanning)?;
        let project = |entries: &[&Entry]| {
            let rows: Vec<DVector<f64>> = entries
                .iter()
                .map(|e| {
                    directions.tr_mul(&(DVector::from_column_slice(&e.response.displacements) - &middle))
                })
                .collect();
            DMatrix::from_fn(rows.len(), directions.ncols(), |i, k| rows[i][k])
        };
        let some: Vec<&Layout> = spanning.iter().map(|e| &e.ranked.layout).collect();
        let y = project(&spanning);
        let (_, length) = LENGTHS
            .iter()
            .filter_map(|&length| Some((left_out(&Kernel::new(&coordinates, length), &some, &y)?, length)))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let kernel = Kernel::new(&coordinates, length);
        let layouts: Vec<&Layout> = learned.iter().map(|e| &e.ranked.layout).collect();
        let weights = Cholesky::new(kernel.matrix(&layouts))?.solve(&project(&learned));
        Some(Surrogate {
            layouts: layouts.into_iter().cloned().collect(),
            kernel,
            weights,
            directions,
            middle,
        })
    }

    /// The scores that the model expects of `layouts` \[mm\].
    pub fn scores(&self, aim: &Aim, layouts: &[Layout]) -> Vec<f64> {
        let score =
            |(layout, x): (&Layout, &[f64])| aim.target.misfit(x).rms_mm + aim.worth(aim.space.cost(layout));
        layouts
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| {
                let x = self.displacements(chunk);
                let scores: Vec<f64> = chunk
                    .iter()
                    .zip(x.as_slice().chunks_exact(x.nrows()))
                    .map(score)
                    .collect();
                scores
            })
            .collect()
    }

    /// The displacements that the model expects, `(components × layouts)` \[mm\].
    pub fn displacements(&self, layouts: &[Layout]) -> DMatrix<f64> {
        let likeness = DMatrix::from_fn(self.layouts.len(), layouts.len(), |i, j| {
            self.kernel.at(&layouts[j], &self.layouts[i])
        });
        let mut x = &self.directions * self.weights.tr_mul(&likeness);
        x.column_iter_mut().for_each(|mut column| column += &self.middle);
        x
    }
}

/// The layouts to learn from: all, or the better half of the most and a spread of the rest.
fn chosen<'a>(memory: &'a Memory) -> Vec<&'a Entry> {
    let standing: Vec<&Entry> = memory.entries.iter().filter(|e| e.response.complete).collect();
    if standing.len() <= MOST_LEARNED {
        return standing;
    }
    let mut order: Vec<usize> = (0..standing.len()).collect();
    let error = |i: usize| {
        let x = &standing[i].response.displacements;
        memory.aim.target.misfit(x).rms_mm
    };
    let errors: Vec<f64> = (0..standing.len()).map(error).collect();
    order.sort_by(|&a, &b| errors[a].total_cmp(&errors[b]).then(a.cmp(&b)));
    let (near, far) = order.split_at(MOST_LEARNED / 2);
    let mut kept = near.to_vec();
    kept.extend(every(far.len(), MOST_LEARNED - near.len()).map(|i| far[i]));
    kept.sort_unstable();
    kept.into_iter().map(|i| standing[i]).collect()
}

fn spread<'a>(entries: &[&'a Entry], most: usize) -> Vec<&'a Entry> {
    every(entries.len(), most).map(|i| entries[i]).collect()
}

/// At most `most` indices of `n`, evenly apart.
fn every(n: usize, most: usize) -> impl Iterator<Item = usize> {
    let kept = n.min(most);
    (0..kept).map(move |k| k * n / kept)
}

/// z: the displacements of the uniform layouts along their principal directions, `(materials × coordinates)`.
fn coordinates(memory: &Memory) -> Option<Vec<Vec<f64>>> {
    let uniform = memory.uniform();
    let known: Vec<&Entry> = uniform.iter().filter_map(|l| memory.get(l)).collect();
    let finite = |e: &&Entry| e.response.displacements.iter().all(|x| x.is_finite());
    if known.len() < uniform.len() || !known.iter().all(finite) {
        return None;
    }
    if known.len() == 1 {
        return Some(vec![vec![0.0]]);
    }
    let (middle, directions) = principal(&known)?;
    let rows: Vec<DVector<f64>> = known
        .iter()
        .map(|e| directions.tr_mul(&(DVector::from_column_slice(&e.response.displacements) - &middle)))
        .collect();
    let spread = (rows.iter().map(|r| r[0] * r[0]).sum::<f64>() / rows.len() as f64).sqrt();
    Some(
        rows.iter()
            .map(|r| r.iter().take(COORDINATES).map(|y| y / spread).collect())
            .collect(),
    )
}

/// The mean of displacements and the directions that they spread in, widest first.
fn principal(entries: &[&Entry]) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let n = entries.len();
    let first = entries.first()?;
    let mut middle = DVector::zeros(first.response.displacements.len());
    for e in entries {
        middle += DVector::from_column_slice(&e.response.displacements) / n as f64;
    }
    let mut centred = DMatrix::zeros(middle.len(), n);
    for (i, e) in entries.iter().enumerate() {
        centred.set_column(
            i,
            &(DVector::from_column_slice(&e.response.displacements) - &middle),
        );
    }
    let gram = centred.tr_mul(&centred);
    if !gram.iter().all(|x| x.is_finite()) || gram.trace() <= 0.0 {
        return None;
    }
    let eigen = SymmetricEigen::new(gram);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let largest = eigen.eigenvalues[order[0]];
    let kept: Vec<usize> = order
        .into_iter()
        .filter(|&k| eigen.eigenvalues[k] > LEAST_SPREAD * LEAST_SPREAD * largest)
        .collect();
    let columns: Vec<DVector<f64>> = kept
        .iter()
        .map(|&k| &centred * eigen.eigenvectors.column(k) / eigen.eigenvalues[k].sqrt())
        .collect();
    Some((middle, DMatrix::from_columns(&columns)))
}

/// Root mean square of the errors e over layouts, summed over directions.
fn left_out(kernel: &Kernel, layouts: &[&Layout], y: &DMatrix<f64>) -> Option<f64> {
    let inverse = Cholesky::new(kernel.matrix(layouts))?.inverse();
    let weights = &inverse * y;
    let squares: f64 = (0..layouts.len())
        .map(|i| weights.row(i).norm_squared() / inverse[(i, i)].powi(2))
        .sum();
    let rms = (squares / layouts.len() as f64).sqrt();
    rms.is_finite().then_some(rms)
}
