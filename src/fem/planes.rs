//! The planes that layer borders make in a grid: which borders share one, where it was drawn, and where it is now.
//!
//! ```text
//! z(s) = p_k + (s − s_k) (p_{k+1} − p_k) / (s_{k+1} − s_k)      for s_k ≤ s ≤ s_{k+1}
//! ```
//!
//! s_k is where plane k was drawn and p_k where it is: coordinates \[mm\] along the grid's axis, or shares of the object's height.
//! The grid's levels are made for the planes as drawn and moved with them, so that every layer keeps its levels, however thick
//! it is. Borders of several regions that coincide are one plane and move together; a plane does not pass another.

use crate::geometry::axis::Axis;
use crate::geometry::cells::{Cells, LayeredRegion, Style};
use crate::geometry::grid::GridError;
use crate::geometry::solid::Solid;

/// Borders nearer to each other than this share of the whole are one plane.
const ONE_PLANE: f64 = 1e-3;

/// The planes of all borders across a grid's layer axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    /// The grid's layer axis.
    pub axis: Axis,
    /// Do layers follow the object's height? Then planes are shares of it.
    pub follows: bool,
    /// Where each plane was drawn, ascending, the ends of the object included.
    pub drawn: Vec<f64>,
    /// Where it is.
    pub now: Vec<f64>,
    /// The borders that lie on each plane: region, and number of the border in it.
    pub borders: Vec<Vec<[usize; 2]>>,
}

impl Planes {
    /// The planes of `cells` inside `solid`.
    ///
    /// # Errors
    /// [`GridError::Borders`]: borders of one plane that moved apart, or planes that passed each other.
    pub fn of(solid: &Solid, cells: &Cells) -> Result<Planes, GridError> {
        let follows = cells.heights().is_some();
        let axis = match cells.heights() {
            Some(heights) => heights.axis(),
            None => cells.regions().first().map_or(Axis::Z, |r| r.axis),
        };
        let (low, high) = solid.bounds();
        let ends = match follows {
            true => [0.0, 1.0],
            false => [low[axis.index()], high[axis.index()]],
        };
        let own = |r: &LayeredRegion| r.axis == axis && (r.style == Style::Follow) == follows;
        let mut places: Vec<(f64, f64, Option<[usize; 2]>)> =
            ends.iter().map(|&end| (end, end, None)).collect();
        for (r, (region, drawn)) in cells.regions().iter().zip(cells.drawn_borders()).enumerate() {
            if own(region) {
                let both = drawn.iter().zip(&region.borders).enumerate();
                places.extend(both.map(|(b, (&drawn, &now))| (drawn, now, Some([r, b]))));
            }
        }
        // Stable: of equal places the ends come first, so that a plane at an end stays there.
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        let whole = places[places.len() - 1].0 - places[0].0;
        let mut planes = Planes {
            axis,
            follows,
            drawn: Vec::new(),
            now: Vec::new(),
            borders: Vec::new(),
        };
        for (drawn, now, border) in places {
            let last = planes.drawn.len();
            if last == 0 || drawn - planes.drawn[last - 1] >= ONE_PLANE * whole {
                planes.drawn.push(drawn);
                planes.now.push(now);
                planes.borders.push(border.into_iter().collect());
            } else {
                if (now - planes.now[last - 1]).abs() > ONE_PLANE * whole {
                    return Err(GridError::Borders {
                        first: planes.now[last - 1],
                        second: now,
                    });
                }
                planes.borders[last - 1].extend(border);
            }
        }
        match planes.now.windows(2).find(|pair| pair[0] >= pair[1]) {
            Some(pair) => Err(GridError::Borders {
                first: pair[0],
                second: pair[1],
            }),
            None => Ok(planes),
        }
    }

    /// Where a level is that was drawn at `level`.
    pub fn at(&self, level: f64) -> f64 {
        if self.now == self.drawn {
            return level;
        }
        let last = self.drawn.len() - 2;
        let k = self
            .drawn
            .partition_point(|&s| s <= level)
            .saturating_sub(1)
            .min(last);
        let share = (level - self.drawn[k]) / (self.drawn[k + 1] - self.drawn[k]);
        self.now[k] + share * (self.now[k + 1] - self.now[k])
    }

    /// May plane `k` move? Not at an end of the object or of a region.
    pub fn may_move(&self, k: usize, cells: &Cells) -> bool {
        let inner = |&[r, b]: &[usize; 2]| b > 0 && b + 1 < cells.regions()[r].borders.len();
        k > 0 && k + 1 < self.drawn.len() && self.borders[k].iter().all(inner)
    }

    /// The borders of all regions with the planes at `places`, `(planes)`.
    pub fn borders_at(&self, cells: &Cells, places: &[f64]) -> Vec<Vec<f64>> {
        let mut borders: Vec<Vec<f64>> = cells.regions().iter().map(|r| r.borders.clone()).collect();
        for (k, (own, &place)) in self.borders.iter().zip(places).enumerate() {
            if self.may_move(k, cells) {
                own.iter().for_each(|&[r, b]| borders[r][b] = place);
            }
        }
        borders
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::region::Region;
    use crate::geometry::shapes::block::block;
    use crate::math::Vec3;

    fn cells() -> (Solid, Cells) {
        let region = |name: &str, region, borders| LayeredRegion {
            name: name.into(),
            region,
            axis: Axis::Z,
            style: Style::Flat,
            borders,
            across: [Vec::new(), Vec::new()],
        };
        let inner = Region::Box {
            min: Vec3::zeros(),
            max: Vec3::new(5.0, 10.0, 8.0),
        };
        let cells = Cells::new(
            vec![
                region("a", inner, vec![0.0, 4.0, 8.0]),
                region("b", Region::Everything, vec![0.0, 4.0, 6.0, 12.0]),
            ],
            None,
        );
        (
            Solid::new(block(Vec3::new(10.0, 10.0, 12.0), 5.0).unwrap()).unwrap(),
            cells,
        )
    }

    #[test]
    fn borders_that_coincide_are_one_plane_and_ends_of_regions_stay() {
        let (solid, cells) = cells();
        let planes = Planes::of(&solid, &cells).unwrap();
        assert_eq!(planes.drawn, [0.0, 4.0, 6.0, 8.0, 12.0]);
        let free: Vec<usize> = (0..5).filter(|&k| planes.may_move(k, &cells)).collect();
        assert_eq!(free, [1, 2]);
        let borders = planes.borders_at(&cells, &[0.0, 3.0, 7.0, 8.0, 12.0]);
        assert_eq!(borders, [vec![0.0, 3.0, 8.0], vec![0.0, 3.0, 7.0, 12.0]]);
        let moved = Planes::of(&solid, &cells.moved(&borders).unwrap()).unwrap();
        assert_eq!(moved.now, [0.0, 3.0, 7.0, 8.0, 12.0]);
        // Half way between drawn planes is half way between where they are.
        assert_eq!([2.0, 5.0, 7.0, 10.0].map(|s| moved.at(s)), [1.5, 5.0, 7.5, 10.0]);
    }

    #[test]
    fn borders_that_part_or_pass_are_refused() {
        let (solid, cells) = cells();
        for wrong in [
            [vec![0.0, 3.0, 8.0], vec![0.0, 4.0, 6.0, 12.0]],
            [vec![0.0, 4.0, 8.0], vec![0.0, 4.0, 9.0, 12.0]],
        ] {
            let moved = cells.moved(&wrong).unwrap();
            assert!(Planes::of(&solid, &moved).is_err(), "{wrong:?}");
        }
    }
}
