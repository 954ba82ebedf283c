//! From what a scene says is done to an object to nodal forces and prescribed displacements.
//!
//! ```text
//! f_a = Σ forces on node a  −  p ∫ N_a n dA  +  ∫ ρ g N_a dV          at a share of 1
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | f_a | force on node a | N |
//! | p | pressure into the object, on faces of the boundary with outward normal n | MPa |
//! | ρ | density | t/mm³ |
//! | g | acceleration of gravity | mm/s² |
//! | N_a | shape function | – |
//!
//! All are dead loads: areas, normals and volumes are those of the undeformed object, and do not follow it. 1 N is
//! 1 t mm/s².

use super::super::contact::{Drive, Push};
use super::super::elements::{Discretisation, gauss_points, trilinear};
use super::super::equilibrium::Load;
use super::super::model::Constrained;
use super::super::scene_text::displacement;
use super::super::setup::{finite, quantity};
use super::super::stage::Support;
use super::sets::find_set;
use super::text::{LevelsText, LoadText, MoveText, components};
use super::{VolumeScene, bodies};
use crate::geometry::boundary::boundary_faces;
use crate::math::Vec3;
use crate::units;
use crate::units::document::Mistake;
use std::collections::BTreeMap;
use std::ops::Range;
use toml::Spanned;

/// More levels of one case than this are refused.
const MOST_LEVELS: usize = 10_000;
/// Millimetres in a metre: gravity is written in m/s².
const MM_PER_M: f64 = 1000.0;

/// How a case's load grows.
#[derive(Clone, Debug, PartialEq)]
pub enum Loading {
    /// Everything in proportion.
    Proportional {
        /// The load at a share of 1.
        load: Load,
        /// The shares, ascending.
        shares: Vec<f64>,
    },
    /// Level by level; each is reached from rest.
    Path {
        /// The whole load of each level.
        levels: Vec<Load>,
    },
    /// With rigid bodies, one level after the other.
    Contact {
        /// The load at a share of 1.
        load: Load,
        /// Its shares.
        shares: Vec<f64>,
        /// Where the bodies are wanted, `(levels × bodies)`.
        drives: Vec<Vec<Drive>>,
    },
}

/// A list with one entry for each level, and its place in the file.
#[derive(Clone, Debug)]
pub struct Waypoints {
    /// Its place.
    pub span: Range<usize>,
    /// How many entries.
    pub count: usize,
}

impl Loading {
    /// How many levels there are.
    pub fn levels(&self) -> usize {
        match self {
            Loading::Proportional { shares, .. } | Loading::Contact { shares, .. } => shares.len(),
            Loading::Path { levels } => levels.len(),
        }
    }

    /// What a level is called by: its share of the load; on a path, or with rigid bodies, its number from 1.
    pub fn level(&self, index: usize) -> f64 {
        match self {
            Loading::Proportional { shares, .. } => shares.get(index).copied().unwrap_or(0.0),
            Loading::Path { .. } | Loading::Contact { .. } => (index + 1) as f64,
        }
    }

    /// The external forces at a level, `(nodes)` \[N\].
    pub fn forces(&self, index: usize) -> Vec<Vec3> {
        match self {
            Loading::Proportional { load, shares } | Loading::Contact { load, shares, .. } => {
                let share = shares.get(index).copied().unwrap_or(0.0);
                load.forces.iter().map(|f| f * share).collect()
            }
            Loading::Path { levels } => levels.get(index).map(|l| l.forces.clone()).unwrap_or_default(),
        }
    }
}

/// A case, wired: what is held, what moves, what pushes.
#[derive(Clone, Debug)]
pub struct Wired {
    /// Components that are held or moved, `(nodes)`.
    pub constrained: Vec<Constrained>,
    /// What holds and moves the object; moves first.
    pub supports: Vec<Support>,
    /// Its load.
    pub loading: Loading,
}

