//! A mesh as arrays in JSON, as other programs dump it: an object with `nodes`, a list of triples, and `tetrahedra` or
//! `hexahedra`, lists of node numbers from 0. Every other list of node numbers becomes a set of nodes; every list of whole
//! numbers or texts with one entry an element becomes groups `LIST=VALUE`. Everything else is passed over.

use super::volume::{CellKind, RawCell, RawVolume, missing};
use super::volume_error::VolumeFileError;
use crate::math::Vec3;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

const NODES: [&str; 3] = ["nodes", "nodes_mm", "points"];
const TETRAHEDRA: [&str; 2] = ["tetrahedra", "tets"];
const HEXAHEDRA: [&str; 2] = ["hexahedra", "hexes"];
/// More values than this are data, not labels of parts.
const MOST_LABELS: usize = 256;

pub(super) fn read(bytes: &[u8]) -> Result<RawVolume, VolumeFileError> {
    let value: Value = serde_json::from_slice(bytes).map_err(|e| VolumeFileError::Syntax {
        place: format!("line {}, column {}", e.line(), e.column()),
        found: e.to_string(),
        expected: "JSON".into(),
    })?;
    let Value::Object(map) = value else {
        return Err(syntax(
            "the file",
            "no object",
            "{\"nodes\": [[x, y, z], …], \"tetrahedra\": [[a, b, c, d], …]}",
        ));
    };
    let mut raw = RawVolume::default();
    let (name, nodes) = first(&map, &NODES)
        .ok_or_else(|| syntax("the file", "no array \"nodes\"", "[[x, y, z], …] under that name"))?;
    for (i, row) in nodes.iter().enumerate() {
        raw.nodes.push(point(row, &format!("{name}[{i}]"))?);
        raw.node_numbers.push(i as u64);
    }
    let mut number = 0;
    for (names, kind) in [
        (&TETRAHEDRA, CellKind::Tetrahedron),
        (&HEXAHEDRA, CellKind::Hexahedron),
    ] {
        let Some((name, rows)) = first(&map, names) else {
            continue;
        };
        for (i, row) in rows.iter().enumerate() {
            let corners = corners(row, kind, &format!("{name}[{i}]"), number, &raw)?;
            raw.cells.push(RawCell {
                kind,
                corners,
                number,
            });
            number += 1;
        }
    }
    let own = NODES.iter().chain(&TETRAHEDRA).chain(&HEXAHEDRA);
    let own: Vec<&str> = own.copied().collect();
    for (name, value) in map.iter().filter(|(n, _)| !own.contains(&n.as_str())) {
        let Value::Array(list) = value else { continue };
        if list.len() == raw.cells.len() && !list.is_empty() {
            raw.groups.extend(labels(name, list));
        } else if let Some(members) = numbers_of_nodes(list, raw.nodes.len()) {
            raw.node_sets.push((name.clone(), members));
        }
    }
    Ok(raw)
}

fn syntax(place: &str, found: &str, expected: &str) -> VolumeFileError {
    VolumeFileError::Syntax {
        place: place.into(),
        found: found.into(),
        expected: expected.into(),
    }
}

fn first<'a>(map: &'a Map<String, Value>, names: &[&'a str]) -> Option<(&'a str, &'a Vec<Value>)> {
    names
        .iter()
        .find_map(|&name| Some((name, map.get(name)?.as_array()?)))
}

fn point(row: &Value, place: &str) -> Result<Vec3, VolumeFileError> {
    let list = row.as_array().filter(|list| list.len() == 3);
    let numbers: Option<Vec<f64>> = list.and_then(|list| list.iter().map(Value::as_f64).collect());
    let Some(x) = numbers else {
        return Err(syntax(place, &row.to_string(), "three numbers [x, y, z]"));
    };
    // JSON has no word for NaN, but numbers that are too large become infinite.
    if x.iter().any(|c| !c.is_finite()) {
        return Err(VolumeFileError::NotFinite {
            place: place.into(),
            value: row.to_string(),
        });
    }
    Ok(Vec3::new(x[0], x[1], x[2]))
}

fn corners(
    row: &Value,
    kind: CellKind,
    place: &str,
    number: u64,
    raw: &RawVolume,
) -> Result<[u32; 8], VolumeFileError> {
    let count = kind.corners();
    let list = row.as_array().filter(|list| list.len() == count);
    let Some(list) = list else {
        let expected = format!("{count} node numbers");
        return Err(syntax(place, &row.to_string(), &expected));
    };
    let mut corners = [0; 8];
    for (corner, value) in corners.iter_mut().zip(list) {
        let node = value.as_u64().filter(|&n| n < raw.nodes.len() as u64);
        *corner = node.ok_or_else(|| missing(place, number, value, &raw.node_numbers))? as u32;
    }
    Ok(corners)
}

/// The list as node indices, if it is one of nothing else.
fn numbers_of_nodes(list: &[Value], nodes: usize) -> Option<Vec<u32>> {
    let index = |v: &Value| v.as_u64().filter(|&n| n < nodes as u64).map(|n| n as u32);
    list.iter()
        .map(index)
        .collect::<Option<Vec<u32>>>()
        .filter(|l| !l.is_empty())
}

/// The cells of each value of a list with one whole number or text a cell; none if it holds anything else, or too many.
fn labels(name: &str, list: &[Value]) -> Vec<(String, Vec<u32>)> {
    let mut cells: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    for (cell, value) in (0_u32..).zip(list) {
        let label = match value {
            Value::String(text) => text.clone(),
            Value::Number(n) if n.is_i64() || n.is_u64() => n.to_string(),
            _ => return Vec::new(),
        };
        cells.entry(label).or_default().push(cell);
        if cells.len() > MOST_LABELS {
            return Vec::new();
        }
    }
    let named = |(label, cells)| (format!("{name}={label}"), cells);
    cells.into_iter().map(named).collect()
}
