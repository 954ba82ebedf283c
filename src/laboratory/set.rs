//! The measurement set of a laboratory's presses.

use super::markers::Marker;
use super::measure::Press;
use super::noise::Errors;
use super::read::Laboratory;
use crate::fem::example::MeasuredPoint;
use crate::fem::measurement_set::write::{BlockSet, BlockSpecimen};
use crate::fem::measurement_set::{Experiment, Origin};
use crate::fem::setup::FixedText;
use crate::math::Vec3;
use std::fmt::Write as _;

/// The set: the block as one homogeneous material, with what the `markers` of the fine structure did in the `presses` of the
/// laboratory's probes. A press that reached no level is left out; noise is added in the order of probes, levels and markers.
pub fn measurement_set(laboratory: &Laboratory, markers: &[Marker], presses: &[Press]) -> BlockSet {
    let mut errors = laboratory.noise.as_ref().map(Errors::new);
    let mut experiments = Vec::new();
    for (probe, press) in laboratory.probes.iter().zip(presses) {
        let levels = press.markers_mm.len();
        if levels == 0 {
            continue;
        }
        let mut points: Vec<MeasuredPoint> = markers.iter().map(|m| measured(m.place)).collect();
        for level in &press.markers_mm {
            for (point, moved) in points.iter_mut().zip(level) {
                let mut read = |x: f64| Some(x + errors.as_mut().map_or(0.0, Errors::next_mm));
                point
                    .displacements_mm
                    .push(moved.iter().map(|&x| read(x)).collect());
            }
        }
        experiments.push(Experiment {
            name: probe.name.clone(),
            contact: probe.contact,
            forces: probe.forces[..levels].to_vec(),
            deviations_mm: vec![vec![laboratory.deviation_mm(); levels]; points.len()],
            points,
            weight: 1.0,
            held_out: probe.held_out,
        });
    }
    BlockSet {
        origin: Origin::Computed(origin(laboratory)),
        material: laboratory.card.clone(),
        specimen: BlockSpecimen {
            size_mm: laboratory.fine.size,
            element_size_mm: laboratory.element_size_mm,
            tetrahedra: false,
            fixed: laboratory.fixed.iter().map(fixed).collect(),
        },
        experiments,
    }
}

fn measured(place: Vec3) -> MeasuredPoint {
    MeasuredPoint {
        place,
        directions: vec![Vec3::x(), Vec3::y(), Vec3::z()],
        displacements_mm: Vec::new(),
    }
}

fn origin(laboratory: &Laboratory) -> String {
    let fine = &laboratory.fine;
    let noise = match laboratory.noise {
        None => "no noise".to_string(),
        Some(n) => format!("noise of {} mm, seed {}", n.deviation_mm, n.seed),
    };
    format!(
        "pliant {} measure: {}; base material {}; {} hexahedra, {} nodes; {noise}",
        env!("CARGO_PKG_VERSION"),
        laboratory.words,
        laboratory.base.words,
        fine.mesh.elements.len(),
        fine.mesh.nodes.len()
    )
}

/// A support as TOML.
pub(super) fn fixed(own: &FixedText) -> String {
    let mut out = String::from("[[fixed]]\n");
    if let Some(face) = &own.face {
        let _ = writeln!(out, "face = {:?}", face.get_ref());
    }
    if let Some(corners) = &own.box_mm {
        let _ = writeln!(out, "box_mm = {:?}", corners.get_ref());
    }
    if let Some(components) = &own.components {
        let _ = writeln!(out, "components = {:?}", components.get_ref());
    }
    out.push('\n');
    out
}
