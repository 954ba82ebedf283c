//! The folder that goes to the printer: `NAME.3mf` with all materials, one `NAME-MATERIAL.stl` each, and
//! `manifest.json`, which says what each file is and holds its checksum.
//!
//! The folder changes all at once or not at all: files are written aside on the same file system and then renamed,
//! and what they replaced comes back if a rename fails. Files of an earlier export into the same folder go; files
//! that no manifest names are left alone.

use super::manifest::{
    BoundingBox, FORMAT, FORMAT_VERSION, FileRecord, MANIFEST, Manifest, PartRecord, checksum, plain_name,
    read_manifest,
};
use super::threemf::{ThreemfError, ThreemfPart, write_threemf};
use super::tiling::Part;
use super::tiling::check::{TilingFault, check_part, enclosed_volume};
use crate::geometry::files::stl::{single, write_titled_stl};
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;
use crate::units::whole_file::{folder_of, sync_folder};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// How far a part's stated volume may be from what its mesh encloses in single precision, as a fraction.
const VOLUME_TOLERANCE: f64 = 1e-3;

/// One material's share of an object, ready to write.
#[derive(Clone, Debug)]
pub struct ExportPart {
    /// The material's id in the database.
    pub material_id: String,
    /// Its name for people.
    pub material_name: String,
    /// Display colour, sRGB red, green, blue.
    pub colour: [u8; 3],
    /// A closed oriented manifold \[mm\].
    pub mesh: TriMesh,
    /// The volume that it encloses \[mm³\].
    pub volume_mm3: f64,
}

/// What goes with the meshes.
#[derive(Clone, Debug, Default)]
pub struct ExportMeta {
    /// The object's title. Default: the export's name.
    pub title: Option<String>,
    /// A sentence about it.
    pub description: Option<String>,
    /// Where it comes from (layout file, its checksum, lattice spacing, …): kept in the manifest as it is.
    pub origin: BTreeMap<String, String>,
}

/// Why an export could not be written.
#[derive(Debug, Error)]
pub enum ExportError {
    /// A name that cannot start a file's.
    #[error("`{0}` cannot name an export: use letters, digits, `-`, `_` and `.`, not starting with `.`")]
    Name(String),
    /// Nothing to write.
    #[error("an export needs at least one part")]
    NoParts,
    /// Two parts of one material.
    #[error("material `{0}` has two parts; join them into one mesh")]
    Twice(String),
    /// A mesh that would not print.
    #[error("the mesh of material `{material}` has {count} faults, first: {first}")]
    Mesh {
        /// Whose mesh.
        material: String,
        /// How many faults.
        count: usize,
        /// The first of them.
        first: String,
    },
    /// The 3MF writer's.
    #[error(transparent)]
    Threemf(#[from] ThreemfError),
    /// The file system's.
    #[error("{path}: {source}")]
    Io {
        /// Where.
        path: PathBuf,
        /// What.
        source: io::Error,
    },
    /// Something that we do not replace.
    #[error("{0} is in the way and not a file; move it away")]
    InTheWay(PathBuf),
}

fn at(path: &Path) -> impl FnOnce(io::Error) -> ExportError + '_ {
    move |source| ExportError::Io {
        path: path.to_path_buf(),
        source,
    }
}

/// Writes an export into `dir`, which is made if it is missing.
///
/// Vertices are rounded to single precision before anything is written, so both formats hold the same mesh, and its
/// volume and bounds in the manifest are those of what was written.
///
/// # Errors
/// A name, part or mesh that cannot be written, or a file system that refuses; the folder is then as it was.
pub fn write_export(
    dir: &Path,
    name: &str,
    parts: &[ExportPart],
    meta: &ExportMeta,
) -> Result<Manifest, ExportError> {
    if !plain_name(name) {
        return Err(ExportError::Name(name.into()));
    }
    let meshes = written_meshes(parts)?;
    let parent = folder_of(dir);
    fs::create_dir_all(parent).map_err(at(parent))?;
    // Removed with everything in it when this function returns, however it does.
    let aside = tempfile::Builder::new()
        .prefix(".pliant-export-")
        .tempdir_in(parent)
        .map_err(at(parent))?;
    let (new, old) = (aside.path().join("new"), aside.path().join("old"));
    for folder in [&new, &old] {
        fs::create_dir(folder).map_err(at(folder))?;
    }
    let manifest = stage(&new, name, parts, &meshes, meta)?;
    if !dir.exists() {
        fs::rename(&new, dir).map_err(at(dir))?;
    } else {
        let mut gone = manifest.files();
        if let Ok(earlier) = read_manifest(dir) {
            gone.extend(earlier.files());
        }
        swap(dir, &new, &old, &manifest.files(), &gone)?;
    }
    sync_folder(dir);
    sync_folder(parent);
    Ok(manifest)
}

