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
    let [a, b, c, d, e, f, g, h, _] = *telegram;
    sum(u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]))
}

/// The sum of the eight bytes of two words. Every other byte of a word has room for the carry of the byte before it, so
/// that four sums are made at a time.
#[inline(always)]
fn sum(head: u32, value: u32) -> u8 {
    let halves = |word: u32| (word & 0x00FF_00FF).wrapping_add(word >> 8 & 0x00FF_00FF);
    let sums = halves(head).wrapping_add(halves(value));
    sums.wrapping_add(sums >> 16) as u8
}

/// The telegram of two words, the first of which begins with the address, with its checksum. It is written word by
/// word, because time is short before a reply.
#[inline(always)]
fn telegram(head: u32, value: u32) -> Telegram {
    let mut telegram = [0; TELEGRAM];
    if let ([first, second], [last]) = telegram.as_chunks_mut() {
        (*first, *second, *last) = (head.to_le_bytes(), value.to_le_bytes(), sum(head, value));
    }
    telegram
}

/// The request that carries `command` to the module with `address`.
pub fn encode_command(address: u8, command: Command) -> Telegram {
    let Command { opcode, kind, motor, value } = command;
    telegram(u32::from_le_bytes([address, opcode, kind, motor]), value.cast_unsigned().swap_bytes())
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
    let [address, opcode, kind, motor, a, b, c, d, last] = *telegram;
    let command = Command::from_bytes([opcode, kind, motor, a, b, c, d]);
    Addressed { address, command, intact: last == checksum(telegram) }
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
        Reply::Plain { status, opcode, value } => encode_plain(host, module, status, opcode, value),
        Reply::Version([a, b, c, d, e, f, g, h]) => [host, a, b, c, d, e, f, g, h],
        Reply::Memory(command) => encode_command(host, command),
    }
}

/// The telegram of a [`Reply::Plain`].
#[inline(always)]
pub fn encode_plain(host: u8, module: u8, status: Status, opcode: u8, value: i32) -> Telegram {
    telegram(u32::from_le_bytes([host, module, status as u8, opcode]), value.cast_unsigned().swap_bytes())
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
///
/// The bytes go through a register of two words, and their sum is made on the way: when the last one comes, nothing is
/// left to be done.
#[derive(Clone, Debug, Default)]
pub struct Framer {
    last: Micros,
    length: u8,
    /// The sum of the bytes but the last.
    sum: u8,
    /// The last byte.
    check: u8,
    /// The four bytes before `value`, the first in the lowest place.
    head: u32,
    /// The four bytes before the last, the first in the lowest place.
    value: u32,
}

impl Framer {
    /// Longest pause between two bytes of the same telegram.
    pub const GAP: Micros = Micros::from_millis(5);

    /// A framer that has received nothing.
    pub const fn new() -> Self {
        Framer { last: Micros(0), length: 0, sum: 0, check: 0, head: 0, value: 0 }
    }

    /// Takes one byte that arrived at the time `at`. True if it completes a telegram, which stays in the framer until
    /// the next byte.
    #[inline(always)]
    pub fn push(&mut self, byte: u8, at: Micros) -> bool {
        if at.0.wrapping_sub(self.last.0) > Self::GAP.0 || self.length >= TELEGRAM as u8 {
            self.reset();
        }
        self.last = at;
        self.head = self.head >> 8 | self.value << 24;
        self.value = self.value >> 8 | u32::from(self.check) << 24;
        self.sum = self.sum.wrapping_add(self.check);
        self.check = byte;
        self.length = self.length.saturating_add(1);
        self.length == TELEGRAM as u8
    }

    /// The number of the command in a telegram that is complete.
    #[inline(always)]
    pub const fn opcode(&self) -> u8 {
        (self.head >> 8) as u8
    }

    /// A complete telegram, taken apart as [`decode`] does.
    #[inline(always)]
    pub const fn decode(&self) -> Addressed {
        let command = Command {
            opcode: self.opcode(),
            kind: (self.head >> 16) as u8,
            motor: (self.head >> 24) as u8,
            value: self.value.swap_bytes().cast_signed(),
        };
        Addressed { address: self.head as u8, command, intact: self.check == self.sum }
    }

    /// Drops the first byte of a complete telegram, which becomes an unfinished one.
    pub const fn drop_first(&mut self) {
        self.sum = self.sum.wrapping_sub(self.head as u8);
        self.length = self.length.saturating_sub(1);
    }

    /// Drops an unfinished telegram, as is due when a link is opened anew.
    #[inline(always)]
    pub const fn reset(&mut self) {
        (self.length, self.sum, self.check) = (0, 0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: fn(u64) -> Micros = Micros;

    #[test]
    fn special_replies_have_their_own_shape() {
        assert_eq!(&encode_reply(2, 1, &Reply::Version(*b"1234V142")), b"\x021234V142");
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
            assert!(!framer.push(*byte, AT(i as u64)));
        }
        // Pauses of exactly 5 ms do not end a telegram.
        for (start, pause) in [(5_100, 1_040), (20_000, 5_000)] {
            let complete = |(i, byte): (usize, &u8)| framer.push(*byte, AT(start + pause * i as u64));
            let ends: Vec<_> = telegram.iter().enumerate().map(complete).collect();
            assert_eq!(ends, [[false; 8].as_slice(), &[true]].concat());
            assert_eq!(framer.decode(), decode(&telegram));
        }
    }

    #[test]
    fn framer_adds_up_what_it_takes() {
        let mut framer = Framer::new();
        for value in [-1, 0x1234_5678, i32::MIN] {
            for wrong in 0..TELEGRAM {
                let mut telegram = encode_command(0xFF, Command::new(0xFE, 0xFD, 0xFC, value));
                telegram[wrong] ^= 0x80;
                assert!(telegram.iter().filter(|byte| framer.push(**byte, AT(0))).count() == 1);
                assert_eq!((framer.decode(), framer.opcode()), (decode(&telegram), telegram[1]));
                assert!(!framer.decode().intact);
            }
        }
        let telegram = encode_command(1, Command::new(6, 1, 0, 0));
        assert!([&[10], &telegram[..8]].concat().iter().filter(|byte| framer.push(**byte, AT(0))).count() == 1);
        framer.drop_first();
        assert!(framer.push(telegram[8], AT(0)));
        assert_eq!(framer.decode(), decode(&telegram));
        assert!(framer.decode().intact);
    }
}
