//! What a curator asks: list, show, compare, diff, refit, export, page.

use super::commands::pliant;
use super::{as_first, database, text_of};
use pliant::material::check::check;
use pliant::material::database::Database;
use pliant::material::difference::Difference;
use pliant::material::homogeneous::{uniaxial, uniaxial_by_parameters};
use pliant::material::hyperelastic::{FoamTerm, Form, Hyperelastic};
use pliant::material::law::Law;
use pliant::material::record::{MaterialRecord, Model, Uncertainty};
use pliant::report::database_curve::{MaterialCurve, deviation};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::Value;
use std::path::Path;
use std::process::Command;

const DATABASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/materials-db");
const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data");

fn json(arguments: &[&str]) -> Value {
    let (code, out, err) = pliant(&[arguments, &["--json"]].concat());
    assert_eq!(code, 0, "{out}{err}");
    serde_json::from_str(&out).unwrap()
}

fn ids(arguments: &[&str]) -> Vec<String> {
    let list = json(&[&["db", "list", "--db", DATABASE], arguments].concat());
    list.as_array()
        .unwrap()
        .iter()
        .map(|r| r["id"].as_str().unwrap().to_string())
        .collect()
}

/// The shipped records in a folder of their own, without recipes.
fn copy() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for id in ["rtv615", "leap-foam"] {
        let text = as_first(id).replace(&format!("recipe = \"coupons/{id}.toml\"\n"), "");
        std::fs::write(folder.path().join(format!("{id}.toml")), text).unwrap();
    }
    folder
}

fn path(folder: &tempfile::TempDir) -> String {
    folder.path().to_string_lossy().into_owned()
}

#[test]
fn list_filters_and_sorts() {
    let all = ids(&[]);
    assert_eq!(all.len(), database().entries().len());
    let law = |id: &String| database().find(id).unwrap().law().unwrap();
    let young = |id: &String| law(id).young_modulus(&pliant::math::mandel::Mandel::zeros());
    let soft = ids(&["--stiffness", "100 kPa..0.3 MPa"]);
    assert!(!soft.is_empty() && soft.iter().all(|id| (0.1..=0.3).contains(&young(id))));
    let rest = ids(&["--stiffness", "..100 kPa"]).len() + ids(&["--stiffness", "0.3 MPa.."]).len();
    assert_eq!(soft.len() + rest, all.len(), "no modulus lies on a border");
    let rising = ids(&["--sort", "stiffness"]);
    assert!(rising.windows(2).all(|pair| young(&pair[0]) <= young(&pair[1])));
    let by_error = ids(&["--sort", "error"]);
    let error = |id: &String| {
        database()
            .find(id)
            .unwrap()
            .relative_rms()
            .unwrap_or(f64::INFINITY)
    };
    assert!(by_error.windows(2).all(|pair| error(&pair[0]) <= error(&pair[1])));
    let density = |id: &String| database().find(id).unwrap().density_g_per_cm3;
    assert!(
        ids(&["--sort", "density"])
            .windows(2)
            .all(|pair| density(&pair[0]) <= density(&pair[1]))
    );
    for (arguments, holds) in [
        (
            &["--kind", "isotropic"][..],
            &(|r: &MaterialRecord| r.kind.word() == "isotropic") as &dyn Fn(&MaterialRecord) -> bool,
        ),
        (&["--synthetic"], &|r| r.synthetic),
        (&["--measured"], &|r| !r.synthetic),
        (&["--printable"], &|r| r.printability.printable),
        (&["--printer", "CAST silicone"], &|r| {
            r.printability.process.contains("cast silicone")
        }),
        (&["--source", "marechal"], &|r| {
            r.source.citation.contains("Marechal")
        }),
    ] {
        let expected: Vec<String> = database()
            .records()
            .filter(|r| holds(r))
            .map(|r| r.id.clone())
            .collect();
        assert_eq!(ids(arguments), expected, "{arguments:?}");
    }
    let (code, out, _) = pliant(&["db", "list", "--db", DATABASE, "--source", "nobody at all"]);
    assert!(code == 0 && out.contains("no material is like that"), "{out}");
    for wrong in ["1..2", "2 MPa..1 MPa", "1 MPa"] {
        let (code, _, err) = pliant(&["db", "list", "--db", DATABASE, "--stiffness", wrong]);
        assert!(code == 2 && err.contains("--stiffness"), "{err}");
    }
}

