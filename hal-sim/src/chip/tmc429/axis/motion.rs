//! The ramp generator, pulse generator and switch logic of an axis.

use super::super::ramp::{self, FRACTION_BITS};
use super::super::registers::{axis as reg, interrupt, ref_conf};
use super::{Axis, NEVER, PHASE_PERIOD, RampMode, wrap};

impl Axis {
    /// Notes that the switch inputs, or the way in which they are read, have changed after tick `tick`.
    pub(in crate::chip::tmc429) fn inputs_changed(&mut self, tick: u64) {
        self.sample_at = self.sample_at.min(tick + 1);
        self.next = self.next.min(self.sample_at);
    }

    /// Executes tick `tick`, which must be [`Axis::next`]. `right` and `left` are the active switches.
    /// Returns the direction of a step if one was made: true when X_ACTUAL counted up.
    pub(in crate::chip::tmc429) fn tick(&mut self, tick: u64, right: bool, left: bool) -> Option<bool> {
        if self.free_steps > 0 && self.sample_at == NEVER {
            return Some(self.free_step(tick));
        }
        self.sync(tick - 1);
        let sampled = self.sample_at <= tick;
        if sampled {
            self.sample(right, left);
        }
        let step = self.pulse(tick);
        self.synced = tick;
        if sampled || step.is_some() {
            self.set_goal();
        }
        if tick.trailing_zeros() >= self.ramp_div {
            let difference = self.goal - self.velocity;
            self.velocity += self.limit(difference);
        }
        self.settle();
        step
    }

    /// The number of steps, from the present one on, that have no other effect in the axis than to be counted; 0 if
    /// anything else comes first.
    #[inline]
    pub(in crate::chip::tmc429) fn free_steps(&self) -> u32 {
        if self.sample_at == NEVER { self.free_steps } else { 0 }
    }

    /// The number of steps that are due by tick `last`, as far as nothing but steps is due; it may be more than
    /// [`free_steps`](Self::free_steps).
    #[inline]
    pub(in crate::chip::tmc429) fn free_steps_due(&self, last: u64) -> u64 {
        if self.next > last || self.free_steps() == 0 {
            return 0;
        }
        let pulses = (last >> self.pulse_div) - (self.synced >> self.pulse_div);
        (u64::from(self.phase) + pulses * u64::from(self.rate())) / u64::from(PHASE_PERIOD)
    }

    /// The tick of a step, counted from 1, of which all before are free; or of what else comes next.
    pub(in crate::chip::tmc429) fn tick_of_step(&self, step: u64) -> u64 {
        if step <= 1 { self.next } else { ((self.synced >> self.pulse_div) + self.pulses_to(step)) << self.pulse_div }
    }

    /// The pulse ticks up to a step, counted from 1, at the present rate.
    fn pulses_to(&self, step: u64) -> u64 {
        (step * u64::from(PHASE_PERIOD) - u64::from(self.phase)).div_ceil(self.rate().into())
    }

    /// The shortest time between two steps at the present rate, which is not 0, in ticks.
    pub(in crate::chip::tmc429) fn shortest_period(&self) -> u64 {
        u64::from(PHASE_PERIOD / self.rate()) << self.pulse_div
    }

    /// The number of steps that may follow before the one that makes X_ACTUAL `position`, of 24 bits.
    pub(in crate::chip::tmc429) fn steps_before(&self, position: u32) -> u32 {
        let ahead = position.wrapping_sub(self.x_actual.cast_unsigned());
        let way = if self.velocity > 0 { ahead } else { ahead.wrapping_neg() };
        (way & reg::POSITION_MASK).wrapping_sub(1) & reg::POSITION_MASK
    }

    /// Whether the next step counts up.
    pub(in crate::chip::tmc429) fn counts_up(&self) -> bool {
        self.velocity > 0
    }

    /// Makes that many free steps at once. Returns the tick of the last one.
    pub(in crate::chip::tmc429) fn skip(&mut self, steps: u32) -> u64 {
        let pulses = self.pulses_to(steps.into());
        let phase = u64::from(self.phase) + pulses * u64::from(self.rate());
        self.phase = (phase - u64::from(steps) * u64::from(PHASE_PERIOD)) as u32;
        self.synced = ((self.synced >> self.pulse_div) + pulses) << self.pulse_div;
        self.free_steps -= steps;
        self.up = self.velocity > 0;
        self.next = self.next_step();
        self.count(steps);
        self.synced
    }

    /// A change of velocity, limited to what one ramp tick can do.
    pub(super) fn limit(&self, difference: i32) -> i32 {
        let a_max = self.a_max.cast_signed();
        difference.clamp(-a_max, a_max)
    }

    /// Whether the velocity is on the way to its goal.
    pub(in crate::chip::tmc429) fn ramps(&self) -> bool {
        self.goal != self.velocity
    }

