//! Orders of convergence on a manufactured solution at finite strain.
//!
//! ```text
//! choose u(X);   F = I + ∇u,  P = R T(U − I);   b = −Div P    body force, a dead load
//! solve with u on the border and b inside;      ‖u_h − u‖ = O(h²),  ‖∇u_h − ∇u‖ = O(h)
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | u | displacement on a cube with edges of 1 mm | mm |
//! | P | first Piola–Kirchhoff stress of the law itself | MPa |
//! | b | force per undeformed volume | N/mm³ |
//! | h | edge of a cell | mm |
//!
//! Norms are L2 over the undeformed body, as shares of the norm of u and of ∇u. The orders are those of linear shape
//! functions (Strang and Fix 1973). The meshes are distorted, since equal cells can be better than their order. Source of
//! the method: Roache 2002, Code verification by the method of manufactured solutions.

use super::record::{Findings, Row};
use super::specimen::{Kind, Rule, Specimen, distort, integrate, on_border};
use super::{Check, CheckError, Cost};
use crate::fem::equilibrium::{Load, Options};
use crate::material::hyperelastic::{Form, Hyperelastic};
use crate::material::law::Law;
use crate::math::mandel::{from_tensor, to_tensor};
use crate::math::polar::polar;
use crate::math::{Mat3, Vec3};

/// Convergence to a manufactured solution.
pub const ORDERS: Check = Check {
    id: "orders",
    title: "Orders of convergence at finite strain",
    against: "Manufactured solutions with strains of up to 40 %: the error of the displacement must fall with the square of \
              the cell's size, that of its gradient with the size itself.",
    cost: Cost::Heavy,
    run: orders,
};

/// Cells along each edge of the cube.
const GRIDS: [usize; 3] = [4, 8, 16];
/// Step of the differences that give Div P \[mm\]; of the fourth order, so their error is about 1e-11 of P.
const STEP: f64 = 1e-3;

/// A chosen displacement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Field {
    /// Volumes change by up to 60 %.
    Compressible,
    /// No volume changes: three shears one after the other.
    Isochoric,
}

impl Field {
    /// u \[mm\].
    fn displacement(self, x: &Vec3) -> Vec3 {
        match self {
            Field::Compressible => Vec3::new(
                0.16 * (2.1 * x.x + 0.9 * x.y).sin() * (1.3 * x.z).cos(),
                0.14 * (1.7 * x.x).cos() * (2.3 * x.y + 0.7 * x.z).sin(),
                0.13 * (2.2 * x.z - 1.1 * x.x).sin() + 0.10 * x.x * x.y,
            ),
            Field::Isochoric => {
                let u = 0.15 * (2.1 * x.y + 0.9 * x.z).sin();
                let v = 0.15 * (1.9 * (x.x + u) - 1.2 * x.z).sin();
                let w = 0.15 * (2.0 * (x.x + u) + 1.3 * (x.y + v)).cos();
                Vec3::new(u, v, w)
            }
        }
    }

    /// ∇u, row i for component i.
    fn gradient(self, x: &Vec3) -> Mat3 {
        match self {
            Field::Compressible => {
                let (a, b, c) = (2.1 * x.x + 0.9 * x.y, 1.3 * x.z, 1.7 * x.x);
                let (d, e) = (2.3 * x.y + 0.7 * x.z, 2.2 * x.z - 1.1 * x.x);
                Mat3::new(
                    0.16 * 2.1 * a.cos() * b.cos(),
                    0.16 * 0.9 * a.cos() * b.cos(),
                    -0.16 * 1.3 * a.sin() * b.sin(),
                    -0.14 * 1.7 * c.sin() * d.sin(),
                    0.14 * 2.3 * c.cos() * d.cos(),
                    0.14 * 0.7 * c.cos() * d.cos(),
                    -0.13 * 1.1 * e.cos() + 0.10 * x.y,
                    0.10 * x.x,
                    0.13 * 2.2 * e.cos(),
                )
            }
            Field::Isochoric => {
                let a = 0.15 * (2.1 * x.y + 0.9 * x.z).cos();
                let u = 0.15 * (2.1 * x.y + 0.9 * x.z).sin();
                let b = 0.15 * (1.9 * (x.x + u) - 1.2 * x.z).cos();
                let v = 0.15 * (1.9 * (x.x + u) - 1.2 * x.z).sin();
                let c = -0.15 * (2.0 * (x.x + u) + 1.3 * (x.y + v)).sin();
                let du = Vec3::new(0.0, 2.1 * a, 0.9 * a);
                let dx = Vec3::x() + du;
                let dv = b * (1.9 * dx - 1.2 * Vec3::z());
                let dw = c * (2.0 * dx + 1.3 * (Vec3::y() + dv));
                Mat3::from_rows(&[du.transpose(), dv.transpose(), dw.transpose()])
            }
        }
    }
}

/// P = R T(U − I).
fn piola(field: Field, law: &Law, x: &Vec3) -> Mat3 {
    let p = polar(&(Mat3::identity() + field.gradient(x)));
    p.rotation * to_tensor(&law.stress(&from_tensor(&(p.stretch - Mat3::identity()))))
}

