//! From bytes to a surface in millimetres.

use super::{MeshFileError, SurfaceFormat, obj, ply, stl, threemf};
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;
use crate::units::LengthUnit;
use std::ops::RangeInclusive;
use std::path::Path;

/// Largest extents that an object may have \[mm\].
const SIZES: RangeInclusive<f64> = 5.0..=3000.0;

/// A surface as it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceFile {
    /// The surface \[mm\]. Every vertex is used.
    pub mesh: TriMesh,
    /// The unit of the numbers in the file.
    pub unit: LengthUnit,
    /// Remarks for the user about what was passed over.
    pub notes: Vec<String>,
}

/// What a reader of one format found: numbers in the file's own unit, which few formats declare.
#[derive(Clone, Debug, Default)]
pub(super) struct RawSurface {
    pub mesh: TriMesh,
    pub unit: Option<LengthUnit>,
    pub notes: Vec<String>,
    /// Why there may be no triangles, for the error message.
    pub if_empty: String,
}

pub(super) fn is_plausible(largest_mm: f64) -> bool {
    SIZES.contains(&largest_mm)
}

/// Reads a surface. `unit` is the unit of the file's numbers; a 3MF declares its own, so there it may be left out.
///
/// # Errors
/// [`MeshFileError`]: bytes that are no such file, an index out of range, a coordinate that is not finite, no triangles, a
/// unit that is missing or contradicts the file's, and a largest extent below 5 mm or above 3000 mm.
pub fn read_surface(
    bytes: &[u8],
    format: SurfaceFormat,
    unit: Option<LengthUnit>,
) -> Result<SurfaceFile, MeshFileError> {
    let raw = match format {
        SurfaceFormat::Stl => stl::read(bytes)?,
        SurfaceFormat::Obj => obj::read(bytes)?,
        SurfaceFormat::Ply => ply::read(bytes)?,
        SurfaceFormat::ThreeMf => threemf::read(bytes)?,
    };
    in_millimetres(raw, unit)
}

/// Reads a surface from a file, in the format that its name says.
///
/// # Errors
/// As [`read_surface`], with the path before the message.
pub fn open_surface(path: &Path, unit: Option<LengthUnit>) -> Result<SurfaceFile, MeshFileError> {
    let format = SurfaceFormat::from_path(path)?;
    let bytes = std::fs::read(path).map_err(|cause| MeshFileError::Open {
        path: path.to_path_buf(),
        cause,
    })?;
    read_surface(&bytes, format, unit).map_err(|error| MeshFileError::In {
        path: path.to_path_buf(),
        cause: Box::new(error),
    })
}

fn in_millimetres(raw: RawSurface, stated: Option<LengthUnit>) -> Result<SurfaceFile, MeshFileError> {
    let mut mesh = raw.mesh.without_loose_vertices();
    let Some((lo, hi)) = mesh.bounds().filter(|_| !mesh.triangles.is_empty()) else {
        return Err(MeshFileError::Empty { hint: raw.if_empty });
    };
    if let Some(number) = mesh
        .vertices
        .iter()
        .position(|v| !v.iter().all(|x| x.is_finite()))
    {
        // The readers refuse such coordinates; a transform of the file may still overflow.
        let place = format!("vertex {number}, after its transform");
        return Err(MeshFileError::NotFinite {
            place,
            value: format!("{:?}", mesh.vertices[number].as_slice()),
        });
    }
    let size: Vec3 = hi - lo;
    let unit = match (raw.unit, stated) {
        (Some(declared), Some(stated)) if declared != stated => {
            return Err(MeshFileError::UnitConflict { declared, stated });
        }
        (Some(unit), _) | (None, Some(unit)) => unit,
        (None, None) => {
            return Err(MeshFileError::UnitMissing {
                x: size.x,
                y: size.y,
                z: size.z,
            });
        }
    };
    let largest_mm = size.max() * unit.to_mm();
    if !is_plausible(largest_mm) {
        return Err(MeshFileError::ImplausibleSize {
            largest_mm,
            unit,
            declared: raw.unit.is_some(),
        });
    }
    mesh.vertices.iter_mut().for_each(|v| *v *= unit.to_mm());
    Ok(SurfaceFile {
        mesh,
        unit,
        notes: raw.notes,
    })
}
