//! Checks against closed forms: nothing here is compared with an earlier answer of the same code.

mod checks;
mod clusters;
mod command;
mod elements;
mod equilibrium;
mod laws;
mod robustness;
mod sensitivity;
mod support;
