//! The shipped database: every record is sound, and comes out of its coupon file again.

mod commands;
mod curator;
mod versions;
mod writers;

use pliant::fitting::coupon::file::CouponFile;
use pliant::fitting::coupon::record::fit_coupon;
use pliant::material::database::Database;
use pliant::material::homogeneous::{first_fold, uniaxial};
use pliant::material::put::Change;
use pliant::material::record::{Kind, MaterialRecord};
use pliant::math::mandel::Mandel;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::path::{Path, PathBuf};

const DATABASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db");
const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data");

fn database() -> Database {
    Database::open(Path::new(DATABASE)).unwrap()
}

fn text_of(id: &str) -> String {
    std::fs::read_to_string(Path::new(DATABASE).join(format!("{id}.toml"))).unwrap()
}

/// A shipped record as a first version, for folders that hold no older ones.
fn as_first(id: &str) -> String {
    let text = text_of(id);
    let lines = text.lines().filter(|line| !line.starts_with("previous_sha256"));
    let first = lines.map(|line| match line.starts_with("version = ") {
        true => "version = 1",
        false => line,
    });
    first.map(|line| format!("{line}\n")).collect()
}

#[test]
fn every_record_is_sound() {
    let database = database();
    assert!(database.broken().is_empty(), "{:?}", database.broken());
    // Stored stresses that the law answers again, among all else; and older versions as they were written.
    for (entry, findings) in database.check() {
        assert!(entry.unknown.is_empty(), "{:?}", entry.unknown);
        assert!(findings.is_empty(), "{}: {findings:?}", entry.file.display());
    }
    let count = |f: &dyn Fn(&MaterialRecord) -> bool| database.records().filter(|r| f(r)).count();
    let tested = |r: &MaterialRecord, test: &str| r.measurements.iter().any(|m| m.test == test);
    assert!(count(&|r| r.id.starts_with("ecoflex") && tested(r, "uniaxial-compression")) >= 10);
    assert!(count(&|r| tested(r, "uniaxial-tension") && r.measurements.len() == 1) >= 5);
    assert!(count(&|r| r.kind == Kind::TransverselyIsotropic) >= 4);
    assert_eq!(
        count(&|r| r.measurements.len() == 3),
        2,
        "the foam that was pressed, pulled and sheared, and the rubber that was pulled in three ways"
    );
    for record in database.records() {
        // Computed, not measured: the blocks with tubes.
        assert_eq!(record.synthetic, record.id.starts_with("tubes-"), "{}", record.id);
        assert!(!record.measurements.is_empty(), "{}", record.id);
        assert!(
            // A structure with walls and cut ends is not quite a homogeneous material.
            record
                .relative_rms()
                .is_none_or(|e| e < if record.synthetic { 0.07 } else { 0.05 }),
            "{}: {:?}",
            record.id,
            record.relative_rms()
        );
    }
}

/// Objects are pressed to half their height, whatever their material was measured in.
#[test]
fn no_curve_folds() {
    for record in database().records() {
        let law = record.law().unwrap();
        assert_eq!(first_fold(&law, -0.75, 300), None, "{}", record.id);
        let high = record.model.range.engineering_strain[1];
        assert_eq!(first_fold(&law, high.max(0.3), 300), None, "{}", record.id);
    }
}

/// Newton's method on a pressed silicone meets no negative stiffness: the symmetric part of the tangent is positive
/// definite at random strains up to a norm of 0.6. (With a bulk modulus in step with the shear modulus, a quarter of
/// these strains fail.)
#[test]
fn silicones_have_a_definite_tangent() {
    let mut silicones = 0;
    for record in database()
        .records()
        .filter(|r| r.printability.process == "cast silicone")
    {
        let law = record.law().unwrap();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
        for _ in 0..500 {
            let direction = Mandel::from_fn(|_, _| rng.gen_range(-1.0..1.0));
            let strain = direction.normalize() * rng.gen_range(0.0..0.6);
            let (_, tangent) = law.stress_and_tangent(&strain);
            let least = ((tangent + tangent.transpose()) * 0.5)
                .symmetric_eigenvalues()
                .min();
            assert!(least > 0.0, "{}: {least} MPa at {strain}", record.id);
        }
        silicones += 1;
    }
    assert!(silicones >= 15);
}

/// What the testing machine said, read off the file by hand: EF30_0T_A1 shows −45.43 kPa at a strain of −0.3282.
#[test]
fn answers_what_the_machine_measured() {
    let law = database().find("ecoflex-00-30").unwrap().law().unwrap();
    let stress = uniaxial(&law, -0.328219).stress;
    assert!((stress + 0.045426).abs() < 0.01 * 0.045426, "{stress} MPa");
}

