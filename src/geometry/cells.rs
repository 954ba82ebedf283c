//! Cells: the parts of an object that take one material each.
//!
//! A goal names regions; each is cut into layers along an axis, either flat (equal slices of the region's extent) or
//! following the object's own height (equal shares between its lower and upper surface). A point belongs to the first
//! region that contains it. Cells are numbered region by region, from the lowest layer up.
//!
//! A region may also be cut across its axis, into columns; columns of several layers are *voxels*. In a layer they are
//! numbered along the first of the two other axes (in cyclic order) first.

use super::axis::Axis;
use super::heights::Heights;
use super::region::Region;
use super::solid::Solid;
use crate::math::Vec3;

/// How a region is cut into layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// Equal shares between the object's lower and upper surface.
    Follow,
    /// Equal slices of the region's extent.
    Flat,
}

/// A region and its layers.
#[derive(Clone, Debug)]
pub struct LayeredRegion {
    /// Its name.
    pub name: String,
    /// Where it is.
    pub region: Region,
    /// The axis that the layers are stacked along.
    pub axis: Axis,
    /// How the layers are cut.
    pub style: Style,
    /// Layer borders, ascending, `(layers + 1)`: shares for [`Style::Follow`], coordinates \[mm\] for [`Style::Flat`].
    pub borders: Vec<f64>,
    /// Borders of the columns along the two other axes, in cyclic order, ascending \[mm\], `(columns + 1)` each; empty for
    /// one column.
    pub across: [Vec<f64>; 2],
}

impl LayeredRegion {
    /// Number of layers.
    pub fn layers(&self) -> usize {
        self.borders.len() - 1
    }

    /// Number of columns along the two other axes, in cyclic order.
    pub fn columns(&self) -> [usize; 2] {
        [0, 1].map(|c| self.across[c].len().saturating_sub(1).max(1))
    }

    /// Is it cut across its axis?
    pub fn is_voxels(&self) -> bool {
        self.across.iter().any(|borders| !borders.is_empty())
    }

    /// Number of cells along x, y and z.
    pub fn counts(&self) -> [usize; 3] {
        let (a, b) = self.axis.others();
        let mut counts = [self.layers(); 3];
        [counts[a], counts[b]] = self.columns();
        counts
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.counts().iter().product()
    }

    /// The cell at `index` cells along x, y and z, counted in the region.
    pub fn number(&self, index: [usize; 3]) -> usize {
        let (a, b) = self.axis.others();
        let [na, nb] = self.columns();
        index[a] + na * (index[b] + nb * index[self.axis.index()])
    }

    /// The place along x, y and z of the cell `number` of the region.
    pub fn index(&self, number: usize) -> [usize; 3] {
        let (a, b) = self.axis.others();
        let [na, nb] = self.columns();
        let mut index = [number / (na * nb); 3];
        (index[a], index[b]) = (number % na, number / na % nb);
        index
    }
}

/// All cells of an object.
#[derive(Clone, Debug)]
pub struct Cells {
    regions: Vec<LayeredRegion>,
    heights: Option<Heights>,
    first: Vec<usize>,
    count: usize,
    /// The borders of each region before any was moved.
    drawn: Vec<Vec<f64>>,
}

/// Borders that layers cannot have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BorderError {
    /// A region has another number of borders.
    #[error("found borders of {found} regions, expected {expected}")]
    Regions {
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// The borders of a region are not as many as they were, or they don't ascend from one end to the other.
    #[error(
        "region {region:?}: found the borders {found:?}, expected {count} numbers that ascend from {from} to {to}"
    )]
    Order {
        /// Its name.
        region: String,
        /// Its borders as given.
        found: Vec<f64>,
        /// How many it has.
        count: usize,
        /// The first one, which stays.
        from: f64,
        /// The last one, which stays.
        to: f64,
    },
}

/// A surface between cells: negative on one side, zero on it, positive on the other \[mm\].
pub type Border<'a> = Box<dyn Fn(&Vec3) -> f64 + Sync + 'a>;

