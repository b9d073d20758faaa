//! The file that keeps an EEPROM's contents.
//!
//! The file is held, as `held/` does it on each system, as long as the simulator runs. For each page that a module
//! writes a new file is made. It is written to the disk before it replaces the old one, so that the path always leads
//! to a complete file. Only then the page counts as written; if any of this fails, the firmware sees a failed page
//! write. A simulator that is killed meanwhile leaves its new file behind; the next one to hold the old file removes
//! it.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use hal_sim::chip::at25::Backing;
use tmcl_link::system::{identity, identity_at, let_large_writes_fail, real};
use tmcl_link::wording::words;
use tmcm_sim::Product;

use crate::failure::Failure;
use crate::files::{beside, left_beside};
use crate::held::{Held, hold_new, lock_new};

/// A file with the contents of the EEPROM.
#[derive(Debug)]
pub struct EepromFile {
    path: PathBuf,
    /// The product whose EEPROM it is.
    product: Product,
    /// The contents at the start; `None` if there was no file.
    found: Option<Vec<u8>>,
    /// The locked file; `None` until the first write if there was no file.
    held: Option<Held>,
    /// True if the last attempt to write failed.
    failing: bool,
    /// Tells a person something.
    say: fn(&str),
}

impl EepromFile {
    /// Opens, locks and reads the file for the EEPROM of a product, if there is one.
    ///
    /// # Errors
    /// The file has another size than this EEPROM, cannot be written, or is in use by another simulator; it stays
    /// unchanged.
    pub fn open(path: &Path, product: Product, say: fn(&str)) -> Result<Self, Failure> {
        let failed = |why: String| Failure::Failed(format!("--eeprom: {}{why}", path.display()));
        let real = loop {
            let error = match real(path) {
                Ok(real) => break real,
                Err(error) => error,
            };
            match fs::symlink_metadata(path) {
                // Another simulator has made the file meanwhile.
                Ok(found) if error.kind() == ErrorKind::NotFound && !found.is_symlink() => {}
                Err(_) if error.kind() == ErrorKind::NotFound => {
                    let path = std::path::absolute(path)
                        .map_err(|error| failed(format!(" cannot be made: {}", words(error))))?;
                    return Ok(EepromFile { path, product, found: None, held: None, failing: false, say });
                }
                _ => return Err(failed(format!(" cannot be read: {}", words(error)))),
            }
        };
        let size = product.kind().eeprom.size;
        let cannot = |error: io::Error| failed(format!(" cannot be read and written: {}", words(error)));
        loop {
            // Only a regular file is opened: opening or reading a pipe or a device may take for ever.
            let found = fs::metadata(&real).map_err(cannot)?;
            if !found.is_file() {
                return Err(failed(" is no file; it is left alone. Give the name of a file".into()));
            }
            if found.len() != size as u64 {
                let (length, name, whose) = (found.len(), product.name(), whose(found.len()));
                return Err(failed(format!(
                    " has {length} bytes{whose}, the EEPROM of a {name} has {size}; the file is left alone. Give another \
                     name, and the file will be made"
                )));
            }
            if found.permissions().readonly() {
                return Err(failed(" is read-only; stores would be lost. Make it writable, or give a copy".into()));
            }
            let mut file = OpenOptions::new().read(true).write(true).open(&real).map_err(cannot)?;
            let held = match Held::lock(&file, &real) {
                Ok(held) => held,
                Err(TryLockError::WouldBlock) => {
                    return Err(failed(
                        " is the EEPROM of another simulator that runs; end that one, or give another file".into(),
                    ));
                }
                Err(TryLockError::Error(error)) => return Err(failed(format!(" cannot be locked: {}", words(error)))),
            };
            // Between opening and locking another simulator may have replaced the file and ended; then the new one is
            // opened.
            if identity(&file).and_then(|file| Ok(file == identity_at(&real)?)).map_err(cannot)? {
                let mut contents = vec![0; size];
                file.read_exact(&mut contents).map_err(cannot)?;
                sweep(&real, size);
                return Ok(EepromFile {
                    path: real,
                    product,
                    found: Some(contents),
                    held: Some(held),
                    failing: false,
                    say,
                });
            }
        }
    }

    /// Opens the files of several modules, of which the products are given: `path` for the first module, `path` with
    /// `.2`, `.3` ... for the others.
    pub fn open_all(path: &Path, products: &[Product], say: fn(&str)) -> Result<Vec<Self>, Failure> {
        let_large_writes_fail().map_err(unwatched)?;
        let name = |number: usize| {
            let mut name = path.as_os_str().to_owned();
            if number > 1 {
                name.push(format!(".{number}"));
            }
            name
        };
        (1..).zip(products).map(|(number, product)| Self::open(Path::new(&name(number)), *product, say)).collect()
    }

