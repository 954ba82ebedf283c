//! Contact against closed forms and balances: Hertz, flat punch, Coulomb's law, sums of forces.

mod bodies;
mod friction;
mod half_space;
mod support;