/// Displacements of a moved set, `(levels)`, at each level or at a share of 1.
struct Moved {
    components: Constrained,
    /// One displacement, scaled with the load; or one for each level.
    path: Vec<Vec3>,
    is_path: bool,
}

/// Wires a case of a scene.
///
/// # Errors
/// [`Mistake`] at the key that is wrong.
pub fn wire(scene: &VolumeScene, parts: &Discretisation, text: &LoadText) -> Result<Wired, Mistake> {
    let nodes = scene.file.mesh.nodes.len();
    let mut moves = Vec::new();
    for own in &text.moves {
        moves.push((own, read_move(scene, own)?));
    }
    let forces = forces(scene, parts, text)?;
    let (path, count) = counts(scene, text, &moves)?;
    let shares = shares(scene, &text.levels, count)?;
    let mut constrained = vec![[false; 3]; nodes];
    let mut supports = Vec::new();
    for (index, fixed) in scene.fixed.iter().enumerate() {
        let own = fixed.get_ref();
        let set = find_set(&scene.document, &own.set, &scene.sets, &scene.file)?;
        let which = components(&scene.document, &own.components)?;
        let name = format!("fixed {} ({})", index + 1, own.set.get_ref());
        supports.push(hold(name, set, which, &mut constrained));
    }
    let mut prescribed = vec![vec![Vec3::zeros(); nodes]; if path.is_some() { shares.len() } else { 1 }];
    let by_fixed = constrained.clone();
    let mut movers = Vec::new();
    for (own, moved) in &moves {
        let set = find_set(&scene.document, &own.set, &scene.sets, &scene.file)?;
        check_free(scene, own, moved, set, &by_fixed, &constrained)?;
        for (k, level) in prescribed.iter_mut().enumerate() {
            let share = if path.is_some() { shares[k] } else { 1.0 };
            let target = if moved.is_path {
                moved.path[k]
            } else {
                moved.path[0] * share
            };
            for &node in set {
                for c in (0..3).filter(|&c| moved.components[c] && !by_fixed[node as usize][c]) {
                    level[node as usize][c] = target[c];
                }
            }
        }
        let name = format!("move ({})", own.set.get_ref());
        movers.push(hold(name, set, moved.components, &mut constrained));
    }
    // What moves the object is asked for first.
    supports.splice(0..0, movers);
    let load = |prescribed: Vec<Vec3>, share: f64| Load {
        forces: forces.iter().map(|f| f * share).collect(),
        prescribed: (!moves.is_empty()).then_some(prescribed),
    };
    let loading = if !scene.bodies.is_empty() {
        Loading::Contact {
            load: load(prescribed.swap_remove(0), 1.0),
            drives: bodies::drives(scene, text, &shares)?,
            shares,
        }
    } else if let Some(push) = text.push.first() {
        let message = "found a push, but the scene has no [[probe]] and no [floor]";
        return Err(scene.document.mistake(&push.probe.span(), message));
    } else if path.is_some() {
        Loading::Path {
            levels: prescribed
                .into_iter()
                .zip(&shares)
                .map(|(p, s)| load(p, *s))
                .collect(),
        }
    } else {
        Loading::Proportional {
            load: load(prescribed.swap_remove(0), 1.0),
            shares,
        }
    };
    check_load(scene, text, &loading)?;
    Ok(Wired {
        constrained,
        supports,
        loading,
    })
}

/// Something is done, at least.
fn check_load(scene: &VolumeScene, text: &LoadText, loading: &Loading) -> Result<(), Mistake> {
    let is_nothing = |load: &Load| {
        load.forces.iter().all(|f| *f == Vec3::zeros())
            && load.prescribed.iter().flatten().all(|u| *u == Vec3::zeros())
    };
    let nothing = match loading {
        Loading::Proportional { load, .. } => is_nothing(load),
        Loading::Path { levels } => levels.iter().all(is_nothing),
        Loading::Contact { load, drives, .. } => {
            let still = |d: &Drive| matches!(d.push, Push::Travel(0.0)) && d.across_mm == Vec3::zeros();
            is_nothing(load) && drives.iter().flatten().all(still)
        }
    };
    if !nothing {
        return Ok(());
    }
    let message = format!(
        "load {:?} does nothing, expected forces_n, gravity_m_s2, [[load.force]], [[load.pressure]], [[load.move]] or [[load.push]]",
        text.name.get_ref()
    );
    Err(scene.document.mistake(&text.name.span(), message))
}

