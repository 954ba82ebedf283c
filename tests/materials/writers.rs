//! Several processes write to one database, and some are killed.

use super::text_of;
use assert_cmd::cargo::cargo_bin;
use pliant::material::database::Database;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Files of one material with different densities.
fn records(folder: &Path, count: usize) -> Vec<PathBuf> {
    let text = text_of("rtv615").replace("recipe = \"coupons/rtv615.toml\"\n", "");
    let old = text
        .lines()
        .find(|l| l.starts_with("density_g_per_cm3"))
        .unwrap()
        .to_string();
    (0..count)
        .map(|i| {
            let file = folder.join(format!("record-{i}.toml"));
            let new = format!("density_g_per_cm3 = {}", 1.0 + 0.01 * i as f64);
            std::fs::write(&file, text.replace(&old, &new)).unwrap();
            file
        })
        .collect()
}

fn add(file: &Path, db: &Path) -> Child {
    Command::new(cargo_bin("pliant"))
        .args(["db", "add"])
        .arg(file)
        .arg("--db")
        .arg(db)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

fn sound(db: &Path) -> Database {
    let database = Database::open(db).unwrap();
    assert!(database.broken().is_empty(), "{:?}", database.broken());
    for (entry, findings) in database.check() {
        assert!(findings.is_empty(), "{}: {findings:?}", entry.file.display());
    }
    database
}

#[test]
fn writers_wait_for_one_another() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().join("db");
    let files = records(folder.path(), 12);
    let children: Vec<Child> = files.iter().map(|file| add(file, &db)).collect();
    for mut child in children {
        assert!(child.wait().unwrap().success());
    }
    let database = sound(&db);
    let history = database.history("rtv615");
    let versions: Vec<u32> = history.iter().map(|e| e.record.version).collect();
    assert_eq!(
        versions,
        (1..=12).collect::<Vec<u32>>(),
        "no version was lost or given twice"
    );
    let mut densities: Vec<f64> = history.iter().map(|e| e.record.density_g_per_cm3).collect();
    densities.sort_by(f64::total_cmp);
    densities.dedup();
    assert_eq!(densities.len(), 12);
}

/// Killed at moments spread over the whole of a write, a writer leaves the old record or the new one, and every version
/// before it.
#[test]
fn a_kill_leaves_the_old_or_the_new_record() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().join("db");
    let files = records(folder.path(), 2);
    let start = std::time::Instant::now();
    assert!(add(&files[0], &db).wait().unwrap().success());
    let whole = start.elapsed().max(Duration::from_millis(2));
    let (mut written, mut cut) = (0, 0);
    let mut version = 1;
    for attempt in 0..120 {
        // In turn, so that every write that is done makes another version.
        let file = &files[(version as usize) % 2];
        let mut child = add(file, &db);
        std::thread::sleep(whole.mul_f64(1.3 * f64::from(attempt % 40) / 40.0));
        // SIGKILL, on Unix. A writer that has ended already was not killed.
        let _ = child.kill();
        child.wait().unwrap();
        let database = sound(&db);
        let now = database.find("rtv615").unwrap().version;
        assert!(now == version || now == version + 1, "{version} became {now}");
        assert_eq!(database.history("rtv615").len(), now as usize);
        match now == version {
            true => cut += 1,
            false => written += 1,
        }
        version = now;
    }
    println!("{written} writes done, {cut} cut off");
    assert!(
        written > 0 && cut > 0,
        "{written} writes done, {cut} cut off: the kills came at no interesting moment"
    );
    // The lock of a writer that was killed does not hold up the next.
    assert!(add(&files[(version as usize) % 2], &db).wait().unwrap().success());
    assert_eq!(sound(&db).find("rtv615").unwrap().version, version + 1);
}
