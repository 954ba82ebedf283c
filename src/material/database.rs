//! The database of materials: a folder with one record per file, `materials-db/ID.toml`. Git is its history.

use super::check::{Finding, check};
use super::record::{MaterialRecord, RecordError, Unknown, field_error};
use crate::units::whole_file::replace_file;
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
    /// Reads every `*.toml` of `folder`. Files that are no sound record don't stop it: [`Database::broken`] has them.
    ///
    /// # Errors
    /// If the folder can't be read.
    pub fn open(folder: &Path) -> Result<Self, DatabaseError> {
        let failed = |source| DatabaseError::Folder {
            folder: folder.to_path_buf(),
            source,
        };
        let mut files = Vec::new();
        for item in std::fs::read_dir(folder).map_err(failed)? {
            let path = item.map_err(failed)?.path();
            if path.extension().is_some_and(|e| e == "toml") && path.is_file() {
                files.push(path);
            }
        }
        files.sort();
        let mut database = Database {
            folder: folder.to_path_buf(),
            entries: Vec::new(),
            broken: Vec::new(),
        };
        for file in files {
            match read_entry(&file) {
                Ok(entry) => database.entries.push(entry),
                Err(error) => database.broken.push(error),
            }
        }
        database.entries.sort_by(|a, b| a.record.id.cmp(&b.record.id));
        Ok(database)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The records with their files, sorted by id.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The records, sorted by id.
    pub fn records(&self) -> impl Iterator<Item = &MaterialRecord> {
        self.entries.iter().map(|entry| &entry.record)
    }

    /// Files that could not be read as a record.
    pub fn broken(&self) -> &[RecordError] {
        &self.broken
    }

    /// The record named `id`.
    ///
    /// # Errors
    /// If there is none; the message names the nearest ids, or why the file of that name can't be read.
    pub fn find(&self, id: &str) -> Result<&MaterialRecord, DatabaseError> {
        self.entry(id).map(|entry| &entry.record)
    }

    /// The record named `id`, with its file.
    ///
    /// # Errors
    /// As [`Database::find`].
    pub fn entry(&self, id: &str) -> Result<&Entry, DatabaseError> {
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
            read_entry(&own)?;
            hint.push_str("; its file appeared just now, try again");
        }
        Err(DatabaseError::Unknown {
            id: id.into(),
            folder: self.folder.clone(),
            hint,
        })
    }
}

fn read_entry(file: &Path) -> Result<Entry, RecordError> {
    let text = std::fs::read_to_string(file).map_err(|source| RecordError::Read {
        file: file.to_path_buf(),
        source,
    })?;
    let (record, unknown) = MaterialRecord::parse(&text, file)?;
    let stem = file
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    if record.id != stem {
        return Err(field_error(
            &text,
            file,
            "id",
            &record.id,
            &format!("the name of the file, {stem:?}"),
        ));
    }
    Ok(Entry {
        record,
        file: file.to_path_buf(),
        text,
        unknown,
    })
}

/// Writes a record to `folder/ID.toml`, aside first, then renamed, so that a reader never sees half of it. Answers the
/// file's path.
///
/// # Errors
/// If the folder can't be made or the file can't be written.
pub fn write_record(record: &MaterialRecord, folder: &Path) -> Result<PathBuf, DatabaseError> {
    let file = folder.join(format!("{}.toml", record.id));
    let failed = |message: String| DatabaseError::Write {
        file: file.clone(),
        message,
    };
    let text = record.to_toml().map_err(|e| failed(e.to_string()))?;
    replace_file(&file, text.as_bytes()).map_err(|e| failed(e.to_string()))?;
    Ok(file)
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
