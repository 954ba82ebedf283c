//! Cutting tetrahedra along the zero set of a level set.

use super::complex::{Classes, Complex, Tet};
use super::{LevelSet, warp};
use crate::math::Vec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Which side stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// Only where the level set is negative: the object's own surface.
    Negative,
    /// Both sides, told apart by their class: an interface.
    Both,
}

/// What cuts.
pub struct Knife<'a> {
    /// Zero on the surface to cut along.
    pub level: LevelSet<'a>,
    /// The bit of vertices on it.
    pub bit: u32,
    /// Which side stays.
    pub keep: Keep,
    /// Shortest edge of a lattice box \[mm\].
    pub h: f64,
    /// A crossing nearer than this to a vertex, over `h`, moves it.
    pub near: f64,
}

/// Where an edge meets the surface.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// The edge's ends, the smaller number first.
    pub ends: (u32, u32),
    /// The place \[mm\].
    pub point: Vec3,
}

/// Cuts every tetrahedron that the surface passes, given the level set at the vertices.
pub fn cut(complex: &mut Complex, mut values: Vec<f64>, knife: &Knife) {
    // A thousandth of what single precision resolves over the object: rounding in the level set, no geometry.
    let noise = 1e-10 * complex.points.iter().map(|p| p.amax()).fold(0.0, f64::max);
    for (value, on) in values.iter_mut().zip(&mut complex.on) {
        if value.abs() <= noise {
            *value = 0.0;
            *on |= 1 << knife.bit;
        }
    }
    let crossings = crossings(complex, &values, knife);
    warp::warp(complex, &mut values, &crossings, knife);

    let mut middles = HashMap::new();
    for crossing in crossings {
        let (a, b) = (crossing.ends.0 as usize, crossing.ends.1 as usize);
        if values[a] * values[b] < 0.0 {
            let on = complex.on[a] & complex.on[b] | 1 << knife.bit;
            middles.insert(crossing.ends, complex.push(crossing.point, on));
        }
    }
    split_all(complex, &values, &middles, knife);
}

/// The crossings of all edges whose ends lie on opposite sides, in the order in which the tetrahedra name them.
fn crossings(complex: &Complex, values: &[f64], knife: &Knife) -> Vec<Crossing> {
    let mut seen = HashMap::new();
    let mut edges = Vec::new();
    for tet in &complex.tets {
        let signs = tet.v.map(|i| values[i as usize]);
        if signs.iter().all(|s| *s <= 0.0) || signs.iter().all(|s| *s >= 0.0) {
            continue;
        }
        for (a, b) in tet.edges() {
            if values[a as usize] * values[b as usize] < 0.0
                && seen.insert((a.min(b), a.max(b)), ()).is_none()
            {
                edges.push((a.min(b), a.max(b)));
            }
        }
    }
    let crossing = |&(a, b): &(u32, u32)| {
        let ends = [a, b].map(|i| (complex.points[i as usize], values[i as usize]));
        Crossing {
            ends: (a, b),
            point: root(knife.level, ends[0], ends[1], 1e-5 * knife.h),
        }
    };
    edges.par_iter().map(crossing).collect()
}

/// A zero of `level` between two points of opposite sign, by regula falsi (Illinois variant), with a halving wherever
/// two steps together did not halve the bracket: a level set that is flat on one side, or only a sign, costs
/// bisection, a distance two or three evaluations.
fn root(level: LevelSet, (a, fa): (Vec3, f64), (b, fb): (Vec3, f64), tolerance: f64) -> Vec3 {
    let length = (b - a).norm();
    let small = 1e-9 * (fa.abs() + fb.abs());
    let (mut s, mut fs, mut t, mut ft) = (0.0, fa, 1.0, fb);
    let mut before = [2.0, 2.0];
    let mut moved_low = None;
    for _ in 0..60 {
        let halve = t - s > 0.5 * before[0];
        let m = if halve {
            0.5 * (s + t)
        } else {
            (s * ft - t * fs) / (ft - fs)
        };
        let x = a + (b - a) * m;
        let fm = level(&x);
        // A function that loses its mind between two good vertices still gets a crossing, only a coarse one.
        if fm.abs() <= small || !fm.is_finite() {
            return x;
        }
        before = [before[1], t - s];
        let low = (fm < 0.0) == (fa < 0.0);
        if low {
            (s, fs) = (m, fm);
            ft *= if moved_low == Some(true) { 0.5 } else { 1.0 };
        } else {
            (t, ft) = (m, fm);
            fs *= if moved_low == Some(false) { 0.5 } else { 1.0 };
        }
        moved_low = Some(low);
        if (t - s) * length <= tolerance {
            break;
        }
    }
    a + (b - a) * (0.5 * (s + t))
}

