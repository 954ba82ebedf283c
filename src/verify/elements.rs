//! What every element must do, on meshes of any shape.
//!
//! ```text
//! patch     u = G x on the border  ⇒  u = G x inside
//! rigid     u = (Q − I) x + c      ⇒  f_int = 0
//! turned    f_int(Q (x + u) + c − x) = Q f_int(u)
//! balance   Σ f = 0,  Σ (x + u) × f = 0
//! ```
//!
//! G is a constant displacement gradient, Q a rotation, c a shift. An element that fails the patch test converges to
//! something else than the equations (Irons and Razzaque 1972).

use super::record::{Findings, Row};
use super::specimen::{Kind, Specimen, distort, forces, on_border, prescribed, uniform_traction};
use super::{Check, CheckError, Cost};
use crate::fem::equilibrium::{Options, Stop};
use crate::geometry::volume::VolumeMesh;
use crate::material::law::Law;
use crate::math::{Mat3, Vec3};

/// Patch tests.
pub const PATCH: Check = Check {
    id: "patch",
    title: "Patch test on distorted meshes",
    against: "A homogeneous strain of the border is the strain inside: exact on every mesh (Irons and Razzaque 1972).",
    cost: Cost::Light,
    run: patch,
};

/// Rigid motion, objectivity, balance, inversion.
pub const RIGID: Check = Check {
    id: "rigid",
    title: "Rigid motion, objectivity, and elements inside out",
    against: "A rotation by 131° and a shift of 13 mm make no force; the forces of a bent body turn with it and are in \
              balance. A load that the body cannot carry, and a displacement that turns it inside out, are answered by \
              a refusal.",
    cost: Cost::Light,
    run: rigid,
};

const SIZE: Vec3 = Vec3::new(3.0, 2.0, 2.0);

fn distorted(kind: Kind) -> VolumeMesh {
    let mut mesh = kind.cuboid(SIZE, [3, 3, 2]);
    distort(&mut mesh, SIZE, 1.0, 0.15);
    mesh
}

/// The laws that elements are tried with.
fn laws() -> Result<Vec<(&'static str, Law)>, CheckError> {
    Ok(vec![
        ("linear, ν = 0.3", Law::linear_isotropic(0.3, 0.3)?),
        ("linear, ν = 0.49", Law::linear_isotropic(0.3, 0.49)?),
        ("rubber fitted to coupons", super::path::rubber()?),
    ])
}

fn patch() -> Result<Findings, CheckError> {
    let slope = Mat3::new(-0.15, 0.05, 0.02, 0.08, 0.10, -0.04, 0.03, -0.06, 0.12);
    let options = Options {
        tolerance: 1e-11,
        ..Options::default()
    };
    let mut rows = Vec::new();
    for kind in Kind::ALL {
        let mut worst = 0.0f64;
        for (_, law) in laws()? {
            let body = Specimen::new(kind, distorted(kind), law, |x| [on_border(x, &SIZE); 3])?;
            let target: Vec<Vec3> = body.nodes().iter().map(|x| slope * x).collect();
            let u = body.settled(&prescribed(target.clone()), 1, &options)?;
            let errors = u.iter().zip(&target).map(|(u, t)| (u - t).norm());
            worst = errors.fold(worst, f64::max);
        }
        let quantity = format!("{}: largest |u − G x|", kind.name());
        rows.push(Row::at_most(quantity, "mm", 1e-9, worst));
    }
    Ok(Findings::new(
        rows,
        "Strains of up to 15 %, three laws each. Displacements are about 0.5 mm and the solve stops at 1e-11 of that.",
    ))
}

