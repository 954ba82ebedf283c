//! Cells: the parts of an object that take one material each.
//!
//! A goal names regions; each is cut into layers along an axis, either flat (equal slices of the region's extent) or
//! following the object's own height (equal shares between its lower and upper surface). A point belongs to the first
//! region that contains it. Cells are numbered region by region, from the lowest layer up.

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
            count += region.borders.len() - 1;
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
        let height = self.height_in(region, point);
        let layers = region.borders.len() - 1;
        let layer = region.borders[1..layers].partition_point(|&b| b <= height);
        Some(self.first[index] + layer)
    }

    fn height_in(&self, region: &LayeredRegion, point: &Vec3) -> f64 {
        match (&self.heights, region.style) {
            (Some(heights), Style::Follow) => heights.relative(point),
            _ => point[region.axis.index()],
        }
    }

    /// Name of a cell for people: "sole 2" is the second layer from below.
    pub fn name(&self, cell: usize) -> String {
        let (region, layer) = self.place(cell);
        let layers = region.borders.len() - 1;
        if layers == 1 {
            region.name.clone()
        } else {
            format!("{} {}", region.name, layer + 1)
        }
    }

    /// The region of a cell and its layer in it, from 0 below.
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
}
