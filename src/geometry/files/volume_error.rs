//! What can be wrong with a file of a volume mesh.

use crate::math::Vec3;
use crate::units::LengthUnit;
use std::path::PathBuf;
use thiserror::Error;

/// A volume mesh that cannot be used. Each message says where, what was found, and how to mend it.
#[derive(Debug, Error)]
pub enum VolumeFileError {
    /// An ending that names no format.
    #[error("{name}: expected a volume mesh ending in .msh (Gmsh), .vtu (VTK) or .json (arrays)")]
    UnknownFormat {
        /// The file's name.
        name: String,
    },
    /// The system refused.
    // The cause stands in the message, and is no `source` as well, or reports would say it twice.
    #[error("{path}: cannot be read: {cause}")]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// An error inside the named file.
    #[error("{path}: {cause}")]
    In {
        /// The file.
        path: PathBuf,
        /// The error.
        cause: Box<VolumeFileError>,
    },
    /// Something else stands where the format wants something.
    #[error("{place}: found {found}, expected {expected}")]
    Syntax {
        /// Line, byte or array.
        place: String,
        /// What stands there.
        found: String,
        /// What should.
        expected: String,
    },
    /// A coordinate that is not a number.
    #[error("{place}: the coordinate {value} is not a finite number: mend or remove that node")]
    NotFinite {
        /// Line, byte or node.
        place: String,
        /// What was found.
        value: String,
    },
    /// An element names a node that is not there.
    #[error("{place}: element {element} names node {node}, which the file does not hold: {}", span(.low, .high))]
    MissingNode {
        /// Line, byte or array.
        place: String,
        /// Number of the element in the file.
        element: u64,
        /// What it names.
        node: String,
        /// Lowest number of a node.
        low: u64,
        /// Highest.
        high: u64,
    },
    /// Something that is in order, but not read here.
    #[error("{place}: {what} is not read: {mend}")]
    Unsupported {
        /// Line, byte or array.
        place: String,
        /// What was met.
        what: String,
        /// What to do.
        mend: String,
    },
    /// The file ends too early.
    #[error("the file is cut off in {what}: save it again")]
    Truncated {
        /// What was being read.
        what: String,
    },
    /// No tetrahedra, no hexahedra.
    #[error(
        "the file holds no tetrahedra and no hexahedra, but {found}: save the volume's elements too (in Gmsh: mesh in 3D; with physical groups, make one of the volume)"
    )]
    NoVolume {
        /// What it holds.
        found: String,
    },
    /// Tetrahedra and hexahedra, or worse.
    #[error(
        "the file holds {found}: one mesh holds one kind of element here; mesh it with tetrahedra alone, or hexahedra alone"
    )]
    Mixed {
        /// What it holds.
        found: String,
    },
    /// An element without volume.
    #[error(
        "element {element} near ({x:.4}, {y:.4}, {z:.4}) mm is flat: its volume is {volume_mm3:.3e} mm³ at a longest edge of {edge_mm:.3e} mm; mesh again, or remove it",
        x = place.x, y = place.y, z = place.z
    )]
    Flat {
        /// Number of the element in the file.
        element: u64,
        /// Its first node \[mm\].
        place: Vec3,
        /// Its volume \[mm³\].
        volume_mm3: f64,
        /// Its longest edge \[mm\].
        edge_mm: f64,
    },
    /// A hexahedron that is turned inside out in a part of it.
    #[error(
        "hexahedron {element} near ({x:.4}, {y:.4}, {z:.4}) mm is folded: its Jacobian determinant has both signs (smallest {least:.3e}); mend its nodes' order or mesh again",
        x = place.x, y = place.y, z = place.z
    )]
    Folded {
        /// Number of the element in the file.
        element: u64,
        /// Its first node \[mm\].
        place: Vec3,
        /// Smallest Jacobian determinant over its integration points, as a share of the largest in size.
        least: f64,
    },
    /// A node of no element.
    #[error(
        "node {node} at ({x:.4}, {y:.4}, {z:.4}) mm belongs to no element ({count} such nodes): remove it, or save the elements that hold it",
        x = place.x, y = place.y, z = place.z
    )]
    LooseNode {
        /// Number of the node in the file.
        node: u64,
        /// Where it is \[mm\].
        place: Vec3,
        /// How many there are.
        count: usize,
    },
    /// More than numbers of 32 bits can name.
    #[error("the file holds {found} {what}, more than {most}: use a coarser mesh")]
    TooLarge {
        /// Nodes or elements.
        what: &'static str,
        /// How many.
        found: u64,
        /// How many may be.
        most: u64,
    },
    /// No unit.
    #[error(
        "the file does not say its unit, and the mesh measures {x} × {y} × {z} in it: state the unit, for instance unit = \"mm\""
    )]
    UnitMissing {
        /// Extent.
        x: f64,
        /// Extent.
        y: f64,
        /// Extent.
        z: f64,
    },
    /// A size that no soft object has.
    #[error("with the unit {unit} the mesh is {largest_mm:.4e} mm long, where 0.5 mm to 3 m is expected{}", guess(*.largest_mm / .unit.to_mm()))]
    ImplausibleSize {
        /// Largest extent \[mm\].
        largest_mm: f64,
        /// The unit that was stated.
        unit: LengthUnit,
    },
}

fn span(low: &u64, high: &u64) -> String {
    if low > high {
        "it has no nodes".into()
    } else {
        format!("its nodes are numbered {low} to {high}; save it again with all its nodes")
    }
}

fn guess(raw: f64) -> String {
    let fits = |u: &&LengthUnit| super::volume::SIZES.contains(&(raw * u.to_mm()));
    let units: Vec<&str> = LengthUnit::ALL.iter().filter(fits).map(|u| u.name()).collect();
    if units.is_empty() {
        ": no unit makes it the size of an object, check the file".into()
    } else {
        format!(": is the unit {}?", units.join(" or "))
    }
}
