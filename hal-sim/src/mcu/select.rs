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
    /// From its select to the first bit.
    first: Nanos,
    /// From the end of one datagram to the select of the next.
    pause: Nanos,
}

/// Clocks of a motion controller that has its clock from the microcontroller.
const fn clocks(number: Nanos) -> Nanos {
    number * SECOND / TMC429_CLOCK_HZ as Nanos
}

/// Clocks of a TMC5160 that runs on its own oscillator, which may be as slow as this.
const fn own_clocks(number: Nanos) -> Nanos {
    number * SECOND / 8_000_000
}

impl Limits {
    /// The TMC429 wants eight of its clocks a bit and three around its select (its datasheet, section 6.2.1). The
    /// TMC262 takes 4 MHz, the AT25128 5 MHz, and both want no more than 100 ns. The TMC5160 wants two of its clocks a
    /// bit, which are 8 MHz, or 4 MHz on its own oscillator. It wants two of them and 10 ns between datagrams, and 10
    /// ns before the first bit (its datasheet, section 4.3). `clocked` says whether the motion chips have a clock from
    /// the microcontroller.
    const fn of(chip: Chip, clocked: bool) -> Self {
        match chip {
            Chip::Tmc429(_) => Self { bit: clocks(8), first: clocks(3), pause: clocks(3) },
            Chip::Tmc262(_) => Self { bit: 250, first: 100, pause: 100 },
            Chip::Tmc5160(_) => {
                let two = if clocked { clocks(2) } else { own_clocks(2) };
                Self { bit: two, first: 10, pause: two + 10 }
            }
            Chip::At25 => Self { bit: 200, first: 100, pause: 100 },
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
    pub(super) fn set(&mut self, low: bool, clocked: bool, now: Cycles, time: &Timebase) -> Result<(), &'static str> {
        let soon = low && now - self.since < time.span(Limits::of(self.chip, clocked).pause);
        (self.low, self.since) = (low, now);
        if soon { Err("a chip is selected too soon after its last datagram") } else { Ok(()) }
    }

    /// Whether a word can be understood.
    pub(super) fn check(&self, word: Word, clocked: bool, time: &Timebase) -> Result<(), &'static str> {
        let limits = Limits::of(self.chip, clocked);
        if word.bit < time.span(limits.bit) {
            Err("the SPI clock is faster than the chip on this bus takes")
        } else if word.start() < self.since + time.span(limits.first) {
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
        select.set(true, true, 1_000, &time).unwrap();
        let word = |bit, start| Word { mosi: 0, wide: false, bit, at: start + 8 * bit };
        assert!(select.check(word(83, 2_000), true, &time).is_err());
        assert!(select.check(word(84, 1_031), true, &time).is_err());
        assert_eq!(select.check(word(84, 1_032), true, &time), Ok(()));
        select.set(false, true, 3_000, &time).unwrap();
        assert!(select.set(true, true, 3_031, &time).is_err());
        select.set(false, true, 4_000, &time).unwrap();
        assert_eq!(select.set(true, true, 4_032, &time), Ok(()));
    }

    /// At 168 MHz: 21 cycles a bit are 125 ns, 8 MHz, and 42 cycles are 250 ns, 4 MHz. With 10 ns more they are 22.7
    /// and 43.7 cycles; 10 ns alone are 1.7.
    #[test]
    fn the_tmc5160_takes_half_the_speed_on_its_own_oscillator() {
        let time = Timebase::new(168_000_000, 0, 0);
        let word = |bit, start| Word { mosi: 0, wide: false, bit, at: start + 8 * bit };
        for (clocked, bit, pause) in [(true, 21, 23), (false, 42, 44)] {
            let mut select = Select::new(Chip::Tmc5160(0));
            select.set(true, clocked, 1_000, &time).unwrap();
            assert!(select.check(word(bit - 1, 2_000), clocked, &time).is_err());
            assert!(select.check(word(bit, 1_001), clocked, &time).is_err());
            assert_eq!(select.check(word(bit, 1_002), clocked, &time), Ok(()));
            select.set(false, clocked, 3_000, &time).unwrap();
            assert!(select.set(true, clocked, 3_000 + pause - 1, &time).is_err());
            select.set(false, clocked, 4_000, &time).unwrap();
            assert_eq!(select.set(true, clocked, 4_000 + pause, &time), Ok(()));
        }
    }
}
