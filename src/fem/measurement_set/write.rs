//! A measurement set as a file: `ID.toml`, and beside it a folder `ID/` with a CSV for each example.

use super::{Experiment, MaterialCard, Origin, SCHEMA};
use crate::material::record::Kind;
use crate::math::Vec3;
use crate::units::whole_file::replace_file;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

/// How the specimen and its supports are to stand in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockSpecimen {
    /// Edges of the block \[mm\].
    pub size_mm: Vec3,
    /// Edge length of the elements that a fit should use \[mm\].
    pub element_size_mm: f64,
    /// Hexahedra or tetrahedra.
    pub tetrahedra: bool,
    /// The supports as TOML tables, each `[[fixed]]` with its keys.
    pub fixed: String,
}

/// A set of a block, to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockSet {
    /// Where the numbers come from.
    pub origin: Origin,
    /// The material.
    pub material: MaterialCard,
    /// The specimen.
    pub specimen: BlockSpecimen,
    /// What was done to it and measured.
    pub experiments: Vec<Experiment>,
}

/// Writes a set to `folder/ID.toml` and `folder/ID/EXAMPLE.csv`; the former last, so that a set that can be read is whole. Answers
/// the set's file.
///
/// # Errors
/// What the system says.
pub fn write_set(set: &BlockSet, folder: &Path) -> io::Result<PathBuf> {
    let id = &set.material.id;
    for experiment in &set.experiments {
        let file = folder
            .join(id)
            .join(format!("{}.csv", file_stem(&experiment.name)));
        replace_file(&file, table(experiment).as_bytes())?;
    }
    let file = folder.join(format!("{id}.toml"));
    replace_file(&file, toml_text(set).as_bytes())?;
    Ok(file)
}

/// A name as part of a path: letters, digits and hyphens.
fn file_stem(name: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_lowercase()
        } else {
            '-'
        }
    };
    name.chars().map(plain).collect()
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_string()).to_string()
}

fn list(values: impl IntoIterator<Item = f64>) -> String {
    let values: Vec<String> = values.into_iter().map(|v| format!("{v}")).collect();
    format!("[{}]", values.join(", "))
}

fn toml_text(set: &BlockSet) -> String {
    let mut out = String::new();
    out.push_str("# A measurement set of pliant; docs/formats.md describes the fields.\n");
    let _ = writeln!(out, "schema = {SCHEMA}");
    match &set.origin {
        Origin::Measured => out.push_str("origin = \"measured\"\n"),
        Origin::Computed(from) => {
            let _ = writeln!(out, "origin = \"computed\"\ncomputed_from = {}", quoted(from));
        }
    }
    material(&set.material, &mut out);
    let specimen = &set.specimen;
    let elements = if specimen.tetrahedra {
        "tetrahedra"
    } else {
        "hexahedra"
    };
    let _ = write!(
        out,
        "\n[specimen]\nsize_mm = {}\nelement_size = \"{} mm\"\nelements = \"{elements}\"\n\n{}\n",
        list(specimen.size_mm.iter().copied()),
        specimen.element_size_mm,
        specimen.fixed.trim_end()
    );
    for experiment in &set.experiments {
        let contact = &experiment.contact;
        let _ = write!(
            out,
            "\n[[example]]\nname = {}\npoint_mm = {}\ndirection = {}\nradius = \"{} mm\"\nfile = {}\n",
            quoted(&experiment.name),
            list(contact.point.iter().copied()),
            list(contact.direction.iter().copied()),
            contact.radius_mm,
            quoted(&format!(
                "{}/{}.csv",
                set.material.id,
                file_stem(&experiment.name)
            ))
        );
        if experiment.weight != 1.0 {
            let _ = writeln!(out, "weight = {}", experiment.weight);
        }
        if experiment.held_out {
            out.push_str("held_out = true\n");
        }
    }
    out
}

fn material(card: &MaterialCard, out: &mut String) {
    let assumptions: Vec<String> = card.assumptions.iter().map(|a| quoted(a)).collect();
    let _ = write!(
        out,
        "\n[material]\nid = {}\nname = {}\nkind = {}\n",
        quoted(&card.id),
        quoted(&card.name),
        quoted(card.kind.word())
    );
    if card.kind == Kind::TransverselyIsotropic {
        let _ = writeln!(out, "axis = {}", list(card.axis.iter().copied()));
    }
    let _ = write!(
        out,
        "colour = {}\ndensity_g_per_cm3 = {}\nassumptions = [{}]\n\n[material.printability]\nprintable = {}\nprocess = {}\n\n[material.source]\ncitation = {}\nlicence = {}\n",
        quoted(&card.colour),
        card.density_g_per_cm3,
        assumptions.join(", "),
        card.printability.printable,
        quoted(&card.printability.process),
        quoted(&card.source.citation),
        quoted(&card.source.licence)
    );
    if let Some(link) = &card.source.link {
        let _ = writeln!(out, "link = {}", quoted(link));
    }
}

/// The CSV of an example. Points that were measured along the three axes alone have a place there; displacements have six
/// digits after the point.
fn table(experiment: &Experiment) -> String {
    let mut out = String::from("fx_n,fy_n,fz_n,x_mm,y_mm,z_mm,dx_mm,dy_mm,dz_mm,sd_mm\n");
    for (level, force) in experiment.forces.iter().enumerate() {
        for (point, deviations) in experiment.points.iter().zip(&experiment.deviations_mm) {
            let (x, moved) = (point.place, &point.displacements_mm[level]);
            if moved.len() != 3 || moved.iter().all(Option::is_none) {
                continue;
            }
            let _ = write!(out, "{},{},{},{},{},{}", force.x, force.y, force.z, x.x, x.y, x.z);
            for d in moved {
                match d {
                    Some(d) => {
                        let _ = write!(out, ",{d:.6}");
                    }
                    None => out.push(','),
                }
            }
            let _ = writeln!(out, ",{}", deviations[level]);
        }
    }
    out
}
