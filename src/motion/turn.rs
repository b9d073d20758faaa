//! The poll of an axis in each millisecond: it follows the motor, guards it, advances a reference search, notices what
//! has happened, and chooses the motor's current.
//!
//! Of a motor that moves the poll reads the position alone; the other reading of the millisecond is taken half a
//! millisecond later, so that a poll has one datagram to a chip, and no more; or two short ones, to a chip that answers the
//! first one with the second. Longer, and rare, is a poll that stops the motor, changes its current, or finds it held by a
//! switch; and longer are those of a reference search: two readings each, and where a leg begins or the zero point is
//! found the settings of the ramp generator, some ten datagrams in all.

use super::Error;
use super::axis::{Axis, Events, Joined};
use super::current::MotionState;
use super::hardware::{Followed, Goal, Hardware, Known, Mode};
use super::orders::Untold;
use super::sensors::Sensors;
use super::switch::{SETTLED, SETTLED_ON_LINE, Switches};
use crate::param::AxisParameter as P;
use crate::units::Micros;

/// How much the speed of a motor that is held to a straight line may differ from its limit while it counts as turning at
/// that speed, besides a 64th of it: the limit wavers, and the speed may have been read some milliseconds ago.
const WAVERING: u32 = 2;

/// Microsteps in 16 ms, the time of [`Axis::correction`], of a motor that makes two in a millisecond: one that is faster is
/// somewhere else in each poll.
const BRISK: i32 = 2 * 16;

impl<H: Hardware> Axis<H> {
    /// What the motor does, by the last readings.
    pub(super) fn motion_state(&self) -> MotionState {
        let held = self.held > 0;
        let known = self.hardware.known();
        let moving = held || known.ahead() != 0 || known.speed != 0;
        if !moving || (held && self.values.is_on(P::EndSwitchPowerDown)) {
            return MotionState::Standing;
        }
        if held {
            return MotionState::Held;
        }
        let cruises = if known.mode.positions() {
            let speed = self.positioning_speed().unsigned_abs();
            known.speed.unsigned_abs().abs_diff(speed) <= if self.limited() { speed / 64 + WAVERING } else { 0 }
        } else {
            known.speed == known.target_speed
        };
        if cruises { MotionState::Cruising } else { MotionState::Changing }
    }

    /// True while the motor is to turn at a speed, outside a reference search.
    fn rotates(&self) -> bool {
        let Known { mode, target_speed, .. } = *self.hardware.known();
        mode == Mode::Velocity && target_speed != 0 && self.search.is_none()
    }
}

