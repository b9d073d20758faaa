//! The stop switches of an axis on a TMC5160, and its latches.

use embedded_hal::spi::SpiDevice;

use super::Bound;
use crate::chip::tmc5160::{Register, ramp_stat};
use crate::motion::Error;
use crate::motion::hardware::{RampGenerator, StopSwitches};
use crate::motion::profile::Profile;

impl<D: SpiDevice> StopSwitches for Bound<'_, D> {
    /// While their polarities are such that both stop the motor, the chip does not know their states.
    fn switches(&mut self) -> Result<[bool; 2], Error> {
        if self.axis.delays.halting == 0 {
            let word = self.chip.read(Register::RampStat)?;
            self.axis.closed = [word & ramp_stat::STOP_L != 0, word & ramp_stat::STOP_R != 0];
        }
        Ok(self.axis.closed)
    }

    fn turn_switches(&mut self) -> Result<[bool; 2], Error> {
        Ok(self.axis.closed)
    }

    fn meets_switch(&self, profile: &Profile<'_>, ahead: i32) -> bool {
        profile.stops.hold(ahead, self.axis.closed)
    }

    /// A last reading of 0 may be older than the goal.
    fn is_held(&mut self, profile: &Profile<'_>, ahead: i32, _: bool) -> Result<bool, Error> {
        let stood = self.axis.delays.settling == 0 && self.axis.known.speed == 0;
        Ok(self.meets_switch(profile, ahead) && (stood || self.speed()? == 0))
    }

    fn latch(&mut self) -> Result<(), Error> {
        Ok(self.chip.write(Register::RampStat, ramp_stat::LATCHES)?)
    }

    fn latched(&mut self) -> Result<Option<i32>, Error> {
        if self.chip.read(Register::RampStat)? & ramp_stat::LATCHES == 0 {
            return Ok(None);
        }
        Ok(Some(self.chip.read(Register::XLatch)? as i32))
    }
}
