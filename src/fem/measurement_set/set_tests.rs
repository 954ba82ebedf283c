//! Sets are read, refused, written and doubted.

use super::plausible::oddities;
use super::write::{BlockSet, BlockSpecimen, write_set};
use super::*;
use crate::fem::specimen::Specimen;

const HEAD: &str = r##"
schema = 1
origin = "measured"

[material]
id = "soft-foam"
name = "Soft foam"
kind = "isotropic"
colour = "#aabbcc"
density_g_per_cm3 = 0.1

[material.printability]
printable = false
process = "cut from a block"

[material.source]
citation = "Nobody (2000)"
licence = "none"

[specimen]
size_mm = [40, 50, 25]
element_size = "5 mm"

[[fixed]]
face = "bottom"
"##;

const EXAMPLE: &str = r#"
[[example]]
name = "middle"
point_mm = [20, 25, 25]
direction = [0, 0, -1]
radius = "8 mm"
forces_n = [2, 4, 6]
displacements_mm = [1.0, 1.8, 2.4]
"#;

fn document(text: &str) -> Document {
    Document {
        file: "set.toml".into(),
        text: text.into(),
    }
}

fn read(text: &str) -> Result<MeasurementSet, Mistake> {
    MeasurementSet::read(document(text))
}

#[test]
fn a_block_is_meshed_held_and_wired() {
    let set = read(&format!("{HEAD}{EXAMPLE}")).unwrap();
    assert_eq!(set.mesh.nodes.len(), 9 * 11 * 6);
    assert_eq!(
        set.constrained.iter().filter(|c| **c == [true; 3]).count(),
        9 * 11
    );
    assert_eq!(set.experiments[0].deviations_mm, vec![vec![DEVIATION_MM; 3]]);
    assert!(oddities(&set).is_empty(), "{:?}", oddities(&set));
    let specimen = Specimen::new(&set).unwrap();
    let wired = &specimen.experiments[0];
    assert!((wired.shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    // The moment about the middle of an even pressure vanishes.
    let middle: Vec3 = wired
        .shares
        .iter()
        .zip(&set.mesh.nodes)
        .map(|(s, x)| x * *s)
        .sum();
    assert!((middle - Vec3::new(20.0, 25.0, 25.0)).norm() < 0.05, "{middle}");
    assert_eq!(wired.under_probe, [true]);
    // A linear field is read exactly, whatever the element.
    let u: Vec<Vec3> = set.mesh.nodes.iter().map(|x| x * 0.1).collect();
    assert!((wired.sensors[0].read(&u) - Vec3::new(2.0, 2.5, 2.5)).norm() < 1e-12);
}

#[test]
fn wrong_sets_are_refused_at_their_line() {
    let line_of = |text: &str, part: &str| text[..text.find(part).unwrap()].matches('\n').count() + 1;
    let whole = format!("{HEAD}{EXAMPLE}");
    for (from, to, at, words) in [
        ("schema = 1", "schema = 7", "schema", "schema 7"),
        ("\"measured\"", "\"guessed\"", "origin", "\"guessed\""),
        ("[40, 50, 25]", "[40, 0, 25]", "size_mm", "above zero"),
        ("\"5 mm\"", "\"0.01 mm\"", "size_mm", "larger element_size"),
        ("\"5 mm\"", "\"5\"", "element_size", "unit"),
        ("face = \"bottom\"", "face = \"left\"", "face", "\"left\""),
        ("[2, 4, 6]", "[2, 6, 4]", "forces_n", "rising"),
        (
            "[1.0, 1.8, 2.4]",
            "[1.0, 1.8]",
            "displacements_mm",
            "2 displacements for 3 forces",
        ),
        (
            "kind = \"isotropic\"",
            "kind = \"isotropic\"\naxis = [0, 0, 1]",
            "axis",
            "isotropic",
        ),
        ("#aabbcc", "blue", "colour", "#rrggbb"),
        ("soft-foam", "Soft Foam", "id", "lower-case"),
        (
            "radius = \"8 mm\"",
            "radius = \"8 mm\"\nheld_out = true",
            "[[example]]",
            "held out",
        ),
        (
            "radius = \"8 mm\"",
            "radius = \"8 mm\"\nweight = 0.0",
            "weight",
            "above zero",
        ),
    ] {
        let text = whole.replace(from, to);
        let error = read(&text).unwrap_err();
        assert!(error.message.contains(words), "{from} → {to}: {error}");
        assert_eq!(error.line, line_of(&text, at), "{from} → {to}: {error}");
    }
}

#[test]
fn a_marker_off_the_specimen_is_named() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("points.csv"),
        "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n2,20,25,40,0,0,-1\n",
    )
    .unwrap();
    let example = EXAMPLE
        .replace("forces_n = [2, 4, 6]", "file = \"points.csv\"")
        .replace("displacements_mm = [1.0, 1.8, 2.4]", "");
    let set = MeasurementSet::read(Document {
        file: folder.path().join("set.toml"),
        text: format!("{HEAD}{example}"),
    })
    .unwrap();
    let error = Specimen::new(&set).unwrap_err().to_string();
    assert!(
        error.contains("15.0 mm off the specimen") && error.contains("unit"),
        "{error}"
    );
}