#[test]
fn show_and_compare_draw() {
    let folder = tempfile::tempdir().unwrap();
    let svg = folder.path().join("plot.svg");
    let file = svg.to_string_lossy().into_owned();
    let (code, out, err) = pliant(&["db", "show", "leap-foam", "--db", DATABASE, "--svg", &file]);
    assert!(
        code == 0 && out.contains("extrapolated") && out.contains("coupons/leap-foam.toml"),
        "{out}{err}"
    );
    let plot: Vec<&str> = out
        .lines()
        .skip_while(|l| !l.starts_with("nominal stress"))
        .collect();
    assert!(
        plot.len() > 18 && plot[..18].iter().all(|l| l.is_ascii() && l.len() <= 80),
        "{out}"
    );
    let drawn = std::fs::read_to_string(&svg).unwrap();
    assert!(
        drawn.starts_with("<svg")
            && drawn.contains("engineering strain [%]")
            && drawn.contains("stroke-dasharray")
    );
    let value = json(&["db", "show", "leap-foam", "--db", DATABASE]);
    let point = &value["uniaxial"][0];
    let law = database().find("leap-foam").unwrap().law().unwrap();
    let state = uniaxial(&law, point["strain"].as_f64().unwrap());
    assert!((state.stress - point["stress_mpa"].as_f64().unwrap()).abs() < 1e-12);

    let names = ["leap-foam", "ecoflex-00-30", "rtv615"];
    let compare = [&["db", "compare", "--db", DATABASE, "--svg", &file], &names[..]].concat();
    let (code, out, _) = pliant(&compare);
    assert!(code == 0 && out.contains("stress at -30 % [MPa]"), "{out}");
    let drawn = std::fs::read_to_string(&svg).unwrap();
    assert!(names.iter().all(|n| out.contains(n) && drawn.contains(n)));
    // EcoFlex was pressed alone: what it does when pulled is in brackets.
    let line = out.lines().find(|l| l.contains("stress at +30 %")).unwrap();
    assert_eq!(line.matches('(').count(), 2, "{line}");
    let (code, _, err) = pliant(&["db", "compare", "leap-foam", "--db", DATABASE]);
    assert!(code == 2 && err.contains("2"), "{err}");
    let (code, _, err) = pliant(&["db", "compare", "leap-foam", "leap-form", "--db", DATABASE]);
    assert!(code == 2 && err.contains("near it"), "{err}");
}

/// The band is two standard deviations: of one parameter s the curve moves by s ∂P/∂p, here by a difference.
#[test]
fn the_band_follows_from_the_covariance() {
    let mut record = database().find("rtv615").unwrap().clone();
    let law = record.law().unwrap();
    let parameters = law.parameters();
    // The two that the curve feels most at this strain.
    let slopes = uniaxial_by_parameters(&law, &uniaxial(&law, 0.4));
    let mut order: Vec<usize> = (0..slopes.len()).collect();
    order.sort_by(|a, b| slopes[*b].abs().total_cmp(&slopes[*a].abs()));
    let (first, second) = (order[0].min(order[1]), order[0].max(order[1]));
    record.uncertainty = Some(Uncertainty {
        parameters: vec![parameters[first].name.clone(), parameters[second].name.clone()],
        covariance: vec![vec![1e-4, 0.5e-4], vec![0.5e-4, 4e-4]],
        basis: "residuals".into(),
    });
    let axial = 0.4;
    let slope = |i: usize| {
        let at = |step: f64| {
            let mut values: Vec<f64> = parameters.iter().map(|p| p.value).collect();
            values[i] += step;
            uniaxial(&law.with_parameters(&values).unwrap(), axial).stress
        };
        (at(1e-5) - at(-1e-5)) / 2e-5
    };
    let (a, b) = (slope(first), slope(second));
    let expected = (1e-4 * a * a + 2.0 * 0.5e-4 * a * b + 4e-4 * b * b).sqrt();
    let found = deviation(&record, &law, axial).unwrap();
    assert!(
        expected > 1e-5 && (found / expected - 1.0).abs() < 1e-5,
        "{found} and {expected}"
    );
    let curve = MaterialCurve::of(&record, &law);
    assert_eq!(curve.band.len(), curve.fitted.len());
    let (point, band) = (curve.fitted[30], curve.band[30]);
    let s = deviation(&record, &law, point[0] / 100.0).unwrap();
    assert!((band[1] - band[0] - 4.0 * s).abs() < 1e-12 && (band[1] - point[1] - 2.0 * s).abs() < 1e-12);
}

