//! Making the object's border a closed surface without pinches, before anything is improved.
//!
//! The lattice sees a thin bridge, or two parts that nearly touch, as tetrahedra that meet along an edge or in a vertex
//! only. Along an edge the smaller wedge of material goes; a vertex between two cones of material is doubled; a vertex
//! between two cones of outside loses its tetrahedra. Crumbs go as well.

use super::workpiece::{OUTSIDE, Workpiece};
use std::collections::{BTreeMap, BTreeSet};

/// Rounds before we give up; a wedge that goes can open a new pinch next to it.
const ROUNDS: usize = 30;
/// Separate pieces smaller than this, over the cube of the edge length, go.
const CRUMB: f64 = 1.0;

/// Mends the border; answers whether that succeeded.
pub(super) fn mend(piece: &mut Workpiece, edge: f64) -> bool {
    for _ in 0..ROUNDS {
        let changed = open_edges(piece) | part_vertices(piece);
        if !changed {
            drop_crumbs(piece, edge);
            return true;
        }
    }
    false
}

/// The object's border: every face once, by its three vertices, with the tetrahedron behind it.
pub(super) fn border(piece: &Workpiece) -> Vec<([u32; 3], u32)> {
    let mut faces: Vec<([u32; 3], u32)> = Vec::new();
    for t in piece.alive() {
        let v = piece.tet(t);
        for mut face in [
            [v[1], v[2], v[3]],
            [v[0], v[2], v[3]],
            [v[0], v[1], v[3]],
            [v[0], v[1], v[2]],
        ] {
            face.sort_unstable();
            faces.push((face, t));
        }
    }
    faces.sort_unstable();
    faces
        .chunk_by(|f, g| f.0 == g.0)
        .filter(|c| c.len() == 1)
        .map(|c| c[0])
        .collect()
}

fn remove(piece: &mut Workpiece, tets: &[u32]) {
    let vertices: BTreeSet<u32> = tets.iter().flat_map(|&t| piece.tet(t)).collect();
    tets.iter().for_each(|&t| piece.remove(t));
    piece.mark_uncovered(&vertices);
}

/// Takes away the smaller wedge at every edge of the border that has more than two faces of it.
fn open_edges(piece: &mut Workpiece) -> bool {
    let mut count: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for ([a, b, c], _) in border(piece) {
        for edge in [[a, b], [b, c], [a, c]] {
            *count.entry(edge).or_default() += 1;
        }
    }
    let mut changed = false;
    for [a, b] in count.into_iter().filter(|(_, n)| *n > 2).map(|(edge, _)| edge) {
        let around = piece.around(a, b);
        let mut wedges = groups(&around, |s, t| {
            let shared = piece.tet(s).into_iter().filter(|v| piece.tet(t).contains(v));
            shared.count() == 3
        });
        if wedges.len() < 2 {
            continue;
        }
        let volume = |wedge: &Vec<u32>| wedge.iter().map(|&t| piece.volume(t)).sum::<f64>();
        wedges.sort_by(|p, q| volume(p).total_cmp(&volume(q)));
        remove(piece, &wedges[0]);
        changed = true;
    }
    changed
}

/// Doubles vertices between cones of material and opens those between cones of outside.
fn part_vertices(piece: &mut Workpiece) -> bool {
    let vertices: BTreeSet<u32> = border(piece).into_iter().flat_map(|(face, _)| face).collect();
    let mut changed = false;
    for v in vertices {
        let star = piece.star(v).to_vec();
        let cones = groups(&star, |s, t| {
            let shared = piece.tet(s).into_iter().filter(|w| piece.tet(t).contains(w));
            shared.count() == 3
        });
        for cone in cones.iter().skip(1) {
            piece.split_off(v, cone);
            changed = true;
        }
        if cones.len() == 1 {
            let rim: Vec<[u32; 2]> = piece
                .walls(v)
                .into_iter()
                .filter(|w| w.labels[1] == OUTSIDE)
                .map(|w| w.edge)
                .collect();
            let numbers: Vec<u32> = (0..rim.len() as u32).collect();
            let fans = groups(&numbers, |i, j| {
                rim[i as usize].iter().any(|x| rim[j as usize].contains(x))
            });
            if fans.len() > 1 {
                remove(piece, &star);
                changed = true;
            }
        }
    }
    changed
}

