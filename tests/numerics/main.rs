//! The iterative solver on the systems that finite elements make.

mod multigrid;
