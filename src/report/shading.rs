//! Normals, light and outlines of a picture.
//!
//! A surface of colour `c` (linear light) and unit normal `n`, both sides alike, is shown as
//!
//! ```text
//! c · (a + h·n_up + v·n_view + k·max(0, n·l)),    n_view ≥ 0
//! ```
//!
//! with an ambient part `a`, a sky `h`, a light `v` at the viewer, so that a cut face is never in the dark, and a key
//! light `k` along `l` from the upper left behind the viewer; they add up to one for a face towards the key light, so
//! that a legend can be read against it. Normals are averaged over the faces about a vertex that meet at less than a
//! crease angle: a scanned foot is smooth, a block keeps its edges.

use crate::geometry::surface::TriMesh;
use crate::math::Vec3;

/// How strongly light and shade differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// Shape first: for parts in a few colours.
    Modelling,
    /// Colour first: for a quantity that is read from a colour bar.
    Even,
}

impl Light {
    /// The factor on linear light for a unit normal in camera axes (right, up, towards the viewer).
    pub fn factor(self, [x, y, z]: [f64; 3]) -> f64 {
        // Upper left, behind the viewer: (−0.28, 0.52, 0.81), a unit vector but for rounding.
        let key = (-0.28 * x + 0.52 * y + 0.81 * z).max(0.0);
        match self {
            Self::Modelling => 0.54 + 0.06 * y + 0.20 * z + 0.26 * key,
            Self::Even => 0.68 + 0.03 * y + 0.30 * key,
        }
    }
}

/// Cosine of the angle beyond which two faces meet in an edge: 38°, between the 30° of a coarse cylinder of twelve
/// sides and the 45° of a chamfer.
const CREASE: f64 = 0.788;

/// A unit normal for each corner of each triangle, `(m × 3)`. Zero for triangles without area or with wrong indices.
pub fn corner_normals(mesh: &TriMesh) -> Vec<[Vec3; 3]> {
    let count = mesh.vertices.len();
    let faces: Vec<Vec3> = mesh
        .triangles
        .iter()
        .map(|triangle| area_normal(mesh, triangle).unwrap_or_default())
        .collect();
    let units: Vec<Vec3> = faces.iter().map(|face| unit(*face)).collect();
    // Faces about each vertex, as one list with an offset for each vertex.
    let mut offsets = vec![0u32; count + 1];
    let valid = |corner: u32| (corner as usize) < count;
    for corner in mesh.triangles.iter().flatten().filter(|corner| valid(**corner)) {
        offsets[*corner as usize + 1] += 1;
    }
    for vertex in 0..count {
        offsets[vertex + 1] += offsets[vertex];
    }
    let mut about = vec![0u32; offsets[count] as usize];
    let mut next = offsets.clone();
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        for corner in triangle.iter().filter(|corner| valid(**corner)) {
            about[next[*corner as usize] as usize] = face as u32;
            next[*corner as usize] += 1;
        }
    }
    let smooth = |face: usize, corner: u32| {
        if !valid(corner) {
            return units[face];
        }
        let range = offsets[corner as usize] as usize..offsets[corner as usize + 1] as usize;
        let near = about[range]
            .iter()
            .filter(|other| units[**other as usize].dot(&units[face]) > CREASE);
        unit(near.map(|other| faces[*other as usize]).sum())
    };
    let corners = |(face, triangle): (usize, &[u32; 3])| triangle.map(|corner| smooth(face, corner));
    mesh.triangles.iter().enumerate().map(corners).collect()
}

/// The three corners of a triangle; `None` if an index points nowhere or a coordinate is not finite.
pub fn corners(mesh: &TriMesh, triangle: &[u32; 3]) -> Option<[Vec3; 3]> {
    let mut places = [Vec3::zeros(); 3];
    for (place, corner) in places.iter_mut().zip(triangle) {
        *place = *mesh.vertices.get(*corner as usize)?;
        if !place.iter().all(|value| value.is_finite()) {
            return None;
        }
    }
    Some(places)
}

fn area_normal(mesh: &TriMesh, triangle: &[u32; 3]) -> Option<Vec3> {
    let [a, b, c] = corners(mesh, triangle)?;
    Some((b - a).cross(&(c - a)))
}

/// The unit vector along `vector`; zero for zero and for what is not finite.
pub fn unit(vector: Vec3) -> Vec3 {
    let length = vector.norm();
    if length > 0.0 && length.is_finite() {
        vector / length
    } else {
        Vec3::zeros()
    }
}

/// One sample of a picture: what is seen there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Distance towards the viewer \[mm\]; −∞ where nothing is.
    pub depth: f32,
    /// Unit normal in camera axes, times 127.
    pub normal: [i8; 3],
    /// sRGB of the surface.
    pub colour: [u8; 3],
    /// Which shape, from 1; 0 where nothing is.
    pub shape: u16,
}

