//! `pliant simulate` for a scene on a volume mesh.

use super::simulate::{Arguments, keep};
use super::terminal::{say, warn};
use super::{Answer, stop};
use crate::design::found::sha256;
use crate::fem::volume_scene::record::{LevelFields, VolumeCaseRecord, series, write_level_vtu};
use crate::fem::volume_scene::stage::VolumeStage;
use crate::fem::volume_scene::{FineSurface, VolumeScene};
use crate::geometry::files::write_stl;
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;
use crate::units::document::Document;
use miette::{IntoDiagnostic, WrapErr};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Simulates the scene in `document`.
///
/// # Errors
/// A scene, a material or a mesh that is wrong; files that cannot be written.
pub fn run(arguments: &Arguments, document: Document) -> miette::Result<Answer> {
    let began = Instant::now();
    let scene = VolumeScene::read(document, &arguments.db).into_diagnostic()?;
    let stage = VolumeStage::new(&scene).into_diagnostic()?;
    if !arguments.json {
        say(&format!(
            "{}: {} elements, {} nodes, {} regions; {} load cases",
            scene.name,
            scene.file.mesh.elements.len(),
            scene.file.mesh.nodes.len(),
            scene.regions.len(),
            stage.cases.len()
        ));
    }
    let flag = stop::flag();
    let outcomes = stage
        .simulate(&scene.options, scene.steps, &|| flag.load(Ordering::Relaxed))
        .into_diagnostic()
        .wrap_err_with(|| scene.document.file.display().to_string())?;
    let folder = arguments.out.clone().unwrap_or_else(|| {
        let beside = arguments.scene.parent().unwrap_or(Path::new(""));
        beside.join("simulated")
    });
    let mut records = Vec::new();
    for (case, outcome) in stage.cases.iter().zip(&outcomes) {
        let fields: Vec<LevelFields> = outcome
            .levels
            .iter()
            .map(|u| LevelFields::new(&scene, &stage, case, u))
            .collect();
        let mut files = Vec::new();
        for (k, own) in fields.iter().enumerate() {
            let mut bytes = Vec::new();
            write_level_vtu(&mut bytes, &scene, outcome, k, own).into_diagnostic()?;
            let stem = if k + 1 == fields.len() {
                case.name.clone()
            } else {
                format!("{}-{:03}", case.name, k + 1)
            };
            let name = format!("{stem}.vtu");
            keep(&folder.join(&name), &bytes)?;
            if let Some(surface) = &scene.surface {
                let bytes = moved_surface(surface, &outcome.levels[k])?;
                keep(&folder.join(format!("{stem}-surface.stl")), &bytes)?;
            }
            files.push((case.loading.level(k), name));
        }
        if files.len() > 1 {
            keep(
                &folder.join(format!("{}.pvd", case.name)),
                series(&files).as_bytes(),
            )?;
        }
        records.push(VolumeCaseRecord::new(&scene, &stage, case, outcome, &fields));
    }
    let mut warnings = scene.warnings();
    warnings.extend(records.iter().flat_map(|r| r.warnings.iter().cloned()));
    let record = record(&scene, &records, &warnings);
    keep(&folder.join("simulated.json"), format!("{record:#}\n").as_bytes())?;
    tell(
        arguments,
        record,
        &records,
        &warnings,
        &folder,
        began.elapsed().as_secs_f64(),
    );
    let complete = records.iter().all(|r| r.complete);
    Ok(if complete { Answer::Done } else { Answer::Negative })
}

/// The fine surface where the mesh's nodes are displaced by `u`, as STL.
fn moved_surface(surface: &FineSurface, u: &[Vec3]) -> miette::Result<Vec<u8>> {
    let moved = TriMesh {
        vertices: surface.embedding.displaced(u).into_diagnostic()?,
        triangles: surface.mesh.triangles.clone(),
    };
    let mut bytes = Vec::new();
    write_stl(&moved, &mut bytes).into_diagnostic()?;
    Ok(bytes)
}

/// `simulated.json`: no times, so that equal runs leave equal files.
fn record(scene: &VolumeScene, records: &[VolumeCaseRecord], warnings: &[String]) -> Value {
    let regions = scene.regions.iter().map(|region| {
        json!({
            "name": region.name,
            "material": scene.materials[region.material].id,
            "material_id": region.material,
            "elements": region.elements,
        })
    });
    json!({
        "schema": 1,
        "pliant": env!("CARGO_PKG_VERSION"),
        "name": scene.name,
        "scene": scene.document.file,
        "scene_sha256": sha256(scene.document.text.as_bytes()),
        "elements": scene.file.mesh.elements.len(),
        "nodes": scene.file.mesh.nodes.len(),
        "node_numbers": scene.file.node_numbers,
        "element_numbers": scene.file.element_numbers,
        "tolerance": scene.options.tolerance,
        "steps": scene.steps,
        "materials": scene.materials.iter().map(|m| &m.id).collect::<Vec<_>>(),
        "regions": regions.collect::<Vec<_>>(),
        "cases": records,
        "warnings": warnings,
    })
}

fn tell(
    arguments: &Arguments,
    mut record: Value,
    records: &[VolumeCaseRecord],
    warnings: &[String],
    folder: &PathBuf,
    seconds: f64,
) {
    for warning in warnings {
        warn(&format!("warning: {warning}"));
    }
    if arguments.json {
        record["folder"] = json!(folder);
        record["seconds"] = json!(seconds);
        say(&format!("{record:#}"));
        return;
    }
    for record in records {
        let Some(level) = record.levels.last() else {
            say(&format!("{}: no level was reached", record.name));
            continue;
        };
        let size = |u: &[f64; 3]| u.iter().map(|c| c * c).sum::<f64>().sqrt();
        let most = level.displacements_mm.iter().map(size).fold(0.0, f64::max);
        say(&format!(
            "{}: {} levels, largest move {most:.4} mm, residual {:.1e}, {} factorisations",
            record.name,
            record.levels.len(),
            record.residual,
            record.work.factorisations
        ));
        for support in &level.supports {
            say(&format!(
                "  {}: force {} N",
                support.support,
                rounded(support.force_n)
            ));
        }
        for body in &level.bodies {
            say(&format!(
                "  {}: travel {:.4} mm, force {} N on {:.2} mm², pressure {:.4} MPa, at most {:.4} MPa",
                body.name,
                body.travel_mm,
                rounded(body.force_n),
                body.area_mm2,
                body.mean_pressure_mpa,
                body.largest_pressure_mpa
            ));
        }
    }
    say(&format!("files  {}", folder.display()));
}

/// Three components to four decimals.
fn rounded(force_n: [f64; 3]) -> String {
    // Adding zero turns −0 into 0.
    let [x, y, z] = force_n.map(|f| (1e4 * f).round() / 1e4 + 0.0);
    format!("({x:.4}, {y:.4}, {z:.4})")
}
