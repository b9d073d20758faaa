//! A link over a serial device.

use std::fs::{File, TryLockError};
use std::os::fd::AsFd;
use std::time::Duration;

use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::termios::{OptionalActions, QueueSelector};
use tmcm::tmcl::binary::Telegram;

use super::{LinkError, Log, drop_stale, read_reply, write_request};
use crate::failure::Failure;
use crate::wording::words;

/// Message about a device that another program has locked.
const IN_USE: &str = "another program uses this port. End it, or wait for its end";

/// An open serial device in raw, non-blocking mode, locked against other programs.
#[derive(Debug)]
pub(super) struct Serial(pub(super) File);

impl Serial {
    pub(super) fn open(path: &str, baud: u32) -> Result<Self, Failure> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let device = rustix::fs::open(path, flags, Mode::empty()).map_err(|error| {
            let hint = match error {
                Errno::NOENT => ". Is the module connected? Or start a virtual one: tmcl sim --serial PATH",
                Errno::BUSY => return Failure::Failed(format!("{path}: {IN_USE}")),
                Errno::ACCESS => ". Your user may have to be in the group that owns the device (often dialout)",
                _ => "",
            };
            Failure::Failed(format!("cannot open {path}: {}{hint}", words(error)))
        })?;
        let device = File::from(device);
        if let Err(TryLockError::WouldBlock) = device.try_lock() {
            return Err(Failure::Failed(format!("{path}: {IN_USE}")));
        }
        configure(&device, baud).map_err(|error| {
            Failure::Failed(match error {
                Errno::NOTTY => format!("{path} is not a serial device"),
                Errno::INVAL => format!("{path} does not do {baud} baud"),
                _ => format!("cannot set up {path}: {}", words(error)),
            })
        })?;
        exclude_others(&device, path);
        Ok(Serial(device))
    }

    pub(super) fn exchange(
        &mut self,
        request: &Telegram,
        timeout: Duration,
        log: &mut Log,
    ) -> Result<Telegram, LinkError> {
        drop_stale(&mut self.0, log);
        rustix::termios::tcflush(&self.0, QueueSelector::IFlush).map_err(std::io::Error::from)?;
        write_request(&mut self.0, request, log)?;
        read_reply(&mut self.0, timeout, log)
    }
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
