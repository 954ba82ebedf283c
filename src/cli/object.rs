//! `pliant object`: surfaces of simple objects as STL files, a look at any mesh file, and tetrahedra inside one.

use super::Answer;
use super::terminal::{say, warn};
use crate::geometry::cells::{Cells, LayeredRegion, Style};
use crate::geometry::files::vtu::{Array, VtuCells, VtuGrid, write_vtu};
use crate::geometry::files::{open_surface, write_stl};
use crate::geometry::shapes::{self, SeatOptions, ShapeError, SoleOptions};
use crate::geometry::tetrahedra::{MeshOptions, Quality, TetMesh, tetrahedral_mesh};
use crate::geometry::volume::Elements;
use crate::geometry::{Axis, Region, Solid, TriMesh};
use crate::math::Vec3;
use crate::units::whole_file::{folder_of, replace_file};
use crate::units::{LengthUnit, length};
use clap::{Args, Subcommand};
use miette::{IntoDiagnostic, WrapErr};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Makes the surface of a simple object, inspects any mesh file, or fills one with tetrahedra.
///
/// Lengths carry their unit: 250mm, "25 cm", 10in.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(subcommand)]
    object: Object,
    /// Answer in JSON, for machines
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Object {
    /// Makes a rectangular block with one corner at the origin
    Block(Block),
    /// Makes the sole of a flip-flop for a left foot: heel at the origin, toes towards +y, ground at z = 0
    Sole(Sole),
    /// Makes a round padded stool seat with a dimple in the middle
    Seat(Seat),
    /// Reads a mesh file and says how large it is, what is wrong with it, and whether it bounds a solid
    Inspect(Inspect),
    /// Fills a closed surface, clean or scanned, with tetrahedra that follow layers, and says how good they are
    Tetrahedra(Tetrahedra),
}

#[derive(Debug, Args)]
struct Out {
    /// The STL file to write (binary, millimetres)
    #[arg(long, value_name = "FILE.stl")]
    out: PathBuf,
}

#[derive(Debug, Args)]
struct Block {
    #[command(flatten)]
    to: Out,
    /// Extent along x
    #[arg(long, value_parser = length, default_value = "50mm")]
    width: f64,
    /// Extent along y
    #[arg(long, value_parser = length, default_value = "40mm")]
    depth: f64,
    /// Extent along z
    #[arg(long, value_parser = length, default_value = "25mm")]
    height: f64,
    /// Side of the triangles
    #[arg(long, value_parser = length, default_value = "2.5mm")]
    spacing: f64,
}

#[derive(Debug, Args)]
struct Sole {
    #[command(flatten)]
    to: Out,
    /// Heel to toes [default: 260mm]
    #[arg(long, value_parser = length)]
    length: Option<f64>,
    /// Largest width, at the ball of the foot [default: 98mm]
    #[arg(long, value_parser = length)]
    ball_width: Option<f64>,
    /// Largest width of the heel [default: 70mm]
    #[arg(long, value_parser = length)]
    heel_width: Option<f64>,
    /// Thickness at the heel [default: 22mm]
    #[arg(long, value_parser = length)]
    heel_thickness: Option<f64>,
    /// Thickness at the toes [default: 14mm]
    #[arg(long, value_parser = length)]
    toe_thickness: Option<f64>,
    /// Depth of the hollow for the heel [default: 1.5mm]
    #[arg(long, value_parser = length)]
    footbed_depth: Option<f64>,
    /// How far the tip rises off the ground [default: 0mm]
    #[arg(long, value_parser = length)]
    toe_spring: Option<f64>,
    /// Radius of the upper rim [default: 3mm]
    #[arg(long, value_parser = length)]
    rim_radius: Option<f64>,
    /// Side of the triangles [default: 6mm]
    #[arg(long, value_parser = length)]
    spacing: Option<f64>,
}

