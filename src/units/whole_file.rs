//! Files that are whole or not there: bytes go to a file beside the target, are brought to the disk, and take the target's
//! name in one step. Whoever reads meanwhile, or after a crash, finds the old file or the new one, never half of one.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// Writes `bytes` to `file`, in place of what was there. Makes the folder if it is missing.
///
/// # Errors
/// What the system says; the old file is then as it was.
pub fn replace_file(file: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = folder_of(file);
    std::fs::create_dir_all(folder)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".pliant-");
    // A temporary file is its owner's alone; this asks for what an ordinary new file gets, less the process's mask.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut aside = builder.tempfile_in(folder)?;
    aside.write_all(bytes)?;
    aside.as_file().sync_all()?;
    aside.persist(file).map_err(|e| e.error)?;
    sync_folder(folder);
    Ok(())
}

/// The folder that `file` lies in.
pub fn folder_of(file: &Path) -> &Path {
    file.parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
}

/// Brings a folder's list of names to the disk. Best effort: some file systems know no such thing.
pub fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_nothing_else_is_left() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("made").join("layout.toml");
        replace_file(&file, b"first, and longer").unwrap();
        replace_file(&file, b"second").unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), b"second");
        assert_eq!(std::fs::read_dir(folder_of(&file)).unwrap().count(), 1);
    }

    #[test]
    fn a_target_that_cannot_be_replaced_stays_and_no_scrap_is_left() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("taken");
        std::fs::create_dir(&target).unwrap();
        std::fs::write(target.join("inside"), "kept").unwrap();
        assert!(replace_file(&target, b"new").is_err());
        assert_eq!(std::fs::read(target.join("inside")).unwrap(), b"kept");
        assert_eq!(std::fs::read_dir(root.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_it_as_they_may_any_new_file() {
        use std::os::unix::fs::PermissionsExt;
        let root = tempfile::tempdir().unwrap();
        let (ours, ordinary) = (root.path().join("ours"), root.path().join("ordinary"));
        replace_file(&ours, b"").unwrap();
        std::fs::write(&ordinary, "").unwrap();
        let mode = |file: &Path| std::fs::metadata(file).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&ordinary));
    }
}
