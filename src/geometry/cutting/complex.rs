//! The tetrahedra that are cut, and the lattice that they start from.

use super::{CutError, LevelSet};
use crate::math::Vec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// A vertex's bits 0 to 5 say that it lies on the lower or upper plane of the bounds in x, y, z; it never leaves them.
const PLANES: u32 = 6;
/// A vertex's bit for the object's own surface.
pub const SURFACE_BIT: u32 = PLANES;
/// The first of a vertex's bits for interfaces between design cells.
pub const FIRST_INTERFACE_BIT: u32 = SURFACE_BIT + 1;
/// As many interfaces as there are bits left.
pub const MAX_INTERFACES: usize = (u128::BITS - FIRST_INTERFACE_BIT) as usize;

/// A tetrahedron of positive volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tet {
    /// Its vertices, `(4)`; seen from the first, the other three run counter-clockwise around the far side's outside.
    pub v: [u32; 4],
    /// Which side of every interface it lies on: an index into [`Complex::sides`].
    pub class: u32,
}

impl Tet {
    /// Its four faces, counter-clockwise from outside, each named by the vertex it leaves out.
    pub fn faces(&self) -> [[u32; 3]; 4] {
        let [a, b, c, d] = self.v;
        [[b, c, d], [a, d, c], [a, b, d], [a, c, b]]
    }

    /// Its six edges.
    pub fn edges(&self) -> [(u32, u32); 6] {
        let [a, b, c, d] = self.v;
        [(a, b), (a, c), (a, d), (b, c), (b, d), (c, d)]
    }
}

/// A conforming set of tetrahedra: two of them share a whole face, a whole edge, a vertex, or nothing.
#[derive(Debug)]
pub struct Complex {
    /// Vertex positions, `(n × 3)` \[mm\].
    pub points: Vec<Vec3>,
    /// For each vertex, the planes and surfaces that it lies on, one bit each.
    pub on: Vec<u128>,
    /// The tetrahedra.
    pub tets: Vec<Tet>,
    /// For each class, the side of each interface cut so far: true where the level set is positive.
    pub sides: Vec<Vec<bool>>,
    /// Shortest distances between neighbouring planes of the lattice, `(3)` \[mm\].
    pub boxes: Vec3,
}

impl Complex {
    /// Lattice tetrahedra between the planes at `lines`, ascending coordinates along x, y and z \[mm\], at least two each,
    /// without those boxes that lie outside with all their corners; and the level set at every vertex kept.
    ///
    /// # Errors
    /// [`CutError::NotFinite`] where the level set has no answer.
    pub fn lattice(surface: LevelSet, lines: &[Vec<f64>; 3]) -> Result<(Self, Vec<f64>), CutError> {
        let n: [usize; 3] = std::array::from_fn(|k| lines[k].len() - 1);
        let boxes = Vec3::from_fn(|k, _| {
            let steps = lines[k].windows(2).map(|pair| pair[1] - pair[0]);
            steps.fold(f64::INFINITY, f64::min)
        });
        let nodes = n.map(|n| n + 1);
        let split = |id: usize| {
            [
                id % nodes[0],
                id / nodes[0] % nodes[1],
                id / (nodes[0] * nodes[1]),
            ]
        };
        let point = |id: usize| {
            let i = split(id);
            Vec3::new(lines[0][i[0]], lines[1][i[1]], lines[2][i[2]])
        };
        let values: Vec<f64> = (0..nodes.iter().product())
            .into_par_iter()
            .map(|id| surface(&point(id)))
            .collect();
        if let Some(id) = values.iter().position(|f| !f.is_finite()) {
            return Err(CutError::NotFinite {
                what: "the surface's distance".into(),
                point: point(id).into(),
            });
        }

        let mut number = vec![u32::MAX; values.len()];
        let mut complex = Self {
            points: Vec::new(),
            on: Vec::new(),
            tets: Vec::new(),
            sides: vec![Vec::new()],
            boxes,
        };
        let mut kept = Vec::new();
        for_each_box(n, nodes, |corners| {
            if corners.iter().all(|&c| values[c] > 0.0) {
                return;
            }
            let v = corners.map(|c| {
                if number[c] == u32::MAX {
                    number[c] = complex.points.len() as u32;
                    complex.points.push(point(c));
                    complex.on.push(planes(split(c), n));
                    kept.push(values[c]);
                }
                number[c]
            });
            complex.tets.extend(kuhn(v));
        });
        Ok((complex, kept))
    }

