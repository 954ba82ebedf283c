//! Joining vertices that stand at one place. An STL repeats each vertex in every triangle, and other exporters split
//! vertices along seams; neighbours are found again only once the copies are one.

use super::surface::TriMesh;
use crate::math::Vec3;
use std::collections::HashMap;

/// Joins vertices that are closer than `tolerance` \[mm\] to an earlier one, and drops those that no triangle uses. Zero joins
/// equal positions only. Triangles keep their number and order, also if two of their corners become one.
///
/// Positions must be finite and indices in range.
pub fn weld(mesh: &TriMesh, tolerance: f64) -> TriMesh {
    let mut keeper: Vec<u32> = Vec::with_capacity(mesh.vertices.len());
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    // Cells of twice the tolerance: all that lies within the tolerance is in this cell or a neighbour. The cast
    // saturates, which at worst puts far vertices into one crowded cell.
    let cell_of = |v: &Vec3| -> [i64; 3] {
        if tolerance > 0.0 {
            [v.x, v.y, v.z].map(|x| (x / (2.0 * tolerance)).floor() as i64)
        } else {
            // −0 and 0 are one place.
            [v.x, v.y, v.z].map(|x| (x + 0.0).to_bits() as i64)
        }
    };
    let reach = i64::from(tolerance > 0.0);
    for (number, vertex) in mesh.vertices.iter().enumerate() {
        let home = cell_of(vertex);
        let mut found: Option<u32> = None;
        for offset in neighbours(reach) {
            let cell = [0, 1, 2].map(|k| home[k].saturating_add(offset[k]));
            for &candidate in cells.get(&cell).into_iter().flatten() {
                let near = (mesh.vertices[candidate as usize] - vertex).norm() <= tolerance;
                // The earliest of several, so that the answer does not depend on the order of the cells.
                if near && found.is_none_or(|earlier| candidate < earlier) {
                    found = Some(candidate);
                }
            }
        }
        match found {
            Some(earlier) => keeper.push(earlier),
            None => {
                keeper.push(number as u32);
                cells.entry(home).or_default().push(number as u32);
            }
        }
    }
    let triangles = mesh
        .triangles
        .iter()
        .map(|t| t.map(|v| keeper[v as usize]))
        .collect();
    TriMesh {
        vertices: mesh.vertices.clone(),
        triangles,
    }
    .without_loose_vertices()
}

fn neighbours(reach: i64) -> impl Iterator<Item = [i64; 3]> {
    let side = move || -reach..=reach;
    side().flat_map(move |i| side().flat_map(move |j| side().map(move |k| [i, j, k])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(gap: f64) -> TriMesh {
        let v = Vec3::new;
        let vertices = vec![
            v(0.0, 0.0, 0.0),
            v(1.0, 0.0, 0.0),
            v(0.0, 1.0, 0.0),
            v(1.0 + gap, 0.0, 0.0),
            v(1.0, 1.0, -0.0),
            v(0.0, 1.0 - gap, -0.0),
        ];
        TriMesh {
            vertices,
            triangles: vec![[0, 1, 2], [3, 4, 5]],
        }
    }

    #[test]
    fn copies_become_one() {
        let welded = weld(&strip(0.0), 0.0);
        assert_eq!(welded.vertices.len(), 4);
        assert_eq!(welded.triangles, vec![[0, 1, 2], [1, 3, 2]]);
    }

    #[test]
    fn the_tolerance_is_a_distance() {
        assert_eq!(weld(&strip(1e-4), 2e-4).vertices.len(), 4);
        assert_eq!(weld(&strip(1e-4), 0.5e-4).vertices.len(), 6);
        assert_eq!(weld(&strip(1e-4), 0.0).vertices.len(), 6);
    }
}
