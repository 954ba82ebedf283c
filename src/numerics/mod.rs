//! Numerical methods that the floors above share. Rooms: [`least_squares`].

pub mod least_squares;
