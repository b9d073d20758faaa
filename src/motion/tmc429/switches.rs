//! The stop switches of an axis on a TMC429, and its latch.

use embedded_hal::spi::SpiDevice;

use super::{Bound, position};
use crate::chip::tmc429::{Register, reference, signed};
use crate::motion::Error;
use crate::motion::hardware::{RampGenerator, StopSwitches};
use crate::motion::profile::Profile;

impl<M: SpiDevice, D: SpiDevice> StopSwitches for Bound<'_, M, D> {
    fn switches(&mut self) -> Result<[bool; 2], Error> {
        self.read_switches()
    }

    /// All switches of the chip are in one register.
    fn turn_switches(&mut self) -> Result<[bool; 2], Error> {
        let bits = self.chip.switches_once()?;
        Ok(self.own_switches(bits))
    }

    /// Near the position that the chip counts as zero, within the tolerance of parameter 141, the chip lets the motor
    /// pass the stop switches (datasheet section 8.1.14).
    fn meets_switch(&self, profile: &Profile<'_>, ahead: i32) -> bool {
        let tolerance = profile.tolerance.unsigned_abs();
        let near = tolerance != 0 && signed(self.axis.known.position as u32, 24).unsigned_abs() <= tolerance;
        !near && profile.stops.hold(ahead, self.axis.last_switches(self.chip))
    }

    /// The readings of switches and speed may be some milliseconds old, so they are taken again before the motor counts
    /// as held.
    fn is_held(&mut self, profile: &Profile<'_>, ahead: i32, stays: bool) -> Result<bool, Error> {
        if !stays && !self.meets_switch(profile, ahead) {
            return Ok(false);
        }
        self.read_switches()?;
        Ok(self.meets_switch(profile, ahead) && self.speed()? == 0)
    }

    fn latch(&mut self) -> Result<(), Error> {
        Ok(self.chip.write(self.axis.generator, Register::XLatched, 0)?)
    }

    /// The chip latches the position only while the motor moves (datasheet section 8.1.15).
    fn latched(&mut self) -> Result<Option<i32>, Error> {
        if self.chip.read(self.axis.generator, Register::RefConfMode)? & reference::LATCH_PENDING != 0 {
            return Ok(None);
        }
        let counter = self.chip.read(self.axis.generator, Register::XLatched)?;
        Ok(Some(position::extend(self.axis.known.position, counter)))
    }
}
