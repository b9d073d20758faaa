//! SYSCFG: which port each external interrupt line looks at (RM0090 9.2).

use super::peripheral::{Access, Peripheral, Refusal, field};

const MEMRMP: u32 = 0x00;
const EXTICR: core::ops::RangeInclusive<u32> = 0x08..=0x14;

/// The system configuration controller.
#[derive(Debug, Default)]
pub(super) struct Syscfg {
    exticr: [u32; 4],
}

impl Syscfg {
    /// The port (0 is A) that EXTI line `line` (0..=15) looks at.
    pub(super) fn port(&self, line: usize) -> usize {
        let register = self.exticr.get(line / 4).copied().unwrap_or(0);
        field(register, 4 * (line as u32 % 4), 4) as usize
    }
}

impl Peripheral for Syscfg {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            MEMRMP => Ok(0),
            _ if EXTICR.contains(&offset) => Ok(self.exticr[(offset as usize - 8) / 4]),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            _ if EXTICR.contains(&offset) => self.exticr[(offset as usize - 8) / 4] = value & 0xFFFF,
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}
