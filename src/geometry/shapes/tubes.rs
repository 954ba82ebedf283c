//! A block with round tubes along z, meshed with hexahedra that follow the holes.
//!
//! Around each hole lies one cell of the array, a hexagon or a square, with lines from the hole to the cell's border and
//! rings between (an O-grid); the plane mesh is drawn along z. Few elements follow a fine hole that way.
//!
//! ```text
//! φ = π d² / (4 A)           A = s² √3/2 (hexagonal), s² (square)
//! r'² = 2π r² / (n sin(2π/n))                    the polygon with n corners has the circle's area
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | d, r, s | diameter, radius, spacing of the tubes | mm |
//! | φ | share of the tubes in the volume | – |
//! | A | area of a cell | mm² |
//! | n, r' | corners of the polygon that stands for the hole, and their distance from its middle | –, mm |
//!
//! In a hexagonal array every second row begins half a spacing later: its first and last hole are cut in half by the block's
//! ends in x. The ends in y pass midway between rows, so that no hole is cut there. Both keep the array's share of tubes.
//! Validity: tubes that leave walls of some percent of the spacing.

use super::error::{ShapeError, within};
use crate::geometry::volume::{Elements, VolumeMesh};
use crate::math::Vec3;
use std::collections::HashMap;
use std::f64::consts::PI;

/// How the tubes stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TubeArray {
    /// Rows shifted by half a spacing, √3/2 spacings apart: isotropic across the tubes.
    Hexagonal,
    /// Rows one spacing apart.
    Square,
}

impl TubeArray {
    /// Distance of rows as a share of the spacing.
    pub fn row_pitch(self) -> f64 {
        match self {
            TubeArray::Hexagonal => 0.75_f64.sqrt(),
            TubeArray::Square => 1.0,
        }
    }

    /// Corners of a cell.
    fn sides(self) -> usize {
        match self {
            TubeArray::Hexagonal => 6,
            TubeArray::Square => 4,
        }
    }
}

/// A block of tubes and how finely it is meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeBlock {
    /// Diameter of a tube \[mm\].
    pub diameter_mm: f64,
    /// Distance of neighbouring tubes' axes \[mm\].
    pub spacing_mm: f64,
    /// How they stand.
    pub array: TubeArray,
    /// Tubes in a row (along x) and rows (along y).
    pub count: [usize; 2],
    /// Height of the block, which is the tubes' length \[mm\].
    pub height_mm: f64,
    /// Elements along each side of a cell.
    pub along_side: usize,
    /// Elements from a hole to the border of its cell.
    pub rings: usize,
    /// Elements along z.
    pub layers: usize,
}

/// More elements than this are refused.
const MOST_ELEMENTS: usize = 2_000_000;
/// Widest hole as a share of the distance of rows.
const WALL: f64 = 0.96;
/// Places closer than this share of the spacing are one node.
const SAME: f64 = 1e-6;

impl TubeBlock {
    /// Edges of the block, which lies between the origin and this corner \[mm\].
    pub fn size(&self) -> Vec3 {
        let rows = self.count[1] as f64 * self.array.row_pitch();
        Vec3::new(
            self.count[0] as f64 * self.spacing_mm,
            rows * self.spacing_mm,
            self.height_mm,
        )
    }

    /// φ, the share of the tubes in the volume.
    pub fn share(&self) -> f64 {
        let d = self.diameter_mm / self.spacing_mm;
        PI * d * d / (4.0 * self.array.row_pitch())
    }

    /// Elements that the mesh will have.
    pub fn elements(&self) -> usize {
        let across = self.array.sides() * self.along_side * self.rings;
        [self.count[0], self.count[1], self.layers]
            .iter()
            .fold(across, |n, &k| n.saturating_mul(k))
    }

    /// The hexahedra.
    ///
    /// # Errors
    /// [`ShapeError`]: a size outside its range, tubes that leave no walls, no tubes, no or too many elements.
    pub fn mesh(&self) -> Result<VolumeMesh, ShapeError> {
        self.check()?;
        let (places, quads) = self.plane_mesh();
        let mut nodes = Vec::with_capacity(places.len() * (self.layers + 1));
        for k in 0..=self.layers {
            let z = self.height_mm * k as f64 / self.layers as f64;
            nodes.extend(places.iter().map(|p| Vec3::new(p[0], p[1], z)));
        }
        let mut cells = Vec::with_capacity(quads.len() * self.layers);
        for k in 0..self.layers {
            let (low, high) = ((k * places.len()) as u32, ((k + 1) * places.len()) as u32);
            cells.extend(quads.iter().map(|&[a, b, c, d]| {
                [
                    low + a,
                    low + b,
                    low + c,
                    low + d,
                    high + a,
                    high + b,
                    high + c,
                    high + d,
                ]
            }));
        }
        Ok(VolumeMesh {
            nodes,
            elements: Elements::Hexahedra(cells),
        })
    }

