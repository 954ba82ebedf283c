//! Records never change: other content is another version, and the one before stays as it was.

use super::commands::pliant;
use super::{as_first, database, text_of};
use pliant::design::goal::Goal;
use pliant::material::database::Database;
use pliant::material::hyperelastic::{Form, Hyperelastic};
use pliant::material::law::Law;
use pliant::material::put::Change;
use pliant::material::record::{MaterialRecord, Model, Uncertainty};
use pliant::material::versions::sha256;
use pliant::math::mandel::Mandel;
use std::path::Path;

fn foam() -> MaterialRecord {
    let mut record = database().find("leap-foam").unwrap().clone();
    // The recipe lies in the shipped folder alone.
    record.recipe = None;
    record
}

fn with_density(density: f64) -> MaterialRecord {
    MaterialRecord {
        density_g_per_cm3: density,
        ..foam()
    }
}

fn findings(folder: &Path) -> Vec<String> {
    let database = Database::open(folder).unwrap();
    let broken = database.broken().iter().map(ToString::to_string);
    let checked = database.check();
    let found = checked
        .iter()
        .flat_map(|(_, findings)| findings.iter().map(|f| format!("{}: {}", f.field, f.message)));
    broken.chain(found).collect()
}

#[test]
fn other_content_is_another_version() {
    let folder = tempfile::tempdir().unwrap();
    let put = |record: &MaterialRecord| Database::put(folder.path(), record).unwrap();
    let first = put(&with_density(0.1));
    let bytes = std::fs::read(&first.file).unwrap();
    assert_eq!((first.version, first.change), (1, Change::First));
    assert_eq!(put(&with_density(0.1)).change, Change::Same);
    let second = put(&with_density(0.2));
    assert_eq!((second.version, second.change), (2, Change::Revised));
    // The version that the caller holds does not count.
    let third = put(&MaterialRecord {
        version: 9,
        ..with_density(0.3)
    });
    assert_eq!(third.version, 3);
    assert_eq!(
        std::fs::read(folder.path().join("versions/leap-foam@1.toml")).unwrap(),
        bytes
    );

    let database = Database::open(folder.path()).unwrap();
    for (name, density) in [
        ("leap-foam@1", 0.1),
        ("leap-foam@2", 0.2),
        ("leap-foam@3", 0.3),
        ("leap-foam", 0.3),
    ] {
        assert_eq!(database.find(name).unwrap().density_g_per_cm3, density, "{name}");
    }
    let versions: Vec<u32> = database
        .history("leap-foam")
        .iter()
        .map(|e| e.record.version)
        .collect();
    assert_eq!(versions, [1, 2, 3]);
    let second = database.find("leap-foam@2").unwrap();
    assert_eq!(
        second.previous_sha256,
        Some(sha256(&String::from_utf8(bytes).unwrap()))
    );
    for (name, hint) in [
        ("leap-foam@4", "version 1, 2, 3"),
        ("leap-foam@x", "ID@2"),
        ("leap@1", "near it"),
    ] {
        let error = database.find(name).unwrap_err().to_string();
        assert!(error.contains(hint), "{error}");
    }
    assert_eq!(findings(folder.path()), Vec::<String>::new());
    let (code, out, _) = pliant(&[
        "db",
        "show",
        "leap-foam@2",
        "--db",
        &folder.path().to_string_lossy(),
    ]);
    assert!(
        code == 0 && out.contains("2 of 3: not the newest") && out.contains("0.2 g/cm³"),
        "{out}"
    );
}

