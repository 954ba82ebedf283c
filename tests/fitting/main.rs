//! Fits of materials to measurements.

mod laws;
mod measured;
mod predictions;
mod probe;
mod set_command;
mod tangential;
mod twin;
