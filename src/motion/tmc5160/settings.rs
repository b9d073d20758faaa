//! The registers of a TMC5160 that follow the profile of its motor: those of its ramps, and what its stop switches and
//! a stall do.

use embedded_hal::spi::SpiDevice;

use super::Bound;
use super::ramp::{self, Shape};
use super::unit::SpeedUnit;
use crate::chip::tmc5160::{Register, sw_mode};
use crate::motion::Error;
use crate::motion::profile::Profile;
use crate::motion::switch::Side;
use crate::param::AxisParameter as P;

impl<D: SpiDevice> Bound<'_, D> {
    /// Brings the registers of positioning ramps to the profile. True if one was written. A motor that already brakes
    /// before its target speeds up again for a stronger brake only when the target is written once more (datasheet
    /// section 6.3.1, XTARGET).
    pub(super) fn write_ramp(&mut self, profile: &Profile<'_>) -> Result<bool, Error> {
        let (mut written, mut brakes) = (false, false);
        for (register, word) in ramp::words(profile, self.axis.shape.unwrap_or(Shape::of(profile.values))) {
            if !self.chip.holds(register, word) {
                self.chip.write(register, word)?;
                written = true;
                brakes |= matches!(register, Register::V1 | Register::DMax | Register::D1);
            }
        }
        if brakes && self.axis.known.mode.positions() && self.axis.known.ahead() != 0 {
            self.chip.write(Register::XTarget, self.axis.known.target as u32)?;
        }
        Ok(written)
    }

    /// Brings SW_MODE to the profile, whose unit and top speed are noted for what is read later.
    pub(super) fn write_switches(&mut self, profile: &Profile<'_>) -> Result<(), Error> {
        let Profile { values, stops, .. } = *profile;
        self.axis.unit = SpeedUnit::of(values);
        self.axis.top_speed = profile.speed;
        let bit = |set: bool, bit: u32| if set { bit } else { 0 };
        let latch = match stops.latch {
            Some(Side::Left) => sw_mode::LATCH_L_INACTIVE,
            Some(Side::Right) => sw_mode::LATCH_R_INACTIVE,
            None => sw_mode::LATCH_L_ACTIVE | sw_mode::LATCH_R_ACTIVE,
        };
        self.axis.switches = bit(stops.left, sw_mode::STOP_L_ENABLE)
            | bit(stops.right, sw_mode::STOP_R_ENABLE)
            | bit(values.is_on(P::LeftSwitchPolarity), sw_mode::POL_STOP_L)
            | bit(values.is_on(P::RightSwitchPolarity), sw_mode::POL_STOP_R)
            | bit(values.is_on(P::SwapSwitches), sw_mode::SWAP_LR)
            | bit(stops.soft, sw_mode::EN_SOFTSTOP)
            | sw_mode::EN_LATCH_ENCODER
            | latch;
        self.show_switches()
    }

    /// Writes SW_MODE, unless the switches are still what stops the motor at once.
    pub(super) fn show_switches(&mut self) -> Result<(), Error> {
        if self.axis.delays.halting > 0 {
            return Ok(());
        }
        let stall = if self.axis.stall.armed { sw_mode::SG_STOP } else { 0 };
        Ok(self.chip.write(Register::SwMode, self.axis.switches | stall)?)
    }
}
