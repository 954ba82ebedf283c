//! Where things stand in a TOML file: lines of fields, fields that a structure does not know.

use super::record::{RecordError, Unknown};
use serde::Serialize;
use std::path::Path;

/// Reads any TOML file into `T`, with the line of what is wrong.
///
/// # Errors
/// [`RecordError::Syntax`].
pub fn read_toml<T: serde::de::DeserializeOwned>(text: &str, file: &Path) -> Result<T, RecordError> {
    toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| line_of(text, span.start));
        RecordError::Syntax {
            file: file.to_path_buf(),
            line,
            message: error.message().to_string(),
        }
    })
}

/// A [`RecordError::Field`] at the line where `field` stands.
pub fn field_error(
    text: &str,
    file: &Path,
    field: &str,
    value: &dyn std::fmt::Display,
    expected: &str,
) -> RecordError {
    RecordError::Field {
        file: file.to_path_buf(),
        line: line_of_field(text, field),
        field: field.into(),
        value: value.to_string(),
        expected: expected.into(),
    }
}

/// The line, from 1, of a byte offset.
fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&b| b == b'\n').count()
}

/// The line, from 1, where a field such as `model.centres[2].weights` stands; that of the nearest table that holds it
/// if it is missing, 1 if the text is no TOML.
pub fn line_of_field(text: &str, field: &str) -> usize {
    use toml::de::{DeTable, DeValue};
    let Ok(root) = DeTable::parse(text) else { return 1 };
    let mut offset = 0;
    let mut table = Some(root.get_ref());
    let mut list: Option<&toml::de::DeArray<'_>> = None;
    for part in field.split(['.', '[']) {
        let value = match part.strip_suffix(']') {
            Some(index) => index
                .parse::<usize>()
                .ok()
                .and_then(|i| list.and_then(|l| l.get(i))),
            None => match table.and_then(|t| t.get_key_value(part)) {
                Some((key, value)) => {
                    offset = key.span().start;
                    Some(value)
                }
                None => None,
            },
        };
        let Some(value) = value else { break };
        if part.ends_with(']') {
            offset = value.span().start;
        }
        (table, list) = match value.get_ref() {
            DeValue::Table(t) => (Some(t), None),
            DeValue::Array(l) => (None, Some(l)),
            _ => (None, None),
        };
    }
    line_of(text, offset)
}

/// The fields of `text` that are not in `known` when that is written again.
pub fn unknown_fields<T: Serialize>(text: &str, known: &T) -> Vec<Unknown> {
    let (Ok(found), Ok(written)) = (toml::from_str::<toml::Value>(text), toml::Value::try_from(known)) else {
        return Vec::new();
    };
    let mut paths = Vec::new();
    missing_keys(&found, &written, "", &mut paths);
    paths
        .into_iter()
        .map(|field| Unknown {
            line: line_of_field(text, &field),
            field,
        })
        .collect()
}

fn missing_keys(found: &toml::Value, written: &toml::Value, path: &str, out: &mut Vec<String>) {
    match (found, written) {
        (toml::Value::Table(found), toml::Value::Table(written)) => {
            for (key, value) in found {
                let here = if path.is_empty() {
                    key.clone()
                } else {
                    format!("{path}.{key}")
                };
                match written.get(key) {
                    Some(other) => missing_keys(value, other, &here, out),
                    None => out.push(here),
                }
            }
        }
        (toml::Value::Array(found), toml::Value::Array(written)) => {
            for (i, (value, other)) in found.iter().zip(written).enumerate() {
                missing_keys(value, other, &format!("{path}[{i}]"), out);
            }
        }
        _ => {}
    }
}
