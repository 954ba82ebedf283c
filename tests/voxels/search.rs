//! The search for layouts of voxels: against a genetic algorithm, and with its rules.

use crate::twin::{Twin, compare, twin};
use nalgebra::DMatrix;
use pliant::design::journal::{Journal, Key};
use pliant::design::search::Aim;
use pliant::design::space::{Space, distinct};
use pliant::design::voxels::bench::{MixtureBench, OwnMixtures};
use pliant::design::voxels::kept::JournalledMixtures;
use pliant::design::voxels::rules::VoxelRules;
use pliant::design::voxels::{Found, Options, search};
use pliant::fem::mixture::{MixtureError, Mixtures, Reading};
use pliant::fem::rig::Response;
use std::time::Duration;

/// Symmetry, features of two voxels at least and a connected material, and the same answer on one thread.
#[test]
fn rules_hold_for_what_is_found() {
    let more = "[voxels]\nsymmetry = [\"y\"]\nleast_feature = \"12 mm\"\nconnected = [\"dragon-skin-30\"]";
    let twin = twin([8, 6, 4], more);
    let rules = twin.goal.voxels.clone().unwrap();
    // Blocks of two voxels along each axis: 4 × 3 × 2, of which two rows along y are mirror images.
    assert_eq!(rules.variables, 4 * 2 * 2);
    let options = Options {
        most_simulations: 24,
        ..Options::default()
    };
    let run = || twin.search(&twin.space(), 0.0, &rules, &options);
    let found = run();
    let best = &found.outcome.best[0];
    let at = |x: usize, y: usize, z: usize| best.layout[x + 8 * (y + 6 * z)];
    for (x, y, z) in (0..192).map(|c| (c % 8, c / 8 % 6, c / 48)) {
        assert_eq!(at(x, y, z), at(x, 5 - y, z));
        assert_eq!(at(x, y, z), at(x / 2 * 2, y / 2 * 2, z / 2 * 2));
    }
    assert!(best.misfit.rms_mm < found.outcome.best_uniform.as_ref().unwrap().misfit.rms_mm);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one.install(run).outcome, found.outcome);
}

/// The small sister of `cargo bench --bench voxels`: both work for a fixed number of simulations, so that neither the machine nor its load
/// matters. The ratio grows with what the genetic algorithm is given.
#[test]
fn slow_needs_far_fewer_simulations_than_a_genetic_algorithm() {
    let options = Options {
        most_simulations: 18,
        ..Options::default()
    };
    let (found, ratio) = compare([8, 6, 4], &options, 500, Duration::from_secs(3600));
    let best = found.outcome.best[0].misfit.rms_mm;
    let uniform = found.outcome.best_uniform.unwrap().misfit.rms_mm;
    // Seen: 0.009 of 0.2 mm, 30 times.
    assert!(best < 0.06 * uniform, "{best} of {uniform}");
    assert!(ratio > 20.0, "{ratio}");
}

const SHORT: Options = Options {
    seed: 1,
    most_simulations: 24,
    relaxing: 6,
    cycles: 0,
    readings: 600,
    enough_mm: 0.0,
    tolerance: 1e-3,
};

/// A space with the twin's volumes and neighbours, where the materials weigh 1, 2 and 3 and cost as much per cm³.
fn weighed(twin: &Twin) -> Space {
    Space {
        densities_g_per_cm3: vec![1.0, 2.0, 3.0],
        prices_per_cm3: vec![1.0, 2.0, 3.0],
        ..twin.goal.space(&twin.rig).unwrap()
    }
}

#[test]
fn mass_and_forbidden_neighbours_are_kept() {
    let twin = twin([8, 6, 4], "");
    let (space, rules) = (weighed(&twin), VoxelRules::free(192));
    let free = twin.search(&space, 0.0, &rules, &SHORT).outcome.best.remove(0);
    let bounded = Space {
        most_mass_g: 0.9 * space.mass_g(&free.layout),
        apart: vec![[0, 2]],
        ..space
    };
    assert!(!bounded.allows(&free.layout));
    let found = twin.search(&bounded, 0.0, &rules, &SHORT).outcome;
    let best = &found.best[0];
    println!(
        "free {:.4} mm, bounded {:.4} mm",
        free.misfit.rms_mm, best.misfit.rms_mm
    );
    assert!(bounded.allows(&best.layout) && distinct(&best.layout) > 1);
    assert!(best.score_mm < 0.5 * found.best_uniform.unwrap().score_mm);
    assert!(found.bound.score_mm <= best.score_mm);
}

