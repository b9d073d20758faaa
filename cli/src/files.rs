//! Files of the user's: read no further than any file of their kind goes.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

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

fn within(length: u64, limit: u64) -> io::Result<()> {
    if length <= limit {
        return Ok(());
    }
    Err(io::Error::new(ErrorKind::FileTooLarge, format!("it is larger than {limit} bytes")))
}
