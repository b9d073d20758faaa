//! On Unix the file itself is locked. A file that takes its place is locked before, so that the path always leads to a
//! locked one.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;

use tmcl_link::system::{identity, identity_at};

/// A file that is locked as long as this is there.
#[derive(Debug)]
pub(crate) struct Held(File);

impl Held {
    /// Locks the open file at a path.
    pub(crate) fn lock(file: &File, _: &Path) -> Result<Self, TryLockError> {
        file.try_lock()?;
        // The lock belongs to the open file, whatever the number of its descriptors.
        file.try_clone().map(Held).map_err(TryLockError::Error)
    }

    /// True if the path leads to this file.
    pub(crate) fn is_at(&self, path: &Path) -> io::Result<bool> {
        Ok(identity(&self.0)? == identity_at(path)?)
    }
}

/// Locks a file that is to take the place of one that is held, before anything is written into it.
pub(crate) fn lock_new(file: &File) -> io::Result<()> {
    Ok(file.try_lock()?)
}

/// Gives a complete, locked file its path by `give`, and holds it from now on in place of the old one.
pub(crate) fn hold_new(
    held: &mut Option<Held>,
    file: File,
    _: &Path,
    give: impl FnOnce() -> io::Result<()>,
) -> io::Result<()> {
    give()?;
    *held = Some(Held(file));
    Ok(())
}
