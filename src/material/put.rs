//! Writing to the database: one writer at a time, and nothing that a kill could leave half done.
//!
//! A record never changes. What differs from the newest record of its id becomes the next version: the file of the newest
//! goes to `versions/ID@N.toml` byte by byte, then the new record takes its place, naming the SHA-256 of the file before.
//! Both files are written aside and renamed, in this order, so that at every moment the newest record is the old one or
//! the new one, and every older one can be read. Writers wait for the lock of `.lock`, which the system takes from a process
//! that dies; readers need none.

use super::database::{Database, DatabaseError, read_entry};
use super::migrate::rewritten;
use super::record::{MaterialRecord, SCHEMA, Unknown};
use super::versions::{VERSIONS, file_of_version, sha256};
use crate::units::whole_file::replace_file;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// What a writer did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Put {
    /// The record's file.
    pub file: PathBuf,
    /// Its version.
    pub version: u32,
    /// Whether it is new.
    pub change: Change,
}

/// What became of a record that was put.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The first record of its id.
    First,
    /// Another version of an id that was there.
    Revised,
    /// The newest record holds the same; nothing was written.
    Same,
}

/// The longest that a writer waits for another.
const PATIENCE: Duration = Duration::from_secs(30);
/// Scraps of writers that were killed are cleared away once they are older than any write takes.
const SCRAP_AGE: Duration = Duration::from_secs(600);

impl Database {
    /// Puts a record into the folder, as version 1 of its id or, where it differs from the newest, as the next one; the
    /// record's own `version` and `previous_sha256` don't count. Fields of the newest record that this program does not know
    /// are carried over, but for those in lists, which a new fit makes anew. Makes the folder if it is missing. Whether the record
    /// is sound is the caller's to [`check`](super::check::check).
    ///
    /// # Errors
    /// An id that is no file's name, a newest record that can't be read, another writer that does not end, a file that can't
    /// be written. The folder is then as it was.
    pub fn put(folder: &Path, record: &MaterialRecord) -> Result<Put, DatabaseError> {
        put(folder, record, None)
    }

    /// Puts the record whose file holds `text` into the folder, as [`Database::put`] does, with all of its own fields that this
    /// program does not know and none of the newest record's.
    ///
    /// # Errors
    /// As [`Database::put`].
    pub fn put_text(folder: &Path, record: &MaterialRecord, text: &str) -> Result<Put, DatabaseError> {
        put(folder, record, Some(text))
    }

    /// Rewrites the records of older schemas in `folder` in this version's. Their content and version stay, and so do their
    /// comments and fields unknown to this program, which are answered with each file. Older versions are read in the schema
    /// that they were written in, and stay as they are.
    ///
    /// # Errors
    /// A record that can't be read or written. If one can't be read, none is rewritten.
    pub fn migrate(folder: &Path) -> Result<Vec<(PathBuf, Vec<Unknown>)>, DatabaseError> {
        // A folder that is not there is answered here, with its hint, rather than by the lock.
        Database::open(folder)?;
        let _lock = Lock::of(folder)?;
        let mut database = Database::open(folder)?;
        if let Some(error) = database.take_broken() {
            return Err(error.into());
        }
        let mut texts = Vec::new();
        for entry in database.entries() {
            let recipe = format!("coupons/{}.toml", entry.record.id);
            let recipe = Some(recipe.as_str()).filter(|r| folder.join(r).is_file());
            if let Some(text) = rewritten(&entry.text, &entry.file, recipe)? {
                texts.push((entry, text));
            }
        }
        let mut done = Vec::new();
        for (entry, text) in texts {
            replace_file(&entry.file, text.as_bytes()).map_err(|e| failed(&entry.file, e))?;
            done.push((entry.file.clone(), entry.unknown.clone()));
        }
        Ok(done)
    }
}

fn failed(file: &Path, message: impl std::fmt::Display) -> DatabaseError {
    DatabaseError::Write {
        file: file.to_path_buf(),
        message: message.to_string(),
    }
}

/// The right to write to a folder; given back when it is dropped.
struct Lock {
    _file: File,
}

