//! Other people's readers, through Python.

use std::path::Path;
use std::process::Command;

/// The exit code with which a script says that a package is missing.
const MISSING: i32 = 77;

/// Runs a script of this folder and answers what it printed, or `None` with a word about it where Python or a package
/// is missing. `PLIANT_PYTHON` names the interpreter; with `PLIANT_REQUIRE_PYTHON` set, missing is failing.
pub fn run(script: &str, arguments: &[&Path]) -> Option<String> {
    let python = std::env::var("PLIANT_PYTHON").unwrap_or_else(|_| {
        let own = concat!(env!("CARGO_MANIFEST_DIR"), "/target/python/bin/python");
        if Path::new(own).exists() {
            own.into()
        } else {
            "python3".into()
        }
    });
    let script = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fabrication")).join(script);
    let missing = |why: &str| {
        assert!(std::env::var_os("PLIANT_REQUIRE_PYTHON").is_none(), "{why}");
        println!("skipped: {why}");
        None
    };
    let output = match Command::new(&python).arg(&script).args(arguments).output() {
        Ok(output) => output,
        Err(error) => return missing(&format!("{python}: {error}")),
    };
    let (text, errors) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    if output.status.code() == Some(MISSING) {
        return missing(&errors);
    }
    assert!(output.status.success(), "{}: {text}{errors}", script.display());
    Some(text.into_owned())
}