impl Cells {
    /// The cells of `regions`; `heights` are needed where a region follows the object's height.
    pub fn new(regions: Vec<LayeredRegion>, heights: Option<Heights>) -> Cells {
        let mut first = Vec::with_capacity(regions.len());
        let mut count = 0;
        let drawn = regions.iter().map(|r| r.borders.clone()).collect();
        for region in &regions {
            first.push(count);
            count += region.count();
        }
        Cells {
            regions,
            heights,
            first,
            count,
            drawn,
        }
    }

    /// The same cells with other borders between their layers, `(regions × (layers + 1))`; the outer ones stay.
    ///
    /// # Errors
    /// [`BorderError`]: counts that differ, borders that don't ascend, outer borders that moved.
    pub fn moved(&self, borders: &[Vec<f64>]) -> Result<Cells, BorderError> {
        if borders.len() != self.regions.len() {
            return Err(BorderError::Regions {
                found: borders.len(),
                expected: self.regions.len(),
            });
        }
        let mut cells = self.clone();
        for ((region, borders), drawn) in cells.regions.iter_mut().zip(borders).zip(&self.drawn) {
            let (from, to) = (drawn[0], drawn[drawn.len() - 1]);
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (to - from);
            let ascend = borders.windows(2).all(|pair| pair[0] < pair[1]);
            if borders.len() != drawn.len()
                || !ascend
                || !near(borders[0], from)
                || !near(borders[borders.len() - 1], to)
            {
                return Err(BorderError::Order {
                    region: region.name.clone(),
                    found: borders.clone(),
                    count: drawn.len(),
                    from,
                    to,
                });
            }
            region.borders.clone_from(borders);
        }
        Ok(cells)
    }

    /// The borders of each region as they were drawn, before any was moved, `(regions × (layers + 1))`.
    pub fn drawn_borders(&self) -> &[Vec<f64>] {
        &self.drawn
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The regions, in order.
    pub fn regions(&self) -> &[LayeredRegion] {
        &self.regions
    }

    /// The object's lower and upper surface, if a region follows them.
    pub fn heights(&self) -> Option<&Heights> {
        self.heights.as_ref()
    }

    /// The cell that `point` \[mm\] belongs to, or `None` if no region contains it.
    pub fn cell_at(&self, point: &Vec3) -> Option<usize> {
        let (index, region) = self
            .regions
            .iter()
            .enumerate()
            .find(|(_, region)| region.region.contains(point))?;
        let (a, b) = region.axis.others();
        let mut place = [0; 3];
        place[region.axis.index()] = slot(&region.borders, self.height_in(region, point));
        (place[a], place[b]) = (
            slot(&region.across[0], point[a]),
            slot(&region.across[1], point[b]),
        );
        Some(self.first[index] + region.number(place))
    }

    /// Number of the first cell of each region.
    pub fn first_cells(&self) -> &[usize] {
        &self.first
    }

    /// Is any region cut across its axis?
    pub fn has_voxels(&self) -> bool {
        self.regions.iter().any(LayeredRegion::is_voxels)
    }

    fn height_in(&self, region: &LayeredRegion, point: &Vec3) -> f64 {
        match (&self.heights, region.style) {
            (Some(heights), Style::Follow) => heights.relative(point),
            _ => point[region.axis.index()],
        }
    }

    /// Name of a cell for people: "sole 2" is the second layer from below, "block 3 4 10" a voxel by its place along x, y
    /// and z, a direction of one cell left out.
    pub fn name(&self, cell: usize) -> String {
        let (region, number) = self.place(cell);
        let index = region.index(number);
        let counts = region.counts();
        (0..3)
            .filter(|&c| counts[c] > 1)
            .fold(region.name.clone(), |name, c| format!("{name} {}", index[c] + 1))
    }

    /// The region of a cell and its number in it; of a region in layers alone that is the layer, from 0 below.
    pub fn place(&self, cell: usize) -> (&LayeredRegion, usize) {
        let index = self.first.partition_point(|&f| f <= cell).saturating_sub(1);
        (&self.regions[index], cell - self.first[index])
    }

    /// The surfaces between cells.
    pub fn borders(&self) -> Vec<Border<'_>> {
        let mut borders: Vec<Border<'_>> = Vec::new();
        for region in &self.regions {
            if !matches!(region.region, Region::Everything) {
                borders.push(Box::new(|p: &Vec3| region.region.level(p)));
            }
            if region.is_voxels() {
                let (a, b) = region.axis.others();
                let axes = [(a, &region.across[0]), (b, &region.across[1])];
                for (component, lines) in axes.into_iter().filter(|(_, lines)| lines.len() > 2) {
                    borders.push(Box::new(move |p: &Vec3| wave(lines, p[component])));
                }
                if region.layers() > 1 {
                    borders.push(self.layers_at_once(region));
                }
                continue;
            }
            for &border in &region.borders[1..region.borders.len() - 1] {
                borders.push(match (&self.heights, region.style) {
                    (Some(heights), Style::Follow) => {
                        let (a, b) = region.axis.others();
                        Box::new(move |p: &Vec3| {
                            let [low, high] = heights.at(p[a], p[b]);
                            p[region.axis.index()] - low - border * (high - low)
                        })
                    }
                    _ => Box::new(move |p: &Vec3| p[region.axis.index()] - border),
                });
            }
        }
        borders
    }

