//! From a layout to what a printer eats (Bickel 2010, section 8.5): one closed mesh per material that together tile
//! the object, and the files that carry them.
//!
//! Rooms: [`layout`] (from cells to parts), [`tiling`] (an object cut into closed parts), [`threemf`] (parts as a 3MF
//! file), [`export`] (the folder that goes to the printer), [`manifest`] (what that folder holds).

pub mod export;
pub mod layout;
pub mod manifest;
pub mod threemf;
pub mod tiling;
