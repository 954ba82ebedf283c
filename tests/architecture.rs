//! The house's plan: each folder of `src/` uses only what stands below it.
//!
//! A new folder or a new edge is a change to [`PLAN`] and to the table in `src/lib.rs`, made on purpose, with a line in
//! `docs/decisions/`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// A folder of `src/`, its floor, and the folders that it may use.
struct Room {
    floor: u8,
    folder: &'static str,
    uses: &'static [&'static str],
}

const PLAN: [Room; 13] = [
    Room {
        floor: 0,
        folder: "math",
        uses: &[],
    },
    Room {
        floor: 0,
        folder: "units",
        uses: &[],
    },
    Room {
        floor: 1,
        folder: "geometry",
        uses: &["math", "units"],
    },
    Room {
        floor: 1,
        folder: "numerics",
        uses: &["math"],
    },
    Room {
        floor: 2,
        folder: "material",
        uses: &["math", "units"],
    },
    Room {
        floor: 3,
        folder: "fem",
        uses: &["geometry", "numerics", "material", "math", "units"],
    },
    Room {
        floor: 4,
        folder: "laboratory",
        uses: &["fem", "material", "geometry", "numerics", "math", "units"],
    },
    Room {
        floor: 5,
        folder: "fitting",
        uses: &["fem", "material", "numerics", "geometry", "math", "units"],
    },
    Room {
        floor: 6,
        folder: "design",
        uses: &["fem", "material", "numerics", "geometry", "math", "units"],
    },
    Room {
        floor: 7,
        folder: "fabrication",
        uses: &["design", "material", "geometry", "math", "units"],
    },
    Room {
        floor: 8,
        folder: "report",
        uses: ALL_BELOW,
    },
    Room {
        floor: 9,
        folder: "verify",
        uses: ALL_BELOW,
    },
    Room {
        floor: 10,
        folder: "cli",
        uses: ALL_BELOW,
    },
];

/// Every folder on a lower floor.
const ALL_BELOW: &[&str] = &["*"];

fn room(folder: &str) -> Option<&'static Room> {
    PLAN.iter().find(|room| room.folder == folder)
}

fn may_use(from: &Room, to: &Room) -> bool {
    let named = from.uses.contains(&to.folder);
    from.folder == to.folder || named || (from.uses == ALL_BELOW && to.floor < from.floor)
}

/// The parts of Rust that paths are made of: identifiers, `::`, and single marks. Comments and texts are left out, so
/// neither a link in a comment nor a message can break the plan.
fn tokens(source: &str) -> Vec<(usize, String)> {
    let chars: Vec<char> = source.chars().collect();
    let (mut tokens, mut i, mut line) = (Vec::new(), 0, 1);
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    while i < chars.len() {
        let start = i;
        match chars[i] {
            '/' if at(i + 1) == '/' => {
                while i < chars.len() && chars[i] != '\n' {
                    i += 1;
                }
            }
            '/' if at(i + 1) == '*' => {
                let mut depth = 0;
                loop {
                    match (at(i), at(i + 1)) {
                        ('/', '*') => (depth, i) = (depth + 1, i + 2),
                        ('*', '/') => (depth, i) = (depth - 1, i + 2),
                        _ => i += 1,
                    }
                    if depth == 0 || i >= chars.len() {
                        break;
                    }
                }
            }
            'r' if raw_text_end(&chars, i).is_some() => i = raw_text_end(&chars, i).unwrap_or(chars.len()),
            '"' => {
                i += 1;
                while i < chars.len() && chars[i] != '"' {
                    i += if chars[i] == '\\' { 2 } else { 1 };
                }
                i += 1;
            }
            // A character; what else starts with an apostrophe is a lifetime.
            '\'' if at(i + 1) == '\\' => {
                i += 3;
                while i < chars.len() && chars[i] != '\'' {
                    i += 1;
                }
                i += 1;
            }
            '\'' if at(i + 2) == '\'' => i += 3,
            c if c.is_alphabetic() || c == '_' => {
                while at(i).is_alphanumeric() || at(i) == '_' {
                    i += 1;
                }
                tokens.push((line, chars[start..i].iter().collect()));
            }
            ':' if at(i + 1) == ':' => {
                i += 2;
                tokens.push((line, "::".into()));
            }
            c => {
                i += 1;
                if !c.is_whitespace() {
                    tokens.push((line, c.into()));
                }
            }
        }
        line += chars[start..i.min(chars.len())]
            .iter()
            .filter(|c| **c == '\n')
            .count();
    }
    tokens
}

