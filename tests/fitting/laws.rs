//! Laws that twins are made of.

use pliant::material::hyperelastic::{FoamTerm, Form, Hyperelastic};
use pliant::material::isotropic::{IsotropicRbf, invariants, shear_and_bulk};
use pliant::material::law::{Law, Range};
use pliant::material::transverse::{TransverseModuli, TransverseRbf};
use pliant::math::mandel::Mandel;

/// A foam-like law of six centres: soft in the middle of compression, stiff beyond, with a Poisson's ratio that falls.
pub fn foam() -> Law {
    let path = [0.0, -0.1, -0.25, -0.45, 0.15];
    let young = [0.3, 0.2, 0.16, 0.3, 0.25];
    let ratio = [0.3, 0.22, 0.15, 0.1, 0.32];
    let mut centres: Vec<[f64; 3]> = path
        .iter()
        .zip(ratio)
        .map(|(e, r)| invariants(&Mandel::new(-r * e, -r * e, *e, 0.0, 0.0, 0.0)))
        .collect();
    centres.push(invariants(&Mandel::new(0.0, 0.0, 0.0, 0.0, 0.4, 0.0)));
    let mut moduli: Vec<[f64; 2]> = young
        .iter()
        .zip(ratio)
        .map(|(e, r)| shear_and_bulk(*e, r).map(|(s, b)| [s, b]).unwrap())
        .collect();
    let (shear, bulk) = shear_and_bulk(0.22, 0.25).unwrap();
    moduli.push([shear, bulk]);
    Law::Isotropic(IsotropicRbf::interpolating(&centres, &moduli, Range::UNBOUNDED).unwrap())
}

/// Rubber that is easily compressed.
pub fn rubber() -> Law {
    let form = Form::NeoHookeanLogarithmic {
        shear_mpa: 0.1,
        lame_lambda_mpa: 0.2,
    };
    Law::Hyperelastic(Hyperelastic::new(form).unwrap())
}

/// A foam of one term.
pub fn hyperfoam() -> Law {
    let form = Form::Hyperfoam {
        terms: vec![FoamTerm {
            shear_mpa: 0.1,
            exponent: 8.0,
            poisson: 0.15,
        }],
    };
    Law::Hyperelastic(Hyperelastic::new(form).unwrap())
}

/// Fibres along z whose matrix softens in compression and shear.
pub fn fibres() -> Law {
    let at = |young: [f64; 2], ratios: [f64; 2], shear: f64| {
        TransverseModuli::from_engineering(young[0], young[1], ratios[0], ratios[1], shear).unwrap()
    };
    let strains = [
        Mandel::zeros(),
        Mandel::new(0.03, 0.03, -0.15, 0.0, 0.0, 0.0),
        Mandel::new(0.06, 0.06, -0.4, 0.0, 0.0, 0.0),
        Mandel::new(-0.03, -0.03, 0.15, 0.0, 0.0, 0.0),
        Mandel::new(-0.2, 0.05, 0.05, 0.0, 0.0, 0.0),
        Mandel::new(0.0, 0.0, -0.1, 0.3, 0.2, 0.0),
    ];
    let moduli = [
        at([0.4, 0.2], [0.3, 0.3], 0.1),
        at([0.3, 0.18], [0.25, 0.3], 0.09),
        at([0.25, 0.2], [0.2, 0.3], 0.08),
        at([0.35, 0.16], [0.3, 0.3], 0.1),
        at([0.4, 0.25], [0.3, 0.35], 0.1),
        at([0.32, 0.2], [0.25, 0.3], 0.13),
    ];
    let zero = TransverseRbf::linear(&moduli[0]).unwrap();
    let centres: Vec<[f64; 4]> = strains.iter().map(|e| zero.invariants(e)).collect();
    Law::TransverselyIsotropic(Box::new(
        TransverseRbf::interpolating(&centres, &moduli, Range::UNBOUNDED).unwrap(),
    ))
}
