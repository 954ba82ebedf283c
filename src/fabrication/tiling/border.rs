//! From labelled tetrahedra to the parts' meshes.
//!
//! A face between two labels becomes one triangle of each part, in opposite directions. That alone closes every part,
//! but two pieces of one material may touch along an edge or in a vertex only. There the part's triangles are joined
//! the way its material is (walking through its tetrahedra around the edge), and each fan of triangles gets a vertex
//! of its own, all at the same place.

use super::{Part, TilingError};
use crate::geometry::cutting::complex::{Complex, Tet};
use crate::geometry::cutting::labels::{Faces, NOTHING};
use crate::geometry::surface::TriMesh;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Rounds of splitting edges that two fans of one part share at both ends; one was enough in all that we have seen.
const ROUNDS: usize = 8;

/// The parts, by ascending label.
pub(super) fn parts(complex: &mut Complex, mut labels: Vec<u32>) -> Result<Vec<Part>, TilingError> {
    for _ in 0..ROUNDS {
        let borders = borders(complex, &labels);
        let mut shared = BTreeSet::new();
        let mut parts = Vec::new();
        for (&label, border) in &borders {
            match manifold(complex, &labels, label, border)? {
                Ok(mesh) => {
                    parts.push(Part {
                        label: label as usize,
                        mesh,
                        volume_mm3: volume(complex, &labels, label),
                    });
                }
                Err(edges) => shared.extend(edges),
            }
        }
        if shared.is_empty() {
            return Ok(parts);
        }
        bisect(complex, &mut labels, &shared);
    }
    Err(TilingError::NotManifold {
        detail: format!("edges remain shared after {ROUNDS} rounds of splitting"),
    })
}

fn volume(complex: &Complex, labels: &[u32], label: u32) -> f64 {
    let of = |(tet, l): (&Tet, &u32)| {
        if *l == label {
            complex.six_volumes(tet.v) / 6.0
        } else {
            0.0
        }
    };
    complex.tets.iter().zip(labels).map(of).sum()
}

/// Each part's triangles in the complex' vertices, counter-clockwise from outside the part.
fn borders(complex: &Complex, labels: &[u32]) -> BTreeMap<u32, Vec<[u32; 3]>> {
    let mut borders: BTreeMap<u32, Vec<[u32; 3]>> = BTreeMap::new();
    for (v, s, t) in Faces::of(complex).pairs() {
        let label = |t: u32| labels[t as usize];
        if t.map(label) == Some(label(s)) {
            continue;
        }
        for t in [Some(s), t]
            .into_iter()
            .flatten()
            .filter(|&t| label(t) != NOTHING)
        {
            let mut faces = complex.tets[t as usize].faces().into_iter();
            borders
                .entry(label(t))
                .or_default()
                .extend(faces.find(|f| f.iter().all(|i| v.contains(i))));
        }
    }
    borders
}

/// A corner of a triangle in a list: three to each.
type Corner = usize;

/// The part's mesh with a vertex for each fan of triangles, or the edges that two fans share at both ends, `(a < b)`.
fn manifold(
    complex: &Complex,
    labels: &[u32],
    label: u32,
    triangles: &[[u32; 3]],
) -> Result<Result<TriMesh, Vec<(u32, u32)>>, TilingError> {
    let mut fans = Fans::new(3 * triangles.len());
    let edges = edges(triangles);
    let crowded: HashMap<(u32, u32), Vec<Corner>> = edges
        .chunk_by(|p, q| p.0 == q.0)
        .filter(|sides| sides.len() != 2)
        .map(|sides| (sides[0].0, sides.iter().map(|s| s.1).collect()))
        .collect();
    for sides in edges.chunk_by(|p, q| p.0 == q.0).filter(|sides| sides.len() == 2) {
        fans.join_along(triangles, sides[0].1, sides[1].1);
    }
    for (edge, wedges) in around(complex, labels, label, &crowded) {
        for (from, to) in wedge_ends(&wedges) {
            let side = |third: u32| {
                crowded[&edge]
                    .iter()
                    .copied()
                    .find(|&c| triangles[c / 3][(c % 3 + 2) % 3] == third)
            };
            let (Some(p), Some(q)) = (side(from), side(to)) else {
                let detail = format!("material around the edge {edge:?} of part {label} has no border");
                return Err(TilingError::NotManifold { detail });
            };
            fans.join_along(triangles, p, q);
        }
    }
    let (corners, places) = fans.numbered(triangles);
    let meshed: Vec<[u32; 3]> = corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    let still = self::edges(&meshed);
    let mut shared: Vec<(u32, u32)> = still
        .chunk_by(|p, q| p.0 == q.0)
        .filter(|sides| sides.len() != 2)
        .map(|sides| sides[0].0)
        .map(|(a, b)| (places[a as usize], places[b as usize]))
        .map(|(a, b)| (a.min(b), a.max(b)))
        .collect();
    if shared.is_empty() {
        let vertices = places.iter().map(|&v| complex.points[v as usize]).collect();
        return Ok(Ok(TriMesh {
            vertices,
            triangles: meshed,
        }));
    }
    shared.sort_unstable();
    shared.dedup();
    Ok(Err(shared))
}