fn rigid() -> Result<Findings, CheckError> {
    let turn = nalgebra::Rotation3::from_scaled_axis(Vec3::new(1.0, -2.0, 0.5)).into_inner();
    let shift = Vec3::new(10.0, -3.0, 7.0);
    let (mut free, mut turned_by, mut sum, mut moment) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    for kind in Kind::ALL {
        for (_, law) in laws()? {
            let body = Specimen::new(kind, distorted(kind), law, |x| [x.z < 1e-9; 3])?;
            let moved = |u: &dyn Fn(&Vec3) -> Vec3| -> Vec<Vec3> { body.nodes().iter().map(u).collect() };
            let rigid = body.internal_forces(&moved(&|x| turn * x + shift - x));
            let bend = |x: &Vec3| 0.1 * Vec3::new(x.y * x.z, x.x, -x.x * x.y);
            let bent = moved(&bend);
            let before = body.internal_forces(&bent);
            let after = body.internal_forces(&moved(&|x| turn * (x + bend(x)) + shift - x));
            // As shares of the bent body's forces, so that a stiffer law is not judged harder.
            let size: f64 = before.iter().map(|f| f.norm()).fold(0.0, f64::max);
            let largest = rigid.iter().map(|f| f.norm()).fold(0.0, f64::max);
            free = free.max(largest / size);
            let off = before.iter().zip(&after).map(|(b, a)| (turn * b - a).norm());
            turned_by = turned_by.max(off.fold(0.0, f64::max) / size);
            sum = sum.max(before.iter().sum::<Vec3>().norm() / size);
            let arms = body.nodes().iter().zip(&bent).zip(&before);
            let total: Vec3 = arms.map(|((x, u), f)| (x + u).cross(f)).sum();
            moment = moment.max(total.norm() / (size * SIZE.norm()));
        }
    }
    let mut rows = vec![
        Row::at_most("force of a rigid motion, share of a bent body's", "", 1e-12, free),
        Row::at_most("forces turned with the body, difference", "", 1e-12, turned_by),
        Row::at_most("sum of the forces", "", 1e-12, sum),
        Row::at_most("sum of the moments", "", 1e-12, moment),
    ];
    for kind in Kind::ALL {
        rows.push(overload(kind)?);
        rows.push(pushed_through(kind)?);
    }
    Ok(Findings::new(
        rows,
        "Three laws and four kinds of elements, the worst of all. Forces are sums of rounded products: 1e-12 of the largest \
         is a thousand roundings.",
    ))
}

/// A block of 0.05 MPa under 100 N on a small patch folds; there is no equilibrium with det F > 0 to be found.
fn overload(kind: Kind) -> Result<Row, CheckError> {
    let size = Vec3::new(50.0, 40.0, 25.0);
    let law = Law::linear_isotropic(0.05, 0.3)?;
    let body = Specimen::new(kind, kind.cuboid(size, [10, 8, 5]), law, |x| [x.z < 1e-9; 3])?;
    let patch = |x: &Vec3| x.z > 25.0 - 1e-9 && (x.x - 25.0).hypot(x.y - 20.0) < 8.5;
    let shares = uniform_traction(&body.model.mesh, &size, [0, 1], patch);
    let load = forces(shares.iter().map(|s| Vec3::new(0.0, 0.0, -100.0 * s)).collect());
    let curve = body.curve(&load, &[0.1, 0.5, 1.0], &Options::default())?;
    let refused = curve.stop != Stop::Converged && curve.levels.len() < 3;
    let quantity = format!("{}: 100 N on a block of 0.05 MPa", kind.name());
    Ok(Row::answer(quantity, "refused", words(refused), refused))
}

/// The top of a cube is pushed below its base.
fn pushed_through(kind: Kind) -> Result<Row, CheckError> {
    let size = Vec3::from_element(10.0);
    let law = Law::linear_isotropic(0.2, 0.3)?;
    let ends = |x: &Vec3| x.z < 1e-9 || x.z > 10.0 - 1e-9;
    let body = Specimen::new(kind, kind.cuboid(size, [2, 2, 2]), law, |x| [ends(x); 3])?;
    let target = body
        .nodes()
        .iter()
        .map(|x| Vec3::new(0.0, 0.0, -1.2 * x.z))
        .collect();
    let curve = body.curve(&prescribed(target), &[0.5, 1.0], &Options::default())?;
    let refused = curve.stop != Stop::Converged && curve.reached < 1.0 / 1.2;
    let quantity = format!("{}: the top pushed through the base", kind.name());
    Ok(Row::answer(quantity, "refused", words(refused), refused))
}

fn words(refused: bool) -> String {
    if refused { "refused" } else { "accepted" }.into()
}