#[derive(Debug, Args)]
struct Seat {
    #[command(flatten)]
    to: Out,
    /// Diameter [default: 340mm]
    #[arg(long, value_parser = length)]
    diameter: Option<f64>,
    /// Height of the dome's apex [default: 60mm]
    #[arg(long, value_parser = length)]
    thickness: Option<f64>,
    /// How much higher the apex is than the rim [default: 10mm]
    #[arg(long, value_parser = length)]
    dome: Option<f64>,
    /// Radius of the dimple, and of the inner region [default: 45mm]
    #[arg(long, value_parser = length)]
    button_radius: Option<f64>,
    /// Depth of the dimple [default: 6mm]
    #[arg(long, value_parser = length)]
    button_depth: Option<f64>,
    /// Radius of the upper rim [default: 22mm]
    #[arg(long, value_parser = length)]
    rim_radius: Option<f64>,
    /// Side of the triangles [default: 11mm]
    #[arg(long, value_parser = length)]
    spacing: Option<f64>,
}

#[derive(Debug, Args)]
struct Inspect {
    /// An STL, OBJ, PLY or 3MF file
    file: PathBuf,
    /// The unit of the file's numbers: um, mm, cm, m, in, ft (a 3MF declares its own)
    #[arg(long)]
    unit: Option<LengthUnit>,
}

#[derive(Debug, Args)]
struct Tetrahedra {
    /// An STL, OBJ, PLY or 3MF file
    file: PathBuf,
    /// The unit of the file's numbers: um, mm, cm, m, in, ft (a 3MF declares its own)
    #[arg(long)]
    unit: Option<LengthUnit>,
    /// Length of the edges; diagonals are longer, up to 1.7 times
    #[arg(long, value_parser = length)]
    edge: f64,
    /// Equal layers, whose borders the tetrahedra follow
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=100))]
    layers: u16,
    /// The axis along which the layers are stacked
    #[arg(long, default_value = "z")]
    axis: Axis,
    /// No dihedral angle may be below this, nor above 180° less this, in degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 10.0)]
    least_angle: f64,
    /// The VTU file to write, with the layer of each tetrahedron as `cell`
    #[arg(long, value_name = "FILE.vtu")]
    out: Option<PathBuf>,
}

/// What is said about a mesh.
#[derive(Debug, Serialize)]
struct MeshSummary {
    file: String,
    nodes: usize,
    tetrahedra: usize,
    layers: u16,
    #[serde(flatten)]
    quality: Quality,
    warnings: Vec<String>,
}

/// What is said about a solid.
#[derive(Debug, Serialize)]
struct Summary {
    file: String,
    triangles: usize,
    size_mm: [f64; 3],
    volume_mm3: f64,
    area_mm2: f64,
    open_edges: usize,
    components: usize,
    warnings: Vec<String>,
}

/// Runs `pliant object`.
///
/// # Errors
/// Options that make no shape, a file that cannot be read or written.
pub fn run(arguments: &Arguments) -> miette::Result<Answer> {
    let json = arguments.json;
    match &arguments.object {
        Object::Block(block) => {
            let size = Vec3::new(block.width, block.depth, block.height);
            write(shapes::block(size, block.spacing), &block.to.out, json)
        }
        Object::Sole(sole) => write(shapes::flip_flop_sole(&sole.options()), &sole.to.out, json),
        Object::Seat(seat) => write(shapes::stool_seat(&seat.options()), &seat.to.out, json),
        Object::Inspect(arguments) => inspect(arguments, json),
        Object::Tetrahedra(arguments) => mesh(arguments, json),
    }
}

impl Sole {
    fn options(&self) -> SoleOptions {
        let default = SoleOptions::default();
        SoleOptions {
            length: self.length.unwrap_or(default.length),
            ball_width: self.ball_width.unwrap_or(default.ball_width),
            heel_width: self.heel_width.unwrap_or(default.heel_width),
            heel_thickness: self.heel_thickness.unwrap_or(default.heel_thickness),
            toe_thickness: self.toe_thickness.unwrap_or(default.toe_thickness),
            footbed_depth: self.footbed_depth.unwrap_or(default.footbed_depth),
            toe_spring: self.toe_spring.unwrap_or(default.toe_spring),
            rim_radius: self.rim_radius.unwrap_or(default.rim_radius),
            spacing: self.spacing.unwrap_or(default.spacing),
        }
    }
}

