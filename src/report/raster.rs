//! Triangles to pixels without a graphics card: an orthographic depth buffer, several samples to a pixel.
//!
//! A triangle with corners `p₀, p₁, p₂` in the picture plane covers a sample `p` if its barycentric coordinates
//!
//! ```text
//! λᵢ = area(p, pⱼ, pₖ) / area(p₀, p₁, p₂),    (i, j, k) cyclic
//! ```
//!
//! are all at least zero; depth, normal and value there are `Σ λᵢ fᵢ` (exact, since the projection is affine). Of
//! several triangles the nearest is kept, of equals the first, so the picture depends on nothing but its input.

use super::colour::{Colour, NO_VALUE, sequential};
use super::shading::{Light, Sample, corner_normals, corners, outlines, unit};
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;

/// A viewer far away: three orthogonal unit vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// To the right in the picture.
    pub right: Vec3,
    /// Up in the picture.
    pub up: Vec3,
    /// From the object to the viewer.
    pub towards: Vec3,
}

impl Camera {
    /// Looking along `direction` with `up` upwards, neither of which need be of unit length or orthogonal. Where they
    /// are of no use (zero, parallel, not finite) another upward direction is taken.
    pub fn looking(direction: Vec3, up: Vec3) -> Self {
        let towards = match unit(-direction) {
            zero if zero == Vec3::zeros() => Vec3::z(),
            towards => towards,
        };
        let spare = if towards.y.abs() < 0.9 {
            Vec3::y()
        } else {
            Vec3::z()
        };
        let right = [unit(up), spare]
            .into_iter()
            .map(|up| up.cross(&towards))
            .find(|right| right.norm() > 1e-6)
            .unwrap_or_else(Vec3::x);
        let right = unit(right);
        Self {
            right,
            up: towards.cross(&right),
            towards,
        }
    }

    /// From the front, a little from the right and above, with z upwards: what shows most of most objects.
    pub fn three_quarter() -> Self {
        Self::looking(Vec3::new(-0.50, 0.80, -0.62), Vec3::z())
    }

    /// A point or direction in camera axes: right, up, towards the viewer.
    pub fn seen(&self, vector: Vec3) -> Vec3 {
        Vec3::new(
            self.right.dot(&vector),
            self.up.dot(&vector),
            self.towards.dot(&vector),
        )
    }
}

/// A camera over a sheet of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where from.
    pub camera: Camera,
    /// Pixels per millimetre.
    pub scale: f64,
    /// What is in the middle of the sheet, in camera axes \[mm\].
    pub centre: [f64; 2],
    /// Size of the sheet \[px\].
    pub size: [u32; 2],
}

impl View {
    /// A sheet of a width on which all vertices are seen, with a margin about them, at most `tallest` high \[px\].
    /// `None` if no vertex has finite coordinates.
    pub fn fitted<'a>(
        camera: Camera,
        meshes: impl IntoIterator<Item = &'a TriMesh>,
        width: u32,
        tallest: u32,
        margin: u32,
    ) -> Option<Self> {
        let (width, tallest) = (width.clamp(16, 8192), tallest.clamp(16, 8192));
        let margin = margin.min(width.min(tallest) / 4);
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for vertex in meshes.into_iter().flat_map(|mesh| &mesh.vertices) {
            let seen = camera.seen(*vertex);
            if seen.iter().all(|value| value.is_finite() && value.abs() < 1e30) {
                for axis in 0..2 {
                    low[axis] = low[axis].min(seen[axis]);
                    high[axis] = high[axis].max(seen[axis]);
                }
            }
        }
        if low[0] > high[0] {
            return None;
        }
        let span = [0, 1].map(|axis| (high[axis] - low[axis]).max(1e-9));
        let room = |length: u32| f64::from(length.saturating_sub(2 * margin).max(8));
        let scale = (room(width) / span[0]).min(room(tallest) / span[1]);
        // A flat object still gets a sheet that is a quarter as high as it is wide.
        let height = (scale * span[1]).ceil() as u32 + 2 * margin;
        let height = height.clamp((width / 4).min(tallest), tallest);
        let centre = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
        Some(Self {
            camera,
            scale,
            centre,
            size: [width, height],
        })
    }

    /// Where a point is on the sheet \[px\], from the top left.
    pub fn pixel(&self, point: Vec3) -> [f64; 2] {
        let seen = self.camera.seen(point);
        [
            0.5 * f64::from(self.size[0]) + self.scale * (seen.x - self.centre[0]),
            0.5 * f64::from(self.size[1]) - self.scale * (seen.y - self.centre[1]),
        ]
    }
}

