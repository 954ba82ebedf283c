//! Markers on the faces of the fine mesh.
//!
//! A grid of spots is laid over a face; each becomes a marker at the nearest place with material, as a marker cannot be glued
//! into a hole. A spot with no material within half a step of the grid gets none, and no place gets two.

use super::patch::outer_faces;
use super::read::{Face, MarkerGrid};
use super::structure::Fine;
use crate::fem::example::Sensor;
use crate::geometry::closest::closest_on_triangle;
use crate::geometry::embedding::Locator;
use crate::math::Vec3;

/// Places are given in thousandths \[1/mm\].
const PER_MM: f64 = 1e3;

/// A marker.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    /// Where it is on the undeformed block \[mm\].
    pub place: Vec3,
    /// Its displacement, read from the nodes of the fine mesh.
    pub sensor: Sensor,
}

/// The markers of all `grids`, in their order.
///
/// # Errors
/// A sentence: a mesh that holds nothing.
pub fn markers(fine: &Fine, grids: &[MarkerGrid]) -> Result<Vec<Marker>, String> {
    let locator = Locator::new(&fine.mesh).map_err(|e| e.to_string())?;
    let mut places: Vec<Vec3> = Vec::new();
    for grid in grids {
        for place in on_face(fine, grid) {
            let place = place.map(|x| (x * PER_MM).round() / PER_MM);
            if places.iter().all(|p| (p - place).norm() > 2.0 / PER_MM) {
                places.push(place);
            }
        }
    }
    let sensor = |place: &Vec3| {
        let held = locator.nearest(place);
        let nodes = held.nodes.iter().map(|&n| n as usize);
        Sensor {
            weights: nodes.zip(held.weights.iter().copied()).collect(),
        }
    };
    Ok(places
        .into_iter()
        .map(|place| Marker {
            sensor: sensor(&place),
            place,
        })
        .collect())
}

fn on_face(fine: &Fine, grid: &MarkerGrid) -> Vec<Vec3> {
    let triangles = material(fine, grid.face);
    let [a, b] = grid.face.across();
    let step = [
        fine.size[a] / grid.count[0] as f64,
        fine.size[b] / grid.count[1] as f64,
    ];
    let mut places = Vec::new();
    for j in 0..grid.count[1] {
        for i in 0..grid.count[0] {
            let mut spot = Vec3::zeros();
            spot[grid.face.axis.index()] = grid.face.place(&fine.size);
            spot[a] = (i as f64 + 0.5) * step[0];
            spot[b] = (j as f64 + 0.5) * step[1];
            let nearest = triangles
                .iter()
                .map(|t| closest_on_triangle(t, &spot))
                .min_by(|p, q| (p - spot).norm().total_cmp(&(q - spot).norm()));
            if let Some(place) = nearest.filter(|p| (p - spot).norm() <= 0.5 * step[0].min(step[1])) {
                places.push(place);
            }
        }
    }
    places
}

/// The triangles of a face's elements that are at least half full there.
fn material(fine: &Fine, face: Face) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for own in outer_faces(fine, face) {
        if own.fill.iter().sum::<f64>() < 2.0 {
            continue;
        }
        let [p, q, r, s] = own.nodes.map(|n| fine.mesh.nodes[n as usize]);
        triangles.extend([[p, q, r], [p, r, s]]);
    }
    triangles
}
