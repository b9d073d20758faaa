//! The scenario files that the user names, and the scenarios in them that are wanted.

use std::path::{Path, PathBuf};

use tmcl_link::wording::words;
use tmcm_sim::Model;
use tmcm_sim::scenario::suite::File;
use tmcm_sim::scenario::{self, Surroundings};

use super::programs;
use crate::failure::Failure;
use crate::files::{is_standard, name, read_named};

/// File name extension of scenario files, for which a folder is searched.
const EXTENSION: &str = "txt";

/// Reads a scenario file, or standard input. `model` and `world`, the text of a world file, are for scenarios that do
/// not name their own.
///
/// # Errors
/// The file cannot be read. Mistakes in it are part of the result.
pub fn read_file(path: &Path, model: Model, world: &str) -> Result<File, Failure> {
    let text = String::from_utf8(read_named(path)?)
        .map_err(|_| Failure::Failed(format!("cannot read {}: it is no text (UTF-8)", name(path))))?;
    let folder = if is_standard(path) { Path::new("") } else { path.parent().unwrap_or(Path::new("")) };
    Ok(read_text(&name(path), &text, folder, model, world))
}

/// Reads the text of a scenario file of this name; files that it names are looked for in `folder`.
pub fn read_text(name: &str, text: &str, folder: &Path, model: Model, world: &str) -> File {
    let (product, firmware) = (model.product(), model.firmware());
    let surroundings = Surroundings { folder, product, firmware, world, assemble: &programs::read };
    File { name: name.into(), scenarios: scenario::read(text, &surroundings) }
}

/// The files that a path stands for: itself, or the scenario files in a folder, in the order of their names.
///
/// # Errors
/// The folder cannot be read, or there is none in it.
pub fn expanded(path: &Path) -> Result<Vec<PathBuf>, Failure> {
    if !path.is_dir() {
        return Ok(vec![path.into()]);
    }
    let cannot = |error| Failure::Failed(format!("cannot read {}: {}", path.display(), words(error)));
    let entries = std::fs::read_dir(path).and_then(Iterator::collect::<Result<Vec<_>, _>>).map_err(cannot)?;
    let mut paths: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == EXTENSION));
    paths.sort();
    if paths.is_empty() {
        return Err(Failure::Failed(format!(
            "no scenario file in {}; their names end in .{EXTENSION}",
            path.display()
        )));
    }
    Ok(paths)
}

/// Keeps the scenarios whose file or title contains a text, and with `first_rows` only the first case of each. Gives
/// how many scenarios are left.
pub fn select(files: &mut [File], text: &str, first_rows: bool) -> usize {
    for File { name, scenarios } in files.iter_mut() {
        scenarios.retain(|scenario| format!("{name}: {}", scenario.title).contains(text));
        if first_rows {
            scenarios
                .iter_mut()
                .filter_map(|scenario| scenario.cases.as_mut().ok())
                .for_each(|cases| cases.truncate(1));
        }
    }
    files.iter().map(|file| file.scenarios.len()).sum()
}
