//! The kinds of mesh files.

use super::MeshFileError;
use std::path::Path;

/// A mesh file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceFormat {
    Stl,
    Obj,
    Ply,
    ThreeMf,
}

impl SurfaceFormat {
    /// The format that the ending of a path names, small or capital.
    ///
    /// # Errors
    /// [`MeshFileError::UnknownFormat`] for any other ending.
    pub fn from_path(path: &Path) -> Result<SurfaceFormat, MeshFileError> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("stl") => Ok(SurfaceFormat::Stl),
            Some("obj") => Ok(SurfaceFormat::Obj),
            Some("ply") => Ok(SurfaceFormat::Ply),
            Some("3mf") => Ok(SurfaceFormat::ThreeMf),
            _ => Err(MeshFileError::UnknownFormat {
                name: path.display().to_string(),
            }),
        }
    }
}
