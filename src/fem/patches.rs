//! Patches of tetrahedra that share one volumetric strain.
//!
//! A linear tetrahedron has one volumetric strain. A mesh has five to six of them a node, and near incompressibility
//! (ν → ½) that many constraints on three displacements a node leave almost nothing to move: it locks. Sharing one
//! volumetric strain over a patch of k tetrahedra leaves about 5.5/k constraints a node; the continuum has one
//! equation for three displacements, so k of five and more restores the balance (de Souza Neto et al. 2005, F-bar
//! patches; here in a form with an energy, see [`super::forces`]).
//!
//! Patches are grown one after the other: from the first free tetrahedron, always taking the neighbour across a face
//! that brings the fewest new nodes, then the most common faces, then the lowest number, to at most eight. What is left over in
//! threes or fewer joins a neighbour that has room. The result depends on the numbering, but not on threads.

use super::elements::BATCH;
use std::collections::BTreeSet;
use std::collections::HashMap;

/// A patch this small looks for a neighbour with room.
const TOO_SMALL: usize = 3;

/// A partition of tetrahedra into patches of at most eight.
#[derive(Clone, Debug, PartialEq)]
pub struct Patches {
    starts: Vec<u32>,
    elements: Vec<u32>,
    node_starts: Vec<u32>,
    nodes: Vec<u32>,
    /// For each element of `elements`, the places of its four nodes among its patch's nodes.
    places: Vec<[u8; 4]>,
}

impl Patches {
    /// Patches of the tetrahedra `tets`; where `regions`, `(elements)`, are given, a patch stays inside one of them.
    pub fn new(tets: &[[u32; 4]], regions: Option<&[u16]>) -> Patches {
        let across = face_neighbours(tets, regions);
        let mut patch_of = vec![u32::MAX; tets.len()];
        let mut patches: Vec<Vec<u32>> = Vec::new();
        for seed in 0..tets.len() {
            if patch_of[seed] == u32::MAX {
                let patch = grown(seed as u32, tets, &across, &patch_of);
                for &e in &patch {
                    patch_of[e as usize] = patches.len() as u32;
                }
                patches.push(patch);
            }
        }
        give_away(&mut patches, &mut patch_of, &across);
        Patches::of(tets, patches.into_iter().filter(|p| !p.is_empty()))
    }

