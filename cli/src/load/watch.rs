//! `tmcl load --watch`: a program that is loaded again whenever one of its files is saved.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use tmcl_link::EndSignal;
use tmcl_link::system::{Identity, identity_at};
use tmcl_tools::asm::Settings;
use tmcl_tools::conversation::Conversation;
use tmcl_tools::stop::Stop;

use super::options::Options;
use super::{check, load};
use crate::failure::{Ended, Failure};
use crate::program::read_watched;
use crate::tell;

/// Interval at which the files are looked at. A file that is being saved counts as saved when it has not changed for
/// that long.
const LOOK: Duration = Duration::from_millis(150);

/// The marks of a file that change when it is saved: its time, its length, and which file it is where an editor puts a
/// new file in its place. `None` for a file that does not exist.
type Stamp = Option<(SystemTime, u64, Identity)>;

fn stamp(path: &Path) -> Stamp {
    let metadata = std::fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len(), identity_at(path).ok()?))
}

/// The files on which the program depends, as they were when it was read.
#[derive(Default)]
struct Watched(Vec<(PathBuf, Stamp)>);

impl Watched {
    /// Begins to watch these files, too.
    fn add(&mut self, files: impl IntoIterator<Item = PathBuf>) {
        for file in files {
            if !self.0.iter().any(|(known, _)| *known == file) {
                let stamp = stamp(&file);
                self.0.push((file, stamp));
            }
        }
    }

    /// The first file that is another one than it was.
    fn changed(&self) -> Option<PathBuf> {
        self.0.iter().find(|(file, seen)| stamp(file) != *seen).map(|(file, _)| file.clone())
    }

    /// The same files as they are now.
    fn now(&self) -> Self {
        let mut now = Watched::default();
        now.add(self.0.iter().map(|(file, _)| file.clone()));
        now
    }
}

/// Loads the program, and loads it again whenever one of its files is saved, until a signal comes.
///
/// # Errors
/// The module refuses a program, the link fails, or a signal has come. Mistakes in the files are none.
pub(super) fn run(
    module: &mut Conversation,
    settings: Settings,
    options: &Options,
    signal: &EndSignal,
) -> Result<(), Failure> {
    let path = &options.program.file;
    loop {
        // What is saved from now on has not been read.
        let mut watched = Watched::default();
        watched.add([path.clone()]);
        let (program, files) = read_watched(path, settings);
        watched.add(files);
        match program.and_then(|program| check(&program, settings).map(|()| program)) {
            Ok(program) => load(module, &program, options, signal)?,
            Err(failure) => {
                let message = failure.message().map_or_else(String::new, |message| format!("tmcl: {message}\n"));
                // A closed standard error does not end the program.
                let _ = writeln!(tell::err(), "{message}tmcl: not loaded; the module keeps the program that it has");
            }
        }
        writeln!(tell::out(), "waiting for {} to be saved; Ctrl-C ends", path.display())?;
        let saved = wait(watched, signal)?;
        writeln!(tell::out(), "{} has changed", saved.display())?;
    }
}

/// Waits until a file has been saved, and gives its name.
fn wait(mut watched: Watched, signal: &EndSignal) -> Result<PathBuf, Failure> {
    let mut saved = None;
    loop {
        if signal.within(LOOK) {
            return Err(signal.failure(""));
        }
        match (watched.changed(), saved.take()) {
            (Some(file), _) => {
                watched = watched.now();
                saved = Some(file);
            }
            (None, Some(file)) => return Ok(file),
            (None, None) => {}
        }
    }
}
