//! Where the texts of programs come from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Sources by their names: the files of an operating system, or what a page in a browser holds.
pub trait Sources {
    /// The text of the source of this name.
    ///
    /// # Errors
    /// A message that names the source and says why it cannot be read.
    fn read(&self, name: &Path) -> Result<String, String>;

    /// Whether there is a source of this name.
    fn exists(&self, name: &Path) -> bool;

    /// The one name of a source that may have several.
    fn canonical(&self, name: &Path) -> PathBuf {
        name.into()
    }

    /// The names of all sources, where that can be told.
    fn names(&self) -> Vec<PathBuf> {
        Vec::new()
    }
}

/// Texts that are there already, by their names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Texts(pub BTreeMap<PathBuf, String>);

impl Sources for Texts {
    fn read(&self, name: &Path) -> Result<String, String> {
        let none = || format!("cannot read {}: there is no such file or folder", name.display());
        self.0.get(name).cloned().ok_or_else(none)
    }

    fn exists(&self, name: &Path) -> bool {
        self.0.contains_key(name)
    }

    fn names(&self) -> Vec<PathBuf> {
        self.0.keys().cloned().collect()
    }
}
