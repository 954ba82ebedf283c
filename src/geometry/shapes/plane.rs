//! Plane outlines and their triangulation: a triangular lattice inside, the outline around it, Delaunay between them, then a
//! few steps of smoothing.

use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// A point in the plane \[mm\].
pub(super) type Flat = [f64; 2];

/// A smooth closed curve through the given points (Catmull–Rom), as `count` points at equal distances along it.
pub(super) fn closed_spline(through: &[Flat], count: usize) -> Vec<Flat> {
    const STEPS: usize = 64;
    let n = through.len();
    let mut dense: Vec<Flat> = Vec::with_capacity(n * STEPS + 1);
    for k in 0..n {
        let [p, q, r, s] = [
            through[(k + n - 1) % n],
            through[k],
            through[(k + 1) % n],
            through[(k + 2) % n],
        ];
        for step in 0..STEPS {
            let t = step as f64 / STEPS as f64;
            dense.push([0, 1].map(|c| {
                let [p, q, r, s] = [p[c], q[c], r[c], s[c]];
                let cubic = -p + 3.0 * q - 3.0 * r + s;
                q + 0.5 * t * ((r - p) + t * ((2.0 * p - 5.0 * q + 4.0 * r - s) + t * cubic))
            }));
        }
    }
    dense.push(dense[0]);
    at_equal_distances(&dense, count)
}

/// `count` points at equal distances along a closed polygon whose last point repeats the first.
fn at_equal_distances(polygon: &[Flat], count: usize) -> Vec<Flat> {
    let mut along = vec![0.0];
    for pair in polygon.windows(2) {
        along.push(along[along.len() - 1] + distance(pair[0], pair[1]));
    }
    let whole = along[along.len() - 1];
    let mut segment = 0;
    let place = |k: usize| {
        let target = whole * k as f64 / count as f64;
        while along[segment + 1] < target {
            segment += 1;
        }
        let t = (target - along[segment]) / (along[segment + 1] - along[segment]);
        [0, 1].map(|c| polygon[segment][c] + t * (polygon[segment + 1][c] - polygon[segment][c]))
    };
    (0..count).map(place).collect()
}

pub(super) fn perimeter(outline: &[Flat]) -> f64 {
    (0..outline.len())
        .map(|k| distance(outline[k], outline[(k + 1) % outline.len()]))
        .sum()
}

fn distance(p: Flat, q: Flat) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

/// The outline moved inward by `by` \[mm\]; counter-clockwise, with curvature radii above `by`.
pub(super) fn inset(outline: &[Flat], by: f64) -> Vec<Flat> {
    let n = outline.len();
    let moved = |k: usize| {
        let (before, after) = (outline[(k + n - 1) % n], outline[(k + 1) % n]);
        let length = distance(before, after);
        let (tx, ty) = ((after[0] - before[0]) / length, (after[1] - before[1]) / length);
        [outline[k][0] - by * ty, outline[k][1] + by * tx]
    };
    (0..n).map(moved).collect()
}

/// A triangulated plane region: the outline's points come first, in their order.
pub(super) struct Patch {
    pub points: Vec<Flat>,
    /// Counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
}

/// Triangulates the inside of a counter-clockwise outline into triangles with sides of about `spacing` \[mm\].
pub(super) fn patch(outline: &[Flat], spacing: f64) -> Patch {
    let mut points: Vec<Flat> = outline.to_vec();
    points.extend(lattice(outline, spacing));
    let triangles = delaunay(outline, &points);
    smooth(&mut points, &triangles, outline.len());
    Patch { points, triangles }
}

/// A triangular lattice inside the outline, away from it.
fn lattice(outline: &[Flat], spacing: f64) -> Vec<Flat> {
    let fold = |c: usize, pick: fn(f64, f64) -> f64| outline.iter().map(|p| p[c]).fold(outline[0][c], pick);
    let (lo, hi) = (
        [fold(0, f64::min), fold(1, f64::min)],
        [fold(0, f64::max), fold(1, f64::max)],
    );
    let step = spacing * 3.0_f64.sqrt() / 2.0;
    let rows = ((hi[1] - lo[1]) / step).ceil() as usize;
    let columns = ((hi[0] - lo[0]) / spacing).ceil() as usize + 1;
    let mut inside = Vec::new();
    for row in 0..=rows {
        for column in 0..=columns {
            let shift = if row % 2 == 0 { 0.0 } else { -spacing / 2.0 };
            let point = [lo[0] + shift + column as f64 * spacing, lo[1] + row as f64 * step];
            if contains(outline, point) && away(outline, point, 0.7 * spacing) {
                inside.push(point);
            }
        }
    }
    inside
}

fn contains(outline: &[Flat], p: Flat) -> bool {
    let mut inside = false;
    for (k, q) in outline.iter().enumerate() {
        let r = outline[(k + 1) % outline.len()];
        if (q[1] > p[1]) != (r[1] > p[1]) && p[0] < q[0] + (r[0] - q[0]) * (p[1] - q[1]) / (r[1] - q[1]) {
            inside = !inside;
        }
    }
    inside
}

/// Whether the point keeps its distance from the outline's sides.
fn away(outline: &[Flat], p: Flat, by: f64) -> bool {
    (0..outline.len()).all(|k| {
        let (q, r) = (outline[k], outline[(k + 1) % outline.len()]);
        let (dx, dy) = (r[0] - q[0], r[1] - q[1]);
        let t = (((p[0] - q[0]) * dx + (p[1] - q[1]) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
        distance(p, [q[0] + t * dx, q[1] + t * dy]) >= by
    })
}

fn delaunay(outline: &[Flat], points: &[Flat]) -> Vec<[u32; 3]> {
    let mut mesh = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut handles = Vec::with_capacity(points.len());
    for p in points {
        // It refuses only numbers that are not finite, and the options were checked.
        handles.extend(mesh.insert(Point2::new(p[0], p[1])).ok());
    }
    for k in 0..outline.len() {
        let (from, to) = (handles[k], handles[(k + 1) % outline.len()]);
        if mesh.can_add_constraint(from, to) {
            mesh.add_constraint(from, to);
        }
    }
    let mut triangles = Vec::new();
    for face in mesh.inner_faces() {
        let corners = face.vertices().map(|v| v.fix().index() as u32);
        let middle = [0, 1].map(|c| corners.iter().map(|&v| points[v as usize][c]).sum::<f64>() / 3.0);
        if contains(outline, middle) {
            triangles.push(corners);
        }
    }
    triangles
}

/// Moves each inner point to the middle of its neighbours, a few times.
fn smooth(points: &mut [Flat], triangles: &[[u32; 3]], fixed: usize) {
    for _ in 0..4 {
        let mut sums = vec![([0.0; 2], 0.0); points.len()];
        for t in triangles {
            for k in 0..3 {
                // Each inner edge is met twice, once in each direction: every neighbour counts equally.
                let (from, to) = (t[k] as usize, t[(k + 1) % 3] as usize);
                sums[from].0 = [0, 1].map(|c| sums[from].0[c] + points[to][c]);
                sums[from].1 += 1.0;
            }
        }
        for (point, (sum, count)) in points.iter_mut().zip(&sums).skip(fixed) {
            *point = sum.map(|s| s / count);
        }
    }
}