impl Seat {
    fn options(&self) -> SeatOptions {
        let default = SeatOptions::default();
        SeatOptions {
            diameter: self.diameter.unwrap_or(default.diameter),
            thickness: self.thickness.unwrap_or(default.thickness),
            dome: self.dome.unwrap_or(default.dome),
            button_radius: self.button_radius.unwrap_or(default.button_radius),
            button_depth: self.button_depth.unwrap_or(default.button_depth),
            rim_radius: self.rim_radius.unwrap_or(default.rim_radius),
            spacing: self.spacing.unwrap_or(default.spacing),
        }
    }
}

fn write(mesh: Result<TriMesh, ShapeError>, out: &Path, json: bool) -> miette::Result<Answer> {
    let mesh = mesh.into_diagnostic()?;
    save(&mesh, out)
        .into_diagnostic()
        .wrap_err_with(|| format!("{} could not be written", out.display()))?;
    let solid = Solid::new(mesh).into_diagnostic()?;
    report(&summary(out, &solid, Vec::new()), json)
}

/// Writes the file whole.
fn save(mesh: &TriMesh, out: &Path) -> std::io::Result<()> {
    let mut bytes = Vec::new();
    write_stl(mesh, &mut bytes)?;
    replace_in_its_folder(out, &bytes)
}

/// Writes the file whole. A folder that is missing was mistyped, so none is made.
fn replace_in_its_folder(out: &Path, bytes: &[u8]) -> std::io::Result<()> {
    if !folder_of(out).is_dir() {
        return Err(std::io::Error::new(
            std::io::ErrorKind::NotFound,
            "there is no such folder: make it first, or name another",
        ));
    }
    replace_file(out, bytes)
}

/// More of the volume lost or won than this is said as a warning.
const VOLUME_WARNING: f64 = 0.02;

fn mesh(arguments: &Tetrahedra, json: bool) -> miette::Result<Answer> {
    if let Some(out) = &arguments.out
        && out.extension().is_none_or(|e| !e.eq_ignore_ascii_case("vtu"))
    {
        return Err(miette::miette!(
            "{}: expected a name that ends in .vtu",
            out.display()
        ));
    }
    let file = open_surface(&arguments.file, arguments.unit).into_diagnostic()?;
    let solid = Solid::new(file.mesh).into_diagnostic()?;
    let cells = flat_layers(&solid, arguments.axis, arguments.layers);
    let options = MeshOptions {
        least_dihedral_deg: arguments.least_angle,
        ..MeshOptions::new(arguments.edge)
    };
    let made = tetrahedral_mesh(&solid, Some(&cells), &options).into_diagnostic()?;
    if let Some(out) = &arguments.out {
        save_mesh(&made, out).wrap_err_with(|| format!("{} could not be written", out.display()))?;
    }
    let lost = made.quality.volume_error;
    let mut warnings: Vec<String> = file.notes.into_iter().chain(solid.health().warnings()).collect();
    if lost.abs() > VOLUME_WARNING {
        let percent = 100.0 * lost;
        warnings.push(format!("the volume is off by {percent:+.1} %: use shorter edges"));
    }
    let summary = MeshSummary {
        file: arguments.file.display().to_string(),
        nodes: made.mesh.nodes.len(),
        tetrahedra: made.mesh.elements.len(),
        layers: arguments.layers,
        quality: made.quality,
        warnings,
    };
    report_mesh(&summary, json)
}

/// The whole object in equal layers across an axis.
fn flat_layers(solid: &Solid, axis: Axis, layers: u16) -> Cells {
    let (low, high) = solid.bounds();
    let (from, to) = (low[axis.index()], high[axis.index()]);
    let border = |k: u16| from + (to - from) * f64::from(k) / f64::from(layers);
    let whole = LayeredRegion {
        name: "layer".into(),
        region: Region::Everything,
        axis,
        style: Style::Flat,
        borders: (0..=layers).map(border).collect(),
        across: Default::default(),
    };
    Cells::new(vec![whole], None)
}

