//! The database of materials: a folder with the newest record of each material, `ID.toml`, and the versions before it,
//! `versions/ID@N.toml`. Reading it; [`super::put`] writes.

use super::check::{Finding, check};
use super::record::{MaterialRecord, RecordError, Unknown, field_error};
use super::versions::{VERSIONS, id_and_version};
use std::path::{Path, PathBuf};

/// A record and the file that it came from.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The record.
    pub record: MaterialRecord,
    /// Its file.
    pub file: PathBuf,
    /// The file's text, for the lines of findings.
    pub text: String,
    /// Fields that this version does not know.
    pub unknown: Vec<Unknown>,
}

impl Entry {
    /// Everything wrong with the record; see [`check`].
    pub fn check(&self) -> Vec<Finding> {
        check(&self.record, &self.text)
    }
}

/// All records of a folder, sorted by id.
#[derive(Debug)]
pub struct Database {
    folder: PathBuf,
    entries: Vec<Entry>,
    /// Sorted by id and version.
    older: Vec<Entry>,
    broken: Vec<RecordError>,
}

/// Why a database, or a material in it, can't be had.
#[derive(Debug, thiserror::Error)]
pub enum DatabaseError {
    /// The folder can't be read.
    #[error("material database {}: {source} (name its folder with --db)", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// No record has this id.
    #[error("no material {id:?} in {}{hint}", folder.display())]
    Unknown {
        /// The id asked for.
        id: String,
        /// The folder.
        folder: PathBuf,
        /// Which ones are near.
        hint: String,
    },
    /// The record with this id can't be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A record can't be written.
    #[error("{}: {message}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// What went wrong.
        message: String,
    },
}

impl Database {
    /// Reads every `*.toml` of `folder`, and of the older versions in it. Files that are no sound record don't stop it:
    /// [`Database::broken`] has them.
    ///
    /// # Errors
    /// If the folder can't be read.
    pub fn open(folder: &Path) -> Result<Self, DatabaseError> {
        let failed = |folder: &Path, source| DatabaseError::Folder {
            folder: folder.to_path_buf(),
            source,
        };
        let mut database = Database {
            folder: folder.to_path_buf(),
            entries: Vec::new(),
            older: Vec::new(),
            broken: Vec::new(),
        };
        for file in records_in(folder).map_err(|e| failed(folder, e))? {
            match read_entry(&file, None) {
                Ok(entry) => database.entries.push(entry),
                Err(error) => database.broken.push(error),
            }
        }
        // After the newest: a version that a writer replaces meanwhile is then found here.
        let versions = folder.join(VERSIONS);
        let files = match records_in(&versions) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            files => files.map_err(|e| failed(&versions, e))?,
        };
        for file in files {
            match read_entry(&file, Some(version_in_name(&file))) {
                Ok(entry) => database.older.push(entry),
                Err(error) => database.broken.push(error),
            }
        }
        let order = |e: &Entry| (e.record.id.clone(), e.record.version);
        database.entries.sort_by_key(order);
        database.older.sort_by_key(order);
        Ok(database)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The newest records with their files, sorted by id.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The newest records, sorted by id.
    pub fn records(&self) -> impl Iterator<Item = &MaterialRecord> {
        self.entries.iter().map(|entry| &entry.record)
    }

    /// The older versions with their files, sorted by id and version.
    pub fn older(&self) -> &[Entry] {
        &self.older
    }

    /// The versions of a material, from the first that is kept to the newest.
    pub fn history(&self, id: &str) -> Vec<&Entry> {
        let mut history: Vec<&Entry> = self.older.iter().filter(|e| e.record.id == id).collect();
        if let Some(newest) = self.entries.iter().find(|e| e.record.id == id) {
            // A writer that was killed may have kept the newest already.
            history.retain(|e| e.record.version != newest.record.version);
            history.push(newest);
        }
        history
    }

    /// Files that could not be read as a record.
    pub fn broken(&self) -> &[RecordError] {
        &self.broken
    }

    /// The first of the files that could not be read.
    pub(super) fn take_broken(&mut self) -> Option<RecordError> {
        (!self.broken.is_empty()).then(|| self.broken.remove(0))
    }

