//! The ramp generator: position, velocity and how they change.
//!
//! A velocity v has eight more bits behind its unit, microsteps per 2^24 clocks, and a position 32 bits behind the
//! microstep. Every 512 clocks v moves by an acceleration, and at each clock the position moves by v: so follow both
//! formulas of 12.1, v f/2^24 and a f^2/2^41.

mod settings;

use super::registers::Registers;
use settings::{RampMode, Settings};

/// Clocks from one change of the velocity to the next.
pub(super) const TICK: u64 = 512;
/// "Never" as a clock.
pub(super) const NEVER: u64 = u64::MAX;
/// A microstep in the unit of positions.
const MICROSTEP: u64 = 1 << 32;
/// Where within a microstep a motor at rest stands: half of one from the next step in either direction.
const CENTRE: u64 = MICROSTEP / 2;
/// Bits of a velocity behind its unit.
const FRACTION_BITS: u32 = 8;

/// Causes that keep the motor from moving, in one direction or both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Stops {
    /// The left switch stops motion to lower positions.
    pub(super) left: bool,
    /// The right switch stops motion to higher positions.
    pub(super) right: bool,
    /// Switches brake the motor instead of stopping it at once.
    pub(super) soft: bool,
    /// A stall stops motion in both directions.
    pub(super) stall: bool,
}

impl Stops {
    fn hold(self, direction: i32) -> bool {
        self.stall || self.left && direction < 0 || self.right && direction > 0
    }
}

/// The ramp generator. Its motion is evaluated only when necessary: `phase` is that of the clock `synced`, and until
/// the clock `next` it follows from the velocity.
#[derive(Debug)]
pub(super) struct Ramp {
    settings: Settings,
    position: i32,
    /// With sign; 2^-8 of the unit of VACTUAL.
    velocity: i32,
    /// How far the motor has come on its way to the next step, below [`MICROSTEP`].
    phase: u64,
    synced: u64,
    next: u64,
    /// The clock at which TZEROWAIT ends.
    wait_end: u64,
    stops: Stops,
    /// The motor brakes in order to stop at the target. "Rewrite XTARGET afterwards in order to trigger a second
    /// acceleration phase" (6.3.1).
    braking: bool,
    /// The motor came to rest where it has to turn back, in this direction.
    turning_back: i32,
    second_move: bool,
    reached: bool,
    /// Number of steps that can be made before anything but position and phase changes.
    free_steps: u32,
    /// The speed for which `period`, the clocks of a step rounded up, was calculated: remembering it saves a division.
    period_speed: u32,
    period: u64,
}

impl Ramp {
    /// At rest at position 0, which is the target as well: event_pos_reached is active upon reset (16.2). `clock` is
    /// the present one.
    pub(super) fn new(registers: &Registers, clock: u64) -> Self {
        Self {
            settings: Settings::of(registers),
            position: 0,
            velocity: 0,
            phase: CENTRE,
            synced: clock,
            next: NEVER,
            wait_end: 0,
            stops: Stops::default(),
            braking: false,
            turning_back: 0,
            second_move: false,
            reached: true,
            free_steps: 0,
            period_speed: 0,
            period: 0,
        }
    }

    /// The next clock that must not be skipped.
    #[inline]
    pub(super) fn next(&self) -> u64 {
        self.next
    }

    /// XACTUAL.
    pub(super) fn position(&self) -> i32 {
        self.position
    }

    /// VACTUAL. The fraction is cut towards zero.
    pub(super) fn velocity(&self) -> i32 {
        let whole = (self.velocity.unsigned_abs() >> FRACTION_BITS).cast_signed();
        if self.velocity < 0 { -whole } else { whole }
    }

    /// Whether the motor stands, also within a microstep.
    pub(super) fn stands(&self) -> bool {
        self.velocity == 0
    }

    /// The flag position_reached.
    pub(super) fn at_target(&self) -> bool {
        self.position == self.settings.target
    }

