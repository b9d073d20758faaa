//! Files of the user's: read no further than any file of their kind goes.

use std::fs::File;
use std::io::{self, ErrorKind, IsTerminal, Read};
use std::path::Path;

/// In place of a file: standard input, standard output.
pub(crate) const STANDARD: &str = "-";
/// A text or a program that is larger is none, by far.
pub(crate) const LARGEST: u64 = 1 << 20;

/// All that there is to be read, unless that is more than `limit` bytes.
pub(crate) fn read(source: impl Read, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source.take(limit + 1).read_to_end(&mut bytes)?;
    within(bytes.len() as u64, limit)?;
    Ok(bytes)
}

/// All that is in a file, unless that is more than `limit` bytes.
pub(crate) fn read_file(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    within(file.metadata()?.len(), limit)?;
    // A device does not tell how long it is.
    read(file, limit)
}

/// A text file.
pub(crate) fn read_text(path: &Path) -> io::Result<String> {
    let bytes = read_file(path, LARGEST)?;
    String::from_utf8(bytes).map_err(|_| io::Error::new(ErrorKind::InvalidData, "it is no text (UTF-8)"))
}

/// The source in a file, or on standard input. Comments are in whatever encoding the author had, so other bytes than
/// UTF-8 are no error.
pub(crate) fn read_source(path: &Path) -> Result<String, String> {
    let bytes = read_named(path)?;
    if is_text(&bytes) {
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    } else {
        Err(format!("{} is no text; if it is an assembled program, tmcl disasm shows its source", name(path)))
    }
}

/// All that is in a file, or comes in on standard input.
pub(crate) fn read_named(path: &Path) -> Result<Vec<u8>, String> {
    let name = name(path);
    let bytes = if path == Path::new(STANDARD) {
        read(std::io::stdin().lock(), LARGEST)
    } else {
        match File::open(path) {
            // It would be waited for.
            Ok(file) if file.is_terminal() => {
                return Err(format!("{name} is a device, not a file; a link comes first, then the file"));
            }
            Ok(file) => read(file, LARGEST),
            Err(error) => Err(error),
        }
    };
    bytes.map_err(|error| format!("cannot read {name}: {error}"))
}

/// The name by which a file, or standard input, is told.
pub(crate) fn name(path: &Path) -> String {
    if path == Path::new(STANDARD) { "standard input".into() } else { path.display().to_string() }
}

/// An assembled program is never without zeros.
pub(crate) fn is_text(bytes: &[u8]) -> bool {
    !bytes.contains(&0)
}

fn within(length: u64, limit: u64) -> io::Result<()> {
    if length <= limit {
        return Ok(());
    }
    Err(io::Error::new(ErrorKind::FileTooLarge, format!("it is larger than {limit} bytes")))
}
