//! A slender cantilever bent until its tip points sideways.

use super::elastica::{Slenderness, tip};
use super::record::{Findings, Row};
use super::specimen::{Kind, Specimen, forces, uniform_traction};
use super::{Check, CheckError, Cost};
use crate::fem::equilibrium::{Options, Stop};
use crate::material::law::Law;
use crate::math::Vec3;

/// Large rotation.
pub const CANTILEVER: Check = Check {
    id: "cantilever",
    title: "Cantilever with large rotation",
    against: "The elastica under a dead tip load: tip deflections of Mattiasson 1981 (Int. J. Numer. Meth. Eng. 17, 145–153), \
              and by our own shooting, which also knows stretch and shear (Reissner 1972).",
    cost: Cost::Heavy,
    run: cantilever,
};

/// P L² / EI, and Mattiasson's shortening and deflection over the length.
const TABLE: [(f64, f64, f64); 3] = [
    (2.0, 0.16064, 0.49346),
    (5.0, 0.38763, 0.71379),
    (10.0, 0.55500, 0.81061),
];

const LENGTH: f64 = 100.0;
const HEIGHT: f64 = 10.0;
const WIDTH: f64 = 1.25;
const YOUNG_MPA: f64 = 1.0;

/// Tip positions at the loads of the table.
fn bent(kind: Kind, counts: [usize; 3]) -> Result<Vec<Vec3>, CheckError> {
    let size = Vec3::new(LENGTH, WIDTH, HEIGHT);
    // With ν = 0 nothing restrains the clamp's cross-section, and bending is plane.
    let law = Law::linear_isotropic(YOUNG_MPA, 0.0)?;
    let body = Specimen::new(kind, kind.cuboid(size, counts), law, |x| {
        [x.x < 1e-9, true, x.x < 1e-9]
    })?;
    let at_tip = |x: &Vec3| x.x > LENGTH - 1e-9;
    let shares = uniform_traction(&body.model.mesh, &size, [1, 2], at_tip);
    let stiffness = YOUNG_MPA * WIDTH * HEIGHT.powi(3) / 12.0;
    let unit = 10.0 * stiffness / (LENGTH * LENGTH);
    let load = forces(shares.iter().map(|s| Vec3::new(0.0, 0.0, unit * s)).collect());
    let factors: Vec<f64> = (1..=20).map(|k| f64::from(k) / 20.0).collect();
    let curve = body.curve(&load, &factors, &Options::default())?;
    if curve.stop != Stop::Converged {
        return Err(CheckError::NotReached {
            stop: curve.stop,
            share: curve.reached,
        });
    }
    let of_level = |u: &Vec<Vec3>| u.iter().zip(&shares).map(|(u, s)| u * *s).sum::<Vec3>() / LENGTH;
    Ok([3, 9, 19].map(|level| of_level(&curve.levels[level])).to_vec())
}

fn cantilever() -> Result<Findings, CheckError> {
    let mut rows = Vec::new();
    for (load, shortening, deflection) in TABLE {
        let own = tip(load, Slenderness::ELASTICA);
        for (name, expected, found) in [
            ("shortening", shortening, own.shortening),
            ("deflection", deflection, own.deflection),
        ] {
            let quantity = format!("shooting, P L²/EI = {load}: {name} over length");
            rows.push(Row::near(quantity, "", expected, found, 1e-5));
        }
    }
    let beam = Slenderness::rectangle(HEIGHT / LENGTH);
    for (kind, counts) in [
        (Kind::Hexahedra, [160, 1, 8]),
        (Kind::KuhnCells, [160, 1, 16]),
        (Kind::Tetrahedra, [160, 1, 16]),
        (Kind::Patches, [160, 1, 16]),
    ] {
        let found = bent(kind, counts)?;
        for ((load, ..), u) in TABLE.iter().zip(found) {
            let expected = tip(*load, beam);
            let [a, b, c] = counts;
            let name = |what: &str| format!("{a} × {b} × {c} {}, {load}: {what}", kind.name());
            rows.push(Row::within(name("shortening"), "", expected.shortening, -u.x, 0.02).digits(4));
            rows.push(Row::within(name("deflection"), "", expected.deflection, u.z, 0.02).digits(4));
        }
    }
    Ok(Findings::new(
        rows,
        "The beam is ten times as long as high and its material is linear in Biot strain with ν = 0, which is just what the shooting \
         assumes; strains reach 22 %. The rows after the table's are of finite elements against the shooting with stretch and shear. \
         Sharing one volume change makes an element a little too soft in bending, by the square of its share of the height; linear \
         shape functions make it a little too stiff.",
    ))
}
