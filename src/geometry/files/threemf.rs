//! 3MF (core specification 1.3, and the paths of the production extension 1.1): the triangles of everything that is to be
//! built, in the declared unit.
//!
//! A package is a zip of parts. The model part names objects, which are meshes or assemblies of other objects; its build list
//! says which of them stand on the plate, and where. Colours, textures, slices and beams are passed over. Own code, since
//! slicers write objects between other resources and spread them over several parts, which the crate for it refuses.

use super::MeshFileError;
use super::read::RawSurface;
use super::stl::quoted;
use crate::geometry::surface::TriMesh;
use crate::math::Vec3;
use crate::units::LengthUnit;
use quick_xml::NsReader;
use quick_xml::events::{BytesStart, Event};
use quick_xml::name::ResolveResult;
use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use zip::ZipArchive;

const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
const ROOT_RELATIONSHIP: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
/// Largest part that is unpacked \[bytes\]: a zip may name more than any memory holds.
const LARGEST_PART: u64 = 1 << 30;
/// Most vertices or triangles that a build may repeat its objects to.
const MOST_TRIANGLES: usize = 20_000_000;
/// Most objects that a build may place, assemblies included.
const MOST_PLACEMENTS: usize = 1_000_000;
/// Deepest nesting of assemblies; more is a circle.
const DEEPEST: usize = 32;

type Package<'a> = ZipArchive<Cursor<&'a [u8]>>;

/// Twelve numbers of an affine map, row by row: x' = x R + t for row vectors.
type Transform = [f64; 12];
const IDENTITY: Transform = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

/// An object placed somewhere.
#[derive(Clone, Debug)]
struct Placement {
    /// The part that holds the object, if not this one.
    path: Option<String>,
    object: u32,
    transform: Transform,
}

#[derive(Clone, Debug, Default)]
struct Object {
    mesh: TriMesh,
    components: Vec<Placement>,
    /// Only models and surfaces are parts of the thing; supports are not.
    counts: bool,
}

#[derive(Clone, Debug)]
struct Model {
    unit: LengthUnit,
    objects: BTreeMap<u32, Object>,
    build: Vec<Placement>,
}

pub(super) fn read(bytes: &[u8]) -> Result<RawSurface, MeshFileError> {
    let mut package = ZipArchive::new(Cursor::new(bytes))
        .map_err(|error| fault("package", format!("no readable zip archive: {error}")))?;
    let root = root_part(&mut package)?;
    let mut models: BTreeMap<String, Model> = BTreeMap::new();
    models.insert(root.clone(), parse(&part(&mut package, &root)?, &root)?);
    let mut pending = vec![root.clone()];
    while let Some(from) = pending.pop() {
        for path in paths(&models[&from]) {
            if !models.contains_key(&path) {
                let model = parse(&part(&mut package, &path)?, &path)?;
                if model.unit != models[&root].unit {
                    return Err(fault(
                        &path,
                        "its unit differs from that of the root model".into(),
                    ));
                }
                models.insert(path.clone(), model);
                pending.push(path);
            }
        }
    }
    let mut assembly = Assembly {
        models: &models,
        mesh: TriMesh::default(),
        supports: 0,
        placements: 0,
    };
    for item in &models[&root].build {
        assembly.place(&root, item, &IDENTITY, 0)?;
    }
    let mut notes = Vec::new();
    if assembly.supports > 0 {
        notes.push(format!(
            "{} support objects of the 3MF were passed over",
            assembly.supports
        ));
    }
    let if_empty = "its build list names no object with triangles".into();
    Ok(RawSurface {
        mesh: assembly.mesh,
        unit: Some(models[&root].unit),
        notes,
        if_empty,
    })
}

/// The other parts that a model refers to.
fn paths(model: &Model) -> Vec<String> {
    let components = model.objects.values().flat_map(|object| &object.components);
    components
        .chain(&model.build)
        .filter_map(|placement| placement.path.clone())
        .collect()
}

