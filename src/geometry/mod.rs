//! Shapes: surfaces, volumes, and the files that hold them. Rooms: [`surface`], [`volume`].

pub mod surface;
pub mod volume;