/// The colour of a surface. Slices that are too short leave the rest grey.
#[derive(Clone, Copy, Debug)]
pub enum Paint<'a> {
    /// One colour.
    Uniform(Colour),
    /// A colour for each triangle, `(m)`.
    Faces(&'a [Colour]),
    /// A colour for each vertex, `(n)`, blended between them in sRGB.
    Vertices(&'a [Colour]),
    /// A value for each vertex, `(n)`, interpolated and then shown on the sequential map from the range's first end to
    /// its second.
    Values(&'a [f64], [f64; 2]),
}

/// A surface in a picture.
#[derive(Clone, Copy, Debug)]
pub struct Shape<'a> {
    /// The surface. Triangles with wrong indices or coordinates that are not finite are left out.
    pub mesh: &'a TriMesh,
    /// Its colour.
    pub paint: Paint<'a>,
}

/// Which lines are drawn over the shading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lines {
    /// None.
    None,
    /// About shapes and folds.
    Silhouettes,
    /// And along sharp edges.
    Edges,
}

/// How a picture is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rendering {
    /// Samples along each side of a pixel, 1 to 4.
    pub samples: u32,
    /// Light and shade.
    pub light: Light,
    /// Lines over it.
    pub lines: Lines,
}

impl Default for Rendering {
    fn default() -> Self {
        Self {
            samples: 3,
            light: Light::Modelling,
            lines: Lines::Edges,
        }
    }
}

/// Pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Width and height \[px\].
    pub size: [u32; 2],
    /// sRGB and opacity, 8 bits each, row by row from the top, `(height × width × 4)`.
    pub rgba: Vec<u8>,
}

impl Image {
    /// The colour of a pixel, white outside.
    pub fn pixel(&self, x: u32, y: u32) -> Colour {
        let at = 4 * (y as usize * self.size[0] as usize + x as usize);
        match self.rgba.get(at..at + 3) {
            Some(&[red, green, blue]) if x < self.size[0] => Colour::rgb(red, green, blue),
            _ => Colour::rgb(255, 255, 255),
        }
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// What the encoder says; it has no reason to refuse a picture from [`render`].
    pub fn png(&self) -> Result<Vec<u8>, image::ImageError> {
        use image::ImageEncoder as _;
        use image::codecs::png::{CompressionType, FilterType, PngEncoder};
        // The ground is opaque: three channels do.
        let rgb: Vec<u8> = self
            .rgba
            .chunks_exact(4)
            .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]])
            .collect();
        let mut bytes = Vec::new();
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive).write_image(
            &rgb,
            self.size[0],
            self.size[1],
            image::ExtendedColorType::Rgb8,
        )?;
        Ok(bytes)
    }
}

/// The picture of some shapes on white.
pub fn render(shapes: &[Shape], view: &View, rendering: Rendering) -> Image {
    let pixels = u64::from(view.size[0]) * u64::from(view.size[1]);
    // A sheet has at most 2²⁶ samples, 0.8 GB: very large pictures are sampled more coarsely.
    let affordable = (1..=4u32)
        .rev()
        .find(|fold| pixels * u64::from(fold * fold) <= 1 << 26)
        .unwrap_or(1);
    let samples = rendering.samples.clamp(1, affordable);
    let mut sheet = Sheet::new(*view, samples);
    for (index, shape) in shapes.iter().enumerate() {
        sheet.draw(shape, (index + 1).min(usize::from(u16::MAX)) as u16);
    }
    sheet.developed(rendering)
}

/// The samples of a picture under way.
struct Sheet {
    view: View,
    /// Samples along a side of a pixel.
    fold: usize,
    width: usize,
    height: usize,
    samples: Vec<Sample>,
}

/// What is interpolated over a triangle.
struct Corner {
    /// In samples from the top left, and depth \[mm\].
    place: [f64; 3],
    normal: Vec3,
    /// A colour or a value and two blanks.
    tint: [f64; 3],
}

impl Sheet {
    fn new(view: View, fold: u32) -> Self {
        let [width, height] = view.size.map(|length| (length * fold) as usize);
        Self {
            view,
            fold: fold as usize,
            width,
            height,
            samples: vec![Sample::EMPTY; width * height],
        }
    }

