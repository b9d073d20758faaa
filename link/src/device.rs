//! The device of a link, which carries bytes: a serial device or a connection.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use serial2::SerialPort;
use tmcl_tools::wire::LinkError;

use super::lost;
use crate::poll::readable;

/// A serial device or a connection.
#[derive(Debug)]
pub(super) enum Device {
    Serial(SerialPort),
    Tcp(TcpStream),
}

impl Device {
    /// Throws away what the driver of a serial device still has of what has come.
    pub(super) fn flush_input(&self) -> Result<(), LinkError> {
        match self {
            Device::Serial(port) => port.discard_input_buffer().map_err(lost),
            Device::Tcp(_) => Ok(()),
        }
    }

    /// Reads what has come, or comes until an instant: the number of bytes, which is 0 at the end of a connection.
    /// `None` if nothing comes by then.
    pub(super) fn read_by(&mut self, bytes: &mut [u8], until: Instant) -> Result<Option<usize>, LinkError> {
        let read = match self {
            Device::Serial(port) => read_serial(port, bytes, until),
            Device::Tcp(stream) => readable(stream, until).and_then(|is_readable| match is_readable {
                true => stream.read(bytes),
                false => Err(ErrorKind::TimedOut.into()),
            }),
        };
        match read {
            Ok(count) => Ok(Some(count)),
            Err(error) if error.kind() == ErrorKind::ConnectionReset => Err(LinkError::Closed),
            Err(error) => match error.kind() {
                ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted => Ok(None),
                _ => Err(lost(error)),
            },
        }
    }

    /// Sends bytes. That does not block, because a request fits the buffer of a device.
    pub(super) fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let sent = match self {
            Device::Serial(port) => port.write_all(bytes),
            Device::Tcp(stream) => stream.write_all(bytes),
        };
        sent.map_err(lost)
    }
}

fn read_serial(port: &mut SerialPort, bytes: &mut [u8], until: Instant) -> io::Result<usize> {
    let left = until.saturating_duration_since(Instant::now());
    // The library counts whole milliseconds, and with a part of one it would not wait.
    port.set_read_timeout(Duration::from_millis(left.as_micros().div_ceil(1000) as u64))?;
    port.read(bytes)
}
