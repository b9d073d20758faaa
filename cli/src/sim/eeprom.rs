//! The file that keeps the EEPROM's contents.
//!
//! It is locked for as long as the module runs. Each page that the module writes makes a new file, which is complete,
//! on the disk and locked before it takes the place of the old one: whoever opens the path finds a file that is whole
//! and whose lock is held. Only then the page counts as written; if that fails it is not, and the firmware notices.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use hal_sim::chip::at25::{Backing, SIZE};
use signal_hook::consts::SIGXFSZ;

use super::say;
use crate::failure::Failure;

/// A file with the contents of the EEPROM.
#[derive(Debug)]
pub struct EepromFile {
    path: PathBuf,
    /// What was in the file at the start; none if there was no file.
    found: Option<Vec<u8>>,
    /// The file itself, locked.
    held: Option<File>,
    /// The last attempt to write it failed.
    failing: bool,
}

impl EepromFile {
    /// Opens and reads the file, if there is one. A file that cannot be an EEPROM's, cannot be written or is another
    /// simulator's is an error and left alone.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        let failed = |why: String| Failure::Failed(format!("--eeprom: {}{why}", path.display()));
        let real = match fs::canonicalize(path) {
            Ok(real) => real,
            Err(error) if error.kind() == ErrorKind::NotFound && fs::symlink_metadata(path).is_err() => {
                let path = std::path::absolute(path).map_err(|error| failed(format!(" cannot be made: {error}")))?;
                return Ok(EepromFile { path, found: None, held: None, failing: false });
            }
            Err(error) => return Err(failed(format!(" cannot be read: {error}"))),
        };
        let cannot = |error: io::Error| failed(format!(" cannot be read and written: {error}"));
        loop {
            // Nothing is opened whose opening or reading may take for ever.
            let found = fs::metadata(&real).map_err(cannot)?;
            if !found.is_file() {
                return Err(failed(" is no file; it is left alone. Give the name of a file".into()));
            }
            if found.len() != SIZE as u64 {
                let length = found.len();
                return Err(failed(format!(
                    " has {length} bytes, an EEPROM has {SIZE}; the file is left alone. Give another name, and the \
                     file will be made"
                )));
            }
            if found.permissions().readonly() {
                return Err(failed(" is read-only; stores would be lost. Make it writable, or give a copy".into()));
            }
            let mut file = OpenOptions::new().read(true).write(true).open(&real).map_err(cannot)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    return Err(failed(
                        " is the EEPROM of another simulator that runs; end that one, or give another file".into(),
                    ));
                }
                Err(TryLockError::Error(error)) => return Err(failed(format!(" cannot be locked: {error}"))),
            }
            // Another simulator may have replaced it, and ended, since it was opened.
            if same(&file, &real).map_err(cannot)? {
                let mut contents = vec![0; SIZE];
                file.read_exact(&mut contents).map_err(cannot)?;
                return Ok(EepromFile { path: real, found: Some(contents), held: Some(file), failing: false });
            }
        }
    }

    /// The files of several modules: that of the first has the name given, the others' have their number added.
    pub fn open_all(path: &Path, modules: usize) -> Result<Vec<Self>, Failure> {
        // Beyond the limit to the size of files a write is to fail, not to end the program.
        signal_hook::flag::register(SIGXFSZ, Arc::<AtomicBool>::default())
            .map_err(|error| Failure::Failed(format!("cannot watch for signals: {error}")))?;
        let name = |number: usize| {
            let mut name = path.as_os_str().to_owned();
            if number > 1 {
                name.push(format!(".{number}"));
            }
            name
        };
        (1..=modules).map(|number| Self::open(Path::new(&name(number)))).collect()
    }

    /// What was in the file when it was opened.
    pub fn contents(&self) -> Option<&[u8]> {
        self.found.as_deref()
    }

    /// Gives the file these contents. The old one is there until the new one is complete.
    pub fn save(&mut self, contents: &[u8]) -> Result<(), Failure> {
        self.replace(contents).map_err(|error| {
            let taken = self.held.is_none() && error.kind() == ErrorKind::AlreadyExists;
            // Who has been faster says why.
            let refused = taken.then(|| Self::open(&self.path).err()).flatten();
            refused
                .unwrap_or_else(|| Failure::Failed(format!("--eeprom: cannot write {}: {error}", self.path.display())))
        })
    }

    fn replace(&mut self, contents: &[u8]) -> io::Result<()> {
        let exists = match self.held.as_ref().map(|held| same(held, &self.path)) {
            Some(Ok(true)) => true,
            Some(Ok(false)) => return Err(io::Error::other("another file has taken its place")),
            // Whoever removed the file gets it back.
            Some(Err(error)) if error.kind() != ErrorKind::NotFound => return Err(error),
            Some(Err(_)) | None => false,
        };
        let (fresh, mut file) = beside(&self.path)?;
        let written = self
            .fill(&mut file, contents)
            .and_then(|()| if exists { fs::rename(&fresh, &self.path) } else { name_anew(&fresh, &self.path) });
        if written.is_err() {
            // What is left of it is of no use; the old file is untouched.
            let _ = fs::remove_file(&fresh);
            return written;
        }
        self.held = Some(file);
        // That the new file has the name is to outlive the computer, too. There are file systems that cannot say so.
        let _ = self.path.parent().map(|folder| File::open(folder)?.sync_all());
        Ok(())
    }

    fn fill(&self, file: &mut File, contents: &[u8]) -> io::Result<()> {
        if let Some(held) = &self.held {
            file.set_permissions(held.metadata()?.permissions())?;
        }
        file.try_lock()?;
        file.write_all(contents)?;
        file.sync_all()
    }
}

impl Backing for EepromFile {
    fn keep(&mut self, contents: &[u8]) -> bool {
        let saved = self.save(contents);
        match &saved {
            Err(failure) if !self.failing => say(&format!("{failure}. Until it can be written, nothing is stored")),
            Ok(()) if self.failing => say(&format!("--eeprom: {} is written again", self.path.display())),
            _ => {}
        }
        self.failing = saved.is_err();
        !self.failing
    }
}

/// Gives a file a name that nobody has: of several who do so at once one succeeds.
fn name_anew(fresh: &Path, path: &Path) -> io::Result<()> {
    match fs::hard_link(fresh, path) {
        Ok(()) => {
            // One name too many does no harm.
            let _ = fs::remove_file(fresh);
            Ok(())
        }
        // There are file systems without links; those cannot say who is first.
        Err(error) if error.kind() != ErrorKind::AlreadyExists && fs::symlink_metadata(path).is_err() => {
            fs::rename(fresh, path)
        }
        Err(error) => Err(error),
    }
}

/// Whether a file is the one at a path.
fn same(file: &File, path: &Path) -> io::Result<bool> {
    let (held, there) = (file.metadata()?, fs::symlink_metadata(path)?);
    Ok((held.dev(), held.ino()) == (there.dev(), there.ino()))
}

/// A new file beside another, under a name that nobody can foresee. What has that name already is not touched.
fn beside(path: &Path) -> io::Result<(PathBuf, File)> {
    loop {
        let mut name = path.as_os_str().to_owned();
        name.push(format!(".{:016x}.new", RandomState::new().hash_one(())));
        match OpenOptions::new().write(true).create_new(true).open(&name) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return Ok((name.into(), made?)),
        }
    }
}
