//! Forces under the probe that the sensor did not measure (thesis 8.3).

use crate::laws::foam;
use crate::probe::{fitted, plain};
use crate::twin::{Block, measure, pressed, stress_error};
use pliant::fem::specimen::Specimen;
use pliant::fitting::probe::fit::{ProbeOptions, Tangential};
use pliant::fitting::probe::start::Symmetry;
use pliant::material::record::Kind;
use pliant::math::Vec3;

/// The truth is pressed with tangential forces of up to a fifth of the force, which are then forgotten; the fit finds them by the
/// markers under the probe, and the law is better for it.
#[test]
fn slow_missing_tangential_forces_are_found_and_put_back() {
    let truth = foam();
    let block = Block::standard([6, 5, 3], 4, 3, 10.0);
    let set = block.set(Kind::Isotropic, Vec3::z());
    let specimen = Specimen::new(&set).unwrap();
    let mut pressed = pressed(&set, &specimen);
    let mut held = Vec::new();
    for (k, press) in pressed.presses.iter_mut().enumerate() {
        let [a, b] = press.across();
        let turn = 1.3 * k as f64;
        let direction = a * turn.cos() + b * turn.sin();
        for (level, (tangential, force)) in press.tangential.iter_mut().zip(&press.forces).enumerate() {
            *tangential = direction * (force.norm() * (0.1 + 0.05 * level as f64));
        }
        held.push(press.tangential.clone());
    }
    let data = measure(&mut pressed, &truth, 0.001, 7);
    for press in &mut pressed.presses {
        press.tangential.fill(Vec3::zeros());
    }
    let symmetry = Symmetry::of(&set.material);
    let without = fitted(&mut pressed.clone(), symmetry, &plain());
    let options = ProbeOptions::default();
    let with = fitted(&mut pressed, symmetry, &options);
    let [before, after] = [&without, &with].map(|f| stress_error(&f.law, &truth, &data.met));
    println!(
        "stress {:.2} % without, {:.2} % with; displacements {:.3} % and {:.3} %",
        100.0 * before,
        100.0 * after,
        100.0 * without.errors.relative(),
        100.0 * with.errors.relative()
    );
    let Tangential::Used { forces, elsewhere } = &with.tangential else {
        panic!("{:?}", with.tangential);
    };
    assert!(elsewhere[1] < 0.3 * elsewhere[0], "{elsewhere:?}");
    for ((_, found), held) in forces.iter().zip(&held) {
        for (f, h) in found.iter().zip(held) {
            assert!((f - h).norm() < 0.1 * h.norm(), "{f:?} {h:?}");
        }
    }
    assert!(after < 0.5 * before && after < 0.02, "{before} {after}");
}

/// Where there are none, none are used: the markers elsewhere are no better for what noise makes up.
#[test]
fn noise_makes_no_tangential_forces() {
    let block = Block::standard([4, 3, 2], 3, 2, 8.0);
    let set = block.set(Kind::Isotropic, Vec3::z());
    let specimen = Specimen::new(&set).unwrap();
    let mut pressed = pressed(&set, &specimen);
    measure(&mut pressed, &foam(), 0.01, 5);
    let fit = fitted(
        &mut pressed,
        Symmetry::of(&set.material),
        &ProbeOptions::default(),
    );
    assert_eq!(fit.tangential, Tangential::Dropped);
    assert!(
        pressed
            .presses
            .iter()
            .flat_map(|p| &p.tangential)
            .all(|t| *t == Vec3::zeros())
    );
}