fn save_mesh(made: &TetMesh, out: &Path) -> miette::Result<()> {
    let Elements::Tetrahedra(tets) = &made.mesh.elements else {
        return Err(miette::miette!("the mesh is not of tetrahedra"));
    };
    let cell: Vec<i32> = made.cell_of_element.iter().map(|&c| i32::from(c)).collect();
    let grid = VtuGrid {
        points: &made.mesh.nodes,
        cells: VtuCells::Tetrahedra(tets),
    };
    let mut bytes = Vec::new();
    write_vtu(&mut bytes, &grid, &[], &[("cell", Array::Integers(&cell))]).into_diagnostic()?;
    replace_in_its_folder(out, &bytes).into_diagnostic()
}

fn report_mesh(summary: &MeshSummary, json: bool) -> miette::Result<Answer> {
    if json {
        say(&serde_json::to_string_pretty(summary).into_diagnostic()?);
        return Ok(Answer::Done);
    }
    let quality = &summary.quality;
    say(&format!(
        "{}: {} tetrahedra, {} nodes",
        summary.file, summary.tetrahedra, summary.nodes
    ));
    say(&format!(
        "dihedral angles {:.1}° to {:.1}°; volume {:.1} cm³, {:+.2} % off the surface's",
        quality.least_dihedral_deg,
        quality.greatest_dihedral_deg,
        quality.volume_mm3 / 1000.0,
        // Adding zero turns −0 into 0.
        (1e4 * quality.volume_error).round() / 100.0 + 0.0
    ));
    say(&format!(
        "off the surface by up to {:.2} mm, off borders between layers by up to {:.2} mm",
        quality.surface_distance_mm, quality.border_distance_mm
    ));
    for warning in &summary.warnings {
        warn(&format!("warning: {warning}"));
    }
    Ok(Answer::Done)
}

fn inspect(arguments: &Inspect, json: bool) -> miette::Result<Answer> {
    let file = open_surface(&arguments.file, arguments.unit).into_diagnostic()?;
    match Solid::new(file.mesh) {
        Ok(solid) => report(&summary(&arguments.file, &solid, file.notes), json),
        Err(error) => {
            if json {
                say(&serde_json::json!({ "file": arguments.file, "refused": error.to_string() }).to_string());
            } else {
                warn(&format!("{}: {error}", arguments.file.display()));
            }
            Ok(Answer::Negative)
        }
    }
}

fn summary(file: &Path, solid: &Solid, notes: Vec<String>) -> Summary {
    let health = solid.health();
    Summary {
        file: file.display().to_string(),
        triangles: solid.mesh().triangles.len(),
        size_mm: solid.size().into(),
        volume_mm3: solid.volume(),
        area_mm2: solid.mesh().area(),
        open_edges: health.open_edges,
        components: health.components,
        warnings: notes.into_iter().chain(health.warnings()).collect(),
    }
}

fn report(summary: &Summary, json: bool) -> miette::Result<Answer> {
    if json {
        say(&serde_json::to_string_pretty(summary).into_diagnostic()?);
        return Ok(Answer::Done);
    }
    let [x, y, z] = summary.size_mm;
    say(&format!("{}: {x:.1} × {y:.1} × {z:.1} mm", summary.file));
    say(&format!(
        "{:.1} cm³, {:.1} cm², {} triangles in {}",
        summary.volume_mm3 / 1000.0,
        summary.area_mm2 / 100.0,
        summary.triangles,
        if summary.components == 1 {
            "one piece".into()
        } else {
            format!("{} pieces", summary.components)
        }
    ));
    for warning in &summary.warnings {
        warn(&format!("warning: {warning}"));
    }
    Ok(Answer::Done)
}