fn body_force(field: Field, law: &Law, x: &Vec3) -> Vec3 {
    let mut divergence = Vec3::zeros();
    for c in 0..3 {
        let at = |steps: f64| {
            let mut moved = *x;
            moved[c] += steps * STEP;
            piola(field, law, &moved).column(c).into_owned()
        };
        divergence += (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * STEP);
    }
    -divergence
}

/// Relative errors of the displacement and of its gradient on `n` cells along each edge.
fn errors(kind: Kind, field: Field, law: &Law, n: usize) -> Result<[f64; 2], CheckError> {
    let size = Vec3::from_element(1.0);
    let mut mesh = kind.cuboid(size, [n; 3]);
    distort(&mut mesh, size, 1.0 / n as f64, 0.1);
    let body = Specimen::new(kind, mesh, law.clone(), |x| [on_border(x, &size); 3])?;
    let mut forces = vec![Vec3::zeros(); body.nodes().len()];
    integrate(&body.model.mesh, Rule::Loads, |s| {
        let b = body_force(field, law, &s.place) * s.weight;
        for (&i, shape) in s.nodes.iter().zip(s.shape) {
            forces[i as usize] += b * *shape;
        }
    });
    let load = Load {
        forces,
        prescribed: Some(body.nodes().iter().map(|x| field.displacement(x)).collect()),
    };
    let u = body.settled(&load, 1, &Options::default())?;
    let (mut off, mut whole) = ([0.0; 2], [0.0; 2]);
    integrate(&body.model.mesh, Rule::Errors, |s| {
        let (mut value, mut slope) = (Vec3::zeros(), Mat3::zeros());
        for ((&i, shape), g) in s.nodes.iter().zip(s.shape).zip(s.gradients) {
            value += u[i as usize] * *shape;
            slope += u[i as usize] * g.transpose();
        }
        let (exact, exact_slope) = (field.displacement(&s.place), field.gradient(&s.place));
        off[0] += s.weight * (value - exact).norm_squared();
        off[1] += s.weight * (slope - exact_slope).norm_squared();
        whole[0] += s.weight * exact.norm_squared();
        whole[1] += s.weight * exact_slope.norm_squared();
    });
    Ok([0, 1].map(|k| (off[k] / whole[k]).sqrt()))
}

fn orders() -> Result<Findings, CheckError> {
    let rubber = Law::Hyperelastic(Hyperelastic::new(Form::NeoHookeanIsochoric {
        shear_mpa: 0.1,
        bulk_mpa: 5.0,
    })?);
    let linear = Law::linear_isotropic(0.3, 0.3)?;
    let mut rows = Vec::new();
    for (field, name, law, kinds) in [
        (Field::Compressible, "linear, ν = 0.3", linear, &Kind::ALL[..]),
        (
            Field::Isochoric,
            "neo-Hookean, ν = 0.49",
            rubber,
            &Kind::SHARING[..],
        ),
    ] {
        for &kind in kinds {
            let mut found = Vec::new();
            for n in GRIDS {
                found.push(errors(kind, field, &law, n)?);
            }
            for (k, norm, least) in [(0, "u", 1.85), (1, "∇u", 0.95)] {
                let orders: Vec<f64> = found.windows(2).map(|e| (e[0][k] / e[1][k]).log2()).collect();
                for (grids, order) in GRIDS.windows(2).zip(orders) {
                    // The coarsest pair need not have found its order yet.
                    let least = if grids[0] == GRIDS[0] { least - 0.15 } else { least };
                    let quantity = format!(
                        "{name}, {}: order of {norm}, {} to {} cells an edge",
                        kind.name(),
                        grids[0],
                        grids[1]
                    );
                    rows.push(Row::at_least(quantity, "", least, order).digits(3));
                }
            }
        }
    }
    Ok(Findings::new(
        rows,
        "Norms are L2 over the undeformed body. The neo-Hookean solution keeps every volume, so that its pressure stays moderate. What \
         is asked leaves room for the distortion, which changes from grid to grid, and more on the coarsest pair.",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_are_those_of_the_displacements_and_strains_are_finite() {
        for field in [Field::Compressible, Field::Isochoric] {
            let (mut largest, mut least, mut most) = (0.0f64, f64::INFINITY, 0.0f64);
            for k in 0..200 {
                let t = f64::from(k);
                let x = Vec3::new((0.37 * t).fract(), (0.61 * t).fract(), (0.83 * t).fract());
                for c in 0..3 {
                    let mut step = Vec3::zeros();
                    step[c] = 1e-6;
                    let ends = [x + step, x - step].map(|x| field.displacement(&x));
                    let by_difference = (ends[0] - ends[1]) / 2e-6;
                    assert!((by_difference - field.gradient(&x).column(c)).norm() < 1e-9);
                }
                let f = Mat3::identity() + field.gradient(&x);
                (least, most) = (least.min(f.determinant()), most.max(f.determinant()));
                let strain = polar(&f).stretch - Mat3::identity();
                largest = largest.max(strain.symmetric_eigenvalues().amax());
            }
            assert!(largest > 0.25 && largest < 0.5, "{largest}");
            match field {
                Field::Compressible => assert!(least > 0.3 && most > 1.3, "{least} {most}"),
                Field::Isochoric => assert!((least - 1.0).abs() < 1e-14 && (most - 1.0).abs() < 1e-14),
            }
        }
    }
}
