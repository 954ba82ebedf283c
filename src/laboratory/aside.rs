//! Finished presses on disk, so that a run that was broken off goes on where it was.
//!
//! Each press is a TOML file in a folder of the laboratory beside the set to come, with a checksum of everything that it
//! depends on: structure, base material, supports, markers, the press itself, this program's version. What has another checksum
//! is computed again.

use super::measure::Press;
use super::read::{Laboratory, Probe};
use super::set::fixed;
use crate::units::whole_file::replace_file;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::io;
use std::path::{Path, PathBuf};

#[derive(Serialize, Deserialize)]
struct Kept {
    sha256: String,
    press: Press,
}

/// The folder of a laboratory's finished presses.
#[derive(Clone, Debug)]
pub struct Aside {
    folder: PathBuf,
    common: String,
}

impl Aside {
    /// The finished presses of `laboratory` whose set goes to `out`.
    pub fn new(laboratory: &Laboratory, out: &Path) -> Aside {
        let fine = &laboratory.fine;
        let common = format!(
            "{} {} {:?} {:?} {:?} {:?} {:?} {} {:?}",
            env!("CARGO_PKG_VERSION"),
            laboratory.words,
            laboratory.base.law,
            laboratory.fixed.iter().map(fixed).collect::<String>(),
            laboratory.markers,
            fine.size,
            fine.fill,
            fine.mesh.nodes.len(),
            fine.mesh.elements,
        );
        Aside {
            folder: out.join(format!(".measuring-{}", laboratory.card.id)),
            common: hex(common.as_bytes()),
        }
    }

    fn sum(&self, probe: &Probe) -> String {
        hex(format!("{} {probe:?}", self.common).as_bytes())
    }

    fn file(&self, probe: &Probe) -> PathBuf {
        self.folder.join(format!("{}.toml", probe.name))
    }

    /// The press of `probe`, if it was finished before and nothing that it depends on has changed.
    pub fn find(&self, probe: &Probe) -> Option<Press> {
        let text = std::fs::read_to_string(self.file(probe)).ok()?;
        let kept: Kept = toml::from_str(&text).ok()?;
        (kept.sha256 == self.sum(probe)).then_some(kept.press)
    }

    /// Keeps a finished press.
    ///
    /// # Errors
    /// What the system says.
    pub fn keep(&self, probe: &Probe, press: &Press) -> io::Result<()> {
        let kept = Kept {
            sha256: self.sum(probe),
            press: press.clone(),
        };
        // TOML, since numbers come back from it as they were, to the last bit.
        let text = toml::to_string(&kept).map_err(io::Error::other)?;
        replace_file(&self.file(probe), text.as_bytes())
    }

    /// Takes the folder away, once the set is written. Best effort: what is left is only in the way of nothing.
    pub fn clear(&self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

fn hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}
