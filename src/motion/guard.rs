//! Causes that stop an axis without a ramp: a stall, an encoder deviation, a shut-down of its driver, and a stop switch
//! that its ramp generator does not watch. Each poll looks for them here.

use super::Error;
use super::hardware::{Driver, Hardware, RampGenerator};
use super::joined::Joined;
use super::stall::Measured;

/// Bit of parameter 207 (manual chapter 4): stallGuard2 has stopped the motor.
const STALL: i32 = 1;
/// Bit of parameter 207: an encoder deviation has stopped the motor.
const DEVIATION: i32 = 2;

impl<H: Hardware> Joined<'_, H> {
    /// Looks for a stall, an encoder deviation and a shut-down of the driver, once in each poll, and stops the motor
    /// without a ramp where there is any. Each stays visible in parameters 207 and 208, but is an event only when it is
    /// new. A motor that was stopped for a deviation may go on deviating until a motion command moves it again:
    /// otherwise it could never be moved back.
    pub(super) fn guard(&mut self) -> Result<(), Error> {
        let readings = self.readings();
        if readings.is_lost {
            return self.recover();
        }
        let deviates = self.axis.encoders.deviate(self.axis.last_position(), &self.axis.values) || readings.deviates;
        let deviation = deviates && !self.axis.orders.deviating;
        let faults = readings.shut_downs & !self.axis.orders.alarms;
        // If the chip does not answer now, the next poll asks it again.
        let stall = self.look_for_stall().unwrap_or(false);
        if !(stall || deviation || faults != 0) {
            return Ok(());
        }
        self.axis.events.stall |= stall;
        self.axis.events.deviation |= deviation;
        self.axis.events.alarm |= faults != 0;
        self.axis.events.cut_short |= self.axis.orders.travelling;
        self.axis.orders.errors |= if stall { STALL } else { 0 } | if deviation { DEVIATION } else { 0 };
        self.axis.orders.deviating |= deviation;
        self.axis.orders.alarms |= faults;
        self.hard_stop()
    }

    /// Sets up hardware that has lost its registers: the motor stands where it was last known to be, and a positioning
    /// move or a reference search has ended. The driver is written at the end of the next poll that gets so far.
    pub(super) fn recover(&mut self) -> Result<(), Error> {
        self.axis.events.cut_short |= self.axis.orders.travelling || self.axis.search.is_some();
        self.axis.driving.forget();
        self.hard_stop()?;
        let position = self.axis.last_position();
        self.chips().set_encoder(position)
    }

    /// Stops a motor that turns or is to turn right while the right stop switch is closed, where the axis watches this
    /// switch itself. That ends a move to the right. A reference search ends its leg by what it sees of the switch. A
    /// motor that is on its way back goes on to its goal, as under a ramp generator that watches the switch.
    pub(super) fn watch(&mut self) -> Result<(), Error> {
        let known = *self.axis.hardware.known();
        let turns_right = known.ahead() > 0 || known.speed > 0;
        if self.axis.watched_right() != Some(true) || !self.axis.stops().right || !turns_right {
            return Ok(());
        }
        if known.ahead() <= 0 || self.axis.search.is_some() {
            self.stop()?;
            return if known.ahead() < 0 { self.resume(known) } else { Ok(()) };
        }
        self.axis.events.cut_short |= self.axis.orders.travelling;
        self.hard_stop()
    }

    /// Writes all registers of the driver anew, as is necessary after its supply has come back.
    pub fn restart_driver(&mut self) -> Result<(), Error> {
        self.axis.measured = Measured::default();
        self.chips().forget();
        self.write_driver()
    }
}
