//! From a layout to what a printer eats (Bickel 2010, section 8.5): one closed mesh per material that together tile
//! the object, and the files that carry them. Rooms: [`layout`] (from cells to parts), [`tiling`], the files' formats [`threemf`] and [`stl`], and
//! [`export`], the folder that goes to the printer, and its [`manifest`].

pub mod export;
pub mod layout;
pub mod manifest;
pub mod stl;
pub mod threemf;
pub mod tiling;
