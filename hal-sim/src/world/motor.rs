//! The motor: a rotor that follows the field of the coils, without dynamics, as long as the torque lasts.
//!
//! Torques are in fractions of the torque at full current ([`FULL_TORQUE`]). The current makes a torque available, of
//! which a fast motor has only what the supply lets through. Load, friction, a drag that grows with the speed and,
//! while the speed changes, inertia demand one. While more torque is available than demanded, the rotor is where the
//! field is (the load angle is reported, but not subtracted from the position). Otherwise, or when the rotor meets a
//! hard end, the rotor stays where it is and the field runs away. The rotor falls in again once the torque suffices and
//! the field moves no faster than the pull-in speed, or stands. It does so at the nearest position that looks the same
//! to the rotor, a multiple of four full steps away. With the bridges off friction holds the rotor.

mod acceleration;
mod speed;
mod torque;

use crate::chip::load::{FULL_LOAD, LoadRatio};
use crate::clock::{Nanos, SECOND};
use acceleration::Acceleration;
use speed::Speed;
pub use torque::Winding;

/// Number of units of position in a full step.
pub const FULL_STEP: i64 = 256;
/// Number of units of position in an electrical period, of four full steps. Positions that far apart look the same to
/// the rotor.
pub const PERIOD: i64 = 4 * FULL_STEP;
/// The torque at full current, which is also the load that stalls the motor there.
pub const FULL_TORQUE: u32 = 65_536;

/// The properties of a motor. The default has neither friction nor inertia, all of its torque at any speed, and never
/// loses a step by itself.
#[derive(Clone, Debug)]
pub struct MotorConfig {
    /// Torque that friction demands at any speed, in 1/65536 of the torque at full current.
    pub friction: u32,
    /// Torque that an acceleration of 1000 full steps/s^2 demands, in 1/65536 of the torque at full current.
    pub inertia: u32,
    /// The winding of the motor; `None` for a motor that has all of its torque at any speed, and no drag.
    pub winding: Option<Winding>,
    /// Torque that a speed of 1000 full steps/s demands, and twice as much at twice the speed, in 1/65536 of the torque
    /// at full current.
    pub drag: u32,
    /// Speed in full steps per second up to which a rotor that lost the field can fall in again; at least 1.
    pub pull_in: u32,
    /// The lowest position that the rotor can reach, a mechanical hard end, in 1/256 full steps.
    pub lowest: i64,
    /// The highest position that the rotor can reach.
    pub highest: i64,
}

impl Default for MotorConfig {
    fn default() -> Self {
        Self { friction: 0, inertia: 0, winding: None, drag: 0, pull_in: 200, lowest: i64::MIN, highest: i64::MAX }
    }
}

/// The motor. Positions are in 1/256 full steps.
#[derive(Clone, Debug)]
pub struct Motor {
    config: MotorConfig,
    rotor: i64,
    field: i64,
    /// Rotor minus field while the rotor follows: a multiple of [`PERIOD`].
    offset: i64,
    /// The value that the offset has as long as no step is lost.
    origin: i64,
    /// The rotor follows the field.
    following: bool,
    /// The rotor does not follow, and the field has not stood long enough since its last step for the rotor to fall in.
    unsettled: bool,
    /// The current, in 1/32 of the full one.
    current: u32,
    /// The supply voltage, in 0.1 V.
    supply: u16,
    available: u32,
    load: u32,
    demand: u32,
    /// The time of the last step; `None` if the field has not moved since the driver was reset.
    last_step: Option<Nanos>,
    speed: Speed,
    acceleration: Acceleration,
}

impl Motor {
    /// A motor with its rotor at `start`, bridges off, and a field at 0.
    pub fn new(config: MotorConfig, start: i64) -> Self {
        let rotor = start.clamp(config.lowest, config.highest);
        let mut motor = Self {
            config,
            rotor,
            field: 0,
            offset: 0,
            origin: 0,
            following: false,
            unsettled: true,
            current: 0,
            supply: 0,
            available: 0,
            load: 0,
            demand: 0,
            last_step: None,
            speed: Speed::resting(0),
            acceleration: Acceleration::default(),
        };
        motor.restart(0);
        motor.weigh();
        motor
    }

    /// The absolute position of the rotor, in 1/256 full steps.
    #[inline]
    pub fn rotor(&self) -> i64 {
        self.rotor
    }

    /// The absolute position that the rotor would have if it had followed every step, in 1/256 full steps.
    #[inline]
    pub fn field(&self) -> i64 {
        self.field + self.origin
    }

    /// How many full steps the rotor is behind the field since the driver was powered; negative if it is ahead. Before
    /// the bridges are switched on for the first time the rotor can be up to two full steps off the field.
    pub fn lost_steps(&self) -> i64 {
        (self.field() - self.rotor) / FULL_STEP
    }

