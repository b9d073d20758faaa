//! RCC's clocks and resets, and what they reach.

use super::Soc;
use crate::mcu::peripheral::{Peripheral, bit};
use crate::mcu::unit::PeripheralName;

impl Soc {
    /// Lets the crystal stop or swing; true if that is an NMI.
    pub(in crate::mcu) fn set_crystal(&mut self, swings: bool) -> bool {
        match self.peripherals.rcc.set_crystal(swings) {
            Ok(missed) => {
                self.apply_clocks();
                missed
            }
            Err(reason) => {
                self.refuse("RCC", 0, PeripheralName::Rcc.description().base, None, reason);
                false
            }
        }
    }

    /// RCC has been accessed: resets peripherals, and brings its clocks to all of them.
    pub(super) fn change_clocks(&mut self) {
        if let Some((group, bits)) = self.peripherals.rcc.take_resets() {
            let reset = |unit: &PeripheralName| {
                let description = unit.description();
                description.group == group && bit(bits, description.bit)
            };
            for unit in PeripheralName::ALL.into_iter().filter(reset) {
                self.peripherals.of(unit).reset();
                self.agenda.touch(unit);
            }
        }
        self.apply_clocks();
    }

    /// Brings the clocks that RCC makes to all that runs on them.
    pub(super) fn apply_clocks(&mut self) {
        let clocks = self.peripherals.rcc.clocks();
        if clocks == self.clocks && self.time.hz() == clocks.hz {
            self.connect(PeripheralName::Rcc);
        } else {
            // What has been counted so far was at the old clocks.
            for unit in PeripheralName::ALL {
                let now = self.now;
                self.peripherals.of(unit).advance(now);
            }
            self.sync();
            self.clocks = clocks;
            self.time.change(clocks.hz, self.now);
            self.connect(PeripheralName::Rcc);
        }
        for unit in PeripheralName::ALL {
            self.peripherals.of(unit).set_divider(clocks.divider(unit));
        }
        self.peripherals.can.set_core_clock(clocks.hz);
        self.agenda.touch_all_but(PeripheralName::Rcc);
        self.peripherals.flash.advance(self.now);
        self.peripherals.flash.set_core_clock(clocks.hz);
        self.check_flash();
    }

    /// The run ends where the flash interface does not suit the clock.
    pub(super) fn check_flash(&mut self) {
        if let Some(reason) = self.peripherals.flash.complaint() {
            self.refuse("FLASH", 0, PeripheralName::Flash.description().base, None, reason);
        }
    }
}
