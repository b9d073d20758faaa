//! For how long the polls of an axis do nothing but to take the same readings again. Whoever simulates a module may
//! leave such polls out.

use super::axis::{Axis, Events};
use super::foreseeable::Foreseeable;
use super::hardware::Readings;
use super::orders::Untold;
use super::stall::Measured;
use crate::param::AxisParameter as P;
use crate::units::Micros;

/// The prospects of an axis, as long as its inputs and the answers of its chips stay as they are. Only the position and
/// the load of a motor that turns on at its speed may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Calm {
    /// Polls before this time change nothing but what they have read.
    pub until: Micros,
    /// The number of microsteps that the motor may still make until a poll may act upon its position. It counts on the
    /// motor's way, from where the motor was read last; it is 0 for a motor that rests.
    pub room: u32,
}

impl<H: Foreseeable> Axis<H> {
    /// The prospects of the axis after its last poll, which was that of the turn at `turn`; `None` if the next poll may
    /// do more than to take readings.
    pub fn calm(&self, controller: &H::Controller, turn: Micros) -> Option<Calm> {
        let idle = self.search.is_none()
            && self.untold == Untold::Nothing
            && !self.hold.holds()
            && self.watched_right().is_none();
        let mut current = self.orders.current;
        let excitation = current.select(turn, self.motion_state(), self.last_speed(), &self.values);
        let told = !self.has_reading() && self.events == Events::default() && self.driving.is(excitation);
        let Readings { shut_downs, waits, deviates, is_lost, .. } = self.hardware.readings(controller);
        let settled = (self.orders.was_at_target || !self.at_target()) && !waits;
        let well = !is_lost && !deviates && shut_downs & !self.orders.alarms == 0;
        if !(idle && told && settled && well) {
            return None;
        }
        let room = self.hardware.room(controller)?;
        let unguarded = matches!(self.measured, Measured::Whole { .. })
            && self.values.get(P::StopOnStall) == 0
            && !self.encoders.are_supervised(&self.values);
        let rests = room == 0 && !self.orders.travelling && self.orders.current.stands();
        let until = self.orders.current.calm_until(turn, &self.values);
        (rests || room > 0 && unguarded).then_some(Calm { until, room })
    }
}
