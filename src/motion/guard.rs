//! An axis stops by itself at a stall, when an encoder deviates, and when its driver has shut down; and it is stopped
//! hard from outside, for example at under-voltage.

use embedded_hal::spi::SpiDevice;

use super::current::Excitation;
use super::stall::{self, Measured};
use super::{Axis, Error};
use crate::chip::tmc262::flags;
use crate::chip::tmc429::{RampMode, Register, Tmc429};
use crate::param::AxisParameter as P;
use crate::units::Micros;

/// Bit of parameter 207: stopped by stallGuard2 (manual chapter 4).
const STALL: i32 = 1;
/// Bit of parameter 207: stopped by an encoder deviation.
const DEVIATION: i32 = 2;
/// Driver flags that mean its bridges are shut down.
const SHUT_DOWN: u8 = flags::OVERTEMPERATURE | flags::SHORT_A | flags::SHORT_B;

impl<D: SpiDevice> Axis<D> {
    /// Looks for a stall, a deviation and driver faults once a poll, and stops the motor without a ramp if there is
    /// one. Each stays visible in parameters 207 and 208, but is an event only when it is new. A motor that has been
    /// stopped for a deviation may deviate until it is sent somewhere again.
    pub(super) fn guard<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>) -> Result<(), Error> {
        let deviation = self.deviates() && !self.deviating;
        let faults = self.driver.flags() & SHUT_DOWN & !self.alarms;
        // A speed that could not be read now is read with the next poll.
        let stall = self.stalled(chip).unwrap_or(false);
        if !(stall || deviation || faults != 0) {
            return Ok(());
        }
        self.events.stall |= stall;
        self.events.deviation |= deviation;
        self.events.alarm |= faults != 0;
        self.events.cut_short |= self.travelling;
        self.errors |= if stall { STALL } else { 0 } | if deviation { DEVIATION } else { 0 };
        self.deviating |= deviation;
        self.alarms |= faults;
        self.hard_stop(now, chip)
    }

    /// Stops at once, without a ramp, and ends a move or a reference search. A stop that does not get through to the
    /// chip is tried again with every poll. V_ACTUAL may be written in hold mode only (datasheet section 8.1.6); a
    /// written zero clears the hidden bits of the velocity, too.
    pub fn hard_stop<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>) -> Result<(), Error> {
        self.stopping = true;
        self.measured = Measured::default();
        self.search = None;
        self.travelling = false;
        self.set_mode(chip, RampMode::Hold)?;
        chip.write(self.generator, Register::VActual, 0)?;
        chip.write(self.generator, Register::VTarget, 0)?;
        self.speed = 0;
        self.run_at(now, chip, 0)?;
        self.stopping = false;
        Ok(())
    }

    /// Sets the driver up anew, as after its supply has come back.
    pub fn restart_driver(&mut self) -> Result<(), Error> {
        self.measured = Measured::default();
        self.driver.forget();
        self.write_driver()
    }

    /// Driver flags as parameter 208 shows them: those of the last answer, and shut-downs since the last motion
    /// command.
    pub(super) fn driver_flags(&self) -> u8 {
        self.driver.flags() | self.alarms
    }

    /// Before a motion: a driver that has shut down is given another chance. Switching the chopper off and on
    /// ends the shut-down (TMC262: short to ground stays latched until TOFF was zero).
    pub(super) fn release_driver(&mut self) -> Result<(), Error> {
        if let Some(excitation) = self.excitation.take_if(|_| self.alarms != 0) {
            self.alarms = 0;
            self.measured = Measured::default();
            self.excitation = Some(Excitation { free: true, ..excitation });
            self.write_driver()?;
            // So the next poll writes the excitation even if it is the one of before.
            self.excitation = None;
        }
        Ok(())
    }

    /// Stop on stall (parameter 181): a load value of zero, measured wholly above the speed given there.
    fn stalled<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>) -> Result<bool, Error> {
        let above = self.value(P::StopOnStall);
        let span = stall::span(self.value(P::StallGuardFilter) != 0, self.value(P::MicrostepResolution));
        let measured = self.measured.look(self.position.actual, self.speed, above, span);
        Ok(above > 0 && measured && self.sensors.stall && self.actual_speed(chip)?.abs() > above)
    }

    /// Deviation supervision (parameters 212 and 218); 0 switches it off.
    fn deviates(&self) -> bool {
        let far = |position: i32, limit: P| {
            let limit = self.value(limit).unsigned_abs();
            limit != 0 && self.position.actual.wrapping_sub(position).unsigned_abs() > limit
        };
        far(self.encoder.position(), P::MaximumEncoderDeviation)
            || far(self.external.position(), P::MaximumExternalEncoderDeviation)
    }
}
