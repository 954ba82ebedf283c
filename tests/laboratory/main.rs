//! The virtual laboratory: its meshes against exact moduli, its presses against homogeneous blocks, its command.

mod command;
mod homogenisation;
mod presses;
mod records;
mod support;
