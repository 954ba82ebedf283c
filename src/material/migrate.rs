//! From older schemas of the record to the one of this version.
//!
//! | schema | what changed |
//! |---|---|
//! | 1 | the first |
//! | 2 | `version`, `previous_sha256`, `recipe`, `[uncertainty]`; `rms_mm` and `largest_mm` of a measurement. A record of schema 1 is version 1 of its material |
//!
//! A record is read in any schema; a newer one than this program's is refused. [`rewritten`] changes a file's text, and
//! touches nothing but what the schema changed: comments, order, digits and fields unknown to this version stay.

use super::record::{MaterialRecord, RecordError, SCHEMA, field_error};
use std::path::Path;

/// Brings a record that was read from `text` in any schema to [`SCHEMA`].
///
/// # Errors
/// A schema that this program does not know, a version that is missing.
pub(super) fn migrate(record: &mut MaterialRecord, text: &str, file: &Path) -> Result<(), RecordError> {
    if !(1..=SCHEMA).contains(&record.schema) {
        let expected = format!("1 to {SCHEMA}; a newer file needs a newer pliant");
        return Err(field_error(text, file, "schema", &record.schema, &expected));
    }
    if record.schema == 1 && record.version == 0 {
        record.version = 1;
    }
    if record.version == 0 {
        let expected = "a whole number from 1";
        return Err(field_error(text, file, "version", &"missing or 0", expected));
    }
    record.schema = SCHEMA;
    Ok(())
}

/// The text of a record's file in this version's schema; none if it is in it already. `recipe` is the file that the record
/// was fitted from, where there is one.
///
/// # Errors
/// A text that is no record, or that has no line with `schema` alone on it.
pub fn rewritten(text: &str, file: &Path, recipe: Option<&str>) -> Result<Option<String>, RecordError> {
    #[derive(serde::Deserialize)]
    struct Head {
        schema: u32,
    }
    let head: Head = super::record::read_toml(text, file)?;
    MaterialRecord::parse(text, file)?;
    if head.schema == SCHEMA {
        return Ok(None);
    }
    let unclear = || {
        let expected = "schema alone on its line, so that it can be rewritten";
        field_error(text, file, "schema", &head.schema, expected)
    };
    let line = super::record::line_of_field(text, "schema") - 1;
    let old = text.lines().nth(line).ok_or_else(unclear)?;
    let (code, comment) = old
        .split_once('#')
        .map_or((old, ""), |(code, comment)| (code, comment));
    if code.replace(' ', "").trim() != format!("schema={}", head.schema) {
        return Err(unclear());
    }
    let comment = if comment.is_empty() {
        String::new()
    } else {
        format!(" #{comment}")
    };
    let mut new = format!("schema = {SCHEMA}{comment}\nversion = 1");
    if let Some(recipe) = recipe {
        new.push_str(&format!("\nrecipe = {}", toml::Value::from(recipe)));
    }
    let mut lines: Vec<&str> = text.lines().collect();
    lines[line] = &new;
    let mut rewritten = lines.join("\n");
    rewritten.push('\n');
    // What was written must read as what was there.
    let before = MaterialRecord::parse(text, file)?.0;
    let (mut after, _) = MaterialRecord::parse(&rewritten, file)?;
    after.recipe = before.recipe.clone();
    if after != before {
        return Err(unclear());
    }
    Ok(Some(rewritten))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: &str = include_str!("../../materials-db/versions/body-double-silk@1.toml");

    /// A record of schema 1, with a comment and a field that this version does not know.
    fn old() -> String {
        let head = "schema = 2\nversion = 1\nrecipe = \"coupons/body-double-silk.toml\"\n";
        assert!(NOW.contains(head));
        NOW.replace(head, "schema = 1 # the first\nodour = \"sweet\"   # as told\n")
    }

    #[test]
    fn an_older_record_reads_as_version_1() {
        let file = Path::new("body-double-silk.toml");
        let (before, unknown) = MaterialRecord::parse(&old(), file).unwrap();
        let (mut now, _) = MaterialRecord::parse(NOW, file).unwrap();
        assert_eq!(unknown.len(), 1);
        assert_eq!((unknown[0].field.as_str(), unknown[0].line), ("odour", 5));
        now.recipe = None;
        assert_eq!(before, now);
    }

    #[test]
    fn rewriting_changes_the_schema_and_nothing_else() {
        let file = Path::new("body-double-silk.toml");
        let recipe = "coupons/body-double-silk.toml";
        let new = rewritten(&old(), file, Some(recipe)).unwrap().unwrap();
        let expected = "schema = 2 # the first\nversion = 1\nrecipe = \"coupons/body-double-silk.toml\"\nodour = \"sweet\"   # as told\n";
        assert_eq!(
            new,
            old().replace(
                "schema = 1 # the first\nodour = \"sweet\"   # as told\n",
                expected
            )
        );
        assert_eq!(rewritten(&new, file, Some(recipe)).unwrap(), None);
    }

    #[test]
    fn what_cannot_be_read_is_refused() {
        let file = Path::new("a.toml");
        let refused = |text: &str| MaterialRecord::parse(text, file).unwrap_err().to_string();
        let newer = refused(&NOW.replace("schema = 2", "schema = 3"));
        assert!(
            newer.contains("line 4: schema = 3") && newer.contains("newer pliant"),
            "{newer}"
        );
        let none = refused(&NOW.replace("version = 1\n", ""));
        assert!(none.contains("version = missing"), "{none}");
        let dotted = old().replace("schema = 1 # the first", "\"schema\" = 1");
        let refused = rewritten(&dotted, file, None).unwrap_err().to_string();
        assert!(refused.contains("alone on its line"), "{refused}");
    }
}
