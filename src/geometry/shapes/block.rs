//! The rectangular block, the specimen of every check.

use super::error::{ShapeError, within};
use crate::geometry::axis::Axis;
use crate::geometry::surface::TriMesh;
use crate::geometry::weld::weld;
use crate::math::Vec3;

/// A block from the origin to `size` \[mm\], its faces divided into squares of about `spacing` \[mm\].
///
/// # Errors
/// [`ShapeError`] for an edge outside of 1 to 3000 mm, or a spacing that is not between the longest edge and a 200th of it.
pub fn block(size: Vec3, spacing: f64) -> Result<TriMesh, ShapeError> {
    for (name, extent) in ["width", "depth", "height"].into_iter().zip(&size) {
        within(name, *extent, 1.0, 3000.0)?;
    }
    within("spacing", spacing, size.max() / 200.0, size.max())?;
    let cells = size.map(|extent| (extent / spacing).round().max(1.0));
    let mut mesh = TriMesh::default();
    for axis in Axis::ALL {
        let (i, j) = axis.others();
        let (columns, rows) = (cells[i] as u32, cells[j] as u32);
        for (along, outward) in [(0.0, false), (size[axis.index()], true)] {
            let base = mesh.vertices.len() as u32;
            for r in 0..=rows {
                for c in 0..=columns {
                    // Multiply first: the last node lies exactly on the far edge.
                    let a = size[i] * f64::from(c) / cells[i];
                    let b = size[j] * f64::from(r) / cells[j];
                    mesh.vertices.push(axis.point(along, a, b));
                }
            }
            let at = |c: u32, r: u32| base + r * (columns + 1) + c;
            for r in 0..rows {
                for c in 0..columns {
                    let (p, q, s, t) = (at(c, r), at(c + 1, r), at(c + 1, r + 1), at(c, r + 1));
                    // Alternating diagonals, so that the faces have no grain.
                    let pair = if (c + r) % 2 == 0 {
                        [[p, q, s], [p, s, t]]
                    } else {
                        [[p, q, t], [q, s, t]]
                    };
                    mesh.triangles
                        .extend(pair.map(|[u, v, w]| if outward { [u, v, w] } else { [u, w, v] }));
                }
            }
        }
    }
    Ok(weld(&mesh, 0.0))
}