    /// The flag velocity_reached: VACTUAL and VMAX match.
    pub(super) fn at_speed(&self) -> bool {
        let speed = self.velocity.unsigned_abs();
        let wrong = match self.settings.mode {
            RampMode::Up => self.velocity < 0,
            RampMode::Down => self.velocity > 0,
            RampMode::Position | RampMode::Hold => false,
        };
        speed == self.settings.vmax && !wrong
    }

    /// The flag t_zerowait_active.
    pub(super) fn waits(&self, clock: u64) -> bool {
        clock < self.wait_end
    }

    /// The flag event_pos_reached.
    pub(super) fn reached(&self) -> bool {
        self.reached
    }

    /// The flag second_move.
    pub(super) fn second_move(&self) -> bool {
        self.second_move
    }

    /// Clears these two flags.
    pub(super) fn clear(&mut self, reached: bool, second_move: bool) {
        self.reached &= !reached;
        self.second_move &= !second_move;
    }

    /// The direction in which the motor moves, or is to move: 1, -1, or 0 for none.
    pub(super) fn demand(&self) -> i32 {
        match self.settings.mode {
            RampMode::Position => self.way().signum(),
            RampMode::Up => 1,
            RampMode::Down => -1,
            RampMode::Hold => self.velocity.signum(),
        }
    }

    /// The direction of motion: 1, -1, or 0 for none.
    pub(super) fn direction(&self) -> i32 {
        self.velocity.signum()
    }

    /// Takes over registers that have changed at `clock`. `aimed` is true after a write that sets the motor a goal:
    /// then it may accelerate again.
    pub(super) fn set(&mut self, registers: &Registers, aimed: bool, clock: u64) {
        self.sync(clock);
        let before = self.at_target();
        self.settings = Settings::of(registers);
        self.braking &= !aimed;
        self.note_target(before);
        self.schedule();
    }

    /// Writes XACTUAL at `clock`.
    pub(super) fn set_position(&mut self, position: i32, clock: u64) {
        self.sync(clock);
        let before = self.at_target();
        self.position = position;
        self.phase = CENTRE;
        self.braking = false;
        self.note_target(before);
        self.schedule();
    }

    /// Sets what keeps the motor from moving, from `clock` on. A motor that moves that way stops at once, unless it is
    /// a switch that brakes it softly.
    pub(super) fn set_stops(&mut self, stops: Stops, clock: u64) {
        if stops == self.stops {
            return;
        }
        self.sync(clock);
        self.stops = stops;
        if self.velocity != 0 && stops.hold(self.velocity.signum()) && (stops.stall || !stops.soft) {
            self.rest();
        }
        self.schedule();
    }

    /// Does what is due at the clock [`next`](Self::next). Returns the direction of a step if one was made: true when
    /// XACTUAL counted up.
    #[inline]
    pub(super) fn act(&mut self) -> Option<bool> {
        let clock = self.next;
        if self.free_steps > 0 {
            self.free_steps -= 1;
            let speed = self.velocity.unsigned_abs();
            self.phase = self.phase + (clock - self.synced) * u64::from(speed) - MICROSTEP;
            self.synced = clock;
            self.next = clock + self.clocks_after_a_step(speed);
            let up = self.velocity > 0;
            self.position = self.position.wrapping_add(if up { 1 } else { -1 });
            return Some(up);
        }
        self.change(clock)
    }

    /// The number of steps due by the clock `last`, as far as they have no other effect here than to be counted; fewer
    /// for a clock far ahead.
    #[inline]
    pub(super) fn free_steps(&self, last: u64) -> u32 {
        if self.free_steps < 2 {
            return 0;
        }
        let clocks = (last - self.synced).min(1 << 20);
        let due = (self.phase + clocks * u64::from(self.velocity.unsigned_abs())) / MICROSTEP;
        due.min(self.free_steps.into()) as u32
    }

