//! The chip and what is connected to it: how steps turn the field, and what comes back from switches, encoder and load.

use super::Tmc5160;
use super::driver::State;
use super::encoder::NullEvent;
use super::ramp::Stops;
use super::registers::address::*;
use super::switches::{Motion, Pair, mode};
use crate::chip::{Mechanics, Sensed, Tracks};
use crate::clock::Nanos;

impl Tmc5160 {
    /// Brings the chip to time `to`. Steps turn the field of `mechanics`, which returns the inputs after each.
    pub fn advance(&mut self, to: Nanos, mechanics: &mut impl Mechanics) {
        if self.rest(to) {
            return;
        }
        let last = self.clock.tick_at(to);
        while self.ramp.next() <= last {
            self.skip_steps(last, mechanics);
            let clock = self.ramp.next();
            match self.ramp.act() {
                Some(up) => self.step(clock, up, mechanics),
                None if self.ramp.stands() => self.heed_stops(clock),
                None => {}
            }
        }
        self.now = to;
        if self.driver.stands_still(self.state(last)) {
            self.driver.set_reduced(true);
            mechanics.energise(self.torque_current());
        }
        self.reschedule();
    }

    /// Tells the chip what is at its inputs after a change without a step, at the time to which it was advanced. The
    /// encoder passes through all of its positions on the way, where it has the levels that `tracks` gives.
    #[inline]
    pub fn sense(&mut self, sensed: Sensed, tracks: impl Fn(i64) -> Tracks) {
        if self.differs(sensed) {
            let clock = self.present();
            self.take_inputs(sensed, clock, tracks);
            self.reschedule();
        }
    }

    /// Makes the steps at once that are due by `last` and have no effect on anything but positions. The last step
    /// before an effect is left, and the last one that is due.
    #[inline]
    fn skip_steps(&mut self, last: u64, mechanics: &impl Mechanics) {
        let due = self.ramp.free_steps(last);
        if due < 2 {
            return;
        }
        let up = self.ramp.direction() > 0;
        let way = mechanics.free_way(self.driver.turns_up(up));
        let steps = due.min(self.driver.steps_to_full_step(up));
        let steps = i64::from(steps).min(self.driver.steps_on(way)) as u32;
        if steps > 1 {
            let clock = self.ramp.skip(steps - 1);
            self.driver.skip(steps - 1, up, clock);
        }
    }

    /// Makes everything follow a position counter that has moved.
    #[inline]
    fn step(&mut self, clock: u64, up: bool, mechanics: &mut impl Mechanics) {
        let full_step = self.driver.step(clock, up);
        if self.driver.set_reduced(false) {
            mechanics.energise(self.torque_at(clock));
        }
        let at = self.clock.time_of(clock);
        let sensed = mechanics.turn(at, self.driver.field());
        if self.differs(sensed) {
            self.take_inputs(sensed, clock, |count| mechanics.tracks(count));
        }
        self.encoder.compare(self.ramp.position(), &self.registers);
        if full_step {
            self.take_reading(clock, at, mechanics);
        }
        if self.ramp.stands() {
            self.heed_stops(clock);
        }
    }

    /// The motor has passed a full step: the load is measured, and a stall may stop it.
    fn take_reading(&mut self, clock: u64, at: Nanos, mechanics: &mut impl Mechanics) {
        let speed = self.ramp.velocity().unsigned_abs();
        let state = State { registers: &self.registers, clock, speed, driven: self.supplied && self.bridges.on() };
        let stalled = self.driver.take_reading(state, at, mechanics.load());
        mechanics.energise(self.torque_at(clock));
        if stalled && self.registers.bit(SW_MODE, mode::SG_STOP) {
            self.stalled = true;
            self.heed_stops(clock);
        }
    }

    /// Whether this is not what the inputs were.
    #[inline]
    fn differs(&self, sensed: Sensed) -> bool {
        let Pair { left, right } = self.switches.levels();
        sensed.left != left || sensed.right != right || sensed.count != self.encoder.count()
    }

    /// Brings switches and encoder to the levels at their pins.
    fn take_inputs(&mut self, sensed: Sensed, clock: u64, tracks: impl Fn(i64) -> Tracks) {
        if !self.supplied {
            self.encoder.plug(sensed.count, tracks(sensed.count));
        }
        while self.encoder.count() != sensed.count {
            let up = self.encoder.count() < sensed.count;
            let levels = tracks(self.encoder.count() + if up { 1 } else { -1 });
            let event = self.encoder.edge(up, levels, &mut self.registers);
            self.heed_null(event);
            self.encoder.compare(self.ramp.position(), &self.registers);
        }
        if self.switches.set(Pair { left: sensed.left, right: sensed.right }, &self.registers) {
            self.xlatch = self.ramp.position();
            if self.registers.bit(SW_MODE, mode::LATCH_ENCODER) {
                self.encoder.take_latch();
            }
        }
        self.heed_stops(clock);
    }

    pub(super) fn heed_null(&mut self, event: Option<NullEvent>) {
        if event.is_some_and(|event| event.latch_position) {
            self.xlatch = self.ramp.position();
        }
    }

    /// Lets switches and stalls stop the motor, or lets it go again.
    pub(super) fn heed_stops(&mut self, clock: u64) {
        let Pair { left, right } = self.switches.stops(&self.registers);
        self.follow_switches();
        let stall = self.stalled && self.registers.bit(SW_MODE, mode::SG_STOP);
        self.ramp.set_stops(Stops { left, right, soft: self.registers.bit(SW_MODE, mode::SOFT), stall }, clock);
        self.follow_switches();
    }

    fn follow_switches(&mut self) {
        let held = self.registers.get(RAMPMODE) == 3;
        let motion = Motion { demand: self.ramp.demand(), direction: self.ramp.direction(), held };
        self.switches.follow(motion, &self.registers);
    }
}
