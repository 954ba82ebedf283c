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
use crate::material::law::Law;
use crate::math::mandel::{from_tensor, to_tensor};
use crate::math::polar::polar;
use crate::math::{Mat3, Vec3};

/// Convergence to a manufactured solution.
pub const ORDERS: Check = Check {
    id: "orders",
    title: "Orders of convergence at finite strain",
    against: "A manufactured solution with strains of up to 40 %: the error of the displacement must fall with the square of \
              the cell's size, that of its gradient with the size itself.",
    cost: Cost::Heavy,
    run: orders,
};

/// Cells along each edge of the cube.
const GRIDS: [usize; 3] = [4, 8, 16];
/// Step of the differences that give Div P \[mm\]; of the fourth order, so their error is about 1e-11 of P.
const STEP: f64 = 1e-3;

/// The chosen displacement \[mm\].
fn displacement(x: &Vec3) -> Vec3 {
    Vec3::new(
        0.16 * (2.1 * x.x + 0.9 * x.y).sin() * (1.3 * x.z).cos(),
        0.14 * (1.7 * x.x).cos() * (2.3 * x.y + 0.7 * x.z).sin(),
        0.13 * (2.2 * x.z - 1.1 * x.x).sin() + 0.10 * x.x * x.y,
    )
}

/// Its gradient, row i for component i.
fn gradient(x: &Vec3) -> Mat3 {
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

/// P = R T(U − I).
fn piola(law: &Law, x: &Vec3) -> Mat3 {
    let p = polar(&(Mat3::identity() + gradient(x)));
    p.rotation * to_tensor(&law.stress(&from_tensor(&(p.stretch - Mat3::identity()))))
}

fn body_force(law: &Law, x: &Vec3) -> Vec3 {
    let mut divergence = Vec3::zeros();
    for c in 0..3 {
        let at = |steps: f64| {
            let mut moved = *x;
            moved[c] += steps * STEP;
            piola(law, &moved).column(c).into_owned()
        };
        divergence += (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * STEP);
    }
    -divergence
}

/// Relative errors of the displacement and of its gradient on `n` cells along each edge.
fn errors(kind: Kind, law: &Law, n: usize) -> Result<[f64; 2], CheckError> {
    let size = Vec3::from_element(1.0);
    let mut mesh = kind.cuboid(size, [n; 3]);
    distort(&mut mesh, size, 1.0 / n as f64, 0.1);
    let body = Specimen::new(mesh, law.clone(), |x| [on_border(x, &size); 3])?;
    let mut forces = vec![Vec3::zeros(); body.nodes().len()];
    integrate(&body.model.mesh, Rule::Loads, |s| {
        let b = body_force(law, &s.place) * s.weight;
        for (&i, shape) in s.nodes.iter().zip(s.shape) {
            forces[i as usize] += b * *shape;
        }
    });
    let load = Load {
        forces,
        prescribed: Some(body.nodes().iter().map(displacement).collect()),
    };
    let u = body.settled(&load, 1, &Options::default())?;
    let (mut off, mut whole) = ([0.0; 2], [0.0; 2]);
    integrate(&body.model.mesh, Rule::Errors, |s| {
        let (mut value, mut slope) = (Vec3::zeros(), Mat3::zeros());
        for ((&i, shape), g) in s.nodes.iter().zip(s.shape).zip(s.gradients) {
            value += u[i as usize] * *shape;
            slope += u[i as usize] * g.transpose();
        }
        let (exact, exact_slope) = (displacement(&s.place), gradient(&s.place));
        off[0] += s.weight * (value - exact).norm_squared();
        off[1] += s.weight * (slope - exact_slope).norm_squared();
        whole[0] += s.weight * exact.norm_squared();
        whole[1] += s.weight * exact_slope.norm_squared();
    });
    Ok([0, 1].map(|k| (off[k] / whole[k]).sqrt()))
}

fn orders() -> Result<Findings, CheckError> {
    let laws = [
        ("ν = 0.3", Law::linear_isotropic(0.3, 0.3)?),
        ("ν = 0.49", Law::linear_isotropic(0.3, 0.49)?),
    ];
    let mut rows = Vec::new();
    for kind in Kind::ALL {
        for (name, law) in &laws {
            let mut found = Vec::new();
            for n in GRIDS {
                let e = errors(kind, law, n);
                eprintln!("{kind:?} {name} {n} {e:?}");
                found.push(e.unwrap_or([f64::NAN; 2]));
            }
            for (k, norm, least) in [(0, "u", 1.85), (1, "∇u", 0.95)] {
                let slopes: Vec<f64> = found.windows(2).map(|e| (e[0][k] / e[1][k]).log2()).collect();
                let quantity = format!(
                    "{}, {name}: order of {norm}, {} to {} cells an edge",
                    kind.name(),
                    GRIDS[1],
                    GRIDS[2]
                );
                rows.push(Row::at_least(quantity, "", least, slopes[1]).digits(3));
            }
        }
    }
    Ok(Findings::new(
        rows,
        "The orders approach 2 and 1 from the grids of 4, 8 and 16 cells; what is asked of the last two leaves room for the \
         distortion, which changes from grid to grid.",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradient_is_that_of_the_displacement_and_the_strain_is_finite() {
        let (mut largest, mut least) = (0.0f64, f64::INFINITY);
        for k in 0..200 {
            let t = f64::from(k);
            let x = Vec3::new((0.37 * t).fract(), (0.61 * t).fract(), (0.83 * t).fract());
            for c in 0..3 {
                let mut step = Vec3::zeros();
                step[c] = 1e-6;
                let by_difference = (displacement(&(x + step)) - displacement(&(x - step))) / 2e-6;
                assert!((by_difference - gradient(&x).column(c)).norm() < 1e-9);
            }
            let f = Mat3::identity() + gradient(&x);
            least = least.min(f.determinant());
            let strain = polar(&f).stretch - Mat3::identity();
            largest = largest.max(strain.symmetric_eigenvalues().amax());
        }
        assert!(least > 0.3 && largest > 0.3 && largest < 0.5, "{least} {largest}");
    }
}