fn stiffer(record: &MaterialRecord, factor: f64) -> MaterialRecord {
    let law = record.law().unwrap();
    let values: Vec<f64> = law
        .parameters()
        .iter()
        .map(|p| p.value + f64::ln(factor))
        .collect();
    let model = Model::of(
        &law.with_parameters(&values).unwrap(),
        record.model.range.engineering_strain,
    )
    .unwrap();
    MaterialRecord {
        model,
        ..record.clone()
    }
}

#[test]
fn diff_tells_by_how_much_a_record_moved() {
    let folder = copy();
    let db = path(&folder);
    let before = database().find("rtv615").unwrap().clone();
    let mut after = stiffer(&before, 1.05);
    after.recipe = None;
    after.density_g_per_cm3 = 1.5;
    Database::put(folder.path(), &after).unwrap();
    for names in [
        &["rtv615"][..],
        &["rtv615@1", "rtv615"],
        &["rtv615@1", "rtv615@2"],
    ] {
        let (code, out, err) = pliant(&[&["db", "diff", "--db", &db], names].concat());
        assert_eq!(code, 0, "{err}");
        assert!(
            out.contains("rtv615@1 to rtv615@2") && out.contains("moved by 5.0 %"),
            "{out}"
        );
        assert!(
            out.contains("density_g_per_cm3") && out.contains("to 1.5"),
            "{out}"
        );
        assert!(out.contains("ln MPa (+4.88e-2)"), "{out}");
    }
    let value = json(&["db", "diff", "rtv615", "--db", &db]);
    assert!((value["curve"]["relative_rms"].as_f64().unwrap() - 0.05).abs() < 1e-6);
    let (code, _, err) = pliant(&["db", "diff", "leap-foam", "--db", &db]);
    assert!(code == 2 && err.contains("no version before it"), "{err}");
    let (code, _, err) = pliant(&["db", "diff", "--db", &db]);
    assert!(code == 2 && err.contains("--against"), "{err}");
}

/// Against a copy, and against a commit, where git is there.
#[test]
fn diff_with_another_revision() {
    let (old, new) = (copy(), copy());
    let db = path(&new);
    let against = |revision: &[&str]| pliant(&[&["db", "diff", "--db", &db], revision].concat());
    let older = path(&old);
    let (code, out, _) = against(&["--against", &older]);
    assert!(
        code == 0 && out.contains("0 records changed or new, 2 the same"),
        "{out}"
    );
    let git = |arguments: &[&str]| {
        let mut command = Command::new("git");
        command
            .arg("-C")
            .arg(new.path())
            .args(["-c", "user.name=a", "-c", "user.email=a@b"])
            .args(arguments);
        command.output().is_ok_and(|o| o.status.success())
    };
    let versioned = git(&["init", "-q"]) && git(&["add", "."]) && git(&["commit", "-qm", "first"]);
    let mut after = stiffer(database().find("rtv615").unwrap(), 1.02);
    after.recipe = None;
    Database::put(new.path(), &after).unwrap();
    let mut third = after.clone();
    third.id = "another".into();
    Database::put(new.path(), &third).unwrap();
    let both: Vec<Vec<&str>> = match versioned {
        true => vec![vec!["--against", &older], vec!["--revision", "HEAD"]],
        false => {
            println!("skipped a part: git is not there");
            vec![vec!["--against", &older]]
        }
    };
    for revision in &both {
        let (code, out, err) = against(revision);
        assert!(code == 0 && out.contains("another: new, version 1"), "{out}{err}");
        assert!(
            out.contains("rtv615: version 1 to 2") && out.contains("moved by 2.0 %"),
            "{out}"
        );
        assert!(out.contains("2 records changed or new, 1 the same"), "{out}");
        let (_, out, _) = against(&[revision, &["leap-foam"][..]].concat());
        assert!(out.contains("0 records changed or new, 1 the same"), "{out}");
    }
    // In place, without a version; and a version that is gone.
    let foam = new.path().join("leap-foam.toml");
    let text = std::fs::read_to_string(&foam).unwrap();
    std::fs::write(&foam, text.replace("midsole", "middle")).unwrap();
    let (code, out, _) = against(&both[both.len() - 1]);
    assert!(
        code == 1 && out.contains("leap-foam: changed, but both are version 1"),
        "{out}"
    );
    std::fs::remove_file(new.path().join("versions/rtv615@1.toml")).unwrap();
    let (code, out, _) = against(&both[both.len() - 1]);
    assert!(code == 1 && out.contains("rtv615@1: no longer there"), "{out}");
    if versioned {
        for wrong in ["--output=x", "no-such-branch"] {
            let (code, _, err) = against(&[&format!("--revision={wrong}")]);
            assert!(code == 2 && err.contains(wrong), "{err}");
        }
    }
}