/// The meshes as they will be written, checked.
fn written_meshes(parts: &[ExportPart]) -> Result<Vec<TriMesh>, ExportError> {
    if parts.is_empty() {
        return Err(ExportError::NoParts);
    }
    let mut seen = BTreeSet::new();
    let mut meshes = Vec::new();
    for part in parts {
        if !seen.insert(&part.material_id) {
            return Err(ExportError::Twice(part.material_id.clone()));
        }
        let vertices: Vec<Vec3> = part.mesh.vertices.iter().map(single).collect();
        let mesh = TriMesh {
            vertices,
            triangles: part.mesh.triangles.clone(),
        };
        let volume_mm3 = if mesh
            .triangles
            .iter()
            .flatten()
            .all(|&v| (v as usize) < mesh.vertices.len())
        {
            enclosed_volume(&mesh)
        } else {
            0.0
        };
        let checked = Part {
            label: meshes.len(),
            mesh,
            volume_mm3,
        };
        let mut faults = check_part(&checked);
        if (volume_mm3 - part.volume_mm3).abs() > VOLUME_TOLERANCE * volume_mm3.abs() {
            let (part, enclosed, stated) = (checked.label, volume_mm3, part.volume_mm3);
            faults.push(TilingFault::BadVolume {
                part,
                enclosed,
                stated,
            });
        }
        if let Some(first) = faults.first() {
            let (material, count) = (part.material_id.clone(), faults.len());
            return Err(ExportError::Mesh {
                material,
                count,
                first: first.to_string(),
            });
        }
        meshes.push(checked.mesh);
    }
    Ok(meshes)
}

/// Writes all files into an empty folder.
fn stage(
    folder: &Path,
    name: &str,
    parts: &[ExportPart],
    meshes: &[TriMesh],
    meta: &ExportMeta,
) -> Result<Manifest, ExportError> {
    let mut metadata = vec![("Title", meta.title.as_deref().unwrap_or(name))];
    metadata.extend(meta.description.as_deref().map(|text| ("Description", text)));
    let objects: Vec<ThreemfPart> = parts
        .iter()
        .zip(meshes)
        .map(|(part, mesh)| ThreemfPart {
            name: &part.material_name,
            colour: part.colour,
            mesh,
        })
        .collect();
    let threemf = record(folder, format!("{name}.3mf"), |file| {
        write_threemf(file, &objects, &metadata)
    })?;

    let mut records = Vec::new();
    let mut used = BTreeSet::new();
    for (i, (part, mesh)) in parts.iter().zip(meshes).enumerate() {
        let base = format!("{name}-{}", slug(&part.material_id));
        let spare = (2..).map(|k| format!("{base}-{k}"));
        let base = std::iter::once(base.clone())
            .chain(spare)
            .find(|b| used.insert(b.clone()))
            .unwrap_or(base);
        let stl = record(folder, format!("{base}.stl"), |file| {
            let mut out = BufWriter::new(file);
            write_titled_stl(mesh, &format!("{name}, {}", part.material_id), &mut out)?;
            Ok::<(), ThreemfError>(out.flush()?)
        })?;
        let [r, g, b] = part.colour;
        records.push(PartRecord {
            material: part.material_id.clone(),
            name: part.material_name.clone(),
            colour: format!("#{r:02X}{g:02X}{b:02X}"),
            stl,
            threemf_object: i + 2,
            triangles: mesh.triangles.len(),
            volume_mm3: enclosed_volume(mesh),
            bounding_box_mm: bounding_box(&mesh.vertices),
        });
    }
    let corners: Vec<Vec3> = records
        .iter()
        .flat_map(|r| {
            [
                Vec3::from(r.bounding_box_mm.min),
                Vec3::from(r.bounding_box_mm.max),
            ]
        })
        .collect();
    let manifest = Manifest {
        format: FORMAT.into(),
        version: FORMAT_VERSION,
        name: name.into(),
        tool: format!("pliant {}", env!("CARGO_PKG_VERSION")),
        unit: "mm".into(),
        volume_mm3: records.iter().map(|r| r.volume_mm3).sum(),
        bounding_box_mm: bounding_box(&corners),
        threemf,
        parts: records,
        origin: meta.origin.clone(),
    };
    let path = folder.join(MANIFEST);
    let mut text = serde_json::to_string_pretty(&manifest).map_err(|e| at(&path)(e.into()))?;
    text.push('\n');
    record(folder, MANIFEST.into(), |mut file| {
        Ok::<(), ThreemfError>(file.write_all(text.as_bytes())?)
    })?;
    Ok(manifest)
}

