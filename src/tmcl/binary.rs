//! The nine-byte telegram of RS485, USB and every other byte link (manual sections 3.1, 3.2).
//!
//! A telegram has no start byte. Only a pause shows where the next telegram begins after a byte was lost, so
//! [`Framer`] takes each byte with the time of its arrival.

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

/// The telegram with its checksum filled in.
fn sealed(mut telegram: Telegram) -> Telegram {
    telegram[TELEGRAM - 1] = checksum(&telegram);
    telegram
}

/// The request that carries `command` to the module with `address`.
pub fn encode_command(address: u8, command: Command) -> Telegram {
    let [opcode, kind, motor, a, b, c, d] = command.to_bytes();
    sealed([address, opcode, kind, motor, a, b, c, d, 0])
}

/// The parts of a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Addressed {
    /// Address of the module that the request is for.
    pub address: u8,
    /// The command in bytes 1 to 7.
    pub command: Command,
    /// True if the checksum is right.
    pub intact: bool,
}

/// Takes a telegram apart as a request, whether its checksum is right or not.
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

/// The telegram of a reply from the module with address `module` to the host with address `host`. A
/// [`Reply::Version`] has neither module address nor checksum; a [`Reply::Memory`] has no module address and no status.
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

/// A plain reply as a host receives it.
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
    /// The status; `None` if the protocol has no status with this number.
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

/// Cuts a stream of bytes into telegrams. A byte that comes more than [`Framer::GAP`] after the previous byte begins a
/// new telegram; an unfinished telegram is dropped.
#[derive(Clone, Debug, Default)]
pub struct Framer {
    buffer: Telegram,
    length: usize,
    last: Micros,
}

impl Framer {
    /// Longest pause between two bytes of the same telegram.
    pub const GAP: Micros = Micros::from_millis(5);

    /// A framer that has received nothing.
    pub const fn new() -> Self {
        Framer { buffer: [0; TELEGRAM], length: 0, last: Micros(0) }
    }

    /// Takes one byte that arrived at the time `at`; returns the telegram if the byte completes one.
    pub fn push(&mut self, byte: u8, at: Micros) -> Option<Telegram> {
        if at.since(self.last) > Self::GAP {
            self.length = 0;
        }
        self.last = at;
        if let Some(slot) = self.buffer.get_mut(self.length) {
            *slot = byte;
        }
        self.length = self.length.saturating_add(1);
        (self.length == TELEGRAM).then(|| {
            self.length = 0;
            self.buffer
        })
    }

    /// Drops an unfinished telegram, as is due when a link is opened anew.
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
        // Three stray bytes, then a pause of 5.1 ms: the telegram that follows is complete.
        for (i, byte) in [0xFF, 0x01, 0x06].iter().enumerate() {
            assert_eq!(framer.push(*byte, AT(i as u64)), None);
        }
        let start = 5_100;
        let got: Vec<_> =
            telegram.iter().enumerate().filter_map(|(i, b)| framer.push(*b, AT(start + 1_040 * i as u64))).collect();
        assert_eq!(got, [telegram]);
        // Pauses of exactly 5 ms do not end a telegram.
        let got: Vec<_> =
            telegram.iter().enumerate().filter_map(|(i, b)| framer.push(*b, AT(20_000 + 5_000 * i as u64))).collect();
        assert_eq!(got, [telegram]);
    }
}