/// The name of the root model part, from the package's relationships, or where everybody puts it.
fn root_part(package: &mut Package) -> Result<String, MeshFileError> {
    if package.index_for_name("_rels/.rels").is_some() {
        let text = part(package, "_rels/.rels")?;
        let mut reader = NsReader::from_str(&text);
        loop {
            match reader
                .read_event()
                .map_err(|error| fault("_rels/.rels", error.to_string()))?
            {
                Event::Start(tag) | Event::Empty(tag) if tag.local_name().as_ref() == "Relationship" => {
                    let place = |_: &str| "_rels/.rels".to_string();
                    if attribute(&tag, "Type", place)?.as_deref() == Some(ROOT_RELATIONSHIP)
                        && let Some(target) = attribute(&tag, "Target", place)?
                    {
                        return Ok(part_name(&target));
                    }
                }
                Event::Eof => break,
                _ => {}
            }
        }
    }
    Ok("3D/3dmodel.model".into())
}

fn part_name(path: &str) -> String {
    path.trim_start_matches('/').to_string()
}

fn part(package: &mut Package, name: &str) -> Result<String, MeshFileError> {
    // Names of parts are equal up to case.
    let index = (0..package.len()).find(|&k| {
        package
            .name_for_index(k)
            .is_some_and(|other| other.is_ok_and(|other| other.eq_ignore_ascii_case(name)))
    });
    let index = index.ok_or_else(|| fault(name, "the package has no such part: this is no 3MF".into()))?;
    let file = package
        .by_index(index)
        .map_err(|error| fault(name, error.to_string()))?;
    let mut bytes = Vec::new();
    file.take(LARGEST_PART + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| fault(name, error.to_string()))?;
    if bytes.len() as u64 > LARGEST_PART {
        return Err(MeshFileError::TooLarge {
            what: "bytes in one part",
            limit: LARGEST_PART,
        });
    }
    String::from_utf8(bytes).map_err(|_| fault(name, "its text is not UTF-8".into()))
}

fn fault(part: &str, message: String) -> MeshFileError {
    MeshFileError::ThreeMf {
        part: part.to_string(),
        message,
    }
}

/// The value of an attribute by its local name, whatever its prefix.
fn attribute(
    tag: &BytesStart,
    name: &str,
    place: impl Fn(&str) -> String,
) -> Result<Option<String>, MeshFileError> {
    for attribute in tag.attributes() {
        let attribute = attribute.map_err(|error| fault(&place(name), error.to_string()))?;
        if attribute.key.local_name().as_ref() == name {
            let value = attribute.normalized_value(quick_xml::XmlVersion::Implicit1_0);
            return Ok(Some(
                value
                    .map_err(|error| fault(&place(name), error.to_string()))?
                    .into_owned(),
            ));
        }
    }
    Ok(None)
}

/// Where the parser stands, for messages.
struct Place<'a> {
    part: &'a str,
    text: &'a str,
    position: u64,
}

