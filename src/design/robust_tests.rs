//! Forecasts against closed forms and against full simulations of sampled materials.

use super::*;
use crate::design::goal::Goal;
use crate::geometry::files::write_stl;
use crate::geometry::shapes::block::block;
use crate::material::database::Database;
use crate::math::Vec3;
use std::path::Path;

/// A block of two layers, pressed on top by `force` N, seen at three points.
fn goal(force: f64) -> Goal {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    write_stl(&block(Vec3::new(30.0, 30.0, 20.0), 10.0).unwrap(), &mut bytes).unwrap();
    std::fs::write(folder.path().join("block.stl"), bytes).unwrap();
    let mut rows = String::from("force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n");
    for level in [0.5, 1.0] {
        for (x, y) in [(15, 15), (5, 15), (20, 25)] {
            rows += &format!("{},{x},{y},20,0,0,0\n", level * force);
        }
    }
    std::fs::write(folder.path().join("points.csv"), rows).unwrap();
    let text = r#"
schema = 1
name = "Block"
[object]
mesh = "block.stl"
unit = "mm"
element_size = "10 mm"
[[fixed]]
face = "bottom"
[[region]]
name = "block"
layers = 2
[palette]
materials = ["mold-star-16", "dragon-skin-20"]
[[example]]
name = "top"
point_mm = [15, 15, 20]
direction = [0, 0, -1]
radius = "8 mm"
file = "points.csv"
"#;
    std::fs::write(folder.path().join("goal.toml"), text).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    Goal::read(
        folder.path(),
        &Database::open(&root.join("materials-db")).unwrap(),
    )
    .unwrap()
}

/// All of a law's moduli rise and fall together, by `share`.
fn scaled(law: &Law, share: f64) -> Doubt {
    Doubt {
        spread: DMatrix::from_element(law.parameters().len(), 1, share),
    }
}

fn changed(law: &Law, by: &DVector<f64>) -> Law {
    let values: Vec<f64> = law
        .parameters()
        .iter()
        .zip(by.iter())
        .map(|(p, d)| p.value + d)
        .collect();
    law.with_parameters(&values).unwrap()
}

/// Displacements as targets.
fn target_of(goal: &Goal, rig: &Rig, layout: &[u8]) -> Target {
    let response = rig
        .bench()
        .unwrap()
        .respond(layout, &equilibrium::Options::default(), &|| false);
    let mut target = Target::new(&goal.setup.examples);
    target.components = response.displacements.into_iter().map(Some).collect();
    target
}

/// Under a light press u ∝ 1/E: with all moduli uncertain by s, σ_i = s |x_i|; and where the target is the response itself, RMS
/// = s |z| RMS(x), whose 90 % quantile is that of |z|, 1.645. Strains of 1 ‰ are off by about as much, 2 000 samples by some 2 %.
#[test]
fn one_modulus_has_the_band_of_the_closed_form() {
    let goal = goal(0.05);
    let laws: Vec<Law> = goal.palette.iter().map(|m| m.law.clone()).collect();
    let rig = Rig::new(&goal.setup, laws.clone()).unwrap();
    let target = target_of(&goal, &rig, &[0, 0]);
    let share = 0.08;
    let go = AtomicBool::new(false);
    let doubts = vec![Some(scaled(&laws[0], share)), None];
    let judge = Judge::new(&rig, &target, doubts, Options::default(), &go).unwrap();
    let (response, modes) = judge.modes(&mut rig.bench().unwrap(), &[0, 0]).unwrap();
    let largest = response.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (i, x) in response.iter().enumerate() {
        let found = deviation(&modes, &[(i, 1.0)]);
        assert!(
            (found - share * x.abs()).abs() < 0.01 * share * largest,
            "{i}: {found} {x}"
        );
    }
    let forecast = judge.forecast(&mut rig.bench().unwrap(), &[0, 0]).unwrap();
    assert!(forecast.misfit.rms_mm < 1e-9);
    let zero = vec![0.0; response.len()];
    let size = target.misfit(&zero).rms_mm;
    let expected = BAND * share * size;
    assert!(
        (forecast.pessimistic_rms_mm / expected - 1.0).abs() < 0.06,
        "{} {expected}",
        forecast.pessimistic_rms_mm
    );
    // A material that the layout does not use changes nothing; one without doubt has no band.
    let certain = judge.forecast(&mut rig.bench().unwrap(), &[1, 1]).unwrap();
    assert_eq!(certain.pessimistic_rms_mm, certain.misfit.rms_mm);
    assert_eq!(judge.known_exactly(), [1]);
}