    /// Six times the volume of a tetrahedron \[mm³\].
    pub fn six_volumes(&self, v: [u32; 4]) -> f64 {
        let [a, b, c, d] = v.map(|i| self.points[i as usize]);
        (b - a).cross(&(c - a)).dot(&(d - a))
    }

    /// A tetrahedron's centroid \[mm\].
    pub fn centroid(&self, tet: &Tet) -> Vec3 {
        tet.v.iter().map(|&i| self.points[i as usize]).sum::<Vec3>() / 4.0
    }

    /// Appends a vertex and answers its number.
    pub fn push(&mut self, point: Vec3, on: u128) -> u32 {
        self.points.push(point);
        self.on.push(on);
        (self.points.len() - 1) as u32
    }
}

/// New classes for one interface: each old class's two sides.
#[derive(Debug, Default)]
pub struct Classes(HashMap<(u32, bool), u32>);

impl Classes {
    /// The class of pieces of `parent` on one side of the interface being cut.
    pub fn side(&mut self, old: &[Vec<bool>], new: &mut Vec<Vec<bool>>, parent: u32, positive: bool) -> u32 {
        *self.0.entry((parent, positive)).or_insert_with(|| {
            let mut sides = old[parent as usize].clone();
            sides.push(positive);
            new.push(sides);
            (new.len() - 1) as u32
        })
    }
}

/// A level set at all points, or the first point where it is not finite.
pub fn sample(level: LevelSet, points: &[Vec3], what: impl Fn() -> String) -> Result<Vec<f64>, CutError> {
    let values: Vec<f64> = points.par_iter().map(level).collect();
    match values.iter().position(|f| !f.is_finite()) {
        Some(i) => Err(CutError::NotFinite {
            what: what(),
            point: points[i].into(),
        }),
        None => Ok(values),
    }
}

/// Coordinates `(3 × n)` \[mm\] that divide each extent of the bounds evenly, by `spacing` \[mm\] or a little less.
pub fn even_lines((low, high): (Vec3, Vec3), spacing: f64) -> [Vec<f64>; 3] {
    std::array::from_fn(|k| {
        let n = (((high[k] - low[k]) / spacing).ceil() as usize).max(1);
        let step = (high[k] - low[k]) / n as f64;
        let mut lines: Vec<f64> = (0..n).map(|i| low[k] + step * i as f64).collect();
        lines.push(high[k]);
        lines
    })
}

/// Calls `visit` with the eight nodes of each box, x fastest.
fn for_each_box(n: [usize; 3], nodes: [usize; 3], mut visit: impl FnMut([usize; 8])) {
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                visit(std::array::from_fn(|c| {
                    let (i, j, k) = (i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
                    (k * nodes[1] + j) * nodes[0] + i
                }));
            }
        }
    }
}

/// The planes of the bounds on which a node lies.
fn planes(i: [usize; 3], n: [usize; 3]) -> u128 {
    (0..3).fold(0, |on, k| {
        on | u128::from(i[k] == 0) << (2 * k) | u128::from(i[k] == n[k]) << (2 * k + 1)
    })
}

/// A box as six tetrahedra around its diagonal from corner 0 to corner 7: one for each order in which a walk along
/// the axes can take the three steps.
fn kuhn(v: [u32; 8]) -> [Tet; 6] {
    const WALKS: [[usize; 4]; 6] = [
        [0, 1, 3, 7],
        [0, 3, 2, 7],
        [0, 2, 6, 7],
        [0, 6, 4, 7],
        [0, 4, 5, 7],
        [0, 5, 1, 7],
    ];
    WALKS.map(|walk| Tet {
        v: walk.map(|c| v[c]),
        class: 0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattice_fills_its_bounds() {
        let (low, high) = (Vec3::new(-1.0, 0.0, 2.0), Vec3::new(1.0, 1.0, 3.5));
        let (complex, values) = Complex::lattice(&|_| -1.0, &even_lines((low, high), 0.4)).expect("a box");
        assert_eq!(values.len(), complex.points.len());
        let volumes: Vec<f64> = complex
            .tets
            .iter()
            .map(|t| complex.six_volumes(t.v) / 6.0)
            .collect();
        assert!(volumes.iter().all(|v| *v > 0.0));
        // 2 × 1 × 1.5 mm.
        assert!((volumes.iter().sum::<f64>() - 3.0).abs() < 1e-12);
    }
}