/// Where a raw text (`r"…"`, `r#"…"#`) that starts at `i` ends.
fn raw_text_end(chars: &[char], i: usize) -> Option<usize> {
    let before = i.checked_sub(1).map_or(' ', |k| chars[k]);
    if (before.is_alphanumeric() && before != 'b') || before == '_' {
        return None;
    }
    let hashes = chars[i + 1..].iter().take_while(|c| **c == '#').count();
    if chars.get(i + 1 + hashes) != Some(&'"') {
        return None;
    }
    let mut end = i + 2 + hashes;
    while end < chars.len() {
        if chars[end] == '"'
            && chars[end + 1..]
                .iter()
                .take(hashes)
                .filter(|c| **c == '#')
                .count()
                == hashes
        {
            return Some(end + 1 + hashes);
        }
        end += 1;
    }
    Some(end)
}

/// Lines and names of what a file uses at the crate's root, given how deep its module lies (`src/a/b.rs`: 2).
fn used_at_root(source: &str, file_depth: usize) -> Vec<(usize, String)> {
    let tokens = tokens(source);
    let text = |i: usize| tokens.get(i).map_or("", |t| t.1.as_str());
    let mut used = Vec::new();
    // One entry per open brace: whether it opened a module.
    let mut braces: Vec<bool> = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        match text(i) {
            "{" => braces.push(i >= 2 && text(i - 2) == "mod"),
            "}" => {
                braces.pop();
            }
            "crate" if text(i + 1) == "::" => names_after(&tokens, i + 2, &mut used),
            "super" if text(i + 1) == "::" => {
                let depth = file_depth + braces.iter().filter(|module| **module).count();
                let mut supers = 1;
                while text(i + 2) == "super" && text(i + 3) == "::" {
                    (supers, i) = (supers + 1, i + 2);
                }
                if supers >= depth {
                    names_after(&tokens, i + 2, &mut used);
                }
            }
            _ => {}
        }
        i += 1;
    }
    used
}

