//! A grid of hexahedra over an object, its cells partly filled at the border.
//!
//! Two axes carry straight grid lines; along the third, the layer axis, the levels lie either at fixed heights or at
//! fixed shares between the object's lower and upper surface. The grid need not follow the outline: every octant of a
//! cell knows which share of its volume lies inside the object, and an integration point counts by that share (the
//! finite cell method, Parvizian, Düster and Rank 2007, with one constant per octant). So a dirty scan needs only an
//! answer to "inside or outside?", and layer borders inside the object lie on element faces.

use super::axis::Axis;
use super::heights::Heights;
use super::solid::Solid;
use super::volume::{Elements, VolumeMesh};
use crate::math::Vec3;
use rayon::prelude::*;

/// The levels of a grid along its layer axis.
#[derive(Clone, Debug)]
pub enum Levels {
    /// Fixed heights, ascending \[mm\].
    Flat(Vec<f64>),
    /// Shares between the lower (0) and the upper (1) surface, ascending.
    Following(Heights, Vec<f64>),
}

/// A grid over an object.
#[derive(Clone, Debug)]
pub struct Grid {
    /// The hexahedra that hold some of the object, and their nodes.
    pub mesh: VolumeMesh,
    /// Share of each octant inside the object, eight a hexahedron in the order of its nodes, `(8 × hexahedra)`.
    pub fill: Vec<f64>,
    axis: Axis,
    lines: [Vec<f64>; 2],
    levels: Levels,
    hexahedron_of: Vec<u32>,
}

/// Where a point lies in the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Number of the hexahedron.
    pub element: usize,
    /// Reference coordinates in it, −1 to 1 inside.
    pub reference: Vec3,
}

/// Why no grid could be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// Too many cells.
    #[error("elements of {size_mm} mm make {cells} cells, more than {most}: choose larger elements")]
    TooFine {
        /// Asked element size \[mm\].
        size_mm: f64,
        /// Cells that it would make.
        cells: usize,
        /// The most that is allowed.
        most: usize,
    },
    /// Layer borders that the levels of one grid cannot follow.
    #[error(
        "layer borders at {first} and {second} cannot be: borders of regions that were drawn in one plane move together, and none passes another"
    )]
    Borders {
        /// One of them, \[mm\] or a share of the height.
        first: f64,
        /// The other.
        second: f64,
    },
    /// No cell holds anything of the object.
    #[error("no element of {size_mm} mm holds a tenth of its volume of the object: choose smaller elements")]
    Empty {
        /// Asked element size \[mm\].
        size_mm: f64,
    },
}

/// More cells than a direct solver on this class of machine takes.
const MOST_CELLS: usize = 400_000;
/// Cells with less of the object than this share are left out.
const LEAST_FILL: f64 = 0.1;
/// Sampling lines across an octant, each way.
const SAMPLES: usize = 3;
const NONE: u32 = u32::MAX;
/// Grid steps from a cell to its nodes, in the order of a hexahedron's nodes.
const CORNER_STEPS: [[usize; 3]; 8] = [
    [0, 0, 0],
    [1, 0, 0],
    [1, 1, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 0, 1],
    [1, 1, 1],
    [0, 1, 1],
];