/// The records' own covariances, drawn three times: what the simulation of the changed materials answers is what the modes say, to
/// 5 % of the largest change (moduli are off by some percent, and the response bends by as much of that).
#[test]
fn sampled_materials_respond_as_the_modes_say() {
    let goal = goal(6.0);
    let laws: Vec<Law> = goal.palette.iter().map(|m| m.law.clone()).collect();
    let rig = Rig::new(&goal.setup, laws.clone()).unwrap();
    let layout = [0u8, 1];
    let target = target_of(&goal, &rig, &layout);
    let go = AtomicBool::new(false);
    let doubts = doubts(&goal.palette).unwrap();
    assert!(
        doubts.iter().all(Option::is_some),
        "both records have a covariance"
    );
    let judge = Judge::new(&rig, &target, doubts.clone(), Options::default(), &go).unwrap();
    let (response, modes) = judge.modes(&mut rig.bench().unwrap(), &layout).unwrap();
    for sample in 0..3 {
        let mut expected = DVector::from_column_slice(&response);
        let mut sampled = Vec::new();
        for m in 0..2 {
            let z = judge.draws[m].column(sample);
            expected += &modes[m] * z;
            sampled.push(changed(&laws[m], &(&doubts[m].as_ref().unwrap().spread * z)));
        }
        let other = Rig::new(&goal.setup, sampled).unwrap();
        let exact = equilibrium::Options::default();
        let full = other.bench().unwrap().respond(&layout, &exact, &|| false);
        assert!(full.complete);
        let change = |x: &[f64]| DVector::from_iterator(x.len(), x.iter().zip(&response).map(|(a, b)| a - b));
        let (full, linear) = (change(&full.displacements), change(expected.as_slice()));
        println!(
            "sample {sample}: {:.2e} mm, off by {:.2e} mm",
            full.amax(),
            (&full - &linear).amax()
        );
        assert!(full.amax() > 1e-4 && (&full - &linear).amax() < 0.05 * full.amax());
    }
}

/// Material 0 made the target and is uncertain by a fifth; material 1 is known, and 4 % stiffer. Nominally 0 is better, and 1 where
/// one has to be sure. Exchanges find it from the other.
#[test]
fn the_certain_layout_is_chosen_over_the_nominally_better_one() {
    let goal = goal(3.0);
    let soft = goal.palette[0].law.clone();
    let stiff = changed(&soft, &DVector::from_element(soft.parameters().len(), 0.04));
    let rig = Rig::new(&goal.setup, vec![soft.clone(), stiff.clone()]).unwrap();
    let target = target_of(&goal, &rig, &[0, 0]);
    let go = AtomicBool::new(false);
    let doubts = vec![Some(scaled(&soft, 0.2)), Some(scaled(&stiff, 0.01))];
    let judge = Judge::new(&rig, &target, doubts.clone(), Options::default(), &go).unwrap();
    let [sure, better] = [&judge.ranked(&[vec![0, 0], vec![1, 1]])[..], &[]]
        .concat()
        .try_into()
        .unwrap();
    assert_eq!(
        (&sure.layout[..], &better.layout[..]),
        (&[1u8, 1][..], &[0u8, 0][..])
    );
    assert!(better.misfit.rms_mm < 1e-9 && sure.misfit.rms_mm > 1e-3);
    assert!(sure.pessimistic_rms_mm < 0.5 * better.pessimistic_rms_mm);
    let space = Space::free(2, 2);
    let improved = judge.improved(&space, &[vec![0, 0]]);
    assert_eq!(
        (improved[0].layout.as_slice(), improved.len()),
        (&[1u8, 1][..], 4)
    );
    assert_eq!(improved[0], sure);
    // The same seed gives the same numbers; a limit on the space holds.
    let again = Judge::new(&rig, &target, doubts, Options::default(), &go).unwrap();
    assert_eq!(again.improved(&space, &[vec![0, 0]]), improved);
    let mut bound = Space::free(2, 2);
    bound.allowed[0] = vec![0];
    assert_eq!(again.improved(&bound, &[vec![0, 0]])[0].layout, [0, 1]);
    let wrong = Options {
        quantile: 1.0,
        ..Options::default()
    };
    assert!(matches!(
        Judge::new(&rig, &target, vec![None, None], wrong, &go),
        Err(RobustError::Quantile(_))
    ));
}
