//! The nine-byte telegram of RS485, USB and every other byte link (manual sections 3.1, 3.2).
//!
//! TMCL has no start byte: a silence is the only way back into step, so [`Framer`] is told when each byte
//! arrived.

use super::{Command, Reply, Status};
use crate::units::Micros;

/// Length of a request and of a reply, in bytes.
pub const TELEGRAM: usize = 9;

/// A request or reply as it travels on a byte link.
pub type Telegram = [u8; TELEGRAM];

/// The sum of all bytes but the last, in eight bits (manual section 3.1.1).
pub fn checksum(telegram: &Telegram) -> u8 {
    telegram.iter().take(TELEGRAM - 1).fold(0, |sum, byte| sum.wrapping_add(*byte))
}

fn sealed(mut telegram: Telegram) -> Telegram {
    telegram[TELEGRAM - 1] = checksum(&telegram);
    telegram
}

/// A request for the module with `address`.
pub fn encode_command(address: u8, command: Command) -> Telegram {
    let [opcode, kind, motor, a, b, c, d] = command.to_bytes();
    sealed([address, opcode, kind, motor, a, b, c, d, 0])
}

/// A telegram taken apart as a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Addressed {
    /// The address it goes to.
    pub address: u8,
    /// The command that its bytes are.
    pub command: Command,
    /// The checksum is right.
    pub intact: bool,
}

/// Takes a request apart.
pub fn decode(telegram: &Telegram) -> Addressed {
    let [address, opcode, kind, motor, a, b, c, d, sum] = *telegram;
    let command = Command::from_bytes([opcode, kind, motor, a, b, c, d]);
    Addressed { address, command, intact: sum == checksum(telegram) }
}

/// The command in a request, or `None` if its checksum is wrong.
pub fn decode_command(telegram: &Telegram) -> Option<Command> {
    let Addressed { command, intact, .. } = decode(telegram);
    intact.then_some(command)
}

/// A reply from the module with address `module` to the host with address `host`. The special replies:
/// the version string has neither module address nor checksum, program memory has a command in place of
/// module address, status and value.
pub fn encode_reply(host: u8, module: u8, reply: &Reply) -> Telegram {
    match *reply {
        Reply::Plain { status, opcode, value } => {
            let [a, b, c, d] = value.to_be_bytes();
            sealed([host, module, status as u8, opcode, a, b, c, d, 0])
        }
        Reply::Version([a, b, c, d, e, f, g, h]) => [host, a, b, c, d, e, f, g, h],
        Reply::Memory(command) => encode_command(host, command),
    }
}

/// A plain reply as a host sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// Host address.
    pub host: u8,
    /// Module address.
    pub module: u8,
    /// The status byte as sent; [`Status::from_number`] names it.
    pub status: u8,
    /// Number of the command answered.
    pub opcode: u8,
    /// The value.
    pub value: i32,
}

impl Received {
    /// The status, if it is one the protocol knows.
    pub fn status(&self) -> Option<Status> {
        Status::from_number(self.status)
    }
}

/// Takes a plain reply apart; `None` if its checksum is wrong.
pub fn decode_reply(telegram: &Telegram) -> Option<Received> {
    let [host, module, status, opcode, a, b, c, d, sum] = *telegram;
    (sum == checksum(telegram)).then(|| Received {
        host,
        module,
        status,
        opcode,
        value: i32::from_be_bytes([a, b, c, d]),
    })
}

/// Cuts a stream of bytes into telegrams. A byte that comes more than [`Framer::GAP`] after the one before
/// starts a new telegram, and the unfinished one is dropped.
#[derive(Clone, Debug, Default)]
pub struct Framer {
    buffer: Telegram,
    length: usize,
    last: Micros,
}

impl Framer {
    /// Silence after which an unfinished telegram is given up.
    pub const GAP: Micros = Micros::from_millis(5);

    /// An empty framer.
    pub const fn new() -> Self {
        Framer { buffer: [0; TELEGRAM], length: 0, last: Micros(0) }
    }

    /// Takes one byte that arrived at `at`; returns the telegram it completes.
    pub fn push(&mut self, byte: u8, at: Micros) -> Option<Telegram> {
        if at.since(self.last) > Self::GAP {
            self.length = 0;
        }
        self.last = at;
        if let Some(place) = self.buffer.get_mut(self.length) {
            *place = byte;
        }
        self.length = self.length.saturating_add(1);
        (self.length == TELEGRAM).then(|| {
            self.length = 0;
            self.buffer
        })
    }

    /// Forgets an unfinished telegram, as when a link is opened anew.
    pub fn reset(&mut self) {
        self.length = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: fn(u64) -> Micros = Micros;

    #[test]
    fn special_replies_have_their_own_shape() {
        assert_eq!(&encode_reply(2, 1, &Reply::Version(*b"1140V142")), b"\x021140V142");
        let stored = Command::new(4, 0, 0, 90_000);
        assert_eq!(encode_reply(2, 1, &Reply::Memory(stored)), [2, 4, 0, 0, 0, 1, 0x5F, 0x90, 0xF6]);
        assert_eq!(encode_reply(2, 1, &Reply::WRONG_CHECKSUM), [2, 1, 1, 0, 0, 0, 0, 0, 4]);
    }

    #[test]
    fn framer_resynchronises_on_a_gap_only() {
        let telegram = encode_command(1, Command::new(6, 1, 0, 0));
        let mut framer = Framer::new();
        // Three stray bytes, then silence of 5 ms and a bit: the telegram comes through whole.
        for (i, byte) in [0xFF, 0x01, 0x06].iter().enumerate() {
            assert_eq!(framer.push(*byte, AT(i as u64)), None);
        }
        let start = 5_100;
        let got: Vec<_> =
            telegram.iter().enumerate().filter_map(|(i, b)| framer.push(*b, AT(start + 1_040 * i as u64))).collect();
        assert_eq!(got, [telegram]);
        // A pause of exactly 5 ms inside a telegram is still the same telegram.
        let got: Vec<_> =
            telegram.iter().enumerate().filter_map(|(i, b)| framer.push(*b, AT(20_000 + 5_000 * i as u64))).collect();
        assert_eq!(got, [telegram]);
    }
}