/// Each kind of damage to the older versions is found out.
#[test]
fn older_versions_must_be_there_as_they_were() {
    let made = || {
        let folder = tempfile::tempdir().unwrap();
        for density in [0.1, 0.2, 0.3] {
            Database::put(folder.path(), &with_density(density)).unwrap();
        }
        folder
    };
    let damage = |what: &dyn Fn(&Path), expected: &str| {
        let folder = made();
        what(folder.path());
        let found = findings(folder.path());
        assert!(
            found.iter().any(|f| f.contains(expected)),
            "{expected}: {found:?}"
        );
        let (code, ..) = pliant(&["db", "check", "--db", &folder.path().to_string_lossy()]);
        assert_eq!(code, 1);
    };
    let version = |folder: &Path, n: u32| folder.join(format!("versions/leap-foam@{n}.toml"));
    let edit = |file: &Path, from: &str, to: &str| {
        let text = std::fs::read_to_string(file).unwrap();
        assert!(text.contains(from), "{text}");
        std::fs::write(file, text.replace(from, to)).unwrap();
    };
    damage(
        &|f| std::fs::remove_file(version(f, 1)).unwrap(),
        "not there or broken",
    );
    damage(
        &|f| edit(&version(f, 1), "= 0.1\n", "= 0.15\n"),
        "changed after it was written",
    );
    damage(
        &|f| edit(&version(f, 2), "midsole", "middle"),
        "changed after it was written",
    );
    damage(
        &|f| std::fs::remove_file(f.join("leap-foam.toml")).unwrap(),
        "expected leap-foam.toml",
    );
    damage(
        &|f| edit(&version(f, 1), "version = 1", "version = 4"),
        "what the file's name says",
    );
    damage(
        &|f| std::fs::rename(version(f, 1), f.join("versions/leap.toml")).unwrap(),
        "what the file's name says",
    );
    let newer = |f: &Path| {
        let text = std::fs::read_to_string(f.join("leap-foam.toml")).unwrap();
        std::fs::write(version(f, 7), text.replace("version = 3", "version = 7")).unwrap();
    };
    damage(&newer, "expected less than the 3");
    let none = |f: &Path| {
        let file = f.join("leap-foam.toml");
        let text = std::fs::read_to_string(&file).unwrap();
        let kept: Vec<&str> = text
            .lines()
            .filter(|l| !l.starts_with("previous_sha256"))
            .collect();
        std::fs::write(file, kept.join("\n")).unwrap();
    };
    damage(&none, "SHA-256 of version 2");
    damage(
        &|f| edit(&f.join("leap-foam.toml"), "id =", "recipe = \"../x.toml\"\nid ="),
        "from which the record was fitted",
    );
}

/// A writer that was killed after its first step, and one whose newest record was edited in place.
#[test]
fn a_cut_off_write_is_taken_up_and_an_edit_in_place_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let put = Database::put(folder.path(), &with_density(0.1)).unwrap();
    let kept = folder.path().join("versions/leap-foam@1.toml");
    std::fs::create_dir(folder.path().join("versions")).unwrap();
    std::fs::copy(&put.file, &kept).unwrap();
    assert_eq!(findings(folder.path()), Vec::<String>::new());
    let text = std::fs::read_to_string(&put.file).unwrap();
    std::fs::write(&put.file, text.replace("= 0.1\n", "= 0.15\n")).unwrap();
    assert!(findings(folder.path())[0].contains("holds something else"));
    let error = Database::put(folder.path(), &with_density(0.2))
        .unwrap_err()
        .to_string();
    assert!(error.contains("version 1 too"), "{error}");
    std::fs::write(&put.file, text).unwrap();
    assert_eq!(
        Database::put(folder.path(), &with_density(0.2)).unwrap().version,
        2
    );
    // The newest taken away: the next one goes on counting.
    std::fs::remove_file(&put.file).unwrap();
    assert_eq!(
        Database::put(folder.path(), &with_density(0.3)).unwrap().version,
        2
    );
    assert_eq!(
        Database::open(folder.path())
            .unwrap()
            .find("leap-foam@1")
            .unwrap()
            .density_g_per_cm3,
        0.1
    );
}