#[test]
fn refit_says_what_is_missing_and_how_far_it_moved() {
    let folder = copy();
    let db = path(&folder);
    let refit = |arguments: &[&str]| pliant(&[&["db", "refit", "--db", &db], arguments].concat());
    let (code, _, err) = refit(&["rtv615"]);
    assert!(
        code == 2 && err.contains("does not say what it was fitted from"),
        "{err}"
    );
    // With its recipe, but without measurements.
    let recipe = "coupons/sole-heel-foam.toml";
    std::fs::create_dir(folder.path().join("coupons")).unwrap();
    std::fs::copy(Path::new(DATABASE).join(recipe), folder.path().join(recipe)).unwrap();
    std::fs::write(
        folder.path().join("sole-heel-foam.toml"),
        as_first("sole-heel-foam"),
    )
    .unwrap();
    let (code, _, err) = refit(&["sole-heel-foam"]);
    assert!(
        code == 2 && err.contains("--data") && err.contains(".csv"),
        "{err}"
    );
    // Estimates need none.
    let tubes = "tubes-fine-open";
    if database()
        .find(tubes)
        .is_ok_and(|r| r.recipe.as_deref().is_some_and(|r| r.starts_with("coupons/")))
    {
        let (code, out, err) = pliant(&["db", "refit", tubes, "--db", DATABASE]);
        assert!(
            code == 0 && out.contains("nothing changed") && out.contains("--write"),
            "{out}{err}"
        );
    }
    if !Path::new(DATA).is_dir() {
        println!("skipped the rest: no measurements at {DATA}");
        return;
    }
    let (code, out, err) = refit(&["sole-heel-foam", "--data", DATA]);
    assert!(code == 0 && out.contains("errors now"), "{out}{err}");
    assert!(!folder.path().join("versions").exists(), "nothing was written");
    // A stiffer record in its place: the fit goes back, by 1 − 1/1.1, and becomes another version.
    let mut other = stiffer(&database().find("sole-heel-foam").unwrap().clone(), 1.1);
    other.recipe = Some(recipe.into());
    Database::put(folder.path(), &other).unwrap();
    let value = json(&[
        "db",
        "refit",
        "sole-heel-foam",
        "--data",
        DATA,
        "--write",
        "--db",
        &db,
    ]);
    let moved = value["curve"]["relative_rms"].as_f64().unwrap();
    assert!((moved - (1.0 - 1.0 / 1.1)).abs() < 1e-3, "{moved}");
    assert_eq!(value["written"]["version"], 3);
    let database = Database::open(folder.path()).unwrap();
    assert_eq!(database.history("sole-heel-foam").len(), 3);
    assert!(database.check().iter().all(|(_, findings)| findings.is_empty()));
}

