//! Chip selects, and what the chips want of the clock behind them: whoever is faster is refused.

use super::peripheral::Cycles;
use super::spi::Word;
use super::timebase::Timebase;
use crate::board::{Chip, TMC429_CLOCK_HZ};
use crate::clock::{Nanos, SECOND};

/// The shortest times that a chip understands.
struct Limits {
    /// A bit.
    bit: Nanos,
    /// From its select to the first bit, and from the end of one datagram to the select of the next.
    select: Nanos,
}

/// Clocks of the TMC429.
const fn clocks(number: Nanos) -> Nanos {
    number * SECOND / TMC429_CLOCK_HZ as Nanos
}

impl Limits {
    /// The TMC429 wants eight of its clocks a bit and three around its select (its datasheet, section 6.2.1). The TMC262
    /// takes 4 MHz, the AT25128 5 MHz, and both want no more than 100 ns. The TMC5160 with its external clock takes 8 MHz,
    /// and two periods of that clock and 10 ns between datagrams (4.3).
    const fn of(chip: Chip) -> Self {
        match chip {
            Chip::Tmc429(_) => Self { bit: clocks(8), select: clocks(3) },
            Chip::Tmc262(_) => Self { bit: 250, select: 100 },
            Chip::Tmc5160(_) => Self { bit: 125, select: clocks(2) + 10 },
            Chip::At25 => Self { bit: 200, select: 100 },
        }
    }
}

/// The chip select of a chip.
#[derive(Debug)]
pub(super) struct Select {
    chip: Chip,
    low: bool,
    /// When that changed.
    since: Cycles,
}

impl Select {
    pub(super) const fn new(chip: Chip) -> Self {
        Self { chip, low: false, since: 0 }
    }

    pub(super) const fn chip(&self) -> Chip {
        self.chip
    }

    pub(super) const fn is_low(&self) -> bool {
        self.low
    }

    /// Changes it.
    pub(super) fn set(&mut self, low: bool, now: Cycles, time: &Timebase) -> Result<(), &'static str> {
        let soon = low && now - self.since < time.span(Limits::of(self.chip).select);
        (self.low, self.since) = (low, now);
        if soon { Err("a chip is selected too soon after its last datagram") } else { Ok(()) }
    }

    /// Whether a word can be understood.
    pub(super) fn check(&self, word: Word, time: &Timebase) -> Result<(), &'static str> {
        let limits = Limits::of(self.chip);
        if word.bit < time.span(limits.bit) {
            Err("the SPI clock is faster than the chip on this bus takes")
        } else if word.start() < self.since + time.span(limits.select) {
            Err("the first bit comes too soon after the chip's select")
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 168 MHz: 84 cycles a bit are 500 ns, eight clocks of 16 MHz; three of them are 31.5 cycles.
    #[test]
    fn the_tmc429_refuses_what_is_faster_than_its_datasheet() {
        let time = Timebase::new(168_000_000, 0, 0);
        let mut select = Select::new(Chip::Tmc429(0));
        select.set(true, 1_000, &time).unwrap();
        let word = |bit, start| Word { mosi: 0, wide: false, bit, at: start + 8 * bit };
        assert!(select.check(word(83, 2_000), &time).is_err());
        assert!(select.check(word(84, 1_031), &time).is_err());
        assert_eq!(select.check(word(84, 1_032), &time), Ok(()));
        select.set(false, 3_000, &time).unwrap();
        assert!(select.set(true, 3_031, &time).is_err());
        select.set(false, 4_000, &time).unwrap();
        assert_eq!(select.set(true, 4_032, &time), Ok(()));
    }
}