/// A linear field of 20 markers over five forces, one of them misread at one force.
fn markers(change: impl Fn(usize, usize, Vec3) -> Vec3) -> Experiment {
    let levels = 5;
    let mut points = Vec::new();
    for i in 0..20 {
        let place = Vec3::new(
            if i < 10 { 0.0 } else { 40.0 },
            5.0 * (i % 10) as f64,
            if i % 2 == 0 { 1.0 } else { 20.0 },
        );
        let displacements_mm = (0..levels)
            .map(|level| {
                let load = (level + 1) as f64;
                let u = Vec3::new(0.001 * load, 0.0, -0.004 * place.z * load * (1.0 - 0.04 * load));
                change(i, level, u).iter().map(|c| Some(*c)).collect()
            })
            .collect();
        points.push(MeasuredPoint {
            place,
            directions: vec![Vec3::x(), Vec3::y(), Vec3::z()],
            displacements_mm,
        });
    }
    Experiment {
        name: "middle".into(),
        contact: Contact {
            point: Vec3::new(20.0, 25.0, 25.0),
            direction: -Vec3::z(),
            radius_mm: 8.0,
        },
        forces: (1..=levels)
            .map(|k| Vec3::new(0.0, 0.0, -2.0 * k as f64))
            .collect(),
        deviations_mm: vec![vec![0.002; levels]; points.len()],
        points,
        weight: 1.0,
        held_out: false,
    }
}

fn with(experiment: Experiment) -> MeasurementSet {
    let mut set = read(&format!("{HEAD}{EXAMPLE}")).unwrap();
    set.experiments = vec![experiment];
    set
}

#[test]
fn units_drift_and_outliers_are_seen_and_a_sound_set_is_not_doubted() {
    let sound = oddities(&with(markers(|_, _, u| u)));
    assert!(sound.is_empty(), "{sound:?}");
    let in_metres = oddities(&with(markers(|_, _, u| u * 1e-6)));
    assert!(
        in_metres[0].is_fatal && in_metres[0].message.contains("displacements in mm"),
        "{in_metres:?}"
    );
    let drifted = oddities(&with(markers(|_, level, u| {
        u + Vec3::new(0.0, 0.1 * level as f64, 0.0)
    })));
    assert!(
        drifted.len() == 1 && drifted[0].message.contains("drifted") && !drifted[0].is_fatal,
        "{drifted:?}"
    );
    let misread = |i, level, u| {
        if (i, level) == (7, 2) {
            u + Vec3::new(0.0, 0.0, 0.3)
        } else {
            u
        }
    };
    let found = oddities(&with(markers(misread)));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].message.contains("under 6.000 N") && found[0].message.contains("(0.0, 35.0, 20.0)"),
        "{found:?}"
    );
    let slipped = oddities(&with(markers(|_, level, u| if level == 4 { u * 0.5 } else { u })));
    assert!(
        slipped.iter().any(|o| o.message.contains("gone back")),
        "{slipped:?}"
    );
}

#[test]
fn a_written_set_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut experiment = markers(|_, _, u| u);
    experiment.points[3].displacements_mm[2] = vec![None; 3];
    let set = with(experiment);
    let block = BlockSet {
        origin: Origin::Computed("a \"twin\" of nothing".into()),
        material: set.material.clone(),
        specimen: BlockSpecimen {
            size_mm: Vec3::new(40.0, 50.0, 25.0),
            element_size_mm: 5.0,
            tetrahedra: false,
            fixed: "[[fixed]]\nface = \"bottom\"\n".into(),
        },
        experiments: set.experiments.clone(),
    };
    let file = write_set(&block, folder.path()).unwrap();
    let back = MeasurementSet::open(&file).unwrap();
    assert_eq!(back.origin, block.origin);
    assert_eq!(back.material, set.material);
    assert_eq!(back.mesh, set.mesh);
    let (a, b) = (&back.experiments[0], &set.experiments[0]);
    assert_eq!(
        (&a.forces, a.contact, &a.deviations_mm[0]),
        (&b.forces, b.contact, &b.deviations_mm[0])
    );
    assert_eq!(a.points.len(), b.points.len());
    assert_eq!(a.points[3].displacements_mm[2], vec![None; 3]);
    for (a, b) in a.points.iter().zip(&b.points) {
        for (a, b) in a
            .displacements_mm
            .iter()
            .flatten()
            .zip(b.displacements_mm.iter().flatten())
        {
            assert!(a.zip(*b).is_none_or(|(a, b)| (a - b).abs() < 1e-6));
        }
    }
}