    fn of(tets: &[[u32; 4]], patches: impl Iterator<Item = Vec<u32>>) -> Patches {
        let mut result = Patches {
            starts: vec![0],
            elements: Vec::with_capacity(tets.len()),
            node_starts: vec![0],
            nodes: Vec::new(),
            places: Vec::with_capacity(tets.len()),
        };
        for mut patch in patches {
            patch.sort_unstable();
            let nodes: BTreeSet<u32> = patch.iter().flat_map(|&e| tets[e as usize]).collect();
            let nodes: Vec<u32> = nodes.into_iter().collect();
            // At most 32 nodes: eight tetrahedra of four.
            let place = |n: &u32| nodes.iter().position(|m| m == n).unwrap_or(0) as u8;
            for &e in &patch {
                let [a, b, c, d] = &tets[e as usize];
                result.places.push([place(a), place(b), place(c), place(d)]);
            }
            result.elements.extend(patch);
            result.starts.push(result.elements.len() as u32);
            result.nodes.extend(nodes);
            result.node_starts.push(result.nodes.len() as u32);
        }
        result
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Is there none?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The elements of patch `p`, ascending.
    #[inline]
    pub fn elements(&self, p: usize) -> &[u32] {
        &self.elements[self.starts[p] as usize..self.starts[p + 1] as usize]
    }

    /// The nodes of patch `p`, ascending.
    #[inline]
    pub fn nodes(&self, p: usize) -> &[u32] {
        &self.nodes[self.node_starts[p] as usize..self.node_starts[p + 1] as usize]
    }

    /// Where the nodes of the `k`-th element of patch `p` stand among the patch's nodes.
    #[inline]
    pub fn places(&self, p: usize, k: usize) -> &[u8; 4] {
        &self.places[self.starts[p] as usize + k]
    }
}

/// The tetrahedra across the four faces of each, ascending, of the same region only.
fn face_neighbours(tets: &[[u32; 4]], regions: Option<&[u16]>) -> Vec<Vec<u32>> {
    let mut across = vec![Vec::with_capacity(4); tets.len()];
    let mut open: HashMap<[u32; 3], u32> = HashMap::with_capacity(2 * tets.len());
    for (e, tet) in tets.iter().enumerate() {
        for without in 0..4 {
            let mut face = [0; 3];
            let others = (0..4).filter(|&k| k != without).map(|k| tet[k]);
            face.iter_mut().zip(others).for_each(|(f, n)| *f = n);
            face.sort_unstable();
            let Some(other) = open.remove(&face) else {
                open.insert(face, e as u32);
                continue;
            };
            if regions.is_none_or(|r| r[e] == r[other as usize]) {
                across[e].push(other);
                across[other as usize].push(e as u32);
            }
        }
    }
    across.iter_mut().for_each(|list| list.sort_unstable());
    across
}

fn grown(seed: u32, tets: &[[u32; 4]], across: &[Vec<u32>], patch_of: &[u32]) -> Vec<u32> {
    let mut patch = vec![seed];
    let mut nodes = tets[seed as usize].to_vec();
    while patch.len() < BATCH {
        let free = |e: &u32| patch_of[*e as usize] == u32::MAX && !patch.contains(e);
        let candidates = patch
            .iter()
            .flat_map(|&e| &across[e as usize])
            .copied()
            .filter(free);
        let cost = |e: u32| {
            let new = tets[e as usize].iter().filter(|n| !nodes.contains(n)).count();
            let faces = across[e as usize].iter().filter(|o| patch.contains(o)).count();
            (new, std::cmp::Reverse(faces), e)
        };
        let Some(next) = candidates.min_by_key(|&e| cost(e)) else {
            break;
        };
        for &n in &tets[next as usize] {
            if !nodes.contains(&n) {
                nodes.push(n);
            }
        }
        patch.push(next);
    }
    patch
}

/// Moves the elements of small patches to neighbours that have room, the smallest first.
fn give_away(patches: &mut [Vec<u32>], patch_of: &mut [u32], across: &[Vec<u32>]) {
    for p in 0..patches.len() {
        if patches[p].len() > TOO_SMALL {
            continue;
        }
        for e in std::mem::take(&mut patches[p]) {
            let others = across[e as usize].iter().map(|&o| patch_of[o as usize]);
            let room = others.filter(|&o| {
                o as usize != p && !patches[o as usize].is_empty() && patches[o as usize].len() < BATCH
            });
            let home = room
                .min_by_key(|&o| (patches[o as usize].len(), o))
                .unwrap_or(p as u32);
            patches[home as usize].push(e);
            patch_of[e as usize] = home;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::volume::{Elements, KUHN, VolumeMesh};
    use crate::math::Vec3;

    fn tets(counts: [usize; 3]) -> Vec<[u32; 4]> {
        let mesh = VolumeMesh::cuboid(Vec3::new(1.0, 1.0, 1.0), counts, true);
        let Elements::KuhnCells(cells) = mesh.elements else {
            unreachable!()
        };
        cells
            .iter()
            .flat_map(|cell| KUHN.map(|t| t.map(|k| cell[k])))
            .collect()
    }

    #[test]
    fn every_tetrahedron_is_in_one_patch_and_patches_are_of_a_good_size() {
        let tets = tets([5, 4, 6]);
        let patches = Patches::new(&tets, None);
        let mut seen = vec![0; tets.len()];
        for p in 0..patches.len() {
            assert!(patches.elements(p).len() <= BATCH);
            for (k, &e) in patches.elements(p).iter().enumerate() {
                seen[e as usize] += 1;
                let nodes = patches.places(p, k).map(|i| patches.nodes(p)[i as usize]);
                assert_eq!(nodes, tets[e as usize]);
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
        // Five a patch is what balances constraints and displacements.
        let mean = tets.len() as f64 / patches.len() as f64;
        assert!(mean > 5.0, "mean patch size {mean}");
    }

    #[test]
    fn patches_stay_inside_regions() {
        let tets = tets([4, 4, 4]);
        let regions: Vec<u16> = (0..tets.len()).map(|e| (e / 6 % 4 / 2) as u16).collect();
        let patches = Patches::new(&tets, Some(&regions));
        for p in 0..patches.len() {
            let of = |e: &u32| regions[*e as usize];
            let first = of(&patches.elements(p)[0]);
            assert!(patches.elements(p).iter().all(|e| of(e) == first));
        }
    }
}