    fn draw(&mut self, shape: &Shape, id: u16) {
        let mesh = shape.mesh;
        let fold = self.fold as f64;
        let normals = corner_normals(mesh);
        for (face, triangle) in mesh.triangles.iter().enumerate() {
            let Some(places) = corners(mesh, triangle) else {
                continue;
            };
            let corner = |index: usize| {
                let [x, y] = self.view.pixel(places[index]).map(|pixel| fold * pixel);
                Corner {
                    place: [x, y, self.view.camera.towards.dot(&places[index])],
                    normal: self.view.camera.seen(normals[face][index]),
                    tint: tint(shape.paint, face, triangle[index] as usize),
                }
            };
            let range = if let Paint::Values(_, range) = shape.paint {
                Some(range)
            } else {
                None
            };
            self.fill(&[corner(0), corner(1), corner(2)], range, id);
        }
    }

    /// Puts one triangle on the sheet.
    fn fill(&mut self, [a, b, c]: &[Corner; 3], range: Option<[f64; 2]>, id: u16) {
        let (pa, pb, pc) = (a.place, b.place, c.place);
        let area = (pb[0] - pa[0]) * (pc[1] - pa[1]) - (pb[1] - pa[1]) * (pc[0] - pa[0]);
        // Seen edge-on (or not a number): nothing to see.
        if area.is_nan() || area.abs() < 1e-12 {
            return;
        }
        let ends = |axis: usize, length: usize| {
            let low = pa[axis].min(pb[axis]).min(pc[axis]) - 0.5;
            let high = pa[axis].max(pb[axis]).max(pc[axis]) - 0.5;
            // Casts saturate, so far-away corners stop at the sheet's border.
            (
                low.ceil().max(0.0) as usize,
                ((high.floor() + 1.0).max(0.0) as usize).min(length),
            )
        };
        let (left, right) = ends(0, self.width);
        let (top, bottom) = ends(1, self.height);
        for row in top..bottom {
            let y = row as f64 + 0.5;
            for column in left..right {
                let x = column as f64 + 0.5;
                let wb = ((x - pa[0]) * (pc[1] - pa[1]) - (y - pa[1]) * (pc[0] - pa[0])) / area;
                let wc = ((pb[0] - pa[0]) * (y - pa[1]) - (pb[1] - pa[1]) * (x - pa[0])) / area;
                let wa = 1.0 - wb - wc;
                // Rounding must not open a crack between two triangles: a little beyond the edge still counts.
                if wa < -1e-9 || wb < -1e-9 || wc < -1e-9 {
                    continue;
                }
                let depth = (wa * pa[2] + wb * pb[2] + wc * pc[2]) as f32;
                let sample = &mut self.samples[row * self.width + column];
                if depth > sample.depth {
                    let normal = unit(wa * a.normal + wb * b.normal + wc * c.normal);
                    let tint =
                        [0, 1, 2].map(|index| wa * a.tint[index] + wb * b.tint[index] + wc * c.tint[index]);
                    *sample = Sample {
                        depth,
                        normal: packed(normal),
                        colour: shown(tint, range),
                        shape: id,
                    };
                }
            }
        }
    }

    /// Light, lines, and the mean of the samples of each pixel, in linear light.
    fn developed(&self, rendering: Rendering) -> Image {
        let spacing = 1.0 / (self.view.scale * self.fold as f64);
        let lines = match rendering.lines {
            Lines::None => vec![0.0; self.samples.len()],
            lines => outlines(&self.samples, self.width, spacing, lines == Lines::Edges),
        };
        let decoded: Vec<[f64; 3]> = (0..=255)
            .map(|byte| Colour::rgb(byte, byte, byte).linear())
            .collect();
        let lit = |index: usize| -> [f64; 3] {
            let sample = &self.samples[index];
            if sample.shape == 0 && lines[index] == 0.0 {
                return [1.0; 3];
            }
            let factor = match sample.shape {
                0 => 1.0,
                _ => rendering
                    .light
                    .factor(sample.normal.map(|component| f64::from(component) / 127.0)),
            };
            let clear = 1.0 - f64::from(lines[index]);
            sample.colour.map(|byte| {
                let light = (decoded[usize::from(byte)][0] * factor).min(1.0);
                // Lines are of a dark grey, 0.02 in linear light.
                clear * light + (1.0 - clear) * 0.02
            })
        };
        let share = 1.0 / (self.fold * self.fold) as f64;
        let mut rgba = Vec::with_capacity(4 * self.samples.len() / (self.fold * self.fold));
        for top in (0..self.height).step_by(self.fold) {
            for left in (0..self.width).step_by(self.fold) {
                let mut sum = [0.0; 3];
                for row in top..top + self.fold {
                    for column in left..left + self.fold {
                        let light = lit(row * self.width + column);
                        sum = [0, 1, 2].map(|channel| sum[channel] + light[channel]);
                    }
                }
                let mean = match sum.map(|light| light * share) {
                    // Paper, most of the sheet: its white needs no powers.
                    [red, green, blue] if red.min(green).min(blue) >= 1.0 => Colour::rgb(255, 255, 255),
                    mean => Colour::from_linear(mean),
                };
                rgba.extend([mean.red, mean.green, mean.blue, 255]);
            }
        }
        Image {
            size: self.view.size,
            rgba,
        }
    }
}

