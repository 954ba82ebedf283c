//! A thick hollow sphere, blown up from inside.
//!
//! ```text
//! small strain   u = C r + D / r²,   3 K C = 4 μ D / B³ (nothing pulls outside),   p = 4 μ D (1/A³ − 1/B³)
//! finite strain  b³ − a³ = B³ − A³,  p = μ/2 (4/λ_b + 1/λ_b⁴ − 4/λ_a − 1/λ_a⁴),   λ_a = a/A,  λ_b = b/B
//! ```
//!
//! The second is that of an incompressible neo-Hookean material, from σ_θ − σ_r = μ (λ² − λ⁻⁴) and p = ∫ 2 (σ_θ − σ_r)/r dr.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | A, B; a, b | inner and outer radius at rest; blown up | mm |
//! | λ | stretch along the surface | – |
//! | K, μ | bulk and shear modulus | MPa |
//! | p | pressure on the inner surface | MPa |
//!
//! One octant is meshed, with its three planes of symmetry held. The inner radius is prescribed and the pressure follows from
//! the reactions by virtual work: growing the inner radius a by δa does the work Σ f · n δa = p · 4π a² δa / 8. Source: Lamé;
//! Timoshenko and Goodier, Theory of Elasticity, article 136; Green and Zerna 1954,
//! section 3.10.

use super::record::{Findings, Row};
use super::specimen::{Kind, Specimen, prescribed};
use super::{Check, CheckError, Cost};
use crate::fem::equilibrium::Options;
use crate::geometry::volume::VolumeMesh;
use crate::material::hyperelastic::{Form, Hyperelastic};
use crate::material::isotropic::shear_and_bulk;
use crate::material::law::Law;
use crate::math::Vec3;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Lamé's sphere.
pub const SPHERE: Check = Check {
    id: "sphere",
    title: "Thick sphere under pressure",
    against: "Closed forms: Lamé's at small strain; that of an incompressible neo-Hookean sphere blown up by half (Green and \
              Zerna 1954).",
    cost: Cost::Heavy,
    run: sphere,
};

const INNER: f64 = 10.0;
const OUTER: f64 = 20.0;

/// One octant of the shell, `n` cells along each edge of its three patches and `n` through it, layers thinner inside.
fn octant(kind: Kind, n: usize) -> VolumeMesh {
    let mut number = BTreeMap::new();
    let mut nodes = Vec::new();
    let mut node = |lattice: [usize; 3], layer: usize| -> u32 {
        *number.entry((lattice, layer)).or_insert_with(|| {
            // Equal angles along the edges of each patch.
            let direction = Vec3::from(lattice.map(|i| (FRAC_PI_4 * i as f64 / n as f64).tan())).normalize();
            let radius = INNER * (OUTER / INNER).powf(layer as f64 / n as f64);
            nodes.push(direction * radius);
            nodes.len() as u32 - 1
        })
    };
    let mut cells = Vec::new();
    for axis in 0..3 {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        for layer in 0..n {
            for i in 0..n {
                for j in 0..n {
                    let mut at = |di: usize, dj: usize, dl: usize| {
                        let mut lattice = [n; 3];
                        lattice[b] = i + di;
                        lattice[c] = j + dj;
                        node(lattice, layer + dl)
                    };
                    cells.push([
                        at(0, 0, 0),
                        at(1, 0, 0),
                        at(1, 1, 0),
                        at(0, 1, 0),
                        at(0, 0, 1),
                        at(1, 0, 1),
                        at(1, 1, 1),
                        at(0, 1, 1),
                    ]);
                }
            }
        }
    }
    let elements = kind.of_cells(cells);
    VolumeMesh { nodes, elements }
}

