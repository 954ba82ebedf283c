//! Layouts of voxels: mixtures and their derivatives, the search, what it is compared with, and the command.

mod command;
mod genetic;
mod mixtures;
mod search;
mod support;
mod twin;
