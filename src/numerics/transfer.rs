//! Interpolation from a coarse lattice to sites anywhere: the coarse spaces of the multigrid method.
//!
//! ```text
//! u(x) = Σ_J w_J(x) U_J ,    w trilinear on a lattice of straight lines,    A_c = Pᵀ A P
//! ```
//!
//! The lattice lies over the object without regard to its surface; only lattice points that some site hangs on exist.
//! Trilinear functions hold every rigid motion and every constant strain exactly, wherever the sites lie, so one lattice
//! serves grids of hexahedra, graded ones, and free tetrahedra. On a grid whose nodes lie on straight lines the lattice
//! takes every second line, and its space is a part of the fine one.
//!
//! Positions in mm, weights without unit. Sources: Brandt 1977 (multilevel), Xu 1996 (auxiliary grids).

use super::blocks::{Block, BlockMatrix, BlockPattern, CHUNK, in_chunks};
use crate::math::Vec3;
use rayon::prelude::*;

/// Ascending coordinates of the lattice's lines along each axis \[mm\].
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    lines: [Vec<f64>; 3],
}

impl Lattice {
    /// A lattice as fine as the sites: through their own lines where they have some, evenly spaced elsewhere.
    pub fn over(positions: &[Vec3], pattern: &BlockPattern) -> Lattice {
        let mut reach = Vec3::zeros();
        for (i, x) in positions.iter().enumerate() {
            let mut far = Vec3::zeros();
            for &j in pattern.row(i) {
                far = far.sup(&(positions[j as usize] - x).abs());
            }
            reach += far;
        }
        reach /= positions.len().max(1) as f64;
        Lattice {
            lines: [0, 1, 2].map(|c| axis_lines(positions.iter().map(|x| x[c]).collect(), reach[c])),
        }
    }

    /// Every second line, along the axes on which lines are close; `None` when there is nothing left to leave out.
    pub fn coarsened(&self) -> Option<Lattice> {
        /// Axes with lines up to this much further apart than the closest ones are thinned out together with them.
        const ALIKE: f64 = 1.6;
        let gap = |lines: &[f64]| match lines {
            [first, .., last] if lines.len() > 2 => (last - first) / (lines.len() - 1) as f64,
            _ => f64::INFINITY,
        };
        let least = self.lines.iter().map(|l| gap(l)).fold(f64::INFINITY, f64::min);
        if least.is_infinite() {
            return None;
        }
        let lines = [0, 1, 2].map(|c| {
            let lines = &self.lines[c];
            if gap(lines) > ALIKE * least {
                return lines.clone();
            }
            let last = lines.len() - 1;
            (0..=last)
                .filter(|k| k % 2 == 0 || *k == last)
                .map(|k| lines[k])
                .collect()
        });
        Some(Lattice { lines })
    }

    /// The two lines about `x` on axis `c` and the second one's weight.
    fn between(&self, c: usize, x: f64) -> (usize, usize, f64) {
        let lines = &self.lines[c];
        if lines.len() < 2 {
            return (0, 0, 0.0);
        }
        let k = lines.partition_point(|&l| l <= x).clamp(1, lines.len() - 1) - 1;
        let t = ((x - lines[k]) / (lines[k + 1] - lines[k])).clamp(0.0, 1.0);
        // Rounding must not hang a site on points a whole cell away.
        let t = if t < 1e-9 {
            0.0
        } else if t > 1.0 - 1e-9 {
            1.0
        } else {
            t
        };
        (k, k + 1, t)
    }
}

/// The sites' own lines if they are at least half of `reach` apart in the mean, evenly spaced ones `reach` apart if not.
fn axis_lines(mut coordinates: Vec<f64>, reach: f64) -> Vec<f64> {
    coordinates.sort_unstable_by(f64::total_cmp);
    let (Some(&low), Some(&high)) = (coordinates.first(), coordinates.last()) else {
        return vec![0.0];
    };
    let tolerance = 1e-6 * reach;
    coordinates.dedup_by(|b, a| *b - *a <= tolerance);
    let intervals = coordinates.len() - 1;
    if intervals as f64 * reach <= 2.0 * (high - low) {
        return coordinates;
    }
    let intervals = ((high - low) / reach).round().max(1.0) as usize;
    (0..=intervals)
        .map(|k| low + (high - low) * k as f64 / intervals as f64)
        .collect()
}

/// Interpolation P from coarse to fine sites, and its transpose.
#[derive(Clone, Debug)]
pub struct Transfer {
    forward: Weights,
    backward: Weights,
    /// Positions of the coarse sites \[mm\].
    pub positions: Vec<Vec3>,
}

#[derive(Clone, Debug)]
struct Weights {
    starts: Vec<u32>,
    entries: Vec<(u32, f64)>,
}

