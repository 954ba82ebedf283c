//! What must not change an answer: how many load steps lead to it, how many threads there are, how nodes are numbered.

use super::record::{Findings, Row};
use super::specimen::{Kind, Specimen, distort, forces, uniform_traction};
use super::{Check, CheckError, Cost};
use crate::fem::equilibrium::{Load, Options};
use crate::geometry::volume::{Elements, VolumeMesh};
use crate::material::law::Law;
use crate::math::Vec3;

/// Load steps, threads, numbering.
pub const REPEAT: Check = Check {
    id: "repeat",
    title: "Load steps, threads and numbering",
    against: "The same block, solved again.",
    cost: Cost::Heavy,
    run: repeat,
};

const SIZE: Vec3 = Vec3::new(50.0, 40.0, 25.0);

fn mesh(kind: Kind) -> VolumeMesh {
    let mut mesh = kind.cuboid(SIZE, [10, 8, 5]);
    distort(&mut mesh, SIZE, 5.0, 0.1);
    mesh
}

fn pressed(kind: Kind, mesh: VolumeMesh, law: Law) -> Result<(Specimen, Load), CheckError> {
    let body = Specimen::new(kind, mesh, law, |x| [x.z < 1e-9; 3])?;
    let patch = |x: &Vec3| x.z > 25.0 - 1e-9 && (x.x - 25.0).hypot(x.y - 20.0) < 8.5;
    let shares = uniform_traction(&body.model.mesh, &SIZE, [0, 1], patch);
    let load = forces(shares.iter().map(|s| Vec3::new(0.0, 0.0, -5.0 * s)).collect());
    Ok((body, load))
}

/// Largest distance between two fields, as a share of the largest displacement.
fn apart(a: &[Vec3], b: &[Vec3]) -> f64 {
    let size = a.iter().map(Vec3::norm).fold(0.0, f64::max);
    let off = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    off.fold(0.0, f64::max) / size
}

/// The mesh with its nodes numbered in another order, and the new number of each node. 7919 is prime, so its multiples go
/// through all remainders of the node count unless that is a multiple of it. Elements keep their order: patches of
/// tetrahedra are grown in it.
fn renumbered(mesh: &VolumeMesh) -> (VolumeMesh, Vec<u32>) {
    let count = mesh.nodes.len();
    let place = |i: usize| (i * 7919 + 13) % count;
    let mut nodes = vec![Vec3::zeros(); count];
    mesh.nodes
        .iter()
        .enumerate()
        .for_each(|(i, x)| nodes[place(i)] = *x);
    fn turned<const N: usize>(cells: &[[u32; N]], place: impl Fn(usize) -> usize) -> Vec<[u32; N]> {
        let again = cells.iter();
        again.map(|c| c.map(|i| place(i as usize) as u32)).collect()
    }
    let elements = match &mesh.elements {
        Elements::Hexahedra(cells) => Elements::Hexahedra(turned(cells, place)),
        Elements::KuhnCells(cells) => Elements::KuhnCells(turned(cells, place)),
        Elements::Tetrahedra(tets) => Elements::Tetrahedra(turned(tets, place)),
    };
    let map = (0..count).map(|i| place(i) as u32).collect();
    (VolumeMesh { nodes, elements }, map)
}

fn on_threads(threads: usize, kind: Kind, law: &Law, options: &Options) -> Result<Vec<Vec3>, CheckError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|e| CheckError::Other(format!("no pool of {threads} threads: {e}")))?;
    pool.install(|| {
        let (body, load) = pressed(kind, mesh(kind), law.clone())?;
        body.settled(&load, 1, options)
    })
}

fn repeat() -> Result<Findings, CheckError> {
    let exact = Options {
        tolerance: 1e-12,
        accelerated_iterations: 100,
        ..Options::default()
    };
    let law = super::path::rubber()?;
    let mut rows = Vec::new();
    for kind in Kind::ALL {
        let (body, load) = pressed(kind, mesh(kind), law.clone())?;
        let once = body.settled(&load, 1, &Options::default())?;
        let mut steps = 0.0f64;
        for n in [3, 10] {
            steps = steps.max(apart(&once, &body.settled(&load, n, &Options::default())?));
        }
        let of = |what: &str| format!("{}: {what}", kind.name());
        rows.push(Row::at_most(
            of("1, 3 and 10 load steps, difference"),
            "",
            1e-6,
            steps,
        ));

        let [one, four] = [1, 4].map(|threads| on_threads(threads, kind, &law, &exact));
        let same = one? == four?;
        let words = if same { "the same bits" } else { "other bits" };
        rows.push(Row::answer(
            of("1 and 4 threads"),
            "the same bits",
            words.into(),
            same,
        ));

        let plain = body.settled(&load, 1, &exact)?;
        let (turned, map) = renumbered(&body.model.mesh);
        let (other, load) = pressed(kind, turned, law.clone())?;
        let found = other.settled(&load, 1, &exact)?;
        let back: Vec<Vec3> = map.iter().map(|&i| found[i as usize]).collect();
        rows.push(Row::at_most(
            of("nodes in another order, difference"),
            "",
            1e-9,
            apart(&plain, &back),
        ));
    }
    Ok(Findings::new(
        rows,
        "A rubber fitted to coupons, 5 N on a patch. Differences are shares of the largest displacement. The solve stops at 1e-8 \
         of the load in the first row and at 1e-12 in the others.",
    ))
}
