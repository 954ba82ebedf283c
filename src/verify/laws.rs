//! Every law in the homogeneous tests of a coupon, through whole solves.
//!
//! ```text
//! uniaxial     stretch λ along z, free sides s:      t_x(s, s, λ) = 0  →  s;    P = t_z(s, s, λ)
//! equibiaxial  stretch λ along x and y, free s:      t_z(λ, λ, s) = 0  →  s;    P = t_x(λ, λ, s)
//! shear        F = I + γ e₁ ⊗ e₂:  λ₁ = (γ + √(4 + γ²))/2, λ₂ = 1/λ₁, λ₃ = 1;   P₁₂ = Σ t_i dλ_i/dγ
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | λ_i | principal stretches | – |
//! | t_i | principal Biot stress, ∂W/∂λ_i where there is an energy W | MPa |
//! | P | nominal stress, force over undeformed area | MPa |
//!
//! The t_i are written out here by hand, apart from the code of the laws; the sides' stretch is found by bisection. For an
//! isotropic law T and U share their axes, so P : dF = Σ t_i dλ_i. Sources: Ogden 1972; Storåkers 1986; the Abaqus Theory
//! Guide, 4.6, for the conventions.

use super::record::{Findings, Row};
use super::specimen::{Kind, Specimen, distort, on_border, prescribed};
use super::{Check, CheckError, Cost};
use crate::fem::equilibrium::Options;
use crate::material::hyperelastic::{FoamTerm, Form, Hyperelastic, OgdenTerm, VolumeEnergy};
use crate::material::law::{Law, SMOOTHING_STRAIN};
use crate::material::paper::{PaperParameters, PaperRbf, StrainNorm};
use crate::material::transverse::{TransverseModuli, TransverseRbf};
use crate::math::Vec3;
use crate::math::mandel::Mandel;
use crate::math::rbf::ConstantTerm;

/// Closed forms of every law.
pub const LAWS: Check = Check {
    id: "laws",
    title: "Uniaxial, equibiaxial and shear tests of every law",
    against: "Closed forms from principal stretches, written out by hand in the check: reactions of a distorted mesh over its \
              undeformed area.",
    cost: Cost::Light,
    run: laws,
};

/// Principal Biot stresses at principal stretches.
type Stresses = Box<dyn Fn([f64; 3]) -> [f64; 3]>;

fn volume(l: [f64; 3]) -> f64 {
    l[0] * l[1] * l[2]
}

fn linear(mu: f64, lambda: f64) -> Stresses {
    Box::new(move |l| l.map(|s| 2.0 * mu * (s - 1.0) + lambda * (l[0] + l[1] + l[2] - 3.0)))
}

fn neo_hookean_logarithmic(mu: f64, lambda: f64) -> Stresses {
    Box::new(move |l| l.map(|s| mu * (s - 1.0 / s) + lambda * volume(l).ln() / s))
}

/// Ogden's terms (μ, α) and K/2 (J − 1)².
fn ogden(terms: Vec<(f64, f64)>, bulk: f64) -> Stresses {
    Box::new(move |l| {
        let j = volume(l);
        l.map(|s| {
            let distortion: f64 = terms
                .iter()
                .map(|(mu, a)| {
                    let of = |s: f64| (s / j.cbrt()).powf(*a);
                    2.0 * mu / a * (of(s) - (of(l[0]) + of(l[1]) + of(l[2])) / 3.0)
                })
                .sum();
            (distortion + bulk * (j - 1.0) * j) / s
        })
    })
}

/// C10 (Ī1 − 3) + C01 (Ī2 − 3) + K/2 (J − 1)².
fn mooney_rivlin(c10: f64, c01: f64, bulk: f64) -> Stresses {
    Box::new(move |l| {
        let j = volume(l);
        let first: f64 = l.iter().map(|s| s * s).sum();
        let second: f64 = l.iter().map(|s| 1.0 / (s * s)).sum();
        l.map(|s| {
            let of_first = 2.0 * c10 * j.powf(-2.0 / 3.0) * (s - first / (3.0 * s));
            let of_second = 2.0 * c01 * j.powf(2.0 / 3.0) * (second / (3.0 * s) - 1.0 / (s * s * s));
            of_first + of_second + bulk * (j - 1.0) * j / s
        })
    })
}

