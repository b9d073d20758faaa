//! EXTI: interrupts from edges on pins (RM0090 12.3). Lines 16 and up, from inside the chip, are not connected.

use super::peripheral::{Access, Peripheral, Refusal};

const IMR: u32 = 0x00;
const EMR: u32 = 0x04;
const RTSR: u32 = 0x08;
const FTSR: u32 = 0x0C;
const SWIER: u32 = 0x10;
const PR: u32 = 0x14;

const LINES: u32 = 0x7F_FFFF;
/// The lines of each interrupt, in the order of the interrupts.
const INTERRUPTS: [u32; 7] = [1, 2, 4, 8, 0x10, 0x3E0, 0xFC00];

/// The external interrupt controller.
#[derive(Debug, Default)]
pub(super) struct Exti {
    imr: u32,
    rtsr: u32,
    ftsr: u32,
    pr: u32,
    /// Levels of the 16 pins looked at.
    levels: u32,
}

impl Exti {
    /// Lines of which an edge would be noticed.
    pub(super) fn watched(&self) -> u32 {
        (self.rtsr | self.ftsr) & 0xFFFF
    }

    /// The levels of the pins looked at, one bit a line.
    pub(super) fn set_levels(&mut self, levels: u32) {
        let (risen, fallen) = (levels & !self.levels, self.levels & !levels);
        self.pr |= risen & self.rtsr | fallen & self.ftsr;
        self.levels = levels;
    }
}

impl Peripheral for Exti {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            IMR => Ok(self.imr),
            EMR | SWIER => Ok(0),
            RTSR => Ok(self.rtsr),
            FTSR => Ok(self.ftsr),
            PR => Ok(self.pr),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        let value = value & LINES;
        match offset {
            IMR => self.imr = value,
            EMR if value == 0 => {}
            EMR => return Err(Refusal::Use("events instead of interrupts are not modelled")),
            RTSR => self.rtsr = value,
            FTSR => self.ftsr = value,
            SWIER => self.pr |= value & self.imr,
            PR => self.pr &= !value,
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn interrupts(&self) -> u32 {
        let pending = self.pr & self.imr;
        INTERRUPTS.iter().rev().fold(0, |lines, &mask| lines << 1 | u32::from(pending & mask != 0))
    }

    fn reset(&mut self) {
        // The levels are the pins' own.
        *self = Self { levels: self.levels, ..Self::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_that_is_looked_for_raises_its_interrupt() {
        let mut exti = Exti::default();
        exti.write(RTSR, 1 << 7).unwrap();
        exti.write(IMR, 1 << 7).unwrap();
        exti.set_levels(1 << 7 | 1 << 2);
        assert_eq!((exti.read(PR), exti.interrupts()), (Ok(1 << 7), 1 << 5));
        exti.write(PR, 1 << 7).unwrap();
        exti.set_levels(0);
        assert_eq!((exti.read(PR), exti.interrupts()), (Ok(0), 0));
    }
}
