//! Pictures of an object with their legends: its parts in colour, cut open; a quantity on its surface. The shaded
//! surface is a PNG, everything that is read is text about it.

use super::colour::Colour;
use super::legend::{ColourBar, Legend};
use super::raster::{Camera, Lines, Paint, Rendering, Shape, View, render};
use super::shading::{Light, unit};
use super::svg::{self, Anchor, Drawing, Stroke, Svg, Type};
use super::ticks::{Ticks, extent};
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// Nothing to see.
    #[error("the picture `{title}` shows no surface: its meshes have no vertex with finite coordinates")]
    Empty {
        /// The picture's title.
        title: String,
    },
    /// Values that belong to another mesh.
    #[error(
        "the picture `{title}` has {values} values for {vertices} vertices: give one for each vertex, NaN where none \
         is known"
    )]
    Values {
        /// The picture's title.
        title: String,
        /// How many values were given.
        values: usize,
        /// How many are needed.
        vertices: usize,
    },
    /// The encoder refused.
    #[error("the picture `{title}` could not be written as PNG")]
    Encoding {
        /// The picture's title.
        title: String,
        /// What the encoder says.
        source: image::ImageError,
    },
}

/// A part of an object in one colour.
#[derive(Clone, Debug)]
pub struct ColouredPart<'a> {
    /// The legend's entry; parts of one name and colour share it.
    pub name: String,
    /// Its colour.
    pub colour: Colour,
    /// Its closed surface, already cut.
    pub mesh: &'a TriMesh,
}

/// A place on an object where something acts.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    /// Where \[mm\].
    pub at: Vec3,
    /// An arrow that ends there in this direction; a dot without.
    pub direction: Option<Vec3>,
    /// What it is called; may be empty.
    pub label: String,
}

impl Marker {
    /// A load: an arrow along its direction.
    pub fn load(at: Vec3, direction: Vec3, label: impl Into<String>) -> Self {
        Self {
            at,
            direction: Some(direction),
            label: label.into(),
        }
    }

    /// A point of measurement.
    pub fn point(at: Vec3, label: impl Into<String>) -> Self {
        Self {
            at,
            direction: None,
            label: label.into(),
        }
    }
}

/// An object's parts in their colours.
#[derive(Clone, Debug)]
pub struct CutOpen<'a> {
    /// Read aloud to those who don't see it, and named in errors.
    pub title: String,
    /// The parts.
    pub parts: Vec<ColouredPart<'a>>,
    /// What is marked on it.
    pub markers: Vec<Marker>,
}

impl<'a> CutOpen<'a> {
    /// Parts without markers.
    pub fn new(title: impl Into<String>, parts: Vec<ColouredPart<'a>>) -> Self {
        Self {
            title: title.into(),
            parts,
            markers: Vec::new(),
        }
    }

    /// The same with marks.
    pub fn marked(self, markers: Vec<Marker>) -> Self {
        Self { markers, ..self }
    }

    /// The picture.
    ///
    /// # Errors
    /// [`PictureError::Empty`] where there is nothing to see.
    pub fn picture(&self, camera: &Camera) -> Result<Picture, PictureError> {
        let shapes: Vec<Shape> = self
            .parts
            .iter()
            .map(|part| Shape {
                mesh: part.mesh,
                paint: Paint::Uniform(part.colour),
            })
            .collect();
        let mut entries: Vec<(String, Colour)> = Vec::new();
        for part in &self.parts {
            let entry = (part.name.clone(), part.colour);
            if !entries.contains(&entry) {
                entries.push(entry);
            }
        }
        let rendering = Rendering {
            light: Light::Modelling,
            lines: Lines::Edges,
            ..Rendering::default()
        };
        Picture::of(
            &self.title,
            &shapes,
            camera,
            rendering,
            Legend::Parts(entries),
            &self.markers,
        )
    }
}

