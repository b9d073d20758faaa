//! Faults of a board, and the disturbance of its CAN controller.

use super::{Board, Chip};
use crate::chip::tmc262::Bridge;
use crate::fault::{CanState, Fault};

impl Board {
    /// Injects or removes a fault. `axis`, which the board has to have, counts for faults of a driver, an encoder or a
    /// motion controller.
    pub fn set_fault(&mut self, fault: Fault, axis: usize, on: bool) {
        let drive = &mut self.drives[axis];
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
            Fault::ShortA => drive.chip.set_short(Bridge::A, on),
            Fault::ShortB => drive.chip.set_short(Bridge::B, on),
            Fault::OpenA => drive.chip.set_open(Bridge::A, on),
            Fault::OpenB => drive.chip.set_open(Bridge::B, on),
            Fault::Overtemperature => drive.overtemperature = on,
            Fault::Encoder => drive.encoder.set_stuck(on, self.world.axis(axis).motor().rotor()),
        }
        self.connect();
    }

    /// What has become of the CAN controller.
    pub fn can(&self) -> CanState {
        self.can
    }

    /// Disturbs the CAN controller, or lets it recover. The owner of the board also has to tell its firmware.
    pub fn set_can(&mut self, state: CanState) {
        self.can = state;
    }
}
