//! Lines of a serial CAN adapter (SLCAN), each with a frame.

use tmcm::can::{CanFrame, Frame};
use tmcm::tmcl::binary::Telegram;
use tmcm::tmcl::{Command, can};
use tmcm_sim::wire::reply_in_frame;

use super::Framing;
use crate::slcan::{self, DONE, REFUSED};
use crate::wire::{LinkError, Tap};

/// Most bytes that are taken at once.
const MOST: usize = 256;

/// The framing of CAN behind an adapter.
#[derive(Clone, Debug, Default)]
pub struct Slcan {
    /// The identifier that was asked, and what.
    asked: Option<(u16, Command)>,
    /// The bytes that have come, and have not been cut into lines.
    bytes: Vec<u8>,
}

/// A line from an adapter, without its end.
enum Line {
    Done(String),
    Refused,
}

impl Slcan {
    /// Lines that open an adapter's channel, each of which is [answered](Slcan::answered). An empty line ends any
    /// unfinished command, C closes the channel, S8 sets 1 Mbit/s (the module's default), O opens the channel.
    pub const OPEN: [&str; 4] = ["\r", "C\r", "S8\r", "O\r"];

    /// Takes bytes that have come since one of the lines with which the channel is opened. True when that is answered.
    /// A refusal may mean that the adapter is in the wanted state already: if the channel does not open, it will refuse
    /// the frames.
    pub fn answered(&mut self, bytes: &[u8]) -> bool {
        self.hear(bytes);
        while let Some(line) = self.line() {
            if !matches!(line, Line::Done(line) if !line.is_empty()) {
                return true;
            }
        }
        false
    }

    /// Takes bytes. What has no end for longer than any line is none, and is dropped.
    fn hear(&mut self, bytes: &[u8]) {
        let begun = self.bytes.iter().rev().take_while(|byte| ![DONE, REFUSED].contains(byte)).count();
        if begun > MOST {
            self.bytes.truncate(self.bytes.len() - begun);
        }
        self.bytes.extend(bytes);
    }

    /// The next whole line.
    fn line(&mut self) -> Option<Line> {
        let end = self.bytes.iter().position(|byte| [DONE, REFUSED].contains(byte))?;
        let mut line: Vec<u8> = self.bytes.drain(..=end).collect();
        Some(match line.pop() {
            Some(REFUSED) => Line::Refused,
            _ => Line::Done(String::from_utf8(line).unwrap_or_default()),
        })
    }

    /// Drops all that has come: late replies to earlier requests, and half a line.
    fn forget(&mut self, tap: &mut dyn Tap) {
        for line in self.bytes.split(|byte| [DONE, REFUSED].contains(byte)) {
            slcan::parse(&String::from_utf8_lossy(line)).iter().for_each(|frame| tap.frame_back(frame));
        }
        self.bytes.clear();
    }
}

impl Framing for Slcan {
    fn ask(&mut self, address: u16, command: Command, tap: &mut dyn Tap) -> Result<Vec<u8>, LinkError> {
        self.forget(tap);
        let frame = Frame::standard(address, &can::encode_command(command)).ok_or(LinkError::Refused)?;
        self.asked = Some((address, command));
        tap.frame_out(&frame);
        Ok(format!("{}\r", slcan::line(&frame)).into())
    }

    fn room(&self) -> usize {
        MOST
    }

    /// A frame is the reply if it has the module's identifier and the number of the command; other frames are passed
    /// over.
    fn take(&mut self, bytes: &[u8], tap: &mut dyn Tap) -> Option<Result<Telegram, LinkError>> {
        self.hear(bytes);
        while let Some(line) = self.line() {
            let Line::Done(line) = line else { return Some(Err(LinkError::Refused)) };
            let frame = slcan::parse(&line);
            frame.iter().for_each(|frame| tap.frame_back(frame));
            let frame = frame.filter(|frame| !frame.is_extended() && frame.is_data_frame());
            if let Some(reply) =
                frame.zip(self.asked).and_then(|(frame, (id, command))| reply_in_frame(id, command, frame.data()))
            {
                return Some(Ok(reply));
            }
        }
        None
    }

    fn late(&mut self, bytes: &[u8], _: &mut dyn Tap) {
        self.hear(bytes);
    }

    fn give_up(&mut self) -> LinkError {
        LinkError::NoReply { bytes: 0 }
    }
}

#[cfg(test)]
mod tests {
    use tmcm::tmcl::binary;

    use super::*;
    use crate::wire::Nobody;

    const GAP: Command = Command::new(6, 1, 0, 0);

    #[test]
    fn the_channel_is_open_when_each_line_is_answered() {
        let mut slcan = Slcan::default();
        let answers: [&[u8]; 4] = [b"\r", b"t0028036406000000AA00\r\x07", b"\r", b"\x07"];
        assert!(answers.iter().all(|answer| slcan.answered(answer)));
        assert!(!slcan.answered(b"t002803640600"));
        assert!(!slcan.answered(b"0000AA00\r"));
        assert!(slcan.answered(b"\r"));
    }

    #[test]
    fn the_reply_is_found_among_other_traffic() {
        let mut slcan = Slcan::default();
        assert_eq!(slcan.ask(3, GAP, &mut Nobody).unwrap(), b"t00380601000000000000\r");
        assert!(slcan.take(b"z\rt0028016406000000FF00\rt00280364", &mut Nobody).is_none());
        let reply = slcan.take(b"060000007B00\r", &mut Nobody).unwrap().unwrap();
        let reply = binary::decode_reply(&reply).unwrap();
        assert_eq!((reply.module, reply.status, reply.opcode, reply.value), (3, 100, 6, 0x7B));
    }

    /// Late replies and half a line that came before the request are not taken for its reply.
    #[test]
    fn replies_that_came_before_the_request_are_dropped() {
        let mut slcan = Slcan::default();
        slcan.ask(3, GAP, &mut Nobody).unwrap();
        let late = b"z\rt00280364060000000100\rt00280364060000000200\rt00280364";
        let value =
            |reply: Option<Result<Telegram, LinkError>>| binary::decode_reply(&reply.unwrap().unwrap()).unwrap().value;
        assert_eq!(value(slcan.take(late, &mut Nobody)), 1);
        slcan.late(b"06000000", &mut Nobody);
        slcan.ask(3, GAP, &mut Nobody).unwrap();
        assert_eq!(value(slcan.take(b"z\rt00280364060000000300\r", &mut Nobody)), 3);
    }

    /// Bytes without an end cost no memory, and the reply behind them is found.
    #[test]
    fn what_never_ends_is_dropped() {
        let mut slcan = Slcan::default();
        slcan.ask(3, GAP, &mut Nobody).unwrap();
        for _ in 0..100 {
            assert!(slcan.take(&[b'x'; MOST], &mut Nobody).is_none());
            assert!(slcan.bytes.len() <= 3 * MOST);
        }
        assert!(slcan.take(b"\rt00280364060000007B00\r", &mut Nobody).is_some());
    }

    #[test]
    fn a_refusal_ends_the_wait_at_once() {
        let mut slcan = Slcan::default();
        slcan.ask(3, GAP, &mut Nobody).unwrap();
        assert!(matches!(slcan.take(b"\x07", &mut Nobody), Some(Err(LinkError::Refused))));
        assert!(matches!(slcan.ask(2048, GAP, &mut Nobody), Err(LinkError::Refused)));
    }
}