    /// Brings `velocity` and `phase` to the end of tick `tick`, all of the ticks up to there being quiet.
    pub(in crate::chip::tmc429) fn sync(&mut self, tick: u64) {
        let pulses = (tick >> self.pulse_div) - (self.synced >> self.pulse_div);
        // No step is due, so the phase stays below 2048.
        self.phase += (pulses * u64::from(self.rate())) as u32;
        if self.goal != self.velocity {
            let ramps = (tick >> self.ramp_div) - (self.synced >> self.ramp_div);
            // The last change before the goal may be a smaller one, but that tick is not a quiet one.
            let change = i64::from(self.limit(self.goal - self.velocity)) * ramps.cast_signed();
            self.velocity += change as i32;
        }
        self.synced = tick;
    }

    /// Looks at the switch inputs: interrupts on edges, position latch, stop.
    fn sample(&mut self, right: bool, left: bool) {
        self.sample_at = NEVER;
        let reference = self.reference();
        if left != self.left {
            self.raise(if left { interrupt::STOP_LEFT_HIGH } else { interrupt::STOP_LEFT_LOW });
        }
        if right != self.right {
            self.raise(if right { interrupt::STOP_RIGHT_HIGH } else { interrupt::STOP_RIGHT_LOW });
        }
        self.left = left;
        self.right = right;
        // "An event at the reference switch takes effect only during motion (when V_ACTUAL is not 0)"
        // (8.1.15). Either edge counts: 9.3 latches both sides of the switch in one direction of motion.
        if self.latch_armed && self.reference() != reference && self.rate() != 0 {
            self.x_latched = self.x_actual;
            self.latch_armed = false;
        }
        if self.drives_into_switch() && !self.soft_stopping {
            self.raise(interrupt::STOP);
            if self.ref_conf & ref_conf::SOFT_STOP != 0 {
                self.soft_stopping = true;
            } else {
                self.velocity = 0;
            }
        }
    }

    /// Does the pulse generator's part of tick `tick`.
    fn pulse(&mut self, tick: u64) -> Option<bool> {
        if self.stray_step {
            self.stray_step = false;
            self.phase = 0;
        } else if tick.trailing_zeros() >= self.pulse_div {
            self.phase += self.rate();
            if self.phase < PHASE_PERIOD {
                return None;
            }
            self.phase -= PHASE_PERIOD;
            self.up = self.velocity > 0;
        } else {
            return None;
        }
        self.count(1);
        Some(self.up)
    }

    /// Executes a tick at which a step is due that has no other effect than to be counted.
    fn free_step(&mut self, tick: u64) -> bool {
        let pulses = (tick >> self.pulse_div) - (self.synced >> self.pulse_div);
        self.phase = self.phase + (pulses * u64::from(self.rate())) as u32 - PHASE_PERIOD;
        self.synced = tick;
        self.free_steps -= 1;
        self.up = self.velocity > 0;
        self.next = self.next_step();
        self.count(1);
        self.up
    }

    /// Counts steps in the direction `up`.
    fn count(&mut self, steps: u32) {
        // 64 microsteps per full step are an increment of 1, a full step is one of 64 (11.5.1).
        let width = (steps << (6 - self.usrs.min(6))) as u8;
        if self.up {
            self.x_actual = wrap(self.x_actual.wrapping_add_unsigned(steps));
            self.microstep = self.microstep.wrapping_add(width);
        } else {
            self.x_actual = wrap(self.x_actual.wrapping_sub_unsigned(steps));
            self.microstep = self.microstep.wrapping_sub(width);
        }
    }

    /// Determines what the ramp generator aims at, and V_TARGET where the chip computes it (8.1.5).
    pub(super) fn set_goal(&mut self) {
        let v_max = self.v_max.cast_signed();
        let mut goal = match self.mode {
            RampMode::Hold => self.velocity,
            RampMode::Velocity => self.v_target.clamp(-v_max, v_max) << FRACTION_BITS,
            RampMode::Ramp | RampMode::Soft => {
                let way = self.way();
                let distance = way.unsigned_abs();
                let allowed = if self.mode == RampMode::Ramp {
                    self.proportion.linear_ramp(distance, self.v_max)
                } else {
                    self.proportion.exponential(distance, self.v_max)
                };
                // V_MIN keeps the velocity up to the target (8.1.3); V_MAX = 0 holds the motor (8.1.4).
                let speed = if way == 0 { 0 } else { allowed.max(self.v_min).min(self.v_max) };
                self.v_target = if way < 0 { -speed.cast_signed() } else { speed.cast_signed() };
                self.v_target << FRACTION_BITS
            }
        };
        // An active stop switch does not let the motor start into it either.
        if self.left && self.is_stop(ref_conf::DISABLE_STOP_L) {
            goal = goal.max(0);
        }
        if self.right && self.is_stop(ref_conf::DISABLE_STOP_R) {
            goal = goal.min(0);
        }
        self.goal = goal;
    }