#[test]
fn export_is_exact_or_says_how_near() {
    let folder = copy();
    let db = path(&folder);
    let export = |id: &str, arguments: &[&str]| {
        pliant(&[&["db", "export", id, "--db", &db, "--for"], arguments].concat())
    };
    // A hyperelastic record.
    let foam = Form::Hyperfoam {
        terms: vec![FoamTerm {
            shear_mpa: 0.1,
            exponent: 4.0,
            poisson: 0.1,
        }],
    };
    let mut record = database().find("leap-foam").unwrap().clone();
    (record.id, record.recipe, record.checks) = ("energy-foam".into(), None, Vec::new());
    record.model = Model::of(&Law::Hyperelastic(Hyperelastic::new(foam).unwrap()), [-0.5, 0.2]).unwrap();
    Database::put(folder.path(), &record).unwrap();
    let (code, out, err) = export("energy-foam", &["abaqus"]);
    assert!(
        code == 0 && out.contains("*HYPERFOAM, N=1\n0.1, 4.0, 0.1\n"),
        "{out}{err}"
    );
    assert!(
        out.contains("the law itself") && out.contains("*DENSITY\n1e-10"),
        "{out}"
    );
    let (code, _, err) = export("energy-foam", &["febio"]);
    assert!(
        code == 2 && err.contains("Poisson") && err.contains("--within"),
        "{err}"
    );
    // Moduli that depend on strain: only near, and only when asked.
    let (code, _, err) = export("leap-foam", &["abaqus"]);
    assert!(
        code == 2 && err.contains("moduli that depend on strain") && err.contains("--within"),
        "{err}"
    );
    let (code, _, err) = export("rtv615", &["febio", "--within", "0.001 %"]);
    assert!(code == 2 && err.contains("would take it"), "{err}");
    let (code, out, err) = export("rtv615", &["calculix", "--within", "5 %"]);
    assert!(
        code == 0 && out.contains("*HYPERELASTIC") && err.contains("error of stress"),
        "{out}{err}"
    );
    let value = json(&[
        "db", "export", "rtv615", "--for", "febio", "--within", "5 %", "--db", &db,
    ]);
    assert_eq!(value["exact"], false);
    let errors = value["errors"].as_array().unwrap();
    // Shear was not measured: it is told, and does not count.
    for e in errors {
        let fitted = e["test"] != "simple-shear";
        assert!(
            e["fitted"] == fitted && (!fitted || e["relative_rms"].as_f64().unwrap() <= 0.05),
            "{errors:?}"
        );
    }
    let (code, _, err) = pliant(&[
        "db",
        "export",
        "tubes-fine-wide",
        "--for",
        "febio",
        "--within",
        "5 %",
        "--db",
        DATABASE,
    ]);
    assert!(code == 2 && err.contains("json"), "{err}");
    // The whole record, unknown fields too.
    let file = folder.path().join("record.json");
    let (code, out, _) = export("leap-foam", &["json", "--out", &file.to_string_lossy()]);
    assert!(code == 0 && out.contains("wrote"), "{out}");
    let value: MaterialRecord = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let database = Database::open(folder.path()).unwrap();
    // Read by serde_json, which may miss the last bit of a long number.
    let difference = Difference::between(database.find("leap-foam").unwrap(), &value);
    assert!(difference.is_empty(), "{difference:?}");
    assert_eq!(
        value.checks.len(),
        database.find("leap-foam").unwrap().checks.len()
    );
    for wrong in ["0", "-3 %", "101 %", "few"] {
        assert_eq!(
            export("leap-foam", &["abaqus", &format!("--within={wrong}")]).0,
            2
        );
    }
}

/// Elements of a page, each closed as it was opened; texts of scripts and styles are passed over.
fn open_tags(html: &str) -> Vec<String> {
    const VOID: [&str; 4] = ["meta", "input", "br", "!DOCTYPE"];
    let (mut stack, mut rest) = (Vec::new(), html);
    while let Some(start) = rest.find('<') {
        let end = start + rest[start..].find('>').unwrap();
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        let name = tag
            .trim_start_matches('/')
            .split([' ', '\n', '/'])
            .next()
            .unwrap()
            .to_string();
        if tag.starts_with('/') {
            assert_eq!(stack.pop().as_ref(), Some(&name), "{tag}");
        } else if !VOID.contains(&name.as_str()) && !tag.ends_with('/') {
            if ["script", "style"].contains(&name.as_str()) {
                rest = &rest[rest.find(&format!("</{name}>")).unwrap()..];
            }
            stack.push(name);
        }
    }
    stack
}

