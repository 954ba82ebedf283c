//! The borders between pliant and what people and other programs keep on disk. Inside, everything is in newtons, millimetres and megapascals (N/mm² = MPa), masses in
//! tonnes and times in seconds, so that force = mass · acceleration needs no factor. A quantity that a person writes
//! carries its unit and is read here; a bare number is refused, because it hides the one mistake that no later check
//! can see. Rooms: [`quantity`], [`price`] (money), [`length_unit`], [`document`] (a TOML file with the places of its mistakes),
//! [`whole_file`] (files written whole or not at all).

pub mod document;
pub mod length_unit;
pub mod price;
pub mod quantity;
pub mod whole_file;

pub use length_unit::LengthUnit;
pub use quantity::{UnitError, compliance, density, force, length, mass, stiffness, stress};
