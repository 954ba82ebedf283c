//! Mesh files. Readers take bytes and answer a surface in millimetres; every format but 3MF leaves its unit open, so
//! the caller says it, and a size that no object has is refused. Rooms: [`format`](mod@format), [`error`], [`read`],
//! [`stl`], [`obj`], [`ply`], [`threemf`]; written for ParaView: [`vtu`].

pub mod error;
pub mod format;
pub mod obj;
pub mod ply;
pub mod read;
pub mod stl;
pub mod threemf;
pub mod vtu;

pub use error::MeshFileError;
pub use format::SurfaceFormat;
pub use obj::write_obj;
pub use read::{SurfaceFile, open_surface, read_surface};
pub use stl::write_stl;
