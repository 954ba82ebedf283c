//! `pliant fit` on made-up coupons: six kinds of tests of one foam, written as files, read, fitted, compared; and what is
//! said of coupons that make no sense.

use assert_cmd::Command;
use pliant::fitting::coupon::file::TestKind;
use pliant::fitting::coupon::state::response;
use pliant::material::database::Database;
use pliant::material::hyperelastic::{FoamTerm, Form, Hyperelastic};
use pliant::material::law::Law;
use std::fmt::Write;
use std::path::Path;

fn pliant(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("pliant")
        .unwrap()
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code().unwrap_or(-1),
        text(&output.stdout),
        text(&output.stderr),
    )
}

const HEAD: &str = "schema = 1\nid = \"made-up\"\nname = \"Made up\"\ncolour = \"#aabbcc\"\ndensity_g_per_cm3 = 0.2\n\
    model = \"hyperfoam-1\"\nassumptions = [\"made up\"]\n[printability]\nprintable = false\nprocess = \"none\"\n\
    [source]\ncitation = \"nobody\"\nlicence = \"none\"\n[poisson]\nfitted = \"constant\"\n";

const KINDS: [(TestKind, f64); 6] = [
    (TestKind::UniaxialCompression, -0.6),
    (TestKind::UniaxialTension, 0.4),
    (TestKind::EquibiaxialTension, 0.3),
    (TestKind::PlanarTension, 0.4),
    (TestKind::ConfinedCompression, -0.4),
    (TestKind::SimpleShear, 0.3),
];

fn foam() -> Law {
    let terms = vec![FoamTerm {
        shear_mpa: 0.08,
        exponent: 5.0,
        poisson: 0.2,
    }];
    Law::Hyperelastic(Hyperelastic::new(Form::Hyperfoam { terms }).unwrap())
}

/// The curves of the foam in `folder`, with a ripple of half a percent, and the coupon file that names them.
fn write_coupon(folder: &Path) -> String {
    let law = foam();
    let mut coupon = HEAD.to_string();
    for (kind, end) in KINDS {
        let mut table = String::from("strain;stress\n");
        for i in 1..=30 {
            let strain = end * f64::from(i) / 30.0;
            let ripple = 1.0 + 0.005 * (1.7 * f64::from(i)).sin();
            let stress = 1000.0 * ripple * response(&law, kind, strain).stress;
            writeln!(table, "{strain};{stress}").unwrap();
        }
        let file = format!("{}.csv", kind.word());
        std::fs::write(folder.join(&file), table).unwrap();
        write!(
            coupon,
            "[[tests]]\nkind = \"{}\"\nspecimen = \"made up\"\nweight = 2.0\nfile = \"{file}\"\ndelimiter = \";\"\n\
             deformation = {{ column = \"strain\", unit = \"1\" }}\nload = {{ column = \"stress\", unit = \"kPa\" }}\n\
             range = [0.0, {}]\n",
            kind.word(),
            end.abs()
        )
        .unwrap();
    }
    std::fs::write(folder.join("coupon.toml"), &coupon).unwrap();
    coupon
}

#[test]
fn six_kinds_of_tests_make_a_foam_again() {
    let folder = tempfile::tempdir().unwrap();
    write_coupon(folder.path());
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (coupon, db, plots, page) = (at("coupon.toml"), at("db"), at("docs/plots"), at("docs/page.md"));
    let arguments = [
        "fit",
        &coupon,
        "--out",
        &db,
        "--compare",
        "--bootstrap",
        "30",
        "--plots",
        &plots,
        "--page",
        &page,
    ];
    let (code, out, err) = pliant(&arguments);
    assert_eq!(code, 0, "{err}");
    for words in [
        "confined-compression",
        "stopped since",
        "Poisson's ratio = 0.2",
        "AICc",
        "inside the range hyperfoam-1",
        "outside the range trust hyperfoam-1",
    ] {
        assert!(out.contains(words), "{words} is not in {out}");
    }
    let record = Database::open(Path::new(&db))
        .unwrap()
        .find("made-up")
        .unwrap()
        .clone();
    let law = record.law().unwrap();
    for (kind, end) in KINDS {
        for share in [0.3, 1.0] {
            let (a, b) = (
                response(&law, kind, share * end).stress,
                response(&foam(), kind, share * end).stress,
            );
            // The ripple averages out.
            assert!((a / b - 1.0).abs() < 3e-3, "{kind:?}: {a} for {b}");
        }
    }
    let uncertainty = record.uncertainty.unwrap();
    assert_eq!(uncertainty.parameters.len(), 3);
    assert!(
        uncertainty.basis.starts_with("bootstrap of 30"),
        "{}",
        uncertainty.basis
    );
    assert!((0..3).all(|i| uncertainty.covariance[i][i] > 0.0));
    let page = std::fs::read_to_string(&page).unwrap();
    assert!(
        page.contains("## made-up") && page.contains("](plots/made-up-laws.svg)"),
        "{page}"
    );
    for name in ["made-up.svg", "made-up-errors.svg", "made-up-laws.svg"] {
        let svg = std::fs::read_to_string(Path::new(&plots).join(name)).unwrap();
        assert!(
            svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"),
            "{name}"
        );
    }
    let (code, _, err) = pliant(&["db", "check", "--db", &db]);
    assert_eq!(code, 0, "{err}");
}

