//! Linux, macOS and their like.

use std::fs::{File, Metadata, TryLockError};
use std::io::{self, ErrorKind};
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize};

use rustix::io::Errno;
use rustix::termios::{ControlModes, OptionalActions};
use serial2::SerialPort;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};

use super::claim;

/// How a user gets a virtual module in place of a serial device that is not there.
pub(crate) const VIRTUAL_PORT: &str = "tmcl sim --serial PATH";

/// An end of a connection within the program.
pub type Socket = UnixStream;

/// Both ends of a connection within the program.
///
/// # Errors
/// The system has no room for it.
pub fn pair() -> io::Result<(Socket, Socket)> {
    UnixStream::pair()
}

/// The source from which standard input is read.
pub type Input = File;

/// Standard input, past the buffer of the library, in which bytes could hide from who waits for them.
///
/// # Errors
/// It is closed.
pub fn standard_input() -> io::Result<Input> {
    Ok(io::stdin().as_fd().try_clone_to_owned()?.into())
}

/// Sees to it that from now on Ctrl-C (SIGINT), SIGTERM and SIGHUP no longer end the program. SIGHUP tells that the
/// terminal is gone. The number of such a signal is put into each of `numbers`, and then a byte is written into `rope`.
/// SIGHUP is left alone if the program was started with it ignored, as `nohup` does.
pub(crate) fn watch(rope: &Socket, numbers: &[Arc<AtomicUsize>]) -> io::Result<()> {
    let hangup = (!is_ignored(SIGHUP)).then_some(SIGHUP);
    for signal in [SIGINT, SIGTERM].into_iter().chain(hangup) {
        // The number is noted before the bell rings, because handlers run in the order of their registration.
        for number in numbers {
            signal_hook::flag::register_usize(signal, Arc::clone(number), signal.unsigned_abs() as usize)?;
        }
        signal_hook::low_level::pipe::register(signal, rope.try_clone()?)?;
    }
    Ok(())
}

/// True if the program was started with this signal ignored: the signal must not end it.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask >> (signal - 1) & 1 != 0)
}

/// From now on a write beyond the limit for file sizes fails, and does not end the program by SIGXFSZ.
///
/// # Errors
/// The system refuses to watch for the signal.
pub fn let_large_writes_fail() -> io::Result<()> {
    signal_hook::flag::register(SIGXFSZ, Arc::<AtomicBool>::default()).map(|_| ())
}

/// The name by which the library opens a serial device.
pub(crate) fn port_name(path: &str) -> &str {
    path
}

/// Advice for whoever cannot open a serial device.
pub(crate) fn port_hint(error: &io::Error) -> &'static str {
    match error.kind() {
        ErrorKind::PermissionDenied => ". Your user may have to be in the group that owns the device (often dialout)",
        _ => "",
    }
}

/// True if another program has a serial device that could not be opened.
pub(crate) fn is_taken(error: &io::Error) -> bool {
    error.kind() == ErrorKind::ResourceBusy
}

/// True if what could not be opened as a serial device is none.
pub(crate) fn is_no_port(error: &io::Error) -> bool {
    error.raw_os_error() == Some(Errno::NOTTY.raw_os_error())
}

/// Locks a serial device against other programs. False if one of them has locked it.
pub(crate) fn lock(port: &SerialPort) -> io::Result<bool> {
    let device = File::from(port.as_fd().try_clone_to_owned()?);
    // The lock belongs to the device that is open, whatever the number of its descriptors. Where there are no locks, it
    // goes without.
    Ok(!matches!(device.try_lock(), Err(TryLockError::WouldBlock)))
}

/// Takes a serial device, which has been set up, for this program alone, and lets it carry bytes whatever its modem
/// lines say.
pub(crate) fn settle(port: &SerialPort, path: &str) -> io::Result<()> {
    let mut settings = rustix::termios::tcgetattr(port)?;
    settings.control_modes |= ControlModes::CREAD | ControlModes::CLOCAL;
    rustix::termios::tcsetattr(port, OptionalActions::Now, &settings)?;
    // Programs that ignore the lock are kept out, too. Not for a pseudo terminal, which would stay exclusive after this
    // program has ended, because its other end stays open.
    if !std::fs::canonicalize(path).is_ok_and(|device| claim::is_pseudo_terminal(&device)) {
        // If this fails, the lock alone must do.
        let _ = rustix::termios::ioctl_tiocexcl(port);
    }
    Ok(())
}

/// Whether a device leads to one module, which answers whatever the address: it is that of USB, or the port of
/// `tmcl sim --serial`.
pub(crate) fn leads_to_one(path: &str) -> bool {
    let device = std::fs::canonicalize(path).unwrap_or_else(|_| path.into());
    let is_usb = device.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"ttyACM"));
    is_usb || claim::is_usb(&device)
}

/// The path of a file without links.
///
/// # Errors
/// There is no such file, or no way to it.
pub fn real(path: &Path) -> io::Result<PathBuf> {
    path.canonicalize()
}

/// True if an error of writing is that nobody reads any more.
pub fn has_no_reader(error: &io::Error) -> bool {
    error.kind() == ErrorKind::BrokenPipe
}

/// The numbers that tell a file from all others that there are at the same time.
pub type Identity = (u64, u64);

/// The identity of an open file, which tells it from others.
///
/// # Errors
/// The system does not say.
pub fn identity(file: &File) -> io::Result<Identity> {
    file.metadata().map(|metadata| of(&metadata))
}

/// The identity of the file at a path, which tells it from others; a symbolic link has an identity of its own.
///
/// # Errors
/// There is no such file, or the system does not say.
pub fn identity_at(path: &Path) -> io::Result<Identity> {
    std::fs::symlink_metadata(path).map(|metadata| of(&metadata))
}

fn of(metadata: &Metadata) -> Identity {
    (metadata.dev(), metadata.ino())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_of_usb_leads_to_one_module() {
        let there_are_none = ["/dev/ttyACM177", "/dev/ttyUSB177", "/dev/ttyS177", "/dev/ttyACM177/x"];
        assert_eq!(there_are_none.map(leads_to_one), [true, false, false, false]);
    }
}
