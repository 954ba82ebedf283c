//! The parts of a layout: one closed mesh per material.

use super::export::ExportPart;
use super::tiling::{Tiling, TilingError, TilingOptions, tile};
use crate::design::goal::Goal;
use crate::geometry::cutting::LevelSet;
use crate::math::Vec3;

/// Which side of a plane through the object is left out, to look inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// A point of the plane \[mm\].
    pub point: Vec3,
    /// Normal of the plane; the side that it points to is left out.
    pub normal: Vec3,
}

/// Tiles the goal's object by the materials of `layout`: part labels are indices into the palette.
///
/// # Errors
/// [`TilingError`]: a lattice too fine, or a volume that is off by more than the tolerance.
pub fn tile_layout(
    goal: &Goal,
    layout: &[u8],
    cut: Option<Cut>,
    options: &TilingOptions,
) -> Result<Tiling, TilingError> {
    let solid = &goal.setup.object.solid;
    let borders = goal.setup.cells.borders();
    let plane = cut.map(|cut| move |p: &Vec3| (p - cut.point).dot(&cut.normal));
    let mut level_sets: Vec<LevelSet> = borders.iter().map(|b| b.as_ref() as LevelSet).collect();
    if let Some(plane) = &plane {
        level_sets.push(plane);
    }
    let label = |p: &Vec3| {
        if plane.as_ref().is_some_and(|plane| plane(p) > 0.0) {
            return None;
        }
        goal.setup.cells.cell_at(p).map(|cell| layout[cell] as usize)
    };
    tile(
        &|p: &Vec3| solid.signed_distance(p),
        solid.bounds(),
        &level_sets,
        &label,
        options,
    )
}

/// How finely to tile: by the narrowest cell, checked against the object's own volume.
pub fn export_options(goal: &Goal) -> TilingOptions {
    let solid = &goal.setup.object.solid;
    let thinnest = goal
        .setup
        .cells
        .regions()
        .iter()
        .map(|r| goal.setup.cells.narrowest(r, solid))
        .fold(f64::INFINITY, f64::min);
    TilingOptions {
        thinnest_mm: (thinnest.is_finite() && thinnest > 0.0).then_some(thinnest),
        volume_mm3: Some(solid.volume()),
        ..TilingOptions::default()
    }
}

/// The parts with their materials' names and colours, ready to be written.
pub fn export_parts(goal: &Goal, tiling: Tiling) -> Vec<ExportPart> {
    tiling
        .parts
        .into_iter()
        .map(|part| {
            let record = &goal.palette[part.label].record;
            ExportPart {
                material_id: record.id.clone(),
                material_name: record.name.clone(),
                colour: rgb(&record.colour),
                mesh: part.mesh,
                volume_mm3: part.volume_mm3,
            }
        })
        .collect()
}

/// `#rrggbb` as red, green, blue; grey if it is no colour, which `db check` reports.
pub fn rgb(colour: &str) -> [u8; 3] {
    let channel = |k: usize| u8::from_str_radix(colour.get(1 + 2 * k..3 + 2 * k)?, 16).ok();
    match (channel(0), channel(1), channel(2)) {
        (Some(r), Some(g), Some(b)) => [r, g, b],
        _ => [128; 3],
    }
}
