//! For how long an axis with a TMC429 and a TMC262 only takes the same readings.

use embedded_hal::spi::SpiDevice;

use super::generator::READINGS;
use super::{Rest, Tmc429Tmc262, position};
use crate::chip::tmc429::Tmc429;
use crate::motion::Foreseeable;

impl<M: SpiDevice, D: SpiDevice> Foreseeable for Tmc429Tmc262<M, D> {
    const ROTATION: u8 = READINGS;

    /// Load and current are each read once in four readings of the driver.
    const FRESH: u8 = 16;

    /// An axis notes that it is at its target whatever its mode.
    fn room(&self, chip: &Tmc429<M>) -> Option<u32> {
        if !chip.answers() {
            return None;
        }
        if self.rest == Rest::Rests {
            return Some(0);
        }
        let room = self.known.steps_before(self.known.target)?;
        if self.known.mode.positions() && self.waypoint != self.known.target {
            return Some(position::room(self.known.steps_before(self.waypoint)?));
        }
        Some(room.min(position::EXTENDED))
    }
}
