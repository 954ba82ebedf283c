//! A small testing machine: curves written as text and read back.

use super::*;
use crate::fitting::coupon::file::CouponFile;
use std::path::Path;

fn test_of(extra: &str) -> Test {
    let text = format!(
        "schema = 1\nid = \"x\"\nname = \"X\"\ncolour = \"#aabbcc\"\ndensity_g_per_cm3 = 1.0\n\
         [printability]\nprintable = false\nprocess = \"cast\"\n[source]\ncitation = \"c\"\nlicence = \"l\"\n\
         [poisson]\nassumed = 0.4\n[[tests]]\nkind = \"uniaxial-compression\"\nspecimen = \"s\"\nfile = \"f.csv\"\n{extra}"
    );
    CouponFile::parse(&text, Path::new("coupon.toml"))
        .unwrap()
        .0
        .tests
        .remove(0)
}

const GAP: &str = "deformation = { column = \"gap\", unit = \"um\", measure = \"height\" }\n\
    load = { column = \"force\", unit = \"N\", negate = true }\nheight_mm = 10.0\narea_mm2 = 50.0\nrange = [0.0, 0.4]\n\
    points = 20\n";

/// Two cycles on 10 mm of 0.2 MPa and 50 mm²: F = 10 N × strain, the second cycle at half the force, unloading at 80 %.
fn two_cycles() -> String {
    let mut text = String::from("time,gap,force\n");
    for cycle in [1.0, 0.5] {
        for (from, to, part) in [(0.0, 0.5, 1.0), (0.5, 0.0, 0.8)] {
            for i in 0..=100 {
                let strain = from + (to - from) * f64::from(i) / 100.0;
                text += &format!(
                    "0,{},{}\n",
                    10_000.0 * (1.0 - strain),
                    10.0 * strain * part * cycle
                );
            }
        }
    }
    text
}

#[test]
fn picks_the_branch_and_turns_the_units() {
    let text = two_cycles();
    for (branch, modulus) in [("", 0.2), ("cycle = 2\n", 0.1), ("branch = \"average\"\n", 0.18)] {
        let curve = read_curve(&test_of(&format!("{GAP}{branch}")), text.as_bytes(), None).unwrap();
        assert_eq!(curve.strain.len(), 20);
        for (e, p) in curve.strain.iter().zip(&curve.stress) {
            assert!(*e < 0.0 && *e > -0.4);
            // The bins of loading and unloading hold the same strains up to one sample.
            assert!(
                (p / e - modulus).abs() < 0.005 * modulus,
                "{branch:?}: {p} at {e}"
            );
        }
    }
    let third = read_curve(&test_of(&format!("{GAP}cycle = 3\n")), text.as_bytes(), None);
    assert!(third.unwrap_err().to_string().contains("of loading branch 3"));
}

#[test]
fn takes_out_the_slack() {
    // Nothing up to 2 %, then 0.3 MPa.
    let mut text = String::from("e;s\n");
    for i in 0..=200 {
        let e = f64::from(i) / 400.0;
        text += &format!("{e};{}\n", -300.0 * (e - 0.02).max(0.0));
    }
    let test = test_of(
        "delimiter = \";\"\ndeformation = { column = \"e\", unit = \"1\", negate = true }\n\
         load = { column = \"s\", unit = \"kPa\" }\nrange = [0.0, 0.4]\ntoe_compensation = [0.05, 0.2]\n",
    );
    let curve = read_curve(&test, text.as_bytes(), None).unwrap();
    assert!((curve.slack - 0.02).abs() < 1e-12, "{}", curve.slack);
    for (e, p) in curve.strain.iter().zip(&curve.stress) {
        assert!((p / e - 0.3).abs() < 1e-9, "{p} at {e}");
    }
}

