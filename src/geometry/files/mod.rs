//! Mesh files. Readers take bytes and answer a mesh in millimetres; every format but 3MF leaves its unit open, so
//! the caller says it, and a size that no object has is refused.
//!
//! Surfaces: [`format`](mod@format), [`error`], [`read`], [`stl`], [`obj`], [`ply`], [`threemf`]. Volumes with their named
//! groups: [`volume`], [`volume_error`], `msh` (Gmsh), `vtu_read` and `vtu_array` (VTK), `arrays` (JSON), `numbers`
//! (text or bytes). Voxel images: [`nrrd`]. Written for others: [`vtu`] (ParaView), [`msh_write`] (Gmsh).

mod arrays;
pub mod error;
pub mod format;
mod msh;
pub mod msh_write;
pub mod nrrd;
mod numbers;
pub mod obj;
pub mod ply;
pub mod read;
pub mod stl;
pub mod threemf;
pub mod volume;
pub mod volume_error;
pub mod vtu;
mod vtu_array;
mod vtu_read;

pub use error::MeshFileError;
pub use format::SurfaceFormat;
pub use msh_write::write_msh;
pub use obj::write_obj;
pub use read::{SurfaceFile, open_surface, read_surface};
pub use stl::write_stl;
pub use volume::{Group, VolumeFile, VolumeFormat, open_volume, read_volume, volume_from_arrays};
pub use volume_error::VolumeFileError;
