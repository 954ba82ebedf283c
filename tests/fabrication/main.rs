//! From shapes to files: parts that tile, and files that other programs open.

mod shapes;
mod tiling;
