//! Cook's membrane near incompressibility: a tapered panel, clamped on the left, sheared on the right.

use super::record::{Findings, Row};
use super::specimen::{Kind, Specimen, forces, uniform_traction};
use super::{Check, CheckError, Cost};
use crate::fem::equilibrium::Options;
use crate::material::hyperelastic::{Form, Hyperelastic};
use crate::material::law::Law;
use crate::math::Vec3;

/// Cook's membrane.
pub const COOK: Check = Check {
    id: "cook",
    title: "Cook's membrane near incompressibility",
    against: "Plane strain, W = μ/2 (J^(−2/3) I₁ − 3) + K/2 (J − 1)², μ = 80.194 MPa, K = 400 889.8 MPa (ν = 0.4999), 100 N per mm of \
              thickness (Simo and Armero 1992, whose figures end at 6.9 mm). FElupe 11 with nine-node quadrilaterals and a \
              discontinuous linear pressure gives 6.8757, 6.9062, 6.9199, 6.9267 mm on 8 to 64 elements a side, and so 6.933 mm in \
              the limit of first order.",
    cost: Cost::Heavy,
    run: cook,
};

/// Vertical displacement of the upper right corner \[mm\], extrapolated from FElupe's last two grids.
const EXPECTED: f64 = 6.933;
const SHEAR_MPA: f64 = 80.194;
const BULK_MPA: f64 = 400_889.8;
/// Force per thickness \[N/mm\].
const LOAD: f64 = 100.0;

/// Vertical displacement of the upper right corner on `n` by `n` cells, one through a thickness of a cell \[mm\].
fn raised(kind: Kind, n: usize) -> Result<f64, CheckError> {
    let thickness = 48.0 / n as f64;
    let square = Vec3::new(1.0, 1.0, thickness);
    let mut mesh = kind.cuboid(square, [n, n, 1]);
    let shares = uniform_traction(&mesh, &square, [1, 2], |x| x.x > 1.0 - 1e-9);
    let corner = mesh
        .nodes
        .iter()
        .position(|x| x.x > 1.0 - 1e-9 && x.y > 1.0 - 1e-9);
    for x in &mut mesh.nodes {
        *x = Vec3::new(48.0 * x.x, 44.0 * x.x + (44.0 - 28.0 * x.x) * x.y, x.z);
    }
    let law = Law::Hyperelastic(Hyperelastic::new(Form::NeoHookeanIsochoric {
        shear_mpa: SHEAR_MPA,
        bulk_mpa: BULK_MPA,
    })?);
    let body = Specimen::new(kind, mesh, law, |x| [x.x < 1e-9, x.x < 1e-9, true])?;
    let total = LOAD * thickness;
    let load = forces(shares.iter().map(|s| Vec3::new(0.0, total * s, 0.0)).collect());
    let u = body.settled(&load, 4, &Options::default())?;
    Ok(corner.map_or(f64::NAN, |i| u[i].y))
}

fn cook() -> Result<Findings, CheckError> {
    let mut rows = Vec::new();
    for kind in Kind::SHARING {
        for (n, tolerance) in [(8, 0.15), (16, 0.06), (32, 0.02)] {
            let quantity = format!("{} × {} {}: rise of the upper right corner", n, n, kind.name());
            rows.push(Row::within(quantity, "mm", EXPECTED, raised(kind, n)?, tolerance).digits(4));
        }
    }
    let locked = raised(Kind::Tetrahedra, 32)?;
    let quantity = "32 × 32 tetrahedra, each with its own volume change";
    rows.push(Row::stated(quantity, "mm", EXPECTED, locked).digits(4));
    Ok(Findings::new(
        rows,
        "The re-entrant clamp limits every method to about the first order. Tetrahedra that share no volume change lock: their row \
         is there for comparison.",
    ))
}
