//! How good a tetrahedron is: by the sines of its dihedral angles.
//!
//! ```text
//! sin θ_e = 6V |e| / (|n_1| |n_2|)          n = (b − a) × (c − a) of the two faces at the edge e
//! ```
//!
//! The sine falls towards 0° and towards 180°, so the least of the six finds every way in which a tetrahedron can be
//! flat, and it carries the sign of the volume. A least sine of sin β holds all angles between β and 180° − β.

use crate::math::Vec3;

/// The least sine of the dihedral angles, −1 to 1; negative where the tetrahedron is inside out, 0 where it is flat.
pub(super) fn least_sine(p: &[Vec3; 4]) -> f64 {
    let [ab, ac, ad] = [1, 2, 3].map(|k| p[k] - p[0]);
    let (bc, bd, cd) = (p[2] - p[1], p[3] - p[1], p[3] - p[2]);
    let volumes = ab.cross(&ac).dot(&ad);
    // Squared double areas of the faces opposite to the corners a, b, c, d.
    let faces = [
        bc.cross(&bd).norm_squared(),
        ac.cross(&ad).norm_squared(),
        ab.cross(&ad).norm_squared(),
        ab.cross(&ac).norm_squared(),
    ];
    let edges = [
        (ab, 2, 3),
        (ac, 1, 3),
        (ad, 1, 2),
        (bc, 0, 3),
        (bd, 0, 2),
        (cd, 0, 1),
    ];
    let least = edges
        .iter()
        .map(|(e, f, g)| e.norm_squared() / (faces[*f] * faces[*g]))
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() {
        volumes * least.sqrt()
    } else {
        0.0
    }
}

/// Least and greatest dihedral angle \[°\] of a tetrahedron of positive volume.
pub fn dihedral_angles_deg(p: &[Vec3; 4]) -> [f64; 2] {
    // Outward normals of the faces opposite to each corner.
    let normal = |a: usize, b: usize, c: usize| (p[b] - p[a]).cross(&(p[c] - p[a])).normalize();
    let normals = [normal(1, 2, 3), normal(0, 3, 2), normal(0, 1, 3), normal(0, 2, 1)];
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for i in 0..4 {
        for j in i + 1..4 {
            let (sine, cosine) = (normals[i].cross(&normals[j]).norm(), -normals[i].dot(&normals[j]));
            let angle = sine.atan2(cosine).to_degrees();
            range = [range[0].min(angle), range[1].max(angle)];
        }
    }
    range
}

/// Six times the volume \[mm³\].
pub(super) fn six_volumes(p: &[Vec3; 4]) -> f64 {
    (p[1] - p[0]).cross(&(p[2] - p[0])).dot(&(p[3] - p[0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// A corner of a cube has three right angles at the axes and three of acos(1/√3) = 54.7356° at the far face; a regular
    /// tetrahedron has acos(1/3) = 70.5288° everywhere.
    #[test]
    fn known_angles() {
        let corner = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()];
        let least = (1.0 / 3.0_f64.sqrt()).acos();
        assert_relative_eq!(
            dihedral_angles_deg(&corner)[0],
            least.to_degrees(),
            epsilon = 1e-12
        );
        assert_relative_eq!(dihedral_angles_deg(&corner)[1], 90.0, epsilon = 1e-12);
        assert_relative_eq!(least_sine(&corner), least.sin(), epsilon = 1e-12);
        let regular = [
            [1.0, 1.0, 1.0],
            [1.0, -1.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, 1.0],
        ]
        .map(Vec3::from);
        assert_relative_eq!(
            least_sine(&regular).abs(),
            (8.0_f64 / 9.0).sqrt(),
            epsilon = 1e-12
        );
        assert_relative_eq!(
            dihedral_angles_deg(&regular)[1],
            (1.0_f64 / 3.0).acos().to_degrees(),
            epsilon = 1e-10
        );
    }

    #[test]
    fn flat_and_inverted_ones_are_bad() {
        let flat = [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(0.3, 0.3, 1e-9)];
        assert!(least_sine(&flat) < 1e-8);
        let inverted = [Vec3::x(), Vec3::zeros(), Vec3::y(), Vec3::z()];
        assert!(least_sine(&inverted) < -0.5);
        assert_eq!(least_sine(&[Vec3::x(); 4]), 0.0);
    }
}
