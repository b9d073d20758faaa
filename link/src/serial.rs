//! A link over a serial device.

use std::fs::{File, TryLockError};
use std::os::fd::AsFd;

use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::termios::OptionalActions;

use super::Error;
use crate::claim;
use crate::wording::words;

/// Message about a device that another program has locked.
const IN_USE: &str = "another program uses this port. End it, or wait for its end";

/// Opens a serial device in raw, non-blocking mode, locked against other programs.
pub(super) fn open(path: &str, baud: u32) -> Result<File, Error> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let device = rustix::fs::open(path, flags, Mode::empty()).map_err(|error| {
        let hint = match error {
            Errno::NOENT => ". Is the module connected? Or start a virtual one: tmcl sim --serial PATH",
            Errno::BUSY => return Error(format!("{path}: {IN_USE}")),
            Errno::ACCESS => ". Your user may have to be in the group that owns the device (often dialout)",
            _ => "",
        };
        Error(format!("cannot open {path}: {}{hint}", words(error)))
    })?;
    let device = File::from(device);
    if let Err(TryLockError::WouldBlock) = device.try_lock() {
        return Err(Error(format!("{path}: {IN_USE}")));
    }
    configure(&device, baud).map_err(|error| {
        Error(match error {
            Errno::NOTTY => format!("{path} is not a serial device"),
            Errno::INVAL => format!("{path} does not do {baud} baud"),
            _ => format!("cannot set up {path}: {}", words(error)),
        })
    })?;
    exclude_others(&device, path);
    Ok(device)
}

/// Whether a device leads to one module, which answers whatever the address: it is that of USB, or the port of
/// `tmcl sim --serial`.
pub(super) fn is_alone(path: &str) -> bool {
    let device = std::fs::canonicalize(path).unwrap_or_else(|_| path.into());
    let is_usb = device.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"ttyACM"));
    is_usb || claim::is_usb(&device)
}

/// Keeps programs that ignore the lock from opening the device. Not for a pseudo terminal, which would stay exclusive
/// after this program has ended, because its other end stays open.
fn exclude_others(device: &impl AsFd, path: &str) {
    if !std::fs::canonicalize(path).is_ok_and(|device| device.starts_with("/dev/pts")) {
        // If this fails, the lock alone must do.
        let _ = rustix::termios::ioctl_tiocexcl(device);
    }
}

fn configure(device: &impl AsFd, baud: u32) -> Result<(), Errno> {
    let mut settings = rustix::termios::tcgetattr(device)?;
    settings.make_raw();
    settings.control_modes |= rustix::termios::ControlModes::CREAD | rustix::termios::ControlModes::CLOCAL;
    settings.control_modes &= !(rustix::termios::ControlModes::CSTOPB | rustix::termios::ControlModes::CRTSCTS);
    settings.set_speed(baud)?;
    rustix::termios::tcsetattr(device, OptionalActions::Now, &settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_of_usb_leads_to_one_module() {
        let there_are_none = ["/dev/ttyACM177", "/dev/ttyUSB177", "/dev/ttyS177", "/dev/ttyACM177/x"];
        assert_eq!(there_are_none.map(is_alone), [true, false, false, false]);
    }
}