impl Weights {
    #[inline]
    fn row(&self, i: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    fn transposed(&self, columns: usize) -> Weights {
        let mut starts = vec![0; columns + 1];
        for (j, _) in &self.entries {
            starts[*j as usize + 1] += 1;
        }
        for j in 0..columns {
            starts[j + 1] += starts[j];
        }
        let mut free = starts.clone();
        let mut entries = vec![(0, 0.0); self.entries.len()];
        for i in 0..self.starts.len() - 1 {
            for &(j, w) in self.row(i) {
                entries[free[j as usize] as usize] = (i as u32, w);
                free[j as usize] += 1;
            }
        }
        Weights { starts, entries }
    }
}

/// Room for one coarse row.
#[derive(Default)]
struct RowRoom {
    /// Fine sites near the coarse one, and the place of each, plus one, in `near`.
    place: Vec<u32>,
    near: Vec<u32>,
    sums: Vec<Block>,
}

impl Transfer {
    /// Interpolation from `lattice` to sites at `positions`.
    pub fn new(positions: &[Vec3], lattice: &Lattice) -> Transfer {
        let counts = [0, 1, 2].map(|c| lattice.lines[c].len() as u64);
        let keyed: Vec<Vec<(u64, f64)>> = positions
            .par_iter()
            .map(|x| {
                let axes = [0, 1, 2].map(|c| lattice.between(c, x[c]));
                let side = |c: usize, upper: usize| {
                    let (low, high, t) = axes[c];
                    if upper == 1 {
                        (high as u64, t)
                    } else {
                        (low as u64, 1.0 - t)
                    }
                };
                let corners = (0..8).map(|k| {
                    let [(i, wi), (j, wj), (k, wk)] = [side(0, k & 1), side(1, k >> 1 & 1), side(2, k >> 2)];
                    (i + counts[0] * (j + counts[1] * k), wi * wj * wk)
                });
                corners.filter(|(_, w)| *w > 0.0).collect()
            })
            .collect();
        let mut keys: Vec<u64> = keyed.iter().flatten().map(|(key, _)| *key).collect();
        keys.par_sort_unstable();
        keys.dedup();
        let mut starts = vec![0];
        let mut entries = Vec::new();
        for row in &keyed {
            entries.extend(
                row.iter()
                    .map(|(key, w)| (keys.partition_point(|k| k < key) as u32, *w)),
            );
            starts.push(entries.len() as u32);
        }
        let at = |key: &u64| {
            let (i, j, k) = (
                key % counts[0],
                key / counts[0] % counts[1],
                key / counts[0] / counts[1],
            );
            let line = |c: usize, i: u64| lattice.lines[c][i as usize];
            Vec3::new(line(0, i), line(1, j), line(2, k))
        };
        let forward = Weights { starts, entries };
        Transfer {
            backward: forward.transposed(keys.len()),
            forward,
            positions: keys.iter().map(at).collect(),
        }
    }

    /// Number of coarse sites.
    pub fn coarse_sites(&self) -> usize {
        self.positions.len()
    }

    /// Renumbers the coarse sites: `order[k]` is the one that becomes the k-th.
    pub fn renumbered(mut self, order: &[u32]) -> Transfer {
        let mut place = vec![0; order.len()];
        for (k, &j) in order.iter().enumerate() {
            place[j as usize] = k as u32;
        }
        for (j, _) in &mut self.forward.entries {
            *j = place[*j as usize];
        }
        self.backward = self.forward.transposed(order.len());
        self.positions = order.iter().map(|&j| self.positions[j as usize]).collect();
        self
    }

    /// `coarse = Pᵀ fine`.
    pub fn restrict(&self, fine: &[Vec3], coarse: &mut [Vec3]) {
        in_chunks(coarse, |k, coarse| {
            for (i, c) in (k * CHUNK..).zip(coarse) {
                let weights = self.backward.row(i).iter();
                *c = weights.fold(Vec3::zeros(), |sum, &(j, w)| sum + fine[j as usize] * w);
            }
        });
    }

    /// `fine += P coarse`.
    pub fn prolong(&self, coarse: &[Vec3], fine: &mut [Vec3]) {
        in_chunks(fine, |k, fine| {
            for (i, f) in (k * CHUNK..).zip(fine) {
                let weights = self.forward.row(i).iter();
                *f = weights.fold(*f, |sum, &(j, w)| sum + coarse[j as usize] * w);
            }
        });
    }

    /// Which blocks `Pᵀ A P` has.
    pub fn coarse_pattern(&self, fine: &BlockPattern) -> BlockPattern {
        let room = || (vec![u32::MAX; fine.sites()], vec![u32::MAX; self.coarse_sites()]);
        let rows: Vec<Vec<u32>> = (0..self.coarse_sites())
            .into_par_iter()
            .with_min_len(1024)
            .map_init(room, |(fine_seen, coarse_seen), row| {
                let mark = row as u32;
                let mut columns = Vec::new();
                for &(i, _) in self.backward.row(row) {
                    for &j in fine.row(i as usize) {
                        if std::mem::replace(&mut fine_seen[j as usize], mark) == mark {
                            continue;
                        }
                        for &(column, _) in self.forward.row(j as usize) {
                            if std::mem::replace(&mut coarse_seen[column as usize], mark) != mark {
                                columns.push(column);
                            }
                        }
                    }
                }
                columns.sort_unstable();
                columns
            })
            .collect();
        BlockPattern::from_rows(&rows)
    }

