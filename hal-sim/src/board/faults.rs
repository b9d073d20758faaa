//! Faults of a board, and the disturbance of its CAN controller.

use super::{Board, Chip};
use crate::fault::{CanState, Fault};

impl Board {
    /// Injects or removes a fault. `axis`, which the board has to have, counts for faults of an axis. A fault of what
    /// the board does not have changes nothing.
    pub fn set_fault(&mut self, fault: Fault, axis: usize, on: bool) {
        match fault {
            Fault::Eeprom => self.at25.set_answering(!on),
            Fault::Spi => self.motion_bus_stuck = on.then_some(0xFF),
            Fault::SpiLow => self.motion_bus_stuck = on.then_some(0),
            Fault::Tmc429 => {
                if let Some((controller, _)) = self.kind.motor(axis) {
                    self.set_deaf(Chip::Tmc429(controller), on);
                }
            }
            Fault::Tmc262 => self.set_deaf(Chip::Tmc262(axis), on),
            Fault::Tmc5160 => self.set_deaf(Chip::Tmc5160(axis), on),
            fault => self.motion.chips_mut().set_fault(fault, axis, self.world.axis(axis), on, self.now),
        }
        self.connect();
    }

    /// The state of the CAN controller.
    pub fn can(&self) -> CanState {
        self.can
    }

    /// Disturbs the CAN controller, or lets it recover. The owner of the board also has to tell its firmware.
    pub fn set_can(&mut self, state: CanState) {
        self.can = state;
    }
}