/// Marks what a set holds; a component belongs to the first support that names it.
fn hold(name: String, set: &[u32], which: Constrained, constrained: &mut [Constrained]) -> Support {
    let mut held = Vec::new();
    for &node in set {
        let before = constrained[node as usize];
        let own = [0, 1, 2].map(|c| which[c] && !before[c]);
        if own != [false; 3] {
            held.push((node as usize, own));
            constrained[node as usize] = [0, 1, 2].map(|c| before[c] || which[c]);
        }
    }
    Support { name, held }
}

fn read_move(scene: &VolumeScene, text: &MoveText) -> Result<Moved, Mistake> {
    let document = &scene.document;
    match (&text.displacement_mm, &text.path_mm) {
        (Some(own), None) => {
            let target = displacement(document, own)?;
            Ok(Moved {
                components: target.map(|d| d.is_some()),
                path: vec![Vec3::from(target.map(|d| d.unwrap_or(0.0)))],
                is_path: false,
            })
        }
        (None, Some(own)) => read_path(scene, own),
        (None, None) => {
            let message = "found a move without displacement_mm or path_mm, expected one of them";
            Err(document.mistake(&text.set.span(), message))
        }
        (Some(_), Some(own)) => {
            let message = "found displacement_mm and path_mm, expected one of them";
            Err(document.mistake(&own.span(), message))
        }
    }
}

fn read_path(
    scene: &VolumeScene,
    text: &Spanned<BTreeMap<String, Spanned<Vec<f64>>>>,
) -> Result<Moved, Mistake> {
    let mut moved = Moved {
        components: [false; 3],
        path: Vec::new(),
        is_path: true,
    };
    for (key, list) in text.get_ref() {
        let wrong = |found: String| {
            let message = format!(
                "found {found}, expected equally long lists of finite numbers, such as {{ x = [1, 2], z = [0, -1] }}"
            );
            scene.document.mistake(&list.span(), message)
        };
        let Some(c) = ["x", "y", "z"].iter().position(|k| k == key) else {
            return Err(wrong(format!("the component {key:?}")));
        };
        let values = list.get_ref();
        let fits = moved.path.is_empty() || moved.path.len() == values.len();
        if values.is_empty() || values.len() > MOST_LEVELS || !fits {
            return Err(wrong(format!("{} waypoints", values.len())));
        }
        if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
            return Err(wrong(format!("{bad}")));
        }
        moved.path.resize(values.len(), Vec3::zeros());
        for (point, value) in moved.path.iter_mut().zip(values) {
            point[c] = *value;
        }
        moved.components[c] = true;
    }
    if moved.path.is_empty() {
        let message = "found a path without components, expected for instance { z = [-1, -2] }";
        return Err(scene.document.mistake(&text.span(), message));
    }
    Ok(moved)
}

/// How many waypoints the paths of a case have, and how many entries all its lists; `None` without any.
fn counts(
    scene: &VolumeScene,
    text: &LoadText,
    moves: &[(&MoveText, Moved)],
) -> Result<(Option<usize>, Option<usize>), Mistake> {
    let paths = moves.iter().filter(|(_, m)| m.is_path);
    let moving: Vec<Waypoints> = paths
        .map(|(own, m)| Waypoints {
            span: own.set.span(),
            count: m.path.len(),
        })
        .collect();
    if let (Some(first), false) = (moving.first(), scene.bodies.is_empty()) {
        let message = "found path_mm in a scene with rigid bodies, expected displacement_mm there";
        return Err(scene.document.mistake(&first.span, message));
    }
    let path = common(scene, moving.iter())?;
    let listed = bodies::waypoints(text);
    let count = common(scene, moving.iter().chain(&listed))?;
    Ok((path, count))
}

