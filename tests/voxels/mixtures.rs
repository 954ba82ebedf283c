//! Mixtures: what they are where they are none, and their derivatives.

use crate::support::{goal, goal_text, rig};
use pliant::fem::equilibrium::Options;
use pliant::fem::mixture::{Mixtures, Reading};
use pliant::fem::rig::Rig;

/// Over tr ε, over J, and one with another stiffness: what mixes must not depend on how a law is written.
const MATERIALS: [&str; 3] = ["ecoflex-00-30", "treloar-rubber", "dragon-skin-20"];

fn exact() -> Options {
    Options {
        tolerance: 1e-10,
        ..Options::default()
    }
}

/// Shares without any pattern, the same in each run.
fn scattered(count: usize) -> Vec<f64> {
    let share = |k: usize| 0.1 + ((k * 7919 + 13) % 101) as f64 / 101.0;
    (0..count).map(share).collect()
}

#[test]
fn cells_of_one_material_each_answer_as_on_the_rig() {
    let goal = goal(&goal_text("voxels = [3, 2, 2]", &MATERIALS, "", 2, &[0.5, 1.0])).unwrap();
    let rig = rig(&goal);
    let layout: Vec<u8> = (0..12).map(|c| (c * 5 % 3) as u8).collect();
    let mut shares = vec![0.0; 36];
    layout
        .iter()
        .enumerate()
        .for_each(|(c, &m)| shares[3 * c + m as usize] = 1.0);
    let pure = rig.bench().unwrap().respond(&layout, &exact(), &|| false);
    let mixed = Mixtures::new(&rig, 12)
        .press(&shares, &exact(), &|| false)
        .unwrap();
    let stop = rig.bench().unwrap().press(&layout, 0, &exact()).stop;
    assert!(pure.complete, "{stop}");
    assert!(
        pure.displacements.iter().any(|x| x.abs() > 0.01),
        "{:?}",
        pure.displacements
    );
    for (a, b) in pure.displacements.iter().zip(&mixed.response.displacements) {
        assert!((a - b).abs() < 1e-8, "{a} and {b}");
    }
}

/// A mixture of a material with itself is that material.
#[test]
fn shares_of_one_material_make_a_whole() {
    let goal = goal(&goal_text("columns = [3, 2]", &MATERIALS, "", 1, &[1.0])).unwrap();
    let law = goal.palette[1].law.clone();
    let rig = Rig::new(&goal.setup, vec![law.clone(), law]).unwrap();
    let mixtures = Mixtures::new(&rig, 6);
    let press = |first: f64| {
        let shares: Vec<f64> = (0..12)
            .map(|k| if k % 2 == 0 { first } else { 1.0 - first })
            .collect();
        mixtures.press(&shares, &exact(), &|| false).unwrap().response
    };
    let (whole, parts) = (press(1.0), press(0.3));
    assert!(whole.complete);
    assert!(
        whole.displacements.iter().any(|x| x.abs() > 0.01),
        "{:?}",
        whole.displacements
    );
    for (a, b) in whole.displacements.iter().zip(&parts.displacements) {
        assert!((a - b).abs() < 1e-8, "{a} and {b}");
    }
}

/// Against central differences: half a sum of squares over all readings, by all shares.
#[test]
fn derivatives_by_the_shares() {
    let goal = goal(&goal_text("voxels = [3, 2, 2]", &MATERIALS, "", 2, &[0.5, 1.0])).unwrap();
    let rig = rig(&goal);
    let mixtures = Mixtures::new(&rig, 12);
    let shares = scattered(36);
    let respond = |shares: &[f64]| mixtures.press(shares, &exact(), &|| false).unwrap();
    let pressed = respond(&shares);
    assert!(pressed.response.complete);
    let readings: Vec<Reading> = (0..4)
        .map(|k| Reading {
            press: k / 2,
            level: k % 2,
            weights: vec![1.0; rig.presses[k / 2].components()],
        })
        .collect();
    // Cells 0 and 11 are one variable.
    let variable_of_cell: Vec<u32> = (0..12).map(|c| if c == 11 { 0 } else { c }).collect();
    let derivatives = mixtures
        .derivatives(&pressed, &readings, &variable_of_cell, 1e-12)
        .unwrap();
    assert_eq!(derivatives.shape(), (4, 33));
    let x = &pressed.response.displacements;
    let target: Vec<f64> = x
        .iter()
        .enumerate()
        .map(|(k, x)| 0.8 * x + 0.01 * k as f64)
        .collect();
    let half_square = |x: &[f64]| 0.5 * x.iter().zip(&target).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let gradient = |column: usize| -> f64 {
        (0..4)
            .map(|k| (x[k] - target[k]) * derivatives[(k, column)])
            .sum()
    };
    let scale = (0..33).map(|c| gradient(c).abs()).fold(0.0, f64::max);
    assert!(scale > 1e-3, "{scale}");
    for column in 0..33 {
        let moved = |step: f64| {
            let mut moved = shares.clone();
            for cell in (0..12).filter(|&c| variable_of_cell[c] as usize == column / 3) {
                moved[3 * cell + column % 3] += step;
            }
            half_square(&respond(&moved).response.displacements)
        };
        // Fourth order, so that the step may be large enough for the solver's tolerance.
        let step = 2e-3;
        let expected =
            (8.0 * (moved(step) - moved(-step)) - (moved(2.0 * step) - moved(-2.0 * step))) / (12.0 * step);
        assert!(
            (gradient(column) - expected).abs() < 1e-6 * scale,
            "{column}: {} and {expected}",
            gradient(column)
        );
    }
}
