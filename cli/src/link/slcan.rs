//! A link over a serial CAN adapter (SLCAN), on a serial device or a TCP port.

use std::io::{ErrorKind, Read, Write};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use tmcm::tmcl::binary::{self, Telegram};
use tmcm::tmcl::can::{self, Data, Frame};
use tmcm::tmcl::{Command, Opcode, Reply};

use super::{LinkError, readable};
use crate::slcan::{CanFrame, DONE};

/// Closes the adapter's channel, whatever state it is in, sets 1 Mbit/s, the module's default, and opens it.
const OPEN: &[u8] = b"\rC\rS8\rO\r";
/// Host address in the telegrams that replies are turned into; on CAN nobody has one.
const HOST: u8 = 2;

/// An adapter with its channel open, on a device in non-blocking mode.
#[derive(Debug)]
pub(super) struct Slcan<T> {
    device: T,
    line: Vec<u8>,
}

impl<T: Read + Write + AsFd> Slcan<T> {
    pub(super) fn open(mut device: T) -> Result<Self, std::io::Error> {
        device.write_all(OPEN)?;
        Ok(Slcan { device, line: Vec::new() })
    }

    /// The telegram's address is the identifier that the module listens to. Replies are told from other frames on
    /// the bus by what they answer.
    pub(super) fn exchange(&mut self, request: &Telegram, timeout: Duration) -> Result<Telegram, LinkError> {
        let (Some(command), [id, ..]) = (binary::decode_command(request), *request) else {
            return Err(LinkError::NoReply { bytes: 0 });
        };
        let frame = CanFrame::from(Frame { id: id.into(), data: can::encode_command(command) });
        self.device.write_all(format!("{frame}\r").as_bytes())?;
        let until = Instant::now() + timeout;
        loop {
            let line = self.line(until)?;
            let frame = CanFrame::parse(&line).as_ref().and_then(CanFrame::plain);
            if let Some(reply) = frame.and_then(|frame| telegram(id, command, &frame.data)) {
                return Ok(reply);
            }
        }
    }

    /// The next line from the adapter.
    fn line(&mut self, until: Instant) -> Result<String, LinkError> {
        loop {
            if let Some(end) = self.line.iter().position(|byte| *byte == DONE) {
                let line = self.line.drain(..=end).take(end).collect();
                return Ok(String::from_utf8(line).unwrap_or_default());
            }
            if !readable(&self.device, until)? {
                return Err(LinkError::NoReply { bytes: 0 });
            }
            let mut bytes = [0; 256];
            match self.device.read(&mut bytes) {
                Ok(0) => return Err(LinkError::Closed),
                Ok(count) => self.line.extend(bytes.iter().take(count)),
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
                Err(error) => return Err(error.into()),
            }
        }
    }
}

/// The reply to `command` of the module with identifier `id`, as the telegram it would be on a byte link; `None`
/// for any other frame.
fn telegram(id: u8, command: Command, data: &Data) -> Option<Telegram> {
    let eight: [u8; 8] = data.as_slice().try_into().ok()?;
    let [module, status, opcode, a, b, c, d, _] = eight;
    match (Opcode::from_number(command.opcode), command.kind) {
        (Some(Opcode::FirmwareVersion), 0) => Some(binary::encode_reply(HOST, id, &Reply::Version(eight))),
        (Some(Opcode::ReadMemory), _) if module != id || opcode != command.opcode => {
            let stored = Command::from_bytes(*eight.first_chunk()?);
            Some(binary::encode_reply(HOST, id, &Reply::Memory(stored)))
        }
        _ if module != id || opcode != command.opcode => None,
        _ => {
            let mut telegram = [HOST, module, status, opcode, a, b, c, d, 0];
            telegram[8] = binary::checksum(&telegram);
            Some(telegram)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::UnixStream;

    /// An adapter that answers the frame of `GAP 1, 0` to module 3 with other traffic, then with the reply.
    #[test]
    fn the_reply_is_found_among_other_traffic() {
        let (host, mut adapter) = UnixStream::pair().unwrap();
        host.set_nonblocking(true).unwrap();
        let mut link = Slcan::open(host).unwrap();
        adapter.write_all(b"\r\r\rz\rt0028016406000000FF00\rt00280364060000007B00\r").unwrap();
        let request = binary::encode_command(3, Command::new(6, 1, 0, 0));
        let reply = binary::decode_reply(&link.exchange(&request, Duration::from_secs(5)).unwrap()).unwrap();
        assert_eq!((reply.module, reply.status, reply.opcode, reply.value), (3, 100, 6, 0x7B));
        let mut sent = [0; 64];
        let count = adapter.read(&mut sent).unwrap();
        assert_eq!(&sent[..count], b"\rC\rS8\rO\rt00380601000000000000\r");
    }
}
