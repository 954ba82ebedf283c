//! Materials from coupons: small specimens of one material under homogeneous strain.
//!
//! | room | holds |
//! |---|---|
//! | [`mod@file`] | which tests make a material, as people write it |
//! | [`curve`] | the file of a testing machine as strain and nominal stress |
//! | [`state`] | what a law answers in each kind of test |
//! | [`fit`] | a law fitted to all tests together |
//! | [`rbf`], [`hyperelastic`] | the families of laws: moduli that depend on strain (Bickel 2010, 8.2); energies of the stretches |
//! | [`uncertainty`], [`bootstrap`] | how well the tests determine it |
//! | [`compare`] | several laws side by side, and which to trust where |
//! | [`record`] | all together as a material record |

pub mod bootstrap;
pub mod compare;
pub mod curve;
pub mod file;
pub mod fit;
pub mod hyperelastic;
pub mod rbf;
pub mod record;
pub mod state;
pub mod uncertainty;