/// Terms (μ, α, β).
fn foam(terms: Vec<(f64, f64, f64)>) -> Stresses {
    Box::new(move |l| {
        l.map(|s| {
            let of = |(mu, a, b): &(f64, f64, f64)| 2.0 * mu / a / s * (s.powf(*a) - volume(l).powf(-a * b));
            terms.iter().map(of).sum()
        })
    })
}

/// A law, its name, and its stresses by hand.
type Case = (&'static str, Law, Stresses);

/// Shear modulus, Lamé's λ and bulk modulus of the laws that have no more to choose \[MPa\].
const MODULI: (f64, f64, f64) = (0.1, 0.4, 0.5);

/// Rubbers and foams with an energy of the stretches.
fn hyperelastic() -> Result<Vec<Case>, CheckError> {
    let form = |form| Hyperelastic::new(form).map(Law::Hyperelastic);
    let (mu, lambda, bulk) = MODULI;
    let powers = |bulk: f64| VolumeEnergy::Powers(vec![0.5 * bulk]);
    let terms = |terms: &[(f64, f64)]| -> Vec<OgdenTerm> {
        let term = |(shear_mpa, exponent): &(f64, f64)| OgdenTerm {
            shear_mpa: *shear_mpa,
            exponent: *exponent,
        };
        terms.iter().map(term).collect()
    };
    let two = [(0.08, 1.7), (0.02, -3.0)];
    let foam_terms = [(0.06, 4.0, 0.2), (0.03, -2.0, 0.1)];
    Ok(vec![
        (
            "neo-Hooke, logarithmic",
            form(Form::NeoHookeanLogarithmic {
                shear_mpa: mu,
                lame_lambda_mpa: lambda,
            })?,
            neo_hookean_logarithmic(mu, lambda),
        ),
        (
            "neo-Hooke, isochoric",
            form(Form::NeoHookeanIsochoric {
                shear_mpa: mu,
                bulk_mpa: bulk,
            })?,
            ogden(vec![(mu, 2.0)], bulk),
        ),
        (
            "Mooney–Rivlin",
            form(Form::MooneyRivlin {
                c10_mpa: 0.04,
                c01_mpa: 0.01,
                bulk_mpa: bulk,
            })?,
            mooney_rivlin(0.04, 0.01, bulk),
        ),
        (
            "Ogden, two terms",
            form(Form::Ogden {
                terms: terms(&two),
                volume: powers(bulk),
            })?,
            ogden(two.to_vec(), bulk),
        ),
        (
            "hyperfoam, two terms",
            form(Form::Hyperfoam {
                terms: foam_terms
                    .iter()
                    .map(|(shear_mpa, exponent, poisson)| FoamTerm {
                        shear_mpa: *shear_mpa,
                        exponent: *exponent,
                        poisson: *poisson,
                    })
                    .collect(),
            })?,
            foam(
                foam_terms
                    .iter()
                    .map(|(m, a, n)| (*m, *a, n / (1.0 - 2.0 * n)))
                    .collect(),
            ),
        ),
    ])
}

/// Laws over Biot strain.
fn over_biot_strain() -> Result<Vec<Case>, CheckError> {
    let (mu, lambda, _) = MODULI;
    Ok(vec![
        (
            "linear in Biot strain",
            // E and ν of μ and λ.
            Law::linear_isotropic(
                mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu),
                lambda / (2.0 * (lambda + mu)),
            )?,
            linear(mu, lambda),
        ),
        (
            "rubber, secant",
            super::path::rubber()?,
            of_rubber(super::path::rubber()?),
        ),
        (
            "rubber, energy",
            super::path::with_energy()?,
            of_energy(super::path::with_energy()?),
        ),
        (
            "transversely isotropic, axis z",
            Law::TransverselyIsotropic(Box::new(TransverseRbf::linear(&TransverseModuli {
                e11: 0.5,
                e12: 0.2,
                e13: 0.15,
                e33: 0.9,
                e44: 0.12,
            })?)),
            Box::new(|l| {
                let [x, y, z] = l.map(|s| s - 1.0);
                [
                    0.5 * x + 0.2 * y + 0.15 * z,
                    0.2 * x + 0.5 * y + 0.15 * z,
                    0.15 * (x + y) + 0.9 * z,
                ]
            }),
        ),
        (
            "papers' form, alike centres",
            papers_form(lambda, mu)?,
            linear(mu, lambda),
        ),
    ])
}

