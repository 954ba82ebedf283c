//! Tree nodes that behave alike, found by K-means.
//!
//! ```text
//! dist(a, b) = Σ_j ‖x(a, m̄_j) − x(b, m̄_j)‖²          Bickel 2010, (8.4)
//! ```
//!
//! x(a, m̄_j) are the displacements of node a with all undecided cells of material j: the squared Euclidean distance of
//! the responses written one after the other, so K-means minimises just this. The representative of a cluster is the
//! node nearest to its centroid.
//!
//! n nodes span at most n − 1 dimensions. They are projected there first, by the eigenvectors of their Gram matrix,
//! which keeps every distance and makes the clustering independent of how many points were measured.

use linfa::DatasetBase;
use linfa::traits::{Fit, Predict};
use linfa_clustering::KMeans;
use nalgebra::{DMatrix, SymmetricEigen};
use ndarray::Array2;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256Plus;

/// Restarts of K-means; the best is kept.
const RESTARTS: usize = 10;

/// Indices of at most `most` nodes that stand for all, ascending. `features`, `(nodes × dimensions)` \[mm\].
///
/// The same features and seed give the same representatives on any number of threads.
pub(super) fn representatives(features: &[Vec<f64>], most: usize, seed: u64) -> Vec<usize> {
    let distinct = distinct(features);
    if distinct.len() <= most {
        return distinct;
    }
    let chosen: Vec<&Vec<f64>> = distinct.iter().map(|&i| &features[i]).collect();
    let points = projected(&chosen);
    let Some(labels) = labels(&points, most, seed) else {
        // Clustering can fail only on numbers that are not finite, which were sorted out; keep the first nodes then.
        return distinct.into_iter().take(most).collect();
    };
    let mut result: Vec<usize> = (0..most)
        .filter_map(|c| nearest_to_centroid(&points, &labels, c))
        .map(|i| distinct[i])
        .collect();
    result.sort_unstable();
    result
}

/// The first of each set of equal nodes, without those that hold a number that is not finite.
fn distinct(features: &[Vec<f64>]) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for (i, feature) in features.iter().enumerate() {
        let finite = feature.iter().all(|x| x.is_finite());
        if finite && !kept.iter().any(|&k| features[k] == *feature) {
            kept.push(i);
        }
    }
    kept
}

/// The nodes in the space that they span, scaled to order one, `(n × n)`.
fn projected(features: &[&Vec<f64>]) -> Array2<f64> {
    let n = features.len();
    let dimensions = features[0].len();
    let mean: Vec<f64> = (0..dimensions)
        .map(|d| features.iter().map(|f| f[d]).sum::<f64>() / n as f64)
        .collect();
    let centred: Vec<Vec<f64>> = features
        .iter()
        .map(|f| f.iter().zip(&mean).map(|(x, m)| x - m).collect())
        .collect();
    let gram = DMatrix::from_fn(n, n, |i, j| {
        centred[i]
            .iter()
            .zip(&centred[j])
            .map(|(a, b)| a * b)
            .sum::<f64>()
    });
    let scale = gram.trace().max(f64::MIN_POSITIVE) / n as f64;
    let eigen = SymmetricEigen::new(gram / scale);
    Array2::from_shape_fn((n, n), |(i, j)| {
        eigen.eigenvectors[(i, j)] * eigen.eigenvalues[j].max(0.0).sqrt()
    })
}

fn labels(points: &Array2<f64>, clusters: usize, seed: u64) -> Option<Vec<usize>> {
    let data = DatasetBase::from(points.clone());
    let model = KMeans::params_with_rng(clusters, Xoshiro256Plus::seed_from_u64(seed))
        .n_runs(RESTARTS)
        .max_n_iterations(300)
        .tolerance(1e-6)
        .fit(&data)
        .ok()?;
    Some(model.predict(points).to_vec())
}

/// The point of cluster `c` nearest to the mean of its points; `None` if it has none.
fn nearest_to_centroid(points: &Array2<f64>, labels: &[usize], c: usize) -> Option<usize> {
    let members: Vec<usize> = (0..labels.len()).filter(|&i| labels[i] == c).collect();
    let dimensions = points.ncols();
    let centroid: Vec<f64> = (0..dimensions)
        .map(|d| members.iter().map(|&i| points[[i, d]]).sum::<f64>() / members.len() as f64)
        .collect();
    let distance = |i: usize| {
        (0..dimensions)
            .map(|d| (points[[i, d]] - centroid[d]).powi(2))
            .sum::<f64>()
    };
    members
        .into_iter()
        .min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three bunches far apart, in a space of more dimensions than points.
    fn bunches() -> Vec<Vec<f64>> {
        (0..30)
            .map(|i| {
                let mut f = vec![0.0; 50];
                f[i % 3] = 10.0;
                f[3 + i] = 0.01 * i as f64;
                f
            })
            .collect()
    }

    #[test]
    fn one_representative_comes_from_each_bunch() {
        let found = representatives(&bunches(), 3, 7);
        let mut bunch: Vec<usize> = found.iter().map(|i| i % 3).collect();
        bunch.sort_unstable();
        assert_eq!(bunch, [0, 1, 2]);
        assert_eq!(found, representatives(&bunches(), 3, 7));
    }

    #[test]
    fn projection_keeps_distances() {
        let features = bunches();
        let points = projected(&features.iter().collect::<Vec<_>>());
        let original = |i: usize, j: usize| -> f64 {
            features[i]
                .iter()
                .zip(&features[j])
                .map(|(a, b)| (a - b).powi(2))
                .sum()
        };
        let projected =
            |i: usize, j: usize| -> f64 { (0..30).map(|d| (points[[i, d]] - points[[j, d]]).powi(2)).sum() };
        let scale = projected(0, 1) / original(0, 1);
        for (i, j) in [(0, 2), (3, 9), (4, 29), (11, 12)] {
            assert!((projected(i, j) - scale * original(i, j)).abs() < 1e-9 * projected(0, 1));
        }
    }

    #[test]
    fn equal_and_unusable_nodes_are_left_out() {
        let features = vec![
            vec![1.0, 2.0],
            vec![1.0, 2.0],
            vec![f64::NAN, 0.0],
            vec![3.0, f64::INFINITY],
            vec![0.0, 0.0],
        ];
        assert_eq!(representatives(&features, 5, 1), [0, 4]);
        assert_eq!(representatives(&[], 5, 1), Vec::<usize>::new());
    }
}
