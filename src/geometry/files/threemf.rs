//! 3MF.

use super::MeshFileError;
use super::read::RawSurface;

pub(super) fn read(_bytes: &[u8]) -> Result<RawSurface, MeshFileError> {
    Err(MeshFileError::ThreeMf {
        part: "package".into(),
        message: "3MF is not read yet".into(),
    })
}
