//! `pliant simulate` on the real binary: closed forms, files that others read, and mistakes that are answered.

mod bad_scenes;
mod bench;
mod layouts;
mod outputs;
mod physics;
mod volumes;
