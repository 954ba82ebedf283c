//! Shapes: surfaces, volumes, and the files that hold them. Rooms: [`files`], [`surface`].

pub mod files;
pub mod surface;