impl Sample {
    /// Nothing but paper.
    pub const EMPTY: Self = Self {
        depth: f32::NEG_INFINITY,
        normal: [0; 3],
        colour: [255; 3],
        shape: 0,
    };

    fn direction(&self) -> [f32; 3] {
        self.normal.map(|component| f32::from(component) / 127.0)
    }
}

/// How dark a line goes through each sample, 0 to 1, `(height × width)`: silhouettes, borders of shapes, folds behind
/// one another, and (if `creases`) sharp edges. `spacing` is the distance from sample to sample \[mm\].
pub fn outlines(samples: &[Sample], width: usize, spacing: f64, creases: bool) -> Vec<f32> {
    let mut dark = vec![0.0f32; samples.len()];
    let mut mark = |first: usize, second: usize, axis: usize| {
        let strength = border(&samples[first], &samples[second], axis, spacing as f32, creases);
        if strength > 0.0 {
            dark[first] = dark[first].max(strength);
            dark[second] = dark[second].max(strength);
        }
    };
    for (index, _) in samples.iter().enumerate() {
        if (index + 1) % width != 0 && index + 1 < samples.len() {
            mark(index, index + 1, 0);
        }
        if index + width < samples.len() {
            mark(index, index + width, 1);
        }
    }
    dark
}

/// How strong a line is wanted between two neighbours, right (axis 0) or below (axis 1) of one another.
fn border(first: &Sample, second: &Sample, axis: usize, spacing: f32, creases: bool) -> f32 {
    if first.shape == 0 && second.shape == 0 {
        return 0.0;
    }
    if first.shape != second.shape {
        return 0.8;
    }
    let (a, b) = (first.direction(), second.direction());
    // Along a surface, depth changes by the slope of its tangent plane: −n_x/n_z to the right, +n_y/n_z downwards.
    let slope = |normal: [f32; 3]| {
        let along = if axis == 0 { -normal[0] } else { normal[1] };
        along / normal[2].max(0.15)
    };
    let step = second.depth - first.depth;
    let miss = (step - slope(a) * spacing)
        .abs()
        .min((step - slope(b) * spacing).abs());
    // Eight samples: deeper than the roughness of a scan, less than a fold that one wants to see.
    if miss > 8.0 * spacing {
        return 0.7;
    }
    let aligned = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if creases && aligned < CREASE as f32 {
        0.5
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two unit squares that meet in the y axis at an angle; normals (0,0,1) and (sin, 0, cos).
    fn roof(angle_deg: f64) -> TriMesh {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        TriMesh {
            vertices: vec![
                Vec3::new(-1.0, 0.0, 0.0),
                Vec3::new(0.0, 0.0, 0.0),
                Vec3::new(0.0, 1.0, 0.0),
                Vec3::new(cos, 0.0, -sin),
            ],
            triangles: vec![[0, 1, 2], [1, 3, 2]],
        }
    }

    #[test]
    fn normals_are_shared_over_a_gentle_fold_and_kept_at_a_sharp_one() {
        let gentle = corner_normals(&roof(20.0));
        // Equal areas: the shared normal is half way, 10° from each.
        assert!((gentle[0][1].x - 10f64.to_radians().sin()).abs() < 1e-12);
        assert!((gentle[0][1] - gentle[1][0]).norm() < 1e-12);
        assert!((gentle[0][0] - Vec3::z()).norm() < 1e-12);
        let sharp = corner_normals(&roof(60.0));
        assert!((sharp[0][1] - Vec3::z()).norm() < 1e-12);
    }

    #[test]
    fn wrong_triangles_have_no_normal() {
        let mut mesh = roof(0.0);
        mesh.triangles = vec![[0, 1, 9], [0, 0, 0]];
        mesh.vertices[2].x = f64::NAN;
        assert!(
            corner_normals(&mesh)
                .iter()
                .flatten()
                .all(|normal| *normal == Vec3::zeros())
        );
    }

    #[test]
    fn a_face_towards_the_light_shows_its_own_colour() {
        for light in [Light::Modelling, Light::Even] {
            let toward = light.factor([-0.28, 0.52, 0.81]);
            assert!((0.98..=1.01).contains(&toward), "{toward}");
            assert!(light.factor([0.7, -0.7, 0.1]) < toward);
        }
    }

    #[test]
    fn a_tilted_plane_has_no_lines_and_a_step_has() {
        let at = |depth: f32| Sample {
            depth,
            normal: [90, 0, 90],
            colour: [0; 3],
            shape: 1,
        };
        // A plane tilted by 45°: one sample further right is one sample deeper.
        assert_eq!(border(&at(0.0), &at(-1.0), 0, 1.0, true), 0.0);
        assert!(border(&at(0.0), &at(-20.0), 0, 1.0, true) > 0.5);
        assert!(border(&at(0.0), &Sample { shape: 2, ..at(-1.0) }, 0, 1.0, false) > 0.5);
        assert_eq!(border(&Sample::EMPTY, &Sample::EMPTY, 1, 1.0, true), 0.0);
    }
}