impl<H: Hardware> Joined<'_, H> {
    /// Polls the axis, which the device does once in each millisecond. `reading` is the number of the reading to be
    /// taken, or `None` if it is another axis' turn; while the motor moves [`refresh`](Self::refresh) takes it, later. An axis
    /// that is `on_line`, on a straight line with others, or rotates, is found held by a stop switch as soon as its position stays.
    /// Returns the events since the poll before.
    pub fn poll(&mut self, now: Micros, sensors: Sensors, reading: Option<u8>, on_line: bool) -> Events {
        self.sensors = sensors;
        self.count();
        // Where a datagram did not get through to a chip, the next poll tries again.
        let _ = self.turn(now, reading, on_line);
        core::mem::take(&mut self.events)
    }

    /// Takes the reading that the last poll has left to be taken, if there is one.
    pub fn refresh(&mut self) {
        if let Some(reading) = self.later.take() {
            let (hardware, controller) = self.reach();
            // A reading that did not get through comes again in the next rotation.
            let _ = hardware.refresh(controller, reading);
        }
    }

    /// True while a motor that is to turn at a speed stands before its closed stop switch, or brakes there.
    fn is_at_switch(&mut self) -> bool {
        self.rotates() && (self.held > 0 || self.values.is_on(P::SoftStop) && self.brakes_at_switch())
    }

    /// True while the stop switch to which a motor turns is closed. The switches are read for it: a press that is over before the
    /// ramp is shows in nothing else.
    #[cold]
    #[inline(never)]
    fn brakes_at_switch(&mut self) -> bool {
        let target_speed = self.hardware.known().target_speed;
        self.on_course(|hardware, controller, course| {
            hardware.turn_switches(controller).is_ok() && hardware.meets_switch(controller, course, target_speed)
        })
    }

    /// Ends a rotation at the stop switch before the motor, which stands there, or brakes: it does not turn again by itself
    /// when the switch opens. What the chip does not take of that the next poll tells it again.
    pub fn end_at_switch(&mut self) {
        let told = self.hardware.known().target_speed;
        if self.head(Goal::Speed(0)).is_err() {
            self.untold = self.untold.max(Untold::Course);
        }
        self.orders.ended = Some(told);
    }

    /// Tells the chips what they have not taken before.
    pub(super) fn catch_up(&mut self) -> Result<(), Error> {
        match self.untold {
            Untold::Nothing => Ok(()),
            Untold::Course | Untold::Position => {
                let known = *self.hardware.known();
                if self.untold == Untold::Position {
                    self.place(known.position, true)?;
                }
                let ended = self.orders.ended;
                let told = self.resume(known);
                // That is no new goal.
                self.orders.ended = ended;
                self.untold = if told.is_ok() { Untold::Nothing } else { self.untold };
                told
            }
            Untold::Stop => self.hard_stop(),
        }
    }

    fn turn(&mut self, now: Micros, reading: Option<u8>, on_line: bool) -> Result<(), Error> {
        let before = self.last_position();
        if self.is_lost() {
            self.recover()?;
        } else {
            self.catch_up()?;
        }
        let (hardware, controller) = self.reach();
        let Followed { rests, left } = hardware.follow(controller, reading)?;
        if !rests {
            self.later = left;
        } else if let Some(reading) = left {
            hardware.refresh(controller, reading)?;
        }
        self.rests = rests;
        self.guard()?;
        self.watch()?;
        if let Some(search) = self.search {
            self.poll_search(now, search)?;
        }
        let known = *self.hardware.known();
        let ahead = self.orders.ended.unwrap_or(known.ahead());
        // The speed, and one of the switches, may have been read many milliseconds ago.
        let brisk = if known.speed == 0 { self.brisk } else { known.speed.abs() > self.correction(BRISK) };
        self.brisk = (on_line || self.rotates()) && brisk;
        let stays = self.brisk && self.held == 0 && ahead != 0 && known.position == before;
        let held = (known.speed == 0 || stays)
            && ahead != 0
            && self.on_course(|hardware, controller, course| hardware.is_held(controller, course, ahead, stays))?;
        self.held = if held { self.held.saturating_add(1) } else { 0 };
        self.events.at_switch = self.is_at_switch();
        let reached = self.at_target();
        self.events.at_target |= reached && !core::mem::replace(&mut self.orders.was_at_target, reached);
        if self.orders.travelling {
            let cut_short = self.held >= if on_line { SETTLED_ON_LINE } else { SETTLED } && !reached;
            self.events.reached |= reached;
            self.events.cut_short |= cut_short;
            self.orders.travelling = !(reached || cut_short);
        }
        self.refresh_excitation(now, self.motion_state())
    }

    /// Gives the motor the current that belongs to this state of motion; a driver that has it already is not written
    /// to.
    pub(super) fn refresh_excitation(&mut self, now: Micros, state: MotionState) -> Result<(), Error> {
        let excitation = self.select_excitation(now, state);
        if self.excitation != Some(excitation) || self.hardware.waits_to_be_driven() {
            self.excitation = Some(excitation);
            self.write_driver().inspect_err(|_| self.excitation = None)?;
        }
        Ok(())
    }

    /// Writes the driver's parameters and the present excitation to the driver.
    pub(super) fn write_driver(&mut self) -> Result<(), Error> {
        let Some(excitation) = self.excitation else { return Ok(()) };
        self.on_course(|hardware, controller, course| hardware.drive(controller, course.values, excitation))
    }

    /// Reads the actual position in microsteps from the hardware.
    ///
    /// # Errors
    /// [`Error::Chip`] when the chip did not answer.
    pub fn actual_position(&mut self) -> Result<i32, Error> {
        let (hardware, controller) = self.reach();
        hardware.position(controller)
    }

    /// Reads the speed to which the motor is accelerating or braking: the commanded one, also while the motor brakes at a stop
    /// switch, or the ramp generator's own.
    pub(super) fn target_speed(&mut self) -> Result<i32, Error> {
        if let Some(told) = self.orders.ended.filter(|_| self.last_speed() != 0) {
            return Ok(told);
        }
        let (hardware, controller) = self.reach();
        hardware.target_speed(controller)
    }

    /// Reads the actual speed from the hardware, right if positive.
    pub(super) fn actual_speed(&mut self) -> Result<i32, Error> {
        let (hardware, controller) = self.reach();
        hardware.speed(controller)
    }

    /// Reads the stop switches from the hardware; the home switch is that of this poll.
    pub(super) fn switches(&mut self) -> Result<Switches, Error> {
        let (hardware, controller) = self.reach();
        let stops = hardware.switches(controller)?;
        Ok(self.with_home(stops))
    }

    /// The stop switches in this turn; the home switch is that of this poll.
    pub(super) fn turn_switches(&mut self) -> Result<Switches, Error> {
        let (hardware, controller) = self.reach();
        let stops = hardware.turn_switches(controller)?;
        Ok(self.with_home(stops))
    }

    fn with_home(&self, [left, right]: [bool; 2]) -> Switches {
        Switches { left, right: self.watched_right().unwrap_or(right), home: self.sensors.home }
    }
}
