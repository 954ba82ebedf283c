//! Every simulated layout, kept on disk: a killed search goes on where it was, and later searches on the same object do not
//! simulate what an earlier one did.
//!
//! A response is filed under the SHA-256 of everything that it depends on: the mesh, its supports, cells, loads and
//! sensors, the solver's options, the version of this program, and the law in each cell; not the palette's order nor the
//! target. So a search with other targets, more materials or another method finds what fits. The journal changes how
//! long a search takes, never what it answers: it gives the responses that the search asks for and no others.
//!
//! The store is a single file ([`redb`]); responses are committed in transactions of about two seconds' work, so a kill
//! loses no more than that.

use super::search::{Bench, Progress};
use crate::fem::equilibrium::Options;
use crate::fem::rig::{Layout, Response, Rig};
use redb::{Database, DatabaseError, ReadableDatabase, StorageError, TableDefinition};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Key of what is kept: the first half of the SHA-256 of all that it depends on.
pub type Key = [u8; 16];

/// Whole or not, then the displacements, eight bytes each, low byte first.
const RESPONSES: TableDefinition<Key, &[u8]> = TableDefinition::new("responses, 1");
/// What was chosen on the way, as the search for layouts of voxels packs it.
const DECISIONS: TableDefinition<Key, &[u8]> = TableDefinition::new("decisions, 1");
/// About as much work is lost by a kill.
const BETWEEN_COMMITS: Duration = Duration::from_secs(2);
/// Layouts in the first transaction.
const FIRST: usize = 16;

/// The store.
#[derive(Debug)]
pub struct Journal {
    store: Database,
    file: PathBuf,
}

/// Why there is no journal.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// Another process has it.
    #[error("{}: another search has this journal open; wait for it, or give --journal another file", file.display())]
    Busy {
        /// The file.
        file: PathBuf,
    },
    /// It cannot be read or written.
    #[error("{}: the journal of simulated layouts cannot be used: {reason}; delete it, or go without by --no-journal", file.display())]
    Broken {
        /// The file.
        file: PathBuf,
        /// What the store said.
        reason: String,
    },
}

impl Journal {
    /// Opens the journal in `file`, or begins one.
    ///
    /// # Errors
    /// [`JournalError`]: another search has it open; it is no journal.
    pub fn open(file: &Path) -> Result<Journal, JournalError> {
        let broken = |reason: String| JournalError::Broken {
            file: file.to_path_buf(),
            reason,
        };
        if let Some(folder) = file.parent() {
            std::fs::create_dir_all(folder).map_err(|e| broken(e.to_string()))?;
        }
        if !file.exists() {
            begin(file)?;
        }
        match Database::create(file) {
            Ok(store) => Ok(Journal {
                store,
                file: file.to_path_buf(),
            }),
            Err(DatabaseError::DatabaseAlreadyOpen) => Err(JournalError::Busy {
                file: file.to_path_buf(),
            }),
            Err(error) => Err(broken(error.to_string())),
        }
    }

    /// A bench that asks `inner` only for what the journal does not hold.
    pub fn bench<'a>(&'a self, rig: &Rig, options: &Options, inner: &'a mut dyn Bench) -> Journalled<'a> {
        let mut setting = Sha256::new();
        setting.update(env!("CARGO_PKG_VERSION"));
        setting.update(identity(rig));
        setting.update(format!("{options:?}"));
        Journalled {
            journal: self,
            setting: setting.finalize().into(),
            laws: rig
                .laws
                .iter()
                .map(|law| Sha256::digest(format!("{law:?}")).into())
                .collect(),
            inner,
            batch: FIRST,
            found: 0,
            error: None,
        }
    }

    fn broken(&self, reason: impl ToString) -> JournalError {
        JournalError::Broken {
            file: self.file.clone(),
            reason: reason.to_string(),
        }
    }

