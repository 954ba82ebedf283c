//! From a layout to what a printer eats (Bickel 2010, section 8.5): one closed mesh per material that together tile
//! the object, and the files that carry them. Rooms: [`tiling`].

pub mod tiling;