impl Grid {
    /// A grid over `solid` with lines about `size_mm` apart across `axis`, the given `levels` along it, and extra lines
    /// at the coordinates `extra` of the two other axes, in cyclic order.
    ///
    /// # Errors
    /// [`GridError`]: too many cells, or none with anything inside.
    pub fn new(
        solid: &Solid,
        axis: Axis,
        size_mm: f64,
        levels: Levels,
        extra: [&[f64]; 2],
    ) -> Result<Grid, GridError> {
        let (low, high) = solid.bounds();
        let across = <[usize; 2]>::from(axis.others());
        let lines = [0, 1].map(|c| grid_lines(low[across[c]], high[across[c]], size_mm, extra[c]));
        let layers = levels.count() - 1;
        let columns = (lines[0].len() - 1) * (lines[1].len() - 1);
        let cells = columns.saturating_mul(layers);
        if cells > MOST_CELLS {
            return Err(GridError::TooFine {
                size_mm,
                cells,
                most: MOST_CELLS,
            });
        }
        let fill: Vec<Vec<[f64; 8]>> = (0..columns)
            .into_par_iter()
            .map(|n| {
                column_fill(
                    solid,
                    axis,
                    &lines,
                    &levels,
                    n % (lines[0].len() - 1),
                    n / (lines[0].len() - 1),
                )
            })
            .collect();
        let mut grid = Grid {
            mesh: VolumeMesh {
                nodes: Vec::new(),
                elements: Elements::Hexahedra(Vec::new()),
            },
            fill: Vec::new(),
            axis,
            lines,
            levels,
            hexahedron_of: vec![NONE; cells],
        };
        grid.collect(&fill);
        if grid.mesh.elements.is_empty() {
            return Err(GridError::Empty { size_mm });
        }
        Ok(grid)
    }

    /// The same elements with their levels elsewhere: nodes move along the layer axis, and the octants are filled anew from
    /// `solid`. As many levels as before.
    pub fn with_levels(&self, solid: &Solid, levels: Levels) -> Grid {
        let (na, nb) = (self.lines[0].len(), self.lines[1].len());
        let layers = levels.count().min(self.levels.count()) - 1;
        let mut grid = Grid {
            levels,
            ..self.clone()
        };
        let columns: Vec<Vec<[f64; 8]>> = (0..(na - 1) * (nb - 1))
            .into_par_iter()
            .map(|n| {
                let (i, j) = (n % (na - 1), n / (na - 1));
                column_fill(solid, self.axis, &self.lines, &grid.levels, i, j)
            })
            .collect();
        let Elements::Hexahedra(hexahedra) = &self.mesh.elements else {
            return grid;
        };
        for k in 0..layers {
            for (n, fill) in columns.iter().enumerate() {
                let (i, j) = (n % (na - 1), n / (na - 1));
                let element = self.hexahedron_of[i + (na - 1) * (j + (nb - 1) * k)];
                if element == NONE {
                    continue;
                }
                let element = element as usize;
                grid.fill[8 * element..8 * element + 8].copy_from_slice(&fill[k]);
                for (&node, [di, dj, dk]) in hexahedra[element].iter().zip(CORNER_STEPS) {
                    grid.mesh.nodes[node as usize] = grid.node(i + di, j + dj, k + dk);
                }
            }
        }
        grid
    }

    /// The levels along the layer axis.
    pub fn levels(&self) -> &Levels {
        &self.levels
    }

    fn collect(&mut self, fill: &[Vec<[f64; 8]>]) {
        let (na, nb) = (self.lines[0].len(), self.lines[1].len());
        let layers = self.levels.count() - 1;
        let mut node_of = vec![NONE; na * nb * (layers + 1)];
        let mut hexahedra = Vec::new();
        let cells =
            (0..layers).flat_map(|k| (0..nb - 1).flat_map(move |j| (0..na - 1).map(move |i| (i, j, k))));
        for (i, j, k) in cells {
            let octants = &fill[i + j * (na - 1)][k];
            if octants.iter().sum::<f64>() / 8.0 < LEAST_FILL {
                continue;
            }
            self.hexahedron_of[i + (na - 1) * (j + (nb - 1) * k)] = hexahedra.len() as u32;
            hexahedra.push(CORNER_STEPS.map(|[di, dj, dk]| {
                let (i, j, k) = (i + di, j + dj, k + dk);
                let slot = &mut node_of[i + na * (j + nb * k)];
                if *slot == NONE {
                    *slot = self.mesh.nodes.len() as u32;
                    self.mesh.nodes.push(self.node(i, j, k));
                }
                *slot
            }));
            self.fill.extend(octants);
        }
        self.mesh.elements = Elements::Hexahedra(hexahedra);
    }