    pub(super) fn read(&self, keys: &[Key]) -> Result<Vec<Option<Response>>, JournalError> {
        let reading = self.store.begin_read().map_err(|e| self.broken(e))?;
        let table = match reading.open_table(RESPONSES) {
            Ok(table) => table,
            Err(redb::TableError::TableDoesNotExist(_)) => return Ok(vec![None; keys.len()]),
            Err(error) => return Err(self.broken(error)),
        };
        let one = |key: &Key| -> Result<Option<Response>, StorageError> {
            Ok(table.get(key)?.and_then(|value| unpacked(value.value())))
        };
        keys.iter()
            .map(one)
            .collect::<Result<_, _>>()
            .map_err(|e| self.broken(e))
    }

    pub(super) fn write(&self, entries: &[(Key, &Response)]) -> Result<(), JournalError> {
        let writing = self.store.begin_write().map_err(|e| self.broken(e))?;
        {
            let mut table = writing.open_table(RESPONSES).map_err(|e| self.broken(e))?;
            for (key, response) in entries {
                table
                    .insert(key, packed(response).as_slice())
                    .map_err(|e| self.broken(e))?;
            }
        }
        writing.commit().map_err(|e| self.broken(e))
    }

    pub(super) fn decision(&self, key: &Key) -> Result<Option<Vec<u8>>, JournalError> {
        let reading = self.store.begin_read().map_err(|e| self.broken(e))?;
        let table = match reading.open_table(DECISIONS) {
            Ok(table) => table,
            Err(redb::TableError::TableDoesNotExist(_)) => return Ok(None),
            Err(error) => return Err(self.broken(error)),
        };
        let found = table.get(key).map_err(|e| self.broken(e))?;
        Ok(found.map(|value| value.value().to_vec()))
    }

    pub(super) fn decide(&self, key: &Key, chosen: &[u8]) -> Result<(), JournalError> {
        let writing = self.store.begin_write().map_err(|e| self.broken(e))?;
        {
            let mut table = writing.open_table(DECISIONS).map_err(|e| self.broken(e))?;
            table.insert(key, chosen).map_err(|e| self.broken(e))?;
        }
        writing.commit().map_err(|e| self.broken(e))
    }
}

/// Makes an empty store aside and names it `file` when it is whole: one that was killed on the way could not be opened.
fn begin(file: &Path) -> Result<(), JournalError> {
    let broken = |reason: String| JournalError::Broken {
        file: file.to_path_buf(),
        reason,
    };
    let mut name = file.as_os_str().to_owned();
    name.push(".new");
    let aside = PathBuf::from(name);
    let made = match Database::create(&aside) {
        Err(DatabaseError::DatabaseAlreadyOpen) => {
            return Err(JournalError::Busy {
                file: file.to_path_buf(),
            });
        }
        // What an earlier kill left.
        Err(_) if aside.exists() => {
            std::fs::remove_file(&aside).map_err(|e| broken(e.to_string()))?;
            Database::create(&aside)
        }
        made => made,
    };
    drop(made.map_err(|e| broken(e.to_string()))?);
    std::fs::rename(&aside, file).map_err(|e| broken(e.to_string()))
}

/// What the response of any layout depends on, but for its laws.
pub(super) fn identity(rig: &Rig) -> [u8; 32] {
    let mut hash = Sha256::new();
    let mesh = &rig.model.mesh;
    hash.update(format!("{:?}", mesh.elements));
    for node in &mesh.nodes {
        node.iter().for_each(|x| hash.update(x.to_le_bytes()));
    }
    for fill in rig.model.fill.iter().flatten() {
        hash.update(fill.to_le_bytes());
    }
    for held in &rig.model.constrained {
        hash.update(held.map(u8::from));
    }
    for cell in &rig.cell_of_point {
        hash.update(cell.to_le_bytes());
    }
    hash.update(format!("{:?}", rig.presses));
    hash.finalize().into()
}

fn packed(response: &Response) -> Vec<u8> {
    let mut bytes = vec![u8::from(response.complete)];
    for x in &response.displacements {
        bytes.extend(x.to_le_bytes());
    }
    bytes
}

fn unpacked(bytes: &[u8]) -> Option<Response> {
    let (&complete, rest) = bytes.split_first()?;
    let number = |b: &[u8]| Some(f64::from_le_bytes(b.try_into().ok()?));
    Some(Response {
        displacements: rest.chunks(8).map(number).collect::<Option<_>>()?,
        complete: complete == 1,
    })
}

