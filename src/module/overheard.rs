//! Replies to other modules, as a module hears them that has the very address they go to: the host's
//! (parameter 76 on RS485, 70 on CAN).
//!
//! Nothing in a reply says that it is none of the requests it looks like, so the module keeps track of what others
//! are asked: what fits as a reply to that is one.

use crate::tmcl::{Command, Opcode, Status};
use crate::units::Micros;

/// How long a reply may keep the bus waiting: the longest telegram pause, some EEPROM pages, and the wire.
const PATIENCE: Micros = Micros::from_millis(400);

/// The last request to another module.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Overheard {
    request: Option<(Micros, Command)>,
}

impl Overheard {
    /// Another module has been asked this; with a wrong checksum, nothing that can be read.
    pub(super) fn asked(&mut self, now: Micros, command: Option<Command>) {
        // That is answered as command 0.
        self.request = Some((now, command.unwrap_or(Command::new(0, 0, 0, 0))));
    }

    /// Whether the seven bytes that came to the host's address are another module's reply - identifier or address,
    /// status, command number and value - or its event of command 138. If not, they are a request. Either way
    /// the host has its reply or waits no more.
    pub(super) fn is_reply(&mut self, now: Micros, content: [u8; Command::SIZE]) -> bool {
        let [_, status, opcode, ..] = content;
        let status = Status::from_number(status);
        if status == Some(Status::PositionReached) && opcode == Opcode::PositionReachedEvent as u8 {
            return true;
        }
        let Some((at, asked)) = self.request.take() else { return false };
        let fits = match Opcode::from_number(asked.opcode) {
            // A stored command.
            Some(Opcode::ReadMemory) => true,
            Some(Opcode::FirmwareVersion) if asked.kind == 0 => content.iter().all(u8::is_ascii_graphic),
            _ => status.is_some() && opcode == asked.opcode,
        };
        fits && now.since(at) <= PATIENCE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: fn(u64) -> Micros = Micros::from_millis;
    const GAP: Command = Command::new(6, 1, 0, 0);
    const REPLY: [u8; 7] = [3, 100, 6, 0, 0, 0, 9];
    const REQUEST: [u8; 7] = [6, 100, 0, 0, 0, 0, 0];

    #[test]
    fn a_reply_fits_the_request_before_it() {
        let mut overheard = Overheard::default();
        assert!(!overheard.is_reply(AT(0), REPLY));
        overheard.asked(AT(10), Some(GAP));
        assert!(overheard.is_reply(AT(11), REPLY));
        assert!(!overheard.is_reply(AT(12), REPLY), "the host has its reply");
        overheard.asked(AT(13), Some(GAP));
        assert!(!overheard.is_reply(AT(14), REQUEST));
        assert!(!overheard.is_reply(AT(15), REPLY), "the host waits no more");
        overheard.asked(AT(20), Some(GAP));
        assert!(!overheard.is_reply(AT(421), REPLY), "nobody waits that long");
    }

    #[test]
    fn special_replies_and_events_are_known() {
        let mut overheard = Overheard::default();
        assert!(overheard.is_reply(AT(0), [3, 128, 138, 0, 0, 0, 1]));
        overheard.asked(AT(1), Some(Command::new(136, 0, 0, 0)));
        assert!(overheard.is_reply(AT(2), *b"1140V14"));
        overheard.asked(AT(3), Some(Command::new(136, 0, 0, 0)));
        assert!(!overheard.is_reply(AT(4), [136, 0, 0, 0, 0, 0, 0]), "it scans the bus");
        overheard.asked(AT(5), Some(Command::new(134, 0, 0, 0)));
        assert!(overheard.is_reply(AT(6), [3, 0, 0, 0, 0, 0, 0]));
        overheard.asked(AT(7), None);
        assert!(overheard.is_reply(AT(8), [3, 1, 0, 0, 0, 0, 0]));
    }
}
