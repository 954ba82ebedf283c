//! A mesh while it is being improved: tetrahedra that come and go, and who is around whom.

use super::shape::{least_sine, six_volumes};
use crate::geometry::cutting::complex::{Complex, SURFACE_BIT};
use crate::geometry::cutting::labels::Faces;
use crate::math::Vec3;
use std::collections::BTreeSet;

/// The label across the object's surface.
pub(super) const OUTSIDE: u32 = u32::MAX;

/// A face with two different labels on its sides, seen from one of its vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Wall {
    /// The face's other two vertices, the smaller number first.
    pub edge: [u32; 2],
    /// The two labels, the smaller first; [`OUTSIDE`] is the largest.
    pub labels: [u32; 2],
}

/// A tetrahedron to be.
pub(super) type NewTet = ([u32; 4], u32);

/// The mesh.
#[derive(Debug)]
pub(super) struct Workpiece {
    /// Vertex positions \[mm\].
    pub points: Vec<Vec3>,
    /// The surfaces that each vertex helps to bound, one bit each ([`crate::geometry::cutting::complex`]).
    pub on: Vec<u128>,
    /// Those of them that it may leave, by less than the slack.
    pub loose: Vec<u128>,
    /// Where a vertex of the object's border stands whose surface is not there to return to: over a hole.
    pub anchors: Vec<Option<Vec3>>,
    tets: Vec<[u32; 4]>,
    label: Vec<u32>,
    gone: Vec<bool>,
    sine: Vec<f64>,
    star: Vec<Vec<u32>>,
}

impl Workpiece {
    /// Takes over what the cutting left. Bits of surfaces that separate nothing at a vertex are dropped.
    pub fn new(complex: &Complex, labels: &[u32]) -> Workpiece {
        let n = complex.points.len();
        let mut piece = Workpiece {
            points: complex.points.clone(),
            on: vec![0; n],
            loose: vec![0; n],
            anchors: vec![None; n],
            tets: Vec::with_capacity(2 * complex.tets.len()),
            label: Vec::new(),
            gone: Vec::new(),
            sine: Vec::new(),
            star: vec![Vec::new(); n],
        };
        for (tet, &label) in complex.tets.iter().zip(labels) {
            piece.add((tet.v, label));
        }
        for (v, s, t) in Faces::of(complex).pairs() {
            if t.map(|t| labels[t as usize]) != Some(labels[s as usize]) {
                let bits = v.iter().fold(u128::MAX, |bits, &i| bits & complex.on[i as usize]);
                v.iter().for_each(|&i| piece.on[i as usize] |= bits);
            }
        }
        piece
    }

