//! The mesh of a scene, its sets of nodes and its regions of elements.

use super::super::setup::{ShapeText, length_unit};
use super::text::{MeshText, RegionText, SetText};
use crate::geometry::boundary::boundary_faces;
use crate::geometry::files::{Group, VolumeFile, open_volume, volume_from_arrays};
use crate::geometry::volume::Elements;
use crate::math::Vec3;
use crate::units::LengthUnit;
use crate::units::document::{Document, Mistake};
use std::collections::{BTreeMap, BTreeSet};
use toml::Spanned;

/// A set of nodes of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeSet {
    /// Its name.
    pub name: String,
    /// Its nodes, ascending.
    pub nodes: Vec<u32>,
}

/// Reads the mesh of a scene.
///
/// # Errors
/// [`Mistake`] at the key: neither or both of a file and arrays, and what the mesh's own check finds.
pub fn read_mesh(document: &Document, text: &Spanned<MeshText>) -> Result<VolumeFile, Mistake> {
    let (span, text) = (text.span(), text.get_ref());
    let arrays = [
        text.nodes_mm.as_ref().map(Spanned::span),
        text.tetrahedra.as_ref().map(Spanned::span),
        text.hexahedra.as_ref().map(Spanned::span),
    ];
    if let Some(file) = &text.file {
        if let Some(second) = arrays.iter().flatten().next() {
            let message = "found a file and arrays, expected one of them";
            return Err(document.mistake(second, message));
        }
        let unit = length_unit(document, &text.unit)?;
        let path = document.resolve(file.get_ref());
        return open_volume(&path, unit).map_err(|e| document.mistake(&file.span(), e.to_string()));
    }
    if let Some(unit) = &text.unit {
        let message = "found a unit without a file: arrays are in mm, as nodes_mm says";
        return Err(document.mistake(&unit.span(), message));
    }
    let (nodes, elements, place) = match (&text.nodes_mm, &text.tetrahedra, &text.hexahedra) {
        (Some(nodes), Some(tets), None) => (nodes, Elements::Tetrahedra(tets.get_ref().clone()), tets.span()),
        (Some(nodes), None, Some(cells)) => {
            (nodes, Elements::Hexahedra(cells.get_ref().clone()), cells.span())
        }
        _ => {
            let message = "expected file and unit; or nodes_mm with either tetrahedra or hexahedra";
            return Err(document.mistake(&span, message));
        }
    };
    let nodes = nodes.get_ref().iter().copied().map(Vec3::from).collect();
    volume_from_arrays(nodes, elements).map_err(|e| document.mistake(&place, e.to_string()))
}

/// Which of the mesh's parts a place may name.
struct Numbered<'a> {
    groups: &'a [Group],
    numbers: &'a [u64],
    /// "node" or "element".
    word: &'static str,
    /// Where each lies \[mm\].
    places: Vec<Vec3>,
}

/// The keys that say where something is.
struct Place<'a> {
    span: std::ops::Range<usize>,
    group: &'a Option<Spanned<String>>,
    numbers: &'a Option<Spanned<Vec<u64>>>,
    box_mm: &'a Option<Spanned<[[f64; 3]; 2]>>,
    cylinder: &'a Option<Spanned<super::super::setup::CylinderText>>,
}

impl Numbered<'_> {
    /// Members of a place, ascending; `None` if it names none.
    fn find(&self, document: &Document, place: &Place) -> Result<Option<Vec<u32>>, Mistake> {
        let word = self.word;
        let given = [
            place.group.as_ref().map(Spanned::span),
            place.numbers.as_ref().map(Spanned::span),
            place.box_mm.as_ref().map(Spanned::span),
            place.cylinder.as_ref().map(Spanned::span),
        ];
        let mut given = given.into_iter().flatten();
        let Some(span) = given.next() else {
            return Ok(None);
        };
        if let Some(second) = given.next() {
            let message = format!("found a second place, expected one of group, {word}s, box_mm, cylinder");
            return Err(document.mistake(&second, message));
        }
        let members = if let Some(group) = place.group {
            self.group(document, group)?
        } else if let Some(numbers) = place.numbers {
            self.numbers(document, numbers)?
        } else {
            let shape = ShapeText {
                box_mm: place.box_mm.clone(),
                cylinder: place.cylinder.clone(),
                mesh: None,
            };
            let region = shape.read(document, LengthUnit::Millimetre)?;
            let inside = |(i, x): (usize, &Vec3)| region.contains(x).then_some(i as u32);
            self.places.iter().enumerate().filter_map(inside).collect()
        };
        if members.is_empty() {
            let message = format!("this place holds no {word} of the mesh: move or enlarge it");
            return Err(document.mistake(&span, message));
        }
        Ok(Some(members))
    }

    fn group(&self, document: &Document, name: &Spanned<String>) -> Result<Vec<u32>, Mistake> {
        if let Some(group) = self.groups.iter().find(|g| g.name == *name.get_ref()) {
            return Ok(group.members.clone());
        }
        let known: Vec<String> = self.groups.iter().map(|g| format!("{:?}", g.name)).collect();
        let message = if known.is_empty() {
            format!(
                "found group {:?}, but the mesh names no groups of {}s",
                name.get_ref(),
                self.word
            )
        } else {
            format!(
                "found group {:?}, expected one of the mesh's: {}",
                name.get_ref(),
                known.join(", ")
            )
        };
        Err(document.mistake(&name.span(), message))
    }

    fn numbers(&self, document: &Document, numbers: &Spanned<Vec<u64>>) -> Result<Vec<u32>, Mistake> {
        let index: BTreeMap<u64, u32> = self.numbers.iter().copied().zip(0..).collect();
        let mut members = BTreeSet::new();
        for number in numbers.get_ref() {
            let Some(&i) = index.get(number) else {
                let ends = index.keys().next().zip(index.keys().next_back());
                let (low, high) = ends.map_or((0, 0), |(a, b)| (*a, *b));
                let message = format!(
                    "found {} {number}, which the mesh does not hold: expected numbers from {low} to {high}",
                    self.word
                );
                return Err(document.mistake(&numbers.span(), message));
            };
            members.insert(i);
        }
        Ok(members.into_iter().collect())
    }
}