    /// All borders between a region's layers as one function.
    fn layers_at_once<'a>(&'a self, region: &'a LayeredRegion) -> Border<'a> {
        let (a, b) = region.axis.others();
        Box::new(move |p: &Vec3| match (&self.heights, region.style) {
            (Some(heights), Style::Follow) => {
                let [low, high] = heights.at(p[a], p[b]);
                let thickness = (high - low).max(f64::MIN_POSITIVE);
                wave(&region.borders, heights.relative(p)) * thickness
            }
            _ => wave(&region.borders, p[region.axis.index()]),
        })
    }

    /// Edge length of the elements across the layers \[mm\]: as `asked`, but no more than a voxel, and lines as near as a fifth
    /// of it are still told apart.
    pub fn element_size_mm(&self, asked: f64) -> f64 {
        let voxels = self.regions.iter().filter(|r| r.is_voxels());
        let flat = voxels.flat_map(|r| {
            let along = (r.style == Style::Flat).then_some(&r.borders);
            r.across.iter().chain(along)
        });
        let widths = flat
            .filter(|lines| lines.len() > 2)
            .flat_map(|lines| lines.windows(2).map(|pair| pair[1] - pair[0]));
        let (least, most) = widths.fold((f64::INFINITY, 0.0f64), |(least, most), w| {
            (least.min(w), most.max(w))
        });
        if most > 0.0 {
            asked.min(most).min(5.0 * least)
        } else {
            asked
        }
    }

    /// The narrowest cell that `solid` gets in a region \[mm\], in any direction: [`Cells::thinnest_layer`], or the
    /// narrowest column.
    pub fn narrowest(&self, region: &LayeredRegion, solid: &Solid) -> f64 {
        let columns = region
            .across
            .iter()
            .flat_map(|lines| lines.windows(2).map(|pair| pair[1] - pair[0]));
        columns.fold(self.thinnest_layer(region, solid), f64::min)
    }

    /// The thinnest layer that `solid` gets in a region \[mm\]: the fifth percentile over the object where layers follow
    /// its height.
    pub fn thinnest_layer(&self, region: &LayeredRegion, solid: &Solid) -> f64 {
        let whole = region.borders[region.borders.len() - 1] - region.borders[0];
        let thin = region.borders.windows(2).map(|pair| pair[1] - pair[0]);
        thin.fold(f64::INFINITY, f64::min) / whole * self.height_of(region, solid)
    }