#[test]
fn the_page_holds_everything_and_loads_nothing() {
    let folder = copy();
    let mut odd = database().find("rtv615").unwrap().clone();
    odd.recipe = None;
    odd.name = "</script><b onclick=x>&\"'".into();
    odd.source.link = Some("javascript:alert(1)".into());
    odd.colour = "red;}".into();
    Database::put(folder.path(), &odd).unwrap();
    let file = folder.path().join("page.html");
    let db = path(&folder);
    let (code, out, err) = pliant(&["db", "page", "--db", &db, "--out", &file.to_string_lossy()]);
    assert!(code == 0 && out.contains("wrote"), "{out}{err}");
    let page = std::fs::read_to_string(&file).unwrap();
    assert_eq!(open_tags(&page), Vec::<String>::new());
    assert!(!page.contains("<b onclick") && !page.contains("javascript:") && !page.contains("red;}"));
    assert!(page.contains("Version 2 after 1"), "what the versions changed");
    let (code, ..) = pliant(&["db", "page", "--db", DATABASE, "--out", &file.to_string_lossy()]);
    assert_eq!(code, 0);
    let page = std::fs::read_to_string(&file).unwrap();
    assert_eq!(open_tags(&page), Vec::<String>::new());
    let count = |what: &str| page.matches(what).count();
    let records = database().entries().len();
    assert_eq!(
        (count("<svg"), count("<article"), count("<tr data-id=")),
        (records, records, records)
    );
    for id in database().records().map(|r| &r.id) {
        assert!(
            page.contains(&format!("<article id=\"{id}\" data-id=\"{id}\"")),
            "{id}"
        );
    }
    assert_eq!(count("<script>"), 1);
    for control in ["words", "kind", "origin", "least", "most", "printable", "shown"] {
        assert!(
            page.contains(&format!("id=\"{control}\"")) && page.contains(&format!("\"{control}\"")),
            "{control}"
        );
    }
    for loaded in ["src=", "@import", "url(", "<link", "fetch(", "XMLHttpRequest"] {
        assert!(!page.contains(loaded), "{loaded}");
    }
}

/// Cut off anywhere or with a byte changed, a record is read or refused, and what is read can be checked.
#[test]
fn no_damage_to_a_record_is_a_panic() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let file = Path::new("leap-foam.toml");
    let (mut read, mut refused) = (0, 0);
    let mut look = |text: &str| match MaterialRecord::parse(text, file) {
        Ok((record, _)) => {
            check(&record, text);
            read += 1;
        }
        Err(error) => {
            assert!(error.to_string().contains("leap-foam"), "{error}");
            refused += 1;
        }
    };
    for id in ["leap-foam", "tubes-fine-wide"] {
        let good = text_of(id);
        for end in (0..good.len())
            .step_by(53)
            .filter(|end| good.is_char_boundary(*end))
        {
            look(&good[..end]);
        }
        for _ in 0..150 {
            let mut bytes = good.clone().into_bytes();
            let at = rng.gen_range(0..bytes.len());
            bytes[at] = b"0-9.e\"[]= \nanif"[rng.gen_range(0..15)];
            if let Ok(text) = String::from_utf8(bytes) {
                look(&text);
            }
        }
    }
    let text = text_of("leap-foam").replacen("shear", "", 1);
    for odd in ["nan", "inf", "-inf", "1e308", "-1e-308", "0"] {
        for field in [
            "density_g_per_cm3",
            "constant",
            "weights",
            "invariants",
            "low",
            "strain",
        ] {
            let line = text
                .lines()
                .find(|l| l.starts_with(&format!("{field} =")))
                .unwrap();
            let number = line
                .split(['[', ',', '=', ']'])
                .nth(if line.contains('[') { 2 } else { 1 })
                .unwrap()
                .trim();
            look(&text.replacen(line, &line.replacen(number, odd, 1), 1));
        }
    }
    assert!(read > 20 && refused > 100, "{read} read, {refused} refused");
}
