//! Windows replaces no file that is open, so the lock is a file beside it. The lock is open for this program alone, and
//! the system removes it when it is closed, however the program ends.

use std::fs::{File, TryLockError};
use std::io;
use std::os::windows::fs::OpenOptionsExt;
use std::path::Path;

use tmcl_link::system::{Identity, identity, identity_at};

/// Numbers by which the system is asked to read, write and remove the lock, to let nobody else open it, and to remove
/// it when it is closed.
const GENERIC_READ_WRITE: u32 = 0xC000_0000;
const DELETE: u32 = 0x0001_0000;
const FILE_FLAG_DELETE_ON_CLOSE: u32 = 0x0400_0000;
/// The error of a file that another program has for itself.
const SHARING_VIOLATION: i32 = 32;

/// A file that no other simulator takes as long as this is there.
#[derive(Debug)]
pub(crate) struct Held {
    _lock: File,
    /// The identity of the file.
    file: Identity,
}

impl Held {
    /// Locks the open file at a path.
    pub(crate) fn lock(file: &File, path: &Path) -> Result<Self, TryLockError> {
        let file = identity(file).map_err(TryLockError::Error)?;
        Ok(Held { _lock: lock_beside(path)?, file })
    }

    /// True if the path leads to this file.
    pub(crate) fn is_at(&self, path: &Path) -> io::Result<bool> {
        Ok(self.file == identity_at(path)?)
    }
}

fn lock_beside(path: &Path) -> Result<File, TryLockError> {
    let mut name = path.as_os_str().to_owned();
    name.push(".lock");
    let mut options = File::options();
    options.write(true).create(true).truncate(false).access_mode(GENERIC_READ_WRITE | DELETE).share_mode(0);
    options.custom_flags(FILE_FLAG_DELETE_ON_CLOSE).open(name).map_err(|error| match error.raw_os_error() {
        Some(SHARING_VIOLATION) => TryLockError::WouldBlock,
        _ => TryLockError::Error(error),
    })
}

/// A file that is to take the place of one that is held needs no lock of its own.
pub(crate) fn lock_new(_: &File) -> io::Result<()> {
    Ok(())
}

/// Gives a complete file its path by `give`, and holds it from now on in place of the old one.
pub(crate) fn hold_new(
    held: &mut Option<Held>,
    file: File,
    path: &Path,
    give: impl FnOnce() -> io::Result<()>,
) -> io::Result<()> {
    let lock = held.is_none().then(|| lock_beside(path)).transpose()?;
    drop(file);
    give()?;
    let file = identity_at(path)?;
    match (held, lock) {
        (Some(held), _) => held.file = file,
        (held, lock) => *held = lock.map(|lock| Held { _lock: lock, file }),
    }
    Ok(())
}