/// The pressure \[MPa\] that grows the inner radius by `growth` \[mm\].
fn pressure(kind: Kind, n: usize, law: Law, growth: f64, steps: usize) -> Result<f64, CheckError> {
    let is_inner = |x: &Vec3| x.norm() < INNER * (1.0 + 1e-9);
    let held = |x: &Vec3| [0, 1, 2].map(|c| is_inner(x) || x[c] < 1e-9);
    let body = Specimen::new(kind, octant(kind, n), law, held)?;
    let target = body
        .nodes()
        .iter()
        .map(|x| {
            if is_inner(x) {
                x.normalize() * growth
            } else {
                Vec3::zeros()
            }
        })
        .collect();
    let u = body.settled(&prescribed(target), steps, &Options::default())?;
    let forces = body.internal_forces(&u);
    let inner = body.nodes().iter().zip(&forces).filter(|(x, _)| is_inner(x));
    let along: f64 = inner.map(|(x, f)| f.dot(&x.normalize())).sum();
    let radius = INNER + growth;
    Ok(along / (FRAC_PI_2 * radius * radius))
}

/// Lamé's pressure for a growth of the inner radius \[MPa\].
fn lame(young_mpa: f64, poisson: f64, growth: f64) -> Result<f64, CheckError> {
    let (shear, bulk) = shear_and_bulk(young_mpa, poisson)?;
    // u(A) = growth, with C = 4 μ D / (3 K B³).
    let per_d = 4.0 * shear / (3.0 * bulk * OUTER.powi(3)) * INNER + 1.0 / (INNER * INNER);
    Ok(4.0 * shear * growth / per_d * (1.0 / INNER.powi(3) - 1.0 / OUTER.powi(3)))
}

/// The pressure in an incompressible neo-Hookean sphere \[MPa\].
fn neo_hookean(shear_mpa: f64, growth: f64) -> f64 {
    let inner = INNER + growth;
    let outer = (OUTER.powi(3) + inner.powi(3) - INNER.powi(3)).cbrt();
    let of = |stretch: f64| 4.0 / stretch + stretch.powi(-4);
    0.5 * shear_mpa * (of(outer / OUTER) - of(inner / INNER))
}

fn sphere() -> Result<Findings, CheckError> {
    let mut rows = Vec::new();
    for kind in Kind::ALL {
        // A tetrahedron with a volume change of its own locks near ½.
        let ratios = if kind == Kind::Tetrahedra {
            &[0.3][..]
        } else {
            &[0.3, 0.499]
        };
        for poisson in ratios {
            let expected = lame(1.0, *poisson, 1e-4)?;
            let law = Law::linear_isotropic(1.0, *poisson)?;
            let found = pressure(kind, 8, law, 1e-4, 1)?;
            let quantity = format!("{}, ν = {poisson}, inner radius + 0.001 %: pressure", kind.name());
            rows.push(Row::within(quantity, "MPa", expected, found, 0.02).digits(4));
        }
    }
    let expected = neo_hookean(1.0, 0.5 * INNER);
    for kind in Kind::SHARING {
        let law = Law::Hyperelastic(Hyperelastic::new(Form::NeoHookeanIsochoric {
            shear_mpa: 1.0,
            bulk_mpa: 2000.0,
        })?);
        for n in [4, 8] {
            let found = pressure(kind, n, law.clone(), 0.5 * INNER, 4)?;
            let quantity = format!(
                "{}, neo-Hookean, {n} cells through, inner radius + 50 %: pressure",
                kind.name()
            );
            rows.push(
                Row::within(quantity, "MPa", expected, found, if n == 4 { 0.05 } else { 0.02 }).digits(4),
            );
        }
    }
    Ok(Findings::new(
        rows,
        "Eight cells through the wall and along each edge of an octant's three patches where nothing else is said. Flat faces and \
         linear shape functions leave 0.1 % (hexahedra) to 1.5 % (tetrahedra), which four cells make four times as large.",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::elements::Discretisation;

    #[test]
    fn the_octant_has_its_volume() {
        let exact = std::f64::consts::PI / 6.0 * (OUTER.powi(3) - INNER.powi(3));
        for kind in Kind::ALL {
            let parts = Discretisation::new(&octant(kind, 8), None).unwrap();
            let volume: f64 = (0..parts.points()).map(|q| parts.weight(q)).sum();
            // Flat faces lie inside the sphere by the square of the cell's angle, (π/16)²/8 twice.
            assert!((volume / exact - 1.0).abs() < 0.01, "{volume} of {exact}");
        }
    }
}