    /// Opens the file of a single module.
    ///
    /// # Errors
    /// Those of [`EepromFile::open`].
    pub fn open_one(path: &Path, product: Product, say: fn(&str)) -> Result<Self, Failure> {
        let_large_writes_fail().map_err(unwatched)?;
        Self::open(path, product, say)
    }

    /// The contents when the file was opened; `None` if there was no file.
    pub fn contents(&self) -> Option<&[u8]> {
        self.found.as_deref()
    }

    /// Replaces the file by one with these contents. The old file stays until the new one is complete.
    pub fn save(&mut self, contents: &[u8]) -> Result<(), Failure> {
        let is_first = self.held.is_none();
        let replaced = self.replace(contents);
        if is_first && replaced.is_ok() {
            sweep(&self.path, contents.len());
        }
        replaced.map_err(|error| {
            // Another simulator may have made the file meanwhile: the error of opening that file tells the user more.
            let refused = is_first.then(|| Self::open(&self.path, self.product, self.say).err()).flatten();
            refused.unwrap_or_else(|| {
                Failure::Failed(format!("--eeprom: cannot write {}: {}", self.path.display(), words(error)))
            })
        })
    }

    fn replace(&mut self, contents: &[u8]) -> io::Result<()> {
        let exists = match self.held.as_ref().map(|held| held.is_at(&self.path)) {
            Some(Ok(true)) => true,
            Some(Ok(false)) => return Err(io::Error::other("another file has taken its place")),
            // A file that a user has removed is made again.
            Some(Err(error)) if error.kind() != ErrorKind::NotFound => return Err(error),
            Some(Err(_)) | None => false,
        };
        let (fresh, mut file) = beside(&self.path)?;
        let EepromFile { path, held, .. } = self;
        let give = || if exists { fs::rename(&fresh, &*path) } else { name_anew(&fresh, path) };
        let filled = fill(&mut file, contents, exists.then_some(path.as_path()));
        let written = filled.and_then(|()| hold_new(held, file, path, give));
        if written.is_err() {
            // The old file is untouched, and the incomplete new one is of no use.
            let _ = fs::remove_file(&fresh);
            return written;
        }
        // The directory is synchronised, too, so that the new file survives a crash of the computer. Some file systems
        // do not support that, so an error is ignored.
        let _ = self.path.parent().map(|folder| File::open(folder)?.sync_all());
        Ok(())
    }
}

/// Writes a new file to the disk, with the permissions of the old one.
fn fill(file: &mut File, contents: &[u8], old: Option<&Path>) -> io::Result<()> {
    if let Some(old) = old {
        file.set_permissions(fs::metadata(old)?.permissions())?;
    }
    lock_new(file)?;
    file.write_all(contents)?;
    file.sync_all()
}

impl Backing for EepromFile {
    fn keep(&mut self, contents: &[u8]) -> bool {
        let saved = self.save(contents);
        match &saved {
            Err(failure) if !self.failing => {
                (self.say)(&format!("{failure}. Until it can be written, nothing is stored"))
            }
            Ok(()) if self.failing => (self.say)(&format!("--eeprom: {} is written again", self.path.display())),
            _ => {}
        }
        self.failing = saved.is_err();
        !self.failing
    }
}

fn unwatched(error: io::Error) -> Failure {
    Failure::Failed(format!("cannot watch for signals: {}", words(error)))
}

/// The products that have an EEPROM of so many bytes, in words behind the number.
fn whose(size: u64) -> String {
    let names = Product::ALL.into_iter().filter(|product| product.kind().eeprom.size as u64 == size).map(Product::name);
    let names = names.collect::<Vec<_>>().join(" or ");
    if names.is_empty() { names } else { format!(" like that of a {names}") }
}

/// Removes what a simulator that was killed has left of new files for an EEPROM of `size` bytes. Who calls this has the
/// lock of the file at `path`, so no other simulator makes new ones; one that tries to has locked its own.
fn sweep(path: &Path, size: usize) {
    for left in left_beside(path) {
        let is_ours = |found: fs::Metadata| found.is_file() && found.len() <= size as u64;
        if fs::symlink_metadata(&left).is_ok_and(is_ours) && File::open(&left).is_ok_and(|file| file.try_lock().is_ok())
        {
            // What cannot be removed does no harm.
            let _ = fs::remove_file(&left);
        }
    }
}

/// Gives a file a name that no other file has. If several simulators try at once, one succeeds.
fn name_anew(fresh: &Path, path: &Path) -> io::Result<()> {
    match fs::hard_link(fresh, path) {
        Ok(()) => {
            // If the temporary name cannot be removed, the file has two names, which does no harm.
            let _ = fs::remove_file(fresh);
            Ok(())
        }
        // File systems without hard links need a rename, which cannot tell who was first.
        Err(error) if error.kind() != ErrorKind::AlreadyExists && fs::symlink_metadata(path).is_err() => {
            fs::rename(fresh, path)
        }
        Err(error) => Err(error),
    }
}
