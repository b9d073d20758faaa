//! Frames, and how the registers of a mailbox hold them (RM0090 32.9.3).

use crate::mcu::peripheral::{bit, field};

/// Bits of a data frame besides its data, and of the pause after it: with a short and with a long identifier.
const BITS: [u64; 2] = [47, 67];

/// A frame on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CanFrame {
    /// Identifier, 11 or 29 bits.
    pub id: u32,
    /// Whether it has 29 bits.
    pub extended: bool,
    /// Whether it is a remote request.
    pub remote: bool,
    /// How many bytes of data it has, 0..=8.
    pub length: u8,
    /// The data; zero beyond the length.
    pub data: [u8; 8],
}

impl CanFrame {
    pub(super) fn bits(&self) -> u64 {
        let data = if self.remote { 0 } else { 8 * u64::from(self.length) };
        BITS[usize::from(self.extended)] + data
    }

    /// Ranks the frame: of two that begin at the same time, the one with the lower rank wins.
    pub(super) fn rank(&self) -> u32 {
        let base = if self.extended { self.id } else { self.id << 18 };
        base << 1 | u32::from(self.extended)
    }

    /// The identifier register of a mailbox.
    pub(super) fn identifier(&self) -> u32 {
        let id = if self.extended { self.id << 3 | 4 } else { self.id << 21 };
        id | u32::from(self.remote) << 1
    }

    pub(super) fn words(&self) -> [u32; 2] {
        let (low, high) = self.data.split_at(4);
        [low, high].map(|half| half.iter().rev().fold(0, |word, &byte| word << 8 | u32::from(byte)))
    }
}

/// The registers of a transmit mailbox: TIxR, TDTxR, TDLxR, TDHxR.
pub(super) type Mailbox = [u32; 4];

/// The frame that a mailbox asks to send.
pub(super) fn frame(mailbox: &Mailbox) -> CanFrame {
    let [identifier, length, low, high] = *mailbox;
    let extended = bit(identifier, 2);
    let remote = bit(identifier, 1);
    let length = field(length, 0, 4).min(8) as u8;
    let mut data = [0; 8];
    let all = low.to_le_bytes().into_iter().chain(high.to_le_bytes());
    for (to, byte) in data.iter_mut().zip(all).take(if remote { 0 } else { length.into() }) {
        *to = byte;
    }
    CanFrame { id: if extended { identifier >> 3 } else { identifier >> 21 }, extended, remote, length, data }
}
