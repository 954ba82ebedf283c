//! From measurements to material parameters.
//!
//! [`coupon`] fits small specimens under homogeneous strain: pressed, pulled or sheared, without finite elements. [`probe`] fits
//! presses of a whole specimen, whose strain is not homogeneous, by finite elements (Bickel 2010, 8.3). [`stand_in`] finds, for
//! another program, the hyperelastic law nearest to a record's.

pub mod coupon;
pub mod probe;
pub mod stand_in;
