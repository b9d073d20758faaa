//! Where a program for the microcontroller can panic. It says so itself: a panic has its place in the source with it
//! (`core::panic::Location`), one of defmt its text, and the linker keeps only those that something refers to.

use std::collections::BTreeSet;
use std::fmt;

use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, elf};

/// A place that can panic.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Place {
    /// The file, beginning with the name of its package; in this package with `src` or `tests`.
    pub(crate) file: String,
    /// Line and column.
    pub(crate) at: (u32, u32),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (line, column) = self.at;
        write!(f, "{}:{line}:{column}", self.file)
    }
}

/// All places that are in a program: four words each in the constants, of which the first two are the name of the file.
pub(crate) fn places(file: &object::File) -> BTreeSet<Place> {
    let in_memory =
        |flags| matches!(flags, SectionFlags::Elf { sh_flags, .. } if sh_flags & u64::from(elf::SHF_ALLOC) != 0);
    let constants = file.sections().filter(|section| in_memory(section.flags()));
    let constants: Vec<_> = constants.map(|section| (section.address(), section.data().unwrap())).collect();
    let bytes = |address: u32, length: u32| {
        constants.iter().find_map(|(start, data)| {
            let from = usize::try_from(u64::from(address).checked_sub(*start)?).ok()?;
            data.get(from..from.checked_add(length as usize)?)
        })
    };
    let place = |words: &[u32]| {
        let [name, length, line, column] = *words else { return None };
        let name = std::str::from_utf8(bytes(name, length)?).ok()?;
        (name.ends_with(".rs") && line != 0 && column != 0).then(|| Place { file: short(name), at: (line, column) })
    };
    let words = |data: &[u8]| data.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect::<Vec<_>>();
    constants.iter().flat_map(|(_, data)| words(data).windows(4).filter_map(place).collect::<Vec<_>>()).collect()
}

/// The name of a file without what is different on each machine and in each version.
fn short(name: &str) -> String {
    // /rustc/HASH/library/core/src/lib.rs
    if let Some((_, path)) = name.split_once("/library/") {
        return path.into();
    }
    // .cargo/registry/src/INDEX/PACKAGE-VERSION/src/lib.rs
    let Some((_, path)) = name.split_once("/registry/src/") else { return name.into() };
    let path = path.split_once('/').map_or(path, |(_, path)| path);
    let (package, path) = path.split_once('/').unwrap_or((path, ""));
    format!("{}/{path}", package.rsplit_once('-').map_or(package, |(name, _)| name))
}

/// The texts of the panics that go by way of defmt, with their packages. defmt keeps its texts as names of symbols.
pub(crate) fn texts(file: &object::File) -> BTreeSet<String> {
    let quoted = |name: &str, key: &str| {
        let (_, rest) = name.split_once(&format!("\"{key}\":\""))?;
        Some(rest.split("\",\"").next()?.to_owned())
    };
    let text = |symbol: object::Symbol| {
        let name = symbol.name().ok()?;
        let text = quoted(name, "data")?;
        Some(format!("{}: {}", quoted(name, "package")?, text.strip_prefix("panicked at ")?))
    };
    file.symbols().filter_map(text).collect()
}