/// The number of waypoints, which all lists of a case share; `None` without lists.
fn common<'a>(
    scene: &VolumeScene,
    mut lists: impl Iterator<Item = &'a Waypoints>,
) -> Result<Option<usize>, Mistake> {
    let Some(first) = lists.next() else {
        return Ok(None);
    };
    if let Some(other) = lists.find(|l| l.count != first.count) {
        let message = format!(
            "found a list of {} levels beside one of {}, expected equally many",
            other.count, first.count
        );
        return Err(scene.document.mistake(&other.span, message));
    }
    if first.count == 0 {
        return Err(scene.document.mistake(
            &first.span,
            "found an empty list, expected one entry for each level",
        ));
    }
    Ok(Some(first.count))
}

/// The shares of the load, one a level.
fn shares(
    scene: &VolumeScene,
    text: &Option<Spanned<LevelsText>>,
    path: Option<usize>,
) -> Result<Vec<f64>, Mistake> {
    let Some(text) = text else {
        return Ok(vec![1.0; path.unwrap_or(1)]);
    };
    let fail = |message: String| Err(scene.document.mistake(&text.span(), message));
    let shares: Vec<f64> = match text.get_ref() {
        LevelsText::Count(n) if (1..=MOST_LEVELS).contains(n) => {
            (1..=*n).map(|k| k as f64 / *n as f64).collect()
        }
        LevelsText::Count(n) => {
            return fail(format!("found levels = {n}, expected 1 to {MOST_LEVELS}"));
        }
        LevelsText::Shares(shares) => shares.clone(),
    };
    if let Some(count) = path {
        if shares.len() != count || shares.iter().any(|s| !s.is_finite()) {
            return fail(format!(
                "found {} levels beside lists of {count}, expected as many finite shares of the other loads",
                shares.len()
            ));
        }
        return Ok(shares);
    }
    let rising = shares.windows(2).all(|p| p[0] < p[1]);
    let sound = shares.iter().all(|s| s.is_finite() && *s > 0.0) && shares.len() <= MOST_LEVELS;
    if shares.is_empty() || !rising || !sound {
        return fail(format!(
            "found levels = {shares:?}, expected rising shares above zero, such as [0.5, 1.0]"
        ));
    }
    Ok(shares)
}

/// What a support holds cannot be moved, and nothing twice.
fn check_free(
    scene: &VolumeScene,
    text: &MoveText,
    moved: &Moved,
    set: &[u32],
    by_fixed: &[Constrained],
    constrained: &[Constrained],
) -> Result<(), Mistake> {
    for &node in set {
        for c in (0..3).filter(|&c| moved.components[c]) {
            let n = node as usize;
            let goes = moved.path.iter().any(|u| u[c] != 0.0);
            let by = match (by_fixed[n][c], constrained[n][c]) {
                (true, _) if goes => "a [[fixed]] holds it",
                (false, true) => "another [[load.move]] moves it",
                _ => continue,
            };
            let [x, y, z] = <[f64; 3]>::from(scene.file.mesh.nodes[n]);
            let message = format!(
                "the move of {:?} shifts node {} at ({x:.1}, {y:.1}, {z:.1}) mm along {}, where {by}: keep the two sets apart, or free that component",
                text.set.get_ref(),
                scene.file.node_numbers[n],
                ["x", "y", "z"][c]
            );
            return Err(scene.document.mistake(&text.set.span(), message));
        }
    }
    Ok(())
}

