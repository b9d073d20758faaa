//! For how long an axis with a TMC5160 only takes the same readings.

use embedded_hal::spi::SpiDevice;

use super::{Tmc5160Axis, readings};
use crate::chip::tmc5160::Tmc5160;
use crate::motion::Foreseeable;

impl<D: SpiDevice> Foreseeable for Tmc5160Axis<D> {
    const ROTATION: u8 = readings::ROTATION;

    /// Each reading but the version comes once in eight turns, and is answered in the next one.
    const FRESH: u8 = 10;

    fn room(&self, chip: &Tmc5160<D>) -> Option<u32> {
        if self.delays.are_left() || self.stall.armed || self.stall.stopped || !chip.answers() {
            return None;
        }
        if self.rests() {
            return Some(0);
        }
        let room = self.known.steps_before(self.known.target)?.min(self.known.steps_before(0)?);
        Some(room.min(readings::LEAP / 2))
    }
}
