//! Reading files that the user names, up to the largest size that such files may have.

use std::fs::File;
use std::io::{self, IsTerminal, Read};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use tmcl_link::poll::readable;
use tmcl_link::signal::Wait;
use tmcl_link::system::{Input, standard_input};
use tmcl_link::wording::words;
use tmcl_server::files::{LARGEST, read};
use tmcl_tools::sources::Sources;

use crate::failure::Failure;

/// File name that stands for standard input or standard output.
pub(crate) const STANDARD: &str = "-";
/// How long a signal may go unnoticed while standard input says nothing.
const GLANCE: Duration = Duration::from_millis(50);

/// Reads TMCL source from a file or standard input. Other bytes than UTF-8 are no error, because comments may be in any
/// encoding.
pub(crate) fn read_source(path: &Path) -> Result<String, Failure> {
    let bytes = read_named(path)?;
    if is_text(&bytes) {
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    } else {
        let name = name(path);
        Err(Failure::Failed(format!("{name} is no text; if it is an assembled program, tmcl disasm shows its source")))
    }
}

/// Reads a file, or standard input to its end.
///
/// # Errors
/// The file cannot be read, or a signal has come while standard input had no end.
pub(crate) fn read_named(path: &Path) -> Result<Vec<u8>, Failure> {
    let name = name(path);
    let bytes = if is_standard(path) {
        standard_input().and_then(|input| {
            let mut typed = Typed { input, wait: Wait::begin(), ended_by: None };
            let bytes = read(&mut typed, LARGEST);
            match typed.ended_by {
                Some(signal) => Err(io::Error::from(Failure::Interrupted { signal, message: String::new() })),
                None => bytes,
            }
        })
    } else {
        match File::open(path) {
            // Reading a terminal would wait for input without end.
            Ok(file) if file.is_terminal() => {
                let hint = "a link comes first, then the file";
                return Err(Failure::Failed(format!("{name} is a device, not a file; {hint}")));
            }
            Ok(file) => read(file, LARGEST),
            Err(error) => Err(error),
        }
    };
    bytes.map_err(|error| {
        error.downcast().unwrap_or_else(|error| Failure::Failed(format!("cannot read {name}: {}", words(error))))
    })
}

/// Standard input, which may be a terminal where nothing comes for ever. It ends at a signal, even where the signal
/// does not end the program by itself.
struct Typed {
    input: Input,
    wait: Wait,
    /// The number of the signal that has ended it.
    ended_by: Option<u8>,
}

impl Read for Typed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            // What has been typed before Ctrl-C is half of something.
            let ready = readable(&self.input, Instant::now() + GLANCE)?;
            self.ended_by = self.wait.signal();
            if self.ended_by.is_some() {
                return Ok(0);
            }
            if ready {
                return self.input.read(buffer);
            }
        }
    }
}

/// The files of this computer as sources of programs.
pub(crate) struct Files;

impl Sources for Files {
    fn read(&self, name: &Path) -> Result<String, String> {
        read_source(name).map_err(|failure| failure.to_string())
    }

    fn exists(&self, name: &Path) -> bool {
        name.exists()
    }

    fn canonical(&self, name: &Path) -> PathBuf {
        name.canonicalize().unwrap_or_else(|_| name.into())
    }
}

/// True for the name of standard input or standard output.
pub(crate) fn is_standard(path: &Path) -> bool {
    path == Path::new(STANDARD)
}

/// The name of a file, or of standard input, in messages.
pub(crate) fn name(path: &Path) -> String {
    if is_standard(path) { "standard input".into() } else { path.display().to_string() }
}

/// True for text. An assembled program always contains bytes of 0, and text never does.
pub(crate) fn is_text(bytes: &[u8]) -> bool {
    !bytes.contains(&0)
}