#[test]
fn a_weighted_cost_makes_layouts_cheaper() {
    let twin = twin([8, 6, 4], "");
    let (space, rules) = (weighed(&twin), VoxelRules::free(192));
    let dear = twin.search(&space, 0.0, &rules, &SHORT).outcome.best.remove(0);
    // A tenth of what the best single material is off, for all of the cost.
    let weight = 0.2 / space.cost(&dear.layout);
    let cheap = twin.search(&space, weight, &rules, &SHORT).outcome.best.remove(0);
    let score = |layout: &[u8], rms_mm: f64| rms_mm + weight * space.cost(layout);
    println!(
        "{:.4} mm at {:.1}, {:.4} mm at {:.1}",
        dear.misfit.rms_mm,
        space.cost(&dear.layout),
        cheap.misfit.rms_mm,
        space.cost(&cheap.layout)
    );
    assert!((cheap.score_mm - score(&cheap.layout, cheap.misfit.rms_mm)).abs() < 1e-12);
    assert!(space.cost(&cheap.layout) < 0.95 * space.cost(&dear.layout));
    assert!(cheap.score_mm < score(&dear.layout, dear.misfit.rms_mm));
}

/// Counts what is asked of it.
struct Counting<'a> {
    inner: &'a mut dyn MixtureBench,
    pressed: usize,
    derived: usize,
}

impl MixtureBench for Counting<'_> {
    fn press(&mut self, shares: &[f64], tolerance: f64) -> Result<Option<Response>, MixtureError> {
        self.pressed += 1;
        self.inner.press(shares, tolerance)
    }

    fn derivatives(
        &mut self,
        shares: &[f64],
        tolerance: f64,
        readings: &[Reading],
    ) -> Result<Option<DMatrix<f64>>, MixtureError> {
        self.derived += 1;
        self.inner.derivatives(shares, tolerance, readings)
    }

    fn recall(&mut self, key: &Key) -> Option<Vec<u8>> {
        self.inner.recall(key)
    }
}

/// A search that was ended goes on from its journal to what it would have found in one go.
#[test]
fn a_journal_goes_on_where_it_was() {
    let twin = twin([8, 6, 4], "");
    let (space, rules) = (twin.space(), VoxelRules::free(192));
    let aim = Aim {
        space: &space,
        target: &twin.target,
        cost_weight_mm: 0.0,
    };
    let folder = tempfile::tempdir().unwrap();
    let run = |most_simulations: usize| -> (Found, [usize; 3]) {
        let journal = Journal::open(&folder.path().join("journal.redb")).unwrap();
        let mut own = OwnMixtures::new(Mixtures::new(&twin.rig, 192), &rules, &|| false);
        let mut counting = Counting {
            inner: &mut own,
            pressed: 0,
            derived: 0,
        };
        let mut bench = JournalledMixtures::new(&journal, &twin.rig, &rules, &mut counting);
        let options = Options {
            most_simulations,
            ..SHORT
        };
        let found = search(&twin.rig, &aim, &rules, &options, &mut bench, &|_, _| ()).unwrap();
        assert!(bench.error.is_none());
        let recalled = bench.found;
        (found, [recalled, counting.pressed, counting.derived])
    };
    let (first, [recalled, before, derived]) = run(9);
    assert_eq!((recalled, before), (0, first.outcome.simulations));
    assert!(derived > 1);
    let (whole, [recalled, pressed, more]) = run(18);
    assert_eq!((recalled, pressed), (before, whole.outcome.simulations - before));
    assert_eq!(more, whole.linearisations - derived);
    let alone = twin.search(
        &space,
        0.0,
        &rules,
        &Options {
            most_simulations: 18,
            ..SHORT
        },
    );
    assert_eq!((&whole.outcome, &whole.history), (&alone.outcome, &alone.history));
    let (again, [recalled, pressed, more]) = run(18);
    assert_eq!(
        (again.outcome, recalled),
        (whole.outcome, alone.outcome.simulations)
    );
    assert_eq!((pressed, more), (0, 0));
}
