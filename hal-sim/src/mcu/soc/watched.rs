//! The register that the program reads again and again.

use crate::mcu::unit::PeripheralName;

/// Reads of the same value from the same register that look like waiting.
const SPIN: u32 = 2;

/// The last register read, and how often it gave the same with nothing in between.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::mcu) struct Watched {
    address: u32,
    value: u32,
    times: u32,
}

impl Watched {
    /// The program has read `value`.
    #[inline]
    pub(super) fn note(&mut self, unit: PeripheralName, address: u32, value: u32) {
        if self.address == address && self.value == value && unit.changes_by_events() {
            self.times += 1;
        } else {
            *self = Self { address, value, times: 0 };
        }
    }

    /// True while the program seems to wait for the register it has just read.
    #[inline]
    pub(in crate::mcu) fn is_spinning(&self) -> bool {
        self.times >= SPIN
    }
}