#[test]
fn unknown_fields_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().join("db");
    let file = folder.path().join("any-name.toml");
    let own = text_of("leap-foam")
        .replace("recipe = \"coupons/leap-foam.toml\"\n", "")
        .replace("name =", "smell = \"fresh\"\nname =")
        .replace("[printability]", "[printability]\ntemperature_c = 200.5")
        .replace(
            "test = \"simple-shear\"",
            "test = \"simple-shear\"\noperator = \"M\"",
        );
    std::fs::write(&file, &own).unwrap();
    let add = || {
        pliant(&[
            "db",
            "add",
            &file.to_string_lossy(),
            "--db",
            &db.to_string_lossy(),
        ])
    };
    let (code, out, err) = add();
    assert!(code == 0 && out.contains("version 1"), "{out}{err}");
    for field in ["smell", "printability.temperature_c", "measurements[2].operator"] {
        assert!(err.contains(field), "{err}");
    }
    let text = || std::fs::read_to_string(db.join("leap-foam.toml")).unwrap();
    let has = |words: &[&str]| words.iter().all(|w| text().contains(w));
    assert!(
        has(&["smell = \"fresh\"", "temperature_c = 200.5", "operator = \"M\""]),
        "{}",
        text()
    );
    assert!(add().1.contains("nothing was written"));
    // Another unknown value alone is other content.
    std::fs::write(&file, own.replace("fresh", "stale")).unwrap();
    assert!(add().1.contains("version 2"));
    // A new fit knows nothing of them; those outside lists stay.
    let put = Database::put(&db, &with_density(0.25)).unwrap();
    assert_eq!(put.version, 3);
    assert!(
        has(&[
            "smell = \"stale\"",
            "temperature_c = 200.5",
            "density_g_per_cm3 = 0.25"
        ]),
        "{}",
        text()
    );
    assert_eq!(
        Database::put(&db, &with_density(0.25)).unwrap().change,
        Change::Same
    );
    assert_eq!(findings(&db), Vec::<String>::new());
}