/// The nodal forces of a case at a share of 1, `(nodes)` \[N\].
fn forces(scene: &VolumeScene, parts: &Discretisation, text: &LoadText) -> Result<Vec<Vec3>, Mistake> {
    let document = &scene.document;
    let mut forces = vec![Vec3::zeros(); scene.file.mesh.nodes.len()];
    if let Some(list) = &text.forces_n {
        let numbers = scene.file.node_numbers.iter().copied();
        let index: BTreeMap<u64, usize> = numbers.zip(0..).collect();
        for entry in list.get_ref() {
            let [node, x, y, z] = *entry.get_ref();
            let found = (node >= 0.0 && node.fract() == 0.0).then_some(node as u64);
            let place = found.and_then(|number| index.get(&number));
            let (Some(&place), true) = (place, (x + y + z).is_finite()) else {
                let message = format!(
                    "found {:?}, expected [node, fx, fy, fz] with a node of the mesh and three finite numbers",
                    entry.get_ref()
                );
                return Err(document.mistake(&entry.span(), message));
            };
            forces[place] += Vec3::new(x, y, z);
        }
    }
    for own in &text.force {
        let set = find_set(document, &own.set, &scene.sets, &scene.file)?;
        let each = match (&own.total_n, &own.each_n) {
            (Some(total), None) => finite(document, total)? / set.len() as f64,
            (None, Some(each)) => finite(document, each)?,
            _ => {
                let message =
                    "expected one of total_n (spread equally over the set) and each_n (on each node)";
                return Err(document.mistake(&own.set.span(), message));
            }
        };
        set.iter().for_each(|&n| forces[n as usize] += each);
    }
    for own in &text.pressure {
        let set = find_set(document, &own.set, &scene.sets, &scene.file)?;
        let pressure = quantity(document, &own.pressure, units::stress)?;
        if !add_pressure(scene, set, pressure, &mut forces) {
            let message = format!(
                "found no face of the boundary with all its nodes in {:?}, expected a set that covers faces",
                own.set.get_ref()
            );
            return Err(document.mistake(&own.set.span(), message));
        }
    }
    if let Some(gravity) = &text.gravity_m_s2 {
        let g = finite(document, gravity)? * MM_PER_M;
        add_gravity(scene, parts, g, &mut forces)
            .map_err(|message| document.mistake(&gravity.span(), message))?;
    }
    Ok(forces)
}

/// Was there a face?
fn add_pressure(scene: &VolumeScene, set: &[u32], pressure: f64, forces: &mut [Vec3]) -> bool {
    let mesh = &scene.file.mesh;
    let mut inside = vec![false; mesh.nodes.len()];
    set.iter().for_each(|&n| inside[n as usize] = true);
    let mut any = false;
    for face in boundary_faces(mesh) {
        if !face.nodes().iter().all(|&n| inside[n as usize]) {
            continue;
        }
        any = true;
        for (&node, area) in face.nodes().iter().zip(face.area_vectors(&mesh.nodes)) {
            forces[node as usize] -= area * pressure;
        }
    }
    any
}

fn add_gravity(
    scene: &VolumeScene,
    parts: &Discretisation,
    g: Vec3,
    forces: &mut [Vec3],
) -> Result<(), String> {
    let mesh = &scene.file.mesh;
    let n = parts.points_per_element();
    let values = gauss_points().map(|at| trilinear(&at));
    for (e, &region) in scene.region_of.iter().enumerate() {
        let region = &scene.regions[usize::from(region)];
        let Some(density) = scene.materials[region.material].density else {
            return Err(format!(
                "material {:?} of region {:?} has no density, which gravity needs: add for instance density = \"1070 kg/m3\" to its [[material]]",
                scene.materials[region.material].id, region.name
            ));
        };
        let nodes = mesh.elements.nodes_of(e);
        for (i, at_point) in values.iter().enumerate().take(n) {
            let weight = parts.weight(e * n + i) * density;
            for (k, &node) in nodes.iter().enumerate() {
                // A tetrahedron's shape functions have equal integrals.
                let share = if nodes.len() == 4 { 0.25 } else { at_point[k] };
                forces[node as usize] += g * (weight * share);
            }
        }
    }
    Ok(())
}