/// The papers' interpolation between two centres of the same moduli: with its constant term it gives them everywhere.
fn papers_form(lambda: f64, mu: f64) -> Result<Law, CheckError> {
    let centres = [Mandel::zeros(), Mandel::new(0.1, 0.1, -0.3, 0.0, 0.0, 0.0)];
    let law = PaperRbf::interpolating(
        &centres,
        &[vec![lambda, mu], vec![lambda, mu]],
        PaperParameters::Lame,
        StrainNorm::Tensor,
        ConstantTerm::With,
    )?;
    Ok(Law::Paper(Box::new(law)))
}

/// t_i = ∂W/∂λ_i with W = μ |dev ε|² + K/2 tr² ε and the moduli of the law's own interpolant, by differences of the fourth
/// order: exact to about 1e-11 MPa.
fn of_energy(law: Law) -> Stresses {
    const H: f64 = 1e-3;
    let energy = move |l: [f64; 3]| {
        let (trace, dev, q) = invariants(l);
        let [shear, bulk] = match &law {
            Law::Energy(law) => law.moduli(&q),
            _ => [f64::NAN; 2],
        };
        shear * dev.iter().map(|d| d * d).sum::<f64>() + 0.5 * bulk * trace * trace
    };
    Box::new(move |l| {
        std::array::from_fn(|i| {
            let at = |steps: f64| {
                let mut moved = l;
                moved[i] += steps * H;
                energy(moved)
            };
            (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * H)
        })
    })
}

/// tr ε, the principal values of dev ε, and the three invariants that moduli are interpolated over.
fn invariants(l: [f64; 3]) -> (f64, [f64; 3], [f64; 3]) {
    let e = l.map(|s| s - 1.0);
    let trace = e[0] + e[1] + e[2];
    let dev = e.map(|e| e - trace / 3.0);
    let norm_squared: f64 = dev.iter().map(|d| d * d).sum();
    let delta_squared = SMOOTHING_STRAIN * SMOOTHING_STRAIN;
    let norm = (norm_squared + delta_squared).sqrt() - SMOOTHING_STRAIN;
    // |dev ε| cos 3θ = 3 √6 det(dev ε) / |dev ε|², smoothed alike.
    let lode = 3.0 * 6f64.sqrt() * dev[0] * dev[1] * dev[2] / (norm_squared + delta_squared);
    (trace, dev, [trace / 3f64.sqrt(), norm, lode])
}

/// For a law that is interpolated: 2 μ dev ε + K tr ε with the moduli of its own interpolant, which has tests of its own.
fn of_rubber(law: Law) -> Stresses {
    Box::new(move |l| {
        let (trace, dev, q) = invariants(l);
        let [shear, bulk] = match &law {
            Law::Isotropic(law) => law.moduli(&q),
            _ => [f64::NAN; 2],
        };
        dev.map(|d| 2.0 * shear * d + bulk * trace)
    })
}

/// The root of a rising function between a tenth and three.
fn root(rising: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.1, 3.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if rising(middle) > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high)
}

const SIZE: Vec3 = Vec3::new(2.0, 3.0, 4.0);

/// Sum of the reactions on the side where component `c` is largest, over that side's undeformed area \[MPa\].
fn nominal(body: &Specimen, u: &[Vec3], c: usize) -> Vec3 {
    let forces = body.internal_forces(u);
    let side = body
        .nodes()
        .iter()
        .zip(&forces)
        .filter(|(x, _)| x[c] > SIZE[c] - 1e-9);
    let sum: Vec3 = side.map(|(_, f)| f).sum();
    sum / (SIZE.x * SIZE.y * SIZE.z / SIZE[c])
}