/// Makes a file, has it written and brought to the disk, and answers its record.
fn record(
    folder: &Path,
    name: String,
    write: impl FnOnce(&File) -> Result<(), ThreemfError>,
) -> Result<FileRecord, ExportError> {
    let path = folder.join(&name);
    let file = File::create(&path).map_err(at(&path))?;
    write(&file).map_err(|error| match error {
        ThreemfError::Io(source) => ExportError::Io {
            path: path.clone(),
            source,
        },
        other => other.into(),
    })?;
    file.sync_all().map_err(at(&path))?;
    let (bytes, sha256) = checksum(&path).map_err(at(&path))?;
    Ok(FileRecord {
        file: name,
        bytes,
        sha256,
    })
}

/// Puts the files named `new` from one folder into `dir`, and those named `gone` out of it into `old`; on an error
/// everything goes back.
fn swap(
    dir: &Path,
    from: &Path,
    old: &Path,
    new: &BTreeSet<String>,
    gone: &BTreeSet<String>,
) -> Result<(), ExportError> {
    let here: Vec<&String> = gone
        .iter()
        .filter(|name| dir.join(name).symlink_metadata().is_ok())
        .collect();
    if let Some(name) = here.iter().find(|name| dir.join(name).is_dir()) {
        return Err(ExportError::InTheWay(dir.join(name)));
    }
    let away = here.iter().map(|name| (dir.join(name), old.join(name)));
    // The manifest last: a folder with a manifest is whole.
    let (last, first): (Vec<&String>, Vec<&String>) = new.iter().partition(|name| *name == MANIFEST);
    let inward = first
        .into_iter()
        .chain(last)
        .map(|name| (from.join(name), dir.join(name)));
    let mut done: Vec<(PathBuf, PathBuf)> = Vec::new();
    for (source, target) in away.chain(inward) {
        if let Err(error) = fs::rename(&source, &target) {
            for (source, target) in done.iter().rev() {
                // Nothing better is left to do if this fails as well.
                let _ = fs::rename(target, source);
            }
            return Err(ExportError::Io {
                path: target,
                source: error,
            });
        }
        done.push((source, target));
    }
    Ok(())
}

/// A material id as part of a file's name.
fn slug(id: &str) -> String {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    id.chars()
        .take(80)
        .map(|c| if allowed(c) { c } else { '-' })
        .collect()
}

fn bounding_box(points: &[Vec3]) -> BoundingBox {
    let least = points.iter().fold(Vec3::repeat(f64::INFINITY), |m, p| m.inf(p));
    let greatest = points
        .iter()
        .fold(Vec3::repeat(f64::NEG_INFINITY), |m, p| m.sup(p));
    BoundingBox {
        min: least.into(),
        max: greatest.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_swap_puts_everything_back() {
        let root = tempfile::tempdir().expect("a folder");
        let folder = |name: &str| {
            let path = root.path().join(name);
            fs::create_dir(&path).expect("a folder");
            path
        };
        let (dir, new, old) = (folder("dir"), folder("new"), folder("old"));
        for (path, text) in [(&dir, "before"), (&new, "after")] {
            fs::write(path.join("a.stl"), text).expect("a file");
        }
        fs::write(dir.join("stale.stl"), "stale").expect("a file");
        let names = |names: &[&str]| names.iter().map(|n| n.to_string()).collect::<BTreeSet<_>>();
        // `b.stl` was promised and never written: its rename fails after that of `a.stl` went well.
        let promised = names(&["a.stl", "b.stl"]);
        swap(
            &dir,
            &new,
            &old,
            &promised,
            &names(&["a.stl", "b.stl", "stale.stl"]),
        )
        .expect_err("no b.stl");
        assert_eq!(fs::read_to_string(dir.join("a.stl")).expect("back"), "before");
        assert_eq!(fs::read_to_string(dir.join("stale.stl")).expect("back"), "stale");
        assert_eq!(fs::read_dir(&dir).expect("dir").count(), 2);
    }
}
