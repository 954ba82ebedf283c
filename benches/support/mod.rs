//! What the benches share: alternating rounds, medians, memory, and the objects that are solved.
#![allow(dead_code)] // Each bench uses a part.

use pliant::fem::forces::Materials;
use pliant::fem::model::Model;
use pliant::fem::stiffness::Kind;
use pliant::geometry::axis::Axis;
use pliant::geometry::files::read::open_surface;
use pliant::geometry::grid::{Grid, Levels};
use pliant::geometry::heights::Heights;
use pliant::geometry::solid::Solid;
use pliant::geometry::volume::VolumeMesh;
use pliant::material::law::Law;
use pliant::math::Vec3;
use pliant::units::LengthUnit;
use std::path::Path;
use std::time::Instant;

/// Seconds that `work` takes.
pub fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

/// Seconds of processor time that the calling thread takes for `work`; wall time where the system does not say. On a
/// machine that others use too, wall times compare badly.
pub fn processor_seconds(work: impl FnOnce()) -> f64 {
    let used = || {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    let before = used();
    let wall = seconds(work);
    match (before, used()) {
        (Some(before), Some(after)) => 1e-9 * (after - before),
        _ => wall,
    }
}

/// The middle of some times.
pub fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// What follows `--name=` among the arguments.
pub fn argument(name: &str) -> Option<String> {
    let start = format!("--{name}=");
    std::env::args().find_map(|a| a.strip_prefix(&start).map(str::to_owned))
}

/// Most memory that the process has used so far \[MiB\]; zero where the system does not say.
pub fn peak_mib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kib = line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok());
    kib.unwrap_or(0.0) / 1024.0
}

/// A model with a law for each point and a load: one linear step.
pub struct Problem {
    pub name: String,
    pub model: Model,
    pub laws: Vec<Law>,
    pub cell_of_point: Vec<u16>,
    pub load: Vec<f64>,
}

impl Problem {
    /// The lower triangle of the stiffness at rest.
    pub fn stiffness(&self) -> Vec<f64> {
        let laws: Vec<&Law> = self.laws.iter().collect();
        let materials = Materials {
            laws: &laws,
            cell_of_point: &self.cell_of_point,
        };
        let rest = vec![Vec3::zeros(); self.model.mesh.nodes.len()];
        let mut values = vec![0.0; self.model.symbolic().pattern().rows.len()];
        self.model.assemble(&rest, &materials, Kind::Secant, &mut values);
        values
    }
}

/// Stiffnesses of the layers and Poisson's ratio of all.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    pub contrast: f64,
    pub poisson: f64,
}

/// A cube of `n³` hexahedra or Kuhn cells of 1 mm, held below, pressed sideways and down on top. With contrast, cubes an
/// eighth of the edge long alternate.
pub fn cube(n: usize, material: Material, tetrahedra: bool) -> Problem {
    let size = Vec3::from_element(n as f64);
    let mesh = VolumeMesh::cuboid(size, [n; 3], tetrahedra);
    let held = mesh.nodes.iter().map(|x| [x.z == 0.0; 3]).collect();
    let part = (n as f64 / 8.0).max(1.0);
    let is_stiff = move |x: &Vec3| (x / part).iter().map(|c| c.floor() as i64).sum::<i64>() % 2 == 0;
    let kind = if tetrahedra { "Kuhn cells" } else { "hexahedra" };
    problem(format!("cube of {kind}"), mesh, None, held, material, is_stiff)
}

/// The flip-flop's sole in hexahedra of `size_mm`, its levels following the surface, cells at the outline partly filled.
pub fn sole(size_mm: f64, layers: usize, material: Material) -> Problem {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/flip-flop/sole.stl");
    let surface = open_surface(&path, Some(LengthUnit::Millimetre)).expect("the sole is shipped");
    let solid = Solid::new(surface.mesh).expect("it is closed");
    let shares: Vec<f64> = (0..=layers).map(|k| k as f64 / layers as f64).collect();
    let heights = Heights::new(&solid, Axis::Z, size_mm);
    let grid = Grid::new(
        &solid,
        Axis::Z,
        size_mm,
        Levels::Following(heights, shares),
        [&[], &[]],
    )
    .expect("the grid fits");
    let mut held = vec![[false; 3]; grid.mesh.nodes.len()];
    for node in grid.end_nodes(false) {
        held[node] = [true; 3];
    }
    let is_stiff = |x: &Vec3| (x / 20.0).iter().map(|c| c.floor() as i64).sum::<i64>() % 2 == 0;
    problem(
        "sole, partly filled".into(),
        grid.mesh,
        Some(grid.fill),
        held,
        material,
        is_stiff,
    )
}

fn problem(
    name: String,
    mesh: VolumeMesh,
    fill: Option<Vec<f64>>,
    held: Vec<[bool; 3]>,
    material: Material,
    is_stiff: impl Fn(&Vec3) -> bool,
) -> Problem {
    let model = Model::new(mesh, fill, held).expect("the mesh is sound and held");
    let laws = [1.0, 1.0 / material.contrast]
        .map(|young| Law::linear_isotropic(young, material.poisson).expect("valid moduli"));
    let per_element = model.parts.points_per_element();
    let cell_of_point = (0..model.parts.points())
        .map(|q| {
            let nodes = model.mesh.elements.nodes_of(q / per_element);
            let middle: Vec3 =
                nodes.iter().map(|&n| model.mesh.nodes[n as usize]).sum::<Vec3>() / nodes.len() as f64;
            u16::from(!is_stiff(&middle))
        })
        .collect();
    let top = model
        .mesh
        .nodes
        .iter()
        .map(|x| x.z)
        .fold(f64::NEG_INFINITY, f64::max);
    let forces: Vec<Vec3> = model
        .mesh
        .nodes
        .iter()
        .map(|x| {
            if x.z > 0.9 * top {
                Vec3::new(0.3, 0.1, -1.0)
            } else {
                Vec3::zeros()
            }
        })
        .collect();
    let mut load = vec![0.0; model.unknowns()];
    model.gather(&forces, &mut load);
    Problem {
        name,
        model,
        laws: laws.to_vec(),
        cell_of_point,
        load,
    }
}
