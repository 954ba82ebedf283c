//! Shapes, solids and mesh files, on made surfaces and on real scans.

mod command;
mod files;
mod scans;
mod shapes;
mod solids;
mod threemf;
mod volumes;
