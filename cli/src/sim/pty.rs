//! A serial port for host software: a pseudo terminal, and a symbolic link to the terminal's device.

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
use crate::wording::words;

/// A pseudo terminal in raw mode.
#[derive(Debug)]
pub struct Pty<E> {
    /// The simulator's end of the link.
    pub end: E,
    device: PathBuf,
    link: Option<PathBuf>,
    /// Shows other simulators that the link's path is in use.
    _claim: Option<OwnedFd>,
    /// The terminal's device, kept open so that the terminal stays in raw mode while no host has the device open.
    _slave: OwnedFd,
}

impl<E> Pty<E> {
    /// Makes a pseudo terminal and, if `link` is given, a symbolic link to its device at that path. `option` is the
    /// option named in error messages.
    pub fn open(option: &str, link: Option<&Path>, end: impl FnOnce(Stream<File>) -> E) -> Result<Self, Failure> {
        let (master, slave, device) =
            terminal().map_err(|error| Failure::Failed(format!("cannot make a pseudo terminal: {}", words(error))))?;
        let claim = link.map(|link| make_symlink(option, link, &device)).transpose()?;
        // While one telegram waits for a host that does not read, further replies are lost, as on a wire.
        let stream = Stream::new(File::from(master), 1);
        Ok(Pty { end: end(stream), device, link: link.map(Path::to_path_buf), _claim: claim, _slave: slave })
    }

    /// Path of the terminal's device.
    pub fn device(&self) -> &Path {
        &self.device
    }

    /// The path that host software opens: the symbolic link if there is one, else the device.
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.device)
    }
}

impl<E> Drop for Pty<E> {
    /// Removes the symbolic link, unless it points to another device by now.
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && fs::read_link(link).is_ok_and(|target| target == self.device)
        {
            // A link that cannot be removed does no harm: the next run replaces it.
            let _ = fs::remove_file(link);
        }
    }
}

/// Makes a pseudo terminal in raw mode; gives its two ends, the simulator's one non-blocking, and its device's path.
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

/// Makes the symbolic link and claims its path. The link of a simulator that has ended is replaced; any other file is
/// an error.
fn make_symlink(option: &str, link: &Path, device: &Path) -> Result<OwnedFd, Failure> {
    let shown = link.display();
    let no_link = |error: io::Error| {
        Failure::Failed(format!(
            "{option}: cannot make a link at {shown}: {}. Its directory has to exist",
            words(error)
        ))
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
        fs::remove_file(link).map_err(|error| {
            Failure::Failed(format!("{option}: cannot replace the old link {shown}: {}", words(error)))
        })?;
    }
    std::os::unix::fs::symlink(device, link).map_err(no_link)?;
    Ok(claim)
}

/// Claims a path for a link; fails while another simulator has the path. The old link's target does not show whether
/// its simulator still runs, because the numbers of terminals are used again.
fn claim(link: &Path) -> io::Result<OwnedFd> {
    let parent = link.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = fs::metadata(parent)?;
    let mut hasher = DefaultHasher::new();
    (folder.dev(), folder.ino(), link.file_name()).hash(&mut hasher);
    take(&format!("tmcl sim {:016x}", hasher.finish()))
}

/// Claims a name until the returned descriptor is closed. The name is a socket's abstract name, because the system
/// frees such a name however the process ends.
#[cfg(target_os = "linux")]
fn take(name: &str) -> io::Result<OwnedFd> {
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::net::{SocketAddr, UnixDatagram};
    Ok(UnixDatagram::bind_addr(&SocketAddr::from_abstract_name(name)?)?.into())
}

/// Claims a name until the returned descriptor is closed. This system has no abstract names, so the claim is the lock
/// of a temporary file, which is not removed.
#[cfg(not(target_os = "linux"))]
fn take(name: &str) -> io::Result<OwnedFd> {
    let file = File::options().create(true).truncate(false).write(true).open(std::env::temp_dir().join(name))?;
    file.try_lock().map_err(|_| ErrorKind::AddrInUse)?;
    Ok(file.into())
}
