//! The core's accesses to peripherals.

use super::Soc;
use super::watched::Watched;
use crate::mcu::cpu::Bus;
use crate::mcu::peripheral::{Cycles, Refusal};
use crate::mcu::unit::{PeripheralName, SIZE};

impl Bus for Soc {
    fn read(&mut self, now: Cycles, address: u32, bytes: u32) -> u32 {
        self.now = now;
        let word = address & !3;
        let Some((unit, offset)) = self.enter(word, None) else { return 0 };
        let outcome = self.peripherals.of(unit).read(offset);
        let value = self.outcome(unit, offset, word, None, outcome).unwrap_or(0);
        self.watched.note(unit, address, value);
        let shifted = value >> (8 * (address & 3));
        if bytes < 4 { shifted & ((1 << (8 * bytes)) - 1) } else { shifted }
    }

    fn write(&mut self, now: Cycles, address: u32, _bytes: u32, value: u32) {
        self.now = now;
        self.watched = Watched::default();
        if let Some((unit, offset)) = self.enter(address, Some(value)) {
            let outcome = if address & 3 == 0 {
                self.peripherals.of(unit).write(offset, value)
            } else {
                Err(Refusal::Use("writes of single bytes are not modelled"))
            };
            self.outcome(unit, offset, address, Some(value), outcome);
            self.agenda.touch(unit);
        }
    }
}

impl Soc {
    /// Finds the peripheral of an access and brings it up to date.
    fn enter(&mut self, address: u32, written: Option<u32>) -> Option<(PeripheralName, u32)> {
        let Some((unit, offset)) = self.decoder.find(address) else {
            self.refuse("nothing known", address % SIZE, address, written, "this peripheral is not modelled");
            return None;
        };
        if !self.peripherals.rcc.is_enabled(unit) {
            // It reads zero (RM0090 7.3); a write would be lost.
            if written.is_some() {
                self.refuse(unit.description().name, offset, address, written, "its clock is off");
            }
            return None;
        }
        let now = self.now;
        self.peripherals.of(unit).advance(now);
        if unit.port().is_some_and(|port| self.wiring.drives(port)) {
            // Pins that the board drives are read as they are now.
            self.sync();
            self.wiring.drive(&mut self.peripherals.ports);
        }
        if unit == PeripheralName::GpioA {
            self.wiring.join_pads(&mut self.peripherals.ports);
        }
        if unit == PeripheralName::Tim4 && self.peripherals.timers[2].follows_encoder() {
            self.sync();
            if let Some(count) = self.wiring.encoder(&self.peripherals.ports) {
                self.peripherals.timers[2].follow(count);
            }
        }
        // Reading takes data and clears flags.
        self.agenda.touch(unit);
        Some((unit, offset))
    }

    fn outcome<T>(
        &mut self,
        unit: PeripheralName,
        offset: u32,
        address: u32,
        written: Option<u32>,
        outcome: Result<T, Refusal>,
    ) -> Option<T> {
        let reason = match outcome {
            Ok(value) => return Some(value),
            Err(Refusal::Register) => "this register is not modelled",
            Err(Refusal::Use(reason)) => reason,
        };
        self.refuse(unit.description().name, offset, address, written, reason);
        None
    }
}
