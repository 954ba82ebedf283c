//! Shapes, solids and mesh files, on made surfaces and on real scans.

mod command;
mod embedding;
mod files;
mod scans;
mod shapes;
mod solids;
mod tetrahedra;
mod threemf;
mod volumes;
