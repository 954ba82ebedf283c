//! Binary STL: 80 bytes of header, the number of triangles, and for each of them its normal, its three corners and
//! two bytes of nothing, all little-endian single precision. STL names no unit; ours is the millimetre.

use crate::geometry::surface::TriMesh;
use crate::math::Vec3;
use std::io::{self, Write};

/// Writes a mesh, with `header` cut to what fits.
///
/// Corners are rounded to single precision first and normals follow from the rounded ones; a triangle without area
/// gets the zero normal, which readers take as "work it out".
///
/// # Errors
/// Those of `out`; a mesh of more triangles than STL can count, or with a vertex that is missing or not finite.
pub fn write_stl(mut out: impl Write, mesh: &TriMesh, header: &str) -> io::Result<()> {
    let invalid = |what: String| io::Error::new(io::ErrorKind::InvalidInput, what);
    let count = u32::try_from(mesh.triangles.len()).map_err(|_| {
        invalid(format!(
            "{} triangles are more than STL can count",
            mesh.triangles.len()
        ))
    })?;
    let mut head = [b' '; 80];
    // "solid" at the start would make readers take the file for text.
    let text: Vec<u8> = format!("binary STL, mm, {header}")
        .bytes()
        .filter(u8::is_ascii)
        .take(80)
        .collect();
    head[..text.len()].copy_from_slice(&text);
    out.write_all(&head)?;
    out.write_all(&count.to_le_bytes())?;
    for (i, t) in mesh.triangles.iter().enumerate() {
        let corner = |v: u32| {
            let p = mesh
                .vertices
                .get(v as usize)
                .filter(|p| p.iter().all(|c| (*c as f32).is_finite()));
            p.map(single)
                .ok_or_else(|| invalid(format!("triangle {i} names vertex {v}, missing or not finite")))
        };
        let p = [corner(t[0])?, corner(t[1])?, corner(t[2])?];
        let normal = (p[1] - p[0])
            .cross(&(p[2] - p[0]))
            .try_normalize(0.0)
            .unwrap_or_default();
        let mut record = [0; 50];
        let numbers = [normal, p[0], p[1], p[2]]
            .into_iter()
            .flat_map(|v| [v.x, v.y, v.z]);
        for (bytes, number) in record.chunks_exact_mut(4).zip(numbers) {
            bytes.copy_from_slice(&(number as f32).to_le_bytes());
        }
        out.write_all(&record)?;
    }
    Ok(())
}

/// A point as single precision holds it, `-0` as `0`: what welds in one file then welds in all.
pub fn single(p: &Vec3) -> Vec3 {
    p.map(|c| f64::from(c as f32) + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_one_triangle() {
        let mesh = TriMesh {
            vertices: vec![
                Vec3::new(-0.0, 0.0, 0.5),
                Vec3::new(2.0, 0.0, 0.5),
                Vec3::new(0.0, 3.0, 0.5),
            ],
            triangles: vec![[0, 1, 2]],
        };
        let mut bytes = Vec::new();
        write_stl(&mut bytes, &mesh, "wedge").expect("memory");
        assert_eq!(bytes.len(), 84 + 50);
        assert_eq!(&bytes[..22], b"binary STL, mm, wedge ");
        assert_eq!(&bytes[80..84], [1, 0, 0, 0]);
        let numbers: Vec<f32> = bytes[84..132]
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        assert_eq!(
            numbers,
            [0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 2.0, 0.0, 0.5, 0.0, 3.0, 0.5]
        );
        // -0 became 0: the byte of its sign is clear.
        assert_eq!(bytes[84 + 12 + 3], 0);
    }

    #[test]
    fn a_missing_vertex_is_an_error() {
        let mesh = TriMesh {
            vertices: vec![Vec3::zeros(); 2],
            triangles: vec![[0, 1, 2]],
        };
        assert!(write_stl(Vec::new(), &mesh, "").is_err());
    }
}