/// The sets of a scene: its own, in their order.
///
/// # Errors
/// [`Mistake`] at the key: a name that stands twice, no place or several, an unknown group or node, an empty set.
pub fn read_sets(document: &Document, texts: &[SetText], file: &VolumeFile) -> Result<Vec<NodeSet>, Mistake> {
    let numbered = Numbered {
        groups: &file.node_sets,
        numbers: &file.node_numbers,
        word: "node",
        places: file.mesh.nodes.clone(),
    };
    let mut sets: Vec<NodeSet> = Vec::new();
    for text in texts {
        let name = text.name.get_ref();
        if sets.iter().any(|s| s.name == *name) {
            return Err(document.mistake(&text.name.span(), format!("the set {name:?} stands twice")));
        }
        let place = Place {
            span: text.name.span(),
            group: &text.group,
            numbers: &text.nodes,
            box_mm: &text.box_mm,
            cylinder: &text.cylinder,
        };
        let Some(mut nodes) = numbered.find(document, &place)? else {
            let message =
                format!("set {name:?} has no place, expected one of group, nodes, box_mm, cylinder");
            return Err(document.mistake(&place.span, message));
        };
        if text.surface == Some(true) {
            let surface: BTreeSet<u32> = boundary_faces(&file.mesh)
                .iter()
                .flat_map(|f| f.nodes().to_vec())
                .collect();
            nodes.retain(|n| surface.contains(n));
            if nodes.is_empty() {
                let message = format!("set {name:?} holds no node of the surface");
                return Err(document.mistake(&place.span, message));
            }
        }
        sets.push(NodeSet {
            name: name.clone(),
            nodes,
        });
    }
    Ok(sets)
}

/// A set by its name: one of the scene, or else a group of the mesh's file.
///
/// # Errors
/// [`Mistake`] that lists what there is.
pub fn find_set<'a>(
    document: &Document,
    name: &Spanned<String>,
    sets: &'a [NodeSet],
    file: &'a VolumeFile,
) -> Result<&'a [u32], Mistake> {
    if let Some(set) = sets.iter().find(|s| s.name == *name.get_ref()) {
        return Ok(&set.nodes);
    }
    if let Some(group) = file.node_sets.iter().find(|g| g.name == *name.get_ref()) {
        return Ok(&group.members);
    }
    let own = sets.iter().map(|s| &s.name);
    let known: Vec<String> = own
        .chain(file.node_sets.iter().map(|g| &g.name))
        .map(|n| format!("{n:?}"))
        .collect();
    let message = format!(
        "found set {:?}, expected the name of a [[set]] or of a group of the mesh: {}",
        name.get_ref(),
        if known.is_empty() {
            "there is none".into()
        } else {
            known.join(", ")
        }
    );
    Err(document.mistake(&name.span(), message))
}

/// For each element the region that takes it.
///
/// # Errors
/// [`Mistake`] at the key: several places, an unknown group or element, an element that no region takes.
pub fn read_regions(
    document: &Document,
    texts: &Spanned<Vec<RegionText>>,
    file: &VolumeFile,
) -> Result<Vec<u16>, Mistake> {
    const NONE: u16 = u16::MAX;
    let elements = &file.mesh.elements;
    let middle = |e: usize| {
        let nodes = elements.nodes_of(e);
        nodes.iter().map(|&n| file.mesh.nodes[n as usize]).sum::<Vec3>() / nodes.len() as f64
    };
    let numbered = Numbered {
        groups: &file.element_groups,
        numbers: &file.element_numbers,
        word: "element",
        places: (0..elements.len()).map(middle).collect(),
    };
    if texts.get_ref().len() >= usize::from(NONE) {
        return Err(document.mistake(&texts.span(), "found more than 65534 regions"));
    }
    let mut region_of = vec![NONE; elements.len()];
    for (r, text) in texts.get_ref().iter().enumerate() {
        let place = Place {
            span: text.name.span(),
            group: &text.group,
            numbers: &text.elements,
            box_mm: &text.box_mm,
            cylinder: &text.cylinder,
        };
        let everything = || (0..elements.len() as u32).collect();
        for e in numbered.find(document, &place)?.unwrap_or_else(everything) {
            let own = &mut region_of[e as usize];
            if *own == NONE {
                *own = r as u16;
            }
        }
    }
    let left = region_of.iter().filter(|r| **r == NONE).count();
    if let Some(e) = region_of.iter().position(|r| *r == NONE) {
        let [x, y, z] = <[f64; 3]>::from(numbered.places[e]);
        let message = format!(
            "{left} of {} elements are in no region, for instance {} near ({x:.1}, {y:.1}, {z:.1}) mm: add a last region without a place, which takes the rest",
            region_of.len(),
            file.element_numbers[e]
        );
        return Err(document.mistake(&texts.span(), message));
    }
    Ok(region_of)
}