#[test]
fn add_refuses_what_is_unsound() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().join("db");
    let good = folder.path().join("good.toml");
    let bad = folder.path().join("bad.toml");
    std::fs::write(&good, text_of("rtv615")).unwrap();
    let spoilt = text_of("leap-foam").replace("density_g_per_cm3 = 0.1", "density_g_per_cm3 = 100.0");
    std::fs::write(&bad, &spoilt).unwrap();
    let add = |files: &[&Path]| {
        let mut arguments = vec![
            "db".to_string(),
            "add".into(),
            "--db".into(),
            db.to_string_lossy().into_owned(),
        ];
        arguments.extend(files.iter().map(|f| f.to_string_lossy().into_owned()));
        pliant(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let line = 1 + spoilt.lines().position(|l| l.starts_with("density")).unwrap();
    let (code, _, err) = add(&[&good, &bad]);
    assert!(
        code == 1 && err.contains(&format!("bad.toml, line {line}: density_g_per_cm3")),
        "{err}"
    );
    assert!(!db.exists(), "nothing of the two was added");
    std::fs::write(&bad, "schema = 2\nversion").unwrap();
    let (code, _, err) = add(&[&bad]);
    assert!(code == 2 && err.contains("line 2"), "{err}");
    let (code, _, err) = add(&[Path::new("/nowhere.toml")]);
    assert!(code == 2 && err.contains("/nowhere.toml"), "{err}");
    // Ids that would leave the folder never get there.
    std::fs::write(
        &bad,
        text_of("rtv615").replace("id = \"rtv615\"", "id = \"../rtv615\""),
    )
    .unwrap();
    assert_eq!(add(&[&bad]).0, 1);
    let escaping = MaterialRecord {
        id: "../x".into(),
        ..foam()
    };
    assert!(
        Database::put(&db, &escaping)
            .unwrap_err()
            .to_string()
            .contains("expected lower-case")
    );
    let odd = with_density(f64::NAN);
    assert!(
        Database::put(&db, &odd)
            .unwrap_err()
            .to_string()
            .contains("finite")
    );
    assert!(!db.join("leap-foam.toml").exists());
}

#[test]
fn migrate_rewrites_what_is_old() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().to_string_lossy().into_owned();
    let now = as_first("leap-foam");
    let old = now.replace(
        "schema = 2\nversion = 1\nrecipe = \"coupons/leap-foam.toml\"\n",
        "schema = 1\nsmell = \"fresh\"\n",
    );
    let file = folder.path().join("leap-foam.toml");
    std::fs::write(&file, &old).unwrap();
    // Read as it is.
    let (code, out, err) = pliant(&["db", "check", "--db", &db]);
    assert!(code == 0 && err.contains("smell"), "{out}{err}");
    assert_eq!(
        Database::open(folder.path())
            .unwrap()
            .find("leap-foam@1")
            .unwrap()
            .version,
        1
    );
    std::fs::create_dir(folder.path().join("coupons")).unwrap();
    std::fs::write(folder.path().join("coupons/leap-foam.toml"), "").unwrap();
    let (code, out, err) = pliant(&["db", "migrate", "--db", &db]);
    assert!(
        code == 0 && out.contains("1 records rewritten") && err.contains("smell"),
        "{out}{err}"
    );
    let expected = now.replace(
        "coupons/leap-foam.toml\"\n",
        "coupons/leap-foam.toml\"\nsmell = \"fresh\"\n",
    );
    assert_eq!(std::fs::read_to_string(&file).unwrap(), expected);
    assert!(
        pliant(&["db", "migrate", "--db", &db])
            .1
            .contains("nothing was written")
    );
    // One that can't be read: none is rewritten.
    std::fs::write(&file, &old).unwrap();
    std::fs::write(folder.path().join("other.toml"), "schema = 1").unwrap();
    let (code, _, err) = pliant(&["db", "migrate", "--db", &db]);
    assert!(code == 2 && err.contains("other.toml"), "{err}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), old);
}

/// A covariance must fit the law.
#[test]
fn uncertainties_are_checked() {
    let good = foam();
    let names: Vec<String> = good
        .law()
        .unwrap()
        .parameters()
        .iter()
        .take(2)
        .map(|p| p.name.clone())
        .collect();
    let with = |parameters: Vec<String>, covariance: Vec<Vec<f64>>| MaterialRecord {
        uncertainty: Some(Uncertainty {
            parameters,
            covariance,
            basis: "residuals".into(),
        }),
        ..foam()
    };
    let found = |record: &MaterialRecord| -> Vec<String> {
        let text = record.to_toml().unwrap();
        match MaterialRecord::parse(&text, Path::new("leap-foam.toml")) {
            Err(error) => vec![error.to_string()],
            Ok((again, _)) => pliant::material::check::check(&again, &text)
                .iter()
                .map(|f| f.message.clone())
                .collect(),
        }
    };
    assert_eq!(
        found(&with(names.clone(), vec![vec![4e-4, 1e-4], vec![1e-4, 1e-2]])),
        Vec::<String>::new()
    );
    assert_eq!(
        with(names.clone(), vec![vec![4e-4, 0.0], vec![0.0, 1e-2]])
            .uncertainty
            .unwrap()
            .deviations(),
        [0.02, 0.1]
    );
    for (record, expected) in [
        (with(names.clone(), vec![vec![1.0, 0.0]]), "2 rows of 2"),
        (
            with(names.clone(), vec![vec![1.0, 0.5], vec![0.0, 1.0]]),
            "symmetric",
        ),
        (
            with(names.clone(), vec![vec![1.0, 2.0], vec![2.0, 1.0]]),
            "negative",
        ),
        (
            with(names.clone(), vec![vec![f64::NAN, 0.0], vec![0.0, 1.0]]),
            "finite",
        ),
        (
            with(vec!["ln shear modulus at centre 99".into()], vec![vec![1.0]]),
            "no parameter of the law",
        ),
        (
            with(
                vec![names[1].clone(), names[0].clone()],
                vec![vec![1.0, 0.0], vec![0.0, 1.0]],
            ),
            "order",
        ),
    ] {
        let found = found(&record);
        assert!(
            found.iter().any(|f| f.contains(expected)),
            "{expected}: {found:?}"
        );
    }
}

/// Palettes and scenes take versions; two of one material are two materials.
#[test]
fn designs_and_scenes_name_versions() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().join("db");
    let firm = |shear_mpa: f64| {
        let form = Form::NeoHookeanIsochoric {
            shear_mpa,
            bulk_mpa: 2.0,
        };
        let law = Law::Hyperelastic(Hyperelastic::new(form).unwrap());
        let model = Model::of(&law, [-0.5, 0.5]).unwrap();
        MaterialRecord { model, ..foam() }
    };
    for shear in [0.1, 0.2] {
        Database::put(&db, &firm(shear)).unwrap();
    }
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/block");
    let goal = std::fs::read_to_string(shipped.join("goal.toml")).unwrap();
    let (start, end) = (
        goal.find("materials = [").unwrap(),
        goal.find("]\n\n[[example]]").unwrap(),
    );
    std::fs::copy(shipped.join("block.stl"), folder.path().join("block.stl")).unwrap();
    std::fs::create_dir(folder.path().join("original")).unwrap();
    std::fs::copy(
        shipped.join("original/middle.csv"),
        folder.path().join("original/middle.csv"),
    )
    .unwrap();
    let file = folder.path().join("goal.toml");
    let read = |materials: &str| {
        std::fs::write(
            &file,
            format!("{}materials = [{materials}{}", &goal[..start], &goal[end..]),
        )
        .unwrap();
        Goal::read(&file, &Database::open(&db).unwrap())
    };
    let palette = read("\"leap-foam@1\", \"leap-foam\"").unwrap().palette;
    let ids: Vec<&str> = palette.iter().map(|m| m.record.id.as_str()).collect();
    assert_eq!(ids, ["leap-foam@1", "leap-foam"]);
    let young = |law: &Law| law.young_modulus(&Mandel::zeros());
    assert!(young(&palette[1].law) > 1.8 * young(&palette[0].law));
    let twice = read("\"leap-foam@2\", \"leap-foam\"").unwrap_err().to_string();
    assert!(twice.contains("stands twice"), "{twice}");

    // Two cubes side by side, one of each version.
    let cube = |name: &str, x: f64, material: &str| {
        format!(
            "[[region]]\nname = \"{name}\"\nbox_mm = [[{x}, -1, -1], [{}, 11, 11]]\nmaterial = \"{material}\"\n",
            x + 12.0
        )
    };
    let mut nodes = Vec::new();
    for start in [0, 20] {
        for (x, y, z) in [
            (0, 0, 0),
            (10, 0, 0),
            (10, 10, 0),
            (0, 10, 0),
            (0, 0, 10),
            (10, 0, 10),
            (10, 10, 10),
            (0, 10, 10),
        ] {
            nodes.push(format!("[{}, {y}, {z}]", start + x));
        }
    }
    let plane = |name: &str, components: &str, z: f64| {
        format!(
            "[[set]]\nname = \"{name}\"\nbox_mm = [[-1, -1, {}], [31, 11, {}]]\n[[fixed]]\nset = \"{name}\"\ncomponents = \"{components}\"\n",
            z - 0.1,
            z + 0.1
        )
    };
    let scene = format!(
        "schema = 1\n[mesh]\nnodes_mm = [{}]\nhexahedra = [[0,1,2,3,4,5,6,7], [8,9,10,11,12,13,14,15]]\n\
         [[set]]\nname = \"top\"\nbox_mm = [[-1, -1, 9.9], [31, 11, 10.1]]\n{}{}{}\
         [[load]]\nname = \"press\"\n[[load.move]]\nset = \"top\"\ndisplacement_mm = {{ z = -1 }}\n",
        nodes.join(", "),
        cube("old", -1.0, "leap-foam@1"),
        cube("new", 19.0, "leap-foam"),
        plane("floor", "xyz", 0.0),
    );
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, scene).unwrap();
    let database = db.to_string_lossy().into_owned();
    let (code, out, err) = pliant(&["simulate", &file.to_string_lossy(), "--db", &database, "--json"]);
    assert_eq!(code, 0, "{out}{err}");
    let value: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        value["materials"],
        serde_json::json!(["leap-foam@1", "leap-foam"]),
        "{value}"
    );
}