/// A bench with a memory on disk.
pub struct Journalled<'a> {
    journal: &'a Journal,
    setting: [u8; 32],
    laws: Vec<[u8; 32]>,
    inner: &'a mut dyn Bench,
    /// Layouts in the next transaction.
    batch: usize,
    /// How many responses the journal gave.
    pub found: usize,
    /// What went wrong with the journal; the search went on without it.
    pub error: Option<JournalError>,
}

impl Journalled<'_> {
    fn key(&self, layout: &[u8]) -> Key {
        let mut hash = Sha256::new();
        hash.update(self.setting);
        layout.iter().for_each(|&m| hash.update(self.laws[m as usize]));
        let mut key = Key::default();
        key.copy_from_slice(&hash.finalize()[..16]);
        key
    }

    fn simulate(&mut self, layouts: &[Layout], progress: &Progress, keys: &[Key]) -> Vec<Option<Response>> {
        let mut responses = Vec::with_capacity(layouts.len());
        while responses.len() < layouts.len() {
            let from = responses.len();
            let to = layouts.len().min(from + self.batch);
            let began = Instant::now();
            let new = self.inner.respond(
                &layouts[from..to],
                &Progress {
                    batch: to - from,
                    ..*progress
                },
            );
            // Full batches alone say how long one takes.
            if to - from == self.batch {
                let rate = BETWEEN_COMMITS.as_secs_f64() / began.elapsed().as_secs_f64().max(1e-3);
                self.batch = ((self.batch as f64 * rate.clamp(0.5, 2.0)) as usize).clamp(FIRST / 2, 4096);
            }
            let whole: Vec<(Key, &Response)> = keys[from..to]
                .iter()
                .zip(&new)
                .filter_map(|(key, response)| Some((*key, response.as_ref()?)))
                .collect();
            if self.error.is_none() && !whole.is_empty() {
                self.error = self.journal.write(&whole).err();
            }
            let is_stopped = new.iter().any(Option::is_none);
            responses.extend(new);
            if is_stopped {
                responses.resize(layouts.len(), None);
            }
        }
        responses
    }
}

impl Bench for Journalled<'_> {
    fn respond(&mut self, layouts: &[Layout], progress: &Progress) -> Vec<Option<Response>> {
        let keys: Vec<Key> = layouts.iter().map(|l| self.key(l)).collect();
        let mut known = match self.journal.read(&keys) {
            Ok(known) => known,
            Err(error) => {
                self.error.get_or_insert(error);
                vec![None; layouts.len()]
            }
        };
        self.found += known.iter().flatten().count();
        let missing: Vec<usize> = (0..layouts.len()).filter(|&i| known[i].is_none()).collect();
        let fresh: Vec<Layout> = missing.iter().map(|&i| layouts[i].clone()).collect();
        let keys: Vec<Key> = missing.iter().map(|&i| keys[i]).collect();
        for (i, response) in missing.into_iter().zip(self.simulate(&fresh, progress, &keys)) {
            known[i] = response;
        }
        known
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a kill left of a store that was being made is no trouble; what is none is left alone.
    #[test]
    fn a_store_is_named_when_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("j.redb");
        std::fs::write(folder.path().join("j.redb.new"), "torn").unwrap();
        let journal = Journal::open(&file).unwrap();
        journal.decide(&[7; 16], b"this").unwrap();
        drop(journal);
        let journal = Journal::open(&file).unwrap();
        assert_eq!(journal.decision(&[7; 16]).unwrap().as_deref(), Some(&b"this"[..]));
        assert_eq!(journal.decision(&[8; 16]).unwrap(), None);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(matches!(Journal::open(&file), Err(JournalError::Busy { .. })));
        let other = folder.path().join("other");
        std::fs::write(&other, "no journal").unwrap();
        assert!(Journal::open(&other).is_err());
        assert_eq!(std::fs::read(&other).unwrap(), b"no journal");
    }
}