    /// The number of steps that have no other effect here than to be counted; `None` for none.
    pub(super) fn quiet(&self) -> Option<u64> {
        (self.free_steps > 0).then_some(self.free_steps.into())
    }

    /// The clock of a step, counted from 1, if all up to it are made at the present speed.
    pub(super) fn clock_of_step(&self, step: u64) -> u64 {
        let way = (u128::from(step) * u128::from(MICROSTEP)).saturating_sub(self.phase.into());
        let clocks = way.div_ceil(u128::from(self.velocity.unsigned_abs().max(1)));
        self.synced + u64::try_from(clocks).unwrap_or(u64::MAX / 2)
    }

    /// Makes that many of these steps at once. Returns the clock of the last one.
    pub(super) fn skip(&mut self, steps: u32) -> u64 {
        let speed = self.velocity.unsigned_abs();
        let way = u64::from(steps) * MICROSTEP;
        let clocks = (way - self.phase).div_ceil(speed.into());
        self.phase = self.phase + clocks * u64::from(speed) - way;
        self.synced += clocks;
        self.next = self.synced + self.clocks_after_a_step(speed);
        self.free_steps -= steps;
        self.position = if self.velocity > 0 {
            self.position.wrapping_add_unsigned(steps)
        } else {
            self.position.wrapping_sub_unsigned(steps)
        };
        self.synced
    }

    /// As [`act`](Self::act), where more than a step may be due.
    fn change(&mut self, clock: u64) -> Option<bool> {
        self.sync(clock);
        let step = self.phase >= MICROSTEP;
        let up = self.velocity > 0;
        if step {
            self.phase -= MICROSTEP;
            self.position = self.position.wrapping_add(if up { 1 } else { -1 });
            self.note_target(false);
            let (speed, settings) = (self.velocity.unsigned_abs(), &self.settings);
            // What a single change of the velocity could do is done at once.
            if self.at_target() && settings.mode == RampMode::Position && speed <= settings.arrival(speed) {
                self.rest();
            }
        }
        if clock.is_multiple_of(TICK) {
            let velocity = self.next_velocity(clock);
            if velocity == 0 && self.velocity != 0 {
                self.rest();
            }
            self.velocity = velocity;
        }
        self.schedule();
        step.then_some(up)
    }

    /// Brings the phase to `clock`; no step is due before.
    fn sync(&mut self, clock: u64) {
        self.phase += (clock - self.synced) * u64::from(self.velocity.unsigned_abs());
        self.synced = clock;
    }

    /// The way to the target, of at most 2^31 - 1 microsteps; the position is allowed to wrap around (6.3.1).
    fn way(&self) -> i32 {
        self.settings.target.wrapping_sub(self.position)
    }

    fn note_target(&mut self, before: bool) {
        self.reached |= self.at_target() && !before;
    }

    /// The motor has come to rest, or is stopped. Until TZEROWAIT is over it does not start again.
    fn rest(&mut self) {
        let direction = self.velocity.signum();
        let back = if self.settings.mode == RampMode::Position { self.way().signum() } else { 0 };
        self.turning_back = if back == -direction { back } else { 0 };
        self.velocity = 0;
        self.phase = CENTRE;
        self.braking = false;
        self.wait_end = self.synced + self.settings.zero_wait;
    }

    /// The velocity after the change at `clock`.
    fn next_velocity(&mut self, clock: u64) -> i32 {
        let direction = self.velocity.signum();
        if direction == 0 {
            let demand = self.demand();
            let speed = if clock < self.wait_end { 0 } else { self.first_speed(demand) };
            if speed != 0 {
                self.second_move |= self.turning_back == demand;
                self.turning_back = 0;
            }
            return speed.cast_signed() * demand;
        }
        let (speed, settings) = (self.velocity.unsigned_abs(), &self.settings);
        let speed = if self.stops.hold(direction) {
            settings.brake(speed)
        } else {
            match settings.mode {
                RampMode::Hold => speed,
                RampMode::Up | RampMode::Down if self.demand() != direction => speed.saturating_sub(settings.amax),
                RampMode::Up | RampMode::Down => settings.approach(speed, settings.amax),
                RampMode::Position if self.way().signum() != direction => settings.brake(speed),
                RampMode::Position => self.toward_target(speed),
            }
        };
        speed.cast_signed() * direction
    }

