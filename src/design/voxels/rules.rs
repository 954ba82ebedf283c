//! `[voxels]`: which cells must be alike, and which materials must hang together.
//!
//! Cells that must be alike share a *variable*: mirror images, and voxels of one block where features must not be smaller.
//! A block takes at least `least_feature` along each axis; blocks of a row are as even as can be and mirror images of
//! one another, so that both ties can hold at once.

use crate::fem::setup::positive_length;
use crate::geometry::axis::Axis;
use crate::geometry::cells::{Cells, LayeredRegion, Style};
use crate::geometry::solid::Solid;
use crate::math::Vec3;
use crate::units::document::{Document, Mistake};
use serde::Deserialize;
use toml::Spanned;

/// `[voxels]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VoxelsText {
    /// Mirror planes through the middle of the object, by their normals.
    pub symmetry: Option<Spanned<Vec<Axis>>>,
    /// Least size of anything of one material, with unit.
    pub least_feature: Option<Spanned<String>>,
    /// Ids of materials each of which must be one part, connected by faces.
    pub connected: Option<Spanned<Vec<Spanned<String>>>>,
}

/// The rules, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelRules {
    /// The variable of each cell, `(cells)`; numbered by their first cells.
    pub variable_of_cell: Vec<u32>,
    /// How many variables there are.
    pub variables: usize,
    /// Indices in the palette of the materials that must be connected.
    pub connected: Vec<u8>,
}

impl VoxelRules {
    /// Every cell for itself.
    pub fn free(cells: usize) -> VoxelRules {
        VoxelRules {
            variable_of_cell: (0..cells as u32).collect(),
            variables: cells,
            connected: Vec::new(),
        }
    }
}

/// Reads the rules for `cells` of `solid`; `palette` holds the ids of the base materials.
///
/// # Errors
/// [`Mistake`]: a cell without a mirror image, features larger than a region, a material that the palette lacks.
pub fn read_voxel_rules(
    document: &Document,
    text: &VoxelsText,
    cells: &Cells,
    solid: &Solid,
    palette: &[&str],
) -> Result<VoxelRules, Mistake> {
    let mut ties = Ties((0..cells.count() as u32).collect());
    let mirrors = text.symmetry.as_ref();
    if let Some(axes) = mirrors {
        for axis in axes.get_ref() {
            mirror(document, &axes.span(), *axis, cells, solid, &mut ties)?;
        }
    }
    if let Some(least) = &text.least_feature {
        let least_mm = positive_length(document, least)?;
        for (region, &first) in cells.regions().iter().zip(cells.first_cells()) {
            let blocks = blocks(region, least_mm).map_err(|m| document.mistake(&least.span(), m))?;
            for number in 0..region.count() {
                let index = region.index(number);
                let corner = std::array::from_fn(|c| {
                    let k = blocks[c].partition_point(|&b| b <= index[c]) - 1;
                    blocks[c][k]
                });
                ties.join(first + number, first + region.number(corner));
            }
        }
    }
    let mut connected = Vec::new();
    for id in text.connected.iter().flat_map(|list| list.get_ref()) {
        let Some(m) = palette.iter().position(|p| p == id.get_ref()) else {
            let message = format!(
                "material {:?} is not in the palette, which holds {palette:?}",
                id.get_ref()
            );
            return Err(document.mistake(&id.span(), message));
        };
        connected.push(m as u8);
    }
    connected.sort_unstable();
    connected.dedup();
    let (variable_of_cell, variables) = ties.numbered();
    Ok(VoxelRules {
        variable_of_cell,
        variables,
        connected,
    })
}

/// Ties each cell to its image in the plane through the object's middle with normal `axis`.
fn mirror(
    document: &Document,
    span: &std::ops::Range<usize>,
    axis: Axis,
    cells: &Cells,
    solid: &Solid,
    ties: &mut Ties,
) -> Result<(), Mistake> {
    let (low, high) = solid.bounds();
    let c = axis.index();
    for cell in 0..cells.count() {
        let Some(middle) = middle(cells, cell) else {
            let message = "found symmetry with a region in layers, or one that follows the object's height, expected flat voxels or columns";
            return Err(document.mistake(span, message));
        };
        // A region without a shape goes on around others: its cell may have its middle in one of them.
        if cells.cell_at(&middle) != Some(cell) {
            continue;
        }
        let mut image = middle;
        image[c] = low[c] + high[c] - middle[c];
        let other = cells.cell_at(&image);
        let back = other
            .and_then(|o| self::middle(cells, o))
            .map(|m| (m - image).norm());
        let near = 1e-6 * (high - low).norm();
        let (Some(other), true) = (other, back.is_some_and(|d| d <= near)) else {
            let message = format!(
                "cell {:?} has no mirror image across the middle of the object: its regions must be symmetric too",
                cells.name(cell)
            );
            return Err(document.mistake(span, message));
        };
        ties.join(cell, other);
    }
    Ok(())
}