    /// Extent of a region along its axis \[mm\]: the fifth percentile of the object's height in it where layers follow that.
    pub fn height_of(&self, region: &LayeredRegion, solid: &Solid) -> f64 {
        let (Some(heights), Style::Follow) = (&self.heights, region.style) else {
            return region.borders[region.borders.len() - 1] - region.borders[0];
        };
        let (low, high) = solid.bounds();
        let (a, b) = region.axis.others();
        let at = |c: usize, k: usize| low[c] + (high[c] - low[c]) * (k as f64 + 0.5) / 40.0;
        let mut thickness = Vec::new();
        for i in 0..40 {
            for j in 0..40 {
                let [bottom, top] = heights.at(at(a, i), at(b, j));
                let middle = region.axis.point(0.5 * (bottom + top), at(a, i), at(b, j));
                if solid.contains(&middle) && region.region.contains(&middle) {
                    thickness.push(top - bottom);
                }
            }
        }
        thickness.sort_by(f64::total_cmp);
        thickness.get(thickness.len() / 20).copied().unwrap_or(0.0)
    }
}

/// Which of the intervals between ascending `borders` holds `x`; the outer ones have no end.
fn slot(borders: &[f64], x: f64) -> usize {
    match borders.len() {
        0..=2 => 0,
        n => borders[1..n - 1].partition_point(|&b| b <= x),
    }
}

