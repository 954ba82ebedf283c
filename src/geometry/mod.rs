//! Shapes: surfaces, volumes, and the files that hold them. Rooms: [`surface`], [`volume`].

pub mod grid;
pub mod heights;
pub mod ray;
pub mod surface;
pub mod volume;
