//! Files that hold meshes and fields. Rooms: [`vtu`].

pub mod vtu;