    fn check(&self) -> Result<(), ShapeError> {
        within("spacing", self.spacing_mm, 0.01, 1000.0)?;
        within("height", self.height_mm, 0.01, 3000.0)?;
        self.check_counts()?;
        // The polygon's corners lie outside the circle, and must leave a wall to the block's ends.
        let widest = WALL * self.array.row_pitch() * self.spacing_mm;
        let most = widest * self.diameter_mm / (2.0 * self.hole_radius()).max(f64::MIN_POSITIVE);
        within("diameter", self.diameter_mm, 0.05 * self.spacing_mm, most)?;
        Ok(())
    }

    fn check_counts(&self) -> Result<(), ShapeError> {
        let counts = [
            ("tubes in a row", self.count[0]),
            ("rows", self.count[1]),
            ("elements along a side", self.along_side),
            ("rings", self.rings),
            ("layers", self.layers),
        ];
        let none = |option, value: usize, expected: String| ShapeError {
            option,
            value: value as f64,
            expected,
        };
        for (option, count) in counts {
            if count == 0 {
                return Err(none(option, count, "at least 1 (a count)".into()));
            }
        }
        let elements = self.elements();
        if elements > MOST_ELEMENTS {
            return Err(none(
                "elements",
                elements,
                format!("at most {MOST_ELEMENTS} (a count)"),
            ));
        }
        Ok(())
    }

    /// Nodes and quadrilaterals, counter-clockwise, of the section across the tubes.
    fn plane_mesh(&self) -> (Vec<[f64; 2]>, Vec<[u32; 4]>) {
        let mut plane = PlaneMesh {
            grain: SAME * self.spacing_mm,
            places: Vec::new(),
            quads: Vec::new(),
            known: HashMap::new(),
        };
        let s = self.spacing_mm;
        let all = self.array.sides() * self.along_side;
        for row in 0..self.count[1] {
            let y = (row as f64 + 0.5) * self.array.row_pitch() * s;
            let is_shifted = self.array == TubeArray::Hexagonal && row % 2 == 1;
            let tubes = self.count[0] + usize::from(is_shifted);
            for tube in 0..tubes {
                let x = if is_shifted {
                    tube as f64
                } else {
                    tube as f64 + 0.5
                } * s;
                // Of a hexagon the sides 4, 5, 0 lie to the right of its middle, 1, 2, 3 to the left.
                let n = self.along_side;
                let segments: Vec<usize> = match (is_shifted, tube) {
                    (true, 0) => (4 * n..6 * n).chain(0..n).collect(),
                    (true, t) if t + 1 == tubes => (n..4 * n).collect(),
                    _ => (0..all).collect(),
                };
                self.add_cell(&mut plane, [x, y], row, &segments);
            }
        }
        (plane.places, plane.quads)
    }

    fn add_cell(&self, plane: &mut PlaneMesh, centre: [f64; 2], row: usize, segments: &[usize]) {
        let all = self.array.sides() * self.along_side;
        for &segment in segments {
            let lines = [segment, (segment + 1) % all].map(|at| (self.hole(at), self.border(at, row)));
            for ring in 0..self.rings {
                let node = |plane: &mut PlaneMesh, line: usize, ring: usize| {
                    let (from, to) = lines[line];
                    let t = ring as f64 / self.rings as f64;
                    let at = |c: usize| centre[c] + from[c] * (1.0 - t) + to[c] * t;
                    plane.node([at(0), at(1)])
                };
                let quad = [
                    node(plane, 0, ring),
                    node(plane, 0, ring + 1),
                    node(plane, 1, ring + 1),
                    node(plane, 1, ring),
                ];
                plane.quads.push(quad);
            }
        }
    }

    /// Corner `at` of the polygon that stands for the hole.
    fn hole(&self, at: usize) -> [f64; 2] {
        let step = 2.0 * PI / (self.array.sides() * self.along_side) as f64;
        let first = PI / self.array.sides() as f64;
        let (sin, cos) = (first + step * at as f64).sin_cos();
        let radius = self.hole_radius();
        [radius * cos, radius * sin]
    }

    /// r', where the polygon with the circle's area has its corners \[mm\].
    fn hole_radius(&self) -> f64 {
        let step = 2.0 * PI / (self.array.sides() * self.along_side) as f64;
        // Of a square with one element to a side step is π/2, of all others less.
        0.5 * self.diameter_mm * (step / step.sin()).sqrt()
    }

    /// Point `at` of the cell's border, which follows the block's ends in the first and last row.
    fn border(&self, at: usize, row: usize) -> [f64; 2] {
        let (side, t) = (
            at / self.along_side,
            (at % self.along_side) as f64 / self.along_side as f64,
        );
        let sides = self.array.sides();
        let [a, b] = [self.corner(side, row), self.corner((side + 1) % sides, row)];
        [a[0] * (1.0 - t) + b[0] * t, a[1] * (1.0 - t) + b[1] * t]
    }