impl Lock {
    fn of(folder: &Path) -> Result<Self, DatabaseError> {
        let path = folder.join(".lock");
        let lock = File::options().create(true).append(true).open(&path);
        let file = lock.map_err(|e| failed(&path, e))?;
        let start = Instant::now();
        loop {
            match file.try_lock() {
                Ok(()) => return Ok(Lock { _file: file }),
                Err(TryLockError::WouldBlock) if start.elapsed() < PATIENCE => {
                    std::thread::sleep(Duration::from_millis(10));
                }
                Err(TryLockError::WouldBlock) => {
                    let message = format!(
                        "another program has been writing to this database for {} s: end it, or try again",
                        PATIENCE.as_secs()
                    );
                    return Err(failed(&path, message));
                }
                Err(TryLockError::Error(e)) => return Err(failed(&path, e)),
            }
        }
    }
}

fn put(folder: &Path, record: &MaterialRecord, own_text: Option<&str>) -> Result<Put, DatabaseError> {
    let file = folder.join(format!("{}.toml", record.id));
    if !super::check::is_id(&record.id) {
        let message = format!(
            "id {:?}: expected lower-case letters, digits and hyphens",
            record.id
        );
        return Err(failed(&file, message));
    }
    std::fs::create_dir_all(folder).map_err(|e| failed(folder, e))?;
    let _lock = Lock::of(folder)?;
    clear_scraps(folder);
    clear_scraps(&folder.join(VERSIONS));
    let newest = newest_text(&file, folder, &record.id)?;
    let (older, other) = match &newest {
        Some((text, file, version)) => (Some(read_entry(file, *version)?.record), Some(text.as_str())),
        None => (None, None),
    };
    let mut next = record.clone();
    next.schema = SCHEMA;
    next.version = older.as_ref().map_or(1, |old| old.version.saturating_add(1));
    next.previous_sha256 = other.map(sha256);
    if let (Some(old), Some(text)) = (&older, other)
        && file.is_file()
    {
        let mut same = next.clone();
        (same.version, same.previous_sha256) = (old.version, old.previous_sha256.clone());
        if same == *old && own_text.is_none_or(|own| unknown_part(own) == unknown_part(text)) {
            return Ok(Put {
                file,
                version: old.version,
                change: Change::Same,
            });
        }
        archive(folder, old, text)?;
    }
    let unknown_from = own_text
        .map(|text| (text, true))
        .or(other.map(|text| (text, false)));
    let text = text_with_unknown(&next, unknown_from).map_err(|e| failed(&file, e))?;
    // Written and read again before it takes the place of another: a record that can't be read must not get there.
    let (again, _) = MaterialRecord::parse(&text, &file)?;
    if again != next {
        return Err(failed(
            &file,
            "the record would not come back from its file (is a number not finite?)",
        ));
    }
    replace_file(&file, text.as_bytes()).map_err(|e| failed(&file, e))?;
    Ok(Put {
        file,
        version: next.version,
        change: match older {
            None => Change::First,
            Some(_) => Change::Revised,
        },
    })
}

/// A file's text, the file, and the version that its name says.
type NewestFile = (String, PathBuf, Option<u32>);

/// The text of the newest record of an id and its file; of the highest of the older versions, where `ID.toml` was taken away.
fn newest_text(file: &Path, folder: &Path, id: &str) -> Result<Option<NewestFile>, DatabaseError> {
    let read = |file: &Path| std::fs::read_to_string(file).map_err(|e| failed(file, e));
    if file.exists() {
        return Ok(Some((read(file)?, file.to_path_buf(), None)));
    }
    let highest = super::versions::kept(folder, id).into_iter().next_back();
    let Some(version) = highest else { return Ok(None) };
    let file = file_of_version(folder, id, version);
    Ok(Some((read(&file)?, file, Some(version))))
}

