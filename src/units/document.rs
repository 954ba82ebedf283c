//! A TOML file that people write: every mistake in it is answered with the file, the line, what was found and what was
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

/// The text of a TOML file and where it came from.
#[derive(Clone, Debug)]
pub struct Document {
    /// The file's path, for messages and for the paths inside it.
    pub file: PathBuf,
    /// Its text.
    pub text: String,
}

impl Document {
    /// Reads the text as a `T`.
    ///
    /// # Errors
    /// [`Mistake`]: not TOML, a key that is missing or unknown, a value of the wrong kind.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, Mistake> {
        toml::from_str(&self.text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            self.mistake(&span, error.message().trim().replace('\n', "; "))
        })
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
