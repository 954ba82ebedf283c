//! Why a load curve ended: what the last equilibrium and the iteration that failed beyond it tell.
//!
//! ```text
//! S = (fᵀ K₀⁻¹ f) / (fᵀ K_T⁻¹ f)            current stiffness parameter (Bergan 1980): 1 at rest, 0 at a limit point
//! ```
//!
//! At a limit point the tangent K_T becomes singular and no further load has an equilibrium near by: the object buckles,
//! snaps or yields like a foam whose walls give in. Without forces, where displacements are prescribed, an indefinite
//! tangent alone is the sign. An interpolated stiffness that is not positive definite (the papers' interpolation can lose
//! that between its centres) is named before.

use super::equilibrium::{Path, Solver};
use super::forces::{Materials, point_fields};
use super::load_curve::{Load, Stop};
use crate::math::Vec3;
use crate::numerics::gmres::Side;

/// Below this current stiffness parameter the end of a curve is a limit point.
const SOFT: f64 = 0.1;

/// The reason `stop`, or the deeper one that the states around it tell.
pub(super) fn named(
    solver: &mut Solver,
    stop: Stop,
    path: &Path,
    materials: &Materials,
    load: &Load,
) -> Stop {
    if stop == Stop::Cancelled {
        return stop;
    }
    let failed = path.failed.borrow();
    for u in [&path.u, &*failed] {
        if let Some(indefinite) = indefinite_law(solver, u, materials) {
            return indefinite;
        }
    }
    if stop != Stop::NotConverged {
        return stop;
    }
    match stiffness_parameter(solver, path, materials, load) {
        Some(stiffness) if stiffness < SOFT => Stop::LimitPoint { stiffness },
        _ => stop,
    }
}

/// The first point whose law has lost positive definiteness.
fn indefinite_law(solver: &Solver, u: &[Vec3], materials: &Materials) -> Option<Stop> {
    if u.is_empty() || u.iter().any(|u| !u.iter().all(|x| x.is_finite())) {
        return None;
    }
    let model = solver.model;
    let strains = point_fields(&model.parts, u, materials).strain;
    let q = (0..strains.len()).find(|&q| !materials.at(q).is_definite(&strains[q]))?;
    let element = q / model.parts.points_per_element();
    let place = model.mesh.nodes[model.mesh.elements.nodes_of(element)[0] as usize];
    Some(Stop::Indefinite { element, place })
}

/// S at the last equilibrium, zero where the tangent is indefinite; `None` where nothing can be said.
fn stiffness_parameter(solver: &mut Solver, path: &Path, materials: &Materials, load: &Load) -> Option<f64> {
    if !solver.factorise_tangent(&path.u, materials) {
        return Some(0.0);
    }
    let mut force = vec![0.0; solver.model.unknowns()];
    solver.model.gather(&load.forces, &mut force);
    if force.iter().all(|f| *f == 0.0) {
        return None;
    }
    let work = |x: &[f64]| x.iter().zip(&force).map(|(x, f)| x * f).sum::<f64>();
    let mut now = force.clone();
    solver.solve_tangent(&mut now, Side::Plain, 1e-6)?;
    // The secant's factor at rest may have been made for other materials in between; this one is at hand.
    let mut rest = force.clone();
    solver.rest.solve(&mut rest);
    let ratio = work(&rest) / work(&now);
    ratio.is_finite().then_some(ratio)
}
