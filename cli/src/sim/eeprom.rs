//! The file that keeps the EEPROM's contents.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::failure::Failure;

/// Bytes in an AT25128.
const SIZE: usize = 16_384;
/// Time between two attempts to write the file when it cannot be written.
const RETRY: Duration = Duration::from_secs(1);

/// A file with the contents of the EEPROM.
#[derive(Debug)]
pub struct EepromFile {
    path: PathBuf,
    /// What is in the file; none until it exists.
    kept: Option<Vec<u8>>,
    /// When the last attempt to write it failed.
    failed: Option<Instant>,
}

impl EepromFile {
    /// Reads the file, if there is one. A file that cannot be an EEPROM's is an error and left alone.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        let shown = path.display();
        let (path, kept) = match fs::read(path) {
            Ok(bytes) if bytes.len() == SIZE => {
                let real = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
                (real, Some(bytes))
            }
            Ok(bytes) => {
                let found = bytes.len();
                let message = format!(
                    "--eeprom: {shown} has {found} bytes, an EEPROM has {SIZE}; the file is left alone. Give another \
                     name, and the file will be made"
                );
                return Err(Failure::Failed(message));
            }
            Err(error) if error.kind() == ErrorKind::NotFound => (path.to_path_buf(), None),
            Err(error) => return Err(Failure::Failed(format!("--eeprom: cannot read {shown}: {error}"))),
        };
        Ok(EepromFile { path, kept, failed: None })
    }

    /// The files of several modules: that of the first has the name given, the others' have their number added.
    pub fn open_all(path: &Path, modules: usize) -> Result<Vec<Self>, Failure> {
        let name = |number: usize| {
            let mut name = path.as_os_str().to_owned();
            if number > 1 {
                name.push(format!(".{number}"));
            }
            name
        };
        (1..=modules).map(|number| Self::open(Path::new(&name(number)))).collect()
    }

    /// What is in the file.
    pub fn contents(&self) -> Option<&[u8]> {
        self.kept.as_deref()
    }

    /// Brings the file up to date, if `contents` is not what it has. The old file is there until the new
    /// one is complete.
    pub fn save(&mut self, contents: &[u8]) -> Result<(), Failure> {
        if self.kept.as_deref() == Some(contents) {
            return Ok(());
        }
        let mut fresh = self.path.clone().into_os_string();
        fresh.push(format!(".{}.new", std::process::id()));
        let written = fs::write(&fresh, contents).and_then(|()| fs::rename(&fresh, &self.path));
        match written {
            Ok(()) => {
                self.kept = Some(contents.to_vec());
                self.failed = None;
                Ok(())
            }
            Err(error) => {
                // What is left of it is of no use; the old file is untouched.
                let _ = fs::remove_file(&fresh);
                Err(Failure::Failed(format!("--eeprom: cannot write {}: {error}", self.path.display())))
            }
        }
    }

    /// The same while the module runs: gives a message for a person when it begins to fail, and tries again
    /// once in a while.
    pub fn keep(&mut self, contents: &[u8]) -> Option<String> {
        if self.failed.is_some_and(|at| at.elapsed() < RETRY) {
            return None;
        }
        let failure = self.save(contents).err()?;
        let first = self.failed.replace(Instant::now()).is_none();
        first.then(|| failure.to_string())
    }
}