/// Zero at each inner one of the ascending `borders`, with another sign in each interval between them: the distance to
/// the nearest inner border. One function for all of them, because a tiling remembers the functions that it cuts by.
fn wave(borders: &[f64], x: f64) -> f64 {
    let k = slot(borders, x);
    let inner = &borders[1..borders.len() - 1];
    let below = k.checked_sub(1).map_or(f64::INFINITY, |k| x - inner[k]);
    let above = inner.get(k).map_or(f64::INFINITY, |b| b - x);
    let distance = below.min(above);
    if k.is_multiple_of(2) { -distance } else { distance }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_regions() -> Cells {
        let inner = Region::Box {
            min: Vec3::new(0.0, 0.0, 0.0),
            max: Vec3::new(10.0, 10.0, 6.0),
        };
        let region = |name: &str, region, borders: Vec<f64>| LayeredRegion {
            name: name.into(),
            region,
            axis: Axis::Z,
            style: Style::Flat,
            borders,
            across: Default::default(),
        };
        Cells::new(
            vec![
                region("heel", inner, vec![0.0, 3.0, 6.0]),
                region("rest", Region::Everything, vec![0.0, 2.0, 4.0, 6.0]),
            ],
            None,
        )
    }

    #[test]
    fn points_fall_into_the_first_region_and_the_layer_of_their_height() {
        let cells = two_regions();
        assert_eq!(cells.count(), 5);
        assert_eq!(cells.cell_at(&Vec3::new(5.0, 5.0, 1.0)), Some(0));
        assert_eq!(cells.cell_at(&Vec3::new(5.0, 5.0, 3.5)), Some(1));
        assert_eq!(cells.cell_at(&Vec3::new(50.0, 5.0, 3.5)), Some(3));
        // Rounding at the object's surface must not drop a point out of the outer layers.
        assert_eq!(cells.cell_at(&Vec3::new(50.0, 5.0, -0.1)), Some(2));
        assert_eq!(cells.cell_at(&Vec3::new(50.0, 5.0, 6.1)), Some(4));
        assert_eq!(cells.name(1), "heel 2");
        assert_eq!(cells.name(2), "rest 1");
    }

    #[test]
    fn moved_borders_move_the_cells_between_them() {
        let cells = two_regions();
        let moved = cells
            .moved(&[vec![0.0, 1.0, 6.0], vec![0.0, 2.0, 4.5, 6.0]])
            .unwrap();
        assert_eq!(moved.cell_at(&Vec3::new(5.0, 5.0, 1.5)), Some(1));
        assert_eq!(moved.cell_at(&Vec3::new(50.0, 5.0, 4.2)), Some(3));
        assert_eq!(moved.drawn_borders(), cells.drawn_borders());
        for wrong in [
            vec![vec![0.0, 1.0, 6.0]],
            vec![vec![0.0, 6.0], vec![0.0, 2.0, 4.0, 6.0]],
            vec![vec![0.0, 6.5, 6.0], vec![0.0, 2.0, 4.0, 6.0]],
            vec![vec![0.5, 1.0, 6.0], vec![0.0, 2.0, 4.0, 6.0]],
            vec![vec![0.0, f64::NAN, 6.0], vec![0.0, 2.0, 4.0, 6.0]],
        ] {
            assert!(cells.moved(&wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn borders_change_sign_between_neighbouring_cells() {
        let cells = two_regions();
        let borders = cells.borders();
        assert_eq!(borders.len(), 4);
        let separated = |p: Vec3, q: Vec3| borders.iter().any(|b| b(&p) * b(&q) < 0.0);
        assert!(separated(Vec3::new(5.0, 5.0, 1.0), Vec3::new(5.0, 5.0, 4.0)));
        assert!(separated(Vec3::new(5.0, 5.0, 1.0), Vec3::new(15.0, 5.0, 1.0)));
        assert!(!separated(Vec3::new(15.0, 5.0, 4.5), Vec3::new(17.0, 5.0, 5.5)));
    }

    /// Three along x, two along y, four along z of a box of 3 × 2 × 4 mm.
    fn voxels(axis: Axis) -> LayeredRegion {
        let lines = |n: usize| (0..=n).map(|k| k as f64).collect::<Vec<f64>>();
        let counts = [3, 2, 4];
        let (a, b) = axis.others();
        LayeredRegion {
            name: "block".into(),
            region: Region::Everything,
            axis,
            style: Style::Flat,
            borders: lines(counts[axis.index()]),
            across: [lines(counts[a]), lines(counts[b])],
        }
    }

    #[test]
    fn voxels_are_numbered_and_named_by_their_place_whatever_their_axis() {
        for axis in [Axis::X, Axis::Y, Axis::Z] {
            let region = voxels(axis);
            assert_eq!((region.counts(), region.count()), ([3, 2, 4], 24));
            let cells = Cells::new(vec![region], None);
            let mut seen = [false; 24];
            for (x, y, z) in (0..24).map(|k| (k % 3, k / 3 % 2, k / 6)) {
                let point = Vec3::new(x as f64 + 0.5, y as f64 + 0.25, z as f64 + 0.9);
                let cell = cells.cell_at(&point).unwrap();
                assert!(!std::mem::replace(&mut seen[cell], true));
                assert_eq!(cells.regions()[0].index(cell), [x, y, z]);
                assert_eq!(cells.name(cell), format!("block {} {} {}", x + 1, y + 1, z + 1));
            }
            // Beyond the outer borders the outer voxels go on.
            let corner = cells.cell_at(&Vec3::new(-1.0, 9.0, 9.0)).unwrap();
            assert_eq!(cells.regions()[0].index(corner), [0, 1, 3]);
        }
    }

    #[test]
    fn voxels_of_one_axis_share_one_border_function() {
        let cells = Cells::new(vec![voxels(Axis::Z)], None);
        let borders = cells.borders();
        assert_eq!(borders.len(), 3);
        let separated = |p: Vec3, q: Vec3| borders.iter().any(|b| b(&p) * b(&q) < 0.0);
        let middle = |x: usize, y: usize, z: usize| Vec3::new(x as f64 + 0.5, y as f64 + 0.5, z as f64 + 0.5);
        assert!(separated(middle(0, 0, 0), middle(1, 0, 0)));
        assert!(separated(middle(1, 0, 2), middle(1, 0, 3)));
        assert!(separated(middle(2, 0, 1), middle(2, 1, 1)));
        assert!(!separated(middle(2, 0, 1), Vec3::new(2.9, 0.1, 1.2)));
        // The distance to the nearest border, so that roots are found in a step or two.
        assert!((borders[2](&Vec3::new(0.0, 0.0, 1.3)) - 0.3).abs() < 1e-12);
        assert!((borders[2](&Vec3::new(0.0, 0.0, 0.9)) + 0.1).abs() < 1e-12);
    }
}
