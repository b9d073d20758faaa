//! The bus that takes the core's accesses to peripherals.

use crate::mcu::peripheral::Cycles;

/// Takes the core's accesses to peripherals.
pub(in crate::mcu) trait Bus {
    /// Reads 1, 2 or 4 bytes in an instruction that began at `now`.
    fn read(&mut self, now: Cycles, address: u32, bytes: u32) -> u32;
    /// Writes 1, 2 or 4 bytes, likewise.
    fn write(&mut self, now: Cycles, address: u32, bytes: u32, value: u32);
}