#[test]
fn a_coupon_makes_its_record_again() {
    if !Path::new(DATA).is_dir() {
        println!("skipped: no measurements at {DATA}");
        return;
    }
    let mut made = 0;
    for item in std::fs::read_dir(Path::new(DATABASE).join("coupons")).unwrap() {
        let path: PathBuf = item.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let (coupon, unknown) = CouponFile::parse(&text, &path).unwrap();
        assert!(unknown.is_empty(), "{path:?}: {unknown:?}");
        let fitted = fit_coupon(&coupon, &|file| std::fs::read(Path::new(DATA).join(file))).unwrap();
        let stored = MaterialRecord::parse(&text_of(&coupon.id), &path).unwrap().0;
        assert_eq!(
            fitted.record.measurements.len(),
            stored.measurements.len(),
            "{}",
            coupon.id
        );
        let (new, old) = (fitted.record.law().unwrap(), stored.law().unwrap());
        let [low, high] = stored.model.range.engineering_strain;
        for i in 1..=20 {
            let axial = low + (high - low) * f64::from(i) / 20.0;
            let (a, b) = (uniaxial(&new, axial).stress, uniaxial(&old, axial).stress);
            // Another processor may round differently on the way to the minimum.
            assert!(
                (a - b).abs() <= 1e-4 * b.abs() + 1e-9,
                "{} at {axial}: {a} and {b}",
                coupon.id
            );
        }
        for (new, old) in fitted.record.measurements.iter().zip(&stored.measurements) {
            assert!(
                (new.relative_rms - old.relative_rms).abs() < 1e-4,
                "{}",
                coupon.id
            );
        }
        made += 1;
    }
    // Records of presses were fitted to sets, which tests/laboratory looks at.
    let of_sets = |r: &&MaterialRecord| r.recipe.as_ref().is_some_and(|f| f.starts_with("sets/"));
    let sets = database().records().filter(of_sets).count();
    assert_eq!(
        made + sets,
        database().entries().len(),
        "each record has its coupon or its set"
    );
}

#[test]
fn records_survive_writing() {
    let folder = tempfile::tempdir().unwrap();
    for record in database().records() {
        let put = Database::put(folder.path(), record).unwrap();
        assert_eq!((put.version, put.change), (1, Change::First));
        let file = put.file;
        let text = std::fs::read_to_string(&file).unwrap();
        let (again, unknown) = MaterialRecord::parse(&text, &file).unwrap();
        // A database numbers what it is given from one.
        let numbered = MaterialRecord {
            version: 1,
            previous_sha256: None,
            ..record.clone()
        };
        assert_eq!(again, numbered);
        assert!(unknown.is_empty());
        assert_eq!(again.law().unwrap(), record.law().unwrap());
    }
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        database().entries().len() + 1,
        "nothing left aside but the lock"
    );
}

/// One thing wrong at a time, each named with its line.
#[test]
fn a_spoiled_record_is_found_out() {
    let good = text_of("ecoflex-00-30");
    let line = |start: &str| 1 + good.lines().position(|l| l.starts_with(start)).unwrap();
    let file = Path::new("ecoflex-00-30.toml");
    let spoil = |from: &str, to: &str| {
        let text = good.replacen(from, to, 1);
        assert_ne!(text, good, "{from:?} is not in the file");
        MaterialRecord::parse(&text, file).map(|(record, _)| pliant::material::check::check(&record, &text))
    };
    let finding = |from: &str, to: &str| {
        let findings = spoil(from, to).unwrap();
        assert!(!findings.is_empty(), "{from:?} to {to:?} went unnoticed");
        findings[0].clone()
    };
    let colour = good.lines().find(|l| l.starts_with("colour")).unwrap();
    assert_eq!(finding(colour, "colour = \"red\"").line, line("colour"));
    let density = good.lines().find(|l| l.starts_with("density")).unwrap();
    assert!(
        finding(density, "density_g_per_cm3 = 1070.0")
            .message
            .contains("kg/m³")
    );
    let moduli = good.lines().find(|l| l.starts_with("moduli_mpa")).unwrap();
    let found = finding(moduli, "moduli_mpa = [0.05, 2.0]");
    assert_eq!(
        (found.line, found.field.as_str()),
        (line("moduli_mpa"), "model.centres[0].moduli_mpa")
    );
    let stress = good.lines().find(|l| l.starts_with("stress_mpa")).unwrap();
    let found = finding(stress, "stress_mpa = [0.0, 0.0, -1.0, 0.0, 0.0, 0.0]");
    assert_eq!(
        (found.line, found.field.as_str()),
        (line("stress_mpa"), "checks[0].stress_mpa")
    );
    let weights = good.lines().find(|l| l.starts_with("weights")).unwrap();
    assert!(
        finding(weights, "weights = [100.0, 0.0]")
            .message
            .contains("sums to")
    );

    let error = spoil("schema = 2", "schema = 7").unwrap_err().to_string();
    assert!(
        error.contains(&format!("line {}: schema = 7", line("schema"))),
        "{error}"
    );
    let error = spoil(moduli, "moduli_mpa = [0.05]").unwrap_err().to_string();
    assert!(
        error.contains("2 numbers, for a material that is isotropic"),
        "{error}"
    );
    let error = spoil(colour, "colour = 3").unwrap_err().to_string();
    assert!(
        error.contains(&format!("line {}", line("colour"))) && error.contains("string"),
        "{error}"
    );
    let error = spoil(colour, "").unwrap_err().to_string();
    assert!(error.contains("colour"), "{error}");
    let (_, unknown) = MaterialRecord::parse(&good.replacen("colour", "odour = 1\ncolour", 1), file).unwrap();
    assert_eq!(
        (unknown[0].line, unknown[0].field.as_str()),
        (line("colour"), "odour")
    );
}

#[test]
fn an_unknown_id_is_answered_with_its_neighbours() {
    let error = database().find("ecoflex-0030").unwrap_err().to_string();
    assert!(error.contains("ecoflex-00-30"), "{error}");
    assert!(
        Database::open(Path::new("/nowhere"))
            .unwrap_err()
            .to_string()
            .contains("--db")
    );
}
