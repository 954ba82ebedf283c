//! `pliant fit` on a measurement set, end to end.

use crate::laws::foam;
use crate::twin::{Block, measure, pressed};
use assert_cmd::Command;
use pliant::fem::measurement_set::MeasurementSet;
use pliant::fem::specimen::Specimen;
use pliant::material::record::{Kind, MaterialRecord};
use pliant::math::Vec3;
use std::fmt::Write as _;
use std::path::Path;

const HEAD: &str = r##"schema = 1
origin = "computed"
computed_from = "a twin"

[material]
id = "twin-foam"
name = "Twin foam"
kind = "isotropic"
colour = "#c9b458"
density_g_per_cm3 = 0.1
assumptions = []

[material.printability]
printable = false
process = "cut from a block"

[material.source]
citation = "this test"
licence = "none"

[specimen]
size_mm = [50, 40, 25]
element_size = "8.4 mm"
elements = "tetrahedra"

[[fixed]]
face = "bottom"
"##;

/// A database folder with the set `sets/twin-foam.toml`, measured on the mesh that the file makes.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let sets = folder.path().join("sets");
    std::fs::create_dir(&sets).unwrap();
    let block = Block::standard([6, 5, 3], 3, 3, 10.0);
    let mut text = HEAD.to_string();
    for (k, (place, direction)) in block.presses.iter().enumerate() {
        let p = place.component_mul(&block.size);
        write!(
            text,
            "\n[[example]]\nname = \"press {}\"\npoint_mm = [{}, {}, {}]\ndirection = [{}, {}, {}]\nradius = \"8 mm\"\nfile = \"twin-foam/{k}.csv\"\nheld_out = {}\n",
            k + 1, p.x, p.y, p.z, direction.x, direction.y, direction.z, k == 2
        )
        .unwrap();
    }
    let blank = block.set(Kind::Isotropic, Vec3::z());
    std::fs::create_dir(sets.join("twin-foam")).unwrap();
    let write_tables = |values: &dyn Fn(usize, usize, usize) -> f64| {
        for k in 0..3 {
            let mut csv = "force_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm\n".to_string();
            for (l, force) in block.forces.iter().enumerate() {
                for (m, point) in blank.experiments[k].points.iter().enumerate() {
                    let [x, y, z] = [0, 1, 2].map(|c| values(k, l, 3 * m + c));
                    let at = point.place;
                    writeln!(csv, "{force},{},{},{},{x},{y},{z}", at.x, at.y, at.z).unwrap();
                }
            }
            std::fs::write(sets.join(format!("twin-foam/{k}.csv")), csv).unwrap();
        }
    };
    let file = sets.join("twin-foam.toml");
    std::fs::write(&file, &text).unwrap();
    // The file's own mesh is what the truth is simulated on; its readings are made up until then.
    write_tables(&|_, l, _| 0.1 * (l + 1) as f64);
    let set = MeasurementSet::open(&file).unwrap();
    let specimen = Specimen::new(&set).unwrap();
    let mut pressed = pressed(&set, &specimen);
    measure(&mut pressed, &foam(), 0.002, 3);
    write_tables(&|k, l, c| pressed.presses[k].readings[l][c].unwrap());
    folder
}

fn pliant(folder: &Path, arguments: &[&str]) -> std::process::Output {
    let mut command = Command::cargo_bin("pliant").unwrap();
    command.current_dir(folder).args(arguments).output().unwrap()
}

#[test]
fn a_set_becomes_a_record_a_table_and_a_page() {
    let folder = folder();
    let file = "sets/twin-foam.toml";
    let arguments = ["fit", file, "--out", ".", "--plots", "plots", "--bootstrap", "50"];
    let output = pliant(folder.path(), &arguments);
    let text = String::from_utf8_lossy(&output.stdout).to_string();
    let complaint = String::from_utf8_lossy(&output.stderr).to_string();
    assert_eq!(output.status.code(), Some(0), "{text}{complaint}");
    for word in [
        "average mm",
        "small",
        "medium",
        "large",
        "held out",
        "stopped",
        "wrote",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    let record = std::fs::read_to_string(folder.path().join("twin-foam.toml")).unwrap();
    let (record, unknown) = MaterialRecord::parse(&record, Path::new("twin-foam.toml")).unwrap();
    assert!(unknown.is_empty());
    assert_eq!(record.recipe.as_deref(), Some(file));
    assert_eq!(record.measurements.len(), 2);
    assert!(
        record
            .measurements
            .iter()
            .all(|m| m.rms_mm.unwrap() < 0.05 && m.relative_rms < 0.03)
    );
    let uncertainty = record.uncertainty.as_ref().unwrap();
    assert!(uncertainty.basis.contains("bootstrap of 50") && uncertainty.parameters.len() == 12);
    let page = std::fs::read_to_string(folder.path().join("plots/twin-foam-fit.html")).unwrap();
    assert!(page.contains("Errors by force") && page.contains("95 % band") && page.contains("held out"));
    assert!(folder.path().join("plots/twin-foam-markers.svg").exists());
    // The record passes the database's own check.
    let checked = pliant(folder.path(), &["db", "check", "--db", "."]);
    let said = String::from_utf8_lossy(&checked.stdout).to_string();
    assert_eq!(checked.status.code(), Some(0), "{said}");
}

#[test]
fn options_that_do_not_belong_are_refused() {
    let folder = folder();
    let output = pliant(
        folder.path(),
        &["fit", "sets/twin-foam.toml", "--compare", "--dry-run"],
    );
    assert_eq!(output.status.code(), Some(2));
    let complaint = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(complaint.contains("--compare"), "{complaint}");
    assert!(!folder.path().join("twin-foam.toml").exists());
}