/// The first name of a path, or the first of each in braces.
fn names_after(tokens: &[(usize, String)], start: usize, used: &mut Vec<(usize, String)>) {
    if tokens.get(start).is_none_or(|t| t.1 != "{") {
        used.extend(tokens.get(start).cloned());
        return;
    }
    let (mut depth, mut first) = (0, true);
    for token in &tokens[start..] {
        match token.1.as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            "," if depth == 1 => first = true,
            _ if depth == 1 && first => {
                used.push(token.clone());
                first = false;
            }
            _ => {}
        }
        if depth == 0 {
            return;
        }
    }
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)
        .expect("src")
        .map(|e| e.expect("an entry").path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

fn source_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// What a file, by its path in `src/`, does against the plan.
fn breaches(path: &Path, source: &str) -> Vec<String> {
    let parts: Vec<String> = path
        .iter()
        .map(|p| p.to_string_lossy().replace(".rs", ""))
        .collect();
    // The crate's own two files are doors and no folders.
    if parts.len() == 1 && matches!(parts[0].as_str(), "lib" | "main") {
        return Vec::new();
    }
    let Some(from) = room(&parts[0]) else {
        return vec![format!("{}: `{}` is not in the plan", path.display(), parts[0])];
    };
    let depth = parts.len() - usize::from(parts.last().is_some_and(|p| p == "mod"));
    let breach = |(line, name): (usize, String)| match room(&name) {
        Some(to) if may_use(from, to) => None,
        Some(_) => Some(format!(
            "{}:{line}: `{}` may not use `{name}`",
            path.display(),
            from.folder
        )),
        None => Some(format!("{}:{line}: `{name}` is not in the plan", path.display())),
    };
    used_at_root(source, depth)
        .into_iter()
        .filter_map(breach)
        .collect()
}

#[test]
fn every_folder_uses_only_what_the_plan_allows() {
    let root = source_folder();
    let mut files = Vec::new();
    rust_files(&root, &mut files);
    let found: Vec<String> = files
        .iter()
        .flat_map(|path| {
            breaches(
                path.strip_prefix(&root).expect("below"),
                &fs::read_to_string(path).expect("text"),
            )
        })
        .collect();
    assert!(
        found.is_empty(),
        "{} breaches of the plan:\n{}",
        found.len(),
        found.join("\n")
    );
}

#[test]
fn plan_leads_downwards() {
    for from in &PLAN {
        for to in from.uses.iter().filter(|uses| **uses != "*") {
            let to = room(to).unwrap_or_else(|| panic!("{to} is not in the plan"));
            assert!(
                to.floor < from.floor,
                "{} on floor {} uses {}",
                from.folder,
                from.floor,
                to.folder
            );
        }
    }
}

/// `src/lib.rs` shows the same plan, and declares these folders and no others.
#[test]
fn library_shows_the_plan() {
    let source = fs::read_to_string(source_folder().join("lib.rs")).expect("lib.rs");
    let rows: Vec<Vec<String>> = source
        .lines()
        .filter_map(|line| line.strip_prefix("//! | "))
        .map(|row| {
            row.trim_end_matches('|')
                .split(" | ")
                .map(|c| c.trim().to_string())
                .collect()
        })
        .filter(|row: &Vec<String>| row[0].parse::<u8>().is_ok())
        .collect();
    let shown: BTreeSet<(String, String, BTreeSet<String>)> = rows
        .iter()
        .map(|row| {
            let folder = row[1].trim_matches(|c| "[`]".contains(c)).to_string();
            (
                row[0].clone(),
                folder,
                row[3].split(", ").map(str::to_string).collect(),
            )
        })
        .collect();
    let planned = PLAN.iter().map(|room| {
        let uses: BTreeSet<String> = match room.uses {
            [] => ["–".to_string()].into(),
            ALL_BELOW if room.folder == "cli" => ["all".to_string()].into(),
            ALL_BELOW => ["all below".to_string()].into(),
            uses => uses.iter().map(|u| u.to_string()).collect(),
        };
        (room.floor.to_string(), room.folder.to_string(), uses)
    });
    assert_eq!(shown, planned.collect());
    let declared: BTreeSet<&str> = source
        .lines()
        .filter_map(|l| l.strip_prefix("pub mod ")?.strip_suffix(';'))
        .collect();
    assert_eq!(declared, PLAN.iter().map(|room| room.folder).collect());
}

/// The check itself: what it must find, and what it must not take for a path.
#[test]
fn breaches_are_found() {
    let count = |path: &str, source: &str| breaches(Path::new(path), source).len();
    assert_eq!(count("math/polar.rs", "use crate::fem::Element;"), 1);
    assert_eq!(
        count("math/mod.rs", "fn f() -> crate :: geometry::TriMesh { todo!() }"),
        1
    );
    assert_eq!(
        count(
            "geometry/a.rs",
            "use crate::{math::{Vec3, fem}, fem::{self}, units};"
        ),
        1
    );
    assert_eq!(count("geometry/a.rs", "use super::super::material::Law;"), 1);
    assert_eq!(count("geometry/mod.rs", "use super::material::Law;"), 1);
    assert_eq!(
        count(
            "geometry/a.rs",
            "mod tests { use super::super::super::{fem, math}; }"
        ),
        1
    );
    assert_eq!(count("fem/a/b.rs", "use super::super::design::X;"), 0);
    assert_eq!(
        count(
            "geometry/a.rs",
            "mod tests { use super::super::material::Local; }"
        ),
        0
    );
    assert_eq!(count("math/a.rs", "fn f() { \"\\\"\"; } use crate::fem::X;"), 1);
    assert_eq!(
        count(
            "math/a.rs",
            "fn f<'a>(c: char) -> bool { c == '\"' } use crate::fem::X; // \""
        ),
        1
    );
    assert_eq!(
        count(
            "math/a.rs",
            "/* crate::fem */ // crate::fem\nconst A: &str = r#\"crate::\"fem\"#;"
        ),
        0
    );
    assert_eq!(
        count("math/a.rs", "macro_rules! m { () => { $crate::report::plot() } }"),
        1
    );
    assert_eq!(count("math/a.rs", "use crate::Shortcut;"), 1);
    assert_eq!(count("attic/a.rs", ""), 1);
    assert_eq!(
        count("cli/db.rs", "use crate::report::table; use crate::math::Vec3;"),
        0
    );
    assert_eq!(count("report/a.rs", "use crate::cli::terminal;"), 1);
}
