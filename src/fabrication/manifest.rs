//! What an export folder holds: `manifest.json`, with the material, volume and checksum of each file, so that the
//! files can still be told apart, and trusted, years later.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The manifest's file name.
pub const MANIFEST: &str = "manifest.json";
/// The manifest's format, its first key.
pub const FORMAT: &str = "pliant-export";
/// The manifest's schema version.
pub const FORMAT_VERSION: u32 = 1;
/// What an export folder holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Always [`FORMAT`].
    pub format: String,
    /// [`FORMAT_VERSION`] of the version that wrote it.
    pub version: u32,
    /// The export's name.
    pub name: String,
    /// What wrote it.
    pub tool: String,
    /// Always `mm`.
    pub unit: String,
    /// Volume of all parts \[mm³\].
    pub volume_mm3: f64,
    /// Bounds of all parts.
    pub bounding_box_mm: BoundingBox,
    /// The file with all materials.
    pub threemf: FileRecord,
    /// One entry per material, in the 3MF file's order.
    pub parts: Vec<PartRecord>,
    /// Where the object comes from.
    #[serde(default)]
    pub origin: BTreeMap<String, String>,
}

/// One material in a manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartRecord {
    /// The material's id in the database.
    pub material: String,
    /// Its name for people.
    pub name: String,
    /// Display colour, `#RRGGBB`.
    pub colour: String,
    /// Its STL file.
    pub stl: FileRecord,
    /// The object's id in the 3MF file.
    pub threemf_object: usize,
    /// Triangles of its mesh.
    pub triangles: usize,
    /// The volume that the written mesh encloses \[mm³\].
    pub volume_mm3: f64,
    /// Bounds of the written mesh.
    pub bounding_box_mm: BoundingBox,
}

/// A file in a manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Its name in the manifest's folder.
    pub file: String,
    /// Its size.
    pub bytes: u64,
    /// Its SHA-256, in hexadecimal.
    pub sha256: String,
}

/// Corners of an axis-parallel box \[mm\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoundingBox {
    /// Least x, y, z.
    pub min: [f64; 3],
    /// Greatest x, y, z.
    pub max: [f64; 3],
}

impl Manifest {
    /// All files of the export, the manifest among them; names that point elsewhere are not ours to touch.
    pub(super) fn files(&self) -> BTreeSet<String> {
        let parts = self.parts.iter().map(|p| &p.stl.file);
        let named = parts
            .chain([&self.threemf.file])
            .filter(|name| plain_name(name))
            .cloned();
        named.chain([MANIFEST.to_string()]).collect()
    }
}

/// Whether a name is that of a file in a folder, whatever the system.
pub(super) fn plain_name(name: &str) -> bool {
    let allowed = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.');
    !name.is_empty() && !name.starts_with('.') && name.len() <= 150 && name.chars().all(allowed)
}

/// Why a manifest could not be read.
#[derive(Debug, Error)]
pub enum ManifestError {
    /// The file system's.
    #[error("{path}: {source}")]
    Io {
        /// Where.
        path: PathBuf,
        /// What.
        source: io::Error,
    },
    /// A manifest that is none.
    #[error("{path}: not a manifest of an export: {detail}")]
    Format {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        detail: String,
    },
}

/// Reads the manifest of an export folder.
///
/// # Errors
/// No such file, not a manifest, or one of a version that this one does not know.
pub fn read_manifest(dir: &Path) -> Result<Manifest, ManifestError> {
    let path = dir.join(MANIFEST);
    let text = fs::read_to_string(&path).map_err(|source| ManifestError::Io {
        path: path.clone(),
        source,
    })?;
    let manifest: Manifest = serde_json::from_str(&text).map_err(|error| ManifestError::Format {
        path: path.clone(),
        detail: error.to_string(),
    })?;
    if manifest.format != FORMAT || manifest.version != FORMAT_VERSION {
        let (format, version) = (&manifest.format, manifest.version);
        let detail =
            format!("it is `{format}` version {version}, expected `{FORMAT}` version {FORMAT_VERSION}");
        return Err(ManifestError::Format { path, detail });
    }
    Ok(manifest)
}

/// A file that is not what its manifest says.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ExportFault {
    /// It cannot be read.
    #[error("{file}: {detail}")]
    Unreadable {
        /// Its name.
        file: String,
        /// Why not.
        detail: String,
    },
    /// Its content changed.
    #[error("{file}: {bytes} bytes with SHA-256 {found}, the manifest says {expected}; export again")]
    Changed {
        /// Its name.
        file: String,
        /// Its size now.
        bytes: u64,
        /// Its checksum now.
        found: String,
        /// Its checksum in the manifest.
        expected: String,
    },
}

/// Holds every file of an export folder against its manifest, and answers those that differ.
///
/// # Errors
/// Those of [`read_manifest`].
pub fn verify(dir: &Path) -> Result<Vec<ExportFault>, ManifestError> {
    let manifest = read_manifest(dir)?;
    let records = manifest.parts.iter().map(|p| &p.stl).chain([&manifest.threemf]);
    let fault = |record: &FileRecord| {
        let file = record.file.clone();
        if !plain_name(&file) {
            return Some(ExportFault::Unreadable {
                file,
                detail: "not a name in this folder".into(),
            });
        }
        match checksum(&dir.join(&file)) {
            Err(error) => Some(ExportFault::Unreadable {
                file,
                detail: error.to_string(),
            }),
            Ok((bytes, found)) if found != record.sha256 || bytes != record.bytes => {
                Some(ExportFault::Changed {
                    file,
                    bytes,
                    found,
                    expected: record.sha256.clone(),
                })
            }
            Ok(_) => None,
        }
    };
    Ok(records.filter_map(fault).collect())
}

/// Size and SHA-256 of a file.
pub(super) fn checksum(path: &Path) -> io::Result<(u64, String)> {
    let mut hash = Sha256::new();
    let bytes = io::copy(&mut File::open(path)?, &mut hash)?;
    Ok((
        bytes,
        hash.finalize().iter().map(|b| format!("{b:02x}")).collect(),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_point_elsewhere_are_refused() {
        for name in ["", ".", "..", "a/b", "../a", "a\\b", ".hidden", "a b"] {
            assert!(!plain_name(name), "{name}");
        }
        assert!(plain_name("flip-flop_2.1"));
    }
}
