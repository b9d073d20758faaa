//! PWR: the power controller (RM0090 5.4). The regulator is ready at once.

use super::peripheral::{Access, Peripheral, Refusal};

const CR: u32 = 0x00;
const CSR: u32 = 0x04;

/// DBP, FPDS, VOS: what can be set without anything to sleep deeper than WFI. Bit 15 belongs to VOS in relatives of
/// the chip that drivers serve alike; here it is reserved.
const CR_WRITABLE: u32 = 1 << 8 | 1 << 9 | 3 << 14;
const RESERVED: u32 = 1 << 15;
const VOSRDY: u32 = 1 << 14;

/// The power controller.
#[derive(Debug)]
pub(super) struct Pwr {
    cr: u32,
}

impl Pwr {
    pub(super) fn new() -> Self {
        Self { cr: 1 << 14 }
    }
}

impl Peripheral for Pwr {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            CR => Ok(self.cr),
            CSR => Ok(VOSRDY),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            CR if value & !CR_WRITABLE == 0 => self.cr = value & !RESERVED,
            CR => return Err(Refusal::Use("only DBP, FPDS and VOS are modelled")),
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn reset(&mut self) {
        *self = Self::new();
    }
}