/// Replaces every tetrahedron by its pieces.
fn split_all(complex: &mut Complex, values: &[f64], middles: &HashMap<(u32, u32), u32>, knife: &Knife) {
    let old = std::mem::take(&mut complex.tets);
    let old_sides = std::mem::take(&mut complex.sides);
    let (mut sides, mut classes) = (Vec::new(), Classes::default());
    let mut tets = Vec::with_capacity(old.len());
    let mut keep = |v: [u32; 4], parent: u32, positive: bool| match knife.keep {
        Keep::Negative if positive => {}
        Keep::Negative => tets.push(Tet { v, class: parent }),
        Keep::Both => {
            tets.push(Tet {
                v,
                class: classes.side(&old_sides, &mut sides, parent, positive),
            });
        }
    };
    for tet in &old {
        let signs = tet.v.map(|i| sign(values[i as usize]));
        match (signs.contains(&-1), signs.contains(&1)) {
            (true, true) => {
                for positive in [false, true] {
                    piece(tet, signs, positive, middles, |v| keep(v, tet.class, positive));
                }
            }
            (negative, positive) => {
                let positive = if negative || positive {
                    positive
                } else {
                    // All four on the surface: only the true function knows.
                    (knife.level)(&complex.centroid(tet)) > 0.0
                };
                keep(tet.v, tet.class, positive);
            }
        }
    }
    complex.tets = tets;
    complex.sides = if knife.keep == Keep::Both {
        sides
    } else {
        old_sides
    };
}

fn sign(value: f64) -> i8 {
    i8::from(value > 0.0) - i8::from(value < 0.0)
}

/// A convex polygon of at most four vertices.
#[derive(Clone, Copy, Debug, Default)]
struct Polygon {
    v: [u32; 4],
    n: usize,
}

impl Polygon {
    fn push(&mut self, v: u32) {
        self.v[self.n] = v;
        self.n += 1;
    }

    fn vertices(&self) -> &[u32] {
        &self.v[..self.n]
    }

    /// Its triangles, from the vertex of the smallest number.
    fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let v = self.vertices();
        let start = (0..v.len()).min_by_key(|&i| v[i]).unwrap_or(0);
        (1..v.len().saturating_sub(1)).map(move |i| [0, i, i + 1].map(|j| v[(start + j) % v.len()]))
    }
}

