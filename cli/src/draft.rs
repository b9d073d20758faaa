//! A file that takes the place of an older one when it is complete, and not before.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use tmcl_link::wording;
use tmcl_server::files::beside;

use crate::failure::Failure;

/// A file that is being written, beside the one that it will be. It is removed if it is never finished.
#[derive(Debug)]
pub(crate) struct Draft {
    /// The path of the file that it will be.
    path: PathBuf,
    /// Where it is written; `None` for what is no file on a disk, such as a pipe, which is written directly.
    beside: Option<PathBuf>,
    file: File,
}

impl Draft {
    /// Begins a file, so that a name that cannot be written is noticed at once.
    pub(crate) fn begin(path: &Path) -> Result<Self, Failure> {
        Self::open(path).map_err(|error| cannot(path, &error))
    }

    fn open(path: &Path) -> io::Result<Self> {
        // A link goes on to lead to the file.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.into());
        match OpenOptions::new().write(true).open(&path) {
            Ok(file) if !file.metadata()?.is_file() => return Ok(Draft { path, beside: None, file }),
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
        path.file_name().ok_or(ErrorKind::InvalidFilename)?;
        let (beside, file) = beside(&path)?;
        Ok(Draft { path, beside: Some(beside), file })
    }

    /// Writes the bytes, with which the file is complete.
    pub(crate) fn finish(mut self, bytes: &[u8]) -> Result<(), Failure> {
        let written = self.file.write_all(bytes).and_then(|()| match &self.beside {
            Some(beside) => {
                if let Ok(old) = fs::metadata(&self.path) {
                    fs::set_permissions(beside, old.permissions())?;
                }
                self.file.sync_all()?;
                fs::rename(beside, &self.path)
            }
            None => Ok(()),
        });
        match written {
            Ok(()) => {
                self.beside = None;
                Ok(())
            }
            Err(error) => Err(cannot(&self.path, &error)),
        }
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if let Some(beside) = &self.beside {
            // What cannot be removed is left.
            let _ = fs::remove_file(beside);
        }
    }
}

fn cannot(path: &Path, error: &io::Error) -> Failure {
    Failure::Failed(format!("cannot write {}: {}", path.display(), wording::of(error)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_only_by_a_complete_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("axis.tmcl");
        fs::write(&path, "old").unwrap();
        drop(Draft::begin(&path).unwrap());
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        Draft::begin(&path).unwrap().finish(b"new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside it");
        assert!(Draft::begin(&folder.path().join("none/axis.tmcl")).is_err());
        assert!(Draft::begin(folder.path()).is_err());
        Draft::begin(Path::new("/dev/null")).unwrap().finish(b"new").unwrap();
        assert!(Draft::begin(Path::new("/dev/full")).unwrap().finish(b"new").is_err());
    }
}