/// Keeps the newest record among the older versions, before another takes its place.
fn archive(folder: &Path, old: &MaterialRecord, text: &str) -> Result<(), DatabaseError> {
    let file = file_of_version(folder, &old.id, old.version);
    if file.exists() {
        // A writer was killed between its two steps; or somebody changed the newest record in place.
        let kept = read_entry(&file, Some(old.version))?;
        if kept.text == text {
            return Ok(());
        }
        if kept.record != *old {
            let message = format!(
                "holds another record than {}.toml, which says that it is version {} too: give that one the next version, with \
                 `pliant db add`, and put back what it was",
                old.id, old.version
            );
            return Err(failed(&file, message));
        }
    }
    replace_file(&file, text.as_bytes()).map_err(|e| failed(&file, e))
}

/// A record's text with the fields that this program does not know of another text; of its lists too, if `lists`.
fn text_with_unknown(
    record: &MaterialRecord,
    from: Option<(&str, bool)>,
) -> Result<String, Box<dyn std::error::Error>> {
    let plain = record.to_toml()?;
    let Some((text, lists)) = from else {
        return Ok(plain);
    };
    let (found, known) = found_and_known(text)?;
    let mut table: toml::Table = toml::from_str(&plain)?;
    if !graft(&found, &known, &mut table, lists) {
        return Ok(plain);
    }
    let heading: String = plain
        .lines()
        .take_while(|line| line.starts_with('#'))
        .flat_map(|line| [line, "\n"])
        .collect();
    Ok(heading + &toml::to_string(&table)?)
}

/// A record's file as a table, and what of it this program knows.
fn found_and_known(text: &str) -> Result<(toml::Table, toml::Table), Box<dyn std::error::Error>> {
    let found: toml::Table = toml::from_str(text)?;
    let record: MaterialRecord = toml::from_str(text)?;
    Ok((found, toml::Table::try_from(record)?))
}

/// What this program does not know of a record's file.
fn unknown_part(text: &str) -> Option<toml::Table> {
    let (found, known) = found_and_known(text).ok()?;
    let mut part = known.clone();
    graft(&found, &known, &mut part, true).then(|| rest(&part, &known))
}

/// `table` without what stands in `known`; whole where a list holds something unknown.
fn rest(table: &toml::Table, known: &toml::Table) -> toml::Table {
    let mut left = toml::Table::new();
    for (key, value) in table {
        match (value, known.get(key)) {
            (toml::Value::Table(a), Some(toml::Value::Table(b))) => {
                let inner = rest(a, b);
                if !inner.is_empty() {
                    left.insert(key.clone(), inner.into());
                }
            }
            (value, Some(other)) if value == other => {}
            (value, _) => {
                left.insert(key.clone(), value.clone());
            }
        }
    }
    left
}

/// Puts what `found` has and `known` has not into `into`, where the tables around it are there too. Whether there was any.
fn graft(found: &toml::Table, known: &toml::Table, into: &mut toml::Table, lists: bool) -> bool {
    use toml::Value::{Array, Table};
    let mut any = false;
    for (key, value) in found {
        any |= match (value, known.get(key), into.get_mut(key)) {
            (_, None, None) => into.insert(key.clone(), value.clone()).is_none(),
            (Table(found), Some(Table(known)), Some(Table(into))) => graft(found, known, into, lists),
            (Array(found), Some(Array(known)), Some(Array(into))) if lists && found.len() == into.len() => {
                let rows = found.iter().zip(known).zip(into);
                rows.fold(false, |any, row| match row {
                    ((Table(found), Table(known)), Table(into)) => graft(found, known, into, lists) | any,
                    _ => any,
                })
            }
            _ => false,
        };
    }
    any
}

/// Takes away what writers that were killed left aside long ago. Best effort.
fn clear_scraps(folder: &Path) {
    let Ok(items) = std::fs::read_dir(folder) else {
        return;
    };
    for item in items.flatten() {
        let ours = item.file_name().to_string_lossy().starts_with(".pliant-");
        let age = item
            .metadata()
            .and_then(|m| m.modified())
            .ok()
            .and_then(|at| SystemTime::now().duration_since(at).ok());
        if ours && age.is_some_and(|age| age > SCRAP_AGE) {
            let _ = std::fs::remove_file(item.path());
        }
    }
}
