//! An axis stops by itself at a stall, when an encoder deviates, and when its driver has shut down; and it is stopped
//! hard from outside, for example at under-voltage.

use super::Error;
use super::axis::Joined;
use super::current::Excitation;
use super::hardware::Hardware;
use super::stall::{self, Measured};
use crate::param::AxisParameter as P;

/// Bit of parameter 207: stopped by stallGuard2 (manual chapter 4).
const STALL: i32 = 1;
/// Bit of parameter 207: stopped by an encoder deviation.
const DEVIATION: i32 = 2;

impl<H: Hardware> Joined<'_, H> {
    /// Looks for a stall, a deviation and driver faults once a poll, and stops the motor without a ramp if there is
    /// one. Each stays visible in parameters 207 and 208, but is an event only when it is new. A motor that has been
    /// stopped for a deviation may deviate until it is sent somewhere again.
    pub(super) fn guard(&mut self) -> Result<(), Error> {
        let deviation = self.encoders.deviate(self.last_position(), &self.values) && !self.deviating;
        let faults = self.hardware.flags(self.controller()) & H::SHUT_DOWN & !self.alarms;
        // A speed that could not be read now is read with the next poll.
        let stall = self.stalled().unwrap_or(false);
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
        self.hard_stop()
    }

    /// Stops at once, without a ramp, and ends a move or a reference search. A stop that does not get through to the
    /// chip is tried again with every poll.
    pub fn hard_stop(&mut self) -> Result<(), Error> {
        self.stopping = true;
        self.measured = Measured::default();
        self.search = None;
        self.travelling = false;
        self.on_course(H::stop)?;
        self.stopping = false;
        Ok(())
    }

    /// Sets the driver up anew, as after its supply has come back.
    pub fn restart_driver(&mut self) -> Result<(), Error> {
        self.measured = Measured::default();
        let (hardware, controller) = self.reach();
        hardware.forget(controller);
        self.write_driver()
    }

    /// Driver flags as parameter 208 shows them: those of the last answer, and shut-downs since the last motion
    /// command.
    pub(super) fn driver_flags(&self) -> u8 {
        self.hardware.flags(self.controller()) | self.alarms
    }

    /// Before a motion: a driver that has shut down is given another chance. Switching the chopper off and on
    /// ends the shut-down (TMC262: short to ground stays latched until TOFF was zero).
    pub(super) fn release_driver(&mut self) -> Result<(), Error> {
        let alarm = self.alarms != 0;
        if let Some(excitation) = self.excitation.take_if(|_| alarm) {
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
    fn stalled(&mut self) -> Result<bool, Error> {
        let above = self.values.get(P::StopOnStall);
        let span = stall::span(self.values.is_on(P::StallGuardFilter), self.values.get(P::MicrostepResolution));
        let known = *self.hardware.known();
        let measured = self.measured.look(known.position, known.speed, above, span);
        let stalled = self.hardware.stalled(self.controller(), self.sensors.stall);
        Ok(above > 0 && measured && stalled && self.actual_speed()?.abs() > above)
    }
}
