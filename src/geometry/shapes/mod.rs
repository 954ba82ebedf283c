//! Generators of the objects that ship with pliant: closed, manifold, outward surfaces.
//! Rooms: [`block`](mod@block), [`sole`], [`seat`], and what the last two are made from: [`slab`], [`plane`], [`error`].
//! [`tubes`] makes a volume mesh: a block with round tubes.

pub mod block;
pub mod error;
pub mod plane;
pub mod seat;
pub mod slab;
pub mod sole;
pub mod tubes;

pub use block::block;
pub use error::ShapeError;
pub use seat::{SeatOptions, stool_seat};
pub use sole::{SoleOptions, flip_flop_sole};
pub use tubes::{TubeArray, TubeBlock};
