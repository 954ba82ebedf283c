//! Objects whose volume is known, as level sets.

use pliant::math::Vec3;

/// Signed distance to a box around the origin with these half extents \[mm\].
pub fn block(half: Vec3) -> impl Fn(&Vec3) -> f64 + Sync {
    move |x: &Vec3| {
        let q = x.abs() - half;
        q.map(|c| c.max(0.0)).norm() + q.max().min(0.0)
    }
}

/// Signed distance to a ball around the origin.
pub fn ball(radius: f64) -> impl Fn(&Vec3) -> f64 + Sync {
    move |x: &Vec3| x.norm() - radius
}

/// Bounds around the origin.
pub fn around(half: Vec3) -> (Vec3, Vec3) {
    (-half, half)
}

/// A flat sole, 260 × 100 × 20 mm: an outline of two ellipse-like lobes swept along z.
pub fn sole() -> (impl Fn(&Vec3) -> f64 + Sync, (Vec3, Vec3)) {
    let outline = |x: f64| 42.0 + 8.0 * (x / 40.0).sin();
    let f = move |p: &Vec3| {
        let along = (p.x / 130.0).powi(4) + (p.y / outline(p.x)).powi(4);
        // Near the wall about the distance to it: the gradient of the fourth root is near 1/45 across.
        let wall = 45.0 * (along.sqrt().sqrt() - 1.0);
        wall.max((p.z - 10.0).abs() - 10.0)
    };
    (f, (Vec3::new(-130.0, -50.0, 0.0), Vec3::new(130.0, 50.0, 20.0)))
}
