//! From a layout to what a printer eats (Bickel 2010, section 8.5): one closed mesh per material that together tile
//! the object, and the files that carry them. Rooms: [`tiling`], the files' formats [`threemf`] and [`stl`], and
//! [`export`], the folder that goes to the printer, and its [`manifest`].

pub mod export;
pub mod manifest;
pub mod stl;
pub mod threemf;
pub mod tiling;
