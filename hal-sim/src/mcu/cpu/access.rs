//! Loads and stores, wherever they lead: memory, peripherals, the core's own registers.

use rsemu::cpu::arm::v7m::sys::{DWT_PCSR, in_ppb, in_vendor_ppb};

use super::bus::Bus;
use super::core::Core;
use super::memory::mask;
use super::registers::PC;
use super::trap::{Outcome, Trap};
use crate::mcu::peripheral::bit;

/// Addresses on the bus: places where single bits of RAM are to be had, peripherals (with theirs), and the vendor's
/// part of the core's own bus.
const ON_BUS: [core::ops::Range<u32>; 3] =
    [0x2200_0000..0x2400_0000, 0x4000_0000..0x6000_0000, 0xE004_2000..0xE004_2400];

impl Core {
    /// Reads 1, 2 or 4 bytes.
    #[inline]
    pub(super) fn read<B: Bus>(&mut self, bus: &mut B, address: u32, bytes: u32) -> Outcome<u32> {
        self.used += 1;
        match self.memory.load(address, bytes) {
            Some(value) => {
                self.wait_for_data(address);
                Ok(value)
            }
            None => self.read_beyond(bus, address, bytes),
        }
    }

    /// Writes 1, 2 or 4 bytes.
    #[inline]
    pub(super) fn write<B: Bus>(&mut self, bus: &mut B, address: u32, bytes: u32, value: u32) -> Outcome {
        self.used += 1;
        match self.memory.store(address, bytes, value) {
            Some(()) => Ok(()),
            None => self.write_beyond(bus, address, bytes, value),
        }
    }

    #[inline(never)]
    fn read_beyond<B: Bus>(&mut self, bus: &mut B, address: u32, bytes: u32) -> Outcome<u32> {
        if is_own(address) {
            self.tick();
            let word = if address & !3 == DWT_PCSR {
                Some(self.registers.get(PC).wrapping_sub(4))
            } else {
                self.sys.read_word(address, false)
            };
            return word.map(|word| word >> (8 * (address & 3)) & mask(bytes)).ok_or(Trap::Access);
        }
        self.ask_bus(address)?;
        if address.is_multiple_of(bytes) {
            return Ok(bus.read(self.now, address, bytes));
        }
        Ok((0..bytes).fold(0, |value, at| value | bus.read(self.now, address.wrapping_add(at), 1) << (8 * at)))
    }

    #[inline(never)]
    fn write_beyond<B: Bus>(&mut self, bus: &mut B, address: u32, bytes: u32, value: u32) -> Outcome {
        if is_own(address) {
            return self.write_own(address, bytes, value);
        }
        self.ask_bus(address)?;
        if address.is_multiple_of(bytes) {
            bus.write(self.now, address, bytes, value & mask(bytes));
            return Ok(());
        }
        for at in 0..bytes {
            bus.write(self.now, address.wrapping_add(at), 1, value >> (8 * at) & 0xFF);
        }
        Ok(())
    }

    /// Writes to the core's own registers. Of a word written in part, the rest stays.
    fn write_own(&mut self, address: u32, bytes: u32, value: u32) -> Outcome {
        self.tick();
        let word = if bytes == 4 {
            value
        } else {
            let shift = 8 * (address & 3);
            let old = self.sys.read_word(address, true).ok_or(Trap::Access)?;
            old & !(mask(bytes) << shift) | (value & mask(bytes)) << shift
        };
        let taken = self.sys.write_word(address, word);
        self.plan_tick();
        self.attention = true;
        if bit(self.sys.mpu_ctrl, 0) {
            self.refuse("the memory protection unit is not modelled");
        }
        if taken { Ok(()) } else { Err(Trap::Access) }
    }

    /// Whether there is something on the bus; notes that it is accessed, or where there is nothing.
    fn ask_bus(&mut self, address: u32) -> Outcome {
        self.far = address;
        self.accessed = ON_BUS.iter().any(|place| place.contains(&address));
        if self.accessed { Ok(()) } else { Err(Trap::Access) }
    }
}

/// Whether an address belongs to the core itself.
fn is_own(address: u32) -> bool {
    in_ppb(address) && !in_vendor_ppb(address)
}