/// The middle of a cell \[mm\]; `None` where it is not at one place for all columns.
fn middle(cells: &Cells, cell: usize) -> Option<Vec3> {
    let (region, number) = cells.place(cell);
    if region.style == Style::Follow {
        return None;
    }
    let index = region.index(number);
    let (a, b) = region.axis.others();
    let between = |lines: &[f64], k: usize| match lines.len() {
        0 | 1 => None,
        _ => Some(0.5 * (lines[k] + lines[k + 1])),
    };
    let mut middle = Vec3::zeros();
    middle[region.axis.index()] = between(&region.borders, index[region.axis.index()])?;
    middle[a] = between(&region.across[0], index[a])?;
    middle[b] = between(&region.across[1], index[b])?;
    Some(middle)
}

/// For each of x, y and z the first voxels of the blocks that take at least `least_mm`.
fn blocks(region: &LayeredRegion, least_mm: f64) -> Result<[Vec<usize>; 3], String> {
    let (a, b) = region.axis.others();
    let mut result = [(); 3].map(|()| vec![0]);
    for (c, lines) in [
        (region.axis.index(), &region.borders),
        (a, &region.across[0]),
        (b, &region.across[1]),
    ] {
        let n = lines.len().saturating_sub(1);
        // Layers that follow the height have no one thickness: `least_layer` is for them.
        if n < 2 || (c == region.axis.index() && region.style == Style::Follow) {
            result[c] = (0..n.max(1)).collect();
            continue;
        }
        let width = lines[1] - lines[0];
        let voxels = (least_mm / width - 1e-9).ceil().max(1.0) as usize;
        if voxels > n {
            return Err(format!(
                "region {:?} is {:.2} mm along {}, less than the least feature of {least_mm} mm",
                region.name,
                width * n as f64,
                ["x", "y", "z"][c]
            ));
        }
        result[c] = starts(n, n / voxels);
    }
    Ok(result)
}

/// The first of the voxels of `count` blocks in a row of `n`, each of at least n/count voxels rounded down, and the row of
/// blocks its own mirror image. An odd row has no even number of such blocks.
fn starts(n: usize, count: usize) -> Vec<usize> {
    let count = if n % 2 == 1 && count.is_multiple_of(2) {
        count - 1
    } else {
        count
    };
    (0..count)
        .map(|q| {
            if 2 * q <= count {
                n * q / count
            } else {
                n - n * (count - q) / count
            }
        })
        .collect()
}

/// Sets of cells that are alike.
struct Ties(Vec<u32>);

impl Ties {
    fn root(&mut self, cell: usize) -> usize {
        let mut at = cell;
        while self.0[at] as usize != at {
            self.0[at] = self.0[self.0[at] as usize];
            at = self.0[at] as usize;
        }
        at
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b) as u32;
    }

    fn numbered(mut self) -> (Vec<u32>, usize) {
        let mut number = vec![u32::MAX; self.0.len()];
        let mut count = 0;
        let variable_of_cell = (0..self.0.len())
            .map(|cell| {
                let root = self.root(cell);
                if number[root] == u32::MAX {
                    number[root] = count;
                    count += 1;
                }
                number[root]
            })
            .collect();
        (variable_of_cell, count as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_large_enough_and_mirror_images() {
        for n in 2..40 {
            for voxels in 1..=n {
                let mut starts = starts(n, n / voxels);
                assert_eq!(starts[0], 0);
                starts.push(n);
                let sizes: Vec<usize> = starts.windows(2).map(|p| p[1] - p[0]).collect();
                assert!(sizes.iter().all(|&s| s >= voxels), "{n} {voxels} {sizes:?}");
                assert!(sizes.iter().eq(sizes.iter().rev()), "{n} {voxels} {sizes:?}");
            }
        }
    }
}
