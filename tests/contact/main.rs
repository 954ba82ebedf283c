//! Contact against closed forms: Hertz, flat punch, Coulomb's law, and balance of forces.

mod half_space;
mod support;
