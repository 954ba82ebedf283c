//! A neo-Hookean block that five other codes have solved.

use super::record::{Findings, Row};
use super::specimen::{Kind, Specimen, forces};
use super::{Check, CheckError, Cost};
use crate::fem::equilibrium::Options;
use crate::material::hyperelastic::{Form, Hyperelastic};
use crate::material::isotropic::shear_and_bulk;
use crate::material::law::Law;
use crate::math::Vec3;

/// The block of five codes.
pub const BLOCK: Check = Check {
    id: "block",
    title: "A rubber block in six codes",
    against: "DOLFINx 0.5, CalculiX 2.20, FElupe 11, scikit-fem 12 and a prototype of our own, which agree to 1e-8 mm: a block of \
              50 × 50 × 25 mm, W = μ/2 (J^(−2/3) I₁ − 3) + K/2 (J − 1)², E = 0.15 MPa, ν = 0.4, its base held, 15 N spread evenly over \
              the nodes of its top within 8.5 mm of the middle.",
    cost: Cost::Light,
    run: block,
};

/// Cells along each axis, tetrahedra, and the mean displacement of the loaded nodes \[mm\].
const CASES: [([usize; 3], usize, f64); 2] = [
    ([7, 8, 5], 1680, -3.2384626163),
    ([12, 11, 10], 7920, -3.7689840047),
];

const SIZE: Vec3 = Vec3::new(50.0, 50.0, 25.0);

fn sunk(counts: [usize; 3]) -> Result<f64, CheckError> {
    let (shear_mpa, bulk_mpa) = shear_and_bulk(0.15, 0.4)?;
    let law = Law::Hyperelastic(Hyperelastic::new(Form::NeoHookeanIsochoric {
        shear_mpa,
        bulk_mpa,
    })?);
    let kind = Kind::Tetrahedra;
    let body = Specimen::new(kind, kind.cuboid(SIZE, counts), law, |x| [x.z < 1e-9; 3])?;
    let is_loaded = |x: &Vec3| x.z > 25.0 - 1e-9 && (x.x - 25.0).hypot(x.y - 25.0) < 8.5;
    let loaded = body.nodes().iter().filter(|x| is_loaded(x)).count() as f64;
    let share = |x: &Vec3| if is_loaded(x) { 1.0 / loaded } else { 0.0 };
    let load = forces(
        body.nodes()
            .iter()
            .map(|x| Vec3::new(0.0, 0.0, -15.0 * share(x)))
            .collect(),
    );
    let options = Options {
        tolerance: 1e-10,
        ..Options::default()
    };
    let u = body.settled(&load, 10, &options)?;
    Ok(body.nodes().iter().zip(&u).map(|(x, u)| share(x) * u.z).sum())
}

fn block() -> Result<Findings, CheckError> {
    let mut rows = Vec::new();
    for (counts, tetrahedra, expected) in CASES {
        let quantity = format!("{tetrahedra} tetrahedra: mean displacement of the loaded nodes");
        rows.push(Row::near(quantity, "mm", expected, sunk(counts)?, 1e-7).digits(8));
    }
    Ok(Findings::new(
        rows,
        "The others stopped at 1e-8 and printed eight to eleven digits.",
    ))
}