impl Place<'_> {
    fn name(&self) -> String {
        let before = self.text.get(..self.position as usize).unwrap_or(self.text);
        format!(
            "{}, line {}",
            self.part,
            1 + before.bytes().filter(|&b| b == b'\n').count()
        )
    }

    fn text_of(&self, tag: &BytesStart, name: &str) -> Result<String, MeshFileError> {
        attribute(tag, name, |_| self.name())?.ok_or_else(|| {
            let element = tag.local_name();
            fault(
                &self.name(),
                format!("<{}> lacks the attribute \"{name}\"", element.as_ref()),
            )
        })
    }

    fn number<T: std::str::FromStr>(&self, tag: &BytesStart, name: &str) -> Result<T, MeshFileError> {
        let value = self.text_of(tag, name)?;
        value.trim().parse().map_err(|_| {
            fault(
                &self.name(),
                format!("{name}={} is no such number", quoted(&value)),
            )
        })
    }

    fn finite(&self, tag: &BytesStart, name: &str) -> Result<f64, MeshFileError> {
        let value: f64 = self.number(tag, name)?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(MeshFileError::NotFinite {
                place: self.name(),
                value: value.to_string(),
            })
        }
    }

    fn placement(&self, tag: &BytesStart) -> Result<Placement, MeshFileError> {
        let mut transform = IDENTITY;
        if let Some(text) = attribute(tag, "transform", |_| self.name())? {
            let numbers: Vec<f64> = text
                .split_whitespace()
                .filter_map(|word| word.parse().ok())
                .collect();
            let wrong = || {
                fault(
                    &self.name(),
                    format!("transform={}: expected 12 numbers", quoted(&text)),
                )
            };
            transform = numbers.try_into().map_err(|_| wrong())?;
            if !transform.iter().all(|x: &f64| x.is_finite()) {
                return Err(wrong());
            }
        }
        let path = attribute(tag, "path", |_| self.name())?.map(|path| part_name(&path));
        Ok(Placement {
            path,
            object: self.number(tag, "objectid")?,
            transform,
        })
    }
}

fn unit_of(name: &str) -> Option<LengthUnit> {
    match name {
        "micron" => Some(LengthUnit::Micrometre),
        "millimeter" => Some(LengthUnit::Millimetre),
        "centimeter" => Some(LengthUnit::Centimetre),
        "inch" => Some(LengthUnit::Inch),
        "foot" => Some(LengthUnit::Foot),
        "meter" => Some(LengthUnit::Metre),
        _ => None,
    }
}

fn parse(text: &str, part: &str) -> Result<Model, MeshFileError> {
    // The specification's default unit is the millimetre.
    let mut model = Model {
        unit: LengthUnit::Millimetre,
        objects: BTreeMap::new(),
        build: Vec::new(),
    };
    let mut current: Option<(u32, Object)> = None;
    let mut reader = NsReader::from_str(text.trim_start_matches('\u{feff}'));
    let mut seen = false;
    loop {
        let position = reader.buffer_position();
        let place = Place { part, text, position };
        let (namespace, event) = reader
            .read_resolved_event()
            .map_err(|error| fault(&place.name(), error.to_string()))?;
        let core = matches!(namespace, ResolveResult::Bound(ns) if ns.as_ref() == CORE);
        match event {
            Event::Eof => break,
            Event::Start(tag) | Event::Empty(tag) if core => {
                seen = true;
                element(&mut model, &mut current, &tag, &place)?;
            }
            Event::End(tag) if core && tag.local_name().as_ref() == "object" => {
                if let Some((id, object)) = current.take() {
                    check_indices(&object.mesh, id, part)?;
                    model.objects.insert(id, object);
                }
            }
            _ => {}
        }
    }
    if !seen {
        return Err(fault(
            part,
            format!("no element of the 3MF core namespace ({CORE})"),
        ));
    }
    if current.is_some() {
        return Err(MeshFileError::Truncated {
            what: format!("{part} ends inside an object"),
        });
    }
    Ok(model)
}

fn element(
    model: &mut Model,
    current: &mut Option<(u32, Object)>,
    tag: &BytesStart,
    place: &Place,
) -> Result<(), MeshFileError> {
    match tag.local_name().as_ref() {
        "model" => {
            if let Some(unit) = attribute(tag, "unit", |_| place.name())? {
                model.unit = unit_of(&unit).ok_or_else(|| {
                    fault(&place.name(), format!("unit={} is no unit of 3MF", quoted(&unit)))
                })?;
            }
        }
        "object" => {
            let kind = attribute(tag, "type", |_| place.name())?;
            let counts = matches!(kind.as_deref(), None | Some("model" | "surface"));
            *current = Some((
                place.number(tag, "id")?,
                Object {
                    counts,
                    ..Object::default()
                },
            ));
        }
        "vertex" => {
            if let Some((_, object)) = current {
                let [x, y, z] = ["x", "y", "z"];
                let position = Vec3::new(
                    place.finite(tag, x)?,
                    place.finite(tag, y)?,
                    place.finite(tag, z)?,
                );
                object.mesh.vertices.push(position);
            }
        }
        "triangle" => {
            if let Some((_, object)) = current {
                let corners = [
                    place.number(tag, "v1")?,
                    place.number(tag, "v2")?,
                    place.number(tag, "v3")?,
                ];
                object.mesh.triangles.push(corners);
            }
        }
        "component" => {
            if let Some((_, object)) = current {
                object.components.push(place.placement(tag)?);
            }
        }
        "item" => model.build.push(place.placement(tag)?),
        _ => {}
    }
    Ok(())
}