    /// Numbers of the tetrahedra that are there.
    pub fn alive(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.tets.len() as u32).filter(|&t| self.is_alive(t))
    }

    pub fn is_alive(&self, t: u32) -> bool {
        !self.gone[t as usize]
    }

    pub fn tet(&self, t: u32) -> [u32; 4] {
        self.tets[t as usize]
    }

    pub fn label(&self, t: u32) -> u32 {
        self.label[t as usize]
    }

    /// The least sine of a tetrahedron's dihedral angles.
    pub fn sine(&self, t: u32) -> f64 {
        self.sine[t as usize]
    }

    /// The tetrahedra around a vertex.
    pub fn star(&self, v: u32) -> &[u32] {
        &self.star[v as usize]
    }

    pub fn corners(&self, v: [u32; 4]) -> [Vec3; 4] {
        v.map(|i| self.points[i as usize])
    }

    /// The volume of a tetrahedron \[mm³\].
    pub fn volume(&self, t: u32) -> f64 {
        six_volumes(&self.corners(self.tet(t))) / 6.0
    }

    /// The worst sine among tetrahedra.
    pub fn worst(&self, tets: &[u32]) -> f64 {
        tets.iter().map(|&t| self.sine(t)).fold(f64::INFINITY, f64::min)
    }

    /// The tetrahedra around an edge.
    pub fn around(&self, a: u32, b: u32) -> Vec<u32> {
        let both = |t: &u32| self.tet(*t).contains(&b);
        self.star(a).iter().copied().filter(both).collect()
    }

    /// The tetrahedron across the face of `t` that leaves out corner `k`.
    pub fn across(&self, t: u32, k: usize) -> Option<u32> {
        let mut face = self.tet(t).into_iter().enumerate().filter(|(i, _)| *i != k);
        let [a, b, c] = std::array::from_fn(|_| face.next().map_or(0, |(_, v)| v));
        let on_face = |s: &u32| {
            let v = self.tet(*s);
            *s != t && v.contains(&b) && v.contains(&c)
        };
        self.star(a).iter().copied().find(on_face)
    }

    /// Appends a tetrahedron and answers its number.
    pub fn add(&mut self, (v, label): NewTet) -> u32 {
        let t = self.tets.len() as u32;
        self.sine.push(least_sine(&self.corners(v)));
        self.tets.push(v);
        self.label.push(label);
        self.gone.push(false);
        v.iter().for_each(|&i| self.star[i as usize].push(t));
        t
    }

    /// Takes a tetrahedron away.
    pub fn remove(&mut self, t: u32) {
        for v in self.tet(t) {
            self.star[v as usize].retain(|&s| s != t);
        }
        self.gone[t as usize] = true;
    }

    /// Puts `new` in the place of `old`.
    pub fn replace(&mut self, old: &[u32], new: &[NewTet]) {
        old.iter().for_each(|&t| self.remove(t));
        new.iter().for_each(|&tet| {
            self.add(tet);
        });
    }

    /// Moves a vertex.
    pub fn relocate(&mut self, v: u32, point: Vec3) {
        self.points[v as usize] = point;
        for i in 0..self.star[v as usize].len() {
            let t = self.star[v as usize][i];
            self.sine[t as usize] = least_sine(&self.corners(self.tet(t)));
        }
    }

    /// Appends a copy of a vertex and gives it the tetrahedra `of`.
    pub fn split_off(&mut self, v: u32, of: &[u32]) {
        let (i, copy) = (v as usize, self.points.len() as u32);
        self.points.push(self.points[i]);
        self.on.push(self.on[i]);
        self.loose.push(self.loose[i]);
        self.anchors.push(self.anchors[i]);
        self.star[i].retain(|t| !of.contains(t));
        self.star.push(of.to_vec());
        for &t in of {
            self.tets[t as usize]
                .iter_mut()
                .filter(|w| **w == v)
                .for_each(|w| *w = copy);
        }
    }

    /// Puts a vertex into the middle of an edge, which halves all tetrahedra around it, and answers its number.
    pub fn split(&mut self, a: u32, b: u32) -> u32 {
        let walls = self.walls(a);
        let along = walls.iter().filter(|w| w.edge.contains(&b));
        let on = along.fold(0, |bits, w| bits | self.bits([a, w.edge[0], w.edge[1]]));
        let [i, j] = [a as usize, b as usize];
        let (v, middle) = (self.points.len() as u32, (self.points[i] + self.points[j]) / 2.0);
        self.points.push(middle);
        self.on.push(on);
        self.loose.push(on & (self.loose[i] | self.loose[j]));
        let anchored = self.anchors[i].is_some() || self.anchors[j].is_some();
        self.anchors.push((anchored && on != 0).then_some(middle));
        self.star.push(Vec::new());
        for t in self.around(a, b) {
            let (tet, label) = (self.tet(t), self.label(t));
            self.remove(t);
            for end in [a, b] {
                self.add((tet.map(|w| if w == end { v } else { w }), label));
            }
        }
        v
    }

    /// Takes the vertex of a split back, and with it the tetrahedra around it, for those that were there before.
    pub fn unsplit(&mut self, v: u32, before: &[u32]) {
        let old: Vec<NewTet> = before.iter().map(|&t| (self.tet(t), self.label(t))).collect();
        let halves = self.star(v).to_vec();
        self.replace(&halves, &old);
    }

    /// The faces at a vertex that have different labels on their sides.
    pub fn walls(&self, v: u32) -> Vec<Wall> {
        let mut faces: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * self.star(v).len());
        for &t in self.star(v) {
            let tet = self.tet(t);
            for i in 0..4 {
                for j in i + 1..4 {
                    if tet[i] != v && tet[j] != v {
                        faces.push(([tet[i].min(tet[j]), tet[i].max(tet[j])], self.label(t)));
                    }
                }
            }
        }
        faces.sort_unstable();
        faces
            .chunk_by(|f, g| f.0 == g.0)
            .filter_map(|sides| {
                let labels = [sides[0].1, sides.get(1).map_or(OUTSIDE, |s| s.1)];
                (labels[0] != labels[1]).then_some(Wall {
                    edge: sides[0].0,
                    labels,
                })
            })
            .collect()
    }

    /// The surfaces on which a face with different labels on its sides lies.
    pub fn bits(&self, face: [u32; 3]) -> u128 {
        face.iter().fold(u128::MAX, |bits, &v| bits & self.on[v as usize])
    }

    /// Marks the vertices of every face that bounds the object as being on the object's surface where nothing says on which
    /// surface the face lies: what was taken away has uncovered it.
    pub fn mark_uncovered(&mut self, vertices: &BTreeSet<u32>) {
        for &v in vertices {
            for wall in self.walls(v) {
                let face = [v, wall.edge[0], wall.edge[1]];
                if wall.labels[1] == OUTSIDE && self.bits(face) == 0 {
                    face.iter().for_each(|&i| self.on[i as usize] |= 1 << SURFACE_BIT);
                }
            }
        }
    }
}
