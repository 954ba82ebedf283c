//! The rigid bodies of a scene on a volume mesh, and where each case wants them.

use super::super::contact::{Drive, Friction, Pose, Push, RigidBody, Shape, Surface};
use super::super::setup::{finite, length_unit, positive_length, quantity, read_object};
use super::VolumeScene;
use super::loads::Waypoints;
use super::sets::find_set;
use super::text::{FrictionText, LoadText, NumbersText, ProbeText, PushText, VolumeSceneText};
use crate::math::Vec3;
use crate::units;
use crate::units::document::{Document, Mistake};
use std::ops::Range;
use toml::Spanned;

/// A rigid body with its name.
#[derive(Clone, Debug)]
pub struct NamedBody {
    /// Its name.
    pub name: String,
    /// The body.
    pub body: RigidBody,
}

/// The bodies of a scene: its probes in their order, then the floor.
///
/// # Errors
/// [`Mistake`] at the key: an unknown shape, a length that is missing or out of range, a surface that cannot be read.
pub fn read_bodies(document: &Document, text: &VolumeSceneText) -> Result<Vec<NamedBody>, Mistake> {
    let mut bodies: Vec<NamedBody> = Vec::new();
    for probe in &text.probe {
        let name = probe.name.get_ref();
        if name == "floor" || bodies.iter().any(|b| b.name == *name) {
            let message = format!("found a second body {name:?}, expected one name for each");
            return Err(document.mistake(&probe.name.span(), message));
        }
        bodies.push(NamedBody {
            name: name.clone(),
            body: read_probe(document, probe)?,
        });
    }
    if let Some(floor) = &text.floor {
        let span = floor.span();
        let floor = floor.get_ref();
        let point = finite(document, &floor.point_mm)?;
        let normal = match &floor.normal {
            Some(normal) => finite(document, normal)?,
            None => Vec3::z(),
        };
        let body = RigidBody::floor(point, normal, friction(document, &floor.friction)?)
            .map_err(|e| document.mistake(&span, e.to_string()))?;
        bodies.push(NamedBody {
            name: "floor".into(),
            body,
        });
    }
    Ok(bodies)
}

fn read_probe(document: &Document, text: &ProbeText) -> Result<RigidBody, Mistake> {
    let span = text.shape.span();
    let fail = |message: String| document.mistake(&span, message);
    let position = finite(document, &text.position_mm)?;
    let towards = finite(document, &text.direction)?;
    let friction = friction(document, &text.friction)?;
    let need = |name: &str, length: &Option<Spanned<String>>| match length {
        Some(length) => positive_length(document, length),
        None => Err(fail(format!(
            "a {} needs {name}, such as {name} = \"5 mm\"",
            text.shape.get_ref()
        ))),
    };
    let edge_mm = match &text.edge {
        Some(edge) => quantity(document, edge, units::length)?,
        None => 0.0,
    };
    let shape = match text.shape.get_ref().as_str() {
        "sphere" => Shape::Sphere {
            radius_mm: need("radius", &text.radius)?,
        },
        "disc" => Shape::Disc {
            radius_mm: need("radius", &text.radius)?,
            edge_mm,
        },
        "cylinder" => Shape::Cylinder {
            radius_mm: need("radius", &text.radius)?,
            length_mm: need("length", &text.length)?,
            edge_mm,
        },
        "box" => {
            let Some(size) = &text.size_mm else {
                return Err(fail("a box needs size_mm, such as size_mm = [10, 10, 5]".into()));
            };
            Shape::Cuboid {
                size_mm: finite(document, size)?,
                edge_mm,
            }
        }
        "mesh" => return mesh_probe(document, text, position, towards, friction),
        other => {
            return Err(fail(format!(
                "found shape {other:?}, expected sphere, disc, cylinder, box or mesh"
            )));
        }
    };
    // A disc's face looks where it is pushed; the axis of all others is z unless they say so.
    let is_disc = matches!(shape, Shape::Disc { .. });
    let axis = match &text.axis {
        Some(axis) => finite(document, axis)?,
        None if is_disc => towards,
        None => Vec3::z(),
    };
    let pose = match &text.across {
        Some(across) => Pose::turned(position, axis, finite(document, across)?),
        None if axis == Vec3::z() => Pose::at(position),
        None => Pose::new(position, axis),
    };
    let pose = pose.map_err(|e| fail(e.to_string()))?;
    RigidBody::probe(shape, pose, towards, friction).map_err(|e| fail(e.to_string()))
}

fn mesh_probe(
    document: &Document,
    text: &ProbeText,
    offset: Vec3,
    towards: Vec3,
    friction: Friction,
) -> Result<RigidBody, Mistake> {
    let Some(file) = &text.mesh else {
        let message = "a probe of shape \"mesh\" needs mesh = \"FILE\" and its unit";
        return Err(document.mistake(&text.shape.span(), message));
    };
    let unit = length_unit(document, &text.unit)?;
    let fail = |message: String| document.mistake(&file.span(), message);
    let object = read_object(&document.resolve(file.get_ref()), unit).map_err(fail)?;
    let body = RigidBody::of_solid(&object.solid, None, offset, towards, friction);
    body.map_err(|e| document.mistake(&file.span(), e.to_string()))
}

