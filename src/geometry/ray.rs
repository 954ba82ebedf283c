//! Where a straight line meets a surface.

use super::surface::TriMesh;
use crate::math::Vec3;

/// A place where a line meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the line's origin along its direction, negative behind it \[mm\].
    pub distance: f64,
    /// Does the line enter the object there, by the triangle's orientation?
    pub enters: bool,
}

/// All places where the line through `origin` along the unit vector `direction` meets `mesh`, nearest to the far negative
/// end first (Möller and Trumbore 1997).
pub fn hits(mesh: &TriMesh, origin: &Vec3, direction: &Vec3) -> Vec<Hit> {
    let mut found = Vec::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.vertices[i as usize]);
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(&ac);
        let determinant = ab.dot(&p);
        if determinant.abs() < 1e-14 * ab.norm() * ac.norm() {
            continue;
        }
        let to_origin = origin - a;
        let u = to_origin.dot(&p) / determinant;
        let q = to_origin.cross(&ab);
        let v = direction.dot(&q) / determinant;
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
            // The normal ab × ac looks against the direction where the line enters: determinant > 0.
            found.push(Hit {
                distance: ac.dot(&q) / determinant,
                enters: determinant > 0.0,
            });
        }
    }
    found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enters_and_leaves_a_tetrahedron() {
        let vertices = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mesh = TriMesh { vertices, triangles };
        let found = hits(&mesh, &Vec3::new(0.2, 0.3, 5.0), &-Vec3::z());
        assert_eq!(found.len(), 2);
        // The slanted face is at z = 1 − x − y = 0.5, the base at 0.
        assert!((found[0].distance - 4.5).abs() < 1e-12 && found[0].enters);
        assert!((found[1].distance - 5.0).abs() < 1e-12 && !found[1].enters);
        assert!(hits(&mesh, &Vec3::new(2.0, 0.0, 5.0), &-Vec3::z()).is_empty());
    }
}