/// Every triangle side as its undirected edge and the corner that it starts from, sorted by edge.
fn edges(triangles: &[[u32; 3]]) -> Vec<((u32, u32), Corner)> {
    let sides = |(t, v): (usize, &[u32; 3])| {
        let v = *v;
        (0..3).map(move |k| {
            let (a, b) = (v[k], v[(k + 1) % 3]);
            ((a.min(b), a.max(b)), 3 * t + k)
        })
    };
    let mut edges: Vec<_> = triangles.iter().enumerate().flat_map(sides).collect();
    edges.sort_unstable();
    edges
}

/// For each crowded edge, the part's tetrahedra around it, each as its two vertices off the edge.
fn around(
    complex: &Complex,
    labels: &[u32],
    label: u32,
    crowded: &HashMap<(u32, u32), Vec<Corner>>,
) -> BTreeMap<(u32, u32), Vec<[u32; 2]>> {
    let mut around: BTreeMap<(u32, u32), Vec<[u32; 2]>> = BTreeMap::new();
    if crowded.is_empty() {
        return around;
    }
    for (tet, _) in complex.tets.iter().zip(labels).filter(|(_, l)| **l == label) {
        for (a, b) in tet.edges() {
            let edge = (a.min(b), a.max(b));
            if crowded.contains_key(&edge) {
                let off = tet.v.iter().filter(|&&v| v != a && v != b);
                let mut pair = [0; 2];
                pair.iter_mut().zip(off).for_each(|(p, &v)| *p = v);
                around.entry(edge).or_default().push(pair);
            }
        }
    }
    around
}

/// The two ends of every chain of tetrahedra around an edge: the wedges of material there.
fn wedge_ends(links: &[[u32; 2]]) -> Vec<(u32, u32)> {
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &[c, d] in links {
        next.entry(c).or_default().push(d);
        next.entry(d).or_default().push(c);
    }
    let starts: Vec<u32> = next
        .iter()
        .filter(|(_, n)| n.len() == 1)
        .map(|(&v, _)| v)
        .collect();
    let mut ends = Vec::new();
    for &start in &starts {
        let (mut before, mut at) = (start, next[&start][0]);
        while let Some(&onward) = next[&at].iter().find(|&&v| v != before) {
            (before, at) = (at, onward);
        }
        if start < at {
            ends.push((start, at));
        }
    }
    ends
}

/// Corners of triangles, joined to fans around one vertex: a forest with path halving.
struct Fans(Vec<u32>);

impl Fans {
    fn new(corners: usize) -> Self {
        Self((0..corners as u32).collect())
    }

    fn root(&mut self, corner: Corner) -> u32 {
        let mut c = corner as u32;
        while self.0[c as usize] != c {
            self.0[c as usize] = self.0[self.0[c as usize] as usize];
            c = self.0[c as usize];
        }
        c
    }

    /// Joins two triangles along the sides that start at these corners, at both ends.
    fn join_along(&mut self, triangles: &[[u32; 3]], p: Corner, q: Corner) {
        let end = |c: Corner| 3 * (c / 3) + (c % 3 + 1) % 3;
        for c in [p, end(p)] {
            for d in [q, end(q)] {
                if triangles[c / 3][c % 3] == triangles[d / 3][d % 3] {
                    let (c, d) = (self.root(c), self.root(d));
                    self.0[c.max(d) as usize] = c.min(d);
                }
            }
        }
    }

    /// A vertex number for each corner, and each vertex' number in `triangles`.
    fn numbered(&mut self, triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
        let mut number = vec![u32::MAX; self.0.len()];
        let mut places = Vec::new();
        let corners = (0..self.0.len())
            .map(|c| {
                let root = self.root(c) as usize;
                if number[root] == u32::MAX {
                    number[root] = places.len() as u32;
                    places.push(triangles[c / 3][c % 3]);
                }
                number[root]
            })
            .collect();
        (corners, places)
    }
}

/// Splits edges at their middles, with all tetrahedra around them. An edge next to one split before it waits.
fn bisect(complex: &mut Complex, labels: &mut Vec<u32>, edges: &BTreeSet<(u32, u32)>) {
    let mut around: BTreeMap<(u32, u32), Vec<usize>> = BTreeMap::new();
    for (t, tet) in complex.tets.iter().enumerate() {
        for (a, b) in tet.edges() {
            let edge = (a.min(b), a.max(b));
            if edges.contains(&edge) {
                around.entry(edge).or_default().push(t);
            }
        }
    }
    let mut touched = BTreeSet::new();
    for ((a, b), tets) in around {
        if tets.iter().any(|t| touched.contains(t)) {
            continue;
        }
        let middle = (complex.points[a as usize] + complex.points[b as usize]) / 2.0;
        let on = complex.on[a as usize] & complex.on[b as usize];
        let m = complex.push(middle, on);
        for t in tets {
            touched.insert(t);
            let tet = complex.tets[t];
            let with = |old: u32| Tet {
                v: tet.v.map(|v| if v == old { m } else { v }),
                ..tet
            };
            complex.tets[t] = with(a);
            complex.tets.push(with(b));
            labels.push(labels[t]);
        }
    }
}