/// Columns without names, between any number of blanks; stress comes first.
#[test]
fn reads_a_table_without_names() {
    let test = test_of(
        "delimiter = \" \"\nnames_line = 0\nskip_lines = 1\nbranch = \"whole\"\npoints = 100\n\
         deformation = { column = \"2\", unit = \"1\", measure = \"stretch\" }\n\
         load = { column = \"1\", unit = \"MPa\" }\nrange = [0.0, 0.5]\n",
    );
    let row = |i: i32| {
        format!(
            "   {:.4} \t {:.3}\n",
            -0.002 * f64::from(i),
            1.0 - 0.02 * f64::from(i)
        )
    };
    let table: String = (1..=20).map(row).collect();
    let curve = read_curve(&test, format!("made up\n{table}").as_bytes(), None).unwrap();
    assert_eq!(curve.strain.len(), 20);
    assert!((curve.strain[4] + 0.1).abs() < 1e-12 && (curve.stress[4] + 0.01).abs() < 1e-12);
    let wide = test_of(
        "delimiter = \" \"\nnames_line = 0\ndeformation = { column = \"3\", unit = \"1\" }\n\
         load = { column = \"1\", unit = \"MPa\" }\nrange = [0.0, 0.5]\n",
    );
    let error = read_curve(&wide, table.as_bytes(), None).unwrap_err().to_string();
    assert!(
        error.contains("no column \"3\"; it has [\"1\", \"2\"]"),
        "{error}"
    );
}

#[test]
fn names_file_line_and_column() {
    let test = test_of(GAP);
    let message = |text: &str| read_curve(&test, text.as_bytes(), None).unwrap_err().to_string();
    let good = two_cycles();
    let broken: String = good
        .lines()
        .enumerate()
        .map(|(i, l)| {
            if i == 6 {
                "0,9000,NaN\n".into()
            } else {
                format!("{l}\n")
            }
        })
        .collect();
    assert_eq!(
        message(&broken),
        "f.csv, line 7, column \"force\": \"NaN\" is not a finite number"
    );
    assert!(message(&good.replace("force", "load")).contains("line 1: no column \"force\""));
    assert!(message("time,gap,force\n0,10000,0\n").contains("1 points in the file"));
    assert!(message(&good.replace(',', ";")).contains("no column"));
    let upwards: String = (0..100).map(|i| format!("0,{},{i}\n", 10_000 + 50 * i)).collect();
    assert!(message(&format!("time,gap,force\n{upwards}")).contains("negative in compression"));
    // Millimetres that are read as micrometres squeeze the specimen flat: plausible in strain, caught in stress.
    let pulled: String = (0..100)
        .map(|i| format!("0,{},{}\n", 10_000 - 50 * i, -i))
        .collect();
    assert!(message(&format!("time,gap,force\n{pulled}")).contains("of the sign of strain"));
    let mega: String = (0..100)
        .map(|i| format!("0,{},{}\n", 10_000 - 50 * i, 1000 * i))
        .collect();
    assert!(message(&format!("time,gap,force\n{mega}")).contains("is the unit right?"));
}

#[test]
fn refuses_a_branch_that_goes_back() {
    let mut text = String::from("time,gap,force\n");
    for i in 0..=200 {
        // A dip of 10 % of the way in the middle, too small for a cycle of its own.
        let way = f64::from(i) / 200.0;
        let strain = 0.5 * (way - 0.2 * (-((way - 0.5) / 0.02).powi(2)).exp());
        text += &format!("0,{},{}\n", 10_000.0 * (1.0 - strain), 10.0 * strain);
    }
    let error = read_curve(&test_of(GAP), text.as_bytes(), None).unwrap_err();
    assert!(matches!(error, CurveError::Backwards { .. }), "{error}");
}

#[test]
fn a_coupon_names_the_field_that_is_wrong() {
    let text = std::fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/materials-db/coupons/sole-heel-foam.toml"
    ))
    .unwrap();
    let parse = |from: &str, to: &str| {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from} is not in the file");
        CouponFile::parse(&changed, Path::new("c.toml"))
    };
    let line = 1 + text.lines().position(|l| l.starts_with("range")).unwrap();
    let error = parse("range = [0.0, 0.6]", "range = [0.0, 60.0]")
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with(&format!("c.toml, line {line}: tests[0].range = [0.0, 60.0]")),
        "{error}"
    );
    let error = parse("unit = \"um\"", "unit = \"inch\"").unwrap_err().to_string();
    assert!(error.contains("tests[0].deformation.unit = \"inch\""), "{error}");
    let error = parse("height_mm", "hight_mm").unwrap_err().to_string();
    assert!(error.contains("tests[0].height_mm = missing"), "{error}");
    let error = parse("schema = 1", "schema = 2").unwrap_err().to_string();
    assert!(error.contains("line 2: schema = 2: expected 1"), "{error}");
    let unknown = parse("cycle = 2", "cycle = 2\nwether = 1").unwrap().1;
    assert_eq!(unknown.len(), 1);
    assert_eq!(unknown[0].field, "tests[0].wether");
}