/// For machines; twice, to the last digit, so that the second time there is nothing new to write.
#[test]
fn the_same_seed_makes_the_same_record() {
    let folder = tempfile::tempdir().unwrap();
    write_coupon(folder.path());
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let (coupon, db) = (at("coupon.toml"), at("db"));
    let again = ["fit", &coupon, "--out", &db, "--bootstrap", "30", "--json"];
    let (first, second) = (pliant(&again), pliant(&again));
    assert_eq!(first, second);
    let record = Database::open(Path::new(&db))
        .unwrap()
        .find("made-up")
        .unwrap()
        .clone();
    assert_eq!(record.version, 1);
    let json: serde_json::Value = serde_json::from_str(&first.1).unwrap();
    assert!(json[0]["comparison"].is_null());
    assert_eq!(json[0]["bootstrap"]["bands"].as_array().unwrap().len(), 6);
    assert!(json[0]["numbers"][1]["standard_error"].as_f64().unwrap() > 0.0);
}

#[test]
fn a_coupon_that_makes_no_sense_is_answered_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let good = write_coupon(folder.path());
    let file = folder.path().join("coupon.toml");
    let db = folder.path().join("db");
    let run = |text: &str| {
        std::fs::write(&file, text).unwrap();
        let (code, _, err) = pliant(&["fit", &file.to_string_lossy(), "--out", &db.to_string_lossy()]);
        assert_eq!(code, 2, "{err}");
        assert!(!db.exists(), "nothing is written: {err}");
        err
    };
    let cases = [
        ("weight = 2.0", "weight = 0.0", "tests[0].weight = 0"),
        ("kind = \"planar-tension\"", "kind = \"torsion\"", "torsion"),
        ("model = \"hyperfoam-1\"", "model = \"ogden-9\"", "ogden-9"),
        ("fitted = \"constant\"", "at-rest = 0.7", "poisson.at-rest = 0.7"),
        (
            "column = \"strain\"",
            "column = \"strian\"",
            "no column \"strian\"",
        ),
        ("planar-tension.csv", "nowhere.csv", "nowhere.csv"),
        ("unit = \"kPa\"", "unit = \"bar\"", "tests[0].load.unit"),
        (
            "range = [0.0, 0.6]",
            "range = [0.0, 0.6]\nlateral = { file = \"w\", width = \"w\", height = \"h\" }",
            "w: ",
        ),
    ];
    for (from, to, expected) in cases {
        let text = good.replacen(from, to, 1);
        assert_ne!(text, good, "{from:?} is not in the file");
        let err = run(&text);
        assert!(err.contains(expected), "{expected:?} is not in {err}");
    }
    let held = good.replace("weight = 2.0", "held_out = true");
    assert!(run(&held).contains("all held out"), "at least one test is fitted");
    let confined = good.replacen(
        "range = [0.0, 0.4]\n[[tests]]\nkind = \"simple-shear\"",
        "range = [0.0, 0.4]\nlateral = { file = \"w\", width = \"w\", height = \"h\" }\n[[tests]]\nkind = \"simple-shear\"",
        1,
    );
    assert!(
        run(&confined).contains("in confined-compression"),
        "a confined side has no width"
    );
    // Upside down: stress against strain.
    let table = folder.path().join("planar-tension.csv");
    let curve = std::fs::read_to_string(&table).unwrap();
    std::fs::write(&table, curve.replace(';', ";-").replace(";-stress", ";stress")).unwrap();
    let err = run(&good);
    assert!(
        err.contains("planar-tension.csv") && err.contains("negate"),
        "{err}"
    );
}

#[test]
fn refuses_too_few_samples() {
    let (code, _, err) = pliant(&["fit", "coupon.toml", "--bootstrap", "3"]);
    assert!(code == 2 && err.contains("20"), "{err}");
}

/// Files cut off or spoiled at any place are answered, never a panic.
#[test]
fn spoiled_files_are_answered() {
    use pliant::fitting::coupon::curve::read_curve;
    use pliant::fitting::coupon::file::CouponFile;
    use rand::{Rng, SeedableRng};
    let folder = tempfile::tempdir().unwrap();
    let good = write_coupon(folder.path());
    let (coupon, _) = CouponFile::parse(&good, Path::new("coupon.toml")).unwrap();
    let table = std::fs::read(folder.path().join("planar-tension.csv")).unwrap();
    let test = &coupon.tests[3];
    assert!(read_curve(test, &table, None).is_ok());
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(2);
    let (mut wrong_coupons, mut wrong_curves) = (0, 0);
    for _ in 0..3000 {
        let end = (0..=good.len()).filter(|i| good.is_char_boundary(*i));
        let end: Vec<usize> = end.collect();
        let mut text: String = good[..end[rng.gen_range(0..end.len())]].into();
        if rng.gen_bool(0.5) {
            text = good.replacen(
                rng.gen_range('0'..='9'),
                ["", "-", "1e400", "nan", "é"][rng.gen_range(0..5)],
                3,
            );
        }
        wrong_coupons += usize::from(CouponFile::parse(&text, Path::new("c")).is_err());
        let mut bytes = table.clone();
        bytes.truncate(rng.gen_range(0..=table.len()));
        for _ in 0..rng.gen_range(0..4) {
            if !bytes.is_empty() {
                let at = rng.gen_range(0..bytes.len());
                bytes[at] = rng.gen_range(0..=255);
            }
        }
        wrong_curves += usize::from(read_curve(test, &bytes, Some(&bytes)).is_err());
    }
    assert!(
        wrong_coupons > 1000 && wrong_curves > 1000,
        "{wrong_coupons} {wrong_curves}"
    );
}