    /// Whether the rotor is held or carried along by the field.
    pub fn is_following(&self) -> bool {
        self.following && self.has_torque()
    }

    /// The torque that current, supply and speed make available, in 1/65536 of the torque at full current.
    pub fn available(&self) -> u32 {
        self.available
    }

    /// The torque that load, friction, drag and inertia demand, in 1/65536 of the torque at full current.
    pub fn demand(&self) -> u32 {
        self.demand
    }

    /// The angle by which the load turns the rotor back against the field, in 1/256 full steps: 0..=256. At 256 (90
    /// degrees electrical) the rotor stalls.
    pub fn load_angle(&self) -> i64 {
        let ratio = f64::from(self.load_ratio()) / f64::from(FULL_LOAD);
        (ratio.asin() / core::f64::consts::FRAC_PI_2 * FULL_STEP as f64).round() as i64
    }

    /// The ratio of the demanded to the available torque; [`FULL_LOAD`] for a motor that stalls or does not follow.
    pub fn load_ratio(&self) -> LoadRatio {
        if !self.following || !self.has_torque() {
            return FULL_LOAD;
        }
        (u64::from(self.demand) * u64::from(FULL_LOAD) / u64::from(self.available)) as LoadRatio
    }

    /// Sets the external load in 1/65536 of the torque at full current.
    pub fn set_load(&mut self, load: u32) {
        self.load = load;
        self.weigh();
        self.unsettled = !self.following;
    }

    /// The external load in 1/65536 of the torque at full current.
    pub fn load(&self) -> u32 {
        self.load
    }

    /// The external load as people write it, 0 to 1: rounded to four digits, so that what was set is told.
    pub fn load_told(&self) -> f64 {
        (f64::from(self.load) / f64::from(FULL_TORQUE) * 1e4).round() / 1e4
    }

    /// Sets the current that makes torque, in 1/32 of the full current; 0 is bridges off.
    #[inline]
    pub fn set_current(&mut self, current: u32) {
        if current != self.current {
            self.current = current;
            self.weigh();
            self.unsettled = !self.following;
        }
    }

    /// Sets the supply voltage of the bridges, in 0.1 V.
    pub fn set_supply(&mut self, supply: u16) {
        if supply != self.supply {
            self.supply = supply;
            self.weigh();
            self.unsettled = !self.following;
        }
    }

    /// Moves the motor after a step at `at` has moved the field to `field`, on the driver's scale in 1/256 full steps.
    #[inline]
    pub fn follow(&mut self, at: Nanos, field: i64) {
        if self.unsettled {
            self.settle(at);
        }
        if self.has_come_to_rest(at) {
            self.rest();
        }
        let delta = field - self.field;
        self.field = field;
        let mut is_measured = self.config.winding.is_some() && self.speed.measure(at, field);
        if !self.following {
            self.try_to_fall_in(at, delta);
        } else if self.config.inertia != 0 {
            is_measured |= self.acceleration.measure(at, delta, self.config.inertia);
        }
        if is_measured {
            self.weigh();
        }
        self.last_step = Some(at);
        if self.following {
            let rotor = self.field + self.offset;
            let free = rotor >= self.config.lowest && rotor <= self.config.highest;
            if self.has_torque() && free {
                self.rotor = rotor;
            } else {
                self.lose(rotor);
            }
        }
    }

    /// How far the field may move up or down before anything but the positions of field and rotor changes. The value is
    /// 0 if the motor is to be told of each step, because it has lost the field or its inertia counts.
    #[inline]
    pub(super) fn free_way(&self, up: bool) -> i64 {
        if !self.following || !self.has_torque() || self.config.inertia != 0 {
            return 0;
        }
        let way = if up {
            self.config.highest.saturating_sub(self.rotor)
        } else {
            self.rotor.saturating_sub(self.config.lowest)
        };
        way.max(0)
    }

    /// Moves the motor after the field was set to `field` at `at` other than by a step, for example by coil currents
    /// given over SPI.
    pub fn turn_field(&mut self, at: Nanos, field: i64) {
        if field != self.field {
            self.follow(at, field);
        }
    }

    /// Moves the motor on to `now` after time without steps: a rotor that has lost a standing field may fall in.
    /// Returns whether the rotor moved.
    #[inline]
    pub fn settle(&mut self, now: Nanos) -> bool {
        if self.has_come_to_rest(now) {
            self.rest();
        }
        if self.falls_in_at().is_none_or(|due| due > now) {
            return false;
        }
        let before = self.rotor;
        self.fall_in_at_rest();
        before != self.rotor
    }

