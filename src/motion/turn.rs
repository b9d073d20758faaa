//! The poll of an axis in each millisecond: it follows the motor, guards it, advances a reference search, notices what
//! has happened, and chooses the motor's current.
//!
//! Of a motor that moves the poll reads the position alone. The other reading of the millisecond is taken half a
//! millisecond later, so that a poll has one datagram to a chip, and no more. It has two short ones to a chip that
//! answers the first one with the second. Longer, and rare, is a poll that stops the motor, changes its current, or
//! finds it held by a switch. Those of a reference search are longer, too: two readings each. Where a leg begins or the
//! zero point is found, the settings of the ramp generator are added, some ten datagrams in all.

use super::Error;
use super::axis::{Axis, Events};
use super::current::MotionState;
use super::hardware::{Followed, Hardware, Known, RampGenerator, RampMode, Shape, StopSwitches};
use super::joined::Joined;
use super::sensors::Sensors;
use crate::param::AxisParameter as P;
use crate::units::Micros;

/// How much the speed of a motor held to a straight line may differ from its limit while it counts as turning at that
/// speed, besides a 64th of it. The limit wavers, and the speed may have been read some milliseconds ago.
const WAVERING: u32 = 2;

/// Microsteps in 16 ms, the time of [`Axis::correction`], of a motor that makes two in a millisecond: one that is
/// faster is somewhere else in each poll.
const BRISK: i32 = 2 * 16;

impl<H: Hardware> Axis<H> {
    /// The state of motion, by the last readings.
    pub(super) fn motion_state(&self) -> MotionState {
        let held = self.hold.holds();
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
        mode == RampMode::Velocity && target_speed != 0 && self.search.is_none()
    }
}

impl<H: Hardware> Joined<'_, H> {
    /// Polls the axis, which the device does once in each millisecond. `reading` is the number of the reading to be
    /// taken, or `None` if it is another axis' turn; while the motor moves [`refresh`](Self::refresh) takes it, later.
    /// An axis that is `on_line`, on a straight line with others, or rotates, is found held by a stop switch as soon as
    /// its position stays. Returns the events since the poll before.
    pub fn poll(&mut self, now: Micros, sensors: Sensors, reading: Option<u8>, on_line: bool) -> Events {
        self.axis.sensors = sensors;
        self.axis.count();
        // Where a datagram did not get through to a chip, the next poll tries again.
        let _ = self.turn(now, reading, on_line);
        core::mem::take(&mut self.axis.events)
    }

    /// Takes the reading that the last poll has left to be taken, if there is one.
    pub fn refresh(&mut self) {
        if let Some(reading) = self.axis.followed.left.take() {
            // A reading that did not get through comes again in the next rotation.
            let _ = self.chips().refresh(reading);
        }
    }

    /// True while a motor that is to turn at a speed stands before its closed stop switch, or brakes there.
    fn is_at_switch(&mut self) -> bool {
        self.axis.rotates()
            && (self.axis.hold.holds() || self.axis.values.is_on(P::SoftStop) && self.brakes_at_switch())
    }

    /// True while the stop switch to which a motor turns is closed. The switches are read for it: a press that is over
    /// before the ramp is shows in nothing else.
    #[cold]
    #[inline(never)]
    fn brakes_at_switch(&mut self) -> bool {
        let target_speed = self.axis.hardware.known().target_speed;
        let (mut chips, profile) = self.chips_and_profile();
        chips.turn_switches().is_ok() && chips.meets_switch(&profile, target_speed)
    }

    fn turn(&mut self, now: Micros, reading: Option<u8>, on_line: bool) -> Result<(), Error> {
        let before = self.axis.last_position();
        if self.readings().is_lost {
            self.recover()?;
        } else {
            self.catch_up()?;
        }
        self.follow(reading)?;
        self.guard()?;
        self.watch()?;
        if let Some(search) = self.axis.search {
            self.poll_search(now, search)?;
        }
        self.look_for_hold(before, on_line)?;
        self.axis.events.at_switch = self.is_at_switch();
        self.notice_arrival(on_line);
        self.refresh_excitation(now, self.axis.motion_state())
    }

    /// Follows the motor. The reading that is wanted is taken at once from a motor that rests, else it is left.
    fn follow(&mut self, reading: Option<u8>) -> Result<(), Error> {
        let Followed { rests, left } = self.chips().follow(reading)?;
        if !rests {
            self.axis.followed.left = left;
        } else if let Some(reading) = left {
            self.chips().refresh(reading)?;
        }
        self.axis.followed.rests = rests;
        Ok(())
    }

    /// Looks whether a stop switch holds the motor, whose position was `before` in the last poll.
    fn look_for_hold(&mut self, before: i32, on_line: bool) -> Result<(), Error> {
        let known = *self.axis.hardware.known();
        let ahead = self.axis.orders.ended.unwrap_or(known.ahead());
        let matters = on_line || self.axis.rotates();
        let Axis { hold, values, .. } = &mut *self.axis;
        let stays = hold.stays(&known, before, ahead, matters, || H::Shape::correction(values, BRISK));
        let held = (known.speed == 0 || stays) && ahead != 0 && {
            let (mut chips, profile) = self.chips_and_profile();
            chips.is_held(&profile, ahead, stays)?
        };
        self.axis.hold.count(held);
        Ok(())
    }

    /// Notices that the motor has reached its target, or that a stop switch has ended its move.
    fn notice_arrival(&mut self, on_line: bool) {
        let reached = self.axis.at_target();
        self.axis.events.at_target |= reached && !core::mem::replace(&mut self.axis.orders.was_at_target, reached);
        if self.axis.orders.travelling {
            let cut_short = self.axis.hold.has_settled(on_line) && !reached;
            self.axis.events.reached |= reached;
            self.axis.events.cut_short |= cut_short;
            self.axis.orders.travelling = !(reached || cut_short);
        }
    }
}
