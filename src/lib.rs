//! pliant designs and fabricates deformable objects.
//!
//! A soft object is measured, materials are fitted to the measurements, a database keeps them, a search finds the
//! layout of materials inside an object that behaves like the original, and a writer hands the layout to a
//! multi-material printer (Bickel 2010, chapter 8, figure 8.1). The folders are the stages of that way; each may use
//! only what stands on the floors below it, which `tests/architecture.rs` checks.
//!
//! | floor | folder | holds | may use |
//! |---|---|---|---|
//! | 0 | [`math`] | small dense algebra, polar decomposition, radial basis functions | – |
//! | 0 | [`units`] | N, mm, MPa inside; quantities with units and whole files at the borders | – |
//! | 1 | [`geometry`] | triangle and hexahedral meshes, inside and distance queries, regions and cells, meshing, mesh files | math, units |
//! | 1 | [`numerics`] | sparse patterns and factorisations, accelerated fixed points, least squares | math |
//! | 2 | [`material`] | constitutive laws at a point; the material record and the database over `materials-db/` | math, units |
//! | 3 | [`fem`] | elements, assembly, loads, the quasi-static solve; scenes and force–displacement examples | geometry, numerics, material, math, units |
//! | 4 | [`laboratory`] | fine structures under a probe, computed to measurement sets | fem, material, geometry, numerics, math, units |
//! | 5 | [`fitting`] | measured curves to material parameters | fem, material, numerics, geometry, math, units |
//! | 6 | [`design`] | goals, layouts and their errors, bounds, search | fem, material, numerics, geometry, math, units |
//! | 7 | [`fabrication`] | a layout to per-material meshes, 3MF, STL | design, material, geometry, math, units |
//! | 8 | [`report`] | plots, tables, pages, pictures made from the results above | all below |
//! | 9 | [`verify`] | checks of the mechanics against closed forms, other programs and measurements | all below |
//! | 10 | [`cli`] | one file per subcommand: arguments, checked options, library, report | all |

pub mod cli;
pub mod design;
pub mod fabrication;
pub mod fem;
pub mod fitting;
pub mod geometry;
pub mod laboratory;
pub mod material;
pub mod math;
pub mod numerics;
pub mod report;
pub mod units;
pub mod verify;