/// Items that hang together by `touch`, in their order.
fn groups(items: &[u32], touch: impl Fn(u32, u32) -> bool) -> Vec<Vec<u32>> {
    let mut left: Vec<u32> = items.to_vec();
    let mut groups = Vec::new();
    while !left.is_empty() {
        let mut group = vec![left.remove(0)];
        let mut next = 0;
        while next < group.len() {
            let here = group[next];
            let (near, far) = left.into_iter().partition::<Vec<u32>, _>(|&i| touch(here, i));
            group.extend(near);
            left = far;
            next += 1;
        }
        groups.push(group);
    }
    groups
}

/// Takes away separate pieces that are next to nothing; the largest stays in any case.
fn drop_crumbs(piece: &mut Workpiece, edge: f64) {
    let alive: Vec<u32> = piece.alive().collect();
    let mut component = BTreeMap::new();
    let mut volumes: Vec<f64> = Vec::new();
    for &first in &alive {
        if component.contains_key(&first) {
            continue;
        }
        let number = volumes.len();
        component.insert(first, number);
        let (mut pending, mut volume) = (vec![first], 0.0);
        while let Some(t) = pending.pop() {
            volume += piece.volume(t);
            for next in (0..4).filter_map(|k| piece.across(t, k)) {
                if component.insert(next, number).is_none() {
                    pending.push(next);
                }
            }
        }
        volumes.push(volume);
    }
    let largest = volumes.iter().copied().fold(0.0, f64::max);
    for t in alive {
        let volume = volumes[component[&t]];
        if volume < CRUMB * edge.powi(3) && volume < largest {
            piece.remove(t);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::cutting::complex::{Complex, even_lines};
    use crate::math::Vec3;

    /// Of 2 × 2 × 2 boxes of 1 mm those for which `keep` answers true, by the place of their lower corner.
    fn boxes(keep: impl Fn([bool; 3]) -> bool) -> Workpiece {
        let lines = even_lines((Vec3::zeros(), Vec3::repeat(2.0)), 1.0);
        let (mut complex, _) = Complex::lattice(&|_| -1.0, &lines).unwrap();
        let tets = std::mem::take(&mut complex.tets);
        complex.tets = tets
            .into_iter()
            .filter(|tet| {
                let centroid = complex.centroid(tet);
                keep([0, 1, 2].map(|k| centroid[k] > 1.0))
            })
            .collect();
        Workpiece::new(&complex, &vec![0; complex.tets.len()])
    }

    fn volume(piece: &Workpiece) -> f64 {
        piece.alive().map(|t| piece.volume(t)).sum()
    }

    /// The most faces of the border at an edge.
    fn most_at_an_edge(piece: &Workpiece) -> usize {
        let mut edges: Vec<[u32; 2]> = border(piece)
            .into_iter()
            .flat_map(|([a, b, c], _)| [[a, b], [b, c], [a, c]])
            .collect();
        edges.sort_unstable();
        edges.chunk_by(|e, f| e == f).map(<[_]>::len).max().unwrap_or(0)
    }

    #[test]
    fn boxes_that_touch_in_a_corner_get_a_corner_each() {
        let mut piece = boxes(|upper| upper == [false; 3] || upper == [true; 3]);
        let vertices = piece.points.len();
        assert!(mend(&mut piece, 0.5));
        assert_eq!(piece.points.len(), vertices + 1);
        assert!((volume(&piece) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn boxes_that_touch_along_an_edge_are_parted() {
        // Two columns of two boxes, diagonally across from one another; one is longer so that they are not alike.
        let mut piece = boxes(|[x, y, z]| x == y && !(x && z));
        assert_eq!(most_at_an_edge(&piece), 4);
        assert!(mend(&mut piece, 0.5));
        assert_eq!(most_at_an_edge(&piece), 2);
        // What goes is less than the smaller of the two.
        assert!(volume(&piece) > 2.0 && volume(&piece) < 3.0, "{}", volume(&piece));
    }

    #[test]
    fn crumbs_go_and_the_largest_piece_stays() {
        let mut piece = boxes(|upper| upper == [false; 3] || upper == [true, true, false]);
        // Larger than the cube of an edge, both stay; smaller, the largest does. They share an edge, so one has lost a wedge.
        assert!(mend(&mut piece, 2.0));
        assert!((volume(&piece) - 1.0).abs() < 1e-12, "{}", volume(&piece));
    }

    #[test]
    fn a_sound_border_stays_as_it_is() {
        let mut piece = boxes(|_| true);
        assert!(mend(&mut piece, 0.5));
        assert_eq!(piece.points.len(), 27);
        assert!((volume(&piece) - 8.0).abs() < 1e-12);
    }
}
