//! Files that the user names: read up to the largest size that such files may have, and replaced by others.

use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Largest size of a text or program in bytes; real ones are far smaller.
pub const LARGEST: u64 = 1 << 20;

/// Reads a source to its end; an error if that is more than `limit` bytes.
pub fn read(source: impl Read, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source.take(limit + 1).read_to_end(&mut bytes)?;
    within(bytes.len() as u64, limit)?;
    Ok(bytes)
}

/// Reads a file; an error if it has more than `limit` bytes.
pub fn read_file(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    within(file.metadata()?.len(), limit)?;
    // The limit also applies while reading, because the length of a device is unknown.
    read(file, limit)
}

/// Reads a text file.
pub fn read_text(path: &Path) -> io::Result<String> {
    let bytes = read_file(path, LARGEST)?;
    String::from_utf8(bytes).map_err(|_| io::Error::new(ErrorKind::InvalidData, "it is no text (UTF-8)"))
}

fn within(length: u64, limit: u64) -> io::Result<()> {
    if length <= limit {
        return Ok(());
    }
    Err(io::Error::new(ErrorKind::FileTooLarge, format!("it is larger than {limit} bytes")))
}

/// Makes a new file in the directory of `path`, under a random name, so that no existing file is touched.
pub fn beside(path: &Path) -> io::Result<(PathBuf, File)> {
    loop {
        let mut name = path.as_os_str().to_owned();
        name.push(format!(".{:016x}.new", RandomState::new().hash_one(())));
        match OpenOptions::new().write(true).create_new(true).open(&name) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return Ok((name.into(), made?)),
        }
    }
}

/// Files that [`beside`] has made for `path`, by their names, and that are still there.
pub fn left_beside(path: &Path) -> impl Iterator<Item = PathBuf> {
    let name = path.file_name().map(OsStr::as_encoded_bytes).unwrap_or_default().to_vec();
    let is_made = move |other: &OsStr| {
        let random = other.as_encoded_bytes().strip_prefix(name.as_slice()).and_then(|rest| rest.strip_prefix(b"."));
        let random = random.and_then(|rest| rest.strip_suffix(b".new"));
        random.is_some_and(|random| random.len() == 16 && random.iter().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f')))
    };
    let folder = path.parent().map(fs::read_dir).into_iter().flatten().flatten().flatten();
    folder.filter(move |entry| is_made(&entry.file_name())).map(|entry| entry.path())
}
