//! The driver of a TMC5160.

use embedded_hal::spi::SpiDevice;

use super::{Bound, configuration};
use crate::chip::tmc5160::{Register, gstat, ramp_stat};
use crate::motion::Error;
use crate::motion::current::Excitation;
use crate::motion::hardware::Driver;
use crate::motion::values::Values;

/// Number of turns, one in a millisecond, after which a reading of the driver's flags is younger than its last release.
/// They are asked for in one of four turns, and come in the next one.
const RELEASING: u8 = 6;

impl<D: SpiDevice> Driver for Bound<'_, D> {
    /// The chip itself goes over to the standby current, so the state of motion decides only whether the bridges are on
    /// and coolStep works.
    fn drive(&mut self, values: &Values, excitation: Excitation) -> Result<(), Error> {
        if excitation.free {
            self.chip.write(Register::Gstat, gstat::DRV_ERR)?;
            self.axis.delays.releasing = RELEASING;
        }
        let wanted = configuration::pwm_wanted(values);
        self.axis.stealth_chop.on = wanted && (self.axis.stealth_chop.on || self.axis.rests());
        self.axis.stealth_chop.waits = wanted && !self.axis.stealth_chop.on;
        let mut supervises_anew = false;
        for (register, word) in configuration::words(values, excitation, self.axis.stealth_chop.on) {
            supervises_anew |= register == Register::EncDeviation && !self.chip.holds(register, word);
            self.chip.write(register, word)?;
        }
        if supervises_anew { self.forget_deviation() } else { Ok(()) }
    }

    fn forget(&mut self) {
        self.chip.forget();
    }

    /// The chip stops the motor itself, see [`watch_stall`](Self::watch_stall).
    fn stalled(&self, _: bool) -> bool {
        false
    }

    /// A motor that a stall has stopped would be let go if the stop were switched off, so it is asked before.
    fn watch_stall(&mut self, armed: bool) -> Result<bool, Error> {
        if self.axis.stall.armed && !armed {
            self.axis.stall.stopped = self.chip.read(Register::RampStat)? & ramp_stat::EVENT_STOP_SG != 0;
        }
        if self.axis.stall.armed != armed && !self.axis.stall.stopped {
            self.axis.stall.armed = armed;
            self.show_switches()?;
        }
        Ok(self.axis.stall.stopped)
    }
}
