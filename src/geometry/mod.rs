//! Shapes: surfaces, solids, and the files that hold them.
//!
//! A [`surface::TriMesh`] is read from a mesh file by [`files`] or made by [`shapes`]; a [`solid::Solid`] answers what is
//! inside it, how far its surface is, and where grid lines run through it, also when the surface is as dirty as scans are;
//! a [`region::Region`] names a part of space. Rooms:
//!
//! | room | holds |
//! |---|---|
//! | [`axis`] | x, y, z and their cyclic order |
//! | [`surface`] | the triangle mesh |
//! | [`files`] | surfaces: STL, OBJ, PLY, 3MF; volumes: MSH, VTU, JSON |
//! | [`weld`], [`health`], [`orientation`] | what a surface needs before it can bound a solid |
//! | [`tree`], [`winding`], [`closest`], [`crossings`] | the hierarchy over triangles and its queries |
//! | [`solid`] | the object's shape, with inside and outside |
//! | [`region`] | boxes, cylinders and solids as level sets |
//! | [`cells`] | regions cut into layers |
//! | [`cutting`] | a lattice of tetrahedra cut along level sets |
//! | [`heights`] | lower and upper surface along an axis |
//! | [`volume`], [`grid`] | volume meshes; the grid of hexahedra over a solid |
//! | [`tetrahedra`] | tetrahedral meshes of solids that follow borders |
//! | [`embedding`] | the element that contains a point; fine surfaces that follow volume meshes |
//! | [`boundary`] | a volume mesh's faces |
//! | [`ray`] | where a line meets a surface |
//! | [`shapes`] | generators of the objects that ship with pliant |

pub mod axis;
pub mod boundary;
pub mod cells;
pub mod closest;
pub mod crossings;
pub mod cutting;
pub mod embedding;
pub mod files;
pub mod grid;
pub mod health;
pub mod heights;
pub mod orientation;
pub mod ray;
pub mod region;
pub mod shapes;
pub mod solid;
pub mod surface;
pub mod tetrahedra;
pub mod tree;
pub mod volume;
pub mod weld;
pub mod winding;

pub use axis::Axis;
pub use region::Region;
pub use solid::Solid;
pub use surface::TriMesh;