/// What is interpolated from one corner.
fn tint(paint: Paint, face: usize, vertex: usize) -> [f64; 3] {
    let channels = |colour: Colour| [colour.red, colour.green, colour.blue].map(f64::from);
    match paint {
        Paint::Uniform(colour) => channels(colour),
        Paint::Faces(colours) => channels(*colours.get(face).unwrap_or(&NO_VALUE)),
        Paint::Vertices(colours) => channels(*colours.get(vertex).unwrap_or(&NO_VALUE)),
        Paint::Values(values, _) => [*values.get(vertex).unwrap_or(&f64::NAN), 0.0, 0.0],
    }
}

/// The sRGB bytes of an interpolated tint.
fn shown(tint: [f64; 3], range: Option<[f64; 2]>) -> [u8; 3] {
    match range {
        None => tint.map(|channel| channel.round() as u8),
        Some(range) => {
            let colour = sequential(fraction(tint[0], range));
            [colour.red, colour.green, colour.blue]
        }
    }
}

/// Where a value is in a range, 0 to 1; 0 in a range without extent, NaN for a value that is not finite.
pub fn fraction(value: f64, [low, high]: [f64; 2]) -> f64 {
    if !value.is_finite() {
        return f64::NAN;
    }
    if high > low {
        ((value - low) / (high - low)).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// A unit normal towards the viewer, in bytes.
fn packed(normal: Vec3) -> [i8; 3] {
    let normal = if normal.z < 0.0 { -normal } else { normal };
    [normal.x, normal.y, normal.z].map(|component| (127.0 * component).round() as i8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looking down: x right, y up.
    fn from_above(size: [u32; 2], scale: f64) -> View {
        View {
            camera: Camera::looking(-Vec3::z(), Vec3::y()),
            scale,
            centre: [0.0, 0.0],
            size,
        }
    }

    fn triangle(corners: [[f64; 3]; 3]) -> TriMesh {
        TriMesh {
            vertices: corners.iter().map(|[x, y, z]| Vec3::new(*x, *y, *z)).collect(),
            triangles: vec![[0, 1, 2]],
        }
    }

    const PLAIN: Rendering = Rendering {
        samples: 1,
        light: Light::Even,
        lines: Lines::None,
    };
    const WHITE: Colour = Colour::rgb(255, 255, 255);

    #[test]
    fn a_known_triangle_covers_the_pixels_whose_centres_it_holds() {
        // 8 × 8 px at 1 px/mm about the origin; the right triangle (−3,−3), (3,−3), (−3,3).
        let mesh = triangle([[-3.0, -3.0, 0.0], [3.0, -3.0, 0.0], [-3.0, 3.0, 0.0]]);
        let view = from_above([8, 8], 1.0);
        let blue = Colour::qualitative(1);
        let image = render(
            &[Shape {
                mesh: &mesh,
                paint: Paint::Uniform(blue),
            }],
            &view,
            PLAIN,
        );
        for row in 0..8u32 {
            for column in 0..8u32 {
                // Centre of the pixel in mm: inside where x ≥ −3, y ≥ −3, x + y ≤ 0.
                let (x, y) = (f64::from(column) - 3.5, 3.5 - f64::from(row));
                let inside = x >= -3.0 && y >= -3.0 && x + y <= 0.0;
                assert_eq!(
                    image.pixel(column, row) != WHITE,
                    inside,
                    "row {row}, column {column}"
                );
            }
        }
    }

    #[test]
    fn the_nearest_wins_in_either_order() {
        let near = triangle([[-3.0, -3.0, 1.0], [3.0, -3.0, 1.0], [0.0, 3.0, 1.0]]);
        let far = triangle([[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]]);
        let red = Shape {
            mesh: &near,
            paint: Paint::Uniform(Colour::rgb(255, 0, 0)),
        };
        let green = Shape {
            mesh: &far,
            paint: Paint::Faces(&[Colour::rgb(0, 255, 0)]),
        };
        let view = from_above([20, 20], 1.0);
        let image = render(&[red, green], &view, PLAIN);
        assert_eq!(image, render(&[green, red], &view, PLAIN));
        let middle = image.pixel(10, 11);
        assert!(middle.red > 200 && middle.green == 0, "{middle:?}");
        let beside = image.pixel(10, 5);
        assert!(beside.green > 200 && beside.red == 0, "{beside:?}");
    }

    #[test]
    fn neighbours_leave_no_crack() {
        // A square of two triangles about an edge that goes through no round number.
        let vertices =
            [[-4.1, -4.3], [4.7, -4.2], [4.4, 4.6], [-4.5, 4.9]].map(|[x, y]| Vec3::new(x, y, 0.1 * x));
        let mesh = TriMesh {
            vertices: vertices.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let view = from_above([64, 64], 6.0);
        let image = render(
            &[Shape {
                mesh: &mesh,
                paint: Paint::Uniform(Colour::qualitative(0)),
            }],
            &view,
            PLAIN,
        );
        for row in 8..56 {
            for column in 8..56 {
                assert_ne!(image.pixel(column, row), WHITE);
            }
        }
    }

    #[test]
    fn values_are_shown_where_they_are() {
        let mesh = triangle([[-30.0, -10.0, 0.0], [30.0, -10.0, 0.0], [0.0, 40.0, 0.0]]);
        let values = [0.0, 1.0, 0.5];
        let shape = Shape {
            mesh: &mesh,
            paint: Paint::Values(&values, [0.0, 1.0]),
        };
        let image = render(&[shape], &from_above([64, 64], 1.0), PLAIN);
        // The map is violet (blue over green) at its low end, yellow (green over blue) at its high one.
        let (low, high) = (image.pixel(6, 41), image.pixel(57, 41));
        assert!(low.blue > low.green && high.green > high.blue, "{low:?} {high:?}");
        assert_eq!(fraction(f64::NAN, [0.0, 1.0]).to_bits(), f64::NAN.to_bits());
        assert_eq!(fraction(3.0, [3.0, 3.0]), 0.0);
    }

    #[test]
    fn wrong_meshes_leave_white_paper() {
        let view = from_above([16, 16], 1.0);
        let mut mesh = triangle([[-3.0, -3.0, 0.0], [3.0, -3.0, 0.0], [0.0, f64::NAN, 0.0]]);
        mesh.triangles.push([0, 1, 77]);
        let image = render(
            &[Shape {
                mesh: &mesh,
                paint: Paint::Vertices(&[]),
            }],
            &view,
            Rendering::default(),
        );
        assert!(image.rgba.iter().all(|byte| *byte == 255));
        assert!(View::fitted(Camera::three_quarter(), [&TriMesh::default()], 100, 100, 5).is_none());
        for (direction, up) in [
            (Vec3::zeros(), Vec3::zeros()),
            (Vec3::z(), Vec3::z()),
            (Vec3::y(), Vec3::y()),
        ] {
            let camera = Camera::looking(direction, up);
            assert!((camera.right.cross(&camera.up) - camera.towards).norm() < 1e-12);
        }
    }

    #[test]
    fn everything_fits_on_the_sheet() {
        let mesh = triangle([[0.0, 0.0, 0.0], [250.0, 10.0, 5.0], [30.0, 90.0, 20.0]]);
        let view = View::fitted(Camera::three_quarter(), [&mesh], 300, 200, 10).unwrap();
        for vertex in &mesh.vertices {
            let [x, y] = view.pixel(*vertex);
            assert!(
                (9.9..=290.1).contains(&x) && (9.9..=f64::from(view.size[1]) - 9.9).contains(&y),
                "{x} {y}"
            );
        }
    }
}