fn check_indices(mesh: &TriMesh, object: u32, part: &str) -> Result<(), MeshFileError> {
    let count = mesh.vertices.len();
    for (number, t) in mesh.triangles.iter().enumerate() {
        if let Some(v) = t.iter().find(|&&v| v as usize >= count) {
            return Err(MeshFileError::IndexOutOfRange {
                place: format!("{part}, object {object}, triangle {number}"),
                index: v.to_string(),
                count,
                from_one: false,
            });
        }
    }
    Ok(())
}

/// The build in the making.
struct Assembly<'a> {
    models: &'a BTreeMap<String, Model>,
    mesh: TriMesh,
    supports: usize,
    placements: usize,
}

impl Assembly<'_> {
    fn place(
        &mut self,
        part: &str,
        item: &Placement,
        outer: &Transform,
        depth: usize,
    ) -> Result<(), MeshFileError> {
        let part = item.path.as_deref().unwrap_or(part);
        let object = self
            .models
            .get(part)
            .and_then(|model| model.objects.get(&item.object))
            .ok_or_else(|| {
                fault(
                    part,
                    format!("there is no object {}, but it is to be built", item.object),
                )
            })?;
        if depth > DEEPEST {
            return Err(fault(part, format!("object {} contains itself", item.object)));
        }
        if !object.counts {
            self.supports += 1;
            return Ok(());
        }
        self.placements += 1;
        if self.placements > MOST_PLACEMENTS {
            return Err(MeshFileError::TooLarge {
                what: "placed objects",
                limit: MOST_PLACEMENTS as u64,
            });
        }
        let transform = product(&item.transform, outer);
        if self.mesh.triangles.len() + object.mesh.triangles.len() > MOST_TRIANGLES {
            return Err(MeshFileError::TooLarge {
                what: "triangles",
                limit: MOST_TRIANGLES as u64,
            });
        }
        let base = self.mesh.vertices.len() as u32;
        self.mesh
            .vertices
            .extend(object.mesh.vertices.iter().map(|v| apply(&transform, v)));
        // A mirrored placement would turn the surface inside out.
        let mirrored = determinant(&transform) < 0.0;
        self.mesh.triangles.extend(object.mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| v + base);
            if mirrored { [a, c, b] } else { [a, b, c] }
        }));
        for component in &object.components {
            self.place(part, component, &transform, depth + 1)?;
        }
        Ok(())
    }
}

fn apply(m: &Transform, v: &Vec3) -> Vec3 {
    Vec3::from([0, 1, 2].map(|k| v.x * m[k] + v.y * m[3 + k] + v.z * m[6 + k] + m[9 + k]))
}

/// The map that does `inner` first.
fn product(inner: &Transform, outer: &Transform) -> Transform {
    let mut m = IDENTITY;
    for row in 0..4 {
        for k in 0..3 {
            let sum: f64 = (0..3).map(|l| inner[3 * row + l] * outer[3 * l + k]).sum();
            m[3 * row + k] = if row == 3 { sum + outer[9 + k] } else { sum };
        }
    }
    m
}

fn determinant(m: &Transform) -> f64 {
    let row = |r: usize| Vec3::new(m[3 * r], m[3 * r + 1], m[3 * r + 2]);
    row(0).dot(&row(1).cross(&row(2)))
}