/// Stretches the components `along` by `stretch` between smooth plates and leaves the others free.
fn stretched(kind: Kind, law: &Law, along: &[usize], stretch: f64) -> Result<Settled, CheckError> {
    let mut mesh = kind.cuboid(SIZE, [2, 3, 3]);
    distort(&mut mesh, SIZE, 1.0, 0.15);
    let held = |x: &Vec3| [0, 1, 2].map(|c| x[c] < 1e-9 || (along.contains(&c) && x[c] > SIZE[c] - 1e-9));
    let body = Specimen::new(kind, mesh, law.clone(), held)?;
    let target = body.nodes().iter().map(|x| x * (stretch - 1.0)).collect();
    let u = body.settled(&prescribed(target), 2, &options())?;
    Ok(Settled { body, u })
}

/// A body and its displacements.
struct Settled {
    body: Specimen,
    u: Vec<Vec3>,
}

fn options() -> Options {
    Options {
        tolerance: 1e-11,
        ..Options::default()
    }
}

fn sheared(kind: Kind, law: &Law, gamma: f64) -> Result<f64, CheckError> {
    let mut mesh = kind.cuboid(SIZE, [2, 3, 3]);
    distort(&mut mesh, SIZE, 1.0, 0.15);
    let body = Specimen::new(kind, mesh, law.clone(), |x| [on_border(x, &SIZE); 3])?;
    let target = body
        .nodes()
        .iter()
        .map(|x| Vec3::new(gamma * x.y, 0.0, 0.0))
        .collect();
    let u = body.settled(&prescribed(target), 2, &options())?;
    // Edges carry the forces of two faces: the work of the whole border is ∫ P : dF, and dF/dγ is e₁ ⊗ e₂.
    let forces = body.internal_forces(&u);
    let work: f64 = body.nodes().iter().zip(&forces).map(|(x, f)| f.x * x.y).sum();
    Ok(work / (SIZE.x * SIZE.y * SIZE.z))
}

fn laws() -> Result<Findings, CheckError> {
    let mut rows = Vec::new();
    for (name, law, stress) in over_biot_strain()?.into_iter().chain(hyperelastic()?) {
        for (test, stretch) in [("uniaxial", 0.7), ("uniaxial", 1.4), ("equibiaxial", 1.25)] {
            let (along, expected): (&[usize], f64) = match test {
                "uniaxial" => {
                    let side = root(|s| stress([s, s, stretch])[0]);
                    (&[2], stress([side, side, stretch])[2])
                }
                _ => {
                    let side = root(|s| stress([stretch, stretch, s])[2]);
                    (&[0, 1], stress([stretch, stretch, side])[0])
                }
            };
            let mut worst = 0.0f64;
            let mut found = 0.0;
            for kind in [Kind::Hexahedra, Kind::Patches] {
                let at = stretched(kind, &law, along, stretch)?;
                let c = along[0];
                let p = nominal(&at.body, &at.u, c)[c];
                if (p - expected).abs() >= worst {
                    (worst, found) = ((p - expected).abs(), p);
                }
            }
            let quantity = format!("{name}: P, {test}, λ = {stretch}");
            rows.push(Row::within(quantity, "MPa", expected, found, 1e-7));
        }
        let gamma = 0.5f64;
        let root_of = (4.0 + gamma * gamma).sqrt();
        let first = 0.5 * (gamma + root_of);
        let t = stress([first, 1.0 / first, 1.0]);
        let expected = (t[0] * first - t[1] / first) / root_of;
        let found = sheared(Kind::Hexahedra, &law, gamma)?;
        let quantity = format!("{name}: P₁₂, simple shear, γ = {gamma}");
        rows.push(Row::within(quantity, "MPa", expected, found, 1e-7));
    }
    Ok(Findings::new(
        rows,
        "Homogeneous states on distorted hexahedra and patched tetrahedra, the worse of the two; the solve stops at 1e-11.",
    ))
}