/// A quantity on an object's surface.
#[derive(Clone, Debug)]
pub struct SurfaceMap<'a> {
    /// Read aloud to those who don't see it, and named in errors.
    pub title: String,
    /// The surface.
    pub mesh: &'a TriMesh,
    /// The quantity at each vertex, `(n)`; NaN where it is not known.
    pub values: &'a [f64],
    /// Its name, as in `displacement error`.
    pub quantity: String,
    /// Its unit, as in `mm`.
    pub unit: String,
    /// The ends of the colour bar; `None` for the smallest and the largest value.
    pub range: Option<[f64; 2]>,
    /// What is marked on it.
    pub markers: Vec<Marker>,
}

impl<'a> SurfaceMap<'a> {
    /// A quantity over its own range, without markers.
    pub fn new(
        title: impl Into<String>,
        mesh: &'a TriMesh,
        values: &'a [f64],
        quantity: impl Into<String>,
        unit: impl Into<String>,
    ) -> Self {
        let (title, quantity, unit) = (title.into(), quantity.into(), unit.into());
        Self {
            title,
            mesh,
            values,
            quantity,
            unit,
            range: None,
            markers: Vec::new(),
        }
    }

    /// The same over a given range, so that pictures can be compared.
    pub fn ranged(self, range: [f64; 2]) -> Self {
        Self {
            range: Some(range),
            ..self
        }
    }

    /// The same with marks.
    pub fn marked(self, markers: Vec<Marker>) -> Self {
        Self { markers, ..self }
    }

    /// The picture.
    ///
    /// # Errors
    /// [`PictureError::Values`] if there is not one value for each vertex, [`PictureError::Empty`] where there is
    /// nothing to see.
    pub fn picture(&self, camera: &Camera) -> Result<Picture, PictureError> {
        let (values, vertices) = (self.values.len(), self.mesh.vertices.len());
        if values != vertices {
            return Err(PictureError::Values {
                title: self.title.clone(),
                values,
                vertices,
            });
        }
        let own = extent(self.values.iter().copied());
        let given = self
            .range
            .filter(|[low, high]| low.is_finite() && high.is_finite() && low <= high);
        let range = given.or(own).unwrap_or([0.0, 0.0]);
        let shapes = [Shape {
            mesh: self.mesh,
            paint: Paint::Values(self.values, range),
        }];
        let rendering = Rendering {
            light: Light::Even,
            lines: Lines::Edges,
            ..Rendering::default()
        };
        let legend = Legend::Scale(ColourBar {
            quantity: self.quantity.clone(),
            unit: self.unit.clone(),
            range,
            unknown: self.values.iter().any(|value| !value.is_finite()),
        });
        Picture::of(&self.title, &shapes, camera, rendering, legend, &self.markers)
    }
}

/// A finished picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// What it shows.
    pub title: String,
    /// What its colours mean.
    pub legend: Legend,
    view: View,
    png: Vec<u8>,
    markers: Vec<Marker>,
}

/// Width of a picture in a page \[px\].
const WIDTH: f64 = super::plot::WIDTH;
/// Pixels of the PNG to a pixel of the page, for dense screens and print.
const DENSITY: u32 = 2;

impl Picture {
    fn of(
        title: &str,
        shapes: &[Shape],
        camera: &Camera,
        rendering: Rendering,
        legend: Legend,
        markers: &[Marker],
    ) -> Result<Self, PictureError> {
        let width = WIDTH as u32 * DENSITY;
        let meshes = shapes.iter().map(|shape| shape.mesh);
        let view = View::fitted(*camera, meshes, width, width * 2 / 3, 12 * DENSITY).ok_or_else(|| {
            PictureError::Empty {
                title: title.to_owned(),
            }
        })?;
        // Two samples along each side of half a pixel are as fine as four of a whole one.
        let image = render(
            shapes,
            &view,
            Rendering {
                samples: 2,
                ..rendering
            },
        );
        let png = image.png().map_err(|source| PictureError::Encoding {
            title: title.to_owned(),
            source,
        })?;
        Ok(Self {
            title: title.to_owned(),
            legend,
            view,
            png,
            markers: markers.to_vec(),
        })
    }

    /// The shaded surface alone, as the bytes of a PNG file.
    pub fn png(&self) -> &[u8] {
        &self.png
    }