fn friction(document: &Document, text: &Option<Spanned<FrictionText>>) -> Result<Friction, Mistake> {
    let Some(text) = text else {
        return Ok(Friction::Frictionless);
    };
    match text.get_ref() {
        FrictionText::Coefficient(coefficient) => Ok(Friction::Coulomb {
            coefficient: *coefficient,
        }),
        FrictionText::Word(word) if word == "none" => Ok(Friction::Frictionless),
        FrictionText::Word(word) if word == "sticking" => Ok(Friction::Sticking),
        FrictionText::Word(word) => {
            let message = format!(
                "found friction {word:?}, expected \"none\", \"sticking\" or a coefficient such as 0.4"
            );
            Err(document.mistake(&text.span(), message))
        }
    }
}

/// The bodies with what a probe holds: points of the surface on nodes of its set, which slide on it and do not come off.
///
/// # Errors
/// [`Mistake`]: an unknown set, or one without a node of the surface.
pub fn hold(scene: &VolumeScene, surface: &Surface) -> Result<Vec<RigidBody>, Mistake> {
    let mut bodies = Vec::new();
    for (index, named) in scene.bodies.iter().enumerate() {
        let Some(set) = scene.holds.get(index).and_then(Option::as_ref) else {
            bodies.push(named.body.clone());
            continue;
        };
        let nodes = find_set(&scene.document, set, &scene.sets, &scene.file)?;
        let points: Vec<u32> = (0_u32..)
            .zip(&surface.points)
            .filter(|(_, p)| p.weights.iter().all(|(n, _)| nodes.binary_search(n).is_ok()))
            .map(|(i, _)| i)
            .collect();
        if points.is_empty() {
            let message = format!("the set {:?} holds no node of the surface", set.get_ref());
            return Err(scene.document.mistake(&set.span(), message));
        }
        bodies.push(named.body.clone().holding(points));
    }
    Ok(bodies)
}

/// How long the lists of a case's pushes are, each with its place.
pub fn waypoints(text: &LoadText) -> Vec<Waypoints> {
    let length =
        |numbers: &Option<Spanned<NumbersText>>| match numbers.as_ref().map(|n| (n.span(), n.get_ref())) {
            Some((span, NumbersText::List(list))) => Some(Waypoints {
                span,
                count: list.len(),
            }),
            _ => None,
        };
    let pushes = text.push.iter();
    pushes
        .flat_map(|p| [length(&p.travel_mm), length(&p.force_n)])
        .flatten()
        .collect()
}

/// Where every body is wanted at each level, `(levels × bodies)`.
///
/// # Errors
/// [`Mistake`]: a push of no body, without a travel or a force or with both, a force that pulls.
pub fn drives(scene: &VolumeScene, text: &LoadText, shares: &[f64]) -> Result<Vec<Vec<Drive>>, Mistake> {
    let mut levels = vec![vec![Drive::HELD; scene.bodies.len()]; shares.len()];
    for push in &text.push {
        let index = body_of(scene, &push.probe)?;
        for (k, level) in levels.iter_mut().enumerate() {
            level[index] = drive(scene, push, k, shares[k])?;
        }
    }
    Ok(levels)
}

fn body_of(scene: &VolumeScene, name: &Spanned<String>) -> Result<usize, Mistake> {
    let found = scene.bodies.iter().position(|b| b.name == *name.get_ref());
    found.ok_or_else(|| {
        let known: Vec<String> = scene.bodies.iter().map(|b| format!("{:?}", b.name)).collect();
        let message = format!(
            "found probe {:?}, expected the name of a [[probe]], or floor: {}",
            name.get_ref(),
            if known.is_empty() {
                "there is none".into()
            } else {
                known.join(", ")
            }
        );
        scene.document.mistake(&name.span(), message)
    })
}

fn drive(scene: &VolumeScene, text: &PushText, k: usize, share: f64) -> Result<Drive, Mistake> {
    let number = |numbers: &Spanned<NumbersText>| -> Result<(f64, Range<usize>), Mistake> {
        let value = match numbers.get_ref() {
            NumbersText::One(x) => x * share,
            // All lists are as long as there are levels.
            NumbersText::List(list) => list.get(k).copied().unwrap_or(f64::NAN),
        };
        if value.is_finite() {
            return Ok((value, numbers.span()));
        }
        let message = "expected a finite number, or a list of one for each level";
        Err(scene.document.mistake(&numbers.span(), message))
    };
    let push = match (&text.travel_mm, &text.force_n) {
        (Some(travel), None) => Push::Travel(number(travel)?.0),
        (None, Some(force)) => {
            let (force, span) = number(force)?;
            if force < 0.0 {
                let message =
                    format!("found a force of {force} N, expected zero or more: a probe does not pull");
                return Err(scene.document.mistake(&span, message));
            }
            Push::Force(force)
        }
        _ => {
            let message = "expected one of travel_mm and force_n";
            return Err(scene.document.mistake(&text.probe.span(), message));
        }
    };
    let across_mm = match &text.across_mm {
        Some(way) => finite(&scene.document, way)? * share,
        None => Vec3::zeros(),
    };
    Ok(Drive { push, across_mm })
}