    fn node(&self, i: usize, j: usize, k: usize) -> Vec3 {
        let (a, b) = (self.lines[0][i], self.lines[1][j]);
        let (across_a, across_b) = self.axis.others();
        let mut node = Vec3::zeros();
        node[across_a] = a;
        node[across_b] = b;
        node[self.axis.index()] = self.levels.height(k, a, b);
        node
    }

    /// The layer axis.
    pub fn axis(&self) -> Axis {
        self.axis
    }

    /// The place of `point`, in the nearest hexahedron of its column if it lies in none.
    pub fn locate(&self, point: &Vec3) -> Option<Place> {
        let (across_a, across_b) = self.axis.others();
        let (a, b, w) = (point[across_a], point[across_b], point[self.axis.index()]);
        let (i0, j0) = (cell_of(&self.lines[0], a), cell_of(&self.lines[1], b));
        // Columns by distance from the point's own: an outline point may lie over a cell that was left out.
        let mut best: Option<(f64, Place)> = None;
        for j in j0.saturating_sub(1)..=(j0 + 1).min(self.lines[1].len() - 2) {
            for i in i0.saturating_sub(1)..=(i0 + 1).min(self.lines[0].len() - 2) {
                let Some((miss, place)) = self.locate_in_column(i, j, [a, b, w]) else {
                    continue;
                };
                if best.is_none_or(|(least, _)| miss < least - 1e-9) {
                    best = Some((miss, place));
                }
            }
        }
        best.map(|(_, place)| place)
    }

    /// The nearest place in one column and how far outside it the point is, in units of the cell.
    fn locate_in_column(&self, i: usize, j: usize, [a, b, w]: [f64; 3]) -> Option<(f64, Place)> {
        let (na, nb) = (self.lines[0].len(), self.lines[1].len());
        let along = |lines: &[f64], i: usize, x: f64| 2.0 * (x - lines[i]) / (lines[i + 1] - lines[i]) - 1.0;
        let (xi, eta) = (along(&self.lines[0], i, a), along(&self.lines[1], j, b));
        let corner = |k: usize, di: usize, dj: usize| {
            self.levels
                .height(k, self.lines[0][i + di], self.lines[1][j + dj])
        };
        let height = |k: usize| {
            let (s, t) = (
                0.5 * (1.0 + xi.clamp(-1.0, 1.0)),
                0.5 * (1.0 + eta.clamp(-1.0, 1.0)),
            );
            (corner(k, 0, 0) * (1.0 - s) + corner(k, 1, 0) * s) * (1.0 - t)
                + (corner(k, 0, 1) * (1.0 - s) + corner(k, 1, 1) * s) * t
        };
        let mut best: Option<(f64, Place)> = None;
        for k in 0..self.levels.count() - 1 {
            let element = self.hexahedron_of[i + (na - 1) * (j + (nb - 1) * k)];
            if element == NONE {
                continue;
            }
            let (low, high) = (height(k), height(k + 1));
            let zeta = 2.0 * (w - low) / (high - low) - 1.0;
            let outside = |x: f64| (x.abs() - 1.0).max(0.0);
            let miss = outside(xi).max(outside(eta)).max(outside(zeta));
            if best.is_none_or(|(least, _)| miss < least - 1e-9) {
                let reference = Vec3::new(xi, eta, zeta).map(|c| c.clamp(-1.25, 1.25));
                best = Some((
                    miss,
                    Place {
                        element: element as usize,
                        reference,
                    },
                ));
            }
        }
        best
    }