    /// The picture with markers, a scale bar and its legend.
    pub fn svg(&self) -> Svg {
        let height = f64::from(self.view.size[1]) / f64::from(DENSITY);
        // An arrow that starts above the picture moves it down.
        let highest = self
            .markers
            .iter()
            .filter_map(|marker| self.arrow(marker))
            .map(|[tail, _]| tail[1]);
        let top = (14.0 - highest.fold(f64::INFINITY, f64::min)).max(0.0);
        let bottom = top + height + 34.0;
        let mut drawing = Drawing::new(WIDTH, bottom + self.legend.height());
        drawing.png([0.0, top], [WIDTH, height], &self.png);
        for marker in &self.markers {
            self.draw_marker(&mut drawing, marker, top);
        }
        self.draw_scale(&mut drawing, bottom - 14.0);
        self.legend.draw(&mut drawing, bottom);
        drawing.finish(&self.title)
    }

    /// Where a point is in the drawing, without the shift to the top \[px\].
    fn place(&self, point: Vec3) -> [f64; 2] {
        self.view.pixel(point).map(|pixel| pixel / f64::from(DENSITY))
    }

    /// Tail and tip of a marker's arrow; `None` for a dot, or an arrow seen from an end.
    fn arrow(&self, marker: &Marker) -> Option<[[f64; 2]; 2]> {
        let seen = self.view.camera.seen(unit(marker.direction?));
        let tip = self.place(marker.at);
        // 52 px long where it lies in the picture, shorter where it comes towards us.
        let shaft = [52.0 * seen.x, -52.0 * seen.y];
        let visible = shaft[0].hypot(shaft[1]) > 14.0 && tip.iter().all(|value| value.is_finite());
        visible.then(|| [[tip[0] - shaft[0], tip[1] - shaft[1]], tip])
    }

    fn draw_marker(&self, drawing: &mut Drawing, marker: &Marker, top: f64) {
        let place = self.place(marker.at);
        if !place.iter().all(|value| value.is_finite()) {
            return;
        }
        let white = Stroke::solid(Colour::rgb(255, 255, 255), 5.0);
        let label = match self.arrow(marker) {
            Some(ends) => {
                let [tail, tip] = ends.map(|[x, y]| [x, y + top]);
                let length = (tip[0] - tail[0]).hypot(tip[1] - tail[1]);
                let along = [(tip[0] - tail[0]) / length, (tip[1] - tail[1]) / length];
                let point = |back: f64, side: f64| {
                    [
                        tip[0] - back * along[0] - side * along[1],
                        tip[1] - back * along[1] + side * along[0],
                    ]
                };
                let head = [tip, point(11.0, 4.6), point(11.0, -4.6)];
                drawing.line(&[tail, point(8.0, 0.0)], white);
                drawing.line(
                    &[head[0], head[1], head[2], head[0]],
                    Stroke { width: 3.0, ..white },
                );
                drawing.line(&[tail, point(9.0, 0.0)], Stroke::solid(svg::INK, 2.0));
                drawing.polygon(&head, svg::INK, 1.0);
                [tail[0] + 7.0, tail[1] + 6.0]
            }
            None => {
                drawing.dot([place[0], place[1] + top], 4.0, svg::INK);
                [place[0] + 8.0, place[1] + top + 4.0]
            }
        };
        if !marker.label.is_empty() {
            let (anchor, x) = if label[0] > WIDTH - 8.0 - svg::text_width(&marker.label, 12.0) {
                (Anchor::End, label[0] - 15.0)
            } else {
                (Anchor::Start, label[0])
            };
            let style = Type {
                rim: true,
                anchor,
                ..Type::of(12.0)
            };
            drawing.text([x, label[1]], &marker.label, style, false);
        }
    }

