//! DBGMCU: what a debugger may keep alive (RM0090 38.16). No debugger is connected, so it does nothing.

use super::peripheral::{Access, Peripheral, Refusal};

const IDCODE: u32 = 0x00;
const CR: u32 = 0x04;
const APB1_FZ: u32 = 0x08;
const APB2_FZ: u32 = 0x0C;

/// Revision Y of the STM32F405 and its relatives.
const ID: u32 = 0x100F_6413;

/// The debug support of the chip.
#[derive(Debug, Default)]
pub(super) struct Dbgmcu {
    cr: u32,
    freeze: [u32; 2],
}

impl Peripheral for Dbgmcu {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            IDCODE => Ok(ID),
            CR => Ok(self.cr),
            APB1_FZ => Ok(self.freeze[0]),
            APB2_FZ => Ok(self.freeze[1]),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            CR => self.cr = value,
            APB1_FZ => self.freeze[0] = value,
            APB2_FZ => self.freeze[1] = value,
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}
