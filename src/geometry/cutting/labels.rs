//! Which tetrahedron belongs to whom.

use super::LevelSet;
use super::complex::{Complex, FIRST_INTERFACE_BIT, Tet};
use crate::math::Vec3;
use rayon::prelude::*;

/// No label: left out, as the outside is.
pub const NOTHING: u32 = u32::MAX;
/// Not labelled yet.
const OPEN: u32 = u32::MAX - 1;
/// Each tetrahedron's label, asked at its centroid.
///
/// Next to a curved interface the centroid of a thin piece can lie on the other side of the true level set than the
/// piece does. Such a piece takes the label of a neighbour on its own side instead.
pub fn labels(
    complex: &Complex,
    level_sets: &[LevelSet],
    label: &(dyn Fn(&Vec3) -> Option<usize> + Sync),
) -> Vec<u32> {
    let ask = |tet: &Tet| label(&complex.centroid(tet)).map_or(NOTHING, |l| l as u32);
    let mut labels: Vec<u32> = complex
        .tets
        .par_iter()
        .map(|tet| {
            let bits = tet.v.iter().fold(0, |bits, &v| bits | complex.on[v as usize]);
            let sides = &complex.sides[tet.class as usize];
            let centroid = complex.centroid(tet);
            let strays = level_sets
                .iter()
                .zip(sides)
                .enumerate()
                .any(|(i, (level, positive))| {
                    bits & 1 << (FIRST_INTERFACE_BIT + i as u32) != 0 && (level(&centroid) > 0.0) != *positive
                });
            if strays { OPEN } else { ask(tet) }
        })
        .collect();
    if labels.contains(&OPEN) {
        let faces = Faces::of(complex);
        let mut pairs: Vec<(u32, u32)> = faces
            .pairs()
            .filter_map(|(_, s, t)| t.map(|t| (s, t)))
            .filter(|&(s, t)| complex.tets[s as usize].class == complex.tets[t as usize].class)
            .filter(|&(s, t)| labels[s as usize] == OPEN || labels[t as usize] == OPEN)
            .collect();
        loop {
            let open = pairs.len();
            pairs.retain(|&(s, t)| {
                let (s, t) = (s as usize, t as usize);
                match (labels[s] == OPEN, labels[t] == OPEN) {
                    (true, false) => labels[s] = labels[t],
                    (false, true) => labels[t] = labels[s],
                    (both, _) => return both,
                }
                false
            });
            if pairs.len() == open {
                break;
            }
        }
        for (l, tet) in labels.iter_mut().zip(&complex.tets).filter(|(l, _)| **l == OPEN) {
            *l = ask(tet);
        }
    }
    labels
}

/// Every face of every tetrahedron, sorted so that the two sides of a face are neighbours.
pub struct Faces(Vec<u128>);

impl Faces {
    /// The faces of all tetrahedra.
    pub fn of(complex: &Complex) -> Self {
        let keys = |(t, tet): (usize, &Tet)| {
            tet.faces().map(|mut face| {
                face.sort_unstable();
                face.iter().fold(0_u128, |key, &v| key << 32 | u128::from(v)) << 32 | t as u128
            })
        };
        let mut faces: Vec<u128> = complex.tets.par_iter().enumerate().flat_map_iter(keys).collect();
        faces.par_sort_unstable();
        Self(faces)
    }

    /// Each face's vertices and the tetrahedra on its sides, in an order that only the vertex numbers decide.
    pub fn pairs(&self) -> impl Iterator<Item = ([u32; 3], u32, Option<u32>)> + '_ {
        self.0.chunk_by(|a, b| a >> 32 == b >> 32).map(|c| {
            let v = [96, 64, 32].map(|shift| (c[0] >> shift) as u32);
            (v, c[0] as u32, c.get(1).map(|t| *t as u32))
        })
    }
}
