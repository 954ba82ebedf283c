//! Small laboratories as text, read.

use pliant::laboratory::read::Laboratory;
use pliant::units::document::Document;
use std::path::Path;

/// The card, a compressible base of 1 MPa, and the supports.
pub const HEAD: &str = r##"schema = 1

[material]
id = "small"
name = "Small block"
kind = "transversely-isotropic"
colour = "#a195ca"

[material.printability]
printable = true
process = "jetting"

[material.source]
citation = "made up"
licence = "none"

[base.law]
law = "linear"
young = "1 MPa"
poisson = 0.4
density = "1.2 g/cm3"

[[fixed]]
face = "bottom"

[[markers]]
face = "z+"
count = [5, 4]

[[markers]]
face = "y-"
count = [3, 3]
"##;

/// A solid block of 20 × 16 × 10 mm.
pub const SOLID: &str =
    "[solid]\nsize_mm = [20, 16, 10]\nelement_size = \"2 mm\"\n[specimen]\nelement_size = \"2 mm\"\n";

/// A block of tubes as large, 4 in each of 4 rows.
pub const TUBES: &str = "[tubes]\ndiameter = \"2 mm\"\nspacing = \"5 mm\"\narray = \"hexagonal\"\ncount = [4, 4]\nheight = \"10 mm\"\nlayers = 4\n";

/// A press on top.
pub const MIDDLE: &str = "[[probe]]\nname = \"middle\"\npoint_mm = [10, 8, 10]\ndirection = [0, 0, -1]\nradius = \"4 mm\"\nforces_n = [1, 3]\n";

/// A press from the side that drags upwards.
pub const SIDE: &str = "[[probe]]\nname = \"side\"\npoint_mm = [10, 0, 5]\ndirection = [0, 1, 0]\ndrags = [0, 1, 0.3]\nradius = \"4 mm\"\nforces_n = [2]\n";

/// The laboratory of some text in `folder`.
pub fn laboratory(folder: &Path, parts: &[&str]) -> Laboratory {
    let document = Document {
        file: folder.join("laboratory.toml"),
        text: parts.concat(),
    };
    Laboratory::read(document, Path::new("no-database")).unwrap()
}
