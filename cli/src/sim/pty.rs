//! A serial port for host software: a pseudo terminal, with a symbolic link to it.

use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::{self, ErrorKind};
use std::os::fd::OwnedFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags};
use rustix::pty::OpenptFlags;
use rustix::termios::OptionalActions;

use super::stream::Stream;
use crate::failure::Failure;

/// A pseudo terminal in raw mode.
#[derive(Debug)]
pub struct Pty<E> {
    /// What hosts send, and where replies go.
    pub end: E,
    device: PathBuf,
    link: Option<PathBuf>,
    /// Shows other simulators that the link is in use.
    _claim: Option<OwnedFd>,
    /// Kept open so that the terminal stays as it is, raw, while no host has it open.
    _slave: OwnedFd,
}

impl<E> Pty<E> {
    /// Makes a pseudo terminal and, if `option` was given a path, a symbolic link to it there.
    pub fn open(option: &str, link: Option<&Path>, end: impl FnOnce(Stream<File>) -> E) -> Result<Self, Failure> {
        let (master, slave, device) =
            terminal().map_err(|error| Failure::Failed(format!("cannot make a pseudo terminal: {error}")))?;
        let claim = link.map(|link| make_symlink(option, link, &device)).transpose()?;
        // One telegram may wait for a host that does not read; then replies are lost, as on a wire.
        let stream = Stream::new(File::from(master), 1);
        Ok(Pty { end: end(stream), device, link: link.map(Path::to_path_buf), _claim: claim, _slave: slave })
    }

    /// The terminal's device.
    pub fn device(&self) -> &Path {
        &self.device
    }

    /// The path for host software: the link if there is one.
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.device)
    }
}

impl<E> Drop for Pty<E> {
    /// Removes the link, unless it has become somebody else's.
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && fs::read_link(link).is_ok_and(|target| target == self.device)
        {
            // There is nobody to tell if it cannot be removed; the next run replaces it.
            let _ = fs::remove_file(link);
        }
    }
}

fn terminal() -> io::Result<(OwnedFd, OwnedFd, PathBuf)> {
    let master = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    rustix::pty::grantpt(&master)?;
    rustix::pty::unlockpt(&master)?;
    let name = rustix::pty::ptsname(&master, Vec::new())?;
    let device = PathBuf::from(name.to_string_lossy().into_owned());
    let slave = rustix::fs::open(&device, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
    let mut settings = rustix::termios::tcgetattr(&slave)?;
    settings.make_raw();
    rustix::termios::tcsetattr(&slave, OptionalActions::Now, &settings)?;
    let flags = rustix::fs::fcntl_getfl(&master)?;
    rustix::fs::fcntl_setfl(&master, flags | OFlags::NONBLOCK)?;
    Ok((master, slave, device))
}

/// Makes the symbolic link, and gives what shows that it is in use. What an earlier run has left there is replaced,
/// anything else stays.
fn make_symlink(option: &str, link: &Path, device: &Path) -> Result<OwnedFd, Failure> {
    let shown = link.display();
    let no_link = |error: io::Error| {
        Failure::Failed(format!("{option}: cannot make a link at {shown}: {error}. Its directory has to exist"))
    };
    let found = fs::symlink_metadata(link).ok();
    let leftover = |found: &fs::Metadata| {
        found.is_symlink() && fs::read_link(link).is_ok_and(|target| target.starts_with("/dev/pts"))
    };
    if found.as_ref().is_some_and(|found| !leftover(found)) {
        let message = format!(
            "{option}: {shown} exists and is not a link to a terminal; it is left alone. Give a path where there is \
             nothing yet"
        );
        return Err(Failure::Failed(message));
    }
    let claim = claim(link).map_err(|error| match error.kind() {
        ErrorKind::AddrInUse => {
            Failure::Failed(format!("{option}: {shown} is the port of a simulator that runs. Give another path"))
        }
        _ => no_link(error),
    })?;
    if found.is_some() {
        fs::remove_file(link)
            .map_err(|error| Failure::Failed(format!("{option}: cannot replace the old link {shown}: {error}")))?;
    }
    std::os::unix::fs::symlink(device, link).map_err(no_link)?;
    Ok(claim)
}

/// Takes a path for a link; fails while somebody has it. The terminals tell nothing: their numbers are used again.
fn claim(link: &Path) -> io::Result<OwnedFd> {
    let parent = link.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = fs::metadata(parent)?;
    let mut hasher = DefaultHasher::new();
    (folder.dev(), folder.ino(), link.file_name()).hash(&mut hasher);
    take(&format!("tmcl sim {:016x}", hasher.finish()))
}

/// Takes a name for as long as what is returned is open. A socket's abstract name goes with the process, however that ends.
#[cfg(target_os = "linux")]
fn take(name: &str) -> io::Result<OwnedFd> {
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::net::{SocketAddr, UnixDatagram};
    Ok(UnixDatagram::bind_addr(&SocketAddr::from_abstract_name(name)?)?.into())
}

/// The same where there are no abstract names: the lock of a file does, which stays behind.
#[cfg(not(target_os = "linux"))]
fn take(name: &str) -> io::Result<OwnedFd> {
    let file = File::options().create(true).truncate(false).write(true).open(std::env::temp_dir().join(name))?;
    file.try_lock().map_err(|_| ErrorKind::AddrInUse)?;
    Ok(file.into())
}
