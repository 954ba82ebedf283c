//! Shapes: surfaces, volumes, and the files that hold them. Rooms: [`surface`].

pub mod surface;