    /// `Pᵀ A P`, written to `out` on the pattern that [`Transfer::coarse_pattern`] gave.
    pub fn coarse_values(&self, fine: &BlockMatrix, coarse: &BlockPattern, out: &mut [Block]) {
        let room = || RowRoom {
            place: vec![0; fine.pattern.sites()],
            ..RowRoom::default()
        };
        coarse
            .chunks(out)
            .into_par_iter()
            .enumerate()
            .for_each_init(room, |room, (k, out)| {
                pulp::Arch::new().dispatch(
                    #[inline(always)]
                    || {
                        let rows = coarse.rows_of_chunk(k);
                        let first = coarse.starts[rows.start];
                        for i in rows {
                            let own = coarse.starts[i] - first..coarse.starts[i + 1] - first;
                            self.coarse_row(fine, i, coarse.row(i), room, &mut out[own]);
                        }
                    },
                );
            });
    }

    /// Row `row`: first the rows of the fine sites near it are added up, then their columns are handed to coarse sites.
    #[inline(always)]
    fn coarse_row(
        &self,
        fine: &BlockMatrix,
        row: usize,
        columns: &[u32],
        room: &mut RowRoom,
        out: &mut [Block],
    ) {
        room.near.clear();
        room.sums.clear();
        for &(i, w) in self.backward.row(row) {
            let range = fine.pattern.starts[i as usize]..fine.pattern.starts[i as usize + 1];
            for (block, &j) in fine.values[range.clone()]
                .iter()
                .zip(&fine.pattern.columns[range])
            {
                let place = &mut room.place[j as usize];
                if *place == 0 {
                    room.near.push(j);
                    room.sums.push([0.0; 9]);
                    *place = room.near.len() as u32;
                }
                let sum = &mut room.sums[*place as usize - 1];
                for (s, b) in sum.iter_mut().zip(block) {
                    *s += w * b;
                }
            }
        }
        out.fill([0.0; 9]);
        for (&j, sum) in room.near.iter().zip(&room.sums) {
            room.place[j as usize] = 0;
            for &(column, w) in self.forward.row(j as usize) {
                let Ok(k) = columns.binary_search(&column) else {
                    continue;
                };
                for (o, s) in out[k].iter_mut().zip(sum) {
                    *o += w * s;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sites anywhere in a box, each a neighbour of the next few.
    fn cloud(n: usize) -> (Vec<Vec3>, BlockPattern) {
        let at = |i: usize, f: f64| 5.0 * (f * i as f64).sin();
        let positions = (0..n).map(|i| Vec3::new(at(i, 1.3), 2.0 * at(i, 2.9), at(i, 4.1)));
        let near = |i: usize| i.saturating_sub(3)..(i + 4).min(n);
        let rows: Vec<Vec<u32>> = (0..n).map(|i| near(i).map(|j| j as u32).collect()).collect();
        (positions.collect(), BlockPattern::from_rows(&rows))
    }

    #[test]
    fn linear_fields_pass_from_any_lattice_to_any_sites_exactly() {
        let (positions, pattern) = cloud(300);
        let slope = crate::math::Mat3::new(0.1, -0.2, 0.3, 0.05, 0.4, -0.1, 0.2, 0.15, -0.3);
        let mut lattice = Lattice::over(&positions, &pattern);
        while let Some(next) = lattice.coarsened() {
            lattice = next;
            let transfer = Transfer::new(&positions, &lattice);
            let coarse: Vec<Vec3> = transfer.positions.iter().map(|x| slope * x).collect();
            let mut fine = vec![Vec3::zeros(); positions.len()];
            transfer.prolong(&coarse, &mut fine);
            // Trilinear weights add up to one and hold linear functions; only rounding of sites onto lines (1e-9 of a
            // cell, here below 20 mm) is left.
            for (u, x) in fine.iter().zip(&positions) {
                assert!((u - slope * x).norm() < 1e-7);
            }
        }
    }

    #[test]
    fn lines_of_a_grid_are_found_and_every_second_is_kept() {
        let nodes = |line: &[f64]| -> Vec<f64> { line.iter().flat_map(|x| [*x; 30]).collect() };
        let graded = [0.0, 1.0, 2.1, 3.3, 4.6];
        assert_eq!(axis_lines(nodes(&graded), 1.2), graded);
        let lattice = Lattice {
            lines: [graded.to_vec(), vec![0.0, 5.0, 10.0], vec![0.0, 1.0, 2.0, 3.0]],
        };
        let coarse = lattice.coarsened().unwrap();
        // The second axis has long cells already; an odd count keeps its last line.
        assert_eq!(coarse.lines[0], [0.0, 2.1, 4.6]);
        assert_eq!(coarse.lines[1], [0.0, 5.0, 10.0]);
        assert_eq!(coarse.lines[2], [0.0, 2.0, 3.0]);
    }
}
