//! The SPI port: a shift register of 40 bits, and what it does not understand (4).

use crate::clock::{Nanos, SECOND};

/// Bits of a datagram.
const BITS: u32 = 40;
const MASK: u64 = (1 << BITS) - 1;
/// SCK is valid before and after a change of CSN, tCC, in nanoseconds.
const SETTLED: Nanos = 10;

/// Why a datagram was not taken. The chip itself would take something else, or nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The clock of the datagram was faster than 4 MHz, or 8 MHz where the chip has an external clock.
    Clock,
    /// Chip select was high before it for less than two periods of the chip's clock and 10 ns.
    Select,
}

/// The port. What it sends was latched at the end of the last access.
#[derive(Debug, Default)]
pub(super) struct Port {
    shift: u64,
    bits: u32,
    /// The next 40 bits to be sent.
    reply: u64,
    selected: Nanos,
    deselected: Option<Nanos>,
    soon: bool,
    refused: Option<Refusal>,
}

/// The speeds of the port.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    /// The highest frequency of SCK in Hz.
    pub(super) clock: u64,
    /// The shortest time for which CSN is high.
    pub(super) high: Nanos,
}

impl Limits {
    /// As of a chip with an external clock of `hz`, or with its internal one.
    pub(super) fn of(external: bool, hz: u32) -> Self {
        let clock = if external { u64::from(hz) / 2 } else { 4_000_000 };
        Self { clock, high: 2 * SECOND / u64::from(hz).max(1) + SETTLED }
    }
}

impl Port {
    pub(super) fn select(&mut self, now: Nanos, limits: Limits) {
        self.shift = self.reply;
        self.bits = 0;
        self.soon = self.deselected.is_some_and(|before| now - before < limits.high);
        self.selected = now;
    }

    pub(super) fn byte(&mut self, mosi: u8) -> u8 {
        let miso = (self.shift >> (BITS - 8)) as u8;
        self.shift = (self.shift << 8 | u64::from(mosi)) & MASK;
        self.bits = self.bits.saturating_add(8);
        miso
    }

    /// CSN rises. Gives address and data of a datagram: the last 40 bits; fewer are none.
    pub(super) fn deselect(&mut self, now: Nanos, limits: Limits) -> Option<(u8, u32)> {
        self.deselected = Some(now);
        let wire = u64::from(self.bits) * SECOND / limits.clock.max(1) + 2 * SETTLED;
        let refusal = if self.soon {
            Some(Refusal::Select)
        } else if now - self.selected < wire {
            Some(Refusal::Clock)
        } else {
            None
        };
        if refusal.is_some() {
            self.refused = refusal;
            return None;
        }
        (self.bits >= BITS).then_some(((self.shift >> 32) as u8, self.shift as u32))
    }

    /// Latches what the next access sends.
    pub(super) fn answer(&mut self, status: u8, data: u32) {
        self.reply = u64::from(status) << 32 | u64::from(data);
    }

    pub(super) fn refused(&self) -> Option<Refusal> {
        self.refused
    }
}