    /// Nodes on the lower (`false`) or upper (`true`) end of the object along the layer axis: those that have no element
    /// beyond them in their column.
    pub fn end_nodes(&self, upper: bool) -> Vec<usize> {
        let Elements::Hexahedra(cells) = &self.mesh.elements else {
            return Vec::new();
        };
        let (na, nb) = (self.lines[0].len(), self.lines[1].len());
        let layers = self.levels.count() - 1;
        let mut is_end = vec![false; self.mesh.nodes.len()];
        for j in 0..nb - 1 {
            for i in 0..na - 1 {
                let of = |k: usize| self.hexahedron_of[i + (na - 1) * (j + (nb - 1) * k)];
                let found = if upper {
                    (0..layers).rev().map(of).find(|&e| e != NONE)
                } else {
                    (0..layers).map(of).find(|&e| e != NONE)
                };
                let Some(e) = found else { continue };
                let face = if upper { 4..8 } else { 0..4 };
                for &node in &cells[e as usize][face] {
                    is_end[node as usize] = true;
                }
            }
        }
        (0..is_end.len()).filter(|&n| is_end[n]).collect()
    }
}

impl Levels {
    /// How many levels there are.
    pub fn count(&self) -> usize {
        match self {
            Levels::Flat(heights) => heights.len(),
            Levels::Following(_, shares) => shares.len(),
        }
    }

    /// Height of level `k` \[mm\] over the coordinates `a`, `b`.
    pub fn height(&self, k: usize, a: f64, b: f64) -> f64 {
        match self {
            Levels::Flat(heights) => heights[k],
            Levels::Following(surfaces, shares) => {
                let [low, high] = surfaces.at(a, b);
                low + shares[k] * (high - low)
            }
        }
    }
}

/// Lines from `low` to `high` about `size` apart, with one at each of `extra`; an extra line that falls next to a regular one
/// replaces it.
fn grid_lines(low: f64, high: f64, size: f64, extra: &[f64]) -> Vec<f64> {
    let mut borders = vec![low, high];
    borders.extend(
        extra
            .iter()
            .filter(|&&x| x > low + 0.1 * size && x < high - 0.1 * size),
    );
    borders.sort_by(f64::total_cmp);
    borders.dedup_by(|a, b| (*a - *b).abs() < 0.1 * size);
    let mut lines = vec![borders[0]];
    for pair in borders.windows(2) {
        let n = ((pair[1] - pair[0]) / size).round().max(1.0) as usize;
        lines.extend((1..=n).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / n as f64));
    }
    lines
}

fn cell_of(lines: &[f64], x: f64) -> usize {
    lines
        .partition_point(|&l| l <= x)
        .saturating_sub(1)
        .min(lines.len() - 2)
}

/// Fill of the octants of all cells of one column, lowest first.
fn column_fill(
    solid: &Solid,
    axis: Axis,
    lines: &[Vec<f64>; 2],
    levels: &Levels,
    i: usize,
    j: usize,
) -> Vec<[f64; 8]> {
    let layers = levels.count() - 1;
    let mut fill = vec![[0.0; 8]; layers];
    // Octants in the order of the nodes: counter-clockwise below, then above.
    let octant = |half_a: usize, half_b: usize, upper: usize| [[0, 3], [1, 2]][half_a][half_b] + 4 * upper;
    let share = 1.0 / (SAMPLES * SAMPLES) as f64;
    for sa in 0..2 * SAMPLES {
        for sb in 0..2 * SAMPLES {
            let between = |l: &[f64], i: usize, s: usize| {
                l[i] + (l[i + 1] - l[i]) * (s as f64 + 0.5) / (2 * SAMPLES) as f64
            };
            let (a, b) = (between(&lines[0], i, sa), between(&lines[1], j, sb));
            let spans = solid.intervals(axis, a, b);
            if spans.is_empty() {
                continue;
            }
            for (k, fill) in fill.iter_mut().enumerate() {
                let (low, high) = (levels.height(k, a, b), levels.height(k + 1, a, b));
                let middle = 0.5 * (low + high);
                for (upper, (from, to)) in [(low, middle), (middle, high)].into_iter().enumerate() {
                    let inside: f64 = spans
                        .iter()
                        .map(|s| (s[1].min(to) - s[0].max(from)).max(0.0))
                        .sum();
                    fill[octant(sa / SAMPLES, sb / SAMPLES, upper)] += share * inside / (to - from);
                }
            }
        }
    }
    fill
}