    /// The speed after the first change from rest, 0 if the motor is not to move.
    fn first_speed(&self, demand: i32) -> u32 {
        let settings = &self.settings;
        if demand == 0 || self.stops.hold(demand) {
            return 0;
        }
        match settings.mode {
            RampMode::Hold => 0,
            RampMode::Up | RampMode::Down => settings.approach(0, settings.amax),
            RampMode::Position => {
                let start = settings.vstart.min(settings.vmax);
                let wanted = settings.approach(start, settings.acceleration(start));
                wanted.min(settings.speed_at(self.remaining(), wanted)).max(start)
            }
        }
    }

    /// The speed after the next change on the way to the target.
    fn toward_target(&mut self, speed: u32) -> u32 {
        let settings = &self.settings;
        let mut wanted = settings.approach(speed, settings.acceleration(speed));
        if self.braking {
            wanted = wanted.min(speed);
        }
        let allowed = settings.speed_at(self.remaining(), wanted.max(speed));
        if allowed >= wanted {
            return wanted;
        }
        self.braking |= allowed < speed;
        allowed.max(settings.slowest(speed)).min(wanted)
    }

    /// The distance to the step into the target.
    fn remaining(&self) -> u64 {
        (u64::from(self.way().unsigned_abs()) << 32).saturating_sub(self.phase)
    }

    /// Finds the next clock at which anything can happen but the quiet progress that `sync` covers.
    fn schedule(&mut self) {
        self.free_steps = 0;
        self.next = NEVER;
        let tick = (self.synced / TICK + 1) * TICK;
        if self.velocity == 0 {
            if self.synced < self.wait_end {
                self.next = self.wait_end;
            } else if self.first_speed(self.demand()) != 0 {
                self.next = tick;
            }
            return;
        }
        let speed = self.velocity.unsigned_abs();
        if speed != self.period_speed {
            self.period_speed = speed;
            self.period = MICROSTEP.div_ceil(speed.into());
        }
        let step = if self.phase < u64::from(speed) {
            self.clocks_after_a_step(speed)
        } else {
            (MICROSTEP - self.phase).div_ceil(speed.into())
        };
        self.next = self.synced + step;
        match self.quiet_steps(speed) {
            Some(steps) => self.free_steps = steps,
            None => self.next = self.next.min(tick),
        }
    }

    /// The clocks to the next step with a phase that is below the speed, as after a step.
    #[inline]
    fn clocks_after_a_step(&self, speed: u32) -> u64 {
        let enough = (self.period - 1) * u64::from(speed) + self.phase >= MICROSTEP;
        self.period - u64::from(enough)
    }

    /// `None` if the velocity may change at the next tick; else the number of steps that may follow before it may, or
    /// before the target's position.
    fn quiet_steps(&self, speed: u32) -> Option<u32> {
        let (direction, settings) = (self.velocity.signum(), &self.settings);
        if self.stops.hold(direction) {
            return None;
        }
        let ahead = if direction > 0 { self.way() } else { self.way().wrapping_neg() }.cast_unsigned();
        let to_target = ahead.saturating_sub(1);
        match settings.mode {
            RampMode::Hold => Some(to_target),
            RampMode::Up | RampMode::Down => {
                (self.demand() == direction && speed == settings.vmax).then_some(to_target)
            }
            RampMode::Position => {
                let cruises = self.way().signum() == direction && speed == settings.vmax && !self.braking;
                let free = ahead.saturating_sub(settings.braking_steps());
                (cruises && free > 0).then_some(free)
            }
        }
    }
}
