//! Asynchronous characters on a line.

use crate::clock::{Nanos, SECOND};

/// A character that the module has sent, as a host's receiver at the end of the cable would time it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Character {
    /// When its start bit began.
    pub start: Nanos,
    /// When its stop bit ended.
    pub end: Nanos,
    /// The eight bits of the character.
    pub value: u8,
    /// Whether the transceiver was sending from start to end; else the bus has not seen it whole.
    pub driven: bool,
}

/// A character on its way to the module.
#[derive(Clone, Copy, Debug)]
pub(super) struct Incoming {
    /// When its start bit begins.
    pub(super) start: Nanos,
    /// The bits of the character from the start bit on, the first lowest; after them the line is high.
    pub(super) levels: u128,
    /// How many there are.
    pub(super) bits: u32,
    /// Bits a second.
    pub(super) baud: u32,
}

/// Bits of a character: start bit, eight data bits, stop bit.
const BITS: u32 = 10;

impl Incoming {
    /// A byte with its start and stop bit.
    pub(super) fn byte(start: Nanos, value: u8, baud: u32) -> Self {
        Self { start, levels: u128::from(value) << 1 | 1 << 9, bits: BITS, baud }
    }

    /// When its last bit ends.
    pub(super) fn end(&self) -> Nanos {
        self.start + u64::from(self.bits) * SECOND / u64::from(self.baud.max(1))
    }
}
