//! Requests of a host over a byte link of a module that runs its image, and what has come back. The module cannot be
//! asked whether it will answer, so this is told from the bytes. A request waits until as many replies have come, or
//! until the module has been silent for too long.

use std::collections::VecDeque;

use hal_sim::clock::{MILLISECOND, Nanos};
use tmcm::tmcl::binary::{TELEGRAM, Telegram};

use crate::pieces::is_line;
use crate::wire::answering::{is_event, is_silent_telegram};

/// Longest silence of the module, in virtual time, after which a reply is expected no more. Only while its EEPROM works
/// it may take longer.
pub(super) const SILENCE: Nanos = 50 * MILLISECOND;

/// Status of the event of command 138, in text.
const EVENT: &[u8] = b"128 ";

/// A request on a byte link, and the reply to it.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Answer {
    pub(super) request: Vec<u8>,
    pub(super) reply: Vec<u8>,
}

/// The requests on a byte link that wait for replies.
#[derive(Debug, Default)]
pub(super) struct Asked {
    /// Whole telegrams and lines, oldest first.
    open: VecDeque<Vec<u8>>,
    /// The bytes that have come back of a telegram or line that is not whole yet.
    part: Vec<u8>,
    /// Until when a reply is expected.
    until: Nanos,
}

impl Asked {
    /// The last of these bytes of the host, a telegram, a line or a part of one, is on the link at the time `at`.
    pub(super) fn ask(&mut self, bytes: &[u8], at: Nanos) {
        self.give_up(at);
        if is_answered(bytes) {
            self.open.push_back(bytes.to_vec());
        }
        self.until = self.until.max(at + SILENCE);
    }

    /// Bytes have come back, from the module or from another one that has answered in its place. The replies that end
    /// with them, each with its request, or with none if nobody has asked.
    pub(super) fn hear(&mut self, bytes: &[u8], at: Nanos) -> Vec<Answer> {
        self.give_up(at);
        self.until = self.until.max(at + SILENCE);
        self.part.extend(bytes);
        std::iter::from_fn(|| self.take()).flatten().collect()
    }

    /// The module works for the host, as is seen from outside, until the time `at`.
    pub(super) fn works(&mut self, at: Nanos) {
        if !self.open.is_empty() {
            self.until = self.until.max(at + SILENCE);
        }
    }

    /// True while a reply is expected at the time `at`.
    pub(super) fn waits(&self, at: Nanos) -> bool {
        !self.open.is_empty() && at < self.until
    }

    /// After a long silence nothing that was before matters.
    fn give_up(&mut self, at: Nanos) {
        if at >= self.until {
            self.open.clear();
            self.part.clear();
        }
    }

    /// Takes the next whole telegram or line from what has come back; gives it with its request if it is a reply.
    fn take(&mut self) -> Option<Option<Answer>> {
        let in_text = self.open.front().is_some_and(|request| is_line(request));
        let end = if in_text { self.part.iter().position(|byte| *byte == b'\r')? + 1 } else { TELEGRAM };
        if self.part.len() < end {
            return None;
        }
        let whole: Vec<u8> = self.part.drain(..end).collect();
        let is_reply = match *whole {
            _ if in_text => is_text_reply(&whole),
            [_, _, status, opcode, ..] => !is_event(status, opcode),
            _ => true,
        };
        Some(is_reply.then(|| Answer { request: self.open.pop_front().unwrap_or_default(), reply: whole }))
    }
}

/// True for a whole telegram or line that may be answered.
pub(super) fn is_answered(bytes: &[u8]) -> bool {
    match <&Telegram>::try_from(bytes) {
        Ok(telegram) if !is_line(bytes) => !is_silent_telegram(telegram),
        _ => is_line(bytes) && bytes.len() > 1,
    }
}

/// True for the reply to a line, such as `BA 100 0`. A line that is echoed has the name of a command behind the
/// address, and an event has a status of its own.
fn is_text_reply(line: &[u8]) -> bool {
    matches!(line.trim_ascii_start(), [_, _, b' ', rest @ ..] if !rest.starts_with(EVENT))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tmcm::tmcl::binary::{encode_command, encode_plain};
    use tmcm::tmcl::{Command, Status};

    fn telegram(opcode: u8, value: i32) -> Telegram {
        encode_command(1, Command::new(opcode, 0, 0, value))
    }

    fn reply(status: Status, opcode: u8) -> Telegram {
        encode_plain(2, 1, status, opcode, 0)
    }

    #[test]
    fn a_request_waits_for_its_reply() {
        let mut asked = Asked::default();
        asked.ask(&telegram(6, 0), 0);
        asked.ask(&telegram(6, 1), 0);
        let answer = Answer { request: telegram(6, 0).to_vec(), reply: reply(Status::Ok, 6).to_vec() };
        assert_eq!(asked.hear(&reply(Status::Ok, 6), 5), [answer]);
        assert!(asked.waits(5));
        // An event is no reply, and half a reply is none yet.
        assert_eq!(asked.hear(&reply(Status::PositionReached, 138), 6).len(), 0);
        assert_eq!(asked.hear(&reply(Status::Ok, 6)[..4], 7).len(), 0);
        assert!(asked.waits(7));
        assert_eq!(asked.hear(&reply(Status::Ok, 6)[4..], 8).len(), 1);
        assert!(!asked.waits(8));
    }

    #[test]
    fn a_silence_ends_the_wait_unless_the_module_works() {
        let mut asked = Asked::default();
        asked.ask(&telegram(7, 0), 10);
        assert!(asked.waits(10 + SILENCE - 1) && !asked.waits(10 + SILENCE));
        asked.works(SILENCE);
        assert!(asked.waits(2 * SILENCE - 1) && !asked.waits(2 * SILENCE));
        // The part of a reply that came before is not one of the next.
        asked.hear(&[1, 2, 3], SILENCE);
        asked.ask(&telegram(6, 0), 3 * SILENCE);
        assert_eq!(asked.hear(&reply(Status::Ok, 6), 3 * SILENCE).len(), 1);
        assert!(!asked.waits(3 * SILENCE));
    }

    #[test]
    fn what_gets_no_reply_does_not_wait() {
        for bytes in [&telegram(137, 1234)[..], b"\r", &[1, 2, 3], b"AGAP"] {
            let mut asked = Asked::default();
            asked.ask(bytes, 0);
            assert!(!asked.waits(0), "{bytes:?}");
        }
        let mut asked = Asked::default();
        asked.ask(&telegram(137, 0), 0);
        assert!(asked.waits(0), "it is refused");
    }

    #[test]
    fn the_echo_of_a_line_is_no_reply() {
        let mut asked = Asked::default();
        asked.ask(b"AMVP ABS, 0, 100\r", 0);
        assert_eq!(asked.hear(b"AMVP ABS, 0, 100\r", 0).len(), 0);
        assert_eq!(asked.hear(b"BA 128 1\r", 0).len(), 0);
        assert!(asked.waits(0));
        assert_eq!(asked.hear(b"BA 100 100\r", 0).len(), 1);
        assert!(!asked.waits(0));
    }
}
