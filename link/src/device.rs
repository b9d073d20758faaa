//! What carries bytes: a serial device or a connection, in non-blocking mode.

use std::fs::File;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::os::fd::{AsFd, BorrowedFd};

use rustix::termios::QueueSelector;
use tmcl_tools::wire::LinkError;

use super::lost;

/// A serial device or a connection, in non-blocking mode.
#[derive(Debug)]
pub(super) enum Device {
    Serial(File),
    Tcp(TcpStream),
}

impl Device {
    /// Throws away what the driver of a serial device still has of what has come.
    pub(super) fn flush_input(&self) -> Result<(), LinkError> {
        match self {
            Device::Serial(device) => rustix::termios::tcflush(device, QueueSelector::IFlush).map_err(lost),
            Device::Tcp(_) => Ok(()),
        }
    }
}

impl Read for Device {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self {
            Device::Serial(device) => device.read(bytes),
            Device::Tcp(stream) => stream.read(bytes),
        }
    }
}

impl Write for Device {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Device::Serial(device) => device.write(bytes),
            Device::Tcp(stream) => stream.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Device::Serial(device) => device.flush(),
            Device::Tcp(stream) => stream.flush(),
        }
    }
}

impl AsFd for Device {
    fn as_fd(&self) -> BorrowedFd<'_> {
        match self {
            Device::Serial(device) => device.as_fd(),
            Device::Tcp(stream) => stream.as_fd(),
        }
    }
}
