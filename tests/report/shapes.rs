//! Objects to draw: a sole, its halves in layers, a scan if there is one.

use pliant::geometry::surface::TriMesh;
use pliant::math::Vec3;

/// Half of the width of a sole at a place along it, `t` from heel 0 to toe 1 \[mm\].
fn half_width(t: f64) -> f64 {
    let round = (1.0 - (2.0 * t - 1.0).abs().powi(8)).max(0.0).sqrt();
    round * (34.0 + 9.0 * (std::f64::consts::PI * (1.6 * t - 0.55)).sin())
}

/// A sole 240 mm long: its layer between two fractions of its height.
pub fn sole(from: f64, to: f64, fine: bool) -> TriMesh {
    slab(from, to, -1.0, if fine { [620, 200] } else { [160, 48] })
}

/// Three layers of the left half: cut along the middle, closed.
pub fn cut_sole() -> Vec<TriMesh> {
    [[0.0, 0.35], [0.35, 0.6], [0.6, 1.0]]
        .iter()
        .map(|[from, to]| slab(*from, *to, 0.0, [160, 24]))
        .collect()
}

/// A made-up error on it \[mm\].
pub fn error(point: &Vec3) -> f64 {
    let about = |x: f64, y: f64| (-((point.x - x).powi(2) + (point.y - y).powi(2)) / 900.0).exp();
    0.02 + 0.4 * about(5.0, 35.0) + 0.25 * about(-10.0, 180.0)
}

/// Between two fractions of the height, from a fraction of the half width (−1 the whole, 0 the half) to the right edge.
fn slab(from: f64, to: f64, edge: f64, [along, across]: [usize; 2]) -> TriMesh {
    let mut mesh = TriMesh::default();
    let height = |t: f64, fraction: f64| fraction * (21.0 - 6.0 * t + 2.0 * (6.0 * t).sin());
    for top in [from, to] {
        for i in 0..=along {
            for j in 0..=across {
                let t = 0.004 + 0.992 * i as f64 / along as f64;
                let s = edge + (1.0 - edge) * j as f64 / across as f64;
                let bend = 8.0 * (std::f64::consts::PI * t).sin();
                mesh.vertices
                    .push(Vec3::new(-(s * half_width(t)) - bend, 240.0 * t, height(t, top)));
            }
        }
    }
    let at = |level: usize, i: usize, j: usize| ((level * (along + 1) + i) * (across + 1) + j) as u32;
    let mut quad = |a: u32, b: u32, c: u32, d: u32| mesh.triangles.extend([[a, b, c], [a, c, d]]);
    for i in 0..along {
        for j in 0..across {
            quad(at(0, i, j), at(0, i, j + 1), at(0, i + 1, j + 1), at(0, i + 1, j));
            quad(at(1, i, j), at(1, i + 1, j), at(1, i + 1, j + 1), at(1, i, j + 1));
        }
        quad(at(0, i, 0), at(0, i + 1, 0), at(1, i + 1, 0), at(1, i, 0));
        quad(
            at(0, i, across),
            at(1, i, across),
            at(1, i + 1, across),
            at(0, i + 1, across),
        );
    }
    for j in 0..across {
        quad(at(0, 0, j), at(1, 0, j), at(1, 0, j + 1), at(0, 0, j + 1));
        quad(
            at(0, along, j),
            at(0, along, j + 1),
            at(1, along, j + 1),
            at(1, along, j),
        );
    }
    mesh
}

/// The surface in an STL file; `None` if there is no such file.
pub fn scan(path: &str) -> Option<TriMesh> {
    let mut file = std::fs::File::open(path).ok()?;
    let read = stl_io::read_stl(&mut file).ok()?;
    let vertices = read
        .vertices
        .iter()
        .map(|vertex| Vec3::from(vertex.0.map(f64::from)));
    let triangles = read
        .faces
        .iter()
        .map(|face| face.vertices.map(|corner| corner as u32));
    Some(TriMesh {
        vertices: vertices.collect(),
        triangles: triangles.collect(),
    })
}
