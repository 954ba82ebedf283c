//! From shapes to files: parts that tile, and files that other programs open.

mod export;
mod python;
mod shapes;
mod tiling;
mod volumes;
mod vtu;
