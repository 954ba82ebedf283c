//! The older versions of the database's records, `versions/ID@N.toml`, and whether they are all there as they were written.
//!
//! Each record from version 2 on names the SHA-256 of the file before it, so that the newest vouches for all older ones.

use super::check::{Finding, check};
use super::database::{Database, Entry};
use super::record::line_of_field;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// The folder of the older versions, in the database's.
pub const VERSIONS: &str = "versions";

/// Where version `version` of `id` is kept once a newer one is there.
pub fn file_of_version(folder: &Path, id: &str, version: u32) -> PathBuf {
    folder.join(VERSIONS).join(format!("{id}@{version}.toml"))
}

/// `ID@N` taken apart: the id and the version, if one is named.
///
/// # Errors
/// What stands behind the `@`, if it is no whole number from 1.
pub fn id_and_version(name: &str) -> Result<(&str, Option<u32>), &str> {
    let Some((id, version)) = name.split_once('@') else {
        return Ok((name, None));
    };
    // A plus or zeros before would make two names for one record.
    let plain = version.bytes().all(|b| b.is_ascii_digit()) && !version.starts_with('0');
    match version.parse() {
        Ok(number) if plain => Ok((id, Some(number))),
        _ => Err(version),
    }
}

/// The versions of `id` that are kept in the folder, rising.
pub(super) fn kept(folder: &Path, id: &str) -> Vec<u32> {
    let Ok(items) = std::fs::read_dir(folder.join(VERSIONS)) else {
        return Vec::new();
    };
    let mut versions: Vec<u32> = items
        .flatten()
        .filter_map(|item| {
            let name = item.file_name().to_string_lossy().into_owned();
            match id_and_version(name.strip_suffix(".toml")?) {
                Ok((other, version)) if other == id => version,
                _ => None,
            }
        })
        .collect();
    versions.sort_unstable();
    versions
}

/// SHA-256 of a file's text in hexadecimal digits; whether its lines end in LF or CR LF makes no difference, as git may change it.
pub fn sha256(text: &str) -> String {
    let digest = Sha256::digest(text.replace("\r\n", "\n").as_bytes());
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Database {
    /// Everything wrong with every record: [`check`] for the newest ones, and whether the older ones are there without
    /// gaps as they were written, and the recipe is in the folder. In the order of the files; older versions without findings are
    /// left out.
    pub fn check(&self) -> Vec<(&Entry, Vec<Finding>)> {
        let mut checked = Vec::new();
        for entry in self.entries() {
            let mut findings = check(&entry.record, &entry.text);
            findings.extend(self.recipe_finding(entry));
            findings.extend(self.history_finding(entry));
            checked.push((entry, findings));
        }
        for entry in self.older() {
            let mut findings = Vec::new();
            findings.extend(self.history_finding(entry));
            findings.extend(self.place_finding(entry));
            if !findings.is_empty() {
                checked.push((entry, findings));
            }
        }
        checked
    }

    /// Whether an older version is older than the newest.
    fn place_finding(&self, entry: &Entry) -> Option<Finding> {
        let (id, version) = (&entry.record.id, entry.record.version);
        let Some(newest) = self.entries().iter().find(|e| e.record.id == *id) else {
            let message = format!("an older version of a record that is not there: expected {id}.toml");
            return Some(finding(entry, "id", message));
        };
        let newest_version = newest.record.version;
        // A writer that was killed between its two steps leaves the newest record here too, unchanged.
        let doubled = version == newest_version && entry.record == newest.record;
        if version < newest_version || doubled {
            return None;
        }
        let message = match version == newest_version {
            true => format!("{version}: {id}.toml says so too and holds something else"),
            false => format!("{version}: expected less than the {newest_version} of {id}.toml"),
        };
        Some(finding(entry, "version", message))
    }

    fn recipe_finding(&self, entry: &Entry) -> Option<Finding> {
        let recipe = entry.record.recipe.as_deref()?;
        let path = Path::new(recipe);
        let inside = path
            .components()
            .all(|c| matches!(c, std::path::Component::Normal(_)));
        if inside && self.folder().join(path).is_file() {
            return None;
        }
        let message = format!(
            "{recipe:?}: expected a file in {}, from which the record was fitted",
            self.folder().display()
        );
        Some(finding(entry, "recipe", message))
    }

    /// What is wrong with the link from a record to the version before it.
    fn history_finding(&self, entry: &Entry) -> Option<Finding> {
        let record = &entry.record;
        let wrong = |message: String| Some(finding(entry, "previous_sha256", message));
        let Some(stored) = &record.previous_sha256 else {
            return match record.version {
                0 | 1 => None,
                n => wrong(format!("missing: expected the SHA-256 of version {}", n - 1)),
            };
        };
        let Some(before) = record.version.checked_sub(1).filter(|n| *n > 0) else {
            return wrong(format!("{stored}: expected none, for version 1"));
        };
        let file = file_of_version(self.folder(), &record.id, before);
        let Some(older) = self
            .older()
            .iter()
            .find(|e| e.record.id == record.id && e.record.version == before)
        else {
            return wrong(format!(
                "{stored}: expected its file {}, which is not there or broken",
                file.display()
            ));
        };
        let found = sha256(&older.text);
        if found != *stored {
            return wrong(format!(
                "{stored}: but {} has {found}: it was changed after it was written",
                file.display()
            ));
        }
        None
    }
}

fn finding(entry: &Entry, field: &str, message: String) -> Finding {
    Finding {
        line: line_of_field(&entry.text, field),
        field: field.into(),
        message,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_versions() {
        assert_eq!(id_and_version("leap-foam"), Ok(("leap-foam", None)));
        assert_eq!(id_and_version("leap-foam@12"), Ok(("leap-foam", Some(12))));
        for wrong in ["a@", "a@0", "a@01", "a@+1", "a@x", "a@1@2", "a@99999999999"] {
            assert!(id_and_version(wrong).is_err(), "{wrong}");
        }
    }

    /// FIPS 180-2, appendix B.1; and the same with other ends of lines.
    #[test]
    fn digest_of_a_text() {
        assert_eq!(
            sha256("abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
        assert_eq!(sha256("a\r\nb\r\n"), sha256("a\nb\n"));
    }
}