    /// A bar of a round length.
    fn draw_scale(&self, drawing: &mut Drawing, y: f64) {
        let pixels_per_mm = self.view.scale / f64::from(DENSITY);
        let ticks = Ticks::between(0.0, 0.4 * WIDTH / pixels_per_mm, 2);
        let length = ticks.step * pixels_per_mm;
        let stroke = Stroke::solid(svg::SOFT_INK, 1.4);
        let ends = [16.0, 16.0 + length];
        drawing.line(&[[ends[0], y], [ends[1], y]], stroke);
        for end in ends {
            drawing.line(&[[end, y - 3.5], [end, y + 3.5]], stroke);
        }
        let text = format!("{} mm", ticks.label(ticks.step));
        drawing.text(
            [ends[1] + 8.0, y + 4.0],
            &text,
            Type::of(12.0).coloured(svg::SOFT_INK),
            false,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::super::colour::NO_VALUE;
    use super::*;

    fn triangle() -> TriMesh {
        let vertices = [[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [0.0, 30.0, 5.0]];
        TriMesh {
            vertices: vertices.map(|[x, y, z]| Vec3::new(x, y, z)).to_vec(),
            triangles: vec![[0, 1, 2]],
        }
    }

    #[test]
    fn the_colour_bar_ends_where_the_data_end() {
        let mesh = triangle();
        let values = [0.137, 2.46, 1.0];
        let picture = SurfaceMap::new("t", &mesh, &values, "error", "mm")
            .picture(&Camera::three_quarter())
            .unwrap();
        let Legend::Scale(bar) = &picture.legend else {
            panic!("no scale")
        };
        assert_eq!(bar.range, [0.137, 2.46]);
        let svg = picture.svg();
        assert!(
            svg.as_str().contains("error [mm]")
                && svg.as_str().contains(">0.137</text>")
                && svg.as_str().contains(">2.46</text>")
        );
    }

    #[test]
    fn unknown_and_equal_values_are_shown() {
        let mesh = triangle();
        for values in [[f64::NAN; 3], [2.0; 3], [0.0, f64::INFINITY, 1.0]] {
            let svg = SurfaceMap::new("t", &mesh, &values, "error", "mm")
                .picture(&Camera::three_quarter())
                .unwrap()
                .svg();
            assert!(!svg.as_str().contains("NaN") && !svg.as_str().contains("inf"));
        }
    }

    #[test]
    fn a_value_too_few_is_refused() {
        let mesh = triangle();
        let error = SurfaceMap::new("heel", &mesh, &[1.0], "error", "mm")
            .picture(&Camera::three_quarter())
            .unwrap_err();
        assert_eq!(
            error.to_string(),
            "the picture `heel` has 1 values for 3 vertices: give one for each vertex, NaN where none is known"
        );
        let empty = TriMesh::default();
        let part = ColouredPart {
            name: "a".to_owned(),
            colour: Colour::qualitative(1),
            mesh: &empty,
        };
        assert!(matches!(
            CutOpen::new("x", vec![part]).picture(&Camera::three_quarter()),
            Err(PictureError::Empty { .. })
        ));
    }

    #[test]
    fn parts_of_one_material_share_an_entry() {
        let mesh = triangle();
        let part = |name: &str, index| ColouredPart {
            name: name.to_owned(),
            colour: Colour::qualitative(index),
            mesh: &mesh,
        };
        let cut = CutOpen::new("x", vec![part("a", 1), part("b", 2), part("a", 1)]);
        let picture = cut.picture(&Camera::three_quarter()).unwrap();
        assert!(matches!(&picture.legend, Legend::Parts(entries) if entries.len() == 2));
        assert_eq!(&picture.png()[1..4], b"PNG");
    }

    #[test]
    fn an_arrow_points_where_the_load_pushes() {
        let mesh = triangle();
        let at = Vec3::new(10.0, 10.0, 2.0);
        let cut = CutOpen::new(
            "x",
            vec![ColouredPart {
                name: "a".to_owned(),
                colour: NO_VALUE,
                mesh: &mesh,
            }],
        )
        .marked(vec![Marker::load(at, -Vec3::z(), "5 N")]);
        let picture = cut.picture(&Camera::three_quarter()).unwrap();
        let [tail, tip] = picture.arrow(&cut.markers[0]).unwrap();
        // Down in the world is down in the picture, and down is more in pixels.
        assert!(tip[1] > tail[1] + 14.0 && (tip[0] - tail[0]).abs() < 1e-6);
        assert_eq!(tip, picture.place(at));
        assert!(picture.svg().as_str().contains(">5 N</text>"));
    }
}
