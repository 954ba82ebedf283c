//! From measured curves to material parameters.
//!
//! A coupon is a small specimen of one material under homogeneous strain: pressed, pulled or sheared. Rooms:
//! [`coupon_file`] says which tests make a material, [`curve`] reads them, [`coupon`] fits the law (Bickel 2010, section
//! 8.2, with homogeneous strain in place of a finite-element probe), [`tubes`] estimates blocks with parallel tubes
//! that nobody has measured, [`probe`] fits to presses of a specimen by finite elements, [`record`] puts all together into a material record.

pub mod coupon;
pub mod coupon_file;
pub mod curve;
pub mod probe;
pub mod record;
pub mod tubes;
