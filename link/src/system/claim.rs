//! Names that a simulator claims while it runs, for other simulators and for the tools to see.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Claims a path for a symbolic link to a terminal; fails while another simulator has the path. The old link's target
/// does not show whether its simulator still runs, because the numbers of terminals are used again.
pub fn path(link: &Path) -> io::Result<OwnedFd> {
    let parent = link.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = fs::metadata(parent)?;
    let mut hasher = DefaultHasher::new();
    (folder.dev(), folder.ino(), link.file_name()).hash(&mut hasher);
    take(&format!("tmcl sim {:016x}", hasher.finish()))
}

/// Claims a terminal as the end of a USB cable.
pub fn usb(device: &Path) -> io::Result<OwnedFd> {
    take(&end_of_cable(device)?)
}

/// True for the path of a pseudo terminal's device.
pub fn is_pseudo_terminal(device: &Path) -> bool {
    device.starts_with("/dev/pts") || device.to_str().is_some_and(|device| device.starts_with("/dev/ttys"))
}

/// True if a simulator that runs has claimed this terminal as the end of a USB cable.
pub fn is_usb(device: &Path) -> bool {
    end_of_cable(device).is_ok_and(|name| is_taken(&name))
}

fn end_of_cable(device: &Path) -> io::Result<String> {
    let terminal = fs::metadata(device)?;
    Ok(format!("tmcl sim usb {:x} {:x}", terminal.dev(), terminal.ino()))
}

/// Claims a name until the returned descriptor is closed. The name is a socket's abstract name, because the system
/// frees such a name however the process ends.
#[cfg(target_os = "linux")]
fn take(name: &str) -> io::Result<OwnedFd> {
    Ok(std::os::unix::net::UnixDatagram::bind_addr(&abstract_name(name)?)?.into())
}

/// True while somebody has claimed a name.
#[cfg(target_os = "linux")]
fn is_taken(name: &str) -> bool {
    let connect = || std::os::unix::net::UnixDatagram::unbound()?.connect_addr(&abstract_name(name)?);
    connect().is_ok()
}

#[cfg(target_os = "linux")]
fn abstract_name(name: &str) -> io::Result<std::os::unix::net::SocketAddr> {
    <std::os::unix::net::SocketAddr as std::os::linux::net::SocketAddrExt>::from_abstract_name(name)
}

/// Claims a name until the returned descriptor is closed. This system has no abstract names, so the claim is the lock
/// of a temporary file, which is not removed.
#[cfg(not(target_os = "linux"))]
fn take(name: &str) -> io::Result<OwnedFd> {
    let path = std::env::temp_dir().join(name);
    let file = fs::File::options().create(true).truncate(false).write(true).open(path)?;
    file.try_lock().map_err(|_| io::ErrorKind::AddrInUse)?;
    Ok(file.into())
}

/// True while somebody has claimed a name.
#[cfg(not(target_os = "linux"))]
fn is_taken(name: &str) -> bool {
    fs::File::open(std::env::temp_dir().join(name)).is_ok_and(|file| file.try_lock_shared().is_err())
}