/// Gives `keep` the tetrahedra of one side of a cut tetrahedron: a fan from the piece's smallest vertex to the
/// triangles of all faces that do not hold it. Faces are split from *their* smallest vertex, which is the fan's
/// wherever they hold it, so the neighbour across a face always makes the same triangles.
fn piece(
    tet: &Tet,
    signs: [i8; 4],
    positive: bool,
    middles: &HashMap<(u32, u32), u32>,
    mut keep: impl FnMut([u32; 4]),
) {
    let side: i8 = if positive { 1 } else { -1 };
    let sign_of = |v: u32| {
        tet.v
            .iter()
            .zip(signs)
            .find(|(w, _)| **w == v)
            .map_or(0, |(_, s)| s)
    };
    let mut faces = [Polygon::default(); 5];
    let mut count = 0;
    let mut rim: [(u32, u32); 4] = [(0, 0); 4];
    let mut rims = 0;
    for face in tet.faces() {
        let mut polygon = Polygon::default();
        for (k, &v) in face.iter().enumerate() {
            let w = face[(k + 1) % 3];
            let (sv, sw) = (sign_of(v), sign_of(w));
            if sv != -side {
                polygon.push(v);
            }
            if sv * sw < 0
                && let Some(&m) = middles.get(&(v.min(w), v.max(w)))
            {
                polygon.push(m);
            }
        }
        if polygon.n < 3 {
            continue;
        }
        faces[count] = polygon;
        count += 1;
        let v = polygon.vertices();
        for (k, &a) in v.iter().enumerate() {
            let b = v[(k + 1) % v.len()];
            if sign_of(a) == 0 && sign_of(b) == 0 {
                rim[rims] = (b, a);
                rims += 1;
            }
        }
    }
    // The face made by the cut: the other faces' edges on it, run backwards.
    let mut cap = Polygon::default();
    let mut next = rim[0].0;
    for _ in 0..rims {
        cap.push(next);
        next = rim[..rims]
            .iter()
            .find(|(a, _)| *a == next)
            .map_or(next, |(_, b)| *b);
    }
    faces[count] = cap;
    count += 1;

    let Some(apex) = faces[..count].iter().flat_map(|f| f.vertices()).copied().min() else {
        return;
    };
    for face in faces[..count].iter().filter(|f| !f.vertices().contains(&apex)) {
        for [a, b, c] in face.triangles() {
            keep([apex, a, b, c]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pattern of signs with both sides: the pieces must fill the tetrahedron with positive volumes.
    #[test]
    fn pieces_fill_the_tetrahedron() {
        let corners = [
            Vec3::zeros(),
            Vec3::new(1.0, 0.1, 0.0),
            Vec3::new(0.2, 1.0, 0.0),
            Vec3::new(0.1, 0.3, 1.0),
        ];
        for order in [[0, 1, 2, 3], [2, 0, 1, 3], [3, 1, 0, 2], [1, 3, 0, 2]] {
            for pattern in 0..81_usize {
                let values: Vec<f64> = (0..4)
                    .map(|k| (pattern / 3_usize.pow(k) % 3) as f64 - 1.0)
                    .collect();
                if !(values.contains(&1.0) && values.contains(&-1.0)) {
                    continue;
                }
                let mut v: [u32; 4] = order;
                let mut complex = Complex {
                    points: corners.to_vec(),
                    on: vec![0; 4],
                    tets: Vec::new(),
                    sides: vec![Vec::new()],
                    boxes: Vec3::repeat(1.0),
                };
                if complex.six_volumes(v) < 0.0 {
                    v.swap(0, 1);
                }
                let whole = complex.six_volumes(v);
                complex.tets.push(Tet { v, class: 0 });
                // Linear between the corners, which is all that a cut between them sees.
                let mut middles = HashMap::new();
                for (a, b) in complex.tets[0].edges() {
                    if values[a as usize] * values[b as usize] < 0.0 {
                        let middle = (corners[a as usize] + corners[b as usize]) / 2.0;
                        middles.insert((a.min(b), a.max(b)), complex.push(middle, 0));
                    }
                }
                let level = |_: &Vec3| 0.0;
                let knife = Knife {
                    level: &level,
                    bit: 7,
                    keep: Keep::Both,
                    h: 1.0,
                    near: 0.15,
                };
                split_all(&mut complex, &values, &middles, &knife);
                let volumes: Vec<f64> = complex.tets.iter().map(|t| complex.six_volumes(t.v)).collect();
                assert!(volumes.iter().all(|v| *v > 1e-3), "{values:?} {volumes:?}");
                assert!(
                    (volumes.iter().sum::<f64>() - whole).abs() < 1e-12,
                    "{values:?} {volumes:?}"
                );
            }
        }
    }

    #[test]
    fn root_of_a_sign_a_distance_and_a_plateau() {
        let (a, b) = (Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0));
        let functions: [LevelSet; 3] = [&|x| (x.x - 0.7).signum(), &|x| x.x * x.x - 0.49, &|x| {
            if x.x < 0.7 { -1e-6 } else { x.x - 0.7 + 1e-9 }
        }];
        for f in functions {
            let x = root(f, (a, f(&a)), (b, f(&b)), 1e-6);
            assert!((x.x - 0.7).abs() < 1e-6, "{x:?}");
        }
    }
}
