//! A link over a serial CAN adapter (SLCAN), on a serial device or a TCP port.

use std::io::{ErrorKind, Read, Write};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use tmcl_tools::slcan::{self, DONE, REFUSED};
use tmcl_tools::wire::{LinkError, Tap};
use tmcm::can::{CanFrame, Frame};
use tmcm::tmcl::binary::Telegram;
use tmcm::tmcl::{Command, can};
use tmcm_sim::wire::reply_in_frame;

use super::exchange::{Patience, STALE_READS};
use super::lost;
use crate::poll::readable;

/// Commands that open the adapter's channel: an empty line ends any unfinished command, C closes the channel, S8 sets
/// 1 Mbit/s (the module's default), O opens the channel.
const OPEN: [&str; 4] = ["", "C", "S8", "O"];
/// Longest wait for the answer to each of these commands; some adapters do not answer.
const ANSWER: Duration = Duration::from_millis(300);

/// An adapter with its channel open, on a device in non-blocking mode.
#[derive(Debug)]
pub(super) struct Slcan<T> {
    device: T,
    line: Vec<u8>,
}

impl<T: Read + Write + AsFd> Slcan<T> {
    pub(super) fn open(device: T) -> Result<Self, LinkError> {
        let mut adapter = Slcan { device, line: Vec::new() };
        for command in OPEN {
            adapter.write(command)?;
            // A refusal may mean that the adapter is in the wanted state already, so it is ignored. If the channel
            // does not open, the adapter will refuse the frames.
            let mut patience = Patience::begin(ANSWER);
            loop {
                match adapter.line(&mut patience) {
                    Ok(line) if !line.is_empty() => {}
                    Ok(_) | Err(LinkError::Refused | LinkError::NoReply { .. }) => break,
                    Err(error) => return Err(error),
                }
            }
        }
        Ok(adapter)
    }

    /// Sends a command to the module with identifier `id` and waits for its reply. A frame is the reply if it has the
    /// module's identifier and the number of the command; other frames are ignored.
    pub(super) fn ask(
        &mut self,
        id: u16,
        command: Command,
        timeout: Duration,
        tap: &mut dyn Tap,
    ) -> Result<Telegram, LinkError> {
        self.forget(tap)?;
        let frame = Frame::standard(id, &can::encode_command(command)).ok_or(LinkError::Refused)?;
        tap.frame_out(&frame);
        self.write(&slcan::line(&frame))?;
        let mut patience = Patience::begin(timeout);
        loop {
            let frame = slcan::parse(&self.line(&mut patience)?);
            frame.iter().for_each(|frame| tap.frame_back(frame));
            let frame = frame.filter(|frame| !frame.is_extended() && frame.is_data_frame());
            if let Some(reply) = frame.and_then(|frame| reply_in_frame(id, command, frame.data())) {
                return Ok(reply);
            }
        }
    }

    fn write(&mut self, line: &str) -> Result<(), LinkError> {
        // The write does not block, because a line fits the device's buffer.
        self.device.write_all(format!("{line}\r").as_bytes()).map_err(lost)
    }

    /// Drops everything that has come so far: late replies to earlier requests.
    fn forget(&mut self, tap: &mut dyn Tap) -> Result<(), LinkError> {
        for _ in 0..STALE_READS {
            if !readable(&self.device, Instant::now()).map_err(lost)? {
                break;
            }
            self.read()?;
        }
        for line in self.line.split(|byte| [DONE, REFUSED].contains(byte)) {
            slcan::parse(&String::from_utf8_lossy(line)).iter().for_each(|frame| tap.frame_back(frame));
        }
        self.line.clear();
        Ok(())
    }

    /// The next line from the adapter; a refusal is an error.
    fn line(&mut self, patience: &mut Patience) -> Result<String, LinkError> {
        loop {
            // Somebody who never stops talking does not keep this from ending.
            if patience.is_over() {
                return Err(LinkError::NoReply { bytes: 0 });
            }
            if let Some(end) = self.line.iter().position(|byte| [DONE, REFUSED].contains(byte)) {
                let mut line: Vec<u8> = self.line.drain(..=end).collect();
                return match line.pop() {
                    Some(REFUSED) => Err(LinkError::Refused),
                    _ => Ok(String::from_utf8(line).unwrap_or_default()),
                };
            }
            if !patience.readable(&self.device)? {
                return Err(LinkError::NoReply { bytes: 0 });
            }
            self.read()?;
        }
    }

    fn read(&mut self) -> Result<(), LinkError> {
        let mut bytes = [0; 256];
        match self.device.read(&mut bytes) {
            Ok(0) => Err(LinkError::Closed),
            Ok(count) => {
                self.line.extend(bytes.iter().take(count));
                Ok(())
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(()),
            Err(error) => Err(lost(error)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader};
    use std::os::unix::net::UnixStream;

    use tmcm::tmcl::binary;

    use super::*;
    use tmcl_tools::wire::Nobody;

    /// A link to an adapter that answers line by line, and then falls silent.
    fn link(answers: &'static [&str]) -> (Slcan<UnixStream>, std::thread::JoinHandle<Vec<String>>) {
        let (host, adapter) = UnixStream::pair().unwrap();
        host.set_nonblocking(true).unwrap();
        let adapter = std::thread::spawn(move || {
            let mut lines = BufReader::new(adapter.try_clone().unwrap()).split(DONE);
            let mut answer = |answer: &&str| {
                let line = lines.next().unwrap().unwrap();
                (&adapter).write_all(answer.as_bytes()).unwrap();
                String::from_utf8(line).unwrap()
            };
            ["\r", "t0028036406000000AA00\r\x07", "\r", "\r"].iter().chain(answers).map(&mut answer).collect()
        });
        (Slcan::open(host).unwrap(), adapter)
    }

    const GAP: Command = Command::new(6, 1, 0, 0);

    #[test]
    fn the_reply_is_found_among_other_traffic() {
        let (mut link, adapter) = link(&["z\rt0028016406000000FF00\rt00280364060000007B00\r"]);
        let reply = link.ask(3, GAP, Duration::from_secs(5), &mut Nobody).unwrap();
        let reply = binary::decode_reply(&reply).unwrap();
        assert_eq!((reply.module, reply.status, reply.opcode, reply.value), (3, 100, 6, 0x7B));
        assert_eq!(adapter.join().unwrap(), ["", "C", "S8", "O", "t00380601000000000000"]);
    }

    /// Late replies and half a line that came before the request are not taken for its reply.
    #[test]
    fn replies_that_came_before_the_request_are_dropped() {
        const LATE: &str = "z\rt00280364060000000100\rt00280364060000000200\rt00280364";
        let (mut link, adapter) = link(&[LATE, "z\rt00280364060000000300\r"]);
        let mut ask = || {
            let reply = link.ask(3, GAP, Duration::from_secs(5), &mut Nobody).unwrap();
            binary::decode_reply(&reply).unwrap().value
        };
        assert_eq!((ask(), ask()), (1, 3));
        adapter.join().unwrap();
    }

    #[test]
    fn a_refusal_ends_the_wait_at_once() {
        let (mut link, _adapter) = link(&["\x07"]);
        let refused = link.ask(3, GAP, Duration::from_secs(60), &mut Nobody);
        assert!(matches!(refused, Err(LinkError::Refused)), "{refused:?}");
    }
}
