//! Windows has no pseudo terminals that host software could open as a serial port, so there is none of these, and
//! whoever asks for one is told what there is.

use std::io::{self, Read, Write};
use std::path::Path;

use rustix::fd::{AsFd, BorrowedFd};

use crate::failure::Failure;
use crate::stream::Stream;

/// Whether there are pseudo terminals.
pub const EXIST: bool = false;

/// A value that does not exist, for what is not there. It is inside of what others know, who could not go on otherwise.
#[derive(Debug)]
enum Nothing {}

/// The simulator's end of a pseudo terminal.
#[derive(Debug)]
pub struct Master(Nothing);

impl Read for Master {
    fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
        match self.0 {}
    }
}

impl Write for Master {
    fn write(&mut self, _: &[u8]) -> io::Result<usize> {
        match self.0 {}
    }

    fn flush(&mut self) -> io::Result<()> {
        match self.0 {}
    }
}

impl AsFd for Master {
    fn as_fd(&self) -> BorrowedFd<'_> {
        match self.0 {}
    }
}

/// A pseudo terminal in raw mode.
#[derive(Debug)]
pub struct Pty<E> {
    /// The simulator's end of the link.
    pub end: E,
    none: Nothing,
}

impl<E> Pty<E> {
    /// Says what there is in place of a pseudo terminal for `option`.
    ///
    /// # Errors
    /// Always.
    pub fn open(option: &str, _: Option<&Path>, _: impl FnOnce(Stream<Master>) -> E) -> Result<Self, Failure> {
        let instead = match option {
            "--serial" => "--tcp ADDR:PORT offers the module's USB link to host software that can open a TCP port",
            "--slcan" => "--slcan-tcp ADDR:PORT offers the CAN adapter to host software that can open a TCP port",
            _ => "The CAN bus is offered by --slcan-tcp ADDR:PORT, and the USB link by --tcp ADDR:PORT",
        };
        Err(Failure::Arguments(format!("{option}: Windows has no pseudo terminals to open as serial ports. {instead}")))
    }

    /// The same terminal as the end of a USB cable.
    pub fn of_usb(self) -> Self {
        self
    }

    /// Hangs up.
    pub fn hang_up(self) -> Vacant {
        Vacant(self.none)
    }

    /// Path of the terminal's device.
    pub fn device(&self) -> &Path {
        match self.none {}
    }

    /// The path that host software opens.
    pub fn path(&self) -> &Path {
        match self.none {}
    }
}

/// The place of a pseudo terminal that has hung up.
#[derive(Debug)]
pub struct Vacant(Nothing);

impl Vacant {
    /// Makes a pseudo terminal in this place.
    pub fn try_to_occupy<E>(
        &mut self,
        _: &str,
        _: impl FnOnce(Stream<Master>) -> E,
    ) -> Option<Result<Pty<E>, Failure>> {
        match self.0 {}
    }
}