    /// The time at which a field that stands until then counts as resting, or a rotor that has lost it falls in; `None`
    /// if neither will be.
    #[inline]
    pub fn next_event(&self) -> Option<Nanos> {
        let rests = self.rests_at();
        self.falls_in_at().map_or(rests, |due| Some(rests.map_or(due, |rests| rests.min(due))))
    }

    /// The time at which a rotor that has lost the field falls in, if the field stands until then; `None` if it will
    /// not fall in by itself.
    #[inline]
    fn falls_in_at(&self) -> Option<Nanos> {
        if !self.unsettled || !self.has_torque() {
            return None;
        }
        let full_step = SECOND / u64::from(self.config.pull_in.max(1));
        Some(self.last_step.map_or(0, |last| last + full_step))
    }

    /// The time at which a field that stands until then counts as resting; `None` if it does already.
    #[inline]
    fn rests_at(&self) -> Option<Nanos> {
        self.speed.rests_at(self.last_step?)
    }

    #[inline]
    fn has_come_to_rest(&self, now: Nanos) -> bool {
        self.rests_at().is_some_and(|rests| rests <= now)
    }

    /// The field has come to rest: it no longer takes anything for its speed.
    #[cold]
    fn rest(&mut self) {
        self.speed.rest();
        self.weigh();
    }

    /// Moves the rotor by `full_steps` against the field, as a blow does. A multiple of four full steps lasts. With the
    /// bridges on the rotor is drawn from any other position to the nearest multiple of four, from two full steps to
    /// the next higher. Hard ends limit the way.
    pub fn slip(&mut self, full_steps: i64) {
        let target = self.rotor.saturating_add(full_steps.saturating_mul(FULL_STEP));
        self.rotor = target.clamp(self.config.lowest, self.config.highest);
        if self.has_torque() && self.following {
            self.fall_in_at_rest();
        } else {
            self.following = false;
            self.unsettled = true;
        }
    }

    /// Notes that the driver was reset and its field now stands at `field`. The count of lost steps begins anew, and
    /// when the bridges are switched on the rotor is drawn to the nearest position that looks like the field's.
    pub fn restart(&mut self, field: i64) {
        self.field = field;
        self.speed = Speed::resting(field);
        self.weigh();
        self.last_step = None;
        self.following = false;
        self.unsettled = true;
        self.origin = self.nearest_offset();
    }

    #[inline]
    fn has_torque(&self) -> bool {
        self.available > self.demand
    }

    /// Works out anew what torque there is, and what torque is demanded.
    fn weigh(&mut self) {
        let made = self.current * (FULL_TORQUE / 32);
        let (most, drag) = self.config.winding.as_ref().map_or((u32::MAX, 0), |winding| {
            let (volts, speed) = (f64::from(self.supply) / 10.0, self.speed.value());
            (winding.torque(volts, speed), (f64::from(self.config.drag) * speed / 1000.0) as u32)
        });
        self.available = made.min(most);
        let demand = [self.load, self.config.friction, drag, self.acceleration.demand()];
        self.demand = demand.into_iter().fold(0, u32::saturating_add);
    }

    fn lose(&mut self, would_be: i64) {
        if would_be < self.config.lowest {
            self.rotor = self.config.lowest;
        } else if would_be > self.config.highest {
            self.rotor = self.config.highest;
        }
        self.following = false;
        self.unsettled = true;
        self.acceleration = Acceleration::default();
        self.rest();
    }

    /// Lets a rotor that does not follow fall in, if the step of `delta` at `at` is slow enough.
    #[cold]
    fn try_to_fall_in(&mut self, at: Nanos, delta: i64) {
        self.unsettled = true;
        let took = self.last_step.map_or(SECOND, |last| at.saturating_sub(last));
        let fastest = u128::from(self.config.pull_in) * FULL_STEP as u128;
        let slow = u128::from(delta.unsigned_abs()) * u128::from(SECOND) <= fastest * u128::from(took);
        if slow && self.has_torque() {
            self.fall_in();
            self.acceleration.begin(at);
        }
    }

    /// The offset that puts the rotor at the nearest position that looks like the field's.
    fn nearest_offset(&self) -> i64 {
        let apart = self.rotor - self.field;
        (apart + PERIOD / 2).div_euclid(PERIOD) * PERIOD
    }

    fn fall_in(&mut self) {
        self.offset = self.nearest_offset();
        self.following = true;
        self.unsettled = false;
    }

    /// Lets the rotor fall in at a standing field, or leaves it pressed against a hard end if the nearest position is
    /// beyond.
    fn fall_in_at_rest(&mut self) {
        self.fall_in();
        let rotor = self.field + self.offset;
        if rotor < self.config.lowest || rotor > self.config.highest {
            self.lose(rotor);
            self.unsettled = false;
        } else {
            self.rotor = rotor;
        }
    }
}

#[cfg(test)]
mod tests;
