//! From measured curves to material parameters.
//!
//! A coupon is a small specimen of one material under homogeneous strain: pressed, pulled or sheared. Rooms:
//! [`coupon_file`] says which tests make a material, [`curve`] reads them, [`coupon_state`] says what a law answers in
//! them, [`coupon`] fits a law: one whose moduli depend on strain ([`coupon_rbf`]; Bickel 2010, section 8.2, with
//! homogeneous strain in place of a finite-element probe) or one with an energy of the stretches ([`hyperelastic`]).
//! [`coupon_uncertainty`] and [`bootstrap`] say how well the tests determine it, [`compare`] which law to trust where.
//! [`stand_in`] finds the law that another program has, [`probe`] fits to presses of a whole specimen by finite elements,
//! [`record`] puts all together into a material
//! record.

pub mod bootstrap;
pub mod compare;
pub mod coupon;
pub mod coupon_file;
pub mod coupon_rbf;
pub mod coupon_state;
pub mod coupon_uncertainty;
pub mod curve;
pub mod hyperelastic;
pub mod probe;
pub mod record;
pub mod stand_in;