    fn corner(&self, k: usize, row: usize) -> [f64; 2] {
        let s = self.spacing_mm;
        if self.array == TubeArray::Square {
            let [x, y] = [[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]][k];
            return [x * s, y * s];
        }
        let (side, tip, end) = (0.5 / 3f64.sqrt(), 1.0 / 3f64.sqrt(), 0.5 * self.array.row_pitch());
        let (is_first, is_last) = (row == 0, row + 1 == self.count[1]);
        let [x, y] = match k {
            0..=2 => {
                let height = if is_last { [end; 3] } else { [side, tip, side] };
                [[0.5, height[0]], [0.0, height[1]], [-0.5, height[2]]][k]
            }
            _ => {
                let depth = if is_first { [end; 3] } else { [side, tip, side] };
                [[-0.5, -depth[0]], [0.0, -depth[1]], [0.5, -depth[2]]][k - 3]
            }
        };
        [x * s, y * s]
    }
}

/// A plane mesh that grows; nodes at one place are one.
struct PlaneMesh {
    grain: f64,
    places: Vec<[f64; 2]>,
    quads: Vec<[u32; 4]>,
    known: HashMap<[i64; 2], u32>,
}

impl PlaneMesh {
    fn node(&mut self, place: [f64; 2]) -> u32 {
        let key = place.map(|x| (x / self.grain).round() as i64);
        // Rounding may put two neighbours into adjoining boxes.
        for dx in -1..=1 {
            for dy in -1..=1 {
                if let Some(&node) = self.known.get(&[key[0] + dx, key[1] + dy]) {
                    return node;
                }
            }
        }
        let node = self.places.len() as u32;
        self.places.push(place);
        self.known.insert(key, node);
        node
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::boundary::boundary_faces;

    fn block(array: TubeArray, diameter_mm: f64) -> TubeBlock {
        TubeBlock {
            diameter_mm,
            spacing_mm: 5.0,
            array,
            count: [3, 4],
            height_mm: 7.0,
            along_side: 2,
            rings: 2,
            layers: 3,
        }
    }

    /// The volume is that of the block less the tubes', exactly, whatever is cut at the ends; all corners of all elements
    /// turn the right way.
    #[test]
    fn the_volume_is_the_solids_share_and_no_corner_is_folded() {
        for array in [TubeArray::Hexagonal, TubeArray::Square] {
            for diameter in [1.0, 2.5, 3.6, 4.0] {
                let block = block(array, diameter);
                let mesh = block.mesh().unwrap();
                let Elements::Hexahedra(cells) = &mesh.elements else {
                    panic!("hexahedra")
                };
                assert_eq!(cells.len(), block.elements());
                let mut volume = 0.0;
                for cell in cells {
                    let at = cell.map(|n| mesh.nodes[n as usize]);
                    let height = at[4].z - at[0].z;
                    let d = [at[2] - at[0], at[3] - at[1]];
                    volume += 0.5 * (d[0].x * d[1].y - d[0].y * d[1].x) * height;
                    for k in 0..4 {
                        let (next, last) = (at[(k + 1) % 4] - at[k], at[(k + 3) % 4] - at[k]);
                        let sine = next.cross(&last).z / (next.norm() * last.norm());
                        assert!(sine > 0.3, "{array:?} {diameter}: {sine}");
                    }
                }
                let whole = block.size().product();
                let share = 1.0 - volume / whole;
                assert!((share - block.share()).abs() < 1e-9, "{share} {}", block.share());
            }
        }
    }

    /// Neighbouring cells share their nodes: the only faces inside the block are those of the holes' walls.
    #[test]
    fn cells_meet_without_gaps() {
        for array in [TubeArray::Hexagonal, TubeArray::Square] {
            let block = block(array, 2.5);
            let mesh = block.mesh().unwrap();
            let size = block.size();
            let (mut walls, mut ends) = (0, 0.0);
            for face in boundary_faces(&mesh) {
                let on = |c: usize, x: f64| {
                    face.nodes()
                        .iter()
                        .all(|&n| (mesh.nodes[n as usize][c] - x).abs() < 1e-9)
                };
                if on(2, size.z) {
                    ends += face.area_vectors(&mesh.nodes).iter().map(|a| a.z).sum::<f64>();
                } else if !(on(2, 0.0) || on(0, 0.0) || on(0, size.x) || on(1, 0.0) || on(1, size.y)) {
                    walls += 1;
                }
            }
            // 12 holes of 6 · 2 or 4 · 2 faces around, 3 layers.
            let around = if array == TubeArray::Hexagonal { 12 } else { 8 };
            assert_eq!(walls, 12 * around * 3);
            assert!((ends - size.x * size.y * (1.0 - block.share())).abs() < 1e-9);
        }
    }

    #[test]
    fn sizes_that_make_no_block_are_refused() {
        let good = block(TubeArray::Hexagonal, 2.5);
        for bad in [
            TubeBlock {
                diameter_mm: 4.9,
                ..good
            },
            TubeBlock {
                diameter_mm: f64::NAN,
                ..good
            },
            TubeBlock {
                count: [0, 4],
                ..good
            },
            TubeBlock { layers: 0, ..good },
            TubeBlock {
                rings: usize::MAX,
                ..good
            },
        ] {
            assert!(bad.mesh().is_err(), "{bad:?}");
        }
    }
}
