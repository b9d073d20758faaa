//! FLASH: the interface to the flash memory (RM0090 3.9). Programming and erasing are not modelled: the image
//! never changes itself.

use super::peripheral::{Access, Peripheral, Refusal, field};

const ACR: u32 = 0x00;
const SR: u32 = 0x0C;
const CR: u32 = 0x10;
const OPTCR: u32 = 0x14;

/// LATENCY, PRFTEN, ICEN, DCEN, ICRST, DCRST.
const ACR_WRITABLE: u32 = 0x1F07;
const LOCK: u32 = 1 << 31;
const OPTCR_RESET: u32 = 0x0FFF_AAED;

/// At 2.7 V to 3.6 V a wait state is needed for every further 30 MHz (table 10).
const HZ_PER_WAIT_STATE: u64 = 30_000_000;

/// The flash interface.
#[derive(Debug, Default)]
pub(super) struct Flash {
    acr: u32,
}

impl Flash {
    /// Whether the wait states set are enough for a core clock of `hz`.
    pub(super) fn keeps_up_with(&self, hz: u64) -> bool {
        hz <= HZ_PER_WAIT_STATE * u64::from(field(self.acr, 0, 3) + 1)
    }
}

impl Peripheral for Flash {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            ACR => Ok(self.acr),
            SR => Ok(0),
            CR => Ok(LOCK),
            OPTCR => Ok(OPTCR_RESET),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            ACR if value & !ACR_WRITABLE == 0 => self.acr = value,
            ACR => return Err(Refusal::Use("reserved bits of ACR")),
            CR | OPTCR => return Err(Refusal::Use("programming the flash is not modelled")),
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}