    /// The record named `id`, or `id@N` for its version N.
    ///
    /// # Errors
    /// If there is none; the message names the nearest ids, or the versions that are there, or why the file of that name can't
    /// be read.
    pub fn find(&self, id: &str) -> Result<&MaterialRecord, DatabaseError> {
        self.entry(id).map(|entry| &entry.record)
    }

    /// The record named `id` or `id@N`, with its file.
    ///
    /// # Errors
    /// As [`Database::find`].
    pub fn entry(&self, name: &str) -> Result<&Entry, DatabaseError> {
        let unknown = |hint: String| DatabaseError::Unknown {
            id: name.into(),
            folder: self.folder.clone(),
            hint,
        };
        let (id, version) = id_and_version(name).map_err(|found| {
            unknown(format!(
                ": found version {found:?}, expected a whole number from 1, as in ID@2"
            ))
        })?;
        let Some(version) = version else {
            return self.newest(id);
        };
        let history = self.history(id);
        if let Some(entry) = history.iter().find(|e| e.record.version == version) {
            return Ok(entry);
        }
        self.newest(id)?;
        let there: Vec<String> = history.iter().map(|e| e.record.version.to_string()).collect();
        Err(unknown(format!("; it has version {}", there.join(", "))))
    }

    fn newest(&self, id: &str) -> Result<&Entry, DatabaseError> {
        if let Some(entry) = self.entries.iter().find(|e| e.record.id == id) {
            return Ok(entry);
        }
        let mut near: Vec<(usize, &str)> = self
            .entries
            .iter()
            .map(|e| (edit_distance(id, &e.record.id), e.record.id.as_str()))
            .collect();
        near.sort();
        let near: Vec<&str> = near.iter().take(3).map(|n| n.1).collect();
        let mut hint = match near.is_empty() {
            true => "; the folder holds no records".to_string(),
            false => format!("; near it are {}", near.join(", ")),
        };
        let own = self.folder.join(format!("{id}.toml"));
        if own.is_file() {
            // Its file is there but broken: that is the message that helps.
            read_entry(&own, None)?;
            hint.push_str("; its file appeared just now, try again");
        }
        Err(DatabaseError::Unknown {
            id: id.into(),
            folder: self.folder.clone(),
            hint,
        })
    }
}

/// The record files of a folder, sorted.
fn records_in(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for item in std::fs::read_dir(folder)? {
        let path = item?.path();
        if path.extension().is_some_and(|e| e == "toml") && path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// The version that the name of a file in `versions/` says; 0, which no record has, if it says none.
fn version_in_name(file: &Path) -> u32 {
    let stem = file.file_stem().map(|s| s.to_string_lossy()).unwrap_or_default();
    id_and_version(&stem)
        .ok()
        .and_then(|(_, version)| version)
        .unwrap_or(0)
}

/// Reads a record's file, and compares the record with the file's name: `ID.toml`, or `ID@N.toml` for `version` N.
pub(super) fn read_entry(file: &Path, version: Option<u32>) -> Result<Entry, RecordError> {
    let text = std::fs::read_to_string(file).map_err(|source| RecordError::Read {
        file: file.to_path_buf(),
        source,
    })?;
    let (record, unknown) = MaterialRecord::parse(&text, file)?;
    let stem = file
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    let expected = |what: &str| format!("what the file's name says, {what:?}");
    let id = match version {
        None => stem.as_str(),
        Some(_) => stem.split_once('@').map_or("", |(id, _)| id),
    };
    if record.id != id {
        return Err(field_error(&text, file, "id", &record.id, &expected(id)));
    }
    if let Some(n) = version.filter(|n| *n != record.version) {
        return Err(field_error(
            &text,
            file,
            "version",
            &record.version,
            &expected(&n.to_string()),
        ));
    }
    Ok(Entry {
        record,
        file: file.to_path_buf(),
        text,
        unknown,
    })
}

/// Levenshtein's distance in bytes.
fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.bytes().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.bytes().enumerate() {
            let replaced = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}
