//! A TOML file that people write, or a JSON file with the same keys: every mistake in it is answered with the file, the line, what was found and what was
//! expected.

use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A mistake in a file, at its place.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}:{line}:{column}: {message}", file.display())]
pub struct Mistake {
    /// The file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// What was found and what was expected.
    pub message: String,
}

/// The text of a TOML or JSON file and where it came from.
#[derive(Clone, Debug)]
pub struct Document {
    /// The file's path, for messages and for the paths inside it.
    pub file: PathBuf,
    /// Its text.
    pub text: String,
}

impl Document {
    /// Reads the file's text.
    ///
    /// # Errors
    /// [`Mistake`] if the file cannot be read.
    pub fn open(file: &Path) -> Result<Document, Mistake> {
        let unreadable = |e: std::io::Error| Mistake {
            file: file.to_path_buf(),
            line: 1,
            column: 1,
            message: format!("cannot be read: {e}"),
        };
        Ok(Document {
            file: file.to_path_buf(),
            text: std::fs::read_to_string(file).map_err(unreadable)?,
        })
    }

    /// Reads the text as a `T`.
    ///
    /// # Errors
    /// [`Mistake`]: not TOML (or JSON, where the file's name ends in `.json`), a key that is missing or unknown, a value of
    /// the wrong kind.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, Mistake> {
        let ending = self.file.extension().and_then(|e| e.to_str()).unwrap_or("");
        if ending.eq_ignore_ascii_case("json") {
            return self.parse_toml(&self.json_as_toml()?);
        }
        self.parse_toml(&self.text)
    }

    fn parse_toml<T: DeserializeOwned>(&self, text: &str) -> Result<T, Mistake> {
        toml::from_str(text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            self.mistake(&span, error.message().trim().replace('\n', "; "))
        })
    }

    /// The JSON as TOML, byte by byte, so that places in one are places in the other: `:` becomes `=`, and of the outermost
    /// object the braces become blanks and the commas line breaks. What is left are inline tables, which may span lines
    /// (TOML 1.1).
    fn json_as_toml(&self) -> Result<String, Mistake> {
        if let Err(error) = serde_json::from_str::<serde_json::Map<String, serde_json::Value>>(&self.text) {
            let line = error.line().saturating_sub(1);
            let start: usize = self.text.split_inclusive('\n').take(line).map(str::len).sum();
            let at = start + error.column().saturating_sub(1);
            return Err(self.mistake(&(at..at), format!("no JSON object: {error}")));
        }
        let mut toml = self.text.clone().into_bytes();
        let (mut depth, mut quoted, mut escaped) = (0, false, false);
        for byte in &mut toml {
            if quoted {
                quoted = *byte != b'"' || escaped;
                escaped = *byte == b'\\' && !escaped;
                continue;
            }
            match *byte {
                b'"' => quoted = true,
                b'{' | b'[' => {
                    depth += 1;
                    if depth == 1 {
                        *byte = b' ';
                    }
                }
                b'}' | b']' => {
                    if depth == 1 {
                        *byte = b' ';
                    }
                    depth -= 1;
                }
                b':' => *byte = b'=',
                b',' if depth == 1 => *byte = b'\n',
                b'\n' | b'\r' if depth == 1 => *byte = b' ',
                _ => {}
            }
        }
        // Only ASCII was changed, and to ASCII.
        Ok(String::from_utf8_lossy(&toml).into_owned())
    }

    /// A mistake at the bytes `span` of the text.
    pub fn mistake(&self, span: &Range<usize>, message: impl Into<String>) -> Mistake {
        let before = self.text.get(..span.start).unwrap_or(&self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        Mistake {
            file: self.file.clone(),
            line,
            column,
            message: message.into(),
        }
    }

    /// A path written in the file, taken from the folder that the file lies in.
    pub fn resolve(&self, path: &str) -> PathBuf {
        self.file.parent().unwrap_or(Path::new("")).join(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Sample {
        #[allow(dead_code)]
        force: toml::Spanned<String>,
    }

    fn document(text: &str) -> Document {
        Document {
            file: "designs/a/goal.toml".into(),
            text: text.into(),
        }
    }

    #[test]
    fn mistakes_name_file_line_and_column() {
        let error = document("\nforce = 12\n").parse::<Sample>().unwrap_err();
        assert_eq!((error.line, error.column), (2, 9));
        assert!(
            error.to_string().starts_with("designs/a/goal.toml:2:9: "),
            "{error}"
        );
        let unknown = document("force = \"1 N\"\nfroce = 2\n")
            .parse::<Sample>()
            .unwrap_err();
        assert_eq!(unknown.line, 2);
        assert!(unknown.message.contains("froce"), "{unknown}");
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Whole {
        name: String,
        loads: Vec<Part>,
        scale: f64,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Part {
        at: toml::Spanned<Vec<f64>>,
    }

    #[test]
    fn json_has_the_same_keys_and_the_same_places() {
        let json = |text: &str| Document {
            file: "scene.json".into(),
            text: text.into(),
        };
        let text = "{\n  \"name\":\n \"a, \\\"b\\\": {c}\",\n  \"loads\": [{\"at\": [1,\n 2.5e-3]}, {\"at\": []}],\n\"scale\": 2\n}\n";
        let document = json(text);
        let whole: Whole = document.parse().unwrap();
        assert_eq!((whole.name.as_str(), whole.scale), ("a, \"b\": {c}", 2.0));
        assert_eq!(whole.loads[0].at.get_ref(), &[1.0, 2.5e-3]);
        let mistake = document.mistake(&whole.loads[1].at.span(), "here");
        assert_eq!((mistake.line, mistake.column), (5, 19));
        let broken = json("{\n\"name\": ]\n}").parse::<Whole>().unwrap_err();
        assert_eq!(broken.line, 2, "{broken}");
        let unknown = json("{\"name\": \"a\",\n\"nmae\": 1}")
            .parse::<Whole>()
            .unwrap_err();
        assert!(unknown.line == 2 && unknown.message.contains("nmae"), "{unknown}");
    }

    #[test]
    fn paths_start_at_the_file() {
        assert_eq!(
            document("").resolve("sole.stl"),
            PathBuf::from("designs/a/sole.stl")
        );
        assert_eq!(
            document("").resolve("/tmp/sole.stl"),
            PathBuf::from("/tmp/sole.stl")
        );
    }
}