    /// Updates everything that follows from position, velocity and switches, after a tick or a write.
    pub(super) fn settle(&mut self) {
        if self.velocity != 0 && self.stops_here() {
            self.velocity = 0;
            self.goal = 0;
        }
        if self.drives_into_switch() {
            if !self.soft_stopping {
                self.sample_at = self.sample_at.min(self.synced + 1);
            }
        } else {
            self.soft_stopping = false;
        }
        let mut conditions = 0;
        if self.at_target() {
            conditions |= interrupt::POS_END;
        }
        if self.reference() {
            if self.x_actual.unsigned_abs() > self.tolerance {
                conditions |= interrupt::REF_WRONG;
            }
        } else if self.x_actual == 0 {
            conditions |= interrupt::REF_MISS;
        }
        self.raise(conditions & !self.conditions);
        self.conditions = conditions;
        self.schedule();
    }

    /// True in the positioning modes if the motor is on the target and slow enough to stay there.
    fn stops_here(&self) -> bool {
        self.positioning()
            && self.at_target()
            && self.velocity.unsigned_abs()
                <= ramp::arrival_limit(self.v_min, self.a_max, self.pulse_div, self.ramp_div)
    }

    fn positioning(&self) -> bool {
        matches!(self.mode, RampMode::Ramp | RampMode::Soft)
    }

    /// The way to the target: the 24 bit difference, so |way| < 2^23 is the right direction (8.1.1).
    fn way(&self) -> i32 {
        wrap(self.x_target - self.x_actual)
    }

    /// The switch selected by ref_RnL (8.1.11.2).
    fn reference(&self) -> bool {
        if self.ref_conf & ref_conf::REF_RNL != 0 { self.right } else { self.left }
    }

    /// True if the stop function that the bit `disable` would switch off is on at this position. "To exclude a motion
    /// range" (8.1.14) is read so that a tolerance of 0 excludes nothing, not even the origin.
    fn is_stop(&self, disable: u32) -> bool {
        let excluded = self.tolerance != 0 && self.x_actual.unsigned_abs() <= self.tolerance;
        self.ref_conf & disable == 0 && !excluded
    }

    fn drives_into_switch(&self) -> bool {
        (self.left && self.velocity < 0 && self.is_stop(ref_conf::DISABLE_STOP_L))
            || (self.right && self.velocity > 0 && self.is_stop(ref_conf::DISABLE_STOP_R))
    }

    /// Sets interrupt flags as far as their masks allow (8.1.12).
    fn raise(&mut self, flags: u32) {
        self.interrupt_flags |= flags & self.interrupt_mask;
    }

    /// Finds the next tick at which anything can happen but the quiet progress that `sync` covers.
    fn schedule(&mut self) {
        let mut next = self.sample_at;
        let rate = self.rate();
        self.free_steps = 0;
        if rate != 0 {
            if rate != self.period_rate {
                self.period_rate = rate;
                self.period = PHASE_PERIOD.div_ceil(rate);
            }
            next = next.min(self.next_step());
        }
        if self.goal != self.velocity {
            if self.a_max != 0 {
                // On the target, each tick may be the one slow enough to stay there.
                let ramps = if self.positioning() && self.at_target() {
                    1
                } else {
                    ramp::quiet_ticks(self.velocity, self.goal, self.a_max)
                };
                next = next.min(((self.synced >> self.ramp_div) + ramps) << self.ramp_div);
            }
        } else if rate != 0 && !self.left && !self.right {
            self.free_steps = self.count_free_steps();
        }
        self.next = next;
    }

    /// The tick of the next step at the present rate, which is not 0.
    fn next_step(&self) -> u64 {
        let rate = self.rate();
        // Right after a step the phase is below the rate, and one tick less than the period at most will do.
        let pulses = if self.phase < rate {
            self.period - u32::from((self.period - 1) * rate + self.phase >= PHASE_PERIOD)
        } else {
            (PHASE_PERIOD - self.phase).div_ceil(rate)
        };
        ((self.synced >> self.pulse_div) + u64::from(pulses)) << self.pulse_div
    }

    /// Counts the steps that may follow before a position that has an effect: the target, the origin, or the beginning
    /// of the ramp down. The velocity is at its goal, and both switches are open.
    fn count_free_steps(&self) -> u32 {
        let up = self.velocity > 0;
        let steps_to = |position: i32| {
            let way = if up { position - self.x_actual } else { self.x_actual - position };
            (way.cast_unsigned() & reg::POSITION_MASK).saturating_sub(1)
        };
        let free = steps_to(self.x_target).min(steps_to(0));
        let braking = match self.mode {
            RampMode::Velocity | RampMode::Hold => return free,
            RampMode::Ramp => self.proportion.linear_ramp_length(self.v_max),
            RampMode::Soft => self.proportion.exponential_length(self.v_max),
        };
        let distance = self.way().unsigned_abs();
        braking.map_or(0, |braking| distance.saturating_sub(braking)).min(free)
    }
}
